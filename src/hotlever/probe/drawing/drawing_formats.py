"""Reads a GDSII, OASIS or DXF file into plain lists, in a process of its own.

The libraries that read these files take damaged ones for valid memory, and deep arrays for short
work; a process that is started for one file can fail or be stopped. So this module is run as a
script (see `hotlever.probe.drawing.sheet`), imports nothing of hotlever, and prints JSON: the
sheet, or an error in one line.
"""

from __future__ import annotations

import io
import json
import logging
import math
import sys
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Sequence
from itertools import chain, pairwise
from typing import Any

#: Polygons, and corners in all, beyond which a file holds more than one lever.
MOST_POLYGONS = 20_000
#: Points within this (µm) are one: a file does not state them better.
_SAME_UM = 1e-6


class Refusal(Exception):
    """What is wrong with the file, in one line."""


def kind_of(content: bytes) -> str:
    """Return what a file is, by its first bytes."""
    if content[2:4] == b"\x00\x02":
        return "GDSII"
    if content.startswith(b"%SEMI-OASIS"):
        return "OASIS"
    if content.startswith(b"AutoCAD Binary DXF") or b"SECTION" in content[:4096]:
        return "DXF"
    raise Refusal("no GDSII, OASIS or DXF file")


class Outlines:
    """What a file draws, by layer, and what should be known of it."""

    def __init__(self) -> None:
        self.layers: defaultdict[str, dict[str, list[Any]]] = defaultdict(
            lambda: {"rings": [], "lines": [], "fills": []}
        )
        self.corners = 0
        self._counts = Counter[tuple[str, str]]()

    def note(self, layer: str, what: str, count: int = 1) -> None:
        """Count something that should be known of a layer; in `what` {} stands for how many."""
        self._counts[layer, what] += count

    def leave_out(self, layer: str, what: str) -> None:
        """Count something that does not count."""
        self.note(layer, f"left out: {{}} {what}")

    def notes(self) -> list[tuple[str, str]]:
        """Return what was noted, each with its layer."""
        return [
            (layer, what.format(count) + (f" (layer {layer})" if layer else ""))
            for (layer, what), count in self._counts.items()
        ]

    def count(self, points: Sequence[Any]) -> None:
        """Refuse a file of very many corners."""
        self.corners += len(points)
        if self.corners > 200_000:
            raise Refusal("holds more than 200000 corners, expected one lever")


def extent_of(points: Sequence[Sequence[float]]) -> float:
    """Return the longer side of the box around some points, 0 if there are none."""
    return max((max(axis) - min(axis) for axis in zip(*points, strict=True)), default=0.0)


# --- GDSII and OASIS ----------------------------------------------------------------------------


def read_stream(
    path: str, kind: str, cell: str | None, unit_um: float | None, tolerance_um: float
) -> dict[str, Any]:
    """Return what a cell of a GDSII or OASIS file holds, in µm."""
    import gdstk

    # OASIS files know no unit but the µm
    stated_um = 1e6 * gdstk.gds_units(path)[0] if kind == "GDSII" else 1.0
    scale = 1.0 if unit_um is None else unit_um / stated_um
    read = gdstk.read_gds if kind == "GDSII" else gdstk.read_oas
    library = read(path, unit=1e-6, tolerance=tolerance_um / scale)
    cells: dict[str, Any] = {each.name: each for each in library.cells}
    # a cell of KLayout's own keeps what its cells with parameters were drawn from
    top = [each.name for each in library.top_level() if each.name != "$$$CONTEXT_INFO$$$"]
    sheet: dict[str, Any] = {"kind": kind, "cells": sorted(cells), "top": sorted(top)}
    sheet["unit_um"] = unit_um or stated_um
    counts: dict[str, int] = {}
    for each in library.cells:
        _count(each, counts, ())
    if cell is None and len(top) == 1:
        cell = top[0]
    if cell is None or cell not in cells:
        return sheet | {"cell": cell, "layers": {}, "labels": []}
    if counts[cell] > MOST_POLYGONS:
        raise Refusal(
            f"cell '{cell}' holds {counts[cell]} polygons, expected at most {MOST_POLYGONS}: "
            "name the cell of one lever"
        )
    # paths of an absolute width keep it, which polygons of references do not
    own = cells[cell].flatten()
    outlines = Outlines()
    points = [path for path in own.paths if _is_point(path, scale)]
    for polygon in [*own.get_polygons(), *chain.from_iterable(map(_of_point, points))]:
        name = f"{polygon.layer}/{polygon.datatype}"
        ring = (scale * polygon.points).tolist()
        if extent_of(ring) <= _SAME_UM:
            outlines.leave_out(name, "polygon or path without extent")
        else:
            outlines.layers[name]["rings"].append(ring)
    labels = [
        (f"{label.layer}/{label.texttype}", label.text, *(scale * at for at in label.origin))
        for label in own.get_labels()
    ]
    return sheet | {
        "cell": cell,
        "layers": outlines.layers,
        "labels": labels[:1000],
        "notes": outlines.notes(),
    }


