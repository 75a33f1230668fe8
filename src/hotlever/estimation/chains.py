"""How far to trust a set of Markov chains: effective sample size and R̂.

Both after Vehtari, Gelman, Simpson, Carpenter and Bürkner, Bayesian Analysis 16 (2021) 667,
doi:10.1214/20-BA1221.
"""

from __future__ import annotations

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft
from scipy.special import ndtri
from scipy.stats import rankdata

from hotlever.types import Array


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
    halves = np.concatenate([chains[:, :half], chains[:, chains.shape[1] - half :]])
    folded = np.abs(halves - np.median(halves))
    return max(_rhat(_normal_ranks(halves)), _rhat(_normal_ranks(folded)))


def effective_sample_size(chains: Array) -> float:
    """Return how many independent draws would give the mean as well as the chains do.

    From the autocorrelation of all chains together, summed while its pairs are positive and
    made monotone (Geyer), so that chains which disagree count for less.

    Parameters
    ----------
    chains : ndarray, shape (chains, draws)
    """
    count, draws = chains.shape
    covariance = _autocovariance(chains).mean(axis=0)
    within = covariance[0] * draws / (draws - 1)
    between = chains.mean(axis=1).var(ddof=1) if count > 1 else 0.0
    total = within * (draws - 1) / draws + between
    if total == 0.0:
        return float(chains.size)
    correlation = 1.0 - (within - covariance * draws / (draws - 1)) / total
    correlation[0] = 1.0
    pairs = correlation[: draws // 2 * 2].reshape(-1, 2).sum(axis=1)
    ends = np.flatnonzero(pairs < 0)
    pairs = pairs[: ends[0]] if ends.size else pairs
    time = 2.0 * np.minimum.accumulate(pairs).sum() - 1.0
    # chains that alternate can do better than independent draws, but not without limit
    time = max(time, 1.0 / np.log10(chains.size))
    return float(chains.size / time)


def _rhat(chains: Array) -> float:
    draws = chains.shape[1]
    within = chains.var(axis=1, ddof=1).mean()
    between = chains.mean(axis=1).var(ddof=1)
    return float(np.sqrt((draws - 1) / draws + between / within))


def _normal_ranks(values: Array) -> Array:
    """Replace values by the normal scores of their ranks."""
    scores: Array = ndtri((rankdata(values).reshape(values.shape) - 0.375) / (values.size + 0.25))
    return scores


def _autocovariance(chains: Array) -> Array:
    """Return the autocovariance of each chain at every lag, shape (chains, draws)."""
    draws = chains.shape[1]
    length = next_fast_len(2 * draws)
    spectrum = rfft(chains - chains.mean(axis=1, keepdims=True), n=length, axis=1)
    covariance: Array = irfft(np.abs(spectrum) ** 2, n=length, axis=1)[:, :draws] / draws
    return covariance
