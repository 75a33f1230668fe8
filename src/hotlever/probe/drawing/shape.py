"""The shape of a probe file that is drawn in a file, read and written."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
import shapely
from pydantic import Field, TypeAdapter, ValidationError
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from hotlever.errors import InputError, counted, quoted
from hotlever.files import whole_file
from hotlever.materials import HIGH_DOPED
from hotlever.probe.drawing.edges import check_apart, covered, cut_away, etched, terminal_edges
from hotlever.probe.drawing.layers import (
    DrawnLayer,
    DrawnTerminal,
    layer_values,
    terminal_part,
    terminal_values,
)
from hotlever.probe.drawing.outlines import (
    NARROWEST,
    DrawingError,
    Ring,
    check_widths,
    healed,
    holes,
    one_piece,
    parts_of,
    polygons,
    rings_of,
    snapped,
    together,
)
from hotlever.probe.drawing.partition import Partition, PartitionPiece, partitioned
from hotlever.probe.drawing.sheet import (
    FARTHEST_UM,
    LARGEST_UM,
    SMALLEST_UM,
    Sheet,
    doubt,
    extent_of,
    is_lever,
    read_sheet,
    sensible_unit,
)
from hotlever.probe.layout import BorderTaper, Film, Layout, Part, Point, Region, Taper, Terminal
from hotlever.probe.mesh import MOST_SQUARES
from hotlever.probe.shapes import EDGE_BIAS, Shape, full_bias_name, thickness
from hotlever.records import Record, bounded


@lru_cache(maxsize=32)
def build_layout(
    layers: tuple[DrawnLayer, ...],
    terminals: tuple[DrawnTerminal, ...],
    tip: Point,
    tolerance_um: float,
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

    Raises
    ------
    DrawingError
        If the drawing is at fault: an outline (`hotlever.probe.drawing.outlines`), a part
        (`hotlever.probe.drawing.partition`) or a terminal (`hotlever.probe.drawing.edges`).
    """
    by_name = {layer.name: layer for layer in layers}
    # outlines that are nearer to that of the body are the same
    narrowest, snap = NARROWEST * tolerance_um, 1.5 * tolerance_um
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
    layout = Layout(tuple(regions), tuple(ends), tip, 1.0)
    if bias := by_name[body].edge_bias_um:
        layout = etched(body, layout, outline, bias, tolerance_um)
    for region in layout.regions:
        squares = region.area / region.narrow_um**2
        if "heater" in region.layers and squares > MOST_SQUARES:
            what = f"{region.narrow_um:.3g} µm wide and {squares:.0f} times as long, expected at "
            raise DrawingError(
                f"{what}most {MOST_SQUARES:g}", "heater", drawn["heater"], region.polygon
            )
    if not layout.contains(np.array([tip])).all():
        raise DrawingError(f"it lies outside the {body}", "tip_um", place=tip)
    return layout


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
    piece: PartitionPiece,
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
        If it should border on high-doped silicon and does not, or borders on two kinds of it, or
        edges that it borders on are shifted by different lengths.
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
    taper = partition.taper(number, sources, tolerance)
    if taper is not None:
        shifts = {layers[own].window_bias_um - layers[name].window_bias_um for name in sources}
        if len(shifts) > 1:
            what = "it borders on layers of different edge_bias_um, expected the same"
            raise DrawingError(what, own, place=piece.shape)
        taper = taper.shifted(*shifts)
        if isinstance(taper, Taper) and taper.length_um <= 0:
            what = f"with edge_bias_um = {layers[own].window_bias_um:g} nothing of it is left"
            raise DrawingError(what, own, place=piece.shape)
    return taper, next(iter(materials), HIGH_DOPED)


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

    for name in ("supply", "ground"):
        if at[name] <= insulates:
            raise fault("it touches no conductor", terminal_part(name), at[name])
    pieces = range(len(partition.pieces))
    drawn = {number for number in pieces if "heater" in partition.pieces[number].layers}
    heaters = drawn - insulates
    if drawn and not heaters:
        raise fault("it conducts no current", "heater", drawn)
    at_supply, at_ground = (at[name] for name in ("supply", "ground"))
    supply, ground = (
        partition.reached(start, heaters | insulates) for start in (at_supply, at_ground)
    )
    if not heaters:
        if not supply & ground:
            what = "no conductor joins it with the supply"
            raise fault(what, terminal_part("ground"), at_ground)
        return ["heater" if number in supply & ground else "reader branch" for number in pieces]
    if not supply or not ground:
        name = "ground" if supply else "supply"
        raise fault("it lies on the heater", terminal_part(name), at[name])
    if supply & ground:
        what = "supply and ground are joined without it: no current has to pass"
        raise fault(what, "heater", heaters)
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


