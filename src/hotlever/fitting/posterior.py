"""The posterior of a fit's parameters, and the band of tip temperature that follows from it.

Sampled with emcee on the reduced lever. The likelihood takes the fit's own weighted residuals as
normal, with one unknown noise scale for each observable. With the prior 1/σ the scales are
integrated out exactly: a group of n residuals with the sum of squares Q contributes Q^(−n/2).
The parameters have uniform priors within the bounds of `PARAMETERS`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import get_context
from typing import Any, Literal, Protocol

import emcee
import numpy as np
import xarray as xr
from numpy.typing import NDArray

from hotlever import __version__
from hotlever.errors import ComputationError, InputError
from hotlever.fitting.diagnostics import effective_sample_size, split_rhat
from hotlever.fitting.drift import Drift
from hotlever.fitting.fit import Fit
from hotlever.fitting.nearby import NearbyModel
from hotlever.lever.equations import OBSERVABLES
from hotlever.lever.lever import Lever
from hotlever.lever.reduced_cache import cached_reduction
from hotlever.materials import PARAMETERS, Material
from hotlever.materials.silicon import inversion_temperature
from hotlever.threads import single_threaded_children

Array = NDArray[np.float64]
Progress = Callable[[int, int], None]
Noise = Literal["each", "common"]

#: Ensembles that know nothing of each other, so that R̂ compares independent runs.
ENSEMBLES = 4
#: Steps of every walker that are dropped. The walkers start from the linearised posterior.
_WARM_UP = 25
#: Steps between two reports of progress.
_BLOCK = 10
#: Share of moves proposed from the linearised posterior; the others follow the walkers.
_GAUSSIAN_SHARE = 0.6
#: Degrees of freedom of that proposal, whose tails must be wider than the posterior's.
_TAILS = 5.0

#: Quantiles (%) of a predictive band: median, 68 % and 95 %.
BAND_QUANTILES = (2.5, 16.0, 50.0, 84.0, 97.5)


class Target(Protocol):
    """A density to sample."""

    def log_probability(self, point: Array) -> float:
        """Return the logarithm of the density, up to a constant; −∞ where it vanishes."""
        ...


@dataclass(frozen=True)
class Gaussian:
    """A normal approximation of a density.

    Attributes
    ----------
    mean : ndarray, shape (d,)
    covariance : ndarray, shape (d, d)
    """

    mean: Array
    covariance: Array


@dataclass(frozen=True)
class Chains:
    """What sampling gives.

    Attributes
    ----------
    points : ndarray, shape (ensembles, walkers, draws, d)
    log_probability : ndarray, shape (ensembles, walkers, draws)
    accepted : float
        Share of proposals that were accepted.
    """

    points: Array
    log_probability: Array
    accepted: float


# --- the posterior of a fit ---------------------------------------------------------------------


class FitPosterior:
    """Logarithm of the posterior density of a fit's varied parameters, over their scales.

    Parameters
    ----------
    fit : Fit
    model : NearbyModel
        At the fit's optimum and its measurement's biases.
    noise : {"each", "common"}
        One unknown noise scale for each observable, or one for all scaled residuals.
    """

    def __init__(self, fit: Fit, model: NearbyModel, noise: Noise) -> None:
        self._model, self._material, self._names = model, fit.probe.material, fit.names
        known = [PARAMETERS[name] for name in fit.names]
        self.scale = np.array([parameter.scale for parameter in known])
        self.lower = np.array([parameter.lower for parameter in known]) / self.scale
        self.upper = np.array([parameter.upper for parameter in known]) / self.scale
        self.optimum = np.array([getattr(self._material, name) for name in fit.names]) / self.scale
        self._rows = [OBSERVABLES.index(name) for name in fit.observables]
        self._data = np.stack([fit.measurement.observable(name) for name in fit.observables])
        self._weights = fit.data_weights
        self._present = np.isfinite(self._data) & (self._weights > 0)
        self._drift = Drift(fit.observables, self._present) if fit.drift else None
        groups = np.arange(len(self._rows)) if noise == "each" else np.zeros(len(self._rows), int)
        self._group = np.broadcast_to(groups[:, None], self._data.shape)[self._present]
        self._counts = np.bincount(self._group)

    def material(self, point: Array) -> Material:
        """Return the material of a point."""
        values = dict(zip(self._names, (point * self.scale).tolist(), strict=True))
        return self._material.model_copy(update=values)

    def log_probability(self, point: Array) -> float:
        """Return the logarithm of the density; −∞ where the lever has no such state."""
        if np.any(point <= self.lower) or np.any(point >= self.upper):
            return -math.inf
        try:
            values = self._model.predict(self.material(point))
        except ComputationError:
            return -math.inf
        return self._log_likelihood(self._scaled(values[self._rows] - self._data))

    def linearised(self) -> Gaussian:
        """Return the posterior of the model linearised at the optimum, as a normal one.

        The weights follow from the residuals and the residuals from the weights; a few dozen
        rounds settle both. Directions that the data leave open are closed by the prior.
        """
        varied = [list(PARAMETERS).index(name) for name in self._names]
        residual = self._scaled(self._model.predict(self._material)[self._rows] - self._data)
        slopes = self._model.sensitivities()[self._rows][:, :, varied] * self.scale
        jacobian = (slopes * self._weights[:, :, None])[self._present]
        if self._drift is not None:
            jacobian = self._drift.removed(jacobian, self._weights)
        prior = np.diag(12.0 / (self.upper - self.lower) ** 2)
        step = np.zeros(len(varied))
        for _ in range(50):
            weights = (self._counts / self._squares(residual + jacobian @ step))[self._group]
            covariance = np.linalg.inv(jacobian.T @ (weights[:, None] * jacobian) + prior)
            step = -covariance @ (jacobian.T @ (weights * residual))
        margin = 1e-3 * (self.upper - self.lower)
        mean = np.clip(self.optimum + step, self.lower + margin, self.upper - margin)
        return Gaussian(mean, covariance)

    def _scaled(self, difference: Array) -> Array:
        if self._drift is not None:
            difference = difference - self._drift.line(difference, self._weights)
        scaled: Array = (difference * self._weights)[self._present]
        return scaled

    def _squares(self, residual: Array) -> Array:
        """Return the sum of squares of each group; never zero, for its logarithm."""
        return np.maximum(np.bincount(self._group, residual**2), np.finfo(float).tiny)

    def _log_likelihood(self, residual: Array) -> float:
        return float(-0.5 * self._counts @ np.log(self._squares(residual)))


def sample_posterior(
    fit: Fit,
    *,
    samples: int = 10_000,
    walkers: int = 24,
    processes: int = 2,
    seed: int = 0,
    noise: Noise = "each",
    lever: Lever | None = None,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Sample the posterior of the parameters that a fit varied.

    Parameters
    ----------
    fit : Fit
    samples : int
        Kept, at least; rounded up to a whole number of steps of all walkers.
    walkers : int
        Of each of four independent ensembles.
    processes : int
        Started by spawn: a script that calls this with more than one needs
        ``if __name__ == "__main__"``. The samples do not depend on their number.
    seed : int
    noise : {"each", "common"}
        One unknown noise scale for each observable (they differ by a factor of ten in real
        data), or one for all scaled residuals, which is what the fit's standard errors assume.
    lever : Lever, optional
        The fitted probe on the default mesh, by default.
    progress : callable, optional
        Called with the steps done and their number.

    Returns
    -------
    xarray.Dataset
        On the dimensions ``chain`` and ``draw``: the varied parameters,
        ``inversion_temperature`` and ``log_probability``; on ``quantity`` (all of these but the
        last): ``effective_sample_size``, ``rhat``; ``acceptance_fraction``; the coordinate
        ``ensemble`` of each chain. Attributes give the fixed parameters, the seed and the noise.

    Raises
    ------
    InputError
        If a number is too small or `noise` unknown.
    ComputationError
        If no start is found or a worker process dies.
    """
    if noise not in ("each", "common"):
        raise InputError(f"found noise = {noise!r}, expected 'each' or 'common'")
    lever = lever or Lever(fit.probe)
    space, bias = cached_reduction(lever), fit.measurement.bias_V
    at_optimum = FitPosterior(fit, NearbyModel(lever, space, bias), noise)
    # with other weights than the fit's, the posterior lies beside the optimum
    middle = lever.with_material(at_optimum.material(at_optimum.linearised().mean))
    target = FitPosterior(fit, NearbyModel(middle, space, bias), noise)
    chains = sample(
        target,
        at_optimum.linearised(),
        samples=samples,
        walkers=walkers,
        processes=processes,
        seed=seed,
        progress=progress,
    )
    data = _dataset(fit, chains, target.scale)
    data.attrs |= {"seed": seed, "noise": noise}
    return data


