"""The tip of an estimated lever: its table by bias, its knee and power law, and how sure all are.

No knee is needed: a lever that was measured below it is less certain above, and that is all.
"""

from __future__ import annotations

from collections.abc import Container
from dataclasses import replace

import numpy as np

from hotlever.errors import counted
from hotlever.estimate.diagnosis import outlier_notes
from hotlever.estimate.estimate import Estimate
from hotlever.estimate.experiment import TIP, PredictionAtRest
from hotlever.estimate.knee import Knee
from hotlever.estimate.options import CalibrationOptions
from hotlever.estimate.power_law import law_of_model, power_turns
from hotlever.estimate.search import Solution
from hotlever.estimate.tip_table import TipTable, rms
from hotlever.estimate.tip_temperature import tip_by_bias
from hotlever.estimate.uncertainty_budget import budget_of_estimate
from hotlever.lever import Branch, Lever
from hotlever.lever.branch import TIP_RISE
from hotlever.lever.continuation import continued
from hotlever.lever.lever import COARSE, HOTTEST
from hotlever.measurement import Measurement
from hotlever.measurement.data import resolution_of
from hotlever.probe import Circuit, Probe
from hotlever.probe.priors import THERMOMETER
from hotlever.probe.shapes import full_bias_name
from hotlever.quantities import FITTED, OF_A_CONTACT
from hotlever.spieser2017 import RAMAN_ERROR_K
from hotlever.types import Array, Progress
from hotlever.work import one_blas_thread


def calibrated(
    solution: Solution,
    estimate: Estimate,
    measured: Measurement,
    options: CalibrationOptions,
    route: str = "probe",
    progress: Progress | None = None,
) -> Estimate:
    """Return an estimate with the tip temperature of its lever.

    Parameters
    ----------
    solution : Solution
    estimate : Estimate
        Of that solution.
    measured : Measurement
        What is calibrated: the same bias and current, or all that was estimated with.
    options : CalibrationOptions
    route : str
        See `Estimate`.
    progress : callable, optional
    """
    probe, reason = estimate.probe, estimate.reason
    circuit, medium, at_V = probe.circuit, probe.surroundings.medium, options.at_V
    table, jumps, asymmetry = tip_by_bias(solution, options.samples, at_V, progress)
    notes = [*estimate.notes, *what_data_lack(measured, circuit, table["tip_K"])]
    notes += [asymmetry] if asymmetry and not reason else []
    notes += [jump.note for jump in jumps]
    notes += [] if reason else what_spectra_would_do(solution, table)
    notes += outlier_notes(solution.residuals, solution.prediction.values, robust=True)
    own, vacuum = solution.branch, _hotter(solution, "vacuum")
    # beyond the measured range a coarse lever says where the knee is
    if own.knee is None:
        own = vacuum if medium == "vacuum" else _hotter(solution, medium)
    knee, threshold = knee_with_errors(solution, own), vacuum.knee
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
    notes += _of_exact_edges(probe, estimate.priors)
    hottest = np.nanargmax(table["tip_K"])
    row = int(hottest if at_V is None else np.searchsorted(table["bias_V"], at_V))
    if by_power:
        law, residual = law_of_model(vacuum, None if threshold is None else threshold.power_mW)
    return replace(
        estimate,
        measurement=measured,
        notes=notes,
        tabulated=table,
        gum=budget_of_estimate(solution, table.rows(slice(row, row + 1)), options.budget_of),
        route=route,
        power_law=law,
        law_residual_K=residual,
        k=k,
        k_stderr=k_stderr,
        knee=knee,
        measured_rms_K=rms(_missed(solution.branch, measured, circuit)),
    )


@one_blas_thread
def _hotter(solution: Solution, medium: str) -> Branch:
    """Return the branch of a coarse lever, to tips hotter than was measured, in a medium.

    In that of the measurement it goes on from the states that the search ended with, in another one
    it has the same mesh.
    """
    assert isinstance(solution.prediction, PredictionAtRest)
    probe, searched = solution.probe, solution.prediction.linearised.branch
    space = searched.equations.space
    if space.is_reduced:
        return Lever(probe.in_medium(medium), COARSE).branch()
    if medium != probe.surroundings.medium:
        return Lever(probe.in_medium(medium), COARSE, space=space.full).branch()
    rise = HOTTEST - probe.circuit.base_temperature_K
    return continued(searched.equations, lambda to: to.values[-1, TIP_RISE] >= rise, searched)


