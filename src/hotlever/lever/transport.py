"""Constitutive relations: the fluxes of heat and charge that fields drive.

Of the slopes of temperature and potential, turned round, both tested with ∇φ::

    −J = σ ∇V + β ∇T,    −q = κ ∇T + T (β ∇V + γ ∇T),

and the heat source, tested with φ: what the surface radiates less the heat made, −J·∇V. Without
thermoelectricity β and γ are nothing and the heat made is Joule's. With it Peltier and Thomson heat
are parts of these terms (L. Onsager, Phys. Rev. 37, 405 (1931); Kelvin's relation is the same β in
both fluxes). All are linear in the properties, so that the change of fluxes with a parameter is the
fluxes of the properties' derivatives.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from dataclasses import fields as fields_of
from typing import Self

import numpy as np

from hotlever.lever.space import Fields, Fluxes, Tangent, Thermoelectric
from hotlever.probe.physics import Physics
from hotlever.types import Array


@dataclass(frozen=True)
class Properties:
    """Properties of the sheet at the quadrature points, thickness included, or changes of them.

    Attributes
    ----------
    kappa, sigma : ndarray, shape (points, n)
        Conductivities (mW/K and mA/V).
    beta, gamma : ndarray, or None
        Σ σ S (mA/K) and Σ σ S² (mW/K²) of what conducts beside each other; None without
        thermoelectricity.
    emission : ndarray, or None
        What the faces radiate, less what they take up (mW/µm²); None without radiation.
    """

    kappa: Array
    sigma: Array
    beta: Array | None = None
    gamma: Array | None = None
    emission: Array | None = None

    @classmethod
    def zero(cls, shape: tuple[int, ...], physics: Physics) -> Self:
        """Return those of nothing, with the effects that count."""
        names = ["kappa", "sigma"]
        names += ["beta", "gamma"] if physics.thermoelectric else []
        names += ["emission"] if physics.radiation else []
        return cls(**{name: np.zeros(shape) for name in names})

    def reversed(self) -> Properties:
        """Return those of carriers of the other sign."""
        return self if self.beta is None else replace(self, beta=-self.beta)

    @property
    def named(self) -> dict[str, Array]:
        """Those that count, by name."""
        names = [field.name for field in fields_of(self)]
        return {name: value for name in names if (value := getattr(self, name)) is not None}


def fluxes_of(fields: Fields, properties: Properties) -> Fluxes:
    """Return the fluxes that fields drive, see the module's text."""
    charge = properties.sigma * fields.grad_V
    heat = properties.kappa * fields.grad_T
    if properties.beta is not None and properties.gamma is not None:
        charge += properties.beta * fields.grad_T
        carried = properties.beta * fields.grad_V + properties.gamma * fields.grad_T
        heat += fields.T * carried
    source = -dot(charge, fields.grad_V)
    if properties.emission is not None:
        source += properties.emission
    return Fluxes(source, heat, charge)


def tangent_of(fields: Fields, properties: Properties, by_T: Properties) -> Tangent:
    """Return how fluxes change with the fields, by properties and their derivatives by T."""
    changes = fluxes_of(fields, by_T)
    kappa, thermoelectric = properties.kappa, None
    source_V, heat_T = -2.0 * properties.sigma * fields.grad_V, changes.heat
    beta, gamma = properties.beta, properties.gamma
    if beta is not None and gamma is not None:
        peltier = fields.T * beta
        source_V -= beta * fields.grad_T
        heat_T = heat_T + beta * fields.grad_V + gamma * fields.grad_T
        kappa = kappa + fields.T * gamma
        thermoelectric = Thermoelectric(-beta * fields.grad_V, peltier, beta)
    return Tangent(
        heat_source_T=changes.heat_source,
        heat_flux_T=heat_T,
        kappa=kappa,
        heat_source_V=source_V,
        charge_flux_T=changes.charge,
        sigma=properties.sigma,
        thermoelectric=thermoelectric,
    )


def dot(first: Array, second: Array) -> Array:
    """Return the products of vectors (dimension, points, n)."""
    return np.einsum("dpn,dpn->pn", first, second)
