"""Numbers and tables as text, for terminals, notebooks and pages."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Sequence

#: What is written of a quantity whose error says that it may be anything.
NOT_DETERMINED = "not determined"
#: Standard errors that 95 % of a normal distribution lie within.
BAND = 1.96


def value_with_error(
    value: float,
    stderr: float | None,
    scale: float = 1.0,
    bounds: tuple[float, float] = (0.0, math.inf),
) -> str:
    """Return a value with its standard error in the last digits, such as ``0.686(5)``.

    Two digits of the value are written at least, and all before the decimal point. Where the error
    is no smaller than the value, the ends of the 95 % interval are written that are within what the
    quantity may be; that it is not determined, if none is.

    Parameters
    ----------
    value : float
    stderr : float or None
        None or 0 of what is exact, which stands alone; NaN if it is not known: three digits then.
    scale : float
        The unit, of its own, that the quantity is written in.
    bounds : tuple of float
        What the quantity may be at all; most are positive. Without a highest value, an end at ten
        times the value tells nothing.

    Examples
    --------
    >>> value_with_error(0.6862, 0.0049)
    '0.686(5)'
    >>> value_with_error(5.75e17, None, 1e17)
    '5.75'
    >>> value_with_error(771.3, 28.0), value_with_error(897.24, 1.31)
    ('771(28)', '897.2(1.3)')
    >>> value_with_error(1.9e17, 2.1e17), value_with_error(0.02, 0.07, bounds=(-1.0, 1.0))
    ('below 6.0e17', '-0.12 to 0.16')
    >>> value_with_error(0.719, 300.0)
    'not determined'
    """
    if not stderr or not math.isfinite(value):
        return f"{value / scale:.6g}"
    if math.isnan(stderr):
        return f"{value / scale:.3g}"
    if stderr >= abs(value):
        return _interval(value, stderr, scale, bounds)
    value, error = value / scale, stderr / scale
    if _has_power(value):
        power = math.floor(math.log10(abs(value)))
        return f"{value_with_error(value / 10.0**power, error / 10.0**power)}e{power}"
    # one digit of the error, two where the first is a 1, and two of the value
    first = f"{error:.1e}"
    finest = int(first[4:]) - (first[0] == "1")
    digits = max(0, -min(finest, math.floor(math.log10(abs(value))) - 1))
    last = f"{error:.{digits}f}" if error >= 1.0 else f"{error * 10.0**digits:.0f}"
    return f"{value:.{digits}f}({last})"


def _has_power(value: float) -> bool:
    """Whether a number is written with a power of ten."""
    return not 1e-4 <= abs(value) < 1e5


def _interval(value: float, stderr: float, scale: float, bounds: tuple[float, float]) -> str:
    """Return what 95 % lie between, where an error is larger than its value."""
    low, high = value - BAND * stderr, value + BAND * stderr
    told_low, told_high = low > bounds[0], high < bounds[1]
    if told_low and told_high:
        return f"{significant(low / scale)} to {significant(high / scale)}"
    if told_high and (math.isfinite(bounds[1]) or high < 10.0 * value):
        return f"below {significant(high / scale)}"
    if told_low:
        return f"above {significant(low / scale)}"
    return NOT_DETERMINED


def significant(value: float) -> str:
    """Return a number to two digits, or all before the decimal point.

    Examples
    --------
    >>> significant(0.01234), significant(4.0), significant(123.4), significant(4e17)
    ('0.012', '4.0', '123', '4.0e17')
    """
    rounded = f"{value:.1e}"
    mantissa, _, power = rounded.partition("e")
    if value and _has_power(float(rounded)):
        return f"{mantissa}e{int(power)}"
    return f"{value:.{max(0, 1 - int(power))}f}"


def listed(words: Iterable[object]) -> str:
    """Return words with commas and an "and".

    Examples
    --------
    >>> listed(["a", "b", "c"]), listed(["a"])
    ('a, b and c', 'a')
    """
    *first, last = map(str, words)
    return f"{', '.join(first)} and {last}" if first else last


def with_unit(text: str, unit: str) -> str:
    """Return the text of a value with its unit, of which a pure number has none.

    Examples
    --------
    >>> with_unit("5", "mA"), with_unit("1", "1")
    ('5 mA', '1')
    """
    return text if unit in ("", "1") else f"{text} {unit}"


def aligned(rows: Sequence[Sequence[str]], right: bool = False) -> list[str]:
    """Return rows of cells as lines, each column as wide as its widest cell.

    Examples
    --------
    >>> aligned([["p", "2.65"], ["n_d", "5.75"]])
    ['p    2.65', 'n_d  5.75']
    """
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    adjust = str.rjust if right else str.ljust
    return ["  ".join(map(adjust, row, widths)).rstrip() for row in rows]


def as_toml(value: object) -> str:
    """Return a text, a truth, a number or a list as TOML writes it; long lists on several lines.

    Examples
    --------
    >>> as_toml("1/0"), as_toml(((0.0, -1.5), (0.0, 1.5))), as_toml(True)
    ('"1/0"', '[[0.0, -1.5], [0.0, 1.5]]', 'true')
    """
    # JSON writes all of these as TOML does
    text = json.dumps(value, ensure_ascii=False)
    if len(text) <= 100 or not isinstance(value, list | tuple):
        return text
    inner = ",\n".join(as_toml(entry) for entry in value)
    return f"[\n{inner},\n]"
