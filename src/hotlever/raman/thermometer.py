"""The thermometer: its calibration, and from the place of the line to the temperature.

Two laws are fitted to the same hot-plate series of one instrument. The linear law of Spieser et al.
2017 is the paper's; the anharmonic law (`hotlever.raman.anharmonic`) is for use above the hot
plate's range. Both refer to the line's place at room temperature on the same instrument, so an
offset of its axis cancels.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field, ValidationError, model_validator
from scipy.special import chdtri

from hotlever import __version__
from hotlever import spieser2017 as paper
from hotlever.errors import InputError, unknown_name
from hotlever.files import read_json, write_text
from hotlever.materials.silicon import MELTING_POINT
from hotlever.raman import anharmonic
from hotlever.raman.lineshape import LineShape, Peak, PeakOptions
from hotlever.records import Record, explained
from hotlever.types import Array

Law = Literal["linear", "anharmonic"]
# no number of a calibration is larger, and none may overflow when it is squared
Number = Annotated[float, Field(ge=-1e12, le=1e12)]
Size = Annotated[float, Field(ge=0, le=1e12)]


class Point(Record):
    """One spectrum of the series."""

    file: str
    temperature_K: Number
    centre_cm: Number
    centre_stderr_cm: Number


class LinearFit(Record):
    """T − T_RT = constant + slope·shift, the paper's law and error model."""

    constant_K: Number
    slope_K_cm: Number = Field(lt=0)
    slope_stderr_K_cm: Size = 0.0
    error_constant_K: Size = paper.RAMAN_ERROR_K
    error_fraction: Size = paper.RAMAN_ERROR_SHARE
    residual_rms_K: Size = 0.0

    def temperature(self, shift: Array, room_temperature: float) -> Array:
        """Temperature (K) of a shift (cm⁻¹)."""
        return np.asarray(room_temperature + self.constant_K + self.slope_K_cm * shift)

    def band(self, above_room: Array) -> Array:
        """The paper's calibration error (K) at T − T_RT (K)."""
        return np.asarray(self.error_constant_K + self.error_fraction * np.maximum(above_room, 0.0))


class AnharmonicFit(Record):
    """Balkanski's law, with a parabola through the same points to judge it by.

    ``covariance`` is that of (reference, three_phonon, four_phonon), cm⁻².
    """

    three_phonon_cm: float = Field(ge=-100, le=100)
    four_phonon_cm: float = Field(ge=-100, le=100)
    covariance: list[list[Number]]
    parabola: list[Number] = Field(default=[])
    ratio_fixed: bool = False
    residual_rms_K: Size = 0.0
    reduced_chi_square: Size = 0.0

    @model_validator(mode="after")
    def _square(self) -> AnharmonicFit:
        if [len(row) for row in self.covariance] != [3, 3, 3]:
            raise ValueError("covariance: expected a matrix of 3 × 3")
        if len(self.parabola) not in (0, 2):
            raise ValueError("parabola: expected two coefficients or none")
        return self

    def shift(self, temperature: Array, room_temperature: float) -> tuple[Array, Array]:
        """Shift (cm⁻¹) and its slope (cm⁻¹/K) at temperatures (K)."""
        return anharmonic.shift(
            temperature, room_temperature, self.three_phonon_cm, self.four_phonon_cm
        )

    def temperature(self, shift: Array, room_temperature: float) -> Array:
        """Temperature (K) of a shift (cm⁻¹); NaN where silicon has none such below melting."""
        temperatures = np.arange(20.0, MELTING_POINT + 0.5, 0.5)[::-1]
        falling, _ = self.shift(temperatures, room_temperature)
        return np.asarray(np.interp(shift, falling, temperatures, np.nan, np.nan))


