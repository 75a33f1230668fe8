"""Ranges of values as they are typed: ``START:STOP:COUNT``, ends included, or a single value."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING

from hotlever.errors import InputError, quoted, shown
from hotlever.tasks.texts import parse_number
from hotlever.units import bias_setting, setting

if TYPE_CHECKING:
    from hotlever.types import Array

#: A sweep of so many biases takes minutes, as does a design varied so often.
MOST_BIASES, MOST_DESIGNS = 10_000, 1000
MOST_FREQUENCIES, MOST_SET_POINTS = 10_000, 1000
#: Distances to a surface, of which each takes seconds, and between which they are (µm).
MOST_DISTANCES, NEAREST, FARTHEST = 1000, 0.001, 1e4
#: The paper's sweep.
_BIAS = "1:11:25"


def parse_bias(text: str | None, lowest_V: float = 0.0) -> Array:
    """Parse a range of biases in volts; ``1:11:25`` if there is none.

    Where the lowest bias that a lever is told of is negative, as with held supplies or
    thermoelectricity, the start may be negative.

    Examples
    --------
    >>> parse_bias("1:11:3").tolist(), parse_bias("8V").tolist()
    ([1.0, 6.0, 11.0], [8.0])
    """
    text = _BIAS if text is None else text
    where = f"--bias {shown(text)}"

    def volts(part: str) -> float:
        return bias_setting(part, where)

    biases = _values(text, where, "1:11:25 (V)", MOST_BIASES, volts)
    # between two ends of either sign there are smaller ones
    bias_setting(str(min((abs(bias) for bias in biases.tolist() if bias), default=0.0)), where)
    if biases[0] < lowest_V:
        why = "polarity counts with held supplies or --physics thermoelectric"
        raise InputError(f"{where}: expected {lowest_V:g} <= START <= STOP; {why}")
    return biases


def parse_set_points(text: str, unit: str, where: str) -> Array:
    """Parse ``3kohm``, several with commas between, or a range, in a unit.

    Examples
    --------
    >>> parse_set_points("2.5kohm,3kohm", "ohm", "--hold-resistance").tolist()
    [2500.0, 3000.0]
    >>> parse_set_points("1mW:2mW:3", "mW", "--hold-power").tolist()
    [1.0, 1.5, 2.0]
    """
    import numpy as np

    def value(part: str) -> float:
        return _positive(setting(part, unit, where), part, where)

    if ":" not in text:
        return np.array([value(part) for part in text.split(",")])
    example = "2kohm:3kohm:11" if unit == "ohm" else f"1{unit}:4{unit}:7"
    return _values(text, where, example, MOST_SET_POINTS, value)


def parse_frequencies(text: str) -> Array:
    """Parse a range of frequencies with units, spaced evenly in the logarithm.

    Examples
    --------
    >>> parse_frequencies("1Hz:1kHz:4").round(6).tolist()
    [1.0, 10.0, 100.0, 1000.0]
    """
    where = f"--frequency {shown(text)}"

    def hertz(part: str) -> float:
        return _positive(setting(part, "Hz", where), part, where)

    return _values(text, where, "1Hz:10MHz:71", MOST_FREQUENCIES, hertz, even=False)


def parse_distances(text: str) -> Array:
    """Parse a range of distances with units of length (µm).

    Examples
    --------
    >>> parse_distances("300nm:3um:4").round(6).tolist()
    [0.3, 1.2, 2.1, 3.0]
    """
    from hotlever.probe.tip import length_um

    where = f"--distance {shown(text)}"

    def distance(part: str) -> float:
        length = length_um(part)
        if length is None or not NEAREST <= length <= FARTHEST:
            raise InputError(
                f"{where}: found {quoted(part)}, expected a length from {1e3 * NEAREST:g}nm to "
                f"{1e-4 * FARTHEST:g}cm, such as 300nm"
            )
        return length

    return _values(text, where, "0.3um:3um:10", MOST_DISTANCES, distance)


def parse_pressures(text: str) -> Array:
    """Parse a range of pressures in mbar, spaced evenly in the logarithm.

    Examples
    --------
    >>> parse_pressures("10:1000:3").round(6).tolist()
    [10.0, 100.0, 1000.0]
    """
    where = f"--pressure {shown(text)}"

    def pressure(part: str) -> float:
        value = parse_number(part, where)
        if not 1e-6 <= value <= 1e6:
            raise InputError(f"{where}: found {quoted(part)}, expected 1e-6 to 1e6 mbar")
        return value

    return _values(text, where, "10:1000:3 (mbar)", MOST_DISTANCES, pressure, even=False)


def parse_vary(text: str) -> tuple[str, Array]:
    """Parse ``NAME=START:STOP:COUNT``.

    Examples
    --------
    >>> name, values = parse_vary("heater_length_um=3:6:4")
    >>> name, values.tolist()
    ('heater_length_um', [3.0, 4.0, 5.0, 6.0])
    """
    where, example = f"--vary {shown(text)}", "heater_length_um=3:6:7"
    name, equals, numbers = text.partition("=")
    if not equals:
        raise InputError(f"{where}: expected NAME=START:STOP:COUNT, such as {example}")
    values = _values(numbers, where, example, MOST_DESIGNS, lambda part: parse_number(part, where))
    if values.size < 2:
        raise InputError(f"{where}: expected two values or more, such as {example}")
    return name.strip(), values


def parse_varied(texts: Iterable[str]) -> dict[str, Array]:
    """Parse several ``NAME=START:STOP:COUNT``, of which each value goes with each other.

    Examples
    --------
    >>> {name: values.size for name, values in parse_varied(["n_d=1e17:5e17:3", "p=2:3:2"]).items()}
    {'n_d': 3, 'p': 2}
    """
    varied: dict[str, Array] = {}
    for text in texts:
        name, values = parse_vary(text)
        if name in varied:
            raise InputError(f"--vary {shown(name)}: given twice, expected once")
        varied[name] = values
    count = math.prod(values.size for values in varied.values())
    if count > MOST_DESIGNS:
        raise InputError(f"--vary: found {count} designs, expected at most {MOST_DESIGNS}")
    return varied


def _positive(value: float, text: str, where: str) -> float:
    if not 0.0 < value < math.inf:
        raise InputError(f"{where}: found {quoted(text)}, expected more than 0")
    return value


def _values(
    text: str,
    where: str,
    example: str,
    most: int,
    value_of: Callable[[str], float],
    *,
    even: bool = True,
) -> Array:
    """Parse ``START:STOP:COUNT`` or a single value, spaced evenly or so in the logarithm."""
    import numpy as np

    start, *others = text.split(":")
    if not others:
        return np.array([value_of(start)])
    if len(others) != 2:
        raise InputError(f"{where}: expected START:STOP:COUNT, such as {example}, or a value")
    low, high, count = value_of(start), value_of(others[0]), others[1]
    # a number of more digits than the limit has is too large without being read
    readable = count.isdecimal() and len(count) <= len(str(most))
    if not readable or not 1 <= int(count) <= most:
        raise InputError(
            f"{where}: COUNT is {quoted(count)}, expected a whole number from 1 to {most}"
        )
    if high < low or (int(count) == 1) != (low == high):
        raise InputError(f"{where}: expected START < STOP, or START = STOP with COUNT 1")
    if not even:
        return np.geomspace(low, high, int(count))
    values = np.linspace(low, high, int(count))
    # from -0.3 to 0.3 the middle would be 6e-17
    return np.where(np.abs(values) < 1e-9 * (high - low), 0.0, values)