#: What is nearer is the same (µm), unless a probe file says otherwise.
TOLERANCE_UM = 0.002

#: A place that is drawn, and an outline or a line, as lists or tuples (µm).
_Coordinate = Annotated[float, Field(strict=True, gt=-FARTHEST_UM, lt=FARTHEST_UM)]
_PLACE = TypeAdapter[Point](tuple[_Coordinate, _Coordinate])
_OUTLINE = TypeAdapter[Ring](
    Annotated[tuple[tuple[_Coordinate, _Coordinate], ...], Field(min_length=2)]
)


class DrawingFile(Record):
    """The file that a drawing is read from, and how its numbers and curves are taken."""

    file: str | None = Field(default=None, description="GDSII, OASIS or DXF, relative to this file")
    cell: str | None = Field(
        default=None, description="of GDSII and OASIS; the top cell if left out"
    )
    unit_um: float | None = Field(
        default=None,
        gt=0,
        le=1e6,
        description="of the file's numbers; left out: what it says, 1 if it says nothing",
    )
    tolerance_um: float = bounded(
        "curves become lines within it, what is nearer is the same", 1e-4, 0.1, TOLERANCE_UM
    )

    def sheet(self, where: str, folder: Path | None) -> Sheet:
        """Read the file, whose name is relative to a folder.

        Raises
        ------
        InputError
            If it is missing, or see `hotlever.probe.drawing.sheet.read_sheet`.
        """
        if not self.file:
            raise InputError(f"{where}: file is missing (GDSII, OASIS or DXF)")
        path = os.fspath(Path(self.file) if folder is None else folder / self.file)
        unit_um, tolerance_um = self.unit_um, self.tolerance_um
        return read_sheet(path, self.cell, unit_um=unit_um, tolerance_um=tolerance_um)


