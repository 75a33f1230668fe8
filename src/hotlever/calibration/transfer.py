"""From the knee of a measured I-V curve to the tip temperature at every power.

The paper's transfer (its Section V): in another medium, or on another lever of the same kind, the
tip temperature is the same function of the power but for one factor, T(P) = T_ref(P / k), and the
knee of the I-V curve tells the factor. What T_ref is decides how good that is: a power law, the
model of a probe, or a model fitted to the lever itself.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hotlever.calibration.characteristic import Characteristic
from hotlever.calibration.power_law import PowerLaw

Array = NDArray[np.float64]


@dataclass(frozen=True)
class TemperatureCurve:
    """Tip temperature against power of a reference, and the power of its knee.

    Attributes
    ----------
    tip : callable
        Temperature (K) of powers (mW); NaN where nothing is known.
    knee_mW : float
        Power at which the reference has its knee.
    """

    tip: Callable[[Array], Array]
    knee_mW: float

    def at(self, power_mW: Array, knee_mW: float) -> Array:
        """Return the temperature (K) of a lever whose knee is at `knee_mW`."""
        return self.tip(np.asarray(power_mW, dtype=float) * (self.knee_mW / knee_mW))


def curve_of_law(law: PowerLaw, base_temperature_K: float) -> TemperatureCurve:
    """Return a power law as a reference; its threshold stands for the knee, as in the paper."""
    return TemperatureCurve(
        lambda power: law.tip_temperature(power, base_temperature_K), law.threshold_mW
    )


def curve_of_model(
    models: Mapping[str, Characteristic],
    medium: str,
    measured_knee: tuple[str, float] | None = None,
) -> TemperatureCurve:
    """Return the model of a lever in a medium as a reference.

    Parameters
    ----------
    models : mapping of str to Characteristic
        By medium.
    medium : str
        Of the lever to be calibrated.
    measured_knee : tuple of str and float, optional
        Medium and power (mW) of a knee that was measured on the lever which the model was fitted
        to. It takes the place of the model's, since models are less sure of the knee than of the
        temperature at a power.
    """
    model = models[medium]
    assert model.knee is not None
    knee = model.knee.power_mW
    if measured_knee is not None:
        where, power = measured_knee
        there = models[where].knee
        assert there is not None
        knee *= power / there.power_mW
    return TemperatureCurve(model.tip_temperature, knee)