def _is_point(path: Any, scale: float) -> bool:
    """Whether a path goes nowhere, so that gdstk draws nothing of it."""
    return extent_of((scale * path.spine()).tolist()) <= _SAME_UM


def _of_point(path: Any) -> Iterable[Any]:
    """Yield what a path of one place draws: a square or a disc, by its ends, or a point."""
    import gdstk

    place = path.spine()[0]
    for layer, datatype, width, offset, end in zip(
        path.layers, path.datatypes, path.widths()[0], path.offsets()[0], path.ends, strict=True
    ):
        kind = {"layer": layer, "datatype": datatype}
        half = width / 2
        # which way its ends are, nobody can tell
        square = end == "extended" or (isinstance(end, tuple) and set(end) == {half})
        if offset == 0 and half > 0 and square:
            drawn = gdstk.rectangle(place - half, place + half, **kind)
        elif offset == 0 and half > 0 and end == "round":
            drawn = gdstk.ellipse(place, half, tolerance=path.tolerance, **kind)
        else:
            drawn = gdstk.Polygon([tuple(place)] * 3, **kind)
        yield drawn


def _count(cell: Any, counts: dict[str, int], above: tuple[str, ...]) -> int:
    """Return how many polygons a cell has with all that it refers to."""
    if cell.name in above:
        raise Refusal(f"cell '{cell.name}' refers to itself")
    if cell.name not in counts:
        polygons = len(cell.polygons) + len(cell.paths)
        for reference in cell.references:
            inner = reference.cell
            if isinstance(inner, str):
                raise Refusal(f"cell '{cell.name}' refers to '{inner}', which is not there")
            times = max(1, reference.repetition.size or 1)
            polygons += times * _count(inner, counts, (*above, cell.name))
        counts[cell.name] = polygons
    return counts[cell.name]


# --- DXF ----------------------------------------------------------------------------------------


def read_dxf(
    file: str, content: bytes, unit_um: float | None, tolerance_um: float, largest_um: float
) -> dict[str, Any]:
    """Return what the model space of a DXF file holds, in µm; curves become short lines."""
    import ezdxf
    from ezdxf import recover, units
    from ezdxf.enums import InsertUnits

    try:
        if content.startswith(b"AutoCAD Binary DXF"):
            document = ezdxf.readfile(file)
        else:
            document, auditor = recover.read(io.BytesIO(content))
            for entry in (*auditor.errors, *auditor.fixes):
                logging.warning("%s", entry.message)
    except ezdxf.DXFError as error:
        raise Refusal(f"a damaged DXF file ({error})") from None
    stated = unit_um is not None or document.units != 0
    if unit_um is None:
        # a file that says no unit is taken to be in µm
        try:
            unit = InsertUnits(document.units or InsertUnits.Microns)
            # ezdxf knows no factor of parts of an inch
            parts = {InsertUnits.Mils: 1e-3, InsertUnits.Microinches: 1e-6}
            whole = InsertUnits.Inches if unit in parts else unit
            unit_um = parts.get(unit, 1.0) * units.conversion_factor(whole, InsertUnits.Microns)
        except (TypeError, ValueError):
            raise Refusal(
                f"its $INSUNITS, {document.units}, is no unit that is understood; say it with "
                "--unit, or as unit_um in [probe]"
            ) from None
    drawing = _Drawing(document, unit_um, tolerance_um, largest_um)
    drawing.walk(document.modelspace(), None, "", 0)
    drawing.flatten()
    return {
        "kind": "DXF",
        "layers": drawing.outlines.layers,
        "labels": drawing.labels[:1000],
        "unit_um": unit_um,
        "unit_stated": stated,
        "notes": drawing.outlines.notes(),
        "hidden": drawing.hidden,
    }


