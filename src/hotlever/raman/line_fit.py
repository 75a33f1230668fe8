"""Where the silicon line of a spectrum is, how wide and how strong, and how sure we are.

The fit needs no start values, but takes the line's place as one. There are two models: the line
(`hotlever.raman.lineshape.line`) on a sloping background, and the same beside a broad band on
the low side: disordered silicon near 480 cm⁻¹, or a shoulder from warmer surroundings in the laser
spot. Left out, such a band pulls the centre of a hot, weak line by more than a wavenumber (tens of
kelvin).

Where both are possible noise would decide between them. Akaike's criterion gives each model its
weight (Burnham and Anderson, Model Selection and Multimodel Inference, 2nd ed., 2002, 2.9, 4.3).
The answer is that of the likelier one; its standard error holds the answer of the other as well, by
that one's weight.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.ndimage import gaussian_filter1d, median_filter
from scipy.special import expit

from hotlever.raman import detector_noise as noise
from hotlever.raman.lineshape import (
    LINE_RANGE,
    MIN_SAMPLES,
    SIGMA_PER_FWHM,
    At,
    Band,
    FittedLine,
    LineProblem,
    NoSiliconLine,
    Peak,
    PeakOptions,
    in_window,
    observed_width,
    width_of,
)
from hotlever.types import Array, Mask

#: cm⁻¹; no silicon line is wider.
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
    options = options or PeakOptions()
    prefix = f"{where}: " if where else ""
    x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    inside = in_window(x, prefix, options.window)
    x, y = x[inside], y[inside]
    peak = _fit(x, y, options)
    searched = options.start is None and _is_coarse(x)
    if searched and (peak is None or _spiky(peak, _step(x))):
        peak = _beside_cosmic_ray(x, y, options, peak) or peak
    if peak is None:
        raise NoSiliconLine(
            f"{prefix}no silicon line found between {LINE_RANGE[0]:g} and {LINE_RANGE[1]:g} cm⁻¹"
        )
    return peak


def with_hidden_top(peak: Peak, x: Array, gaps: Sequence[float]) -> Peak:
    """Return a line as clipped if its top is among the samples without a value.

    Beyond its range a detector may write that there is no number, or none at all.

    Parameters
    ----------
    peak : Peak
    x : (n,) array
        The samples that have a value, cm⁻¹.
    gaps : sequence of float
        Those that have none.
    """
    below, above = x[x <= peak.centre].max(initial=-np.inf), x[x > peak.centre].min(initial=np.inf)
    top = [gap for gap in gaps if below < gap < above]
    if not top or peak.clipped is not None:
        return peak
    return replace(
        peak,
        centre_stderr=_of_flanks(peak.centre_stderr, peak.centre, min(top), max(top)),
        clipped=(min(top), max(top)),
        flags=("saturated", *peak.flags),
    )


def _of_flanks(error: float, centre: float, low: float, high: float) -> float:
    """Return the error of a centre by the flanks of a line that is clipped between two places.

    They disagree with the middle of what is hidden by as much as detector blooming skews them.
    """
    return math.hypot(error, centre - 0.5 * (low + high))


def _step(x: Array) -> float:
    return float(np.median(np.diff(x)))


def _is_coarse(x: Array) -> bool:
    """Whether steps are so large that a cosmic ray, and the response, are as wide as the line."""
    return _step(x) > 1.2


def _in_range(x: Array) -> Mask:
    return np.asarray((x >= LINE_RANGE[0]) & (x <= LINE_RANGE[1]))


def _near(x: Array, start: float) -> Mask:
    """The samples about the place that is given, the nearest at least."""
    away = np.abs(x - start)
    return np.asarray(away <= max(3.0, float(away.min())))


def _spiky(peak: Peak, step: float) -> bool:
    """Whether a line is too narrow to be silicon's, or is no more than one sample of this axis."""
    return peak.fwhm < 1.2 or observed_width(peak.fwhm, peak.resolution) < 1.2 * step


def _beside_cosmic_ray(x: Array, y: Array, options: PeakOptions, spike: Peak | None) -> Peak | None:
    """The line without what looks like one: on a coarse axis a cosmic ray does."""
    ray = spike.centre if spike else x[np.argmax(np.where(_in_range(x), y, -np.inf))]
    hit = np.abs(x - ray) <= 1.1 * _step(x)
    peak = _fit(x[~hit], y[~hit], options) if np.count_nonzero(~hit) >= MIN_SAMPLES else None
    if peak is None or _spiky(peak, _step(x)):
        return None
    return replace(
        peak,
        spikes=tuple(sorted((*peak.spikes, *x[hit].tolist()))),
        flags=tuple(dict.fromkeys(("cosmic-ray", *peak.flags))),
    )


