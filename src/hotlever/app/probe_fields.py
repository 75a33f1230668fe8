"""A probe that is edited as fields: its picture, what can be set in it, and it with that set.

What is edited is the sections of a probe file, as `hotlever.probe.Probe.from_sections` takes them,
be they a probe or not yet. `opened`, `drawn`, `settable` and `written` run in a worker process.
"""

from __future__ import annotations

import math
import re
import tempfile
from collections.abc import Container, Iterator, Mapping
from copy import deepcopy
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from hotlever import figures
from hotlever.app.project import file_stamp
from hotlever.app.workers import Report
from hotlever.errors import InputError, excerpt
from hotlever.lever.discretisation import chosen_space
from hotlever.materials.kinds import KINDS
from hotlever.materials.parameters import STATED, label, parameter_named
from hotlever.materials.presets import PRESETS, usual_values, with_tables
from hotlever.materials.stated import names_stated
from hotlever.probe import Circuit, Probe
from hotlever.probe.drawing.outlines import DrawingError
from hotlever.probe.drawing.shape import TOLERANCE_UM, DrawnShape
from hotlever.probe.drawing.sheet import read_sheet
from hotlever.probe.probe import file_text, read_sections
from hotlever.probe.shapes import EDGE_BIAS, PARAMETRIC, SHAPE_SECTIONS

# Sections of a probe file by name.
Sections = dict[str, Any]

#: What a layer of a drawing may be, in words; films and parts have names of their own.
ROLES = {"": "not used", "body": "outline of the lever", "heater": "heater", "film": "film or part"}
ROLES |= {name: f"terminal: {name}" for name in ("supply", "ground", "reader")}


# --- it with something set ------------------------------------------------------------------------


def with_value(sections: Sections, place: tuple[str, ...], key: str, value: Any) -> Sections:
    """Return sections with a value set, or with None taken out.

    Examples
    --------
    >>> with_value({"probe": {"gap_um": 1.0}}, ("probe",), "gap_um", 2.0)
    {'probe': {'gap_um': 2.0}}
    """
    changed = deepcopy(sections)
    inside = changed
    for name in place:
        inside = inside.setdefault(name, {})
    if value is None:
        inside.pop(key, None)
    else:
        inside[key] = value
    return changed


def has_section(sections: Sections, place: tuple[str, ...]) -> bool:
    """Return whether there is a section."""
    inside: Any = sections
    for name in place:
        inside = inside.get(name) if isinstance(inside, dict) else None
    return isinstance(inside, dict)


def with_material_renamed(sections: Sections, old: str, new: str) -> Sections:
    """Return sections in which a material has another name, wherever it is named.

    Layers are made of it, priors are of its parameters, and a monitor may be the mean over it.

    Raises
    ------
    InputError
        If the name is taken or empty.
    """
    changed, new = deepcopy(sections), new.strip()
    materials = changed.get("materials", {})
    if not new or new in materials:
        raise InputError(f"found '{excerpt(new)}', expected a name that no material has")
    changed["materials"] = {new if name == old else name: own for name, own in materials.items()}
    layers, of_old = changed.get("layers", {}), f"{old}."
    if "prior" in changed:
        changed["prior"] = {
            new + name.removeprefix(old) if name.startswith(of_old) else name: stated
            for name, stated in changed["prior"].items()
        }
    # the keys that name it, in sections of which kind; a layer of its name comes before it
    keys = {"layers": "material"} | ({} if old in layers else {"monitor": "region"})
    for part, key in keys.items():
        for own in changed.get(part, {}).values():
            if isinstance(own, dict) and own.get(key) == old:
                own[key] = new
    return changed


@dataclass(frozen=True)
class LayerRow:
    """What a layer of a drawing is.

    Attributes
    ----------
    label : str
        The layer's name in the drawing, or of the outlines that the probe file lists.
    drawn : str or list
        It, or the outlines.
    part : str
        ``layers`` or ``terminals``; empty if it is not used.
    name : str
        Its key there.
    material : str
        Of ``[materials]``; empty for the silicon of ``[material]``.
    """

    label: str
    drawn: Any
    part: str = ""
    name: str = ""
    material: str = ""

    @property
    def role(self) -> str:
        """What it is, in one word."""
        if self.part == "layers" and self.name != "heater":
            return "body" if self.name in ("silicon", "body") else "film"
        return self.name


def _drawn_in(layer: Any) -> Any:
    """Return what a layer or terminal is drawn in: a name, or outlines."""
    return layer.get("drawn", layer.get("area")) if isinstance(layer, dict) else layer


