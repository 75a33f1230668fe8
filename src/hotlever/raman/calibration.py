"""The thermometer's calibration: line position against temperature on one instrument.

Two laws are fitted to the same hot-plate series. The linear law of Spieser et al. 2017 is the
paper's; the anharmonic law (`hotlever.raman.anharmonic`) is for use above the hot plate's
range. Both refer to the line's place at room temperature on the same instrument, so an offset
of its axis cancels.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from hotlever import __version__
from hotlever.errors import InputError
from hotlever.files import read_text, write_text
from hotlever.raman import anharmonic
from hotlever.raman.lineshape import Array
from hotlever.raman.published import (
    BALKANSKI1983,
    ROOM_TEMPERATURE,
    SILICON_MELTS,
    SPIESER2017,
)

FORMAT: Literal["hotlever-raman-calibration-1"] = "hotlever-raman-calibration-1"

ROOM = (273.0, 323.0)
"""K; the coldest spectrum of a series must lie here."""
FREE_FIT_POINTS, FREE_FIT_SPAN = 6, 250.0
"""Fewer temperatures, or a smaller span (K), cannot tell the three- from the four-phonon
term; their ratio is then the published one."""
_TEMPERATURES = np.arange(20.0, SILICON_MELTS + 0.5, 0.5)


class _Model(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Point(_Model):
    """One spectrum of the series."""

    file: str
    temperature_K: float
    centre_cm: float
    centre_stderr_cm: float


class LinearFit(_Model):
    """T − T_RT = constant + slope·shift, the paper's law and error model."""

    constant_K: float
    slope_K_cm: float = Field(lt=0)
    slope_stderr_K_cm: float = Field(default=0.0, ge=0)
    error_constant_K: float = Field(default=SPIESER2017.error_constant, ge=0)
    error_fraction: float = Field(default=SPIESER2017.error_fraction, ge=0)
    residual_rms_K: float = Field(default=0.0, ge=0)

    def temperature(self, shift: Array, room_temperature: float) -> Array:
        """Temperature (K) of a shift (cm⁻¹)."""
        return np.asarray(room_temperature + self.constant_K + self.slope_K_cm * shift)

    def band(self, above_room: Array) -> Array:
        """The paper's calibration error (K) at T − T_RT (K)."""
        return np.asarray(self.error_constant_K + self.error_fraction * np.maximum(above_room, 0.0))


class AnharmonicFit(_Model):
    """Balkanski's law, with a parabola through the same points to judge it by.

    ``covariance`` is that of (reference, three_phonon, four_phonon), cm⁻².
    """

    three_phonon_cm: float
    four_phonon_cm: float
    covariance: list[list[float]]
    parabola: list[float] = Field(default=[], max_length=2)
    ratio_fixed: bool = False
    residual_rms_K: float = Field(default=0.0, ge=0)
    reduced_chi_square: float = Field(default=0.0, ge=0)

    @model_validator(mode="after")
    def _square(self) -> AnharmonicFit:
        matrix = self.covariance
        if len(matrix) != 3 or any(len(row) != 3 for row in matrix):
            raise ValueError("covariance: expected a matrix of 3 × 3")
        if self.parabola and len(self.parabola) != 2:
            raise ValueError("parabola: expected two coefficients or none")
        return self

    def shift(self, temperature: Array, room_temperature: float) -> tuple[Array, Array]:
        """Shift (cm⁻¹) and its slope (cm⁻¹/K) at temperatures (K)."""
        return anharmonic.shift(
            temperature, room_temperature, self.three_phonon_cm, self.four_phonon_cm
        )

    def temperature(self, shift: Array, room_temperature: float) -> Array:
        """Temperature (K) of a shift (cm⁻¹); NaN where silicon has none such below melting."""
        values, _ = self.shift(_TEMPERATURES, room_temperature)
        return np.asarray(
            np.interp(shift, values[::-1], _TEMPERATURES[::-1], left=np.nan, right=np.nan)
        )


