"""The coupled electro-thermal equations of a lever, and where its heat and charge go.

Heat (paper's first equation, with the sign corrected) and charge::

    −∇·(κ ∇T) = σ |∇V|² − heat lost to air,    ∇·(σ ∇V) = 0,

and, where a probe asks for them, what the current carries and the surface radiates
(`hotlever.lever.transport`),

with what is wired to the terminals (`Terminals`). One more condition, the
*constraint*, selects a state: its tip temperature. What is behind the swept supply does not enter:
what a lever shows at a tip temperature does not depend on it. Units are µm, V, mA, mW and K.
Several states stand side by side, see `hotlever.lever.space`.

The loss to air is linear in θ = ∫κ_air dT on the surface (`hotlever.air.operator`). The air
operator fills the plate itself with air too; κ is therefore κ_Si − κ_air where there is air.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import replace
from typing import Any

import numpy as np

from hotlever.air.stores import HeatInAir
from hotlever.contact.law import ContactLaw, contact_of
from hotlever.lever.full_space import FullSpace
from hotlever.lever.laws_at_points import LawsAtPoints
from hotlever.lever.layers_at_points import Rim
from hotlever.lever.newton import refined
from hotlever.lever.space import LEVER, TIP, Constraint, Factors, Space, SurfaceTangent
from hotlever.lever.transport import (
    Fields,
    Fluxes,
    Motion,
    Properties,
    Tangent,
    fluxes_of,
    tangent_of,
    weights_of_properties,
)
from hotlever.materials import Kind
from hotlever.materials.air import kirchhoff_variable
from hotlever.materials.laws import Evaluated
from hotlever.probe import Probe
from hotlever.probe.circuit import Circuit, Wiring
from hotlever.probe.surroundings import Physics
from hotlever.types import Array, Index
from hotlever.units import PER_CM_TO_MILLI_PER_UM

#: What an instrument shows of a state, in the order of `LeverEquations.observed`.
ELECTRICAL_OUTPUTS = ("lever_V", "current_mA", "reader_V")
#: What `balance_columns` returns: heat made in heater and legs (mW; NaN without legs), current to
#: ground (mA), heat through the leg ends, into the air, radiated and into a tip in contact (mW).
BALANCES = (
    "heater_mW",
    "leg1_mW",
    "leg2_mW",
    "ground_current_mA",
    "end_heat_mW",
    "air_heat_mW",
    "radiated_mW",
    "into_tip_mW",
)


class LeverEquations:
    """Residual, Jacobian and derivatives of one lever of some materials, in its circuit.

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
        physics: Physics | None = None,
        motions: Mapping[str, Motion] | None = None,
        laws: type[LawsAtPoints] = LawsAtPoints,
        contact: ContactLaw | None = None,
    ) -> None:
        physics = physics or Physics()  # of the paper
        self.space, self.materials, self.motions = space, materials, motions or {}
        self.circuit, self.base_temperature_K = circuit, circuit.base_temperature_K
        self.terminals = Terminals(space, circuit)
        self.laws = laws(space, materials, self.base_temperature_K, physics, self.motions)
        self.rim = space.rim if physics.at_surface else Rim.nothing(space.size)
        self.contact = contact
        self.footprint = Rim.nothing(space.size) if contact is None else space.footprint
        self._polarity = 1.0
        self._latest: tuple[Array, tuple[Fields, Properties, Properties], Evaluated] | None = None
        self._stored: tuple[Array, tuple[Array, Array]] | None = None
        self.scale = np.where(space.is_temperature, 1.0, 0.01)[:, None]
        self.step_limit = np.where(space.is_temperature, 60.0, 5.0)[:, None]

    @classmethod
    def of_probe(cls, space: Space, probe: Probe, **options: Any) -> LeverEquations:
        """Return those of a probe's materials, circuit, physics and contact; options as above."""
        options = {"contact": contact_of(probe), **options}
        return cls(space, probe.kinds, probe.circuit, probe.physics, **options)

    # --- fields, fluxes and heat at the points ------------------------------------------------

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

    def driven(self, share: float) -> LeverEquations:
        """Return the same with held supplies and warmer leg ends at a share of their values."""
        return self._at(self.terminals.scaled(share, share))

    @property
    def mirrored(self) -> LeverEquations:
        """The same with all potentials reversed."""
        other = self._at(self.terminals.scaled(-1.0, 1.0))
        other._polarity = -self._polarity
        return other

    def _at(self, terminals: Terminals) -> LeverEquations:
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

    def heat_density(self, x: Array) -> tuple[Array, Array]:
        """Return the heat stored at the points of states (nJ/µm²), and its slope by T, (points, n).

        See `LawsAtPoints.heat_density`.
        """
        T = self.at(x)[0].T
        # a step in time asks at the same states for what is stored and how that changes
        if self._stored is None or self._stored[0] is not T:
            self._stored = T, self.laws.heat_density(T)
        return self._stored[1]

    def storage(self, x: Array) -> Array:
        """Return the heat stored in states (nJ), tested as the balance is, (size + 1, n).

        In time the balance is what it loses per µs.
        """
        return self._only_heat(self.heat_density(x)[0])

    def storage_change(self, x: Array, change: Array) -> Array:
        """Return how `storage` changes by one change of each state, or by several."""
        by_T = self.heat_density(x)[1]
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

    # --- the equations ------------------------------------------------------------------------

    def balance(self, x: Array) -> Array:
        """Return the residuals of heat and charge, and last the current I_h (mA), (size + 1, n)."""
        weak = self.space.weak_form(self.fluxes(x))
        self.terminals.add_currents(weak, x)
        self.terminals.add_heat_into_chip(weak, x)
        for points, (heat, _) in self.losses(x).items():
            getattr(self, points).add_heat(weak, heat)
        return weak + self.space.air.weak_form(self.kirchhoff(x)[0])

    def balance_in(self, circuit: Circuit, x: Array, bias_V: Array | float) -> Array:
        """Return the residuals of heat and charge, and last of a circuit, V_l + R_s I_h − V_b."""
        balance = self.balance(x)
        balance[-1] = circuit.bias(x[-1], balance[-1]) - bias_V
        return balance

    def factorised(
        self,
        x: Array,
        constraint: Constraint = TIP,
        per_us: float = 0.0,
        left: float = 1e-5,
    ) -> Factors:
        """Return the factorised Jacobians of states, with the row of a constraint last.

        They are those of `balance` and so many times (1/µs) that of the heat stored, with what the
        air takes up where things change so fast. In air a solve may leave a share of its right-hand
        side: by default so little that what is found with the factors is as good as exact.
        """
        tangent = self.tangent(x)
        if per_us:
            stored = per_us * self.heat_density(x)[1]
            tangent = replace(tangent, heat_source_T=tangent.heat_source_T + stored)
        taken_up = self.heat_in_air.taken_up(per_us) if per_us else None
        slopes = {points: by["T"] for points, (_, by) in self.losses(x).items()}
        surface = SurfaceTangent(self.kirchhoff(x)[1], taken_up, slopes, left)
        return self.space.factorised(tangent, surface, constraint, self.terminals.behind)

    # --- derivatives --------------------------------------------------------------------------

    def flux_changes(self, x: Array, change: Array) -> Fluxes:
        """Return how the fluxes of states (size + 1, n) change with the unknowns, to first order.

        There may be one change of each state, (size + 1, n), or several, (size + 1, n, k).
        """
        return self.tangent(x).fluxes(self.space.fields(change))

    def balance_change(self, x: Array, change: Array) -> Array:
        """Return how `balance` changes with the unknowns: the Jacobian times changes."""
        weak = self.space.weak_form(self.flux_changes(x, change))
        self.terminals.add_current_changes(weak, change)
        self.terminals.add_heat_into_chip(weak, change)
        more = (..., *(None,) * (change.ndim - 2))
        kappa = self.kirchhoff(x)[1][more]
        for name, (_, by) in self.losses(x).items():
            points: Rim = getattr(self, name)
            points.add_heat(weak, by["T"][more] * points.rise(change))
        return weak + self.space.air.weak_form(kappa * self.space.air.rise(change))

    def balance_change_in(self, circuit: Circuit, x: Array, change: Array) -> Array:
        """Return how `balance_in` changes with the unknowns."""
        balance = self.balance_change(x, change)
        balance[-1] = circuit.bias(change[-1], balance[-1])
        return balance

    def by_parameter(self, x: Array, names: Sequence[str]) -> Array:
        """Return how `balance` changes with parameters or dimensions, (size + 1, n, k)."""
        fields, _, _ = self.at(x)
        by, moved = self.properties(fields.T, names)[1], self._fluxes_moved_by(x, names)
        columns = []
        for name in names:
            change = fluxes_of(fields, by[name])
            columns.append(change + moved[name] if name in moved else change)
        changes = Fluxes(*(np.stack(column, axis=-1) for column in zip(*columns, strict=True)))
        return self.space.weak_form(changes) + self._on_surface(x, names)

    def tested_by_parameter(self, x: Array, names: Sequence[str], tests: Array) -> Array:
        """Return what `by_parameter` does times tests (size + 1, n, m), summed up, (n, m, k).

        Fluxes are linear in the properties, so that the tests give these a weight at each point,
        and a parameter costs no more than a sum over the points.
        """
        fields, _, _ = self.at(x)
        by, moved = self.properties(fields.T, names)[1], self._fluxes_moved_by(x, names)
        at_points, weights = self.space.fields(tests), self.space.weights
        weighted = weights_of_properties(fields, at_points, self.laws.physics, weights)
        tested = np.zeros((*tests.shape[1:], len(names)))
        for column, name in enumerate(names):
            for law, weight in weighted.named.items():
                change = getattr(by[name], law)
                # most parameters are those of one law
                if change.any():
                    tested[..., column] += np.einsum("pn,pnm->nm", change, weight)
            if name in moved:
                tested[..., column] += moved[name].tested(at_points, weights)
        # by these parameters heat leaves the surface or the leg ends, whatever radiates or touches
        surface = [
            name
            for name in names
            if name in {"gas_conductivity", "surface_gap_um", "base_temperature_K", "chip_K_per_mW"}
            or len(self.rim.weights)
            or self.contact is not None
        ]
        if surface:
            columns = [names.index(name) for name in surface]
            on_surface = self._on_surface(x, surface)
            tested[..., columns] += np.einsum("snm,snk->nmk", tests, on_surface)
        return tested

    def _fluxes_moved_by(self, x: Array, names: Sequence[str]) -> dict[str, Fluxes]:
        """Return how fluxes change with the temperature of the base and dimensions among names.

        Properties being the same.
        """
        moving = [name for name in names if name == "base_temperature_K" or name in self.motions]
        if not moving:
            return {}
        fields, fluxes, tangent = self.at(x)[0], self.fluxes(x), self.tangent(x)
        return {
            name: tangent.fluxes(self.terminals.warmed_by_base(fields))
            if name == "base_temperature_K"
            else self.motions[name].of_fluxes(fields, fluxes, tangent)
            for name in moving
        }

    def _on_surface(self, x: Array, names: Sequence[str]) -> Array:
        """Return how what leaves at the surface, and into the chip, changes with parameters."""
        weak = np.zeros((*x.shape, len(names)))
        for points, (_, by_loss) in self.losses(x, names).items():
            stacked = np.stack([by_loss[name] for name in names], axis=-1)
            getattr(self, points).add_heat(weak, stacked)
        air, (theta, kappa_air) = self.space.air, self.kirchhoff(x)
        for column, name in enumerate(names):
            if name == "gas_conductivity":
                weak[..., column] += air.weak_form(theta / air.gas_conductivity)
            elif name == "base_temperature_K":
                cold = self.kirchhoff(np.zeros_like(x))[1]
                weak[..., column] += air.weak_form(kappa_air - cold)
            elif name == "surface_gap_um":
                weak[..., column] += air.change_with_gap(theta)
            elif name == "chip_K_per_mW":
                by_chip = -(self.terminals.chip_mW_per_K**2)
                self.terminals.add_heat_into_chip(weak[..., column], x, by_chip)
        return weak

    def tip_by_parameter(self, x: Array, names: Sequence[str]) -> Array:
        """Return how the tip's rise (K) changes with parameters, the unknowns being the same.

        The tip moves against the mesh. The shape is (n, k).
        """
        unknowns, _ = self.space.tip
        still = np.zeros(unknowns.size)
        rates = [self.motions[name].tip if name in self.motions else still for name in names]
        return np.asarray(np.tensordot(x[unknowns], rates, axes=(0, 1)))

    def solve_linear(
        self,
        x: Array,
        factors: Factors,
        right_hand_side: Array,
        constraint: Constraint = TIP,
    ) -> Array:
        """Solve Jacobian at `x` times change = right-hand side, the constraint being the last row.

        The factors, with the same constraint, may be those of states nearby: what they lack is
        removed by refinement. Right-hand sides are one of each state or several, as in
        `flux_changes`.
        """
        states = np.arange(x.shape[1])

        def missing(change: Array) -> Array:
            left = right_hand_side - self.balance_change(x, change)
            left[-1] = right_hand_side[-1] - constraint.of(self.space, change)
            return left

        scale = self.scale.reshape(-1, *(1,) * (right_hand_side.ndim - 1))
        return refined(
            lambda right: factors.solve(right, states), missing, right_hand_side, scale, 1e-6
        )

    def along(
        self, x: Array, factors: Factors, constraint: Constraint = TIP, *, fresh: bool = False
    ) -> Array:
        """Return the derivative of states by the tip temperature (K) or another constraint.

        The factors may be those of states nearby, or fresh: those of the states themselves.
        """
        unit = np.zeros_like(x)
        unit[-1] = 1.0
        if fresh:
            return factors.solve(unit, np.arange(x.shape[1]))
        return self.solve_linear(x, factors, unit, constraint)

    def cold(self) -> tuple[Array, Array]:
        """Return how the state leaves the one without power, by u = √(rise of the tip).

        Heat and charge decouple at the base temperature: the potential grows as u, and the
        temperature as u².

        Returns
        -------
        first, second : ndarray, shape (size + 1, 1)
            x = first u + second u² + O(u³).
        """
        nothing = np.zeros((self.space.size + 1, 1))
        unit = nothing.copy()
        unit[-1] = 1.0
        factors, one = self.factorised(nothing, LEVER), np.arange(1)
        first = factors.solve(unit, one)
        # how the equations bend along it, by their derivatives on either side, where a lever is
        # nearly cold
        near_V = 1e-3
        bent = self.balance_change(near_V * first, first)
        bent -= self.balance_change(-near_V * first, first)
        bent *= -0.25 / near_V
        bent[-1] = 0.0
        second = factors.solve(bent, one)
        per_square_volt = self.space.tip_rise(second)
        return first / np.sqrt(per_square_volt), second / per_square_volt

    def power(self, x: Array) -> Array:
        """Return the power (mW) that the swept supply and others put into states, (n,)."""
        return self.terminals.power(x, self.space.weak_form(self.fluxes(x)))

    # --- what is measured ------------------------------------------------------------------------

    def observed(self, x: Array) -> Array:
        """Return V_l (V), I_h (mA) and V_r (V, NaN without a reader), shape (3, n)."""
        current = self.space.weak_form(self.fluxes(x))[-1]
        return np.stack([x[-1], current, self.space.reader_voltage(x)])

    def observed_change(self, x: Array, change: Array) -> Array:
        """Return how `observed` changes with the unknowns, to first order."""
        current = self.space.weak_form(self.flux_changes(x, change))[-1]
        return np.stack([change[-1], current, self.space.reader_voltage(change)])

    def observed_gradient(self, x: Array) -> Array:
        """Return the derivatives of `observed` by the unknowns, (size + 1, n, 3).

        Those of V_r are zero without a reader.
        """
        tangent = self.tangent(x)
        unit = np.zeros((len(x), 1))
        unit[-1] = 1.0
        # the current is the charge equation tested with the function that is one on the supply
        supply = self.space.fields(unit).grad_V
        along = (tangent.charge_flux_T * supply).sum(axis=0)
        flat = np.zeros_like(tangent.charge_flux_T)
        gradient = np.zeros((*x.shape, len(ELECTRICAL_OUTPUTS)))
        gradient[-1, :, 0] = 1.0
        if tangent.charge_T is not None:
            flat = tangent.charge_T * supply
        gradient[..., 1] = self.space.weak_form(Fluxes(along, flat, tangent.sigma * supply))
        if self.space.reader is not None:
            unknowns, weights = self.space.reader
            # the nodes of a contact share one unknown
            np.add.at(gradient[..., 2], unknowns, weights[:, None])
        return gradient


