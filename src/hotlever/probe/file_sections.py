"""Probe files: their sections read, changed by the names of their values, and written."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Container, Mapping
from pathlib import Path
from typing import Any

from hotlever.errors import InputError, quoted, unknown_name
from hotlever.files import read_text
from hotlever.materials import HIGH_DOPED, LOW_DOPED, REFERENCE, Kind
from hotlever.materials.kinds import Silicon
from hotlever.materials.sections import classes_at_hand, materials_of
from hotlever.materials.stated import names_stated
from hotlever.probe.circuit import Contact
from hotlever.probe.parts import (
    PARTS,
    SECTIONS,
    PriorTexts,
    ProbeParts,
    with_values,
)
from hotlever.probe.priors import priors_of
from hotlever.probe.shapes import (
    PARAMETRIC,
    SHAPE_SECTIONS,
    Shape,
    ThreeLeg,
)
from hotlever.probe.surroundings import Physics
from hotlever.probe.tip import EXAMPLE
from hotlever.records import Record
from hotlever.spieser2017 import DOI
from hotlever.text import as_toml


def read_sections(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Read a probe file (TOML).

    Raises
    ------
    InputError
        If the file cannot be read or is not TOML.
    """
    text = read_text(path, largest=1_000_000)
    for number, line in enumerate(text.splitlines(), start=1):
        # a key of thousands of parts takes gigabytes to read
        if len(line) > 1000:
            raise InputError(
                f"{path}: line {number}: {len(line)} characters, expected at most 1000"
            )
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise InputError(f"{path}: not valid TOML: nested too deeply") from None
    except ValueError as error:
        # a number of thousands of digits is a ValueError too
        reason = str(error).partition(";")[0]
        raise InputError(f"{path}: not valid TOML: {reason}") from None


def parts_of(
    values: Mapping[str, Any], where: str, folder: Path | None, like: ProbeParts | None
) -> dict[str, Any]:
    """Make the parts of a probe, each for itself, of the sections of a probe file.

    Parameters
    ----------
    values : mapping
        Sections by name.
    where, folder, like
        See `hotlever.probe.probe.Probe.from_sections`.

    Raises
    ------
    InputError
        Naming the section and key, what was found and what is expected.
    """
    classes = classes_at_hand(values.get("laws", {}), where) if like is None else like.classes
    values = {name: section for name, section in values.items() if name != "laws"}
    for name, section in values.items():
        if name not in SECTIONS:
            raise unknown_name("section", name, SECTIONS, where)
        if not isinstance(section, dict):
            raise InputError(f"{where}: [{name}] must be a section, found {quoted(section)}")
    if "probe" not in values:
        raise InputError(f"{where}: section [probe] is missing")
    materials = materials_of(values.get("materials", {}), where, SECTIONS, folder, classes)
    kinds = {name: kind.kind for name, kind in materials.items()}
    shape = _shape_of(values, where, folder, kinds, like)
    for name in materials:
        if name not in shape.materials:
            raise InputError(
                f"{where}: [materials.{name}]: no layer is made of it, expected [layers.…] "
                f'with material = "{name}"'
            )
    by_thickness = _other_thickness(shape)
    for name, section in values.get("materials", {}).items():
        kind = materials[name]
        stated = isinstance(section, Kind) or "c_kappa" in section
        if isinstance(kind, Silicon) and name in by_thickness and not stated:
            materials[name] = kind.model_copy(update={"c_kappa": "thickness"})
    parts: dict[str, Any] = {"shape": shape, "materials": materials}
    usual = REFERENCE
    if not by_thickness.isdisjoint({LOW_DOPED, HIGH_DOPED}):
        usual = REFERENCE.model_copy(update={"c_kappa": "thickness"})
        parts["material"] = usual
    for name in (name for name in PARTS if name in values):
        own = usual.model_dump() if name == "material" else {}
        record_class = classes.get(name, PARTS[name])
        parts[name] = record_class.from_values({**own, **values[name]}, f"{where}: [{name}]")
    return parts


def _other_thickness(shape: Shape) -> set[str]:
    """Return the materials that some layer is of with another thickness than the paper's levers.

    The scale of κ that these have says nothing of it, so that κ of silicon follows from it.
    """
    layout = shape.layout()
    return {
        film.material
        for region in layout.regions
        for film in region.stack
        if (film.thickness_um or layout.thickness_um) != ThreeLeg.reference().thickness_um
    }


