"""The wave form that a command line asks for."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from typer import Option

from hotlever.cli.options import File, parse_volts
from hotlever.errors import InputError
from hotlever.units import setting

if TYPE_CHECKING:
    from hotlever.lever.transient import Waveform

#: Options of which each is a wave form; that of a table comes last.
KINDS = ("--step", "--pulse", "--ramp", "--sine", "--waveform")


def drive(
    step: str | None = Option(None, metavar="V", help="Switch the bias on, and leave it."),
    pulse: str | None = Option(None, metavar="V,TIME", help="A pulse, such as 10V,5us."),
    period: str | None = Option(None, metavar="TIME", help="Of pulses that are repeated."),
    count: int | None = Option(None, metavar="N", help="Number of pulses."),
    ramp: str | None = Option(None, metavar="V,TIME", help="Raise the bias, such as 8V,50us."),
    sine: str | None = Option(None, metavar="V+V@FREQ", help="Such as 3V+0.5V@20kHz."),
    waveform: File = Option(None, help="A table of times and biases, such as a supply takes."),
) -> Any:
    """Make the one wave form that is asked for; None if none is."""
    from hotlever.lever import transient

    texts = dict(zip(KINDS, (step, pulse, ramp, sine), strict=False))
    repeated: dict[str, str | int | None] = {"--period": period, "--count": count}
    given = {name: text for name, text in texts.items() if text is not None}
    names = [*given, *["--waveform"] * (waveform is not None)]
    if len(names) > 1:
        raise InputError(f"found {', '.join(names)}: expected one of {', '.join(KINDS)}")
    alone = [name for name, value in repeated.items() if value is not None]
    if alone and "--pulse" not in given:
        raise InputError(f"{alone[0]}: goes with --pulse")
    if waveform is not None:
        return transient.read_waveform(waveform)
    if not given:
        return None
    ((name, text),) = given.items()
    try:
        if name == "--step":
            return transient.step(parse_volts(text, name))
        if name == "--sine":
            return transient.sine(*_sine(text))
        if name == "--ramp":
            return transient.ramp(*_volts_and_time(text, name))
        return pulses(text, period, 1 if count is None else count)
    except InputError as error:
        raise error if str(error).startswith("--") else InputError(f"{name}: {error}") from None


def pulses(text: str, period: str | None = None, count: int = 1) -> Waveform:
    """Parse ``10V,5us``, and the time after which the next pulse begins."""
    from hotlever.lever import transient

    each = None if period is None else setting(period, "us", "--period")
    return transient.pulse(*_volts_and_time(text, "--pulse"), each, count)


def options_given(driven: partial[Any]) -> dict[str, Any]:
    """Return the options of a wave form that are there, by name."""
    return {f"--{name}": one for name, one in driven.keywords.items() if one is not None}


def table_of(driven: partial[Any]) -> Path | None:
    """Return the table that a wave form is read from, if it is."""
    found: Path | None = driven.keywords["waveform"]
    return found


def _volts_and_time(text: str, where: str) -> tuple[float, float]:
    """Parse ``10V,5us``.

    Examples
    --------
    >>> _volts_and_time("10V,5us", "--pulse")
    (10.0, 5.0)
    """
    volts, comma, length = text.partition(",")
    if not comma:
        raise InputError(f"{where}: found '{text}', expected V,TIME such as 10V,5us")
    return parse_volts(volts, where), setting(length, "us", where)


def _sine(text: str) -> tuple[float, float, float]:
    """Parse ``3V+0.5V@20kHz``; the offset may be left out.

    Examples
    --------
    >>> _sine("3V+0.5V@20kHz"), _sine("2@1MHz")
    ((3.0, 0.5, 20000.0), (0.0, 2.0, 1000000.0))
    """
    volts, at, frequency = text.partition("@")
    if not at:
        raise InputError(f"--sine: found '{text}', expected V+V@FREQ such as 3V+0.5V@20kHz")
    offset, _, amplitude = volts.rpartition("+")
    biases = [parse_volts(one, "--sine") for one in (offset or "0", amplitude)]
    return biases[0], biases[1], setting(frequency, "Hz", "--sine")
