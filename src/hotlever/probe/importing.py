"""A drawing file told in words, and the probe file that is proposed for it."""

from __future__ import annotations

import itertools
import tomllib
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import shapely
from shapely import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from hotlever.errors import InputError, counted
from hotlever.probe.drawing.edges import outline_edges, terminal_edges
from hotlever.probe.drawing.layers import terminal_part
from hotlever.probe.drawing.outlines import (
    DrawingError,
    Ring,
    healed,
    parts_of,
    polygons,
    snapped,
    together,
)
from hotlever.probe.drawing.partition import Partition, partitioned
from hotlever.probe.drawing.shape import TOLERANCE_UM, relative
from hotlever.probe.drawing.sheet import (
    UNITS,
    Sheet,
    SheetLayer,
    doubt,
    extent_of,
    is_lever,
    read_sheet,
    sensible_unit,
)
from hotlever.probe.layout import Point, ring_area
from hotlever.probe.probe import Probe, other_sections, section_lines
from hotlever.text import aligned, as_toml

#: A layer by its name, or outlines.
Drawn = str | tuple[Ring, ...]


@dataclass
class LayerInference:
    """What is what in a drawing.

    Attributes
    ----------
    layers, terminals : dict of str to layer's name or rings
    tip : tuple of float or None
    reasons : dict of str to str
        By the names that parts have in errors, and for the ``tip``.
    doubts : list of str
        What could not be told.
    """

    layers: dict[str, Drawn] = field(default_factory=dict)
    terminals: dict[str, Drawn] = field(default_factory=dict)
    tip: Point | None = None
    reasons: dict[str, str] = field(default_factory=dict)
    doubts: list[str] = field(default_factory=list)


def infer_layers(sheet: Sheet, tolerance: float) -> LayerInference:
    """Say which layer of a drawing is what, and why."""
    inferred = LayerInference()
    shapes = _shapes(sheet, tolerance, inferred.doubts)
    judged = [_Silicon(name, sheet, shapes, tolerance) for name in shapes]
    best = max(judged, key=lambda candidate: candidate.merit, default=None)
    if best is None:
        inferred.doubts.append("no layer holds a closed outline")
        return inferred
    best, film = _body_and_film(best, judged)
    body = "silicon" if film is None else "body"
    inferred.layers[body] = best.name
    touched = len(best.cutters) + len(best.touching)
    verbs = ("lies", "touches") if touched == 1 else ("lie", "touch")
    inferred.reasons[body] = (
        f"{best.shape.area:.4g} µm²; {counted(touched, 'other layer')} {verbs[0]} across it or "
        f"{verbs[1]} its outline"
    )
    if len(best.pieces) > 1:
        inferred.doubts.append(
            f"layer {best.name} has {len(best.pieces)} pieces that do not touch; a lever is one"
        )
    if film is None:
        _low_doped(best, inferred)
    else:
        inferred.layers["film"] = film.name
        inferred.reasons["film"] = "it lies on the body, and no layer lies across it"
        inferred.doubts.append(
            f"layer {film.name} is taken for a film that is heater and legs in one; its thickness, "
            "and what it and the body are made of, the drawing does not say"
        )
    _terminals(best, sheet, inferred)
    _tip(best, sheet, shapes, inferred)
    return inferred


def _shapes(sheet: Sheet, tolerance: float, doubts: list[str]) -> dict[str, BaseGeometry]:
    """Return the healed area of each layer that has one."""
    shapes = {}
    for name, layer in sheet.layers.items():
        if not layer.rings:
            continue
        try:
            areas = polygons(name, sheet.rings(layer), tolerance)
            shapes[name] = healed(name, areas, tolerance)
        except DrawingError as error:
            doubts.append(f"layer {error}")
    return {name: shape for name, shape in shapes.items() if not shape.is_empty}


