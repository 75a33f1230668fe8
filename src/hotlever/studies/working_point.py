"""What a lever shows at a working point and at its knee, with derivatives by its design.

A quantity of a state follows from V_l, I_h and T_tip. At a fixed rise of the tip their derivatives
by a dimension or a material parameter are exact (`hotlever.lever.observables`); the state of a
working point, or of the knee, then moves along the branch until it is one again:
dq = ∂q + q' du with g' du = −∂g, where g = 0 says which state it is. How sensitively a lever reads
its distance to a surface depends on the air, which moves with every dimension, so that it is
differentiated by levers beside it, each with a mesh and panels of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hotlever.errors import ComputationError
from hotlever.lever.branch import TIP_RISE, Branch, Reach
from hotlever.lever.continuation import continued
from hotlever.lever.lever import COARSE, Lever, State
from hotlever.lever.newton import NewtonOptions
from hotlever.lever.observables import by_parameter
from hotlever.lever.reader import Reader, Signal
from hotlever.lever.similar import SimilarLevers
from hotlever.lever.solved_states import solve_at
from hotlever.lever.transient.modes import slowest_modes
from hotlever.probe import Circuit, Probe
from hotlever.types import Array

#: Quantities of the knee, and what they are of any state.
OF_THE_KNEE = {
    "knee_K": "tip_K",
    "knee_mW": "power_mW",
    "knee_bias_V": "bias_V",
    "knee_V": "lever_V",
    "knee_mA": "current_mA",
}
#: From the working point up to the knee.
DISTANCES = {"knee_distance_K": "knee_K", "knee_distance_V": "knee_bias_V"}
#: Of a lever in air over a surface, see `hotlever.lever.reader`.
OF_THE_READER = ("dV_dz_V_per_um", "dlnR_dz_per_um", "resolution_nm_per_rtHz")
#: All that may be made least or greatest, or bounded.
QUANTITIES = (
    *OF_THE_KNEE.values(),
    "time_constant_us",
    *OF_THE_READER,
    *OF_THE_KNEE,
    *DISTANCES,
)


@dataclass(frozen=True)
class WorkingPoint:
    """Where a lever works: the state of a tip temperature, a bias or a power.

    Attributes
    ----------
    column : str
        ``tip_K``, ``bias_V`` or ``power_mW``.
    value : float
        K, V or mW.
    """

    column: str
    value: float

    def is_reached(self, branch: Branch, circuit: Circuit) -> bool:
        """Return whether a branch goes as far."""
        if self.column == "bias_V":
            return Reach(circuit, self.value)(branch)
        if self.column == "power_mW":
            return bool(np.any(branch.values[:, 0] * branch.values[:, 1] >= self.value))
        return branch.values[-1, TIP_RISE] >= self.value - branch.base_temperature_K

    def u(self, branch: Branch, circuit: Circuit) -> float:
        """Return its place on a branch; NaN if that has none."""
        value = np.array([self.value])
        if self.column == "bias_V":
            return float(branch.read(circuit, value).u[0])
        if self.column == "power_mW":
            return float(branch.by_power.u(value)[0])
        return float(branch.u_at(value)[0])

    def __str__(self) -> str:
        unit = self.column.rpartition("_")[2]
        return f"{self.value:g} {unit}"


class SolvedDesign:
    """A probe solved up to its working point, or past its knee.

    Parameters
    ----------
    similar : SimilarLevers
        With a mesh that can follow the probe's dimensions.
    probe : Probe
    point : WorkingPoint
    names : sequence of str
        Parameters of the derivatives, see `hotlever.probe.probe_parameters`.

    Raises
    ------
    ComputationError
        If the lever has no such working point, or the mesh cannot follow.
    """

    def __init__(
        self, similar: SimilarLevers, probe: Probe, point: WorkingPoint, names: Sequence[str] = ()
    ) -> None:
        self.probe, self._similar, self._point, self._names = probe, similar, point, tuple(names)
        self._equations = similar.equations(probe, self._names)
        self.branch = continued(self._equations, self._is_long_enough)
        self.u = point.u(self.branch, probe.circuit)
        if not np.isfinite(self.u):
            raise ComputationError(
                f"the lever has no single state at {point}: its branch ends with the tip at "
                f"{self.branch.hottest_K:.0f} K"
            )

    def _is_long_enough(self, branch: Branch) -> bool:
        past_knee = np.any(np.diff(branch.values[:-1, 0]) < 0)
        return bool(past_knee) and self._point.is_reached(branch, self.probe.circuit)

    # --- values and derivatives -------------------------------------------------------------------

    def value(self, quantity: str) -> float:
        """Return a quantity; NaN of a knee, or a surface below, that does not exist."""
        if quantity == "time_constant_us":
            return self._time_constant
        if quantity in OF_THE_READER:
            return getattr(self._signal, quantity, float("nan"))
        return sum(sign * self._read(own, u)[0] for sign, own, u in self._terms(quantity))

    def gradient(self, quantity: str) -> Array:
        """Return its derivatives by the parameters, (p,)."""
        if quantity == "time_constant_us":
            return np.array([self._time_constant_by(name) for name in self._names])
        if quantity in OF_THE_READER:
            return np.array([self._reader_by(quantity, name) for name in self._names])
        terms = self._terms(quantity)
        return np.sum([sign * self._gradient_of(own, u) for sign, own, u in terms], axis=0)

    def _terms(self, quantity: str) -> list[tuple[float, str, float]]:
        """Return the quantities of states, with their signs and places, that one is made of."""
        at_knee = DISTANCES.get(quantity, quantity)
        if at_knee not in OF_THE_KNEE:
            return [(1.0, quantity, self.u)]
        own, knee_u = OF_THE_KNEE[at_knee], self.branch.knee_u
        terms = [(1.0, own, float("nan") if knee_u is None else knee_u)]
        return [*terms, (-1.0, own, self.u)] if quantity in DISTANCES else terms

    def _gradient_of(self, own: str, u: float) -> Array:
        """Return the derivatives of a quantity of the working point's or the knee's state."""
        _, by_shown, by_circuit = self._read(own, u)
        partial = self._partials(np.array([u]))[0][0]
        along_branch = self._along(u)[:, None] * self._place_by(u, partial)
        return np.asarray(by_shown @ (partial + along_branch) + by_circuit)

    def _read(self, own: str, u: float) -> tuple[float, Array, Array]:
        """Return a quantity, and its derivatives by V_l, I_h and T_tip, and by the circuit."""
        circuit = self.probe.circuit
        lever_V, current_mA = self.branch.curve(u)[:2].tolist()
        value, by_shown = {
            "tip_K": (float(self.branch.tip_K(u)), (0.0, 0.0, 1.0)),
            "lever_V": (lever_V, (1.0, 0.0, 0.0)),
            "current_mA": (current_mA, (0.0, 1.0, 0.0)),
            "power_mW": (lever_V * current_mA, (current_mA, lever_V, 0.0)),
            "bias_V": (circuit.bias(lever_V, current_mA), (1.0, circuit.series_kohm, 0.0)),
        }[own]
        by_circuit = [
            circuit.bias_by(name, current_mA) if own == "bias_V" else 0.0 for name in self._names
        ]
        return value, np.array(by_shown), np.array(by_circuit)

    def _along(self, u: float, derivative: int = 1) -> Array:
        """Return derivatives of V_l, I_h and T_tip along the branch, (3,)."""
        return np.asarray(self.branch.curve(u, derivative)[[0, 1, TIP_RISE]])

    def _partials(self, u: Array) -> tuple[Array, Array]:
        """Return derivatives of V_l, I_h and T_tip by the parameters at fixed rises, (n, 3, p).

        And those of V_l by u, (n,), of the states themselves, not of the curve through them.
        """
        parametrisation = self.branch.parametrisation
        constraint = parametrisation.constraint(u)
        roots = solve_at(
            self._equations,
            u,
            self.branch.states(u),
            NewtonOptions(),
            parametrisation=parametrisation,
        )
        derivatives = by_parameter(self._equations, roots.x, self._names, roots.factors, constraint)
        along = self._equations.along(roots.x, roots.factors, constraint)[-1]
        return derivatives[:, [0, 1, TIP_RISE]], along * parametrisation.rate(
            u, self._equations.space, roots.x
        )

    def _place_by(self, u: float, partial: Array) -> Array:
        """Return how the place u of the working point or of the knee moves, (p,)."""
        if u == self.branch.knee_u:
            # the knee is where V_l stops rising; states beside it tell how derivatives change
            partials, slopes = self._partials(u + 0.3 * np.array([-1.0, 1.0]))
            return np.asarray(-np.diff(partials[:, 0], axis=0)[0] / np.diff(slopes))
        _, by_shown, by_circuit = self._read(self._point.column, u)
        missing = by_shown @ partial + by_circuit
        return np.asarray(-missing / (by_shown @ self._along(u)))

    # --- in time ----------------------------------------------------------------------------------

    @cached_property
    def _time_constant(self) -> float:
        """The slowest time constant at the working point (µs), the source holding the bias."""
        return self._slowest(self.probe, self._rise_K)

    def _time_constant_by(self, name: str) -> float:
        """Return its derivative by a parameter: from levers beside this one, on its mesh moved."""
        value = float(self.probe.values([name])[0])
        step = 1e-3 * (abs(value) or 1.0)
        rise_by = self._gradient_of("tip_K", self.u)[self._names.index(name)]
        above, below = (
            self._slowest(self.probe.replace({name: value + way}), self._rise_K + way * rise_by)
            for way in (step, -step)
        )
        return (above - below) / (2.0 * step)

    @property
    def _rise_K(self) -> float:
        return float(self.branch.rise(np.array([self.u]))[0])

    def _slowest(self, probe: Probe, rise_K: float) -> float:
        lever = self._similar.lever(probe)
        u, guess = np.sqrt([rise_K]), self.branch.states(np.array([self.u]))
        root = solve_at(lever.equations, u, guess, NewtonOptions())
        return float(slowest_modes(State(lever, root.x), count=1)[0][0])

    # --- over a surface ---------------------------------------------------------------------------

    @cached_property
    def _signal(self) -> Signal | None:
        """What the reader shows at the working point; None without a surface below."""
        if not reads_distance(self.probe):
            return None
        lever, bias = self._similar.lever(self.probe), self.value("bias_V")
        return Reader(self.probe).signal(lever, self.branch, self.u, bias)

    def _reader_by(self, quantity: str, name: str) -> float:
        """Return a derivative of what the reader shows, from coarse levers beside this one."""
        value = float(self.probe.values([name])[0])
        # levers that are meshed anew differ by some per cent
        step = 0.05 * (abs(value) or 1.0)
        above, below = (
            SolvedDesign(SimilarLevers(Lever(probe, COARSE)), probe, self._point).value(quantity)
            for probe in (self.probe.with_(**{name: value + way}) for way in (step, -step))
        )
        return (above - below) / (2.0 * step)


def reads_distance(probe: Probe) -> bool:
    """Return whether a probe is in air over a surface."""
    around = probe.surroundings
    return around.medium == "air" and around.surface_gap_um is not None
