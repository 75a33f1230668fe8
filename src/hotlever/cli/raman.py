"""``hotlever raman``, ``hotlever join`` and ``hotlever raman-check``."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer.core
from typer import Argument, Option

from hotlever.cli import output as terminal
from hotlever.cli.commands import app
from hotlever.cli.options import File, with_groups
from hotlever.cli.output import give, note, tell
from hotlever.errors import InputError
from hotlever.files import FIGURE_TYPES, Outputs, json_text, write_text
from hotlever.tasks.files import draw

if TYPE_CHECKING:
    from hotlever.tasks.thermometry import Thermometry

CalibrationOption = Annotated[
    str | None,
    Option(
        metavar="CAL.json",
        help="A calibration that --save-calibration wrote, or 'published' for the published "
        "laws (then --reference is needed).",
    ),
]


@dataclass
class ThermometerOptions:
    """What `set_up` of `hotlever.tasks.thermometry` takes."""

    calibration: CalibrationOption = None
    calibrate_from: list[Path] | None = Option(
        None, metavar="FILE_OR_DIR...", help="Hot-plate spectra to calibrate from; one or more."
    )
    temperatures: File = Option(
        None,
        metavar="TABLE.csv",
        help="Hot-plate temperatures: file name, temperature. Left out: header or file name.",
    )
    corrections: File = Option(
        None,
        metavar="TABLE.csv",
        help="By hand: file, start_cm-1 of the line, from_cm-1 and to_cm-1 of what is fitted, use.",
    )
    reference: list[Path] | None = Option(
        None,
        metavar="FILE_OR_DIR",
        help="Spectrum at room temperature on the instrument as it is now; may be repeated.",
    )
    law: str = Option("anharmonic", metavar="linear|anharmonic", help="Calibration law.")
    shape: str | None = Option(
        None,
        metavar="lorentzian|voigt|fano",
        help="Line shape; left out: that of the calibration, else lorentzian.",
    )
    resolution: float | None = Option(
        None,
        metavar="CM-1",
        help="FWHM of the spectrometer's response, for voigt; left out: fitted.",
    )
    laser_power: float | None = Option(
        None, metavar="MW", help="Laser power on the lever, for its heating."
    )
    thermal_resistance: float | None = Option(
        None, metavar="K/MW", help="Thermal resistance of the lever, K per mW of heat."
    )
    stress: float = Option(
        0.0, metavar="MPA", help="Unknown stress in the silicon; enters the error."
    )

    @property
    def files(self) -> list[Path | str | None]:
        """The files that it reads."""
        several = [*(self.calibrate_from or []), *(self.reference or [])]
        return [*several, self.temperatures, self.calibration, self.corrections]

    def set_up(self) -> Thermometry:
        """Set the thermometer up; what is noticed goes to standard error."""
        from hotlever.tasks.thermometry import set_up

        return set_up(terminal, **vars(self))


class SeveralFiles(typer.core.TyperCommand):
    """A command whose ``--calibrate-from`` takes all paths up to the next option.

    Where that would leave no spectra to measure, it takes the first path only, so that
    ``hotlever raman --calibrate-from hot-plate/ tip/`` means what it says.
    """

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Repeat the option before each of its paths, then parse as usual."""
        options = [param for param in self.params if param.param_type_name == "option"]
        valued = [option for option in options if not getattr(option, "is_flag", False)]
        names = {name for option in valued for name in option.opts}
        return super().parse_args(ctx, spread_option(args, "--calibrate-from", names))


def spread_option(args: list[str], option: str, takes_value: set[str]) -> list[str]:
    """Turn ``--option a b`` into ``--option a --option b``.

    Examples
    --------
    >>> spread_option(["x", "--from", "a", "b", "-o", "c"], "--from", {"--from", "-o"})
    ['x', '--from', 'a', '--from', 'b', '-o', 'c']
    >>> spread_option(["--from", "a", "b"], "--from", {"--from"})
    ['--from', 'a', 'b']
    """
    # each option with its values, and each other word by itself
    parts: list[list[str]] = []
    words = deque(args)
    while words:
        word = words.popleft()
        name, equals, value = word.partition("=")
        part = [word]
        if name == option:
            part = [option, value] if equals else [option]
            while words and not words[0].startswith("-"):
                part.append(words.popleft())
        elif word.startswith("-") and word in takes_value and words:
            part.append(words.popleft())
        parts.append(part)
    groups = [part for part in parts if part[0] == option and len(part) > 1]
    if groups and all(part[0].startswith("-") for part in parts):
        # nothing is left to measure: what follows the first path of the last group
        last = groups[-1]
        parts.insert(parts.index(last) + 1, last[2:])
        del last[2:]
    out: list[str] = []
    for part in parts:
        if part in groups:
            out += [word for value in part[1:] for word in (option, value)]
        else:
            out += part
    return out


