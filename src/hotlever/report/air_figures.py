"""The temperature of the air around a lever, drawn on slices through the tip."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from hotlever.lever3d.fields import temperature_at
from hotlever.lever3d.lever import SolidLever
from hotlever.report.style import figure, panel_letter

Array = NDArray[np.float64]

#: Rises above the base temperature at which isotherms are drawn, as a share of the tip's.
ISOTHERMS = (0.02, 0.05, 0.1, 0.2, 0.4, 0.6, 0.8)
_POINTS = 161


def temperature_slices(lever: SolidLever, x: Array) -> Figure:
    """Draw the temperature in the plane along the lever and across it, far and near.

    Parameters
    ----------
    lever : SolidLever
        In air.
    x : ndarray
        Unknowns of a solved state.
    """
    tip = np.array([*lever.solid.layout.tip, 0.0])
    base = lever.probe.circuit.base_temperature_K
    rise = lever.space.tip_temperature(x) - base
    corners = np.array([p for region in lever.solid.layout.regions for p in region.outline])
    far = 0.5 * np.ptp(corners, axis=0).max()
    near = 2.0 * np.ptp(np.array(lever.solid.layout.heater.outline), axis=0).max()
    middle = (corners.min(axis=0) + corners.max(axis=0)) / 2
    panels = (
        ("along the lever", 0, np.array([middle[0], tip[1], 0.0]), 1.35 * far),
        ("across, at the tip", 1, tip, 1.35 * far),
        ("along, near the heater", 0, tip, near),
        ("across, near the heater", 1, tip, near),
    )
    with figure(7.2, 6.4) as made:
        grid = made.subplots(2, 2)
        for axes, letter, (title, axis, centre, reach) in zip(
            grid.ravel(), "abcd", panels, strict=True
        ):
            across = np.linspace(-reach, reach, _POINTS)
            u, z = np.meshgrid(centre[axis] + across, across)
            points = np.tile(centre, (u.size, 1))
            points[:, axis], points[:, 2] = u.ravel(), z.ravel()
            T = temperature_at(lever, x, points).reshape(u.shape)
            image = axes.pcolormesh(
                u, z, T, cmap="inferno", vmin=base, vmax=base + rise, rasterized=True
            )
            lines = axes.contour(
                u, z, T, levels=[base + s * rise for s in ISOTHERMS], colors="white", linewidths=0.5
            )
            axes.clabel(lines, fmt="%.0f", fontsize=6)
            axes.set(aspect="equal", xlabel=f"{'xy'[axis]} (µm)", ylabel="z (µm)")
            axes.grid(False)
            panel_letter(axes, letter)
            axes.set_title(title, loc="center")
        made.colorbar(image, ax=grid, label="temperature (K)", shrink=0.7)
        made.suptitle(f"bias {x[-1]:.3g} V, tip at {base + rise:.0f} K", fontsize=9)
    return made
