"""A probe, and the file that describes it."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hotlever import plotting
from hotlever.errors import InputError, quoted, unknown_name
from hotlever.files import write_text
from hotlever.materials import KINDS, REFERENCE, Kind, Material
from hotlever.materials.sections import LAWS, classes_at_hand, material_of, materials_of
from hotlever.materials.stated import names_stated
from hotlever.probe.file_sections import file_text, read_sections, shape_of, with_values
from hotlever.probe.monitors import Monitor, Monitors
from hotlever.probe.parts import MATERIAL, MATERIALS, PARTS, SECTIONS, ProbeParts
from hotlever.probe.physics import Physics
from hotlever.probe.priors import priors_of
from hotlever.probe.shapes import PARAMETRIC, SHAPE_SECTIONS, ThreeLeg, UShape
from hotlever.records import Record
from hotlever.spieser2017 import DOI

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from hotlever.probe.drawing.kit import Drawing


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
        classes = classes_at_hand(values.get(LAWS, {}), where) if like is None else like.classes
        values = {name: section for name, section in values.items() if name != LAWS}
        for name, section in values.items():
            if name not in SECTIONS:
                raise unknown_name("section", name, SECTIONS, where)
            if not isinstance(section, dict):
                raise InputError(f"{where}: [{name}] must be a section, found {quoted(section)}")
        if "probe" not in values:
            raise InputError(f"{where}: section [probe] is missing")
        materials = materials_of(values.get(MATERIALS, {}), where, SECTIONS, folder, classes)
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
            if name in values:
                part = classes.get(name, part)
                section = {**usual.get(name, {}), **values[name]}
                parts[name] = part.from_values(section, f"{where}: [{name}]")
        probe = cls.from_values(parts, where)
        probe.circuit.check(probe.layout().terminal_names, probe.surroundings.medium, where)
        if "material" in values and not probe.has_plain_silicon:
            raise InputError(
                f"{where}: [material]: no layer is made of it, expected no "
                "such section, or a layer without a material of its own"
            )
        if probe.monitor is not None:
            probe.monitor.check(probe.layout(), f"{where}: [monitor]")
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

    def sections(self) -> dict[str, dict[str, Any]]:
        """Return the sections as plain values: what `from_sections` takes, or refuses."""
        sections: dict[str, dict[str, Any]] = self.shape.sections()
        if self.materials:
            sections[MATERIALS] = {name: kind.model_dump() for name, kind in self.materials.items()}
        sections |= {name: part.model_dump() for name, part in self.parts.items()}
        if self.laws:
            sections[LAWS] = dict(self.laws)
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
        named = {
            f"{section}.{own}": (section, own)
            for name, value in changes.items()
            for section in [name.rpartition(".")[0]]
            if section in self.materials
            for own in names_stated({name: value})
        }
        keys = {name: named.get(name) or self.field(name)[:2] for name in changes}
        for name, value in changes.items():
            section, key = keys[name]
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
                for other in {*useless} - {own for _, own in keys.values()}:
                    inside[last].pop(other, None)
        sections = {name: with_values(section) for name, section in sections.items()}
        shape = PARAMETRIC.get(str(sections["probe"]["shape"]))
        if shape is not None and not isinstance(self.shape, shape):
            own = sections["probe"].items()
            sections["probe"] = {key: value for key, value in own if key in shape.model_fields}
        return Probe.from_sections(sections, "probe", like=self)

    def with_material(self, section: str, made: type[Record], **values: Any) -> Probe:
        """Return the probe with a class of one's own for one of its materials.

        Parameters
        ----------
        section : str
            Name of the material, or ``material``, the silicon of that section.
        made : type
            A class made of the material's kind, see `hotlever.materials.kind.Kind`, or of
            `hotlever.materials.Material`.
        values : float, str or dict
            What its section holds in place of what it held.

        Raises
        ------
        InputError
            If there is no such material, or the class or a value is none for it.
        """
        plain = [MATERIAL] if self.has_plain_silicon else []
        if section not in [*self.materials, *plain]:
            raise unknown_name("material", section, [*self.materials, *plain])
        before = self.material if section == MATERIAL else self.materials[section]
        base = KINDS[before.kind] if isinstance(before, Kind) else Material
        if not issubclass(made, base):
            raise InputError(
                f"{section}: found {made.__name__}, expected a class made of {base.__name__}"
            )
        own, here = {**with_values(before.model_dump()), **values}, f"[{section}]"
        parts = dict(self)
        if issubclass(made, Kind):
            useless = {*made.without_use(own)} - values.keys()
            own = {name: value for name, value in own.items() if name not in useless}
            parts[MATERIALS] = {**self.materials, section: material_of(own, here, made=made)}
        else:
            parts[MATERIAL] = made.from_values(own, here)
        return type(self).from_values(parts, "probe")

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

    def with_monitors(self, **monitors: Monitor | Mapping[str, Any]) -> Probe:
        """Return the probe with some monitors beside those that it has.

        Parameters
        ----------
        **monitors : Monitor or mapping
            By name, which heads its columns; a mapping holds what ``[monitor.NAME]`` of a probe
            file does.

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
        made = Monitors.from_values({**self.monitors, **monitors}, "monitors")
        made.check(self.layout(), "monitors")
        return self.model_copy(update={"monitor": made})

    def to_toml(self) -> str:
        """Return the probe as a commented probe file."""
        heading = ""
        if self.shape == Probe.reference().shape:
            heading = (
                "# The reference probe. No drawing of the published lever exists: these dimensions"
                f"\n# are inferred from the operating points in doi:{DOI}.\n"
            )
        return file_text(self, self.shape.sections(), self.shape.description(), heading)

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
        return write_text(path, file_text(self, shape, DrawnShape.description()))

    def draw(self, title: str = "") -> Figure:
        """Return a figure of the probe from above, with its heater, terminals and tip."""
        made: Figure = plotting.figures().probe_drawing(self.layout(), title)
        return made
