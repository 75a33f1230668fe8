"""Fits and calibrations: one act, by other priors.

What is known of a lever is brought up to date by all that was measured: by a fit, with flat priors
unless some are stated, to find its parameters; by a calibration, with the usual ones unless others
are, to find its tip temperature. Of a lever whose medium nobody knows both are tried, and it is
said which describes the data.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from typing import Any, get_args

import numpy as np

from hotlever.errors import ComputationError, HotleverError, InputError
from hotlever.estimate.diagnosis import outlier_notes
from hotlever.estimate.estimate import Estimate, read_fit
from hotlever.estimate.experiment import Model, Seen
from hotlever.estimate.knee import calibrated_by_rule
from hotlever.estimate.options import CalibrationOptions, FitOptions, chosen
from hotlever.estimate.problem import Problem
from hotlever.estimate.pulses import pulse_calibration
from hotlever.estimate.search import Solution, solve
from hotlever.estimate.tip_temperature import calibrated, check_in_range, limits_of_range
from hotlever.estimate.verdict import check_plausible, check_similar, doubt_of, no_ramp, verdict_on
from hotlever.measurement import Measurement, given_measurement
from hotlever.probe import Probe
from hotlever.probe.probe_parameters import of_materials, parameters_of
from hotlever.probe.surroundings import Medium
from hotlever.text import NOT_DETERMINED, value_with_error, with_unit
from hotlever.types import Progress


def fit(
    measurement: Measurement | str | os.PathLike[str],
    probe: Probe | str | os.PathLike[str] | None = None,
    options: FitOptions | None = None,
    *,
    model: Model | None = None,
    progress: Progress | None = None,
    seen: Seen | None = None,
    **choices: Any,
) -> Estimate:
    """Find the material parameters that make the model match a measurement.

    Gauss and Newton's steps within a trust region, with the exact Jacobian
    (`hotlever.estimate.search`).

    Parameters
    ----------
    measurement : Measurement or path
        Data, or a measurement file.
    probe : Probe or path, optional
        The reference probe by default. The measurement's series resistance, base temperature
        and medium win over the probe's. Its material is where the fit starts.
    options : FitOptions, optional
    model : callable, optional
        Makes the forward model of a probe at some biases or, in time, times (µs). By default a
        lever that is solved fast and confirmed and corrected by the full one.
    progress : callable, optional
        Called with solved sweeps and how many there usually are.
    seen : callable, optional
        Called with each `hotlever.estimate.experiment.Prediction` on the way, which comes nearer
        and nearer to the data.
    **choices
        Fields of `FitOptions`, such as ``fixed={"n_d": 3.3e17}``.

    Raises
    ------
    InputError
        If a name does not exist, an observable has no data, a fixed value is impossible, or
        there are fewer data than parameters.
    ComputationError
        If the lever cannot be solved at the start, or the fit does not converge.
    """
    options = chosen("fit", options or FitOptions(), choices)
    nominal = Probe.reference() if probe is None else Probe.coerce(probe)
    whole = given_measurement(measurement, nominal)

    def within(medium: Any) -> tuple[Solution, Estimate]:
        """Fit the lever in a medium."""
        problem = Problem.of(whole, nominal, replace(options, medium=medium), model=model)
        solution = solve(problem, progress, seen)
        return solution, _with_remarks(solution, Estimate.of(solution, *verdict_on(solution)))

    solution, result = in_medium(options.medium, within)
    # a search that has not come to its end contradicts nothing
    if result.describes_data is not False or result.in_time or "current" not in result.observables:
        return result
    problem, values = solution.problem, solution.prediction.values
    if problem.options.robust or not outlier_notes(solution.residuals, values, robust=False):
        cause = problem.causes.named()
    else:
        cause = "are the points far from the fit wrong ones? a robust fit (--robust) forgets them"
    return replace(result, reason=f"{result.reason}; {cause}")


def calibrate(
    measurement: Measurement | str | os.PathLike[str],
    *,
    probe: Probe | str | os.PathLike[str] | None = None,
    fit: Estimate | str | os.PathLike[str] | None = None,
    options: CalibrationOptions | None = None,
    progress: Progress | None = None,
    **choices: Any,
) -> Estimate:
    """Find the tip temperature of a lever from its I-V curve.

    What is known of the lever beforehand is brought up to date by all that was measured; with a
    power law the paper's rule is used instead (`hotlever.estimate.knee`).

    Parameters
    ----------
    measurement : Measurement or path
        With bias and current; reader voltages and tip temperatures count where they are.
    probe : Probe or path, optional
        A probe like the measured one; the reference probe by default.
    fit : Estimate or path, optional
        A fit of the measured lever itself, in vacuum or in air. Not together with `probe`. Its data
        count, not what it made of them.
    options : CalibrationOptions, optional
    progress : callable, optional
        Called with solved branches, then with steps of the sampler and followed pulses, and how
        many there usually are.
    **choices
        Fields of `CalibrationOptions`, such as ``medium="air"``.

    Raises
    ------
    InputError
        If the data cannot be those of the probe.
    ComputationError
        If no lever near the probe has states at all measured biases.
    """
    options = chosen("calibrate", options or CalibrationOptions(), choices)
    if (probe is not None) + (fit is not None) + (options.law is not None) > 1:
        raise InputError("a fit, a probe and a power law exclude each other")
    if fit is not None:
        fit = fit if isinstance(fit, Estimate) else read_fit(fit)
        fit.measurement.need_rest("a calibration with a fit")
        route, origin = f"fit in {fit.medium}", fit.probe
    else:
        route = "probe" if options.law is None else "power law"
        origin = Probe.reference() if probe is None else Probe.coerce(probe)
    whole = given_measurement(measurement, origin)
    whole.need_rest("a calibration")
    if np.isnan(whole.current(origin.circuit)).all():
        raise InputError(
            f"{whole.path}: no values of I_h, which a calibration needs beside V_b, or of "
            "V_bridge, of a probe with bridge_upper_ohm and bridge_lower_ohm in [circuit]"
        )
    if options.budget_of == "apex" and origin.contact is None:
        raise InputError(
            "an uncertainty budget of the apex: expected a probe in contact with a sample "
            "([contact] in the probe file)"
        )
    if options.law is not None or (options.medium == "vacuum" and whole.medium == "air"):
        options.need_none_of_the_rule()
        return calibrated_by_rule(whole, origin, options.law, route)
    if options.pulse is not None:
        origin.circuit.need_cold_start("a calibration for pulses")

    def within(medium: Any) -> tuple[Solution, Estimate]:
        """Calibrate the lever in a medium."""
        problem = Problem.of(whole, origin, replace(options.of_lever, medium=medium))
        causes = problem.causes
        check_plausible(problem)
        check_in_range(options.at_V, *limits_of_range(problem.measurement, problem.probe))
        if fit is None:
            check_similar(problem)
        try:
            if fit is None:
                # the search begins with the lever that its data are compared with before
                alone = problem.probe.circuit.starts_cold
                solution = solve(problem, progress, stated=causes.stated if alone else None)
            else:
                solution = fit.solve_beside(problem, options.priors, progress)
            converged, reason = verdict_on(solution)
            result = calibrated(
                solution,
                Estimate.of(solution, converged, reason or no_ramp(solution)),
                problem.measurement,
                options,
                route,
                progress,
            )
        except ComputationError as error:
            raise ComputationError(f"{error}; {causes.named(fit is not None)}") from error
        if result.reason and result.converged:
            cause = causes.named(fit is not None)
            result = replace(result, reason=f"{result.reason}; {cause}")
        notes = [*problem.notes, *result.notes]
        if result.describes_data and (doubt := doubt_of(solution)):
            notes.append(f"{doubt}; {causes.named(fit is not None)}")
        return solution, replace(result, notes=list(dict.fromkeys(notes)))

    solution, result = in_medium(options.medium, within)
    if options.pulse is None:
        return result
    if not result.describes_data:
        note = "the pulse was not followed, since it would be that of another lever"
        return replace(result, notes=[*result.notes, note])
    notes = list(result.notes)
    if "medium" in result.tip_table.budgets["budget_K"]:
        notes.append(f"the pulse is that of a lever in {result.medium}, and so are its errors")
    pulse = pulse_calibration(solution, options.pulse, progress)
    return replace(result, pulse=pulse, notes=notes)


# --- a medium that nobody knows -----------------------------------------------------------------


def in_medium(
    requested_medium: str | None, answered: Callable[[str | None], tuple[Solution, Estimate]]
) -> tuple[Solution, Estimate]:
    """Answer for a lever in the medium that is asked; if that is unknown, in the likelier one.

    Then a note says how well either describes the data; where both do, these do not tell which it
    is, and errors hold both.

    Parameters
    ----------
    requested_medium : str or None
        None is what measurement and probe say.
    answered : callable
        Return a solution in a medium, and the estimate that is read from it.

    Raises
    ------
    InputError, ComputationError
        If there is no such lever in any of them.
    """
    if requested_medium != "unknown":
        return answered(requested_medium)
    answers: dict[str, tuple[Solution, Estimate]] = {}
    failures: dict[str, HotleverError] = {}
    for medium in get_args(Medium):
        try:
            answers[medium] = answered(medium)
        except (InputError, ComputationError) as error:
            failures[medium] = error
    if not answers:
        raise next(iter(failures.values()))

    def unlikeliness(medium: str) -> tuple[bool, float]:
        # what describes the data comes first, and of two of a kind the more probable one
        solution, answer = answers[medium]
        return bool(answer.reason), solution.posterior.deviance

    best, *rest = sorted(answers, key=unlikeliness)
    texts = [f"in {medium} a lever {_how_well(answers[medium][1])}" for medium in (best, *rest)]
    texts += [f"in {medium} there is none: {error}" for medium, error in failures.items()]
    note = f"the medium is not known: {'; '.join(texts)}"
    solution, answer = answers[best]
    for other in (answers[medium][1] for medium in rest if not answers[medium][1].reason):
        answer = answer.in_either(other)
        note += "; the data do not tell which, and the errors of the tip temperature hold both"
    return solution, replace(answer, notes=[note, *answer.notes])


def _how_well(answer: Estimate) -> str:
    rms = answer.residual_rms.items()
    rms_text = ", ".join(f"{value:.2g} {name.rsplit('_', 1)[1]}" for name, value in rms)
    return f"{'does not describe' if answer.reason else 'describes'} the data (rms {rms_text})"


# --- what is said of the parameters of a fit ----------------------------------------------------


def _with_remarks(solution: Solution, estimate: Estimate) -> Estimate:
    """Return a fit with notes on its data, and on what these do not determine."""
    options, residuals, values = estimate.options, solution.residuals, solution.prediction.values
    notes = outlier_notes(residuals, values, options.robust)
    notes += residuals.drifting_zeros(values, solution.posterior.slopes)
    chi_square = residuals.errors.reduced_chi_square(
        residuals.own_difference(values), solution.posterior.leverage
    )
    if chi_square is not None:
        text = (
            f"the scatter about the fit is {np.sqrt(chi_square):.2f} times the measurement errors"
        )
        follow = not options.priors and estimate.describes_data
        notes.append(f"{text}; standard errors follow the scatter" if follow else text)
    return replace(estimate, notes=[*estimate.notes, *notes, *undetermined(estimate)])


def undetermined(fit: Estimate) -> list[str]:
    """Say in words what the data do not determine, and what that means for the tip temperature."""
    texts, declared = [], parameters_of(fit.probe, in_time=True)
    for name in fit.names:
        fitted, bounds = fit.parameters[name], declared[name].bounds
        if fitted.stderr is None:
            if fit.describes_data:
                texts.append(f"{name}: no standard error could be estimated")
        elif fitted.stderr >= abs(fitted.value):
            value = value_with_error(fitted.value, fitted.stderr, bounds=bounds)
            texts.append(
                f"{name} is not determined by these data: its standard error is larger than its "
                "value"
                if value == NOT_DETERMINED
                else f"{name} is only bounded by these data: {with_unit(value, fitted.unit)} (95 %)"
            )
        elif (share := fitted.stderr / abs(fitted.value)) > 0.15:
            texts.append(
                f"{name} is poorly determined by these data: its standard error is {share:.0%} of "
                "its value"
            )
    of_material = [name for name in of_materials(fit.probe, in_time=True) if name in fit.names]
    texts += [
        f"{name} ended at the bound of what it may be, "
        f"{with_unit(f'{bound:g}', declared[name].unit)}: these data would have it beyond"
        for name in of_material
        for bound in declared[name].bounds
        if abs(fit.parameters[name].value - bound) < 1e-3 * abs(bound)
    ]
    correlation = np.tril(fit.correlation, -1)
    texts += [
        f"{fit.names[second]} and {fit.names[first]} are hardly told apart by these "
        f"data (correlation {correlation[first, second]:+.2f})"
        for first, second in np.argwhere(np.abs(correlation) > 0.95)
    ]
    largest = float(np.fmax.reduce(fit.band_columns["tip_stderr_K"]))
    if texts and np.isfinite(largest):
        texts.append(
            "the tip temperature that follows has nevertheless a standard error of at most "
            f"{largest:.1f} K from the fitted parameters"
        )
    return texts