class _Silicon:
    """A layer, seen as the silicon of the lever.

    Attributes
    ----------
    cutters : list of str
        Layers that lie across it so that it falls apart without them, or inside it.
    touching : list of str
        Layers that touch its outline along an edge.
    merit : tuple
        The larger, the likelier it is the silicon.
    """

    def __init__(
        self, name: str, sheet: Sheet, shapes: dict[str, BaseGeometry], tolerance: float
    ) -> None:
        self.name, self.tolerance = name, tolerance
        self.pieces = sorted(parts_of(shapes[name]), key=lambda piece: -piece.area)
        self.shape: Polygon = self.pieces[0]
        self.areas = shapes
        self.cutters: list[str] = []
        self.touching: list[str] = []
        for other, layer in sheet.layers.items():
            if other == name:
                continue
            if other in shapes and self._is_cut_by(shapes[other]):
                self.cutters.append(other)
            elif not self._is_within(shapes.get(other)) and self.ends_of(other, sheet, layer):
                self.touching.append(other)
        self.merit = (bool(self.cutters), min(len(self.touching), 2), self.shape.area)

    def _is_cut_by(self, other: BaseGeometry) -> bool:
        """Whether the silicon falls apart, or has one more hole, without another layer."""
        inside = self._sizable(self.shape.intersection(other))
        area = sum(piece.area for piece in inside)
        # a low-doped layer is no larger share of the silicon
        if not 0 < area < 0.6 * self.shape.area:
            return False
        rest = self._sizable(self.shape.difference(other.buffer(self.tolerance)))
        holes = sum(len(piece.interiors) for piece in rest)
        return len(rest) > 1 or holes > len(self.shape.interiors)

    def lies_on(self, other: str) -> bool:
        """Whether another layer is below all of it, and beyond."""
        below = self.areas[other]
        return below.area > self.shape.area and self._is_within(below)

    def _is_within(self, other: BaseGeometry | None) -> bool:
        """Whether another layer covers all of it, as a frame does, and so marks no end of it."""
        return other is not None and bool(other.buffer(self.tolerance).covers(self.shape))

    def _sizable(self, shape: BaseGeometry) -> list[Polygon]:
        return [
            piece for piece in parts_of(shape) if piece.area > 10 * self.tolerance * piece.length
        ]

    def ends_of(self, name: str, sheet: Sheet, layer: SheetLayer) -> bool:
        """Whether a layer touches the outline along an edge."""
        with suppress(DrawingError):
            drawn = {name: sheet.rings(layer, lines=True)}
            return bool(terminal_edges(self.shape, drawn, self.tolerance))
        return False


def _body_and_film(best: _Silicon, judged: list[_Silicon]) -> tuple[_Silicon, _Silicon | None]:
    """Return the body of a lever, and the film on it where no layer lies across the silicon."""
    if best.cutters:
        return best, None
    below = [other for other in judged if best.lies_on(other.name)]
    if below:
        return max(below, key=lambda other: other.shape.area), best
    above = [
        other for other in judged if other.lies_on(best.name) and other.name not in best.touching
    ]
    return best, max(above, key=lambda other: other.shape.area, default=None)


# --- low-doped parts ---------------------------------------------------------------------------


def _low_doped(best: _Silicon, inferred: LayerInference) -> None:
    """Tell the heater among the layers that cut the silicon, and name the others."""
    if not best.cutters:
        inferred.doubts.append(
            "no layer lies across the silicon so that current has to pass it: the heater is missing"
        )
        return
    heater = _hinted(best.cutters, ("heat", "htr")) or _farthest(best)
    reason = "the silicon falls apart without it"
    if len(best.cutters) > 1:
        reason += "; of such layers the farthest from the terminals"
    inferred.layers["heater"], inferred.reasons["heater"] = heater, reason
    rest = [name for name in best.cutters if name != heater]
    for number, name in enumerate(rest, start=1):
        part = "reader" if len(rest) == 1 else f"low-doped-{number}"
        inferred.layers[part] = name
        inferred.reasons[part] = "the silicon falls apart without it too, nearer to the terminals"


def _hinted(names: Iterable[str], words: tuple[str, ...]) -> str | None:
    """Return the one layer whose name says what it is, None if not one does."""
    hits = [name for name in names if any(word in name.lower() for word in words)]
    return hits[0] if len(hits) == 1 else None


