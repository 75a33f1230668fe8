"""A reduced lever: the same equations on a few modes and a few quadrature points.

Temperature and potential are expanded in modes found from full solutions (proper orthogonal
decomposition of states and of their parameter derivatives). The equations are projected on the
modes (Galerkin), with every material law evaluated at the quadrature points. Two sets of points
share the work: Newton's method runs on the few of an empirical rule with positive weights; then
residuals at all points, with the same Jacobians, remove what the rule lacks. So the rule decides
how fast a state is found, and the modes alone how accurate it is.
"""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from hotlever.lever.air_loss import AirLoss
from hotlever.lever.atlas import Atlas
from hotlever.lever.box import Box
from hotlever.lever.branch import Branch, Reach
from hotlever.lever.equations import LeverEquations
from hotlever.lever.following import branch_of
from hotlever.lever.full_space import FullSpace
from hotlever.lever.heat_in_air import HeatInAir
from hotlever.lever.newton import NewtonOptions, NewtonResult, find_roots
from hotlever.lever.pinned import Pinned
from hotlever.lever.sensitivities import Linearised
from hotlever.lever.space import AirTangent, LinearMap, Pin, Space, Tangent, at_some
from hotlever.probe import Circuit, Probe
from hotlever.threads import one_blas_thread
from hotlever.types import Array, Index

#: Error left (1 K or 10 mV) on the few points, and at the end; and the ratio of two steps with
#: one Jacobian from which a new one is cheaper.
_NEARLY = NewtonOptions(tolerance=1e-2, keep_while=0.2, max_iterations=12)
_DONE = NewtonOptions(tolerance=1e-3, keep_while=0.5, max_iterations=12)


#: What is stored of an atlas.
_OF_ATLAS = ("u", "surface", "grows", "scale")
# Equations on the few points, and what Newton's method found.
Solved = tuple[LeverEquations, NewtonResult]


