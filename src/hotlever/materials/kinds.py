"""What a lever is made of: kinds of material, each with its parameters and its laws.

A material of a kind gives thermal and electrical conductivity with exact derivatives by the
temperature, by its own parameters and, where it is doped, by the local doping. The laws are those
of the modules beside this one; here is said which kind follows which, and with which parameters.

A property that all materials have is a method of `Kind`, and a method of each family that says by
which law. A parameter is a row of `hotlever.materials.parameters` and a field of the kinds that
have it: what a fit may vary, probe files and ``[material]`` follow from these. Where a film has a
number for a property, a section may state a law: a table or a formula, see
`hotlever.materials.stated`.

Laws of silicon may depart from their formulas (`hotlever.materials.departures`). With the name of
the law as its key a property has its derivative by δ at each place, which the modes make one by the
coefficients. The profile of the dopant departs where the doping is made.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Collection, Mapping
from functools import partial
from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
from pydantic import ConfigDict, Field, model_validator

from hotlever.errors import InputError, unknown_name
from hotlever.materials import films, heat, silicon, thermopower
from hotlever.materials.departures import FACTORS, PROFILE
from hotlever.materials.laws import FORMULA_TO, Evaluated, Law
from hotlever.materials.parameters import (
    OF_DIELECTRIC,
    OF_METAL,
    OF_SILICON,
    STATED,
    Parameter,
    constant_of,
    declare,
    field_bounds,
    field_of,
    is_declared,
)
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
        return silicon.MELTING_POINT

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
    def thermoelectric(self, T: Array, n: Array | float, carrier: silicon.Carrier) -> Evaluated:
        """Return β (A cm⁻¹ K⁻¹) and γ (W cm⁻¹ K⁻²), (2, ...), with their derivatives.

        They are Σ σ S and Σ σ S² of the carriers, see `hotlever.materials.thermopower`; those of
        high-doped silicon are of the kind `carrier`.
        """

    def emission(self, T: Array, surroundings_K: float) -> Evaluated:
        """Return what a face radiates less what it takes up (W cm⁻²), with its derivatives."""
        emissivity, by = self.property_at("emissivity", T)
        emission, by_emissivity = heat.grey_emission(T, emissivity, surroundings_K)
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

    @classmethod
    def useful(cls, values: Mapping[str, Any], stated: Collection[str]) -> dict[str, Any]:
        """Return values without those that have no use in a section, unless they are stated."""
        useless = {*cls.without_use(values)} - {*stated}
        return {name: value for name, value in values.items() if name not in useless}

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
        for name in filter(is_declared, self.model_extra or {}):
            # it would be printed as that one, in its unit
            raise ValueError(
                f"{name}: other materials have a parameter of this name, expected another"
            )
        for own, law in self.stated.items():
            for name in law.names:
                if name not in self.parameters:
                    near = unknown_name("name", name, [*self.parameters, "T"])
                    raise ValueError(f"{own}: {near}; other names need a value in the section")
        return self


# What c_κ may be.
ScaleOrByThickness = Annotated[
    Annotated[float, field_of(OF_SILICON["c_kappa"])] | Literal["thickness"],
    Field(
        union_mode="left_to_right",
        description='scale of the thermal conductivity; or "thickness": it follows from the '
        "thickness",
    ),
]


class Silicon(Kind):
    """What all kinds of silicon have in common."""

    family: ClassVar = OF_SILICON

    c_kappa: ScaleOrByThickness
    kappa_1: float = field_of(OF_SILICON["kappa_1"])
    kappa_2: float = field_of(OF_SILICON["kappa_2"])
    kappa_3: float = field_of(OF_SILICON["kappa_3"])
    heat_capacity_scale: float = field_of(OF_SILICON["heat_capacity_scale"])
    scattering_exponent: float = field_of(OF_SILICON["scattering_exponent"])
    emissivity: float = field_of(OF_SILICON["emissivity"])

    def melting(self, name: str) -> str:
        """Say what happens to a material of this name above the temperature at which it melts."""
        return "silicon melts"

    @property
    def _heat(self) -> Law:
        by_thickness = self.c_kappa == "thickness"
        return heat.thermal_conductivity_of_layer if by_thickness else heat.thermal_conductivity

    def thermal_conductivity(self, T: Array, thickness_um: Array | float) -> Evaluated:
        """Return κ (W cm⁻¹ K⁻¹), see `Kind.thermal_conductivity`."""
        kappa = self._heat(T, thickness_um if self.c_kappa == "thickness" else self.c_kappa)
        return self._departed("kappa", T, kappa)

    def _departed(self, law: str, T: Array, evaluated: Evaluated) -> Evaluated:
        """Return a property that is proportional to a law, as far as that departs."""
        value, by = evaluated
        coefficients = self._coefficients(law)
        if any(coefficients):
            factor, slope = FACTORS[law].departed(T, coefficients)
            value = factor * value
            by = {name: factor * partial for name, partial in by.items()}
            by["T"] = by["T"] + value * slope
        return value, {**by, law: value}

    def _coefficients(self, law: str) -> tuple[float, ...]:
        return tuple(getattr(self, name) for name in FACTORS[law].names)

    def enthalpy(self, T: Array) -> Evaluated:
        """Return the heat held (J cm⁻³), see `Kind.enthalpy`."""
        held, by = heat.enthalpy(T)
        scale = self.heat_capacity_scale
        return scale * held, {"T": scale * by["T"], "heat_capacity_scale": held}


class LowDopedSilicon(Silicon):
    """Silicon whose carriers are those of its dopant and, when hot, its own."""

    #: Its law by temperature, doping, p, impurity exponent and intrinsic scale.
    conductivity: ClassVar[Law]
    #: Its law of thermoelectricity, by these and the scattering exponent; and the majority.
    seebeck: ClassVar[Law]
    carrier: ClassVar[silicon.Carrier]

    delta: float = field_of(OF_SILICON["delta"])
    n_d: float = field_of(OF_SILICON["n_d"])
    p: float = field_of(OF_SILICON["p"])
    impurity_exponent: float = field_of(OF_SILICON["impurity_exponent"])
    intrinsic_scale: float = field_of(OF_SILICON["intrinsic_scale"])
    n_i_1: float = field_of(OF_SILICON["n_i_1"])
    n_i_2: float = field_of(OF_SILICON["n_i_2"])
    n_i_3: float = field_of(OF_SILICON["n_i_3"])
    mobility_1: float = field_of(OF_SILICON["mobility_1"])
    mobility_2: float = field_of(OF_SILICON["mobility_2"])
    mobility_3: float = field_of(OF_SILICON["mobility_3"])
    profile_1: float = field_of(OF_SILICON["profile_1"])

    @property
    def front(self) -> float:
        """How far the dopant's front has moved from a border into the heater, over Δ."""
        return PROFILE.spread_hot * self.profile_1

    @property
    def of_carriers(self) -> dict[str, float]:
        """The parameters of its carriers' density and mobility, by name."""
        names = "p", "impurity_exponent", "intrinsic_scale"
        return {name: getattr(self, name) for name in names}

    @property
    def laws(self) -> tuple[Law, ...]:
        """Of thermal and electrical conductivity."""
        return self._heat, type(self).conductivity

    def electrical_conductivity(self, T: Array, n: Array | float) -> Evaluated:
        """Return σ (S cm⁻¹), see `Kind.electrical_conductivity`."""
        return self._departing(type(self).conductivity, T, n, **self.of_carriers)

    def _departing(
        self,
        law: Callable[..., Evaluated],
        T: Array,
        n: Array | float,
        *,
        intrinsic_scale: float | Array,
        **others: float | Array,
    ) -> Evaluated:
        """Return a law of the carriers as far as their density and mobility depart."""
        coefficients, scale, slope = self._coefficients("n_i"), intrinsic_scale, None
        if any(coefficients):
            factor, slope = FACTORS["n_i"].departed(T, coefficients)
            scale = intrinsic_scale * factor
        value, by = law(T, n, intrinsic_scale=scale, **others)
        # δ moves the logarithm of what the scale moves
        by_density = scale * by["intrinsic_scale"]
        by = {**by, "intrinsic_scale": by_density / intrinsic_scale, "n_i": by_density}
        if slope is not None:
            by["T"] = by["T"] + by_density * slope
        return self._departed("mobility", T, (value, by))

    @property
    def effects(self) -> tuple[Law, ...]:
        """Of thermoelectricity."""
        return (type(self).seebeck,)

    def thermoelectric(self, T: Array, n: Array | float, carrier: silicon.Carrier) -> Evaluated:
        """Return β and γ, see `Kind.thermoelectric`."""
        own = self.of_carriers | {"scattering_exponent": self.scattering_exponent}
        return self._departing(type(self).seebeck, T, n, **own)

    def inversion_temperature(self, n: Array | None = None) -> Array:
        """Return the temperature (K) at which the resistivity of a doping (cm⁻³) is highest.

        Of its own doping by default; NaN where there is none below 1700 K.
        """

        def conductivity(T: Array, n: Array, **of_carriers: Array) -> Evaluated:
            # the method, whose law a class of one's own may have replaced
            return self.model_copy(update=of_carriers).electrical_conductivity(T, n)

        return silicon.inversion_temperature(
            self.n_d if n is None else n, **self.of_carriers, conductivity=conductivity
        )


