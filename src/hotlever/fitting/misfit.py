"""Whether a model describes the data that it was fitted to."""

from __future__ import annotations

import numpy as np

from hotlever.fitting.residuals import Residuals
from hotlever.types import Array

#: Data are not described where they scatter about the model by more than this share of the largest,
#: and neighbours together: the product of two is this share of the square, of white noise 0.
_SCATTER, _TOGETHER = 0.004, 0.4
#: The same of fits without priors, which hold dimensions and whatever else is fixed as they are.
_HELD_SCATTER = 0.02
#: Outliers stand alone: so many neighbours that are off by more than so many standard deviations
#: are none; nor are one fewer at the end, with nothing beyond.
_NEIGHBOURS, _FAR = 3, 8.0
#: Fewer rows tell nothing of their neighbours.
_ROWS = 7


def usual_scatter(with_priors: bool) -> float:
    """Return the share of the largest value by which data may scatter about a model (rms)."""
    return _SCATTER if with_priors else _HELD_SCATTER


def undescribed(residuals: Residuals, values: Array, *, with_priors: bool) -> str:
    """Return where data are not described by predicted values (3, n); empty if they are.

    Tip temperatures are left out: a thermometer's scale may be off by more than its readings
    scatter.
    """
    scatter = usual_scatter(with_priors)
    difference = residuals.difference(values) / residuals.largest
    in_order = np.argsort(residuals.along, kind="stable")
    for name, whole in zip(residuals.observables, difference, strict=True):
        known = np.isfinite(whole)
        if name == "tip" or known.sum() < _ROWS:
            continue
        squares = float(np.sum(whole[known] ** 2))
        rms = np.sqrt(squares / known.sum())
        # a drift shows in the order of the rows, another lever in that of the bias
        rows = (whole[known], whole[in_order][known[in_order]])
        together = max(float(row[1:] @ row[:-1]) for row in rows)
        if rms > scatter and together > _TOGETHER * squares:
            worst = int(np.nanargmax(np.abs(whole)))
            return (
                f"{name} differs by {rms:.1%} of its largest value (rms), and not at "
                f"random; most at {residuals.along[worst]:.3g} {residuals.unit}"
            )
    return ""


def off_together(residuals: Residuals, values: Array) -> str:
    """Return where neighbouring data are off together, as no outliers are; empty if none are."""
    in_order = np.argsort(residuals.along, kind="stable")
    along = residuals.along[in_order]
    for name, row in zip(residuals.observables, residuals.deviations(values), strict=True):
        if name == "tip" or row.size < _ROWS:
            continue
        far = np.append(np.abs(row[in_order]) > _FAR, True)
        together = np.lib.stride_tricks.sliding_window_view(far, _NEIGHBOURS).all(axis=1)
        if together.any():
            first = int(np.argmax(together))
            last = min(first + _NEIGHBOURS, along.size) - 1
            ends = f"{along[first]:.3g} to {along[last]:.3g} {residuals.unit}"
            return f"{name} is off in neighbouring rows, from {ends}"
    return ""
