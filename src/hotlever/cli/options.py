"""Options that several commands have, and what their texts are parsed into.

Options that belong together are the fields of a dataclass, which a command takes as an argument
(`with_groups`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, is_dataclass
from inspect import Signature, signature
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, get_args

from typer import Argument, Option

from hotlever.cli import output as terminal
from hotlever.errors import InputError, quoted, shown
from hotlever.files import FIGURE_TYPES, Outputs
from hotlever.tasks.probes import read_probe
from hotlever.tasks.texts import parse_number
from hotlever.units import LEAST_BIAS, MOST_BIAS, setting

if TYPE_CHECKING:
    from hotlever.lever.transient import Waveform
    from hotlever.probe import Circuit, Probe
    from hotlever.types import Array

#: A sweep of so many biases takes minutes, as does a design varied so often.
MOST_BIASES, MOST_DESIGNS = 10_000, 1000
MOST_FREQUENCIES = 10_000

File = Path | None
ProbeFile = Annotated[
    File, Argument(metavar="[PROBE.toml]", help="Probe file; the reference probe if left out.")
]
PlotFile = Annotated[File, Option("--plot", help="Draw to this file: .png, .svg or .pdf.")]
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


# --- groups of options ----------------------------------------------------------------------------


@dataclass
class LeverOptions:
    """A lever to solve: its probe, with some values changed, and the medium around it."""

    probe_file: ProbeFile = None
    medium: str | None = Option(None, help="vacuum or air; what the files say if left out.")
    settings: list[str] | None = Option(
        None, "--set", metavar="NAME=VALUE", help="Change a value of the probe file."
    )

    def probe(self) -> Probe:
        """Read the probe; what should be known of its shape is told."""
        check_medium(self.medium)
        probe = read_probe(terminal, self.probe_file, self.settings)
        return probe if self.medium is None else probe.in_medium(self.medium)


@dataclass
class TableOptions:
    """The files of a computed table, and of its figure."""

    output: File = Option(
        None, "-o", "--output", help="FILE.csv or FILE.nc; standard output if left out."
    )
    plot: PlotFile = None

    def outputs(self, *inputs: Path | None) -> Outputs:
        """Check these files, which are none of the inputs."""
        outputs = Outputs(*inputs)
        outputs.file(self.output, ".csv", ".nc")
        outputs.file(self.plot, *FIGURE_TYPES)
        return outputs


@dataclass
class Drive:
    """At most one wave form: as a text of some kind, or a table."""

    step: str | None = Option(None, metavar="V", help="Switch the bias on, and leave it.")
    pulse: str | None = Option(None, metavar="V,TIME", help="A pulse, such as 10V,5us.")
    period: str | None = Option(None, metavar="TIME", help="Of pulses that are repeated.")
    count: int | None = Option(None, metavar="N", help="Number of pulses.")
    ramp: str | None = Option(None, metavar="V,TIME", help="Raise the bias, such as 8V,50us.")
    sine: str | None = Option(None, metavar="V+V@FREQ", help="Such as 3V+0.5V@20kHz.")
    waveform: File = Option(None, help="A table of times and biases, such as a supply takes.")

    #: Those of which each is a wave form; that of a table comes last.
    _kinds: ClassVar = ("--step", "--pulse", "--ramp", "--sine", "--waveform")

    @property
    def options(self) -> dict[str, Any]:
        """Those that are given, by name."""
        return {f"--{name}": value for name, value in vars(self).items() if value is not None}

    def required(self) -> Waveform:
        """Return the wave form as `read` does, or raise that there is none."""
        waveform = self.read()
        if waveform is None:
            raise InputError(f"found none: expected one of {', '.join(self._kinds)}")
        return waveform

    def read(self) -> Waveform | None:
        """Return the one wave form that is asked for; None if none is."""
        from hotlever.lever.transient import read_waveform
        from hotlever.lever.transient.waveform_texts import waveform_from_text

        names = [name for name in self._kinds if name in self.options]
        if len(names) > 1:
            raise InputError(f"found {', '.join(names)}: expected one of {', '.join(self._kinds)}")
        for name in ("--period", "--count"):
            if name in self.options and self.pulse is None:
                raise InputError(f"{name}: goes with --pulse")
        if self.waveform is not None:
            return read_waveform(self.waveform)
        for name in names:
            text, kind = self.options[name], name.removeprefix("--")
            return waveform_from_text(kind, text, self.period, self.count, mark="--")
        return None


# --- checks ---------------------------------------------------------------------------------------


def check_medium(medium: str | None, *more: str) -> None:
    """Refuse a medium that does not exist."""
    from hotlever.probe.surroundings import Medium

    media = *get_args(Medium), *more
    if medium is not None and medium not in media:
        raise InputError(f"--medium {shown(medium)}: expected {' or '.join(media)}")


def check_number(option: str, value: float | None, least: float, most: float) -> None:
    """Refuse a number out of bounds."""
    if value is not None and not least <= value <= most:
        # what is too long for a float is quoted as it stands
        text = f"{value:g}" if abs(value) < 1e300 else quoted(value)
        raise InputError(f"{option} {text}: expected a number from {least:g} to {most:g}")


def column_files(columns: list[str] | None) -> list[Path]:
    """Return the files among the values of ``--column``."""
    return [Path(text) for text in columns or [] if "=" not in text]


# --- ranges: START:STOP:COUNT ---------------------------------------------------------------------


def parse_bias(text: str, circuit: Circuit | None = None) -> Array:
    """Parse ``START:STOP:COUNT`` in volts, ends included.

    With held supplies in the circuit the start may be negative.

    Examples
    --------
    >>> parse_bias("1:11:3").tolist()
    [1.0, 6.0, 11.0]
    """
    import numpy as np

    where = f"--bias {shown(text)}"
    start, stop, count = _parse_range(text, where, "such as 1:11:25 (V)", MOST_BIASES)
    signed = circuit is not None and not circuit.starts_cold
    if (start < 0 and not signed) or stop < start:
        raise InputError(f"{where}: expected {'' if signed else '0 <= '}START <= STOP")
    if (count == 1) != (start == stop):
        raise InputError(f"{where}: COUNT 1 goes with START = STOP, more with START < STOP")
    biases = np.linspace(start, stop, count)
    if biases[biases > 0].min(initial=LEAST_BIAS) < LEAST_BIAS or stop > MOST_BIAS:
        raise InputError(
            f"{where}: expected biases of 0, or from {LEAST_BIAS:g} to {MOST_BIAS:g} V"
        )
    return biases


def parse_frequencies(text: str) -> Array:
    """Parse ``START:STOP:COUNT`` with units, spaced evenly in the logarithm.

    Examples
    --------
    >>> parse_frequencies("1Hz:1kHz:4").round(6).tolist()
    [1.0, 10.0, 100.0, 1000.0]
    """
    import numpy as np

    where = f"--frequency {shown(text)}"
    start, stop, count = _parse_range(
        text, where, "such as 1Hz:10MHz:71", MOST_FREQUENCIES, lambda end: setting(end, "Hz", where)
    )
    if not 0 < start <= stop or (count == 1) != (start == stop):
        raise InputError(f"{where}: expected 0 < START < STOP, or START = STOP with COUNT 1")
    return np.geomspace(start, stop, count)


def parse_vary(text: str) -> tuple[str, Array]:
    """Parse ``NAME=START:STOP:COUNT``, ends included.

    Examples
    --------
    >>> name, values = parse_vary("heater_length_um=3:6:4")
    >>> name, values.tolist()
    ('heater_length_um', [3.0, 4.0, 5.0, 6.0])
    """
    import numpy as np

    where, example = f"--vary {shown(text)}", "such as heater_length_um=3:6:7"
    name, equals, numbers = text.partition("=")
    if not equals:
        raise InputError(f"{where}: expected NAME=START:STOP:COUNT, {example}")
    start, stop, count = _parse_range(numbers, where, example, MOST_DESIGNS)
    if count < 2 or start == stop:
        raise InputError(f"{where}: expected two values or more, {example}")
    return name.strip(), np.linspace(start, stop, count)


def _parse_range(
    text: str, where: str, example: str, most: int, end: Callable[[str], float] | None = None
) -> tuple[float, float, int]:
    """Parse ``START:STOP:COUNT``; the ends are numbers unless parsed in another way."""
    parts = text.split(":")
    if len(parts) != 3:
        raise InputError(f"{where}: expected START:STOP:COUNT, {example}")
    start, stop = (end(part) if end else parse_number(part, where) for part in parts[:2])
    # a number of more digits than the limit has is too large without being read
    readable = parts[2].isdecimal() and len(parts[2]) <= len(str(most))
    if not readable or not 1 <= int(parts[2]) <= most:
        raise InputError(
            f"{where}: COUNT is {quoted(parts[2])}, expected a whole number from 1 to {most}"
        )
    return start, stop, int(parts[2])