class NSilicon(LowDopedSilicon):
    """Silicon doped with phosphorus, as in the paper."""

    conductivity: ClassVar = silicon.conductivity_low_doped
    seebeck: ClassVar = thermopower.thermoelectric_n_silicon
    carrier: ClassVar = "electron"

    kind: Literal["n-silicon"] = "n-silicon"


class PSilicon(LowDopedSilicon):
    """Silicon doped with boron."""

    conductivity: ClassVar = silicon.conductivity_p
    seebeck: ClassVar = thermopower.thermoelectric_p_silicon
    carrier: ClassVar = "hole"

    kind: Literal["p-silicon"] = "p-silicon"


class HighDopedSilicon(Silicon):
    """Quasi-metallic silicon; its dopant diffuses into low-doped silicon beside it."""

    kind: Literal["high-doped-silicon"] = "high-doped-silicon"
    a0: float = field_of(OF_SILICON["a0"])
    a1: float = field_of(OF_SILICON["a1"])
    n_hd: float = field_of(OF_SILICON["n_hd"])
    legs_1: float = field_of(OF_SILICON["legs_1"])
    legs_2: float = field_of(OF_SILICON["legs_2"])
    legs_3: float = field_of(OF_SILICON["legs_3"])

    def impossible(self, coldest_K: float) -> str:
        """Say that the straight line of Eq. 11 falls to nothing below 300 K, if it does."""
        resistivity = self.a0 + self.a1 * (coldest_K - 300.0)
        least_left = 0.1  # of the resistivity at 300 K, when it is colder
        if resistivity >= least_left * self.a0:
            return ""
        return (
            f"a0 = {self.a0:g} and a1 = {self.a1:g} give a resistivity of {resistivity:.3g} Ω cm "
            f"at {coldest_K:g} K, expected more than {least_left:g} of a0"
        )

    @property
    def laws(self) -> tuple[Law, ...]:
        """Of thermal and electrical conductivity."""
        return self._heat, silicon.conductivity_high_doped

    def electrical_conductivity(self, T: Array, n: Array | float) -> Evaluated:
        """Return σ (S cm⁻¹), see `Kind.electrical_conductivity`."""
        return self._departed("legs", T, silicon.conductivity_high_doped(T, self.a0, self.a1))

    @property
    def effects(self) -> tuple[Law, ...]:
        """Of thermoelectricity."""
        return (thermopower.thermoelectric_high_doped,)

    def thermoelectric(self, T: Array, n: Array | float, carrier: silicon.Carrier) -> Evaluated:
        """Return β and γ, see `Kind.thermoelectric`."""
        own = self.a0, self.a1, self.n_hd, self.scattering_exponent
        return self._departed("legs", T, thermopower.thermoelectric_high_doped(T, *own, carrier))


