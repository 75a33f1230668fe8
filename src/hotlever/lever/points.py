"""The material laws of a lever at its quadrature points, and the heat that its states hold."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from functools import cached_property
from typing import Self

import numpy as np

from hotlever.errors import ComputationError
from hotlever.lever.heat_in_air import HeatInAir
from hotlever.lever.motion import Motion
from hotlever.lever.space import PER_CM_TO_MILLI_PER_UM, Fields, Fluxes, Space
from hotlever.lever.stack import Conductivities, Stacks
from hotlever.materials import Kind
from hotlever.materials.air import kirchhoff_variable
from hotlever.probe.circuit import Circuit
from hotlever.types import Array


class LawsAtPoints:
    """Fields, laws and heat of states of one lever of some materials.

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

    def nodal_rises(self, x: Array) -> Array:
        """Return the rises of the temperature (K) of states at all nodes, (nodes, n)."""
        return self.space.nodal_rises(x, self.end_rises)

    def highest_rise(self, x: Array) -> Array:
        """Return the highest rise of the temperature (K) in states, between the nodes too, (n,)."""
        return self.space.elements.highest(self.nodal_rises(x))

    def driven(self, share: float) -> Self:
        """Return the same with held supplies and warmer leg ends at a share of their values."""
        other = copy(self)
        other.source_mA = share * self.source_mA
        other.end_rises = {name: share * rise for name, rise in self.end_rises.items()}
        other._latest = None
        return other

    @property
    def mirrored(self) -> Self:
        """The same with held supplies of the other polarity."""
        other = copy(self)
        other.source_mA = -self.source_mA
        return other

    def fluxes(self, x: Array) -> Fluxes:
        """Return what the weak equations test."""
        fields, laws = self.at(x)
        return Fluxes(
            -laws.sigma * square(fields.grad_V),
            laws.kappa * fields.grad_T,
            laws.sigma * fields.grad_V,
        )

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

    def storage(self, x: Array) -> Array:
        """Return the heat stored in states (nJ), tested as the balance is, (size + 1, n).

        In time the balance is what it loses per µs.
        """
        return self._only_heat(self.heat_density(self.at(x)[0].T)[0])

    def storage_change(self, x: Array, change: Array) -> Array:
        """Return how `storage` changes by one change of each state, or by several."""
        by_T = self.heat_density(self.at(x)[0].T)[1]
        rise = self.space.temperature.at_points(change)[0]
        heat = (by_T if change.ndim == 2 else by_T[..., None]) * rise
        return self._only_heat(heat)

    def storage_by_parameter(self, x: Array, names: Sequence[str]) -> Array:
        """Return how `storage` changes with parameters of materials, (size + 1, n, k)."""
        cold = np.full_like(self.space.weights, self.base_temperature_K)
        by = self._stacks.heat_by(self.at(x)[0].T, names) - self._stacks.heat_by(cold, names)
        return self._only_heat(by)

    def _only_heat(self, heat: Array) -> Array:
        """Test a heat by area alone."""
        tested = self.space.temperature.values_tested(self.space.weighted(heat[None])[0])
        weak = np.zeros((self.space.size + 1, *heat.shape[1:]))
        weak[self.space.temperature.columns] = tested
        return weak


def square(gradient: Array) -> Array:
    """Return the squared length of vectors (dimension, points, n)."""
    return np.einsum("dpn,dpn->pn", gradient, gradient)
