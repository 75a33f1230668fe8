"""From the knee of a measured I-V curve to the tip temperature at every power.

The paper's transfer (its Section V): in another medium, or on another lever of the same kind, the
tip temperature is the same function of the power but for one factor, T(P) = T_ref(P / k), and the
knee of the I-V curve tells the factor. What T_ref is decides how good that is: a power law, the
model of a probe, or a model fitted to the lever itself.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from hotlever.calibration.power_law import PowerLaw
from hotlever.errors import ComputationError
from hotlever.lever import Branch, OperatingPoint
from hotlever.types import Array


@dataclass(frozen=True)
class TemperatureCurve:
    """Tip temperature against power of a reference, and the power of its knee.

    Attributes
    ----------
    tip : callable
        Temperature (K) of powers (mW); NaN where nothing is known.
    knee_mW : float
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


def curve_of_model(model: Branch, knee_mW: float | None = None) -> TemperatureCurve:
    """Return the model of a lever, in the medium it is to be calibrated in, as reference.

    A knee that was measured (its power) on the lever which the model was fitted to takes the place
    of the model's, since models are less sure of the knee than of the temperature at a power.
    """
    return TemperatureCurve(model.tip_temperature, knee_mW or knee_of(model).power_mW)


def knee_of(model: Branch) -> OperatingPoint:
    """Return the knee of a model.

    Raises
    ------
    ComputationError
        If it has none.
    """
    if model.knee is None:
        raise ComputationError(
            f"the model has no knee below {model.hottest_K:.0f} K; calibrate a lever whose model "
            "has one"
        )
    return model.knee
