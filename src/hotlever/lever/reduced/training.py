"""Training a reduced lever: known branches give its modes, its cubature, its response surface."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from hotlever.cache import cache_file, store_arrays, stored
from hotlever.lever.equations import ELECTRICAL_OUTPUTS
from hotlever.lever.lever import Lever
from hotlever.lever.observables import Linearised
from hotlever.lever.reduced.reduced_lever import ReducedLever
from hotlever.lever.reduced.reduced_space import ReducedSpace, empirical_cubature
from hotlever.lever.reduced.response_surface import ParameterDomain, ResponseSurface
from hotlever.materials import full_name
from hotlever.probe import Probe
from hotlever.probe.probe_parameters import of_materials
from hotlever.types import Array, Progress
from hotlever.work import each, one_blas_thread


@dataclass(frozen=True)
class ReductionOptions:
    """How a reduced lever is made.

    Attributes
    ----------
    parameter_sets : int
        Parameter sets whose whole branch is solved.
    modes_T, modes_V : int
        Modes of each field. The reader voltage, a small potential, asks for more of the latter.
    hottest_K : float
        Tip temperature up to which states are collected.
    parameter_step, branch_step_K : float
        Size of the changes of a state that join the snapshots: as a share of the domain, and in the
        tip temperature.
    """

    parameter_sets: int = 8
    modes_T: int = 36
    modes_V: int = 48
    hottest_K: float = 1350.0
    parameter_step: float = 0.25
    branch_step_K: float = 50.0


def can_be_reduced(probe: Probe, names: Collection[str]) -> bool:
    """Return whether a reduced lever serves: of one geometry, for parameters of its materials.

    With dimensions among the parameters it does not, since its modes are those of one geometry, nor
    in another circuit than the paper's, nor with effects beyond the paper or a tip in contact: with
    these a scale of κ changes more than the power, and the two polarities may differ. A chip that
    gets warmer does not scale with κ either.
    """
    circuit = probe.circuit
    plain = circuit.is_plain and not (circuit.chip_K_per_mW or probe.physics or probe.contact)
    return plain and set(names) <= set(of_materials(probe))


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
        raise ValueError(
            "a reduced lever is in the paper's circuit and physics, for materials that vary"
        )
    from scipy.stats import qmc  # takes long, and most commands reduce nothing

    options, domain = options or ReductionOptions(), ParameterDomain.of(lever.probe, names)
    shares = qmc.Sobol(len(domain.names), seed=0).random(options.parameter_sets)
    training = [
        _trained(lever.with_probe(domain.probe(lever.probe, row)), domain, options.hottest_K)
        for row in each(list(shares), progress)
    ]
    space = _space(lever, training, domain, options)
    points, weights = empirical_cubature(_integrands(space, training), space.weights[:, 0])
    few, surface = space.at_points(points, weights), _surface(space, training, domain)
    return ReducedLever(space, few, points, surface, lever.probe)


def cached_reduction(
    lever: Lever, progress: Progress | None = None, names: Collection[str] = ()
) -> ReducedLever:
    """Return the reduced lever of a lever's geometry and medium, from the cache or `reduce`."""
    reduced = known_reduction(lever, names)
    if reduced is None:
        reduced = reduce(lever, None, progress, names)
        store_arrays(_file(lever, ParameterDomain.of(lever.probe, names)), reduced.arrays())
    return reduced


def known_reduction(lever: Lever, names: Collection[str] = ()) -> ReducedLever | None:
    """Return the reduced lever of a lever's geometry and medium, if it is in the cache."""
    domain = ParameterDomain.of(lever.probe, names)
    reduced = stored(
        _file(lever, domain),
        lambda arrays: ReducedLever.from_arrays(lever, domain, arrays),
    )
    covers = reduced is not None and reduced.surface.domain.covers(lever.probe)
    return reduced if covers else None


