"""A PI controller that holds a lever at a resistance: the bias follows from the state.

The resistance R = V_l/I_h is seen through a filter of first order, and the bias is::

    T_f dR_m/dt = R − R_m,    V_b = P (R_set − R_m) + V_i,    dV_i/dt = I (R_set − R_m)

P is in V/kΩ, I in V/(kΩ ms), which is V/(Ω s). A controller takes over from a state at rest
without a jump: R_m and V_i begin as its resistance and its bias. The bias stays within limits.
While it is at one, V_i follows it (anti-windup by back-calculation; K. J. Åström and T. Hägglund,
Advanced PID Control (2006), Sec. 3.5).

Both are unknowns beside those of the lever and are stepped with them: the bias couples to all of
the Jacobian through the circuit's row alone, and the resistance is one row more.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from hotlever.errors import InputError
from hotlever.lever.equations import LeverEquations
from hotlever.lever.transient.problem import TransientProblem
from hotlever.lever.transient.runge_kutta import LinearSolver
from hotlever.lever.transient.waveform import Piece, Waveform, check_bias
from hotlever.probe import Circuit
from hotlever.types import Array

if TYPE_CHECKING:
    from hotlever.lever.lever import State

#: Unknowns of a controller: R_m (kΩ) and V_i (V); and the size of one unit of each, see
#: `hotlever.lever.transient.runge_kutta.Problem`.
_OWN, _SCALE = 2, np.array([[0.002], [0.01]])
#: Lowest bias as a share of the highest: without a current there is no resistance to measure.
_LOWEST = 0.01
#: What is simulated (µs) if nobody says.
_SETTLING = 1000.0
#: Time constants (µs) that a filter may have.
FASTEST_FILTER, SLOWEST_FILTER = 1e-3, 1e6


@dataclass(frozen=True)
class Controller(Waveform):
    """A bias that is set so that a lever comes to a resistance.

    Attributes
    ----------
    set_ohm : float
        The set point of V_l/I_h (Ω).
    proportional, integral : float
        P (V/kΩ) and I (V/(kΩ ms)): positive where the resistance rises with the tip temperature,
        negative where it falls.
    before_V : float
        Bias (V) of the state that it takes over from.
    limit_V : float
        Highest bias (V); the lowest is a hundredth of it.
    filter_us : float
        Time constant T_f (µs) of the measured resistance.

    Raises
    ------
    InputError
        If a value is out of bounds.
    """

    set_ohm: float
    proportional: float
    integral: float
    before_V: float
    limit_V: float
    filter_us: float = 1.0

    def __post_init__(self) -> None:
        check_bias(self.limit_V)
        if not self.set_ohm > 0.0:
            raise InputError(f"found a set point of {self.set_ohm:g} ohm, expected one above 0")
        if not (np.isfinite([self.proportional, self.integral]).all() and self.integral):
            raise InputError(
                f"found gains of {self.proportional:g} and {self.integral:g}, expected finite "
                "ones, and I other than 0: by P alone the set point is not met"
            )
        if not FASTEST_FILTER <= self.filter_us <= SLOWEST_FILTER:
            raise InputError(
                f"found a filter of {self.filter_us:g} µs, expected {FASTEST_FILTER:g} to "
                f"{SLOWEST_FILTER:g} µs"
            )
        if not _LOWEST * self.limit_V <= self.before_V <= self.limit_V:
            raise InputError(
                f"found a limit of {self.limit_V:g} V, expected at least the bias from which the "
                f"controller starts, {self.before_V:.4g} V, and less than {1 / _LOWEST:g} times it"
            )

    @property
    def text(self) -> str:  # type: ignore[override]
        """What it is, in words."""
        gains = f"{self.proportional:g} V/kΩ, {self.integral:g} V/(kΩ ms)"
        return f"controller ({gains}) to {self.set_ohm:g} Ω"

    @property
    def highest_V(self) -> float:
        """Largest bias (V)."""
        return self.limit_V

    @property
    def usual_end(self) -> float:  # type: ignore[override]
        """Time (µs) for which it is simulated if nobody says."""
        return _SETTLING

    def pieces(self, until: float) -> Iterator[Piece]:
        """Give the one piece, of the set point (kΩ) in place of a bias."""
        yield Piece(0.0, until, lambda t: self.set_ohm / 1000.0, jumps=True)

    def problem(self, equations: LeverEquations, circuit: Circuit, piece: Piece) -> Any:
        """See `Waveform`."""
        return ControlledProblem(equations, circuit, self)

    def history_columns(self, circuit: Circuit, columns: Mapping[str, Array], driven: Array) -> Any:
        """See `Waveform`: the bias, the resistance and its set point (Ω)."""
        lever_V, current = columns["lever_V"], columns["current_mA"]
        return {
            "bias_V": circuit.bias(lever_V, current),
            "set_ohm": 1000.0 * driven,
            "resistance_ohm": 1000.0 * lever_V / current,
        }

    # --- the law ----------------------------------------------------------------------------------

    @property
    def integral_per_us(self) -> float:
        """I in V/(kΩ µs)."""
        return self.integral / 1000.0

    @property
    def tracking_us(self) -> float:
        """Time constant (µs) with which V_i follows the bias at a limit."""
        return abs(self.proportional / self.integral_per_us) + self.filter_us

    def output(self, measured_kohm: float, integrated_V: float) -> tuple[float, float]:
        """Return the bias (V), and what it would be without limits."""
        unlimited_bias = self.proportional * (self.set_ohm / 1000.0 - measured_kohm) + integrated_V
        return min(max(unlimited_bias, _LOWEST * self.limit_V), self.limit_V), unlimited_bias


class ControlledProblem:
    """A lever with a controller, see `hotlever.lever.transient.runge_kutta.Problem`.

    The unknowns are those of `TransientProblem` and below them R_m (kΩ) and V_i (V).

    Parameters
    ----------
    equations : LeverEquations
    circuit : Circuit
    controller : Controller
    """

    def __init__(self, equations: LeverEquations, circuit: Circuit, controller: Controller) -> None:
        self._lever = TransientProblem(equations, circuit, lambda t: 0.0)
        self._equations, self._controller = equations, controller
        self._circuit_row = len(equations.scale) - 1
        self.scale = np.concatenate([self._lever.scale, _SCALE])

    def begin(self, state: State) -> Array:
        """Return the unknowns at a state at rest from which the controller takes over."""
        if state.current_mA == 0.0:
            raise InputError("a controller cannot start without a current, expected a bias")
        own = [[state.lever_V / state.current_mA], [state.bias_V]]
        return np.concatenate([self._lever.begin(state), own])

    def storage(self, x: Array) -> Array:
        """Return what is stored in lever and air, and what the controller holds."""
        return np.concatenate([self._lever.storage(x[:-_OWN]), x[-_OWN:]])

    def storage_change(self, x: Array, changes: Array) -> Array:
        """Return how `storage` changes with the unknowns (rows, 1, k), to first order."""
        stored_change = self._lever.storage_change(x[:-_OWN], changes[:-_OWN])
        return np.concatenate([stored_change, changes[-_OWN:]])

    def residual(self, t: float, x: Array) -> Array:
        """Return the residuals of the lever, the filter and the integral."""
        law, (measured, integrated) = self._controller, x[-_OWN:, 0].tolist()
        bias, unlimited_bias = law.output(measured, integrated)
        lever_V, current = self._equations.observed(self._lever.parts(x[:-_OWN])[0])[:2, 0]
        rest = self._lever.residual(t, x[:-_OWN])
        rest[self._circuit_row] -= bias
        lag = (measured - lever_V / current) / law.filter_us
        rise = law.integral_per_us * (law.set_ohm / 1000.0 - measured)
        rise += (bias - unlimited_bias) / law.tracking_us
        return np.concatenate([rest, [[lag], [-rise]]])

    def factorised(self, x: Array, rate: float) -> LinearSolver:
        """Return the factorised Jacobian of ``rate × storage + residual``."""
        law, own = self._controller, x[-_OWN:, 0].tolist()
        lever, _ = self._lever.parts(x[:-_OWN])
        lever_V, current = self._equations.observed(lever)[:2, 0]
        by_V, by_mA = (self._equations.observed_gradient(lever)[:, 0, k] for k in (0, 1))
        bias, unlimited_bias = law.output(*own)
        by_unlimited_bias = np.array([-law.proportional, 1.0])
        by_bias = by_unlimited_bias if bias == unlimited_bias else np.zeros(_OWN)
        resistance = np.zeros((1, len(x) - _OWN))
        resistance[0, : len(lever)] = (by_V - lever_V / current * by_mA) / current
        corner = rate * np.eye(_OWN)
        corner[0, 0] += 1.0 / law.filter_us
        corner[1] += [law.integral_per_us, 0.0]
        corner[1] -= (by_bias - by_unlimited_bias) / law.tracking_us
        drive = np.zeros((len(x) - _OWN, 1))
        drive[self._circuit_row] = 1.0
        factors = self._lever.factorised(x[:-_OWN], rate)
        return _Bordered(factors, drive, by_bias, -resistance / law.filter_us, corner)

    def norm(self, change: Array) -> float:
        """Return the largest change of the temperature (K), and of the controller in its units."""
        own = np.abs(change[-_OWN:] / _SCALE).max()
        return max(self._lever.norm(change[:-_OWN]), float(own))

    def monitored(self, x: Array) -> Array:
        """See `TransientProblem.monitored`."""
        return self._lever.monitored(x[:-_OWN])


class _Bordered:
    """A factorised Jacobian with the rows and columns of a controller, by its Schur complement.

    Parameters
    ----------
    factors : LinearSolver
        Of the lever.
    drive : ndarray, shape (rows, 1)
        One in the row of the circuit.
    by_bias : ndarray, shape (2,)
        Derivatives of the bias by the unknowns of the controller.
    measured : ndarray, shape (1, rows)
        Of the first row of the controller by those of the lever.
    corner : ndarray, shape (2, 2)
        The controller's own.
    """

    def __init__(
        self, factors: LinearSolver, drive: Array, by_bias: Array, measured: Array, corner: Array
    ) -> None:
        self._factors, self._measured = factors, measured
        # what the lever does with a bias of 1 V
        self._lever_response = factors.solve(drive) * by_bias
        corner = corner.copy()
        corner[:1] += measured @ self._lever_response
        self._schur = corner

    def solve(self, right_hand_side: Array) -> Array:
        """Solve for right-hand sides (rows, 1) or (rows, 1, k)."""
        flat = right_hand_side.reshape(len(right_hand_side), -1)
        above = self._factors.solve(flat[:-_OWN, None])[:, 0]
        below = flat[-_OWN:].copy()
        below[:1] -= self._measured @ above
        own = np.linalg.solve(self._schur, below)
        solution = np.concatenate([above + self._lever_response @ own, own])
        return np.asarray(solution.reshape(right_hand_side.shape))
