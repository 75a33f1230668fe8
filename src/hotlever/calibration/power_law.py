"""The temperature-power law of the paper (Eq. 12)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray


@dataclass(frozen=True)
class PowerLaw:
    """Tip temperature against the power dissipated in the lever (Eq. 12).

    Below the threshold T = T_RT + a P + b P^m, above it T = T_RT + c P, with P in mW.

    Attributes
    ----------
    linear_K_per_mW, nonlinear_K, exponent : float
        a, b and m.
    hot_K_per_mW : float
        c.
    threshold_mW : float
        Power P_th of the transition.

    Notes
    -----
    The law is not continuous: see `jump_K`.
    """

    linear_K_per_mW: float
    nonlinear_K: float
    exponent: float
    hot_K_per_mW: float
    threshold_mW: float

    def tip_temperature(self, power_mW: ArrayLike, base_temperature_K: float = 293.0) -> NDArray:
        """Return the tip temperature (K) at a power (mW).

        Examples
        --------
        >>> EQ12.tip_temperature([2.95, 2.951]).round().tolist()
        [917.0, 922.0]
        """
        power = np.asarray(power_mW, dtype=float)
        cold = self.linear_K_per_mW * power + self.nonlinear_K * power**self.exponent
        rise = np.where(power <= self.threshold_mW, cold, self.hot_K_per_mW * power)
        return base_temperature_K + rise

    @property
    def jump_K(self) -> float:
        """Step of the law at the threshold (K)."""
        below = self.tip_temperature(self.threshold_mW, 0.0)
        return float(self.hot_K_per_mW * self.threshold_mW - below)


#: As published, doi:10.1063/1.4981883.
EQ12 = PowerLaw(
    linear_K_per_mW=103.0,
    nonlinear_K=11.2,
    exponent=3.1,
    hot_K_per_mW=213.0,
    threshold_mW=2.95,
)
