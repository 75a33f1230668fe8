"""Kinds of films: metals, which carry heat and current, and dielectrics, which carry heat alone.

Where a kind has a number for a property, a section may state a law: a table or a formula, see
`hotlever.materials.stated`.
"""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
from pydantic import Field, GetPydanticSchema, model_validator

from hotlever.errors import InputError
from hotlever.materials.films import (
    constant_conductivity,
    dielectric_conductivity,
    metal_conductivity,
    reciprocal,
    wiedemann_franz,
)
from hotlever.materials.heat import enthalpy_by_capacity
from hotlever.materials.kind import Kind
from hotlever.materials.laws import FORMULA_TO, Evaluated, Law
from hotlever.materials.parameters import OF_DIELECTRIC, OF_METAL, Parameter, field_bounds, field_of
from hotlever.materials.silicon import MELTING_POINT, Carrier
from hotlever.materials.stated import StatedLaw, number_or_law
from hotlever.materials.thermopower import of_one_carrier
from hotlever.types import Array


def _law_of(parameter: Parameter, *, or_none: bool = False) -> GetPydanticSchema:
    """Return the annotation of a parameter that may be a law."""
    return number_or_law(field_bounds(parameter), or_none=or_none)


def _field_of(parameter: Parameter, **others: Any) -> Any:
    """Return the field of a parameter that may be a law; its annotation has the bounds."""
    return field_of(parameter, ge=None, le=None, **others)


class Stored(Kind):
    """What materials have in common whose heat capacity is a number or a stated law."""

    heat_capacity: Annotated[float | StatedLaw | None, number_or_law((0.5, 10.0), or_none=True)] = (
        Field(
            default=None,
            description="heat capacity (J cm⁻³ K⁻¹), which counts in time",
        )
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
        return enthalpy_by_capacity(T, self.heat_capacity)


class MetalFilm(Stored):
    """A metal film; the values of a bulk metal are where a fit may start."""

    family: ClassVar = OF_METAL
    of_numbers: ClassVar = {"resistivity": ("tcr",), "kappa": ()}

    kind: Literal["metal-film"] = "metal-film"
    preset: str | None = Field(default=None, description="metal whose values those left out are")
    resistivity: Annotated[float | StatedLaw, _law_of(OF_METAL["resistivity"])] = _field_of(
        OF_METAL["resistivity"]
    )
    tcr: float | None = field_of(OF_METAL["tcr"], default=None)
    resistivity_scale: float | None = field_of(OF_METAL["resistivity_scale"], default=None)
    lorenz_ratio: float = field_of(OF_METAL["lorenz_ratio"])
    kappa: Annotated[float | StatedLaw | None, _law_of(OF_METAL["kappa"], or_none=True)] = (
        _field_of(
            OF_METAL["kappa"],
            default=None,
            description="thermal conductivity (W cm⁻¹ K⁻¹); left out: by Wiedemann and Franz",
        )
    )
    kappa_scale: float | None = field_of(OF_METAL["kappa_scale"], default=None)
    seebeck: Annotated[float | StatedLaw, _law_of(OF_METAL["seebeck"])] = _field_of(
        OF_METAL["seebeck"]
    )
    emissivity: Annotated[float | StatedLaw, _law_of(OF_METAL["emissivity"])] = _field_of(
        OF_METAL["emissivity"]
    )
    melting_point_K: float = Field(
        default=MELTING_POINT, ge=400, le=4000, description="melting point (K)"
    )

    @model_validator(mode="after")
    def _a_number_has_a_coefficient(self) -> Self:
        if self.tcr is None and not isinstance(self.resistivity, StatedLaw):
            raise ValueError("tcr is missing")
        return self

    @property
    def parameters(self) -> dict[str, Parameter]:
        """Those of the parameters that count here."""
        own = super().parameters
        used = {name for law in self.stated.values() for name in law.names}
        if self.kappa is not None and "lorenz_ratio" not in used:
            del own["lorenz_ratio"]
        return own

    @property
    def laws(self) -> tuple[Law, ...]:
        """Of thermal and electrical conductivity."""
        stated, sigma = self.stated, metal_conductivity
        heat: Law = wiedemann_franz if self.kappa is None else constant_conductivity
        return stated.get("kappa", heat), stated.get("resistivity", sigma)

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
            return constant_conductivity(T, self.kappa)
        return wiedemann_franz(T, self._alone, self.lorenz_ratio)

    def electrical_conductivity(self, T: Array, n: Array | float) -> Evaluated:
        """Return σ (S cm⁻¹), see `Kind.electrical_conductivity`."""
        if isinstance(self.resistivity, StatedLaw):
            return reciprocal(self.property_at("resistivity", T))
        return metal_conductivity(T, self.resistivity, self.tcr)

    def _alone(self, T: Array) -> Evaluated:
        """Return σ (S cm⁻¹), which no doping changes."""
        return self.electrical_conductivity(T, 0.0)

    def thermoelectric(self, T: Array, n: Array | float, carrier: Carrier) -> Evaluated:
        """Return β and γ, see `Kind.thermoelectric`."""
        S, by = self.property_at("seebeck", T)
        volts = 1e-6 * S, {name: 1e-6 * slope for name, slope in by.items()}
        return of_one_carrier(self.electrical_conductivity(T, n), volts)


class Dielectric(Stored):
    """An insulator, which carries heat alone."""

    family: ClassVar = OF_DIELECTRIC
    conducts: ClassVar = False
    of_numbers: ClassVar = {"kappa": ("kappa_exponent",)}

    kind: Literal["dielectric"] = "dielectric"
    preset: str | None = Field(
        default=None, description="dielectric whose values those left out are"
    )
    kappa: Annotated[float | StatedLaw, _law_of(OF_DIELECTRIC["kappa"])] = _field_of(
        OF_DIELECTRIC["kappa"]
    )
    kappa_exponent: float | None = field_of(OF_DIELECTRIC["kappa_exponent"])
    kappa_scale: float | None = field_of(OF_DIELECTRIC["kappa_scale"], default=None)
    emissivity: Annotated[float | StatedLaw, _law_of(OF_DIELECTRIC["emissivity"])] = _field_of(
        OF_DIELECTRIC["emissivity"]
    )

    @property
    def laws(self) -> tuple[Law, ...]:
        """Of the thermal conductivity."""
        return (self.stated.get("kappa", dielectric_conductivity),)

    @property
    def melts_K(self) -> float:
        """Temperature (K) at which laws that no file states end."""
        return FORMULA_TO

    def thermal_conductivity(self, T: Array, thickness_um: Array | float) -> Evaluated:
        """Return κ (W cm⁻¹ K⁻¹), see `Kind.thermal_conductivity`."""
        if isinstance(self.kappa, StatedLaw):
            return self.property_at("kappa", T)
        return dielectric_conductivity(T, self.kappa, self.kappa_exponent)

    def electrical_conductivity(self, T: Array, n: Array | float) -> Evaluated:
        """Return σ (S cm⁻¹), zero."""
        nothing = 0.0 * T
        return nothing, {"T": nothing}

    def thermoelectric(self, T: Array, n: Array | float, carrier: Carrier) -> Evaluated:
        """Return β and γ, zero."""
        nothing = np.zeros((2, *T.shape))
        return nothing, {"T": nothing}