Spectra = Annotated[
    list[Path], Argument(metavar="FILE_OR_DIR...", help="Spectra, or folders of spectra.")
]


@app.command("raman", cls=SeveralFiles)
@with_groups
def raman_command(
    spectra: Spectra,
    thermometer: ThermometerOptions,
    save_calibration: File = Option(
        None, metavar="CAL.json", help="Write the calibration to this file."
    ),
    output: File = Option(None, "--output", "-o", metavar="FILE.csv", help="Left out: print."),
    plot: File = Option(
        None, metavar="FILE.png|.svg|.pdf", help="Figure of spectra and calibration."
    ),
) -> None:
    """Find the silicon line in Raman spectra and, calibrated, the temperature."""
    from hotlever.tasks.spectra import Files, measure_spectra

    outputs = Outputs(*spectra, *thermometer.files)
    outputs.file(plot, *FIGURE_TYPES)
    outputs.file(save_calibration)
    outputs.file(output)
    files = Files(output, plot, save_calibration)
    _answer(measure_spectra(thermometer.set_up(), spectra, outputs, files), output)


@app.command("join", cls=SeveralFiles)
@with_groups
def join_command(
    bias_log: Annotated[Path, Argument(metavar="BIAS_LOG.csv", help="The bias sweep.")],
    spectra: Spectra,
    thermometer: ThermometerOptions,
    output: File = Option(None, "--output", "-o", metavar="DATA.csv", help="Left out: print."),
) -> None:
    """Join a bias log with tip spectra into the file that `hotlever fit` takes.

    A spectrum belongs to the row that names it in a 'file' column, or has the bias in its name
    (tip_5.25V.txt); else spectra and rows are paired in order.
    """
    from hotlever.raman.bias_log import join, read_bias_log

    outputs = Outputs(bias_log, *spectra, *thermometer.files)
    outputs.file(output)
    log = read_bias_log(bias_log)
    setup = thermometer.set_up()
    if setup.thermometer is None:
        raise InputError("join needs temperatures: give --calibration or --calibrate-from")
    _, table = setup.measure(spectra)
    missing = table.file.values[table.temperature_K.isnull().values]
    if missing.size:
        note(f"no temperature from {', '.join(missing)}: empty cells")
    text = join(log, table)
    if output is not None:
        with outputs.together():
            write_text(output, text)
    _answer(text, output)


@app.command("raman-check")
def raman_check_command(
    calibration: CalibrationOption = None,
    plot: File = Option(None, metavar="FILE.png|.svg|.pdf", help="The check as a figure."),
    output: File = Option(None, "--output", "-o", metavar="FILE.json", help="The numbers."),
) -> None:
    """How far the paper's linear law is off above 900 K, and what that does to the knee."""
    from hotlever.studies.raman_check import conclusion, paper_check
    from hotlever.tasks.thermometry import calibration_named

    outputs = Outputs(calibration)
    outputs.file(plot, *FIGURE_TYPES)
    outputs.file(output)
    check = paper_check(calibration_named(calibration))
    said = conclusion(check)
    with outputs.together():
        draw(plot, lambda figures: figures.raman_check(check))
        if output is not None:
            lines = check.drop_dims("temperature_K").to_dataframe().rename_axis("name")
            numbers = {"truth": check.truth, "hottest_K": check.hottest_K}
            numbers |= {"lines": lines.reset_index().to_dict("records"), "conclusion": said}
            write_text(output, json_text(numbers))
    give(f"{said}\n")


def _answer(text: str, output: Path | None) -> None:
    """Give the result, or say where it was written."""
    if output is None:
        give(text)
    else:
        tell(f"wrote {output}")
