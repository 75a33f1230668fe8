"""Numbers, ranges, values by name, priors and times of pulses as they are typed."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, Any, get_args

from hotlever.errors import InputError, quoted, shown
from hotlever.units import LEAST_BIAS, MOST_BIAS, NUMBER, setting

if TYPE_CHECKING:
    from hotlever.calibration.pulses import PulseTiming
    from hotlever.probe import Probe
    from hotlever.types import Array

#: A sweep of so many biases takes minutes, as does a design varied so often.
MOST_BIASES, MOST_DESIGNS = 10_000, 1000
MOST_FREQUENCIES, MOST_SET_POINTS = 10_000, 1000
#: Distances to a surface, of which each takes seconds, and between which they are (µm).
MOST_DISTANCES, NEAREST, FARTHEST = 1000, 0.001, 1e4
#: The paper's sweep.
_BIAS = "1:11:25"
#: Of priors: those of a calibration, where none is stated.
USUAL = "usual"


def parse_number(text: str, where: str) -> float:
    """Parse a finite number."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(f"{where}: found {quoted(text)}, expected a number")
    return value


def check_number(option: str, value: float | None, least: float, most: float) -> None:
    """Refuse a number out of bounds."""
    if value is not None and not least <= value <= most:
        # what is too long for a float is quoted as it stands
        text = f"{value:g}" if abs(value) < 1e300 else quoted(value)
        raise InputError(f"{option} {text}: expected a number from {least:g} to {most:g}")


def parse_pairs(
    option: str, texts: Iterable[str] | None, expected: str = "NAME=VALUE", bare: bool = False
) -> dict[str, str]:
    """Split ``NAME=VALUE`` pairs, or bare names (without a value) where these are allowed.

    Examples
    --------
    >>> parse_pairs("--fix", ["n_d=3.3e17", "p"], bare=True)
    {'n_d': '3.3e17', 'p': ''}
    """
    pairs: dict[str, str] = {}
    for text in texts or []:
        name, equals, value = (part.strip() for part in text.partition("="))
        if not (equals or bare) or (equals and bare and not value):
            raise InputError(f"{option} {shown(text)}: expected {expected}")
        if name in pairs:
            raise InputError(f"{option} {name}: given twice, expected once")
        pairs[name] = value
    return pairs


def parse_priors(texts: Sequence[str] | None, probe: Probe) -> dict[str, str] | None:
    """Split and check ``NAME=VALUE±SPREAD``; ``none`` alone is no prior at all, nothing is None.

    Examples
    --------
    >>> from hotlever import Probe
    >>> parse_priors(["thickness_um=0.40±0.02"], Probe.reference())
    {'thickness_um': '0.40±0.02'}
    """
    from hotlever.probe.priors import priors_of

    if not texts:
        return None
    if list(texts) == ["none"]:
        return {}
    expected = "NAME=VALUE±SPREAD, NAME=VALUE×/FACTOR, usual, or none alone"
    pairs = parse_pairs("--prior", [text for text in texts if text != USUAL], expected)
    priors_of(pairs, probe, "--prior")
    return pairs


def parse_settings(texts: Sequence[str] | None, probe: Probe) -> dict[str, Any]:
    """Parse ``NAME=VALUE`` for any key of a probe file: numbers, switches and words.

    A key may have its section before it, and ``none`` leaves out what a file may leave out.

    Examples
    --------
    >>> from hotlever import Probe
    >>> probe = Probe.reference()
    >>> parse_settings(["a0=9e-4", "chip=true", "medium=air", "tip.height_um=0.7"], probe)
    {'a0': 0.0009, 'chip': True, 'medium': 'air', 'tip.height_um': 0.7}
    """
    values: dict[str, Any] = {}
    keys = set[tuple[str, str]]()
    for name, text in parse_pairs("--set", texts).items():
        section, key, record = probe.field(name)
        if (section, key) in keys:
            raise InputError(f"--set {name}: given twice, expected once")
        keys.add((section, key))
        field = record.model_fields.get(key)
        # a key of another shape than the probe's is a dimension
        number = section == "probe" or section in probe.materials
        kind = field.annotation if field is not None else float if number else str
        values[name] = _as_kind(text, (kind, *get_args(kind)), f"--set {name}")
    return values


