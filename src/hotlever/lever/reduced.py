"""A reduced lever: the same equations on a few modes and a few quadrature points.

Temperature and potential are expanded in modes found from full solutions (proper orthogonal
decomposition of states and of their parameter derivatives). The equations are projected on the
modes (Galerkin), with every material law evaluated at the quadrature points, of which an
empirical rule with positive weights keeps a few hundred. `ReducedSpace` offers the operators of
`hotlever.lever.equations.Space`, so residual, Jacobian, continuation and sensitivities are those
of the full lever.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lu_factor, lu_solve
from scipy.optimize import nnls
from scipy.stats import qmc

from hotlever.errors import BranchEndError, ComputationError
from hotlever.lever.equations import LeverEquations
from hotlever.lever.lever import Lever
from hotlever.lever.space import Fields, LeverSpace, Tangent, Tapered
from hotlever.materials import PARAMETERS, Material
from hotlever.threads import one_blas_thread

Array = NDArray[np.float64]
Index = NDArray[np.intp]

#: Parameter ranges that the modes are made for. The shape of the fields does not depend on
#: c_κ: scaling κ scales V² at the same temperatures. n_d is spread evenly in its logarithm.
BOX: dict[str, tuple[float, float]] = {
    "delta": (0.5, 0.9),
    "n_d": (2.0e17, 9.0e17),
    "p": (2.35, 3.0),
    "a0": (7.5e-4, 1.15e-3),
    "a1": (0.85e-6, 1.5e-6),
}
#: Tip temperature (K) up to which states are collected.
HOTTEST = 1350.0


@dataclass(frozen=True)
class ReductionOptions:
    """How a reduced lever is made.

    Attributes
    ----------
    parameter_sets : int
        Parameter sets whose whole branch is solved.
    modes : int
        Modes of each field.
    rule_tolerance : float
        Relative accuracy of the empirical quadrature rule on the training integrals.
    sketch : int
        Random combinations of training integrals that the rule is made to reproduce.
    seed : int
        Of the parameter sets and of the sketch.
    """

    parameter_sets: int = 8
    modes: int = 32
    rule_tolerance: float = 1e-6
    sketch: int = 700
    seed: int = 0


@dataclass(frozen=True)
class Snapshot:
    """A full state with the material it belongs to, and its neighbourhood.

    Attributes
    ----------
    material : Material
    x : ndarray, shape (n,)
    changes : ndarray, shape (n, k)
        Changes of the state along the branch and with each parameter, of the size of the box.
    """

    material: Material
    x: Array
    changes: Array


class ReducedSpace:
    """Modes, and their values at the points of an empirical quadrature rule.

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
    points : ndarray of int
        The quadrature points of the full space that are used.
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
        self._reader = full.reader_weights()
        # where it is hottest: the nodes on which the first, largest mode is largest
        hot = np.argsort(-np.abs(modes_T[0]))[:60]
        self._hot = modes_T[:, hot]
        self.use_points(np.arange(operators.weights.size), operators.weights.ravel())

    def arrays(self) -> tuple[Array, Index, Array, Index, Array]:
        """Return what `from_arrays` makes the space of again."""
        return self.basis, np.array([self._count]), self._lift, self.points, self.weights

    @classmethod
    def from_arrays(
        cls, lever: Lever, basis: Array, count: Index, lift: Array, points: Index, weights: Array
    ) -> ReducedSpace:
        """Make a space of stored arrays.

        Raises
        ------
        ValueError
            If they do not belong to the lever.
        """
        size, split = lever.space.size, int(count[0])
        if basis.shape[1:] != (size,) or lift.shape != (size,) or points.shape != weights.shape:
            raise ValueError("the stored arrays are not of this lever")
        base = lever.probe.circuit.base_temperature_K
        space = cls(lever.space, basis[:split], basis[split:], lift, base)
        space.use_points(points, weights)
        return space

    @property
    def thickness_um(self) -> float | Array:
        """Thickness of the silicon (µm), see `LeverSpace.thickness_um`."""
        thickness = self.full.thickness_um
        if isinstance(thickness, float):
            return thickness
        return thickness.ravel()[self.points][:, None]

    def use_points(self, points: Index, weights: Array) -> None:
        """Integrate with these of the full space's quadrature points from now on."""
        self.points, self.weights = points, weights
        # value and slopes one below the other, so that products are single ones
        self._T = np.ascontiguousarray(self._all_T[:, points].reshape(-1, self._count))
        self._V = np.ascontiguousarray(self._all_V[:, points].reshape(-1, self._all_V.shape[2]))
        per_element = self.full.operators.weights.shape[1]
        self.tapered = []
        for region in self.full.tapered:
            along = np.full(self.full.operators.weights.size, np.nan)
            numbers = region.elements[:, None] * per_element + np.arange(per_element)
            along[numbers.ravel()] = region.along.ravel()
            here = np.flatnonzero(np.isfinite(along[points]))
            self.tapered.append(Tapered(here, along[points][here][:, None], region.length_um))

    # --- between reduced and full states ---------------------------------------------------------

    def expanded(self, x: Array) -> Array:
        """Return the full state of a reduced one."""
        free = x[: self.size] @ self.basis + x[self.size] * self._lift
        free[self._full_T] += self._base
        return np.append(free, x[self.size :])

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

    # --- operators: see `equations.Space` ---------------------------------------------------------

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

    def tip_temperature(self, x: Array) -> float:
        """Return T_tip (K)."""
        return self._base + float(self.tip[1] @ x[: self._count])

    def highest_temperature(self, x: Array) -> float:
        """Return the highest temperature (K) of the nodes that heat up most."""
        return self._base + float((x[: self._count] @ self._hot).max())

    def reader_weights(self) -> tuple[Index, Array] | None:
        """Return unknowns and weights that give V_r; None without a reader."""
        if self._reader is None:
            return None
        unknowns, weights = self._reader
        modes = np.vstack([self.basis[self._count :], self._lift])[:, unknowns] @ weights
        return np.arange(self._count, self.size + 1), modes

    def fields(self, x: Array, base_temperature_K: float) -> Fields:
        """Return temperature and gradients at the points, each an "element" of one point."""
        samples_T = (self._T @ x[: self._count]).reshape(3, -1, 1)
        samples_V = (self._V @ x[self._count : self.size + 1]).reshape(2, -1, 1)
        return Fields(base_temperature_K + samples_T[0], samples_T[1:], samples_V)

    def weak_form(
        self, heat_source: Array | float, heat_flux: Array | float, charge_flux: Array
    ) -> Array:
        """Return the projected equations, and last the current I_h into V_l."""
        count = self.points.size
        heat = np.empty((3, count))
        heat[0] = np.reshape(heat_source, -1)
        heat[1:] = np.reshape(heat_flux, (2, -1)) if np.ndim(heat_flux) else heat_flux
        heat *= self.weights
        charge = charge_flux.reshape(2, -1) * self.weights
        return np.concatenate([heat.ravel() @ self._T, charge.ravel() @ self._V])

    def jacobian(self, tangent: Tangent) -> DenseJacobian:
        """Assemble the projected linearised equations."""
        w, count = self.weights, self.points.size
        T = self._T.reshape(3, count, -1)
        V = self._V.reshape(2, count, -1)

        def scaled(coefficient: Array) -> Array:
            return (w * coefficient.reshape(-1, count))[:, :, None]

        heat_T = np.empty_like(T)
        heat_T[0] = scaled(tangent.heat_source_T)[0] * T[0]
        heat_T[1:] = scaled(tangent.kappa) * T[1:] + scaled(tangent.heat_flux_T) * T[0]
        heat_V = np.einsum("dqm,dqm->qm", scaled(tangent.heat_source_V), V)
        charge_T = scaled(tangent.charge_flux_T) * T[0]
        charge_V = scaled(tangent.sigma) * V
        matrix = np.empty((self.size + 1, self.size + 1))
        split = self._count
        matrix[:split, :split] = self._T.T @ heat_T.reshape(-1, split)
        matrix[:split, split:] = T[0].T @ heat_V
        matrix[split:, :split] = self._V.T @ charge_T.reshape(-1, split)
        matrix[split:, split:] = self._V.T @ charge_V.reshape(2 * count, -1)
        return DenseJacobian(matrix, self.tip[1])


