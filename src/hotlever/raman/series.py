"""Many spectra at once: their lines, their temperatures, and the table of both."""

from __future__ import annotations

import csv
import io
import math
import os
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from hotlever.errors import InputError, unknown_name
from hotlever.raman.calibration import Calibration, Point, calibrate
from hotlever.raman.fit import fit_peak
from hotlever.raman.peak import NoSiliconLine, Peak, PeakOptions
from hotlever.raman.spectrum import Spectrum
from hotlever.raman.stated import kelvin
from hotlever.raman.tables import decode
from hotlever.raman.thermometer import Thermometer

COLUMNS = (
    "file",
    "center_cm-1",
    "center_stderr_cm-1",
    "fwhm_cm-1",
    "shift_cm-1",
    "temperature_K",
    "temperature_error_K",
    "flags",
)
"""Header of the Raman CSV."""

Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class Line:
    """A spectrum and its silicon line, None where it has none."""

    spectrum: Spectrum
    peak: Peak | None


@dataclass(frozen=True)
class Row:
    """One row of the Raman CSV; NaN where there is no number."""

    file: str
    centre: float
    centre_stderr: float
    fwhm: float
    shift: float
    temperature: float
    error: float
    flags: tuple[str, ...]


def measure(
    spectra: Sequence[Spectrum],
    options: PeakOptions | None = None,
    progress: Progress | None = None,
) -> list[Line]:
    """Fit the silicon line of each spectrum.

    Parameters
    ----------
    spectra : sequence of Spectrum
    options : PeakOptions, optional
    progress : callable, optional
        Called with (spectra done, spectra in all).
    """
    lines = []
    for done, spectrum in enumerate(spectra, start=1):
        try:
            peak = fit_peak(spectrum.x, spectrum.y, options, spectrum.name)
        except NoSiliconLine:
            peak = None
        lines.append(Line(spectrum, peak))
        if progress is not None:
            progress(done, len(spectra))
    return lines


def read_lines(lines: Iterable[Line], thermometer: Thermometer | None) -> list[Row]:
    """Rows of the Raman CSV; without a thermometer shift and temperature are left out."""
    lines = list(lines)
    rows = []
    for line, name in zip(lines, _names(line.spectrum for line in lines), strict=True):
        peak = line.peak
        if peak is None:
            nothing = math.nan
            rows.append(
                Row(name, nothing, nothing, nothing, nothing, nothing, nothing, ("no-line",))
            )
            continue
        shift = temperature = error = math.nan
        flags = list(peak.flags)
        if thermometer is not None:
            reading = thermometer.read([peak.centre], [peak.centre_stderr])
            shift, temperature, error = (
                float(values[0]) for values in (reading.shift, reading.temperature, reading.error)
            )
            if math.isnan(temperature):
                flags.append("no-temperature")
            elif reading.outside[0]:
                flags.append("extrapolated")
        rows.append(
            Row(
                name,
                peak.centre,
                peak.centre_stderr,
                peak.fwhm,
                shift,
                temperature,
                error,
                tuple(flags),
            )
        )
    return rows


def _names(spectra: Iterable[Spectrum]) -> list[str]:
    """File names; whole paths where two folders hold the same name."""
    spectra = list(spectra)
    names = [spectrum.name for spectrum in spectra]
    if len(set(names)) == len(names):
        return names
    return [str(Path(spectrum.folder) / spectrum.name) for spectrum in spectra]


def to_csv(rows: Iterable[Row]) -> str:
    """The Raman CSV.

    Examples
    --------
    >>> row = Row("a.txt", 520.7, 0.01, 3.1, float("nan"), float("nan"), float("nan"), ("edge",))
    >>> print(to_csv([row]).splitlines()[1])
    a.txt,520.7000,0.0100,3.100,,,,edge
    """
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(COLUMNS)
    for row in rows:
        numbers = (
            (row.centre, 4),
            (row.centre_stderr, 4),
            (row.fwhm, 3),
            (row.shift, 4),
            (row.temperature, 2),
            (row.error, 2),
        )
        cells = ["" if math.isnan(value) else f"{value:.{digits}f}" for value, digits in numbers]
        writer.writerow([row.file, *cells, ";".join(row.flags)])
    return out.getvalue()


