"""Making a reduced lever: the branches it is trained on, its modes, its points and its atlas."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from scipy.optimize import nnls

from hotlever.cache import cache_file, store_arrays, stored
from hotlever.lever.atlas import Atlas
from hotlever.lever.box import C_KAPPA, Box
from hotlever.lever.equations import SHOWN
from hotlever.lever.lever import Lever
from hotlever.lever.reduced import ReducedLever, ReducedSpace
from hotlever.lever.sensitivities import Linearised
from hotlever.materials import full_name
from hotlever.materials.foreign_laws import own_laws
from hotlever.probe import Probe
from hotlever.probe.parameters import of_materials
from hotlever.threads import one_blas_thread
from hotlever.types import Array, Index, Progress

#: Range of c_κ, whose derivative joins the snapshots in air: silicon competes with air there.
_C_KAPPA_IN_AIR = 0.25
#: Tip temperature (K) up to which states are collected.
HOTTEST = 1350.0
#: Size of the changes of a state that join the snapshots: share of the box, and K.
_PARAMETER_STEP, _BRANCH_STEP = 0.25, 50.0


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


def can_be_reduced(probe: Probe, names: Collection[str]) -> bool:
    """Return whether a reduced lever serves: of one geometry, for parameters of its materials.

    With dimensions among the parameters it does not, since its modes are those of one geometry, nor
    in another circuit than the paper's.
    """
    return set(names) <= set(of_materials(probe)) and probe.circuit.is_plain


@one_blas_thread
def reduce(
    lever: Lever,
    options: ReductionOptions | None = None,
    progress: Progress | None = None,
    names: Collection[str] = (),
) -> ReducedLever:
    """Make the reduced lever of a lever's geometry, medium and base temperature.

    Parameters
    ----------
    lever : Lever
        Its circuit does not matter, nor the values of the paper's silicon; others are where the
        ranges of parameters are.
    options : ReductionOptions, optional
    progress : callable, optional
        Called with the parameter sets done and their number.
    names : collection of str
        Parameters of the materials that vary beside those that a fit usually does.

    Raises
    ------
    ValueError
        If the lever cannot be reduced, see `can_be_reduced`.
    """
    if not can_be_reduced(lever.probe, names):
        raise ValueError("a reduced lever is in the paper's circuit, for materials that vary")
    from scipy.stats import qmc  # takes long, and most commands reduce nothing

    options, box = options or ReductionOptions(), Box.of(lever.probe, names)
    training = []
    shares = qmc.Sobol(len(box.names), seed=options.seed).random(options.parameter_sets)
    for done, row in enumerate(shares, start=1):
        training.append(_trained(lever.with_probe(box.probe(lever.probe, row)), box))
        if progress is not None:
            progress(done, options.parameter_sets)
    space = _modes(lever, training, box, options)
    points, weights = _empirical_rule(space, training, options)
    base = lever.circuit.base_temperature_K
    few, atlas = space.at_points(points, weights), _atlas(space, training, box)
    return ReducedLever(space, few, points, atlas, base)


def cached_reduction(
    lever: Lever, progress: Progress | None = None, names: Collection[str] = ()
) -> ReducedLever:
    """Return the reduced lever of a lever's geometry and medium, from the cache or `reduce`."""
    reduced = known_reduction(lever, names)
    if reduced is None:
        reduced = reduce(lever, None, progress, names)
        store_arrays(_file(lever, Box.of(lever.probe, names)), reduced.arrays())
    return reduced


def known_reduction(lever: Lever, names: Collection[str] = ()) -> ReducedLever | None:
    """Return the reduced lever of a lever's geometry and medium, if it is in the cache."""
    base, box = lever.circuit.base_temperature_K, Box.of(lever.probe, names)
    found = stored(
        _file(lever, box), lambda arrays: ReducedLever.from_arrays(lever.space, base, box, arrays)
    )
    return found if found is not None and found.atlas.box.covers(lever.probe) else None


def _file(lever: Lever, box: Box) -> Path | None:
    """Return the file of a reduced lever, named by all that it depends on but the ranges."""
    elements, air, probe = lever.space.elements, lever.space.air, lever.probe
    held = {
        full_name(material, name): value
        for material, kind in probe.made_of.items()
        for name, value in kind.model_dump().items()
        if full_name(material, name) not in box.parameters
    }
    facts = {
        "shape": probe.shape.model_dump(),
        "tip": probe.tip and probe.tip.model_dump(),
        "base_temperature_K": lever.circuit.base_temperature_K,
        "gas_conductivity": probe.surroundings.gas_conductivity,
        "held": held,
        "laws": own_laws(probe.made_of),
        "parameters": list(box.parameters),
        "options": asdict(ReductionOptions()),
        # a change of Netgen's mesh makes a new file instead of a wrong answer
        "nodes": elements.nodes,
        "elements": elements.dofs,
        "points": elements.positions,
        "air": np.empty(0) if air is None else air.operator.matrix,
    }
    return cache_file("reduced", facts)


# --- training ---------------------------------------------------------------------------------


def _trained(lever: Lever, box: Box) -> Linearised:
    """Return a branch and its derivatives, without the factors: those of all branches are large."""
    found = Linearised.of(
        lever.probe, box.parameters, lever.branch(HOTTEST), lambda _: True, lever.equations
    )
    return replace(found, factors=None)