class ReducedSpace(Space):
    """Modes, and how they look at some of the full lever's quadrature points.

    Parameters
    ----------
    full : FullSpace
    modes_T, modes_V : ndarray, shape (modes, full.size)
        Changes of the full free values, of temperatures only and of potentials only.
    lift : ndarray, shape (full.size,)
        Potentials of a state with V_l = 1 V.
    hot : ndarray of int, optional
        Unknowns among which the highest temperature is; all by default.

    Attributes
    ----------
    modes : ndarray, shape (size, full.size)
    """

    is_reduced = True

    def __init__(
        self, full: FullSpace, modes_T: Array, modes_V: Array, lift: Array, hot: Index | None = None
    ) -> None:
        self.full, self.lift = full, lift
        self.modes = np.concatenate([modes_T, modes_V])
        self.count, self.size = len(modes_T), len(modes_T) + len(modes_V)
        self.is_temperature = np.arange(self.size + 1) < self.count
        lifted = np.append(lift, 1.0)
        with_lever = np.pad(modes_V, ((0, 0), (0, 1)))
        self.temperature = LinearMap(
            np.asarray(full.temperature.matrix @ np.pad(modes_T, ((0, 0), (0, 1))).T),
            full.temperature.kinds,
            slice(self.count),
        )
        self.potential = LinearMap(
            np.asarray(full.potential.matrix @ np.vstack([with_lever, lifted]).T),
            full.potential.kinds,
            slice(self.count, None),
        )
        self.weights, self.films, self.end_test = full.weights, full.films, full.end_test
        self.thickness_um, self.plate_um = full.thickness_um, full.plate_um
        unknowns, weights = full.tip
        self.tip = (np.arange(self.count), modes_T[:, unknowns] @ weights)
        self.reader = None
        if full.reader is not None:
            unknowns, weights = full.reader
            values = np.vstack([modes_V, lift])[:, unknowns] @ weights
            self.reader = (np.arange(self.count, self.size + 1), values)
        self.elements = full.elements
        self._hot = modes_T if hot is None else modes_T[:, hot]
        self.air = None if full.air is None else ReducedAir(full.air, modes_T, self.size)

    def at_points(self, points: Index, weights: Array) -> ReducedSpace:
        """Return the same modes at some of the points, with other weights."""
        space = copy(self)
        space.temperature = self.temperature.among(points)
        space.potential = self.potential.among(points)
        space.weights, space.end_test = weights[:, None], self.end_test[:, points]
        space.thickness_um = at_some(self.thickness_um, points)
        space.plate_um = at_some(self.plate_um, points)
        space.films = tuple(film.among(points) for film in self.films)
        return space

    def rises(self, x: Array) -> Array:
        """Return the rises of the temperature (K) at the hottest nodes, (places, n), of states."""
        return np.asarray(self._hot.T @ x[: self.count])

    def nodal_rises(self, x: Array, end_rises: Mapping[str, float] | None = None) -> Array:
        """Return the rises of the temperature (K) at the nodes of the full lever, (nodes, n)."""
        return self.full.nodal_rises(self.expanded(x), end_rises)

    def expanded(self, x: Array) -> Array:
        """Return the full states of reduced ones, (full.size + 1, n)."""
        free = self.modes.T @ x[:-1] + np.outer(self.lift, x[-1])
        return np.vstack([free, x[-1:]])

    def coordinates(self, x: Array) -> Array:
        """Return the reduced states nearest to full ones, or to changes of them."""
        free = x[:-1] - np.multiply.outer(self.lift, x[-1])
        # the modes are orthogonal, but not of unit length
        orthonormal = self.modes / (self.modes**2).sum(axis=1)[:, None]
        return np.concatenate([np.tensordot(orthonormal, free, axes=1), x[-1:]])

    def factorised(
        self, tangent: Tangent, air: AirTangent | None, pin: Pin, conductance: Array
    ) -> DenseFactors:
        """Put the Jacobians of all states together, the row of the pin last, and invert them."""
        states = tangent.sigma.shape[-1]
        matrices = np.zeros((states, self.size + 1, self.size + 1))
        for state in range(states):
            self._assemble(tangent.of(state), matrices[state])
            if self.air is not None and air is not None:
                of_air = self.air.matrix(air.kappa[:, state], air.taken_up)
                matrices[state, : self.count, : self.count] += of_air
        matrices[:, -1] = 0.0
        matrices[:, -1, : self.count] = np.multiply.outer(pin.tip, self.tip[1])
        matrices[:, -1, -1] = pin.lever
        return DenseFactors(np.asarray(np.linalg.inv(matrices), dtype=float))

    def _assemble(self, tangent: Tangent, matrix: Array) -> None:
        """Project the linearised equations of one state."""
        w, split = self.weights, self.count
        T = self.temperature.matrix.reshape(self.temperature.kinds, w.size, -1)
        V = self.potential.matrix.reshape(self.potential.kinds, w.size, -1)

        def scaled(coefficient: Array) -> Array:
            return w * coefficient[..., None]

        heat_T = np.empty_like(T)
        heat_T[0] = scaled(tangent.heat_source_T) * T[0]
        heat_T[1:] = scaled(tangent.kappa) * T[1:] + scaled(tangent.heat_flux_T) * T[0]
        heat_V = np.einsum("dqm,dqm->qm", scaled(tangent.heat_source_V), V)
        charge_T = scaled(tangent.charge_flux_T) * T[0]
        charge_V = scaled(tangent.sigma) * V
        test_T, test_V = self.temperature.matrix.T, self.potential.matrix.T
        matrix[:split, :split] = test_T @ heat_T.reshape(-1, split)
        matrix[:split, split:] = T[0].T @ heat_V
        matrix[split:, :split] = test_V @ charge_T.reshape(-1, split)
        matrix[split:, split:] = test_V @ charge_V.reshape(-1, V.shape[2])


