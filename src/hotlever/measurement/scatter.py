"""How much data scatter, whatever their model is."""

from __future__ import annotations

import numpy as np

from hotlever.types import Array


def noise_about_neighbours(values: Array) -> float:
    """Return by how much three data or more in a row, (n,), scatter about their neighbours.

    Neither a slope nor a gentle bend counts.
    """
    # the variance of one datum twice less its neighbours is six times that of white noise
    return 1.4826 * float(np.median(np.abs(np.diff(values, 2)))) / float(np.sqrt(6.0))
