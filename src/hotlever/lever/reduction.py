"""Making a reduced lever: the branches it is trained on, its modes, its points and its atlas."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls
from scipy.stats import qmc

from hotlever.errors import BranchEndError
from hotlever.lever.atlas import Atlas, branch_on_grid, common_grid
from hotlever.lever.equations import LeverEquations
from hotlever.lever.lever import Lever
from hotlever.lever.reduced import ReducedSpace, leading_modes
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
#: In air, where silicon competes with air, c_κ does change the shape.
IN_AIR: dict[str, tuple[float, float]] = {"c_kappa": (0.55, 0.8)}
#: Tip temperature (K) up to which states are collected.
HOTTEST = 1350.0
#: Size of the changes of a snapshot: share of the box, and K.
PARAMETER_STEP, BRANCH_STEP = 0.25, 50.0
#: Training levers have this series resistance (Ω), with which the bias rises along a branch. The
#: states of a given lever voltage do not depend on it.
_TRAINING_OHM = 5000.0


@dataclass(frozen=True)
class ReductionOptions:
    """How a reduced lever is made.

    Attributes
    ----------
    parameter_sets : int
        Parameter sets whose whole branch is solved.
    modes_T, modes_V : int
        Modes of each field. The reader voltage, a small potential, asks for more of the latter.
    rule_tolerance : float
        Relative accuracy of the empirical quadrature rule on the training integrals.
    sketch : int
        Random combinations of training integrals that the rule is made to reproduce.
    seed : int
        Of the parameter sets and of the sketch.
    """

    parameter_sets: int = 8
    modes_T: int = 36
    modes_V: int = 48
    rule_tolerance: float = 1e-6
    sketch: int = 420
    seed: int = 0


@dataclass(frozen=True)
class Snapshot:
    """A full state with the material it belongs to, and its neighbourhood.

    Attributes
    ----------
    material : Material
    x : ndarray, shape (n,)
    changes : ndarray, shape (n, k)
        Changes of the state with each parameter by `PARAMETER_STEP` of the box, then by
        `BRANCH_STEP` along the branch, and in air with c_κ; the tip temperature is held for the
        parameters.
    tip_K : float
    """

    material: Material
    x: Array
    changes: Array
    tip_K: float


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
        Its material and series resistance do not matter; its base temperature does.
    options : ReductionOptions, optional
    progress : callable, optional
        Called with the parameter sets done and their number.
    """
    options = options or ReductionOptions()
    probe = lever.probe.with_values({"series_resistance_ohm": _TRAINING_OHM})
    training = Lever(probe, space=lever.space)
    branches: list[list[Snapshot]] = []
    for done, material in enumerate(training_materials(probe.material, options), start=1):
        branches.append(list(collect(training.with_material(material))))
        if progress is not None:
            progress(done, options.parameter_sets)
    return reduced_space(training, branches, options)


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


def place_in_box(material: Material) -> Array:
    """Invert `material_in_box`, beyond the box too."""
    shares = []
    for name, (low, high) in BOX.items():
        value = getattr(material, name)
        if name == "n_d":
            value, low, high = np.log([value, low, high])
        shares.append((value - low) / (high - low))
    return np.array(shares)


def collect(lever: Lever) -> Iterator[Snapshot]:
    """Follow the branch of one material and yield states and their neighbourhoods."""
    follower = lever.follower()
    equations = lever.equations
    hottest = lever.space.highest_temperature
    with suppress(BranchEndError):  # legs can run away before the tip is hot
        for state in follower.follow_arc(lambda state: hottest(state.x) < HOTTEST):
            changes = neighbourhood(equations, state.x)
            yield Snapshot(lever.probe.material, state.x, changes, state.tip)


