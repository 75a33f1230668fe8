"""Profile likelihoods: how much worse a fit gets as a quantity is moved off its optimum.

A quantity is moved by a further datum (`hotlever.estimate.objective.Penalty`), and all parameters
are estimated anew; the rise ΔS of the sum of squares says how many standard errors away it is. A
calibration asks so for the tip temperature, a fit for each of its parameters.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from hotlever.datasets import labelled
from hotlever.errors import ComputationError, HotleverError, InputError
from hotlever.estimate.experiment import TIP, Experiment, Prediction, Predictor, experiment_of
from hotlever.estimate.objective import EstimatedQuantity, Objective, Penalty, Subproblem
from hotlever.estimate.optimiser import Optimiser
from hotlever.estimate.over_a_sample import with_distances
from hotlever.estimate.posterior import Posterior
from hotlever.probe.probe_parameters import parameter_of, usual_parameters
from hotlever.text import BAND
from hotlever.types import Array, Index

if TYPE_CHECKING:
    import xarray as xr

    from hotlever.estimate.estimate import Estimate

#: Confidence levels whose intervals are read off the profile of a parameter.
LEVELS = (0.68, 0.95)


# --- the tip temperature ------------------------------------------------------------------------


@dataclass(frozen=True)
class ErrorProfile:
    """Standard errors of the tip temperature on either side, as multiples of the linearised one.

    Attributes
    ----------
    tip_K : ndarray, shape (k,)
        Rising.
    below, above : ndarray, shape (k,)
    """

    tip_K: Array
    below: Array
    above: Array

    @property
    def linear(self) -> bool:
        """Whether the linearised error is right within a quarter everywhere."""
        return bool(np.abs(np.log([self.below, self.above])).max() < np.log(1.25))

    def credible_interval(
        self, tip_K: Array, stderr_K: Array, other_K: Array
    ) -> tuple[Array, Array]:
        """Return what 95 % of the tip temperatures lie between (K).

        The profile is that of the linearised error `stderr_K`; an `other_K` is the same either way.
        """
        below, above = (np.interp(tip_K, self.tip_K, side) for side in (self.below, self.above))
        low, high = (BAND * np.hypot(side * stderr_K, other_K) for side in (below, above))
        return tip_K - low, tip_K + high


def profile_of_tip(
    posterior: Posterior,
    experiment: Experiment,
    *,
    distance: float = 2.0,
    most_solved: int = 3,
    closeness: float = 0.3,
    least_rise: float = 0.25,
    narrowest: float = 0.6,
) -> ErrorProfile:
    """Move the tip temperature of an estimate with priors away from its optimum.

    On either side the lever is solved whose tip is moved away where it is hottest; what is near it
    serves the other biases. What the optimum tells of levers so far away does not hold where
    parameters make up for each other along a bent valley. Where no such lever is found the
    linearised error is kept, and where nothing that is unknown moves the tip there is none.

    Parameters
    ----------
    posterior : Posterior
    experiment : Experiment
    distance : float
        How far the tip temperature is moved, in standard errors.
    most_solved : int
        Levers that are solved on each side at most.
    closeness : float
        One is near enough if the moved estimate is no further from it than this share of the way
        from the optimum: where levers were solved on until the sum of squares was known within 0.4,
        the standard error changed by 3 % at most.
    least_rise : float
        A rise of the sum of squares below which a side is open.
    narrowest : float
        No side is narrower than this share of the linearised error. Near a fold the search for a
        moved lever may end short of the nearest one, and its sum of squares rises by too much: one
        of 200 levers of which little is known was eleven of its errors off, on a side of a seventh.
    """
    objective, at, rows = posterior.objective, posterior.at, hotter_rows(posterior.at)
    least = objective.squares(at)
    tips = {number: EstimatedQuantity("tip", int(row)) for number, row in enumerate(rows)}
    moving = {number: tip for number, tip in tips.items() if posterior.of(tip)[1] > 0.0}
    sides = np.ones((2, rows.size))
    for side, way in enumerate((-1.0, 1.0) if moving else ()):
        away = way * distance
        penalised = [objective.penalised(_penalty(posterior, tip, away)) for tip in moving.values()]
        near = _solved_near(penalised[-1], posterior, experiment, most_solved, closeness)
        if near is None:
            continue
        for pulled, (number, tip) in zip(penalised, moving.items(), strict=True):
            there, _ = near.of(pulled).minimum()
            value, stderr = posterior.of(tip)
            moved = abs(tip.value(near.values_at(there), there) - value)
            rise = max(near.squares(there) - least, least_rise)
            sides[side, number] = max(moved / (stderr * np.sqrt(rise)), narrowest)
    return ErrorProfile(at.values[TIP, rows], *sides)


def _solved_near(
    penalised: Objective,
    posterior: Posterior,
    experiment: Experiment,
    most: int,
    closeness: float,
) -> Subproblem | None:
    """Solve the lever that a pulled objective leads to, and return what is near it.

    It is moved again from there until that moves it little; None if that does not end. No trial is
    rejected, as a search would: what is near a lever that lies too far off knows the way back. But
    where the second does not move it half as little as the first, both lead to each other.
    """
    objective, at = posterior.objective, posterior.at
    optimum = objective.point(at.probe)
    # lengths in standard errors of the parameters
    errors = np.sqrt(np.diag(posterior.covariance)) / objective.coordinates.rates(optimum)
    near, last = Subproblem(objective, at), float("inf")
    for count in range(most + 1):
        there, _ = near.of(penalised).minimum()
        step_length = float(np.linalg.norm((there - near.origin) / errors))
        moved = np.linalg.norm((near.origin - optimum) / errors)
        if count and step_length < closeness * moved:
            return near
        if count > 1 and step_length > 0.5 * last:
            return None
        last = step_length
        if count < most:
            try:
                solved = experiment.predict(objective.at(near.at.probe, there), near.at)
            except HotleverError:  # it melts below the highest bias, or cannot be drawn
                return None
            near = Subproblem(objective, solved)
    return None


def _penalty(posterior: Posterior, tip: EstimatedQuantity, away: float) -> Penalty:
    """Return a datum that moves an estimate by so many standard errors, if everything is linear.

    It is twice as far away, with the error that the tip is known by: the estimate moves half way.
    """
    value, stderr = posterior.of(tip)
    return Penalty(tip, value + 2.0 * away * stderr, stderr)


def hotter_rows(at: Prediction, count: int = 3) -> Index:
    """Return the rows of the data at which limits are looked for, the hottest last."""
    order = np.argsort(at.values[TIP])
    return order[np.linspace(order.size / 2, order.size - 1, count).astype(int)]


# --- the parameters of a fit --------------------------------------------------------------------


def profile_likelihood(
    result: Estimate,
    name: str,
    *,
    points: int = 11,
) -> xr.Dataset:
    """Hold one parameter at values around its optimum and fit the others again.

    Parameters
    ----------
    result : Estimate
    name : str
        A parameter that was varied.
    points : int
        Odd; values from 2.5 standard errors below to as many above the optimum, within the
        parameter's bounds. More are added on a side where the 95 % interval stays open.

    Returns
    -------
    xarray.Dataset
        On the dimension ``point``: ``value``, ``delta_chi_square`` (in units of the fit's own
        noise variance; what priors add is included), ``parabola`` (what the standard error alone
        says; NaN without one), and ``refitted`` (parameter, point). On (level, side):
        ``interval``, NaN where it is open. ``notes`` says in words which sides are open and why.

    Raises
    ------
    InputError
        If the parameter does not exist or was fixed, it is the only one varied, `points` is too
        small or even, or the data have no scatter or are not described.
    ComputationError
        If the lever cannot be solved at the optimum.
    """
    result.measurement.need_rest("a profile")
    result.need_described("a profile")
    parameter = parameter_of(result.probe, name)
    if name not in result.names or len(result.names) < 2:
        raise InputError(
            f"no profile of {name}: expected one of several parameters that the fit varied "
            f"({', '.join(result.names)})"
        )
    if points < 5 or points % 2 == 0:
        raise InputError(f"found points = {points}, expected an odd number of 5 or more")
    if not result.sum_of_squares > 0:
        raise InputError("the fit meets its data exactly: without scatter nothing tells how sure")
    quantity = EstimatedQuantity("parameter", result.names.index(name))
    names = tuple(dict.fromkeys([*usual_parameters(result.probe), *result.names]))
    objective = result.objective(names)
    residuals = objective.residuals
    # exact to first order at the optimum, and used as it is from there
    experiment = experiment_of(result.probe, residuals.bias, names=names, reduce=True)
    experiment = with_distances(experiment, result.probe, residuals.distance_um)
    experiment, at_optimum = experiment.exact_at(result.probe)
    # with priors, residuals are in standard deviations
    variance = 1.0 if objective.informed else _noise_variance(result, name, residuals.size)
    least = objective.squares(at_optimum) if objective.informed else result.sum_of_squares
    value, stderr = result.parameters[name].value, result.parameters[name].stderr
    # without a standard error, a tenth of the bounds' distance is a step as good as any
    step = (stderr or 0.1 * (parameter.upper - parameter.lower)) * 2.5 / (points // 2)
    rows = {value: (0.0, result.probe.values(result.names))}
    reasons: dict[str, str] = {}
    longer_steps = 6  # that are added on a side until the interval closes
    for side, sign, way, bound in (
        ("lower", -1.0, "down", parameter.lower),
        ("upper", 1.0, "up", parameter.upper),
    ):
        distance = 0.0
        near: Prediction = at_optimum
        for count in range(1, points // 2 + longer_steps + 1):
            distance += step * 2.0 ** max(0, count - points // 2)
            target = value + sign * distance
            if sign * (target - bound) >= 0:
                reasons[side] = f"{way} to its bound {bound:g}"
                break
            # held within a thousandth of a step
            penalised = objective.penalised(Penalty(quantity, target, 1e-3 * step))
            try:
                start = near.probe.replace({name: target})
                predictor = Predictor(experiment, near=near)
                near = Optimiser(penalised, predictor).solve(start).prediction
            except ComputationError:
                reasons[side] = f"as far as the lever can be solved ({target:.4g} cannot)"
                break
            delta = (objective.squares(near) - least) / variance
            rows[target] = delta, near.probe.values(result.names)
            if count >= points // 2 and delta > chdtri(1, 1.0 - LEVELS[-1]):
                break
        else:
            reasons[side] = f"as far as it was followed ({target:.4g})"
    return _dataset(result, name, dict(sorted(rows.items())), reasons)


def _noise_variance(result: Estimate, name: str, size: int) -> float:
    """Return what the sum of squares knows of the noise, corrected by the standard error."""
    variance = result.sum_of_squares / max(size - len(result.names), 1)
    number, stderr = result.names.index(name), result.parameters[name].stderr
    common = result.common_noise_covariance[number, number]
    return variance * (1.0 if stderr is None else float(stderr**2 / common))


def _dataset(
    result: Estimate, name: str, rows: dict[float, tuple[float, Array]], reasons: dict[str, str]
) -> xr.Dataset:
    optimum = result.parameters[name]
    values = np.array(list(rows))
    delta = np.array([delta for delta, _ in rows.values()])
    interval = np.array([_interval(values, delta, optimum.value, level) for level in LEVELS])
    sides = ["lower", "upper"]
    notes = [
        f"{name}: the {100 * level:.0f} % interval is open on the {side} side: the data do not "
        f"exclude values {reasons[side]}"
        for level, ends in zip(LEVELS, interval, strict=True)
        for side, end in zip(sides, ends, strict=True)
        if np.isnan(end)
    ]
    stderr = np.nan if optimum.stderr is None else optimum.stderr
    refitted = np.transpose([parameters for _, parameters in rows.values()])
    others = [number for number, other in enumerate(result.names) if other != name]
    return labelled(
        {
            "delta_chi_square": delta,
            "parabola": ((values - optimum.value) / stderr) ** 2,
            "refitted": (("parameter", "point"), refitted[others]),
            "interval": (("level", "side"), interval),
        },
        "point",
        {
            "value": ("point", values),
            "parameter": [result.names[number] for number in others],
            "level": list(LEVELS),
            "side": sides,
        },
        quantity=name,
        lever=result.probe.title,
        optimum=optimum.value,
        notes="\n".join(notes),
    )


def _interval(values: Array, delta: Array, optimum: float, level: float) -> tuple[float, float]:
    """Read an interval off a profile; NaN for a side where it does not close."""
    # the root of a parabola is a straight line, on which interpolation is exact
    height, limit = np.sqrt(np.maximum(delta, 0.0)), np.sqrt(chdtri(1, 1.0 - level))

    def crossing(side: NDArray[np.bool_], outwards: int) -> float:
        x, y = values[side][::outwards], height[side][::outwards]
        beyond = np.flatnonzero(y >= limit)
        if not beyond.size:
            return float("nan")
        after = beyond[0]
        return float(np.interp(limit, y[after - 1 : after + 1], x[after - 1 : after + 1]))

    return crossing(values <= optimum, -1), crossing(values >= optimum, 1)