# --- films ----------------------------------------------------------------------------------------


def _number_or_law(parameter: Parameter, **others: Any) -> Any:
    """Return the field of a parameter that may be a law, with the bounds of its numbers."""
    field = field_of(parameter, ge=None, le=None, **others)
    field.metadata.append(number_or_law(field_bounds(parameter)))
    return field


class Stored(Kind):
    """What materials have in common whose heat capacity is a number or a stated law."""

    heat_capacity: float | StatedLaw | None = _number_or_law(
        OF_METAL["heat_capacity"],
        default=None,
        description="heat capacity (J cm⁻³ K⁻¹), which counts in time",
    )

    def enthalpy(self, T: Array) -> Evaluated:
        """Return the heat held (J cm⁻³), see `Kind.enthalpy`.

        Raises
        ------
        InputError
            If no heat capacity was given.
        """
        if self.heat_capacity is None:
            raise InputError(
                f"a {self.kind} without heat_capacity (J cm⁻³ K⁻¹) cannot be followed in time"
            )
        if isinstance(self.heat_capacity, StatedLaw):
            return self.heat_capacity.integral(T, self.numbers(self.heat_capacity))
        return heat.enthalpy_by_capacity(T, self.heat_capacity)


class MetalFilm(Stored):
    """A metal film; the values of a bulk metal are where a fit may start."""

    family: ClassVar = OF_METAL
    of_numbers: ClassVar = {"resistivity": ("tcr",), "kappa": ()}

    kind: Literal["metal-film"] = "metal-film"
    preset: str | None = Field(default=None, description="metal whose values those left out are")
    resistivity: float | StatedLaw = _number_or_law(OF_METAL["resistivity"])
    tcr: float | None = field_of(OF_METAL["tcr"], default=None)
    resistivity_scale: float | None = field_of(OF_METAL["resistivity_scale"], default=None)
    lorenz_ratio: float | None = field_of(OF_METAL["lorenz_ratio"])
    kappa: float | StatedLaw | None = _number_or_law(
        OF_METAL["kappa"],
        default=None,
        description="thermal conductivity (W cm⁻¹ K⁻¹); left out: by Wiedemann and Franz",
    )
    kappa_scale: float | None = field_of(OF_METAL["kappa_scale"], default=None)
    seebeck: float | StatedLaw = _number_or_law(OF_METAL["seebeck"])
    emissivity: float | StatedLaw = _number_or_law(OF_METAL["emissivity"])
    melting_point_K: float = Field(
        default=silicon.MELTING_POINT, ge=400, le=4000, description="melting point (K)"
    )

    @model_validator(mode="after")
    def _a_number_has_a_coefficient(self) -> Self:
        if self.tcr is None and not isinstance(self.resistivity, StatedLaw):
            raise ValueError("tcr is missing")
        return self

    @classmethod
    def without_use(cls, values: Mapping[str, Any]) -> dict[str, str]:
        """Return what means nothing in a section of values, see `Kind.without_use`."""
        useless = super().without_use(values)
        if values.get("kappa") is not None and "lorenz_ratio" not in names_stated(values):
            useless["lorenz_ratio"] = "kappa is stated"
        return useless

    @property
    def laws(self) -> tuple[Law | StatedLaw, ...]:
        """Of thermal and electrical conductivity."""
        by_number = films.wiedemann_franz if self.kappa is None else films.constant_conductivity
        return (
            self.stated.get("kappa", by_number),
            self.stated.get("resistivity", films.metal_conductivity),
        )

    @property
    def melts_K(self) -> float:
        """Temperature (K) at which it melts, or at which laws that no file states end."""
        return min(self.melting_point_K, FORMULA_TO)

    def melting(self, name: str) -> str:
        """Say what happens to a material of this name above the temperature at which it melts."""
        return f"'{name}' melts" if self.melting_point_K < FORMULA_TO else super().melting(name)

    def thermal_conductivity(self, T: Array, thickness_um: Array | float) -> Evaluated:
        """Return κ (W cm⁻¹ K⁻¹), see `Kind.thermal_conductivity`."""
        if isinstance(self.kappa, StatedLaw):
            return self.property_at("kappa", T)
        if self.kappa is not None:
            return films.constant_conductivity(T, self.kappa)
        # no doping changes the electrical conductivity
        electrical = partial(self.electrical_conductivity, n=0.0)
        return films.wiedemann_franz(T, electrical, self.lorenz_ratio)

    def electrical_conductivity(self, T: Array, n: Array | float) -> Evaluated:
        """Return σ (S cm⁻¹), see `Kind.electrical_conductivity`."""
        if isinstance(self.resistivity, StatedLaw):
            return films.reciprocal(self.property_at("resistivity", T))
        return films.metal_conductivity(T, self.resistivity, self.tcr)

    def thermoelectric(self, T: Array, n: Array | float, carrier: silicon.Carrier) -> Evaluated:
        """Return β and γ, see `Kind.thermoelectric`."""
        S, by = self.property_at("seebeck", T)
        volts = 1e-6 * S, {name: 1e-6 * slope for name, slope in by.items()}
        return thermopower.of_one_carrier(self.electrical_conductivity(T, n), volts)