class DenseJacobian:
    """The projected linearised equations before circuit equation and pin are added."""

    def __init__(self, matrix: Array, tip: Array) -> None:
        self._matrix, self._tip = matrix, tip
        self.current_gradient = (np.arange(len(matrix)), matrix[-1])

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


# --- making a reduced space ---------------------------------------------------------------------


@one_blas_thread
def reduce(
    lever: Lever,
    options: ReductionOptions | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> ReducedSpace:
    """Make a reduced space for a lever's geometry.

    Parameters
    ----------
    lever : Lever
        Its material does not matter; its base temperature does.
    options : ReductionOptions, optional
    progress : callable, optional
        Called with the parameter sets done and their number.
    """
    options = options or ReductionOptions()
    snapshots: list[Snapshot] = []
    for done, material in enumerate(training_materials(lever.probe.material, options), start=1):
        snapshots.extend(collect(lever.with_material(material)))
        if progress is not None:
            progress(done, options.parameter_sets)
    return reduced_space(lever, snapshots, options)


def training_materials(material: Material, options: ReductionOptions) -> list[Material]:
    """Spread parameter sets over the box (a Sobol sequence)."""
    shares = qmc.Sobol(len(BOX), seed=options.seed).random(options.parameter_sets)
    return [material_in_box(material, row) for row in shares]


def material_in_box(material: Material, shares: Array) -> Material:
    """Return the material at a point of the box given by numbers between 0 and 1."""
    values = {}
    for share, (name, (low, high)) in zip(shares, BOX.items(), strict=True):
        even = low * (high / low) ** share if name == "n_d" else low + share * (high - low)
        values[name] = float(even)
    return material.with_(**values)


def collect(lever: Lever) -> Iterator[Snapshot]:
    """Follow the branch of one material and yield states and their neighbourhoods."""
    follower = lever.follower()
    equations = lever.equations
    hottest = lever.space.highest_temperature
    with suppress(BranchEndError):  # legs can run away before the tip is hot
        for state in follower.follow_arc(lambda state: hottest(state.x) < HOTTEST):
            yield Snapshot(lever.probe.material, state.x, neighbourhood(equations, state.x))


def neighbourhood(equations: LeverEquations, x: Array) -> Array:
    """Return how a state changes along the branch and with each parameter of the box."""
    # at a given tip temperature, so that a fold does no harm
    solver = equations.jacobian(x).factorised(equations.series_kohm, 0.0, 1.0)
    by_parameter = equations.by_parameter(x)
    right_hand_side = np.zeros((x.size, len(BOX) + 1))
    for column, (name, (low, high)) in enumerate(BOX.items()):
        change = by_parameter[:, list(PARAMETERS).index(name)]
        right_hand_side[:-1, column] = -change * 0.25 * (high - low)
    right_hand_side[-2, :-1] *= equations.series_kohm
    right_hand_side[-1, -1] = 50.0  # K along the branch
    changes: Array = solver.solve(right_hand_side)
    return changes


@one_blas_thread
def reduced_space(
    lever: Lever, snapshots: list[Snapshot], options: ReductionOptions
) -> ReducedSpace:
    """Find modes and quadrature rule from snapshots."""
    full, base = lever.space, lever.probe.circuit.base_temperature_K
    is_T = full.is_temperature()[: full.size]
    cold = lever.follower().state.tangent
    lift = np.where(is_T, 0.0, cold[: full.size] / cold[full.size])
    states = np.stack([snapshot.x for snapshot in snapshots])
    changes = np.concatenate([snapshot.changes.T for snapshot in snapshots])
    vectors = np.concatenate([states, changes])
    free = vectors[:, : full.size] - vectors[:, full.size : full.size + 1] * lift
    free[: len(states), is_T] -= base
    modes_T = _leading(np.where(is_T, free, 0.0), options.modes)
    modes_V = _leading(np.where(is_T, 0.0, free), options.modes)
    space = ReducedSpace(full, modes_T, modes_V, lift, base)
    space.use_points(*_empirical_rule(lever, space, snapshots, options))
    return space


def _leading(vectors: Array, count: int) -> Array:
    """Return the leading modes of some vectors, scaled so that their largest entry is one."""
    # the eigenvectors of the Gram matrix: far fewer vectors than values
    gram = vectors @ vectors.T
    _, combinations = np.linalg.eigh(gram)
    modes = combinations[:, ::-1][:, :count].T @ vectors
    modes = np.linalg.qr(modes.T)[0].T
    scaled: Array = modes / np.abs(modes).max(axis=1, keepdims=True)
    return scaled


def _empirical_rule(
    lever: Lever, space: ReducedSpace, snapshots: list[Snapshot], options: ReductionOptions
) -> tuple[Index, Array]:
    """Choose quadrature points and positive weights that keep the projected equations.

    The rule integrates the projected equations of all snapshots as the full one does, up to
    the tolerance: a non-negative least-squares problem on random combinations of their
    integrands.
    """
    rng = np.random.default_rng(options.seed)
    full_weights = space.full.operators.weights.ravel()
    sketch = np.zeros((options.sketch, full_weights.size))
    for snapshot in snapshots:
        equations = lever.with_material(snapshot.material).equations
        fields, laws = equations.at(snapshot.x)
        heat = (laws.sigma * (fields.grad_V**2).sum(axis=0)).ravel()
        power = heat @ full_weights
        flux_T = (laws.kappa * fields.grad_T).reshape(2, -1)
        flux_V = (laws.sigma * fields.grad_V).reshape(2, -1)
        integrands = np.concatenate(
            [
                space.heat_integrands(-heat, flux_T) / power,
                space.charge_integrands(flux_V) * (snapshot.x[-2] / power),
            ]
        )
        rows = rng.integers(0, options.sketch, len(integrands))
        signs = rng.choice((-1.0, 1.0), len(integrands))
        np.add.at(sketch, rows, signs[:, None] * integrands * full_weights)
    values, vectors = np.linalg.eigh(sketch @ sketch.T)
    kept = values > (options.rule_tolerance**2) * values[-1]
    directions = (vectors[:, kept] / np.sqrt(values[kept])).T @ sketch
    shares, _ = nnls(directions, directions.sum(axis=1), maxiter=20 * len(directions))
    points = np.flatnonzero(shares)
    return points, shares[points] * full_weights[points]
