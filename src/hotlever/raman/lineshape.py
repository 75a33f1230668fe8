"""Silicon's Raman line: its shape with exact derivatives, its fit, how it is asked for, and found.

The one-phonon line of silicon is a Lorentzian. Heavy doping makes it interfere with
electronic transitions (Fano), and the spectrometer convolves it with its own, nearly
Gaussian, response (Voigt). One expression holds all of them. With the Fano asymmetry
f = 1/q, the profile (1 + f·e)²/(1 + e²), e = 2(x − centre)/fwhm, is the constant f² (part of
the background) plus

    (1 − f²)·D(e) + 2f·X(e),   D = 1/(1 + e²),   X = e/(1 + e²).

D and X are real and imaginary part of one analytic function, 1/(1 − ie), so a Gaussian response
turns both into real and imaginary part of the Faddeeva function w(z): Abramowitz and
Stegun, Handbook of Mathematical Functions, 7.1 and 7.4.13, with w'(z) = −2z·w(z) + 2i/√π.

With a background, and perhaps a band, the line is the model of a spectrum (`LineProblem`), whose
ten parameters are, by place: the line's centre, ln fwhm and height, the background's level and
slope, the line's asymmetry, ln sigma of the spectrometer's response, and the band's height, centre
and ln fwhm.
"""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal, get_args

import numpy as np
from scipy.special import wofz

from hotlever.errors import InputError, counted, unknown_name
from hotlever.types import Array, Mask

LineShape = Literal["lorentzian", "voigt", "fano"]

#: Part of the spectrum that is fitted, cm⁻¹: the line from 0 K to silicon's melting point
#: with background on both sides, clear of the 2TA (300 cm⁻¹) and 2TO (950 cm⁻¹) bands.
WINDOW = (440.0, 600.0)
LINE_RANGE = (475.0, 535.0)  #: where a silicon line can be, cm⁻¹
MIN_SAMPLES = 12  #: fewer in the window are no spectrum to fit
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
class LineProblem:
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
    def unclipped(self) -> Mask:
        """Samples that no clipped top hides."""
        mask = np.ones(self.x.size, dtype=bool)
        if self.clipped is not None:
            mask[max(self.clipped.start - 1, 0) : self.clipped.stop + 1] = False
        return mask

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
class FittedLine:
    """Parameters that fit a spectrum, the curve, the noise it leaves, and the samples used."""

    problem: LineProblem
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
    def leverage(self) -> Array:
        """The share of each used sample's noise that the parameters have taken up."""
        _, jacobian = self.problem.weighted(self.p, self.variance, self.use)
        # a norm would overflow where a fit has gone far off
        scale = np.abs(jacobian).max(axis=0)
        orthogonal, _ = np.linalg.qr(jacobian / np.where(scale > 0.0, scale, 1.0))
        return np.asarray(np.sum(orthogonal[: int(self.use.sum())] ** 2, axis=1))

    @property
    def misfit(self) -> float:
        """Variance of the weighted residuals over half that of their neighbours' differences."""
        weighted = ((self.problem.y - self.value) / np.sqrt(self.variance))[self.use]
        local = 0.5 * float(np.mean(np.diff(weighted) ** 2))
        return float(np.mean(weighted**2)) / local if local > 0.0 else 1.0


# --- what is asked for, and found ----------------------------------------------------------------


class NoSiliconLine(InputError):
    """There is no silicon line in the spectrum."""


