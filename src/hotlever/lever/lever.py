"""A probe made ready to solve: its branch, its sweeps, its solved states."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.typing import ArrayLike

from hotlever.errors import ComputationError, InputError, as_far_as_possible
from hotlever.lever.branch import TIP_RISE, Branch, Reach, Reading, branch_end, there_and_back
from hotlever.lever.continuation import continued
from hotlever.lever.dataset import (
    at_bias,
    checked_bias,
    dataset_of_branch,
    dataset_of_states,
    with_ramp,
)
from hotlever.lever.discretisation import chosen_space, flat_space, surrounded
from hotlever.lever.equations import LeverEquations
from hotlever.lever.full_space import FullSpace
from hotlever.lever.observables import sensitivities_of
from hotlever.lever.solved_states import state_at_bias
from hotlever.lever.space import TIP, Constraint
from hotlever.materials import Material
from hotlever.probe import Circuit, MeshOptions, Probe
from hotlever.probe.probe_parameters import usual_parameters
from hotlever.types import Array, Progress
from hotlever.work import one_blas_thread

if TYPE_CHECKING:
    import xarray as xr

#: Tip temperature (K) up to which branches are followed: where material laws end.
HOTTEST = 1300.0
#: A coarse mesh, with coarse panels for the air: within 2 K of the default one, at a fifth of its
#: price. For differences between levers, and for fits, which the default one corrects.
COARSE = MeshOptions(heater=0.5, corner=0.25, lever=0.2, panels=0.5)


class Lever:
    """A probe with its mesh, its operators and its equations, ready to be solved.

    Parameters
    ----------
    probe : Probe or path
        A probe, or the name of a probe file.
    mesh : MeshOptions, optional
        Taken as they are; by default the usual mesh is refined where it is not fine enough, see
        `hotlever.lever.discretisation`.
    space : FullSpace, optional
        Mesh and operators of another lever of the same shape.
    progress : callable, optional
        Called while the air operator of a new geometry is made, with steps done and their number.

    Attributes
    ----------
    probe : Probe
    space : FullSpace
        Mesh and operators, which levers of one shape share.
    equations : LeverEquations

    Examples
    --------
    >>> lever = Lever(Probe.reference())
    >>> sweep = lever.sweep([7.22, 8.268])
    >>> sweep.current_mA.values.round(3).tolist(), round(sweep.tip_K.sel(bias=7.22).item())
    ([0.949, 0.927], 547)
    """

    space: FullSpace

    @one_blas_thread
    def __init__(
        self,
        probe: Probe | str | os.PathLike[str],
        mesh: MeshOptions | None = None,
        *,
        space: FullSpace | None = None,
        progress: Progress | None = None,
    ) -> None:
        self.probe = Probe.coerce(probe)
        if space is None and mesh is None:
            space = chosen_space(self.probe)
        mesh = mesh or MeshOptions()
        self._panels = mesh.panels, min(mesh.panels, mesh.panels_over_surface)
        self.space = space or flat_space(self.probe.layout(), mesh, self.probe.wiring)
        if self.space.air.medium != self.medium:
            self.space = self._surrounded(self.space, progress)
        self._prepare()

    def _prepare(self) -> None:
        self.equations = LeverEquations.of_probe(self.space, self.probe)
        self._branch: Branch | None = None

    def _surrounded(self, space: FullSpace, progress: Progress | None = None) -> FullSpace:
        """Return a space in the probe's surroundings."""
        return surrounded(space, self.probe, self.panels, progress)

    @property
    def panels(self) -> float:
        """How fine the panels of the lever are, where there is air."""
        return self._panels[self.probe.surroundings.surface_gap_um is not None]

    @property
    def circuit(self) -> Circuit:
        """The measuring circuit."""
        return self.probe.circuit

    @property
    def medium(self) -> str:
        """What is around the lever: vacuum or air."""
        return self.probe.surroundings.medium

    def __repr__(self) -> str:
        return (
            f"<{type(self).__name__}: {self.probe.shape.shape} in {self.medium}, "
            f"{self.space.mesh.elements.nelements} elements, {self.space.size} unknowns>"
        )

    def with_material(self, material: Material) -> Self:
        """Return the same lever of another material; mesh, operators and air are shared."""
        return self.with_probe(self.probe.model_copy(update={"material": material}))

    def in_medium(self, medium: str) -> Self:
        """Return the same lever in vacuum or in air; mesh and operators are shared."""
        return self.with_probe(self.probe.in_medium(medium))

    def in_pulses(self) -> Self:
        """Return the same lever while the holder of its chip stays cold."""
        probe = self.probe.in_pulses()
        return self if probe is self.probe else self.with_probe(probe)

    def with_probe(self, probe: Probe) -> Self:
        """Return the lever of a probe of the same shape and tip; what is the same is shared."""
        if (probe.layout(), probe.wiring) != (self.probe.layout(), self.probe.wiring):
            raise InputError("another shape, tip or wiring needs a new Lever")
        other = copy(self)
        other.probe = probe
        if probe.model_copy(update={"monitor": self.probe.monitor}) == self.probe:
            return other  # its states are the same
        around, base = probe.surroundings, probe.circuit.base_temperature_K
        if (around, base) != (self.probe.surroundings, self.circuit.base_temperature_K):
            other.space = other._surrounded(self.space)
        other._prepare()
        return other

    # --- its branch ---------------------------------------------------------------------------

    @one_blas_thread
    def branch(self, hottest_K: float = HOTTEST, progress: Progress | None = None) -> Branch:
        """Return the lever by tip temperature, from cold to `hottest_K` or until silicon melts.

        Raises
        ------
        ComputationError
            If a state was not found.
        """
        rise = hottest_K - self.circuit.base_temperature_K
        return self._branch_until(lambda branch: branch.values[-1, TIP_RISE] >= rise, progress)

    def _branch_until(
        self, enough: Callable[[Branch], bool | np.bool_], progress: Progress | None = None
    ) -> Branch:
        """Return a branch that is long enough, going on from the one at hand."""
        try:
            self._branch = continued(self.equations, enough, self._branch, progress)
        except ComputationError as error:
            self._branch = error.partial
            raise
        return self._branch

    @one_blas_thread
    def branch_to(
        self, bias: float, progress: Progress | None = None, lowest: float | None = None
    ) -> Branch:
        """Return a branch that reaches biases (V), or ends before because silicon melts."""
        return self._branch_until(Reach(self.circuit, bias, lowest), progress)

    @one_blas_thread
    def branch_past_knee(self) -> Branch:
        """Return a branch that reaches beyond its knee, or ends below because silicon melts."""
        return self._branch_until(lambda branch: np.any(np.diff(branch.values[:-1, 0]) < 0))

    @one_blas_thread
    def solve(
        self, bias: ArrayLike, progress: Progress | None = None, *, and_back: bool = False
    ) -> list[State]:
        """Find the states that a slow ramp of the bias takes, each solved by itself.

        Parameters
        ----------
        bias : array_like, shape (n,)
            Biases (V) in any order; negative ones where held supplies make them differ.
        and_back : bool
            See `sweep`.
        progress : callable, optional
            Called with the states done and their number.

        Returns
        -------
        list of State
            In the order of `bias`; fields and currents to rounding errors.

        Raises
        ------
        InputError
            If a bias is not finite, or negative where it must not be.
        BranchEndError, ComputationError
            If not every bias is reached; ``partial`` holds the states up to there.
        """
        values = checked_bias(bias, self.probe, and_back)
        branch, reading, failure = self.read(values, and_back=and_back)
        if and_back:
            values = there_and_back(values)[: reading.u.size]
        states: list[State] = []
        for u, value in zip(reading.u, values.tolist(), strict=True):
            if failure is not None and np.isnan(u):
                failure.partial = states
                raise failure
            try:
                states.append(self._state_at(branch, u, value))
            except ComputationError as error:
                error.partial = states
                raise
            if progress is not None:
                progress(len(states), values.size)
        return states

    def _state_at(self, branch: Branch, u: float, bias: float) -> State:
        """Solve at a bias (V) from a place of the branch."""
        at = np.array([u])
        return self.polished(branch.states(at), bias, branch.parametrisation.constraint(at))

    def read(
        self, bias: Array, progress: Progress | None = None, *, and_back: bool = False
    ) -> tuple[Branch, Reading, ComputationError | None]:
        """Return the branch, where on it a ramp finds biases (V), and why it lacks some of them.

        One that goes back too, from the last of rising biases, finds `there_and_back` of them;
        from where the branch ends before there is no way back.
        """
        below, above = min(float(bias.min()), 0.0) or None, float(bias.max())
        branch, failure = as_far_as_possible(lambda: self.branch_to(above, progress, below))
        if and_back and failure is None:
            branch = self._branch = branch.with_folds(self.circuit)
        reading = branch.read(self.circuit, bias)
        if np.isnan(reading.u).any():
            return branch, reading, failure or branch_end(branch, reading)
        if and_back:
            back = branch.read_back(self.circuit, bias[-2::-1], reading.u[-1])
            reading = reading.and_back(back)
        return branch, reading, None

    @one_blas_thread
    def polished(self, guess: Array, bias: float, constraint: Constraint = TIP) -> State:
        """Solve at a bias (V) from a nearby state, (size + 1, 1); see `state_at_bias`."""
        if bias == 0.0 and not guess.any():
            return State(self, guess)  # without power nothing leads along the branch
        return State(self, state_at_bias(self.equations, self.circuit, bias, guess, constraint))

    @one_blas_thread
    def sweep(
        self,
        bias: ArrayLike,
        *,
        sensitivities: bool = False,
        and_back: bool = False,
        progress: Progress | None = None,
    ) -> xr.Dataset:
        """Read the lever's branch over a range of bias.

        Parameters
        ----------
        bias : array_like, shape (n,)
            Biases (V) in any order, met by a slow ramp from zero; negative ones, met by another,
            where held supplies make them differ.
        sensitivities : bool
            Add the derivatives of what a fit compares, at fixed bias, by the parameters that it
            usually varies.
        and_back : bool
            Let the ramp go back from the last bias as well; biases rise then, from 0 V or more. The
            coordinate ``ramp`` says which rows are of the way ``up`` and ``down``. Where the lever
            jumps it does so at other biases on either way.
        progress : callable, optional
            Called with the states done and how many there usually are.

        Returns
        -------
        xarray.Dataset
            One variable for each of `SWEEP_COLUMNS` and a few more on the dimension ``bias``, in
            the order of `bias`; units and long names as attributes; the probe, material, circuit
            and version as attributes of the dataset.

        Raises
        ------
        InputError
            If a bias is not finite, or negative where it must not be, or they do not rise.
        BranchEndError, ComputationError
            If not every bias is reached; ``partial`` holds the dataset up to there.

        Notes
        -----
        Between the states of the branch curves are within 2e-5 in V_l and I_h and 0.02 K of solved
        ones (`solve`), a third of the mesh's error, the highest temperature too; 5e-5 and 0.05 K
        where a leg gets hot faster than the tip.
        """
        values = checked_bias(bias, self.probe, and_back)
        branch, reading, failure = self.read(values, progress, and_back=and_back)
        up = values.size
        if and_back:
            values = there_and_back(values)[: reading.u.size]
        reached = np.flatnonzero(np.isfinite(reading.u))
        u, slopes = reading.u[reached], None
        if sensitivities:
            slopes = sensitivities_of(branch, u, self.circuit, usual_parameters(self.probe))
        notes = reading.notes(values[reached])
        data = dataset_of_branch(self.probe, branch, u, notes, slopes)
        data = at_bias(data, values[reached])
        if and_back:
            data = with_ramp(data, reached < up)
        if failure is not None:
            failure.partial = data
            raise failure
        return data

    @one_blas_thread
    def dataset(self, states: Sequence[State], notes: Sequence[str] = ()) -> xr.Dataset:
        """Return what is observed of solved states, as `sweep` does."""
        x = np.hstack([np.zeros((self.space.size + 1, 0)), *(state.x for state in states)])
        return dataset_of_states(self.probe, self.equations, x, notes)

    @one_blas_thread
    def knee(self) -> xr.Dataset:
        """Return the knee of the I-V curve, dV_l/dI_h = 0, as a sweep of one state.

        Without a series resistor the knee is the fold at which a bias ramp leaves the branch;
        the state does not depend on the resistor, only its bias does.

        Raises
        ------
        ComputationError
            If V_l keeps rising until the silicon melts.
        """
        branch = self.branch_past_knee()
        if branch.knee_u is None:
            end = f"{self.equations.laws.limit[1]}, with the tip at {branch.hottest_K:.0f} K"
            raise ComputationError(f"V_l rises until {end}: there is no knee")
        return dataset_of_branch(self.probe, branch, np.array([branch.knee_u]))


