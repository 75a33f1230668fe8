"""The density of a posterior, sampled by Markov chains of emcee's walkers.

Ensembles are independent of each other, which says how far to trust them.

Effective sample size and R̂ are those of Vehtari, Gelman, Simpson, Carpenter and Bürkner, Bayesian
Analysis 16 (2021) 667, doi:10.1214/20-BA1221.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import emcee
import numpy as np
from scipy.signal import fftconvolve
from scipy.special import ndtri
from scipy.stats import rankdata

from hotlever.errors import ComputationError, InputError
from hotlever.estimate.experiment import Prediction
from hotlever.estimate.objective import Objective
from hotlever.processes import local_processes
from hotlever.types import Array, Progress

# The logarithm of a density, up to a constant; −∞ where it vanishes.
LogDensity = Callable[[Array], float]
#: One unknown noise scale for each observable, or one for all.
Noise = Literal["each", "common"]

#: Degrees of freedom of what is drawn from a normal approximation: its tails must be wider than
#: those of the posterior.
_TAILS = 5.0
#: Rounds in which weights and residuals settle that follow from each other.
_WEIGHT_ROUNDS = 50
#: Ensembles that know nothing of each other, so that R̂ compares independent runs.
ENSEMBLES = 4
#: Walkers of an ensemble: at least, and for each parameter.
_WALKERS, _WALKERS_EACH = 24, 3
#: Steps of every walker that are dropped. The walkers start from the linearised posterior.
_WARM_UP = 25
#: Steps between two reports of progress.
_BLOCK = 10
#: Share of moves proposed from the linearised posterior; the others follow the walkers.
_GAUSSIAN_SHARE = 0.6
#: Effective samples that quantiles take at least, and R̂ above which it is said that more should be
#: taken (both after Vehtari et al.).
FEWEST_EFFECTIVE, SETTLED_RHAT = 400, 1.01
#: R̂ from which on quantiles are no limits. Ensembles that start alike drift alike, which it cannot
#: see.
HIGHEST_RHAT = 1.05


@dataclass(frozen=True)
class Gaussian:
    """A normal approximation of a density of d quantities.

    What is drawn from it has its middle and shape, but the wide tails of a Student's t.
    """

    mean: Array
    covariance: Array

    def wide_draws(self, count: int, random: Any) -> Array:
        """Draw points, shape (count, d)."""
        normal = random.normal(size=(count, self.mean.size))
        stretch = np.sqrt(_TAILS / random.chisquare(_TAILS, size=(count, 1)))
        return np.asarray(self.mean + stretch * (normal @ np.linalg.cholesky(self.covariance).T))

    def wide_log_density(self, points: Array) -> Array:
        """Return the logarithm of the density of such draws, up to a constant."""
        away = points - self.mean
        lengths = np.einsum("ij,jk,ik->i", away, np.linalg.inv(self.covariance), away)
        return np.asarray(-0.5 * (_TAILS + self.mean.size) * np.log1p(lengths / _TAILS))


class PosteriorDensity:
    """The density of the coordinates, for a sampler.

    The likelihood takes weighted residuals as normal. Without priors their noise is unknown, with
    the prior 1/σ, and integrated out exactly: a group of n residuals with the sum of squares Q
    contributes Q^(−n/2). With priors residuals count standard deviations, and contribute
    exp(−Q/2). A parameter without a prior is uniform within its bounds.

    Parameters
    ----------
    objective : Objective
    at : Prediction
        About which it is approximated.
    forward_model : callable
        Return the observables (m, n) at a point; picklable, if it is sampled in processes.
    noise : {"each", "common"}
        What shares a noise scale: an observable, or all.
    """

    def __init__(
        self,
        objective: Objective,
        at: Prediction,
        forward_model: Callable[[Array], Array],
        noise: Noise = "each",
    ) -> None:
        self.objective, self.optimum = objective, objective.point(at.probe)
        self._forward_model = forward_model
        self._residual = objective.residuals.weighted(at.values)
        self._jacobian = objective.of_data(at.slopes, self.optimum)
        # the data that share a noise scale
        self._group = np.nonzero(objective.residuals.present)[0] * (noise == "each")
        self._counts = np.bincount(self._group)

    def log_probability(self, point: Array) -> float:
        """Return the logarithm of the density, up to a constant; −∞ where there is no lever."""
        low, high = self.objective.bounds
        if np.any(point <= low) or np.any(point >= high):
            return -math.inf
        try:
            residual = self.objective.residuals.weighted(self._forward_model(point))
        except ComputationError:
            return -math.inf
        unlikely = float(residual @ residual)
        if not self.objective.informed:
            unlikely = float(self._counts @ np.log(self._squares(residual)))
        from_priors = self.objective.from_priors(point)
        return -0.5 * float(unlikely + from_priors @ from_priors) + self.objective.log_volume(point)

    @property
    def approximation(self) -> Gaussian:
        """What it is if the model is linear in the coordinates: a normal density.

        Without priors the weights follow from the residuals and the residuals from the weights; a
        few dozen rounds settle both.
        """
        objective, (low, high) = self.objective, self.objective.bounds
        residual, jacobian = self._residual, self._jacobian
        of_priors = objective.of_priors(self.optimum)
        pull = of_priors.T @ objective.from_priors(self.optimum)
        uniform = np.where(of_priors.any(axis=0), 0.0, 12.0 / (high - low) ** 2)
        prior = np.diag(uniform) + of_priors.T @ of_priors
        step, weights = np.zeros(self.optimum.size), np.ones(residual.size)
        for _ in range(1 if objective.informed else _WEIGHT_ROUNDS):
            if not objective.informed:
                squares = self._squares(residual + jacobian @ step)
                weights = (self._counts / squares)[self._group]
            covariance = np.linalg.inv(jacobian.T @ (weights[:, None] * jacobian) + prior)
            step = -covariance @ (jacobian.T @ (weights * residual) + pull)
        margin = 1e-3 * (high - low)
        mean = np.clip(self.optimum + step, low + margin, high - margin)
        return Gaussian(mean, np.asarray(covariance, dtype=float))

    def _squares(self, residual: Array) -> Array:
        """Return the sum of squares of each group; never zero, for its logarithm."""
        return np.maximum(np.bincount(self._group, residual**2), np.finfo(float).tiny)


# --- chains -------------------------------------------------------------------------------------


def split_rhat(chains: Array) -> float:
    """Return the rank-normalised split R̂ of one quantity; one if the chains agree.

    The larger of the R̂ of the ranks (do the chains lie at the same place?) and of the folded
    ranks (are they equally wide?).

    Parameters
    ----------
    chains : ndarray, shape (chains, draws)

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> round(split_rhat(rng.normal(size=(4, 1000))), 2)
    1.0
    """
    half = chains.shape[1] // 2
    halves = np.concatenate([chains[:, :half], chains[:, -half:]])
    folded = np.abs(halves - np.median(halves))
    return max(_rhat_of_ranks(halves), _rhat_of_ranks(folded))


def effective_sample_size(chains: Array) -> float:
    """Return how many independent draws would give the mean as well as the chains do.

    From the autocorrelation of all chains together, summed while its pairs are positive and
    made monotone (Geyer), so that chains which disagree count for less.

    Parameters
    ----------
    chains : ndarray, shape (chains, draws)
    """
    draws = chains.shape[1]
    centred = chains - chains.mean(axis=1, keepdims=True)
    # at every lag: divided by all draws, and by one less as a variance is
    products = fftconvolve(centred, centred[:, ::-1], axes=1)[:, draws - 1 :].mean(axis=0)
    biased, covariance = products / draws, products / (draws - 1)
    total = biased[0] + (chains.mean(axis=1).var(ddof=1) if len(chains) > 1 else 0.0)
    if total == 0.0:
        return float(chains.size)
    correlation = 1.0 - (covariance[0] - covariance) / total
    pairs = correlation[: draws // 2 * 2].reshape(-1, 2).sum(axis=1)
    positive = np.logical_and.accumulate(pairs >= 0)
    time = 2.0 * np.minimum.accumulate(pairs)[positive].sum() - 1.0
    # chains that alternate can do better than independent draws, but not without limit
    return float(chains.size / max(time, 1.0 / np.log10(chains.size)))


def _rhat_of_ranks(chains: Array) -> float:
    """Return R̂ of the normal scores of the ranks."""
    draws = chains.shape[1]
    ranks = rankdata(chains).reshape(chains.shape)
    scores = ndtri((ranks - 0.375) / (chains.size + 0.25))
    within = scores.var(axis=1, ddof=1).mean()
    between = scores.mean(axis=1).var(ddof=1)
    if within == 0.0:  # of what is held chains show one value, and agree
        return 1.0 if between == 0.0 else math.inf
    return float(np.sqrt((draws - 1) / draws + between / within))


@dataclass(frozen=True)
class Chains:
    """Points (ensembles, walkers, draws, d) and the logarithm of their density."""

    points: Array
    log_probability: Array

    @property
    def accepted(self) -> float:
        """Share of the proposals that were accepted: a walker stands still otherwise."""
        return float(np.diff(self.points, axis=2).any(axis=-1).mean())


def sample(
    log_density: LogDensity,
    approximation: Gaussian,
    *,
    samples: int,
    walkers: int | None = None,
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
    log_density : callable
        Picklable if `processes` is more than one.
    approximation : Gaussian
        Where the walkers start, and what is proposed.
    samples, walkers, processes, seed, progress
        See `hotlever.estimate.sampling.sample_posterior`.

    Raises
    ------
    InputError
        If a number is too small.
    ComputationError
        If no start is found or a worker process dies.
    """
    dimension = approximation.mean.size
    if walkers is None:
        walkers = max(_WALKERS, _WALKERS_EACH * dimension)
    for name, value, least in (
        ("samples", samples, 1),
        ("walkers", walkers, 2 * dimension),
        ("processes", processes, 1),
    ):
        if value < least:
            raise InputError(f"found {name} = {value}, expected {least} or more")
    # R̂ splits the chains and needs a variance of each half
    draws = max(math.ceil(samples / (ENSEMBLES * walkers)), 4)
    total = _WARM_UP + draws
    seeds = np.random.SeedSequence(seed).generate_state(ENSEMBLES).tolist()
    points, densities = [], []
    with local_processes(min(processes, ENSEMBLES)) as run:
        states = run(_started, [(log_density, approximation, walkers, number) for number in seeds])
        for done in range(0, total, _BLOCK):
            steps = min(_BLOCK, total - done)
            blocks = run(
                _advanced, [(log_density, approximation, state, steps) for state in states]
            )
            states = [state for state, _, _ in blocks]
            points.append([positions for _, positions, _ in blocks])
            densities.append([logarithms for _, _, logarithms in blocks])
            if progress is not None:
                progress(done + steps, total)
    after_warm_up = (
        np.concatenate(values, axis=1)[:, _WARM_UP:].swapaxes(1, 2)
        for values in (points, densities)
    )
    return Chains(*after_warm_up)


