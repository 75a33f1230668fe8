"""Errors that all data of an observable have in common: the scales of meters and thermometers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hotlever.measurement import Measurement
from hotlever.probe.priors import SCALES, Moved, Prior
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
    errors = []
    for name, observable in SCALES.items():
        if observable not in observables:
            continue
        shown = np.abs(measurement.observable(observable))
        share = METERS
        if observable == "tip":
            shown = np.abs(shown - base_temperature_K)
            stated = measurement.tip_error_K / np.maximum(shown, _WARM_K)
            is_stated = np.isfinite(stated).any()
            share = float(np.nanmedian(stated)) if is_stated else RAMAN_ERROR_SHARE
        if name in priors:
            share = priors[name].spread
        errors.append(CommonError(name, observable, share, share * shown))
    return errors


class CommonCovariance:
    """What errors in common do to weighted differences, whose own errors are independent.

    With unit variances beside them the covariance is 1 + A Aᵀ, where the columns of A are what
    errors of one standard deviation add. They are of different observables, so that they have no
    rows in common.

    Parameters
    ----------
    errors : sequence of CommonError
    pattern : ndarray, shape (N, errors)
        A.
    """

    def __init__(self, errors: Sequence[CommonError], pattern: Array) -> None:
        self._errors, self._pattern = errors, pattern

    def decorrelated(self, rows: Array) -> Array:
        """Return rows (N, ...) times the inverse root of the covariance."""
        if not self._errors:
            return np.asarray(rows)
        size = np.linalg.norm(self._pattern, axis=0)
        along = self._pattern / np.maximum(size, 1e-300)
        kept = 1.0 / np.sqrt(1.0 + size**2) - 1.0
        return np.asarray(rows + along @ (kept * (along.T @ rows).T).T)

    def told(self, differences: Array, slopes: Array, covariance: Array) -> dict[str, Moved]:
        """Return the errors as the data tell them, by name.

        By weighted differences (N,) as if data had no errors in common, and their slopes (N, p) by
        parameters of which the fit leaves this covariance.
        """
        pattern = self._pattern
        own = np.linalg.inv(np.eye(len(self._errors)) + pattern.T @ pattern)
        size = -own @ pattern.T @ differences
        by = own @ pattern.T @ slopes
        left = np.sqrt(np.diag(own + by @ covariance @ by.T))
        moved = map(Moved, size.tolist(), left.tolist())
        return dict(zip((error.name for error in self._errors), moved, strict=True))