class _Drawing:
    """The model space of a DXF file, entity by entity, as a CAD program shows it.

    Attributes
    ----------
    outlines : Outlines
    labels : list of (str, str, float, float)
        Layer, text and place (µm).
    hidden : dict of str to str
        Layers of which nothing is seen, and why.
    """

    def __init__(
        self, document: Any, unit_um: float, tolerance_um: float, largest_um: float
    ) -> None:
        self.document, self.unit_um = document, unit_um
        self.tolerance_um, self.largest_um = tolerance_um, largest_um
        #: How many cubic curves stand for a circle: they are off by less than 1e-8 of its radius.
        self.segments = 16
        self.outlines = Outlines()
        self.labels: list[tuple[str, str, float, float]] = []
        self.hidden: dict[str, str] = {}
        # names of layers do not differ by case; as the table of layers has them
        self.names = {layer.dxf.name.lower(): layer.dxf.name for layer in document.layers}
        #: Layer, type, curves, and how areas of several are filled, of each entity.
        self.curves: list[tuple[str, str, list[Any], str | None]] = []
        self.wide: list[tuple[str, Any]] = []

    def walk(self, entities: Any, above: str | None, hidden: str, depth: int) -> None:
        """Take entities of the model space, or of a block on layer `above`.

        Where `hidden` is not empty it says why nothing of them is seen.
        """
        from ezdxf.xclip import XClip

        for entity in entities:
            own = str(entity.dxf.get("layer", "0"))
            # in a block, layer 0 means that of the reference
            name = above if above is not None and own == "0" else own
            name = self.names.setdefault(name.lower(), name)
            unseen = hidden or self._unseen(entity, name)
            if entity.dxftype() != "INSERT":
                self._take(entity, name, unseen)
                continue
            if depth >= 20:
                raise Refusal("blocks are nested more than 20 deep")
            if entity.mcount > MOST_POLYGONS:
                raise Refusal(f"an array of {entity.mcount} blocks, expected one lever")
            block = entity.dxf.get("name", "")
            if entity.block() is None or entity.is_xref():
                if not unseen:
                    what = f"left out: {{}} INSERT of '{_plain(block)}', which is not in the file"
                    self.outlines.note("", what)
                continue
            if not unseen and XClip(entity).is_clipping_enabled:
                self.outlines.note(
                    "", f"{{}} INSERT of '{_plain(block)}' is clipped, but read whole"
                )
            # of a block on a layer that is off, what is on other layers is seen
            inside = hidden
            if not hidden and entity.dxf.get("invisible", 0):
                inside = "in an invisible INSERT"
            elif not hidden and self._state(name) == "frozen":
                inside = f"in an INSERT on the frozen layer {_plain(name)}"
            for single in entity.multi_insert():
                walked = single.virtual_entities(skipped_entity_callback=self._skip(name, inside))
                self.walk(walked, name, inside, depth + 1)

    def _skip(self, name: str, hidden: str) -> Callable[[Any, str], None]:
        """Return what notes entities that ezdxf cannot place with their block."""

        def skipped(entity: Any, _: str) -> None:
            own = str(entity.dxf.get("layer", "0"))
            if not hidden:
                layer = name if own == "0" else self.names.get(own.lower(), own)
                self.outlines.leave_out(layer, f"{entity.dxftype()} in an INSERT that distorts it")

        return skipped

    def _state(self, name: str) -> str:
        """Return whether a layer is ``frozen`` or ``off``, an empty text if it is seen."""
        if not self.document.layers.has_entry(name):
            return ""
        layer = self.document.layers.get(name)
        return "frozen" if layer.is_frozen() else "off" if layer.is_off() else ""

    def _unseen(self, entity: Any, name: str) -> str:
        """Return why an entity itself is not seen, an empty text if it is."""
        if state := self._state(name):
            self.hidden[name] = state
            return "on a frozen layer" if state == "frozen" else "on a layer that is off"
        return "set invisible" if entity.dxf.get("invisible", 0) else ""

    def _take(self, entity: Any, name: str, unseen: str) -> None:
        """Take one entity that is no block."""
        from ezdxf import path

        kind = entity.dxftype()
        if kind in ("TEXT", "MTEXT"):
            if not unseen:
                text, at = entity.plain_text(), entity.dxf.insert
                if kind == "TEXT":
                    text, at = entity.dxf.text, entity.ocs().to_wcs(at)
                self.labels.append((name, text, at.x * self.unit_um, at.y * self.unit_um))
            return
        if unseen:
            self.outlines.leave_out(name, f"{kind} {unseen}")
            return
        if kind == "POLYLINE" and not (entity.is_polygon_mesh or entity.is_poly_face_mesh):
            # the frame of a spline is not seen
            entity.vertices[:] = [each for each in entity.vertices if not each.dxf.flags & 16]
        try:
            if kind in ("IMAGE", "WIPEOUT", "VIEWPORT"):
                raise TypeError
            curve = path.make_path(entity, segments=self.segments)
        except TypeError:
            self.outlines.leave_out(name, f"{kind} without an outline")
            return
        curves = list(curve.sub_paths()) if curve.has_sub_paths else [curve]
        curves = [each for each in curves if self._extent(each) > _SAME_UM]
        if not curves:
            self.outlines.leave_out(name, f"{kind} without extent")
            return
        rule = None
        if kind in ("HATCH", "MPOLYGON", "SOLID", "TRACE", "3DFACE"):
            style = entity.dxf.get("hatch_style", 0) if kind == "HATCH" else 0
            # what is filled: every other ring from outside, the first one, all
            rules = {0: "even-odd", 1: "outer", 2: "all"}
            rule = rules.get(style, rules[0])
        elif kind in ("LWPOLYLINE", "POLYLINE") and entity.has_width:
            self.outlines.note(name, f"{{}} {kind} counts as wide as it is drawn")
            self.wide.append((name, entity))
            if all(width > 0 for width, _ in _segments(entity)):
                return
        self.curves.append((name, kind, curves, rule))

    def _extent(self, *curves: Any) -> float:
        """Return the longer side of a box around the corners of curves (µm)."""
        points = [
            (corner.x, corner.y)
            for curve in curves
            if len(curve)
            for corner in curve.control_vertices()
        ]
        return self.unit_um * extent_of(points)

    def flatten(self) -> None:
        """Draw all curves as short lines.

        A layer that is longer than any lever, in a wrong unit or around many, is drawn as well as
        the longest one: it would be of too many corners to be told so.
        """
        by_layer = defaultdict[str, list[Any]](list)
        for name, _, curves, _ in self.curves:
            by_layer[name] += curves
        tolerance = {}
        for name, curves in by_layer.items():
            larger = max(1.0, self._extent(*curves) / self.largest_um)
            tolerance[name] = larger * self.tolerance_um
            if larger > 1 and any(curve.has_curves for curve in curves):
                extent = larger * self.largest_um
                what = (
                    f"{extent:.4g} µm long, so its curves are drawn within {tolerance[name]:.2g} µm"
                )
                self.outlines.note(name, what)
        for name, kind, curves, rule in self.curves:
            distance = tolerance[name] / self.unit_um
            rings = [self._ring(curve.flattening(distance)) for curve in curves]
            if rule is not None:
                self._fill(name, kind, rings, rule)
                continue
            for curve, points in zip(curves, rings, strict=True):
                closed = len(points) > 2 and curve.is_closed
                self.outlines.layers[name]["rings" if closed else "lines"].append(points)
        for name, polyline in self.wide:
            self._fill(name, polyline.dxftype(), self._faces(polyline), "all")

    def _ring(self, corners: Iterable[Any]) -> list[tuple[float, float]]:
        points = [(point.x * self.unit_um, point.y * self.unit_um) for point in corners]
        if len(points) > 1 and points[0] == points[-1]:
            points.pop()
        self.outlines.count(points)
        return points

    def _fill(
        self, name: str, kind: str, rings: list[list[tuple[float, float]]], rule: str
    ) -> None:
        """Add an area; what of it is a line adds nothing."""
        areas = [ring for ring in rings if not _is_line(ring)]
        if areas:
            self.outlines.layers[name]["fills"].append({"rings": areas, "rule": rule})
        else:
            self.outlines.leave_out(name, f"{kind} without an area")

    def _faces(self, polyline: Any) -> list[list[tuple[float, float]]]:
        """Return the areas of a polyline that has a width."""
        from ezdxf.render.trace import TraceBuilder

        # the outer side of what is wide is hardly ever twice as far from its centre as its middle
        radius_um = 2 * self.unit_um * max(radius for _, radius in _segments(polyline))
        lines = math.pi * math.sqrt(radius_um / (2 * self.tolerance_um))
        segments = min(math.ceil(lines), 2000)
        trace = TraceBuilder.from_polyline(polyline, segments=max(segments, self.segments))
        faces = trace.faces_wcs(polyline.ocs(), 0.0)
        return [self._ring(face) for face in faces]


