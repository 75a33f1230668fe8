"""A calibration as an estimate: what is known of a lever, brought up to date by its measurement.

Material, dimensions and circuit have priors (`hotlever.probe.priors`); the measurement moves them
to where both are most likely, and the tip temperature with its error follows from there
(`hotlever.estimate.tip_temperature`). No knee is needed: a lever that was measured below it is
less certain above, and that is all.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr
from scipy.special import chdtrc

from hotlever.errors import ComputationError, counted
from hotlever.estimate.calibration import Calibration, rms
from hotlever.estimate.diagnosis import lack_of_fit_text, outlier_notes, run_of_outliers
from hotlever.estimate.experiment import TIP, PredictionAtRest
from hotlever.estimate.inverse_problem import Estimate, estimate
from hotlever.estimate.knee import Knee
from hotlever.estimate.options import FitOptions
from hotlever.estimate.power_law import law_of_model, power_turns
from hotlever.estimate.prior_density import PriorDensity
from hotlever.estimate.result import Fit
from hotlever.estimate.tip_temperature import (
    OF_THE_MEASUREMENT,
    highest_bias,
    not_of_a_ramp,
    tip_by_bias,
    tips_in_contact,
)
from hotlever.estimate.uncertainty_budget import BudgetOf, budget_of_estimate
from hotlever.lever import Branch, Lever
from hotlever.lever.lever import COARSE
from hotlever.measurement import Measurement
from hotlever.probe import Circuit, Probe
from hotlever.probe.priors import (
    SCALES,
    THERMOMETER,
    Prior,
    PriorUse,
    as_known,
    default_priors,
    known_beforehand,
    published_material,
    updated,
)
from hotlever.probe.probe_parameters import usual_parameters
from hotlever.quantities import FITTED, OF_A_CONTACT
from hotlever.spieser2017 import RAMAN_ERROR_K
from hotlever.types import Array, Progress

#: Share of the measured biases that a lever must reach to show the data.
_REACHED = 0.98
#: Rows with a current that are not few for a lever.
_FEW = 6
#: Currents are coarse in steps of this share of the largest, each a multiple within so much.
_COARSE, _EVEN = 0.01, 0.02
#: A lever is cold that was never hotter (K).
_COLD_K = 400.0
#: Observables that are temperatures of the tip or of what it touches, and spectra that are offered
#: where there are none.
_OF_A_TIP, _SPECTRA = {"tip", *OF_A_CONTACT}, 5
#: Data are not described where parameters are as far from their priors as one lever in 500 is.
_UNLIKELY = 2e-3
#: The same where data and all other priors are so many standard deviations from one prior: of the
#: nearly twenty of a lever one is, by chance, in one lever of 500.
UNLIKELY_PULL = 3.85


def estimate_lever(
    measured: Measurement,
    probe: Probe,
    fit: Fit | None = None,
    priors: Mapping[str, Prior | str] | None = None,
    progress: Progress | None = None,
) -> tuple[Estimate, dict[str, Prior]]:
    """Estimate a lever from its measurement; return with it what was known beforehand.

    Parameters
    ----------
    measured : Measurement
    probe : Probe
        In the circuit and medium of the measurement.
    fit : Fit, optional
        Of this lever to other data, or to the same. Its data count, not what it made of them.
    priors : mapping of str to Prior or str, optional
        In place of some of the usual ones; if empty there are none, and dimensions are held.
    progress : callable, optional

    Raises
    ------
    ComputationError
        If no lever near the probe has states at all measured biases.
    """
    stated, medium = known_beforehand(probe, priors), probe.surroundings.medium
    if fit is None:
        options = FitOptions(priors=stated, medium=medium)
        return estimate(measured, probe, options, progress=progress), stated
    before_fit = _before(fit, priors)
    fixed = dict.fromkeys(fit.options.fixed)
    options = FitOptions(
        observables=fit.observables,
        fixed=fixed,
        priors=before_fit,
        medium=fit.probe.surroundings.medium,
    )
    fitted = estimate(fit.measurement, fit.probe, options, progress=progress)
    if _same_data(fit.measurement, measured):
        return fitted, before_fit
    # what that leaves of the lever itself is known before the other data; circuit and gas are
    # those of each measurement
    own = [name for name in fitted.options.varied if name not in OF_THE_MEASUREMENT]
    numbers = [fitted.options.varied.index(name) for name in own]
    values, covariance = fitted.probe.values(own), fitted.posterior.covariance
    relative = np.array([name not in before_fit or before_fit[name].relative for name in own])
    left = PriorDensity.of_estimate(own, values, covariance[np.ix_(numbers, numbers)], relative)
    probe = probe.replace(dict(zip(own, values.tolist(), strict=True)))
    theirs = {
        name: prior for name, prior in stated.items() if name in {*OF_THE_MEASUREMENT, *SCALES}
    }
    free = tuple(name for name in own if name not in usual_parameters(probe))
    again = FitOptions(fixed=fixed, priors=theirs, free=free, medium=medium)
    try:
        return (
            estimate(measured, probe, again, before=left, progress=progress),
            {**before_fit, **theirs},
        )
    except ComputationError as error:
        raise ComputationError(
            f"no lever like the fitted one shows these data; is it another lever's fit? ({error})"
        ) from error


def _before(fit: Fit, priors: Mapping[str, Prior | str] | None) -> dict[str, Prior]:
    """Return what was known of a lever before it was fitted.

    The probe of a fit has the material that was found, so that this is no prior of its own.
    """
    if priors is not None and not priors:
        return {}
    stated = {**fit.options.priors, **(priors or {})}
    probe = as_known(fit.probe, stated)
    before = updated(default_priors(probe, published_material()), stated, probe, "priors")
    return {name: prior for name, prior in before.items() if name not in fit.options.fixed}


def _same_data(first: Measurement, second: Measurement) -> bool:
    columns, others = (
        (data.bias_V, data.observable("current"), data.observable("bridge"))
        for data in (first, second)
    )
    return np.array_equal(columns, others, equal_nan=True)


# --- the calibration of an estimated lever ------------------------------------------------------


def calibrated_by_estimate(
    measured: Measurement,
    estimate: Estimate,
    stated: Mapping[str, Prior],
    route: str,
    samples: int = 0,
    at_V: float | None = None,
    of: BudgetOf = "tip",
    progress: Progress | None = None,
) -> Calibration:
    """Return the calibration of an estimated lever, of which some was known beforehand.

    See `hotlever.estimate.procedure.calibrate`.
    """
    probe, priors = estimate.probe, estimate.priors(stated)
    circuit, medium = probe.circuit, probe.surroundings.medium
    tip = tip_by_bias(estimate, samples, at_V, progress)
    converged, reason = _verdict(estimate, priors)
    notes = [*what_data_lack(measured, circuit, tip.table.tip_K.values), *estimate.notes]
    notes += [tip.asymmetry] if tip.asymmetry and not reason else []
    notes += [jump.note for jump in tip.jumps]
    notes += [] if reason else what_spectra_would_do(estimate, tip.table)
    notes += outlier_notes(estimate.residuals, estimate.prediction.values, robust=True)
    own, lever = estimate.branch, Lever(probe.in_medium("vacuum"), COARSE)
    vacuum = lever.branch()
    # beyond the measured range a coarse lever says where the knee is
    if own.knee is None:
        own = vacuum if medium == "vacuum" else lever.in_medium(medium).branch()
    knee, threshold = knee_with_errors(estimate, own), vacuum.knee
    law, residual, k, k_stderr = None, np.nan, np.nan, np.nan
    turns = power_turns(own, medium) or power_turns(vacuum, "vacuum")
    # with held supplies, or where the power turns, the tip does not follow from a power
    by_power = own.starts_cold and not turns
    if own.knee is None or (by_power and threshold is None):
        notes.append(f"the model has no knee below {vacuum.hottest_K:.0f} K; none is needed")
    elif by_power and medium == "vacuum":
        # the law is that of the lever itself
        k, k_stderr, threshold = 1.0, 0.0, own.knee
    elif by_power and threshold is not None:
        k = own.knee.power_mW / threshold.power_mW
        k_stderr = k * knee.power_mW_stderr / knee.power_mW
    if turns:
        notes.append(f"{turns}; there is no power law, and the table is read by bias")
    if probe.contact is not None and probe.contact.interface_K_per_mW == 0.0:
        notes.append(
            "no interface is stated, so that the apex has no error of one; interface_K_per_mW in "
            "[contact] would give it one"
        )
    if not probe.shape.outline_moves:
        notes.append("the outline is taken to be as drawn: no error of it is in the result")
    bias = tip.table.bias_V.values
    row = int(np.nanargmax(tip.table.tip_K) if at_V is None else np.searchsorted(bias, at_V))
    if by_power:
        law, residual = law_of_model(vacuum, None if threshold is None else threshold.power_mW)
    return Calibration(
        table=tip.table,
        gum=budget_of_estimate(estimate, priors, tip.table.isel(bias=slice(row, row + 1)), of),
        weights=_weights(measured, estimate),
        route=route,
        medium=medium,
        power_law=law,
        law_residual_K=residual,
        k=k,
        k_stderr=k_stderr,
        knee=knee,
        knee_tip_K=np.nan if own.knee is None else own.knee.tip_K,
        measured_rms_K=rms(_missed(estimate.branch, measured, circuit)),
        probe=probe,
        measurement=measured,
        priors=priors,
        reason=reason,
        converged=converged,
        notes=notes,
    )


def what_spectra_would_do(estimate: Estimate, table: xr.Dataset) -> list[str]:
    """Say how well a lever without tip temperatures is known, and how well it would be with some.

    They are spectra at even tip temperatures, with the errors that those of the paper have. There
    is nothing to say where nothing was known beforehand.
    """
    if not estimate.objective.informed or set(estimate.residuals.observables) & _OF_A_TIP:
        return []
    tip = table.tip_K.values
    rise = tip - estimate.probe.circuit.base_temperature_K
    even = np.linspace(tip.min(), tip.max(), _SPECTRA + 1)[1:]
    spots = np.unique([int(np.argmin(np.abs(tip - each))) for each in even])
    predicted = estimate.predicted(table.bias_V.values[spots])
    slopes = predicted.slopes[TIP][:, estimate.objective.columns]
    # their thermometer's scale is an error that they share
    shared = np.outer(rise[spots], rise[spots]) * THERMOMETER**2
    noise = np.diag(np.full(spots.size, RAMAN_ERROR_K**2)) + shared
    together = slopes @ estimate.posterior.covariance @ slopes.T
    left = together - together @ np.linalg.solve(together + noise, together)
    hottest = int(np.argmax(rise[spots]))
    now, then = (
        100.0 * float(np.sqrt(covariance[hottest, hottest])) / rise[spots][hottest]
        for covariance in (together, left)
    )
    seen = " and ".join(FITTED[name].symbol for name in estimate.residuals.observables)
    return [
        f"from {seen} alone the rise of its hottest tip is known to ± {now:.2g} %; {_SPECTRA} "
        f"Raman spectra of ± {RAMAN_ERROR_K:g} K and {100.0 * THERMOMETER:g} % of the rise would "
        f"make it ± {then:.2g} %"
    ]


def _weights(measured: Measurement, estimate: Estimate) -> dict[str, Array] | None:
    """Return the weights of an estimate with priors, unless it is of other data too."""
    residuals = estimate.residuals
    if not estimate.objective.informed or "fit" in estimate.objective.prior.sources:
        return None
    if not _same_data(measured, estimate.measurement):
        return None
    return dict(zip(residuals.observables, residuals.data_weights, strict=True))


def _verdict(estimate: Estimate, priors: Mapping[str, PriorUse]) -> tuple[bool, str]:
    """Return whether the search came to an end, and why the data are not described, if so."""
    converged, reason = estimate.verdict(_misfit(estimate, priors))
    circuit = estimate.probe.circuit
    reason = reason or not_of_a_ramp(estimate.branch, circuit, *tips_in_contact(estimate))
    highest = highest_bias(estimate)
    if not reason and highest < _REACHED * float(estimate.residuals.bias.max()):
        reason = f"the lever that comes nearest has no steady state above {highest:.4g} V"
    return converged, reason


def what_data_lack(measured: Measurement, circuit: Circuit, tip_K: np.ndarray) -> list[str]:
    """Say what the data lack, to tell more of a lever."""
    remarks, count = [], np.isfinite(measured.current(circuit)).sum()
    if count < _FEW:
        remarks.append(
            f"{counted(count, 'row')} with a current: few for a lever, so that the answer leans on "
            f"what was known beforehand; {_FEW} or more would tell"
        )
    levels = np.unique(measured.current_mA[np.isfinite(measured.current_mA)])
    step = float(np.diff(levels).min()) if levels.size > 1 else 0.0
    share = step / float(levels[-1]) if step else 0.0
    if share > _COARSE and np.allclose(levels / step, np.round(levels / step), atol=_EVEN):
        remarks.append(
            f"I_h has a resolution of {step:.2g} mA only, {share:.1%} of its largest value, in "
            f"{counted(levels.size, 'step')}"
        )
    hottest = float(np.nanmax(tip_K))
    if hottest < _COLD_K:
        remarks.append(
            f"the lever was measured only up to a tip of {hottest:.0f} K; what it does beyond is "
            "not known"
        )
    return remarks


def _misfit(estimate: Estimate, priors: Mapping[str, PriorUse]) -> str:
    """Return why data are not described by what was fitted to them; empty if they are."""
    of_data, shifts = (estimate.residuals, estimate.prediction.values), estimate.posterior.shifts
    if reason := lack_of_fit_text(*of_data) or run_of_outliers(*of_data):
        return reason
    name = max(shifts, key=lambda name: abs(shifts[name].pull), default="")
    if name and abs(shifts[name].pull) > UNLIKELY_PULL:
        use = priors[name]
        return (
            f"{name}, known as {use.stated}, would have to be another; the "
            f"data are {abs(shifts[name].pull):.1f} σ from it"
        )
    # as many are free to be away as the data tell of
    dof = sum(each.contraction for each in shifts.values())
    if dof > 0 and chdtrc(dof, sum(each.size**2 for each in shifts.values())) < _UNLIKELY:
        most = sorted(shifts, key=lambda name: -abs(shifts[name].size))[:3]
        away = ", ".join(f"{name} by {shifts[name].size:+.1f} σ" for name in most)
        return f"what was known beforehand would have to be wrong by too much together, {away}"
    return ""


def _missed(branch: Branch, measured: Measurement, circuit: Circuit) -> Array:
    """Return how far tips were measured from those of a branch, NaN away from a sample.

    They are those at the measured power; or bias, if the power does not tell.
    """
    one_way = measured.bias_V.min() >= 0.0
    if one_way and branch.starts_cold and branch.power_turns_K is None:
        tip = branch.tip_temperature(circuit.power(measured.bias_V, measured.current(circuit)))
    else:
        tip = branch.tip_K(branch.read(circuit, measured.bias_V).u)
    return np.where(measured.out_of_contact, np.nan, measured.tip_K - tip)


def knee_with_errors(estimate: Estimate, branch: Branch) -> Knee:
    """Return the knee of a branch of the estimated lever, with standard errors; NaN without one.

    There are no errors of a knee that the lever may have beyond the measured range.
    """
    if branch.knee is None:
        return Knee()
    assert isinstance(estimate.prediction, PredictionAtRest)
    surrogate, circuit = estimate.prediction.surrogate, estimate.probe.circuit

    def values(branch: Branch) -> Array:
        """Return V_l, I_h, P_l and V_b of a knee; NaN without one."""
        point = branch.knee
        if point is None:
            return np.full(4, np.nan)
        bias = circuit.bias(point.lever_V, point.current_mA)
        return np.array([point.lever_V, point.current_mA, point.power_mW, bias])

    changes = estimate.posterior.changes(lambda at: values(surrogate.branch_at(at)))
    errors = np.sqrt(np.sum(changes**2, axis=0))
    return Knee(*values(branch).tolist(), *errors.tolist())
