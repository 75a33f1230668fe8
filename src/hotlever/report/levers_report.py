"""Many levers side by side: the table, the figure and the page (paper's Table II)."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from hotlever.fitting.batch import Batch
from hotlever.fitting.levers import INVERSION, compare_levers, statements
from hotlever.report.fit_report import scaled_unit, sentence, value_with_error
from hotlever.report.page import Page
from hotlever.report.style import BLUE, VERMILION, figure, panel_letter
from hotlever.report.uncertainty_figures import axis_label

#: More levers than this are numbered instead of named along an axis.
_MOST_NAMES = 24


def lever_rows(data: xr.Dataset) -> tuple[list[str], list[list[str]]]:
    """Return the table of a wafer as text: columns, and rows with the mean and scatter last.

    Parameters
    ----------
    data : xarray.Dataset
        From `hotlever.fitting.levers.compare_levers`.
    """
    names = data.quantity.values.tolist()
    scales = np.array([axis_label(name)[1] for name in names])
    columns = ["lever"]
    for name in names:
        symbol, unit = ("T_i", "K") if name == INVERSION else (name, scaled_unit(name))
        columns.append(f"{symbol} ({unit})" if unit else symbol)
    rows = [
        [str(lever), *map(_with_error, value, stderr, scales)]
        for lever, value, stderr in zip(
            data.lever.values, data.value.values, data.stderr.values, strict=True
        )
    ]
    for label, numbers in (
        ("mean", data["mean"].values / scales),
        ("scatter between levers", data.scatter.values / scales),
        ("mean standard error", data.mean_stderr.values / scales),
    ):
        rows.append([label, *("" if np.isnan(number) else f"{number:.3g}" for number in numbers)])
    share = data.scatter.values / np.abs(data["mean"].values)
    rows.append(
        ["scatter, relative", *("" if np.isnan(number) else f"{number:.1%}" for number in share)]
    )
    return columns, rows


def _with_error(value: float, stderr: float, scale: float) -> str:
    return value_with_error(value, None if np.isnan(stderr) else stderr, scale)


def levers_text(data: xr.Dataset) -> str:
    """Return the table and what follows from it as lines of text.

    Parameters
    ----------
    data : xarray.Dataset
        From `hotlever.fitting.levers.compare_levers`.
    """
    columns, rows = lever_rows(data)
    table = [columns, *rows]
    widths = [max(len(row[k]) for row in table) for k in range(len(columns))]
    lines = [
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in table
    ]
    lines.insert(1 + data.sizes["lever"], "-" * max(map(len, lines)))
    return "\n".join(lines + statements(data))


def lever_parameters(data: xr.Dataset) -> Figure:
    """Draw each quantity by lever with its standard error, and mean and scatter of the levers.

    Parameters
    ----------
    data : xarray.Dataset
        From `hotlever.fitting.levers.compare_levers`. Quantities that were held are left out.
    """
    count = data.sizes["lever"]
    place = np.arange(1, count + 1)
    many = count > _MOST_NAMES
    free = [
        name
        for name in data.quantity.values.tolist()
        if np.isfinite(data.stderr.sel(quantity=name)).any()
    ]
    with figure(7.4, 1.2 * len(free) + (0.8 if many else 1.2)) as made:
        column = made.subplots(len(free), 1, sharex=True, squeeze=False)[:, 0]
        for name, axes, letter in zip(free, column, "abcdefg", strict=False):
            one = data.sel(quantity=name)
            label, scale = axis_label(name)
            mean, scatter = one["mean"].item() / scale, one.scatter.item() / scale
            if np.isfinite(scatter):
                low, high = mean - scatter, mean + scatter
                axes.axhspan(low, high, color="0.9", lw=0, label="mean ± scatter between levers")
            axes.axhline(mean, color=VERMILION, lw=1.0, label="mean of the levers")
            axes.errorbar(
                place,
                one.value / scale,
                one.stderr / scale,
                fmt="o",
                ms=1.5 if many else 4,
                lw=0.5 if many else 1.0,
                color=BLUE,
                label="lever, with standard error",
            )
            # a unit below the symbol, as the panels are low
            axes.set_ylabel(label.replace(" (", "\n(", 1))
            axes.grid(False, axis="x")
            panel_letter(axes, letter)
        if many:
            column[-1].set(xlabel="lever", xlim=(0, count + 1))
        else:
            column[-1].set_xticks(place, data.lever.values, rotation=45, ha="right")
            column[-1].set_xlim(0.5, count + 0.5)
        made.align_ylabels()
        handles, labels = column[0].get_legend_handles_labels()
        made.legend(handles, labels, loc="outside upper center", ncols=len(labels))
    return made


def levers_page(batch: Batch) -> Page:
    """Return the report page of many levers.

    Parameters
    ----------
    batch : Batch
        With one fit or more.
    """
    data = compare_levers({name: one.content for name, one in batch.fits.items()})
    observables = {tuple(one.content["observables"]) for one in batch.fits.values()}
    page = Page(
        f"Fits of {data.sizes['lever']} levers",
        "Material parameters of levers from their measured "
        f"{' or '.join(', '.join(names) for names in sorted(observables))}.",
    )
    for text in statements(data):
        page.text(sentence(text))
    page.figure(
        "lever_parameters",
        lever_parameters(data),
        "Each fitted parameter by lever, and the inversion temperature that follows.",
    )
    columns, rows = lever_rows(data)
    page.table(columns, rows, "Standard errors in units of the last digits.")
    noted = [(name, text) for name, one in batch.fits.items() for text in one.content["notes"]]
    if noted:
        page.heading("What single fits say")
        page.table(("lever", "note"), noted)
    if batch.failures:
        page.heading("Not fitted")
        page.table(
            ("file", "reason"), [(path, str(error)) for path, error in batch.failures.items()]
        )
    return page
