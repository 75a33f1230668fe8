"""Many spectra at once: their lines, their temperatures, and the table of both."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hotlever.datasets import frame_text, labelled
from hotlever.errors import InputError, unknown_name
from hotlever.raman.line_fit import fit_peak, with_hidden_top
from hotlever.raman.lineshape import NoSiliconLine, Peak, PeakOptions
from hotlever.raman.spectrum import Spectrum, aliases
from hotlever.raman.spectrum_tables import SpectrumCorrection, of_spectrum
from hotlever.raman.thermometer import Point, RamanCalibration, Thermometer, calibrate_raman
from hotlever.types import Progress
from hotlever.work import each

if TYPE_CHECKING:
    import xarray as xr

#: Numbers of a Raman table, and their decimal places in the CSV.
DIGITS = {
    "center_per_cm": 4,
    "center_stderr_per_cm": 4,
    "fwhm_per_cm": 3,
    "shift_per_cm": 4,
    "temperature_K": 2,
    "temperature_error_K": 2,
}


@dataclass(frozen=True)
class MeasuredLine:
    """A spectrum and its silicon line, None where it has none or is left out."""

    spectrum: Spectrum
    peak: Peak | None
    correction: SpectrumCorrection = field(default_factory=SpectrumCorrection)  #: by hand

    @property
    def window(self) -> tuple[float, float]:
        """The part that is fitted, cm⁻¹."""
        return self.correction.of(PeakOptions()).window

    @property
    def flags(self) -> list[str]:
        """What was noticed of the line, and done by hand."""
        if not self.correction.use:
            return ["left-out"]
        flags = ["no-line"] if self.peak is None else list(self.peak.flags)
        return flags if self.correction == SpectrumCorrection() else [*flags, "by-hand"]


def measure(
    spectra: Sequence[Spectrum],
    options: PeakOptions | None = None,
    progress: Progress | None = None,
    corrections: Mapping[str, SpectrumCorrection] | None = None,
) -> list[MeasuredLine]:
    """Fit the silicon line of each spectrum.

    Whether there is a band beside it is asked of all of them together, unless the options say what
    other spectra of the instrument say: noise would decide it for each in another way.

    Parameters
    ----------
    spectra : sequence of Spectrum
    options : PeakOptions, optional
    progress : callable, optional
        Called with (spectra done, in all).
    corrections : mapping of SpectrumCorrection, optional
        By hand, by the name of the spectrum; see `read_corrections`.

    Returns
    -------
    list of MeasuredLine

    Raises
    ------
    InputError
        If the window of a correction holds too few samples.
    """
    options = options or PeakOptions()
    lines = [
        _line(spectrum, of_spectrum(spectrum, corrections or {}), options)
        for spectrum in each(spectra, progress)
    ]
    return lines if options.band_evidence is not None else _together(lines, options)


def _line(spectrum: Spectrum, correction: SpectrumCorrection, options: PeakOptions) -> MeasuredLine:
    peak = None
    if correction.use:
        with suppress(NoSiliconLine):
            fitted = fit_peak(spectrum.x, spectrum.y, correction.of(options), spectrum.name)
            peak = with_hidden_top(fitted, spectrum.x, spectrum.gaps)
    return MeasuredLine(spectrum, peak, correction)


def _together(lines: Sequence[MeasuredLine], options: PeakOptions) -> list[MeasuredLine]:
    """Fit again what is in doubt by itself, with what the others say for a band."""
    total, together = band_evidence(lines), []
    beyond_doubt = 14.0  # no band has a weight of 0.1 % then
    for line in lines:
        own = beyond_doubt if line.peak is None else line.peak.band_evidence
        if own < beyond_doubt and total > own:
            with_others = replace(options, band_evidence=total - own)
            together.append(_line(line.spectrum, line.correction, with_others))
        else:
            together.append(line)
    return together


def band_evidence(lines: Iterable[MeasuredLine]) -> float:
    """Return what spectra together say for a band beside the line, see `Peak.band_evidence`."""
    return sum(line.peak.band_evidence for line in lines if line.peak is not None)


def read_lines(lines: Sequence[MeasuredLine], thermometer: Thermometer | None) -> xr.Dataset:
    """Table of lines and, with a thermometer, of shifts and temperatures.

    Returns
    -------
    xarray.Dataset
        On dimension ``spectrum``: ``file``, the numbers of `DIGITS` (NaN where there is none), and
        ``flags``, separated by semicolons; with a thermometer ``temperature_noise_K``, the part of
        each error that is its own, and the attribute ``room_temperature_K``.
    """
    names = [line.spectrum.name for line in lines]
    if len(set(names)) < len(names):
        # whole paths, where two folders hold the same name
        names = [str(Path(line.spectrum.folder) / line.spectrum.name) for line in lines]
    numbers = np.full((len(DIGITS), len(lines)), np.nan)
    flags = [line.flags for line in lines]
    for column, peak in zip(numbers.T, (line.peak for line in lines), strict=True):
        if peak is not None:
            column[:3] = peak.centre, peak.centre_stderr, peak.fwhm
    more: dict[str, Any] = {}
    room: dict[str, Any] = {}
    if thermometer is not None:
        room["room_temperature_K"] = thermometer.calibration.room_temperature_K
        reading = thermometer.read(numbers[0], numbers[1])
        numbers[3:] = reading.shift, reading.temperature, reading.error
        more["temperature_noise_K"] = reading.noise
        missing = np.isnan(reading.temperature) & ~np.isnan(numbers[0])
        for flag, where in (("no-temperature", missing), ("extrapolated", reading.outside)):
            for spectrum in where.nonzero()[0].tolist():
                flags[spectrum].append(flag)
    joined = np.array([";".join(each) for each in flags], dtype=str)
    columns = {
        "file": ("spectrum", np.array(names, dtype=str), {"long_name": "file"}),
        **dict(zip(DIGITS, numbers, strict=True)),
        "flags": ("spectrum", joined, {"long_name": "what was noticed"}),
        **more,
    }
    return labelled(columns, "spectrum", **room)


def to_csv(table: xr.Dataset) -> str:
    """The Raman CSV of a table from `read_lines`."""
    frame = table[["file", *DIGITS, "flags"]].to_dataframe()
    for name, digits in DIGITS.items():
        frame[name] = frame[name].map(f"{{:.{digits}f}}".format, na_action="ignore")
    header = ["file", *(name.replace("_per_cm", "_cm-1") for name in DIGITS), "flags"]
    return frame_text(frame, index=False, header=header)


def calibrate_from(
    spectra: Sequence[Spectrum],
    options: PeakOptions | None = None,
    temperatures: dict[str, float] | None = None,
    progress: Progress | None = None,
    source: str = "hot-plate series",
    corrections: Mapping[str, SpectrumCorrection] | None = None,
) -> tuple[RamanCalibration, list[MeasuredLine]]:
    """Calibrate from hot-plate spectra, each with its temperature by header or file name.

    Parameters
    ----------
    spectra, options, progress, corrections
        See `measure`.
    temperatures : dict, optional
        Kelvin by file name (see `read_temperatures`), which goes before header and name.
    source : str
        Named in the calibration file.

    Returns
    -------
    RamanCalibration
    list of MeasuredLine
        Without those that are left out.

    Raises
    ------
    InputError
        If a spectrum has no temperature, no silicon line, or a clipped one.
    """
    options = options or PeakOptions()
    corrections = corrections or {}
    retained_spectra = [spectrum for spectrum in spectra if of_spectrum(spectrum, corrections).use]
    if not retained_spectra:
        raise InputError(f"{source}: every spectrum is left out, expected some to calibrate with")
    stated = [_temperature(spectrum, temperatures or {}) for spectrum in retained_spectra]
    lines = measure(retained_spectra, options, progress, corrections)
    points = []
    for line, temperature in zip(lines, stated, strict=True):
        name, peak = line.spectrum.name, line.peak
        if peak is None or "saturated" in peak.flags:
            fault = "no silicon line" if peak is None else "a saturated line"
            raise InputError(f"{name}: {fault}, expected a spectrum to calibrate with")
        points.append(
            Point(
                file=name,
                temperature_K=temperature,
                centre_cm=peak.centre,
                centre_stderr_cm=peak.centre_stderr,
            )
        )
    of_lines = options.shape, options.resolution, source, band_evidence(lines)
    return calibrate_raman(points, *of_lines), lines


def _temperature(spectrum: Spectrum, table: dict[str, float]) -> float:
    name = spectrum.name
    if not table:
        if spectrum.temperature is None:
            raise InputError(
                f"{name}: no temperature in its header or name; expected e.g. "
                "'#Temperature (K)=\t295', a name like si_450K.txt, or a table of temperatures"
            )
        return spectrum.temperature
    called = next((alias for alias in aliases(name) if alias in table), None)
    if called is None:
        raise unknown_name("spectrum in the temperature table", name, table)
    return table[called]
