"""What a lever is made of: kinds of material, each with its parameters and its laws.

A material of a kind gives thermal and electrical conductivity with exact derivatives by the
temperature, by its own parameters and, where it is doped, by the local doping. The laws are those
of the modules beside this one; here is said which kind follows which, and with which parameters.

A property that all materials have is a method of `Kind`, and a method of each family that says by
which law. A parameter is a row of `hotlever.materials.parameters` and a field of the kinds that
have it: what a fit may vary, probe files and ``[material]`` follow from these.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from hotlever.errors import InputError
from hotlever.materials.films import (
    constant_conductivity,
    dielectric_conductivity,
    metal_conductivity,
    wiedemann_franz,
)
from hotlever.materials.heat import enthalpy, enthalpy_by_capacity
from hotlever.materials.laws import FORMULA_TO, Evaluated, Law
from hotlever.materials.p_silicon import conductivity_p, inversion_temperature_p
from hotlever.materials.parameters import (
    OF_DIELECTRIC,
    OF_METAL,
    OF_SILICON,
    Parameter,
    field_of,
)
from hotlever.materials.radiation import grey_emission
from hotlever.materials.silicon import (
    MELTING_POINT,
    Carrier,
    conductivity_high_doped,
    conductivity_low_doped,
    inversion_temperature,
    thermal_conductivity,
    thermal_conductivity_of_layer,
)
from hotlever.materials.thermopower import (
    thermoelectric_high_doped,
    thermoelectric_metal,
    thermoelectric_n_silicon,
    thermoelectric_p_silicon,
)
from hotlever.records import Record
from hotlever.types import Array

#: In place of c_κ: κ follows from the thickness.
BY_THICKNESS = "thickness"
#: Share of its resistivity at 300 K that high-doped silicon has when it is colder.
_LEAST_LEFT = 0.1


class Kind(Record):
    """A material of one kind (section ``[materials.NAME]`` of a probe file)."""

    #: The parameters of its family, of which it has those that are its fields.
    family: ClassVar[dict[str, Parameter]]
    #: All parameters that one of this kind may have, by name.
    declared: ClassVar[dict[str, Parameter]]
    #: Those that a fit varies unless it is told otherwise.
    usual: ClassVar[tuple[str, ...]]
    #: Whether it carries a current.
    conducts: ClassVar[bool] = True

    kind: str
    emissivity: float

    @classmethod
    def __pydantic_init_subclass__(cls, **options: Any) -> None:
        """Find the parameters among the fields."""
        super().__pydantic_init_subclass__(**options)
        family = getattr(cls, "family", {})
        cls.declared = {name: family[name] for name in family if name in cls.model_fields}
        cls.usual = tuple(name for name, parameter in cls.declared.items() if parameter.usual)

    @property
    def parameters(self) -> dict[str, Parameter]:
        """Those of the declared parameters that are numbers here."""
        return {
            name: parameter
            for name, parameter in self.declared.items()
            if isinstance(getattr(self, name), float)
        }

    @property
    @abstractmethod
    def laws(self) -> tuple[Law, ...]:
        """Of thermal and, if it conducts, electrical conductivity."""

    @property
    def effects(self) -> tuple[Law, ...]:
        """Laws of what counts beyond the paper's physics."""
        return ()

    @property
    def highest_K(self) -> float:
        """Temperature (K) at which it melts or its laws end."""
        return MELTING_POINT

    def end(self, name: str) -> str:
        """Say what happens to a material of this name above its highest temperature."""
        return f"the laws of '{name}' end"

    def impossible(self, coldest_K: float) -> str:
        """Say why its laws make no sense from a temperature (K) on; empty if they do."""
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
        return grey_emission(T, self.emissivity, surroundings_K)

    @abstractmethod
    def enthalpy(self, T: Array) -> Evaluated:
        """Return the heat held above that at 298.15 K (J cm⁻³), with its derivatives.

        They are by ``T`` and by parameters.
        """


class Silicon(Kind):
    """What all kinds of silicon have in common."""

    family: ClassVar = OF_SILICON

    c_kappa: Annotated[float, field_of(OF_SILICON["c_kappa"])] | Literal["thickness"] = Field(
        union_mode="left_to_right",
        description=f'scale of the thermal conductivity; or "{BY_THICKNESS}": it follows from the '
        "thickness",
    )
    heat_capacity_scale: float = field_of(OF_SILICON["heat_capacity_scale"])
    scattering_exponent: float = field_of(OF_SILICON["scattering_exponent"])
    emissivity: float = field_of(OF_SILICON["emissivity"])

    def end(self, name: str) -> str:
        """Say what happens to a material of this name above its highest temperature."""
        return "silicon melts"

    @property
    def _heat(self) -> Law:
        by_thickness = self.c_kappa == BY_THICKNESS
        return thermal_conductivity_of_layer if by_thickness else thermal_conductivity

    def thermal_conductivity(self, T: Array, thickness_um: Array | float) -> Evaluated:
        """Return κ (W cm⁻¹ K⁻¹), see `Kind.thermal_conductivity`."""
        return self._heat(T, thickness_um if self.c_kappa == BY_THICKNESS else self.c_kappa)

    def enthalpy(self, T: Array) -> Evaluated:
        """Return the heat held (J cm⁻³), see `Kind.enthalpy`."""
        held, by = enthalpy(T)
        scale = self.heat_capacity_scale
        return scale * held, {"T": scale * by["T"], "heat_capacity_scale": held}