def what_spectra_would_do(solution: Solution, table: TipTable) -> list[str]:
    """Say how well a lever without tip temperatures is known, and how well it would be with some.

    They are spectra at even tip temperatures, with the errors that those of the paper have. There
    is nothing to say where nothing was known beforehand.
    """
    of_a_tip = {"tip", *OF_A_CONTACT}
    if not solution.objective.informed or of_a_tip & set(solution.residuals.observables):
        return []
    tip, spectra = table["tip_K"], 5
    rise = tip - solution.probe.circuit.base_temperature_K
    even = np.linspace(tip.min(), tip.max(), spectra + 1)[1:]
    spots = np.unique([int(np.argmin(np.abs(tip - each))) for each in even])
    predicted = solution.predicted(table["bias_V"][spots])
    slopes = predicted.slopes[TIP][:, solution.objective.columns]
    # their thermometer's scale is an error that they share
    shared = np.outer(rise[spots], rise[spots]) * THERMOMETER**2
    noise = np.diag(np.full(spots.size, RAMAN_ERROR_K**2)) + shared
    together = slopes @ solution.posterior.covariance @ slopes.T
    left = together - together @ np.linalg.solve(together + noise, together)
    hottest = int(np.argmax(rise[spots]))
    now, then = (
        100.0 * float(np.sqrt(covariance[hottest, hottest])) / rise[spots][hottest]
        for covariance in (together, left)
    )
    seen = " and ".join(FITTED[name].symbol for name in solution.residuals.observables)
    return [
        f"from {seen} alone the rise of its hottest tip is known to ± {now:.2g} %; {spectra} "
        f"Raman spectra of ± {RAMAN_ERROR_K:g} K and {100.0 * THERMOMETER:g} % of the rise would "
        f"make it ± {then:.2g} %"
    ]


def _of_exact_edges(probe: Probe, priors: Container[str]) -> list[str]:
    """Say which edges of a drawing that matter to the tip are taken to be where they are drawn."""
    if probe.shape.outline_moves:
        return []
    heated = {
        full_bias_name(layer)
        for region in probe.layout().regions
        if region.part != "reader branch"
        for layer in region.layers
    }
    exact = [name for name in probe.shape.dimensions() if name in heated and name not in priors]
    if not exact:
        return []
    return [
        "edges are taken to be where they are drawn, and no error of them is in the result; a "
        f"prior of {' and '.join(exact)} says how far off they may be"
    ]


def what_data_lack(measured: Measurement, circuit: Circuit, tip_K: np.ndarray) -> list[str]:
    """Say what the data lack, to tell more of a lever."""
    remarks, count = [], np.isfinite(measured.current(circuit)).sum()
    few = 6
    if count < few:
        remarks.append(
            f"{counted(count, 'row')} with a current: few for a lever, so that the answer leans on "
            f"what was known beforehand; {few} or more would tell"
        )
    current = measured.current_mA[np.isfinite(measured.current_mA)]
    step, levels = resolution_of(current), np.unique(current).size
    share = step / float(np.abs(current).max(initial=1e-300))
    if share > 0.01:
        remarks.append(
            f"I_h has a resolution of {step:.2g} mA only, {share:.1%} of its largest value, in "
            f"{counted(levels, 'step')}"
        )
    hottest = float(np.nanmax(tip_K))
    if hottest < 400.0:
        remarks.append(
            f"the lever was measured only up to a tip of {hottest:.0f} K; what it does beyond is "
            "not known"
        )
    return remarks


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


def knee_with_errors(solution: Solution, branch: Branch) -> Knee:
    """Return the knee of a branch of the estimated lever, with standard errors; NaN without one.

    There are no errors of a knee that the lever may have beyond the measured range.
    """
    if branch.knee is None:
        return Knee()
    assert isinstance(solution.prediction, PredictionAtRest)
    surrogate, circuit = solution.prediction.surrogate, solution.probe.circuit

    def values(branch: Branch) -> Array:
        """Return V_l, I_h, P_l, V_b and T_tip of a knee; NaN without one."""
        point = branch.knee
        if point is None:
            return np.full(5, np.nan)
        bias = circuit.bias(point.lever_V, point.current_mA)
        return np.array([point.lever_V, point.current_mA, point.power_mW, bias, point.tip_K])

    changes = solution.posterior.changes(lambda at: values(surrogate.branch_at(at)))
    errors = np.sqrt(np.sum(changes**2, axis=0))
    names = ("lever_V", "current_mA", "power_mW", "bias_V", "tip_K")
    stderr = {f"{name}_stderr": error for name, error in zip(names, errors.tolist(), strict=True)}
    return Knee(**dict(zip(names, values(branch).tolist(), strict=True)), **stderr)