class RamanCalibration(Record):
    """What `Thermometer` needs to know of an instrument, both laws, and where they come from."""

    format: Literal["hotlever-raman-calibration-1"] = "hotlever-raman-calibration-1"
    version: str = __version__
    source: str
    room_temperature_K: float = Field(ge=200, le=400)
    reference_cm: Number | None = None
    reference_stderr_cm: Size = 0.0
    range_K: tuple[Number, Number]
    line_shape: LineShape = "lorentzian"
    resolution_cm: Number | None = None
    #: What the series says for a band beside the line, see `PeakOptions`.
    band_evidence: Number | None = None
    linear: LinearFit
    anharmonic: AnharmonicFit
    points: list[Point] = Field(default=[])

    @model_validator(mode="after")
    def _falling(self) -> RamanCalibration:
        temperatures = np.arange(100.5, MELTING_POINT + 0.5, 0.5)
        _, slope = self.anharmonic.shift(temperatures, self.room_temperature_K)
        # cm⁻¹/K; silicon's line has −0.02
        if not np.all(slope < -1e-6):
            raise ValueError(
                "anharmonic: the line must fall with temperature up to the melting point, "
                f"found three-phonon {self.anharmonic.three_phonon_cm:g} and four-phonon "
                f"{self.anharmonic.four_phonon_cm:g} cm⁻¹"
            )
        return self

    @property
    def options(self) -> PeakOptions:
        """How the lines of its spectra were fitted, and those of others must be."""
        return PeakOptions(self.line_shape, self.resolution_cm, band_evidence=self.band_evidence)

    @property
    def scatter_cm(self) -> float:
        """Standard deviation (cm⁻¹) of lines of the series about the law, beyond their noise.

        It may be the axis that does not come back, or the hot plate, and nobody can tell which. It
        is 0 where noise scatters as much in one series of a hundred.
        """
        residuals = self.residuals()
        away, noise = residuals["anharmonic_cm"], residuals["noise_cm"]
        freedom = noise.size - (2 if self.anharmonic.ratio_fixed else 3)
        if self.reference_cm is None or freedom < 1 or not (noise > 0.0).all():
            return 0.0
        if np.sum((away / noise) ** 2) < chdtri(freedom, 0.01):
            return 0.0
        return float(np.sqrt(max(np.sum(away**2) / freedom - np.mean(noise**2), 0.0)))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the calibration as JSON, whole or not at all."""
        write_text(path, self.model_dump_json(indent=2) + "\n")

    def residuals(self) -> dict[str, Array]:
        """Of the series, by temperature: what each law reads less the hot plate, the paper's band.

        Keys are ``temperature_K``, ``shift_cm``, ``noise_cm``, ``linear_K``, ``anharmonic_cm``,
        ``anharmonic_K`` and ``band_K``.
        """
        points = sorted(self.points, key=lambda point: point.temperature_K)
        temperature = np.array([point.temperature_K for point in points])
        shift = np.array([point.centre_cm for point in points]) - (self.reference_cm or 0.0)
        room = self.room_temperature_K
        linear = self.linear.temperature(shift, room)
        predicted, slope = self.anharmonic.shift(temperature, room)
        return {
            "temperature_K": temperature,
            "shift_cm": shift,
            "noise_cm": np.array([point.centre_stderr_cm for point in points]),
            "anharmonic_cm": shift - predicted,
            "linear_K": linear - temperature,
            # near the fit the law is its tangent; this also holds where it has no inverse
            "anharmonic_K": (shift - predicted) / slope,
            "band_K": self.linear.band(linear - room),
        }


def published_raman_calibration() -> RamanCalibration:
    """The published laws: the linear one of Spieser et al. 2017 and Balkanski's of 1983.

    They hold no reference: give the line's place at room temperature on your instrument.

    Examples
    --------
    >>> law = published_raman_calibration().linear
    >>> law.constant_K, law.slope_K_cm
    (5.0, -41.1)
    """
    return RamanCalibration(
        source=f"Spieser et al. (2017), section III, doi:{paper.DOI}; {anharmonic.SOURCE}",
        room_temperature_K=paper.BASE_TEMPERATURE_K,
        range_K=(paper.BASE_TEMPERATURE_K, paper.RAMAN_CALIBRATED_TO_K),
        linear=LinearFit(constant_K=paper.RAMAN_CONSTANT_K, slope_K_cm=paper.RAMAN_SLOPE_K_CM),
        anharmonic=AnharmonicFit(
            three_phonon_cm=anharmonic.THREE_PHONON,
            four_phonon_cm=anharmonic.FOUR_PHONON,
            covariance=[[0.0] * 3] * 3,
        ),
    )


def calibrate_raman(
    points: Sequence[Point],
    line_shape: LineShape = "lorentzian",
    resolution_cm: float | None = None,
    source: str = "hot-plate series",
    band_evidence: float | None = None,
) -> RamanCalibration:
    """Fit both laws to a hot-plate series.

    Parameters
    ----------
    points : sequence of Point
        At least three temperatures; the coldest one is the room temperature.
    line_shape, resolution_cm, band_evidence
        How the peaks were fitted, see `PeakOptions`; spectra measured with this calibration are
        fitted so too.
    source : str
        Named in the calibration file.

    Returns
    -------
    RamanCalibration
        ``reference_cm`` is the line's place at room temperature by the anharmonic law through
        all points: less noisy than the one spectrum taken there.

    Raises
    ------
    InputError
        If there are too few temperatures, none at room temperature, or the line does not fall
        with temperature.

    Examples
    --------
    >>> temperatures = np.arange(300.0, 901.0, 50.0)
    >>> shifts, _ = anharmonic.shift(temperatures, 300.0)
    >>> series = [Point(file="", temperature_K=t, centre_cm=521.0 + d, centre_stderr_cm=0.03)
    ...           for t, d in zip(temperatures, shifts)]
    >>> fit = calibrate_raman(series)
    >>> round(fit.reference_cm, 6), round(fit.anharmonic.three_phonon_cm, 6)
    (521.0, -2.96)
    """
    temperature = np.array([point.temperature_K for point in points])
    centre = np.array([point.centre_cm for point in points])
    stderr = np.array([point.centre_stderr_cm for point in points])
    distinct = np.unique(np.round(temperature, 1))
    if distinct.size < 3:
        raise InputError(
            f"calibration: {distinct.size} different temperatures, expected at least 3 "
            "(a hot-plate series from room temperature up)"
        )
    room = float(temperature.min())
    if not 273.0 <= room <= 323.0:
        raise InputError(
            f"calibration: the coldest spectrum is at {room:g} K, expected one at room "
            f"temperature (273 to 323 K), from which the shifts are taken"
        )
    if np.any(stderr <= 0.0):
        raise InputError("calibration: every line position needs a standard error above 0")
    reference, law = _fit_anharmonic(temperature, centre, stderr, room)
    shift, above_room = centre - reference, temperature - room
    columns, unit_weights = np.vander(shift, 2), np.ones_like(shift)
    (slope, constant), covariance, variance = _least_squares(columns, above_room, unit_weights)
    if not slope < 0.0:
        raise InputError(
            f"calibration: the line moves by {1 / slope if slope else 0.0:+.4f} cm⁻¹/K with "
            "temperature, expected about -0.024; are the temperatures those of the spectra?"
        )
    linear = {
        "constant_K": constant,
        "slope_K_cm": slope,
        "slope_stderr_K_cm": float(np.sqrt(variance * covariance[0, 0])),
        "residual_rms_K": _rms(above_room - columns @ [slope, constant]),
    }
    content = {
        "source": source,
        "room_temperature_K": room,
        "reference_cm": reference,
        "reference_stderr_cm": float(np.sqrt(law["covariance"][0][0])),
        "range_K": (room, float(temperature.max())),
        "line_shape": line_shape,
        "resolution_cm": resolution_cm,
        "band_evidence": band_evidence,
        "linear": linear,
        "anharmonic": law,
        "points": list(points),
    }
    return RamanCalibration.from_values(content, "calibration")


def _fit_anharmonic(
    temperature: Array, centre: Array, stderr: Array, room: float
) -> tuple[float, dict[str, Any]]:
    """Line's place at room temperature and the law, by weighted linear least squares."""
    columns = anharmonic.gradient(temperature, room)
    distinct = np.unique(np.round(temperature, 1)).size
    # fewer temperatures, or a smaller span, cannot tell the three- from the four-phonon term; their
    # ratio is then the published one
    free = distinct >= 6 and np.ptp(temperature) >= 250.0
    ratio = anharmonic.FOUR_PHONON / anharmonic.THREE_PHONON
    basis = np.eye(3) if free else np.array([[1.0, 0.0], [0.0, 1.0], [0.0, ratio]])
    reduced, covariance, chi_square = _least_squares(columns @ basis, centre, stderr)
    # the residuals may scale errors up, never down
    covariance = basis @ (covariance * max(chi_square, 1.0)) @ basis.T
    reference, three, four = basis @ reduced
    parabola: list[float] = []
    if free:
        # as a shift against the same reference: what the two fits disagree about at room
        # temperature is part of the disagreement
        powers = np.vander(temperature - room, 3, increasing=True)
        parabola = _least_squares(powers, centre, stderr)[0][1:].tolist()
    _, slope = anharmonic.shift(temperature, room, three, four)
    return float(reference), {
        "three_phonon_cm": three,
        "four_phonon_cm": four,
        "covariance": covariance.tolist(),
        "parabola": parabola,
        "ratio_fixed": not free,
        "residual_rms_K": _rms((centre - columns @ [reference, three, four]) / slope),
        "reduced_chi_square": chi_square,
    }