def _shape_of(
    sections: Mapping[str, Any],
    where: str,
    folder: Path | None,
    kinds: Mapping[str, str],
    like: ProbeParts | None,
) -> Shape:
    """Make the shape that some sections of a probe file describe; `kinds` are of its materials."""
    values, here = sections["probe"], f"{where}: [probe]"
    name, shapes = values.get("shape"), (*PARAMETRIC, "drawing")
    if name is None:
        raise InputError(f"{here}: shape is missing (one of: {', '.join(shapes)})")
    if not isinstance(name, str) or name not in (*shapes, "parametric-drawing"):
        raise unknown_name("shape", str(name), shapes, here)
    if name == "drawing":
        # imported here: most probes are drawn by their dimensions
        from hotlever.probe.drawing.shape import DrawnShape

        return DrawnShape.read(sections, where, folder, kinds)
    for section in SHAPE_SECTIONS[1:]:
        if section in sections:
            raise InputError(f'{where}: section [{section}] means nothing with shape = "{name}"')
    if name == "parametric-drawing":
        from hotlever.probe.drawing.parametric import ParametricDrawing

        drawn = None if like is None else like.shape
        own = type(drawn) if isinstance(drawn, ParametricDrawing) else ParametricDrawing
        return own.read(values, where, kinds)
    return PARAMETRIC[name].from_values(values, here)


def check_together(probe: ProbeParts, stated: Mapping[str, Any], where: str) -> None:
    """Refuse sections that do not fit the others; those `stated` are by name.

    Raises
    ------
    InputError
        Naming the section, what was found and what is expected.
    """
    layout = probe.layout()
    probe.circuit.check(layout.terminal_names, probe.surroundings.medium, where)
    if "material" in stated and not probe.has_plain_silicon:
        raise InputError(
            f"{where}: [material]: no layer is made of it, expected no "
            "such section, or a layer without a material of its own"
        )
    if probe.monitor is not None:
        probe.monitor.check(layout, f"{where}: [monitor]")
    if probe.prior is not None:
        for name in probe.prior.model_extra or {}:
            # what has two names is said by one of them
            full = probe.shape.named(name)
            if full != name and full in (probe.prior.model_extra or {}):
                raise InputError(f"{where}: [prior]: {name}: expected {full} alone, it is the same")
    priors_of(probe.stated_priors, probe, f"{where}: [prior]")


# --- by name --------------------------------------------------------------------------------------


def field_of(probe: ProbeParts, name: str) -> tuple[str, str, type[Record]]:
    """Return section, key and record of a name such as ``n_d`` or ``tip.height_um``.

    Raises
    ------
    InputError
        If it is no key of a probe file; the nearest one is given.
    """
    name = probe.shape.named(name)
    section, dot, key = name.rpartition(".")
    if dot and name in probe.shape.dimensions():
        section = f"layers.{section}"
    named = {material: type(kind) for material, kind in probe.materials.items()}
    wired = {f"circuit.{name}": Contact for name in probe.layout().terminal_names}
    records: dict[str, type[Record]] = {
        "probe": type(probe.shape),
        **named,
        **PARTS,
        "material": type(probe.material),
        **wired,
        **{f"layers.{layer}": record for layer, record in probe.shape.layer_records().items()},
    }
    if dot and section not in records:
        raise unknown_name("section", section, [*SECTIONS, *named, *wired])
    keys = {part: [*record.model_fields] for part, record in records.items()}
    # and the numbers that formulas name
    for material, kind in probe.materials.items():
        keys[material] += kind.model_extra or {}
    # in [probe] those of all shapes, its own first
    keys["probe"] += [key for shape in PARAMETRIC.values() for key in shape.model_fields]
    own = [part for part in PARTS if getattr(probe, part)]
    # those of a named material have its name before them
    for part in [section] if dot else ["probe", *own, *PARTS]:
        if part == "material" and not probe.has_plain_silicon:
            continue
        if key in keys[part] or (dot and records[part] is PriorTexts):
            return part, key, records[part]
    # a prior has the name of what it is of
    dotted = {*named, *wired}
    if not probe.has_plain_silicon:
        del keys["material"]
    full = [f"{part}.{key}" if part in dotted else key for part in keys for key in keys[part]]
    choices = keys[section] if dot else full
    raise unknown_name("name", key, dict.fromkeys(choices))


