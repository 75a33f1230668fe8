"""What remains of the 50 K between the measured and the predicted temperature at the knee.

The paper fits a model to a lever and predicts the temperature at its knee; the measured one is
higher. Each suspect is a lever that has one thing more than the model, measured as the paper did:
currents, reader voltages and tip temperatures of a bias ramp. The model is fitted to that, and what
the knee is read to be above what the fit predicts is what the suspect carries; beside it stands
what it would carry were the model not fitted. What is not known
moves a prediction either way: such uncertainties are standard deviations, added in quadrature.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from hotlever import spieser2017 as paper
from hotlever.datasets import labelled
from hotlever.estimation import Fit, Measurement, fit
from hotlever.lever import Lever
from hotlever.lever.lever import COARSE
from hotlever.probe import Probe, Tip
from hotlever.probe.parameters import nuisances, parameters_of
from hotlever.raman.calibration import published_raman_calibration
from hotlever.steps import each
from hotlever.studies.knee_reasons import knee_of
from hotlever.studies.thermoelectric_fit import ramp_of
from hotlever.types import Array, Progress

#: A tip of the usual size of lithography probes.
TIP = Tip(height_um=0.7, half_angle_deg=20.0)
#: A change by which derivatives of the knee are differenced, in standard errors.
_STEP = 0.5
#: What is read by a line and is curved, what has a tip, and what counts beyond the paper.
RAMAN, IN_VACUUM, IN_AIR = "curved Raman law", "tip", "tip with its surface in air"
TOWARDS, AWAY = "thermoelectricity, current to the bridge", "thermoelectricity, current from it"
RADIATION, TOGETHER = "radiation", "all together"
SUSPECTS = (RAMAN, IN_VACUUM, IN_AIR, TOWARDS, AWAY, RADIATION, TOGETHER)
LAYOUT, COVARIANCE = "layout", "covariance of the fit"


def read_by_the_line(tip_K: ArrayLike) -> Array:
    """Return what the published line reads (K) where silicon's phonons soften anharmonically.

    The paper calibrated the line up to 900 K; the anharmonic law has Balkanski's constants.
    """
    law = published_raman_calibration()
    shift, _ = law.anharmonic.shift(np.asarray(tip_K, dtype=float), law.room_temperature_K)
    return np.asarray(law.linear.temperature(shift, law.room_temperature_K))


def suspect_lever(probe: Probe, suspect: str) -> tuple[Probe, bool]:
    """Return a probe with what a suspect has beyond the paper's model, and if a line reads it."""
    everything = suspect == TOGETHER
    if suspect == IN_VACUUM or everything:
        probe = probe.model_copy(update={"tip": TIP})
    if suspect == IN_AIR or (everything and probe.surroundings.medium == "air"):
        probe = probe.model_copy(update={"tip": TIP.with_(in_air=True)})
    thermoelectric, radiates = (
        suspect in (TOWARDS, AWAY, TOGETHER),
        suspect in (RADIATION, TOGETHER),
    )
    effects = ["thermoelectric"] * thermoelectric + ["radiation"] * radiates
    return probe.with_physics(effects), suspect in (RAMAN, TOGETHER)


def carried_by(probe: Probe, suspect: str, own_K: float | None = None) -> tuple[float, float]:
    """Return how far the knee of a suspect's lever is read above two predictions (K).

    That of the model with the lever's own parameters, which may be given where it is known, and
    that of the model fitted to it.

    Raises
    ------
    ComputationError
        If one of the levers has no knee.
    """
    true, by_line = suspect_lever(probe, suspect)
    lever, away = Lever(true), suspect == AWAY
    data = Measurement.of_sweep(ramp_of(lever, -1 if away else 1))
    branch = lever.branch_to(0.0, lowest=-paper.RAMP[-1]).mirrored if away else lever.branch()
    shown = knee_of(branch, f"the lever ({suspect})").tip_K
    if by_line:
        data = replace(data, tip_K=read_by_the_line(data.tip_K))
        shown = float(read_by_the_line(shown))
    fitted = fit(data, probe).probe
    own_K = knee_K(probe) if own_K is None else own_K
    return shown - own_K, shown - knee_K(fitted)


