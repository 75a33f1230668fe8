"""The weighted least-squares problem of one spectrum: line, background and band.

The model has ten parameters, by place: the line's centre, ln fwhm and height, the background's
level and slope, the line's asymmetry, ln sigma of the spectrometer's response, and the band's
height, centre and ln fwhm.
"""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.optimize import leastsq

from hotlever.raman import lineshape
from hotlever.raman.noise import Mask
from hotlever.types import Array


class At:
    """Places of the parameters."""

    CENTRE, LOG_FWHM, HEIGHT, LEVEL, SLOPE, FANO, LOG_SIGMA = range(7)
    BAND = BAND_HEIGHT, BAND_CENTRE, LOG_BAND_FWHM = 7, 8, 9


def width_of(logarithm: float) -> float:
    """A width from its logarithm (0 from −∞), where a diverging fit may have left any number."""
    if logarithm == -math.inf:
        return 0.0
    return math.exp(min(max(float(logarithm), -50.0), 50.0))


@dataclass(frozen=True)
class Problem:
    """A spectrum, the parameters that are free (ascending), and what is known of them before.

    ``priors`` are places of parameters, with mean and standard deviation. ``clipped`` are the
    samples of a clipped top.
    """

    x: Array
    y: Array
    origin: float
    free: tuple[int, ...]
    priors: tuple[tuple[int, float, float], ...] = ()
    clipped: slice | None = None

    @property
    def shown(self) -> Mask:
        """Samples that no clipped top hides."""
        shown = np.ones(self.x.size, dtype=bool)
        if self.clipped is not None:
            shown[max(self.clipped.start - 1, 0) : self.clipped.stop + 1] = False
        return shown

    def evaluate(self, p: Array) -> tuple[Array, Array, Array]:
        """Model (n,), its Jacobian (n, free), and the line's part (n,)."""
        with np.errstate(over="ignore", invalid="ignore"):
            centre, log_fwhm, height, level, slope, fano, log_sigma, *band = p.tolist()
            fwhm, sigma = width_of(log_fwhm), width_of(log_sigma)
            unit, slopes = lineshape.line(self.x, centre, fwhm, fano, sigma)
            part = height * unit
            u = self.x - self.origin
            value = part + level + slope * u
            by_centre, by_fwhm, by_fano, by_sigma = height * slopes
            columns = [by_centre, by_fwhm, unit, np.ones_like(u), u, by_fano, by_sigma]
            if At.BAND_HEIGHT in self.free:
                unit, slopes = lineshape.band(self.x, band[1], width_of(band[2]))
                value += band[0] * unit
                columns += [unit, *(band[0] * slopes)]
            return value, np.array([columns[place] for place in self.free]).T, part

    def weighted(self, p: Array, variance: Array, use: Mask) -> tuple[Array, Array]:
        """Residuals over their standard deviations, priors last, and the Jacobian of both."""
        value, jacobian, _ = self.evaluate(p)
        weight = 1.0 / np.sqrt(variance[use])
        residual, jacobian = (value - self.y)[use] * weight, jacobian[use] * weight[:, None]
        if self.priors:
            places, mean, spread = np.array(self.priors).T
            residual = np.append(residual, (p[places.astype(int)] - mean) / spread)
            jacobian = np.append(jacobian, (places[:, None] == self.free) / spread[:, None], 0)
        if not np.isfinite(residual).all():
            residual, jacobian = np.full_like(residual, 1e30), np.nan_to_num(jacobian)
        return residual, jacobian

    def solve(self, start: Array, variance: Array, use: Mask) -> Array:
        """Weighted least squares from a start, where the parameters stay that are not free."""
        free = list(self.free)

        def all_of(some: Array) -> Array:
            p = start.copy()
            p[free] = some
            return p

        @lru_cache(maxsize=1)
        def at(content: bytes) -> tuple[Array, Array]:
            # MINPACK asks for the residual and the Jacobian at the same point in two calls
            return self.weighted(all_of(np.frombuffer(content)), variance, use)

        # leastsq is the thinnest door to MINPACK's Levenberg-Marquardt: the wrapping that
        # least_squares adds takes longer than the fit of a few hundred samples
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)
            found = leastsq(
                lambda some: at(some.tobytes())[0],
                start[free],
                Dfun=lambda some: at(some.tobytes())[1],
                full_output=True,
                ftol=1e-9,
                xtol=1e-8,
                maxfev=200,
            )[0]
        return all_of(found)


@dataclass(frozen=True)
class Solution:
    """Parameters that fit a spectrum, the curve, the noise it leaves, and the samples used."""

    problem: Problem
    p: Array
    value: Array
    variance: Array
    use: Mask

    @property
    def covariance(self) -> Array:
        """Of all parameters (10, 10); the variance already carries the residuals' scale."""
        _, jacobian = self.problem.weighted(self.p, self.variance, self.use)
        scale = np.linalg.norm(jacobian, axis=0)
        scale[scale == 0.0] = 1.0
        scaled = jacobian / scale
        covariance = np.zeros((self.p.size, self.p.size))
        covariance[np.ix_(self.problem.free, self.problem.free)] = np.linalg.pinv(
            scaled.T @ scaled, hermitian=True
        ) / np.outer(scale, scale)
        return covariance

    @property
    def misfit(self) -> float:
        """Variance of the weighted residuals over half that of their neighbours' differences."""
        weighted = ((self.problem.y - self.value) / np.sqrt(self.variance))[self.use]
        local = 0.5 * float(np.mean(np.diff(weighted) ** 2))
        return float(np.mean(weighted**2)) / local if local > 0.0 else 1.0
