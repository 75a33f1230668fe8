"""Where the silicon line of a spectrum is, how wide and how strong, and how sure we are.

The fit needs no start values. Its model is the line (`lineshape.line`) on a sloping
background, and, where the residuals ask for it, a broad band on the low side: disordered
silicon near 480 cm⁻¹, or a shoulder from warmer surroundings in the laser spot. Left out,
such a band pulls the centre of a hot, weak line by more than a wavenumber (some 50 K).
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Literal, get_args

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.optimize import leastsq

from hotlever.errors import InputError, unknown_name
from hotlever.raman import lineshape, noise
from hotlever.raman.lineshape import Array

Shape = Literal["lorentzian", "voigt", "fano"]

WINDOW = (440.0, 600.0)
"""Part of the spectrum that is fitted, cm⁻¹: the line from 0 K to silicon's melting point
with background on both sides, clear of the 2TA (300 cm⁻¹) and 2TO (950 cm⁻¹) bands."""
LINE_RANGE = (475.0, 535.0)
"""Where a silicon line can be, cm⁻¹."""
MIN_SAMPLES = 12
"""Fewer samples than this in the window are no spectrum to fit."""

DETECTION_SIGMAS = 5.0
"""A line's area must exceed its standard error so many times."""
MISFIT_LIMIT = 1.6
"""From this ratio on the residuals are flagged as more than noise."""
_BAND_GAIN = 20.0  # drop of chi-square that a band with three parameters must bring
_BAND_FWHM, _BAND_SPREAD = 25.0, 0.6  # soft prior of the band: ln fwhm = ln 25 ± 0.6
_SMALL_MISFIT = 1.25  # below it the line model is the right one
_WIDE = 9.0  # cm⁻¹; a line this wide may be two
_SIGMA_SPREAD = 1.0  # soft prior of an unknown spectrometer response: a factor e
_NATURAL_WIDTH = (math.log(4.0), 0.7)  # soft prior of ln fwhm, with an unknown response only
_MIN_FWHM_SAMPLES = 0.5
_MAX_FWHM = 45.0


class NoSiliconLine(InputError):
    """There is no silicon line in the spectrum."""


@dataclass(frozen=True)
class PeakOptions:
    """How to fit the line.

    Attributes
    ----------
    shape : {"lorentzian", "voigt", "fano"}
        "voigt" adds the spectrometer's Gaussian response, "fano" the asymmetry of heavily
        doped silicon. A `resolution` given with "fano" convolves the Fano line too.
    resolution : float, optional
        FWHM of the spectrometer's response, cm⁻¹. Left out with "voigt", it is fitted.
    band : bool
        Whether a broad band on the low side may be added to the model.
    """

    shape: Shape = "lorentzian"
    resolution: float | None = None
    band: bool = True

    def validate(self) -> PeakOptions:
        """Return self, or raise InputError naming the option at fault."""
        if self.shape not in get_args(Shape):
            raise unknown_name("line shape", str(self.shape), get_args(Shape))
        if self.resolution is not None:
            if not (math.isfinite(self.resolution) and 0 < self.resolution < 50):
                raise InputError(
                    f"resolution: found {self.resolution:g}, expected a width in cm⁻¹ "
                    "between 0 and 50"
                )
            if self.shape == "lorentzian":
                raise InputError(
                    "resolution: a Lorentzian has none; use the shape 'voigt' (or 'fano')"
                )
        return self


@dataclass(frozen=True)
class Band:
    """The broad band under or beside the line (Gaussian): cm⁻¹, cm⁻¹, counts."""

    centre: float
    fwhm: float
    height: float


