"""A probe, and the file that describes it: its sections read, checked and written."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hotlever.errors import InputError, quoted, unknown_name
from hotlever.files import read_text, write_text
from hotlever.materials import REFERENCE, Kind
from hotlever.materials.sections import LAWS, materials_of, own_laws, refuse_own_laws
from hotlever.probe.parts import MATERIALS, PARTS, SECTIONS, ProbeParts
from hotlever.probe.physics import Physics
from hotlever.probe.priors import priors_of
from hotlever.probe.shapes import (
    DRAWING,
    PARAMETRIC,
    PARAMETRIC_DRAWING,
    SHAPE_SECTIONS,
    SHAPES,
    Shape,
    ThreeLeg,
    UShape,
)
from hotlever.probe.tip import Tip
from hotlever.records import Record
from hotlever.spieser2017 import DOI
from hotlever.text import as_toml

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from hotlever.probe.drawing.kit import Drawing

#: Bytes that a probe file may have, and characters of a line: a key of thousands of parts takes
#: gigabytes to read.
_LARGEST, _LONGEST_LINE = 1_000_000, 1000
_HEADING = "# A hotlever probe file: lengths in µm, temperatures in K."
#: Column in which comments begin.
_COMMENTS = 32


class Probe(ProbeParts):
    """Shape, circuit, material, surroundings and tip of one lever: everything a solve needs.

    Without a `tip` the lever is flat, as in the paper. What is known of it before it is measured
    counts in fits and calibrations only.

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

        No drawing of the paper's lever is public. These dimensions and the series resistance
        are inferred: with the option-III parameters they give the published operating points.
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
        """Make a probe of what is drawn in Python; see `hotlever.probe.drawing`.

        Parameters
        ----------
        drawing : Drawing or callable
            Or a function that returns one. Its arguments, in µm and with defaults, are then the
            dimensions of the probe.
        materials : mapping of str to Kind or mapping, optional
            Those that layers are made of, by name; or what a section of a probe file would say.

        Raises
        ------
        InputError
            If what is drawn or stated is at fault.
        """
        from hotlever.probe.drawing.parametric import sections_of

        where, sections = sections_of(drawing)
        return cls.from_sections({**sections, MATERIALS: dict(materials or {})}, where, Path())

    @classmethod
    def coerce(cls, probe: Probe | str | os.PathLike[str]) -> Probe:
        """Return a probe as it is, or read one from a probe file.

        Raises
        ------
        InputError
            If it is neither, or the file is at fault.
        """
        if isinstance(probe, Probe):
            return probe
        if isinstance(probe, str | os.PathLike):
            return cls.from_file(probe)
        raise InputError(f"found {type(probe).__name__}, expected a Probe or a probe file")

    @classmethod
    def from_sections(
        cls,
        values: dict[str, Any],
        where: str,
        folder: Path | None = None,
        like: Probe | None = None,
    ) -> Probe:
        """Make a probe of the sections of a probe file.

        Parameters
        ----------
        values : dict
            Sections by name.
        where : str
            Names the file in an error.
        folder : path, optional
            What names of files, of a drawing and of tables, are relative to.
        like : Probe, optional
            One whose materials of the same names have the classes that these are to have.

        Raises
        ------
        InputError
            Naming the section and key, what was found and what is expected.
        """
        refuse_own_laws(values, where)
        for name, section in values.items():
            if name not in SECTIONS:
                raise unknown_name("section", name, SECTIONS, where)
            if not isinstance(section, dict):
                raise InputError(f"{where}: [{name}] must be a section, found {quoted(section)}")
        if "probe" not in values:
            raise InputError(f"{where}: section [probe] is missing")
        before = None if like is None else like.materials
        materials = materials_of(values.get(MATERIALS, {}), where, SECTIONS, folder, before)
        drawn = {name: values[name] for name in SHAPE_SECTIONS if name in values}
        shape = shape_of(drawn, where, folder, materials, None if like is None else like.shape)
        for name in materials:
            if name not in shape.materials:
                raise InputError(
                    f"{where}: [{MATERIALS}.{name}]: no layer is made of it, expected [layers.…] "
                    f'with material = "{name}"'
                )
        parts: dict[str, Any] = {"shape": shape, MATERIALS: materials}
        usual = {"material": REFERENCE.model_dump()}
        for name, part in PARTS.items():
            if name == "material" and like is not None:
                part = type(like.material)
            if name in values:
                section = {**usual.get(name, {}), **values[name]}
                parts[name] = part.from_values(section, f"{where}: [{name}]")
        probe = cls.from_values(parts, where)
        probe.circuit.check(probe.layout().terminal_names, probe.surroundings.medium, where)
        if "material" in values and not probe.has_plain_silicon:
            raise InputError(
                f"{where}: [material]: no layer is made of it, expected no "
                "such section, or a layer without a material of its own"
            )
        priors_of(probe.stated_priors, probe, f"{where}: [prior]")
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

    @property
    def _records(self) -> dict[str, Record]:
        """What it consists of, beside the shape, by the section of its file."""
        named = {f"{MATERIALS}.{name}": kind for name, kind in self.materials.items()}
        return named | self.parts

    def sections(self) -> dict[str, dict[str, Any]]:
        """Return the sections as plain values: what `from_sections` takes, or refuses."""
        sections: dict[str, dict[str, Any]] = self.shape.sections()
        if self.materials:
            sections[MATERIALS] = {name: kind.model_dump() for name, kind in self.materials.items()}
        sections |= {name: part.model_dump() for name, part in self.parts.items()}
        if laws := own_laws(self.made_of):
            sections[LAWS] = laws
        return {name: with_values(section) for name, section in sections.items()}

    def with_(self, **changes: Any) -> Probe:
        """Return a copy with some values changed, each named by its key in a probe file.

        Keys may have their section before them (``**{"tip.height_um": 0.7}``). With another
        `shape`, dimensions that it does not have are left out.

        Raises
        ------
        InputError
            If a name exists in no section (the nearest one is given) or a value is impossible.
        """
        sections = self.sections()
        sections.pop(LAWS, None)
        for name, value in changes.items():
            section, key, _ = self.field(name)
            if key in self.shape.read_with:
                raise InputError(
                    f"{name} counts when a drawing is read, expected it in the probe file"
                )
            inside, (*above, last) = sections, section.split(".")
            for part in [MATERIALS] if section in self.materials else above:
                inside = inside.setdefault(part, {})
            inside.setdefault(last, {})[key] = value
            if section in self.materials:
                useless = type(self.materials[section]).without_use(inside[last])
                for other in {*useless} - {own for _, own, _ in map(self.field, changes)}:
                    inside[last].pop(other, None)
        sections = {name: with_values(section) for name, section in sections.items()}
        shape = PARAMETRIC.get(str(sections["probe"]["shape"]))
        if shape is not None and not isinstance(self.shape, shape):
            own = sections["probe"].items()
            sections["probe"] = {key: value for key, value in own if key in shape.model_fields}
        return Probe.from_sections(sections, "probe", like=self)

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

    def with_physics(self, effects: Iterable[str], where: str = "physics") -> Probe:
        """Return the probe with some effects beyond the paper, and no others.

        Raises
        ------
        InputError
            If there is no such effect.
        """
        return self.model_copy(update={"physics": Physics.of(effects, where)})

    def to_toml(self) -> str:
        """Return the probe as a commented probe file."""
        lines = [_HEADING]
        if self.shape == Probe.reference().shape:
            lines.append(
                "# The reference probe. No drawing of the published lever exists: these dimensions"
                f"\n# are inferred from the operating points in doi:{DOI}."
            )
        return self._text(lines, self.shape.sections(), self.shape.description())

    def _text(self, lines: list[str], shape: Mapping[str, Any], meaning: Mapping[str, str]) -> str:
        """Return a probe file with some lines above the sections of its shape."""
        for name, section in shape.items():
            lines += section_lines(name, section, meaning)
        return "\n".join(lines) + "\n" + self.other_sections()

    def other_sections(self) -> str:
        """Return the sections of its file beside those of its shape."""
        lines = []
        for name, part in self._records.items():
            lines += section_lines(name, part.model_dump(), part.description(), optional=True)
        if self.tip is None:
            example = Tip(height_um=0.7, half_angle_deg=20, apex_radius_um=0.02)
            lines += ["", "# Without a section [tip] the lever is flat. A cone under the heater:"]
            values, meaning = example.model_dump(), example.description()
            lines += section_lines("tip", values, meaning, start="# ")[1:]
        if not self.physics:
            lines += ["", "# Without a section [physics] the physics is the paper's. Beyond it:"]
            effects = dict.fromkeys(Physics.model_fields, True)
            lines += section_lines("physics", effects, Physics.description(), start="# ")[1:]
        if laws := own_laws(self.made_of):
            lines += section_lines(LAWS, laws, {})
        return "\n".join(lines) + "\n"

    def to_file(
        self, path: str | os.PathLike[str], drawing: str | os.PathLike[str] | None = None
    ) -> None:
        """Write the probe as a commented probe file, whole or not at all.

        Parameters
        ----------
        path : path
        drawing : path, optional
            Write what is drawn of it too, as GDSII: the probe file names its layers. That of a
            shape of dimensions is then a drawing, whose dimensions are those of the shape now.
        """
        if drawing is None:
            return write_text(path, self.to_toml())
        from hotlever.probe.drawing.saving import save_drawing
        from hotlever.probe.drawing.shape import DrawnShape

        shape = save_drawing(self.shape, drawing, Path(path).parent)
        return write_text(path, self._text([_HEADING], shape, DrawnShape.description()))

    def draw(self, title: str = "") -> Figure:
        """Return a figure of the probe from above, with its heater, terminals and tip."""
        # figures stand above probes: they are the package's to find
        from hotlever import figures

        return figures.probe_drawing(self.layout(), title)


