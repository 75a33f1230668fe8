"""The shape of silicon's Raman line, with exact derivatives.

The one-phonon line of silicon is a Lorentzian. Heavy doping makes it interfere with
electronic transitions (Fano), and the spectrometer convolves it with its own, nearly
Gaussian, response (Voigt). One expression holds all of them. With the Fano asymmetry
f = 1/q, the profile (1 + f·e)²/(1 + e²), e = 2(x − centre)/fwhm, is the constant f² (part of
the background) plus

    (1 − f²)·D(e) + 2f·X(e),   D = 1/(1 + e²),   X = e/(1 + e²).

D and X are real and imaginary part of one analytic function, 1/(1 − ie), so a Gaussian response
turns both into real and imaginary part of the Faddeeva function w(z): Abramowitz and
Stegun, Handbook of Mathematical Functions, 7.1 and 7.4.13, with w'(z) = −2z·w(z) + 2i/√π.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.special import wofz

from hotlever.types import Array

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
