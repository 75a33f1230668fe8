"""``hotlever raman``, ``hotlever join`` and ``hotlever raman-check``."""

from __future__ import annotations

import json
from contextlib import AbstractContextManager, nullcontext
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any, Literal

import typer
import typer.core

from hotlever.cli.app import app, note, progress, stderr
from hotlever.errors import InputError, unknown_name
from hotlever.files import write_text
from hotlever.raman import calibration as calibrations
from hotlever.raman import join as joining
from hotlever.raman import series
from hotlever.raman.calibration import Calibration
from hotlever.raman.check import paper_check
from hotlever.raman.peak import PeakOptions
from hotlever.raman.spectrum import Spectrum, iter_spectra, spectrum_files
from hotlever.raman.thermometer import Thermometer, laser_heating

PUBLISHED = "published"
LAWS = ("linear", "anharmonic")
SHAPES = ("lorentzian", "voigt", "fano")

_MANY = "--calibrate-from"
_BAR_FROM = 150  # spectra; they take about a second


class SeveralFiles(typer.core.TyperCommand):
    """A command whose ``--calibrate-from`` takes all paths up to the next option.

    Where that would leave no spectra to measure, it takes the first path only, so that
    ``hotlever raman --calibrate-from hot-plate/ tip/`` means what it says.
    """

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Repeat the option before each of its paths, then parse as usual."""
        return super().parse_args(ctx, spread_option(args, _MANY, self._takes_value()))

    def _takes_value(self) -> set[str]:
        names: set[str] = set()
        for parameter in self.params:
            if parameter.param_type_name == "option" and not getattr(parameter, "is_flag", False):
                names.update(parameter.opts)
        return names


def spread_option(args: list[str], option: str, takes_value: set[str]) -> list[str]:
    """Turn ``--option a b`` into ``--option a --option b``.

    Examples
    --------
    >>> spread_option(["x", "--from", "a", "b", "-o", "c"], "--from", {"--from", "-o"})
    ['x', '--from', 'a', '--from', 'b', '-o', 'c']
    >>> spread_option(["--from", "a", "b"], "--from", {"--from"})
    ['--from', 'a', 'b']
    """
    plain, groups, i = 0, [], 0
    parts: list[list[str]] = []
    while i < len(args):
        word = args[i]
        if word == option or word.startswith(option + "="):
            values = [word.partition("=")[2]] if "=" in word else []
            i += 1
            while i < len(args) and not args[i].startswith("-"):
                values.append(args[i])
                i += 1
            groups.append(len(parts))
            parts.append(values)
            continue
        if word.startswith("-") and word in takes_value and i + 1 < len(args):
            parts.append([word, args[i + 1]])
            i += 2
            continue
        plain += not word.startswith("-")
        parts.append([word])
        i += 1
    out: list[str] = []
    for index, part in enumerate(parts):
        if index not in groups:
            out += part
            continue
        if not part:
            out.append(option)
        keep = len(part) if plain or index != groups[-1] else 1
        for value in part[:keep]:
            out += [option, value]
        out += part[keep:]
    return out


Spectra = Annotated[
    list[Path], typer.Argument(metavar="FILE_OR_DIR...", help="Spectra, or folders of spectra.")
]
CalibrationOption = Annotated[
    str | None,
    typer.Option(
        metavar="CAL.json",
        help="A calibration that --save-calibration wrote, or 'published' for the published "
        "laws (then --reference is needed).",
    ),
]
CalibrateFrom = Annotated[
    list[Path] | None,
    typer.Option(
        _MANY, metavar="FILE_OR_DIR...", help="Hot-plate spectra to calibrate from; one or more."
    ),
]
Temperatures = Annotated[
    Path | None,
    typer.Option(
        metavar="TABLE.csv",
        help="Hot-plate temperatures: file name, temperature. Left out: header or file name.",
    ),
]
SaveCalibration = Annotated[
    Path | None, typer.Option(metavar="CAL.json", help="Write the calibration to this file.")
]
Reference = Annotated[
    list[Path] | None,
    typer.Option(
        metavar="FILE_OR_DIR",
        help="Spectrum at room temperature on the instrument as it is now; may be repeated.",
    ),
]
LawOption = Annotated[str, typer.Option(metavar="linear|anharmonic", help="Calibration law.")]
ShapeOption = Annotated[
    str | None,
    typer.Option(
        metavar="lorentzian|voigt|fano",
        help="Line shape; left out: that of the calibration, else lorentzian.",
    ),
]
Resolution = Annotated[
    float | None,
    typer.Option(
        metavar="CM-1", help="FWHM of the spectrometer's response, for voigt; left out: fitted."
    ),
]
LaserPower = Annotated[
    float | None, typer.Option(metavar="MW", help="Laser power on the lever, for its heating.")
]
ThermalResistance = Annotated[
    float | None,
    typer.Option(metavar="K/MW", help="Thermal resistance of the lever, K per mW of heat."),
]
Stress = Annotated[
    float, typer.Option(metavar="MPA", help="Unknown stress in the silicon; enters the error.")
]


@app.command("raman", cls=SeveralFiles)
def raman(
    spectra: Spectra,
    calibration: CalibrationOption = None,
    calibrate_from: CalibrateFrom = None,
    temperatures: Temperatures = None,
    save_calibration: SaveCalibration = None,
    reference: Reference = None,
    law: LawOption = "anharmonic",
    shape: ShapeOption = None,
    resolution: Resolution = None,
    laser_power: LaserPower = None,
    thermal_resistance: ThermalResistance = None,
    stress: Stress = 0.0,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="FILE.csv", help="Left out: print.")
    ] = None,
    plot: Annotated[
        Path | None,
        typer.Option(metavar="FILE.png|.svg|.pdf", help="Figure of spectra and calibration."),
    ] = None,
) -> None:
    """Find the silicon line in Raman spectra and, calibrated, the temperature."""
    setup = _setup(
        calibration, calibrate_from, temperatures, reference, law, shape, resolution,
        laser_power, thermal_resistance, stress,
    )  # fmt: skip
    if save_calibration is not None and setup.calibration is None:
        raise InputError("--save-calibration: there is no calibration; give --calibrate-from")
    lines, rows = setup.measure(spectra)
    if plot is not None:
        from hotlever.raman import figures
        from hotlever.report.style import save_figure

        if len(lines) == 1 and setup.calibration is None:
            figure = figures.one_spectrum(lines[0])
        else:
            figure = figures.thermometry(lines, rows, setup.calibration, setup.series)
        save_figure(figure, plot)
    if save_calibration is not None and setup.calibration is not None:
        setup.calibration.save(save_calibration)
    _put(series.to_csv(rows), output)


@app.command("join", cls=SeveralFiles)
def join(
    bias_log: Annotated[Path, typer.Argument(metavar="BIAS_LOG.csv", help="The bias sweep.")],
    spectra: Spectra,
    calibration: CalibrationOption = None,
    calibrate_from: CalibrateFrom = None,
    temperatures: Temperatures = None,
    reference: Reference = None,
    law: LawOption = "anharmonic",
    shape: ShapeOption = None,
    resolution: Resolution = None,
    laser_power: LaserPower = None,
    thermal_resistance: ThermalResistance = None,
    stress: Stress = 0.0,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="DATA.csv", help="Left out: print.")
    ] = None,
) -> None:
    """Join a bias log with tip spectra into the file that `hotlever fit` takes.

    A spectrum belongs to the row that names it in a 'file' column, or has the bias in its name
    (tip_5.25V.txt); else spectra and rows are paired in order.
    """
    log = joining.read_bias_log(bias_log)
    setup = _setup(
        calibration, calibrate_from, temperatures, reference, law, shape, resolution,
        laser_power, thermal_resistance, stress,
    )  # fmt: skip
    if setup.thermometer is None:
        raise InputError("join needs temperatures: give --calibration or --calibrate-from")
    _, rows = setup.measure(spectra)
    missing = [row.file for row in rows if row.temperature != row.temperature]
    if missing:
        note(f"no temperature from {', '.join(missing)}: empty cells")
    _put(joining.join(log, rows, str(bias_log)), output)


@app.command("raman-check", cls=SeveralFiles)
def raman_check(
    calibration: CalibrationOption = None,
    plot: Annotated[
        Path | None, typer.Option(metavar="FILE.png|.svg|.pdf", help="The check as a figure.")
    ] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="FILE.json", help="The numbers.")
    ] = None,
) -> None:
    """How far the paper's linear law is off above 900 K, and what that does to the knee."""
    law = None
    if calibration is not None and calibration != PUBLISHED:
        law = calibrations.load(calibration)
    check = paper_check(law)
    if plot is not None:
        from hotlever.raman import figures
        from hotlever.report.style import save_figure

        save_figure(figures.paper_check(check), plot)
    if output is not None:
        numbers = {
            "truth": check.calibration.source,
            "hottest_K": check.hottest,
            "lines": [asdict(result) for result in check.results],
            "conclusion": check.conclusion(),
        }
        write_text(output, json.dumps(numbers, indent=2, ensure_ascii=False) + "\n")
    print(check.conclusion())