def steps_of(equations: LeverEquations) -> Array:
    """Return u = √(T_tip − T_base) where the tip passes a step of a law: the curves bend there."""
    rises = np.array(equations.laws.steps_K) - equations.base_temperature_K
    u = np.sqrt(rises[rises > 0])
    return np.concatenate([-u[::-1], u])


# --- the terminals --------------------------------------------------------------------------------


class Terminals:
    """What is wired to the terminals of a lever, in its equations, and how warm its leg ends are.

    Each terminal gives its potential V one equation, and the leg end there the temperature at which
    the chip holds it, the base temperature; or all of them one temperature, above it by
    ``chip_K_per_mW`` times the heat that enters the chip:

    =======  =======================================  ===========================================
    kind     what it is                               equation of the potential
    =======  =======================================  ===========================================
    ground   wired to ground, nothing between         V = 0, no unknown
    held     a supply of its own, of a voltage        one unknown, the same all over the contact;
             behind a resistor or of a current, or a  current into the lever I = J − G V
             ground behind a resistor (Norton)
    sense    floating                                 no current density; V is the mean over it
    swept    the supply that is swept                 V_l, the last unknown: a constraint selects
                                                      a state, or the circuit V_l + R_s I_h = V_b
    =======  =======================================  ===========================================

    Which terminals are what is a matter of the space, whose unknowns depend on it; what is behind
    them and how warm the leg ends are is one of the circuit.

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


# --- where heat and charge go ---------------------------------------------------------------------


def balance_names(wiring: Wiring) -> tuple[str, ...]:
    """Return what `balance_columns` returns: `BALANCES`, and currents into the lever (mA).

    These are at the terminals that the paper's circuit does not have.
    """
    return (*BALANCES, *(f"{name}_mA" for name in _unusual(wiring)))


def _unusual(wiring: Wiring) -> tuple[str, ...]:
    """Return those that a current passes, without the ground of the paper's circuit."""
    usual = "ground" if "ground" in wiring.grounds else None
    return tuple(name for name in wiring.conducting if name != usual)


