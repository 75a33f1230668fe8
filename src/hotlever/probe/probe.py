"""A probe, and the file that describes it."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import hotlever
from hotlever.errors import InputError, unknown_name
from hotlever.files import write_text
from hotlever.materials import Kind
from hotlever.materials.sections import remade
from hotlever.probe.file_sections import (
    changed_sections,
    check_together,
    file_text,
    parts_of,
    read_sections,
)
from hotlever.probe.monitor_sections import Monitor, Monitors
from hotlever.probe.parts import ProbeParts
from hotlever.probe.shapes import ThreeLeg, UShape
from hotlever.records import Record

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
        from hotlever.probe.drawing.parametric import sections_of

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
        probe = cls.from_values(parts_of(values, where, folder, like), where)
        check_together(probe, values, where)
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
        return Probe.from_sections(changed_sections(self, changes), "probe", like=self)

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
        from hotlever.probe.drawing.parametric import drawn_shape
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
