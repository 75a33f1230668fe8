"""A probe with its material and measuring circuit, and the file that describes it."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field, SerializeAsAny, model_validator

from hotlever.errors import InputError, quoted, unknown_name
from hotlever.files import write_text
from hotlever.materials import HIGH_DOPED, LOW_DOPED, REFERENCE, Kind, Material, full_name
from hotlever.materials.kinds import HighDopedSilicon, LowDopedSilicon
from hotlever.materials.sections import LAWS, materials_of, own_laws, refuse_own_laws, with_laws_of
from hotlever.probe.circuit import Circuit, Contact, Wiring
from hotlever.probe.layout import Layout
from hotlever.probe.prior_texts import PriorTexts
from hotlever.probe.priors import priors_of
from hotlever.probe.sections import read_sections, section_lines, with_values
from hotlever.probe.shape_sections import shape_of
from hotlever.probe.shapes import (
    PARAMETRIC,
    SHAPE_SECTIONS,
    Shape,
    ThreeLeg,
    UShape,
)
from hotlever.probe.surroundings import Surroundings
from hotlever.probe.tip import Tip
from hotlever.records import Record
from hotlever.spieser2017 import DOI
from hotlever.types import Array

#: What the sections of a probe file hold, beside the shape in ``[probe]``.
_PARTS: dict[str, type[Record]] = {
    "circuit": Circuit,
    "material": Material,
    "surroundings": Surroundings,
    "tip": Tip,
    "prior": PriorTexts,
}
_MATERIALS = "materials"
SECTIONS = (*SHAPE_SECTIONS, _MATERIALS, *_PARTS)


class Probe(Record):
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

    shape: Shape
    circuit: Circuit = Circuit()
    material: Material = REFERENCE
    materials: dict[str, SerializeAsAny[Kind]] = Field(default_factory=dict)
    surroundings: Surroundings = Surroundings()
    tip: Tip | None = None
    prior: PriorTexts | None = None

    @model_validator(mode="after")
    def _tip_stands_on_the_heater(self) -> Probe:
        if self.tip is not None:
            room = self.shape.layout().heater.narrow_um / 2
            if not self.tip.base_radius_um < room:
                raise ValueError(
                    f"the tip's base has a radius of {self.tip.base_radius_um:.4g} µm, expected "
                    f"less than {room:.4g} µm, half the heater's narrow side"
                )
        return self

    @model_validator(mode="after")
    def _low_doped_parts_are_the_lower(self) -> Probe:
        for region in self.layout().regions:
            low, high = region.stack[0].material, region.dopant_from
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
    def _laws_make_sense_at_the_base(self) -> Probe:
        for kind in self.made_of.values():
            if reason := kind.impossible(self.circuit.base_temperature_K):
                raise ValueError(reason)
        return self

    def __hash__(self) -> int:
        parts = tuple(getattr(self, name) for name in _PARTS)
        return hash((self.shape, tuple(self.materials.items()), *parts))

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
    def from_sections(cls, values: dict[str, Any], where: str, folder: Path | None = None) -> Probe:
        """Make a probe of the sections of a probe file.

        Parameters
        ----------
        values : dict
            Sections by name.
        where : str
            Names the file in an error.
        folder : path, optional
            What the name of a drawing's file is relative to.

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
        materials = materials_of(values.get(_MATERIALS, {}), where, SECTIONS)
        drawn = {name: values[name] for name in SHAPE_SECTIONS if name in values}
        shape = shape_of(drawn, where, folder, materials)
        for name in materials:
            if name not in shape.materials:
                raise InputError(
                    f"{where}: [{_MATERIALS}.{name}]: no layer is made of it, expected [layers.…] "
                    f'with material = "{name}"'
                )
        parts: dict[str, Any] = {"shape": shape, _MATERIALS: materials}
        usual = {"material": REFERENCE.model_dump()}
        for name, part in _PARTS.items():
            if name in values:
                section = {**usual.get(name, {}), **values[name]}
                parts[name] = part.from_values(section, f"{where}: [{name}]")
        probe = cls.from_values(parts, where)
        probe.circuit.check(probe.layout().terminal_names, probe.surroundings.medium, where)
        if "material" in values and not probe.has_plain_silicon:
            raise InputError(f"{where}: [material]: no layer is made of it, expected none")
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
        named = {f"{_MATERIALS}.{name}": kind for name, kind in self.materials.items()}
        return named | self._parts

    @property
    def _parts(self) -> dict[str, Record]:
        """Those of its parts that matter."""
        parts = {name: getattr(self, name) for name in _PARTS if getattr(self, name)}
        if not self.has_plain_silicon:
            del parts["material"]
        return parts

    @property
    def has_plain_silicon(self) -> bool:
        """Whether any of it is made of the silicon of ``[material]``."""
        return not {LOW_DOPED, HIGH_DOPED}.isdisjoint(self.layout().materials)

    def sections(self) -> dict[str, dict[str, Any]]:
        """Return the sections as plain values: what `from_sections` takes, or refuses."""
        found: dict[str, dict[str, Any]] = self.shape.sections()
        if self.materials:
            found[_MATERIALS] = {name: kind.model_dump() for name, kind in self.materials.items()}
        found |= {name: part.model_dump() for name, part in self._parts.items()}
        if laws := own_laws(self.made_of):
            found[LAWS] = laws
        return {name: with_values(section) for name, section in found.items()}

    def field(self, name: str) -> tuple[str, str, type[Record]]:
        """Return section, key and record of a name such as ``n_d`` or ``tip.height_um``.

        Raises
        ------
        InputError
            If it is no key of a probe file; the nearest one is given.
        """
        section, dot, key = name.rpartition(".")
        named = {one: type(kind) for one, kind in self.materials.items()}
        wired = {f"circuit.{name}": Contact for name in self.layout().terminal_names}
        records: dict[str, type[Record]] = {
            "probe": type(self.shape),
            **named,
            **_PARTS,
            **wired,
            **{f"layers.{one}": record for one, record in self.shape.layer_records().items()},
        }
        if dot and section not in records:
            raise unknown_name("section", section, [*SECTIONS, *named, *wired])
        known = {part: [*record.model_fields] for part, record in records.items()}
        # in [probe] those of all shapes, its own first
        known["probe"] += [key for one in PARAMETRIC.values() for key in one.model_fields]
        own = [part for part in _PARTS if getattr(self, part)]
        # those of a named material have its name before them
        for part in [section] if dot else ["probe", *own, *_PARTS]:
            if key in known[part] or (dot and records[part] is PriorTexts):
                return part, key, records[part]
        # a prior has the name of what it is of
        dotted = {*named, *wired}
        full = [f"{part}.{key}" if part in dotted else key for part in known for key in known[part]]
        choices = known[section] if dot else full
        raise unknown_name("name", key, dict.fromkeys(choices))

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
            for one in [_MATERIALS] if section in self.materials else above:
                inside = inside.setdefault(one, {})
            inside.setdefault(last, {})[key] = value
        sections = {name: with_values(section) for name, section in sections.items()}
        shape = PARAMETRIC.get(str(sections["probe"]["shape"]))
        if shape is not None and not isinstance(self.shape, shape):
            own = sections["probe"].items()
            sections["probe"] = {key: value for key, value in own if key in shape.model_fields}
        changed: Probe = with_laws_of(self, Probe.from_sections(sections, "probe"))
        return changed

    def values(self, names: Sequence[str]) -> Array:
        """Return some of its values by their names in a probe file, shape (len(names),)."""
        return np.array([self._value(name) for name in names], dtype=float)

    def _value(self, name: str) -> Any:
        material, dot, own = name.partition(".")
        if dot:
            return getattr(self.materials[material], own)
        parts = (self.shape, *(getattr(self, part) for part in _PARTS))
        return next(
            getattr(part, name) for part in parts if part and name in type(part).model_fields
        )

    def replace(self, values: Mapping[str, float]) -> Probe:
        """Return a copy with some values changed, as `with_` does but unchecked and fast."""
        parts: dict[str, Any] = {}
        for field in ("shape", *_PARTS):
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
        return self.model_copy(update={**parts, _MATERIALS: kinds})

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

    @property
    def stated_priors(self) -> dict[str, str]:
        """What its file says of its priors, by name."""
        return {} if self.prior is None else self.prior.by_name

    @property
    def kinds(self) -> dict[str, Kind]:
        """All its materials by name, the two of ``[material]`` among them."""
        return {**self.material.kinds, **self.materials}

    @property
    def made_of(self) -> dict[str, Kind]:
        """The materials that its layout has, by name."""
        kinds = self.kinds
        return {name: kinds[name] for name in self.layout().materials}

    @property
    def heater_silicon(self) -> LowDopedSilicon | None:
        """The low-doped silicon of the heater; None if it is of another material."""
        kind = self.kinds[self.layout().heater.stack[0].material]
        return kind if isinstance(kind, LowDopedSilicon) else None

    @property
    def wiring(self) -> Wiring:
        """Which of its terminals are what."""
        return self.circuit.wiring(self.layout().terminal_names)

    def layout(self) -> Layout:
        """Return the regions, terminals and tip."""
        return dataclasses.replace(self.shape.layout(), cone=self.tip)

    def to_toml(self) -> str:
        """Return the probe as a commented probe file."""
        lines = ["# A hotlever probe file: lengths in µm, temperatures in K."]
        if self.shape == Probe.reference().shape:
            lines.append(
                "# The reference probe. No drawing of the published lever exists: these dimensions"
                f"\n# are inferred from the operating points in doi:{DOI}."
            )
        meaning = self.shape.description()
        for name, section in self.shape.sections().items():
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
        if laws := own_laws(self.made_of):
            lines += section_lines(LAWS, laws, {})
        return "\n".join(lines) + "\n"

    def to_file(self, path: str | os.PathLike[str]) -> None:
        """Write the probe as a commented probe file, whole or not at all."""
        write_text(path, self.to_toml())
