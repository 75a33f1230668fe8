"""The measuring circuit: a bias source, a series resistor, the lever."""

from __future__ import annotations

from typing import Any

from pydantic import Field

from hotlever.records import Record
from hotlever.spieser2017 import BASE_TEMPERATURE_K


class Circuit(Record):
    """The measuring circuit (section ``[circuit]`` of a probe file).

    The bias V_b drives the heater current I_h through the series resistor R_s and the lever,
    V_b = V_l + R_s I_h. What a lever shows at a tip temperature does not depend on the circuit;
    which tip temperature it takes at a bias does.

    Examples
    --------
    >>> Circuit().bias(lever_V=3.06, current_mA=0.93)
    8.268
    """

    series_resistance_ohm: float = Field(
        default=5600.0, ge=0, le=1e7, description="between the bias source and the lever, R_s"
    )
    base_temperature_K: float = Field(
        default=BASE_TEMPERATURE_K, ge=250, le=1000, description="of the leg ends"
    )

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
