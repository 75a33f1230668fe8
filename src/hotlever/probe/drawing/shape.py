"""The shape of a probe file that is drawn in a file, read and written."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, TypeAdapter, ValidationError

from hotlever.errors import InputError, counted, quoted
from hotlever.files import whole_file
from hotlever.probe.drawing.edges import covered
from hotlever.probe.drawing.layers import (
    AREA,
    DRAWN,
    DrawnLayer,
    DrawnTerminal,
    Rings,
    layer_values,
    terminal_part,
    terminal_values,
)
from hotlever.probe.drawing.layout_builder import build_layout
from hotlever.probe.drawing.outlines import (
    DrawingError,
    Ring,
    holes,
    parts_of,
    polygons,
    together,
)
from hotlever.probe.drawing.sheet import (
    FARTHEST_UM,
    Sheet,
    doubt,
    extent_of,
    is_lever,
    read_sheet,
    sensible_unit,
)
from hotlever.probe.layout import Layout, Point
from hotlever.probe.shapes import Shape, edge_bias, thickness
from hotlever.records import Record

#: What is nearer is the same (µm), unless a probe file says otherwise.
TOLERANCE_UM = 0.002
#: Steps of the coordinates (µm), and how many of them a file counts.
GRID_UM, _MOST_STEPS = 1e-4, 2**31 - 1
_CELL = "LEVER"
#: Number of the layer of the first terminal, if there are not more of others.
_TERMINALS = 10
#: Holes that are named by their polygons.
_MOST_HOLES = 10


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
    tolerance_um: float = Field(
        default=TOLERANCE_UM,
        ge=1e-4,
        le=0.1,
        description="curves become lines within it, what is nearer is the same",
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
    scale: float = Field(
        default=1.0,
        ge=0.01,
        le=100,
        description="outlines and the tip's place are so many times what is drawn",
    )
    edge_bias_um: float = edge_bias()
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
        """Return the thickness: the outline is as it is drawn."""
        return {"thickness_um": self.thickness_um}

    def sections(self) -> dict[str, dict[str, Any]]:
        """Return the sections of a probe file that describe it."""
        return {
            "probe": self.model_dump(exclude={"layers", "terminals"}),
            "layers": {layer.name: layer.section() for layer in self.layers},
            "terminals": {terminal.name: terminal.section() for terminal in self.terminals},
        }

    def layer_records(self) -> dict[str, type[Record]]:
        """Return what the sections ``[layers.NAME]`` hold, by the names of the layers."""
        return {layer.name: DrawnLayer for layer in self.layers if not layer.is_plain}

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
            layout = build_layout(layers, terminals, tip, self.tolerance_um, self.edge_bias_um)
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
        terminals = terminal_values(_section(sections, "terminals", where), f"{where}: [terminals]")
        parts = layers | {terminal_part(name): end for name, end in terminals.items()}
        named = {part: own[DRAWN] for part, own in parts.items() if isinstance(own[DRAWN], str)}
        stated = {key: values[key] for key in DrawingFile.model_fields if key in values}
        sheet = DrawingFile.from_values(stated, here).sheet(here, folder) if named else None
        if sheet is not None:
            values["remarks"] = tuple(sheet.notes(named.values())) or None
        for own in layers.values():
            own[DRAWN] = _rings(sheet, own, f"{where}: [layers] {own['name']}")
        for own in terminals.values():
            own[DRAWN] = _rings(sheet, own, f"{where}: [terminals] {own['name']}", lines=True)
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


def _cut_by(numbers: list[int]) -> str:
    """Say which polygons are holes."""
    first = [str(number) for number in numbers[:_MOST_HOLES]]
    if len(numbers) > _MOST_HOLES:
        first.append("…")
    polygons_ = ", ".join(first)
    return f"{counted(len(numbers), 'hole')}, cut by polygon{'s'[: len(numbers) - 1]} {polygons_}"


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
) -> Rings:
    """Return the outlines of a layer, of a list of points or of a list of such lists."""
    drawn = own[DRAWN]
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

    library = gdstk.Library("hotlever", unit=1e-6, precision=1e-6 * GRID_UM)
    cell, sections = library.new_cell(_CELL), drawn.sections()
    sections["probe"] |= {
        "file": relative(Path(path), folder),
        "cell": _CELL,
        # finer than the steps nothing is the same
        "tolerance_um": max(drawn.tolerance_um, TOLERANCE_UM),
    }

    def added(name: str, rings: Rings, number: int) -> str:
        farthest = max(max(map(abs, point)) for ring in rings for point in ring)
        if farthest > _MOST_STEPS * GRID_UM:
            what = f"{farthest:g} µm from the origin, expected {_MOST_STEPS * GRID_UM:.0f} µm"
            raise DrawingError(f"{what} at most", name)
        for area in parts_of(together(polygons(name, rings, 0.0), 0.0)):
            outline, *holes = (
                gdstk.Polygon(ring.coords[:-1], layer=number)
                for ring in (area.exterior, *area.interiors)
            )
            if holes:
                # an outline that runs along itself, around its holes
                cell.add(*gdstk.boolean(outline, holes, "not", GRID_UM, layer=number))
            else:
                cell.add(outline)
        return f"{number}/0"

    for number, layer in enumerate(drawn.layers, start=1):
        drawn_as = added(layer.name, layer.drawn, number)
        whole = sections["layers"][layer.name]
        sections["layers"][layer.name] = drawn_as if layer.is_plain else whole | {DRAWN: drawn_as}
    first = max(_TERMINALS, len(drawn.layers) + 1)
    for number, end in enumerate(drawn.terminals, start=first):
        if all(len(ring) > 2 for ring in end.drawn):
            drawn_as = added(end.part, end.drawn, number)
            sections["terminals"][end.name] = {AREA: drawn_as} if end.by_area else drawn_as
    with whole_file(path) as temporary:
        library.write_gds(temporary, max_points=0)
    return sections


def relative(path: Path, folder: Path) -> str:
    """Return the name of a file as a file in some folder names it."""
    try:
        return Path(os.path.relpath(path.resolve(), folder.resolve())).as_posix()
    except ValueError:  # on another drive
        return path.resolve().as_posix()
