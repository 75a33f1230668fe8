"""From the place of the line to the temperature, with its error."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from hotlever.errors import InputError, unknown_name
from hotlever.raman.anharmonic import terms
from hotlever.raman.calibration import Calibration
from hotlever.raman.lineshape import Array
from hotlever.raman.peak import Peak
from hotlever.raman.published import ABSORBED_FRACTION, STRESS_SHIFT

Law = Literal["linear", "anharmonic"]


@dataclass(frozen=True)
class Reading:
    """Temperatures of one or more spectra.

    Attributes
    ----------
    shift, shift_stderr : (n,) arrays
        Against the line at room temperature, cm⁻¹; the error without the reference's.
    temperature, error : (n,) arrays
        K; NaN where silicon has no such line.
    outside : (n,) bool array
        Whether the temperature lies outside the calibrated range.
    """

    shift: Array
    shift_stderr: Array
    temperature: Array
    error: Array
    outside: np.ndarray


@dataclass(frozen=True)
class Thermometer:
    """A calibration in use.

    Attributes
    ----------
    calibration : Calibration
    law : {"anharmonic", "linear"}
    reference, reference_stderr : float, optional
        Line's place at room temperature (cm⁻¹) on the instrument as it is now; the
        calibration's own unless given.
    laser_heating : float
        Estimated heating by the laser (K), see `laser_heating`; part of the error.
    stress : float
        Mechanical stress that is not known (MPa); part of the error.

    Examples
    --------
    >>> from hotlever.raman.calibration import published
    >>> thermometer = Thermometer(published(), law="linear", reference=520.7)
    >>> reading = thermometer.read([520.7 - 10.0], [0.05])
    >>> reading.temperature.round(1).tolist()
    [709.0]
    """

    calibration: Calibration
    law: Law = "anharmonic"
    reference: float | None = None
    reference_stderr: float = 0.0
    laser_heating: float = 0.0
    stress: float = 0.0

    def __post_init__(self) -> None:
        if self.law not in get_args(Law):
            raise unknown_name("law", str(self.law), get_args(Law))
        if self.reference is None and self.calibration.reference_cm is None:
            raise InputError(
                "this calibration holds no room-temperature line; give a spectrum of the same "
                "instrument at room temperature as reference"
            )
        for name in ("laser_heating", "stress"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value >= 0.0):
                raise InputError(f"{name}: found {value:g}, expected a number from 0 up")

    def with_reference(self, peaks: Iterable[tuple[Peak, float | None]]) -> Thermometer:
        """Take the room-temperature line from spectra of the instrument as it is now.

        Parameters
        ----------
        peaks : iterable of (Peak, temperature)
            The temperature (K) is the room temperature of the calibration where None.
        """
        room = self.calibration.room_temperature_K
        places, weights = [], []
        for peak, temperature in peaks:
            drift = 0.0
            if temperature is not None:
                drift = float(self.calibration.anharmonic.shift(np.array(temperature), room)[0])
            places.append(peak.centre - drift)
            weights.append(peak.centre_stderr**-2)
        if not places:
            raise InputError("reference: no spectrum with a silicon line")
        return replace(
            self,
            reference=float(np.average(places, weights=weights)),
            reference_stderr=float(np.sum(weights) ** -0.5),
        )

    def read(self, centre: ArrayLike, stderr: ArrayLike) -> Reading:
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
            calibrated range.
        """
        calibration = self.calibration
        room = calibration.room_temperature_K
        own = self.reference is None
        reference = calibration.reference_cm if own else self.reference
        assert reference is not None
        shift = np.atleast_1d(np.asarray(centre, dtype=float)) - reference
        noise = np.atleast_1d(np.asarray(stderr, dtype=float))
        law = calibration.anharmonic
        true = law.temperature(shift, room)
        # where the law has no inverse there is no temperature; any will do to go on with
        at = np.where(np.isfinite(true), true, room)
        _, slope = law.shift(at, room)
        if self.law == "linear":
            temperature = calibration.linear.temperature(shift, room)
            variance = (calibration.linear.slope_K_cm**2) * (
                noise**2 + (calibration.reference_stderr_cm if own else self.reference_stderr) ** 2
            )
            band = calibration.linear.band(temperature - room)
            model = np.maximum(band, np.abs(temperature - at))
            temperature = np.where(np.isfinite(true), temperature, np.nan)
        else:
            temperature = true
            gradient = _gradient(at, room)
            covariance = np.array(law.covariance)
            if not own:
                covariance[0, :] = covariance[:, 0] = 0.0
                covariance[0, 0] = self.reference_stderr**2
            spread = np.einsum("ni,ij,nj->n", gradient, covariance, gradient)
            variance = (noise**2 + np.maximum(spread, 0.0)) / slope**2
            model = self._model_error(at, slope)
        variance = variance + model**2 + self.laser_heating**2
        variance = variance + (STRESS_SHIFT * self.stress / slope) ** 2
        error = np.where(np.isfinite(temperature), np.sqrt(variance), np.nan)
        low, high = calibration.range_K
        with np.errstate(invalid="ignore"):
            outside = (temperature < low - 2.0 * error) | (temperature > high)
        return Reading(shift, noise, temperature, error, outside)

    def _model_error(self, temperature: Array, slope: Array) -> Array:
        """How far the anharmonic law may be off, K: a second law through the same points.

        Constants that no series of this instrument has fixed have no such second law; the
        paper's error band stands in.
        """
        calibration = self.calibration
        u = temperature - calibration.room_temperature_K
        if not calibration.anharmonic.parabola:
            return calibration.linear.band(u)
        first, second = calibration.anharmonic.parabola
        predicted, _ = calibration.anharmonic.shift(temperature, calibration.room_temperature_K)
        return np.asarray(np.abs((first * u + second * u**2 - predicted) / slope))


def _gradient(temperature: Array, room: float) -> Array:
    """Derivatives of the line's place to reference, three- and four-phonon term, (n, 3)."""
    a, b, _, _ = terms(temperature)
    a_room, b_room, _, _ = terms(room)
    return np.stack([np.ones_like(a), a - a_room, b - b_room], axis=1)


def laser_heating(
    power_mW: float, resistance_K_per_mW: float, absorbed: float = ABSORBED_FRACTION
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
    for name, value in (("laser power", power_mW), ("thermal resistance", resistance_K_per_mW)):
        if not (np.isfinite(value) and value >= 0.0):
            raise InputError(f"{name}: found {value:g}, expected a number from 0 up")
    if not 0.0 <= absorbed <= 1.0:
        raise InputError(f"absorbed part: found {absorbed:g}, expected 0 to 1")
    return power_mW * absorbed * resistance_K_per_mW
