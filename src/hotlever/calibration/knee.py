"""The knee of a measured I-V curve: where dV_l/dI_h = 0, with its uncertainty.

The lever voltage V_l = V_b - R_s I_h has its highest value at the knee. V_l(I_h) turns back
there, but the curve is a single-valued function of the power P_l = V_l I_h, so the resistance is
smoothed against the power, and the knee is where the smooth V_l(P_l) is highest.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hotlever.calibration.smoothing import SmoothCurve
from hotlever.errors import InputError
from hotlever.lever import Branch, OperatingPoint
from hotlever.probe import Circuit
from hotlever.types import Array

Function = Callable[[Array], Array]

#: Points whose power is within this factor of the knee's are used.
_NEARBY = 2.0
#: Fewest points near the knee, and fewest on either side of it.
_FEWEST, _FEWEST_BESIDE = 6, 2
#: Points below this share of the highest bias may be lost in noise.
_LOST = 0.01
#: The knee has been passed once V_l has fallen by this share.
_FALLEN = 0.05
#: The knee is sought within this factor of the highest measured lever voltage's power.
_SEARCH = 1.35
#: Rows of a smooth table.
_ROWS = 101


@dataclass(frozen=True)
class IVCurve:
    """Measured points of a lever, rising in power."""

    bias_V: Array
    current_mA: Array
    circuit: Circuit

    @classmethod
    def of(cls, bias_V: ArrayLike, current_mA: ArrayLike, circuit: Circuit) -> IVCurve:
        """Sort the points by power, and leave out those without bias or lost in noise near zero.

        Raises
        ------
        InputError
            If a lever voltage is not positive, or fewer than six points are left.
        """
        bias, current = np.asarray(bias_V, dtype=float), np.asarray(current_mA, dtype=float)
        present = np.isfinite(bias) & np.isfinite(current) & (bias > 0)
        bias, current = bias[present], current[present]
        lever = circuit.lever_voltage(bias, current)
        wrong = (current <= 0) | (lever <= 0)
        lost = wrong & (bias < _LOST * bias.max(initial=0.0))
        bias, current, lever, wrong = (values[~lost] for values in (bias, current, lever, wrong))
        if wrong.any():
            place = int(np.argmax(wrong))
            raise InputError(
                f"at a bias of {bias[place]:g} V the current is {current[place]:g} mA and the "
                f"lever voltage {lever[place]:.4g} V with a series resistance of "
                f"{circuit.series_resistance_ohm:g} ohm, expected positive ones"
            )
        if bias.size < _FEWEST:
            raise InputError(
                f"{bias.size} points with bias and current, expected at least {_FEWEST}"
            )
        order = np.argsort(lever * current, kind="stable")
        return cls(bias[order], current[order], circuit)

    @property
    def lever_V(self) -> Array:
        """V_l = V_b - R_s I_h."""
        return np.asarray(self.circuit.lever_voltage(self.bias_V, self.current_mA))

    @property
    def power_mW(self) -> Array:
        """P_l = V_l I_h."""
        return self.lever_V * self.current_mA

    def only(self, here: NDArray[np.bool_]) -> IVCurve:
        """Return some of the points."""
        return IVCurve(self.bias_V[here], self.current_mA[here], self.circuit)


@dataclass(frozen=True)
class Knee:
    """The knee of a measured I-V curve.

    Attributes
    ----------
    lever_V, current_mA, power_mW, bias_V : float
    lever_V_stderr, current_mA_stderr, power_mW_stderr, bias_V_stderr : float
        From the scatter of the points.
    current_noise : float
        Standard deviation of the current over the current, as the points scatter.
    points : int
        How many were used.

    All but the power are NaN where it had to be estimated.
    """

    lever_V: float = np.nan
    current_mA: float = np.nan
    power_mW: float = np.nan
    bias_V: float = np.nan
    lever_V_stderr: float = np.nan
    current_mA_stderr: float = np.nan
    power_mW_stderr: float = np.nan
    bias_V_stderr: float = np.nan
    current_noise: float = np.nan
    points: float = np.nan

    @property
    def measured(self) -> bool:
        """Whether the points show it."""
        return bool(np.isfinite(self.lever_V))

    @property
    def without_errors(self) -> Knee:
        """The same knee, of which it is not known how far it may be off."""
        return Knee(self.lever_V, self.current_mA, self.power_mW, self.bias_V)


class KneeOutsideError(InputError):
    """The measured range does not include the knee; the text says which way to go."""


def find_knee(curve: IVCurve, like: Branch | None = None) -> Knee:
    """Find the knee in a measured I-V curve.

    Parameters
    ----------
    curve : IVCurve
        Noisy, unevenly spaced.
    like : Branch, optional
        Of a lever that resembles the measured one. Only its relation of temperature to power,
        scaled to the measured knee, is used: the resistance is a smoother function of the
        temperature than of the power. Halves the bias; also says where the knee is to be
        expected when it is outside the range.

    Raises
    ------
    KneeOutsideError
        If the points end before the knee, or begin after it.
    InputError
        If there are too few points near it.
    """
    if curve.circuit.series_resistance_ohm == 0.0:
        raise InputError(
            "without a series resistance the lever jumps at its knee, so a measured curve ends "
            "there and does not show it; measure with one of some kΩ"
        )
    peak = _highest(curve.lever_V)
    centre = float(curve.power_mW[peak])
    _check_sides(curve, peak, like)
    for _ in range(4):
        knee = _around(curve, centre, like)
        if abs(knee.power_mW - centre) < 1e-4 * knee.power_mW:
            break
        centre = knee.power_mW
    return knee


def _highest(lever_V: Array) -> int:
    """Place of the first maximum of V_l: hot legs can make it rise again."""
    highest = np.maximum.accumulate(lever_V)
    fallen = np.flatnonzero(lever_V < (1.0 - _FALLEN) * highest)
    return int(np.argmax(lever_V[: fallen[0]] if fallen.size else lever_V))


def _check_sides(curve: IVCurve, peak: int, like: Branch | None) -> None:
    """Refuse a curve whose highest lever voltage is at one of its ends."""
    if peak < _FEWEST_BESIDE:
        raise KneeOutsideError(
            f"the lever voltage falls from the first points on ({curve.lever_V[0]:.3f} V at a "
            f"bias of {curve.bias_V[0]:.3f} V): the knee is below the measured range; measure "
            "from a lower bias"
        )
    if peak >= curve.bias_V.size - _FEWEST_BESIDE:
        raise KneeOutsideError(
            f"the lever voltage still rises at the end of the measured range "
            f"({curve.lever_V[-1]:.3f} V at a bias of {curve.bias_V[-1]:.3f} V): the knee is "
            f"beyond it{_advice(curve, like)}"
        )


def _advice(curve: IVCurve, like: Branch | None) -> str:
    """Say what bias to go to, by a lever that resembles the measured one."""
    if like is None or like.knee is None:
        return "; measure to a higher bias"
    knee = scale_to(curve, like).applied(like.knee)
    bias = curve.circuit.bias(knee.lever_V, knee.current_mA)
    beyond = max(bias, float(curve.bias_V[-1])) * 1.1
    return (
        f", at about {bias:.1f} V by comparison with the model; measure to {beyond:.1f} V or more"
    )


def _around(curve: IVCurve, centre: float, like: Branch | None) -> Knee:
    """Smooth the points whose power is near `centre`, and find the knee."""
    warp, warp_slope = _warp(centre, like)
    power = curve.power_mW
    near = (np.abs(np.log(power / centre)) < np.log(_NEARBY)) & np.isfinite(warp(power))
    used = curve.only(near)
    power = used.power_mW
    if power.size < _FEWEST or min((power < centre).sum(), (power > centre).sum()) < _FEWEST_BESIDE:
        raise InputError(
            f"{power.size} points with {centre / _NEARBY:.2f} to {centre * _NEARBY:.2f} mW, near "
            f"the knee, expected at least {_FEWEST} with {_FEWEST_BESIDE} on either side; measure "
            "more finely there"
        )
    smooth = _smoothed(used, warp, warp_slope)
    low, high = max(centre / _SEARCH, power[0]), min(centre * _SEARCH, power[-1])
    grid = np.linspace(low, high, 3001)
    ln_V = 0.5 * np.log(grid) + smooth.value(warp(grid))
    place = int(np.argmax(ln_V))
    margin = 30
    if not margin <= place < grid.size - margin:
        raise KneeOutsideError(
            f"the lever voltage is highest at the end of the points near the knee "
            f"({grid[place]:.3f} mW): measure beyond it, and more finely"
        )
    around = slice(place - margin, place + margin + 1)
    curvature, tilt, _ = np.polyfit(grid[around] - grid[place], ln_V[around], 2)
    knee_power = float(grid[place] - tilt / (2.0 * curvature))
    at = np.array(knee_power)
    error_P = float(smooth.slope_stderr(float(warp(at))) * warp_slope(at) / (-2.0 * curvature))
    lever_V = float(np.exp(0.5 * np.log(knee_power) + smooth.value(warp(at))))
    error_V = lever_V * smooth.value_stderr(float(warp(at)))
    current = knee_power / lever_V
    error_I = current * np.hypot(error_P / knee_power, error_V / lever_V)
    # V_b = V + R_s P / V
    by_P = used.circuit.bias(0.0, 1.0 / lever_V)
    by_V = used.circuit.bias(1.0, -current / lever_V)
    error_b = np.hypot(by_P * error_P, by_V * error_V)
    return Knee(
        lever_V,
        current,
        knee_power,
        used.circuit.bias(lever_V, current),
        error_V,
        float(error_I),
        error_P,
        float(error_b),
        smooth.noise_factor,
        power.size,
    )


def _smoothed(curve: IVCurve, warp: Function, warp_slope: Function) -> SmoothCurve:
    """Smooth the logarithm of the root of the resistance, V_l = sqrt(P_l R_l), along `warp`."""
    power, lever = curve.power_mW, curve.lever_V
    along, ln_root_R = warp(power), np.log(lever) - 0.5 * np.log(power)
    # an error in the current moves a point along power and voltage; what counts is how far it
    # leaves the curve, whose slope is known better after each turn
    by_current_V = curve.circuit.lever_voltage(0.0, 1.0)
    by_current_P = lever + by_current_V * curve.current_mA
    smooth = SmoothCurve(along, ln_root_R, curve.current_mA / lever)
    for _ in range(2):
        slope = 0.5 / power + smooth.slope(along) * warp_slope(power)
        leaving = np.abs(by_current_V / lever - slope * by_current_P) * curve.current_mA
        smooth = SmoothCurve(along, ln_root_R, leaving, smooth)
    return smooth


def smooth_rows(curve: IVCurve, knee_mW: float, like: Branch | None = None) -> tuple[Array, Array]:
    """Return current (mA) at evenly spaced biases (V) over the measured range, smoothed.

    The power of the knee may be measured or estimated; for `like` see `find_knee`.
    """
    warp, warp_slope = _warp(knee_mW, like)
    used = curve.only(np.isfinite(warp(curve.power_mW)))
    smooth = _smoothed(used, warp, warp_slope)
    power = np.linspace(used.power_mW[0], used.power_mW[-1], 4000)
    lever = np.sqrt(power) * np.exp(smooth.value(warp(power)))
    current = power / lever
    bias = np.maximum.accumulate(used.circuit.bias(lever, current))
    asked = np.linspace(max(used.bias_V[0], bias[0]), min(used.bias_V.max(), bias[-1]), _ROWS)
    return asked, np.interp(asked, bias, current)


def _warp(centre: float, like: Branch | None) -> tuple[Function, Function]:
    """Return the coordinate in which the resistance is smooth, and its derivative, by the power.

    The temperature rise of a lever that resembles the measured one; without it, the power. It is
    zero without power, and one at the knee.
    """
    if like is None or like.knee is None:
        return lambda power: power / centre, lambda power: np.full_like(power, 1.0 / centre)
    base, knee_mW = like.base_temperature_K, like.knee.power_mW
    rise, scale = like.knee.tip_K - base, like.knee.power_mW / centre
    return (
        lambda power: (like.tip_temperature(power / centre * knee_mW) - base) / rise,
        lambda power: like.tip_slope(power * scale) * scale / rise,
    )


# --- the scale between a measured curve and a lever that resembles it -----------------------------


@dataclass(frozen=True)
class Scale:
    """How a measured I-V curve is stretched against that of another lever.

    The measured lever needs `power` times the power for the same temperature, and then has
    `resistance` times the resistance. `power_stderr` follows from the scatter of the points.
    """

    power: float
    resistance: float
    power_stderr: float

    def applied(self, point: OperatingPoint) -> OperatingPoint:
        """Return a point of the other lever, stretched."""
        lever_V = point.lever_V * float(np.sqrt(self.power * self.resistance))
        power = self.power * point.power_mW
        return OperatingPoint(lever_V, power / lever_V, power, point.tip_K)


def scale_to(curve: IVCurve, like: Branch) -> Scale:
    """Stretch the resistance against power of one lever to the points of another.

    Uses every point up to the knee, and needs no knee: the resistance rises with the temperature,
    so the power at which it has risen by as much tells the scale.

    Raises
    ------
    InputError
        If the points are so cold that the resistance does not tell.
    """
    power, resistance = curve.power_mW, curve.lever_V / curve.current_mA
    below = np.arange(power.size) <= _highest(curve.lever_V)
    power, resistance = power[below], resistance[below]
    top = like.knee.power_mW if like.knee is not None else like.highest_power_mW

    def misfit(ln_k: float) -> tuple[Array, float]:
        tip = like.tip_temperature(np.minimum(power * np.exp(-ln_k), top))
        expected = np.log(like.lever_voltage(tip) ** 2 / (power * np.exp(-ln_k)))
        difference = np.log(resistance) - expected
        return difference - difference.mean(), float(np.exp(difference.mean()))

    lowest = np.log(power[-1] / top)
    grid = np.linspace(lowest, lowest + np.log(20.0), 400)
    squares = [float(np.sum(misfit(value)[0] ** 2)) for value in grid]
    place = int(np.argmin(squares))
    if place == grid.size - 1:
        raise InputError(
            "the resistance hardly changes over the measured points: they are too cold to tell "
            "how much power the lever needs"
        )
    fine = np.linspace(grid[max(place - 1, 0)], grid[place + 1], 201)
    ln_k = float(fine[np.argmin([np.sum(misfit(value)[0] ** 2) for value in fine])])
    left, factor = misfit(ln_k)
    slope = (misfit(ln_k + 1e-4)[0] - left) / 1e-4
    variance = np.sum(left**2) / max(power.size - 2, 1)
    stderr = np.sqrt(variance / np.sum(slope**2))
    return Scale(float(np.exp(ln_k)), factor, float(np.exp(ln_k) * stderr))
