"""What command-line options are parsed into."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import is_dataclass
from inspect import Signature, signature
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_args

from typer import Argument, Option

from hotlever.cli.output import note, progress
from hotlever.errors import InputError, quoted, shown
from hotlever.files import Outputs
from hotlever.tasks.texts import parse_number, parse_settings
from hotlever.units import LEAST_BIAS, MOST_BIAS

if TYPE_CHECKING:
    from hotlever.lever import Lever
    from hotlever.probe import Circuit, Probe
    from hotlever.types import Array

#: A sweep of so many biases takes minutes, as does a design varied so often.
MOST_BIASES, MOST_DESIGNS = 10_000, 1000

File = Path | None
ProbeFile = Annotated[
    File, Argument(metavar="[PROBE.toml]", help="Probe file; the reference probe if left out.")
]
PlotFile = Annotated[File, Option("--plot", help="Draw to this file: .png, .svg or .pdf.")]
SweepPlot = Annotated[
    File, Option("--plot", help="Draw the sweep to this file: .png, .svg or .pdf.")
]
ColumnOption = Annotated[
    list[str] | None,
    Option(
        "--column",
        metavar="'QUANTITY (UNIT)=NAME'",
        help="Which column of the data is which quantity, as 'I_h (uA)=Current' or by its number; "
        "or a file of such lines; repeated.",
    ),
]
PriorOption = Annotated[
    list[str] | None,
    Option(
        "--prior",
        metavar="NAME=VALUE±SPREAD",
        help="What is known beforehand, as n_d=3.3e17±15%, n_d=1e17×/3 (to a factor), "
        "dimensions=±2%, usual (what a calibration takes) or none; repeated.",
    ),
]
SettingsOption = Annotated[
    list[str] | None,
    Option("--set", metavar="NAME=VALUE", help="Change a value of the probe file."),
]
DataOutput = Annotated[
    File, Option("-o", "--output", help="FILE.csv or FILE.nc; standard output if left out.")
]
MediumOption = Annotated[str | None, Option(help="vacuum or air; what the files say if left out.")]
MeasuredMediumOption = Annotated[
    str | None,
    Option(help="vacuum, air or unknown (both are tried); what the files say if left out."),
]


def with_groups(command: Callable[..., None]) -> Callable[..., None]:
    """Let a command take a dataclass as an argument, whose fields are options of the command."""
    arguments = signature(command, eval_str=True).parameters
    types = {name: argument.annotation for name, argument in arguments.items()}
    groups: dict[str, type] = {
        name: kind for name, kind in types.items() if isinstance(kind, type) and is_dataclass(kind)
    }
    fields = {name: signature(kind, eval_str=True).parameters for name, kind in groups.items()}

    def run(**values: Any) -> None:
        for name, group in groups.items():
            values[name] = group(**{field: values.pop(field) for field in fields[name]})
        command(**values)

    options = [
        option
        for name, argument in arguments.items()
        for option in (fields[name].values() if name in groups else [argument])
    ]
    run.__signature__ = Signature(options)  # type: ignore[attr-defined]
    run.__annotations__ = {option.name: option.annotation for option in options}
    run.__doc__ = command.__doc__
    return run


def load_probe(
    path: Path | None, settings: list[str] | None = None, medium: str | None = None
) -> Probe:
    """Read a probe file, or take the reference probe, and change some of its values.

    What should be known of its shape is told.
    """
    from hotlever.probe import Probe

    probe = Probe.reference() if path is None else Probe.from_file(path)
    probe = probe.with_(**parse_settings(settings, probe)) if settings else probe
    note(*probe.shape.notes())
    return probe if medium is None else probe.in_medium(medium)


def make_lever(probe: Probe) -> Lever:
    """Mesh a probe, and make the air around it."""
    from hotlever.lever import Lever

    with progress("air") as update:
        return Lever(probe, progress=update)


def check_plot(outputs: Outputs, plot: Path | None) -> None:
    """Check that a figure can be written, if one is asked for."""
    if plot is not None:
        from hotlever.figures import FIGURE_TYPES

        outputs.file(plot, *FIGURE_TYPES)


def check_medium(medium: str | None, *more: str) -> None:
    """Refuse a medium that does not exist."""
    from hotlever.probe.surroundings import Medium

    known = *get_args(Medium), *more
    if medium is not None and medium not in known:
        raise InputError(f"--medium {shown(medium)}: expected {' or '.join(known)}")


def column_files(columns: list[str] | None) -> list[Path]:
    """Return the files among the values of ``--column``."""
    return [Path(text) for text in columns or [] if "=" not in text]


def parse_bias(text: str, circuit: Circuit | None = None) -> Array:
    """Parse ``START:STOP:COUNT`` in volts, ends included.

    With held supplies in the circuit the start may be negative.

    Examples
    --------
    >>> parse_bias("1:11:3").tolist()
    [1.0, 6.0, 11.0]
    """
    where = f"--bias {shown(text)}"
    start, stop, biases = _parse_range(text, where, "such as 1:11:25 (V)", MOST_BIASES)
    signed = circuit is not None and not circuit.starts_cold
    if (start < 0 and not signed) or stop < start:
        raise InputError(f"{where}: expected {'' if signed else '0 <= '}START <= STOP")
    if (biases.size == 1) != (start == stop):
        raise InputError(f"{where}: COUNT 1 goes with START = STOP, more with START < STOP")
    if biases[biases > 0].min(initial=LEAST_BIAS) < LEAST_BIAS or stop > MOST_BIAS:
        raise InputError(
            f"{where}: expected biases of 0, or from {LEAST_BIAS:g} to {MOST_BIAS:g} V"
        )
    return biases


def parse_vary(text: str) -> tuple[str, Array]:
    """Parse ``NAME=START:STOP:COUNT``, ends included.

    Examples
    --------
    >>> name, values = parse_vary("heater_length_um=3:6:4")
    >>> name, values.tolist()
    ('heater_length_um', [3.0, 4.0, 5.0, 6.0])
    """
    where, example = f"--vary {shown(text)}", "such as heater_length_um=3:6:7"
    name, equals, numbers = text.partition("=")
    if not equals:
        raise InputError(f"{where}: expected NAME=START:STOP:COUNT, {example}")
    start, stop, values = _parse_range(numbers, where, example, MOST_DESIGNS)
    if values.size < 2 or start == stop:
        raise InputError(f"{where}: expected two values or more, {example}")
    return name.strip(), values


def _parse_range(text: str, where: str, example: str, most: int) -> tuple[float, float, Array]:
    import numpy as np

    parts = text.split(":")
    if len(parts) != 3:
        raise InputError(f"{where}: expected START:STOP:COUNT, {example}")
    start, stop = parse_number(parts[0], where), parse_number(parts[1], where)
    # a number of more digits than the limit has is too large without being read
    readable = parts[2].isdecimal() and len(parts[2]) <= len(str(most))
    if not readable or not 1 <= int(parts[2]) <= most:
        raise InputError(
            f"{where}: COUNT is {quoted(parts[2])}, expected a whole number from 1 to {most}"
        )
    return start, stop, np.linspace(start, stop, int(parts[2]))


def check_number(option: str, value: float | None, least: float, most: float) -> None:
    """Refuse a number out of bounds."""
    if value is not None and not least <= value <= most:
        # what is too long for a float is quoted as it stands
        found = f"{value:g}" if abs(value) < 1e300 else quoted(value)
        raise InputError(f"{option} {found}: expected a number from {least:g} to {most:g}")
