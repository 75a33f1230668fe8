"""Gaussian-process regression in one dimension: a smooth curve through noisy points.

Rasmussen and Williams, "Gaussian Processes for Machine Learning", MIT Press (2006), chapters 2,
4 and 5, with the Matérn 5/2 covariance: functions with two derivatives, no more, which does not
round off a sharp bend as smoother covariances do.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize

from hotlever.threads import one_blas_thread
from hotlever.types import Array

#: Ranges of length, amplitude and noise, for coordinates and values of the order of one.
_BOUNDS = ((0.03, 5.0), (1e-3, 20.0), (1e-6, 0.3))
#: The likelihood may have two optima: a bent curve with little noise, a smooth one with more.
_STARTS = ((0.25, 0.5, 2e-3), (0.5, 0.5, 2e-2))
#: Prior variance of the mean.
_MEAN_VARIANCE = 1.0
#: Added to the variances of the points, so that rounding leaves their covariance positive.
_ROUNDING = 1e-11


class SmoothCurve:
    """A curve with its uncertainty, found from noisy values by largest likelihood.

    Parameters
    ----------
    x, y : ndarray, shape (n,)
        Points and values, both of the order of one.
    noise : ndarray, shape (n,)
        Standard errors of the values up to a common factor, `noise_factor`, which is found.
    """

    @one_blas_thread
    def __init__(self, x: Array, y: Array, noise: Array) -> None:
        self._x, self._mean, self._noise = x, float(np.mean(y)), noise
        values = y - self._mean

        def cost(logarithms: Array) -> float:
            """Minus the logarithm of the marginal likelihood, less a constant."""
            factor = self._factorised(*np.exp(logarithms))
            return float(
                0.5 * values @ cho_solve(factor, values) + np.log(np.diag(factor[0])).sum()
            )

        optima = [
            minimize(cost, start, method="L-BFGS-B", bounds=np.log(_BOUNDS))
            for start in np.log(_STARTS)
        ]
        best = min(optima, key=lambda optimum: optimum.fun)
        self._length, self._amplitude, self.noise_factor = np.exp(best.x).tolist()
        self._factor = self._factorised(*np.exp(best.x))
        self._weights = cho_solve(self._factor, values)

    def _factorised(self, length: float, amplitude: float, noise_factor: float) -> tuple:
        covariance = _covariance(self._x, self._x, length, amplitude)
        variance = (noise_factor * self._noise) ** 2 + _ROUNDING
        return cho_factor(covariance + np.diag(variance), lower=True)

    def value(self, x: Array) -> Array:
        """Return the curve at some places, (m,)."""
        cross = _covariance(x, self._x, self._length, self._amplitude)
        return np.asarray(self._mean + cross @ self._weights)

    @one_blas_thread
    def samples(self, x: Array, count: int) -> Array:
        """Return curves that are as likely as this one by the points, (count, m); always the same.

        They scatter about it by its standard error.
        """
        cross = _covariance(x, self._x, self._length, self._amplitude)
        prior = _covariance(x, x, self._length, self._amplitude)
        covariance = prior - cross @ cho_solve(self._factor, cross.T)
        rng = np.random.default_rng(0)
        return rng.multivariate_normal(self.value(x), covariance, count, method="eigh")


def _covariance(x: Array, y: Array, length: float, amplitude: float) -> Array:
    """Return the covariance of the curve at some places, (n,), with that at others, (m,)."""
    distance = np.abs(x[:, None] - y) * np.sqrt(5.0) / length
    matern = (1.0 + distance + distance**2 / 3.0) * np.exp(-distance)
    return np.asarray(amplitude**2 * matern + _MEAN_VARIANCE)
