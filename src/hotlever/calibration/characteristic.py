"""The characteristic of a lever: voltage, current and power by tip temperature.

What a lever shows at a given tip temperature does not depend on the series resistor, and each
tip temperature belongs to one state, folds or not. So states are sought at tip temperatures here,
not at biases.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline

from hotlever.errors import ComputationError, InputError, NewtonError
from hotlever.lever.continuation import AT_BIAS, AT_TIP
from hotlever.lever.equations import LeverEquations
from hotlever.lever.lever import Lever, LeverState, Ramp
from hotlever.lever.newton import NewtonOptions, newton
from hotlever.materials.law import FORMULA_TO
from hotlever.threads import one_blas_thread

Array = NDArray[np.float64]

#: Tip temperature (K) up to which characteristics are made: where the material laws end.
HOTTEST = 1300.0
#: Steps (K) between the states of a characteristic, and the largest from state to state.
_STEP, _LARGEST_STEP = 25.0, 60.0
#: How much hotter than the base (K) the first state is.
_FIRST_RISE = 10.0


@one_blas_thread
def states_at_tip(
    lever: Lever, tip_K: ArrayLike, progress: Callable[[int, int], None] | None = None
) -> Ramp:
    """Solve a lever at tip temperatures instead of biases.

    Parameters
    ----------
    lever : Lever
    tip_K : array_like, shape (n,)
        Tip temperatures (K) above the base temperature, in any order; solved rising.
    progress : callable, optional
        Called with the states done and their number.

    Returns
    -------
    Ramp
        States in the order of rising tip temperature; the bias is what the circuit then needs.

    Raises
    ------
    InputError
        If a temperature is not above the base temperature, or beyond the laws' formulas.
    ComputationError
        If a state was not found; ``partial`` holds those before it.

    Examples
    --------
    >>> from hotlever.probe import Probe
    >>> ramp = states_at_tip(Lever(Probe.reference()), [800.0])
    >>> round(ramp.states[0].bias, 2)
    7.93
    """
    equations = lever.equations
    base = equations.circuit.base_temperature_K
    wanted = np.unique(np.atleast_1d(np.asarray(tip_K, dtype=float)))
    if not np.all((wanted > base) & (wanted <= FORMULA_TO)):
        raise InputError(
            f"tip temperatures from {wanted.min():g} to {wanted.max():g} K, expected values above "
            f"the base temperature of {base:g} K and up to {FORMULA_TO:g} K"
        )
    ramp = Ramp([], [])
    x, tip, slope = _at_tip(equations, _barely_warm(lever), base + _FIRST_RISE)
    try:
        for done, target in enumerate(wanted.tolist(), start=1):
            while tip != target:
                # where it is cold, V follows the root of the rise: doubling it is far enough
                step = min(target, tip + _LARGEST_STEP, base + 2.5 * (tip - base))
                step = max(step, base + 0.4 * (tip - base))
                x, tip, slope = _at_tip(equations, x + (step - tip) * slope, step)
            ramp.states.append(LeverState(float(x[-1]), x))
            if progress is not None:
                progress(done, wanted.size)
    except NewtonError as error:
        raise ComputationError(
            f"no state was found with a hotter tip than {tip:.0f} K", partial=ramp
        ) from error
    return ramp


def _barely_warm(lever: Lever) -> Array:
    """Guess the state with the tip `_FIRST_RISE` above the base: fields follow V there."""
    equations = lever.equations
    base = equations.circuit.base_temperature_K
    x = newton(equations.pinned(AT_BIAS, 0.1), equations.start(), NewtonOptions()).x
    ratio = _FIRST_RISE / (equations.space.tip_temperature(x) - base)
    return np.where(equations.space.is_temperature(), base + ratio * (x - base), ratio**0.5 * x)


def _at_tip(equations: LeverEquations, guess: Array, tip_K: float) -> tuple[Array, float, Array]:
    """Solve at a tip temperature; return the state, that temperature and the slope by it."""
    result = newton(equations.pinned(AT_TIP, tip_K), guess, NewtonOptions())
    unit = np.zeros_like(result.x)
    unit[-1] = 1.0
    return result.x, tip_K, result.jacobian.solve(unit)


@dataclass(frozen=True)
class Characteristic:
    """What a lever shows at rising tip temperatures.

    Attributes
    ----------
    data : xarray.Dataset
        A dataset of `Lever.dataset`, rising in ``tip_K``. Its biases are those of the lever's
        circuit; everything else is independent of the circuit.
    base_temperature_K : float
    """

    data: xr.Dataset
    base_temperature_K: float

    @cached_property
    def _voltage(self) -> CubicSpline:
        """V_l² by tip temperature: a smooth curve, and a straight line where it is cold."""
        return CubicSpline(self._with_zero(self.data.tip_K), self._with_zero(self.data.lever_V**2))

    @cached_property
    def _power(self) -> CubicSpline:
        return CubicSpline(self._with_zero(self.data.tip_K), self._with_zero(self.data.power_mW))

    @cached_property
    def _tip(self) -> CubicSpline:
        return CubicSpline(self._with_zero(self.data.power_mW), self._with_zero(self.data.tip_K))

    def _with_zero(self, values: xr.DataArray) -> Array:
        start = self.base_temperature_K if values.name == "tip_K" else 0.0
        return np.concatenate([[start], values.values])

    @property
    def hottest_K(self) -> float:
        """Highest tip temperature."""
        return float(self.data.tip_K[-1])

    @property
    def highest_power_mW(self) -> float:
        """Power at the highest tip temperature."""
        return float(self.data.power_mW[-1])

    def tip_temperature(self, power_mW: ArrayLike) -> Array:
        """Return the tip temperature (K) by power (mW); NaN beyond the hottest state."""
        power = np.asarray(power_mW, dtype=float)
        return np.where(power <= self.highest_power_mW, self._tip(power), np.nan)

    def tip_slope(self, power_mW: ArrayLike) -> Array:
        """Return dT_tip/dP_l (K/mW) by power (mW)."""
        slope: Array = self._tip(np.asarray(power_mW, dtype=float), 1)
        return slope

    def power(self, tip_K: ArrayLike) -> Array:
        """Return the power (mW) by tip temperature (K); NaN outside the states."""
        return self._inside(tip_K, self._power)

    def lever_voltage(self, tip_K: ArrayLike) -> Array:
        """Return V_l (V) by tip temperature (K); NaN outside the states."""
        return self._inside(tip_K, lambda tip: np.sqrt(np.maximum(self._voltage(tip), 0.0)))

    def bias(self, tip_K: ArrayLike, series_resistance_ohm: float) -> Array:
        """Return the bias (V) that heats the tip to a temperature (K), for any R_s.

        The exact inverse of a model. Between the folds of a lever with a small or very large
        series resistance the state at this bias depends on where one comes from.

        Examples
        --------
        >>> from hotlever.probe import Probe
        >>> model = characteristic(Lever(Probe.reference()), 900.0)
        >>> model.bias([700.0, 800.0], 5600.0).round(2).tolist()
        [7.72, 7.93]
        """
        lever = self.lever_voltage(tip_K)
        return lever + series_resistance_ohm / 1000.0 * self.power(tip_K) / lever

    def _inside(self, tip_K: ArrayLike, function: Callable[[Array], Array]) -> Array:
        tip = np.asarray(tip_K, dtype=float)
        inside = (tip >= self.base_temperature_K) & (tip <= self.hottest_K)
        return np.where(inside, function(tip), np.nan)

    @cached_property
    def knee(self) -> OperatingPoint | None:
        """The knee dV_l/dI_h = 0: the highest lever voltage; None if V_l rises to the end."""
        slopes = self._voltage.derivative()
        roots = slopes.roots(extrapolate=False)
        falling = roots[slopes(roots, 1) < 0]
        if not falling.size:
            return None
        tip = float(falling[0])
        return OperatingPoint.of(float(self.lever_voltage(tip)), float(self.power(tip)), tip)


@dataclass(frozen=True)
class OperatingPoint:
    """A state of a lever as an instrument and a thermometer see it.

    Attributes
    ----------
    lever_V, current_mA, power_mW, tip_K : float
        V_l, I_h, P_l = V_l I_h and T_tip.
    """

    lever_V: float
    current_mA: float
    power_mW: float
    tip_K: float

    @classmethod
    def of(cls, lever_V: float, power_mW: float, tip_K: float) -> OperatingPoint:
        """Make a point of voltage and power."""
        return cls(lever_V, power_mW / lever_V, power_mW, tip_K)


def characteristic(
    lever: Lever,
    hottest_K: float = HOTTEST,
    progress: Callable[[int, int], None] | None = None,
    *,
    step_K: float = _STEP,
) -> Characteristic:
    """Solve a lever from cold to `hottest_K` in steps of the tip temperature.

    With steps of 25 K the curves between the states are within 0.01 K of sweeps of the reference
    lever, with 50 K within 0.2 K.

    Raises
    ------
    ComputationError
        If a state was not found.

    Examples
    --------
    >>> from hotlever.probe import Probe
    >>> knee = characteristic(Lever(Probe.reference())).knee
    >>> round(knee.tip_K), round(knee.power_mW, 2)
    (900, 2.87)
    """
    base = lever.probe.circuit.base_temperature_K
    count = max(int(np.ceil((hottest_K - base) / step_K)), 2)
    steps = np.linspace(base, hottest_K, count + 1)[1:]
    ramp = states_at_tip(lever, steps, progress)
    return Characteristic(lever.dataset(ramp), base)
