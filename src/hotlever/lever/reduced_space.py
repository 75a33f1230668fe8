"""The space of a reduced lever: modes of its states, and how they look at quadrature points.

Temperature and potential are expanded in modes of known states (proper orthogonal decomposition).
The equations are projected on the modes (Galerkin), with every material law evaluated at the
quadrature points, or at the few of an empirical cubature with positive weights (hyper-reduction).
At rest and in time the spaces are the same, their states are not.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from copy import copy
from functools import cached_property
from typing import Self

import numpy as np
from scipy.sparse import csr_matrix

from hotlever.air.coupling import ReducedAir
from hotlever.lever.elements import LinearMap
from hotlever.lever.full_space import FullSpace
from hotlever.lever.layers_at_points import Rim, at_some
from hotlever.lever.space import Constraint, Space, SurfaceTangent
from hotlever.lever.transport import Tangent
from hotlever.types import Array, Index, Mask


def proper_orthogonal_modes(snapshots: Array, most: int | None = None, least: float = 0.0) -> Array:
    """Return the leading modes of snapshots (n, size), scaled so that their largest entry is one.

    Parameters
    ----------
    snapshots : ndarray, shape (n, size)
        Fewer of them than values, as a rule.
    most : int, optional
        How many modes there are at most.
    least : float
        Modes whose singular value is at most this share of the largest are left out.

    Returns
    -------
    ndarray, shape (modes, size)
        Orthogonal, the most important first.
    """
    # the eigenvectors of the Gram matrix: far fewer snapshots than values
    values, combinations = np.linalg.eigh(snapshots @ snapshots.T)
    retained_indices = np.flatnonzero(values > least**2 * values[-1])[::-1][:most]
    modes = np.linalg.qr((combinations[:, retained_indices].T @ snapshots).T)[0].T
    return np.asarray(modes / np.abs(modes).max(axis=1, keepdims=True))


def empirical_cubature(
    integrands: Iterable[Array], weights: Array, tolerance: float = 1e-6
) -> tuple[Index, Array]:
    """Choose points and positive weights that integrate given integrands as all points do.

    A non-negative least-squares problem on random combinations of the integrands.

    Parameters
    ----------
    integrands : iterable of ndarray, shape (k, points)
        Of integrals that compare in size.
    weights : ndarray, shape (points,)
        Of all points.
    tolerance : float
        Relative accuracy on the integrals.

    Returns
    -------
    points : ndarray of int, shape (m,)
    weights : ndarray, shape (m,)
    """
    from scipy.optimize import nnls  # takes longer than all levers

    rng = np.random.default_rng(0)
    # random combinations of the training integrals that the cubature is made to reproduce
    count = 420
    sketch = np.zeros((count, weights.size))
    for some in integrands:
        rows = rng.integers(0, count, len(some))
        signs = rng.choice((-1.0, 1.0), len(some))
        np.add.at(sketch, rows, signs[:, None] * some * weights)
    values, vectors = np.linalg.eigh(sketch @ sketch.T)
    mask = values > (tolerance**2) * values[-1]
    directions = (vectors[:, mask] / np.sqrt(values[mask])).T @ sketch
    shares, _ = nnls(directions, directions.sum(axis=1), maxiter=20 * len(directions))
    points = np.flatnonzero(shares)
    return points, shares[points] * weights[points]


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
        self._full, self.lift = full, lift
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
        self.chip = None
        if full.chip is not None:
            unknowns, weights = full.chip
            self.chip = np.arange(self.count), modes_T[:, unknowns] @ weights
        self.reader = None
        if full.reader is not None:
            unknowns, weights = full.reader
            values = np.vstack([modes_V, lift])[:, unknowns] @ weights
            self.reader = (np.arange(self.count, self.size + 1), values)
        self.elements, self.held = full.elements, {}
        self._hot = modes_T if hot is None else modes_T[:, hot]
        self.air = ReducedAir(full.air, modes_T, self.size)

    @classmethod
    def of_snapshots(
        cls,
        full: FullSpace,
        lift: Array,
        snapshots: Array,
        *,
        most: tuple[int | None, int | None] = (None, None),
        least: float = 0.0,
        hot: Index | None = None,
    ) -> Self:
        """Return the space of the modes of states, temperatures and potentials by themselves.

        Parameters
        ----------
        full : FullSpace
        lift : ndarray, shape (full.size,)
        snapshots : ndarray, shape (full.size + 1, n)
            States, or changes of them.
        most : tuple of int, optional
            Modes of the temperature and of the potential.
        least : float
            See `proper_orthogonal_modes`.
        hot : ndarray of int, optional
        """
        free = (snapshots[:-1] - np.outer(lift, snapshots[-1])).T
        is_T = full.is_temperature[:-1]
        modes_T = proper_orthogonal_modes(np.where(is_T, free, 0.0), most[0], least)
        modes_V = proper_orthogonal_modes(np.where(is_T, 0.0, free), most[1], least)
        return cls(full, modes_T, modes_V, lift, hot)

    @property
    def full(self) -> FullSpace:
        """That of the full lever."""
        return self._full

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

    @cached_property
    def rim(self) -> Rim:
        """The surface at which the mesh ends, all of its points."""
        return self.full.rim.reduced(np.pad(self.modes[: self.count], ((0, 0), (0, 1))))

    @cached_property
    def footprint(self) -> Rim:
        """Points of the circle on which the tip stands."""
        return self.full.footprint.reduced(np.pad(self.modes[: self.count], ((0, 0), (0, 1))))

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

    def combined(self, rises: csr_matrix, potentials: csr_matrix) -> Array:
        """Return the map from the unknowns to combinations of what is at the nodes, (k, nodes)."""
        return np.asarray(
            self.full.combined(rises, potentials) @ self.expanded(np.eye(self.size + 1))
        )

    def coordinates(self, x: Array) -> Array:
        """Return the reduced states nearest to full ones, or to changes of them."""
        free = x[:-1] - np.multiply.outer(self.lift, x[-1])
        # the modes are orthogonal, but not of unit length
        orthonormal = self.modes / (self.modes**2).sum(axis=1)[:, None]
        return np.concatenate([np.tensordot(orthonormal, free, axes=1), x[-1:]])

    def factorised(
        self, tangent: Tangent, surface: SurfaceTangent, constraint: Constraint, conductance: Array
    ) -> DenseFactors:
        """Put the Jacobians of all states together, the constraint last, and invert them."""
        states = tangent.sigma.shape[-1]
        matrices = np.zeros((states, self.size + 1, self.size + 1))
        for state in range(states):
            self._assemble(tangent.of(state), matrices[state])
            of_modes = matrices[state, : self.count, : self.count]
            of_modes += self.air.matrix(surface.kappa[:, state], surface.taken_up)
            if self.chip is not None:
                of_modes += conductance[-1] * np.multiply.outer(self.chip[1], self.chip[1])
            for name, slopes in surface.at_points.items():
                seen = getattr(self, name).temperature.matrix
                of_modes += seen.T @ (slopes[:, [state]] * seen)
        matrices[:, -1] = 0.0
        matrices[:, -1, : self.count] = np.multiply.outer(constraint.tip, self.tip[1])
        matrices[:, -1, -1] = constraint.lever
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
        if tangent.heat_source_slope is not None:
            heat_T[0] += np.einsum("dqm,dqm->qm", scaled(tangent.heat_source_slope), T[1:])
        if tangent.charge_T is not None:
            charge_T += scaled(tangent.charge_T) * T[1:]
        test_T, test_V = self.temperature.matrix.T, self.potential.matrix.T
        matrix[:split, :split] = test_T @ heat_T.reshape(-1, split)
        matrix[:split, split:] = T[0].T @ heat_V
        if tangent.heat_V is not None:
            slopes, heat_slope_V = T[1:].reshape(-1, split), scaled(tangent.heat_V) * V
            matrix[:split, split:] += slopes.T @ heat_slope_V.reshape(-1, V.shape[2])
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

    def followed_by(self, other: DenseFactors) -> DenseFactors:
        """Return the same, and those of other states after them."""
        return DenseFactors(np.concatenate([self._inverses, other._inverses]))

    def among(self, states: Mask | Index) -> DenseFactors:
        """Return those of some states, by a mask or in an order."""
        return DenseFactors(self._inverses[states])
