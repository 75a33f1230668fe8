"""A drawing file told in words, and the probe file that is proposed for it."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hotlever.errors import InputError
from hotlever.probe.drawing.layer_inference import FILM, Drawn, LayerInference, infer_layers
from hotlever.probe.drawing.layers import BODY, DRAWN, HEATER, REQUIRED, SILICON, terminal_part
from hotlever.probe.drawing.outlines import DrawingError, Ring, polygons, together
from hotlever.probe.drawing.shape import TOLERANCE_UM, relative
from hotlever.probe.drawing.sheet import (
    UNITS,
    Sheet,
    doubt,
    extent_of,
    is_lever,
    read_sheet,
    sensible_unit,
)
from hotlever.probe.file_sections import other_sections, section_lines
from hotlever.probe.layout import ring_area
from hotlever.probe.parts import MATERIAL
from hotlever.probe.probe import Probe
from hotlever.probe.shapes import DRAWING
from hotlever.text import aligned, as_toml

#: Layers that are listed, and notes on how the file is read.
_MOST_LISTED = 60
#: What is assumed of a film that is heater and legs in one, and of the body below it.
_ASSUMED = {
    BODY: {"kind": "dielectric", "preset": "SiN"},
    FILM: {"kind": "metal-film", "preset": "Pd"},
}
_FILM_UM = 0.05
#: How another unit is stated.
_UNIT_BY = "--unit {unit}"
_UNSAID, _MISSING = "assumed: a drawing does not say", "not found in the drawing, such as {}"


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
        roles = _by_part(self.inference)
        of_layer = {drawn: role for role, drawn in roles.items() if isinstance(drawn, str)}
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
        path, cell, unit_um=unit_um, tolerance_um=TOLERANCE_UM, unit_stated_by=_UNIT_BY
    )
    inference = infer_layers(sheet, TOLERANCE_UM)
    _check_unit(sheet, inference, unit)
    listing = _listing(sheet, inference)
    name = relative(path, folder)
    text = _probe_file(sheet, inference, listing, name, unit)
    fault: InputError | None = None
    notes: list[str] = []
    try:
        shape = Probe.from_sections(tomllib.loads(text), str(path), folder).shape
        notes = [note for note in shape.notes() if note not in listing]
    except InputError as error:
        fault = error
    return Imported(sheet, inference, listing, text, fault, notes)


def _check_unit(sheet: Sheet, inference: LayerInference, unit: str | None) -> None:
    """Refuse a drawing that is a lever in another unit only.

    One without a heater is read in other units, since its parts may be lost in the tolerance of
    this one; frames and marks beside a lever may be as large as a lever.
    """
    extents = {
        name: extent_of((*layer.rings, *layer.lines)) for name, layer in sheet.layers.items()
    }
    name, better = max(extents, key=lambda name: extents[name]), None
    if HEATER in inference.layers:
        name = str(inference.layers[SILICON])
        if is_lever(extents[name]):
            return
    elif unit is None and not sheet.unit_stated:
        tried = ((unit, _silicon_in(sheet, unit)) for unit in UNITS)
        better, name = next(((unit, layer) for unit, layer in tried if layer), (None, name))
    if better is None:
        if HEATER not in inference.layers and any(map(is_lever, extents.values())):
            return
        better = sensible_unit(extents[name], sheet.unit_um)
    words = doubt(extents[name], sheet.unit_um, better, _UNIT_BY)
    raise InputError(f"{sheet.file}: layer {name}: {words}")


def _silicon_in(sheet: Sheet, unit: str) -> str | None:
    """Return the layer that is the silicon of a lever with a heater in some unit, if there is."""
    try:
        other = read_sheet(sheet.file, sheet.cell, unit_um=UNITS[unit], tolerance_um=TOLERANCE_UM)
    except InputError:  # it would be larger than any wafer
        return None
    layers = infer_layers(other, TOLERANCE_UM).layers
    silicon = layers.get(SILICON)
    if HEATER not in layers or not isinstance(silicon, str):
        return None
    return silicon if is_lever(extent_of(other.layers[silicon].rings)) else None


def _by_part(inference: LayerInference) -> dict[str, Drawn]:
    """Return what is drawn by what it is taken as."""
    ends = {terminal_part(name): drawn for name, drawn in inference.terminals.items()}
    return inference.layers | ends


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
    roles = _by_part(inference)
    of_layer = {drawn: role for role, drawn in roles.items() if isinstance(drawn, str)}
    rows = [["layer", "outlines", "area (µm²)", "x (µm)", "y (µm)", "taken as"]]
    for name, layer in list(sheet.layers.items())[:_MOST_LISTED]:
        points = np.array([point for ring in (*layer.rings, *layer.lines) for point in ring])
        (x0, y0), (x1, y1) = points.min(axis=0), points.max(axis=0)
        number = f"{len(layer.rings)}" + (f" + {len(layer.lines)} open" if layer.lines else "")
        extent = [f"{x0:.6g} to {x1:.6g}", f"{y0:.6g} to {y1:.6g}"]
        area = f"{_area(name, sheet.rings(layer)):.4g}"
        rows.append([name, number, area, *extent, of_layer.get(name, "–")])
    lines += aligned(rows)
    if len(sheet.layers) > _MOST_LISTED:
        lines.append(f"and {len(sheet.layers) - _MOST_LISTED} more layers")
    lines += [f"{label}: {reason}" for label, reason in inference.reasons.items()]
    lines += [text for _, text in sheet.remarks[:_MOST_LISTED]]
    if len(sheet.remarks) > _MOST_LISTED:
        lines.append(f"and {len(sheet.remarks) - _MOST_LISTED} more notes on how it is read")
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
    probe: dict[str, object] = {"shape": DRAWING, "file": name}
    if sheet.cell is not None:
        probe["cell"] = sheet.cell
    if unit is not None or not sheet.unit_stated:
        probe["unit_um"] = sheet.unit_um
    probe |= {"thickness_um": reference.layout().thickness_um, "tip_um": inference.tip}
    meaning = {
        "unit_um": "the file does not say" if unit is None else f"as the import was told: {unit}",
        "thickness_um": "that of the reference probe: a drawing does not say",
        "tip_um": reasons.get("tip", _MISSING.format("[0.0, 0.0]")),
    }
    lines = ["# A hotlever probe file: lengths in µm, temperatures in K.", "#"]
    lines += [f"# {line}" for line in listing]
    lines += section_lines("probe", probe, meaning, optional=True)
    has_film = FILM in inference.layers
    if has_film:
        lines += _film_sections(inference)
    else:
        lines += _drawn_lines("layers", (SILICON, HEATER), inference.layers, reasons, "1/0")
    ends = {role: reasons.get(terminal_part(role), "") for role in inference.terminals}
    lines += _drawn_lines("terminals", REQUIRED, inference.terminals, ends, "10/0")
    without = (MATERIAL,) if has_film else ()
    return "\n".join(lines) + "\n" + other_sections(reference, without)


def _film_sections(inference: LayerInference) -> list[str]:
    """Return the sections of a film, of its body, and of the materials that are assumed of both."""
    lines: list[str] = []
    for name, assumed in _ASSUMED.items():
        layer: dict[str, object] = {DRAWN: inference.layers[name], "material": assumed["preset"]}
        if name == FILM:
            layer["thickness_um"] = _FILM_UM
        meaning = {DRAWN: inference.reasons[name], "thickness_um": _UNSAID}
        lines += section_lines(f"layers.{name}", layer, meaning)
    for assumed in _ASSUMED.values():
        lines += section_lines(f"materials.{assumed['preset']}", assumed, {"preset": _UNSAID})
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
    missing = _MISSING.format(as_toml(example))
    meaning = {role: reasons.get(role, "") if role in inferred else missing for role in drawn}
    return section_lines(section, values, meaning, optional=True)