class _Setup:
    """A thermometer as the command line asked for it, or none."""

    def __init__(
        self,
        options: PeakOptions,
        calibration: Calibration | None,
        thermometer: Thermometer | None,
        hot_plate: list[series.Line],
    ) -> None:
        self.options, self.calibration, self.thermometer = options, calibration, thermometer
        self.series = hot_plate

    def measure(self, paths: list[Path]) -> tuple[list[series.Line], list[series.Row]]:
        """Read and fit spectra; a folder's other files are noted, a missing line too."""
        lines = _lines(paths, self.options, "spectra")
        if all(line.peak is None for line in lines):
            raise InputError(
                f"{paths[0]}: no silicon line in {_count(lines)}, expected one near 520 cm⁻¹"
            )
        return lines, series.read_lines(lines, self.thermometer)


def _count(lines: list[series.Line]) -> str:
    return "this spectrum" if len(lines) == 1 else f"any of {len(lines)} spectra"


def _setup(
    calibration: str | None,
    calibrate_from: list[Path] | None,
    temperatures: Path | None,
    reference: list[Path] | None,
    law: str,
    shape: str | None,
    resolution: float | None,
    laser_power: float | None,
    thermal_resistance: float | None,
    stress: float,
) -> _Setup:
    if law not in LAWS:
        raise unknown_name("law", law, LAWS)
    if shape is not None and shape not in SHAPES:
        raise unknown_name("line shape", shape, SHAPES)
    if calibration is not None and calibrate_from:
        raise InputError("give --calibration or --calibrate-from, not both")
    if temperatures is not None and not calibrate_from:
        raise InputError("--temperatures belongs to --calibrate-from, which is missing")
    if (laser_power is None) != (thermal_resistance is None):
        raise InputError("--laser-power and --thermal-resistance belong together: give both")
    hot_plate: list[series.Line] = []
    chosen: Calibration | None = None
    if calibration == PUBLISHED:
        chosen = calibrations.published()
    elif calibration is not None:
        chosen = calibrations.load(calibration)
    options = _options(chosen, shape, resolution)
    if calibrate_from:
        table = series.read_temperatures(temperatures) if temperatures else None
        plate = _read(calibrate_from)
        with _progress("hot plate", len(plate)) as update:
            source = ", ".join(path.name or str(path) for path in calibrate_from)
            chosen, hot_plate = series.calibrate_from(plate, options, table, update, source)
        _describe(chosen)
    if chosen is None:
        if reference:
            raise InputError("--reference needs --calibration or --calibrate-from")
        return _Setup(options, None, None, [])
    if chosen.reference_cm is None and not reference:
        raise InputError(
            "--calibration published: give --reference, a spectrum of your instrument at room "
            "temperature, from which the shifts are taken"
        )
    heating = 0.0
    if laser_power is not None and thermal_resistance is not None:
        heating = laser_heating(laser_power, thermal_resistance)
        note(f"laser heating is estimated as {heating:.2g} K and enters the error")
    kind: Literal["linear", "anharmonic"] = "linear" if law == "linear" else "anharmonic"
    # a calibration without reference gets one below; 0 stands in until then
    start = 0.0 if chosen.reference_cm is None else None
    thermometer = Thermometer(chosen, kind, reference=start, laser_heating=heating, stress=stress)
    if reference:
        found = _lines(reference, options, "reference")
        pairs = [(line.peak, line.spectrum.temperature) for line in found if line.peak]
        thermometer = thermometer.with_reference(pairs)
    return _Setup(options, chosen, thermometer, hot_plate)


