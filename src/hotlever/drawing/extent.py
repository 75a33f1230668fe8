"""How large levers are, which tells a wrong unit of a drawing."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from hotlever.drawing.fault import Ring

#: Extent of a lever (µm).
SMALLEST_UM, LARGEST_UM = 5.0, 2000.0
#: Units of drawings (µm), the likeliest first.
UNITS = {"um": 1.0, "mm": 1e3, "nm": 1e-3, "m": 1e6, "cm": 1e4, "inch": 25_400.0, "mil": 25.4}


def extent_of(rings: Iterable[Ring]) -> float:
    """Return the longer side of the box around some outlines, in their unit."""
    points = np.array([point for ring in rings for point in ring])
    return float(np.ptp(points, axis=0).max()) if len(points) else 0.0


def is_lever(extent_um: float) -> bool:
    """Whether something is as large as a lever may be."""
    return SMALLEST_UM <= extent_um <= LARGEST_UM


def sensible_unit(extent_um: float, unit_um: float) -> str | None:
    """Return the likeliest unit in which something is as large as a lever, None if there is none.

    Parameters
    ----------
    extent_um : float
        With one unit of the drawing being `unit_um`.
    unit_um : float

    Examples
    --------
    >>> sensible_unit(0.0544, 1.0), sensible_unit(54_400.0, 1000.0), sensible_unit(0.0, 1.0)
    ('mm', 'um', None)
    """
    sizes = {name: extent_um / unit_um * one for name, one in UNITS.items()}
    return next((name for name, size in sizes.items() if is_lever(size)), None)


def doubt(extent_um: float, unit_um: float, unit: str | None, how: str) -> str:
    """Say that something is not as large as a lever, and with which unit it would be.

    Parameters
    ----------
    extent_um, unit_um : float
        As in `sensible_unit`.
    unit : str or None
        The one that makes sense.
    how : str
        Where to say so, as ``--unit {unit}`` or ``unit_um = {unit_um:g}``.
    """
    words = (
        f"{extent_um:.4g} µm long with one unit of the file as {unit_um:g} µm, expected "
        f"{SMALLEST_UM:g} to {LARGEST_UM:g} µm"
    )
    if unit is None:
        return words
    size = extent_um / unit_um * UNITS[unit]
    hint = how.format(unit=unit, unit_um=UNITS[unit])
    return f"{words}; in {unit} it would be {size:.4g} µm: {hint}"
