"""What a probe file says, as a picture and as what can be set. Runs in a worker process."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Iterator, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from hotlever import figures
from hotlever.app.edits import LayerRow, Section, drawn_in
from hotlever.app.jobs import probe_of
from hotlever.app.project import file_stamp
from hotlever.app.workers import Report
from hotlever.errors import InputError
from hotlever.lever.discretisation import chosen_space
from hotlever.materials.kinds import KINDS
from hotlever.materials.parameters import STATED, label, parameter_named
from hotlever.materials.presets import PRESETS, usual_values
from hotlever.materials.sections import with_tables
from hotlever.materials.stated import names_stated
from hotlever.probe import Circuit, Probe
from hotlever.probe.drawing.outlines import DrawingError
from hotlever.probe.drawing.shape import TOLERANCE_UM, DrawnShape
from hotlever.probe.drawing.sheet import read_sheet
from hotlever.probe.file_sections import sections_of
from hotlever.probe.shapes import DRAWING, PARAMETRIC

#: Numbers of other sections that can be set: keys, in the order in which they are shown.
_OF_A_DRAWING = ("thickness_um", "tip_um")
_OF_THE_CIRCUIT = ("series_resistance_ohm", "base_temperature_K")
_TITLES = {"probe": "The lever", "circuit": "Circuit"}
_LAST = ("heat_capacity", "heat_capacity_scale", "emissivity", "melting_point_K")
#: Layers of a drawing that are listed.
_MOST_LAYERS = 40
#: No part of a drawing of a probe lies beyond (µm).
_DRAWABLE_UM = 1e5


def svg(figure: Figure) -> str:
    """Return a figure as SVG."""
    return figure_file(figure, ".svg").decode("utf-8")


def figure_file(figure: Figure, suffix: str) -> bytes:
    """Return a figure as the content of a file."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, f"figure{suffix}")
        figures.save_figure(figure, path)
        return path.read_bytes()


def drawn_text(report: Report, text: str, title: str, mesh: bool = False) -> dict[str, Any]:
    """Return the drawing of a probe file that is being written, or of what is wrong with it."""
    with tempfile.NamedTemporaryFile("w", suffix=".toml", dir=".", prefix=".hotlever-") as file:
        file.write(text)
        file.flush()
        try:
            probe = Probe.from_file(file.name)
        except InputError as error:
            fault = str(error).replace(file.name, title)
            return {"figure": svg(_wrong(error, text, fault)), "fault": fault}
    layout, triangles = probe.layout(), chosen_space(probe).mesh if mesh else None
    return {
        "figure": svg(figures.probe_drawing(layout, title, mesh=triangles)),
        "fault": "",
        "rows": [(part.name, part.part, f"{part.area:.4g} µm²") for part in layout.regions],
        "triangles": 0 if triangles is None else triangles.elements.nelements,
    }


def drawn_file(report: Report, name: str, suffix: str, mesh: bool = False) -> bytes:
    """Return the drawing of a probe as the content of a file."""
    probe = probe_of(name)
    triangles = chosen_space(probe).mesh if mesh else None
    return figure_file(figures.probe_drawing(probe.layout(), name, mesh=triangles), suffix)


def settable(report: Report, text: str) -> dict[str, Any]:
    """Return what can be set in a probe file: layers, materials, dimensions, tip and circuit.

    Nothing, if the text is no probe file that could be edited so.
    """
    try:
        values = sections_of(text, "")
        sections = {name: values.get(name, {}) for name in ("probe", "layers", "terminals")}
        materials = values.get("materials", {})
        if not all(isinstance(part, dict) for part in (*sections.values(), *materials.values())):
            return {}
    except (InputError, AttributeError):
        return {}
    shape = str(sections["probe"].get("shape"))
    cards = [_card(("materials", name), section) for name, section in materials.items()]
    return {
        "layers": _rows(sections) if shape == DRAWING else [],
        "materials": list(materials),
        "cards": [_other(name, values.get(name, {}), own) for name, own in _others(shape)] + cards,
        "new": _new_materials(),
    }


def _wrong(error: InputError, text: str, fault: str) -> Figure:
    """Draw what is wrong with the drawing of a probe file, or with the dimensions of its shape.

    Raises
    ------
    InputError
        If neither has a place in a picture.
    """
    if isinstance(error, DrawingError):
        return figures.outlines_drawing(error.outlines, fault=fault, fault_at=error.place)
    try:
        return _impossible(sections_of(text, "")["probe"], fault)
    # a section may hold anything
    except (InputError, ArithmeticError, AttributeError, LookupError, TypeError, ValueError):
        raise InputError(fault) from None


def _impossible(values: Mapping[str, Any], fault: str) -> Figure:
    """Draw dimensions that do not go together, and mark the part that a line about them names.

    Raises
    ------
    ValueError
        If it names none of them, or no picture has room for them.
    """
    shape, words = PARAMETRIC[values["shape"]], set(re.findall(r"\w+", fault))
    if not words & set(shape.model_fields):
        raise ValueError(fault)
    regions = shape.model_construct(**values).layout().regions
    if not np.abs([region.rings[0] for region in regions]).max() < _DRAWABLE_UM:
        raise ValueError(fault)
    parts = {word.partition("_")[0] for word in words}
    wrong = next((region for region in regions if region.name.partition(" ")[0] in parts), None)
    fault_at = None if wrong is None else np.mean(wrong.rings[0], axis=0).tolist()
    outlines = {region.name: region.rings for region in regions}
    return figures.outlines_drawing(outlines, fault=fault, fault_at=fault_at)