def calibrate_from(
    spectra: Sequence[Spectrum],
    options: PeakOptions | None = None,
    temperatures: dict[str, float] | None = None,
    progress: Progress | None = None,
    source: str = "hot-plate series",
) -> tuple[Calibration, list[Line]]:
    """Calibrate from hot-plate spectra.

    Parameters
    ----------
    spectra : sequence of Spectrum
        Each with its temperature by header or file name, unless `temperatures` has it.
    options : PeakOptions, optional
    temperatures : dict, optional
        Kelvin by file name (see `read_temperatures`); goes before header and name.
    progress : callable, optional
    source : str
        Named in the calibration file.

    Raises
    ------
    InputError
        If a spectrum has no temperature, no silicon line, or a clipped one.
    """
    options = options or PeakOptions()
    table = temperatures or {}
    stated = []
    for spectrum in spectra:
        temperature = table.get(spectrum.name, table.get(Path(spectrum.name).stem))
        if temperature is None and table:
            raise unknown_name("spectrum in the temperature table", spectrum.name, table)
        if temperature is None:
            temperature = spectrum.temperature
        if temperature is None:
            raise InputError(
                f"{spectrum.name}: no temperature in its header or name; expected e.g. "
                "'#Temperature (K)=\t295', a name like si_450K.txt, or a table of temperatures"
            )
        stated.append(temperature)
    lines = measure(spectra, options, progress)
    points = []
    for line, temperature in zip(lines, stated, strict=True):
        if line.peak is None or "saturated" in line.peak.flags:
            found = "no silicon line" if line.peak is None else "a saturated line"
            raise InputError(
                f"{line.spectrum.name}: {found}, expected a spectrum to calibrate with"
            )
        points.append(
            Point(
                file=line.spectrum.name,
                temperature_K=temperature,
                centre_cm=line.peak.centre,
                centre_stderr_cm=line.peak.centre_stderr,
            )
        )
    return calibrate(points, options.shape, options.resolution, source), lines


def read_temperatures(path: str | os.PathLike[str]) -> dict[str, float]:
    """Read a table of temperatures: file name and temperature, in a header's K or °C.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     table = Path(folder) / "plate.csv"
    ...     _ = table.write_text("file,temperature (C)\\na.txt,25\\nb.txt,100\\n")
    ...     read_temperatures(table)
    {'a.txt': 298.15, 'b.txt': 373.15}
    """
    try:
        text = decode(Path(path).read_bytes(), str(path))
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from error
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    separator = next((mark for mark in ("\t", ";", ",") if lines and mark in lines[0]), None)
    unit, table = "K", {}
    for number, line in enumerate(lines, start=1):
        cells = [cell.strip(' "') for cell in line.split(separator)]
        if len(cells) < 2:
            raise InputError(
                f"{path}: row {number}: '{line.strip()[:40]}', expected a file name and a "
                "temperature"
            )
        try:
            value = float(cells[1].replace(",", "."))
        except ValueError:
            if number > 1:
                raise InputError(
                    f"{path}: row {number}: temperature '{cells[1][:40]}', expected a number"
                ) from None
            unit = "C" if "c" in cells[1].lower().split("temp")[-1].replace("erature", "") else "K"
            continue
        temperature = kelvin(value, unit)
        if temperature is None:
            raise InputError(f"{path}: row {number}: {value:g} {unit} is no sample temperature")
        table[Path(cells[0]).name] = temperature
    if not table:
        raise InputError(f"{path}: no rows of file name and temperature")
    return table
