"""Where the silicon line of a spectrum is, how wide and how strong, and how sure we are.

The fit needs no start values. Its model is the line (`hotlever.raman.lineshape.line`) on a sloping
background, and, where the residuals ask for it, a broad band on the low side: disordered
silicon near 480 cm⁻¹, or a shoulder from warmer surroundings in the laser spot. Left out,
such a band pulls the centre of a hot, weak line by more than a wavenumber (tens of kelvin).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.ndimage import gaussian_filter1d

from hotlever.errors import InputError
from hotlever.raman import lineshape, noise
from hotlever.raman.lineshape import Array
from hotlever.raman.peak import (
    LINE_RANGE,
    MIN_SAMPLES,
    WINDOW,
    Band,
    NoSiliconLine,
    Peak,
    PeakOptions,
    observed_width,
)
from hotlever.raman.problem import Problem, Solution, bounded_exp

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
_COARSE = 1.5  # samples; a narrower line is hardly seen
_LONE = 1.2  # samples; a narrower line is no more than one of them
_NARROWEST = 1.2  # cm⁻¹; silicon's line is wider at any temperature
_SPIKE_MAX_STEP = 1.2  # cm⁻¹; on a coarser axis a cosmic ray is no narrower than the line
_MAX_FWHM = 45.0


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
    step = float(np.median(np.diff(x)))
    try:
        peak = _fit(x, y, options, missing)
    except NoSiliconLine:
        if step <= _SPIKE_MAX_STEP:
            raise
        peak = None
    if step <= _SPIKE_MAX_STEP or (peak is not None and not _spiky(peak, step)):
        assert peak is not None
        return peak
    # on a coarse axis a cosmic ray can look like a line: without it, the true one shows
    in_range = (x >= LINE_RANGE[0]) & (x <= LINE_RANGE[1])
    place = x[int(np.argmax(np.where(in_range, y, -np.inf)))] if peak is None else peak.centre
    left_out = np.abs(x - place) <= 1.1 * step
    if np.count_nonzero(~left_out) >= MIN_SAMPLES:
        try:
            other = _fit(x[~left_out], y[~left_out], options, missing)
        except NoSiliconLine:
            other = None
        if other is not None and not _spiky(other, step):
            flags = tuple(dict.fromkeys(("cosmic-ray", *other.flags)))
            hit = tuple(float(value) for value in x[left_out])
            return replace(other, spikes=tuple(sorted(other.spikes + hit)), flags=flags)
    if peak is None:
        raise missing
    return peak


def _spiky(peak: Peak, step: float) -> bool:
    """Whether a line is too narrow to be silicon's, or to be seen by this axis."""
    return peak.fwhm < _NARROWEST or observed_width(peak.fwhm, peak.resolution) < _LONE * step


def _fit(x: Array, y: Array, options: PeakOptions, missing: NoSiliconLine) -> Peak:
    problem, start, clipped = _start(x, y, options, missing)
    use = _without(~_likely_spikes(x, y, float(np.percentile(y, 20))), clipped)
    variance = np.maximum(noise.robust_sigma(y - np.median(y), np.abs(y)) ** 2, 1e-300)
    solution = _refine(problem, start, use, variance, clipped, passes=2)
    # beside a clipped line's flanks a band cannot be told from the hidden shape
    look = options.band and clipped is None
    richer = _with_band(solution, clipped) if look else None
    if richer is None:
        richer = _refine(problem, solution.p, solution.use, solution.variance, clipped)
    return _peak(richer, options, clipped, missing)


def _likely_spikes(x: Array, y: Array, base: float) -> noise.Mask:
    """Cosmic rays by sight; on a coarse axis only where no line of silicon can be."""
    found = noise.likely_spikes(y, base)
    if float(np.median(np.diff(x))) > _SPIKE_MAX_STEP:
        found &= (x < LINE_RANGE[0]) | (x > LINE_RANGE[1])
    return found


def _start(
    x: Array, y: Array, options: PeakOptions, missing: NoSiliconLine
) -> tuple[Problem, Array, slice | None]:
    """Start values from the spectrum itself."""
    background, slope = _coarse_background(x, y)
    origin = float(0.5 * (x[0] + x[-1]))
    flat = y - background - slope * (x - origin)
    step = float(np.median(np.diff(x)))
    clean = ~_likely_spikes(x, y, background)
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
    problem = Problem(
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
    problem: Problem,
    start: Array,
    use: noise.Mask,
    variance: Array,
    clipped: slice | None,
    passes: int = 8,
) -> Solution:
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
    return Solution(problem, p, jacobian, value, part, variance, use)


def _with_band(plain: Solution, clipped: slice | None) -> Solution | None:
    """The fit with a broad band on the low side, or None if the residuals ask for none."""
    problem = plain.problem
    centre, fwhm = float(plain.p[0]), bounded_exp(plain.p[1])
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


def _gain(plain: Solution, fitted: Solution) -> float:
    """Drop of chi-square from one fit to the other, on the samples both use."""
    y, use = plain.problem.y, fitted.use & plain.use
    drop = (y - plain.value) ** 2 - (y - fitted.value) ** 2
    return float(np.sum(drop[use] / fitted.variance[use]))


def _sound(fitted: Solution, band_at: int) -> bool:
    """Whether the band is one: positive, on the low side, beside a line of sane width."""
    p, x = fitted.p, fitted.problem.x
    return bool(
        np.all(np.isfinite(p))
        and p[2] > 0
        and p[band_at] > 0
        and x[0] - 10.0 < p[band_at + 1] < p[0]
        and bounded_exp(p[1]) < _MAX_FWHM
    )


def _peak(
    solution: Solution, options: PeakOptions, clipped: slice | None, missing: NoSiliconLine
) -> Peak:
    """Read the result off the solution, judge it and flag what a user should know."""
    problem, p, use = solution.problem, solution.p, solution.use
    x = problem.x
    if not np.all(np.isfinite(p)):
        raise missing
    covariance = solution.covariance
    errors = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    centre, fwhm, height = float(p[0]), bounded_exp(p[1]), float(p[2])
    index = 5
    sigma, fano, fano_error = problem.fixed_sigma, 0.0, 0.0
    if problem.fit_sigma:
        sigma = bounded_exp(p[index])
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
        found_band = Band(float(p[index + 1]), bounded_exp(p[index + 2]), float(p[index]))
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


def _misfit(residual: Array, variance: Array, use: noise.Mask) -> float:
    """Variance of the weighted residuals over half that of their neighbours' differences."""
    weighted = (residual / np.sqrt(variance))[use]
    differences = np.diff(weighted)
    local = 0.5 * float(np.mean(differences**2))
    return float(np.mean(weighted**2)) / local if local > 0.0 else 1.0


def _flags(
    solution: Solution,
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
        ("coarse", lambda: fwhm < _COARSE * float(np.median(np.diff(x)))),
        ("misfit", lambda: misfit > MISFIT_LIMIT),
    ]
    return tuple(name for name, holds in tests if holds())


def _reach(found: Band, fwhm: float) -> float:
    return 0.5 * found.fwhm + fwhm
