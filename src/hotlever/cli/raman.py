"""``hotlever raman``, ``hotlever join`` and ``hotlever raman-check``."""

from __future__ import annotations

from collections import deque
from dataclasses import MISSING, dataclass
from pathlib import Path
from typing import Any

import typer.core

from hotlever.cli import output as terminal
from hotlever.cli.options import command
from hotlever.cli.output import give, note, tell
from hotlever.errors import InputError
from hotlever.files import FIGURE_TYPES, Outputs, json_text, write_text
from hotlever.tasks.files import draw
from hotlever.tasks.measured_requests import (
    RamanRequest,
    ThermometerRequest,
    calibration_option,
    spectra_argument,
)
from hotlever.tasks.requests import File, argument, option


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


@command("raman", RamanRequest, cls=SeveralFiles)
def raman_command(request: RamanRequest) -> None:
    """Find the silicon line in Raman spectra and, calibrated, the temperature."""
    from hotlever.tasks.spectra import measure_spectra

    _answer(measure_spectra(terminal, request), request.output)


@dataclass(kw_only=True)
class JoinRequest(ThermometerRequest):
    """One measurement file of a bias log and spectra."""

    bias_log: Path = argument(MISSING, metavar="BIAS_LOG.csv", help="The bias sweep.")
    spectra: list[Path] = spectra_argument()
    output: File = option(None, "--output", "-o", metavar="DATA.csv", help="Left out: print.")


@command("join", JoinRequest, cls=SeveralFiles)
def join_command(request: JoinRequest) -> None:
    """Join a bias log with tip spectra into the file that `hotlever fit` takes.

    A spectrum belongs to the row that names it in a 'file' column, or has the bias in its name
    (tip_5.25V.txt); else spectra and rows are paired in order.
    """
    from hotlever.raman.bias_log import join, read_bias_log
    from hotlever.tasks.thermometry import set_up

    bias_log, spectra, output = request.bias_log, request.spectra, request.output
    outputs = Outputs(bias_log, *spectra, *request.files)
    outputs.file(output, ".csv")
    log = read_bias_log(bias_log)
    setup = set_up(terminal, request)
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


@dataclass(kw_only=True)
class CheckRequest:
    """The Raman law above 900 K."""

    calibration: str | None = calibration_option()
    plot: File = option(None, metavar="FILE.png|.svg|.pdf", help="The check as a figure.")
    output: File = option(None, "--output", "-o", metavar="FILE.json", help="The numbers.")


@command("raman-check", CheckRequest)
def raman_check_command(request: CheckRequest) -> None:
    """How far the paper's linear law is off above 900 K, and what that does to the knee."""
    from hotlever.studies.raman_check import conclusion, paper_check
    from hotlever.tasks.thermometry import calibration_named

    calibration, plot, output = request.calibration, request.plot, request.output
    outputs = Outputs(calibration)
    outputs.file(plot, *FIGURE_TYPES)
    outputs.file(output, ".json")
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
