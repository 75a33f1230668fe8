"""Profile likelihoods: how much worse the fit gets as one parameter is held off its optimum."""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.special import chdtri

from hotlever.datasets import labelled
from hotlever.errors import ComputationError, InputError
from hotlever.estimation.experiment import Experiment, experiment_of
from hotlever.estimation.objective import Objective
from hotlever.estimation.optimiser import Optimiser
from hotlever.estimation.residuals import Residuals
from hotlever.estimation.result import Fit
from hotlever.probe import Probe
from hotlever.probe.parameters import parameter_of, usual_parameters
from hotlever.types import Array

#: Confidence levels whose intervals are read off a profile.
LEVELS = (0.68, 0.95)
#: Standard errors that the first points span on each side.
_REACH = 2.5
#: Longer and longer steps that are added on a side until the interval closes.
_MORE_STEPS = 6


def profile_likelihood(
    result: Fit,
    name: str,
    *,
    points: int = 11,
) -> xr.Dataset:
    """Hold one parameter at values around its optimum and fit the others again.

    Parameters
    ----------
    result : Fit
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
    known = parameter_of(result.probe, name)
    if name not in result.names or len(result.names) < 2:
        raise InputError(
            f"no profile of {name}: expected one of several parameters that the fit varied "
            f"({', '.join(result.names)})"
        )
    if points < 5 or points % 2 == 0:
        raise InputError(f"found points = {points}, expected an odd number of 5 or more")
    if not result.sum_of_squares > 0:
        raise InputError("the fit meets its data exactly: without scatter nothing tells how sure")
    optimum, residuals = result.parameters[name], result.residuals()
    others = [other for other in result.names if other != name]
    model = _model(result, residuals)
    near = model.predict(result.probe)
    priors = result.known_before
    whole = Objective(residuals, result.probe, model.names, result.names, priors)
    # with priors, residuals are in standard deviations
    variance = 1.0 if whole.informed else _noise_variance(result, name, residuals.size)
    least = whole.squares(near) if whole.informed else result.sum_of_squares
    of_others = {one: prior for one, prior in priors.items() if one != name}

    def refit(value: float, start: Probe) -> tuple[float, Probe]:
        """Fit the others with the parameter at `value`; return Δχ² and where."""
        nonlocal near
        held = start.moved({name: value})
        objective = Objective(residuals, held, model.names, others, of_others)
        found = Optimiser(model, objective, near=near).solve(held)
        near = found.prediction
        return (whole.squares(near) - least) / variance, found.probe

    # without a standard error, a tenth of the bounds' distance is a step as good as any
    step = (optimum.stderr or 0.1 * (known.upper - known.lower)) * _REACH / (points // 2)
    rows = {optimum.value: (0.0, result.probe)}
    reasons: dict[str, str] = {}
    for side, sign, way, bound in (
        ("lower", -1.0, "down", known.lower),
        ("upper", 1.0, "up", known.upper),
    ):
        probe, distance = result.probe, 0.0
        for count in range(1, points // 2 + _MORE_STEPS + 1):
            distance += step * 2.0 ** max(0, count - points // 2)
            value = optimum.value + sign * distance
            if sign * (value - bound) >= 0:
                reasons[side] = f"{way} to its bound {bound:g}"
                break
            try:
                delta, probe = refit(value, probe)
            except ComputationError:
                reasons[side] = f"as far as the lever can be solved ({value:.4g} cannot)"
                break
            rows[value] = (delta, probe)
            if count >= points // 2 and delta > chdtri(1, 1.0 - LEVELS[-1]):
                break
        else:
            reasons[side] = f"as far as it was followed ({value:.4g})"
    return _dataset(result, name, dict(sorted(rows.items())), reasons)


def _model(result: Fit, residuals: Residuals) -> Experiment:
    """Return a model that is exact to first order at the optimum, and used as it is from there."""
    names = tuple(dict.fromkeys([*usual_parameters(result.probe), *result.names]))
    model = experiment_of(result.probe, residuals.bias, names=names, reduce=True)
    return model.confirmed(model.predict(result.probe))


def _noise_variance(result: Fit, name: str, size: int) -> float:
    """Return what the sum of squares knows of the noise, corrected by the standard error."""
    variance = result.sum_of_squares / max(size - len(result.names), 1)
    place, stderr = result.names.index(name), result.parameters[name].stderr
    common = result.common_noise_covariance[place, place]
    return variance * (1.0 if stderr is None else float(stderr**2 / common))


def _dataset(
    result: Fit,
    name: str,
    rows: dict[float, tuple[float, Probe]],
    reasons: dict[str, str],
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
    others = [other for other in result.names if other != name]
    refitted = np.transpose([probe.at(others) for _, probe in rows.values()])
    return labelled(
        {
            "delta_chi_square": delta,
            "parabola": ((values - optimum.value) / stderr) ** 2,
            "refitted": (("parameter", "point"), refitted),
            "interval": (("level", "side"), interval),
        },
        "point",
        {"value": ("point", values), "parameter": others, "level": list(LEVELS), "side": sides},
        quantity=name,
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
