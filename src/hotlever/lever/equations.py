"""The coupled electro-thermal equations of a lever.

Heat (paper's first equation, with the sign corrected) and charge::

    −∇·(κ ∇T) = σ |∇V|² − heat lost to air,    ∇·(σ ∇V) = 0,

with T = base temperature at all terminals (or what each is held at), V = 0 at ground, V = V_l on
the contact of the swept supply, no current into sense contacts, and into other contacts what their
supplies give by Ohm's law, J − G V. One more condition, the *pin*, selects a state: its tip
temperature. What is behind the swept supply does not enter: what a lever shows at a tip temperature
does not depend on it. Units are µm, V, mA, mW and K. Several states stand side by side, see
`hotlever.lever.space`.

The loss to air is linear in θ = ∫κ_air dT on the surface (`hotlever.air.operator`). The air
operator fills the plate itself with air too; κ is therefore κ_Si − κ_air where there is air.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from functools import cached_property

import numpy as np

from hotlever.errors import ComputationError
from hotlever.lever.heat_in_air import HeatInAir
from hotlever.lever.motion import Motion
from hotlever.lever.space import (
    LEVER,
    PER_CM_TO_MILLI_PER_UM,
    TIP,
    AirTangent,
    Factors,
    Fields,
    Fluxes,
    Pin,
    Space,
    Tangent,
)
from hotlever.lever.stack import GAS, Conductivities, Stacks
from hotlever.materials import Kind
from hotlever.materials.air import kirchhoff_variable
from hotlever.probe.circuit import Circuit
from hotlever.types import Array

#: What an instrument shows of a state, in the order of `LeverEquations.observed`.
SHOWN = ("lever_V", "current_mA", "reader_V")

#: Parameters that are of no law: one moves all temperatures, the other is of the air.
BASE, GAP = "base_temperature_K", "surface_gap_um"

#: Error (relative) to which derivatives are solved, and the most rounds of refinement.
_EXACT, _MOST_ROUNDS = 1e-6, 6


class LeverEquations:
    """Residual, Jacobian and derivatives of one lever of some materials.

    Parameters
    ----------
    space : Space
    materials : mapping of str to Kind
        What it is made of, by name.
    circuit : Circuit
        What is wired to the terminals, and how warm they are.
    motions : mapping of str to Motion, optional
        Of the dimensions by which derivatives may be asked for.

    Raises
    ------
    ComputationError
        If a law makes no sense at the base temperature: a fit may have moved it there.

    Attributes
    ----------
    scale, step_limit : ndarray, shape (size + 1, 1)
        For Newton's method: the size of one unit of each unknown, by which kelvin and volts
        compare, and the largest step.
    """

    def __init__(
        self,
        space: Space,
        materials: Mapping[str, Kind],
        circuit: Circuit,
        motions: Mapping[str, Motion] | None = None,
    ) -> None:
        self.space, self.materials, self.motions = space, materials, motions or {}
        self.circuit, self.base_temperature_K = circuit, circuit.base_temperature_K
        self.conductance, self.source_mA = circuit.norton(space.wired)
        self.end_rises = circuit.end_rises()
        for name, kind in self.made_of.items():
            if reason := kind.impossible(self.base_temperature_K):
                raise ComputationError(f"{name}: {reason}")
        self._stacks = Stacks(space, materials, self.motions)
        self._latest: tuple[Array, tuple[Fields, Conductivities]] | None = None
        self.scale = np.where(space.is_temperature, 1.0, 0.01)[:, None]
        self.step_limit = np.where(space.is_temperature, 60.0, 5.0)[:, None]

    # --- the laws at the quadrature points --------------------------------------------------

    @property
    def made_of(self) -> dict[str, Kind]:
        """The materials of which there are films, by name."""
        return {film.material: self.materials[film.material] for film in self.space.films}

    @property
    def limit(self) -> tuple[float, str]:
        """Temperature (K) beyond which no state is meaningful, and what happens there."""
        return min((kind.highest_K, kind.end(name)) for name, kind in self.made_of.items())

    def conductivities(self, T: Array, names: Sequence[str] = ("T",)) -> Conductivities:
        """Evaluate κ and σ at temperatures (K), (points, n), with some of their derivatives."""
        return self._stacks.conductivities(T, names)

    def at(self, x: Array) -> tuple[Fields, Conductivities]:
        """Return the fields of states (size + 1, n), and κ and σ, at the quadrature points."""
        # residual, Jacobian and derivatives are asked for at the same states one by one
        if self._latest is None or self._latest[0] is not x:
            moved = self.space.fields(x)
            T, grad_T = self.base_temperature_K + moved.T, moved.grad_T
            for name, rise in self.end_rises.items():
                value, slope = np.split(self.space.end_tests[name][..., None], [1])
                T, grad_T = T + rise * value[0], grad_T + rise * slope
            fields = Fields(T, grad_T, moved.grad_V)
            self._latest = (x, (fields, self.conductivities(fields.T)))
        return self._latest[1]

    def driven(self, share: float) -> LeverEquations:
        """Return the same with held supplies and warmer leg ends at a share of their values."""
        other = copy(self)
        other.source_mA = share * self.source_mA
        other.end_rises = {name: share * rise for name, rise in self.end_rises.items()}
        other._latest = None
        return other

    # --- the equations ------------------------------------------------------------------------

    def fluxes(self, x: Array) -> Fluxes:
        """Return what the weak equations test."""
        fields, laws = self.at(x)
        return Fluxes(
            -laws.sigma * square(fields.grad_V),
            laws.kappa * fields.grad_T,
            laws.sigma * fields.grad_V,
        )

    def balance(self, x: Array) -> Array:
        """Return the residuals of heat and charge, and last the current I_h (mA), (size + 1, n)."""
        weak = self.space.weak_form(self.fluxes(x))
        weak[self.space.contacts] += self._into_contacts(x) - self.source_mA[:, None]
        if self.space.air is not None:
            weak += self.space.air.weak_form(self.kirchhoff(x)[0])
        return weak

    def _into_contacts(self, x: Array) -> Array:
        """Return G V (mA) at the contacts, (contacts, ...), of states or of changes of them."""
        potential = x[self.space.contacts]
        return self.conductance.reshape(-1, *(1,) * (x.ndim - 1)) * potential

    def kirchhoff(self, x: Array) -> tuple[Array, Array]:
        """Return θ (mW/µm) and κ (mW/(K µm)) of the gas at the sites of the air operator."""
        base = self.base_temperature_K
        theta, by = kirchhoff_variable(base + self.space.air.rise(x), base)
        unit = PER_CM_TO_MILLI_PER_UM * self.space.air.gas_conductivity
        return unit * theta, unit * by["T"]

    def heat_density(self, T: Array) -> tuple[Array, Array]:
        """Return the heat above that at the base temperature (nJ/µm²), and its slope by T.

        Thickness included, at temperatures (K), (points, n).
        """
        held, by = self._stacks.heat(T)
        return held - self._cold_heat, by

    @property
    def heat_in_air(self) -> HeatInAir | None:
        """Heat that the air takes up itself; None in vacuum, or where that is not known."""
        return None if self.space.air is None else self.space.air.stores

    @cached_property
    def _cold_heat(self) -> Array:
        """The enthalpy at the base temperature (nJ/µm²), (points, 1)."""
        return self._stacks.heat(np.full_like(self.space.weights, self.base_temperature_K))[0]

    def stored(self, x: Array) -> Array:
        """Return the heat stored in states (nJ), tested as `balance` tests, (size + 1, n).

        In time `balance` is what it loses per µs.
        """
        return self._only_heat(self.heat_density(self.at(x)[0].T)[0])

    def stored_change(self, x: Array, change: Array) -> Array:
        """Return how `stored` changes with the unknowns, to first order; see `flux_changes`."""
        by_T = self.heat_density(self.at(x)[0].T)[1]
        rise = self.space.temperature.at_points(change)[0]
        heat = (by_T if change.ndim == 2 else by_T[..., None]) * rise
        return self._only_heat(heat)

    def stored_by_parameter(self, x: Array, names: Sequence[str]) -> Array:
        """Return how `stored` changes with parameters of materials, (size + 1, n, k)."""
        cold = np.full_like(self.space.weights, self.base_temperature_K)
        by = self._stacks.heat_by(self.at(x)[0].T, names) - self._stacks.heat_by(cold, names)
        return self._only_heat(by)

    def _only_heat(self, heat: Array) -> Array:
        """Test a heat by area alone."""
        nothing = np.zeros((self.space.potential.kinds, *heat.shape))
        return self.space.weak_form(Fluxes(heat, nothing, nothing))

    def factorised(self, x: Array, pin: Pin = TIP, per_us: float = 0.0) -> Factors:
        """Return the factorised Jacobians of states, with the row of a pin last.

        They are those of `balance` and so many times (1/µs) that of `stored`, with what the air
        takes up where things change so fast.
        """
        fields, laws = self.at(x)
        heat_source_T = -laws.sigma_by["T"] * square(fields.grad_V)
        if per_us:
            heat_source_T = heat_source_T + per_us * self.heat_density(fields.T)[1]
        tangent = Tangent(
            heat_source_T=heat_source_T,
            heat_flux_T=laws.kappa_by["T"] * fields.grad_T,
            kappa=laws.kappa,
            heat_source_V=-2.0 * laws.sigma * fields.grad_V,
            charge_flux_T=laws.sigma_by["T"] * fields.grad_V,
            sigma=laws.sigma,
        )
        air = None
        if self.space.air is not None:
            own = self.heat_in_air if per_us else None
            taken_up = None if own is None else own.taken_up(per_us)
            air = AirTangent(self.kirchhoff(x)[1], taken_up)
        return self.space.factorised(tangent, air, pin, self.conductance)

    # --- derivatives --------------------------------------------------------------------------

    def flux_changes(self, x: Array, change: Array) -> Fluxes:
        """Return how the fluxes of states (size + 1, n) change with the unknowns, to first order.

        There may be one change of each state, (size + 1, n), or several, (size + 1, n, k).
        """
        fields, laws = self.at(x)
        moved = self.space.fields(change)

        def fitting(known: Array) -> Array:
            return known if change.ndim == 2 else known[..., None]

        grad_T, grad_V = fitting(fields.grad_T), fitting(fields.grad_V)
        sigma = fitting(laws.sigma_by["T"]) * moved.T
        kappa = fitting(laws.kappa_by["T"]) * moved.T
        heat_source = sigma * fitting(square(fields.grad_V))
        heat_source += 2.0 * fitting(laws.sigma) * (grad_V * moved.grad_V).sum(axis=0)
        return Fluxes(
            -heat_source,
            kappa * grad_T + fitting(laws.kappa) * moved.grad_T,
            sigma * grad_V + fitting(laws.sigma) * moved.grad_V,
        )

    def balance_change(self, x: Array, change: Array) -> Array:
        """Return how `balance` changes with the unknowns: the Jacobian times changes."""
        weak = self.space.weak_form(self.flux_changes(x, change))
        weak[self.space.contacts] += self._into_contacts(change)
        if self.space.air is not None:
            kappa = self.kirchhoff(x)[1]
            kappa = kappa if change.ndim == 2 else kappa[..., None]
            weak += self.space.air.weak_form(kappa * self.space.air.rise(change))
        return weak

    def by_parameter(self, x: Array, names: Sequence[str]) -> Array:
        """Return how `balance` changes with parameters or dimensions, (size + 1, n, k)."""
        fields, known = self.at(x)
        # a base temperature that rises takes the whole lever with it
        by = ["T" if name == BASE else name for name in names]
        laws = self.conductivities(fields.T, by)
        sigma = np.stack([laws.sigma_by[name] for name in by], axis=-1)
        kappa = np.stack([laws.kappa_by[name] for name in by], axis=-1)
        grad_T, grad_V = fields.grad_T[..., None], fields.grad_V[..., None]
        heat = -sigma * square(fields.grad_V)[..., None]
        changes = Fluxes(heat, kappa * grad_T, sigma * grad_V)
        for place in (place for place, name in enumerate(names) if name in self.motions):
            motion = self.motions[names[place]]
            moved = motion.of_fluxes(fields, self.fluxes(x), known.kappa, known.sigma)
            changes.heat_source[..., place] += moved.heat_source
            changes.heat[..., place] += moved.heat
            changes.charge[..., place] += moved.charge
        weak = self.space.weak_form(changes)
        if self.space.air is None:
            return weak
        air, (theta, kappa_air) = self.space.air, self.kirchhoff(x)
        for place, name in enumerate(names):
            if name == GAS:
                weak[..., place] += air.weak_form(theta / air.gas_conductivity)
            elif name == BASE:
                cold = self.kirchhoff(np.zeros_like(x))[1]
                weak[..., place] += air.weak_form(kappa_air - cold)
            elif name == GAP:
                weak[..., place] += air.change_with_gap(theta)
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
        pin: Pin = TIP,
    ) -> Array:
        """Solve Jacobian at `x` times change = right-hand side, the last row that of the pin.

        The factors, with the same pin, may be those of states nearby: what they lack is removed by
        refinement. Right-hand sides are one of each state or several, as in `flux_changes`.
        """
        states = np.arange(x.shape[1])
        scale = self.scale.reshape(-1, *(1,) * (right_hand_side.ndim - 1))
        change = factors.solve(right_hand_side, states)
        for _ in range(_MOST_ROUNDS):
            rest = right_hand_side - self.balance_change(x, change)
            rest[-1] = right_hand_side[-1] - pin.of(self.space, change)
            correction = factors.solve(rest, states)
            change = change + correction
            ratio = _length(correction / scale) / _length(change / scale)
            # the next correction would be smaller by the same ratio once more
            if not np.any(ratio**2 > _EXACT):
                break
        return change

    def along(self, x: Array, factors: Factors, pin: Pin = TIP) -> Array:
        """Return the derivative of states by the tip temperature (K) or another pin."""
        unit = np.zeros_like(x)
        unit[-1] = 1.0
        return self.solve_linear(x, factors, unit, pin)

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
        factors = self.factorised(nothing, LEVER)
        potential = self.solve_linear(nothing, factors, unit, LEVER)
        grad_V = self.space.fields(potential).grad_V
        joule = self.at(nothing)[1].sigma * square(grad_V)
        heat = self.space.weak_form(Fluxes(joule, 0.0 * grad_V, 0.0 * grad_V))
        heat[-1] = 0.0
        rise = self.solve_linear(nothing, factors, heat, LEVER)
        per_square_volt = self.space.tip_rise(rise)
        return potential / np.sqrt(per_square_volt), rise / per_square_volt

    def power(self, x: Array) -> Array:
        """Return the power (mW) that the swept supply and others put into states, (n,)."""
        into = self.space.weak_form(self.fluxes(x))
        contacts = self.space.contacts
        return np.asarray(x[-1] * into[-1] + (x[contacts] * into[contacts]).sum(axis=0))

    # --- what is measured ------------------------------------------------------------------------

    def observed(self, x: Array) -> Array:
        """Return V_l (V), I_h (mA) and V_r (V, NaN without a reader), shape (3, n): `SHOWN`."""
        current = self.balance(x)[-1]
        return np.stack([x[-1], current, self.space.reader_voltage(x)])

    def observed_change(self, x: Array, change: Array) -> Array:
        """Return how `observed` changes with the unknowns, to first order."""
        current = self.balance_change(x, change)[-1]
        return np.stack([change[-1], current, self.space.reader_voltage(change)])

    def observed_gradient(self, x: Array) -> Array:
        """Return the derivatives of `observed` by the unknowns, (size + 1, n, 3).

        Those of V_r are zero without a reader.
        """
        fields, laws = self.at(x)
        unit = np.zeros((len(x), 1))
        unit[-1] = 1.0
        # the current is the charge equation tested with the function that is one on the supply
        supply = self.space.fields(unit).grad_V
        along = laws.sigma_by["T"] * (fields.grad_V * supply).sum(axis=0)
        flat = np.zeros_like(fields.grad_V)
        gradient = np.zeros((*x.shape, len(SHOWN)))
        gradient[-1, :, 0] = 1.0
        gradient[..., 1] = self.space.weak_form(Fluxes(along, flat, laws.sigma * supply))
        if self.space.reader is not None:
            unknowns, weights = self.space.reader
            gradient[unknowns, :, 2] = weights[:, None]
        return gradient


def _length(columns: Array) -> Array:
    """Return the largest entry of each column; never zero."""
    return np.maximum(np.abs(columns).max(axis=0), 1e-300)


def square(gradient: Array) -> Array:
    """Return the squared length of vectors (dimension, points, n)."""
    return np.einsum("dpn,dpn->pn", gradient, gradient)