def _segments(polyline: Any) -> list[tuple[float, float]]:
    """Return the larger width of each segment of a polyline, and its radius, 0 if straight."""
    from ezdxf.math import Vec2, bulge_radius

    if polyline.dxftype() == "LWPOLYLINE":
        constant, closed = polyline.dxf.const_width, polyline.closed
        corners = [
            (Vec2(x, y), constant or max(start, end), bulge)
            for x, y, start, end, bulge in polyline.lwpoints
        ]
    else:
        first, last = polyline.dxf.default_start_width, polyline.dxf.default_end_width
        closed = polyline.is_closed
        corners = []
        for vertex in polyline.vertices:
            widths = vertex.dxf.get("start_width", first), vertex.dxf.get("end_width", last)
            corners.append((Vec2(vertex.dxf.location), max(widths), vertex.dxf.get("bulge", 0.0)))
    ends = corners[1:] + corners[: 1 if closed else 0]
    return [
        (width, bulge_radius(at, end, bulge) if bulge and at != end else 0.0)
        for (at, width, bulge), (end, _, _) in zip(corners, ends, strict=closed)
    ]


def _plain(name: Any) -> str:
    """Return a name of the file as it may stand in a note."""
    text = str(name).replace("{", "(").replace("}", ")")
    return text if len(text) <= 40 else f"{text[:39]}…"