def _fit(x: Array, y: Array, options: PeakOptions) -> Peak | None:
    """The line, None where there is none."""
    # flat in whatever unit the intensity is
    started = _start(x, y, options) if np.ptp(y) > 1e-20 else None
    if started is None:
        return None
    problem, start = started
    use = problem.unclipped & ~_likely_spikes(x, y, float(np.percentile(y, 20)), options.start)
    variance = np.maximum(noise.robust_sigma(y - np.median(y), np.abs(y)) ** 2, 1e-300)
    plain = _refine(problem, start, use, variance)
    # beside a clipped line's flanks a band cannot be told from the hidden shape
    richer = _with_band(plain) if options.band and problem.clipped is None else None
    alone, beside = _peak(plain), _peak(richer) if richer is not None else None
    # a band that shares the line's area makes that uncertain, and not whether there is a line
    if not any(_stands_out(peak) for peak in (alone, beside) if peak is not None):
        return None
    if alone is None or beside is None or richer is None:
        return alone or beside
    # three parameters bring so much of χ² by chance, after Akaike
    own = _gain(plain, richer) - 6.0
    return _either(alone, beside, own, options.band_evidence or 0.0)


def _stands_out(peak: Peak) -> bool:
    # a clipped line has no known height, but it is there
    return peak.clipped is not None or peak.area > 5.0 * peak.area_stderr


def _either(alone: Peak, beside: Peak, own: float, elsewhere: float) -> Peak:
    """The likelier of two answers, with errors that hold the other.

    The evidence is how far χ² falls with a band beyond what three parameters bring by chance, in
    this spectrum and ``elsewhere``. Other spectra may speak for a band and not against it: this
    one alone may have it, from its own surroundings.
    """
    evidence = own + max(elsewhere, 0.0)
    peak, other = (beside, alone) if evidence > 0.0 else (alone, beside)
    weight = float(expit(-0.5 * abs(evidence)))  # of the other

    def error(of: str) -> float:
        stated = getattr(peak, f"{of}_stderr"), getattr(other, f"{of}_stderr")
        apart = getattr(other, of) - getattr(peak, of)
        return math.sqrt((1.0 - weight) * stated[0] ** 2 + weight * (stated[1] ** 2 + apart**2))

    centre_error = error("centre")
    in_doubt = centre_error > 1.1 * peak.centre_stderr
    return replace(
        peak,
        centre_stderr=centre_error,
        fwhm_stderr=error("fwhm"),
        area_stderr=error("area"),
        band_evidence=own,
        flags=(*peak.flags, *["band-in-doubt"] * in_doubt),
    )


def _likely_spikes(x: Array, y: Array, base: float, start: float | None) -> Mask:
    """Cosmic rays by sight; none where a line is said or, on a coarse axis, can be."""
    spikes = noise.likely_spikes(y, base)
    if start is not None:
        return np.asarray(spikes & ~_near(x, start))
    return spikes & ~_in_range(x) if _is_coarse(x) else spikes


def _start(x: Array, y: Array, options: PeakOptions) -> tuple[LineProblem, Array] | None:
    """The model, and start values from the spectrum itself; None without a line to see."""
    background, slope = _coarse_background(x, y)
    origin = float(0.5 * (x[0] + x[-1]))
    flat = y - background - slope * (x - origin)
    step = _step(x)
    clean = ~_likely_spikes(x, y, background, options.start)
    flat = np.interp(x, x[clean], flat[clean])
    # three samples and their median: no single spike makes a line, a coarse axis keeps one
    smooth = median_filter(flat, 3, mode="wrap")
    in_range = _in_range(x) & clean
    allowed = np.ones_like(clean) if options.start is None else _near(x, options.start)
    candidates = in_range & allowed
    if not candidates.any():
        return None
    top = int(np.argmax(np.where(candidates, smooth, -np.inf)))
    height = float(max(flat[top], smooth[top]))
    if height <= 0.0:
        return None
    above = smooth > 0.5 * height
    above[top] = True
    run = next(run for run in noise.runs(above) if run.start <= top < run.stop)
    fwhm = float(np.clip(np.ptp(x[run]) + step, 1.5 * step, _MAX_FWHM))
    clipped = noise.plateau(y, in_range, float(np.percentile(y, 5)))
    if clipped is not None and not allowed[clipped].any():
        clipped = None  # another line
    if clipped is not None:
        # flanks alone: the hidden top is higher than the clipped one
        top = (clipped.start + clipped.stop - 1) // 2
        fwhm = max(float(np.ptp(x[clipped])), 2.0 * step)
        background, slope = float(y.min()), 0.0
        height = 2.0 * float(y[top] - background)
    free, priors, log_sigma = [*range(At.FANO)], [], -math.inf
    if options.shape == "fano":
        free.append(At.FANO)
    if options.resolution is not None:
        log_sigma = math.log(options.resolution * SIGMA_PER_FWHM)
    elif options.shape == "voigt" or (options.shape == "lorentzian" and _is_coarse(x)):
        # an instrument with pixels so wide has a response that is no narrower
        log_sigma = math.log(max(step, 0.2 * fwhm) * 2.0 * SIGMA_PER_FWHM)
        # on a coarse axis the two widths are hard to tell apart: soft priors keep both near what
        # they are, the response within a factor e
        priors = [(At.LOG_FWHM, math.log(4.0), 0.7), (At.LOG_SIGMA, log_sigma, 1.0)]
        free.append(At.LOG_SIGMA)
    line = [float(x[top]), math.log(fwhm), height, background, slope, 0.0, log_sigma]
    problem = LineProblem(x, y, origin, tuple(free), tuple(priors), clipped)
    return problem, np.array([*line, 0.0, 0.0, 0.0])


