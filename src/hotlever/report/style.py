"""How hotlever's figures look: colour-blind safe, readable in print, no global state."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hotlever.errors import InputError
from hotlever.files import whole_file

#: Okabe and Ito's colours, safe for colour-blind readers.
BLACK, ORANGE, SKY, GREEN, BLUE, VERMILION, PURPLE = (
    "#000000",
    "#E69F00",
    "#56B4E9",
    "#009E73",
    "#0072B2",
    "#D55E00",
    "#CC79A7",
)
COLOURS = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY, BLACK)

FIGURE_TYPES = (".png", ".svg", ".pdf")

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
def figure(width: float, height: float) -> Iterator[Figure]:
    """Give an empty figure (inches) in hotlever's style; artists made inside follow it."""
    with mpl.rc_context(_STYLE):
        yield Figure(figsize=(width, height), layout="constrained")


def save_figure(made: Figure, path: str | os.PathLike[str]) -> None:
    """Write a figure as PNG, SVG or PDF, whole or not at all.

    Raises
    ------
    InputError
        If the suffix is none of these.
    """
    check_figure_name(path)
    with mpl.rc_context(_STYLE), whole_file(path) as temporary:
        # no dates: the same figure gives the same file
        metadata = {".pdf": {"CreationDate": None}, ".svg": {"Date": None}}
        made.savefig(temporary, metadata=metadata.get(temporary.suffix.lower()))


def check_figure_name(path: str | os.PathLike[str]) -> None:
    """Raise an InputError unless `path` ends like a figure file."""
    suffix = Path(path).suffix.lower()
    if suffix not in FIGURE_TYPES:
        raise InputError(
            f"{path}: unknown figure type '{suffix}', expected one of {', '.join(FIGURE_TYPES)}"
        )


def panel_letter(axes: Axes, letter: str) -> None:
    """Put ``(a)`` above the left corner of a panel."""
    axes.set_title(f"({letter})", loc="left", fontweight="bold")