def _farthest(best: _Silicon) -> str:
    """Return the layer across the silicon that is farthest from where the terminals are."""
    ends = [best.areas[name] for name in best.touching if name in best.areas]
    if not ends:
        base = _base(best.shape, best.areas[best.cutters[0]])
        ends = [LineString(edge) for edge in base] or [best.shape.centroid]
    near = shapely.union_all(ends).centroid
    return max(
        best.cutters, key=lambda name: near.distance(best.areas[name].intersection(best.shape))
    )


# --- terminals ---------------------------------------------------------------------------------


def _terminals(best: _Silicon, sheet: Sheet, inferred: LayerInference) -> None:
    """Tell supply, ground and reader by what lies between them."""
    candidates: dict[str, Drawn] = {name: name for name in best.touching}
    if len(candidates) == 1:
        (only,) = candidates
        rings = enumerate(sheet.rings(sheet.layers[only], lines=True), start=1)
        on_it: dict[str, Drawn] = {f"polygon {n} of {only}": (ring,) for n, ring in rings}
        # several contacts on one layer
        candidates = on_it if len(on_it) > 1 else candidates
    why = "it touches the outline along an edge"
    if len(candidates) < 2:
        heater = inferred.layers.get("heater")
        middle = best.areas[heater] if isinstance(heater, str) else best.shape.centroid
        base = _base(best.shape, middle)
        candidates = {f"edge {number}": (edge,) for number, edge in enumerate(base, start=1)}
        why = "one of the edges in a line far from the heater; no layer marks a terminal"
    if len(candidates) < 2:
        inferred.doubts.append("no edges that could be terminals: supply and ground are missing")
        return
    rings_by = {
        name: sheet.rings(sheet.layers[drawn], lines=True) if isinstance(drawn, str) else drawn
        for name, drawn in candidates.items()
    }
    try:
        named = _named(best, inferred, rings_by)
    except DrawingError as error:
        inferred.doubts.append(f"terminals cannot be told apart ({error.what})")
        named = {
            role: (name, "")
            for role, name in zip(("supply", "ground", "reader"), candidates, strict=False)
        }
    for role, (name, reason) in named.items():
        inferred.terminals[role] = candidates[name]
        inferred.reasons[terminal_part(role)] = "; ".join(filter(None, (why, reason)))


def _named(
    best: _Silicon, inferred: LayerInference, rings: dict[str, tuple[Ring, ...]]
) -> dict[str, tuple[str, str]]:
    """Return the terminal for each role, and why."""
    parts = {
        part: snapped(best.areas[name], best.shape, 1.5 * best.tolerance)
        for part, name in inferred.layers.items()
        if part not in ("silicon", "body", "film") and isinstance(name, str)
    }
    partition = partitioned(("silicon", best.shape), parts)
    ends = terminal_edges(best.shape, rings, best.tolerance)
    at = partition.touched_by(ends, best.tolerance)
    heaters = {number for number, piece in enumerate(partition.pieces) if "heater" in piece.layers}
    sides = _grouped(partition, at, heaters)
    alone = next((side for side in sides if len(side) == 1), sides[0])
    others = [name for side in sides if side is not alone for name in side] or alone[1:]
    supply = _hinted(at, ("supply", "bias", "v+", "vdd")) or alone[0]
    rest = [name for name in (*others, *alone) if name != supply]
    named = {"supply": (supply, "alone on its side of the heater" if len(at) > 2 else "")}
    if not rest:
        return named
    # terminals that reach the heater through another low-doped part only
    low = {number for number, piece in enumerate(partition.pieces) if "silicon" not in piece.layers}
    around = {name: partition.reached(at[name], low) for name in rest}
    behind = [
        name
        for name, numbers in around.items()
        if not any(partition.neighbours(number) & heaters for number in numbers)
    ]
    ground = _hinted(rest, ("ground", "gnd")) or next(
        (name for name in rest if name not in behind), rest[0]
    )
    reason = "on the other side of the heater" if heaters else "at the other end"
    if len(rest) > 1 and not behind:
        reason += "; which of the terminals there is ground, the drawing does not say"
    named["ground"] = (ground, reason)
    rest = [name for name in rest if name != ground]
    for number, name in enumerate(rest):
        role = "reader" if number == 0 else f"end-{number}"
        reason = "behind another low-doped part" if name in behind else "carries no current"
        named[role] = (name, reason)
    return named


