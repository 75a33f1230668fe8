"""Raman spectra that are measured, with or without a thermometer, and what follows from them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_args

from hotlever.errors import InputError, unknown_name
from hotlever.files import FIGURE_TYPES, write_text
from hotlever.tasks.arguments import Reporter, Written, at_most_one, draw, refuse

if TYPE_CHECKING:
    import xarray as xr

    from hotlever.raman.lineshape import PeakOptions
    from hotlever.raman.series import MeasuredLine
    from hotlever.raman.spectrum import Spectrum
    from hotlever.raman.spectrum_tables import SpectrumCorrection
    from hotlever.raman.thermometer import RamanCalibration, Thermometer


@dataclass(frozen=True)
class ThermometerOptions:
    """How the silicon line is found, and what its shift is read with, as the options say it.

    Attributes
    ----------
    calibration : CAL.json
        A calibration that --save-calibration wrote, or 'published' for the published laws (then
        --reference is needed).
    calibrate_from : FILE_OR_DIR...
        Hot-plate spectra to calibrate from; one or more.
    temperatures : TABLE.csv
        Hot-plate temperatures: file name, temperature. Left out: header or file name.
    corrections : TABLE.csv
        By hand: file, start_cm-1 of the line, from_cm-1 and to_cm-1 of what is fitted, use.
    reference : FILE_OR_DIR
        Spectrum at room temperature on the instrument as it is now; may be repeated.
    law : linear|anharmonic
        Calibration law.
    shape : lorentzian|voigt|fano
        Line shape; left out: that of the calibration, else lorentzian.
    resolution : CM-1
        FWHM of the spectrometer's response, for voigt; left out: fitted.
    laser_power : MW
        Laser power on the lever, for its heating.
    thermal_resistance : K/MW
        Thermal resistance of the lever, K per mW of heat.
    stress : MPA
        Unknown stress in the silicon; enters the error.
    """

    calibration: str | None = None
    calibrate_from: list[Path] | None = None
    temperatures: Path | None = None
    corrections: Path | None = None
    reference: list[Path] | None = None
    law: str = "anharmonic"
    shape: str | None = None
    resolution: float | None = None
    laser_power: float | None = None
    thermal_resistance: float | None = None
    stress: float = 0.0


def measure_spectra(
    reporter: Reporter,
    spectra: list[Path],
    *,
    thermometer: ThermometerOptions,
    save_calibration: Annotated[Path | None, Written((".json",))] = None,
    output: Annotated[Path | None, Written((".csv",))] = None,
    plot: Annotated[Path | None, Written(FIGURE_TYPES)] = None,
) -> None:
    """Find the silicon line in Raman spectra and, calibrated, the temperature.

    Parameters
    ----------
    spectra : FILE_OR_DIR...
        Spectra, or folders of spectra.
    save_calibration : CAL.json
        Write the calibration to this file.
    output : FILE.csv
        Left out: print.
    plot : FILE.png|.svg|.pdf
        Figure of spectra and calibration.
    """
    from hotlever.raman import series

    setup = set_up(reporter, thermometer)
    if save_calibration is not None and setup.calibration is None:
        raise InputError("--save-calibration: there is no calibration; give --calibrate-from")
    lines, table = setup.measure(spectra)
    if len(lines) == 1 and setup.calibration is None:
        draw(plot, lambda figures: figures.one_spectrum(lines[0]))
    else:
        of = setup.calibration, setup.hot_plate
        draw(plot, lambda figures: figures.thermometry(lines, table, *of))
    if save_calibration is not None and setup.calibration is not None:
        setup.calibration.save(save_calibration)
    _answer(reporter, series.to_csv(table), output)


def join_spectra(
    reporter: Reporter,
    bias_log: Path,
    spectra: list[Path],
    *,
    thermometer: ThermometerOptions,
    output: Annotated[Path | None, Written((".csv",))] = None,
) -> None:
    """Join a bias log with tip spectra into the file that `hotlever fit` takes.

    A spectrum belongs to the row that names it in a 'file' column, or has the bias in its name
    (tip_5.25V.txt); else spectra and rows are paired in order.

    Parameters
    ----------
    bias_log : BIAS_LOG.csv
        The bias sweep.
    spectra : FILE_OR_DIR...
        Spectra, or folders of spectra.
    output : DATA.csv
        Left out: print.
    """
    from hotlever.raman.spectrum_tables import join, read_bias_log

    log = read_bias_log(bias_log)
    setup = set_up(reporter, thermometer)
    if setup.thermometer is None:
        raise InputError("join needs temperatures: give --calibration or --calibrate-from")
    _, table = setup.measure(spectra)
    read = zip(table.file.values, table.temperature_K.values, strict=True)
    missing = [file for file, temperature in read if isnan(temperature)]
    if missing:
        reporter.note(f"no temperature from {', '.join(missing)}: empty cells")
    _answer(reporter, join(log, table), output)


def _answer(reporter: Reporter, text: str, output: Path | None) -> None:
    """Give the table, or write it and say where."""
    if output is None:
        reporter.give(text)
    else:
        write_text(output, text)
        reporter.tell(f"wrote {output}")


# --- the thermometer ------------------------------------------------------------------------------


@dataclass(frozen=True)
class Thermometry:
    """How spectra are measured: the line's shape, and a thermometer if there is a calibration.

    ``hot_plate`` is what the calibration was made of, if it was made now; ``spectra`` are all that
    the thermometer was set up from.
    """

    reporter: Reporter
    options: PeakOptions
    calibration: RamanCalibration | None = None
    thermometer: Thermometer | None = None
    hot_plate: Sequence[MeasuredLine] = ()
    spectra: Sequence[Spectrum] = ()
    corrections: Mapping[str, SpectrumCorrection] = field(default_factory=dict)
    corrected_by: str = ""  #: name of the table

    def measure(self, paths: Sequence[Path]) -> tuple[list[MeasuredLine], xr.Dataset]:
        """Read and fit spectra; return their lines and the table of `read_lines`.

        Raises
        ------
        InputError
            If one cannot be read, none is left to use, or none has a silicon line.
        """
        from hotlever.raman import series
        from hotlever.raman.spectrum_tables import check_corrections

        spectra = _read(self.reporter, paths)
        table = self.corrected_by
        elsewhere = check_corrections(self.corrections, [*self.spectra, *spectra], table)
        stray = [f"{table}: passed over {name}, of no folder read here" for name in elsewhere]
        _note_some(self.reporter, stray)
        lines = _measure(self.reporter, spectra, self.options, self.corrections, "spectra")
        used = [line for line in lines if line.correction.use]
        if not used:
            raise InputError(f"{table}: leaves out every spectrum, expected some to use")
        if all(line.peak is None for line in used):
            which = "this spectrum" if len(used) == 1 else f"any of {len(used)} spectra"
            raise InputError(f"{paths[0]}: no silicon line in {which}, expected one near 520 cm⁻¹")
        return lines, series.read_lines(lines, self.thermometer)


def _note_some(reporter: Reporter, texts: Sequence[str], most: int = 20) -> None:
    """Tell the first of many notes, at most so many, and how many more there are."""
    reporter.note(*texts[:most])
    if len(texts) > most:
        reporter.note(f"{len(texts) - most} more such notes")


def _read(reporter: Reporter, paths: Sequence[Path]) -> list[Spectrum]:
    """Read spectra; what a folder holds beside them is noted."""
    from hotlever.raman.spectrum import file_and_label
    from hotlever.raman.spectrum_reading import read_spectra

    skipped: list[str] = []
    with reporter.progress("reading") as update:
        spectra = read_spectra(paths, skipped, update)
    _note_some(reporter, [f"passed over {line}" for line in skipped])
    names = {(spectrum.folder, spectrum.name) for spectrum in spectra}
    files = Counter((folder, file_and_label(name)[0]) for folder, name in names)
    several = {name: count for (_, name), count in sorted(files.items()) if count > 1}
    _note_some(
        reporter, [f"{name}: {count} spectra in one file" for name, count in several.items()]
    )
    return spectra


def _measure(
    reporter: Reporter,
    spectra: Sequence[Spectrum],
    options: PeakOptions,
    corrections: Mapping[str, SpectrumCorrection],
    label: str,
) -> list[MeasuredLine]:
    """Fit the lines of spectra; those of many that have none are noted."""
    from hotlever.raman import series

    with reporter.progress(label) as update:
        lines = series.measure(spectra, options, update, corrections)
    if len(lines) > 1:
        used = [line for line in lines if line.correction.use]
        without = [line.spectrum.name for line in used if line.peak is None]
        _note_some(reporter, [f"{name}: no silicon line" for name in without])
    return lines


def calibration_named(name: str | None) -> RamanCalibration | None:
    """Return the published calibration, the one in a file, or none."""
    from hotlever.raman.thermometer import published_raman_calibration, read_raman_calibration

    if name is None:
        return None
    return published_raman_calibration() if name == "published" else read_raman_calibration(name)


def set_up(reporter: Reporter, asked: ThermometerOptions) -> Thermometry:
    """Set up a thermometer, or only the fit of the line if no calibration is named.

    Raises
    ------
    InputError
        If a file is at fault, or these do not go together.
    """
    from hotlever.raman import series
    from hotlever.raman.spectrum_tables import read_corrections, read_temperatures
    from hotlever.raman.thermometer import Law, Thermometer, laser_heating

    if asked.law not in get_args(Law):
        raise unknown_name("law", asked.law, get_args(Law))
    at_most_one(calibration=asked.calibration, calibrate_from=asked.calibrate_from or None)
    if not asked.calibrate_from:
        refuse("goes with --calibrate-from", temperatures=asked.temperatures)
    laser_power, thermal_resistance = asked.laser_power, asked.thermal_resistance
    if (laser_power is None) != (thermal_resistance is None):
        raise InputError("--laser-power and --thermal-resistance belong together: give both")
    heating = 0.0
    if laser_power is not None and thermal_resistance is not None:
        heating = laser_heating(laser_power, thermal_resistance)
        reporter.note(f"laser heating is estimated as {heating:.2g} K and enters the error")
    chosen = calibration_named(asked.calibration)
    options = _peak_options(reporter, chosen, asked.shape, asked.resolution)
    by_hand = read_corrections(asked.corrections) if asked.corrections else {}
    corrected_by = str(asked.corrections)
    hot_plate: list[MeasuredLine] = []
    spectra: list[Spectrum] = []
    if asked.calibrate_from:
        stated = asked.temperatures
        table = read_temperatures(stated) if stated else None
        spectra = _read(reporter, asked.calibrate_from)
        source = ", ".join(path.name or str(path) for path in asked.calibrate_from)
        with reporter.progress("hot plate") as update:
            chosen, hot_plate = series.calibrate_from(
                spectra, options, table, update, source, by_hand
            )
        options = chosen.options
        _describe(reporter, chosen)
    if chosen is None:
        refuse(
            "needs --calibration or --calibrate-from",
            reference=asked.reference or None,
            stress=asked.stress or None,
            laser_power=asked.laser_power,
            law=asked.law != ThermometerOptions.law,
        )
        return Thermometry(reporter, options, corrections=by_hand, corrected_by=corrected_by)
    if chosen.reference_cm is None and not asked.reference:
        raise InputError(
            "--calibration published: give --reference, a spectrum of your instrument at room "
            "temperature, from which the shifts are taken"
        )
    # a calibration without reference gets one below; 0 stands in until then
    start = 0.0 if chosen.reference_cm is None else None
    law: Any = asked.law
    thermometer = Thermometer(chosen, law, start, 0.0, heating, asked.stress)
    if asked.reference:
        lines = _measure(reporter, _read(reporter, asked.reference), options, by_hand, "reference")
        if options.band_evidence is None:
            options = replace(options, band_evidence=series.band_evidence(lines))
        peaks = [(line.peak, line.spectrum.temperature) for line in lines if line.peak]
        thermometer = thermometer.with_reference(peaks)
        spectra += [line.spectrum for line in lines]
    return Thermometry(
        reporter, options, chosen, thermometer, hot_plate, spectra, by_hand, corrected_by
    )


def _peak_options(
    reporter: Reporter, calibration: RamanCalibration | None, shape: Any, resolution: float | None
) -> PeakOptions:
    """As is asked for, else as the calibration was made: both sides must be fitted alike."""
    from hotlever.raman.lineshape import PeakOptions

    if calibration is None or not calibration.points:
        return PeakOptions(shape or "lorentzian", resolution)
    alike = calibration.options
    if shape not in (None, alike.shape) or resolution not in (None, alike.resolution):
        reporter.note(
            f"the calibration was made with the line shape {alike.shape}; "
            "fitting another one shifts the line"
        )
    if shape is None:
        shape = alike.shape
        resolution = alike.resolution if resolution is None else resolution
    return replace(alike, shape=shape, resolution=resolution)


def _describe(reporter: Reporter, calibration: RamanCalibration) -> None:
    """Tell what the series gave, and plainly where the line is not good enough."""
    line, law = calibration.linear, calibration.anharmonic
    residuals, (low, high) = calibration.residuals(), calibration.range_K
    outside = abs(residuals["linear_K"]) > residuals["band_K"]
    reporter.note(
        f"calibrated from {len(calibration.points)} spectra, {low:g} to {high:g} K: linear "
        f"{line.slope_K_cm:.2f} K cm (rms {line.residual_rms_K:.1f} K), anharmonic rms "
        f"{law.residual_rms_K:.1f} K"
    )
    if outside.any():
        where = ", ".join(f"{t:g}" for t in residuals["temperature_K"][outside])
        reporter.note(
            f"the line leaves the paper's error band at {where} K: the shift is not linear"
        )
    if scatter_cm := calibration.scatter_cm:
        scatter_K = scatter_cm * abs(line.slope_K_cm)
        reporter.note(
            f"its lines scatter by {scatter_cm:.2g} cm⁻¹ ({scatter_K:.2g} K) beyond their noise: "
            "if the hot plate is sure, the axis does not come back, and each temperature's error "
            "holds that"
        )
    if law.ratio_fixed:
        reporter.note(
            "too few temperatures to tell three- from four-phonon terms: their ratio is the "
            "published one"
        )
