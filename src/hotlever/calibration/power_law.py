"""The temperature-power law of the paper (Eq. 12), as published or read; see `power_law_fit`."""

from __future__ import annotations

import os

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field
from scipy.optimize import elementwise

from hotlever.errors import InputError
from hotlever.files import read_json
from hotlever.records import Record
from hotlever.spieser2017 import BASE_TEMPERATURE_K, POWER_LAW

#: Largest coefficient of a law that is read: K/mW, K, an exponent or mW.
_LARGEST = 1e5


class PowerLaw(Record):
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
    In general the law is not continuous: see `jump_K`, and `meeting` for a law that is.
    """

    linear_K_per_mW: float
    nonlinear_K: float
    exponent: float
    hot_K_per_mW: float
    threshold_mW: float = Field(gt=0)

    def tip_temperature(
        self, power_mW: ArrayLike, base_temperature_K: float = BASE_TEMPERATURE_K
    ) -> NDArray:
        """Return the tip temperature (K) at a power (mW).

        Examples
        --------
        >>> EQ12.tip_temperature([2.95, 2.951]).round().tolist()
        [917.0, 922.0]
        """
        power = np.asarray(power_mW, dtype=float)
        rise = np.where(
            power <= self.threshold_mW, self._cold_rise(power), self.hot_K_per_mW * power
        )
        return base_temperature_K + rise

    def _cold_rise(self, power: NDArray) -> NDArray:
        # noise may take a power below zero
        heating = np.maximum(power, 0.0)
        return self.linear_K_per_mW * power + self.nonlinear_K * heating**self.exponent

    def power(self, tip_K: ArrayLike, base_temperature_K: float = BASE_TEMPERATURE_K) -> NDArray:
        """Return the lowest power (mW) that gives a tip temperature (K).

        Temperatures inside the jump belong to the threshold. Where the branches overlap (a
        jump downwards) the power on the cold branch is given.

        Raises
        ------
        InputError
            If a temperature is below the base temperature.

        Examples
        --------
        >>> EQ12.power([293.0, 600.0, 919.0, 1100.0]).round(3).tolist()
        [0.0, 2.02, 2.95, 3.789]
        """
        rise = np.asarray(tip_K, dtype=float) - base_temperature_K
        if np.any(rise < 0):
            raise InputError(
                f"a tip temperature of {np.min(tip_K):g} K, expected "
                f"{base_temperature_K:g} K (no power) or more"
            )
        top = float(self._cold_rise(np.asarray(self.threshold_mW)))
        wanted = np.minimum(rise, top)
        cold = elementwise.find_root(
            lambda power, wanted: self._cold_rise(power) - wanted,
            (np.zeros_like(rise), np.full_like(rise, self.threshold_mW)),
            args=(wanted,),
        ).x
        hot = np.maximum(rise / self.hot_K_per_mW, self.threshold_mW)
        return np.where(rise <= top, cold, hot)

    @property
    def jump_K(self) -> float:
        """Step of the law at the threshold (K)."""
        below = self.tip_temperature(self.threshold_mW, 0.0)
        return float(self.hot_K_per_mW * self.threshold_mW - below)

    def scaled(self, k: float) -> PowerLaw:
        """Return the law of a lever that needs k times the power for the same temperatures.

        The paper's transfer from vacuum to air: P is replaced by P / k.
        """
        return self.with_(
            linear_K_per_mW=self.linear_K_per_mW / k,
            nonlinear_K=self.nonlinear_K / k**self.exponent,
            hot_K_per_mW=self.hot_K_per_mW / k,
            threshold_mW=self.threshold_mW * k,
        )

    def meeting(self) -> PowerLaw:
        """Return the law with its threshold moved to where the branches meet: continuous.

        The same four coefficients; the temperature changes only between the two thresholds.

        Raises
        ------
        InputError
            If the branches do not meet at a positive power.

        Examples
        --------
        >>> round(EQ12.meeting().threshold_mW, 3)
        2.968
        """
        ratio = (self.hot_K_per_mW - self.linear_K_per_mW) / self.nonlinear_K
        if not ratio > 0 or self.exponent == 1.0:
            raise InputError("the branches of this power law do not meet at a positive power")
        return self.with_(threshold_mW=float(ratio ** (1.0 / (self.exponent - 1.0))))

    def values(self, base_temperature_K: float = BASE_TEMPERATURE_K) -> dict[str, float]:
        """Return the coefficients and ``threshold_K``, as calibration files have them."""
        threshold_K = float(self.tip_temperature(self.threshold_mW, base_temperature_K))
        return {**self.model_dump(), "threshold_K": threshold_K}


def read_power_law(path: str | os.PathLike[str]) -> PowerLaw:
    """Read a power law: a JSON file with its coefficients, or a calibration file.

    Raises
    ------
    InputError
        If the file cannot be read, or a coefficient is missing, misspelt or not positive.
    """
    content = read_json(path)
    section = content.get("power_law", content)
    if not content.get("describes_data", True):
        raise InputError(
            f"{path}: expected the calibration of a lever that shows its data; this one does not: "
            f"{content.get('reason') or 'its file does not say why'}"
        )
    if not isinstance(section, dict):
        raise InputError(f"{path}: found no power law, expected an object with its coefficients")
    coefficients = {name: value for name, value in section.items() if name != "threshold_K"}
    law = PowerLaw.from_values(coefficients, str(path))
    for name, value in law:
        if not 0 < value <= _LARGEST:
            expected = "a positive number" if not value > 0 else f"at most {_LARGEST:g}"
            raise InputError(f"{path}: {name} = {value:g}, expected {expected}")
    return law


#: As published, doi:10.1063/1.4981883.
EQ12 = PowerLaw(**POWER_LAW)