def _least_squares(columns: Array, values: Array, stderr: Array) -> tuple[Array, Array, float]:
    """Parameters, their covariance for these errors, and the reduced chi-square."""
    weighted = columns / stderr[:, None]
    parameters = np.linalg.lstsq(weighted, values / stderr)[0]
    residual = (values - columns @ parameters) / stderr
    chi_square = float(residual @ residual) / max(values.size - columns.shape[1], 1)
    covariance = np.asarray(np.linalg.pinv(weighted.T @ weighted, hermitian=True))
    return np.asarray(parameters), covariance, chi_square


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def read_raman_calibration(path: str | os.PathLike[str]) -> RamanCalibration:
    """Read a calibration that `RamanCalibration.save` wrote.

    Raises
    ------
    InputError
        Naming the key at fault and what was expected.
    """
    try:
        return RamanCalibration.model_validate_json(json.dumps(read_json(path)))
    except ValidationError as error:
        raise explained(error, RamanCalibration, f"{path}: not a Raman calibration") from None


# --- in use -------------------------------------------------------------------------------------


@dataclass(frozen=True)
class LineTemperature:
    """Temperatures of n spectra."""

    shift: Array  #: (n,), against the line at room temperature, cm⁻¹
    temperature: Array  #: (n,), K; NaN where silicon has no such line
    error: Array  #: (n,), K
    noise: Array  #: (n,), K; the part of the error that is each one's own: noise and scatter
    outside: np.ndarray  #: (n,), whether the temperature lies outside the calibrated range


