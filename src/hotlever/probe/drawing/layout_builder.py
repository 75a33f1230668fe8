"""A layout of what is drawn."""

from __future__ import annotations

from collections import Counter
from functools import lru_cache

import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from hotlever.materials import HIGH_DOPED
from hotlever.probe.drawing.edges import Etching, check_apart, cut_away, terminal_edges
from hotlever.probe.drawing.layers import HEATER, REQUIRED, DrawnLayer, DrawnTerminal, terminal_part
from hotlever.probe.drawing.outlines import (
    NARROWEST,
    DrawingError,
    check_widths,
    healed,
    one_piece,
    parts_of,
    polygons,
    rings_of,
    snapped,
)
from hotlever.probe.drawing.partition import Partition, Piece, partitioned
from hotlever.probe.drawing.sheet import LARGEST_UM, SMALLEST_UM, extent_of, is_lever
from hotlever.probe.layout import BorderTaper, Film, Layout, Part, Point, Region, Taper, Terminal
from hotlever.probe.mesh import MOST_SQUARES

#: Outlines nearer than so many tolerances to that of the body are the same.
_SNAP = 1.5


@lru_cache(maxsize=32)
def build_layout(
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
        If the drawing is at fault: an outline (`hotlever.probe.drawing.outlines`), a part
        (`hotlever.probe.drawing.partition`) or a terminal (`hotlever.probe.drawing.edges`).
    """
    by_name = {layer.name: layer for layer in layers}
    narrowest, snap = NARROWEST * tolerance_um, _SNAP * tolerance_um
    body = next(layer.name for layer in layers if layer.is_body)
    by_area = [end for end in terminals if end.by_area]
    rings = by_name[body].drawn
    if not is_lever(extent := extent_of(rings)):
        what = f"{extent:.4g} µm long, expected {SMALLEST_UM:g} to {LARGEST_UM:g} µm"
        raise DrawingError(f"{what}; are unit and scale right?", body, place=rings[0][0])
    drawn = {each.part: polygons(each.part, each.drawn, tolerance_um) for each in layers}
    outline = one_piece(body, healed(body, drawn[body], tolerance_um), drawn[body])
    check_widths(body, outline, drawn[body], narrowest)
    drawn |= {end.part: polygons(end.part, end.drawn, tolerance_um) for end in by_area}
    shapes = {
        part: _healed_on(body, outline, part, areas, tolerance_um)
        for part, areas in drawn.items()
        if part != body
    }
    edges = {end.name: end.drawn for end in terminals if not end.by_area}
    ends = terminal_edges(outline, edges, tolerance_um)
    if edge_bias_um:
        etching = Etching(body, outline, ends, edge_bias_um, tolerance_um)
        for part, shape in shapes.items():
            shapes[part] = etching.layer(snapped(shape, outline, snap))
        outline, ends = etching.outline, etching.ends
        check_widths(body, outline, drawn[body], narrowest)
    contacts = {end.name: snapped(shapes.pop(end.part), outline, snap) for end in by_area}
    near = [outline]
    for name, shape in shapes.items():
        for below in near:
            shape = snapped(shape, below, snap)
        shapes[name] = shape
        # parts lie apart from each other, films on all that is below
        if by_name[name].is_film:
            near.append(shape)
    borders = {name: shape.boundary for name, shape in shapes.items()}
    if contacts:
        borders |= {terminal_part(name): area.boundary for name, area in contacts.items()}
        outline, ends = cut_away(body, outline, contacts, ends, tip)
        check_apart(ends)
    films = {name: shape for name, shape in shapes.items() if by_name[name].is_film}
    parts = {name: shape for name, shape in shapes.items() if name not in films}
    # the body has a corner wherever a terminal begins or ends
    corners = shapely.MultiPoint([point for end in ends for point in (end.start, end.end)])
    partition = partitioned((body, shapely.snap(outline, corners, 1e-6)), parts, films)
    for piece in partition.pieces:
        _check_piece(piece, borders, drawn, narrowest)
    regions = _regions(partition, by_name, ends, tolerance_um)
    for region in regions:
        squares = region.area / region.narrow_um**2
        if HEATER in region.layers and squares > MOST_SQUARES:
            what = f"{region.narrow_um:.3g} µm wide and {squares:.0f} times as long, expected at "
            raise DrawingError(
                f"{what}most {MOST_SQUARES:g}", HEATER, drawn[HEATER], region.polygon
            )
    if not outline.contains(shapely.Point(tip)):
        raise DrawingError(f"it lies outside the {body}", "tip_um", place=tip)
    return Layout(tuple(regions), tuple(ends), tip, 1.0)


def _healed_on(
    body: str, outline: Polygon, part: str, areas: list[Polygon], tolerance: float
) -> BaseGeometry:
    """Return the shape of another layer or contact, all of which lies on the body somewhere."""
    for number, area in enumerate(areas, start=1):
        inside = parts_of(area.intersection(outline))
        if not any(piece.area > tolerance**2 for piece in inside):
            raise DrawingError(f"it lies outside the {body}", part, number, area)
    return healed(part, areas, tolerance)


def _check_piece(
    piece: Piece,
    borders: dict[str, BaseGeometry],
    drawn: dict[str, list[Polygon]],
    narrowest: float,
) -> None:
    """Refuse a piece that is narrow somewhere, and name the layer whose border makes it so.

    The outline of the body itself is wide enough: a piece is not where a border cuts it badly.
    """
    owner = piece.layers[-1]
    try:
        check_widths(owner, piece.shape, drawn[owner], narrowest)
    except DrawingError as error:
        at = shapely.Point(error.place)
        nearest = min(borders, key=lambda name: borders[name].distance(at), default=owner)
        if nearest == owner or borders[nearest].distance(at) > 2 * narrowest:
            raise
        raise DrawingError(
            f"its border leaves the {owner} with {error.what}: move it",
            nearest,
            drawn[nearest],
            error.place,
        ) from None


def _regions(
    partition: Partition, layers: dict[str, DrawnLayer], ends: list[Terminal], tolerance: float
) -> list[Region]:
    """Return the pieces as regions, each with what it is made of and its part in the circuit."""
    at = partition.touched_by(ends, tolerance)
    insulates = {
        number
        for number, piece in enumerate(partition.pieces)
        if not any(layers[name].conducts for name in piece.layers)
    }
    body = next(layer.name for layer in layers.values() if layer.is_body)
    parts = _parts(partition, body, at, insulates)
    regions, counts = [], Counter[str]()
    for number, piece in enumerate(partition.pieces):
        here = ", ".join(end for end, numbers in at.items() if number in numbers)
        (own, *films), name = piece.layers, piece.layers[-1]
        if layers[own].is_body and here:
            name = f"{name} at {here}"
        counts[name] += 1
        outline, *holes = rings_of(piece.shape)
        taper, dopant_from = _taper(partition, layers, number, tolerance)
        region = Region(
            name if counts[name] == 1 else f"{name} {counts[name]}",
            parts[number],
            outline,
            taper,
            tuple(holes),
            material=layers[own].material,
            dopant_from=dopant_from,
            films=tuple(Film(layers[film].material, layers[film].thickness_um) for film in films),
            insulates=number in insulates,
            layers=tuple(piece.layers),
        )
        regions.append(region)
    return regions


def _taper(
    partition: Partition, layers: dict[str, DrawnLayer], number: int, tolerance: float
) -> tuple[Taper | BorderTaper | None, str]:
    """Return how the doping of a piece is tapered, None where it is even, and from which material.

    Raises
    ------
    DrawingError
        If it should border on high-doped silicon and does not, or borders on two kinds of it.
    """
    piece = partition.pieces[number]
    own = piece.layers[0]
    if not layers[own].is_low_doped:
        return None, HIGH_DOPED
    sources = {name for name in partition.beside(number) if layers[name].is_high_doped}
    materials = {layers[name].material for name in sources}
    if not materials and any(layer.is_body and layer.is_high_doped for layer in layers.values()):
        raise DrawingError("it borders on no high-doped silicon", own, place=piece.shape)
    if len(materials) > 1:
        what = f"it borders on high-doped silicon of {len(materials)} materials, expected one"
        raise DrawingError(what, own, place=piece.shape)
    return partition.taper(number, sources, tolerance), next(iter(materials), HIGH_DOPED)


def _parts(
    partition: Partition, body: str, at: dict[str, set[int]], insulates: set[int]
) -> list[Part]:
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

    def fault(what: str, part: str, numbers: set[int]) -> DrawingError:
        return DrawingError(what, part, place=partition.pieces[min(numbers)].shape)

    for name in REQUIRED:
        if at[name] <= insulates:
            raise fault("it touches no conductor", terminal_part(name), at[name])
    pieces = range(len(partition.pieces))
    drawn = {number for number in pieces if HEATER in partition.pieces[number].layers}
    heaters = drawn - insulates
    if drawn and not heaters:
        raise fault("it conducts no current", HEATER, drawn)
    at_supply, at_ground = (at[name] for name in REQUIRED)
    supply, ground = (
        partition.reached(start, heaters | insulates) for start in (at_supply, at_ground)
    )
    if not heaters:
        if not supply & ground:
            what = "no conductor joins it with the supply"
            raise fault(what, terminal_part(REQUIRED[1]), at_ground)
        return ["heater" if number in supply & ground else "reader branch" for number in pieces]
    if not supply or not ground:
        name = REQUIRED[0] if not supply else REQUIRED[1]
        raise fault("it lies on the heater", terminal_part(name), at[name])
    if supply & ground:
        what = "supply and ground are joined without it: no current has to pass"
        raise fault(what, HEATER, heaters)
    legs: tuple[tuple[Part, set[int], set[int]], ...] = (
        ("leg 1", supply, at_supply),
        ("leg 2", ground, at_ground),
    )
    parts: dict[int, Part] = dict.fromkeys(heaters, "heater")
    for part, leg, end in legs:
        parts |= dict.fromkeys(leg, part)
        for number in sorted(leg):
            if partition.pieces[number].layers == (body,):
                continue
            cut_off = leg - partition.reached(end, {*heaters, *insulates, number}) - {number}
            # current passes it if more of the leg, with heaters at it, lies behind it
            if not any(partition.neighbours(piece) & heaters for piece in (*cut_off, number)):
                parts |= dict.fromkeys((*cut_off, number), "reader branch")
    return [parts.get(number, "reader branch") for number in pieces]