class Stored(Kind):
    """What materials have in common whose heat capacity is a number."""

    heat_capacity: float | None = Field(
        default=None,
        ge=0.5,
        le=10.0,
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
        return enthalpy_by_capacity(T, self.heat_capacity)


class LowDopedSilicon(Silicon):
    """Silicon whose carriers are those of its dopant and, when hot, its own."""

    #: Laws by temperature, doping, p and the impurity exponent; and where σ is least.
    conductivity: ClassVar[Law]
    inversion: ClassVar[Callable[..., Array]]
    #: Its law of thermoelectricity, by these and the scattering exponent; and the majority.
    seebeck: ClassVar[Law]
    carrier: ClassVar[Carrier]

    delta: float = field_of(OF_SILICON["delta"])
    n_d: float = field_of(OF_SILICON["n_d"])
    p: float = field_of(OF_SILICON["p"])
    impurity_exponent: float = field_of(OF_SILICON["impurity_exponent"])

    @property
    def laws(self) -> tuple[Law, ...]:
        """Of thermal and electrical conductivity."""
        return self._heat, type(self).conductivity

    def electrical_conductivity(self, T: Array, n: Array | float) -> Evaluated:
        """Return σ (S cm⁻¹), see `Kind.electrical_conductivity`."""
        return type(self).conductivity(T, n, self.p, self.impurity_exponent)

    @property
    def effects(self) -> tuple[Law, ...]:
        """Of thermoelectricity."""
        return (type(self).seebeck,)

    def thermoelectric(self, T: Array, n: Array | float, carrier: Carrier) -> Evaluated:
        """Return β and γ, see `Kind.thermoelectric`."""
        exponents = self.p, self.impurity_exponent, self.scattering_exponent
        return type(self).seebeck(T, n, *exponents)

    def inversion_temperature(self, n: Array | None = None) -> Array:
        """Return the temperature (K) at which the resistivity of a doping (cm⁻³) is highest.

        Of its own doping by default; NaN where there is none below 1700 K.
        """
        doping = self.n_d if n is None else n
        return type(self).inversion(doping, self.p, self.impurity_exponent)


class NSilicon(LowDopedSilicon):
    """Silicon doped with phosphorus, as in the paper."""

    conductivity: ClassVar = conductivity_low_doped
    inversion: ClassVar = inversion_temperature
    seebeck: ClassVar = thermoelectric_n_silicon
    carrier: ClassVar = "electron"

    kind: Literal["n-silicon"] = "n-silicon"


class PSilicon(LowDopedSilicon):
    """Silicon doped with boron."""

    conductivity: ClassVar = conductivity_p
    inversion: ClassVar = inversion_temperature_p
    seebeck: ClassVar = thermoelectric_p_silicon
    carrier: ClassVar = "hole"

    kind: Literal["p-silicon"] = "p-silicon"


class HighDopedSilicon(Silicon):
    """Quasi-metallic silicon; its dopant diffuses into low-doped silicon beside it."""

    kind: Literal["high-doped-silicon"] = "high-doped-silicon"
    a0: float = field_of(OF_SILICON["a0"])
    a1: float = field_of(OF_SILICON["a1"])
    n_hd: float = field_of(OF_SILICON["n_hd"])

    def impossible(self, coldest_K: float) -> str:
        """Say that the straight line of Eq. 11 falls to nothing below 300 K, if it does."""
        resistivity = self.a0 + self.a1 * (coldest_K - 300.0)
        if resistivity >= _LEAST_LEFT * self.a0:
            return ""
        return (
            f"a0 = {self.a0:g} and a1 = {self.a1:g} give a resistivity of {resistivity:.3g} Ω cm "
            f"at {coldest_K:g} K, expected more than {_LEAST_LEFT:g} of a0"
        )

    @property
    def laws(self) -> tuple[Law, ...]:
        """Of thermal and electrical conductivity."""
        return self._heat, conductivity_high_doped

    def electrical_conductivity(self, T: Array, n: Array | float) -> Evaluated:
        """Return σ (S cm⁻¹), see `Kind.electrical_conductivity`."""
        return conductivity_high_doped(T, self.a0, self.a1)

    @property
    def effects(self) -> tuple[Law, ...]:
        """Of thermoelectricity."""
        return (thermoelectric_high_doped,)

    def thermoelectric(self, T: Array, n: Array | float, carrier: Carrier) -> Evaluated:
        """Return β and γ, see `Kind.thermoelectric`."""
        own = self.a0, self.a1, self.n_hd, self.scattering_exponent
        return thermoelectric_high_doped(T, *own, carrier)


class MetalFilm(Stored):
    """A metal film; the values of a bulk metal are where a fit may start."""

    family: ClassVar = OF_METAL

    kind: Literal["metal-film"] = "metal-film"
    preset: str | None = Field(default=None, description="metal whose values those left out are")
    resistivity: float = field_of(OF_METAL["resistivity"])
    tcr: float = field_of(OF_METAL["tcr"])
    lorenz_ratio: float = field_of(OF_METAL["lorenz_ratio"])
    kappa: float | None = field_of(
        OF_METAL["kappa"],
        default=None,
        description="thermal conductivity (W cm⁻¹ K⁻¹); left out: by Wiedemann and Franz",
    )
    seebeck: float = field_of(OF_METAL["seebeck"])
    emissivity: float = field_of(OF_METAL["emissivity"])
    melting_point_K: float = Field(default=MELTING_POINT, ge=400, le=4000, description="K")

    @property
    def parameters(self) -> dict[str, Parameter]:
        """Those of the declared parameters that count here."""
        other = "kappa" if self.kappa is None else "lorenz_ratio"
        return {name: parameter for name, parameter in self.declared.items() if name != other}

    @property
    def laws(self) -> tuple[Law, ...]:
        """Of thermal and electrical conductivity."""
        heat = wiedemann_franz if self.kappa is None else constant_conductivity
        return heat, metal_conductivity

    @property
    def highest_K(self) -> float:
        """Temperature (K) at which it melts or its laws end."""
        return min(self.melting_point_K, FORMULA_TO)

    def end(self, name: str) -> str:
        """Say what happens to a material of this name above its highest temperature."""
        return f"'{name}' melts" if self.melting_point_K < FORMULA_TO else super().end(name)

    def thermal_conductivity(self, T: Array, thickness_um: Array | float) -> Evaluated:
        """Return κ (W cm⁻¹ K⁻¹), see `Kind.thermal_conductivity`."""
        if self.kappa is not None:
            return constant_conductivity(T, self.kappa)
        return wiedemann_franz(T, self.resistivity, self.tcr, self.lorenz_ratio)

    def electrical_conductivity(self, T: Array, n: Array | float) -> Evaluated:
        """Return σ (S cm⁻¹), see `Kind.electrical_conductivity`."""
        return metal_conductivity(T, self.resistivity, self.tcr)

    def thermoelectric(self, T: Array, n: Array | float, carrier: Carrier) -> Evaluated:
        """Return β and γ, see `Kind.thermoelectric`."""
        return thermoelectric_metal(T, self.resistivity, self.tcr, self.seebeck)


class Dielectric(Stored):
    """An insulator, which carries heat alone."""

    family: ClassVar = OF_DIELECTRIC
    conducts: ClassVar = False

    kind: Literal["dielectric"] = "dielectric"
    preset: str | None = Field(
        default=None, description="dielectric whose values those left out are"
    )
    kappa: float = field_of(OF_DIELECTRIC["kappa"])
    kappa_exponent: float = field_of(OF_DIELECTRIC["kappa_exponent"])
    emissivity: float = field_of(OF_DIELECTRIC["emissivity"])

    @property
    def laws(self) -> tuple[Law, ...]:
        """Of the thermal conductivity."""
        return (dielectric_conductivity,)

    @property
    def highest_K(self) -> float:
        """Temperature (K) at which its laws end."""
        return FORMULA_TO

    def thermal_conductivity(self, T: Array, thickness_um: Array | float) -> Evaluated:
        """Return κ (W cm⁻¹ K⁻¹), see `Kind.thermal_conductivity`."""
        return dielectric_conductivity(T, self.kappa, self.kappa_exponent)

    def electrical_conductivity(self, T: Array, n: Array | float) -> Evaluated:
        """Return σ (S cm⁻¹), zero."""
        nothing = 0.0 * T
        return nothing, {"T": nothing}

    def thermoelectric(self, T: Array, n: Array | float, carrier: Carrier) -> Evaluated:
        """Return β and γ, zero."""
        nothing = np.zeros((2, *T.shape))
        return nothing, {"T": nothing}


KINDS: dict[str, type[Kind]] = {
    kind.model_fields["kind"].default: kind
    for kind in (NSilicon, PSilicon, HighDopedSilicon, MetalFilm, Dielectric)
}
