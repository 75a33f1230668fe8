"""A layout of what is drawn."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import shapely
from shapely import Polygon

from hotlever.drawing.contacts import REQUIRED, terminal_edges, terminal_part
from hotlever.drawing.cutting import Cut, cut, taper_of
from hotlever.drawing.fault import DrawingError, Ring
from hotlever.drawing.healing import (
    NARROWEST,
    check_widths,
    healed,
    nearest_polygon,
    one_piece,
    parts_of,
    polygons,
    snapped,
)
from hotlever.probe.layout import Layout, Part, Point, Region, Terminal

#: Extent of a lever (µm).
_SMALLEST, _LARGEST = 2.0, 2000.0
#: As many squares of its width as a heater may have: it is meshed in steps of its width.
_SQUARES = 100.0
#: Outlines nearer than so many tolerances to that of the silicon are the same.
_SNAP = 1.5
SILICON, HEATER = "silicon", "heater"

Outlines = tuple[tuple[str, tuple[Ring, ...]], ...]


@lru_cache(maxsize=32)
def layout_of(layers: Outlines, terminals: Outlines, tip: Point, tolerance_um: float) -> Layout:
    """Return the layout of a drawing, 1 µm thick.

    Parameters
    ----------
    layers, terminals : tuple of (str, tuple of rings)
        Outlines by name, µm: ``silicon``, ``heater`` and other low-doped parts; and terminals,
        where a ring of two points is a line.
    tip : tuple of float
    tolerance_um : float
        What is nearer is the same.

    Raises
    ------
    DrawingError
        If the drawing is at fault; see `hotlever.drawing.healing`, `hotlever.drawing.cutting` and
        `hotlever.drawing.contacts`.
    """
    drawn = dict(layers)
    narrowest = NARROWEST * tolerance_um
    found = {name: polygons(name, rings, tolerance_um) for name, rings in drawn.items()}
    silicon = one_piece(SILICON, healed(SILICON, found[SILICON], tolerance_um), found[SILICON])
    _check_extent(silicon)
    check_widths(SILICON, silicon, found[SILICON], narrowest)
    low_doped = {}
    for name, areas in found.items():
        if name != SILICON:
            shape = healed(name, areas, tolerance_um)
            _check_on_silicon(name, areas, silicon, tolerance_um)
            low_doped[name] = snapped(shape, silicon, _SNAP * tolerance_um)
    ends = terminal_edges(silicon, dict(terminals), tolerance_um)
    whole = cut(_with_corners(silicon, ends), low_doped)
    for piece in whole.pieces:
        name = piece.kind or SILICON
        check_widths(name, piece.shape, found[name], narrowest)
    regions = _regions(whole, ends, tolerance_um)
    for region, piece in zip(regions, whole.pieces, strict=True):
        squares = region.area / region.narrow_um**2
        if region.part == "heater" and squares > _SQUARES:
            at = piece.shape.representative_point()
            raise DrawingError(
                f"{region.narrow_um:.3g} µm wide and {squares:.0f} times as long, expected at most "
                f"{_SQUARES:g}",
                HEATER,
                nearest_polygon(found[HEATER], (at.x, at.y)),
                (at.x, at.y),
            )
    if not silicon.contains(shapely.Point(tip)):
        raise DrawingError("it lies outside the silicon", "tip_um", None, tip)
    return Layout(tuple(regions), tuple(ends), tip, 1.0)


def _check_extent(silicon: Polygon) -> None:
    x0, y0, x1, y1 = silicon.bounds
    extent = max(x1 - x0, y1 - y0)
    if not _SMALLEST <= extent <= _LARGEST:
        raise DrawingError(
            f"{extent:.4g} µm long, expected {_SMALLEST:g} to {_LARGEST:g} µm; is the unit right?",
            SILICON,
            None,
            (x0, y0),
        )


def _check_on_silicon(name: str, areas: list[Polygon], silicon: Polygon, tolerance: float) -> None:
    for number, area in enumerate(areas, start=1):
        inside = area.intersection(silicon)
        if not any(one.area > tolerance**2 for one in parts_of(inside)):
            at = area.representative_point()
            raise DrawingError("it lies outside the silicon", name, number, (at.x, at.y))


def _with_corners(silicon: Polygon, ends: list[Terminal]) -> Polygon:
    """Return the silicon with a corner wherever a terminal begins or ends."""
    places = shapely.MultiPoint([place for end in ends for place in (end.start, end.end)])
    return shapely.snap(silicon, places, 1e-6)


def _regions(whole: Cut, ends: list[Terminal], tolerance: float) -> list[Region]:
    """Return the pieces as regions, each with its part in the circuit."""
    at = _terminals_of(whole, ends)
    parts = _parts(whole, at)
    regions, counts = [], dict[str, int]()
    for number, piece in enumerate(whole.pieces):
        here = [name for name, numbers in at.items() if number in numbers]
        name = piece.kind or " at ".join([SILICON, *([", ".join(here)] if here else [])])
        counts[name] = counts.get(name, 0) + 1
        outline, *holes = (
            tuple((float(x), float(y)) for x, y in ring.coords[:-1])
            for ring in (piece.shape.exterior, *piece.shape.interiors)
        )
        regions.append(
            Region(
                name if counts[name] == 1 else f"{name} {counts[name]}",
                parts[number],
                outline,
                None if piece.kind is None else taper_of(whole, number, tolerance),
                tuple(holes),
            )
        )
    return regions


def _terminals_of(whole: Cut, ends: list[Terminal]) -> dict[str, set[int]]:
    """Return the numbers of the pieces that each terminal touches."""
    found: dict[str, set[int]] = {}
    for end in ends:
        middle = shapely.Point(np.mean([end.start, end.end], axis=0))
        away = [piece.shape.boundary.distance(middle) for piece in whole.pieces]
        found.setdefault(end.name, set()).add(int(np.argmin(away)))
    return found


def _parts(whole: Cut, at: dict[str, set[int]]) -> list[Part]:
    """Return what each piece is to the circuit.

    Without the heaters the silicon falls apart: what is left at the supply is leg 1, at ground
    leg 2. A low-doped part and what lies behind it, seen from supply and ground, carry no current.

    Raises
    ------
    DrawingError
        If current passes beside the heaters, or not through them.
    """
    heaters = {number for number, piece in enumerate(whole.pieces) if piece.kind == HEATER}
    supply, ground = (whole.reached(at[name], heaters) for name in REQUIRED)
    if not supply or not ground:
        name = REQUIRED[0] if not supply else REQUIRED[1]
        place = whole.pieces[min(at[name])].shape.representative_point()
        raise DrawingError("it lies on the heater", terminal_part(name), None, (place.x, place.y))
    if supply & ground:
        place = whole.pieces[min(heaters)].shape.representative_point()
        raise DrawingError(
            "supply and ground are joined without it: no current has to pass",
            HEATER,
            None,
            (place.x, place.y),
        )
    kinds: tuple[tuple[set[int], Part], ...] = (
        (supply, "leg 1"),
        (ground, "leg 2"),
        (heaters, "heater"),
    )
    parts: dict[int, Part] = {one: part for numbers, part in kinds for one in numbers}
    for number, piece in enumerate(whole.pieces):
        if piece.kind is not None and number not in heaters:
            legs = supply if number in supply else ground
            end = at[REQUIRED[0] if number in supply else REQUIRED[1]]
            cut_off = legs - whole.reached(end, {*heaters, number}) - {number}
            # current passes it if more of the leg, with heaters at it, lies behind it
            feeds = any(whole.neighbours(one) & heaters for one in (*cut_off, number))
            if not feeds:
                parts.update(dict.fromkeys((*cut_off, number), "reader branch"))
    return [parts.get(number, "reader branch") for number in range(len(whole.pieces))]