def changed_sections(probe: ProbeParts, changes: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return the sections of a probe with some values changed, each named as in `field_of`.

    Raises
    ------
    InputError
        If a name exists in no section, or counts while a drawing is read only.
    """
    changes = {probe.shape.named(name): value for name, value in changes.items()}
    sections = probe.sections()
    # numbers that formulas name are keys too
    named = {
        f"{section}.{own}": (section, own)
        for name, value in changes.items()
        for section in [name.rpartition(".")[0]]
        if section in probe.materials
        for own in names_stated({name: value})
    }
    keys = {name: named.get(name) or field_of(probe, name)[:2] for name in changes}
    for name, value in changes.items():
        section, key = keys[name]
        if key in probe.shape.read_with:
            raise InputError(f"{name} counts when a drawing is read, expected it in the probe file")
        inside, (*above, last) = sections, section.split(".")
        for part in ["materials"] if section in probe.materials else above:
            inside = inside.setdefault(part, {})
        if not isinstance(inside.setdefault(last, {}), Mapping):
            # a layer of which no more was said than where it is drawn
            inside[last] = {"drawn": inside[last]}
        inside[last][key] = value
        if section in probe.materials:
            kind, stated = type(probe.materials[section]), {own for _, own in keys.values()}
            inside[last] = kind.useful(inside[last], stated)
    sections = {name: with_values(section) for name, section in sections.items()}
    shape = PARAMETRIC.get(str(sections["probe"]["shape"]))
    if shape is not None and not isinstance(probe.shape, shape):
        own = sections["probe"].items()
        sections["probe"] = {key: value for key, value in own if key in shape.model_fields}
    return sections


# --- as text --------------------------------------------------------------------------------------


def section_lines(
    name: str,
    section: Mapping[str, Any],
    meaning: Mapping[str, str],
    *,
    optional: bool = False,
    start: str = "",
) -> list[str]:
    """Return the lines of a section, after an empty one, each with what its value is.

    Keys that have no value are left out, or with `optional` named in a comment. Sections inside it
    come last. The `start` of each line may make all of it a comment.
    """
    inner = {key: value for key, value in section.items() if isinstance(value, Mapping)}
    lines = [] if inner and len(inner) == len(section) else ["", f"{start}[{name}]"]
    for key, value in section.items():
        if key in inner or (value is None and not optional):
            continue
        written = f"{value:.12g}" if isinstance(value, float) else as_toml(value)
        entry = f"# {key} =" if value is None else f"{start}{key} = {written}"
        lines.append(f"{entry:<30}  # {meaning[key]}" if meaning.get(key) else entry)
    for key, values in inner.items():
        lines += section_lines(f"{name}.{key}", values, {})
    return lines


def file_text(probe: ProbeParts, shape: Mapping[str, Any], meaning: Mapping[str, str]) -> str:
    """Return the probe file of a probe.

    Parameters
    ----------
    probe : ProbeParts
    shape : mapping
        The sections of its shape.
    meaning : mapping of str to str
        What the values of these are, by key.
    """
    lines = ["# A hotlever probe file: lengths in µm, temperatures in K."]
    if shape == ThreeLeg.reference().sections():
        lines += [
            "# The reference probe. No drawing of the published lever exists: these dimensions",
            f"# are inferred from the operating points in doi:{DOI}.",
        ]
    for name, section in shape.items():
        lines += section_lines(name, section, meaning)
    return "\n".join(lines) + "\n" + other_sections(probe)


def other_sections(probe: ProbeParts, without: Container[str] = ()) -> str:
    """Return the sections of a probe's file beside those of its shape, some of them left out."""
    lines = []
    named = {f"materials.{name}": kind for name, kind in probe.materials.items()}
    for name, part in (named | probe.parts).items():
        if name in without:
            continue
        lines += section_lines(name, part.model_dump(), part.description(), optional=True)
    if probe.tip is None:
        lines += ["", "# Without a section [tip] the lever is flat. A cone under the heater:"]
        values, meaning = EXAMPLE.model_dump(), EXAMPLE.description()
        lines += section_lines("tip", values, meaning, start="# ")[1:]
    if not probe.physics:
        lines += ["", "# Without a section [physics] the physics is the paper's. Beyond it:"]
        effects = dict.fromkeys(Physics.model_fields, True)
        lines += section_lines("physics", effects, Physics.description(), start="# ")[1:]
    if probe.laws:
        lines += section_lines("laws", probe.laws, {})
    return "\n".join(lines) + "\n"
