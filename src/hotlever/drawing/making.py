"""A layout of what is drawn."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import shapely
from shapely import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from hotlever.drawing.contacts import (
    REQUIRED,
    DrawnTerminal,
    check_apart,
    cut_away,
    terminal_edges,
    terminal_part,
)
from hotlever.drawing.cutting import Cut, Piece, cut, taper_of
from hotlever.drawing.etching import Etching
from hotlever.drawing.extent import LARGEST_UM, SMALLEST_UM, extent_of
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
from hotlever.drawing.layers import HEATER, DrawnLayer
from hotlever.probe.layout import (
    BorderTaper,
    Film,
    Layout,
    Part,
    Point,
    Region,
    Taper,
    Terminal,
)
from hotlever.probe.mesh import MOST_SQUARES

#: Outlines nearer than so many tolerances to that of the body are the same.
_SNAP = 1.5


@lru_cache(maxsize=32)
def layout_of(
    layers: tuple[DrawnLayer, ...],
    terminals: tuple[DrawnTerminal, ...],
    tip: Point,
    tolerance_um: float,
    edge_bias_um: float = 0.0,
) -> Layout:
    """Return the layout of a drawing, its body 1 µm thick.

    Parameters
    ----------
    layers : tuple of DrawnLayer
        Among them the body; µm.
    terminals : tuple of DrawnTerminal
        µm; a ring of two points is a line.
    tip : tuple of float
    tolerance_um : float
        What is nearer is the same.
    edge_bias_um : float
        How far outside the drawing the edges of the body are.

    Raises
    ------
    DrawingError
        If the drawing is at fault; see `hotlever.drawing.healing`, `hotlever.drawing.cutting` and
        `hotlever.drawing.contacts`.
    """
    known = {layer.name: layer for layer in layers}
    narrowest = NARROWEST * tolerance_um
    body = next(layer.name for layer in layers if layer.is_body)
    _check_extent(body, known[body].rings)
    found = {name: polygons(name, one.rings, tolerance_um) for name, one in known.items()}
    outline = one_piece(body, healed(body, found[body], tolerance_um), found[body])
    check_widths(body, outline, found[body], narrowest)
    shapes = dict[str, BaseGeometry]()
    for name, areas in found.items():
        if name != body:
            shapes[name] = healed(name, areas, tolerance_um)
            _check_on_body(name, areas, body, outline, tolerance_um)
    contacts = dict[str, BaseGeometry]()
    for terminal in terminals:
        if terminal.by_area:
            name = terminal_part(terminal.name)
            found[name] = polygons(name, terminal.rings, tolerance_um)
            contacts[terminal.name] = healed(name, found[name], tolerance_um)
            _check_on_body(name, found[name], body, outline, tolerance_um)
    edges = {one.name: one.rings for one in terminals if not one.by_area}
    ends = terminal_edges(outline, edges, tolerance_um)
    if edge_bias_um:
        etching = Etching(body, outline, ends, edge_bias_um, tolerance_um)
        shapes, contacts = (
            {
                name: etching.layer(snapped(one, outline, _SNAP * tolerance_um))
                for name, one in group
            }
            for group in (shapes.items(), contacts.items())
        )
        outline, ends = etching.outline, etching.ends
        check_widths(body, outline, found[body], narrowest)
    near = [outline]
    for name, shape in shapes.items():
        for one in near:
            shape = snapped(shape, one, _SNAP * tolerance_um)
        shapes[name] = shape
        # parts lie apart from each other, films on all that is below
        if known[name].is_film:
            near.append(shape)
    borders = {name: shape.boundary for name, shape in shapes.items()}
    if contacts:
        contacts = {
            name: snapped(area, outline, _SNAP * tolerance_um) for name, area in contacts.items()
        }
        borders |= {terminal_part(name): area.boundary for name, area in contacts.items()}
        outline, ends = cut_away(body, outline, contacts, ends, tip)
        check_apart(ends)
    films = {name: shape for name, shape in shapes.items() if known[name].is_film}
    parts = {name: shape for name, shape in shapes.items() if name not in films}
    whole = cut((body, _with_corners(outline, ends)), parts, films)
    for piece in whole.pieces:
        _check_piece(piece, borders, found, narrowest)
    regions = _regions(whole, known, ends, tolerance_um)
    for region, piece in zip(regions, whole.pieces, strict=True):
        squares = region.area / region.narrow_um**2
        if HEATER in piece.layers and squares > MOST_SQUARES:
            at = piece.shape.representative_point()
            raise DrawingError(
                f"{region.narrow_um:.3g} µm wide and {squares:.0f} times as long, expected at most "
                f"{MOST_SQUARES:g}",
                HEATER,
                nearest_polygon(found[HEATER], (at.x, at.y)),
                (at.x, at.y),
            )
    if not outline.contains(shapely.Point(tip)):
        raise DrawingError(f"it lies outside the {body}", "tip_um", None, tip)
    return Layout(tuple(regions), tuple(ends), tip, 1.0)


def _check_extent(body: str, rings: tuple[Ring, ...]) -> None:
    extent = extent_of(rings)
    if not SMALLEST_UM <= extent <= LARGEST_UM:
        raise DrawingError(
            f"{extent:.4g} µm long, expected {SMALLEST_UM:g} to {LARGEST_UM:g} µm; are unit and "
            "scale right?",
            body,
            None,
            rings[0][0],
        )


def _check_piece(
    piece: Piece,
    borders: dict[str, BaseGeometry],
    found: dict[str, list[Polygon]],
    narrowest: float,
) -> None:
    """Refuse a piece that is narrow somewhere, and name the layer whose border makes it so.

    The outline of the body itself is wide enough: a piece is not where a border cuts it badly.
    """
    owner = piece.layers[-1]
    try:
        check_widths(owner, piece.shape, found[owner], narrowest)
    except DrawingError as error:
        at = shapely.Point(error.place)
        nearest = min(borders, key=lambda name: borders[name].distance(at), default=owner)
        if nearest == owner or borders[nearest].distance(at) > 2 * narrowest:
            raise
        raise DrawingError(
            f"its border leaves the {owner} with {error.what}: move it",
            nearest,
            nearest_polygon(found[nearest], (at.x, at.y)),
            error.place,
        ) from None


def _check_on_body(
    name: str, areas: list[Polygon], body: str, outline: Polygon, tolerance: float
) -> None:
    for number, area in enumerate(areas, start=1):
        inside = area.intersection(outline)
        if not any(one.area > tolerance**2 for one in parts_of(inside)):
            at = area.representative_point()
            raise DrawingError(f"it lies outside the {body}", name, number, (at.x, at.y))


def _with_corners(silicon: Polygon, ends: list[Terminal]) -> Polygon:
    """Return the silicon with a corner wherever a terminal begins or ends."""
    places = shapely.MultiPoint([place for end in ends for place in (end.start, end.end)])
    return shapely.snap(silicon, places, 1e-6)


def _regions(
    whole: Cut, known: dict[str, DrawnLayer], ends: list[Terminal], tolerance: float
) -> list[Region]:
    """Return the pieces as regions, each with what it is made of and its part in the circuit."""
    at = _terminals_of(whole, ends, tolerance)
    insulates = {
        number
        for number, piece in enumerate(whole.pieces)
        if not any(known[name].kind.conducts for name in piece.layers)
    }
    body = next(layer.name for layer in known.values() if layer.is_body)
    parts = _parts(whole, body, at, insulates)
    regions, counts = [], dict[str, int]()
    for number, piece in enumerate(whole.pieces):
        here = [name for name, numbers in at.items() if number in numbers]
        (own, *films), name = piece.layers, piece.layers[-1]
        if known[own].is_body:
            name = " at ".join([name, *([", ".join(here)] if here else [])])
        counts[name] = counts.get(name, 0) + 1
        outline, *holes = (
            tuple((float(x), float(y)) for x, y in ring.coords[:-1])
            for ring in (piece.shape.exterior, *piece.shape.interiors)
        )
        taper, dopant_from = _taper(whole, known, number, tolerance)
        made = Region(
            name if counts[name] == 1 else f"{name} {counts[name]}",
            parts[number],
            outline,
            taper,
            tuple(holes),
            material=known[own].material,
            films=tuple(Film(known[one].material, known[one].thickness_um) for one in films),
            insulates=number in insulates,
        )
        regions.append(made if dopant_from is None else replace(made, dopant_from=dopant_from))
    return regions


def _taper(
    whole: Cut, known: dict[str, DrawnLayer], number: int, tolerance: float
) -> tuple[Taper | BorderTaper | None, str | None]:
    """Return how the doping of a piece is tapered, and from which material; None where it is even.

    Raises
    ------
    DrawingError
        If it should border on high-doped silicon and does not, or borders on two kinds of it.
    """
    piece = whole.pieces[number]
    own = piece.layers[0]
    if not known[own].is_low_doped:
        return None, None
    sources = {name for name in whole.beside(number) if known[name].is_high_doped}
    materials = {known[name].material for name in sources}
    at = piece.shape.representative_point()
    if not materials and any(layer.is_body and layer.is_high_doped for layer in known.values()):
        raise DrawingError("it borders on no high-doped silicon", own, None, (at.x, at.y))
    if len(materials) > 1:
        what = f"it borders on high-doped silicon of {len(materials)} materials, expected one"
        raise DrawingError(what, own, None, (at.x, at.y))
    return taper_of(whole, number, sources, tolerance), next(iter(materials), None)


def _terminals_of(whole: Cut, ends: list[Terminal], tolerance: float) -> dict[str, set[int]]:
    """Return the numbers of the pieces that each terminal touches."""
    found: dict[str, set[int]] = {}
    for end in ends:
        edge = LineString([end.start, end.end])
        along = [piece.shape.boundary.intersection(edge).length for piece in whole.pieces]
        touched = {number for number, length in enumerate(along) if length > tolerance}
        middle = edge.interpolate(0.5, normalized=True)
        away = [piece.shape.boundary.distance(middle) for piece in whole.pieces]
        found.setdefault(end.name, set()).update(touched or {int(np.argmin(away))})
    return found


def _parts(whole: Cut, body: str, at: dict[str, set[int]], insulates: set[int]) -> list[Part]:
    """Return what each piece is to the circuit.

    Without the heaters the conductor falls apart: what is left at the supply is leg 1, at ground
    leg 2. A low-doped part and what lies behind it, seen from supply and ground, carry no current.
    Where no layer is called heater, all that is between supply and ground is one.

    Raises
    ------
    DrawingError
        If a terminal touches no conductor, or current passes beside the heaters, or not through
        them.
    """
    for name in REQUIRED:
        if at[name] <= insulates:
            place = whole.pieces[min(at[name])].shape.representative_point()
            what = "it touches no conductor"
            raise DrawingError(what, terminal_part(name), None, (place.x, place.y))
    drawn = {number for number, piece in enumerate(whole.pieces) if HEATER in piece.layers}
    heaters = drawn - insulates
    if drawn and not heaters:
        place = whole.pieces[min(drawn)].shape.representative_point()
        raise DrawingError("it conducts no current", HEATER, None, (place.x, place.y))
    supply, ground = (whole.reached(at[name], heaters | insulates) for name in REQUIRED)
    if not heaters:
        if not supply & ground:
            place = whole.pieces[min(at[REQUIRED[1]])].shape.representative_point()
            what = "no conductor joins it with the supply"
            raise DrawingError(what, terminal_part(REQUIRED[1]), None, (place.x, place.y))
        return [
            "heater" if number in supply & ground else "reader branch"
            for number in range(len(whole.pieces))
        ]
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
    for number in sorted(set(parts) - heaters):
        if whole.pieces[number].layers == (body,):
            continue
        legs = supply if number in supply else ground
        end = at[REQUIRED[0] if number in supply else REQUIRED[1]]
        cut_off = legs - whole.reached(end, {*heaters, *insulates, number}) - {number}
        # current passes it if more of the leg, with heaters at it, lies behind it
        feeds = any(whole.neighbours(one) & heaters for one in (*cut_off, number))
        if not feeds:
            parts.update(dict.fromkeys((*cut_off, number), "reader branch"))
    return [parts.get(number, "reader branch") for number in range(len(whole.pieces))]
