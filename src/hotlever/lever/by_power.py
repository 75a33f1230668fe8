"""The tip temperature of a lever by its power, as far as that is a function.

On most levers the power rises with the tip temperature to the end. Where the heat moves towards the
tip faster than the tip gets hotter, the power turns: the tip gets hotter with less of it, and a
power belongs to several temperatures.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from hotlever.lever.curve import crossing, smooth_curve
from hotlever.lever.solved_states import SolvedStates
from hotlever.piecewise import Piecewise
from hotlever.types import Array


class ByPower:
    """A branch of a lever that starts cold, read by its power.

    Parameters
    ----------
    states : SolvedStates
    curve : Piecewise
        V_l (V) and I_h (mA) by u, and what else they show.
    """

    def __init__(self, states: SolvedStates, curve: Piecewise) -> None:
        self._states, self._curve = states, curve

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
        falling = [u for u in self._states.turns(self._power).tolist() if self._power(u, 2) < 0]
        return falling[0] if falling else None

    @cached_property
    def highest_mW(self) -> float:
        """The highest power up to which every power has one temperature."""
        end = self._states.end_u
        if self.turn_u is None:
            return float(self._power(end))
        level = self._states.turns(self._power)
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
        states = self._states
        values, slopes = states.values, states.value_slopes
        power = values[:, 0] * values[:, 1]
        slope = slopes[:, 0] * values[:, 1] + values[:, 0] * slopes[:, 1]
        root = np.sqrt(power)
        # at zero power both begin as u
        by_u = np.append(np.sqrt(slopes[0, 0] * slopes[0, 1]), slope[1:] / (2.0 * root[1:]))
        bent = root[np.isin(states.u, states.steps)]
        return smooth_curve(root, states.u, 1.0 / by_u, bent)