def with_layer(sections: Sections, row: LayerRow, role: str, material: str) -> Sections:
    """Return sections in which a layer of a drawing is something else.

    The row says what is drawn; which layer or terminal that is by now, the sections say. A
    ``material`` that begins with ``+`` is a new one: its kind, and behind ``/`` its preset.
    Materials that no layer is made of any more go: they would be refused.
    """
    changed = deepcopy(sections)
    layers, terminals, materials = (
        changed.setdefault(part, {}) for part in ("layers", "terminals", "materials")
    )
    name, before, was_layer = "", None, False
    for part in (layers, terminals):
        for own in [own for own, entry in part.items() if _drawn_in(entry) == row.drawn]:
            name, before, was_layer = own, part.pop(own), part is layers
    if material.startswith("+"):
        kind, _, preset = material[1:].partition("/")
        material = _free(preset or kind, materials)
        materials[material] = {"kind": kind} | ({"preset": preset} if preset else {})
    of_before = before if isinstance(before, dict) else {}
    if role == "body":
        for body in ("silicon", "body"):
            layers.pop(body, None)
        name = "body" if material else "silicon"
    elif role == "heater":
        layers.pop("heater", None)
        name = "heater"
    elif role == "film":
        former = of_before.get("material", "")
        # a name of its own stays, one after what it was made of does not
        named = was_layer and name not in ("silicon", "body", "heater")
        if not (named and bool(former) == bool(material)) or (former and name.startswith(former)):
            name = _free(material or "low-doped", layers)
    elif role:
        terminals[role if role in ROLES else name] = row.drawn
    if role in ("body", "heater", "film"):
        # a film stays one of another material; edges of a metal have no shift
        stays = {"thickness_um": material and role != "body"}
        stays[EDGE_BIAS] = of_before.get("material", "") == material
        kept = {key: of_before[key] for key in stays if stays[key] and key in of_before}
        entry = {"drawn": row.drawn, **({"material": material} if material else {}), **kept}
        layers[name] = entry if len(entry) > 1 else row.drawn
    used = {layer.get("material") for layer in layers.values() if isinstance(layer, dict)}
    for unused in materials.keys() - used:
        del materials[unused]
    if layers and all(isinstance(layer, dict) and "material" in layer for layer in layers.values()):
        changed.pop("material", None)
    return {name: section for name, section in changed.items() if section or name != "materials"}


def _free(name: str, existing_names: Container[str]) -> str:
    number, free = 1, name
    while free in existing_names:
        number += 1
        free = f"{name}-{number}"
    return free


def typed(key: str, text: str) -> Any:
    """Return what was typed in a field as a value of a probe file; None if nothing was."""
    text = text.strip()
    numbers = [_as_number(part) for part in text.split(",")] if key == "tip_um" else []
    if len(numbers) > 1 and None not in numbers:
        return numbers
    number = _as_number(text)
    return number if number is not None else text or None


def _as_number(text: str) -> float | None:
    """Return a finite number; None if it is none: others are no values of a probe file."""
    try:
        number = float(text.replace("−", "-"))
    except ValueError:
        return None
    return number if math.isfinite(number) else None


# --- opened, drawn and written --------------------------------------------------------------------


def opened(report: Report, name: str) -> Sections:
    """Return the sections of a probe file, or of the reference probe where none is named."""
    return read_sections(name) if name else Probe.reference().sections()


def _probe(sections: Sections, title: str) -> Probe:
    return Probe.from_sections(deepcopy(sections), title, Path())


def written(report: Report, sections: Sections, title: str) -> str:
    """Return the text of the probe file; layers of a drawing stay named, not as their outlines.

    Raises
    ------
    InputError
        If it is no probe yet.
    """
    probe = _probe(sections, title)
    named = {name: sections[name] for name in SHAPE_SECTIONS[1:] if name in sections}
    return file_text(probe, {**probe.shape.sections(), **named}, probe.shape.description())


def drawn(report: Report, sections: Sections, title: str, mesh: bool) -> dict[str, Any]:
    """Return the drawing of a probe that is edited, or of what is wrong with it."""
    try:
        probe = _probe(sections, title)
    except InputError as error:
        return {"figure": svg(_wrong(error, sections)), "fault": str(error)}
    layout, triangles = probe.layout(), chosen_space(probe).mesh if mesh else None
    return {
        "figure": svg(figures.probe_drawing(layout, title, mesh=triangles)),
        "fault": "",
        "rows": [(part.name, part.part, f"{part.area:.4g} µm²") for part in layout.regions],
        "triangles": 0 if triangles is None else triangles.elements.nelements,
    }


def drawn_file(report: Report, sections: Sections, title: str, mesh: bool, suffix: str) -> bytes:
    """Return the drawing of a probe as the content of a file."""
    probe = _probe(sections, title)
    triangles = chosen_space(probe).mesh if mesh else None
    return figure_file(figures.probe_drawing(probe.layout(), title, mesh=triangles), suffix)


def svg(figure: Figure) -> str:
    """Return a figure as SVG."""
    return figure_file(figure, ".svg").decode("utf-8")


