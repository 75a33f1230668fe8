"""Samples of a posterior: estimates from drawn errors (JCGM 101), weighted, and what follows.

A trial draws errors of data and priors, ε, and looks for the estimate x that they lead to: with the
residuals r, in standard deviations, and an orthonormal basis Q of what their Jacobian J spans at
the optimum, Qᵀ r(x) = ε. Where r is linear these are samples of the posterior. Where it bends they
have the density ``exp(−½ |Qᵀ r|²) |det Qᵀ J|``, and each counts as much more as the posterior is
larger there (Bardsley, Solonen, Haario and Laine, SIAM J. Sci. Comput. 36, A1895 (2014)). Errors
are drawn from Student's t, whose tails are wider, so that no sample counts for too much.

With priors residuals count standard deviations. Without, their noise is unknown, with the prior
1/σ: trials draw it too. A parameter without a prior is uniform within its bounds; what the data
leave open is drawn from a normal distribution of that width.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Literal

import numpy as np
import xarray as xr
from scipy import optimize

from hotlever.datasets import labelled
from hotlever.errors import ComputationError, InputError
from hotlever.estimate.estimate import Estimate
from hotlever.estimate.experiment import TIP, ExperimentAtRest, Predictor, experiment_of, named
from hotlever.estimate.objective import EstimatedQuantity, Objective, Subproblem
from hotlever.estimate.options import TrialOptions
from hotlever.estimate.posterior import ErrorProfile, Posterior, hotter_rows
from hotlever.estimate.surrogate import ReducedSurrogate
from hotlever.lever.reduced_lever import ReducedLever
from hotlever.materials import full_name
from hotlever.probe import Probe
from hotlever.probe.probe_parameters import parameters_of, usual_parameters
from hotlever.processes import local_processes
from hotlever.text import BAND
from hotlever.types import Array, Progress
from hotlever.work import each

#: Quantiles (%) of a predictive band: median, 68 % and 95 %.
BAND_QUANTILES = (2.5, 16.0, 50.0, 84.0, 97.5)
#: One unknown noise scale for each observable, or one for all.
Noise = Literal["each", "common"]


class Trials:
    """Estimates from drawn errors near a lever.

    Parameters
    ----------
    near : Subproblem
        What levers near the optimum show.
    noise : {"each", "common"}
        What shares an unknown noise: the data of an observable, or all.
    options : TrialOptions

    Attributes
    ----------
    optimum : ndarray, shape (p,)
        The point about which trials are made: without priors that at which each noise is that of
        its own residuals.
    """

    def __init__(
        self, near: Subproblem, noise: Noise = "each", options: TrialOptions | None = None
    ) -> None:
        self.options = options or TrialOptions()
        self._near, self._objective = near, near.objective
        group = np.nonzero(self._objective.residuals.present)[0] * (noise == "each")
        self._group, self._counts = group, np.bincount(group)
        low, high = self._objective.bounds
        self._margin = 1e-6 * (high - low)
        uniform = ~self._objective.of_priors(near.origin).any(axis=0)
        self._wide = np.diag(math.sqrt(12.0) / (high - low))[uniform]
        self.optimum, self._squares = self._settled()

    def drawn(self, random: Any) -> tuple[Array, float]:
        """Return the estimate from drawn errors, (p,), and the logarithm of its weight."""
        size, tails = self.optimum.size, self.options.tails
        scale, log_density = self._drawn_noise(random)
        basis = np.linalg.qr(self._jacobian(self.optimum, scale))[0]
        errors = random.normal(size=size) * math.sqrt(tails / random.chisquare(tails))
        found = self._least_squares(
            lambda point: basis.T @ self._residual(point, scale) - errors,
            lambda point: basis.T @ self._jacobian(point, scale),
            self.optimum,
        )
        if np.linalg.norm(found.fun) > self.options.accuracy:
            return found.x, -math.inf
        errors = errors + found.fun
        log_density -= 0.5 * (tails + size) * math.log1p(float(errors @ errors) / tails)
        log_density += float(np.linalg.slogdet(found.jac)[1])
        residual = self._residual(found.x, scale)[: -len(self._wide) or None]
        posterior = -0.5 * float(residual @ residual) + self._objective.log_volume(found.x)
        return found.x, posterior + float(np.log(scale).sum()) - log_density

    def _drawn_noise(self, random: Any) -> tuple[Array, float]:
        """Return what residuals of data are multiplied by, and the logarithm of its density."""
        if self._objective.informed:
            return np.ones(self._group.size), 0.0
        # a parameter takes up a share of the noise of all data
        free = 1.0 - min(self.optimum.size / self._group.size, 0.9)
        free_data = np.maximum(self._counts * free, 1.0)
        drawn = random.chisquare(free_data)
        density = 0.5 * float(free_data @ np.log(drawn) - drawn.sum())
        return np.sqrt(drawn / self._squares)[self._group], density

    def _settled(self) -> tuple[Array, Array]:
        """Return the optimum if each noise is that of its own residuals, and their squares."""
        point = self._near.origin
        squares = self._squares_at(point)
        for _ in range(0 if self._objective.informed else self.options.rounds):
            scale, before = np.sqrt(self._counts / squares)[self._group], squares
            point = self._least_squares(
                partial(self._residual, scale=scale),
                partial(self._jacobian, scale=scale),
                point,
            ).x
            squares = self._squares_at(point)
            if np.abs(np.log(squares / before)).max() < self.options.accuracy:
                break
        return point, squares

    def _squares_at(self, point: Array) -> Array:
        """Return the sum of squares of each group; never zero, for its logarithm."""
        residual = self._near.residual(point)[: self._group.size]
        return np.maximum(np.bincount(self._group, residual**2), np.finfo(float).tiny)

    def _residual(self, point: Array, scale: Array) -> Array:
        """Return residuals of data, times a scale, of priors, and from the middle of wide ones."""
        residual = self._near.residual(point)
        residual[: scale.size] *= scale
        return np.concatenate([residual, self._wide @ (point - self._near.origin)])

    def _jacobian(self, point: Array, scale: Array) -> Array:
        """Return the derivatives of `_residual`."""
        jacobian = self._near.jacobian(point)
        jacobian[: scale.size] *= scale[:, None]
        return np.vstack([jacobian, self._wide])

    def _least_squares(
        self, residual: Callable[[Array], Array], jacobian: Callable[[Array], Array], start: Array
    ) -> Any:
        low, high = self._objective.bounds
        return optimize.least_squares(
            residual,
            np.clip(start, low + self._margin, high - self._margin),
            jacobian,
            (low, high),
            x_scale="jac",
            ftol=1e-3,
            xtol=1e-6,
            gtol=None,
            max_nfev=self.options.most_evaluations,
        )


def draw_samples(
    trials: Trials,
    count: int,
    *,
    processes: int = 1,
    seed: int = 0,
    progress: Progress | None = None,
) -> tuple[Array, float]:
    """Make trials, and draw samples that all count the same from them by their weights.

    Parameters
    ----------
    trials : Trials
        Picklable if `processes` is more than one.
    count, processes, seed, progress
        See `sample_posterior`.

    Returns
    -------
    points : ndarray, shape (count, p)
    effective : float
        How many independent ones they are worth: (Σw)² / Σw² of the trials' weights.

    Raises
    ------
    InputError
        If a number is too small.
    ComputationError
        If no trial finds an estimate or a worker process dies.
    """
    for name, value in (("samples", count), ("processes", processes)):
        if value < 1:
            raise InputError(f"found {name} = {value}, expected 1 or more")
    sizes = [
        len(some) for some in np.array_split(np.arange(count), -(-count // trials.options.block))
    ]
    *seeds, last = np.random.SeedSequence(seed).spawn(len(sizes) + 1)
    with local_processes(min(processes, len(sizes))) as run:
        blocks = run(_block, [(trials, *one) for one in zip(sizes, seeds, strict=True)], progress)
    points, logarithms = (np.concatenate(parts) for parts in zip(*blocks, strict=True))
    if not np.isfinite(logarithms).any():
        raise ComputationError(
            f"none of {count} trials of the posterior found a lever within the bounds of the "
            "parameters; fix those that the data do not determine"
        )
    weights = np.exp(logarithms - logarithms.max())
    weights /= weights.sum()
    # systematic resampling: each trial as often as its weight says, but for a fraction
    places = (np.arange(count) + np.random.default_rng(last).random()) / count
    chosen = np.searchsorted(np.cumsum(weights), places).clip(max=count - 1)
    return points[chosen], float(1.0 / (weights @ weights))


def _block(trials: Trials, count: int, seed: np.random.SeedSequence) -> tuple[Array, Array]:
    """Make some trials; return their points, (count, p), and the logarithms of their weights."""
    random = np.random.default_rng(seed)
    points, logarithms = zip(*(trials.drawn(random) for _ in range(count)), strict=True)
    return np.array(points), np.array(logarithms)


# --- a lever near the optimum -------------------------------------------------------------------


class SampledLever:
    """A lever near a fit's optimum, for samples: exact at a probe, cheap for others.

    Parameters
    ----------
    experiment : ExperimentAtRest
        Of a lever like it, reduced if it can be.
    probe : Probe

    Attributes
    ----------
    at : PredictionAtRest
        Of the probe, with the surrogate that is sampled.

    Raises
    ------
    ComputationError
        If the lever cannot be solved.
    """

    def __init__(self, experiment: ExperimentAtRest, probe: Probe) -> None:
        self._experiment, self.at = experiment.exact_at(probe)
        if isinstance(experiment.fast, ReducedLever):
            local, linearised = self.at.surrogate, self.at.linearised
            surrogate = ReducedSurrogate(local, experiment.fast, linearised)
            self.at = replace(self.at, surrogate=surrogate)

    @classmethod
    def of_fit(
        cls, fit: Estimate, probe: Probe, bias: Array, distance_um: Array | None = None
    ) -> SampledLever:
        """Return a lever that was fitted, at some biases (V) and distances, exact at a probe."""
        names = tuple(fit.names)
        experiment = experiment_of(probe, bias, names=names, reduce=True, distance_um=distance_um)
        return cls(experiment, probe)

    def error_K(self, probe: Probe) -> float:
        """Return by how much the tip temperature of a similar probe may be off.

        By the lever that is solved there; of a reduced one by what the full one's residual says.
        """
        solved = self._experiment.predict(probe, self.at)
        surrogate = self.at.surrogate.values_at(probe.values(self._experiment.names))
        error = float(np.abs(surrogate - solved.values)[TIP].max())
        return error + self._experiment.fast.tip_error_K(probe, solved.linearised.branch)


# --- the tip of a calibration -------------------------------------------------------------------


@dataclass(frozen=True)
class SampledTip:
    """What posterior samples say of the tip temperature.

    Attributes
    ----------
    profile : ErrorProfile
        From the quantiles of 2.5 and 97.5 %.
    effective_samples : float
    fewest : int
        So many are expected.
    """

    profile: ErrorProfile
    effective_samples: float
    fewest: int

    @property
    def enough(self) -> bool:
        """Whether the quantiles can be trusted."""
        return self.effective_samples >= self.fewest

    @property
    def note(self) -> str:
        """What the limits are from, or why not from these samples."""
        worth = f"worth {self.effective_samples:.0f} independent ones"
        if self.enough:
            return (
                f"95 % of the tip temperatures lie between quantiles of posterior samples, {worth}"
            )
        return (
            f"too few posterior samples: {worth}, where {self.fewest} are expected; the limits are "
            "those without samples, take more"
        )


def sample_tip(
    posterior: Posterior,
    predictor: Predictor,
    *,
    samples: int,
    progress: Progress | None = None,
) -> SampledTip:
    """Sample the parameters of an estimate, and their tip temperatures.

    Levers that the predictor has solved far enough from the optimum say how values bend. What is
    sampled costs too little for processes of its own.
    """
    objective, at, experiment = posterior.objective, posterior.at, predictor.experiment
    if isinstance(experiment, ExperimentAtRest) and at.probe.circuit.starts_cold:
        # of a branch that ends with the measurement no sample would be hotter
        _, at = experiment.until_melting().exact_at(at.probe)
    # a solved lever that far away tells of those that samples reach
    near = Subproblem(objective, at, predictor.others(at), least=1.0)
    trials, rows = Trials(near, options=objective.residuals.numerics.trials), hotter_rows(at)
    points, effective = draw_samples(trials, samples, progress=progress)
    # one that counts for much is there several times
    different, index = np.unique(points, axis=0, return_inverse=True)
    tips = np.array([near.values_at(point)[TIP, rows] for point in different])[index]
    middle, stderr = np.transpose(
        [posterior.of(EstimatedQuantity("tip", int(row))) for row in rows]
    )
    low, high = np.percentile(tips, (2.5, 97.5), axis=0)
    sides = (middle - low) / (BAND * stderr), (high - middle) / (BAND * stderr)
    return SampledTip(ErrorProfile(middle, *sides), effective, trials.options.fewest_effective)


# --- the parameters of a fit --------------------------------------------------------------------


def sample_posterior(
    fit: Estimate,
    *,
    samples: int = 2_000,
    processes: int = 2,
    seed: int = 0,
    noise: Noise = "each",
    progress: Progress | None = None,
) -> xr.Dataset:
    """Sample the posterior of the parameters that a fit varied, with the priors that it had.

    Parameters
    ----------
    fit : Estimate
    samples : int
        Trials, and samples that are drawn from them.
    processes : int
        Started by spawn: a script that calls this with more than one needs
        ``if __name__ == "__main__"``. The samples do not depend on their number.
    seed : int
    noise : {"each", "common"}
        One unknown noise scale for each observable (they differ by a factor of ten in real
        data), or one for all scaled residuals, which is what the fit's standard errors assume.
    progress : callable, optional
        Called with the blocks of trials done and their number.

    Returns
    -------
    xarray.Dataset
        On the dimension ``draw``: the varied parameters and ``inversion_temperature``, which are
        named by the coordinate ``quantity``; ``effective_sample_size``. Attributes give the fixed
        parameters, the seed, the noise, and by how much the surrogate may be wrong at the outermost
        samples (``surrogate_error_K``).

    Raises
    ------
    InputError
        If a number is too small or `noise` unknown, or the fit does not describe its data.
    ComputationError
        If no trial finds a lever or a worker process dies.
    """
    if noise not in ("each", "common"):
        raise InputError(f"found noise = {noise!r}, expected 'each' or 'common'")
    fit.need_described("a posterior")
    objective = fit.objective(fit.names)
    trials, lever = _trials_at(fit, objective, fit.probe, noise)
    if not objective.informed:
        # with other weights than the fit's, the posterior lies beside the optimum
        middle = objective.at(fit.probe, trials.optimum)
        trials, lever = _trials_at(fit, objective, middle, noise)
    points, effective = draw_samples(
        trials, samples, processes=processes, seed=seed, progress=progress
    )
    data = _dataset(fit, objective.coordinates.values(points), effective)
    errors = list[float]()
    for row in _outermost(points):
        with suppress(InputError):  # no such lever can be drawn
            errors.append(lever.error_K(objective.at(fit.probe, points[row])))
    error = max(errors, default=np.nan)
    data.attrs |= {"seed": seed, "noise": noise, "surrogate_error_K": error}
    return data


def _trials_at(
    fit: Estimate, objective: Objective, probe: Probe, noise: Noise
) -> tuple[Trials, SampledLever]:
    """Return trials with the lever of a probe, and that lever."""
    residuals = objective.residuals
    lever = SampledLever.of_fit(fit, probe, residuals.bias, residuals.distance_um)
    near = Subproblem(objective, lever.at.light)
    return Trials(near, noise, residuals.numerics.trials), lever


def _outermost(points: Array) -> list[int]:
    """Return the samples with the smallest and largest value along the widest axis."""
    away = (points - points.mean(axis=0)) / np.maximum(points.std(axis=0), 1e-300)
    along = away @ np.linalg.eigh(away.T @ away)[1][:, -1]
    return [int(np.argmin(along)), int(np.argmax(along))]


def _dataset(fit: Estimate, values: Array, effective: float) -> xr.Dataset:
    columns = dict(zip(fit.names, values.T, strict=True))
    silicon, material = fit.probe.heater_silicon, fit.probe.layout().heater.material
    slopes = fit.inversion_temperature_slopes_K
    if silicon is not None and slopes.any():  # else it is what it was
        owned = {full_name(material, own): own for own in ("n_d", "p")}
        sampled = {owned[name]: column for name, column in columns.items() if name in owned}
        # the carriers' laws, whose departures move it by some kelvins, to first order
        by_laws = np.where([name in owned for name in fit.names], 0.0, slopes)
        columns["inversion_temperature"] = (
            silicon.model_copy(update=sampled).inversion_temperature()
            + (values - fit.probe.values(fit.names)) @ by_laws
        )
    held = [name for name in usual_parameters(fit.probe) if name not in fit.names]
    at_rest = zip(held, fit.probe.values(held).tolist(), strict=True)
    data = labelled(
        {**columns, "effective_sample_size": ((), effective)},
        "draw",
        {"quantity": list(columns)},
        fixed=", ".join(f"{name} = {value:g}" for name, value in at_rest),
        observables=", ".join(fit.observables),
        lever=fit.probe.title,
    )
    for name, parameter in parameters_of(fit.probe).items():
        if name in fit.names:
            data[name].attrs = {"units": parameter.unit, "long_name": parameter.meaning}
    return data


# --- the band of tip temperature ----------------------------------------------------------------


def predictive_band(
    fit: Estimate,
    posterior: xr.Dataset,
    *,
    bias: Sequence[float] | Array | None = None,
    samples: int = 300,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Predict the tip temperature, with quantiles, from posterior samples.

    It is the band of the true temperature, given the model; measured ones scatter about it by
    their noise as well.

    Parameters
    ----------
    fit : Estimate
    posterior : xarray.Dataset
        From `sample_posterior`.
    bias : sequence of float, optional
        V; by default 81 from zero to the highest measured one.
    samples : int
        Taken evenly from the posterior.
    progress : callable, optional
        Called with the samples done and their number.

    Returns
    -------
    xarray.Dataset
        ``tip_K`` (quantile, bias) and ``tip_at_power_K`` (quantile, power), with the coordinates
        ``quantile`` (%), ``bias_V`` and ``power_mW``. The powers reach to the highest that all
        samples reach; they are NaN where a power does not tell the temperature.

    Raises
    ------
    InputError
        If a bias or the number of samples is impossible.
    ComputationError
        If the lever cannot be solved at a bias.
    """
    if samples < 2:
        raise InputError(f"found samples = {samples}, expected 2 or more")
    measured = fit.measurement.bias_V
    grid = (
        np.linspace(min(float(measured.min()), 0.0), float(measured.max()), 81)
        if bias is None
        else np.unique(np.asarray(bias, float))
    )
    surrogate = SampledLever.of_fit(fit, fit.probe, grid).at.surrogate
    flat = np.stack([posterior[name].values.ravel() for name in fit.names], axis=1)
    chosen = flat[np.linspace(0, len(flat) - 1, min(samples, len(flat))).round().astype(int)]
    tips, powers = [], []
    for row in each(list(chosen), progress):
        columns = named(surrogate.values_at(row))
        tips.append(columns["tip_K"])
        powers.append(surrogate.circuit(row).power(grid, columns["current_mA"]))
    power = np.linspace(np.min(powers, axis=1).max(), np.max(powers, axis=1).min(), grid.size)
    if np.diff(powers, axis=1).min() < 0:
        # with held supplies there may be several temperatures at one power
        power = np.full(grid.size, np.nan)
    at_power = [_against(power, x, tip) for x, tip in zip(powers, tips, strict=True)]
    quantiles = partial(np.percentile, q=BAND_QUANTILES, axis=0)
    return labelled(
        {
            "tip_K": (("quantile", "bias"), quantiles(tips)),
            "tip_at_power_K": (("quantile", "power_mW"), quantiles(at_power)),
        },
        coordinates={"quantile": list(BAND_QUANTILES), "bias": grid, "power_mW": power},
        samples=len(chosen),
        lever=fit.probe.title,
    )


def _against(power: Array, powers: Array, tip: Array) -> Array:
    """Interpolate a tip temperature, which rises with the power, at given powers."""
    order = np.argsort(powers)
    return np.interp(power, powers[order], tip[order])
