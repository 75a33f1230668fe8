"""Figures of studies of the paper's claims."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from hotlever.colours import BLACK, BLUE, ORANGE
from hotlever.figures.style import figure

if TYPE_CHECKING:
    import xarray as xr

#: Of the bars of each medium.
_COLOURS = {"vacuum": BLUE, "air": ORANGE}


def knee_discrepancy(studies: Mapping[str, xr.Dataset]) -> Figure:
    """Draw what each suspect carries of the knee's discrepancy, by medium.

    Parameters
    ----------
    studies : mapping of str to xarray.Dataset
        Of `hotlever.studies.knee_discrepancy`, by medium.
    """
    first = next(iter(studies.values()))
    names = [*map(str, first.suspect.values), "what remains"]
    rows, height = np.arange(len(names)), 0.8 / len(studies)
    with figure(7.4, 0.42 * len(names) + 1.0) as (made, axes):
        for number, (medium, study) in enumerate(studies.items()):
            lengths = np.append(study.shift_K.values, study.left_K)
            error = np.where(rows == rows[-1], study.total_stderr_K, 0.0)
            offset = (number - (len(studies) - 1) / 2) * height
            axes.barh(
                *(rows + offset, lengths, height),
                xerr=np.where(error > 0, error, np.nan),
                color=_COLOURS[medium],
                label=f"in {medium}",
                ecolor=BLACK,
                capsize=2,
            )
        axes.axvline(0.0, color=BLACK, lw=0.6)
        axes.axvline(first.discrepancy_K, color=BLACK, lw=0.8, ls=":", label="in the paper")
        axes.set_yticks(rows, names)
        axes.invert_yaxis()
        axes.set_xlabel("knee as read less that of the fitted model (K)")
        axes.legend(loc="center right")
    return made