class Calibration(_Model):
    """What `Thermometer` needs to know of an instrument, both laws, and where they come from."""

    format: Literal["hotlever-raman-calibration-1"] = FORMAT
    version: str = __version__
    source: str
    room_temperature_K: float = Field(gt=0, lt=SILICON_MELTS)
    reference_cm: float | None = None
    reference_stderr_cm: float = Field(default=0.0, ge=0)
    range_K: tuple[float, float]
    line_shape: Literal["lorentzian", "voigt", "fano"] = "lorentzian"
    resolution_cm: float | None = None
    linear: LinearFit
    anharmonic: AnharmonicFit
    points: list[Point] = []

    @model_validator(mode="after")
    def _falling(self) -> Calibration:
        _, slope = self.anharmonic.shift(_TEMPERATURES, self.room_temperature_K)
        if not np.all(slope[_TEMPERATURES > 100.0] < 0.0):
            raise ValueError(
                "anharmonic: the line must fall with temperature up to the melting point, "
                f"found three-phonon {self.anharmonic.three_phonon_cm:g} and four-phonon "
                f"{self.anharmonic.four_phonon_cm:g} cm⁻¹"
            )
        return self

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the calibration as JSON, whole or not at all."""
        write_text(path, self.model_dump_json(indent=2) + "\n")

    def residuals(self) -> dict[str, Array]:
        """Of the series: temperature by each law less the hot plate's, and the paper's band.

        Returns
        -------
        dict
            ``temperature_K``, ``shift_cm``, ``shift_stderr_cm``, ``linear_K``,
            ``anharmonic_K`` and ``band_K``, each (n,), in order of temperature.
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
            "shift_stderr_cm": np.array([point.centre_stderr_cm for point in points]),
            "linear_K": linear - temperature,
            # near the fit the law is its tangent; this also holds where it has no inverse
            "anharmonic_K": (shift - predicted) / slope,
            "band_K": self.linear.band(linear - room),
        }


def published() -> Calibration:
    """The published laws: the linear one of Spieser et al. 2017 and Balkanski's of 1983.

    They hold no reference: give the line's place at room temperature on your instrument.

    Examples
    --------
    >>> law = published().linear
    >>> law.constant_K, law.slope_K_cm
    (5.0, -41.1)
    """
    return Calibration(
        source=f"{SPIESER2017.source}; {BALKANSKI1983.source}",
        room_temperature_K=ROOM_TEMPERATURE,
        range_K=(ROOM_TEMPERATURE, SPIESER2017.calibrated_to),
        linear=LinearFit(constant_K=SPIESER2017.constant, slope_K_cm=SPIESER2017.slope),
        anharmonic=AnharmonicFit(
            three_phonon_cm=BALKANSKI1983.three_phonon,
            four_phonon_cm=BALKANSKI1983.four_phonon,
            covariance=[[0.0] * 3] * 3,
        ),
    )


