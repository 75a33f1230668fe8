"""A reduced lever: the same equations on a few modes, for a domain of parameters.

Two sets of points share the work: Newton's method runs on the few of an empirical cubature; then
residuals at all points, with the same Jacobians, remove what the cubature lacks. So the cubature
decides how fast a state is found, and the modes alone how accurate it is.

Its a-posteriori error: its states are put into the equations of the full lever. Two steps with the
full residual and the Jacobian at the reduced state show where the full state of the same tip
temperature lies, up to an error of third order in the distance. No full state has to be found.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hotlever.lever.branch import TIP_RISE, Branch, Reach
from hotlever.lever.equations import LeverEquations
from hotlever.lever.lever import COARSE, Lever
from hotlever.lever.newton import NewtonOptions, NewtonResult
from hotlever.lever.observables import Linearised, at_fixed_bias
from hotlever.lever.reduced.reduced_space import ReducedSpace
from hotlever.lever.reduced.response_surface import ParameterDomain, ResponseSurface
from hotlever.lever.similar import SimilarLevers
from hotlever.lever.solved_states import Constrained, solve_at
from hotlever.lever.space import TIP
from hotlever.probe import Circuit, Probe
from hotlever.types import Array, Index
from hotlever.work import one_blas_thread

#: What is stored of a response surface.
_OF_SURFACE = ("u", "coefficients", "grows", "scale")


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
            **{name: np.asarray(getattr(self.surface, name)) for name in _OF_SURFACE},
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
        fitted: dict[str, Any] = {name: arrays[name] for name in _OF_SURFACE}
        there = replace(domain, low=arrays["low"], high=arrays["high"])
        return cls(space, few, points, ResponseSurface(there, **fitted), lever.probe)


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
