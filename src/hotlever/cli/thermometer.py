"""The Raman thermometer that a command line asks for; what is noticed goes to standard error."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_args

from typer import Option

from hotlever.cli.options import File
from hotlever.cli.output import note, progress
from hotlever.errors import InputError, unknown_name

if TYPE_CHECKING:
    import xarray as xr

    from hotlever.raman import PeakOptions, RamanCalibration, Spectrum, Thermometer
    from hotlever.raman.correction import Correction
    from hotlever.raman.series import Line

PUBLISHED = "published"
_MOST_NOTES = 20
CalibrationOption = Annotated[
    str | None,
    Option(
        metavar="CAL.json",
        help="A calibration that --save-calibration wrote, or 'published' for the published "
        "laws (then --reference is needed).",
    ),
]


@dataclass(frozen=True)
class Setup:
    """A thermometer as the command line asked for it, or none.

    `hot_plate` is what the calibration was made of, if it was made now; `read` are all spectra that
    the thermometer was set up from.
    """

    options: PeakOptions
    calibration: RamanCalibration | None = None
    thermometer: Thermometer | None = None
    hot_plate: Sequence[Line] = ()
    read: Sequence[Spectrum] = ()
    corrections: Mapping[str, Correction] = field(default_factory=dict)
    corrected_by: str = ""  #: name of the table

    def measure(self, paths: list[Path]) -> tuple[list[Line], xr.Dataset]:
        """Read and fit spectra; a folder's other files are noted, a missing line too."""
        from hotlever.raman import read_lines
        from hotlever.raman.correction import check_corrections

        spectra = _read(paths)
        table, known = self.corrected_by, [*self.read, *spectra]
        elsewhere = check_corrections(self.corrections, known, table)
        _few_notes([f"{table}: passed over {name}, of no folder read here" for name in elsewhere])
        lines = _lines(spectra, self.options, self.corrections, "spectra")
        used = [line for line in lines if line.used]
        if not used:
            raise InputError(f"{table}: leaves out every spectrum, expected some to use")
        if all(line.peak is None for line in used):
            found = "this spectrum" if len(used) == 1 else f"any of {len(used)} spectra"
            raise InputError(f"{paths[0]}: no silicon line in {found}, expected one near 520 cm⁻¹")
        return lines, read_lines(lines, self.thermometer)


def calibration_of(calibration: str | None) -> RamanCalibration | None:
    """Return the published calibration, the one in a file, or none."""
    from hotlever.raman import published_raman_calibration, read_raman_calibration

    if calibration in (None, PUBLISHED):
        return published_raman_calibration() if calibration else None
    return read_raman_calibration(calibration)


def set_up(
    calibration: CalibrationOption = None,
    calibrate_from: list[Path] | None = Option(
        None, metavar="FILE_OR_DIR...", help="Hot-plate spectra to calibrate from; one or more."
    ),
    temperatures: File = Option(
        None,
        metavar="TABLE.csv",
        help="Hot-plate temperatures: file name, temperature. Left out: header or file name.",
    ),
    corrections: File = Option(
        None,
        metavar="TABLE.csv",
        help="By hand: file, start_cm-1 of the line, from_cm-1 and to_cm-1 of what is fitted, use.",
    ),
    reference: list[Path] | None = Option(
        None,
        metavar="FILE_OR_DIR",
        help="Spectrum at room temperature on the instrument as it is now; may be repeated.",
    ),
    law: str = Option("anharmonic", metavar="linear|anharmonic", help="Calibration law."),
    shape: str | None = Option(
        None,
        metavar="lorentzian|voigt|fano",
        help="Line shape; left out: that of the calibration, else lorentzian.",
    ),
    resolution: float | None = Option(
        None,
        metavar="CM-1",
        help="FWHM of the spectrometer's response, for voigt; left out: fitted.",
    ),
    laser_power: float | None = Option(
        None, metavar="MW", help="Laser power on the lever, for its heating."
    ),
    thermal_resistance: float | None = Option(
        None, metavar="K/MW", help="Thermal resistance of the lever, K per mW of heat."
    ),
    stress: float = Option(
        0.0, metavar="MPA", help="Unknown stress in the silicon; enters the error."
    ),
) -> Setup:
    """Return what the options of ``hotlever raman`` and ``hotlever join`` ask for."""
    from hotlever.raman import Thermometer, laser_heating, read_corrections, series
    from hotlever.raman.peak import LineShape
    from hotlever.raman.thermometer import Law

    if law not in get_args(Law):
        raise unknown_name("law", law, get_args(Law))
    if shape not in (None, *get_args(LineShape)):
        raise unknown_name("line shape", str(shape), get_args(LineShape))
    if calibration is not None and calibrate_from:
        raise InputError("give --calibration or --calibrate-from, not both")
    if temperatures is not None and not calibrate_from:
        raise InputError("--temperatures belongs to --calibrate-from, which is missing")
    if (laser_power is None) != (thermal_resistance is None):
        raise InputError("--laser-power and --thermal-resistance belong together: give both")
    heating = 0.0
    if laser_power is not None and thermal_resistance is not None:
        heating = laser_heating(laser_power, thermal_resistance)
        note(f"laser heating is estimated as {heating:.2g} K and enters the error")
    chosen = calibration_of(calibration)
    hot_plate: list[Line] = []
    options = _options(chosen, shape, resolution)
    by_hand = read_corrections(corrections) if corrections else {}
    plate: list[Spectrum] = []
    if calibrate_from:
        table = series.read_temperatures(temperatures) if temperatures else None
        plate = _read(calibrate_from)
        with progress("hot plate") as update:
            source = ", ".join(path.name or str(path) for path in calibrate_from)
            chosen, hot_plate = series.calibrate_from(
                plate, options, table, update, source, by_hand
            )
        _describe(chosen)
    if chosen is None:
        unused = {"--reference": reference, "--stress": stress, "--laser-power": laser_power}
        for name, given in unused.items():
            if given:
                raise InputError(f"{name} needs --calibration or --calibrate-from")
        return Setup(options, corrections=by_hand, corrected_by=str(corrections))
    if chosen.reference_cm is None and not reference:
        raise InputError(
            "--calibration published: give --reference, a spectrum of your instrument at room "
            "temperature, from which the shifts are taken"
        )
    # a calibration without reference gets one below; 0 stands in until then
    start = 0.0 if chosen.reference_cm is None else None
    chosen_law: Any = law
    thermometer = Thermometer(chosen, chosen_law, start, 0.0, heating, stress)
    if reference:
        found = _lines(_read(reference), options, by_hand, "reference")
        pairs = [(line.peak, line.spectrum.temperature) for line in found if line.peak]
        thermometer = thermometer.with_reference(pairs)
        plate += [line.spectrum for line in found]
    return Setup(options, chosen, thermometer, hot_plate, plate, by_hand, str(corrections))


