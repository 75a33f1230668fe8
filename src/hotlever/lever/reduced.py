"""A reduced lever: the same equations on a few modes and a few quadrature points.

Temperature and potential are expanded in modes found from full solutions (proper orthogonal
decomposition of states and of their parameter derivatives). The equations are projected on the
modes (Galerkin), with every material law evaluated at the quadrature points, of which an
empirical rule with positive weights keeps a few hundred. `ReducedSpace` offers the operators of
`hotlever.lever.equations.Space`, so residual, Jacobian, continuation and sensitivities are those
of the full lever.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lu_factor, lu_solve

from hotlever.errors import ComputationError
from hotlever.lever.air_loss import AirLoss
from hotlever.lever.atlas import Atlas
from hotlever.lever.lever import Lever
from hotlever.lever.space import Fields, LeverSpace, Tangent, Tapered

Array = NDArray[np.float64]
Index = NDArray[np.intp]

#: Modes that enrich a space are at least this large (K, and a hundredth in V).
_SMALLEST = 1e-3


class Samples:
    """The modes of a reduced space at the points of a quadrature rule.

    Parameters
    ----------
    full : LeverSpace
    T : ndarray, shape (3, points, modes)
        Value and slopes of the temperature modes.
    V : ndarray, shape (2, points, modes + 1)
        Slopes of the potential modes, and of the lift.
    points : ndarray of int
        Which of the full space's quadrature points they are.
    weights : ndarray

    Attributes
    ----------
    tapered : list of Tapered
        With each point as an "element".
    """

    def __init__(self, full: LeverSpace, T: Array, V: Array, points: Index, weights: Array) -> None:
        self.points, self.weights = points, weights
        # value and slopes one below the other, so that products are single ones
        self._T = np.ascontiguousarray(T.reshape(-1, T.shape[2]))
        self._V = np.ascontiguousarray(V.reshape(-1, V.shape[2]))
        per_element = full.operators.weights.shape[1]
        thickness = full.thickness_um
        self.thickness_um = (
            thickness if isinstance(thickness, float) else thickness.ravel()[points][:, None]
        )
        self.tapered = []
        for region in full.tapered:
            along = np.full(full.operators.weights.size, np.nan)
            numbers = region.elements[:, None] * per_element + np.arange(per_element)
            along[numbers.ravel()] = region.along.ravel()
            here = np.flatnonzero(np.isfinite(along[points]))
            self.tapered.append(Tapered(here, along[points][here][:, None], region.length_um))

    def fields(self, x: Array, base_temperature_K: float) -> Fields:
        """Return the fields of states, shape (size + 2, states), at points x states."""
        count, states = self._T.shape[1], x.shape[1]
        samples_T = (self._T @ x[:count]).reshape(3, -1, states)
        samples_V = (self._V @ x[count : count + self._V.shape[1]]).reshape(2, -1, states)
        return Fields(base_temperature_K + samples_T[0], samples_T[1:], samples_V)

    def weak_form(
        self, heat_source: Array | float, heat_flux: Array | float, charge_flux: Array
    ) -> Array:
        """Return the projected equations and last the currents, shape (size + 1, states)."""
        states = charge_flux.shape[-1]
        w = self.weights[:, None]
        heat = np.empty((3, w.size, states))
        np.multiply(w, heat_source, out=heat[0])
        np.multiply(w, heat_flux, out=heat[1:])
        charge = charge_flux * w
        return np.concatenate(
            [self._T.T @ heat.reshape(-1, states), self._V.T @ charge.reshape(-1, states)]
        )

    def matrix(self, tangent: Tangent, state: int) -> Array:
        """Return the projected linearised equations of one of the states."""
        w, count = self.weights, self.weights.size
        T = self._T.reshape(3, count, -1)
        V = self._V.reshape(2, count, -1)
        split, width = T.shape[2], V.shape[2]

        def scaled(coefficient: Array) -> Array:
            return (w * coefficient[..., state])[..., None]

        heat_T = np.empty_like(T)
        heat_T[0] = scaled(tangent.heat_source_T) * T[0]
        heat_T[1:] = scaled(tangent.kappa) * T[1:] + scaled(tangent.heat_flux_T) * T[0]
        heat_V = np.einsum("dqm,dqm->qm", scaled(tangent.heat_source_V), V)
        charge_T = scaled(tangent.charge_flux_T) * T[0]
        charge_V = scaled(tangent.sigma) * V
        matrix = np.empty((split + width, split + width))
        matrix[:split, :split] = self._T.T @ heat_T.reshape(-1, split)
        matrix[:split, split:] = T[0].T @ heat_V
        matrix[split:, :split] = self._V.T @ charge_T.reshape(-1, split)
        matrix[split:, split:] = self._V.T @ charge_V.reshape(-1, width)
        return matrix


class ReducedAir:
    """The air operator between temperature modes; see `hotlever.lever.equations.AirTerm`.

    Parameters
    ----------
    full : AirLoss
    modes : ndarray, shape (modes, full size)
        Of the temperature.
    size : int
        Number of modes of both fields.
    """

    def __init__(self, full: AirLoss, modes: Array, size: int) -> None:
        self.filling, self._size = full.filling, size
        self._samples = full.sampling[:, : modes.shape[1]] @ modes.T
        self._spread = self._samples.T @ full.matrix

    def temperature(self, x: Array, base_temperature_K: float) -> Array:
        """Return the temperature (K) at the sites, one column for each state."""
        return base_temperature_K + self._samples @ x[: self._samples.shape[1]]

    def weak_form(self, theta: Array) -> Array:
        """Return the heat lost for θ (mW/µm) at the sites, tested with the modes."""
        weak = np.zeros((self._size + 1, *theta.shape[1:]))
        weak[: len(self._spread)] = self._spread @ theta
        return weak

    def added(self, jacobian: Any, kappa: Array) -> Any:
        """Return the Jacobian with air; κ_air (mW/(K µm)) at the sites."""
        columns = kappa.reshape(len(kappa), -1).T
        return jacobian.plus(
            np.stack([self._spread @ (column[:, None] * self._samples) for column in columns])
        )


class ReducedSpace:
    """Modes, and how they look at quadrature points: at all of them, and at a few.

    Parameters
    ----------
    full : LeverSpace
    modes_T, modes_V : ndarray, shape (modes, full.size)
        Changes of the full free values, of temperatures only and of potentials only.
    lift : ndarray, shape (full.size,)
        Potentials of a state with V_l = 1 V.
    base_temperature_K : float

    Attributes
    ----------
    size : int
        Number of modes of both fields.
    all_points, few_points : Samples
        The equations of `equations.Space` use the few, once `use_points` has chosen them.
    air : ReducedAir or None
    atlas : Atlas or None
        Known branches to start from.
    """

    def __init__(
        self,
        full: LeverSpace,
        modes_T: Array,
        modes_V: Array,
        lift: Array,
        base_temperature_K: float,
    ) -> None:
        self.full, self._base = full, base_temperature_K
        self.basis, self._lift = np.concatenate([modes_T, modes_V]), lift
        self._count = len(modes_T)
        self.size = len(self.basis)
        self._full_T = full.is_temperature()[: full.size]
        operators = full.operators

        def at_points(free: Array, lever_V: float, field: int) -> tuple[Array, Array]:
            nodal = full.nodal(np.append(free, lever_V), 0.0)[field]
            value, slope = operators.evaluate(nodal)
            return value.ravel(), slope.reshape(2, -1)

        temperatures = [at_points(mode, 0.0, 0) for mode in modes_T]
        potentials = [at_points(mode, 0.0, 1) for mode in modes_V] + [at_points(lift, 1.0, 1)]
        #: (2 + 1, all points, modes): value and slopes; slopes only for the potential.
        self._all_T = np.stack([np.vstack([v, g]) for v, g in temperatures], axis=-1)
        self._all_V = np.stack([g for _, g in potentials], axis=-1)
        unknowns, weights = full.tip
        self.tip = (np.arange(self._count), modes_T[:, unknowns] @ weights)
        reader = full.reader_weights()
        self._reader = None
        if reader is not None:
            modes = np.vstack([modes_V, lift])[:, reader[0]] @ reader[1]
            self._reader = (np.arange(self._count, self.size + 1), modes)
        # where it is hottest: the nodes on which the first, largest mode is largest
        hot = np.argsort(-np.abs(modes_T[0]))[:60]
        self._hot = modes_T[:, hot]
        self.all_points = self._samples(
            np.arange(operators.weights.size), operators.weights.ravel()
        )
        self.few_points, self.tapered = self.all_points, self.all_points.tapered
        self.air = None if full.air is None else ReducedAir(full.air, modes_T, self.size)
        self.atlas: Atlas | None = None

    def use_points(self, points: Index, weights: Array) -> None:
        """Choose the few points."""
        self.few_points = self._samples(points, weights)
        self.tapered = self.few_points.tapered

    def _samples(self, points: Index, weights: Array) -> Samples:
        return Samples(self.full, self._all_T[:, points], self._all_V[:, points], points, weights)

    def arrays(self) -> dict[str, Array]:
        """Return what `from_arrays` makes the space of again."""
        few = self.few_points
        atlas = {} if self.atlas is None else vars(self.atlas)
        return {
            "basis": self.basis,
            "count": np.array(self._count),
            "lift": self._lift,
            "points": few.points,
            "weights": few.weights,
            **{f"atlas_{name}": np.asarray(values) for name, values in atlas.items()},
        }

    @classmethod
    def from_arrays(cls, lever: Lever, arrays: Mapping[str, Array]) -> ReducedSpace:
        """Make a space of stored arrays.

        Raises
        ------
        KeyError, ValueError
            If they do not belong to the lever.
        """
        basis, lift, split = arrays["basis"], arrays["lift"], int(arrays["count"])
        points, weights, size = (
            arrays["points"].astype(np.intp),
            arrays["weights"],
            lever.space.size,
        )
        if basis.shape[1:] != (size,) or lift.shape != (size,) or points.shape != weights.shape:
            raise ValueError("the stored arrays are not of this lever")
        base = lever.probe.circuit.base_temperature_K
        space = cls(lever.space, basis[:split], basis[split:], lift, base)
        space.use_points(points, weights)
        if "atlas_grid" in arrays:
            names = [field.name for field in fields(Atlas)]
            space.atlas = Atlas(**{name: arrays[f"atlas_{name}"] for name in names})
        return space

    @property
    def thickness_um(self) -> float | Array:
        """Thickness of the silicon (µm), see `LeverSpace.thickness_um`."""
        return self.few_points.thickness_um

    # --- between reduced and full states ---------------------------------------------------------

    def expanded(self, x: Array) -> Array:
        """Return the full state of a reduced one."""
        free = x[: self.size] @ self.basis + x[self.size] * self._lift
        free[self._full_T] += self._base
        return np.append(free, x[self.size :])

    def coordinates(self, x: Array, *, change: bool = False) -> Array:
        """Return the reduced state nearest to a full one, or of changes of it, (n, k)."""
        return np.concatenate([self._projected(x, change), x[self.full.size :]])

    def _projected(self, x: Array, change: bool) -> Array:
        # the modes are orthogonal, but not of unit length
        lengths = (self.basis**2).sum(axis=1)
        return np.asarray(((self.basis @ self._free(x, change)).T / lengths).T)

    def _free(self, x: Array, change: bool) -> Array:
        """Return what the modes are for: the free values less base temperature and lift."""
        free = x[: self.full.size] - np.multiply.outer(self._lift, x[self.full.size])
        if not change:
            free[self._full_T] -= self._base
        return free

    def enriched(self, states: Array, changes: Array) -> ReducedSpace:
        """Return a space with modes for some full states and changes of states as well.

        Parameters
        ----------
        states, changes : ndarray, shape (full.size + 2, k)
        """
        vectors = np.concatenate(
            [
                (self._free(x, change) - self.basis.T @ self._projected(x, change)).T
                for x, change in ((states, False), (changes, True))
            ]
        )
        hot = self._full_T
        modes_T = leading_modes(np.where(hot, vectors, 0.0), len(vectors), smallest=_SMALLEST)
        modes_V = leading_modes(
            np.where(hot, 0.0, vectors), len(vectors), smallest=0.01 * _SMALLEST
        )
        count = self._count
        space = ReducedSpace(
            self.full,
            np.concatenate([self.basis[:count], modes_T]),
            np.concatenate([self.basis[count:], modes_V]),
            self._lift,
            self._base,
        )
        # the few points were chosen for the old modes: the new space stays with all
        if self.atlas is not None:
            space.atlas = self.atlas.widened(count, len(modes_T), self.size, len(modes_V))
        return space

    def heat_integrands(self, source: Array, flux: Array) -> Array:
        """Return source φ + flux·∇φ at all points of the full space for every mode."""
        integrands: Array = (
            self._all_T[0].T * source + self._all_T[1].T * flux[0] + self._all_T[2].T * flux[1]
        )
        return integrands

    def charge_integrands(self, flux: Array) -> Array:
        """Return flux·∇φ at all points of the full space for every mode and the lift."""
        integrands: Array = self._all_V[0].T * flux[0] + self._all_V[1].T * flux[1]
        return integrands

    # --- what is read off states of shape (size + 2,) or (size + 2, states) ----------------------

    def start(self, base_temperature_K: float) -> Array:
        """Return the exact state without bias."""
        if base_temperature_K != self._base:
            raise ComputationError(
                f"the reduced lever was made for a base temperature of {self._base:g} K, "
                f"not {base_temperature_K:g} K"
            )
        return np.zeros(self.size + 2)

    def is_temperature(self) -> NDArray[np.bool_]:
        """Return which of the unknowns are coefficients of temperature modes."""
        return np.arange(self.size + 2) < self._count

    def tip_temperature(self, x: Array) -> Any:
        """Return T_tip (K), one for each state."""
        return self._base + self.tip[1] @ x[: self._count]

    def highest_temperature(self, x: Array) -> Any:
        """Return the highest temperature (K) of the nodes that heat up most."""
        return self._base + (self._hot.T @ x[: self._count]).max(axis=0)

    def reader_weights(self) -> tuple[Index, Array] | None:
        """Return unknowns and weights that give V_r; None without a reader."""
        return self._reader

    # --- operators of one state: see `equations.Space` --------------------------------------------

    def fields(self, x: Array, base_temperature_K: float) -> Fields:
        """Return temperature and gradients at the points, each an "element" of one point."""
        return self.few_points.fields(x[:, None], base_temperature_K)

    def weak_form(
        self, heat_source: Array | float, heat_flux: Array | float, charge_flux: Array
    ) -> Array:
        """Return the projected equations, and last the current I_h into V_l."""
        return self.few_points.weak_form(heat_source, heat_flux, charge_flux)[:, 0]

    def jacobian(self, tangent: Tangent) -> DenseJacobian:
        """Assemble the projected linearised equations."""
        return DenseJacobian(self.few_points.matrix(tangent, 0), self.tip[1])


class StackedSpace:
    """A reduced space whose states stand side by side: arrays of shape (size + 2, states).

    With it `LeverEquations` evaluates residuals and parameter derivatives of all biases at once:
    arrays of a few hundred points cost as much in calls as in arithmetic.

    Parameters
    ----------
    space : ReducedSpace
    samples : Samples
        The points to integrate with.
    """

    def __init__(self, space: ReducedSpace, samples: Samples) -> None:
        self.size, self.tip, self.tapered = space.size, space.tip, samples.tapered
        self.thickness_um = samples.thickness_um
        self.start, self.is_temperature = space.start, space.is_temperature
        self.tip_temperature = space.tip_temperature
        self.highest_temperature = space.highest_temperature
        self.reader_weights = space.reader_weights
        self.fields, self.weak_form, self.air = samples.fields, samples.weak_form, space.air
        self._samples = samples

    def jacobian(self, tangent: Tangent) -> StackedJacobian:
        """Assemble the projected linearised equations of every state."""
        states = tangent.sigma.shape[-1]
        return StackedJacobian(
            np.stack([self._samples.matrix(tangent, state) for state in range(states)])
        )


class StackedJacobian:
    """The projected linearised equations of several states, shape (states, size + 1, size + 1).

    The last row is the current.
    """

    def __init__(self, matrices: Array) -> None:
        self.matrices = matrices

    def plus(self, heat_T: Array) -> StackedJacobian:
        """Return the sum with changes of the heat equations with T, (states, modes, modes)."""
        count = heat_T.shape[1]
        self.matrices[:, :count, :count] += heat_T
        return self

    def inverses(self, series_resistance_kohm: float) -> Array:
        """Return the inverses at a given bias, with the circuit equation in the last row."""
        matrices = self.matrices.copy()
        matrices[:, -1] *= series_resistance_kohm
        matrices[:, -1, -1] += 1.0
        return np.asarray(np.linalg.inv(matrices), dtype=float)


class DenseJacobian:
    """The projected linearised equations before circuit equation and pin are added."""

    def __init__(self, matrix: Array, tip: Array) -> None:
        self._matrix, self._tip = matrix, tip
        self.current_gradient = (np.arange(len(matrix)), matrix[-1])

    def plus(self, heat_T: Array) -> DenseJacobian:
        """Return the sum with changes of the heat equations with T, (1, modes, modes)."""
        count = heat_T.shape[1]
        self._matrix[:count, :count] += heat_T[0]
        return self

    def completed(self, series_resistance_kohm: float, pin_bias: float, pin_tip: float) -> Array:
        """Return the square matrix; the last rows are circuit equation and pin."""
        size = len(self._matrix)
        full = np.zeros((size + 1, size + 1))
        full[:size, :size] = self._matrix
        full[size - 1] *= series_resistance_kohm
        full[size - 1, size - 1 :] += (1.0, -1.0)
        full[size, : self._tip.size] = pin_tip * self._tip
        full[size, size] = pin_bias
        return full

    def factorised(
        self, series_resistance_kohm: float, pin_bias: float, pin_tip: float
    ) -> DenseSolver:
        """Complete and factorise."""
        return DenseSolver(self.completed(series_resistance_kohm, pin_bias, pin_tip))


class DenseSolver:
    """A factorised dense matrix."""

    def __init__(self, matrix: Array) -> None:
        self._factors = lu_factor(matrix, check_finite=False)

    def solve(self, right_hand_side: Array) -> Array:
        """Solve for one right-hand side (n,) or several (n, k)."""
        solution: Array = lu_solve(self._factors, right_hand_side, check_finite=False)
        return solution


def leading_modes(vectors: Array, count: int, smallest: float = 0.0) -> Array:
    """Return the leading modes of some vectors, scaled so that their largest entry is one.

    Modes that contribute less than `smallest` to every vector are left out.
    """
    # the eigenvectors of the Gram matrix: far fewer vectors than values
    gram = vectors @ vectors.T
    _, combinations = np.linalg.eigh(gram)
    modes = combinations[:, ::-1][:, :count].T @ vectors
    if smallest:
        modes = modes[np.abs(modes).max(axis=1) > smallest]
    modes = np.linalg.qr(modes.T)[0].T
    scaled: Array = modes / np.abs(modes).max(axis=1, keepdims=True)
    return scaled
