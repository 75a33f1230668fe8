"""Markov chains of independent ensembles of emcee's walkers, and how far to trust them.

Effective sample size and R̂ are those of Vehtari, Gelman, Simpson, Carpenter and Bürkner, Bayesian
Analysis 16 (2021) 667, doi:10.1214/20-BA1221.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import emcee
import numpy as np
from scipy.signal import fftconvolve
from scipy.special import ndtri
from scipy.stats import rankdata

from hotlever.errors import ComputationError, InputError
from hotlever.estimation.posterior import Gaussian
from hotlever.processes import local_processes
from hotlever.types import Array, Progress

# The logarithm of a density, up to a constant; −∞ where it vanishes.
LogDensity = Callable[[Array], float]

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
        See `hotlever.estimation.sampling.sample_posterior`.

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
    with local_processes(min(processes, ENSEMBLES)) as (run, share):
        density = share(log_density)
        states = run(_started, [(density, approximation, walkers, number) for number in seeds])
        for done in range(0, total, _BLOCK):
            steps = min(_BLOCK, total - done)
            moved = run(_advanced, [(density, approximation, state, steps) for state in states])
            states = [state for state, _, _ in moved]
            points.append([positions for _, positions, _ in moved])
            densities.append([logarithms for _, _, logarithms in moved])
            if progress is not None:
                progress(done + steps, total)
    kept = (
        np.concatenate(values, axis=1)[:, _WARM_UP:].swapaxes(1, 2)
        for values in (points, densities)
    )
    return Chains(*kept)


def independent_samples(values: Array) -> float:
    """Return how many independent samples some values, (ensembles, walkers, draws), are worth."""
    return effective_sample_size(values.reshape(-1, values.shape[-1]))


def rhat_of_ensembles(values: Array) -> float:
    """Return R̂ of some values between ensembles, which are independent; walkers of one are not."""
    return split_rhat(np.swapaxes(values, 1, 2).reshape(len(values), -1))


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