def _modes(
    lever: Lever, training: list[Linearised], box: Box, options: ReductionOptions
) -> ReducedSpace:
    """Find the modes of states, and of their changes with parameters and along the branch."""
    full = lever.space
    hot = full.is_temperature[:-1]
    cold = training[0].branch.states.slopes[:, 0]
    lift = np.where(hot, 0.0, cold[:-1] / cold[-1])
    widths = box.widths
    if full.air is not None and box.scale:
        widths[C_KAPPA] = _C_KAPPA_IN_AIR
    vectors = []
    for one in training:
        u = one.branch.u[1:]
        vectors.append(one.branch.x[:, 1:])
        vectors.append(one.branch.states.slopes[:, 1:] * (_BRANCH_STEP / (2.0 * u)))
        for name, width in widths.items():
            change = one.changes[:, 1:, box.parameters.index(name)]
            vectors.append(change * (_PARAMETER_STEP * width))
    together = np.concatenate(vectors, axis=1).T
    free = together[:, :-1] - together[:, -1:] * lift
    modes_T = leading_modes(np.where(hot, free, 0.0), options.modes_T)
    modes_V = leading_modes(np.where(hot, 0.0, free), options.modes_V)
    return ReducedSpace(full, modes_T, modes_V, lift)


def leading_modes(vectors: Array, count: int) -> Array:
    """Return the leading modes of some vectors, scaled so that their largest entry is one."""
    # the eigenvectors of the Gram matrix: far fewer vectors than values
    _, combinations = np.linalg.eigh(vectors @ vectors.T)
    modes = combinations[:, ::-1][:, :count].T @ vectors
    modes = np.linalg.qr(modes.T)[0].T
    scaled: Array = modes / np.abs(modes).max(axis=1, keepdims=True)
    return scaled


def _atlas(space: ReducedSpace, training: list[Linearised], box: Box) -> Atlas:
    """Fit states and what they show at the nodes that all branches have."""
    common = training[0].branch.u
    for one in training[1:]:
        common = common[np.isin(common.round(9), one.branch.u.round(9))]
    columns = [box.parameters.index(name) for name in box.names]
    values, slopes = [], []
    for one in training:
        here = np.flatnonzero(np.isin(one.branch.u.round(9), common.round(9)))
        states, changes = space.coordinates(one.branch.x), space.coordinates(one.changes)
        values.append(np.vstack([states, one.branch.values[:, :3].T])[:, here].T)
        together = np.concatenate([changes, one.shown.swapaxes(0, 1)])
        slopes.append(together[:, here][..., columns].swapaxes(0, 1))
    return Atlas.fitted(
        box,
        common,
        [one.probe for one in training],
        np.nan_to_num(np.stack(values)),  # a lever without reader shows no V_r
        np.nan_to_num(np.stack(slopes)),
        np.append(~space.is_temperature, [True] * len(SHOWN)),
    )


def _empirical_rule(
    space: ReducedSpace, training: list[Linearised], options: ReductionOptions
) -> tuple[Index, Array]:
    """Choose quadrature points and positive weights that keep the projected equations.

    The rule integrates the projected equations of all training states as the full one does, up to
    the tolerance: a non-negative least-squares problem on random combinations of their
    integrands.
    """
    weights = space.weights[:, 0]
    T = space.temperature.matrix.reshape(space.temperature.kinds, weights.size, -1)
    V = space.potential.matrix.reshape(space.potential.kinds, weights.size, -1)

    def integrands() -> Iterator[Array]:
        for one in training:
            for column in range(1, one.branch.u.size):
                fluxes = one.branch.equations.fluxes(one.branch.x[:, [column]])
                heat = np.concatenate([fluxes.heat_source[None], fluxes.heat])[..., 0]
                power = -fluxes.heat_source[:, 0] @ weights
                lever_V = one.branch.x[-1, column]
                yield np.einsum("dqm,dq->mq", T, heat) / power
                yield np.einsum("dqm,dq->mq", V, fluxes.charge[..., 0]) * (lever_V / power)

    return empirical_rule(integrands(), weights, options)


def empirical_rule(
    integrands: Iterable[Array], weights: Array, options: ReductionOptions
) -> tuple[Index, Array]:
    """Choose points and positive weights that integrate given integrands as all points do.

    Parameters
    ----------
    integrands : iterable of ndarray, shape (k, points)
        Of integrals that compare in size.
    weights : ndarray, shape (points,)
        Of all points.
    options : ReductionOptions
    """
    rng = np.random.default_rng(options.seed)
    sketch = np.zeros((options.sketch, weights.size))
    for some in integrands:
        rows = rng.integers(0, options.sketch, len(some))
        signs = rng.choice((-1.0, 1.0), len(some))
        np.add.at(sketch, rows, signs[:, None] * some * weights)
    values, vectors = np.linalg.eigh(sketch @ sketch.T)
    kept = values > (options.rule_tolerance**2) * values[-1]
    directions = (vectors[:, kept] / np.sqrt(values[kept])).T @ sketch
    shares, _ = nnls(directions, directions.sum(axis=1), maxiter=20 * len(directions))
    points = np.flatnonzero(shares)
    return points, shares[points] * weights[points]
