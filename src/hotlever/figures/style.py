"""How hotlever's figures look: colour-blind safe, readable in print, no global state."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from cycler import cycler
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hotlever.colours import BLACK, BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILION
from hotlever.errors import InputError
from hotlever.files import FIGURE_TYPES, whole_file
from hotlever.materials.parameters import INVERSION, parameter_named

COLOURS = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY, BLACK)
#: How measured points look.
MEASURED: Any = {"ls": "none", "marker": "o", "mfc": "none", "color": BLACK, "label": "measured"}

#: Title of what is drawn of a lever that does not show its data.
NOT_DESCRIBED = "the data are not described: the nearest lever, without errors"

_STYLE: Any = {
    "font.size": 9,
    "axes.labelsize": 9,
    "axes.titlesize": 9,
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "0.9",
    "axes.axisbelow": True,
    "axes.prop_cycle": cycler(color=COLOURS),
    "legend.frameon": False,
    "legend.fontsize": 8,
    "lines.linewidth": 1.4,
    "lines.markersize": 4.5,
    "savefig.dpi": 160,
    "svg.fonttype": "none",
    "svg.hashsalt": "hotlever",
    "image.cmap": "cividis",
}


@contextmanager
def figure(
    width: float, height: float, *shape: int, letters: bool = False, **subplots: Any
) -> Iterator[tuple[Figure, Any]]:
    """Give an empty figure (inches) and its axes in hotlever's style, which artists follow.

    Parameters
    ----------
    width, height : float
    *shape : int
        Rows and columns of axes; one alone by default.
    letters : bool
        Put letters above them.
    **subplots
        As matplotlib's ``Figure.subplots`` has them.
    """
    with mpl.rc_context(_STYLE):
        made = Figure(figsize=(width, height), layout="constrained")
        axes: Any = made.subplots(*shape, **subplots)
        if letters:
            panel_letters(axes.ravel())
        yield made, axes


def save_figure(made: Figure, path: str | os.PathLike[str]) -> None:
    """Write a figure as PNG, SVG or PDF, whole or not at all.

    Raises
    ------
    InputError
        If the suffix is none of these.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in FIGURE_TYPES:
        raise InputError(
            f"{path}: unknown figure type '{suffix}', expected one of {', '.join(FIGURE_TYPES)}"
        )
    with mpl.rc_context(_STYLE), whole_file(path) as temporary:
        # no dates: the same figure gives the same file
        metadata = {".pdf": {"CreationDate": None}, ".svg": {"Date": None}}
        made.savefig(temporary, metadata=metadata.get(suffix))


def from_zero(values: Any) -> tuple[float | None, None]:
    """Return limits of an axis that begins at zero, unless some values are below it."""
    return (None if np.nanmin(values, initial=0.0) < 0.0 else 0.0), None


def panel_letters(panels: Iterable[Axes]) -> None:
    """Put ``(a)``, ``(b)``, … above the left corners of panels."""
    for letter, axes in zip("abcdefghijkl", panels, strict=False):
        axes.set_title(f"({letter})", loc="left", fontweight="bold")


def axis_label(name: str) -> tuple[str, float]:
    """Return a quantity's axis label and the unit (of its own) that it is drawn in."""
    if name == INVERSION:
        return "T$_i$ (K)", 1.0
    known = parameter_named(name)
    unit = "" if known.unit == "1" else known.unit
    if known.scale != 1.0:
        unit = f"10$^{{{math.log10(known.scale):.0f}}}$ {unit}"
    symbol, _, index = known.symbol.partition("_")
    symbol += f"$_{{{index}}}$" if index else ""
    return f"{symbol} ({unit})" if unit else symbol, known.scale