@dataclass(frozen=True)
class Peak:
    """The fitted silicon line.

    Attributes
    ----------
    centre, centre_stderr : float
        cm⁻¹.
    fwhm, fwhm_stderr : float
        Full width of the Lorentzian, free of the spectrometer's response where that is part
        of the model, cm⁻¹.
    area, area_stderr : float
        Counts · cm⁻¹.
    height : float
        Of the Lorentzian, counts.
    background, slope : float
        At `origin`, counts, and counts per cm⁻¹.
    fano, fano_stderr : float
        Asymmetry 1/q; 0 unless fitted.
    resolution : float
        FWHM of the spectrometer's response in the model, cm⁻¹; 0 is none.
    band : Band or None
        The low-side band, if the data asked for one.
    misfit : float
        Residual variance over the variance of neighbouring differences: 1 where noise is
        all that is left.
    samples : int
        Samples fitted.
    spikes : tuple of float
        Positions of the samples left out as cosmic rays, cm⁻¹.
    clipped : (float, float) or None
        Ends of the flat top that was left out, cm⁻¹.
    flags : tuple of str
        Of "cosmic-ray", "saturated", "low-shoulder", "low-band", "edge", "coarse", "misfit".
    """

    centre: float
    centre_stderr: float
    fwhm: float
    fwhm_stderr: float
    area: float
    area_stderr: float
    height: float
    background: float
    slope: float
    origin: float
    fano: float = 0.0
    fano_stderr: float = 0.0
    resolution: float = 0.0
    band: Band | None = None
    misfit: float = 1.0
    samples: int = 0
    spikes: tuple[float, ...] = ()
    clipped: tuple[float, float] | None = None
    flags: tuple[str, ...] = field(default=())

    def model(self, x: Array) -> Array:
        """The whole fitted curve at `x` (cm⁻¹), counts."""
        x = np.asarray(x, dtype=float)
        sigma = self.resolution * lineshape.SIGMA_PER_FWHM
        value = self.height * lineshape.line(x, self.centre, self.fwhm, self.fano, sigma)[0]
        value = value + self.baseline(x)
        if self.band is not None:
            value += self.band.height * lineshape.band(x, self.band.centre, self.band.fwhm)[0]
        return np.asarray(value)

    def baseline(self, x: Array) -> Array:
        """The sloping background at `x` (cm⁻¹), counts."""
        return np.asarray(self.background + self.slope * (np.asarray(x) - self.origin))


def _exp(logarithm: float) -> float:
    """A width from its logarithm, where a diverging fit may have left any number."""
    return math.exp(min(max(float(logarithm), -50.0), 50.0))


@dataclass(frozen=True)
class _Problem:
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
                sigma = _exp(p[next_one])
                next_one += 1
            if self.fit_fano:
                fano = float(p[next_one])
                next_one += 1
            fwhm = _exp(p[1])
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
                band_fwhm = _exp(log_fwhm)
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
class _Solution:
    problem: _Problem
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


def fit_peak(x: Array, y: Array, options: PeakOptions | None = None, where: str = "") -> Peak:
    """Fit the silicon line of one spectrum.

    Parameters
    ----------
    x : (n,) array
        Raman shift, cm⁻¹, ascending.
    y : (n,) array
        Intensity, in counts or anything proportional to counts less a constant.
    options : PeakOptions, optional
    where : str
        Name of the spectrum, for error messages.

    Returns
    -------
    Peak
        Standard errors are scaled by the residuals, so they need no detector gain.

    Raises
    ------
    NoSiliconLine
        If no line stands out of the noise between 475 and 535 cm⁻¹.

    Examples
    --------
    >>> x = np.arange(440.0, 600.0, 0.5)
    >>> counts = 100 + 900 / (1 + ((x - 520.7) / 1.6) ** 2)
    >>> noisy = np.random.default_rng(0).poisson(counts).astype(float)
    >>> peak = fit_peak(x, noisy)
    >>> abs(peak.centre - 520.7) < 3 * peak.centre_stderr < 0.1
    True
    """
    options = (options or PeakOptions()).validate()
    prefix = f"{where}: " if where else ""
    x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    inside = (x >= WINDOW[0]) & (x <= WINDOW[1])
    if np.count_nonzero(inside) < MIN_SAMPLES:
        raise InputError(
            f"{prefix}{np.count_nonzero(inside)} samples between {WINDOW[0]:g} and "
            f"{WINDOW[1]:g} cm⁻¹, expected at least {MIN_SAMPLES}"
        )
    x, y = x[inside], y[inside]
    missing = NoSiliconLine(
        f"{prefix}no silicon line found between {LINE_RANGE[0]:g} and {LINE_RANGE[1]:g} cm⁻¹"
    )
    if not np.ptp(y) > 0.0:
        raise missing
    problem, start, clipped = _start(x, y, options, missing)
    step = float(np.median(np.diff(x)))
    use = _without(~noise.likely_spikes(y, float(np.percentile(y, 20)), step), clipped)
    variance = np.maximum(noise.robust_sigma(y - np.median(y), np.abs(y)) ** 2, 1e-300)
    solution = _refine(problem, start, use, variance, clipped, passes=2)
    # beside a clipped line's flanks a band cannot be told from the hidden shape
    look = options.band and clipped is None
    richer = _with_band(solution, clipped) if look else None
    if richer is None:
        richer = _refine(problem, solution.p, solution.use, solution.variance, clipped)
    solution = richer
    return _peak(solution, options, clipped, missing)


