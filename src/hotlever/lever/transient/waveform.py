"""Wave forms: a bias that changes in time, smooth between its corners.

Times are in µs and begin at zero; before, the lever rests at the wave form's `before_V`.
"""

from __future__ import annotations

import math
import os
import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np

from hotlever.errors import InputError, counted, excerpt
from hotlever.tables import read_table
from hotlever.types import Array
from hotlever.units import MOST_BIAS, bias_setting, name_and_unit, setting

#: The longest time (µs) that a wave form may have.
LONGEST = 1e12
#: What a wave form is simulated for beyond its last corner (µs), if nobody says.
_AFTERWARDS = 100.0
#: After a step it takes so long (µs) until next to nothing changes.
_SETTLING = 1000.0


@dataclass(frozen=True)
class Piece:
    """A smooth part of a wave form.

    Attributes
    ----------
    start, end : float
        µs.
    bias : callable
        V_b (V) at a time (µs).
    jumps : bool
        Whether the bias jumps at its start.
    longest : float
        The longest time (µs) over which it may be taken to be smooth.
    """

    start: float
    end: float
    bias: Callable[[float], float]
    jumps: bool = False
    longest: float = math.inf


class Waveform(ABC):
    """A bias that changes in time: `step`, `pulse`, `ramp`, `sine` or from `read_waveform`.

    Attributes
    ----------
    text : str
        What it is, in words.
    before_V : float
        Bias (V) at which the lever rests before it begins.
    usual_end : float
        Time (µs) for which it is simulated if nobody says.
    period : float or None
        Of pulses that are repeated (µs),
    count : int
        and how many there are.
    """

    text: str
    before_V: float
    usual_end: float
    period: float | None = None
    count: int = 1

    @property
    @abstractmethod
    def highest_V(self) -> float:
        """Largest bias (V) of either sign."""

    @abstractmethod
    def pieces(self, until: float) -> Iterator[Piece]:
        """Give the smooth parts up to a time (µs)."""

    def bias(self, times: Array) -> Array:
        """Return the bias (V) at times (µs, rising); where it jumps that before, but at 0."""
        volts = np.full(times.shape, self.before_V)
        for piece in self.pieces(math.inf):
            if piece.start > times[-1]:
                break
            behind = times > piece.start if piece.start > 0.0 else times >= 0.0
            here = behind & (times <= piece.end)
            volts[here] = [piece.bias(t) for t in times[here].tolist()]
        return volts


@dataclass(frozen=True)
class Polyline(Waveform):
    """Straight lines between times (µs) and biases (V); a time given twice is a jump."""

    text: str
    times: tuple[float, ...]
    volts: tuple[float, ...]
    usual_end: float
    before_V: float = 0.0
    period: float | None = None
    count: int = 1

    @property
    def highest_V(self) -> float:
        """Largest bias (V) of either sign."""
        return max(map(abs, (self.before_V, *self.volts)))

    def pieces(self, until: float) -> Iterator[Piece]:
        """Give the smooth parts up to a time (µs); after the last corner the bias stays."""
        last = self.before_V
        for (start, low), (end, high) in pairwise(
            [*zip(self.times, self.volts, strict=True), (math.inf, self.volts[-1])]
        ):
            if start >= until:
                return
            if end > start:
                line = partial(_on_a_line, start, low, (high - low) / (end - start))
                yield Piece(start, min(end, until), line, low != last)
                last = high


def _on_a_line(start: float, volts: float, slope: float, t: float) -> float:
    return volts + slope * (t - start)


@dataclass(frozen=True)
class Sine(Waveform):
    """An offset and a sine (V) of some frequency (Hz), from rest at the offset."""

    text: str
    before_V: float
    amplitude_V: float
    frequency_Hz: float

    @property
    def highest_V(self) -> float:
        """Largest bias (V) of either sign."""
        return abs(self.before_V) + abs(self.amplitude_V)

    @property
    def usual_end(self) -> float:  # type: ignore[override]
        """Ten periods (µs)."""
        return 10 * 1e6 / self.frequency_Hz

    def pieces(self, until: float) -> Iterator[Piece]:
        """Give the one smooth part up to a time (µs)."""
        per_us = 2e-6 * math.pi * self.frequency_Hz

        def bias(t: float) -> float:
            return self.before_V + self.amplitude_V * math.sin(per_us * t)

        # so many steps per period that no part of the sine is overlooked
        yield Piece(0.0, until, bias, longest=1e6 / self.frequency_Hz / 20)


def step(volts: float) -> Waveform:
    """Return a bias that is switched on at t = 0 and stays."""
    check_bias(volts)
    return Polyline(f"step to {volts:g} V", (0.0,), (volts,), _SETTLING)


def switched_off(volts: float) -> Waveform:
    """Return a bias at which the lever has come to rest, and that is switched off at t = 0."""
    check_bias(volts)
    return Polyline(f"{volts:g} V switched off", (0.0,), (0.0,), _SETTLING, volts)


