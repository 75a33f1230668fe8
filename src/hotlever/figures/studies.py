"""Figures of studies of the paper's claims."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from hotlever.colours import BLACK, BLUE, GREEN, ORANGE, PURPLE, VERMILION
from hotlever.figures.style import axis_label, figure

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


def thermoelectric_shift(shift: xr.Dataset, other: xr.Dataset | None = None) -> Figure:
    """Draw where the hot spot is for either polarity, and which heat moves it.

    Parameters
    ----------
    shift : xarray.Dataset
        From `hotlever.studies.thermoelectric_shift.shift_by_heat`.
    other : xarray.Dataset, optional
        The same of a lever with carriers of the other sign.
    """
    by_heat = shift.share_nm.sum("side").sel(polarity=1)
    with figure(7.6, 3.4, 1, 2, letters=True) as (made, (place, moved)):
        place.plot(shift.bias, shift.plain_um, ":", color=BLACK, label="without thermoelectricity")
        for polarity, mark, colour in ((1, "o-", BLUE), (-1, "s-", ORANGE)):
            label = f"{'positive' if polarity > 0 else 'negative'} bias"
            at_um = shift.at_um.sel(polarity=polarity)
            place.plot(shift.bias, at_um, mark, color=colour, label=label)
        place.axhline(0.0, color=BLACK, lw=0.6)
        place.set(xlabel="size of the bias (V)", ylabel="hot spot: supply ←   (µm)   → ground")
        place.legend()
        whole = shift.moved_nm.sel(polarity=1)
        moved.plot(shift.bias, whole, "o-", color=BLUE, label="all")
        for heat, colour in (("Peltier", VERMILION), ("Thomson", GREEN)):
            values = by_heat.sel(heat=heat)
            moved.plot(shift.bias, values, "--", color=colour, label=f"{heat} heat")
        if other is not None:
            values = other.moved_nm.sel(polarity=1)
            moved.plot(other.bias, values, "^-", color=PURPLE, label="all, with boron")
        moved.axhline(0.0, color=BLACK, lw=0.6)
        moved.set(xlabel="bias (V)", ylabel=axis_label("moved_nm").replace(" in the", "\nin the"))
        moved.legend()
    return made
