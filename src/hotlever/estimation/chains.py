"""How far to trust a set of Markov chains: effective sample size and R̂.

Both after Vehtari, Gelman, Simpson, Carpenter and Bürkner, Bayesian Analysis 16 (2021) 667,
doi:10.1214/20-BA1221.
"""

from __future__ import annotations

import numpy as np
from scipy.signal import fftconvolve
from scipy.special import ndtri
from scipy.stats import rankdata

from hotlever.types import Array

#: Effective samples that quantiles take at least.
FEWEST_EFFECTIVE = 400


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
    return float(np.sqrt((draws - 1) / draws + between / within))