@dataclass(frozen=True)
class Thermometer:
    """A calibration in use.

    Examples
    --------
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
        reference, covariance, chi_square = _least_squares(
            np.ones((len(lines), 1)), references, weights**-0.5
        )
        return replace(
            self,
            reference=float(reference[0]),
            # lines that differ by more than their noise say how well each of them is known
            reference_stderr=float(np.sqrt(covariance[0, 0] * max(chi_square, 1.0))),
        )

    def read(self, centre: ArrayLike, stderr: ArrayLike) -> LineTemperature:
        """Temperatures of lines.

        Parameters
        ----------
        centre, stderr : (n,) array_like
            cm⁻¹.

        Returns
        -------
        LineTemperature
            The error adds in quadrature: photon noise, what lines of the series scatter by
            beyond it, the calibration's covariance, laser heating, stress, and what the law
            itself may be wrong by: for the linear law the paper's ±(5 K + 0.02 ΔT) or, where
            larger, its distance from the anharmonic law; for the anharmonic law its distance
            from a parabola through the same points (the paper's band, where the constants are
            the published ones). Both grow outside the calibrated range. All but noise and
            scatter is common to the lines.
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
        noise = np.hypot(np.atleast_1d(np.asarray(stderr, dtype=float)), calibration.scatter_cm)
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
        variance = variance + (paper.STRESS_SHIFT * self.stress / slope) ** 2
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
    power_mW: float, resistance_K_per_mW: float, absorbed: float = paper.ABSORBED_SHARE
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