def balance_columns(equations: LeverEquations, x: Array) -> Array:
    """Return what is at the terminals, and where heat goes, of states (size + 1, n), (n, k).

    Currents and heats at terminals are consistent fluxes: reactions of the weak form at the nodes
    of each. The names are `balance_names`.
    """
    return _balances(equations, equations.fluxes(x), *_leaving(equations, x))


def balance_slopes(equations: LeverEquations, x: Array, slopes: Array) -> Array:
    """Return how the `balance_columns` of states change with changes (size + 1, n) of them."""
    by_T = equations.at(x)[2].emission
    rise = equations.space.temperature.at_points(slopes)[0]
    theta = equations.kirchhoff(x)[1] * equations.space.air.rise(slopes)
    faces = np.zeros_like(rise) if by_T is None else by_T * rise
    losses = {
        name: by["T"] * getattr(equations, name).rise(slopes)
        for name, (_, by) in equations.losses(x).items()
    }
    return _balances(equations, equations.flux_changes(x, slopes), theta, faces, losses)


def heat_left(equations: LeverEquations, x: Array) -> Array:
    """Return all heat that leaves states: by the leg ends and from the surface (mW), (n,)."""
    return np.asarray(sum(_heat_out(equations, equations.fluxes(x), *_leaving(equations, x))))


