"""Numbers, values by name, priors and times of pulses as they are typed."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, get_args

from hotlever.errors import InputError, quoted, shown
from hotlever.units import setting

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
        kind = field.annotation if field is not None else float if section == "probe" else str
        values[name] = _as_kind(text, (kind, *get_args(kind)), f"--set {name}")
    return values


def _as_kind(text: str, kinds: tuple[Any, ...], where: str) -> Any:
    """Return a text as one of the kinds of value that a key of a probe file has."""
    if bool in kinds:
        if text not in ("true", "false"):
            raise InputError(f"{where}: found {quoted(text)}, expected true or false")
        return text == "true"
    if type(None) in kinds and text == "none":
        return None
    if any(text in get_args(kind) for kind in kinds):
        return text
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