def _as_kind(text: str, kinds: tuple[Any, ...], where: str) -> Any:
    """Return a text as one of the kinds of value that a key of a probe file has."""
    from hotlever.materials.stated import StatedLaw

    if bool in kinds:
        if text not in ("true", "false"):
            raise InputError(f"{where}: found {quoted(text)}, expected true or false")
        return text == "true"
    if type(None) in kinds and text == "none":
        return None
    if any(text in get_args(kind) for kind in kinds):
        return text
    if StatedLaw in kinds and not NUMBER.fullmatch(text.strip()):
        return text.strip("\"'")  # a formula, or the name of a table's file
    return parse_number(text, where) if float in kinds else text.strip("\"'")


def parse_timing(text: str) -> PulseTiming:
    """Parse ``5us`` or ``5us,100us``.

    Examples
    --------
    >>> parse_timing("5us,0.1ms")
    PulseTiming(length_us=5.0, period_us=100.0)
    """
    from hotlever.calibration.pulses import PulseTiming

    length, comma, period = text.partition(",")
    each = setting(period, "us", "--pulse") if comma else None
    try:
        return PulseTiming(setting(length, "us", "--pulse"), each)
    except InputError as error:
        raise error if str(error).startswith("--") else InputError(f"--pulse: {error}") from None


def parse_setting(text: str, *, tip: bool = False) -> tuple[str, float]:
    """Parse a bias such as ``8V``, or a power such as ``2mW``, as a column and its value.

    With `tip` it may be a tip temperature too.

    Examples
    --------
    >>> parse_setting("8V"), parse_setting("500uW"), parse_setting("700K", tip=True)
    (('bias_V', 8.0), ('power_mW', 0.5), ('tip_K', 700.0))
    """
    temperature = [("tip_K", "K")] if tip else []
    for column, unit in (*temperature, ("bias_V", "V"), ("power_mW", "mW")):
        with suppress(InputError):
            return column, setting(text, unit, "--at", bare=unit == "V")
    also = ", or a tip temperature as 700K" if tip else ""
    raise InputError(
        f"--at: found {quoted(text)}, expected a bias such as 8V or a power as 2mW{also}"
    )


def parse_bounds(texts: Iterable[str] | None) -> dict[str, tuple[float | None, float | None]]:
    """Parse several ``NAME=LOW:HIGH``, of which one end may be left out.

    Examples
    --------
    >>> parse_bounds(["heater_width_um=1:3", "power_mW=:2.5"])
    {'heater_width_um': (1.0, 3.0), 'power_mW': (None, 2.5)}
    """
    bounds = dict[str, tuple[float | None, float | None]]()
    for name, text in parse_pairs("--within", texts, "NAME=LOW:HIGH").items():
        low, colon, high = text.partition(":")
        where = f"--within {name}"
        if not colon:
            raise InputError(f"{where}: found {quoted(text)}, expected LOW:HIGH, such as 1:3")
        ends = [parse_number(end, where) if end else None for end in (low, high)]
        bounds[name] = ends[0], ends[1]
    return bounds


# --- ranges: START:STOP:COUNT ---------------------------------------------------------------------