def knee_K(probe: Probe) -> float:
    """Return the tip temperature at a probe's knee (K).

    Raises
    ------
    ComputationError
        If it has none.
    """
    return knee_of(Lever(probe).branch()).tip_K


def by_layout(probe: Probe, progress: Progress | None = None) -> float:
    """Return the standard deviation (K) of what a fit predicts, by dimensions that are not known.

    Each is off by the standard deviation of its usual prior in the model that is fitted.
    """
    data, true, off = Measurement.of_sweep(Lever(probe).sweep(paper.RAMP)), knee_K(probe), []
    parameters = parameters_of(probe)
    for name in each(nuisances(probe), progress):
        value, spread = float(probe.values([name])[0]), parameters[name].spread or 0.0
        moved = probe.replace({name: value * (1.0 + spread)})
        off.append(knee_K(fit(data, moved).probe) - true)
    return float(np.linalg.norm(off))


def by_covariance(result: Fit) -> float:
    """Return the standard error (K) of the knee that a fit predicts, by its covariance."""
    errors = {name: result.parameters[name].stderr or 0.0 for name in result.names}

    def knee(**changes: float) -> float:
        branch = Lever(result.probe.with_(**changes), COARSE).branch()
        return float("nan") if branch.knee is None else branch.knee.tip_K

    slopes = []
    for name, error in errors.items():
        value = result.parameters[name].value
        ends = [knee(**{name: value + way * _STEP * error}) for way in (1.0, -1.0)]
        slopes.append((ends[0] - ends[1]) / (2.0 * _STEP))
    return float(np.sqrt(np.array(slopes) @ result.correlation @ slopes))


def compare_suspects(
    probe: Probe, example: Fit, *, layout: bool = True, progress: Progress | None = None
) -> xr.Dataset:
    """Compute what each suspect carries of the knee's discrepancy, in one medium.

    Parameters
    ----------
    probe : Probe
        In vacuum or in air.
    example : Fit
        Of a measurement with noise as the paper's, for the covariance.
    layout : bool
        Whether the uncertain layout is computed, a fit for each dimension.
    progress : callable, optional
        Called with the steps done and their number.

    Returns
    -------
    xarray.Dataset
        ``moved_K`` and ``shift_K`` on the dimension ``suspect``, see `carried_by`; NaN where one
        does not count in the medium;
        ``stderr_K`` on ``uncertainty``; the published ``discrepancy_K``, the sum of the suspects
        with the current to the bridge, and what is ``left_K`` after all together, as attributes.

    Raises
    ------
    ComputationError
        If a lever has no knee, or a fit does not come to an end.
    """
    shifts, own_K = [], knee_K(probe)
    for suspect in each(SUSPECTS, progress):
        counts = suspect != IN_AIR or probe.surroundings.medium == "air"
        shifts.append(carried_by(probe, suspect, own_K) if counts else (np.nan, np.nan))
    own, fitted = np.transpose(shifts)
    errors = {COVARIANCE: by_covariance(example)}
    if layout:
        errors[LAYOUT] = by_layout(probe, progress)
    gap = paper.KNEE_MEASURED_K - paper.KNEE_PREDICTED_K
    return labelled(
        {
            "moved_K": ("suspect", own, {"units": "K", "long_name": "above the model's knee"}),
            "shift_K": ("suspect", fitted, {"units": "K", "long_name": "above the fit's knee"}),
            "stderr_K": (
                "uncertainty",
                list(errors.values()),
                {"units": "K", "long_name": "standard error"},
            ),
        },
        "suspect",
        {"suspect": list(SUSPECTS), "uncertainty": list(errors)},
        medium=probe.surroundings.medium,
        discrepancy_K=gap,
        left_K=gap - float(fitted[-1]),
        total_stderr_K=float(np.linalg.norm(list(errors.values()))),
    )
