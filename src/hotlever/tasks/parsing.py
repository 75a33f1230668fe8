"""What is typed: numbers, values by name, priors, times of pulses, and ranges of values.

A range is ``START:STOP:COUNT``, ends included, or a single value.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_args, get_origin

from hotlever.errors import InputError, excerpt, quoted, unknown_name
from hotlever.units import NUMBER, bias_setting, setting

if TYPE_CHECKING:
    from hotlever.estimate.tip_table import PulseTiming
    from hotlever.probe import Probe
    from hotlever.types import Array


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
            raise InputError(f"{option} {excerpt(text)}: expected {expected}")
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
    pairs = parse_pairs("--prior", [text for text in texts if text != "usual"], expected)
    for name in [name for name in pairs if probe.shape.named(name) != name]:
        full = probe.shape.named(name)
        if full in pairs:
            raise InputError(f"--prior {name}: expected {full} alone, it is the same")
        pairs[full] = pairs.pop(name)
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
    from hotlever.probe.probe import field_of

    values: dict[str, Any] = {}
    keys = set[tuple[str, str]]()
    for name, text in parse_pairs("--set", texts).items():
        section, key, record = field_of(probe, name)
        if (section, key) in keys:
            raise InputError(f"--set {name}: given twice, expected once")
        keys.add((section, key))
        field = record.model_fields.get(key)
        # a key of another shape than the probe's is a dimension
        number = section == "probe" or section in probe.materials
        kind = field.annotation if field is not None else float if number else str
        # of a number with bounds the first is what it is
        one_of = get_args(kind)
        kinds = [get_args(one)[0] if get_origin(one) is Annotated else one for one in one_of]
        values[name] = _as_kind(text, (kind, *kinds), f"--set {name}")
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
    if float not in kinds:
        return text.strip("\"'")
    words = [str(word) for kind in kinds if get_origin(kind) is Literal for word in get_args(kind)]
    if words and not NUMBER.fullmatch(text.strip()):
        raise InputError(
            f"{where}: found {quoted(text)}, expected a number or {' or '.join(words)}"
        )
    return parse_number(text, where)


def parse_timing(text: str) -> PulseTiming:
    """Parse ``5us`` or ``5us,100us``.

    Examples
    --------
    >>> parse_timing("5us,0.1ms")
    PulseTiming(length_us=5.0, period_us=100.0)
    """
    from hotlever.estimate.tip_table import PulseTiming

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


def parse_times(until: str | None, at: str | None) -> tuple[float | None, list[float] | None]:
    """Parse when to stop, and the times to report with commas between (µs), if they are stated.

    Examples
    --------
    >>> parse_times("1ms", "5us,20us"), parse_times(None, None)
    ((1000.0, [5.0, 20.0]), (None, None))
    """
    end = None if until is None else setting(until, "us", "--until")
    times = None if at is None else [setting(time, "us", "--at") for time in at.split(",")]
    if times is not None and len(times) > 10_000:
        raise InputError(f"--at: found {len(times)} times, expected at most 10000")
    return end, times


# --- what to measure next -----------------------------------------------------------------------


def parse_temperature(text: str | None, option: str) -> float | None:
    """Parse ``800K``, if it is stated."""
    if text is None:
        return None
    kelvins = setting(text, "K", option)
    check_number(option, kelvins, 1.0, 5000.0)
    return kelvins


def parse_kinds(text: str | None, most: int = 100) -> dict[str, int | None] | None:
    """Parse ``bias,spectra`` or ``bias=15,spectra=3``: kinds of measurement, at most so many.

    Of one kind there may be `most` at most.

    Examples
    --------
    >>> parse_kinds("bias,spectra=3")
    {'bias': None, 'spectra': 3}
    """
    if text is None:
        return None
    kinds = dict[str, int | None]()
    expected = "KIND,... or KIND=COUNT,..., such as bias,spectra=3"
    for name, number in parse_pairs("--allow", text.split(","), expected, bare=True).items():
        if number and not (number.isdecimal() and 1 <= int(number[:9]) <= most):
            raise InputError(
                f"--allow {excerpt(name)}: found {quoted(number)}, expected a whole number from 1 "
                f"to {most}"
            )
        kinds[name] = int(number) if number else None
    return kinds


def parse_costs(texts: Iterable[str] | None, kinds: Sequence[str]) -> dict[str, float]:
    """Parse several ``KIND=TIME``, such as ``spectra=10min``, in minutes.

    Examples
    --------
    >>> parse_costs(["spectra=10min", "bias=30s"], ["bias", "spectra"])
    {'spectra': 10.0, 'bias': 0.5}
    """
    costs, expected = dict[str, float](), "KIND=TIME, such as spectra=10min"
    for name, text in parse_pairs("--cost", texts, expected).items():
        where = f"--cost {excerpt(name)}"
        if name not in kinds:
            raise unknown_name("kind of measurement", name, kinds, "--cost")
        number, minutes = text.rstrip("hminsec "), 0.0
        with suppress(InputError):
            unit = {"s": 1.0 / 60.0, "min": 1.0, "h": 60.0}.get(text[len(number) :].strip(), 0.0)
            minutes = unit * parse_number(number, where)
        if not 0.0 < minutes < math.inf:
            raise InputError(f"{where}: found {quoted(text)}, expected a time such as 30s or 10min")
        costs[name] = minutes
    missing = [kind for kind in kinds if kind not in costs]
    if costs and missing:
        raise InputError(f"--cost: found none of {', '.join(missing)}, expected one of each kind")
    return costs


def parse_noise(texts: Iterable[str] | None) -> dict[str, float]:
    """Parse several ``NAME=SHARE``, such as ``current=0.2%``, of observables or dimensions.

    Examples
    --------
    >>> parse_noise(["current=0.2%", "tip=1%"])
    {'current': 0.002, 'tip': 0.01}
    """
    from hotlever.quantities import OBSERVABLES

    noise, expected = dict[str, float](), "NAME=SHARE, such as current=0.2%"
    names = (*OBSERVABLES, "dimensions")
    for name, text in parse_pairs("--noise", texts, expected).items():
        if name not in names:
            raise unknown_name("observable", name, names, "--noise")
        where = f"--noise {name}"
        share = parse_number(text.removesuffix("%"), where) / 100.0 if text.endswith("%") else 0.0
        if not 1e-6 <= share <= 0.5:
            raise InputError(f"{where}: found {quoted(text)}, expected a share from 1e-4% to 50%")
        noise[name] = share
    return noise


# --- ranges -------------------------------------------------------------------------------------


def parse_bias(text: str | None, lowest_V: float = 0.0) -> Array:
    """Parse a range of biases in volts; ``1:11:25`` if there is none.

    Where the lowest bias that a lever is told of is negative, as with held supplies or
    thermoelectricity, the start may be negative.

    Examples
    --------
    >>> parse_bias("1:11:3").tolist(), parse_bias("8V").tolist()
    ([1.0, 6.0, 11.0], [8.0])
    """
    text = "1:11:25" if text is None else text  # the paper's sweep
    where = f"--bias {excerpt(text)}"
    biases = _values(text, where, "1:11:25 (V)", 10_000, bias_setting)
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

    value_of = partial(_positive, unit)
    if ":" not in text:
        return np.array([value_of(part, where) for part in text.split(",")])
    example = "2kohm:3kohm:11" if unit == "ohm" else f"1{unit}:4{unit}:7"
    return _values(text, where, example, 1000, value_of)


def parse_frequencies(text: str) -> Array:
    """Parse a range of frequencies with units, spaced evenly in the logarithm.

    Examples
    --------
    >>> parse_frequencies("1Hz:1kHz:4").round(6).tolist()
    [1.0, 10.0, 100.0, 1000.0]
    """
    hertz = partial(_positive, "Hz")
    where = f"--frequency {excerpt(text)}"
    return _values(text, where, "1Hz:10MHz:71", 10_000, hertz, even=False)


def parse_distances(text: str) -> Array:
    """Parse a range of distances with units of length (µm).

    Examples
    --------
    >>> parse_distances("300nm:3um:4").round(6).tolist()
    [0.3, 1.2, 2.1, 3.0]
    """
    return _values(text, f"--distance {excerpt(text)}", "0.3um:3um:10", 1000, _distance)


def parse_pressures(text: str) -> Array:
    """Parse a range of pressures in mbar, spaced evenly in the logarithm.

    Examples
    --------
    >>> parse_pressures("10:1000:3").round(6).tolist()
    [10.0, 100.0, 1000.0]
    """
    where, example = f"--pressure {excerpt(text)}", "10:1000:3 (mbar)"
    return _values(text, where, example, 1000, _pressure, even=False)


def parse_varied(texts: Iterable[str], most: int = 1000) -> dict[str, Array]:
    """Parse several ``NAME=START:STOP:COUNT``, of which each value goes with each other.

    More than the `most` designs would take hours.

    Examples
    --------
    >>> varied = parse_varied(["n_d=1e17:5e17:3", "heater_length_um=3:6:2"])
    >>> {name: values.tolist() for name, values in varied.items()}
    {'n_d': [1e+17, 3e+17, 5e+17], 'heater_length_um': [3.0, 6.0]}
    """
    varied: dict[str, Array] = {}
    for text in texts:
        where, example = f"--vary {excerpt(text)}", "heater_length_um=3:6:7"
        name, equals, numbers = text.partition("=")
        if not equals:
            raise InputError(f"{where}: expected NAME=START:STOP:COUNT, such as {example}")
        values = _values(numbers, where, example, most, parse_number)
        if values.size < 2:
            raise InputError(f"{where}: expected two values or more, such as {example}")
        if name.strip() in varied:
            raise InputError(f"--vary {excerpt(name.strip())}: given twice, expected once")
        varied[name.strip()] = values
    count = math.prod(values.size for values in varied.values())
    if count > most:
        raise InputError(f"--vary: found {count} designs, expected at most {most}")
    return varied


def _values(
    text: str,
    where: str,
    example: str,
    most: int,
    value_of: Callable[[str, str], float],
    *,
    even: bool = True,
) -> Array:
    """Parse ``START:STOP:COUNT`` or a single value, spaced evenly or so in the logarithm."""
    import numpy as np

    start, *others = text.split(":")
    if not others:
        return np.array([value_of(start, where)])
    if len(others) != 2:
        raise InputError(f"{where}: expected START:STOP:COUNT, such as {example}, or a value")
    low, high, count = value_of(start, where), value_of(others[0], where), others[1]
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


def _positive(unit: str, text: str, where: str) -> float:
    value = setting(text, unit, where)
    if not 0.0 < value < math.inf:
        raise InputError(f"{where}: found {quoted(text)}, expected more than 0")
    return value


def _distance(text: str, where: str) -> float:
    length = setting(text, "um", where)
    if not 0.001 <= length <= 1e4:
        raise InputError(
            f"{where}: found {quoted(text)}, expected a length from 1nm to 1cm, such as 300nm"
        )
    return length


def _pressure(text: str, where: str) -> float:
    value = parse_number(text, where)
    if not 1e-6 <= value <= 1e6:
        raise InputError(f"{where}: found {quoted(text)}, expected 1e-6 to 1e6 mbar")
    return value