def _options(
    calibration: Calibration | None, shape: str | None, resolution: float | None
) -> PeakOptions:
    """The line shape asked for, else the calibration's: both sides must be fitted alike."""
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
    return PeakOptions(shape or "lorentzian", resolution).validate()  # type: ignore[arg-type]


def _describe(calibration: Calibration) -> None:
    """What the series gave, and plainly where the line is not good enough."""
    line, law = calibration.linear, calibration.anharmonic
    found = calibration.residuals()
    outside = abs(found["linear_K"]) > found["band_K"]
    low, high = calibration.range_K
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
    skipped: list[str] = []
    total = len(spectrum_files(paths))
    found: list[Spectrum] = []
    with _progress("reading", total) as update:
        for done, part in enumerate(iter_spectra(paths, skipped), start=1):
            found += part
            update(done, total)
    for line in skipped:
        note(f"passed over {line}")
    return found


def _lines(paths: list[Path], options: PeakOptions, label: str) -> list[series.Line]:
    spectra = _read(paths)
    with _progress(label, len(spectra)) as update:
        lines = series.measure(spectra, options, update)
    for line in lines:
        if line.peak is None and len(lines) > 1:
            note(f"{line.spectrum.name}: no silicon line")
    return lines


def _progress(label: str, spectra: int) -> AbstractContextManager[series.Progress]:
    """A bar where the work can take more than two seconds."""
    return progress(label) if spectra > _BAR_FROM else nullcontext(lambda done, total: None)


def _put(text: str, output: Path | None) -> None:
    if output is None:
        print(text, end="")
        return
    write_text(output, text)
    stderr.print(f"wrote {output}", markup=False)