def heat_held(equations: LeverEquations, x: Array) -> tuple[Array, Array]:
    """Return the heat in states (nJ), (n,), and its part that is tested at the leg ends."""
    space = equations.space
    (heat,) = space.weighted(equations.heat_density(x)[0][None])
    return heat.sum(axis=0), space.end_test[0] @ heat


def _leaving(equations: LeverEquations, x: Array) -> tuple[Array, Array, dict[str, Array]]:
    """Return what leaves the surface of states.

    θ at the sites of the air, what faces radiate (mW/µm²), and the `LeverEquations.losses` (mW).
    """
    faces = equations.at(x)[1].emission
    if faces is None:
        faces = np.zeros((len(equations.space.weights), x.shape[1]))
    losses = {name: heat for name, (heat, _) in equations.losses(x).items()}
    return equations.kirchhoff(x)[0], faces, losses


def _heat_out(
    equations: LeverEquations, fluxes: Fluxes, theta: Array, faces: Array, losses: dict[str, Array]
) -> tuple[Array, Array, Array, Array]:
    """Return the heat through the leg ends, into the air, radiated, and into the tip."""
    space = equations.space
    heat = space.weighted(np.concatenate([fluxes.heat_source[None], fluxes.heat]))
    by_ends = -np.einsum("dp,dpn->n", space.end_test, heat)
    into_air, at_ends = space.air.heat(theta)
    if space.chip is not None:
        unknowns, weights = space.chip
        at_ends = at_ends + weights @ space.air.weak_form(theta)[unknowns]
    light = (space.weights * faces).sum(axis=0)
    if "rim" in losses:
        at_ends = at_ends + equations.rim.end_test @ losses["rim"]
        light = light + losses["rim"].sum(axis=0)
    into_tip = np.sum(losses.get("footprint", np.zeros((0, light.size))), axis=0)
    return by_ends - at_ends, into_air, light, into_tip