class DrawnShape(DrawingFile, Shape):
    """A lever of any outline; lengths in µm.

    Layers that a probe file takes from a drawing file are read once, when the drawing is made
    with `read`; here, and wherever a drawn probe is kept, they are lists of points. An outline
    inside another is a hole in it; a terminal of two points is a line.
    """

    outline_moves: ClassVar[bool] = False
    read_with: ClassVar[tuple[str, ...]] = ("file", "cell", "unit_um", "remarks")

    shape: Literal["drawing"] = "drawing"
    thickness_um: float = thickness("of the lever, without films on it")
    scale: float = bounded(
        "outlines and the tip's place are so many times what is drawn", 0.01, 100, 1.0
    )
    tip_um: Point = Field(description="place of the tip, as drawn")
    remarks: Annotated[tuple[str, ...], Field(strict=False)] | None = Field(
        default=None, description="what of the file does not count, or not as it is drawn"
    )
    layers: tuple[DrawnLayer, ...]
    terminals: tuple[DrawnTerminal, ...]

    @property
    def title(self) -> str:
        """What it is in a few words."""
        return f"lever of {Path(self.file).name}" if self.file else "drawn lever"

    def dimensions(self) -> dict[str, float]:
        """Return the thickness, and how far edges of the outline and of windows are shifted."""
        shifts = {full_bias_name(one.name): one.edge_bias_um for one in self._with_edges}
        return {"thickness_um": self.thickness_um, **shifts}

    @property
    def _with_edges(self) -> list[DrawnLayer]:
        """The outline, and the layers that dopant diffuses into or from."""
        doped = [one for one in self.layers if one.is_low_doped or one.is_high_doped]
        tapered = any(one.is_low_doped for one in doped) and any(one.is_high_doped for one in doped)
        return [
            one
            for one in self.layers
            if one.is_body or (tapered and one in doped and not one.is_film)
        ]

    def named(self, name: str) -> str:
        """Return the name of a dimension: of one shift of all edges, that of the outline."""
        body = next(layer.name for layer in self.layers if layer.is_body)
        return full_bias_name(body) if name == EDGE_BIAS else name

    def with_dimensions(self, values: Mapping[str, float]) -> Self:
        """Return a copy with some of its dimensions changed, unchecked."""
        layers = tuple(
            layer.model_copy(update={EDGE_BIAS: values[full_bias_name(layer.name)]})
            if full_bias_name(layer.name) in values
            else layer
            for layer in self.layers
        )
        own = {name: value for name, value in values.items() if name in type(self).model_fields}
        return self.model_copy(update={"layers": layers, **own})

    def check(self) -> None:
        """Raise a ValueError if it cannot be drawn and meshed."""
        movable = self._with_edges
        for layer in self.layers:
            if layer.edge_bias_um and layer not in movable:
                names = ", ".join(one.name for one in movable)
                raise InputError(
                    f"[layers.{layer.name}]: edge_bias_um: no dopant diffuses from its edges, "
                    f"expected it of {names}"
                )
        super().check()

    def sections(self) -> dict[str, dict[str, Any]]:
        """Return the sections of a probe file that describe it."""
        return {
            "probe": self.model_dump(exclude={"layers", "terminals"}),
            "layers": {layer.name: layer.section() for layer in self.layers},
            "terminals": {terminal.name: terminal.section() for terminal in self.terminals},
        }

    def layer_records(self) -> dict[str, type[Record]]:
        """Return what the sections ``[layers.NAME]`` hold, by the names of the layers."""
        return {layer.name: DrawnLayer for layer in self.layers}

    @property
    def materials(self) -> tuple[str, ...]:
        """The names of the materials that layers are said to be made of."""
        named = (layer.material for layer in self.layers if not layer.is_plain)
        return tuple(dict.fromkeys(named))

    def _scaled(self, parts: Iterable[Any]) -> tuple[Any, ...]:
        return tuple(part.scaled(self.scale) for part in parts)

    def layout(self) -> Layout:
        """Return the regions, terminals and tip of this shape."""
        layers, terminals = self._scaled(self.layers), self._scaled(self.terminals)
        x, y = self.tip_um
        tip = (self.scale * x, self.scale * y)
        try:
            layout = build_layout(layers, terminals, tip, self.tolerance_um)
        except DrawingError as error:
            place = error.place and (error.place[0] / self.scale, error.place[1] / self.scale)
            raise error.again(place=place) from None
        return replace(layout, thickness_um=self.thickness_um)

    def notes(self) -> list[str]:
        """Say what of the file does not count, what is a hole, and which contacts count as ends."""
        notes = list(self.remarks or ())
        for each in (*self.layers, *(end for end in self.terminals if end.by_area)):
            areas = polygons(each.part, each.drawn, self.tolerance_um)
            if cut := holes(areas, self.tolerance_um):
                notes.append(f"{each.part}: {_cut_by(cut)}")
        films = self._scaled(layer for layer in self.layers if layer.is_film)
        rings = [ring for film in films for ring in film.drawn]
        return notes + covered(self.layout(), self._scaled(self.terminals), rings)

    @classmethod
    def read(
        cls,
        sections: Mapping[str, Any],
        where: str,
        folder: Path | None = None,
        kinds: Mapping[str, str] | None = None,
    ) -> DrawnShape:
        """Make a drawing of the sections of a probe file.

        Parameters
        ----------
        sections : mapping
            ``probe``, ``layers`` and ``terminals``.
        where : str
            Names them in an error.
        folder : path, optional
            What the name of the file is relative to.
        kinds : mapping of str to str, optional
            Of the materials that layers may be made of, by name.

        Raises
        ------
        InputError
            If a key is missing or wrong, or the file cannot be read.
        DrawingError
            If what is drawn is at fault.
        """
        values = dict(sections["probe"])
        here = f"{where}: [probe]"
        if (tip := values.get("tip_um")) is not None:
            try:
                values["tip_um"] = _PLACE.validate_python(tip)
            except ValidationError:
                raise InputError(f"{here}: tip_um = {quoted(tip)}: expected [x, y] (µm)") from None
        layers = layer_values(
            _section(sections, "layers", where), kinds or {}, f"{where}: [layers]"
        )
        if (bias := values.pop(EDGE_BIAS, None)) is not None:
            # where files say it of all shapes
            _add_bias(layers, bias, here)
        terminals = terminal_values(_section(sections, "terminals", where), f"{where}: [terminals]")
        parts = layers | {terminal_part(name): end for name, end in terminals.items()}
        named = {part: own["drawn"] for part, own in parts.items() if isinstance(own["drawn"], str)}
        stated = {key: values[key] for key in DrawingFile.model_fields if key in values}
        sheet = DrawingFile.from_values(stated, here).sheet(here, folder) if named else None
        if sheet is not None:
            values["remarks"] = tuple(sheet.notes(named.values())) or None
        for own in layers.values():
            own["drawn"] = _rings(sheet, own, f"{where}: [layers] {own['name']}")
        for own in terminals.values():
            own["drawn"] = _rings(sheet, own, f"{where}: [terminals] {own['name']}", lines=True)
        drawn_layers = tuple(
            DrawnLayer.from_values(layer, f"{where}: [layers.{name}]")
            for name, layer in layers.items()
        )
        ends = tuple(DrawnTerminal(**terminal) for terminal in terminals.values())
        try:
            if sheet is not None:
                _check_unit(sheet, next(layer for layer in drawn_layers if layer.is_body))
            return cls.from_values({**values, "layers": drawn_layers, "terminals": ends}, here)
        except DrawingError as error:
            raise error.again(
                where=where if sheet is None else sheet.file,
                drawn=named.get(error.part),
                outlines={part.part: part.drawn for part in (*drawn_layers, *ends)},
            ) from None