def _grouped(partition: Partition, at: dict[str, set[int]], heaters: set[int]) -> list[list[str]]:
    """Return the terminals in groups that are connected other than through a heater."""
    groups: list[list[str]] = []
    for name in at:
        reached = partition.reached(at[name], heaters)
        group = next((others for others in groups if at[others[0]] & reached), [])
        if not group:
            groups.append(group)
        group.append(name)
    return groups


def _base(silicon: Polygon, heater: BaseGeometry) -> list[tuple[Point, Point]]:
    """Return the edges that lie in one line on the hull, the line farthest from the heater."""
    edges = outline_edges(silicon)
    hull = np.array(silicon.convex_hull.exterior.coords)
    best: tuple[float, list[tuple[Point, Point]]] = (0.0, [])
    for start, end in itertools.pairwise(hull):
        side = LineString([start, end]).buffer(1e-3)
        here = [edge for edge in edges if side.covers(LineString(edge))]
        away = heater.distance(LineString([start, end]))
        if len(here) > 1 and away > best[0]:
            best = (away, here)
    return sorted(best[1])


# --- tip ---------------------------------------------------------------------------------------


def _tip(
    best: _Silicon, sheet: Sheet, shapes: dict[str, BaseGeometry], inferred: LayerInference
) -> None:
    """Find the place of the tip."""
    for _, text, point in sheet.labels:
        if "tip" in text.lower() and best.shape.contains(shapely.Point(point)):
            inferred.tip = (round(point[0], 6) + 0.0, round(point[1], 6) + 0.0)  # no -0
            inferred.reasons["tip"] = f"the text '{text.strip()[:20]}' stands there"
            return
    heater, film = (inferred.layers.get(part) for part in ("heater", "film"))
    if isinstance(heater, str):
        area, why = shapes[heater].intersection(best.shape), "the middle of the heater"
    elif isinstance(film, str):
        ends = [
            shapes.get(end, best.shape) if isinstance(end, str) else shapely.MultiPoint(end[0])
            for name in ("supply", "ground")
            if (end := inferred.terminals.get(name)) is not None
        ]
        near = shapely.union_all(ends or [best.shape]).centroid
        reach = shapely.hausdorff_distance(near, shapes[film].boundary)
        area = shapes[film].difference(near.buffer(0.95 * reach))
        why = "where the film is farthest from the terminals"
    else:
        return
    inside = max(parts_of(area), key=lambda piece: piece.area)
    middle = inside.centroid if inside.contains(inside.centroid) else inside.point_on_surface()
    inferred.tip = (round(middle.x, 6) + 0.0, round(middle.y, 6) + 0.0)
    inferred.reasons["tip"] = f"{why}; no text in the drawing says 'tip'"


@dataclass(frozen=True)
class Imported:
    """A drawing file made a probe file.

    Attributes
    ----------
    sheet : Sheet
    inference : LayerInference
    listing : list of str
        What the file holds and what is proposed, in lines.
    text : str
        The probe file.
    fault : InputError or None
        Why the probe file cannot be solved as it stands.
    notes : list of str
        What else a user should hear of it.
    """

    sheet: Sheet
    inference: LayerInference
    listing: list[str]
    text: str
    fault: InputError | None
    notes: list[str]

    @property
    def outlines(self) -> dict[str, tuple[Ring, ...]]:
        """All that is drawn, by what it is and by layer."""
        roles, of_layer = _by_part(self.inference)
        outlines = {}
        for name, layer in self.sheet.layers.items():
            role = of_layer.get(name)
            label = name if role in (None, name) else f"{role} ({name})"
            outlines[label] = (*layer.rings, *layer.lines)
        return outlines | {
            role: drawn for role, drawn in roles.items() if not isinstance(drawn, str)
        }


