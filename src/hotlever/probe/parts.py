"""What a probe consists of, before it is a file: shape, circuit, materials, surroundings, tip."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any, Self

import numpy as np
from pydantic import ConfigDict, Field, SerializeAsAny, model_validator

from hotlever.errors import unknown_name
from hotlever.materials import HIGH_DOPED, KINDS, LOW_DOPED, REFERENCE, Kind, Material, full_name
from hotlever.materials.kind import class_name
from hotlever.materials.kinds import HighDopedSilicon, LowDopedSilicon
from hotlever.measurands import OBSERVABLES
from hotlever.probe.circuit import Circuit, Contact, Wiring
from hotlever.probe.contact import SampleContact
from hotlever.probe.layout import Layout
from hotlever.probe.monitors import Monitor, Monitors
from hotlever.probe.physics import THE_PAPERS, Physics
from hotlever.probe.shapes import PARAMETRIC, SHAPE_SECTIONS, Shape
from hotlever.probe.surroundings import Surroundings
from hotlever.probe.tip import Tip
from hotlever.records import Record
from hotlever.types import Array


class PriorTexts(Record):
    """What is known of a lever beforehand (section ``[prior]`` of a probe file), as text."""

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, str]


#: What the sections of a probe file hold, beside the shape in ``[probe]``.
PARTS: dict[str, type[Record]] = {
    "circuit": Circuit,
    "material": Material,
    "surroundings": Surroundings,
    "tip": Tip,
    "contact": SampleContact,
    "physics": Physics,
    "prior": PriorTexts,
    "monitor": Monitors,
}
MATERIAL, MATERIALS = "material", "materials"
#: All sections of a probe file.
SECTIONS = (*SHAPE_SECTIONS, MATERIALS, *PARTS)


class ProbeParts(Record):
    """Everything that a solve needs of one lever, and what is known before it is measured."""

    shape: Shape
    circuit: Circuit = Circuit()
    material: Material = REFERENCE
    materials: dict[str, SerializeAsAny[Kind]] = Field(default_factory=dict)
    surroundings: Surroundings = Surroundings()
    tip: Tip | None = None
    contact: SampleContact | None = None
    physics: Physics = THE_PAPERS
    prior: PriorTexts | None = None
    monitor: Monitors | None = None

    @model_validator(mode="after")
    def _tip_stands_on_the_heater(self) -> Self:
        if self.tip is not None:
            room = self.shape.layout().heater.narrow_um / 2
            if not self.tip.base_radius_um < room:
                raise ValueError(
                    f"the tip's base has a radius of {self.tip.base_radius_um:.4g} µm, expected "
                    f"less than {room:.4g} µm, half the heater's narrow side"
                )
        return self

    @model_validator(mode="after")
    def _contact_is_the_tips(self) -> Self:
        if self.contact is None:
            return self
        if self.tip is None:
            raise ValueError("[contact] means nothing without a section [tip]")
        if self.surroundings.medium == "air":
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
    def _low_doped_parts_are_the_lower(self) -> Self:
        for region in self.layout().regions:
            low, high = region.material, region.dopant_from
            of_low, of_high = self.kinds[low], self.kinds[high]
            if (
                region.taper is not None
                and isinstance(of_low, LowDopedSilicon)
                and isinstance(of_high, HighDopedSilicon)
                and of_low.n_d >= of_high.n_hd
            ):
                raise ValueError(
                    f"{full_name(low, 'n_d')} = {of_low.n_d:g} must be below "
                    f"{full_name(high, 'n_hd')} = {of_high.n_hd:g}"
                )
        return self

    @model_validator(mode="after")
    def _laws_make_sense_at_the_base(self) -> Self:
        for name, kind in self.made_of.items():
            if reason := kind.impossible(self.circuit.base_temperature_K):
                of = f"{name}: " if name in self.materials else ""
                raise ValueError(of + reason)
        return self

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
        return {} if self.prior is None else self.prior.model_extra or {}

    @property
    def monitors(self) -> dict[str, Monitor]:
        """Where temperature and potential are reported, by name."""
        return {} if self.monitor is None else self.monitor.named

    @property
    def parts(self) -> dict[str, Record]:
        """Those of its parts that matter, beside the shape, by the section of a probe file."""
        parts = {name: getattr(self, name) for name in PARTS if getattr(self, name)}
        if not self.has_plain_silicon:
            del parts[MATERIAL]
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
            own[MATERIAL] = type(self.material)
        return own

    @property
    def laws(self) -> dict[str, str]:
        """The names of these classes, as files state them."""
        return {name: class_name(made) for name, made in self.classes.items()}

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
        return -math.inf if self.physics.thermoelectric else self.circuit.lowest_bias_V

    @property
    def wiring(self) -> Wiring:
        """Which of its terminals are what."""
        return self.circuit.wiring(self.layout().terminal_names)

    @property
    def observables(self) -> tuple[str, ...]:
        """Which of `hotlever.measurands.OBSERVABLES` it can show."""
        without = {
            "reader": "reader" not in self.wiring.measurable,
            "bridge": not self.circuit.has_bridge,
        }
        return tuple(name for name in OBSERVABLES if not without.get(name))

    def layout(self) -> Layout:
        """Return the regions, terminals and tip."""
        return dataclasses.replace(self.shape.layout(), cone=self.tip)

    def values(self, names: Sequence[str]) -> Array:
        """Return some of its values by their names in a probe file, shape (len(names),)."""
        return np.array([self._value(name) for name in names], dtype=float)

    def _value(self, name: str) -> Any:
        material, dot, own = name.partition(".")
        if dot:
            return getattr(self.materials[material], own)
        parts = (self.shape, *(getattr(self, part) for part in PARTS))
        return next(
            getattr(part, name) for part in parts if part and name in type(part).model_fields
        )

    def replace(self, values: Mapping[str, float]) -> Self:
        """Return a copy with some values changed, as `with_` does but unchecked and fast."""
        parts: dict[str, Any] = {}
        for field in ("shape", *PARTS):
            part = getattr(self, field)
            own = {
                name: values[name] for name in values if part and name in type(part).model_fields
            }
            parts[field] = part.model_copy(update=own) if own else part
        kinds = dict(self.materials)
        for full, value in values.items():
            name, dot, key = full.partition(".")
            if dot:
                kinds[name] = kinds[name].model_copy(update={key: value})
        return self.model_copy(update={**parts, "materials": kinds})

    def field(self, name: str) -> tuple[str, str, type[Record]]:
        """Return section, key and record of a name such as ``n_d`` or ``tip.height_um``.

        Raises
        ------
        InputError
            If it is no key of a probe file; the nearest one is given.
        """
        section, dot, key = name.rpartition(".")
        named = {material: type(kind) for material, kind in self.materials.items()}
        wired = {f"circuit.{name}": Contact for name in self.layout().terminal_names}
        records: dict[str, type[Record]] = {
            "probe": type(self.shape),
            **named,
            **PARTS,
            MATERIAL: type(self.material),
            **wired,
            **{f"layers.{key}": layer for key, layer in self.shape.layer_records().items()},
        }
        if dot and section not in records:
            raise unknown_name("section", section, [*SECTIONS, *named, *wired])
        keys = {part: [*record.model_fields] for part, record in records.items()}
        # and the numbers that formulas name
        for material, kind in self.materials.items():
            keys[material] += kind.model_extra or {}
        # in [probe] those of all shapes, its own first
        keys["probe"] += [key for shape in PARAMETRIC.values() for key in shape.model_fields]
        own = [part for part in PARTS if getattr(self, part)]
        # those of a named material have its name before them
        for part in [section] if dot else ["probe", *own, *PARTS]:
            if key in keys[part] or (dot and records[part] is PriorTexts):
                return part, key, records[part]
        # a prior has the name of what it is of
        dotted = {*named, *wired}
        full = [f"{part}.{key}" if part in dotted else key for part in keys for key in keys[part]]
        choices = keys[section] if dot else full
        raise unknown_name("name", key, dict.fromkeys(choices))