def parse_bias(text: str | None, lowest_V: float = 0.0) -> Array:
    """Parse ``START:STOP:COUNT`` in volts, ends included; ``1:11:25`` if there is none.

    Where the lowest bias that a lever is told of is negative, as with held supplies or
    thermoelectricity, the start may be negative.

    Examples
    --------
    >>> parse_bias("1:11:3").tolist()
    [1.0, 6.0, 11.0]
    """
    import numpy as np

    text = _BIAS if text is None else text
    where = f"--bias {shown(text)}"
    start, stop, count = _parse_range(text, where, "such as 1:11:25 (V)", MOST_BIASES)
    if start < lowest_V or stop < start:
        least = f"{lowest_V:g} <= " if np.isfinite(lowest_V) else ""
        polar = "; polarity counts with held supplies or --physics thermoelectric"
        why = polar if start < lowest_V else ""
        raise InputError(f"{where}: expected {least}START <= STOP{why}")
    if (count == 1) != (start == stop):
        raise InputError(f"{where}: COUNT 1 goes with START = STOP, more with START < STOP")
    biases = np.linspace(start, stop, count)
    if biases[biases > 0].min(initial=LEAST_BIAS) < LEAST_BIAS or stop > MOST_BIAS:
        raise InputError(
            f"{where}: expected biases of 0, or from {LEAST_BIAS:g} to {MOST_BIAS:g} V"
        )
    return biases


def parse_set_points(text: str, unit: str, where: str) -> Array:
    """Parse ``3kohm``, several with commas between, or ``START:STOP:COUNT``, in a unit.

    Examples
    --------
    >>> parse_set_points("2.5kohm,3kohm", "ohm", "--hold-resistance").tolist()
    [2500.0, 3000.0]
    >>> parse_set_points("1mW:2mW:3", "mW", "--hold-power").tolist()
    [1.0, 1.5, 2.0]
    """
    import numpy as np

    def value(part: str) -> float:
        number = setting(part, unit, where)
        if not 0.0 < number < math.inf:
            raise InputError(f"{where}: found '{shown(part)}', expected more than 0 {unit}")
        return number

    if ":" not in text:
        return np.array([value(part) for part in text.split(",")])
    example = "2kohm:3kohm:11" if unit == "ohm" else f"1{unit}:4{unit}:7"
    return np.linspace(*_parse_range(text, where, f"such as {example}", MOST_SET_POINTS, value))


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


def parse_band(text: str) -> tuple[float, float]:
    """Parse ``LOW:HIGH``, frequencies with units.

    Examples
    --------
    >>> parse_band("1Hz:1kHz")
    (1.0, 1000.0)
    """
    where = f"--bandwidth {shown(text)}"
    low, _, high = text.partition(":")
    band = setting(low, "Hz", where), setting(high, "Hz", where)
    if not 0 < band[0] < band[1]:
        raise InputError(f"{where}: expected LOW:HIGH, such as 1Hz:1kHz, with 0 < LOW < HIGH")
    return band


def parse_distances(text: str) -> Array:
    """Parse ``START:STOP:COUNT`` with units of length, ends included (µm).

    Examples
    --------
    >>> parse_distances("300nm:3um:4").round(6).tolist()
    [0.3, 1.2, 2.1, 3.0]
    """
    import numpy as np

    from hotlever.probe.contact import length_um

    where = f"--distance {shown(text)}"

    def end(part: str) -> float:
        length = length_um(part)
        if length is None or not NEAREST <= length <= FARTHEST:
            raise InputError(
                f"{where}: found {quoted(part)}, expected a length from {1e3 * NEAREST:g}nm to "
                f"{1e-4 * FARTHEST:g}cm, such as 300nm"
            )
        return length

    start, stop, count = _parse_range(text, where, "such as 0.3um:3um:10", MOST_DISTANCES, end)
    if stop < start or (count == 1) != (start == stop):
        raise InputError(f"{where}: expected START < STOP, or START = STOP with COUNT 1")
    return np.linspace(start, stop, count)


def parse_pressures(text: str) -> Array:
    """Parse ``START:STOP:COUNT`` in mbar, spaced evenly in the logarithm.

    Examples
    --------
    >>> parse_pressures("10:1000:3").round(6).tolist()
    [10.0, 100.0, 1000.0]
    """
    import numpy as np

    where = f"--pressure {shown(text)}"
    start, stop, count = _parse_range(text, where, "such as 10:1000:3 (mbar)", MOST_DISTANCES)
    if not 1e-6 <= start <= stop <= 1e6 or (count == 1) != (start == stop):
        raise InputError(
            f"{where}: expected 1e-6 <= START < STOP <= 1e6, or START = STOP with COUNT 1"
        )
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
