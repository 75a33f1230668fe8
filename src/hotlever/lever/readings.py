"""Readings of a branch: by the power, and by a slow ramp of the bias.

On most levers the power rises with the tip temperature to the end. Where the heat moves towards the
tip faster than the tip gets hotter, the power turns: the tip gets hotter with less of it, and a
power belongs to several temperatures.

A slow ramp of the bias takes the first state whose bias V_l + R_s I_h has been reached.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from hotlever.piecewise import Piecewise, crossing, smooth_curve
from hotlever.types import Array

if TYPE_CHECKING:
    from hotlever.lever.branch import Branch

#: A bias (V) that is none.
_NO_BIAS = 1e-9


class ByPower:
    """A branch of a lever that starts cold, read by its power.

    Parameters
    ----------
    branch : Branch
    curve : Piecewise
        V_l (V) and I_h (mA) by u, and what else it shows.
    """

    def __init__(self, branch: Branch, curve: Piecewise) -> None:
        self._branch, self._curve = branch, curve

    @cached_property
    def _power(self) -> Piecewise:
        """P_l (mW) by u."""
        lever_V, current = (
            Piecewise(self._curve.c[..., column], self._curve.x) for column in (0, 1)
        )
        return lever_V * current

    @cached_property
    def turn_u(self) -> float | None:
        """Where the power is highest before it falls; None if it rises to the end."""
        falling = [u for u in self._branch.turns(self._power).tolist() if self._power(u, 2) < 0]
        return falling[0] if falling else None

    @cached_property
    def highest_mW(self) -> float:
        """The highest power up to which every power has one temperature."""
        end = self._branch.end_u
        if self.turn_u is None:
            return float(self._power(end))
        level = self._branch.turns(self._power)
        beyond = np.append(level[level > self.turn_u], end)
        return float(self._power(beyond).min())

    def u(self, power_mW: Array) -> Array:
        """Return where some powers (mW) are; NaN where there is none, or several."""
        if self.turn_u is None:
            u = self._by_root(np.sqrt(np.maximum(power_mW, 0.0)))
        else:
            flat = crossing(self._power, 0.0, self.turn_u, power_mW.ravel())
            u = flat.reshape(power_mW.shape)
        inside = (power_mW >= 0) & (power_mW <= self.highest_mW)
        return np.where(inside, u, np.nan)

    def slope(self, power_mW: Array) -> Array:
        """Return dT_tip/dP_l (K/mW) at some powers (mW), which are not zero."""
        if self.turn_u is not None:
            u = self.u(power_mW)
            return np.asarray(2.0 * u / self._power(u, 1))
        root = np.sqrt(power_mW)
        return np.asarray(self._by_root(root) * self._by_root(root, 1) / root)

    @cached_property
    def _by_root(self) -> Piecewise:
        """u by the root of the power, which is nearly a straight line."""
        branch = self._branch
        values, slopes = branch.values, branch.value_slopes
        power = values[:, 0] * values[:, 1]
        slope = slopes[:, 0] * values[:, 1] + values[:, 0] * slopes[:, 1]
        root = np.sqrt(power)
        # at zero power both begin as u
        by_u = np.append(np.sqrt(slopes[0, 0] * slopes[0, 1]), slope[1:] / (2.0 * root[1:]))
        bent = root[np.isin(branch.u, branch.steps)]
        return smooth_curve(root, branch.u, 1.0 / by_u, bent)


@dataclass(frozen=True)
class Reading:
    """Where a slow ramp of the bias finds a lever.

    Attributes
    ----------
    u : ndarray, shape (n,)
        Where on the branch each bias asked for is; NaN beyond the last that has a state.
    jumps : list of tuple of float
        Bias (V) and tip temperature (K) at each fold that the ramp passes.
    last_V, last_u, last_K : float
        The highest bias that has a state on the branch, where that is, and the tip temperature.
    jumps_back : tuple of tuple of float
        As `jumps`, of a ramp that goes back to zero.
    """

    u: Array
    jumps: list[tuple[float, float]]
    last_V: float
    last_u: float
    last_K: float
    jumps_back: tuple[tuple[float, float], ...] = ()

    @property
    def mirrored(self) -> Reading:
        """The same of the other polarity."""
        jumps = [(-fold, tip) for fold, tip in self.jumps]
        return Reading(-self.u, jumps, -self.last_V, -self.last_u, self.last_K)

    def and_back(self, back: Reading) -> Reading:
        """Return what a ramp finds that goes back to zero from the last place of this one."""
        u = np.concatenate([self.u, back.u])
        return replace(self, u=u, jumps_back=tuple(back.jumps))

    def notes(self, bias: Array) -> list[str]:
        """Say where a ramp through some biases (V) leaves the branch for another part of it."""
        return [
            f"{back}at a bias of {fold:.4f} V the lever jumps from a tip at {tip:.0f} K to a "
            f"{other} branch"
            for back, other, jumps in (
                ("", "hotter", self.jumps),
                ("on the way back, ", "colder", self.jumps_back),
            )
            for fold, tip in jumps
            if bias.min(initial=0.0) < fold < bias.max(initial=0.0)
        ]


def there_and_back(bias: Array) -> Array:
    """Return rising biases, and behind them the same falling.

    Examples
    --------
    >>> there_and_back(np.array([0.0, 1.0, 2.0])).tolist()
    [0.0, 1.0, 2.0, 1.0, 0.0]
    """
    return np.concatenate([bias, bias[-2::-1]])


def slow_ramp(
    curve: Piecewise,
    turns: Array,
    end: float,
    bias: Array,
    tip_K: Callable[[float], Array],
    start: float | None = None,
) -> Reading:
    """Find the states that a slow ramp takes from a start upwards.

    Parameters
    ----------
    curve : Piecewise
        The bias (V) by u.
    turns : ndarray
        Each u at which the curve is level, rising.
    end : float
        Where the branch ends.
    bias : ndarray, shape (n,)
        What is looked for, in any order.
    tip_K : callable
        The tip temperature by u.
    start : float, optional
        Where the ramp begins; where there is no bias if left out.
    """
    u = np.full(bias.shape, np.nan)
    if start is None:
        start = 0.0
        if abs(float(curve(start))) >= _NO_BIAS:
            # a similar lever has no bias elsewhere, near where its branch was followed from
            roots = curve.roots()
            start = float(roots[np.argmin(np.abs(roots))]) if roots.size else float(curve.x[0])
    # what is at no bias is found to rounding errors
    reading = Reading(u, [], min(0.0, float(curve(start))), start, float(tip_K(start)))
    for low, high in pairwise([start, *turns[turns > start].tolist(), end]):
        highest = float(curve(high))
        if highest <= reading.last_V:
            continue  # the bias falls here, or has been as high before
        fell = float(curve(low)) < reading.last_V
        jumps = [*reading.jumps, (reading.last_V, reading.last_K)] if fell else reading.jumps
        here = np.flatnonzero(np.isnan(u) & (bias <= highest))
        u[here] = crossing(curve, low, high, bias[here])
        reading = Reading(u, jumps, highest, high, float(tip_K(high)))
    return reading
