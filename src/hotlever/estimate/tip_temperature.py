"""The tip temperature of an estimated lever by bias, and how sure it is.

Its error adds up by source: what data and priors leave of the lever, what the model leaves out, and
where a ramp of the bias jumps between two measured rows. A ramp that passes a fold leaves the cold
part of a branch for the hot one; the rows tell between which biases that was, and there the tip may
still be cold, or hot already.
"""

from __future__ import annotations

from collections.abc import Container, Mapping
from dataclasses import dataclass, replace

import numpy as np

from hotlever.errors import InputError, counted
from hotlever.estimate.diagnosis import outlier_notes
from hotlever.estimate.estimate import Estimate
from hotlever.estimate.experiment import TIP, PredictionAtRest
from hotlever.estimate.options import CalibrationOptions
from hotlever.estimate.posterior import profile_of_tip, standard_errors
from hotlever.estimate.power_law import law_of_model, power_turns
from hotlever.estimate.search import Solution
from hotlever.estimate.tip_table import (
    Knee,
    TipTable,
    rms,
    table_by_bias,
    total_error,
    with_steep_rows,
)
from hotlever.estimate.uncertainty_budget import budget_of_estimate
from hotlever.lever import Branch, Lever
from hotlever.lever.branch import TIP_RISE
from hotlever.lever.continuation import continued
from hotlever.lever.lever import COARSE, HOTTEST
from hotlever.lever.observables import by_parameter, shown_at_knee_by_parameter
from hotlever.lever.similar import SimilarLevers
from hotlever.measurement import Measurement
from hotlever.measurement.data import resolution_of
from hotlever.piecewise import spline_through
from hotlever.probe import Circuit, Probe
from hotlever.probe.shapes import full_bias_name
from hotlever.probe.surroundings import Surroundings
from hotlever.quantities import FITTED, OF_A_CONTACT, THERMOMETER
from hotlever.spieser2017 import RAMAN_ERROR_K
from hotlever.text import BAND
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
        k_stderr = k * _relative_error_of_k(solution, own, vacuum)
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


def what_data_lack(measured: Measurement, circuit: Circuit, tip_K: Array) -> list[str]:
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


def _relative_error_of_k(solution: Solution, own: Branch, vacuum: Branch) -> float:
    """Return the standard error of the power of a knee over that in vacuum, as a share of it.

    Data show the one, and tell of the other no more than they tell of all parameters: where it is
    known to 3 %, a knee that is measured to 0.3 % has a k of 3 %. NaN for a knee that the lever may
    have beyond the measured range.
    """
    if own is not solution.branch:
        return float("nan")
    assert isinstance(solution.prediction, PredictionAtRest)
    objective, surrogate = solution.objective, solution.prediction.surrogate
    levers = SimilarLevers(
        Lever(solution.probe.in_medium("vacuum"), space=vacuum.equations.space.full)
    )
    equations = levers.equations(levers.drawn, objective.names)
    # as many states as a curve of fifth degree goes through
    assert vacuum.knee_u is not None
    away = np.abs(vacuum.u[vacuum.solved] - vacuum.knee_u)
    near = np.sort(vacuum.solved[np.argsort(away, kind="stable")[:6]])
    constraint = vacuum.parametrisation.constraint(vacuum.u[near])
    slopes = by_parameter(equations, vacuum.x[:, near], objective.names, constraint=constraint)

    def by_logarithm(branch: Branch, u: Array, output_slopes: Array) -> Array:
        """Return how the logarithm of the power of a knee changes with parameters, (k,)."""
        lever_V, current_mA, *_ = shown_at_knee_by_parameter(branch, u, output_slopes)
        knee = branch.need_knee()
        return np.asarray(lever_V / knee.lever_V + current_mA / knee.current_mA)

    gradient = by_logarithm(own, own.u, surrogate.by_parameter)
    gradient -= by_logarithm(vacuum, vacuum.u[near], slopes)
    return float(standard_errors(gradient[objective.columns], solution.posterior.covariance))


