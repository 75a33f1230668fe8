"""How priors are written, in the section ``[prior]`` of a probe file or on the command line.

A value with a spread in its unit, ``0.40 ± 0.02``; with a share, ``3.3e17 ± 15%``; or with a
factor, ``1e17 ×/ 3``. Without a value, ``± 5%`` or ``×/ 3``, it is about the probe's own. ``+-``
stands for ``±``, ``x/`` and ``*/`` for ``×/``. A share is a standard deviation of the logarithm,
and so is the logarithm of a factor.
"""

from __future__ import annotations

import math
import re
from typing import Literal

from pydantic import ConfigDict

from hotlever.errors import InputError
from hotlever.records import Record

#: How a spread is written: in the parameter's unit, as a share of its value, or as a factor.
Written = Literal["unit", "share", "factor"]
_SPREAD = re.compile(r"([^±]{0,40})±([^±]{1,40})")
_FACTOR = re.compile(r"([^/]{0,40})[×xX*] ?/([^/]{1,40})")
_LARGEST_FACTOR = 1000.0


class PriorTexts(Record):
    """What is known of a lever beforehand (section ``[prior]`` of a probe file), as text."""

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, str]

    @property
    def by_name(self) -> dict[str, str]:
        """The text for each parameter."""
        return self.model_extra or {}


def parsed(text: str, where: str) -> tuple[float | None, float, Written]:
    """Return value (None for the probe's own), spread, and how that is written.

    The spread of a factor is its logarithm.

    Raises
    ------
    InputError
        If it is no prior; `where` names it.

    Examples
    --------
    >>> parsed("0.40 ± 0.02", "here"), parsed("± 5%", "here")
    ((0.4, 0.02, 'unit'), (None, 0.05, 'share'))
    """
    wrong = InputError(
        f"{where} = '{text[:60]}', expected a value and its spread such as '3.3e17 ± 15%', "
        "'0.40 ± 0.02', '± 5%' or '1e17 ×/ 3'"
    )
    plain = text.replace("+-", "±").replace("+/-", "±")
    written: Written = "unit"
    if (match := _FACTOR.fullmatch(plain)) is not None:
        written = "factor"
    elif (match := _SPREAD.fullmatch(plain)) is None:
        raise wrong
    first, second = (part.strip() for part in match.groups())
    if written == "unit" and second.endswith("%"):
        written, second = "share", second.removesuffix("%")
    try:
        value = float(first) if first else None
        spread = float(second)
    except ValueError:
        raise wrong from None
    if value is not None and not math.isfinite(value):
        raise wrong
    if written == "factor":
        if not 1.0 < spread <= _LARGEST_FACTOR:
            raise InputError(
                f"{where} = '{text[:60]}': a factor of {spread:g}, expected one above 1 and at "
                f"most {_LARGEST_FACTOR:g}"
            )
        return value, math.log(spread), written
    if not 0 < spread < math.inf:
        raise wrong
    return value, spread / (100.0 if written == "share" else 1.0), written