def _dataset(fit: Fit, chains: Chains, scale: Array) -> xr.Dataset:
    ensembles, walkers, draws, _ = chains.points.shape
    values = chains.points * scale
    columns = {name: values[..., place] for place, name in enumerate(fit.names)}
    units = {name: (PARAMETERS[name].unit, PARAMETERS[name].meaning) for name in fit.names}
    material = fit.probe.material
    n_d = columns.get("n_d", np.full(values.shape[:3], material.n_d))
    p = columns.get("p", np.full(values.shape[:3], material.p))
    columns["inversion_temperature"] = inversion_temperature(n_d, p)
    units["inversion_temperature"] = ("K", "inversion temperature of the heater's doping")
    quantities = list(columns)
    data = xr.Dataset(
        {
            name: (
                ("chain", "draw"),
                column.reshape(ensembles * walkers, draws),
                {"units": units[name][0], "long_name": units[name][1]},
            )
            for name, column in columns.items()
        }
    )
    data["log_probability"] = (
        ("chain", "draw"),
        chains.log_probability.reshape(ensembles * walkers, draws),
        {"units": "1", "long_name": "logarithm of the posterior density, up to a constant"},
    )
    # R̂ between ensembles, which are independent; the walkers of one are not
    data["rhat"] = (
        "quantity",
        [
            split_rhat(np.swapaxes(columns[name], 1, 2).reshape(ensembles, -1))
            for name in quantities
        ],
        {"units": "1", "long_name": "rank-normalised split R-hat between the ensembles"},
    )
    data["effective_sample_size"] = (
        "quantity",
        [effective_sample_size(data[name].values) for name in quantities],
        {"units": "1", "long_name": "effective sample size"},
    )
    data["acceptance_fraction"] = (
        (),
        chains.accepted,
        {"units": "1", "long_name": "share of accepted proposals"},
    )
    data = data.assign_coords(
        quantity=quantities, ensemble=("chain", np.repeat(np.arange(ensembles), walkers))
    )
    held = [name for name in PARAMETERS if name not in fit.names]
    data.attrs = {
        "fixed": ", ".join(f"{name} = {getattr(material, name):g}" for name in held),
        "observables": ", ".join(fit.observables),
        "software": f"hotlever {__version__}, emcee {emcee.__version__}",
    }
    return data


