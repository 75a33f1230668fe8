"""How wave forms are written: ``4V``, ``10V,5us`` or ``3V+0.5V@20kHz``, each of some kind."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from hotlever.errors import InputError
from hotlever.lever.transient.waveform import Waveform, pulse, ramp, sine, step
from hotlever.units import bias_setting, setting

_MAKERS: dict[str, Callable[..., Waveform]] = {
    "step": step,
    "pulse": pulse,
    "ramp": ramp,
    "sine": sine,
}


def waveform_from_text(
    kind: str, text: str, period: str | None = None, count: int | None = None, mark: str = ""
) -> Waveform:
    """Return the wave form that a text stands for.

    Parameters
    ----------
    kind : str
        ``step``, ``pulse``, ``ramp`` or ``sine``.
    text : str
        Such as ``4V``, ``10V,5us`` (pulse and ramp) or ``3V+0.5V@20kHz``, whose offset may be left
        out.
    period : str, optional
        Of pulses that are repeated, such as ``100us``.
    count : int, optional
        Number of pulses; one if left out.
    mark : str
        What stands before the names of these in an error, such as that of options.

    Raises
    ------
    InputError
        If it stands for none, or a value is out of bounds.

    Examples
    --------
    >>> waveform_from_text("pulse", "10V,5us").text
    'pulse of 10 V for 5 µs'
    >>> waveform_from_text("sine", "2@1MHz").text
    '0 V + 2 V sine of 1e+06 Hz'
    """
    where, make = mark + kind, _MAKERS[kind]
    if kind == "step":
        values: list[Any] = [bias_setting(text, where)]
    elif kind == "sine":
        values = _sine(text, where)
    else:
        values = _volts_and_time(text, where)
    if kind == "pulse":
        each = None if period is None else setting(period, "us", f"{mark}period")
        values += [each, 1 if count is None else count]
    try:
        return make(*values)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None


def _volts_and_time(text: str, where: str) -> list[Any]:
    volts, comma, length = text.partition(",")
    if not comma:
        raise InputError(f"{where}: found '{text}', expected V,TIME such as 10V,5us")
    return [bias_setting(volts, where), setting(length, "us", where)]


def _sine(text: str, where: str) -> list[Any]:
    volts, at, frequency = text.partition("@")
    if not at:
        raise InputError(f"{where}: found '{text}', expected V+V@FREQ such as 3V+0.5V@20kHz")
    offset, _, amplitude = volts.rpartition("+")
    biases = [bias_setting(bias, where) for bias in (offset or "0", amplitude)]
    return [*biases, setting(frequency, "Hz", where)]