def _options(
    calibration: RamanCalibration | None, shape: str | None, resolution: float | None
) -> PeakOptions:
    """The line shape asked for, else the calibration's: both sides must be fitted alike."""
    from hotlever.raman import PeakOptions

    if calibration is not None and calibration.points:
        same = shape in (None, calibration.line_shape)
        if not same or resolution not in (None, calibration.resolution_cm):
            note(
                f"the calibration was made with the line shape {calibration.line_shape}; "
                "fitting another one shifts the line"
            )
        if shape is None:
            shape = calibration.line_shape
            resolution = calibration.resolution_cm if resolution is None else resolution
    asked: Any = shape or "lorentzian"
    return PeakOptions(asked, resolution).validate()


def _describe(calibration: RamanCalibration) -> None:
    """What the series gave, and plainly where the line is not good enough."""
    line, law = calibration.linear, calibration.anharmonic
    found, (low, high) = calibration.residuals(), calibration.range_K
    outside = abs(found["linear_K"]) > found["band_K"]
    note(
        f"calibrated from {len(calibration.points)} spectra, {low:g} to {high:g} K: linear "
        f"{line.slope_K_cm:.2f} K cm (rms {line.residual_rms_K:.1f} K), anharmonic rms "
        f"{law.residual_rms_K:.1f} K"
    )
    if outside.any():
        where = ", ".join(f"{t:g}" for t in found["temperature_K"][outside])
        note(f"the line leaves the paper's error band at {where} K: the shift is not linear")
    if law.ratio_fixed:
        note(
            "too few temperatures to tell three- from four-phonon terms: their ratio is the "
            "published one"
        )


def _read(paths: list[Path]) -> list[Spectrum]:
    from hotlever.raman import read_spectra
    from hotlever.raman.part import file_and_label

    skipped: list[str] = []
    with progress("reading") as update:
        found = read_spectra(paths, skipped, update)
    _few_notes([f"passed over {line}" for line in skipped])
    names = {(one.folder, one.name) for one in found}
    files = Counter((folder, file_and_label(name)[0]) for folder, name in names)
    several = {name: count for (_, name), count in sorted(files.items()) if count > 1}
    _few_notes([f"{name}: {count} spectra in one file" for name, count in several.items()])
    return found


def _lines(
    spectra: list[Spectrum], options: PeakOptions, by_hand: Mapping[str, Correction], label: str
) -> list[Line]:
    from hotlever.raman import measure

    with progress(label) as update:
        lines = measure(spectra, options, update, by_hand)
    if len(lines) > 1:
        without = [line.spectrum.name for line in lines if line.used and line.peak is None]
        _few_notes([f"{name}: no silicon line" for name in without])
    return lines


def _few_notes(texts: list[str]) -> None:
    note(*texts[:_MOST_NOTES])
    if len(texts) > _MOST_NOTES:
        note(f"{len(texts) - _MOST_NOTES} more such notes")