def import_drawing(path: Path, cell: str | None, folder: Path, unit: str | None = None) -> Imported:
    """Read a drawing file and propose a probe file.

    Parameters
    ----------
    path : path
    cell : str, optional
        Of a GDSII or OASIS file.
    folder : path
        Where the probe file will stand: the name of the drawing is relative to it.
    unit : str, optional
        Of the file's numbers, as ``mm`` (`hotlever.probe.drawing.sheet`); what it says if left out.

    Raises
    ------
    InputError
        If the file cannot be read, or what it holds is no lever in its unit.
    """
    unit_um = None if unit is None else UNITS[unit]
    sheet = read_sheet(
        path, cell, unit_um=unit_um, tolerance_um=TOLERANCE_UM, unit_stated_by="--unit {unit}"
    )
    inference = infer_layers(sheet, TOLERANCE_UM)
    _check_unit(sheet, inference, unit)
    listing = _listing(sheet, inference)
    name = relative(path, folder)
    text = _probe_file(sheet, inference, listing, name, unit)
    try:
        shape = Probe.from_sections(tomllib.loads(text), str(path), folder).shape
        notes = [note for note in shape.notes() if note not in listing]
    except InputError as fault:
        return Imported(sheet, inference, listing, text, fault, [])
    return Imported(sheet, inference, listing, text, None, notes)


def _check_unit(sheet: Sheet, inference: LayerInference, unit: str | None) -> None:
    """Refuse a drawing that is a lever in another unit only.

    One without a heater is read in other units, since its parts may be lost in the tolerance of
    this one; frames and marks beside a lever may be as large as a lever.
    """
    extents = {
        name: extent_of((*layer.rings, *layer.lines)) for name, layer in sheet.layers.items()
    }
    name, better = max(extents, key=lambda name: extents[name]), None
    if "heater" in inference.layers:
        name = str(inference.layers["silicon"])
        if is_lever(extents[name]):
            return
    elif unit is None and not sheet.unit_stated:
        tried = ((unit, _silicon_in(sheet, unit)) for unit in UNITS)
        better, name = next(((unit, layer) for unit, layer in tried if layer), (None, name))
    if better is None:
        if "heater" not in inference.layers and any(map(is_lever, extents.values())):
            return
        better = sensible_unit(extents[name], sheet.unit_um)
    words = doubt(extents[name], sheet.unit_um, better, "--unit {unit}")
    raise InputError(f"{sheet.file}: layer {name}: {words}")


def _silicon_in(sheet: Sheet, unit: str) -> str | None:
    """Return the layer that is the silicon of a lever with a heater in some unit, if there is."""
    try:
        other = read_sheet(sheet.file, sheet.cell, unit_um=UNITS[unit], tolerance_um=TOLERANCE_UM)
    except InputError:  # it would be larger than any wafer
        return None
    layers = infer_layers(other, TOLERANCE_UM).layers
    silicon = layers.get("silicon")
    if "heater" not in layers or not isinstance(silicon, str):
        return None
    return silicon if is_lever(extent_of(other.layers[silicon].rings)) else None


def _by_part(inference: LayerInference) -> tuple[dict[str, Drawn], dict[str, str]]:
    """Return what is drawn by what it is taken as, and what layers are taken as."""
    ends = {terminal_part(name): drawn for name, drawn in inference.terminals.items()}
    roles = inference.layers | ends
    return roles, {drawn: role for role, drawn in roles.items() if isinstance(drawn, str)}


def _listing(sheet: Sheet, inference: LayerInference) -> list[str]:
    """Return what the file holds, line by line."""
    lines = [f"{Path(sheet.file).name}: {sheet.kind}"]
    if sheet.cell is not None:
        others = [name for name in sheet.cells if name != sheet.cell]
        more = f"; others: {', '.join(others[:20])}" if others else ""
        lines.append(f"cell {sheet.cell}{more}")
    if not sheet.unit_stated:
        lines.append("the file states no unit: taken to be in µm; see --unit and unit_um")
    elif sheet.cell is None:
        lines.append(f"one unit of the file is {sheet.unit_um:g} µm")
    _, of_layer = _by_part(inference)
    rows = [["layer", "outlines", "area (µm²)", "x (µm)", "y (µm)", "taken as"]]
    most = 60
    for name, layer in list(sheet.layers.items())[:most]:
        points = np.array([point for ring in (*layer.rings, *layer.lines) for point in ring])
        (x0, y0), (x1, y1) = points.min(axis=0), points.max(axis=0)
        number = f"{len(layer.rings)}" + (f" + {len(layer.lines)} open" if layer.lines else "")
        extent = [f"{x0:.6g} to {x1:.6g}", f"{y0:.6g} to {y1:.6g}"]
        area = f"{_area(name, sheet.rings(layer)):.4g}"
        rows.append([name, number, area, *extent, of_layer.get(name, "–")])
    lines += aligned(rows)
    if len(sheet.layers) > most:
        lines.append(f"and {len(sheet.layers) - most} more layers")
    lines += [f"{label}: {reason}" for label, reason in inference.reasons.items()]
    lines += [text for _, text in sheet.remarks[:most]]
    if len(sheet.remarks) > most:
        lines.append(f"and {len(sheet.remarks) - most} more notes on how it is read")
    return lines + [f"to be checked: {doubt}" for doubt in inference.doubts]