def _start(
    x: Array, y: Array, options: PeakOptions, missing: NoSiliconLine
) -> tuple[_Problem, Array, slice | None]:
    """Start values from the spectrum itself."""
    background, slope = _coarse_background(x, y)
    origin = float(0.5 * (x[0] + x[-1]))
    flat = y - background - slope * (x - origin)
    step = float(np.median(np.diff(x)))
    clean = ~noise.likely_spikes(y, background, step)
    flat = np.interp(x, x[clean], flat[clean])
    # three samples and their median: no single spike makes a line, a coarse axis keeps one
    smooth = np.median(
        np.stack([np.roll(flat, 1), flat, np.roll(flat, -1)]), axis=0
    )  # the rolled ends lie outside the line's range
    allowed = (x >= LINE_RANGE[0]) & (x <= LINE_RANGE[1])
    ranked = np.where(allowed & clean, smooth, -np.inf)
    if not np.isfinite(ranked).any():
        raise missing
    peak = int(np.argmax(ranked))
    height = float(max(flat[peak], smooth[peak]))
    if height <= 0.0:
        raise missing
    above = smooth > 0.5 * height
    left = right = peak
    while left > 0 and above[left - 1]:
        left -= 1
    while right < x.size - 1 and above[right + 1]:
        right += 1
    fwhm = float(np.clip(x[right] - x[left] + step, 1.5 * step, _MAX_FWHM))
    clipped = noise.plateau(y, allowed & clean, float(np.percentile(y, 5)))
    if clipped is not None:
        # flanks alone: the hidden top is higher than the clipped one
        peak = (clipped.start + clipped.stop - 1) // 2
        width = float(x[clipped.stop - 1] - x[clipped.start])
        height, fwhm = 2.0 * float(y[peak] - y.min()), max(width, 2.0 * step)
        background, slope = float(y.min()), 0.0
    start = [float(x[peak]), math.log(fwhm), height, background, slope]
    sigma, priors = 0.0, []
    fit_sigma = options.shape == "voigt" and options.resolution is None
    if options.resolution is not None:
        sigma = options.resolution * lineshape.SIGMA_PER_FWHM
    if fit_sigma:
        guess = math.log(max(step, 0.2 * fwhm) * 2.0 * lineshape.SIGMA_PER_FWHM)
        # on a coarse axis the two widths are hard to tell apart: keep both near what they are
        priors += [(1, *_NATURAL_WIDTH), (len(start), guess, _SIGMA_SPREAD)]
        start.append(guess)
    if options.shape == "fano":
        start.append(0.0)
    problem = _Problem(
        x,
        y,
        origin,
        fit_sigma=fit_sigma,
        fixed_sigma=sigma,
        fit_fano=options.shape == "fano",
        priors=tuple(priors),
    )
    return problem, np.array(start), clipped


