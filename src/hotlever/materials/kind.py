"""A kind of material: what all have in common."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Self

import numpy as np
from pydantic import ConfigDict, model_validator

from hotlever.errors import unknown_name
from hotlever.materials.heat import grey_emission
from hotlever.materials.laws import Evaluated, Law
from hotlever.materials.parameters import STATED, Parameter, constant_of, declare
from hotlever.materials.silicon import MELTING_POINT, Carrier
from hotlever.materials.stated import StatedLaw, names_stated, number_or_law
from hotlever.records import Record
from hotlever.types import Array


def class_name(material_class: type) -> str:
    """Return the name of a class with its module, as files and messages state it."""
    return f"{material_class.__module__}.{material_class.__qualname__}"


class Kind(Record):
    """A material of one kind (section ``[materials.NAME]`` of a probe file).

    A class of one's own is made of one of `hotlever.materials.kinds`. What it has in place of the
    law of its kind is a method that returns a value and its exact derivatives, a dict by ``"T"``
    and by the names of the parameters that it depends on; `laws` says range and source. A parameter
    of its own is a field made by `hotlever.materials.parameters.field_of`: fits, priors, ``--set``
    and files know it then. `hotlever.probe.Probe.with_material` makes a probe of it.
    """

    #: The parameters of its family, of which it has those that are its fields.
    family: ClassVar[dict[str, Parameter]]
    #: All parameters that one of this kind may have, by name.
    declared: ClassVar[dict[str, Parameter]]
    #: Those that a fit varies unless it is told otherwise.
    usual: ClassVar[tuple[str, ...]]
    #: Whether it carries a current.
    conducts: ClassVar[bool] = True
    #: By property that may be a law: the parameters that only its number has a use for.
    of_numbers: ClassVar[dict[str, tuple[str, ...]]] = {}

    # other keys are numbers that a formula names
    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, float]

    kind: str
    emissivity: Annotated[float | StatedLaw, number_or_law((0.0, 1.0))]

    @classmethod
    def __pydantic_init_subclass__(cls, **options: Any) -> None:
        """Find the parameters among the fields: those of its family, and then its own."""
        super().__pydantic_init_subclass__(**options)
        family = getattr(cls, "family", {})
        own = {
            name: row._replace(name=name)
            for name, field in cls.model_fields.items()
            for row in field.metadata
            if isinstance(row, Parameter)
        }
        for row in own.values():
            declare(row, class_name(cls))
        of_family = {name: family[name] for name in family if name in cls.model_fields}
        cls.declared = of_family | own
        cls.usual = tuple(name for name, parameter in cls.declared.items() if parameter.usual)

    @property
    def parameters(self) -> dict[str, Parameter]:
        """Those of the declared parameters that are numbers here, and those that formulas name."""
        declared = {
            name: parameter
            for name, parameter in self.declared.items()
            if isinstance(getattr(self, name), float)
        }
        return declared | {
            name: constant_of(name, value) for name, value in (self.model_extra or {}).items()
        }

    @property
    def stated(self) -> dict[str, StatedLaw]:
        """The laws that its section states by a table or a formula, by property."""
        values = {name: getattr(self, name) for name in STATED if name in type(self).model_fields}
        return {name: law for name, law in values.items() if isinstance(law, StatedLaw)}

    def property_at(self, name: str, T: Array) -> Evaluated:
        """Return a property that is a number or a stated law, with its derivatives.

        They are by ``T`` and by parameters.
        """
        law = getattr(self, name)
        if not isinstance(law, StatedLaw):
            return np.full_like(T, law), {"T": np.zeros_like(T), name: np.ones_like(T)}
        value, by = law(T, self.numbers(law))
        scale = getattr(self, f"{name}_scale", None)
        if scale is None:
            return value, by
        return scale * value, {
            **{own: scale * slope for own, slope in by.items()},
            f"{name}_scale": value,
        }

    def numbers(self, law: StatedLaw) -> dict[str, float]:
        """Return the values of the parameters that a stated law has."""
        return {name: getattr(self, name) for name in law.names}

    @property
    @abstractmethod
    def laws(self) -> tuple[Law | StatedLaw, ...]:
        """Of thermal and, if it conducts, electrical conductivity."""

    @property
    def effects(self) -> tuple[Law, ...]:
        """Laws of what counts beyond the paper's physics."""
        return ()

    @property
    def highest_K(self) -> float:
        """Temperature (K) at which it melts or the first of its laws ends."""
        return min([self.melts_K, *(law.temperature_range[1] for law in self.stated.values())])

    @property
    def melts_K(self) -> float:
        """Temperature (K) at which it melts, or at which laws that no file states end."""
        return MELTING_POINT

    def end(self, name: str) -> str:
        """Say what happens to a material of this name above its highest temperature."""
        for own, law in self.stated.items():
            _, ends = law.temperature_range
            if ends == self.highest_K < self.melts_K:
                return f"the {law.noun} of {name}.{own} ends at {ends:g} K"
        return self.melting(name)

    def melting(self, name: str) -> str:
        """Say what happens to a material of this name above the temperature at which it melts."""
        return f"the laws of '{name}' end"

    def impossible(self, coldest_K: float) -> str:
        """Say why its laws make no sense from a temperature (K) on; empty if they do."""
        for name, law in self.stated.items():
            begins, ends = law.temperature_range
            if coldest_K < begins:
                return (
                    f"the {law.noun} of {name} begins at {begins:g} K, expected one from "
                    f"the base temperature, {coldest_K:g} K, on"
                )
            if coldest_K >= self.highest_K:
                return (
                    f"the {law.noun} of {name} ends at {ends:g} K, expected one that "
                    f"goes on above the base temperature, {coldest_K:g} K"
                )
            unit, within = STATED[name]
            if fault := law.fault(self.numbers(law), within, unit, coldest_K, self.highest_K):
                return f"{name}, {law.source}, {fault}"
        return ""

    @abstractmethod
    def thermal_conductivity(self, T: Array, thickness_um: Array | float) -> Evaluated:
        """Return κ (W cm⁻¹ K⁻¹) of a film, with its derivatives.

        They are by ``T``, by parameters, and by ``thickness_um`` where κ depends on it.
        """

    @abstractmethod
    def electrical_conductivity(self, T: Array, n: Array | float) -> Evaluated:
        """Return σ (S cm⁻¹), with its derivatives by ``T``, by parameters and by ``n``.

        The doping `n` (cm⁻³) matters to a `LowDopedSilicon` only.
        """

    @abstractmethod
    def thermoelectric(self, T: Array, n: Array | float, carrier: Carrier) -> Evaluated:
        """Return β (A cm⁻¹ K⁻¹) and γ (W cm⁻¹ K⁻²), (2, ...), with their derivatives.

        They are Σ σ S and Σ σ S² of the carriers, see `hotlever.materials.thermopower`; those of
        high-doped silicon are of the kind `carrier`.
        """

    def emission(self, T: Array, surroundings_K: float) -> Evaluated:
        """Return what a face radiates less what it takes up (W cm⁻²), with its derivatives."""
        emissivity, by = self.property_at("emissivity", T)
        emission, by_emissivity = grey_emission(T, emissivity, surroundings_K)
        black = by_emissivity.pop("emissivity")
        changes = {name: black * slope for name, slope in by.items()}
        return emission, {
            **changes,
            **by_emissivity,
            "T": by_emissivity["T"] + changes["T"],
        }

    @abstractmethod
    def enthalpy(self, T: Array) -> Evaluated:
        """Return the heat held above that at 298.15 K (J cm⁻³), with its derivatives.

        They are by ``T`` and by parameters.
        """

    # --- what a section may hold ------------------------------------------------------------------

    @classmethod
    def without_use(cls, values: Mapping[str, Any]) -> dict[str, str]:
        """Return what means nothing in a section of values, beside a law or without one, and why.

        With a law of the resistivity a temperature coefficient has no use, unless a formula names
        it; a scale has none without a law.
        """
        useless = dict[str, str]()
        for name, others in cls.of_numbers.items():
            is_law = isinstance(values.get(name), str | Mapping | StatedLaw)
            for other in others if is_law else [f"{name}_scale"]:
                useless[other] = f"{name} is {'a law' if is_law else 'no law'}"
        used = names_stated(values)
        return {name: why for name, why in useless.items() if name not in used}

    @model_validator(mode="before")
    @classmethod
    def _other_keys_are_named_in_formulas(cls, values: Any) -> Any:
        if not isinstance(values, Mapping):
            return values
        named = names_stated(values)
        for key in values:
            if key not in cls.model_fields and key not in named:
                raise ValueError(str(unknown_name("key", str(key), cls.model_fields)))
        useless = cls.without_use(values)
        for name, why in useless.items():
            if values.get(name) is not None:
                raise ValueError(f"{name} means nothing where {why}, expected none")
        scales = {
            f"{name}_scale": 1.0
            for name in cls.of_numbers
            if f"{name}_scale" not in useless and values.get(f"{name}_scale") is None
        }
        return {**values, **dict.fromkeys(useless), **scales}

    @model_validator(mode="after")
    def _formulas_name_numbers(self) -> Self:
        for own, law in self.stated.items():
            for name in law.names:
                if name not in self.parameters:
                    near = unknown_name("name", name, [*self.parameters, "T"])
                    raise ValueError(f"{own}: {near}; other names need a value in the section")
        return self