class DenseFactors:
    """The inverse Jacobian of each of some states; see `Factors`."""

    def __init__(self, inverses: Array) -> None:
        self._inverses = inverses

    def solve(self, right_hand_side: Array, states: Index, *, transposed: bool = False) -> Array:
        """Solve for right-hand sides (size + 1, n) or (size + 1, n, k) of these n states."""
        columns = right_hand_side.reshape(*right_hand_side.shape[:2], -1).swapaxes(0, 1)
        inverses = self._inverses[states]
        inverses = inverses.swapaxes(1, 2) if transposed else inverses
        solution = np.matmul(inverses, columns).swapaxes(0, 1)
        return solution.reshape(right_hand_side.shape)

    def replaced(self, states: Index, other: DenseFactors) -> DenseFactors:
        """Return the same factors, those of some states taken from others, in their order."""
        inverses = self._inverses.copy()
        inverses[states] = other._inverses
        return DenseFactors(inverses)


class ReducedAir:
    """The air operator between temperature modes; see `AirLoss`."""

    def __init__(self, full: AirLoss, modes: Array, size: int) -> None:
        self.filling, self.gas_conductivity = full.filling, full.gas_conductivity
        self._size, self._count, self.heat = size, len(modes), full.heat
        self._samples = full.sampling[:, : modes.shape[1]] @ modes.T
        self._spread = self._samples.T @ full.operator.matrix
        self._full = full
        self._changes = np.zeros((modes.shape[1] + 1, size + 1))
        self._changes[:-1, : self._count] = modes.T

    @cached_property
    def _stores(self) -> tuple[HeatInAir | None, Array]:
        full = self._full.stores
        return (None, np.empty((0, 0))) if full is None else full.between(self._changes)

    @property
    def stores(self) -> HeatInAir | None:
        """Heat that the air takes up itself; see `AirLoss`."""
        return self._stores[0]

    def expanded(self, in_air: Array) -> Array:
        """Return the temperatures in the air around the full lever."""
        shares = self._stores[1]
        many = in_air.reshape(-1, shares.shape[1], in_air.shape[1])
        return np.einsum("mk,skn->smn", shares, many).reshape(-1, in_air.shape[1])

    def rise(self, x: Array) -> Array:
        """Return the rise of the temperature (K) at the sites, (sites, ...)."""
        return np.asarray(np.tensordot(self._samples, x[: self._count], axes=1))

    def weak_form(self, theta: Array) -> Array:
        """Return the heat lost for θ (mW/µm) at the sites, tested with the modes."""
        weak = np.zeros((self._size + 1, *theta.shape[1:]))
        weak[: self._count] = np.tensordot(self._spread, theta, axes=1)
        return weak

    def matrix(self, kappa: Array, taken_up: Array | None) -> Array:
        """Return what the air adds to the Jacobian of one state, (modes, modes)."""
        added = self._spread @ (kappa[:, None] * self._samples)
        if taken_up is not None and self.stores is not None:
            own = self.stores.coordinates[:, : self._count]
            added = added + own.T @ taken_up @ own
        return np.asarray(added)


