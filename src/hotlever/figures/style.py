"""How hotlever's figures look: colour-blind safe, readable in print, no global state."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from cycler import cycler
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hotlever.errors import InputError
from hotlever.files import FIGURE_TYPES, whole_file
from hotlever.materials.parameters import parameter_named
from hotlever.quantities import QUANTITIES
from hotlever.types import Array

if TYPE_CHECKING:
    import xarray as xr

#: Okabe and Ito's colours, safe for colour-blind readers, in print and in the browser.
BLACK, ORANGE, SKY, GREEN = "#000000", "#E69F00", "#56B4E9", "#009E73"
BLUE, VERMILION, PURPLE = "#0072B2", "#D55E00", "#CC79A7"
#: matplotlib's colour map of temperatures.
HEAT = "inferno"
COLOURS = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY, BLACK)
#: Lines that can be told apart, more of them than there are colours.
LINES = [(line, colour) for line in ("-", "--") for colour in COLOURS]
#: How measured points look.
MEASURED: Any = {"ls": "none", "marker": "o", "mfc": "none", "color": BLACK, "label": "measured"}

#: How figures are drawn, in terms of matplotlib's settings.
STYLE: Any = {
    "font.size": 9,
    "axes.labelsize": 9,
    "axes.titlesize": 9,
    "axes.titlelocation": "left",
    "figure.titlesize": 9,
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
    with mpl.rc_context(STYLE):
        fig = Figure(figsize=(width, height), layout="constrained")
        axes: Any = fig.subplots(*shape, **subplots)
        if letters:
            panel_letters(axes.ravel())
        yield fig, axes


def save_figure(fig: Figure, path: str | os.PathLike[str]) -> None:
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
    with mpl.rc_context(STYLE), whole_file(path) as temporary:
        # no dates: the same figure gives the same file
        metadata = {".pdf": {"CreationDate": None}, ".svg": {"Date": None}}
        fig.savefig(temporary, metadata=metadata.get(suffix))


def curve(axes: Axes, data: xr.Dataset, along: str, name: str, *line: str, **style: Any) -> None:
    """Draw a column of a dataset against another, and label the axes with what they are.

    One without values, as the reader's of a lever that has none, is left out.
    """
    values = data[name].values
    if not np.isnan(values).all():
        axes.plot(data[along].values, values, *line, **style)
    axes.set(ylabel=axis_label(name))
    # of axes above each other the lowest has the label
    if axes.xaxis.get_tick_params().get("labelbottom", True):
        axes.set(xlabel=axis_label(along))


def bridge_beside(axes: Axes, data: xr.Dataset, along: str, **style: Any) -> None:
    """Draw the voltage of a bridge, if there is one, along an axis of its own: it is amplified."""
    name = "bridge_output_V"
    if name in data:
        right = axes.twinx()
        right.plot(data[along], data[name], color=ORANGE, **style)
        right.set_ylabel(axis_label(name), color=ORANGE)
        right.spines["right"].set_visible(True)
        right.grid(False)


def entitle(fig: Figure, *datasets: xr.Dataset, more: str = "", is_described: bool = True) -> None:
    """Write above a figure of which levers its datasets are, as far as these say so, and more.

    Where the levers do not show their data, the title says so.
    """
    levers = [data.attrs["lever"] for data in datasets if "lever" in data.attrs]
    doubt = "" if is_described else "the data are not described: the nearest lever, without errors"
    text = "; ".join(filter(None, [" and ".join(dict.fromkeys(levers)), more, doubt]))
    if text:
        fig.suptitle(text, x=0.01, ha="left", color=BLACK if is_described else VERMILION)


def marker(data: xr.Dataset, along: str, mark: str = "o") -> str:
    """Mark the points of a curve, unless they are so many that they hide the line."""
    return mark if data.sizes[along] <= 40 else ""


def settled(history: xr.Dataset) -> bool:
    """Whether the bias stays what it is: time is then drawn logarithmic."""
    return bool(np.ptp(history.bias_V.values) == 0.0)


def beside(axes: Axes) -> None:
    """Put the legend to the right of axes, where it hides nothing."""
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))


def apart_at_turns(slope: Any, *columns: Any) -> list[Array]:
    """Return columns with a gap wherever a slope changes its sign, and so passes through zero.

    Its size by decades would be joined there as if it stayed what it is on either side.

    Examples
    --------
    >>> apart_at_turns([2.0, 1.0, -1.0], [3.0, 4.0, 5.0])
    [array([ 3.,  4., nan,  5.])]
    """
    turns = np.flatnonzero(np.diff(np.sign(slope)) != 0) + 1
    return [np.insert(np.asarray(column, dtype=float), turns, np.nan) for column in columns]


def some_of(shown: int, count: int, what: str) -> str | None:
    """Return the title of a legend of which not all is shown; None if all is."""
    return f"{shown} of {count} {what}" if shown < count else None


def from_zero(values: Any) -> tuple[float | None, None]:
    """Return limits of an axis that begins at zero, unless some values are below it."""
    return (None if np.nanmin(values, initial=0.0) < 0.0 else 0.0), None


def panel_letters(panels: Iterable[Axes]) -> None:
    """Put ``(a)``, ``(b)``, … above the left corners of panels."""
    for letter, axes in zip("abcdefghijkl", panels, strict=False):
        axes.set_title(f"({letter})", loc="left", fontweight="bold")


def axis_label(name: str) -> str:
    """Return the label of an axis with a quantity of datasets.

    Examples
    --------
    >>> axis_label("bias_V"), axis_label("doping")
    ('bias V$_b$ (V)', 'doping concentration (cm⁻³)')
    """
    return QUANTITIES[name].axis_label


def parameter_label(name: str) -> tuple[str, float]:
    """Return a parameter's axis label and the unit (of its own) that it is drawn in."""
    if name == "inversion_temperature":
        return "T$_i$ (K)", 1.0
    parameter = parameter_named(name)
    unit = "" if parameter.unit == "1" else parameter.unit
    if parameter.scale != 1.0:
        unit = f"10$^{{{math.log10(parameter.scale):.0f}}}$ {unit}"
    symbol, _, index = parameter.symbol.partition("_")
    symbol += f"$_{{{index}}}$" if index else ""
    return f"{symbol} ({unit})" if unit else symbol, parameter.scale


def are_numbered(levers: int) -> bool:
    """Whether so many levers are numbered instead of named along an axis."""
    return levers > 24


def values_by_lever(axes: Axes, quantity: xr.Dataset, scale: float = 1.0) -> None:
    """Draw a quantity by lever with its standard error, and mean and scatter of the levers.

    Parameters
    ----------
    axes : Axes
    quantity : xarray.Dataset
        One of `hotlever.estimate.many.compared`; what does not count is left out.
    scale : float
        Unit, of its own, that it is drawn in.
    """
    count = quantity.sizes["lever"]
    mean, scatter = quantity["mean"].item() / scale, quantity.scatter.item() / scale
    if np.isfinite(scatter):
        low, high = mean - scatter, mean + scatter
        axes.axhspan(low, high, color="0.9", lw=0, label="mean ± scatter between levers")
    axes.axhline(mean, color=VERMILION, lw=1.0, label="mean of the levers")
    style: Any = {"ms": 1.5, "lw": 0.5} if are_numbered(count) else {"ms": 4, "lw": 1.0}
    style |= {"fmt": "o", "color": BLUE, "label": "lever, with standard error"}
    value = quantity.value.where(quantity.counts) / scale
    axes.errorbar(np.arange(1, count + 1), value, quantity.stderr / scale, **style)
    axes.grid(False, axis="x")
