"""Levers of similar probes on one mesh, which moves with their dimensions."""

from __future__ import annotations

from hotlever.lever.branch import Reach
from hotlever.lever.equations import LeverEquations
from hotlever.lever.following import Follower, branch_of
from hotlever.lever.full_space import FullSpace
from hotlever.lever.lever import Lever
from hotlever.lever.motion import motion_of
from hotlever.lever.newton import NewtonOptions, find_roots
from hotlever.lever.pinned import AtTip
from hotlever.lever.sensitivities import Linearised
from hotlever.materials import PARAMETERS
from hotlever.probe import Probe
from hotlever.probe.moving import MovingMesh
from hotlever.threads import one_blas_thread


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
        self._moving = MovingMesh(lever.space.mesh, lever.probe.shape)

    def equations(self, probe: Probe, names: tuple[str, ...] = ()) -> LeverEquations:
        """Return the equations of a probe, with the motions of the dimensions among some names."""
        space = self._lever.space
        if probe.shape != self._lever.probe.shape:
            space = FullSpace(self._moving.at(probe.shape, probe.layout()))
            # air takes up from a place nearly what it took before the place moved a little
            space.air = self._lever.space.air
        gas = probe.surroundings.gas_conductivity
        if space.air is not None and gas != space.air.gas_conductivity:
            space = space.in_gas(gas)
        dimensions = [name for name in names if name in probe.shape.dimensions()]
        motions = {name: motion_of(space, self._moving.movement(name)) for name in dimensions}
        base = probe.circuit.base_temperature_K
        return LeverEquations(space, probe.material, base, motions)

    @one_blas_thread
    def linearised(
        self,
        probe: Probe,
        reach: Reach,
        near: Linearised | None = None,
        names: tuple[str, ...] = tuple(PARAMETERS),
    ) -> Linearised:
        """Solve the branch of a probe, with its derivatives.

        Parameters
        ----------
        probe : Probe
        reach : Reach
        near : Linearised, optional
            Of a similar probe on this mesh, to start from.
        names : tuple of str
            Parameters of the derivatives, see `hotlever.probe.parameters`.

        Raises
        ------
        ComputationError
            If a state was not found.
        """
        equations = self.equations(probe, names)
        if near is None:
            branch = Follower(equations).until(reach)
        else:
            u, guess = near.branch.u[1:], near.states(probe)[:, 1:]
            found = find_roots(AtTip(equations, u**2), guess, NewtonOptions(), near.factors)
            branch = branch_of(equations, u, found)
        return Linearised.of(probe, names, branch, reach)
