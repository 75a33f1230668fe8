"""The verdict on data: whether they can be those of a lever, and whether an estimate shows them.

They are compared twice: before the search by the resistance of the cold lever, which needs none;
after it by what is left over, and by how far parameters are from their priors.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.special import chdtrc

from hotlever.errors import InputError
from hotlever.estimate.diagnosis import lack_of_fit_text, run_of_outliers
from hotlever.estimate.problem import Problem
from hotlever.estimate.search import Solution
from hotlever.estimate.tip_temperature import highest_bias, not_of_a_ramp, tips_in_contact
from hotlever.lever.branch import Reach
from hotlever.lever.lever import COARSE, Lever
from hotlever.lever.similar import SimilarLevers
from hotlever.measurement import Measurement
from hotlever.measurement.data import colder_than_base
from hotlever.probe import Probe
from hotlever.probe.priors import Prior
from hotlever.probe.probe_parameters import parameters_of

# --- before the search --------------------------------------------------------------------------


def check_plausible(problem: Problem) -> None:
    """Refuse data whose resistance at low bias, or whose temperatures, are far from the lever's.

    Raises
    ------
    InputError
        Saying what was compared, and the likeliest cause.
    """
    measured, probe, options = problem.measurement, problem.probe, problem.causes.options
    where = measured.path or "measurement"
    alone, size = probe.circuit.starts_cold, np.abs(measured.bias_V)
    current = measured.current(probe.circuit)
    here = np.isfinite(current) & (measured.bias_V > 0) & (current > 0)
    if not alone:
        # other supplies drive a current as well, which is known less well than what is added, and
        # which low biases hardly change
        here = np.isfinite(current) & (size > 0.05 * size.max())
    different = np.unique(measured.bias_V[here]).size
    if different < options.fewest_biases:
        above = " above 0" if alone else ""
        raise InputError(
            f"{where}: currents{above} at {different} different biases{above}, expected "
            f"{options.fewest_biases} or more"
        )
    _check_temperatures(measured, probe, where)
    bias, current = measured.bias_V[here], current[here]
    low = np.argsort(np.abs(bias))[: max(options.fewest_biases, bias.size // 8)]
    # what a cold lever shows does not depend on what is around it
    cold = probe.in_medium("vacuum") if alone else probe
    rest = Lever(cold, COARSE).branch_to(0.0)
    lever = float(rest.value_slopes[0, 0] / rest.value_slopes[0, 1])
    series = probe.circuit.series_kohm
    added = current[low] - rest.values[0, 1]
    cold_kohm = float(np.median(bias[low] / np.where(added == 0.0, np.nan, added)))
    ratio = cold_kohm / (lever + series)
    if cold_kohm > series and abs(np.log(ratio)) < np.log(options.cold_factor):
        return
    # an owner who knows little of a lever, or of the resistor, expects no less of them
    if alone:
        spread = options.shift * cold_resistance_spread(cold, problem.known)
        resistor = problem.known.get("series_resistance_ohm", Prior(1e3 * series, 0.0))
        least, most = (1e-3 * resistor.at(pull) for pull in (-options.shift, options.shift))
        if least + lever * np.exp(-spread) < cold_kohm < most + lever * np.exp(spread):
            return
    quantity = "V_b / I_h" if alone else "the change of V_b over that of I_h"
    cause = problem.causes.likeliest()
    if not cause and cold_kohm > 100.0 * (lever + series):
        cause = "hardly any current flows, as if a terminal was open or the meter at another one"
    cause = cause or "no single cause that is known explains it"
    raise InputError(
        f"{where}: {quantity} is {cold_kohm:.4g} kΩ at low bias, expected about "
        f"{lever + series:.4g} kΩ ({series:g} kΩ in series and {lever:.3g} kΩ of the lever): "
        f"{cause}"
    )


def check_similar(problem: Problem) -> None:
    """Refuse data that no lever like the probe is near to.

    Raises
    ------
    InputError
        Asking for what may be behind it: another drawing first.
    """
    if cause := problem.causes.of_another_lever():
        where = problem.measurement.path or "measurement"
        raise InputError(f"{where}: no lever like the probe shows such currents: {cause}")


def cold_resistance_spread(probe: Probe, priors: Mapping[str, Prior]) -> float:
    """Return the standard deviation of the logarithm of a cold lever's resistance by its priors."""
    lever = SimilarLevers(Lever(probe, COARSE))
    names = tuple(name for name in priors if name in parameters_of(probe))
    branch = lever.linearised(probe, Reach(probe.circuit, 0.0), names=names)
    first = int(branch.branch.solved[0])
    by = branch.output_slopes[first, :2] / branch.branch.values[first, :2, None]
    spreads = np.array([priors[name].absolute for name in names])
    return float(np.linalg.norm((by[0] - by[1]) * spreads))