def _add_bias(layers: Mapping[str, dict[str, Any]], bias: Any, where: str) -> None:
    """Take what ``[probe]`` says of all edges as what is said of the layer of the outline.

    Raises
    ------
    InputError
        If that says it too.
    """
    (body,) = (name for name in layers if name in ("silicon", "body"))
    if EDGE_BIAS in layers[body]:
        raise InputError(f"{where}: {EDGE_BIAS}: expected it in [layers.{body}] only")
    layers[body][EDGE_BIAS] = bias


def _cut_by(numbers: list[int]) -> str:
    """Say which polygons are holes."""
    first = ", ".join([*map(str, numbers[:10]), *["…"] * (len(numbers) > 10)])
    return f"{counted(len(numbers), 'hole')}, cut by polygon{'s'[: len(numbers) - 1]} {first}"


def _check_unit(sheet: Sheet, body: DrawnLayer) -> None:
    """Refuse a lever of a file that is far too large or too small.

    Raises
    ------
    DrawingError
        With the unit in which it would be a lever.
    """
    extent = extent_of(body.drawn)
    if not is_lever(extent):
        unit = sensible_unit(extent, sheet.unit_um)
        words = doubt(extent, sheet.unit_um, unit, "unit_um = {unit_um:g} in [probe]")
        raise DrawingError(words, body.name)


def _section(sections: Mapping[str, Any], name: str, where: str) -> dict[str, Any]:
    if name not in sections:
        raise InputError(f"{where}: section [{name}] is missing")
    if not isinstance(sections[name], Mapping):
        raise InputError(f"{where}: [{name}] must be a section")
    return dict(sections[name])