def _area(name: str, rings: tuple[Ring, ...]) -> float:
    """Return the area of a layer, or of all its outlines if one is at fault."""
    try:
        return float(together(polygons(name, rings, TOLERANCE_UM), TOLERANCE_UM).area)
    except DrawingError:
        return float(sum(ring_area(np.array(ring)) for ring in rings if len(ring) > 2))


def _probe_file(
    sheet: Sheet, inference: LayerInference, listing: list[str], name: str, unit: str | None
) -> str:
    reference, reasons = Probe.reference(), inference.reasons
    probe: dict[str, object] = {"shape": "drawing", "file": name}
    if sheet.cell is not None:
        probe["cell"] = sheet.cell
    if unit is not None or not sheet.unit_stated:
        probe["unit_um"] = sheet.unit_um
    probe |= {"thickness_um": reference.layout().thickness_um, "tip_um": inference.tip}
    meaning = {
        "unit_um": "the file does not say" if unit is None else f"as the import was told: {unit}",
        "thickness_um": "that of the reference probe: a drawing does not say",
        "tip_um": reasons.get("tip", "not found in the drawing, such as [0.0, 0.0]"),
    }
    lines = ["# A hotlever probe file: lengths in µm, temperatures in K.", "#"]
    lines += [f"# {line}" for line in listing]
    lines += section_lines("probe", probe, meaning, optional=True)
    has_film = "film" in inference.layers
    if has_film:
        lines += _film_sections(inference)
    else:
        lines += _drawn_lines("layers", ("silicon", "heater"), inference.layers, reasons, "1/0")
    ends = {role: reasons.get(terminal_part(role), "") for role in inference.terminals}
    lines += _drawn_lines("terminals", ("supply", "ground"), inference.terminals, ends, "10/0")
    without = ("material",) if has_film else ()
    return "\n".join(lines) + "\n" + other_sections(reference, without)


def _film_sections(inference: LayerInference) -> list[str]:
    """Return the sections of a film, of its body, and of the materials that are assumed of both."""
    lines: list[str] = []
    unsaid = "assumed: a drawing does not say"
    for name, material, own in (("body", "SiN", {}), ("film", "Pd", {"thickness_um": 0.05})):
        layer = {"drawn": inference.layers[name], "material": material, **own}
        meaning = {"drawn": inference.reasons[name], "thickness_um": unsaid}
        lines += section_lines(f"layers.{name}", layer, meaning)
    for kind, preset in (("dielectric", "SiN"), ("metal-film", "Pd")):
        assumed = {"kind": kind, "preset": preset}
        lines += section_lines(f"materials.{preset}", assumed, {"preset": unsaid})
    return lines


def _drawn_lines(
    section: str,
    required: tuple[str, ...],
    inferred: Mapping[str, Drawn],
    reasons: Mapping[str, str],
    example: str,
) -> list[str]:
    """Return a section of what was inferred in a drawing; what is missing stands in a comment."""
    drawn: dict[str, Drawn | None] = dict.fromkeys(required) | dict(inferred)
    values = {
        role: each[0] if isinstance(each, tuple) and len(each) == 1 else each
        for role, each in drawn.items()
    }
    missing = f"not found in the drawing, such as {as_toml(example)}"
    meaning = {role: reasons.get(role, "") if role in inferred else missing for role in drawn}
    return section_lines(section, values, meaning, optional=True)