def _check_temperatures(measured: Measurement, probe: Probe, where: str) -> None:
    """Refuse tips that are colder than the base of the lever."""
    base = probe.circuit.base_temperature_K
    colder = colder_than_base(measured.tip_K, measured.tip_error_K, base)
    if colder.any():
        row = int(np.argmax(colder))
        raise InputError(
            f"{where}: T_tip is {measured.tip_K[row]:.4g} K at {measured.bias_V[row]:.4g} V, "
            f"expected more than the base temperature, {base:g} K: is it in °C, or another column?"
        )


# --- after it -----------------------------------------------------------------------------------


def verdict_on(solution: Solution) -> tuple[bool, str]:
    """Return whether the search came to an end, and why the data are not described, if so.

    One that was ended far from describing the data, where another step would take less than half of
    the sum of squares away, has found that no such lever shows them.
    """
    reason = _misfit(solution)
    share = solution.decrement / max(solution.objective.squares(solution.prediction), 1e-300)
    if solution.converged or (reason and share < 0.5):
        return True, reason
    refused = solution.optimiser.refused
    beyond = f"; a lever on the way could not be solved: {refused}" if refused else ""
    return False, (
        f"the search was ended after {solution.predictor.evaluations} levers, before it converged: "
        f"another step would still lower the sum of squares by {share:.1%}{beyond}"
    )


def no_ramp(solution: Solution) -> str:
    """Say that a slow ramp of the bias does not lead along the data; empty if it does."""
    circuit, highest = solution.probe.circuit, highest_bias(solution)
    if reason := not_of_a_ramp(solution.branch, circuit, *tips_in_contact(solution)):
        return reason
    if highest < 0.98 * float(solution.residuals.bias.max()):
        return f"the lever that comes nearest has no steady state above {highest:.4g} V"
    return ""


def doubt_of(solution: Solution) -> str:
    """Say which parameter data that are described ask to be far from its prior; empty if none."""
    options = solution.residuals.numerics.diagnosis
    name, pull = _farthest(solution)
    if pull < options.doubtful_shift:
        return ""
    return f"the data are {pull:.1f} σ from what is known of {name}, {solution.priors[name].stated}"


def _farthest(solution: Solution) -> tuple[str, float]:
    """Return the parameter that data ask to be farthest from its prior, and how far (σ)."""
    shifts = solution.posterior.shifts
    name = max(shifts, key=lambda name: abs(shifts[name].pull), default="")
    return name, abs(shifts[name].pull) if name else 0.0


def _misfit(solution: Solution) -> str:
    """Return why data are not described by what was fitted to them; empty if they are.

    Without priors outliers stand for themselves: there is nothing that they contradict.
    """
    options = solution.residuals.numerics.diagnosis
    of_data = solution.residuals, solution.prediction.values
    reason = lack_of_fit_text(*of_data)
    if reason or not solution.problem.informed:
        return reason
    if reason := run_of_outliers(*of_data):
        return reason
    name, pull = _farthest(solution)
    if pull > options.shift:
        return (
            f"{name}, known as {solution.priors[name].stated}, would have to be another; the "
            f"data are {pull:.1f} σ from it"
        )
    # as many are free to be away as the data tell of
    shifts = solution.posterior.shifts
    dof = sum(each.contraction for each in shifts.values())
    squares = sum(each.size**2 for each in shifts.values())
    if dof > 0 and chdtrc(dof, squares) < options.shift_probability:
        most = sorted(shifts, key=lambda name: -abs(shifts[name].size))[:3]
        away = ", ".join(f"{name} by {shifts[name].size:+.1f} σ" for name in most)
        return f"what was known beforehand would have to be wrong by too much together, {away}"
    return ""
