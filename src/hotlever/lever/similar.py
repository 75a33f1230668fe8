"""Levers of similar probes: what solves them all, and one mesh that moves with their dimensions."""

from __future__ import annotations

from copy import copy
from typing import Protocol, Self

from hotlever.air.coupling import AirLoss
from hotlever.lever.branch import Branch, Reach
from hotlever.lever.continuation import at_points_of, continued
from hotlever.lever.equations import LeverEquations
from hotlever.lever.full_space import FullSpace
from hotlever.lever.lever import Lever
from hotlever.lever.motion import motion_of
from hotlever.lever.newton import NewtonOptions
from hotlever.lever.parametrisation import solve_at
from hotlever.lever.sensitivities import Linearised
from hotlever.probe import Probe
from hotlever.probe.moving import MovingMesh
from hotlever.probe.parameters import dimensions_of, usual_parameters
from hotlever.threads import one_blas_thread
from hotlever.types import Array


class BranchSolver(Protocol):
    """Solves the branch of any similar probe: a lever as it is, on a coarse mesh, or reduced."""

    @property
    def drawn(self) -> Probe:
        """The probe whose drawing has the mesh."""
        ...

    def linearised(
        self,
        probe: Probe,
        reach: Reach,
        near: Linearised | None = None,
        names: tuple[str, ...] | None = None,
    ) -> Linearised:
        """Solve the branch of a probe, with its derivatives; see `SimilarLevers.linearised`."""
        ...

    def for_any_parameters(self) -> BranchSolver:
        """Return what solves levers far away too, for which this may not be made."""
        ...

    def full_states(
        self, branch: Branch, equations: LeverEquations, reach: Reach
    ) -> tuple[Array, Array]:
        """Return u of states of a branch of this lever, (k,), and those of another's equations.

        These, (size + 1, k), are as many as it takes to see by how much the branches differ.
        """
        ...

    def tip_error_K(self, probe: Probe, branch: Branch) -> float:
        """Return by how much tips on a branch of it may be off its equations' at a fixed bias."""
        ...


class SimilarLevers:
    """A lever, and what it would be with other parameters.

    What is solved changes smoothly with the parameters, dimensions included, since the mesh stays
    the same but for being moved.

    Parameters
    ----------
    lever : Lever
        Flat, if dimensions are to change.
    """

    def __init__(self, lever: Lever) -> None:
        self._lever = lever
        self._moving = MovingMesh(lever.space.mesh, lever.probe)

    @property
    def drawn(self) -> Probe:
        """The probe whose drawing has the mesh."""
        return self._lever.probe

    def lever(self, probe: Probe) -> Lever:
        """Return the lever of a similar probe, on the same mesh moved."""
        return Lever(probe, space=self._space(probe))

    def equations(self, probe: Probe, names: tuple[str, ...] = ()) -> LeverEquations:
        """Return the equations of a probe, with the motions of the dimensions among some names."""
        space = self._space(probe)
        dimensions = [name for name in names if name in dimensions_of(probe)]
        motions = {
            name: motion_of(space, self._moving.movement(probe, name)) for name in dimensions
        }
        return LeverEquations.of_probe(space, probe, motions=motions)

    def for_any_parameters(self) -> Self:
        """See `BranchSolver`."""
        return self

    def full_states(
        self, branch: Branch, equations: LeverEquations, reach: Reach
    ) -> tuple[Array, Array]:
        """See `BranchSolver`."""
        other = at_points_of(branch, continued(equations, reach))
        return other.u[other.solved], other.x[:, other.solved]

    def tip_error_K(self, probe: Probe, branch: Branch) -> float:
        """See `BranchSolver`: its states are solved."""
        return 0.0

    def _space(self, probe: Probe) -> FullSpace:
        """Return mesh, operators and air of a similar probe."""
        space = self._lever.space
        if (probe.shape, probe.tip) != (self.drawn.shape, self.drawn.tip):
            space = FullSpace(self._moving.mesh_of(probe), wiring=space.wiring)
        space = copy(space)
        # air takes up from a place nearly what it took before the place moved a little
        space.air = self._air(probe)
        return space

    def _air(self, probe: Probe) -> AirLoss:
        """Return the air around a similar probe."""
        air, around = self._lever.space.air, probe.surroundings
        if around.gas_conductivity != air.gas_conductivity:
            air = air.in_gas(around.gas_conductivity)
        if around.surface_gap_um != self.drawn.surroundings.surface_gap_um:
            air = air.in_gap(around.surface_gap_um)
        return air

    @one_blas_thread
    def linearised(
        self,
        probe: Probe,
        reach: Reach,
        near: Linearised | None = None,
        names: tuple[str, ...] | None = None,
    ) -> Linearised:
        """Solve the branch of a probe, with its derivatives.

        Parameters
        ----------
        probe : Probe
        reach : Reach
        near : Linearised, optional
            Of a similar probe on this mesh, to start from.
        names : tuple of str
            Parameters of the derivatives, see `hotlever.probe.parameters`; by default what a fit
            usually varies.

        Raises
        ------
        ComputationError
            If a state was not found.
        """
        names = usual_parameters(probe) if names is None else names
        equations = self.equations(probe, names)
        if near is None:
            branch = continued(equations, reach)
        else:
            parametrisation, solved = near.branch.parametrisation, near.branch.solved
            u, guess = near.branch.u[solved], near.states(probe)[:, solved]
            roots = solve_at(equations, u, guess, NewtonOptions(), near.factors, parametrisation)
            branch = Branch.whole(equations, u, roots, parametrisation)
        return Linearised.of(probe, names, branch, reach)