def pulse(volts: float, length: float, period: float | None = None, count: int = 1) -> Waveform:
    """Return a rectangular pulse of some length (µs), or several, one each period (µs).

    Raises
    ------
    InputError
        If a value is out of bounds, or the period not longer than the pulse.

    Examples
    --------
    >>> [(piece.start, piece.end, piece.bias(5.0)) for piece in pulse(10.0, 5.0).pieces(20.0)]
    [(0.0, 5.0, 10.0), (5.0, 20.0, 0.0)]
    """
    check_bias(volts, length)
    if not 1 <= count <= 100_000:
        raise InputError(f"found {count} pulses, expected from 1 to 100000")
    text = f"pulse of {volts:g} V for {length:g} µs"
    if period is None:
        if count > 1:
            raise InputError(f"found {count} pulses without a period, expected a period too")
        period = length + _AFTERWARDS
    elif not length < period <= LONGEST:
        raise InputError(
            f"found a period of {period:g} µs, expected more than the {length:g} µs of the pulse"
        )
    else:
        text += f" each {period:g} µs, {counted(count, 'time')}"
    starts = period * np.arange(count)
    times = np.stack([starts, starts + length, starts + length, starts + period], axis=1)
    volt = np.tile([volts, volts, 0.0, 0.0], count)
    end = max(float(times[-1, -1]), float(times[-1, 1]) + _AFTERWARDS)
    corners = tuple(times.ravel().tolist()), tuple(volt.tolist())
    return Polyline(text, *corners, end, period=period, count=count)


def ramp(volts: float, length: float) -> Waveform:
    """Return a bias that rises from zero within some time (µs) and stays."""
    check_bias(volts, length)
    text = f"ramp to {volts:g} V within {length:g} µs"
    return Polyline(text, (0.0, length), (0.0, volts), length + _AFTERWARDS)


def sine(offset: float, amplitude: float, frequency_Hz: float) -> Waveform:
    """Return a sine about an offset (V), at which the lever rests before."""
    check_bias(offset)
    check_bias(amplitude)
    if not 1e6 / LONGEST <= frequency_Hz <= 1e12:
        raise InputError(f"found a frequency of {frequency_Hz:g} Hz, expected 1e-6 to 1e12 Hz")
    text = f"{offset:g} V + {amplitude:g} V sine of {frequency_Hz:g} Hz"
    return Sine(text, offset, amplitude, frequency_Hz)


def check_bias(volts: float, length: float = 1.0) -> None:
    """Refuse a bias (V) or a time (µs) out of bounds."""
    if not abs(volts) <= MOST_BIAS:
        raise InputError(f"found a bias of {volts:g} V, expected at most {MOST_BIAS:g} V")
    if not 1e-6 <= length <= LONGEST:
        raise InputError(f"found a time of {length:g} µs, expected from 1e-6 to {LONGEST:g} µs")


def read_waveform(path: str | os.PathLike[str]) -> Waveform:
    """Read a wave form from a table of times and biases, with straight lines between its rows.

    A time given twice is a jump. The lever rests at the first bias before the first row, and the
    last one stays.

    Raises
    ------
    InputError
        If a column is missing or stands twice, has no known unit, or the times fall or begin before
        0.
    """
    expected = "a header row like 'time (us),bias (V)'"
    table = read_table(path, expected)
    names = [name_and_unit(heading)[0] for heading in table.names]
    columns = []
    for pattern, inside, what in (("t|time", "us", "time"), ("V|V_?b|bias|voltage", "V", "bias")):
        found = [k for k, name in enumerate(names) if re.fullmatch(pattern, name, re.I)]
        if len(found) != 1:
            header = excerpt(",".join(table.names))
            raise InputError(
                f"{table.where(-1)}: {len(found) or 'no'} {what} column{'s' if found else ''} in "
                f"'{header}', expected {expected}"
            )
        columns.append(table.values(found[0], inside, what))
    times, volts = columns
    for wrong, requirement in (
        (~np.isfinite(times + volts), "a time and a bias"),
        (np.abs(volts) > MOST_BIAS, f"a bias of at most {MOST_BIAS:g} V"),
        (times < 0.0, "a time from 0 on, where a wave form begins"),
        (np.diff(times, prepend=0.0) < 0, "a time not before the last"),
    ):
        if wrong.any():
            raise InputError(f"{table.where(int(wrong.argmax()))}: expected {requirement}")
    if times[-1] > LONGEST:
        raise InputError(f"{path}: lasts until {times[-1]:g} µs, expected at most {LONGEST:g} µs")
    name = os.path.basename(os.fspath(path))
    end = float(times[-1]) or _SETTLING
    if times[0] > 0.0:
        times, volts = np.append(0.0, times), np.append(volts[0], volts)
    points = tuple(times.tolist()), tuple(volts.tolist())
    return Polyline(f"wave form of {name}", *points, end, float(volts[0]))


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
    makers: dict[str, Callable[..., Waveform]] = {
        "step": step,
        "pulse": pulse,
        "ramp": ramp,
        "sine": sine,
    }
    where = mark + kind
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
        return makers[kind](*values)
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