def neighbourhood(equations: LeverEquations, x: Array) -> Array:
    """Return the changes of a state with parameters and along the branch: see `Snapshot`."""
    # at a given tip temperature, so that a fold does no harm
    solver = equations.jacobian(x).factorised(equations.series_kohm, 0.0, 1.0)
    by_parameter = equations.by_parameter(x)
    columns: list[tuple[str, float, float] | None] = [(name, *BOX[name]) for name in BOX]
    columns.append(None)
    if equations.space.air is not None:
        columns += [(name, *IN_AIR[name]) for name in IN_AIR]
    right_hand_side = np.zeros((x.size, len(columns)))
    for place, entry in enumerate(columns):
        if entry is None:
            right_hand_side[-1, place] = BRANCH_STEP
            continue
        name, low, high = entry
        change = by_parameter[:, list(PARAMETERS).index(name)]
        right_hand_side[:-1, place] = -change * PARAMETER_STEP * (high - low)
    right_hand_side[-2] *= equations.series_kohm
    changes: Array = solver.solve(right_hand_side)
    return changes


@one_blas_thread
def reduced_space(
    lever: Lever, branches: list[list[Snapshot]], options: ReductionOptions
) -> ReducedSpace:
    """Find modes, quadrature rule and atlas from the snapshots of some branches."""
    full, base = lever.space, lever.probe.circuit.base_temperature_K
    is_T = full.is_temperature()[: full.size]
    cold = lever.follower().state.tangent
    lift = np.where(is_T, 0.0, cold[: full.size] / cold[full.size])
    snapshots = [snapshot for branch in branches for snapshot in branch]
    states = np.stack([snapshot.x for snapshot in snapshots])
    changes = np.concatenate([snapshot.changes.T for snapshot in snapshots])
    vectors = np.concatenate([states, changes])
    free = vectors[:, : full.size] - vectors[:, full.size : full.size + 1] * lift
    free[: len(states), is_T] -= base
    modes_T = leading_modes(np.where(is_T, free, 0.0), options.modes_T)
    modes_V = leading_modes(np.where(is_T, 0.0, free), options.modes_V)
    space = ReducedSpace(full, modes_T, modes_V, lift, base)
    space.use_points(*_empirical_rule(lever, space, snapshots, options))
    space.atlas = _atlas(lever, space, branches)
    return space


def _atlas(lever: Lever, space: ReducedSpace, branches: list[list[Snapshot]]) -> Atlas:
    base, size = lever.probe.circuit.base_temperature_K, space.size
    kohm = lever.probe.circuit.series_resistance_ohm / 1000.0
    rises = [
        np.sqrt(np.maximum(0.0, [snapshot.tip_K - base for snapshot in branch]))
        for branch in branches
    ]
    grid = common_grid(np.array([rise[-1] for rise in rises]))
    states, slopes = [], []
    for rise, branch in zip(rises, branches, strict=True):
        values = np.stack([space.coordinates(snapshot.x) for snapshot in branch])
        by = np.stack([space.coordinates(snapshot.changes, change=True) for snapshot in branch])
        # the last unknown is V_b = V_l + R_s I_h
        for array in (values.T, np.moveaxis(by, 1, 0)):
            array[size + 1] = (array[size + 1] - array[size]) / kohm
        along = by[:, :, len(BOX)] * (2.0 * rise[:, None] / BRANCH_STEP)
        hot = rise > 0
        u, values, along, by = rise[hot], values[hot], along[hot], by[hot, :, : len(BOX)]
        # at zero bias nothing is hot, and potentials grow evenly with u
        start = np.where(space.is_temperature(), 0.0, 2.0 * values[0] / u[0] - along[0])
        u = np.append(0.0, u)
        values = np.vstack([np.zeros_like(start), values])
        along = np.vstack([start, along])
        by = np.concatenate([np.zeros_like(by[:1]), by]) / PARAMETER_STEP
        (low, high), n_d = BOX["n_d"], branch[0].material.n_d
        by[..., list(BOX).index("n_d")] *= n_d * np.log(high / low) / (high - low)
        state, slope = branch_on_grid(u, values, along, by, grid)
        states.append(state)
        slopes.append(slope)
    places = np.stack([place_in_box(branch[0].material) for branch in branches])
    c_kappa = branches[0][0].material.c_kappa
    return Atlas.fitted(grid, places, np.stack(states), np.stack(slopes), c_kappa)


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