def _file(lever: Lever, domain: ParameterDomain) -> Path | None:
    """Return the file of a reduced lever, named by all that it depends on but the ranges.

    There is none of a lever with laws of its own: whoever changes their code keeps their name.
    """
    if lever.probe.classes:
        return None
    elements, air, probe = lever.space.elements, lever.space.air, lever.probe
    held = {
        full_name(material, name): value
        for material, kind in probe.made_of.items()
        for name, value in kind.model_dump().items()
        if full_name(material, name) not in domain.parameters
    }
    facts = {
        "shape": probe.shape.model_dump(),
        "tip": probe.tip and probe.tip.model_dump(),
        "base_temperature_K": lever.circuit.base_temperature_K,
        "gas_conductivity": probe.surroundings.gas_conductivity,
        "held": held,
        "parameters": list(domain.parameters),
        "options": asdict(ReductionOptions()),
        # a change of Netgen's mesh makes a new file instead of a wrong answer
        "nodes": elements.nodes,
        "elements": elements.dofs,
        "points": elements.positions,
        "air": air.operator.matrix,
    }
    return cache_file("reduced", facts)


# --- training ---------------------------------------------------------------------------------


def _trained(lever: Lever, domain: ParameterDomain, hottest_K: float) -> Linearised:
    """Return a branch and its derivatives, without the factors: those of all branches are large."""
    branch = lever.branch(hottest_K)
    linearised = Linearised.of(
        lever.probe, domain.parameters, branch, lambda _: True, lever.equations
    )
    return replace(linearised, factors=None)


def _space(
    lever: Lever, training: list[Linearised], domain: ParameterDomain, options: ReductionOptions
) -> ReducedSpace:
    """Find the modes of states, and of their changes with parameters and along the branch."""
    full = lever.space
    cold = training[0].branch.slopes[:, 0]
    lift = np.where(full.is_temperature[:-1], 0.0, cold[:-1] / cold[-1])
    widths = domain.widths
    if full.air.medium == "air" and domain.scale:
        # silicon competes with air there, so the derivative by c_κ joins the snapshots
        widths["c_kappa"] = 0.25
    snapshots = []
    for linearised in training:
        branch = linearised.branch
        snapshots.append(branch.x[:, 1:])
        snapshots.append(branch.slopes[:, 1:] * (options.branch_step_K / (2.0 * branch.u[1:])))
        for name, width in widths.items():
            change = linearised.changes[:, 1:, domain.parameters.index(name)]
            snapshots.append(change * (options.parameter_step * width))
    together = np.concatenate(snapshots, axis=1)
    return ReducedSpace.of_snapshots(full, lift, together, most=(options.modes_T, options.modes_V))


def _surface(
    space: ReducedSpace, training: list[Linearised], domain: ParameterDomain
) -> ResponseSurface:
    """Fit states and what they show at the nodes that all branches have."""
    common = training[0].branch.u
    for linearised in training[1:]:
        common = common[np.isin(common.round(9), linearised.branch.u.round(9))]
    columns = [domain.parameters.index(name) for name in domain.names]
    values, slopes = [], []
    for linearised in training:
        branch = linearised.branch
        here = np.flatnonzero(np.isin(branch.u.round(9), common.round(9)))
        states, changes = space.coordinates(branch.x), space.coordinates(linearised.changes)
        values.append(np.vstack([states, branch.values[:, :3].T])[:, here].T)
        electrical_slopes = linearised.output_slopes[:, : len(ELECTRICAL_OUTPUTS)].swapaxes(0, 1)
        together = np.concatenate([changes, electrical_slopes])
        slopes.append(together[:, here][..., columns].swapaxes(0, 1))
    return ResponseSurface.fitted(
        domain,
        common,
        [linearised.probe for linearised in training],
        np.nan_to_num(np.stack(values)),  # a lever without reader shows no V_r
        np.nan_to_num(np.stack(slopes)),
        np.append(~space.is_temperature, [True] * len(ELECTRICAL_OUTPUTS)),
    )


def _integrands(space: ReducedSpace, training: list[Linearised]) -> Iterator[Array]:
    """Give what the projected equations integrate at all training states, by their power."""
    weights = space.weights[:, 0]
    for branch in (linearised.branch for linearised in training):
        for column in range(1, branch.u.size):
            fluxes = branch.equations.fluxes(branch.x[:, [column]])
            heat = np.concatenate([fluxes.heat_source[None], fluxes.heat])[..., 0]
            power = -fluxes.heat_source[:, 0] @ weights
            yield space.temperature.integrands(heat) / power
            lever_V = branch.x[-1, column]
            yield space.potential.integrands(fluxes.charge[..., 0]) * (lever_V / power)