def _is_line(ring: list[tuple[float, float]]) -> bool:
    """Whether all corners of a ring are on one line."""
    (x, y), size = ring[0], extent_of(ring)
    fan = pairwise((x1 - x, y1 - y) for x1, y1 in ring)
    twice = sum(abs(x0 * y1 - x1 * y0) for (x0, y0), (x1, y1) in fan)
    return twice <= _SAME_UM * size


def main() -> None:
    """Read the file named on the command line; options are JSON in the second argument."""
    path, options = sys.argv[1], json.loads(sys.argv[2])
    try:
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (options["memory"], options["memory"]))
    except (ImportError, ValueError, OSError):
        pass
    logging.basicConfig(format="ezdxf: %(message)s")
    unit_um, tolerance_um = options["unit_um"], options["tolerance_um"]
    try:
        with open(path, "rb") as file:
            content = file.read()
        kind = kind_of(content)
        if kind == "DXF":
            sheet = read_dxf(path, content, unit_um, tolerance_um, options["largest_um"])
        else:
            sheet = read_stream(path, kind, options["cell"], unit_um, tolerance_um)
    except Refusal as error:
        sheet = {"error": str(error)}
    except Exception as error:
        # what these libraries raise for damaged files has no end
        sheet = {"error": f"a damaged file ({type(error).__name__}: {error})"}
    print(json.dumps(sheet))


if __name__ == "__main__":
    main()