# --- the band of tip temperature ----------------------------------------------------------------


def predictive_band(
    fit: Fit,
    posterior: xr.Dataset,
    *,
    bias: Sequence[float] | Array | None = None,
    samples: int = 300,
    lever: Lever | None = None,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Predict the tip temperature, with quantiles, from posterior samples.

    It is the band of the true temperature, given the model; measured ones scatter about it by
    their noise as well.

    Parameters
    ----------
    fit : Fit
    posterior : xarray.Dataset
        From `sample_posterior`.
    bias : sequence of float, optional
        V; by default 81 from zero to the highest measured one.
    samples : int
        Taken evenly from the posterior.
    lever : Lever, optional
        The fitted probe on the default mesh, by default.
    progress : callable, optional
        Called with the samples done and their number.

    Returns
    -------
    xarray.Dataset
        ``tip_K`` (quantile, bias) and ``tip_at_power_K`` (quantile, power), with the coordinates
        ``quantile`` (%), ``bias_V`` and ``power_mW``. The powers reach to the highest that all
        samples reach.

    Raises
    ------
    InputError
        If a bias or the number of samples is impossible.
    ComputationError
        If the lever cannot be solved at a bias.
    """
    if samples < 2:
        raise InputError(f"found samples = {samples}, expected 2 or more")
    highest = float(fit.measurement.bias_V.max())
    grid = np.linspace(0.0, highest, 81) if bias is None else np.unique(np.asarray(bias, float))
    lever = lever or Lever(fit.probe)
    model = NearbyModel(lever, cached_reduction(lever), grid)
    flat = np.stack([posterior[name].values.ravel() for name in fit.names], axis=1)
    chosen = flat[np.linspace(0, len(flat) - 1, min(samples, len(flat))).round().astype(int)]
    series_kohm = fit.probe.circuit.series_resistance_ohm / 1000.0
    tips, powers = [], []
    for done, row in enumerate(chosen, start=1):
        values = dict(zip(fit.names, row.tolist(), strict=True))
        current, _, tip = model.predict(fit.probe.material.model_copy(update=values))
        tips.append(tip)
        powers.append((grid - series_kohm * current) * current)
        if progress is not None:
            progress(done, len(chosen))
    power = np.linspace(
        max(row.min() for row in powers), min(row.max() for row in powers), grid.size
    )
    at_power = [_against(power, x, tip) for x, tip in zip(powers, tips, strict=True)]
    data = xr.Dataset(
        {
            "tip_K": (("quantile", "bias"), np.percentile(tips, BAND_QUANTILES, axis=0)),
            "tip_at_power_K": (
                ("quantile", "power"),
                np.percentile(at_power, BAND_QUANTILES, axis=0),
            ),
        },
        coords={
            "quantile": ("quantile", list(BAND_QUANTILES)),
            "bias_V": ("bias", grid),
            "power_mW": ("power", power),
        },
        attrs={"samples": len(chosen), "software": f"hotlever {__version__}"},
    )
    for name, unit, text in (
        ("tip_K", "K", "tip temperature at a bias"),
        ("tip_at_power_K", "K", "tip temperature at a power"),
        ("quantile", "%", "quantile of the posterior prediction"),
        ("bias_V", "V", "bias"),
        ("power_mW", "mW", "power dissipated in the lever"),
    ):
        data[name].attrs = {"units": unit, "long_name": text}
    return data


def _against(power: Array, powers: Array, tip: Array) -> Array:
    """Interpolate a tip temperature, which rises with the power, at given powers."""
    order = np.argsort(powers)
    return np.interp(power, powers[order], tip[order])


# --- sampling -----------------------------------------------------------------------------------


@dataclass
class _Ensemble:
    """Where the walkers of one ensemble are."""

    state: Any
    proposal: Gaussian


def sample(
    target: Target,
    approximation: Gaussian,
    *,
    samples: int,
    walkers: int,
    processes: int = 1,
    seed: int = 0,
    progress: Progress | None = None,
) -> Chains:
    """Sample a density with independent ensembles of emcee's walkers.

    Part of the moves are proposed from a normal approximation with wide tails, independent of
    the walker's place, the others from the differences between walkers: the former make nearly
    independent samples where the approximation is good, the latter need none.

    Parameters
    ----------
    target : Target
        Picklable if `processes` is more than one.
    approximation : Gaussian
        Where the walkers start, and what is proposed.
    samples, walkers, processes, seed, progress
        See `sample_posterior`.

    Raises
    ------
    InputError
        If a number is too small.
    ComputationError
        If no start is found or a worker process dies.
    """
    dimension = approximation.mean.size
    for name, value, least in (
        ("samples", samples, 1),
        ("walkers", walkers, 2 * dimension),
        ("processes", processes, 1),
    ):
        if value < least:
            raise InputError(f"found {name} = {value}, expected {least} or more")
    # R̂ splits the chains and needs a variance of each half
    draws = max(math.ceil(samples / (ENSEMBLES * walkers)), 4)
    blocks = _blocks(_WARM_UP) + _blocks(draws)
    kept, accepted, done = [], [], 0
    with _mapper(target, processes) as run:
        seeds = np.random.SeedSequence(seed).generate_state(ENSEMBLES).tolist()
        ensembles = run(_started, [(approximation, walkers, number) for number in seeds])
        for steps in blocks:
            results = run(_advanced, [(ensemble, steps) for ensemble in ensembles])
            ensembles = [result[0] for result in results]
            done += steps
            if done > _WARM_UP:
                kept.append([result[1:3] for result in results])
                accepted.append(steps * np.mean([result[3] for result in results]))
            if progress is not None:
                progress(done, _WARM_UP + draws)
    points = np.concatenate([[block[0] for block in row] for row in kept], axis=1)
    logs = np.concatenate([[block[1] for block in row] for row in kept], axis=1)
    return Chains(np.swapaxes(points, 1, 2), np.swapaxes(logs, 1, 2), float(sum(accepted) / draws))


def _blocks(steps: int) -> list[int]:
    """Cut a number of steps into blocks."""
    return [min(_BLOCK, steps - first) for first in range(0, steps, _BLOCK)]


def _started(target: Target, approximation: Gaussian, walkers: int, seed: int) -> _Ensemble:
    """Place the walkers of an ensemble where the density does not vanish."""
    random = np.random.RandomState(seed)
    coords: list[Array] = []
    logs: list[float] = []
    for _ in range(50 * walkers):
        point = _wide_draws(approximation, 1, random)[0]
        value = target.log_probability(point)
        if np.isfinite(value):
            coords.append(point)
            logs.append(value)
        if len(coords) == walkers:
            state = emcee.State(np.array(coords), log_prob=np.array(logs))
            state.random_state = random.get_state()
            return _Ensemble(state, approximation)
    raise ComputationError(
        f"only {len(coords)} of {50 * walkers} starting points of the posterior can be solved "
        "within the bounds of the parameters; fix those that the data do not determine"
    )


def _advanced(
    target: Target, ensemble: _Ensemble, steps: int
) -> tuple[_Ensemble, Array, Array, float]:
    """Move an ensemble; return it, its points (steps, walkers, d), their density, acceptance."""
    walkers, dimension = ensemble.state.coords.shape
    sampler = emcee.EnsembleSampler(
        walkers,
        dimension,
        target.log_probability,
        moves=[
            (emcee.moves.MHMove(_Independent(ensemble.proposal)), _GAUSSIAN_SHARE),
            (emcee.moves.DEMove(), 1.0 - _GAUSSIAN_SHARE),
        ],
    )
    state = sampler.run_mcmc(ensemble.state, steps, skip_initial_state_check=True)
    return (
        _Ensemble(state, ensemble.proposal),
        sampler.get_chain(),
        sampler.get_log_prob(),
        float(np.mean(sampler.acceptance_fraction)),
    )


class _Independent:
    """Proposals from a Gaussian with the tails of Student's t, for `emcee.moves.MHMove`."""

    def __init__(self, approximation: Gaussian) -> None:
        self._approximation = approximation

    def __call__(self, coords: Array, random: Any) -> tuple[Array, Array]:
        """Return new points, and the logarithm of q(old) / q(new)."""
        proposed = _wide_draws(self._approximation, len(coords), random)
        return proposed, self._log_density(coords) - self._log_density(proposed)

    def _log_density(self, points: Array) -> Array:
        away = points - self._approximation.mean
        lengths = np.einsum(
            "ij,jk,ik->i", away, np.linalg.inv(self._approximation.covariance), away
        )
        density: Array = -0.5 * (_TAILS + away.shape[1]) * np.log1p(lengths / _TAILS)
        return density


def _wide_draws(approximation: Gaussian, count: int, random: Any) -> Array:
    """Draw from a multivariate Student's t, shape (count, d)."""
    factor = np.linalg.cholesky(approximation.covariance)
    normal = random.normal(size=(count, approximation.mean.size))
    stretch = np.sqrt(_TAILS / random.chisquare(_TAILS, size=(count, 1)))
    draws: Array = approximation.mean + stretch * (normal @ factor.T)
    return draws


# --- processes ----------------------------------------------------------------------------------

#: What a worker process samples; set once when it starts, for it takes megabytes.
_worker_target: Target | None = None


@contextmanager
def _mapper(target: Target, processes: int) -> Iterator[Callable[..., list[Any]]]:
    """Give a function that applies another to the target and each of several arguments."""
    if processes == 1:
        yield lambda function, tasks: [function(target, *task) for task in tasks]
        return
    pool = ProcessPoolExecutor(
        min(processes, ENSEMBLES),
        mp_context=get_context("spawn"),
        initializer=_keep_target,
        initargs=(target,),
    )

    def run(function: Callable[..., Any], tasks: list[tuple[Any, ...]]) -> list[Any]:
        return list(pool.map(_on_target, [function] * len(tasks), tasks))

    try:
        with single_threaded_children(), pool:
            yield run
    except BrokenProcessPool as error:
        raise ComputationError(
            "a process that sampled the posterior died; with too little memory, or in a script "
            'without `if __name__ == "__main__"`, use processes=1'
        ) from error


def _keep_target(target: Target) -> None:
    global _worker_target
    _worker_target = target
    # freeing a large block once teaches glibc not to hand the memory of every intermediate array
    # back to the system, which would cost a new process as much time as the arithmetic
    np.empty(2_000_000)


def _on_target(function: Callable[..., Any], task: tuple[Any, ...]) -> Any:
    return function(_worker_target, *task)