def _rings(
    sheet: Sheet | None, own: Mapping[str, Any], where: str, *, lines: bool = False
) -> tuple[Ring, ...]:
    """Return the outlines of a layer, of a list of points or of a list of such lists."""
    drawn = own["drawn"]
    if sheet is not None and isinstance(drawn, str):
        layer = sheet.layer(drawn, where)
        if layer.lines and not lines:
            x, y = layer.lines[0][0]
            raise InputError(
                f"{sheet.file}: {own['name']} (layer {drawn}), at ({x:.3f}, {y:.3f}) µm: an "
                "outline that is not closed"
            )
        return sheet.rings(layer, lines=lines)
    for outlines in ([drawn], drawn) if isinstance(drawn, list | tuple) and drawn else ():
        try:
            return tuple(map(_OUTLINE.validate_python, outlines))
        except ValidationError:
            continue
    raise InputError(
        f'{where} = {quoted(drawn)}: expected a layer such as "1/0", or points such as '
        "[[0.0, -1.5], [0.0, 1.5]] (µm)"
    )


# --- written --------------------------------------------------------------------------------------


def save_drawing(drawn: DrawnShape, path: str | os.PathLike[str], folder: Path) -> dict[str, Any]:
    """Write a drawing as GDSII, whole or not at all, for mask shops and other programs.

    Parameters
    ----------
    drawn : DrawnShape
    path : path
    folder : path
        Where the probe file will stand.

    Returns
    -------
    dict
        Its sections of a probe file, which name the drawing and its layers. Terminals that are
        lines stay lists of points: a GDSII file has areas only.

    Raises
    ------
    DrawingError
        If it is farther from the origin than such a file can say.
    """
    # imported here: it is needed to write only, files are read in processes of their own
    import gdstk

    grid_um = 1e-4
    library = gdstk.Library("hotlever", unit=1e-6, precision=1e-6 * grid_um)
    cell_name = "LEVER"
    cell, sections = library.new_cell(cell_name), drawn.sections()
    sections["probe"] |= {
        "file": relative(Path(path), folder),
        "cell": cell_name,
        # finer than the steps nothing is the same
        "tolerance_um": max(drawn.tolerance_um, TOLERANCE_UM),
    }

    def added(name: str, rings: tuple[Ring, ...], number: int) -> str:
        farthest = max(max(map(abs, point)) for ring in rings for point in ring)
        most_um = (2**31 - 1) * grid_um  # a file counts steps in 32 bits
        if farthest > most_um:
            what = f"{farthest:g} µm from the origin, expected {most_um:.0f} µm"
            raise DrawingError(f"{what} at most", name)
        for area in parts_of(together(polygons(name, rings, 0.0), 0.0)):
            outline, *holes = (
                gdstk.Polygon(ring.coords[:-1], layer=number)
                for ring in (area.exterior, *area.interiors)
            )
            if holes:
                # an outline that runs along itself, around its holes
                cell.add(*gdstk.boolean(outline, holes, "not", grid_um, layer=number))
            else:
                cell.add(outline)
        return f"{number}/0"

    for number, layer in enumerate(drawn.layers, start=1):
        drawn_as = added(layer.name, layer.drawn, number)
        whole = sections["layers"][layer.name]
        of_more = isinstance(whole, Mapping)
        sections["layers"][layer.name] = whole | {"drawn": drawn_as} if of_more else drawn_as
    # terminals begin at layer 10, if there are not more of others
    first = max(10, len(drawn.layers) + 1)
    for number, end in enumerate(drawn.terminals, start=first):
        if all(len(ring) > 2 for ring in end.drawn):
            drawn_as = added(end.part, end.drawn, number)
            sections["terminals"][end.name] = {"area": drawn_as} if end.by_area else drawn_as
    with whole_file(path) as temporary:
        library.write_gds(temporary, max_points=0)
    return sections


def relative(path: Path, folder: Path) -> str:
    """Return the name of a file as a file in some folder names it."""
    try:
        return Path(os.path.relpath(path.resolve(), folder.resolve())).as_posix()
    except ValueError:  # on another drive
        return path.resolve().as_posix()
