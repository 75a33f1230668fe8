"""The shape of a probe file that is drawn in a file."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from hotlever.errors import InputError, quoted
from hotlever.materials import Kind
from hotlever.probe.drawing.contacts import covered
from hotlever.probe.drawing.layers import (
    DRAWN,
    DrawnLayer,
    DrawnTerminal,
    Rings,
    layer_values,
    terminal_part,
    terminal_values,
)
from hotlever.probe.drawing.layout_builder import build_layout
from hotlever.probe.drawing.outlines import DrawingError, without_nested
from hotlever.probe.drawing.sheet import (
    Layer,
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
#: What it may be.
_FINEST_UM, _COARSEST_UM = 1e-4, 0.1


class Drawing(Shape):
    """A lever of any outline; lengths in µm.

    Layers that a probe file takes from a drawing file are read once, when the drawing is made
    with `read`; here, and wherever a drawn probe is kept, they are lists of points. An outline
    inside another is a hole in it; a terminal of two points is a line.
    """

    outline_moves: ClassVar[bool] = False
    read_with: ClassVar[tuple[str, ...]] = ("file", "cell", "unit_um")

    shape: Literal["drawing"] = "drawing"
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
        ge=_FINEST_UM,
        le=_COARSEST_UM,
        description="curves become lines within it, what is nearer is the same",
    )
    thickness_um: float = thickness("of the lever, without films on it")
    scale: float = Field(
        default=1.0,
        ge=0.01,
        le=100,
        description="outlines and the tip's place are so many times what is drawn",
    )
    edge_bias_um: float = edge_bias()
    tip_um: Point = Field(description="place of the tip, as drawn")
    layers: tuple[DrawnLayer, ...]
    terminals: tuple[DrawnTerminal, ...]

    @model_validator(mode="after")
    def _can_be_meshed(self) -> Self:
        self.layout()
        return self

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
            raise error.drawn_at(self.scale) from None
        return replace(layout, thickness_um=self.thickness_um)

    def notes(self) -> list[str]:
        """Say which contacts cover more of a leg than they count for."""
        films = self._scaled(layer for layer in self.layers if layer.is_film)
        rings = [ring for film in films for ring in film.drawn]
        return covered(self.layout(), self._scaled(self.terminals), rings)

    @classmethod
    def read(
        cls,
        sections: Mapping[str, Any],
        where: str,
        folder: Path | None = None,
        materials: Mapping[str, Kind] | None = None,
    ) -> Drawing:
        """Make a drawing of the sections of a probe file.

        Parameters
        ----------
        sections : mapping
            ``probe``, ``layers`` and ``terminals``.
        where : str
            Names them in an error.
        folder : path, optional
            What the name of the file is relative to.
        materials : mapping of str to Kind, optional
            Those that layers may be made of.

        Raises
        ------
        InputError
            If a key is missing or wrong, or the file cannot be read.
        DrawingError
            If what is drawn is at fault.
        """
        values = dict(sections["probe"])
        tolerance = values.get("tolerance_um", TOLERANCE_UM)
        tip = values.get("tip_um")
        if tip is not None:
            if not _is_points([tip, tip]):
                raise InputError(f"{where}: [probe]: tip_um = {quoted(tip)}: expected [x, y] (µm)")
            values["tip_um"] = (float(tip[0]), float(tip[1]))
        layers = layer_values(
            _section(sections, "layers", where), materials or {}, f"{where}: [layers]"
        )
        terminals = terminal_values(_section(sections, "terminals", where), f"{where}: [terminals]")
        given = {name: part[DRAWN] for name, part in layers.items()} | {
            terminal_part(name): part[DRAWN] for name, part in terminals.items()
        }
        named = {part: layer for part, layer in given.items() if isinstance(layer, str)}
        sheet = _sheet(values, where, folder, tolerance) if named else None
        for section, parts in (("layers", layers), ("terminals", terminals)):
            for name, part in parts.items():
                here = f"{where}: [{section}] {name}"
                part[DRAWN] = _rings(sheet, part[DRAWN], name, here, section)
        made = tuple(
            DrawnLayer.from_values(layer, f"{where}: [layers.{name}]")
            for name, layer in layers.items()
        )
        ends = tuple(DrawnTerminal(**terminal) for terminal in terminals.values())
        try:
            if sheet is not None:
                _check_unit(sheet, next(layer for layer in made if layer.is_body))
            return cls.from_values(
                {**values, "layers": made, "terminals": ends}, f"{where}: [probe]"
            )
        except DrawingError as error:
            file = where if sheet is None else sheet.file
            outlines = {part.part: part.drawn for part in (*made, *ends)}
            raise error.of_file(file, named, outlines) from None


def _check_unit(sheet: Sheet, body: DrawnLayer) -> None:
    """Refuse a lever of a file that is far too large or too small.

    Raises
    ------
    DrawingError
        With the unit in which it would be a lever.
    """
    extent, unit_um = extent_of(body.drawn), sheet.unit_um
    if not is_lever(extent):
        unit = sensible_unit(extent, unit_um)
        words = doubt(extent, unit_um, unit, "unit_um = {unit_um:g} in [probe]")
        raise DrawingError(words, body.name)


def _section(sections: Mapping[str, Any], name: str, where: str) -> dict[str, Any]:
    if name not in sections:
        raise InputError(f"{where}: section [{name}] is missing")
    if not isinstance(sections[name], Mapping):
        raise InputError(f"{where}: [{name}] must be a section")
    return dict(sections[name])


def _sheet(values: dict[str, Any], where: str, folder: Path | None, tolerance: Any) -> Sheet:
    """Read the file whose layers are named."""
    file = values.get("file")
    if not isinstance(file, str) or not file:
        raise InputError(f"{where}: [probe]: file is missing (GDSII, OASIS or DXF)")
    for key, kinds, default in (("cell", str, None), ("unit_um", (int, float), None)):
        if not isinstance(values.get(key, default), (kinds, type(None))):
            raise InputError(f"{where}: [probe]: {key} = {quoted(values[key])}: not understood")
    if not (type(tolerance) in (int, float) and _FINEST_UM <= tolerance <= _COARSEST_UM):
        raise InputError(
            f"{where}: [probe]: tolerance_um = {quoted(tolerance)}: expected {_FINEST_UM:g} to "
            f"{_COARSEST_UM:g}"
        )
    path = Path(file) if folder is None else folder / file
    unit, cell = values.get("unit_um"), values.get("cell")
    return read_sheet(os.fspath(path), cell, unit_um=unit, tolerance_um=float(tolerance))


def rings_of(sheet: Sheet, layer: Layer, *, lines: bool = False) -> Rings:
    """Return the outlines of a layer; with `lines` the steps of open ones too."""
    closed = layer.rings if sheet.kind == "DXF" else without_nested(layer.rings)
    steps = (step for line in layer.lines for step in pairwise(line))
    return (*closed, *steps) if lines else closed


def _rings(sheet: Sheet | None, given: Any, name: str, where: str, section: str) -> Rings:
    """Return the outlines of a layer, of a list of points or of a list of such lists."""
    if sheet is not None and isinstance(given, str):
        layer = sheet.layer(given, where)
        if section == "terminals":
            return rings_of(sheet, layer, lines=True)
        if layer.lines:
            x, y = layer.lines[0][0]
            raise InputError(
                f"{sheet.file}: {name} (layer {given}), at ({x:.3f}, {y:.3f}) µm: an outline that "
                "is not closed"
            )
        return rings_of(sheet, layer)
    if _is_points(given):
        given = [given]
    elif not (isinstance(given, list | tuple) and given and all(map(_is_points, given))):
        raise InputError(
            f'{where} = {quoted(given)}: expected a layer such as "1/0", or points such as '
            "[[0.0, -1.5], [0.0, 1.5]] (µm)"
        )
    return tuple(tuple((float(x), float(y)) for x, y in ring) for ring in given)


def _is_points(given: Any) -> bool:
    """Whether something is a list of two points or more."""
    return (
        isinstance(given, list | tuple)
        and len(given) > 1
        and all(
            isinstance(point, list | tuple)
            and len(point) == 2
            and all(
                type(coordinate) in (int, float) and abs(coordinate) < 1e6 for coordinate in point
            )
            for point in given
        )
    )
