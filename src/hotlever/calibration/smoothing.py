"""Gaussian-process regression in one dimension: a smooth curve through noisy points.

Rasmussen and Williams, "Gaussian Processes for Machine Learning", MIT Press (2006), chapters 2,
4 and 5, with the Matérn 5/2 covariance: functions with two derivatives, no more, which does not
round off a sharp bend as smoother covariances do.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize

Array = NDArray[np.float64]

#: Ranges of length, amplitude and noise, for coordinates and values of the order of one.
_BOUNDS = ((0.03, 5.0), (1e-3, 20.0), (1e-6, 0.3))
_START = (0.25, 0.5, 2e-3)
#: Prior variance of the mean.
_MEAN_VARIANCE = 1.0


class SmoothCurve:
    """A curve with its uncertainty, found from noisy values by largest likelihood.

    Parameters
    ----------
    x, y : ndarray, shape (n,)
        Points and values, both of the order of one.
    noise : ndarray, shape (n,)
        Standard errors of the values up to a common factor, which is found.
    start : SmoothCurve, optional
        A curve through similar values, to begin the search at.

    Attributes
    ----------
    length, amplitude, noise_factor : float
        Of the covariance, and the factor of `noise`.
    """

    length: float
    amplitude: float
    noise_factor: float

    def __init__(self, x: Array, y: Array, noise: Array, start: SmoothCurve | None = None) -> None:
        self._x, self._offset, self._noise = x, float(np.mean(y)), noise
        values = y - self._offset

        def cost(logarithms: Array) -> float:
            """Minus the logarithm of the marginal likelihood, less a constant."""
            factor = self._factorised(*np.exp(logarithms))
            return float(
                0.5 * values @ cho_solve(factor, values) + np.log(np.diag(factor[0])).sum()
            )

        first = _START if start is None else (start.length, start.amplitude, start.noise_factor)
        found = minimize(
            cost, np.log(first), method="L-BFGS-B", bounds=[tuple(np.log(b)) for b in _BOUNDS]
        )
        self.length, self.amplitude, self.noise_factor = np.exp(found.x).tolist()
        self._factor = self._factorised(self.length, self.amplitude, self.noise_factor)
        self._weights = cho_solve(self._factor, values)

    def _factorised(self, length: float, amplitude: float, noise_factor: float) -> tuple:
        scaled = np.abs(self._x[:, None] - self._x) * np.sqrt(5.0) / length
        covariance = amplitude**2 * _matern(scaled) + _MEAN_VARIANCE
        covariance[np.diag_indices_from(covariance)] += (noise_factor * self._noise) ** 2 + 1e-11
        return cho_factor(covariance, lower=True)

    def _scaled(self, x: Array) -> Array:
        return (np.asarray(x)[..., None] - self._x) * np.sqrt(5.0) / self.length

    def _covariance(self, x: Array) -> Array:
        return self.amplitude**2 * _matern(np.abs(self._scaled(x))) + _MEAN_VARIANCE

    def _covariance_slope(self, x: Array) -> Array:
        scaled = self._scaled(x)
        bell = (1.0 + np.abs(scaled)) * np.exp(-np.abs(scaled))
        return -(self.amplitude**2) * np.sqrt(5.0) / (3.0 * self.length) * scaled * bell

    def value(self, x: Array) -> Array:
        """Return the curve."""
        mean: Array = self._offset + self._covariance(x) @ self._weights
        return mean

    def slope(self, x: Array) -> Array:
        """Return the derivative of the curve."""
        mean: Array = self._covariance_slope(x) @ self._weights
        return mean

    def value_stderr(self, x: float) -> float:
        """Return the standard error of the curve at a point."""
        k = self._covariance(np.array(x))
        prior = self.amplitude**2 + _MEAN_VARIANCE
        return float(np.sqrt(max(prior - k @ cho_solve(self._factor, k), 0.0)))

    def slope_stderr(self, x: float) -> float:
        """Return the standard error of the derivative at a point."""
        k = self._covariance_slope(np.array(x))
        prior = 5.0 / 3.0 * (self.amplitude / self.length) ** 2
        return float(np.sqrt(max(prior - k @ cho_solve(self._factor, k), 0.0)))


def _matern(scaled: Array) -> Array:
    return (1.0 + scaled + scaled**2 / 3.0) * np.exp(-scaled)
