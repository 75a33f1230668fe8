"""The weighted least-squares problem of one spectrum: line, background and band."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass

import numpy as np
from scipy.optimize import leastsq

from hotlever.raman import lineshape, noise
from hotlever.raman.lineshape import Array


def bounded_exp(logarithm: float) -> float:
    """A width from its logarithm, where a diverging fit may have left any number."""
    return math.exp(min(max(float(logarithm), -50.0), 50.0))


@dataclass(frozen=True)
class Problem:
    """The model on one spectrum's samples, and which parameters it has.

    Parameters are [centre, ln fwhm, height, background, slope, (ln sigma), (fano),
    (band height, band centre, ln band fwhm)].
    """

    x: Array
    y: Array
    origin: float
    fit_sigma: bool
    fixed_sigma: float
    fit_fano: bool
    with_band: bool = False
    priors: tuple[tuple[int, float, float], ...] = ()

    def size(self) -> int:
        return 5 + self.fit_sigma + self.fit_fano + 3 * self.with_band

    def evaluate(self, p: Array) -> tuple[Array, Array, Array]:
        """Model (n,), its Jacobian (n, parameters), and the line's part (n,)."""
        with np.errstate(over="ignore", invalid="ignore"):
            next_one = 5
            sigma, fano = self.fixed_sigma, 0.0
            if self.fit_sigma:
                sigma = bounded_exp(p[next_one])
                next_one += 1
            if self.fit_fano:
                fano = float(p[next_one])
                next_one += 1
            fwhm = bounded_exp(p[1])
            unit, slopes = lineshape.line(self.x, float(p[0]), fwhm, fano, sigma)
            part = p[2] * unit
            u = self.x - self.origin
            columns = [p[2] * slopes[0], p[2] * slopes[1], unit, np.ones_like(u), u]
            if self.fit_sigma:
                columns.append(p[2] * slopes[3])
            if self.fit_fano:
                columns.append(p[2] * slopes[2])
            value = part + p[3] + p[4] * u
            if self.with_band:
                height, centre, log_fwhm = p[next_one : next_one + 3]
                band_fwhm = bounded_exp(log_fwhm)
                unit_band, band_slopes = lineshape.band(self.x, float(centre), band_fwhm)
                value = value + height * unit_band
                columns += [unit_band, height * band_slopes[0], height * band_slopes[1]]
            return value, np.stack(columns, axis=1), part

    def solve(self, start: Array, variance: Array, use: noise.Mask) -> tuple[Array, Array]:
        """Weighted least squares: the parameters and the weighted Jacobian at the solution."""
        weight = 1.0 / np.sqrt(variance[use])
        indices = [index for index, _, _ in self.priors]
        means = np.array([mean for _, mean, _ in self.priors])
        spreads = np.array([spread for _, _, spread in self.priors])
        rows = np.zeros((len(indices), self.size()))
        rows[np.arange(len(indices)), indices] = 1.0 / spreads if indices else 1.0
        last: tuple[bytes, Array, Array] = (b"", weight, weight)

        def both(p: Array) -> tuple[bytes, Array, Array]:
            # MINPACK asks for the residual and the Jacobian at the same point in two calls
            nonlocal last
            key = p.tobytes()
            if key != last[0]:
                value, jacobian, _ = self.evaluate(p)
                residual = (value - self.y)[use] * weight
                scaled = jacobian[use] * weight[:, None]
                if indices:
                    residual = np.concatenate([residual, (p[indices] - means) / spreads])
                    scaled = np.concatenate([scaled, rows])
                if not np.isfinite(residual).all():
                    residual, scaled = np.full_like(residual, 1e30), np.nan_to_num(scaled)
                last = (key, residual, scaled)
            return last

        # leastsq is the thinnest door to MINPACK's Levenberg-Marquardt: the wrapping that
        # least_squares adds takes longer than the fit of a few hundred samples
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)
            p = leastsq(
                lambda p: both(p)[1],
                start,
                Dfun=lambda p: both(p)[2],
                full_output=True,
                ftol=1e-9,
                xtol=1e-8,
                maxfev=200,
            )[0]
        return np.asarray(p), both(np.asarray(p))[2]


@dataclass(frozen=True)
class Solution:
    problem: Problem
    p: Array
    jacobian: Array
    value: Array
    part: Array
    variance: Array
    use: noise.Mask

    @property
    def covariance(self) -> Array:
        """Of the parameters; the variance already carries the residuals' scale."""
        scale = np.linalg.norm(self.jacobian, axis=0)
        scale[scale == 0.0] = 1.0
        scaled = self.jacobian / scale
        return np.asarray(np.linalg.pinv(scaled.T @ scaled, hermitian=True)) / np.outer(
            scale, scale
        )
