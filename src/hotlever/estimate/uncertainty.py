"""How sure a fit is beyond its covariance: posterior, predictive band and profiles together.

In numbers for the fit file, and in words. A profile likelihood says how much worse a fit gets as a
parameter is moved off its optimum: by a further datum (`hotlever.estimate.objective.Penalty`), with
all others estimated anew; the rise ΔS of the sum of squares says how many standard errors away it
is.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.special import chdtri

from hotlever.datasets import labelled
from hotlever.errors import ComputationError, InputError
from hotlever.estimate.estimate import Estimate
from hotlever.estimate.experiment import Prediction, Predictor, experiment_of
from hotlever.estimate.objective import EstimatedQuantity, Penalty
from hotlever.estimate.sampling import BAND_QUANTILES, predictive_band, sample_posterior
from hotlever.estimate.search import Optimiser
from hotlever.files import json_text
from hotlever.materials.parameters import heading, scale_of
from hotlever.probe.probe_parameters import parameter_of, parameters_of, usual_parameters
from hotlever.processes import PROCESSORS, local_processes
from hotlever.text import BAND, aligned, with_unit
from hotlever.types import Array, Progress

#: Confidence levels whose intervals are read off the profile of a parameter.
LEVELS = (0.68, 0.95)


def profile_likelihood(result: Estimate, name: str, *, points: int = 11) -> xr.Dataset:
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
    experiment, at_optimum = experiment_of(
        result.probe, residuals.bias, names=names, reduce=True, distance_um=residuals.distance_um
    ).exact_at(result.probe)
    # with priors, residuals are in standard deviations
    variance = 1.0 if objective.informed else _noise_variance(result, name, residuals.size)
    least = objective.squares(at_optimum) if objective.informed else result.sum_of_squares
    value, stderr = result.parameters[name].value, result.parameters[name].stderr
    # without a standard error, a tenth of the bounds' distance is a step as good as any
    step = (stderr or 0.1 * (parameter.upper - parameter.lower)) * 2.5 / (points // 2)
    rows = {value: (0.0, result.probe.values(result.names))}
    reasons: dict[str, str] = {}
    longer_steps = 6  # that are added on a side until the interval closes
    # the noise is that of the optimum all along, or squares would not compare
    options = replace(residuals.numerics.search, scatter_rounds=0)
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
                near = Optimiser(penalised, predictor, options).solve(start).prediction
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


# --- all of it ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Uncertainty:
    """What was sampled and profiled of a fit.

    Attributes
    ----------
    fit : Estimate
    posterior, band : xarray.Dataset or None
        See `sample_posterior` and `predictive_band`.
    profiles : dict of str to xarray.Dataset
        By parameter; see `profile_likelihood`.
    """

    fit: Estimate
    posterior: xr.Dataset | None
    band: xr.Dataset | None
    profiles: dict[str, xr.Dataset]

    def statements(self) -> list[str]:
        """Say in words what the data leave open, and what that means for the tip temperature."""
        texts = []
        if self.posterior is not None:
            fewest = self.fit.options.numerics.trials.fewest_effective
            texts += _unsettled(self.posterior, fewest)
            error = self.posterior.attrs["surrogate_error_K"]
            if error > 1.0:
                texts.append(
                    f"the lever that was sampled is off by up to {error:.1f} K at the outermost "
                    "samples of the posterior"
                )
            for name in self.fit.names:
                texts += _about(self.fit, name, self.posterior[name].values.ravel())
        for profile in self.profiles.values():
            texts += profile.attrs["notes"].splitlines()
        if self.band is not None:
            low, *_, high = self.band.tip_K.values
            widest = int(np.argmax(high - low))
            texts.append(
                "the predicted tip temperature is uncertain by at most "
                f"{(high - low)[widest] / 2:.1f} K (half of the 95 % band, at "
                f"{self.band.bias.values[widest]:.3g} V), the model taken as exact"
            )
        return texts

    @property
    def quantities(self) -> dict[str, dict[str, Any]]:
        """What the posterior says of each quantity, by name, as it stands in a fit file."""
        quantities: dict[str, dict[str, Any]] = {}
        if self.posterior is None:
            return quantities
        for name in self.posterior.quantity.values.tolist():
            samples = self.posterior[name]
            values = np.percentile(samples, BAND_QUANTILES).tolist()
            quantities[name] = {
                "mean": samples.mean().item(),
                "standard_deviation": samples.std().item(),
                "quantiles": {
                    f"{q:g}": value for q, value in zip(BAND_QUANTILES, values, strict=True)
                },
                "unit": samples.attrs["units"],
            }
        return quantities

    def tables(self) -> Iterator[tuple[str, list[str], list[list[str]]]]:
        """Give the intervals of profiles and the quantiles of a posterior as tables."""
        if self.profiles:
            first = next(iter(self.profiles.values()))
            columns = ["profile likelihood"]
            for level in first.level.values:
                columns += [f"{100 * level:.0f} % from", "to"]
            rows = [
                [heading(name), *_cells(profile.interval.values.ravel(), name, "open")]
                for name, profile in self.profiles.items()
            ]
            yield "Confidence intervals of the profile likelihoods.", columns, rows
        if self.posterior is not None:
            quantities = self.quantities
            levels = next(iter(quantities.values()))["quantiles"]
            columns = ["posterior", *(f"{level} %" for level in levels)]
            rows = [
                [heading(name), *_cells(quantity["quantiles"].values(), name)]
                for name, quantity in quantities.items()
            ]
            count, worth = self.posterior.sizes["draw"], self.posterior.effective_sample_size.item()
            caption = f"Quantiles of {count} posterior samples, worth {worth:.0f} independent ones."
            yield caption, columns, rows

    def text(self) -> str:
        """Return the tables as lines of text."""
        tables = (aligned([columns, *rows]) for _, columns, rows in self.tables())
        return "\n".join(line for table in tables for line in table)

    def to_json(self) -> str:
        """Return the fit file with the keys ``posterior`` and ``profiles`` beside its own."""
        content = self.fit.content()
        if self.posterior is not None:
            content["posterior"] = {
                "samples": self.posterior.sizes["draw"],
                "seed": self.posterior.attrs["seed"],
                "noise": self.posterior.attrs["noise"],
                "effective_sample_size": round(self.posterior.effective_sample_size.item(), 1),
                "quantities": self.quantities,
            }
        if self.band is not None:
            content["posterior"]["band"] = {
                name.replace("bias", "bias_V"): self.band[name].values.tolist()
                for name in ("quantile", "bias", "tip_K", "power_mW", "tip_at_power_K")
            }
        if self.profiles:
            content["profiles"] = {
                name: {
                    "value": profile.value.values.tolist(),
                    "delta_chi_square": profile.delta_chi_square.values.tolist(),
                    "interval": {
                        f"{100 * level:.0f}": profile.interval.sel(level=level).values.tolist()
                        for level in profile.level.values
                    },
                    "notes": profile.attrs["notes"].splitlines(),
                }
                for name, profile in self.profiles.items()
            }
        return json_text({**content, "uncertainty_notes": self.statements()})


def examine(
    fit: Estimate,
    *,
    samples: int | None = None,
    profiles: bool = False,
    processes: int | None = None,
    sampling: Progress | None = None,
    banding: Progress | None = None,
    profiling: Progress | None = None,
) -> Uncertainty:
    """Sample the posterior of a fit, with its predictive band, and profile its parameters.

    Parameters
    ----------
    fit : Estimate
    samples : int, optional
        Of the posterior, at least; none by default.
    profiles : bool
        Whether to profile every parameter that the fit varied.
    processes : int, optional
        Started by spawn, if more than one: see `sample_posterior`. By default one for each
        processor.
    sampling, banding, profiling : callable, optional
        Called with the steps (for profiles: parameters) done and their number.

    Raises
    ------
    InputError
        If a number is too small, or profiles are asked for of the only varied parameter.
    ComputationError
        If no trial of the posterior finds a lever, a worker process dies, or the lever cannot be
        solved.
    """
    processes = processes or PROCESSORS
    curves, posterior, band = {}, None, None
    if profiles:
        tasks = [(fit, name) for name in fit.names]
        # some at a time, in processes of their own
        with local_processes(min(processes, len(tasks))) as run:
            results = run(profile_likelihood, tasks, profiling)
        curves = dict(zip(fit.names, results, strict=True))
    if samples is not None:
        posterior = sample_posterior(fit, samples=samples, processes=processes, progress=sampling)
        band = predictive_band(fit, posterior, progress=banding)
    return Uncertainty(fit, posterior, band, curves)


def _unsettled(posterior: xr.Dataset, fewest: int) -> list[str]:
    """Say that samples say too little, if they do."""
    effective = posterior.effective_sample_size.item()
    if effective >= fewest:
        return []
    return [
        f"the posterior is not settled: its samples are worth {effective:.0f} independent ones, "
        f"expected at least {fewest}; take more samples"
    ]


def _about(fit: Estimate, name: str, values: Array) -> list[str]:
    """Say whether a parameter is undetermined, or its interval not that of its standard error."""
    parameter, fitted = parameters_of(fit.probe)[name], fit.parameters[name]
    span = parameter.upper - parameter.lower
    undetermined = f"{name} is not determined by these data: its posterior"
    for bound in (parameter.lower, parameter.upper):
        # one tail of 95 % of the samples lies near a bound
        if np.mean(np.abs(values - bound) < 0.02 * span) > 0.025:
            return [f"{undetermined} reaches its bound {with_unit(f'{bound:g}', parameter.unit)}"]
    prior = fit.known.get(name)
    if prior is not None and np.std([*map(prior.deviation, values)]) > 0.9:
        return [f"{name} is as known before: these data do not tell"]
    if values.std() > 0.7 * span / np.sqrt(12.0):
        return [f"{undetermined} is about as wide as its bounds"]
    # two standard errors, nearly: the quantile of the normal distribution
    reach = BAND * (fitted.stderr or 0.0)
    expected = np.array([fitted.value - reach, fitted.value + reach])
    sampled = np.percentile(values, (2.5, 97.5))
    if not reach or np.abs(sampled - expected).max() <= 0.5 * reach:
        return []
    return [
        f"{name}: 95 % of the posterior lies between {sampled[0]:.4g} and {sampled[1]:.4g}, not "
        f"between {expected[0]:.4g} and {expected[1]:.4g} as its standard error says"
    ]


def _cells(values: Iterable[float], name: str, unknown: str = "") -> list[str]:
    return [unknown if np.isnan(value) else f"{value / scale_of(name):.4g}" for value in values]
