"""A curve and a pulse of a lever, and files of them: what the styles of instruments share."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

BIAS = np.linspace(0.4, 10.0, 25)  # V
LEVER_KOHM = 2.0 + 3.0 * (BIAS / 10.0) ** 2
CURRENT = BIAS / (5.6 + LEVER_KOHM)  # mA
LEVER = LEVER_KOHM * CURRENT  # V
READER = 0.42 * LEVER  # V
TIP = 293.0 + 60.0 * LEVER * CURRENT  # K
AMPS, SECONDS, COUNT = CURRENT / 1e3, np.arange(25.0), np.arange(1.0, 26.0)

#: A pulse of 5 V, and the lever's voltage on its way.
TIME = np.arange(-4.0, 20.5, 0.5)  # µs
PULSE = np.where(TIME > 0.0, 5.0, 0.0)
ANSWER = np.where(TIME > 0.0, 2.0 - 0.5 * np.exp(-np.abs(TIME) / 4.0), 0.0)
AFTER = TIME > 0.0


class InstrumentFile(NamedTuple):
    """A file, the columns to tell where they are asked for, and what it holds."""

    style: str
    name: str
    text: str
    columns: dict[str, str]  #: that a question is answered with
    in_time: bool = False
    driven: bool = False  #: by a step that is told beside the file, which has only the answer
    encoding: str = "utf-8"


def rows(*columns, sep=",", comma=False, form="{:.7g}", start="", last="", end="\n"):
    """Text of columns of numbers or of words."""
    lines = []
    for row in zip(*columns, strict=True):
        cells = [cell if isinstance(cell, str) else form.format(cell) for cell in row]
        cells = [cell.replace(".", ",") if comma else cell for cell in cells]
        lines.append(start + sep.join(cells) + last)
    return end.join(lines) + end


def same_text(text: str) -> list[str]:
    """A column of one text."""
    return [text] * 25


def instrument_file(style, name, text, columns=None, in_time=False, driven=False, encoding="utf-8"):
    """Return a file; read as it is unless it has columns to tell."""
    return InstrumentFile(style, name, text, columns or {}, in_time, driven, encoding)
