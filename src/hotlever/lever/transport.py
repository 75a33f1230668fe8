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

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from dataclasses import fields as fields_of
from typing import Any, Self

import numpy as np

from hotlever.probe.surroundings import Physics
from hotlever.types import Array


@dataclass(frozen=True)
class Fields:
    """Temperature and potential of some states at the quadrature points.

    Attributes
    ----------
    T : ndarray, shape (points, n)
        K.
    grad_T, grad_V : ndarray, shape (dimension, points, n)
        K/µm and V/µm. Of k changes of each state the shapes end in (n, k).
    """

    T: Array
    grad_T: Array
    grad_V: Array


@dataclass(frozen=True)
class Fluxes:
    """What the weak equations test at the quadrature points, or changes of it.

    Attributes
    ----------
    heat_source : ndarray, shape (points, n)
        Tested with φ; the heat made is negative.
    heat : ndarray, shape (dimension, points, n)
        The heat flux turned round, κ ∇T and what the current carries, tested with ∇φ.
    charge : ndarray, shape (dimension, points, n)
        The current density turned round, σ ∇V and what ∇T drives, tested with ∇φ.
    """

    heat_source: Array
    heat: Array
    charge: Array

    def __add__(self, other: Fluxes) -> Fluxes:
        return Fluxes(*(mine + its for mine, its in zip(self, other, strict=True)))

    def __iter__(self) -> Iterator[Array]:
        return iter((self.heat_source, self.heat, self.charge))

    def tested(self, tests: Fields, weights: Array) -> Array:
        """Return the sums over the points, with weights (points, 1), for m tests each, (n, m)."""
        source, heat, charge = (weights * flux for flux in self)
        return np.asarray(
            np.einsum("pn,pnm->nm", source, tests.T)
            + np.einsum("dpn,dpnm->nm", heat, tests.grad_T)
            + np.einsum("dpn,dpnm->nm", charge, tests.grad_V)
        )


@dataclass(frozen=True)
class Tangent:
    """Coefficients of the linearised equations at the quadrature points, shapes (..., points, n).

    The names say test function, then trial function: ``heat_source_V`` is how the heat equation
    changes with the potential. Heat: ∫ φ a ψ + ∇φ·b ψ + κ ∇φ·∇ψ for a temperature ψ and
    ∫ φ c·∇ψ for a potential ψ; charge: ∫ ∇φ·d ψ for a temperature and σ ∇φ·∇ψ for a potential.

    Thermoelectricity adds ∫ φ e·∇ψ, f ∇φ·∇ψ and g ∇φ·∇ψ, the last three: of the heat source with
    the slope of the temperature, of the heat flux with that of the potential, and of the current
    density with that of the temperature. They are None without.
    """

    heat_source_T: Array
    heat_flux_T: Array
    kappa: Array
    heat_source_V: Array
    charge_flux_T: Array
    sigma: Array
    heat_source_slope: Array | None = None
    heat_V: Array | None = None
    charge_T: Array | None = None

    def of(self, state: int) -> Tangent:
        """Return the coefficients of one state."""
        return self._each(lambda coefficient: coefficient[..., state])

    def _each(self, of: Callable[[Array], Array]) -> Tangent:
        each: dict[str, Any] = {k: v if v is None else of(v) for k, v in vars(self).items()}
        return Tangent(**each)

    def fluxes(self, changes: Fields) -> Fluxes:
        """Return the changes of the fluxes with one change of each state, or with several."""
        at = self
        if changes.T.ndim > self.sigma.ndim:
            at = self._each(lambda coefficient: coefficient[..., None])
        source = at.heat_source_T * changes.T + (at.heat_source_V * changes.grad_V).sum(axis=0)
        heat = at.heat_flux_T * changes.T + at.kappa * changes.grad_T
        charge = at.charge_flux_T * changes.T + at.sigma * changes.grad_V
        if at.heat_source_slope is not None:
            source = source + (at.heat_source_slope * changes.grad_T).sum(axis=0)
        if at.heat_V is not None:
            heat = heat + at.heat_V * changes.grad_V
        if at.charge_T is not None:
            charge = charge + at.charge_T * changes.grad_T
        return Fluxes(source, heat, charge)


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
        names += ["emission"] if physics.at_surface else []
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