# --- sections of probe files ----------------------------------------------------------------------


def read_sections(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Read a probe file (TOML).

    Raises
    ------
    InputError
        If the file cannot be read or is not TOML.
    """
    return sections_of(read_text(path, largest=_LARGEST), str(path))


def sections_of(text: str, path: str) -> dict[str, Any]:
    """Return the sections of the text of a probe file; `path` names it in an error.

    Raises
    ------
    InputError
        If it is not TOML.
    """
    for number, line in enumerate(text.splitlines(), start=1):
        if len(line) > _LONGEST_LINE:
            raise InputError(
                f"{path}: line {number}: {len(line)} characters, expected at most {_LONGEST_LINE}"
            )
    try:
        values = tomllib.loads(text)
    except RecursionError:
        raise InputError(f"{path}: not valid TOML: nested too deeply") from None
    except ValueError as error:
        # a number of thousands of digits is a ValueError too
        reason = str(error).partition(";")[0]
        raise InputError(f"{path}: not valid TOML: {reason}") from None
    return values


def with_values(section: Mapping[str, Any]) -> dict[str, Any]:
    """Return a section without the keys that have no value."""
    return {
        key: with_values(value) if isinstance(value, Mapping) else value
        for key, value in section.items()
        if value is not None
    }


def commented(entry: str, text: str | None) -> str:
    """Return a line of a probe file with a comment, if there is one."""
    return f"{entry:<{_COMMENTS - 2}}  # {text}" if text else entry


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
        lines.append(commented(entry, meaning.get(key)))
    for key, values in inner.items():
        lines += section_lines(f"{name}.{key}", values, {})
    return lines


def shape_of(
    sections: Mapping[str, Any],
    where: str,
    folder: Path | None = None,
    materials: Mapping[str, Kind] | None = None,
    like: Shape | None = None,
) -> Shape:
    """Make the shape that some sections of a probe file describe.

    Parameters
    ----------
    sections : mapping
        ``[probe]``, and ``[layers]`` and ``[terminals]`` of a drawing.
    where : str
        Names the file in an error.
    folder : path, optional
        What the name of a drawing's file is relative to.
    materials : mapping of str to Kind, optional
        Those that the layers of a drawing may be made of.
    like : Shape, optional
        One whose class it is to have, if both are drawn by one function.

    Raises
    ------
    InputError
        If the shape is unknown, a dimension is missing, misspelt or impossible, or a drawing is
        at fault.
    """
    values, here = sections["probe"], f"{where}: [probe]"
    name = values.get("shape")
    if name is None:
        raise InputError(f"{here}: shape is missing (one of: {', '.join(SHAPES)})")
    if not isinstance(name, str) or name not in (*SHAPES, PARAMETRIC_DRAWING):
        raise unknown_name("shape", str(name), SHAPES, here)
    kinds = {of: kind.kind for of, kind in (materials or {}).items()}
    if name == DRAWING:
        # imported here: most probes are drawn by their dimensions
        from hotlever.probe.drawing.shape import DrawnShape

        return DrawnShape.read(sections, where, folder, kinds)
    for section in SHAPE_SECTIONS[1:]:
        if section in sections:
            raise InputError(f'{where}: section [{section}] means nothing with shape = "{name}"')
    if name == PARAMETRIC_DRAWING:
        from hotlever.probe.drawing.parametric import ParametricDrawing

        own = type(like) if isinstance(like, ParametricDrawing) else ParametricDrawing
        return own.read(values, where, kinds)
    return PARAMETRIC[name].from_values(values, here)