def _coarse_background(x: Array, y: Array) -> tuple[float, float]:
    """Level at mid-window and slope of a line through the medians of the window's ends."""
    part = max(x.size // 6, 3)
    low, high = float(np.median(y[:part])), float(np.median(y[-part:]))
    x_low, x_high = float(np.median(x[:part])), float(np.median(x[-part:]))
    slope = (high - low) / (x_high - x_low)
    return low + slope * (0.5 * (x[0] + x[-1]) - x_low), slope


def _refine(
    problem: LineProblem, start: Array, use: Mask, variance: Array, passes: int = 8
) -> FittedLine:
    """Fit, judge noise and spikes by the fit, and again until neither changes."""
    y, p = problem.y, start
    settled = False
    while passes and not settled:
        passes -= 1
        p = problem.solve(p, variance, use)
        value, _, part = problem.evaluate(p)
        if not np.all(np.isfinite(value)):
            break
        used, assumed = use, variance
        so_far = FittedLine(problem, p, value, variance, use)
        # how far the true line may differ from the model before that is taken for a cosmic ray:
        # where the fit leaves noise alone, where it does not, and on a coarse axis, where pixels
        # and the instrument's response shape the line
        tolerance = 0.04 if so_far.misfit > 1.25 else 0.01
        if _is_coarse(problem.x):
            tolerance = 0.15
        use = problem.unclipped & ~noise.spikes(y, value, part, used, tolerance)
        # a line seen by one or two samples must not be thrown out as a cosmic ray
        if np.count_nonzero(use) < MIN_SAMPLES:
            use = used
        freedom = 1.0 - replace(so_far, use=use).leverage
        seen = noise.variance((y - value)[use], value[use], freedom)
        variance = np.interp(np.arange(y.size), np.flatnonzero(use), seen)
        # in whatever unit the intensity is
        alike = np.allclose(variance, assumed, rtol=0.02, atol=0.0)
        settled = alike and np.array_equal(use, used)
    # settled, the weights of the last pass are within 2 %: the errors take the newest scale
    if not settled:
        p = problem.solve(p, variance, use)
    return FittedLine(problem, p, problem.evaluate(p)[0], variance, use)


def _with_band(
    plain: FittedLine, band_fwhm: float = 25.0, spread: float = 0.6
) -> FittedLine | None:
    """The best fit with a broad band on the low side, or None if there is none.

    A soft prior holds ln fwhm of the band within a spread of that of `band_fwhm`, cm⁻¹.
    """
    problem, x, y = plain.problem, plain.problem.x, plain.problem.y
    centre, fwhm = float(plain.p[At.CENTRE]), width_of(plain.p[At.LOG_FWHM])
    residual = np.where(plain.use, y - plain.value, 0.0) / np.sqrt(plain.variance)
    width = max(0.5 * band_fwhm, min(fwhm, band_fwhm))
    samples = width * SIGMA_PER_FWHM / _step(x)
    # a matched filter: white noise of unit variance comes out with unit variance
    matched = gaussian_filter1d(residual, samples, mode="constant")
    matched *= math.sqrt(2.0 * math.sqrt(math.pi) * max(samples, 0.3))
    low_side = (x < centre - 0.5 * fwhm) & (x > x[0] + 0.25 * width)
    if not low_side.any():
        return None
    at = int(np.argmax(np.where(low_side, matched, -np.inf)))
    prior = (At.LOG_BAND_FWHM, math.log(band_fwhm), spread)
    richer = replace(problem, free=(*problem.free, *At.BAND), priors=(*problem.priors, prior))
    start = plain.p.copy()
    start[At.LOG_BAND_FWHM] = math.log(band_fwhm)
    beside, within = start.copy(), start.copy()
    beside[At.BAND_HEIGHT] = np.sqrt(plain.variance[at]) * max(residual[at], 1.0)
    beside[At.BAND_CENTRE] = x[at]
    # the line may have swallowed a part of the band, and left no residual to see
    within[At.CENTRE], within[At.LOG_FWHM] = centre + 0.2 * fwhm, math.log(0.4 * fwhm)
    within[At.BAND_HEIGHT], within[At.BAND_CENTRE] = 0.4 * plain.p[At.HEIGHT], centre - 0.6 * fwhm
    fits = [_refine(richer, start, plain.use, plain.variance) for start in (beside, within)]
    return max(filter(_sound, fits), key=lambda fit: _gain(plain, fit), default=None)


def _gain(plain: FittedLine, richer: FittedLine) -> float:
    """Drop of chi-square with a band, on the samples that both fits use."""
    both, y = richer.use & plain.use, plain.problem.y
    drop = (y - plain.value) ** 2 - (y - richer.value) ** 2
    return float(np.sum(drop[both] / richer.variance[both]))


def _sound(fitted: FittedLine) -> bool:
    """Whether the band is one: positive, on the low side, beside a line of sane width."""
    p = fitted.p
    return bool(
        not np.isnan(p).any()
        and p[At.HEIGHT] > 0
        and p[At.BAND_HEIGHT] > 0
        and fitted.problem.x[0] - 10.0 < p[At.BAND_CENTRE] < p[At.CENTRE]
        and width_of(p[At.LOG_FWHM]) < _MAX_FWHM
    )


def _peak(solution: FittedLine) -> Peak | None:
    """Read the result off the solution and flag what a user should know; None if it is no line."""
    problem, p, x = solution.problem, solution.p, solution.problem.x
    if np.isnan(p).any():
        return None
    centre, log_fwhm, height, level, slope, fano, log_sigma, *low_band = p.tolist()
    fwhm, resolution = width_of(log_fwhm), width_of(log_sigma) / SIGMA_PER_FWHM
    width, step = observed_width(fwhm, resolution), _step(x)
    covariance = solution.covariance
    errors = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    # area of the resonant part: (1 − f²)·π/2·height·fwhm
    factor = 0.5 * math.pi * fwhm
    gradient = np.zeros_like(p)
    gradient[[At.LOG_FWHM, At.HEIGHT]] = (1.0 - fano**2) * height, 1.0 - fano**2
    gradient[At.FANO] = -2.0 * fano * height
    area = (1.0 - fano**2) * height * factor
    with np.errstate(over="ignore", invalid="ignore"):  # a line that is not there has no error
        area_error = factor * math.sqrt(max(float(gradient @ covariance @ gradient), 0.0))
    clipped = problem.clipped
    if not (
        LINE_RANGE[0] < centre < LINE_RANGE[1]
        # on an axis in nm, which looks alike, a line is forty times narrower
        and max(0.5 * step, 0.5) < width < _MAX_FWHM
        # no spectrometer responds so broadly: it is a hump of the background, and no line
        and resolution < 25.0
        and area > 0.0
    ):
        return None
    band, band_gap = None, math.nan
    if At.BAND_HEIGHT in problem.free:
        band = Band(low_band[1], width_of(low_band[2]), low_band[0])
        band_gap = centre - band.centre - (0.5 * band.fwhm + width)
    spikes, misfit = x[problem.unclipped & ~solution.use].tolist(), solution.misfit
    noisy = misfit <= 1.6  # else the residuals are more than noise
    flags = {
        "cosmic-ray": bool(spikes),
        "saturated": clipped is not None,
        # near enough for the two to overlap above half their heights, or clear of the line
        "low-shoulder": band_gap < 0.0,
        "low-band": band_gap >= 0.0,
        "edge": min(centre - x[0], x[-1] - centre) < 2.0 * width,
        "coarse": width < 1.5 * step,
        "misfit": not noisy,
    }
    # residuals that are no noise are correlated: fewer samples count than there are
    growth = 1.0 if noisy else math.sqrt(misfit)
    ends, centre_error = None, growth * float(errors[At.CENTRE])
    if clipped is not None:
        ends = (float(x[clipped.start]), float(x[clipped.stop - 1]))
        centre_error = _of_flanks(centre_error, centre, *ends)
    return Peak(
        centre=centre,
        centre_stderr=centre_error,
        fwhm=fwhm,
        fwhm_stderr=growth * float(errors[At.LOG_FWHM]) * fwhm,
        area=area,
        area_stderr=area_error,
        height=height,
        background=level,
        slope=slope,
        origin=problem.origin,
        fano=fano,
        fano_stderr=float(errors[At.FANO]),
        resolution=resolution,
        band=band,
        misfit=misfit,
        samples=int(solution.use.sum()),
        spikes=tuple(spikes),
        clipped=ends,
        flags=tuple(flag for flag, holds in flags.items() if holds),
    )
