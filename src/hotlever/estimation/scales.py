"""Errors that all data of an observable have in common: the scales of meters and thermometers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hotlever.measurement import Measurement
from hotlever.probe.priors import SCALES, Prior
from hotlever.spieser2017 import RAMAN_ERROR_SHARE
from hotlever.types import Array

#: Standard error of a meter's scale, relative.
METERS = 1e-3
#: Rise (K) from which a stated error tells the scale of a thermometer.
_WARM_K = 100.0


@dataclass(frozen=True)
class CommonError:
    """An error that all data of an observable have in common, such as that of a meter's scale.

    Attributes
    ----------
    name, observable : str
    share : float
        Its standard deviation, relative to what it is an error of.
    errors : ndarray, shape (rows of the measurement,)
        Its standard deviations.
    """

    name: str
    observable: str
    share: float
    errors: Array


def errors_of_scales(
    measurement: Measurement,
    observables: Sequence[str],
    priors: Mapping[str, Prior],
    base_temperature_K: float,
) -> list[CommonError]:
    """Return the errors of the meters' and the thermometer's scales, as known before.

    That of a thermometer is relative to the rise above the base. Where no prior says how large it
    is, it is as large as what the measurement states of each temperature, or as the paper's.
    """
    found = []
    for name, observable in SCALES.items():
        if observable not in observables:
            continue
        shown = np.abs(measurement.observable(observable))
        share = METERS
        if observable == "tip":
            shown = np.abs(shown - base_temperature_K)
            stated = measurement.tip_error_K / np.maximum(shown, _WARM_K)
            known = np.isfinite(stated).any()
            share = float(np.nanmedian(stated)) if known else RAMAN_ERROR_SHARE
        if name in priors:
            share = priors[name].spread
        found.append(CommonError(name, observable, share, share * shown))
    return found
