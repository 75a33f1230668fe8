"""The states of a lever at its quadrature points: fields, fluxes, and the heat that they hold.

Each terminal gives its potential V one equation, and the leg end there the temperature at which the
chip holds it, the base temperature; or all of them one temperature, above it by ``chip_K_per_mW``
times the heat that enters the chip:

=======  =========================================  ===========================================
kind     what it is                                 equation of the potential
=======  =========================================  ===========================================
ground   wired to ground, nothing between           V = 0, no unknown
held     a supply of its own, of a voltage behind   one unknown, the same all over the contact;
         a resistor or of a current, or a ground    current into the lever I = J − G V
         behind a resistor (Norton)
sense    floating                                   no current density; V is the mean over it
swept    the supply that is swept                   V_l, the last unknown: a constraint selects
                                                    a state, or the circuit V_l + R_s I_h = V_b
=======  =========================================  ===========================================

Which terminals are what is a matter of the space, whose unknowns depend on it; what is behind them
and how warm the leg ends are is one of the circuit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from typing import Any, Self

import numpy as np

from hotlever.air.stores import HeatInAir
from hotlever.contact.law import ContactLaw, contact_of
from hotlever.lever.films import Rim
from hotlever.lever.laws import LawsAtPoints
from hotlever.lever.space import Space
from hotlever.lever.transport import (
    Fields,
    Fluxes,
    Motion,
    Properties,
    Tangent,
    fluxes_of,
    tangent_of,
)
from hotlever.materials import Kind
from hotlever.materials.air import kirchhoff_variable
from hotlever.materials.laws import Evaluated
from hotlever.probe import Probe
from hotlever.probe.circuit import Circuit
from hotlever.probe.surroundings import THE_PAPERS, Physics
from hotlever.types import Array
from hotlever.units import PER_CM_TO_MILLI_PER_UM


class Terminals:
    """What is wired to the terminals of a lever, in its equations; see the module's text.

    Parameters
    ----------
    space : Space
    circuit : Circuit

    Attributes
    ----------
    conductance : ndarray, shape (held,)
        G of the held terminals (mA/V).
    chip_mW_per_K : float
        Of the chip below the leg ends; infinite if it stays at the base temperature.
    source_mA : ndarray, shape (held,)
        J of the held terminals.
    end_rises : dict of str to float
        How much warmer than the base temperature leg ends are (K), if they are.
    """

    def __init__(self, space: Space, circuit: Circuit) -> None:
        self._space, self._held = space, np.array(list(space.held.values()), dtype=int)
        self.conductance, self.source_mA = circuit.norton(space.held)
        self.chip_mW_per_K = np.inf if space.chip is None else 1.0 / circuit.chip_K_per_mW
        self.end_rises = circuit.end_rises()

    def scaled(self, sources: float, rises: float) -> Terminals:
        """Return the same with so many times the sources, and the rises of leg ends."""
        other = copy(self)
        other.source_mA = sources * self.source_mA
        other.end_rises = {name: rises * rise for name, rise in self.end_rises.items()}
        return other

    @property
    def behind(self) -> Array:
        """The conductances behind all unknowns that have one, that of the chip last."""
        chip = [] if self._space.chip is None else [self.chip_mW_per_K]
        return np.append(self.conductance, chip)

    def add_heat_into_chip(self, weak: Array, x: Array, mW_per_K: float | None = None) -> None:
        """Add what the chip takes up of states or changes of them, or by another conductance."""
        if self._space.chip is None:
            return
        unknowns, weights = self._space.chip
        rise = np.tensordot(weights, x[unknowns], axes=1)
        heat = (self.chip_mW_per_K if mW_per_K is None else mW_per_K) * rise
        weak[unknowns] += np.multiply.outer(weights, heat)

    def add_currents(self, weak: Array, x: Array) -> None:
        """Add what held terminals take from states (size + 1, n), G V − J, to the balances there.

        Of an ideal supply both parts are large, so that the difference is taken first.
        """
        weak[self._held] += self._conducted(x) - self.source_mA[:, None]

    def add_current_changes(self, weak: Array, change: Array) -> None:
        """Do the same with changes of the unknowns, (size + 1, n) or (size + 1, n, k)."""
        weak[self._held] += self._conducted(change)

    def _conducted(self, x: Array) -> Array:
        conductance = self.conductance.reshape(-1, *(1,) * (x.ndim - 1))
        return np.asarray(conductance * x[self._held])

    def power(self, x: Array, into: Array) -> Array:
        """Return the power (mW) that supplies put into states, (n,), by the currents (mA) there.

        These are the weak form of the fluxes, (size + 1, n).
        """
        by_held = (x[self._held] * into[self._held]).sum(axis=0)
        return np.asarray(x[-1] * into[-1] + by_held)

    def warmed(self, T: Array, grad_T: Array) -> tuple[Array, Array]:
        """Return temperatures and slopes at the points with leg ends as warm as they are held."""
        for name, rise in self.end_rises.items():
            value, slope = np.split(self._space.end_tests[name][..., None], [1])
            T, grad_T = T + rise * value[0], grad_T + rise * slope
        return T, grad_T

    def warmed_by_base(self, fields: Fields) -> Fields:
        """Return how fields change with the base temperature: leg ends of their own stay."""
        warmer, slope = np.ones_like(fields.T), np.zeros_like(fields.grad_T)
        for name in self.end_rises:
            value, slopes = np.split(self._space.end_tests[name][..., None], [1])
            warmer, slope = warmer - value[0], slope - slopes
        return Fields(warmer, slope, np.zeros_like(fields.grad_V))


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

    def losses(self, x: Array, names: Sequence[str] = ()) -> dict[str, Evaluated]:
        """Return the heat that leaves at the points of ``rim`` and ``footprint`` (mW), (points, n).

        Each if it counts, with derivatives by ``T``, the temperature there, and by parameters.
        """
        every = {}
        if len(self.rim.weights):
            every["rim"] = (
                self.laws.radiated(self.rim, x, self.terminals.end_rises, names)
                if names
                else self._evaluated(x)[2]
            )
        if self.contact is not None:
            heat, by = self.contact.heat(self.footprint.rise(x), names)
            shares = self.footprint.weights
            every["footprint"] = shares * heat, {name: shares * by[name] for name in by}
        return every

    def _evaluated(
        self, x: Array
    ) -> tuple[Array, tuple[Fields, Properties, Properties], Evaluated]:
        """Return states and what the laws say of them."""
        # residual, Jacobian and derivatives are asked for at the same states one by one
        if self._latest is None or not np.array_equal(self._latest[0], x):
            fields = self.space.fields(x)
            T = self.base_temperature_K + fields.T
            T, grad_T = self.terminals.warmed(T, fields.grad_T)
            properties, by = self.properties(T)
            at_points = Fields(T, grad_T, fields.grad_V), properties, by["T"]
            by_rim = self.laws.radiated(self.rim, x, self.terminals.end_rises)
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
        _, by = self.laws.enthalpy(self.at(x)[0].T, names)
        _, by_cold = self.laws.enthalpy(cold, names)
        return self._only_heat(np.stack([by[name] - by_cold[name] for name in names], axis=-1))

    def _only_heat(self, heat: Array) -> Array:
        """Test a heat by area alone."""
        tested = self.space.temperature.values_tested(self.space.weighted(heat[None])[0])
        weak = np.zeros((self.space.size + 1, *heat.shape[1:]))
        weak[self.space.temperature.columns] = tested
        return weak