def figure_file(figure: Figure, suffix: str) -> bytes:
    """Return a figure as the content of a file."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, f"figure{suffix}")
        figures.save_figure(figure, path)
        return path.read_bytes()


def _wrong(error: InputError, sections: Sections) -> Figure:
    """Draw what is wrong with the drawing of a probe, or with the dimensions of its shape.

    Raises
    ------
    InputError
        If neither has a place in a picture.
    """
    fault = str(error)
    if isinstance(error, DrawingError):
        return figures.outlines_drawing(error.outlines, fault=fault, fault_at=error.place)
    try:
        return _impossible(sections["probe"], fault)
    # a section may hold anything
    except (InputError, ArithmeticError, AttributeError, LookupError, TypeError, ValueError):
        raise error from None


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
    # no part of a drawing of a probe lies beyond (µm)
    if not np.abs([region.rings[0] for region in regions]).max() < 1e5:
        raise ValueError(fault)
    parts = {word.partition("_")[0] for word in words}
    wrong = next((region for region in regions if region.name.partition(" ")[0] in parts), None)
    fault_at = None if wrong is None else np.mean(wrong.rings[0], axis=0).tolist()
    outlines = {region.name: region.rings for region in regions}
    return figures.outlines_drawing(outlines, fault=fault, fault_at=fault_at)


# --- what can be set ------------------------------------------------------------------------------


def settable(report: Report, sections: Sections) -> dict[str, Any]:
    """Return what can be set of a probe: layers, materials, dimensions, tip and circuit.

    Nothing, if it is none that could be edited so.
    """
    parts = {name: sections.get(name, {}) for name in ("probe", "layers", "terminals", "materials")}
    if not all(isinstance(part, dict) for part in (*parts.values(), *parts["materials"].values())):
        return {}
    shape = str(parts["probe"].get("shape"))
    cards = [_card(("materials", name), section) for name, section in parts["materials"].items()]
    return {
        "layers": _rows(parts) if shape == "drawing" else [],
        "materials": list(parts["materials"]),
        "cards": [_other(name, sections.get(name, {}), own) for name, own in _others(shape)]
        + cards,
        "new": _new_materials(),
    }


def _rows(sections: Mapping[str, Any]) -> list[LayerRow]:
    rows = []
    for part in ("layers", "terminals"):
        for name, entry in sections[part].items():
            outlines = _drawn_in(entry)
            words = outlines if isinstance(outlines, str) else f"{name} (points)"
            inner = entry if isinstance(entry, dict) else {}
            rows.append(LayerRow(words, outlines, part, name, str(inner.get("material", ""))))
    probe = sections["probe"]
    if isinstance(file := probe.get("file"), str):
        used = {row.label for row in rows}
        path = Path(file)
        try:
            arguments = path, file_stamp(path), probe.get("cell"), probe.get("unit_um")
            rows += [LayerRow(name, name) for name in _layers(*arguments) if name not in used]
        except InputError:
            pass  # the drawing of the probe says what is wrong
    return sorted(rows, key=lambda row: row.part or "z")[:40]


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
    if shape == "drawing":
        meanings = DrawnShape.description()
        yield "probe", {key: meanings[key] for key in ("thickness_um", "tip_um")}
    elif shape in PARAMETRIC:
        yield "probe", PARAMETRIC[shape].description()
    meanings = Circuit.description()
    yield "circuit", {key: meanings[key] for key in ("series_resistance_ohm", "base_temperature_K")}


def _other(name: str, section: Mapping[str, Any], meanings: Mapping[str, str]) -> dict[str, Any]:
    """Return the numbers of a section that is no material."""
    fields = []
    for key, words in meanings.items():
        unit, default = parameter_named(key).unit, _number(getattr(Circuit(), key, ""))
        own = _field((name,), key, section, default, f"{label(key)}: {words} ({unit})")
        fields.append({**own, "label": f"{label(key)} ({unit})"})
    title = "Circuit" if name == "circuit" else "The lever"
    return {"place": (name,), "title": title, "fields": fields}


def _card(place: tuple[str, ...], section: Mapping[str, Any]) -> dict[str, Any]:
    """Return the parameters of a material: of its kind, and those that formulas name."""
    kind = KINDS.get(str(section.get("kind")))
    words = [str(section.get(key)).replace("-", " ") for key in ("kind", "preset")]
    like = f", else as {words[1]}" if "preset" in section else ""
    card: dict[str, Any] = {"place": place, "title": f"{place[-1]}: {words[0]}{like}"}
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
    last = ("heat_capacity", "heat_capacity_scale", "emissivity", "melting_point_K")
    for key in sorted(kind.model_fields, key=lambda own: own in last):
        if key in ("kind", "preset"):
            continue
        field = kind.model_fields[key]
        default = usual.get(key, field.default if isinstance(field.default, float) else "")
        own = _field(place, key, section, _number(default), field.description or "")
        fields.append({**own, "used": key not in useless or key in section or not values})
    named = names_stated({key: value for key, value in values.items() if key in STATED})
    for key in sorted({*named, *section} - kind.model_fields.keys()):
        fields.append(_field(place, key, section, "", f"{key}, a number in a formula"))
    return {**card, "fields": fields}


def _field(
    place: tuple[str, ...], key: str, section: Mapping[str, Any], default: str, meaning: str
) -> dict[str, Any]:
    value = section.get(key)
    if isinstance(value, list):
        value = ", ".join(map(_number, value))
    field = {"place": place, "key": key, "label": meaning, "meaning": meaning, "used": True}
    text = None if isinstance(value, dict) else "" if value is None else _number(value)
    return {**field, "default": default, "value": text}


def _number(value: Any) -> str:
    return f"{value:.12g}" if isinstance(value, int | float) else str(value)