@dataclass(frozen=True)
class PeakOptions:
    """How to fit the line.

    The shape "voigt" adds the spectrometer's Gaussian response, "fano" the asymmetry of heavily
    doped silicon. A resolution given with "fano" convolves the Fano line too.

    Raises
    ------
    InputError
        Naming the option at fault.
    """

    shape: LineShape = "lorentzian"
    #: FWHM of the spectrometer's response, cm⁻¹. Left out with "voigt", it is fitted.
    resolution: float | None = None
    band: bool = True  #: whether a broad band on the low side may be added to the model
    #: What other spectra of the instrument say for a band, the sum of their `Peak.band_evidence`;
    #: left out, those say it that are measured together.
    band_evidence: float | None = None
    #: Where the line is, cm⁻¹, near enough for the fit to begin there; left out, it is looked for.
    start: float | None = None
    window: tuple[float, float] = WINDOW  #: part of the spectrum that is fitted, cm⁻¹

    def __post_init__(self) -> None:
        if self.shape not in get_args(LineShape):
            raise unknown_name("line shape", str(self.shape), get_args(LineShape))
        low, high = LINE_RANGE
        if self.start is not None and not low < self.start < high:
            raise InputError(
                f"start: found {self.start:g} cm⁻¹, expected a place between {low:g} and {high:g}, "
                "where silicon's line can be"
            )
        low, high = self.window
        if not WINDOW[0] <= low < high <= WINDOW[1]:
            raise InputError(
                f"window: found {low:g} to {high:g} cm⁻¹, expected a part of {WINDOW[0]:g} to "
                f"{WINDOW[1]:g}"
            )
        if self.resolution is not None and not 0 < self.resolution < 50:
            raise InputError(
                f"resolution: found {self.resolution:g}, expected a width in cm⁻¹ between 0 and 50"
            )
        if self.resolution is not None and self.shape == "lorentzian":
            raise InputError("resolution: a Lorentzian has none; use the shape 'voigt' (or 'fano')")


@dataclass(frozen=True)
class Band:
    """The broad band under or beside the line (Gaussian): cm⁻¹, cm⁻¹, counts."""

    centre: float
    fwhm: float
    height: float


@dataclass(frozen=True)
class Peak:
    """The fitted silicon line: cm⁻¹, and counts."""

    centre: float
    centre_stderr: float
    fwhm: float  #: of the Lorentzian, free of the spectrometer's response where that is modelled
    fwhm_stderr: float
    area: float  #: counts · cm⁻¹
    area_stderr: float
    height: float  #: of the Lorentzian
    background: float  #: at `origin`
    slope: float  #: of the background, counts per cm⁻¹
    origin: float
    fano: float = 0.0  #: asymmetry 1/q; 0 unless fitted
    fano_stderr: float = 0.0
    resolution: float = 0.0  #: FWHM of the spectrometer's response in the model; 0 is none
    band: Band | None = None  #: on the low side, if that is likelier than none
    #: By how much χ² falls with a band, less what its parameters bring by chance.
    band_evidence: float = 0.0
    #: Residual variance over that of neighbours' differences: 1 where only noise is left.
    misfit: float = 1.0
    samples: int = 0  #: fitted
    spikes: tuple[float, ...] = ()  #: places of the samples left out as cosmic rays
    clipped: tuple[float, float] | None = None  #: ends of the top that was left out
    #: Of "cosmic-ray", "saturated", "low-shoulder", "low-band", "edge", "coarse", "misfit" and
    #: "band-in-doubt".
    flags: tuple[str, ...] = ()

    def model(self, x: Array) -> Array:
        """The whole fitted curve at `x` (cm⁻¹), counts."""
        x = np.asarray(x, dtype=float)
        sigma = self.resolution * SIGMA_PER_FWHM
        value = self.height * line(x, self.centre, self.fwhm, self.fano, sigma)[0]
        value = value + self.baseline(x)
        if self.band is not None:
            value += self.band.height * band(x, self.band.centre, self.band.fwhm)[0]
        return np.asarray(value)

    def baseline(self, x: Array) -> Array:
        """The sloping background at `x` (cm⁻¹), counts."""
        return np.asarray(self.background + self.slope * (np.asarray(x) - self.origin))


def in_window(x: Array, where: str, window: tuple[float, float] = WINDOW) -> Mask:
    """Samples of an axis (cm⁻¹) that are fitted; InputError if they are too few."""
    low, high = window
    inside = (x >= low) & (x <= high)
    count = int(np.count_nonzero(inside))
    if count < MIN_SAMPLES:
        raise InputError(
            f"{where}{counted(count, 'sample')} between {low:g} and "
            f"{high:g} cm⁻¹, expected at least {MIN_SAMPLES} around silicon's line"
        )
    return np.asarray(inside)


def observed_width(lorentzian: float, gaussian: float) -> float:
    """FWHM of a Voigt line from those of its parts, to 0.02 % (Olivero and Longbothum 1977).

    Examples
    --------
    >>> round(observed_width(3.0, 0.0), 3), observed_width(0.0, 2.0)
    (3.0, 2.0)
    """
    return 0.5346 * lorentzian + math.sqrt(0.2166 * lorentzian**2 + gaussian**2)