def _rows(sections: Mapping[str, Any]) -> list[LayerRow]:
    rows = []
    for part in ("layers", "terminals"):
        for name, entry in sections[part].items():
            drawn = drawn_in(entry)
            label = drawn if isinstance(drawn, str) else f"{name} (points)"
            inner = entry if isinstance(entry, dict) else {}
            material = str(inner.get("material", ""))
            rows.append(LayerRow(label, drawn, part, name, material, inner.get("thickness_um")))
    probe = sections["probe"]
    if isinstance(file := probe.get("file"), str):
        used = {row.label for row in rows}
        path = Path(file)
        unit = probe.get("unit_um")
        try:
            arguments = (path, file_stamp(path), probe.get("cell"), unit)
            rows += [LayerRow(name, name) for name in _layers(*arguments) if name not in used]
        except InputError:
            pass  # the drawing of the probe says what is wrong
    return sorted(rows, key=lambda row: row.part or "z")[:_MOST_LAYERS]


@lru_cache(maxsize=8)
def _layers(path: Path, stamp: float, cell: Any, unit_um: Any) -> tuple[str, ...]:
    number = unit_um if isinstance(unit_um, int | float) else None
    name = cell if isinstance(cell, str) else None
    return tuple(read_sheet(path, name, unit_um=number, tolerance_um=TOLERANCE_UM).layers)


def _new_materials() -> dict[str, str]:
    """Return what a new material may be, by what `with_layer` takes."""
    new = {f"+{kind}": f"new: {kind.replace('-', ' ')}" for kind in KINDS}
    for name, preset in PRESETS.items():
        new[f"+{preset.kind}/{name}"] = f"new: {name} ({preset.kind.replace('-', ' ')})"
    return new


def _others(shape: str) -> Iterator[tuple[str, dict[str, str]]]:
    """Give the sections that are no material, with what their numbers are, for a kind of shape."""
    if shape == DRAWING:
        meanings = DrawnShape.description()
        yield "probe", {key: meanings[key] for key in _OF_A_DRAWING}
    elif shape in PARAMETRIC:
        yield "probe", PARAMETRIC[shape].description()
    meanings = Circuit.description()
    yield "circuit", {key: meanings[key] for key in _OF_THE_CIRCUIT}


def _other(name: str, section: Mapping[str, Any], meanings: Mapping[str, str]) -> dict[str, Any]:
    """Return the numbers of a section that is no material."""
    fields = []
    for key, words in meanings.items():
        unit, default = parameter_named(key).unit, _number(getattr(Circuit(), key, ""))
        own = _field((name,), key, section, default, f"{label(key)}: {words} ({unit})")
        fields.append({**own, "label": f"{label(key)} ({unit})"})
    return {"section": (name,), "title": _TITLES[name], "fields": fields}


def _card(path: Section, section: Mapping[str, Any]) -> dict[str, Any]:
    """Return the parameters of a material: of its kind, and those that formulas name."""
    kind = KINDS.get(str(section.get("kind")))
    words = [str(section.get(key)).replace("-", " ") for key in ("kind", "preset")]
    like = f", else as {words[1]}" if "preset" in section else ""
    card: dict[str, Any] = {"section": path, "title": f"{path[-1]}: {words[0]}{like}"}
    if kind is None:
        return {**card, "fields": []}
    preset = PRESETS.get(str(section.get("preset")))
    usual = usual_values(kind.model_fields["kind"].default) | dict(preset.values if preset else {})
    try:
        values = with_tables(section, Path())
    except InputError:
        values = {}
    useless = kind.without_use({**usual, **values})
    fields = []
    # what every material has counts least
    for key in sorted(kind.model_fields, key=lambda own: own in _LAST):
        if key in ("kind", "preset"):
            continue
        field = kind.model_fields[key]
        default = usual.get(key, field.default if isinstance(field.default, float) else "")
        meaning = field.description or ""
        field_shown = _field(path, key, section, _number(default), meaning)
        fields.append({**field_shown, "used": key not in useless or key in section or not values})
    named = names_stated({key: value for key, value in values.items() if key in STATED})
    for key in sorted({*named, *section} - kind.model_fields.keys()):
        fields.append(_field(path, key, section, "", f"{key}, a number in a formula"))
    return {**card, "fields": fields}


def _field(
    path: Section, key: str, section: Mapping[str, Any], default: str, meaning: str
) -> dict[str, Any]:
    value = section.get(key)
    if isinstance(value, list):
        value = ", ".join(map(_number, value))
    field = {"section": path, "key": key, "label": meaning, "meaning": meaning, "used": True}
    text = None if isinstance(value, dict) else "" if value is None else _number(value)
    return {**field, "default": default, "value": text}


def _number(value: Any) -> str:
    return f"{value:.12g}" if isinstance(value, int | float) else str(value)