def calibrate(
    points: Sequence[Point],
    line_shape: Literal["lorentzian", "voigt", "fano"] = "lorentzian",
    resolution_cm: float | None = None,
    source: str = "hot-plate series",
) -> Calibration:
    """Fit both laws to a hot-plate series.

    Parameters
    ----------
    points : sequence of Point
        At least three temperatures; the coldest one is the room temperature.
    line_shape, resolution_cm
        How the peaks were fitted; spectra measured with this calibration are fitted so too.
    source : str
        Named in the calibration file.

    Returns
    -------
    Calibration
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
    >>> fit = calibrate(series)
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
    if not ROOM[0] <= room <= ROOM[1]:
        raise InputError(
            f"calibration: the coldest spectrum is at {room:g} K, expected one at room "
            f"temperature ({ROOM[0]:g} to {ROOM[1]:g} K), from which the shifts are taken"
        )
    if np.any(stderr <= 0.0):
        raise InputError("calibration: every line position needs a standard error above 0")
    reference, law, covariance = _fit_anharmonic(temperature, centre, stderr, room)
    shift = centre - reference
    design = np.stack([np.ones_like(shift), shift], axis=1)
    (constant, slope), *_ = np.linalg.lstsq(design, temperature - room, rcond=None)
    scatter = temperature - room - design @ [constant, slope]
    freedom = max(temperature.size - 2, 1)
    slope_error = np.sqrt(scatter @ scatter / freedom / np.sum((shift - shift.mean()) ** 2))
    if not slope < 0.0:
        raise InputError(
            f"calibration: the line moves by {1 / slope if slope else 0.0:+.4f} cm⁻¹/K with "
            "temperature, expected about -0.024; are the temperatures those of the spectra?"
        )
    try:
        return Calibration(
            source=source,
            room_temperature_K=room,
            reference_cm=reference,
            reference_stderr_cm=float(np.sqrt(covariance[0][0])),
            range_K=(room, float(temperature.max())),
            line_shape=line_shape,
            resolution_cm=resolution_cm,
            linear=LinearFit(
                constant_K=constant,
                slope_K_cm=slope,
                slope_stderr_K_cm=slope_error,
                residual_rms_K=float(np.sqrt(np.mean(scatter**2))),
            ),
            anharmonic=law,
            points=list(points),
        )
    except ValidationError as error:
        raise InputError(f"calibration: {_first(error)}") from error


def _fit_anharmonic(
    temperature: Array, centre: Array, stderr: Array, room: float
) -> tuple[float, AnharmonicFit, list[list[float]]]:
    """Weighted linear least squares for the reference and the two phonon terms."""
    a, b, _, _ = anharmonic.terms(temperature)
    a_room, b_room, _, _ = anharmonic.terms(room)
    ones = np.ones_like(temperature)
    columns = np.stack([ones, a - a_room, b - b_room], axis=1)
    free = (
        np.unique(np.round(temperature, 1)).size >= FREE_FIT_POINTS
        and np.ptp(temperature) >= FREE_FIT_SPAN
    )
    ratio = BALKANSKI1983.four_phonon / BALKANSKI1983.three_phonon
    basis = np.eye(3) if free else np.array([[1.0, 0.0], [0.0, 1.0], [0.0, ratio]])
    reduced, covariance, chi_square = _weighted(columns @ basis, centre, stderr)
    reference, three, four = basis @ reduced
    full = basis @ covariance @ basis.T
    u = temperature - room
    parabola: list[float] = []
    if free:
        coefficients, _, _ = _weighted(np.stack([ones, u, u**2], axis=1), centre, stderr)
        # as a shift against the same reference: what the two fits disagree about at room
        # temperature is part of the disagreement
        parabola = [float(coefficients[1]), float(coefficients[2])]
    _, slope = anharmonic.shift(temperature, room, three, four)
    residual = (centre - columns @ [reference, three, four]) / slope
    law = AnharmonicFit(
        three_phonon_cm=three,
        four_phonon_cm=four,
        covariance=full.tolist(),
        parabola=parabola,
        ratio_fixed=not free,
        residual_rms_K=float(np.sqrt(np.mean(residual**2))),
        reduced_chi_square=chi_square,
    )
    return float(reference), law, full.tolist()


def _weighted(columns: Array, values: Array, stderr: Array) -> tuple[Array, Array, float]:
    """Parameters, covariance (scaled up, never down, by the residuals), reduced chi-square."""
    weighted = columns / stderr[:, None]
    parameters, *_ = np.linalg.lstsq(weighted, values / stderr, rcond=None)
    residual = (values - columns @ parameters) / stderr
    chi_square = float(residual @ residual) / max(values.size - columns.shape[1], 1)
    covariance = np.linalg.pinv(weighted.T @ weighted, hermitian=True)
    return np.asarray(parameters), np.asarray(covariance * max(chi_square, 1.0)), chi_square


def load(path: str | os.PathLike[str]) -> Calibration:
    """Read a calibration that `Calibration.save` wrote.

    Raises
    ------
    InputError
        Naming the key at fault and what was expected.
    """
    try:
        return Calibration.model_validate_json(read_text(path))
    except ValidationError as error:
        raise InputError(f"{path}: not a Raman calibration: {_first(error)}") from error


def _first(error: ValidationError) -> str:
    item = error.errors()[0]
    key = ".".join(str(part) for part in item["loc"])
    return f"{key}: {item['msg']}" if key else str(item["msg"])