@dataclass(frozen=True)
class State:
    """A solved state of a lever in its circuit.

    Attributes
    ----------
    lever : Lever
    x : ndarray, shape (size + 1, 1)
        Unknowns, see `hotlever.lever.space`.
    in_air : ndarray, shape (stores, 1), or None
        Temperatures in the air in time, see `hotlever.air.stores`; None at rest.
    """

    lever: Lever
    x: Array
    in_air: Array | None = None

    @property
    def unknowns(self) -> Array:
        """The unknowns and below them the temperatures in the air, (size + 1 + stores, 1)."""
        in_air = self.in_air
        if in_air is None:
            in_air = self.lever.equations.heat_in_air.follows(self.x)
        return np.concatenate([self.x, in_air])

    @cached_property
    def _electrical_outputs(self) -> list[float]:
        return list(self.lever.equations.observed(self.x)[:, 0].tolist())

    @property
    def lever_V(self) -> float:
        """Lever voltage V_l (V)."""
        return self._electrical_outputs[0]

    @property
    def current_mA(self) -> float:
        """Heater current I_h (mA)."""
        return self._electrical_outputs[1]

    @property
    def reader_V(self) -> float:
        """Reader voltage V_r (V); NaN without a reader."""
        return self._electrical_outputs[2]

    @property
    def bias_V(self) -> float:
        """Bias V_b (V) in the lever's circuit."""
        return float(self.lever.circuit.bias(self.lever_V, self.current_mA))

    @property
    def bridge_output_V(self) -> float:
        """Bridge voltage V_bridge (V); NaN without a bridge."""
        return float(self.lever.circuit.bridge_voltage(self.lever_V, self.bias_V))

    @property
    def tip_K(self) -> float:
        """Tip temperature (K)."""
        rise = self.lever.space.tip_rise(self.x)
        return self.lever.circuit.base_temperature_K + float(rise[0])

    @cached_property
    def nodal(self) -> tuple[Array, Array]:
        """Temperature (K) and potential (V) at the nodes of the elements."""
        equations = self.lever.equations
        base = equations.base_temperature_K
        return self.lever.space.nodal(self.x[:, 0], base, equations.terminals.end_rises)


def sweep(
    probe: Probe,
    bias: ArrayLike,
    *,
    sensitivities: bool = False,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Mesh and solve a probe over a range of bias; see `Lever.sweep`.

    Examples
    --------
    >>> data = sweep(Probe.reference(), [1.0, 7.22])
    >>> data.tip_K.round(0).values.tolist()
    [295.0, 547.0]
    """
    return Lever(probe).sweep(bias, sensitivities=sensitivities, progress=progress)
