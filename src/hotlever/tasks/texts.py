"""Numbers, values by name, priors and times of pulses as they are typed."""

from __future__ import annotations

import math
from collections.abc import Sequence
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


def parse_values(
    option: str, settings: Sequence[str] | None, bare: bool = False
) -> dict[str, float | None]:
    """Parse ``NAME=VALUE`` pairs, or bare names where these are allowed.

    Examples
    --------
    >>> parse_values("--fix", ["n_d=3.3e17", "p"], bare=True)
    {'n_d': 3.3e+17, 'p': None}
    """
    values: dict[str, float | None] = {}
    for one in settings or []:
        name, equals, value = (part.strip() for part in one.partition("="))
        if not (equals or bare):
            raise InputError(f"{option} {one}: expected NAME=VALUE")
        if name in values:
            raise InputError(f"{option} {name}: given twice, expected once")
        values[name] = parse_number(value, f"{option} {name}") if equals else None
    return values


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
    texts = [text for text in texts if text != USUAL]
    pairs: dict[str, str] = {}
    for text in texts:
        name, equals, value = (part.strip() for part in text.partition("="))
        if not equals:
            raise InputError(
                f"--prior {shown(text)}: expected NAME=VALUE±SPREAD, "
                "NAME=VALUE×/FACTOR, usual, or none alone"
            )
        if name in pairs:
            raise InputError(f"--prior {name}: given twice, expected once")
        pairs[name] = value
    priors_of(pairs, probe, "--prior")
    return pairs


def parse_settings(settings: Sequence[str] | None, probe: Probe) -> dict[str, Any]:
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
    for one in settings or []:
        name, equals, text = (part.strip() for part in one.partition("="))
        where = f"--set {name}"
        if not equals:
            raise InputError(f"--set {one}: expected NAME=VALUE")
        section, key, record = probe.field(name)
        if any(probe.field(other)[:2] == (section, key) for other in values):
            raise InputError(f"{where}: given twice, expected once")
        field = record.model_fields.get(key)
        kinds = () if field is None else (field.annotation, *get_args(field.annotation))
        if bool in kinds:
            if text not in ("true", "false"):
                raise InputError(f"{where}: found {quoted(text)}, expected true or false")
            values[name] = text == "true"
        elif type(None) in kinds and text == "none":
            values[name] = None
        elif any(text in get_args(kind) for kind in kinds):
            values[name] = text
        elif float in kinds or (field is None and section == "probe"):
            values[name] = parse_number(text, where)
        else:
            values[name] = text.strip("\"'")
    return values


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