@dataclass(frozen=True)
class ReducedLever:
    """The reduced lever of a geometry, medium and base temperature.

    How wrong it is depends on the material: `hotlever.lever.certificate.certified_branch`.

    Attributes
    ----------
    all_points, few_points : ReducedSpace
    points : ndarray of int
        Which of the full lever's quadrature points the few are.
    atlas : Atlas
        Known branches, to start from.
    base_temperature_K : float
    """

    all_points: ReducedSpace
    few_points: ReducedSpace
    points: Index
    atlas: Atlas
    base_temperature_K: float

    @property
    def names(self) -> tuple[str, ...]:
        """The parameters that it is made for."""
        return self.atlas.box.parameters

    def equations(self, probe: Probe, *, few: bool = False) -> LeverEquations:
        """Return the equations of a probe's materials at all points, or at the few."""
        space = self.few_points if few else self.all_points
        circuit = Circuit(base_temperature_K=self.base_temperature_K)
        return LeverEquations(space, probe.kinds, circuit)

    @one_blas_thread
    def solved(self, probe: Probe, u: Array, guess: Array, factors: Any = None) -> Solved:
        """Solve states of a probe's materials, (size + 1, k), on the few points.

        They are given by u = √(T_tip − T_base) above zero; the factors may be of states nearby.

        Raises
        ------
        NewtonError
            If a state was not found.
        """
        few = self.equations(probe, few=True)
        return few, find_roots(Pinned(few, u**2), guess, _NEARLY, factors)

    @one_blas_thread
    def branch(self, probe: Probe, reach: Reach) -> Branch:
        """Return a probe's branch at the few points: within 0.1 K, in a third of the time.

        Raises
        ------
        NewtonError
            If a state was not found.
        """
        u, guess = self._start(probe, reach)
        few, found = self.solved(probe, u, guess)
        return branch_of(few, u, found)

    def _start(self, probe: Probe, reach: Reach) -> tuple[Array, Array]:
        """Return u of the states that suffice, and guesses of them."""
        count = reach.count(self.atlas.shown(probe))
        return self.atlas.u[1:count], self.atlas.states(probe)[:, 1:count]

    @one_blas_thread
    def linearised(
        self,
        probe: Probe,
        reach: Reach,
        near: Linearised | None = None,
        names: tuple[str, ...] | None = None,
    ) -> Linearised:
        """Solve the branch of a probe of another material, with its derivatives by the material.

        It starts from a branch of a similar material, or from the atlas; see `Lever.linearised`.
        """
        names = self.names if names is None else names
        if not set(names) <= set(self.names):
            raise ValueError(f"a reduced lever has derivatives by {', '.join(self.names)} only")
        if near is None:
            (u, guess), factors = self._start(probe, reach), None
        else:
            u, guess, factors = near.branch.u[1:], near.states(probe)[:, 1:], near.factors
        few, found = self.solved(probe, u, guess, factors)
        every = self.equations(probe)
        found = find_roots(Pinned(every, u**2), found.x, _DONE, found.factors)
        # derivatives by the material are taken at the few points: exact ones cost too much here
        branch = branch_of(every, u, found)
        return Linearised.of(probe, names, branch, reach, few, found.factors)

    # --- on disk ----------------------------------------------------------------------------------

    def arrays(self) -> dict[str, Array]:
        """Return what `from_arrays` makes the reduced lever of again."""
        every = self.all_points
        return {
            "modes_T": every.modes[: every.count],
            "modes_V": every.modes[every.count :],
            "lift": every.lift,
            "points": self.points,
            "weights": self.few_points.weights[:, 0],
            "low": self.atlas.box.low,
            "high": self.atlas.box.high,
            **{f"atlas_{name}": np.asarray(getattr(self.atlas, name)) for name in _OF_ATLAS},
        }

    @classmethod
    def from_arrays(
        cls, full: FullSpace, base_temperature_K: float, box: Box, arrays: Mapping[str, Array]
    ) -> ReducedLever:
        """Make a reduced lever of stored arrays; of the box, they have the ranges themselves.

        Raises
        ------
        KeyError, ValueError, IndexError
            If they do not belong to the space.
        """
        every = ReducedSpace(full, arrays["modes_T"], arrays["modes_V"], arrays["lift"])
        points = arrays["points"].astype(np.intp)
        few = every.at_points(points, arrays["weights"])
        known: dict[str, Any] = {name: arrays[f"atlas_{name}"] for name in _OF_ATLAS}
        atlas = Atlas(replace(box, low=arrays["low"], high=arrays["high"]), **known)
        return cls(every, few, points, atlas, base_temperature_K)