def worth(values: Array) -> tuple[float, float]:
    """Return how many independent samples values, (ensembles, walkers, draws), are worth, and R̂.

    That is between ensembles, which are independent; walkers of one are not.
    """
    by_ensemble = np.swapaxes(values, 1, 2).reshape(len(values), -1)
    size = effective_sample_size(values.reshape(-1, values.shape[-1]))
    return size, split_rhat(by_ensemble)


def _started(
    log_density: LogDensity, approximation: Gaussian, walkers: int, seed: int
) -> emcee.State:
    """Put the walkers of an ensemble where the density does not vanish."""
    random = np.random.RandomState(seed)
    started: list[tuple[Array, float]] = []
    for _ in range(50 * walkers):
        (point,) = approximation.wide_draws(1, random)
        density = log_density(point)
        if np.isfinite(density):
            started.append((point, density))
        if len(started) == walkers:
            points, densities = map(np.array, zip(*started, strict=True))
            return emcee.State(points, log_prob=densities, random_state=random.get_state())
    raise ComputationError(
        f"only {len(started)} of {50 * walkers} starting points of the posterior can be solved "
        "within the bounds of the parameters; fix those that the data do not determine"
    )


def _advanced(
    log_density: LogDensity, approximation: Gaussian, state: emcee.State, steps: int
) -> tuple[emcee.State, Array, Array]:
    """Move an ensemble; return it, its points (steps, walkers, d), and their density."""

    def proposed(coords: Array, random: Any) -> tuple[Array, Array]:
        """Return new points, wherever the walkers are, and the logarithm of q(old) / q(new)."""
        points = approximation.wide_draws(len(coords), random)
        density = approximation.wide_log_density
        return points, density(coords) - density(points)

    sampler = emcee.EnsembleSampler(
        *state.coords.shape,
        log_density,
        moves=[
            (emcee.moves.MHMove(proposed), _GAUSSIAN_SHARE),
            (emcee.moves.DEMove(), 1.0 - _GAUSSIAN_SHARE),
        ],
    )
    state = sampler.run_mcmc(state, steps, skip_initial_state_check=True)
    return state, sampler.get_chain(), sampler.get_log_prob()
