"""Whether thermoelectricity in the model changes what a measurement tells.

Two questions: what a fit of one measurement changes by it, and how well a model without it
describes a lever that has it, wired either way round.
"""

from __future__ import annotations

import xarray as xr

from hotlever.datasets import labelled
from hotlever.estimation import Fit, Measurement, fit
from hotlever.lever import Lever
from hotlever.probe import Probe
from hotlever.spieser2017 import RAMP
from hotlever.studies.thermoelectric_shift import POLARITIES

EFFECT = "thermoelectric"


def fits_with_and_without(measurement: Measurement, probe: Probe) -> dict[bool, Fit]:
    """Return the fits of a measurement by a model without thermoelectricity, and with it."""
    return {
        with_it: fit(measurement, probe.with_physics((EFFECT,) if with_it else ()))
        for with_it in (False, True)
    }


def ramp_of(lever: Lever, polarity: int) -> xr.Dataset:
    """Return the paper's ramp of a lever as an instrument shows it that is wired either way round.

    With −1 the current flows the other way, and all that is shown is positive.
    """
    sweep = lever.sweep([polarity * bias for bias in RAMP])
    for name in ("bias_V", "lever_V", "current_mA", "reader_V"):
        sweep[name] = polarity * sweep[name]
    return sweep


def described_without(probe: Probe) -> xr.Dataset:
    """Fit a model without thermoelectricity to a lever that has it, without noise.

    Parameters
    ----------
    probe : Probe
        Whether it has thermoelectricity does not matter.

    Returns
    -------
    xarray.Dataset
        On the dimension ``polarity``: root mean squares of what the fit leaves,
        ``rms_current_mA``, ``rms_reader_V`` and ``rms_tip_K``; and ``off_K``, the largest
        difference of a tip temperature from the fitted one.
    """
    lever, plain = Lever(probe.with_physics((EFFECT,))), probe.with_physics(())
    rows = []
    for polarity in POLARITIES:
        sweep = ramp_of(lever, polarity)
        result = fit(Measurement.of_sweep(sweep), plain)
        off = abs(result.band.tip_K.values - sweep.tip_K.values)
        rms = {f"rms_{name}": value for name, value in result.residual_rms.items()}
        rows.append({**rms, "off_K": float(off.max())})
    columns = {name: [row[name] for row in rows] for name in rows[0]}
    return labelled(columns, "polarity", {"polarity": list(POLARITIES)})