class Dielectric(Stored):
    """An insulator, which carries heat alone."""

    family: ClassVar = OF_DIELECTRIC
    conducts: ClassVar = False
    of_numbers: ClassVar = {"kappa": ("kappa_exponent",)}

    kind: Literal["dielectric"] = "dielectric"
    preset: str | None = Field(
        default=None, description="dielectric whose values those left out are"
    )
    kappa: float | StatedLaw = _number_or_law(OF_DIELECTRIC["kappa"])
    kappa_exponent: float | None = field_of(OF_DIELECTRIC["kappa_exponent"])
    kappa_scale: float | None = field_of(OF_DIELECTRIC["kappa_scale"], default=None)
    emissivity: float | StatedLaw = _number_or_law(OF_DIELECTRIC["emissivity"])

    @property
    def laws(self) -> tuple[Law | StatedLaw, ...]:
        """Of the thermal conductivity."""
        return (self.stated.get("kappa", films.dielectric_conductivity),)

    @property
    def melts_K(self) -> float:
        """Temperature (K) at which laws that no file states end."""
        return FORMULA_TO

    def thermal_conductivity(self, T: Array, thickness_um: Array | float) -> Evaluated:
        """Return κ (W cm⁻¹ K⁻¹), see `Kind.thermal_conductivity`."""
        if isinstance(self.kappa, StatedLaw):
            return self.property_at("kappa", T)
        return films.dielectric_conductivity(T, self.kappa, self.kappa_exponent)

    def electrical_conductivity(self, T: Array, n: Array | float) -> Evaluated:
        """Return σ (S cm⁻¹), zero."""
        nothing = 0.0 * T
        return nothing, {"T": nothing}

    def thermoelectric(self, T: Array, n: Array | float, carrier: silicon.Carrier) -> Evaluated:
        """Return β and γ, zero."""
        nothing = np.zeros((2, *T.shape))
        return nothing, {"T": nothing}


KINDS: dict[str, type[Kind]] = {
    kind.model_fields["kind"].default: kind
    for kind in (NSilicon, PSilicon, HighDopedSilicon, MetalFilm, Dielectric)
}
