"""From the place of the line to the temperature, with its error."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from hotlever.errors import InputError, unknown_name
from hotlever.raman import anharmonic
from hotlever.raman.lineshape import Peak
from hotlever.raman.raman_calibration import RamanCalibration
from hotlever.spieser2017 import ABSORBED_SHARE, STRESS_SHIFT
from hotlever.types import Array

Law = Literal["linear", "anharmonic"]


@dataclass(frozen=True)
class LineTemperature:
    """Temperatures of n spectra."""

    shift: Array  #: (n,), against the line at room temperature, cm⁻¹
    temperature: Array  #: (n,), K; NaN where silicon has no such line
    error: Array  #: (n,), K
    noise: Array  #: (n,), K; the part of the error that is each one's own: photon noise
    outside: np.ndarray  #: (n,), whether the temperature lies outside the calibrated range


@dataclass(frozen=True)
class Thermometer:
    """A calibration in use.

    Examples
    --------
    >>> from hotlever.raman.raman_calibration import published_raman_calibration
    >>> thermometer = Thermometer(published_raman_calibration(), law="linear", reference=520.7)
    >>> reading = thermometer.read([520.7 - 10.0], [0.05])
    >>> reading.temperature.round(1).tolist()
    [709.0]
    """

    calibration: RamanCalibration
    law: Law = "anharmonic"
    #: The line's place at room temperature (cm⁻¹) on the instrument as it is now; the
    #: calibration's own unless given.
    reference: float | None = None
    reference_stderr: float = 0.0
    laser_heating: float = 0.0  #: estimated, K, see `laser_heating`; part of the error
    stress: float = 0.0  #: mechanical and not known, MPa; part of the error

    def __post_init__(self) -> None:
        if self.law not in get_args(Law):
            raise unknown_name("law", str(self.law), get_args(Law))
        if self.reference is None and self.calibration.reference_cm is None:
            raise InputError(
                "this calibration holds no room-temperature line; give a spectrum of the same "
                "instrument at room temperature as reference"
            )
        _check("laser heating", self.laser_heating, 1e3, "K")
        _check("stress", self.stress, 1e4, "MPa")

    @property
    def room_temperature_K(self) -> float:
        """At which the line is that shifts are taken from."""
        return self.calibration.room_temperature_K

    def with_reference(self, peaks: Iterable[tuple[Peak, float | None]]) -> Thermometer:
        """Take the room-temperature line from spectra of the instrument as it is now.

        Parameters
        ----------
        peaks : iterable of (Peak, temperature)
            The temperature (K) is the room temperature of the calibration where None.
        """
        room = self.calibration.room_temperature_K
        lines = [
            (peak.centre, peak.centre_stderr**-2, room if temperature is None else temperature)
            for peak, temperature in peaks
        ]
        if not lines:
            raise InputError("reference: no spectrum with a silicon line")
        centres, weights, temperatures = np.array(lines).T
        references = centres - self.calibration.anharmonic.shift(temperatures, room)[0]
        return replace(
            self,
            reference=float(np.average(references, weights=weights)),
            reference_stderr=float(np.sum(weights) ** -0.5),
        )

    def read(self, centre: ArrayLike, stderr: ArrayLike) -> LineTemperature:
        """Temperatures of lines.

        Parameters
        ----------
        centre, stderr : (n,) array_like
            cm⁻¹.

        Returns
        -------
        Reading
            The error adds in quadrature: photon noise, the calibration's covariance, laser
            heating, stress, and what the law itself may be wrong by: for the linear law the
            paper's ±(5 K + 0.02 ΔT) or, where larger, its distance from the anharmonic law;
            for the anharmonic law its distance from a parabola through the same points (the
            paper's band, where the constants are the published ones). Both grow outside the
            calibrated range. All but the photon noise is common to the lines.
        """
        calibration, room = self.calibration, self.calibration.room_temperature_K
        linear, law = calibration.linear, calibration.anharmonic
        covariance = np.array(law.covariance)
        reference, reference_stderr = calibration.reference_cm, calibration.reference_stderr_cm
        if self.reference is not None:
            reference, reference_stderr = self.reference, self.reference_stderr
            covariance[0, :] = covariance[:, 0] = 0.0
            covariance[0, 0] = reference_stderr**2
        shift = np.atleast_1d(np.asarray(centre, dtype=float)) - reference
        noise = np.atleast_1d(np.asarray(stderr, dtype=float))
        temperature = law.temperature(shift, room)
        # where the law has no inverse there is no temperature; any will do to go on with
        exists = np.isfinite(temperature)
        at = np.where(exists, temperature, room)
        _, slope = law.shift(at, room)
        if self.law == "linear":
            temperature = np.where(exists, linear.temperature(shift, room), np.nan)
            variance = linear.slope_K_cm**2 * (noise**2 + reference_stderr**2)
            model = np.maximum(linear.band(temperature - room), np.abs(temperature - at))
        else:
            gradient = anharmonic.gradient(at, room)
            spread = np.einsum("ni,ij,nj->n", gradient, covariance, gradient)
            variance = (noise**2 + np.maximum(spread, 0.0)) / slope**2
            model = self._model_error(at, slope)
        own = np.abs(noise * (linear.slope_K_cm if self.law == "linear" else 1.0 / slope))
        variance = variance + model**2 + self.laser_heating**2
        variance = variance + (STRESS_SHIFT * self.stress / slope) ** 2
        error = np.where(exists, np.sqrt(variance), np.nan)
        low, high = calibration.range_K
        outside = (temperature < low - 2.0 * error) | (temperature > high)
        return LineTemperature(shift, temperature, error, np.where(exists, own, np.nan), outside)

    def _model_error(self, temperature: Array, slope: Array) -> Array:
        """How far the anharmonic law may be off, K: a second law through the same points.

        Constants that no series of this instrument has fixed have no such second law; the
        paper's error band stands in.
        """
        law, room = self.calibration.anharmonic, self.calibration.room_temperature_K
        u = temperature - room
        if not law.parabola:
            return self.calibration.linear.band(u)
        first, second = law.parabola
        predicted, _ = law.shift(temperature, room)
        return np.asarray(np.abs((first * u + second * u**2 - predicted) / slope))


def laser_heating(
    power_mW: float, resistance_K_per_mW: float, absorbed: float = ABSORBED_SHARE
) -> float:
    """Estimate the heating by the laser, K.

    Parameters
    ----------
    power_mW : float
        Incident on the lever.
    resistance_K_per_mW : float
        Thermal resistance from the laser spot to the base; the slope of tip temperature
        against heater power is a good value.
    absorbed : float
        Part of the light that is absorbed; Spieser et al. 2017 give 10 %.

    Examples
    --------
    The paper's 100 µW on a lever that warms by 215 K/mW:

    >>> round(laser_heating(0.1, 215.0), 2)
    2.15
    """
    _check("laser power", power_mW, 1e3, "mW")
    _check("thermal resistance", resistance_K_per_mW, 1e5, "K/mW")
    _check("absorbed part", absorbed, 1.0, "of the light")
    return power_mW * absorbed * resistance_K_per_mW


def _check(name: str, value: float, highest: float, unit: str) -> None:
    """Refuse what is negative, no number, or beyond what can be."""
    if not 0.0 <= value <= highest:
        raise InputError(f"{name}: found {value:g}, expected 0 to {highest:g} {unit}")
