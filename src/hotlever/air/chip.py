"""The chip body that holds a lever, as panels.

A block behind x = 0 whose lower face continues the lever's lower face and which rises above it, as
where a lever is etched from the device layer and the tip points away from the chip. Its faces reach
`REACH` lever lengths to all sides.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hotlever.air.panels import Panels
from hotlever.air.surface import PanelOptions, divided, grid, lever_box
from hotlever.probe.layout import Layout

Array = NDArray[np.float64]

#: Extent of the block in lever lengths; four times as much changes the loss by less than 2e-4.
REACH = 8.0
#: Panels at the lever's root, as a share of its width, and their growth with the distance.
_SMALLEST, _GROWTH = 0.1, 0.5


def chip_panels(layout: Layout, options: PanelOptions) -> Panels:
    """Return the front and the lower face of the chip body."""
    (x0, low), (x1, high) = lever_box(layout)
    half, reach = layout.thickness_um / 2, REACH * (x1 - x0)
    smallest = _SMALLEST * (high - low) / options.refinement
    growth = _GROWTH / options.refinement

    def breaks(start: float, stop: float, near: tuple[float, float]) -> Array:
        at = np.linspace(start, stop, 20001)
        away = np.maximum(np.maximum(near[0] - at, at - near[1]), 0.0)
        return divided(at, smallest + growth * away)

    across = breaks(low - reach, high + reach, (low, high))
    up = breaks(half, half + reach, (half, half))
    behind = breaks(x0 - reach, x0, (x0, x0))
    front = grid(across, up)
    below = grid(behind, across)
    return Panels(
        np.concatenate(
            [
                np.concatenate([np.full((*front.shape[:2], 1), x0), front], axis=2),
                np.concatenate([below, np.full((*below.shape[:2], 1), -half)], axis=2),
            ]
        )
    )
