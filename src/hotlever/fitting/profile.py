"""Profile likelihoods: how much worse the fit gets as one parameter is held off its optimum."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.stats import chi2

from hotlever import __version__
from hotlever.errors import ComputationError, InputError
from hotlever.fitting.fit import Fit, fit
from hotlever.fitting.models import FastModel
from hotlever.lever.lever import Lever
from hotlever.lever.reduced_cache import cached_reduction
from hotlever.materials import PARAMETERS, Material, parameter
from hotlever.probe import Probe

Array = NDArray[np.float64]

#: Confidence levels whose intervals are read off a profile.
LEVELS = (0.68, 0.95)
#: Standard errors that the first points span on each side.
_REACH = 2.5
#: Longer and longer steps that are added on a side until the interval closes.
_MORE_STEPS = 6


class _Confirmed:
    """A fast model that was confirmed at the optimum, and is used as it is from there on."""

    def __init__(self, model: FastModel) -> None:
        self.predict = model.predict

    def confirm(self, material: Material, bias: Array) -> Array:
        """Return zeros (3, n)."""
        return np.zeros((3, bias.size))


def profile_likelihood(
    result: Fit,
    name: str,
    *,
    points: int = 11,
    lever: Lever | None = None,
    progress: Callable[[int, int], None] | None = None,
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
    lever : Lever, optional
        The fitted probe on the default mesh, by default.
    progress : callable, optional
        Called with the values done and how many are planned.

    Returns
    -------
    xarray.Dataset
        On the dimension ``point``: ``value``, ``delta_chi_square`` (in units of the fit's own
        noise variance), ``parabola`` (what the standard error alone says; NaN without one), and
        ``refitted`` (parameter, point). On (level, side): ``interval``, NaN where it is open.
        ``notes`` says in words which sides are open and why.

    Raises
    ------
    InputError
        If the parameter does not exist or was fixed, it is the only one varied, or `points` is
        too small or even.
    ComputationError
        If the lever cannot be solved at the optimum.
    """
    known = parameter(name)
    if name not in result.names or len(result.names) < 2:
        raise InputError(
            f"no profile of {name}: expected one of several parameters that the fit varied "
            f"({', '.join(result.names)})"
        )
    if points < 5 or points % 2 == 0:
        raise InputError(f"found points = {points}, expected an odd number of 5 or more")
    profile = _Profile(result, name, lever or Lever(result.probe))
    optimum = result.parameters[name]
    # without a standard error, a tenth of the bounds' distance is a step as good as any
    step = (optimum.stderr or 0.1 * (known.upper - known.lower)) * _REACH / (points // 2)
    rows: dict[float, tuple[float, Material]] = {
        optimum.value: (profile.at_optimum, result.probe.material)
    }
    reasons: dict[str, str] = {}
    for side, sign in (("lower", -1.0), ("upper", 1.0)):
        bound = known.lower if sign < 0 else known.upper
        material, distance = result.probe.material, 0.0
        for count in range(1, points // 2 + _MORE_STEPS + 1):
            distance += step * 2.0 ** max(0, count - points // 2)
            value = optimum.value + sign * distance
            if sign * (value - bound) >= 0:
                reasons[side] = (
                    f"down to its bound {bound:g}" if sign < 0 else (f"up to its bound {bound:g}")
                )
                break
            try:
                squares, material = profile.refit(value, material)
            except ComputationError:
                reasons[side] = f"as far as the lever can be solved ({value:.4g} cannot)"
                break
            rows[value] = (squares, material)
            if progress is not None:
                progress(len(rows), max(points, len(rows)))
            if count >= points // 2 and profile.delta(squares) > chi2.ppf(LEVELS[-1], 1):
                break
        else:
            reasons[side] = f"as far as it was followed ({value:.4g})"
    return _dataset(result, name, profile, dict(sorted(rows.items())), reasons)


class _Profile:
    """Fits with one parameter held."""

    def __init__(self, result: Fit, name: str, lever: Lever) -> None:
        self._result, self._name = result, name
        model = FastModel(lever, cached_reduction(lever))
        model.confirm(lever.probe.material, self._used_bias())
        self._model = _Confirmed(model)
        self.at_optimum = result.sum_of_squares
        data = int(np.count_nonzero(result.data_weights))
        variance = self.at_optimum / max(data - len(result.names), 1)
        # what the sum of squares knows of the noise, corrected by what the standard error knows
        place, stderr = result.names.index(name), result.parameters[name].stderr
        common = result.common_noise_covariance[place, place]
        self._variance = variance * (1.0 if stderr is None else float(stderr**2 / common))

    def delta(self, squares: float) -> float:
        """Return Δχ² of a sum of scaled squares."""
        return (squares - self.at_optimum) / self._variance

    def refit(self, value: float, start: Material) -> tuple[float, Material]:
        """Fit all but the parameter at `value`; return the sum of scaled squares and where."""
        held = {name: getattr(start, name) for name in PARAMETERS if name not in self._result.names}
        probe = self._result.probe.model_copy(update={"material": start})
        refitted = fit(
            self._result.measurement,
            probe,
            observables=self._result.observables,
            fixed={**held, self._name: value},
            drift=self._result.drift,
            data_weights=self._result.data_weights,
            model=self._forward,
        )
        return refitted.sum_of_squares, refitted.probe.material

    def _forward(self, probe: Probe) -> _Confirmed:
        return self._model

    def _used_bias(self) -> Array:
        measurement = self._result.measurement
        data = np.stack([measurement.observable(name) for name in self._result.observables])
        return measurement.bias_V[np.isfinite(data).any(axis=0)]


def _dataset(
    result: Fit,
    name: str,
    profile: _Profile,
    rows: dict[float, tuple[float, Material]],
    reasons: dict[str, str],
) -> xr.Dataset:
    known, optimum = parameter(name), result.parameters[name]
    values = np.array(list(rows))
    delta = np.array([profile.delta(squares) for squares, _ in rows.values()])
    interval = np.array([_interval(values, delta, optimum.value, level) for level in LEVELS])
    sides = ("lower", "upper")
    notes = [
        f"{name}: the {100 * level:.0f} % interval is open on the {side} side: the data do not "
        f"exclude values {reasons[side]}"
        for level, ends in zip(LEVELS, interval, strict=True)
        for side, end in zip(sides, ends, strict=True)
        if np.isnan(end)
    ]
    stderr = np.nan if optimum.stderr is None else optimum.stderr
    others = [other for other in result.names if other != name]
    data = xr.Dataset(
        {
            "delta_chi_square": ("point", delta),
            "parabola": ("point", ((values - optimum.value) / stderr) ** 2),
            "refitted": (
                ("parameter", "point"),
                [[getattr(material, other) for _, material in rows.values()] for other in others],
            ),
            "interval": (("level", "side"), interval),
        },
        coords={
            "value": ("point", values),
            "parameter": others,
            "level": ("level", list(LEVELS)),
            "side": list(sides),
        },
        attrs={
            "parameter": name,
            "optimum": optimum.value,
            "notes": "\n".join(notes),
            "software": f"hotlever {__version__}",
        },
    )
    for column, unit, text in (
        ("value", known.unit, known.meaning),
        ("delta_chi_square", "1", "rise of chi-square with the other parameters refitted"),
        ("parabola", "1", "rise of chi-square by the standard error"),
        ("refitted", "of the parameter", "optimum of the other parameters"),
        ("interval", known.unit, "profile confidence interval"),
        ("level", "1", "confidence level"),
    ):
        data[column].attrs = {"units": unit, "long_name": text}
    return data


def _interval(values: Array, delta: Array, optimum: float, level: float) -> tuple[float, float]:
    """Read an interval off a profile; NaN for a side where it does not close."""
    # the root of a parabola is a straight line, on which interpolation is exact
    height, limit = np.sqrt(np.maximum(delta, 0.0)), np.sqrt(chi2.ppf(level, 1))

    def crossing(side: NDArray[np.bool_], outwards: int) -> float:
        x, y = values[side][::outwards], height[side][::outwards]
        beyond = np.flatnonzero(y >= limit)
        if not beyond.size:
            return float("nan")
        after = beyond[0]
        return float(np.interp(limit, y[after - 1 : after + 1], x[after - 1 : after + 1]))

    return crossing(values <= optimum, -1), crossing(values >= optimum, 1)