def tip_by_bias(
    solution: Solution,
    samples: int = 0,
    at_V: float | None = None,
    progress: Progress | None = None,
) -> tuple[TipTable, list[Jump], str]:
    """Return the tip temperature of an estimated lever with its error, over the measured range.

    Parameters
    ----------
    solution : Solution
    samples : int
        Of the posterior, from which the credible interval is then taken; none by default.
    at_V : float, optional
        A bias that has a row.
    progress : callable, optional

    Returns
    -------
    table : TipTable
        At even biases, and more where the tip is steep, see `hotlever.estimate.tip_table`; the
        limits are as far away as the errors say, unless these do not hold.
    jumps : list of Jump
        Between measured rows.
    asymmetry : str
        Where the limits are from, if not from the errors.

    Raises
    ------
    InputError
        If samples are asked for of an estimate without priors, or the bias is not in the measured
        range.
    """
    probe, circuit, bias = solution.probe, solution.probe.circuit, _rows(solution, at_V)
    predicted = solution.predicted(bias)
    tip, slopes = predicted.values[TIP], predicted.slopes[TIP][:, solution.objective.columns]
    parts = solution.posterior.errors_by_source(slopes)
    stderr = total_error(parts)
    rise = tip - circuit.base_temperature_K
    parts["model"] = error_of_model(probe.surroundings, bias, rise)
    low, high, asymmetry = _credible_interval(
        solution, tip, stderr, parts["model"], samples, progress
    )
    jumps = jumps_of(solution.branch, circuit, *tips_in_contact(solution))
    for jump in jumps:
        here = jump.unknown(bias)
        low = np.where(here, np.minimum(low, jump.cold_K), low)
        high = np.where(here, np.maximum(high, jump.hot_K), high)
        either = here * (jump.hot_K - jump.cold_K) / (2.0 * BAND)
        parts["jump"] = np.hypot(parts.get("jump", 0.0), either)
    # nothing cools a tip below its base, as far as that is known
    coldest = circuit.base_temperature_K - BAND * parts.get("base temperature", 0.0)
    low = np.minimum(np.maximum(low, coldest), tip)
    more, budgets = dict[str, Array](), {"budget_K": parts}
    if probe.contact is not None:
        more, budgets["apex_budget_K"] = _at_the_contact(solution, predicted, parts)
    table = table_by_bias(circuit, bias, predicted.values[0], tip, budgets, (low, high), more)
    if not circuit.starts_cold:
        # the held supplies' part is within a coarse mesh's error
        branch = solution.branch
        swept = branch.x[-1] * branch.equations.observed(branch.x)[1]
        held = spline_through(branch.u, branch.equations.power(branch.x) - swept)
        total = table["power_mW"] + held(branch.read(circuit, bias).u)
        table = replace(table, columns={**table.columns, "total_power_mW": total})
    return table, jumps, asymmetry


def tips_in_contact(solution: Solution) -> tuple[Array, Array]:
    """Return biases (V) and tip temperatures (K) of the rows in contact, or all without a sample.

    They are those that lie on the branch of the lever.
    """
    residuals, tip = solution.residuals, solution.prediction.values[TIP]
    touching = np.ones(tip.size, dtype=bool)
    if residuals.distance_um is not None and solution.probe.contact is not None:
        touching = residuals.distance_um <= 0.0
    return residuals.bias[touching], tip[touching]


def _at_the_contact(
    solution: Solution, predicted: PredictionAtRest, of_tip: Mapping[str, Array]
) -> tuple[dict[str, Array], dict[str, Array]]:
    """Return columns of apex and surface, and the errors of the apex by source.

    What is left out of the model of the lever, and where it jumps, are those of the tip as far as
    the apex follows it.
    """
    columns: dict[str, Array] = {}
    of_apex: dict[str, Array] = {}
    base_K = solution.probe.circuit.base_temperature_K
    rise = predicted.values[TIP] - base_K
    for name, of in OF_A_CONTACT.items():
        row = list(FITTED).index(name)
        slopes = predicted.slopes[row][:, solution.objective.columns]
        parts = solution.posterior.errors_by_source(slopes)
        risen = predicted.values[row] - base_K
        share = np.divide(risen, rise, out=np.zeros_like(rise), where=rise != 0.0)
        parts |= {source: share * error for source, error in of_tip.items() if source not in parts}
        # by so much the resistances of tip and sample differ from full 3-D (benchmarks/contact.py)
        parts["model"] = np.hypot(parts["model"], 0.022 * share * (1.0 - share) * rise)
        columns |= {of.name: base_K + risen, of.name.replace("_K", "_stderr_K"): total_error(parts)}
        of_apex = of_apex or parts
    return columns, of_apex


def measured_range(solution: Solution) -> Array:
    """Return even biases (V) over the measured range, as far as the lever has states."""
    lowest, highest = limits_of_range(solution.problem.measurement, solution.probe)
    return np.linspace(lowest, min(highest, highest_bias(solution)), 101)


def limits_of_range(measured: Measurement, probe: Probe) -> tuple[float, float]:
    """Return the lowest and the highest bias (V) at which a heated lever was measured."""
    # without a bias nothing is known of a lever that is cold then
    heated = measured.bias_V > probe.lowest_bias_V
    present = measured.bias_V[np.isfinite(measured.current(probe.circuit)) & heated]
    return float(present.min()), float(present.max())


def check_in_range(at_V: float | None, lowest_V: float, highest_V: float) -> None:
    """Refuse a bias of the uncertainty budget out of a range."""
    if at_V is not None and not lowest_V <= at_V <= highest_V:
        raise InputError(
            f"an uncertainty budget at {at_V:.4g} V: expected a bias in the measured range, from "
            f"{lowest_V:.4g} to {highest_V:.4g} V"
        )


def _rows(solution: Solution, at_V: float | None) -> Array:
    """Return the biases (V) of the table: even ones, more where the tip rises steeply, and one."""
    even, branch = measured_range(solution), solution.branch
    fine = np.linspace(even[0], even[-1], 10_001)
    tip = branch.tip_K(branch.read(solution.probe.circuit, fine).u)
    rows = with_steep_rows(even, fine, tip)
    check_in_range(at_V, *even[[0, -1]])
    return rows if at_V is None else np.union1d(rows, at_V)


