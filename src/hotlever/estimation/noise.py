"""How the noise of an observable goes with its size, as its residuals tell.

Meters have noise of two kinds: the same everywhere, and in proportion to what they show. Which it
is matters where current varies by a factor of thirty: taken for the same everywhere, noise in
proportion is underestimated where the lever is hot, and good data there are taken for outliers.
"""

from __future__ import annotations

import numpy as np

from hotlever.types import Array

#: Shares of the variance that are in proportion to the square of what is shown; of all of it, data
#: near zero would count infinitely.
_SHARES = np.array([0.0, 0.5, 0.8, 0.95, 0.99])
#: Degrees of freedom of the t distribution by which residuals tell the shares: with few of them it
#: does not matter how far off outliers are (Lange, Little and Taylor, J. Am. Stat. Assoc. 84, 881
#: (1989), who take 4). Rounds in which the scale of it is found.
_TAILS, _ROUNDS = 4.0, 20
#: A datum that alone decides a parameter says nothing of its noise.
_LEAST_FREE = 0.05


def relative_noise(difference: Array, shown: Array, used_up: Array, usual: float) -> Array:
    """Return the noise of data relative to its root mean square, (n,); one where there is none.

    Parameters
    ----------
    difference : ndarray, shape (n,)
        Data minus prediction; NaN where nothing was measured.
    shown : ndarray, shape (n,)
        The prediction.
    used_up : ndarray, shape (n,)
        Leverage: the share of each datum's noise that the fit has taken up.
    usual : float
        Scatter that counts as one datum more, in the unit of the data.

    Notes
    -----
    The variance of a datum is s² (1 − w + w y² / ⟨y²⟩). For each of some shares w the scale s is
    that of greatest likelihood; precisions are averaged with the likelihoods of the shares, so
    that data that cannot tell them apart are not forced to.
    """
    here = np.isfinite(difference)
    squares = difference[here] ** 2 / np.maximum(1.0 - used_up[here], _LEAST_FREE)
    size = shown[here] ** 2
    shape = 1.0 - _SHARES[:, None] + _SHARES[:, None] * size / np.mean(size)
    by_shape = np.append(squares / shape, np.full((_SHARES.size, 1), usual**2), axis=1)
    scale = np.median(by_shape, axis=1, keepdims=True) + np.mean(by_shape, axis=1, keepdims=True)
    for _ in range(_ROUNDS):
        counting = (_TAILS + 1.0) / (_TAILS + by_shape / scale)
        scale = np.mean(counting * by_shape, axis=1, keepdims=True)
    tails = 0.5 * (_TAILS + 1.0) * np.log1p(by_shape / (_TAILS * scale))
    likelihood = -tails.sum(axis=1) - 0.5 * np.log(shape * scale).sum(axis=1)
    chance = np.exp(likelihood - likelihood.max())
    precision = np.average(1.0 / (shape * scale), axis=0, weights=chance)
    relative = np.ones(difference.shape)
    relative[here] = np.sqrt(1.0 / (precision * np.mean(1.0 / precision)))
    return relative
