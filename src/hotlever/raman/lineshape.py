"""The shape of silicon's Raman line, with exact derivatives, and its fit by least squares.

The one-phonon line of silicon is a Lorentzian. Heavy doping makes it interfere with
electronic transitions (Fano), and the spectrometer convolves it with its own, nearly
Gaussian, response (Voigt). One expression holds all of them. With the Fano asymmetry
f = 1/q, the profile (1 + f·e)²/(1 + e²), e = 2(x − centre)/fwhm, is the constant f² (part of
the background) plus

    (1 − f²)·D(e) + 2f·X(e),   D = 1/(1 + e²),   X = e/(1 + e²).

D and X are real and imaginary part of one analytic function, 1/(1 − ie), so a Gaussian response
turns both into real and imaginary part of the Faddeeva function w(z): Abramowitz and
Stegun, Handbook of Mathematical Functions, 7.1 and 7.4.13, with w'(z) = −2z·w(z) + 2i/√π.

With a background, and perhaps a band, the line is the model of a spectrum (`Problem`), whose ten
parameters are, by place: the line's centre, ln fwhm and height, the background's level and slope,
the line's asymmetry, ln sigma of the spectrometer's response, and the band's height, centre and
ln fwhm.
"""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.special import wofz

from hotlever.types import Array, Mask

SIGMA_PER_FWHM = 1.0 / (2.0 * math.sqrt(2.0 * math.log(2.0)))


def line(
    x: Array, centre: float, fwhm: float, fano: float = 0.0, sigma: float = 0.0
) -> tuple[Array, Array]:
    """Silicon line of unit height (before interference and convolution) and its derivatives.

    Parameters
    ----------
    x : (n,) array
        Raman shift, cm⁻¹.
    centre, fwhm : float
        Centre and full width at half maximum of the Lorentzian, cm⁻¹.
    fano : float
        Asymmetry 1/q; 0 is a symmetric line.
    sigma : float
        Standard deviation of the spectrometer's Gaussian response, cm⁻¹; 0 is none.

    Returns
    -------
    value : (n,) array
    derivatives : (4, n) array
        With respect to centre, ln fwhm, fano and ln sigma (zeros where sigma is 0).

    Examples
    --------
    >>> value, _ = line(np.array([520.0, 521.5]), centre=520.0, fwhm=3.0)
    >>> value.tolist()
    [1.0, 0.5]
    """
    half = 0.5 * fwhm
    u = x - centre
    if sigma == 0.0:
        e = u / half
        profile = 1.0 / (1.0 - 1j * e)
        slope = 1j * profile * profile
        by_centre, by_fwhm, by_sigma = -slope / half, -slope * e, np.zeros_like(slope)
    else:
        width = sigma * math.sqrt(2.0)
        z = (u + 1j * half) / width
        w = wofz(z)
        dw = -2.0 * z * w + 2j / math.sqrt(math.pi)
        factor = math.sqrt(math.pi) * half / width
        profile = factor * w
        by_centre = -factor / width * dw
        by_fwhm = factor * (w + dw * (1j * half / width))
        by_sigma = -factor * (w + dw * z)
    parts = np.array([profile, by_centre, by_fwhm, by_sigma])
    value, by_centre, by_fwhm, by_sigma = (1.0 - fano * fano) * parts.real + 2 * fano * parts.imag
    by_fano = 2.0 * profile.imag - 2.0 * fano * profile.real
    return value, np.array([by_centre, by_fwhm, by_fano, by_sigma])


def band(x: Array, centre: float, fwhm: float) -> tuple[Array, Array]:
    """Gaussian band of unit height and its derivatives with respect to centre and ln fwhm.

    Examples
    --------
    >>> value, _ = band(np.array([480.0, 492.0]), centre=480.0, fwhm=24.0)
    >>> value.round(12).tolist()
    [1.0, 0.5]
    """
    k = 4.0 * math.log(2.0) / (fwhm * fwhm)
    u = x - centre
    value = np.exp(-k * u * u)
    return value, np.stack([2.0 * k * u * value, 2.0 * k * u * u * value])


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
            centre, log_fwhm, height, level, slope, fano, log_sigma, *low_band = p.tolist()
            fwhm, sigma = width_of(log_fwhm), width_of(log_sigma)
            unit, slopes = line(self.x, centre, fwhm, fano, sigma)
            part = height * unit
            u = self.x - self.origin
            value = part + level + slope * u
            by_centre, by_fwhm, by_fano, by_sigma = height * slopes
            columns = [by_centre, by_fwhm, unit, np.ones_like(u), u, by_fano, by_sigma]
            if At.BAND_HEIGHT in self.free:
                height, centre, log_fwhm = low_band
                unit, slopes = band(self.x, centre, width_of(log_fwhm))
                value += height * unit
                columns += [unit, *(height * slopes)]
            return value, np.array([columns[parameter] for parameter in self.free]).T, part

    def weighted(self, p: Array, variance: Array, use: Mask) -> tuple[Array, Array]:
        """Residuals over their standard deviations, priors last, and the Jacobian of both."""
        value, jacobian, _ = self.evaluate(p)
        weight = 1.0 / np.sqrt(variance[use])
        residual, jacobian = (value - self.y)[use] * weight, jacobian[use] * weight[:, None]
        if self.priors:
            parameters, mean, spread = np.array(self.priors).T
            residual = np.append(residual, (p[parameters.astype(int)] - mean) / spread)
            jacobian = np.append(jacobian, (parameters[:, None] == self.free) / spread[:, None], 0)
        if not np.isfinite(residual).all():
            residual, jacobian = np.full_like(residual, 1e30), np.nan_to_num(jacobian)
        return residual, jacobian

    def solve(self, start: Array, variance: Array, use: Mask) -> Array:
        """Weighted least squares from a start, where the parameters stay that are not free."""
        from scipy.optimize import leastsq  # takes a third of a second

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
            solution = leastsq(
                lambda some: at(some.tobytes())[0],
                start[free],
                Dfun=lambda some: at(some.tobytes())[1],
                full_output=True,
                ftol=1e-9,
                xtol=1e-8,
                maxfev=200,
            )[0]
        return all_of(solution)


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