def _coarse_background(x: Array, y: Array) -> tuple[float, float]:
    """Level at mid-window and slope of a line through the medians of the window's ends."""
    fifth = max(x.size // 6, 3)
    low, high = float(np.median(y[:fifth])), float(np.median(y[-fifth:]))
    x_low, x_high = float(np.median(x[:fifth])), float(np.median(x[-fifth:]))
    slope = (high - low) / (x_high - x_low)
    return low + slope * (0.5 * (x[0] + x[-1]) - x_low), slope


def _without(use: noise.Mask, clipped: slice | None) -> noise.Mask:
    if clipped is not None:
        use = use.copy()
        use[max(clipped.start - 1, 0) : clipped.stop + 1] = False
    return use


def _refine(
    problem: _Problem,
    start: Array,
    use: noise.Mask,
    variance: Array,
    clipped: slice | None,
    passes: int = 8,
) -> _Solution:
    """Fit, judge noise and spikes by the fit, and again until neither changes."""
    y, p = problem.y, start
    settled = False
    for _ in range(passes):
        p, jacobian = problem.solve(p, variance, use)
        value, _, part = problem.evaluate(p)
        if not np.all(np.isfinite(value)):
            break
        strict, lenient = noise.SPIKE_LINE_TOLERANCE
        tolerance = lenient if _misfit(y - value, variance, use) > _SMALL_MISFIT else strict
        new_use = _without(~noise.spikes(y, value, part, use, tolerance), clipped)
        # a line seen by one or two samples must not be thrown out as a cosmic ray
        if np.count_nonzero(new_use) < MIN_SAMPLES:
            new_use = use
        new_variance = noise.variance((y - value)[new_use], value[new_use], problem.size())
        full = np.interp(np.arange(y.size), np.flatnonzero(new_use), new_variance)
        same = bool(np.array_equal(new_use, use))
        settled = same and bool(np.allclose(full, variance, rtol=0.02))
        use, variance = new_use, full
        if settled:
            break
    if not settled:
        p, jacobian = problem.solve(p, variance, use)
        value, _, part = problem.evaluate(p)
    else:
        # weights of the last pass within 2 %: the errors take the newest scale
        value, full_jacobian, part = problem.evaluate(p)
        jacobian[: int(use.sum())] = full_jacobian[use] / np.sqrt(variance[use])[:, None]
    return _Solution(problem, p, jacobian, value, part, variance, use)


def _with_band(plain: _Solution, clipped: slice | None) -> _Solution | None:
    """The fit with a broad band on the low side, or None if the residuals ask for none."""
    problem = plain.problem
    centre, fwhm = float(plain.p[0]), _exp(plain.p[1])
    residual = np.where(plain.use, problem.y - plain.value, 0.0) / np.sqrt(plain.variance)
    width = max(0.5 * _BAND_FWHM, min(fwhm, _BAND_FWHM))
    step = float(np.median(np.diff(problem.x)))
    samples = width * lineshape.SIGMA_PER_FWHM / step
    # a matched filter: white noise of unit variance comes out with unit variance
    matched = gaussian_filter1d(residual, samples, mode="constant")
    matched *= math.sqrt(2.0 * math.sqrt(math.pi) * max(samples, 0.3))
    low_side = (problem.x < centre - 0.5 * fwhm) & (problem.x > problem.x[0] + 0.25 * width)
    if not low_side.any():
        return None
    at = int(np.argmax(np.where(low_side, matched, -np.inf)))
    size = problem.size()
    prior = (size + 2, math.log(_BAND_FWHM), _BAND_SPREAD)
    richer = replace(problem, with_band=True, priors=(*problem.priors, prior))
    starts = []
    if matched[at] > 3.0:
        height = float(np.sqrt(plain.variance[at]) * max(residual[at], 1.0))
        starts.append(np.concatenate([plain.p, [height, problem.x[at], math.log(_BAND_FWHM)]]))
    if fwhm > _WIDE:
        # one wide line may have swallowed a line and a band, and left no residual to see
        line = plain.p.copy()
        line[0], line[1] = centre + 0.2 * fwhm, math.log(0.4 * fwhm)
        extra = [0.4 * plain.p[2], centre - 0.6 * fwhm, math.log(_BAND_FWHM)]
        starts.append(np.concatenate([line, extra]))
    best, best_gain = None, _BAND_GAIN
    for start in starts:
        fitted = _refine(richer, start, plain.use, plain.variance, clipped)
        gain = _gain(plain, fitted)
        if gain > best_gain and _sound(fitted, size):
            best, best_gain = fitted, gain
    return best


def _gain(plain: _Solution, fitted: _Solution) -> float:
    """Drop of chi-square from one fit to the other, on the samples both use."""
    y, use = plain.problem.y, fitted.use & plain.use
    drop = (y - plain.value) ** 2 - (y - fitted.value) ** 2
    return float(np.sum(drop[use] / fitted.variance[use]))


def _sound(fitted: _Solution, band_at: int) -> bool:
    """Whether the band is one: positive, on the low side, beside a line of sane width."""
    p, x = fitted.p, fitted.problem.x
    return bool(
        np.all(np.isfinite(p))
        and p[2] > 0
        and p[band_at] > 0
        and x[0] - 10.0 < p[band_at + 1] < p[0]
        and _exp(p[1]) < _MAX_FWHM
    )


def _peak(
    solution: _Solution, options: PeakOptions, clipped: slice | None, missing: NoSiliconLine
) -> Peak:
    """Read the result off the solution, judge it and flag what a user should know."""
    problem, p, use = solution.problem, solution.p, solution.use
    x = problem.x
    if not np.all(np.isfinite(p)):
        raise missing
    covariance = solution.covariance
    errors = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    centre, fwhm, height = float(p[0]), _exp(p[1]), float(p[2])
    index = 5
    sigma, fano, fano_error = problem.fixed_sigma, 0.0, 0.0
    if problem.fit_sigma:
        sigma = _exp(p[index])
        index += 1
    resolution = sigma / lineshape.SIGMA_PER_FWHM
    step = float(np.median(np.diff(x)))
    gradient = np.zeros_like(p)
    if problem.fit_fano:
        fano, fano_error = float(p[index]), float(errors[index])
        gradient[index] = -2.0 * fano * height
        index += 1
    # area of the resonant part: (1 − f²)·π/2·height·fwhm
    factor = 0.5 * math.pi * fwhm
    gradient[1] = (1.0 - fano**2) * height
    gradient[2] = 1.0 - fano**2
    area = (1.0 - fano**2) * height * factor
    area_error = factor * math.sqrt(max(float(gradient @ covariance @ gradient), 0.0))
    if not (
        LINE_RANGE[0] < centre < LINE_RANGE[1]
        and _MIN_FWHM_SAMPLES * step < observed_width(fwhm, resolution) < _MAX_FWHM
        # a clipped line has no known height, but it is there
        and (clipped is not None or area > DETECTION_SIGMAS * area_error)
        and area > 0.0
    ):
        raise missing
    found_band = None
    if problem.with_band:
        found_band = Band(float(p[index + 1]), _exp(p[index + 2]), float(p[index]))
    clean = _without(np.ones_like(use), clipped)
    spiked = x[clean & ~use]
    misfit = _misfit(problem.y - solution.value, solution.variance, use)
    width = observed_width(fwhm, resolution)
    flags = _flags(solution, width, found_band, bool(spiked.size), clipped is not None, misfit)
    # residuals that are no noise are correlated: fewer samples count than there are
    errors *= math.sqrt(misfit) if misfit > MISFIT_LIMIT else 1.0
    ends = None
    if clipped is not None:
        ends = (float(x[clipped.start]), float(x[clipped.stop - 1]))
        # the flanks disagree with the clipped top by as much as detector blooming skews them
        errors[0] = math.hypot(float(errors[0]), centre - 0.5 * sum(ends))
    return Peak(
        centre=centre,
        centre_stderr=float(errors[0]),
        fwhm=fwhm,
        fwhm_stderr=float(errors[1]) * fwhm,
        area=area,
        area_stderr=area_error,
        height=height,
        background=float(p[3]),
        slope=float(p[4]),
        origin=problem.origin,
        fano=fano,
        fano_stderr=fano_error,
        resolution=resolution,
        band=found_band,
        misfit=misfit,
        samples=int(use.sum()),
        spikes=tuple(float(value) for value in spiked),
        clipped=ends,
        flags=flags,
    )


def observed_width(lorentzian: float, gaussian: float) -> float:
    """FWHM of a Voigt line from those of its parts, to 0.02 % (Olivero and Longbothum 1977).

    Examples
    --------
    >>> round(observed_width(3.0, 0.0), 3), observed_width(0.0, 2.0)
    (3.0, 2.0)
    """
    return 0.5346 * lorentzian + math.sqrt(0.2166 * lorentzian**2 + gaussian**2)


def _misfit(residual: Array, variance: Array, use: noise.Mask) -> float:
    """Variance of the weighted residuals over half that of their neighbours' differences."""
    weighted = (residual / np.sqrt(variance))[use]
    differences = np.diff(weighted)
    local = 0.5 * float(np.mean(differences**2))
    return float(np.mean(weighted**2)) / local if local > 0.0 else 1.0


def _flags(
    solution: _Solution,
    fwhm: float,
    found: Band | None,
    spiked: bool,
    saturated: bool,
    misfit: float,
) -> tuple[str, ...]:
    x, centre = solution.problem.x, float(solution.p[0])
    tests: list[tuple[str, Callable[[], bool]]] = [
        ("cosmic-ray", lambda: spiked),
        ("saturated", lambda: saturated),
        # near enough for the two to overlap above half their heights, or clear of the line
        ("low-shoulder", lambda: found is not None and centre - found.centre < _reach(found, fwhm)),
        ("low-band", lambda: found is not None and centre - found.centre >= _reach(found, fwhm)),
        ("edge", lambda: min(centre - x[0], x[-1] - centre) < 2.0 * fwhm),
        ("coarse", lambda: fwhm < 1.5 * float(np.median(np.diff(x)))),
        ("misfit", lambda: misfit > MISFIT_LIMIT),
    ]
    return tuple(name for name, holds in tests if holds())


def _reach(found: Band, fwhm: float) -> float:
    return 0.5 * found.fwhm + fwhm