def weights_of_properties(
    fields: Fields, tests: Fields, physics: Physics, weights: Array
) -> Properties:
    """Return what each property counts for in m tests of each state's fluxes, (points, n, m).

    The sum over points of property times weight, for all properties, is `Fluxes.tested`.
    """
    T, grad_T, grad_V = (each[..., None] for each in (fields.T, fields.grad_T, fields.grad_V))
    along_V = (grad_T * tests.grad_V).sum(axis=0), (grad_V * tests.grad_V).sum(axis=0)
    along_T = (grad_T * tests.grad_T).sum(axis=0), (grad_V * tests.grad_T).sum(axis=0)
    at = weights[..., None]
    found = Properties(
        kappa=at * along_T[0], sigma=at * (along_V[1] - tests.T * (grad_V**2).sum(axis=0))
    )
    if physics.thermoelectric:
        beta = along_V[0] - tests.T * (grad_T * grad_V).sum(axis=0) + T * along_T[1]
        found = replace(found, beta=at * beta, gamma=at * T * along_T[0])
    return replace(found, emission=at * tests.T) if physics.at_surface else found


def tangent_of(fields: Fields, properties: Properties, by_T: Properties) -> Tangent:
    """Return how fluxes change with the fields, by properties and their derivatives by T."""
    changes = fluxes_of(fields, by_T)
    plain = Tangent(
        heat_source_T=changes.heat_source,
        heat_flux_T=changes.heat,
        kappa=properties.kappa,
        heat_source_V=-2.0 * properties.sigma * fields.grad_V,
        charge_flux_T=changes.charge,
        sigma=properties.sigma,
    )
    beta, gamma = properties.beta, properties.gamma
    if beta is None or gamma is None:
        return plain
    return replace(
        plain,
        heat_flux_T=plain.heat_flux_T + beta * fields.grad_V + gamma * fields.grad_T,
        kappa=plain.kappa + fields.T * gamma,
        heat_source_V=plain.heat_source_V - beta * fields.grad_T,
        heat_source_slope=-beta * fields.grad_V,
        heat_V=fields.T * beta,
        charge_T=beta,
    )


def dot(first: Array, second: Array) -> Array:
    """Return the products of vectors (dimension, points, n)."""
    return np.einsum("dpn,dpn->pn", first, second)


@dataclass(frozen=True)
class Motion:
    """Rates at the quadrature points, per unit of a dimension by which the mesh moves.

    At a point that moves with its element the values of a field stay, its slopes are strained, and
    the weight of the point grows with the element: all that is needed for exact derivatives.

    Attributes
    ----------
    strain : ndarray, shape (dimension, dimension, points)
        Derivative of the velocity's component i (first axis) along j.
    swelling : ndarray, shape (points, 1)
        Of the weights, relative.
    thickening_um : tuple of ndarray, shape (k, 1)
        Of each film of the space (µm).
    plate_um : ndarray, shape (points, 1)
        Of the plate as the air sees it (µm).
    distances : tuple of ndarray, shape (borders, k, 1)
        Of those of each film.
    tip : ndarray, shape (nodes,)
        Of the weights that give the rise of the tip temperature.
    rim : tuple of ndarray, shape (k, 1)
        Of the surface at the points of each film of a `layers_at_points.Rim`, over their weights.
    """

    strain: Array
    swelling: Array
    thickening_um: tuple[Array, ...]
    plate_um: Array
    distances: tuple[Array, ...]
    tip: Array
    rim: tuple[Array, ...]

    def strained(self, gradient: Array) -> Array:
        """Return how slopes (dimension, points, n) change, the values being the same."""
        return -self._contracted(self.strain.swapaxes(0, 1), gradient)

    def pulled(self, flux: Array) -> Array:
        """Return how a flux (dimension, points, n) changes what it is tested with.

        Its points grow, and the slopes of the test functions are strained.
        """
        return self.swelling * flux - self._contracted(self.strain, flux)

    def _contracted(self, strain: Array, vectors: Array) -> Array:
        return (strain[..., None] * vectors[None]).sum(axis=1)

    def of_fluxes(self, fields: Fields, fluxes: Fluxes, tangent: Tangent) -> Fluxes:
        """Return how fluxes change with the dimension, conductivities (points, n) being the same.

        The tangent is that of the fluxes.
        """
        slopes = self.strained(fields.grad_T), self.strained(fields.grad_V)
        strained = tangent.fluxes(Fields(np.zeros_like(fields.T), *slopes))
        return Fluxes(
            self.swelling * fluxes.heat_source + strained.heat_source,
            self.pulled(fluxes.heat) + strained.heat,
            self.pulled(fluxes.charge) + strained.charge,
        )
