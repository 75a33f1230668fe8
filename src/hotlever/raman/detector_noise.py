"""What a spectrum's own residuals say about its noise, its spikes and a clipped top."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import find_objects, label, maximum_filter1d, median_filter

from hotlever.types import Array, Mask

#: Fewer zeros in a row may be counts.
_FEWEST_ZEROS = 6


def variance(residual: Array, model: Array, freedom: Array) -> Array:
    """Variance of each sample, from the residuals of a fit.

    Photon noise has a variance proportional to the signal, but neither the detector's gain
    nor the level that was subtracted is in the file. So the variance is s²·(model + o) with
    the scale s² and the offset o of greatest likelihood for these residuals; pure photon
    noise (o = 0) is kept unless the residuals contradict it. No curve is known better than its
    numbers are rounded.

    A sample counts by its degree of ``freedom``, one less its leverage, (n,): of a line that few
    samples see the fit leaves no residuals, and these say nothing of the noise there.

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> model = np.linspace(100.0, 900.0, 2000)
    >>> noise = rng.normal(size=2000) * np.sqrt(2.0 * model)
    >>> bool(np.allclose(variance(noise, model, np.ones(2000)) / model, 2.0, rtol=0.1))
    True
    """
    largest = float(np.max(np.abs(model))) or 1.0
    level = np.maximum(model, 0.0) / largest
    offsets = np.array([0.0, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 1e6])
    offsets = offsets if level.min() > 1e-3 else offsets[1:]
    shape = (level + offsets[:, None]) / (1.0 + offsets[:, None])
    rounded = np.finfo(float).eps * largest
    free = max(float(freedom.sum()), 1.0)
    scale = np.maximum(np.sum(residual**2 / shape, axis=1) / free, rounded**2)
    loss = free * np.log(scale) + np.log(shape) @ freedom
    best = int(np.argmin(loss))
    if loss[0] - loss[best] < 12.0:
        best = 0
    return np.asarray(scale[best] * shape[best])


def robust_sigma(residual: Array, model: Array) -> Array:
    """Standard deviation of each sample that a few wild samples cannot spoil.

    The shape is photon noise, with the upper half of the signal's range as a floor against
    levels near zero; the scale is the median absolute deviation.
    """
    level = np.maximum(model, 0.0)
    shape = np.sqrt(np.maximum(level, 0.02 * float(level.max(initial=0.0)) + 1e-300))
    scale = 1.4826 * float(np.median(np.abs(residual / shape)))
    return np.asarray(max(scale, 1e-300) * shape)


def spikes(
    y: Array,
    model: Array,
    line_part: Array,
    trusted: Mask,
    tolerance: float,
    sigmas: float = 6.0,
    most: int = 5,
) -> Mask:
    """Samples hit by cosmic rays: narrow, and far above the fit.

    The noise is judged by the ``trusted`` samples; the true line may differ from the model's
    ``line_part`` by ``tolerance`` of its height. A cosmic ray stands so many ``sigmas`` above the
    fit, and hits no more neighbouring samples than ``most``.
    """
    residual = y - model
    sigma = robust_sigma(residual[trusted], model[trusted])
    sigma_all = np.sqrt(
        np.interp(np.arange(y.size), np.flatnonzero(trusted), sigma) ** 2
        + (tolerance * maximum_filter1d(np.abs(line_part), 5)) ** 2
    )
    score = residual / sigma_all
    hit = score > sigmas
    # the flanks of a spike that spilled into its neighbours
    hit |= maximum_filter1d(hit, 3) & (score > 0.5 * sigmas)
    for run in runs(hit):
        hit[run] = _length(run) <= most
    return hit


def likely_spikes(y: Array, base: float) -> Mask:
    """First guess at cosmic rays, before there is a fit: far above the local median."""
    local = median_filter(y, 9, mode="mirror")
    sigma = 1.4826 * float(np.median(np.abs(np.diff(y)))) / np.sqrt(2.0)
    return np.asarray(y - local > 8.0 * sigma + 1.2 * np.maximum(local - base, 0.0))


def plateau(
    y: Array, candidates: Mask, base: float, tolerance: float = 0.006, fewest: int = 4
) -> slice | None:
    """The flat top of a saturated line above its background, or None.

    A line that is not clipped has only few samples within a small part of its height; more
    than its width allows, in one run at the top, is a clipped line, which is flat within a
    ``tolerance`` of its height. Candidates are samples that are no cosmic rays and may belong to
    the line.
    """
    top = float(y[candidates].max(initial=-np.inf))
    height = top - base
    if height <= 0.0:
        return None
    at_top = runs(candidates & (y >= top - tolerance * height))
    longest = max(at_top, key=_length)
    above_half = int(np.count_nonzero(candidates & (y > base + 0.5 * height)))
    expected = 1.0 + np.sqrt(tolerance) * above_half
    return longest if _length(longest) >= max(fewest, 2.5 * expected) else None


def zeros(y: Array) -> slice | None:
    """The longest run of zeros that no detector gives, or None.

    Beside it the signal is many times larger than its steps from sample to sample; zeros of a
    background that was subtracted, or of single photons, have small neighbours.

    Examples
    --------
    >>> counts = np.random.default_rng(0).poisson(95.0, 300).astype(float)
    >>> counts[100:180] = 0.0
    >>> zeros(counts), zeros(np.maximum(counts - 95.0, 0.0))
    (slice(100, 180, None), None)
    """
    # of a number cut in two a part may be left, too small for any detector
    nothing = np.abs(y) <= 1e-12 * np.abs(y).max(initial=0.0)
    gap = max(runs(nothing), key=_length, default=slice(0, 0))
    if _length(gap) < _FEWEST_ZEROS or not y.any():
        return None
    # the nearest of three is small on the flank of a line, and beside a cosmic ray
    sides = (y[max(gap.start - 3, 0) : gap.start], y[gap.stop : gap.stop + 3])
    beside = max(float(np.abs(side).min()) for side in sides if side.size)
    steps = np.abs(np.diff(np.delete(y, gap)))
    steps = steps[steps > 0.0]
    return gap if steps.size and beside > 3.0 * np.median(steps) else None


def overflows(y: Array) -> Mask:
    """Zeros that a detector wrote beyond its range: few, at the top of a line.

    Examples
    --------
    >>> overflows(np.array([5.0, 40.0, 90.0, 0.0, 0.0, 80.0, 30.0, 5.0, 0.0])).nonzero()[0]
    array([3, 4])
    """
    nothing, hit = y == 0.0, np.zeros(y.size, dtype=bool)
    base = float(np.median(y[~nothing])) if not nothing.all() else 0.0
    half = 0.5 * (base + float(y.max(initial=0.0)))
    for run in runs(nothing):
        inside = run.start > 0 and run.stop < y.size and _length(run) < _FEWEST_ZEROS
        hit[run] = inside and min(y[run.start - 1], y[run.stop]) > half
    return hit


def runs(mask: Mask) -> list[slice]:
    """Runs of True.

    Examples
    --------
    >>> runs(np.array([True, False, True, True]))
    [slice(0, 1, None), slice(2, 4, None)]
    """
    return [run for (run,) in find_objects(label(mask)[0])]


def _length(run: slice) -> int:
    return int(run.stop - run.start)
