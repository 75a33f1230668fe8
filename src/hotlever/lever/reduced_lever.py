"""A reduced lever: the same equations on a few modes, for a domain of parameters; how it is made.

Two sets of points share the work: Newton's method runs on the few of an empirical cubature; then
residuals at all points, with the same Jacobians, remove what the cubature lacks. So the cubature
decides how fast a state is found, and the modes alone how accurate it is.

Its a-posteriori error: its states are put into the equations of the full lever. Two steps with the
full residual and the Jacobian at the reduced state show where the full state of the same tip
temperature lies, up to an error of third order in the distance. No full state has to be found.

It is trained: known branches give its modes, its cubature and its response surface.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from hotlever.cache import cache_file, store_arrays, stored
from hotlever.lever.branch import TIP_RISE, Branch, Reach
from hotlever.lever.equations import ELECTRICAL_OUTPUTS, LeverEquations
from hotlever.lever.lever import COARSE, Lever
from hotlever.lever.newton import NewtonOptions, NewtonResult
from hotlever.lever.observables import Linearised, at_fixed_bias
from hotlever.lever.reduced_space import ReducedSpace, empirical_cubature
from hotlever.lever.response_surface import ParameterDomain, ResponseSurface
from hotlever.lever.similar import SimilarLevers
from hotlever.lever.solved_states import Constrained, solve_at
from hotlever.lever.space import TIP
from hotlever.materials import full_name
from hotlever.probe import Circuit, Probe
from hotlever.probe.probe_parameters import of_materials
from hotlever.types import Array, Index, Progress
from hotlever.work import each, one_blas_thread


@dataclass(frozen=True)
class ReducedLever:
    """The reduced lever of a geometry, medium and base temperature.

    How wrong it is depends on the material: `estimated_error`.

    Attributes
    ----------
    space, hyper_reduced : ReducedSpace
        At all points, and at the few of the cubature.
    points : ndarray of int
        Which of the full lever's quadrature points the few are.
    surface : ResponseSurface
        To start from.
    drawn : Probe
        One of that geometry, medium and base temperature.
    """

    space: ReducedSpace
    hyper_reduced: ReducedSpace
    points: Index
    surface: ResponseSurface
    drawn: Probe

    @property
    def names(self) -> tuple[str, ...]:
        """The parameters that it is made for."""
        return self.surface.domain.parameters

    def _equations(self, probe: Probe, space: ReducedSpace) -> LeverEquations:
        circuit = Circuit(base_temperature_K=self.drawn.circuit.base_temperature_K)
        return LeverEquations(space, probe.kinds, circuit, probe.physics)

    @one_blas_thread
    def solved(
        self, probe: Probe, u: Array, guess: Array, factors: Any = None
    ) -> tuple[LeverEquations, NewtonResult]:
        """Solve states of a probe's materials, (size + 1, k), on the few points.

        They are given by u = √(T_tip − T_base) above zero; the factors may be of states nearby.

        Raises
        ------
        NewtonError
            If a state was not found.
        """
        few = self._equations(probe, self.hyper_reduced)
        # an error of 1 K or 10 mV is small enough to start from on all points
        options = NewtonOptions(tolerance=1e-2, keep_while=0.2, max_iterations=12)
        return few, solve_at(few, u, guess, options, factors)

    @one_blas_thread
    def branch(self, probe: Probe, reach: Reach) -> Branch:
        """Return a probe's branch at the few points: within 0.1 K, in a third of the time.

        Raises
        ------
        NewtonError
            If a state was not found.
        """
        u, guess = self._start(probe, reach)
        few, roots = self.solved(probe, u, guess)
        return Branch.whole(few, u, roots)

    def _start(self, probe: Probe, reach: Reach) -> tuple[Array, Array]:
        """Return u of the states that suffice, and guesses of them."""
        count = reach.count(self.surface.electrical_outputs(probe))
        return self.surface.u[1:count], self.surface.states(probe)[:, 1:count]

    @one_blas_thread
    def linearised(
        self,
        probe: Probe,
        reach: Reach,
        near: Linearised | None = None,
        names: tuple[str, ...] | None = None,
    ) -> Linearised:
        """Solve the branch of a probe of another material, with its derivatives by the material.

        It starts from a branch of a similar material, or from the response surface; see
        `hotlever.lever.similar.SimilarLevers.linearised`.
        """
        names = self.names if names is None else names
        if not set(names) <= set(self.names):
            raise ValueError(f"a reduced lever has derivatives by {', '.join(self.names)} only")
        if near is None:
            (u, guess), factors = self._start(probe, reach), None
        else:
            u, guess, factors = near.branch.u[1:], near.states(probe)[:, 1:], near.factors
        few, roots = self.solved(probe, u, guess, factors)
        every = self._equations(probe, self.space)
        options = NewtonOptions(tolerance=1e-3, keep_while=0.5, max_iterations=12)
        roots = solve_at(every, u, roots.x, options, roots.factors)
        # derivatives by the material are taken at the few points: exact ones cost too much here
        branch = Branch.whole(every, u, roots)
        return Linearised.of(probe, names, branch, reach, few, roots.factors)

    def for_any_parameters(self) -> SimilarLevers:
        """Return what solves levers far away too, for which this may not be made."""
        return SimilarLevers(Lever(self.drawn, COARSE))

    def full_states(self, branch: Branch, equations: LeverEquations) -> tuple[Array, Array]:
        """See `SimilarLevers.full_states`: few, since the errors are small and smooth."""
        some = np.unique(np.linspace(1, branch.u.size - 1, 10).astype(int))
        u, guess = branch.u[some], self.space.expanded(branch.x[:, some])
        return u, solve_at(equations, u, guess, NewtonOptions(tolerance=1e-5)).x

    def tip_error_K(self, probe: Probe, branch: Branch) -> float:
        """See `SimilarLevers.tip_error_K`: what the full lever's residual says."""
        u = branch.u[np.linspace(1, branch.u.size - 1, 4).astype(int)]
        *_, tip = estimated_error(Lever(probe), branch, u)
        return float(tip.max())

    # --- on disk ----------------------------------------------------------------------------------

    def arrays(self) -> dict[str, Array]:
        """Return what `from_arrays` makes the reduced lever of again."""
        space, domain = self.space, self.surface.domain
        return {
            "modes_T": space.modes[: space.count],
            "modes_V": space.modes[space.count :],
            "lift": space.lift,
            "points": self.points,
            "weights": self.hyper_reduced.weights[:, 0],
            "low": domain.low,
            "high": domain.high,
            "u": self.surface.u,
            "coefficients": self.surface.coefficients,
            "grows": self.surface.grows,
            "scale": np.asarray(self.surface.scale),
        }

    @classmethod
    def from_arrays(
        cls,
        lever: Lever,
        domain: ParameterDomain,
        arrays: Mapping[str, Array],
    ) -> ReducedLever:
        """Make the reduced lever of a lever of stored arrays, which have the domain's ranges.

        Raises
        ------
        KeyError, ValueError, IndexError
            If they do not belong to the space.
        """
        space = ReducedSpace(lever.space, arrays["modes_T"], arrays["modes_V"], arrays["lift"])
        points = arrays["points"].astype(np.intp)
        few = space.at_points(points, arrays["weights"])
        names = "u", "coefficients", "grows", "scale"
        of_surface: dict[str, Any] = {name: arrays[name] for name in names}
        there = replace(domain, low=arrays["low"], high=arrays["high"])
        return cls(space, few, points, ResponseSurface(there, **of_surface), lever.probe)