def _balances(
    equations: LeverEquations, fluxes: Fluxes, theta: Array, faces: Array, losses: dict[str, Array]
) -> Array:
    """Return the balances of fluxes and what leaves the surface, see `_leaving`; all linear."""
    space = equations.space
    assert isinstance(space, FullSpace)  # a reduced lever has no ends
    heats = _heat_out(equations, fluxes, theta, faces, losses)
    heat_generation = space.weights * (faces - fluxes.heat_source)
    charge = space.weighted(fluxes.charge)
    of_parts = [
        _heat_of_part(heat_generation, space.parts[part]) for part in ("heater", "leg 1", "leg 2")
    ]
    into = {
        name: np.einsum("dp,dpn->n", space.charge_tests[name], charge)
        for name in space.wiring.conducting
    }
    grounds = [name for name in into if equations.circuit.contact(name).kind == "ground"]
    ground = -sum((into[name] for name in grounds), start=np.zeros_like(heats[0]))
    currents = [into[name] for name in _unusual(space.wiring)]
    return np.stack([*of_parts, ground, *heats, *currents], axis=-1)


def _heat_of_part(heat: Array, points: Index) -> Array:
    """Return the heat made at some points; NaN if the lever has no such part."""
    total = heat[points].sum(axis=0)
    return np.asarray(total if points.size else np.full_like(total, np.nan))