def highest_bias(solution: Solution) -> float:
    """Return the highest bias (V) up to the highest measured one at which the lever has a state."""
    measured = float(solution.residuals.bias.max())
    return solution.branch.highest_bias(solution.probe.circuit, measured)


# --- how sure it is -----------------------------------------------------------------------------


def error_of_model(around: Surroundings, bias: Array, rise: Array) -> Array:
    """Return by how much the tip may be off since the model is (K); most where the tip is steep."""
    # a rise that grows as the square of the bias is that of a lever of constant properties; where
    # it is no steeper the flat lever, or air as panels, differ from full 3-D by this share of it
    # (benchmarks/air.py)
    square, size = np.abs(0.5 * bias * np.gradient(rise, bias)), np.abs(rise)
    error = (7e-4 if around.medium == "air" else 3e-4) * np.maximum(size, square)
    if around.medium == "air" and around.accommodation is None:
        # the jump of the air's temperature at surfaces: with an accommodation of 0.9 air takes up
        # 6 % less, more where the lever is narrow, and an estimate without it is off by so much
        # (rms of six simulated levers from number 1000 on, of both shapes, linearised)
        error = np.hypot(error, 7e-3 * size)
    return np.asarray(error)


def _credible_interval(
    solution: Solution,
    tip: Array,
    stderr: Array,
    of_model: Array,
    samples: int,
    progress: Progress | None,
) -> tuple[Array, Array, str]:
    """Return what 95 % of the tip temperatures lie between (K), and words on where that is from."""
    posterior, informed, too_few = solution.posterior, solution.objective.informed, ""
    if samples:
        if not informed:
            raise InputError("posterior: expected priors, without which it is not that of a fit")
        # what samples takes a second to load, for which few calibrations have to wait
        from hotlever.estimate.sampling import sample_tip

        sampled = sample_tip(posterior, solution.predictor, samples=samples, progress=progress)
        if sampled.enough:
            return *sampled.profile.credible_interval(tip, stderr, of_model), sampled.note
        too_few = sampled.note
    profile = profile_of_tip(posterior, solution.predictor.experiment) if informed else None
    if profile is None or profile.linear:
        away = BAND * np.hypot(stderr, of_model)
        return tip - away, tip + away, too_few
    low, high = profile.credible_interval(tip, stderr, of_model)
    note = (
        "the tip temperature is not a linear function of what is unknown, so that its limits come "
        f"from estimates of hotter and colder levers: at {tip[-1]:.0f} K 95 % lie from "
        f"{low[-1]:.0f} to {high[-1]:.0f} K"
    )
    return low, high, "; ".join(filter(None, (too_few, note)))


# --- where a lever jumps ------------------------------------------------------------------------


@dataclass(frozen=True)
class Jump:
    """A jump of a slow ramp of the bias.

    Attributes
    ----------
    from_V, to_V : float
        The measured biases between which it was.
    cold_K, hot_K : float
        Tip temperatures before and after it.
    """

    from_V: float
    to_V: float
    cold_K: float
    hot_K: float

    @property
    def note(self) -> str:
        """What a user should know of it."""
        return (
            f"between biases of {self.from_V:.4g} and {self.to_V:.4g} V the lever jumps from a tip "
            f"at {self.cold_K:.0f} K to {self.hot_K:.0f} K; the data do not say where"
        )

    def unknown(self, bias: Array) -> Array:
        """Return at which biases (V), (n,), the tip may be on either side."""
        return np.asarray((bias > self.from_V) & (bias < self.to_V))


def jumps_of(branch: Branch, circuit: Circuit, bias: Array, tip_K: Array) -> list[Jump]:
    """Return the jumps of a lever between measured rows, by their bias (V) and tip (K), (n,)."""
    if not bias.size or not circuit.starts_cold:
        return []
    jumps = []
    reading = branch.read(circuit, np.array([float(bias.max())]))
    for fold_V, cold_K in reading.jumps:
        beyond = branch.read(circuit, np.array([fold_V * (1.0 + 1e-6)]))
        hot_K = float(branch.tip_K(beyond.u[0]))
        if not np.isfinite(hot_K):
            continue
        hot = tip_K > 0.5 * (cold_K + hot_K)
        from_V = float(bias[~hot].max(initial=0.0))
        to_V = float(bias[hot].min(initial=float(bias.max())))
        jumps.append(Jump(min(from_V, fold_V), max(to_V, fold_V), cold_K, hot_K))
    return jumps


def not_of_a_ramp(branch: Branch, circuit: Circuit, bias: Array, tip_K: Array) -> str:
    """Say that rows lie where a slow ramp of the bias does not come; empty if they do not."""
    aside = np.abs(branch.tip_K(branch.read(circuit, bias).u) - tip_K) > 20.0
    # one or two beside a jump may
    if aside.sum() < 3:
        return ""
    return (
        f"the lever that comes nearest jumps, and its rows from {bias[aside].min():.3g} to "
        f"{bias[aside].max():.3g} V lie on another part of its branch than a ramp takes"
    )