@one_blas_thread
def estimated_error(lever: Lever, branch: Branch, u: Array) -> Array:
    """Estimate how far a reduced lever's branch is from the full lever's, at fixed biases.

    Parameters
    ----------
    lever : Lever
        The full one, whose circuit counts.
    branch : Branch
        Of a reduced lever of the same geometry.
    u : ndarray, shape (n,)
        √(T_tip − T_base), where to look; above zero.

    Returns
    -------
    ndarray, shape (3, n)
        Bounds on the errors of I_h (mA), V_r (V) and T_tip (K).
    """
    equations = LeverEquations(
        lever.space, branch.equations.materials, lever.circuit, branch.equations.laws.physics
    )
    x, every = branch.equations.space.expanded(branch.states(u)), np.arange(u.size)
    problem = Constrained(equations, TIP, u**2)
    factors = problem.factorised(x, every)
    first = x - factors.solve(problem.residual(x, every), every)
    second = -factors.solve(problem.residual(first, every), every)
    # third index: what the steps say, and the second step alone
    away = np.zeros((u.size, TIP_RISE + 1, 2))
    away[:, :TIP_RISE, 0] = equations.observed(first + second).T - branch.curve(u)[:, :TIP_RISE]
    away[:, :TIP_RISE, 1] = equations.observed_change(first, second).T
    # without that of V_l, which follows at a bias
    errors = np.abs(at_fixed_bias(branch.curve(u, 1), lever.circuit, away))[1:]
    both, second_alone = np.moveaxis(errors, 2, 0)
    # the estimate is a tenth larger than the steps say, and larger by the second of them; and never
    # below what the states are solved to (mA, V, K)
    floor = np.array([2e-8, 2e-8, 5e-5])
    return np.maximum(1.1 * both + second_alone, floor[:, None])


# --- how it is made -------------------------------------------------------------------------------


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
