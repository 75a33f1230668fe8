"""A probe, and the file that describes it."""

from __future__ import annotations

import dataclasses
import math
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from pydantic import Field, SerializeAsAny, model_validator

import hotlever
from hotlever.errors import InputError, unknown_name
from hotlever.files import write_text
from hotlever.materials import HIGH_DOPED, KINDS, LOW_DOPED, REFERENCE, Kind, Material, full_name
from hotlever.materials.kinds import HighDopedSilicon, LowDopedSilicon, class_name
from hotlever.materials.sections import remade
from hotlever.probe.circuit import Circuit, Wiring
from hotlever.probe.file_sections import (
    PARTS,
    PriorTexts,
    changed_sections,
    check_together,
    file_text,
    parts_of,
    read_sections,
    with_values,
)
from hotlever.probe.layout import Layout
from hotlever.probe.monitor_sections import Monitor, Monitors
from hotlever.probe.shapes import Shape, ThreeLeg, UShape
from hotlever.probe.surroundings import Physics, Surroundings
from hotlever.probe.tip import SampleContact, Tip
from hotlever.quantities import OBSERVABLES
from hotlever.records import Record
from hotlever.types import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from hotlever.probe.drawing.kit import Drawing


class Probe(Record):
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

    shape: Shape
    circuit: Circuit = Circuit()
    material: Material = REFERENCE
    materials: dict[str, SerializeAsAny[Kind]] = Field(default_factory=dict)
    surroundings: Surroundings = Surroundings()
    tip: Tip | None = None
    contact: SampleContact | None = None
    physics: Physics = Physics()
    prior: PriorTexts | None = None
    monitor: Monitors | None = None

    @model_validator(mode="after")
    def _tip_fits(self) -> Self:
        if self.tip is not None:
            room = self.shape.layout().heater.narrow_um / 2
            if not self.tip.base_radius_um < room:
                raise ValueError(
                    f"the tip's base has a radius of {self.tip.base_radius_um:.4g} µm, expected "
                    f"less than {room:.4g} µm, half the heater's narrow side"
                )
        elif self.contact is not None:
            raise ValueError("[contact] means nothing without a section [tip]")
        if self.tip and self.contact and self.surroundings.medium == "air":
            gap, height = self.surroundings.surface_gap_um, self.tip.height_um
            if gap is None or not math.isclose(gap, height, rel_tol=1e-6):
                raise ValueError(
                    f"surface_gap_um = {'none' if gap is None else f'{gap:g}'}: expected the "
                    f"height of the tip in contact, {height:g}"
                )
            if self.tip.in_air:
                raise ValueError("in_air: the air beside a tip in contact counts by itself")
        return self

    @model_validator(mode="after")
    def _materials_make_sense(self) -> Self:
        kinds = self.kinds
        for region in self.layout().regions:
            low, high = kinds[region.material], kinds[region.dopant_from]
            if (
                region.taper is not None
                and isinstance(low, LowDopedSilicon)
                and isinstance(high, HighDopedSilicon)
                and low.n_d >= high.n_hd
            ):
                raise ValueError(
                    f"{full_name(region.material, 'n_d')} = {low.n_d:g} must be below "
                    f"{full_name(region.dopant_from, 'n_hd')} = {high.n_hd:g}"
                )
        for name, kind in self.made_of.items():
            if reason := kind.impossible(self.circuit.base_temperature_K):
                of = f"{name}: " if name in self.materials else ""
                raise ValueError(of + reason)
        return self

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

    # --- what it is ------------------------------------------------------------------------------

    def __hash__(self) -> int:
        parts = tuple(getattr(self, name) for name in PARTS)
        return hash((self.shape, tuple(self.materials.items()), *parts))

    @property
    def title(self) -> str:
        """What it is in a few words: its shape, medium, and effects beyond the paper."""
        own = f"{self.shape.title} in {self.surroundings.medium}"
        return ", ".join([own, *self.physics.effects])

    @property
    def stated_priors(self) -> dict[str, str]:
        """What its file says of its priors, by name."""
        texts = (self.prior and self.prior.model_extra) or {}
        return {self.shape.named(name): text for name, text in texts.items()}

    @property
    def monitors(self) -> dict[str, Monitor]:
        """Where temperature and potential are reported, by name."""
        return {} if self.monitor is None else self.monitor.named

    @property
    def parts(self) -> dict[str, Record]:
        """Those of its parts that matter, beside the shape, by the section of a probe file."""
        parts = {name: getattr(self, name) for name in PARTS if getattr(self, name)}
        if not self.has_plain_silicon:
            del parts["material"]
        return parts

    @property
    def has_plain_silicon(self) -> bool:
        """Whether any of it is made of the silicon of ``[material]``."""
        return not {LOW_DOPED, HIGH_DOPED}.isdisjoint(self.layout().materials)

    @property
    def kinds(self) -> dict[str, Kind]:
        """All its materials by name, the two of ``[material]`` among them."""
        return {**self.material.kinds, **self.materials}

    @property
    def classes(self) -> dict[str, type[Record]]:
        """Of its materials those that are of a class of one's own, by section."""
        own: dict[str, type[Record]] = {
            name: type(kind)
            for name, kind in self.materials.items()
            if type(kind) is not KINDS[kind.kind]
        }
        if type(self.material) is not Material and self.has_plain_silicon:
            own["material"] = type(self.material)
        return own

    @property
    def laws(self) -> dict[str, str]:
        """The names of these classes, as files state them."""
        return {name: class_name(record_class) for name, record_class in self.classes.items()}

    @property
    def made_of(self) -> dict[str, Kind]:
        """The materials that its layout has, by name."""
        kinds = self.kinds
        return {name: kinds[name] for name in self.layout().materials}

    @property
    def heater_silicon(self) -> LowDopedSilicon | None:
        """The low-doped silicon of the heater; None if it is of another material."""
        kind = self.kinds[self.layout().heater.material]
        return kind if isinstance(kind, LowDopedSilicon) else None

    @property
    def lowest_bias_V(self) -> float:
        """Bias (V) below which the lever is as at the opposite bias, with the signs reversed.

        There is none, −∞, with held supplies or thermoelectricity: there the polarity counts.
        """
        counts = self.physics.thermoelectric or not self.circuit.starts_cold
        return -math.inf if counts else 0.0

    @property
    def wiring(self) -> Wiring:
        """Which of its terminals are what."""
        return self.circuit.wiring(self.layout().terminal_names)

    @property
    def observables(self) -> tuple[str, ...]:
        """Which of `hotlever.quantities.OBSERVABLES` it can show."""
        without = {
            "reader": "reader" not in self.wiring.measurable,
            "bridge": not self.circuit.has_bridge,
        }
        return tuple(name for name in OBSERVABLES if not without.get(name))

    def layout(self) -> Layout:
        """Return the regions, terminals and tip."""
        return dataclasses.replace(self.shape.layout(), cone=self.tip)

    def sections(self) -> dict[str, dict[str, Any]]:
        """Return the sections as plain values: what `Probe.from_sections` takes, or refuses."""
        sections: dict[str, dict[str, Any]] = self.shape.sections()
        if self.materials:
            sections["materials"] = {
                name: kind.model_dump() for name, kind in self.materials.items()
            }
        sections |= {name: part.model_dump() for name, part in self.parts.items()}
        if self.laws:
            sections["laws"] = dict(self.laws)
        return {name: with_values(section) for name, section in sections.items()}

    def _owner(self, name: str) -> tuple[str, Record | None]:
        """Return the section with a value, by its name in a probe file, and what that holds."""
        material, dot, _ = name.partition(".")
        if dot:
            return material, self.materials[material]
        parts = [("probe", self.shape), *((part, getattr(self, part)) for part in PARTS)]
        owners = ((part, own) for part, own in parts if own and name in type(own).model_fields)
        return next(owners, ("", None))

    def values(self, names: Sequence[str]) -> Array:
        """Return some of its values by their names in a probe file, shape (len(names),)."""
        dimensions = self.shape.dimensions()
        numbers = [
            dimensions[name]
            if name in dimensions
            else getattr(self._owner(name)[1], name.rpartition(".")[2])
            for name in names
        ]
        return np.array(numbers, dtype=float)

    def replace(self, values: Mapping[str, float]) -> Self:
        """Return a copy with some values changed, as `with_` does but unchecked and fast."""
        changed = dict[str, tuple[Record, dict[str, float]]]()
        dimensions = {
            name: value for name, value in values.items() if name in self.shape.dimensions()
        }
        for name, value in values.items():
            section, record = self._owner(name) if name not in dimensions else ("", None)
            if record is not None:
                changed.setdefault(section, (record, {}))[1][name.rpartition(".")[2]] = value
        copies: dict[str, Any] = {
            section: record.model_copy(update=own) for section, (record, own) in changed.items()
        }
        materials = {name: copies.pop(name, kind) for name, kind in self.materials.items()}
        shape = copies.pop("probe", self.shape).with_dimensions(dimensions)
        return self.model_copy(update={**copies, "shape": shape, "materials": materials})

    def with_physics(self, effects: Iterable[str], where: str = "physics") -> Self:
        """Return the probe with some effects beyond the paper, and no others.

        Raises
        ------
        InputError
            If there is no such effect.
        """
        return self.model_copy(update={"physics": Physics.of(effects, where)})
