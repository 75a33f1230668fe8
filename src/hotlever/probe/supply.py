"""The swept supply: the series resistor behind it, and the Wheatstone bridge they may be part of.

Series resistor and lever are one arm of the bridge, a divider of two resistors from the same supply
to ground is the other. An amplifier with an input that draws no current shows the voltage between
both middles::

    V_bridge = gain (V_l − V_b lower / (upper + lower)) + offset

With a divider like the cold lever and its series resistor it is zero when cold, and what is left is
what heat does to the resistance: so a lock-in or an amplifier sees more of it.
"""

from __future__ import annotations

from typing import Any, Self

import numpy as np
from pydantic import Field, model_validator

from hotlever.records import Record
from hotlever.spieser2017 import BASE_TEMPERATURE_K
from hotlever.types import Array

#: Largest resistance of a circuit (Ω), smallest of a bridge, and the largest gain.
_MOST_OHM, _LEAST_OHM, _MOST_GAIN = 1e7, 1e-3, 1e6
#: Largest offset of an amplifier (V).
MOST_OFFSET_V = 10.0


def resistance(meaning: str, default: float) -> Any:
    """Return the field of a resistor (Ω) that may be none."""
    return Field(default=default, ge=0, le=_MOST_OHM, description=meaning)


def _of_bridge(meaning: str) -> Any:
    return Field(default=None, ge=_LEAST_OHM, le=_MOST_OHM, description=f"of a bridge, {meaning}")


class SweptSupply(Record):
    """What drives a lever: V_b = V_l + R_s I_h, and what a bridge shows of it."""

    series_resistance_ohm: float = resistance("between the bias source and the lever, R_s", 5600.0)
    base_temperature_K: float = Field(
        default=BASE_TEMPERATURE_K, ge=250, le=1000, description="of the leg ends"
    )
    bridge_upper_ohm: float | None = _of_bridge("from the bias source to what V_l is compared with")
    bridge_lower_ohm: float | None = _of_bridge("from there to ground")
    bridge_gain: float | None = Field(
        default=None,
        ge=-_MOST_GAIN,
        le=_MOST_GAIN,
        description="of the bridge's amplifier; 1 if left out",
    )
    bridge_offset_V: float = Field(
        default=0.0,
        ge=-MOST_OFFSET_V,
        le=MOST_OFFSET_V,
        description="that the bridge's amplifier shows of no voltage",
    )

    @model_validator(mode="after")
    def _bridge_is_whole(self) -> Self:
        arms = {name: getattr(self, name) for name in ("bridge_upper_ohm", "bridge_lower_ohm")}
        missing = [name for name, ohm in arms.items() if ohm is None]
        amplified = self.bridge_gain is not None or self.bridge_offset_V != 0.0
        if len(missing) == 1 or (missing and amplified):
            raise ValueError(f"a bridge needs {missing[0]}")
        if not missing and not self.series_resistance_ohm:
            raise ValueError(
                "series_resistance_ohm = 0: a bridge needs a resistor in series with the lever, "
                "for without one V_l is V_b"
            )
        if self.bridge_gain == 0.0:
            raise ValueError("bridge_gain = 0: expected the gain of an amplifier")
        return self

    @property
    def series_kohm(self) -> float:
        """R_s in kΩ, which makes volts of milliamperes."""
        return self.series_resistance_ohm / 1000.0

    def bias(self, lever_V: Any, current_mA: Any) -> Any:
        """Return the bias V_b (V) of a lever voltage (V) and a current (mA).

        It is linear, so changes of both give the change of the bias.
        """
        return lever_V + self.series_kohm * current_mA

    def bias_by(self, name: str, current_mA: Any) -> Any:
        """Return how the bias (V) changes with a value of the circuit, the lever being the same."""
        return current_mA / 1000.0 if name == "series_resistance_ohm" else 0.0 * current_mA

    def base_by(self, name: str) -> float:
        """Return how the base temperature changes with a value of the circuit."""
        return float(name == "base_temperature_K")

    def lever_voltage(self, bias_V: Any, current_mA: Any) -> Any:
        """Return the lever voltage V_l (V) of a bias (V) and a current (mA)."""
        return bias_V - self.series_kohm * current_mA

    def power(self, bias_V: Any, current_mA: Any) -> Any:
        """Return the power P_l = V_l I_h (mW) of a bias (V) and a current (mA)."""
        return self.lever_voltage(bias_V, current_mA) * current_mA

    # --- the bridge -------------------------------------------------------------------------------

    @property
    def has_bridge(self) -> bool:
        """Whether the lever is part of a Wheatstone bridge."""
        return self.bridge_upper_ohm is not None

    @property
    def _arms(self) -> tuple[float, float, float]:
        """Gain, and upper and lower resistor of the divider (Ω), NaN without a bridge."""
        upper, lower = self.bridge_upper_ohm, self.bridge_lower_ohm
        if upper is None or lower is None:
            return (float("nan"),) * 3
        return 1.0 if self.bridge_gain is None else self.bridge_gain, upper, lower

    def bridge_voltage(self, lever_V: Any, bias_V: Any) -> Any:
        """Return the voltage V_bridge (V) of a lever voltage and a bias (V); NaN without one."""
        return self.bridge_change(lever_V, bias_V) + self.bridge_offset_V

    def bridge_change(self, lever_V: Any, bias_V: Any) -> Any:
        """Return how V_bridge (V) changes where the lever voltage and the bias change (V)."""
        gain, upper, lower = self._arms
        return gain * (lever_V - lower / (upper + lower) * bias_V)

    def bridge_by(self, name: str, bias_V: Array) -> Array:
        """Return how V_bridge (V) changes with a value of the circuit, V_l and V_b being the same.

        The gain is no such value: its error is that of the scale of what is shown.
        """
        gain, upper, lower = self._arms
        if name == "bridge_offset_V":
            return np.full_like(bias_V, 1.0)
        by = {"bridge_upper_ohm": lower, "bridge_lower_ohm": -upper}.get(name, 0.0)
        return np.asarray(gain * by / (upper + lower) ** 2 * bias_V)

    def current_of_bridge(self, bridge_V: Array, bias_V: Array) -> Array:
        """Return the current I_h (mA) at which the bridge shows a voltage (V); NaN without one."""
        if not self.has_bridge:
            return np.full_like(bias_V, np.nan)
        gain, upper, lower = self._arms
        difference_V = (bridge_V - self.bridge_offset_V) / gain
        return np.asarray((upper / (upper + lower) * bias_V - difference_V) / self.series_kohm)
