"""Numbers, values by name, priors and times of pulses as they are typed."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, Any, get_args

from hotlever.errors import InputError, quoted, shown
from hotlever.units import NUMBER, setting

if TYPE_CHECKING:
    from hotlever.calibration.pulses import PulseTiming
    from hotlever.probe import Probe

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
    from hotlever.probe.file_sections import field_of

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
