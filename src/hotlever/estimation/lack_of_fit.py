"""Whether a model describes the data that it was fitted to."""

from __future__ import annotations

import numpy as np
from scipy.special import chdtrc

from hotlever.estimation.residuals import Residuals
from hotlever.measurands import FITTED, OF_A_CONTACT
from hotlever.measurement.data import noise_about_neighbours
from hotlever.types import Array

#: Data are not described where they differ from the model by more than this share of the largest
#: (rms), and neighbours together: the product of two is this share of the square, of white noise 0.
#: Neither are they where so many neighbours differ by three times as much in their median.
USUAL_SCATTER, _TOGETHER, _RUN = 0.004, 0.4, 4
#: Of noisier data so many neighbours differ by chance by up to so many times their scatter.
_NOISY_RUN = 2.5
#: The share for fits whose weights are no errors, which hold dimensions and whatever else is fixed.
_HELD_SCATTER = 0.01
#: Outliers stand alone: so many neighbours that are off by more than so many standard deviations
#: are none; nor are one fewer at the end, with nothing beyond.
_NEIGHBOURS, _FAR = 3, 8.0
#: Temperatures of a contact are off where by chance one lever in so many is.
_UNLIKELY = 2e-4
#: Fewer rows tell nothing of their neighbours.
_ROWS = 7
#: A datum is named as an outlier beyond this many standard deviations, and so many of those
#: furthest off.
_OUTLYING, _NAMED = 8.0, 10


def lack_of_fit_text(residuals: Residuals, values: Array) -> str:
    """Return where data are not described by predicted values (m, n); empty if they are.

    Temperatures are left out: a thermometer's scale may be off by more than its readings
    scatter.
    """
    scatter = USUAL_SCATTER if residuals.errors.measured else _HELD_SCATTER
    difference = residuals.difference(values) / residuals.largest
    in_order = np.argsort(residuals.along, kind="stable")
    for name, whole, down in zip(
        residuals.observables, difference, residuals.errors.down, strict=True
    ):
        present = np.isfinite(whole)
        if FITTED[name].unit == "K" or present.sum() < _ROWS:
            continue
        # what a robust fit has forgotten stands alone, or is seen as a run
        squares = float(np.sum((down * whole)[present] ** 2))
        rms = np.sqrt(squares / present.sum())
        ordered = in_order[present[in_order]]
        # a drift shows in the order of the rows, another lever in that of the bias
        rows = [(down * whole)[order] for order in (present, ordered)]
        together = max(float(row[1:] @ row[:-1]) for row in rows)
        windows = np.lib.stride_tricks.sliding_window_view(whole[ordered], _RUN)
        runs = np.abs(np.median(windows, axis=1))
        if rms > scatter and together > _TOGETHER * squares:
            worst = int(np.nanargmax(np.abs(whole)))
            return (
                f"{name} differs by {rms:.1%} of its largest value (rms), and not at "
                f"random; most at {residuals.along[worst]:.3g} {residuals.unit}"
            )
        # noise alone has runs too
        noise = noise_about_neighbours(whole[ordered])
        if runs.max() > max(3.0 * USUAL_SCATTER, _NOISY_RUN * noise):
            run = residuals.along[ordered[np.argmax(runs) + np.arange(_RUN)]]
            return (
                f"{name} differs by {runs.max():.1%} of its largest value in neighbouring rows, "
                f"from {run[0]:.3g} to {run[-1]:.3g} {residuals.unit}"
            )
    return _contradiction(residuals, values)


def _contradiction(residuals: Residuals, values: Array) -> str:
    """Return where temperatures of a contact are off by more than their errors; empty if none are.

    Their errors are stated, or else their own scatter. Few as they are, each has its weight.
    """
    away = residuals.difference(values) / residuals.errors.scale
    for name, row in zip(residuals.observables, away, strict=True):
        present = np.isfinite(row)
        if name in OF_A_CONTACT and chdtrc(present.sum(), np.sum(row[present] ** 2)) < _UNLIKELY:
            worst = int(np.nanargmax(np.abs(row)))
            return (
                f"{name} is off by {abs(row[worst]):.1f} standard errors at "
                f"{residuals.along[worst]:.3g} {residuals.unit}"
            )
    return ""


def run_of_outliers(residuals: Residuals, values: Array) -> str:
    """Return where neighbouring data are off together, as no outliers are; empty if none are."""
    in_order = np.argsort(residuals.along, kind="stable")
    along = residuals.along[in_order]
    for name, row in zip(residuals.observables, residuals.deviations(values), strict=True):
        if FITTED[name].unit == "K" or row.size < _ROWS:
            continue
        far = np.append(np.abs(row[in_order]) > _FAR, True)
        together = np.lib.stride_tricks.sliding_window_view(far, _NEIGHBOURS).all(axis=1)
        if together.any():
            first = int(np.argmax(together))
            last = min(first + _NEIGHBOURS, along.size) - 1
            ends = f"{along[first]:.3g} to {along[last]:.3g} {residuals.unit}"
            return f"{name} is off in neighbouring rows, from {ends}"
    return ""


def outlier_notes(residuals: Residuals, values: Array, robust: bool) -> list[str]:
    """Name the points that lie far outside the scatter of the others."""
    advice = "it hardly counts" if robust else "a robust fit would lessen its weight"
    size = np.abs(residuals.deviations(values))
    outliers = np.argwhere(size > _OUTLYING)
    worst = np.sort(np.argsort(-size[tuple(outliers.T)], kind="stable")[:_NAMED])
    named = [
        f"{residuals.observables[row]} at {residuals.along[column]:g} {residuals.unit} is "
        f"{size[row, column]:.0f} standard deviations from the fit; {advice}"
        for row, column in outliers[worst].tolist()
    ]
    more = len(outliers) - len(named)
    return [*named, f"{more} more data are as far from the fit"] if more else named
