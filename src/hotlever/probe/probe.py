"""A probe, and the file that describes it."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Callable, Container, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import hotlever
from hotlever.errors import InputError, quoted, unknown_name
from hotlever.files import read_text, write_text
from hotlever.materials import HIGH_DOPED, LOW_DOPED, REFERENCE, Kind
from hotlever.materials.kinds import Silicon
from hotlever.materials.presets import classes_at_hand, materials_of, remade, without_preset
from hotlever.materials.stated import names_stated
from hotlever.probe.circuit import Contact
from hotlever.probe.parts import (
    PARTS,
    SECTIONS,
    Monitor,
    Monitors,
    PriorTexts,
    ProbeParts,
    with_values,
)
from hotlever.probe.priors import priors_of
from hotlever.probe.shapes import PARAMETRIC, SHAPE_SECTIONS, Shape, ThreeLeg, UShape
from hotlever.probe.surroundings import Physics
from hotlever.probe.tip import EXAMPLE
from hotlever.records import Record
from hotlever.spieser2017 import DOI
from hotlever.text import as_toml

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from hotlever.probe.drawing.kit import Drawing


class Probe(ProbeParts):
    """Shape, circuit, material, surroundings and tip of one lever: everything a solve needs.

    Without a `tip` the lever is flat, as in the paper. Priors count in fits and calibrations only.

    Examples
    --------
    >>> probe = Probe.reference()
    >>> probe.shape.length_um, probe.circuit.series_resistance_ohm
    (54.4, 5600.0)
    >>> probe.with_(n_d=4e17, series_resistance_ohm=0).material.n_d
    4e+17
    """

    @classmethod
    def reference(cls) -> Probe:
        """Return the reference probe: the three-legged lever that reproduces the paper.

        No drawing of it is public. Dimensions and series resistance are inferred: with the
        option-III parameters they give the published operating points.
        """
        return cls(shape=ThreeLeg.reference())

    @classmethod
    def u_shape(cls) -> Probe:
        """Return a two-legged lever with a heater like the reference probe's."""
        return cls(shape=UShape.reference())

    @classmethod
    def from_drawing(
        cls,
        drawing: Drawing | Callable[..., Drawing],
        materials: Mapping[str, Kind | Mapping[str, Any]] | None = None,
    ) -> Probe:
        """Make a probe of a drawing, or of a function that draws; see `hotlever.probe.drawing`.

        The function's arguments, in µm and with defaults, are the dimensions of the probe. The
        `materials` that layers are made of, by name, may be what sections of a probe file say.

        Raises
        ------
        InputError
            If what is drawn or stated is at fault.
        """
        from hotlever.probe.drawing.kit import sections_of

        where, sections = sections_of(drawing)
        return cls.from_sections({**sections, "materials": dict(materials or {})}, where, Path())

    @classmethod
    def coerce(cls, probe: Probe | str | os.PathLike[str]) -> Probe:
        """Return a probe as it is, or read one from a probe file.

        Raises
        ------
        InputError
            If it is neither, or the file is at fault.
        """
        if isinstance(probe, str | os.PathLike):
            return cls.from_file(probe)
        if not isinstance(probe, Probe):
            raise InputError(f"found {type(probe).__name__}, expected a Probe or a probe file")
        return probe

    @classmethod
    def from_sections(
        cls,
        values: dict[str, Any],
        where: str,
        folder: Path | None = None,
        like: Probe | None = None,
    ) -> Probe:
        """Make a probe of the sections of a probe file, by name.

        In errors `where` names the file, which names others relative to `folder`. Where a probe is
        given that this is to be `like`, shape and materials have the classes that they have there.

        Raises
        ------
        InputError
            Naming the section and key, what was found and what is expected.
        """
        probe = cls.from_values(_parts_of(values, where, folder, like), where)
        _check_together(probe, values, where)
        return probe

    @classmethod
    def from_file(cls, path: str | os.PathLike[str]) -> Probe:
        """Read a probe file (TOML).

        Sections left out, and material parameters left out, take the reference probe's values.

        Raises
        ------
        InputError
            If the file cannot be read or its content is at fault.
        """
        values = read_sections(path)
        return cls.from_sections(values, str(path), Path(path).parent)

    def with_(self, **changes: Any) -> Probe:
        """Return a copy with some values changed, each named by its key in a probe file.

        Keys may have their section before them (``**{"tip.height_um": 0.7}``). With another
        `shape`, dimensions that it does not have are left out.

        Raises
        ------
        InputError
            If a name exists in no section (the nearest one is given) or a value is impossible.
        """
        return Probe.from_sections(_changed_sections(self, changes), "probe", like=self)

    def with_material(self, section: str, material_class: type[Record], **values: Any) -> Probe:
        """Return the probe with a class of one's own for one of its materials.

        The `section` is its name, or ``material`` for the silicon of that section. The
        `material_class` is derived from its kind, see `hotlever.materials.kinds.Kind`, or from
        `hotlever.materials.Material`; the ``values`` are in its section in place of what it held.

        Raises
        ------
        InputError
            If there is no such material, or the class or a value is none for it.
        """
        plain = ["material"] if self.has_plain_silicon else []
        if section not in [*self.materials, *plain]:
            raise unknown_name("material", section, [*self.materials, *plain])
        if section == "material":
            changed: dict[str, Any] = {
                "material": remade(self.material, material_class, values, section)
            }
        else:
            new = remade(self.materials[section], material_class, values, section)
            changed = {"materials": {**self.materials, section: new}}
        return type(self).from_values({**dict(self), **changed}, "probe")

    def __repr__(self) -> str:
        # the probe file without its comments
        lines = (line.partition("#")[0].rstrip() for line in self.to_toml().splitlines())
        return "\n".join(filter(None, lines))

    __str__ = __repr__

    def in_medium(self, medium: str) -> Probe:
        """Return the probe in vacuum or in air.

        Raises
        ------
        InputError
            If the medium is neither.
        """
        return self.with_(medium=medium)

    def with_monitors(self, **monitors: Monitor | Mapping[str, Any]) -> Probe:
        """Return the probe with some monitors, by the names of their columns, beside its own.

        A mapping holds what ``[monitor.NAME]`` of a probe file does.

        Raises
        ------
        InputError
            If one is not on the lever (the nearest place is given), or its name is taken.

        Examples
        --------
        >>> probe = Probe.reference().with_monitors(spot={"point_um": (40, 0)})
        >>> print(probe.monitors["spot"])
        at (40, 0) µm
        """
        all_monitors = Monitors.from_values({**self.monitors, **monitors}, "monitors")
        all_monitors.check(self.layout(), "monitors")
        return self.model_copy(update={"monitor": all_monitors})

    def to_toml(self) -> str:
        """Return the probe as a commented probe file."""
        return file_text(self, self.shape.sections(), self.shape.description())

    def to_file(
        self, path: str | os.PathLike[str], drawing: str | os.PathLike[str] | None = None
    ) -> None:
        """Write the probe as a commented probe file, whole or not at all.

        With the path of a `drawing` what is drawn is written too, as GDSII, whose layers the probe
        file names; of the dimensions of its shape nothing can be said any more (`InputError`).
        """
        if drawing is None:
            return write_text(path, self.to_toml())
        from hotlever.probe.drawing.kit import drawn_shape
        from hotlever.probe.drawing.shape import save_drawing

        drawn = drawn_shape(self.shape)
        # of a drawing less may be said, such as what is known of its dimensions
        Probe.from_sections({**self.sections(), **drawn.sections()}, str(path), like=self)
        sections = save_drawing(drawn, drawing, Path(path).parent)
        return write_text(path, file_text(self, sections, drawn.description()))

    def draw(self, title: str = "") -> Figure:
        """Return a figure of the probe from above, with its heater, terminals and tip."""
        figure: Figure = hotlever.figures.probe_drawing(self.layout(), title)
        return figure


# --- the file: its sections read, changed by the names of their values, and written ---------------


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


def _parts_of(
    values: Mapping[str, Any], where: str, folder: Path | None, like: ProbeParts | None
) -> dict[str, Any]:
    """Make the parts of a probe, each for itself, of the sections of a probe file.

    Parameters
    ----------
    values : mapping
        Sections by name.
    where, folder, like
        See `Probe.from_sections`.

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
        from hotlever.probe.drawing.kit import ParametricDrawing

        drawn = None if like is None else like.shape
        own = type(drawn) if isinstance(drawn, ParametricDrawing) else ParametricDrawing
        return own.read(values, where, kinds)
    return PARAMETRIC[name].from_values(values, here)


def _check_together(probe: ProbeParts, stated: Mapping[str, Any], where: str) -> None:
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


def _changed_sections(probe: ProbeParts, changes: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
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
        stated = {own for where, own in keys.values() if where == section}
        if key == "preset" and value is not None:
            inside[last] = without_preset(inside[last], stated)
        inside[last][key] = value
        if section in probe.materials:
            inside[last] = type(probe.materials[section]).useful(inside[last], stated)
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
