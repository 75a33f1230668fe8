"""The states of a lever at its quadrature points: fields, fluxes, and the heat that they hold."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from typing import Any, NamedTuple, Self

import numpy as np

from hotlever.air.stores import HeatInAir
from hotlever.contact.law import ContactLaw, contact_of
from hotlever.lever.laws import LawsAtPoints
from hotlever.lever.motion import Motion
from hotlever.lever.radiation import RimRadiation
from hotlever.lever.rim import Rim
from hotlever.lever.space import Fields, Fluxes, Space, Tangent
from hotlever.lever.terminals import Terminals
from hotlever.lever.transport import Properties, fluxes_of, tangent_of
from hotlever.materials import Kind
from hotlever.materials.air import kirchhoff_variable
from hotlever.materials.laws import Evaluated
from hotlever.probe import Probe
from hotlever.probe.circuit import Circuit
from hotlever.probe.physics import THE_PAPERS, Physics
from hotlever.types import Array
from hotlever.units import PER_CM_TO_MILLI_PER_UM


class Radiated(NamedTuple):
    """What radiates: faces at the quadrature points (mW/µm²), and the points of the rim (mW)."""

    faces: Array
    by_rim: Array


class StatesAtPoints:
    """Fields, fluxes and heat of states of one lever of some materials, in its circuit.

    Parameters
    ----------
    space : Space
    materials : mapping of str to Kind
        What it is made of, by name.
    circuit : Circuit
        What is wired to the terminals, and how warm they are.
    physics : Physics, optional
        The effects that count; those of the paper by default.
    motions : mapping of str to Motion, optional
        Of the dimensions by which derivatives may be asked for.
    laws : type of LawsAtPoints
        How the laws are evaluated.
    contact : ContactLaw, optional
        What a tip takes that touches a sample.

    Raises
    ------
    ComputationError
        As `LawsAtPoints`.

    Attributes
    ----------
    terminals : Terminals
        What is wired to the lever, in its equations.
    laws : LawsAtPoints
    rim : Rim
        What radiates where the mesh ends; nothing without radiation.
    footprint : Rim
        Where heat enters a tip in contact; nothing without.
    scale, step_limit : ndarray, shape (size + 1, 1)
        For Newton's method: the size of one unit of each unknown, by which kelvin and volts
        compare, and the largest step.
    """

    def __init__(
        self,
        space: Space,
        materials: Mapping[str, Kind],
        circuit: Circuit,
        physics: Physics = THE_PAPERS,
        motions: Mapping[str, Motion] | None = None,
        laws: type[LawsAtPoints] = LawsAtPoints,
        contact: ContactLaw | None = None,
    ) -> None:
        self.space, self.materials, self.motions = space, materials, motions or {}
        self.circuit, self.base_temperature_K = circuit, circuit.base_temperature_K
        self.terminals = Terminals(space, circuit)
        self.laws = laws(space, materials, self.base_temperature_K, physics, self.motions)
        self.rim = space.rim if physics.radiation else Rim.nothing(space.size)
        self._radiation = RimRadiation(
            self.rim, materials, circuit.base_temperature_K, self.motions
        )
        self.contact = contact
        self.footprint = Rim.nothing(space.size) if contact is None else space.footprint
        self._polarity = 1.0
        self._latest: tuple[Array, tuple[Fields, Properties, Properties], Evaluated] | None = None
        self.scale = np.where(space.is_temperature, 1.0, 0.01)[:, None]
        self.step_limit = np.where(space.is_temperature, 60.0, 5.0)[:, None]

    @classmethod
    def of_probe(cls, space: Space, probe: Probe, **options: Any) -> Self:
        """Return those of a probe's materials, circuit, physics and contact; options as above."""
        options = {"contact": contact_of(probe), **options}
        return cls(space, probe.kinds, probe.circuit, probe.physics, **options)

    def at(self, x: Array) -> tuple[Fields, Properties, Properties]:
        """Return fields of states (size + 1, n), properties and those by T, at the points."""
        return self._evaluated(x)[1]

    def by_rim(self, x: Array, names: Sequence[str] = ()) -> Evaluated:
        """Return what the rim radiates, see `hotlever.lever.radiation`."""
        if names:
            return self._radiation.heat(x, self.terminals.end_rises, names)
        return self._evaluated(x)[2]

    def into_tip(self, x: Array, names: Sequence[str] = ()) -> Evaluated:
        """Return the heat that enters the tip at the points of its footprint (mW), (points, n).

        With its derivatives by ``T``, the temperature there, and by parameters.
        """
        rise, shares = self.footprint.rise(x), self.footprint.weights
        if self.contact is None:
            return rise, dict.fromkeys(("T", *names), rise)
        heat, by = self.contact.heat(rise, names)
        return shares * heat, {name: shares * slope for name, slope in by.items()}

    def losses(self, x: Array, names: Sequence[str] = ()) -> dict[str, Evaluated]:
        """Return what leaves at the points of ``rim`` and ``footprint``, of those that count."""
        every = {"rim": (self.rim, self.by_rim), "footprint": (self.footprint, self.into_tip)}
        return {name: leaves(x, names) for name, (at, leaves) in every.items() if len(at.weights)}

    def _evaluated(
        self, x: Array
    ) -> tuple[Array, tuple[Fields, Properties, Properties], Evaluated]:
        """Return states and what the laws say of them."""
        # residual, Jacobian and derivatives are asked for at the same states one by one
        if self._latest is None or not np.array_equal(self._latest[0], x):
            moved = self.space.fields(x)
            T = self.base_temperature_K + moved.T
            T, grad_T = self.terminals.warmed(T, moved.grad_T)
            properties, by = self.properties(T)
            at_points = Fields(T, grad_T, moved.grad_V), properties, by["T"]
            by_rim = self._radiation.heat(x, self.terminals.end_rises)
            self._latest = x.copy(), at_points, by_rim
        return self._latest

    def properties(
        self, T: Array, names: Sequence[str] = ("T",)
    ) -> tuple[Properties, dict[str, Properties]]:
        """Return what the laws say at temperatures, and derivatives; see `LawsAtPoints`.

        With all potentials reversed the carriers have the other sign.
        """
        total, by = self.laws.properties(T, names)
        if self._polarity > 0:
            return total, by
        return total.reversed(), {name: each.reversed() for name, each in by.items()}

    @property
    def is_even(self) -> bool:
        """Whether opposite biases make the same temperatures."""
        return self.circuit.starts_cold and not self.laws.physics.thermoelectric

    def nodal_rises(self, x: Array) -> Array:
        """Return the rises of the temperature (K) of states at all nodes, (nodes, n)."""
        return self.space.nodal_rises(x, self.terminals.end_rises)

    def highest_rise(self, x: Array) -> Array:
        """Return the highest rise of the temperature (K) in states, between the nodes too, (n,)."""
        return self.space.elements.highest(self.nodal_rises(x))

    def driven(self, share: float) -> Self:
        """Return the same with held supplies and warmer leg ends at a share of their values."""
        return self._at(self.terminals.scaled(share, share))

    @property
    def mirrored(self) -> Self:
        """The same with all potentials reversed."""
        other = self._at(self.terminals.scaled(-1.0, 1.0))
        other._polarity = -self._polarity
        return other

    def _at(self, terminals: Terminals) -> Self:
        other = copy(self)
        other.terminals, other._latest = terminals, None
        return other

    def fluxes(self, x: Array) -> Fluxes:
        """Return what the weak equations test."""
        fields, properties, _ = self.at(x)
        return fluxes_of(fields, properties)

    def tangent(self, x: Array) -> Tangent:
        """Return how the fluxes of states change with their fields, to first order."""
        return tangent_of(*self.at(x))

    def radiated(self, x: Array) -> Radiated:
        """Return what states radiate."""
        faces = self.at(x)[1].emission
        if faces is None:
            faces = np.zeros((len(self.space.weights), x.shape[1]))
        return Radiated(faces, self.by_rim(x)[0])

    def radiated_change(self, x: Array, change: Array) -> Radiated:
        """Return how `radiated` changes with one change of each state."""
        by_T = self.at(x)[2].emission
        rise = self.space.temperature.at_points(change)[0]
        faces = np.zeros_like(rise) if by_T is None else by_T * rise
        return Radiated(faces, self.by_rim(x)[1]["T"] * self.rim.rise(change))

    def kirchhoff(self, x: Array) -> tuple[Array, Array]:
        """Return θ (mW/µm) and κ (mW/(K µm)) of the gas at the sites of the air operator."""
        base = self.base_temperature_K
        rise = self.space.air.rise(x)
        if not rise.size:
            return rise, rise
        theta, by = kirchhoff_variable(base + rise, base)
        unit = PER_CM_TO_MILLI_PER_UM * self.space.air.gas_conductivity
        return unit * theta, unit * by["T"]

    @property
    def heat_in_air(self) -> HeatInAir:
        """Heat that the air takes up itself; nothing in vacuum, or where that is not known."""
        stores: HeatInAir = self.space.air.stores
        return stores

    def storage(self, x: Array) -> Array:
        """Return the heat stored in states (nJ), tested as the balance is, (size + 1, n).

        In time the balance is what it loses per µs.
        """
        return self._only_heat(self.laws.heat_density(self.at(x)[0].T)[0])

    def storage_change(self, x: Array, change: Array) -> Array:
        """Return how `storage` changes by one change of each state, or by several."""
        by_T = self.laws.heat_density(self.at(x)[0].T)[1]
        rise = self.space.temperature.at_points(change)[0]
        heat = (by_T if change.ndim == 2 else by_T[..., None]) * rise
        return self._only_heat(heat)

    def storage_by_parameter(self, x: Array, names: Sequence[str]) -> Array:
        """Return how `storage` changes with parameters of materials, (size + 1, n, k)."""
        cold = np.full_like(self.space.weights, self.base_temperature_K)
        by = self.laws.enthalpy_by(self.at(x)[0].T, names) - self.laws.enthalpy_by(cold, names)
        return self._only_heat(by)

    def _only_heat(self, heat: Array) -> Array:
        """Test a heat by area alone."""
        tested = self.space.temperature.values_tested(self.space.weighted(heat[None])[0])
        weak = np.zeros((self.space.size + 1, *heat.shape[1:]))
        weak[self.space.temperature.columns] = tested
        return weak
