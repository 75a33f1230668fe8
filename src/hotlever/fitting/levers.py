"""What the fits of many levers say together: means, and the scatter between the levers."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.stats import chi2

from hotlever import __version__
from hotlever.errors import InputError
from hotlever.materials import PARAMETERS

Array = NDArray[np.float64]

#: Levers are said to differ if equal ones would scatter as much less often than this.
_RARE = 0.01
#: A lever stands apart beyond this many standard deviations (median-based) of the others, which
#: takes this many levers to tell.
_APART, _FEWEST = 5.0, 6
INVERSION = "inversion_temperature"


def compare_levers(fits: Mapping[str, Mapping[str, Any]]) -> xr.Dataset:
    """Put the fits of several levers side by side.

    Parameters
    ----------
    fits : mapping of str to mapping
        The contents of fit files (`hotlever.fitting.fit.Fit.to_json`), by the name of the lever.

    Returns
    -------
    xarray.Dataset
        On (``lever``, ``quantity``), the quantities being the six parameters and
        ``inversion_temperature``: ``value`` and ``stderr`` (NaN where there is none). On
        ``quantity``: ``mean``; ``scatter``, the standard deviation between levers (NaN for one
        lever); ``mean_stderr``; ``chi_square`` of the values about their weighted mean, NaN
        where a standard error is missing.

    Raises
    ------
    InputError
        If there is no fit, or one is no fit file.
    """
    if not fits:
        raise InputError("no fits to compare, expected one or more")
    quantities = [*PARAMETERS, INVERSION]
    rows = np.array([_row(name, content) for name, content in fits.items()])
    value, stderr = rows[..., 0], rows[..., 1]
    count = len(rows)
    known = np.isfinite(stderr) & (stderr > 0)
    weights = np.where(known, 1.0 / np.where(known, stderr, 1.0) ** 2, np.nan)
    middle = (weights * value).sum(axis=0) / weights.sum(axis=0)
    scatter = value.std(axis=0, ddof=1) if count > 1 else np.full(len(quantities), np.nan)
    mean_stderr = np.full(len(quantities), np.nan)
    mean_stderr[known.any(axis=0)] = np.nanmean(
        np.where(known, stderr, np.nan)[:, known.any(axis=0)], axis=0
    )
    units = [*(known.unit for known in PARAMETERS.values()), "K"]
    data = xr.Dataset(
        {
            "value": (("lever", "quantity"), value),
            "stderr": (("lever", "quantity"), stderr),
            "mean": ("quantity", value.mean(axis=0)),
            "scatter": ("quantity", scatter),
            "mean_stderr": ("quantity", mean_stderr),
            "chi_square": ("quantity", (weights * (value - middle) ** 2).sum(axis=0)),
        },
        coords={"lever": list(fits), "quantity": quantities, "unit": ("quantity", units)},
        attrs={"software": f"hotlever {__version__}"},
    )
    for name, unit, text in (
        ("value", "of the quantity", "fitted value"),
        ("stderr", "of the quantity", "its standard error"),
        ("mean", "of the quantity", "mean of the levers"),
        ("scatter", "of the quantity", "standard deviation between the levers"),
        ("mean_stderr", "of the quantity", "mean of the standard errors"),
        ("chi_square", "1", "chi-square of the values about their weighted mean"),
    ):
        data[name].attrs = {"units": unit, "long_name": text}
    return data


def _row(name: str, content: Mapping[str, Any]) -> list[tuple[float, float]]:
    """Return value and standard error of each quantity in a fit file."""

    def number(found: float | None) -> float:
        return math.nan if found is None else float(found)

    try:
        row = [
            (number(entry["value"]), number(entry["stderr"]))
            for entry in (content["parameters"][key] for key in PARAMETERS)
        ]
        inversion = content["inversion_temperature_K"], content["inversion_temperature_stderr_K"]
    except (KeyError, TypeError) as error:
        raise InputError(f"{name}: not a fit file, {error} is missing") from error
    return [*row, (number(inversion[0]), number(inversion[1]))]


def statements(data: xr.Dataset) -> list[str]:
    """Say in words whether the levers differ by more than their errors, and which stand apart.

    Parameters
    ----------
    data : xarray.Dataset
        From `compare_levers`.
    """
    found: list[str] = []
    count = data.sizes["lever"]
    judged = [
        name for name in data.quantity.values if np.isfinite(data.chi_square.sel(quantity=name))
    ]
    if count < 2 or not judged:
        return found
    limit = chi2.ppf(1.0 - _RARE, count - 1)
    alike = [name for name in judged if data.chi_square.sel(quantity=name) <= limit]
    for name in judged:
        if name not in alike:
            one = data.sel(quantity=name)
            found.append(
                f"the levers differ in {_said(name)}: they scatter by "
                f"{one.scatter.item() / abs(one['mean'].item()):.1%}, "
                f"{one.scatter.item() / one.mean_stderr.item():.1f} times the mean standard error"
            )
    if alike:
        found.append(
            f"the scatter of {_listed([_said(name) for name in alike])} between the levers is no "
            "larger than the standard errors explain"
        )
    if count >= _FEWEST:
        found += [
            f"{lever} stands apart from the other levers in {_listed(names)}"
            for lever, names in _apart(data.sel(quantity=judged)).items()
        ]
    return found


def _apart(data: xr.Dataset) -> dict[str, list[str]]:
    """Return the levers far from the median, and in what."""
    value, stderr = data.value.values, data.stderr.values
    away = np.abs(value - np.median(value, axis=0))
    spread = 1.4826 * np.median(away, axis=0)
    far = away > _APART * np.hypot(spread, stderr)
    names = data.quantity.values
    return {
        str(lever): [_said(name) for name in names[row]]
        for lever, row in zip(data.lever.values, far, strict=True)
        if row.any()
    }


def _said(name: str) -> str:
    return name.replace("_", " ") if name == INVERSION else str(name)


def _listed(names: Sequence[str]) -> str:
    *first, last = names
    return f"{', '.join(first)} and {last}" if first else last


def levers_csv(data: xr.Dataset) -> str:
    """Return a table with one row for each lever: value and standard error of each quantity.

    Parameters
    ----------
    data : xarray.Dataset
        From `compare_levers`.
    """
    columns = {INVERSION: f"{INVERSION}_K"}
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    header = ["lever"]
    for quantity in data.quantity.values:
        column = columns.get(quantity, quantity)
        header += [
            column,
            column.replace("_K", "_stderr_K") if column.endswith("_K") else f"{column}_stderr",
        ]
    writer.writerow(header)
    pairs = np.stack([data.value.values, data.stderr.values], axis=-1)
    for lever, row in zip(data.lever.values, pairs.reshape(len(pairs), -1), strict=True):
        writer.writerow([lever, *("" if np.isnan(cell) else f"{cell:.8g}" for cell in row)])
    return text.getvalue()
