"""Figures that tasks draw, as far as they are asked for."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw(path: Path | None, figure: Callable[[Any], Figure]) -> None:
    """Draw a figure to a file, if one is asked for.

    ``figure`` makes it of the figures of the package, whose import nobody else has to wait for.
    """
    if path is not None:
        from hotlever import figures

        figures.save_figure(figure(figures), path)
