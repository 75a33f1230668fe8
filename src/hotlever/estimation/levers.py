"""What the fits of many levers say together: means, and the scatter between the levers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from scipy.special import chdtri

from hotlever.datasets import frame_text, labelled
from hotlever.errors import InputError
from hotlever.materials import PARAMETERS
from hotlever.text import INVERSION, parameter_named

#: Levers are said to differ if equal ones would scatter as much less often than this.
_RARE = 0.01
#: A lever stands apart beyond this many standard deviations (median-based) of the others, which
#: takes this many levers to tell.
_APART, _FEWEST = 5.0, 6


def compare_levers(fits: Mapping[str, Mapping[str, Any]]) -> xr.Dataset:
    """Put the fits of several levers side by side.

    Levers whose data are not described have no values. Means are weighted by the inverse variance;
    a lever that does not determine a quantity, or has no error of it beside others that have one,
    is left out of its mean. Where no lever has an error of a quantity, all count the same.

    Parameters
    ----------
    fits : mapping of str to mapping
        The contents of fit files (`hotlever.estimation.result.Fit.content`), by lever.

    Returns
    -------
    xarray.Dataset
        On (``lever``, ``quantity``), the quantities being the parameters of the materials, and
        ``inversion_temperature`` if there is one: ``value`` and ``stderr`` (NaN where there is
        none), and ``counts``, whether the value counts in the mean. On ``lever``: ``described``. On
        ``quantity``: ``mean`` (NaN where no value counts); ``scatter``, the standard deviation
        between levers (NaN for one lever); ``chi_square`` of the values about their mean, NaN
        without standard errors; ``birge_ratio``, the root of it over the degrees of freedom; and
        ``mean_stderr``, the standard error of the mean, larger by the Birge ratio where that is
        above 1.

    Raises
    ------
    InputError
        If there is no fit, one is no fit file, or they are of levers of different materials.
    """
    if not fits:
        raise InputError("no fits to compare, expected one or more")
    units = _units(fits)
    quantities = list(units)
    rows = np.array([_row(name, one, quantities) for name, one in fits.items()], dtype=float)
    answered = np.array([described(one) is True for one in fits.values()])
    rows[~answered] = np.nan
    value, stderr = rows[..., 0], rows[..., 1]
    stated = np.isfinite(stderr) & (stderr > 0)
    positive = np.array([parameter_named(name).lower >= 0 for name in quantities])
    undetermined = stated & positive & (stderr >= np.abs(value))
    counts = np.isfinite(value) & ~undetermined & (stated | ~stated.any(axis=0))
    weight = np.where(counts, 1.0 / np.where(stated, stderr, 1.0) ** 2, 0.0)
    count, known = counts.sum(axis=0), np.where(counts, value, 0.0)
    with np.errstate(invalid="ignore", divide="ignore"):  # what no lever tells is NaN
        mean = (weight * known).sum(axis=0) / weight.sum(axis=0)
        away = np.where(counts, value - mean, 0.0)
        middle = known.sum(axis=0) / count
        squares = np.where(counts, (value - middle) ** 2, 0.0).sum(axis=0)
        scatter = np.where(count > 1, np.sqrt(squares / (count - 1)), np.nan)
        has_errors = stated.any(axis=0) & (count > 0)
        chi_square = np.where(has_errors, (weight * away**2).sum(axis=0), np.nan)
        birge = np.where(count > 1, np.sqrt(chi_square / (count - 1)), np.nan)
        mean_stderr = np.where(has_errors, 1.0 / np.sqrt(weight.sum(axis=0)), np.nan)
    both = ("lever", "quantity")
    return labelled(
        {
            "value": (both, value),
            "stderr": (both, stderr),
            "counts": (both, counts),
            "described": ("lever", answered),
            "mean": mean,
            "mean_stderr": mean_stderr * np.fmax(birge, 1.0),
            "scatter": scatter,
            "chi_square": chi_square,
            "birge_ratio": birge,
        },
        "quantity",
        {"lever": list(fits), "quantity": quantities, "unit": ("quantity", list(units.values()))},
    )


def described(content: Mapping[str, Any]) -> bool | None:
    """Whether the data of a fit file are described; former versions have a reason if not."""
    return content.get("describes_data", not content.get("reason"))


def _units(fits: Mapping[str, Mapping[str, Any]]) -> dict[str, str]:
    """Return the quantities that the levers are compared by, with their units."""
    name, first = next(iter(fits.items()))
    try:
        # dimensions and the like are varied within priors: their scatter is not the levers'
        names = [key for key in first["parameters"] if key in PARAMETERS or "." in key]
        has_inversion = first["inversion_temperature_K"] is not None
    except (KeyError, TypeError, AttributeError) as error:
        raise InputError(f"{name}: not a fit file, {error} is missing") from error
    units = {key: parameter_named(key).unit for key in names}
    return {**units, **({INVERSION: "K"} if has_inversion else {})}


def _row(
    name: str, content: Mapping[str, Any], quantities: Sequence[str]
) -> list[tuple[float | None, float | None]]:
    """Return value and standard error of each quantity in a fit file."""
    try:
        known = {
            **{key: (one["value"], one["stderr"]) for key, one in content["parameters"].items()},
            INVERSION: (
                content["inversion_temperature_K"],
                content["inversion_temperature_stderr_K"],
            ),
        }
        return [known[quantity] for quantity in quantities]
    except (KeyError, TypeError, AttributeError) as error:
        raise InputError(f"{name}: not a fit file, {error} is missing") from error


def statements(data: xr.Dataset) -> list[str]:
    """Say in words which levers are left out, whether the others differ, and which stand apart."""
    found, count = _left_out(data), data.counts.sum("lever").values
    chi_square = np.where(count > 1, data.chi_square.values, np.nan)
    limit = chdtri(np.maximum(count - 1, 1), _RARE)
    for place in np.flatnonzero(chi_square > limit):
        one = data.isel(quantity=place)
        found.append(
            f"the levers differ in {_said(str(one.quantity.item()))}: they scatter by "
            f"{one.scatter.item() / abs(one['mean'].item()):.1%}, χ² is {chi_square[place]:.3g} "
            f"for {count[place] - 1} degrees of freedom (Birge ratio "
            f"{one.birge_ratio.item():.1f})"
        )
    alike = data.quantity.values[chi_square <= limit]
    if alike.size:
        found.append(
            f"the scatter of {_listed([_said(name) for name in alike])} between the levers is no "
            "larger than the standard errors explain"
        )
    many = data.isel(quantity=np.isfinite(chi_square) & (count >= _FEWEST))
    return found + [
        f"{lever} stands apart from the other levers in {_listed(names)}"
        for lever, names in _apart(many).items()
    ]


def _left_out(data: xr.Dataset) -> list[str]:
    """Name the levers that do not count, or not in every mean."""
    found = [
        f"{lever} is left out: its data are not described"
        for lever in data.lever.values[~data.described.values]
    ]
    missing = ~data.counts.values & np.isfinite(data.value.values)
    return found + [
        f"{lever} is left out of the mean of {_listed([_said(name) for name in names])}, which "
        "its data do not determine"
        for lever, row in zip(data.lever.values, missing, strict=True)
        if (names := data.quantity.values[row].tolist())
    ]


def _apart(data: xr.Dataset) -> dict[str, list[str]]:
    """Return the levers far from the median of those that count, and in what."""
    if not data.sizes["quantity"]:
        return {}
    value = data.value.where(data.counts).values
    away = np.abs(value - np.nanmedian(value, axis=0))
    spread = 1.4826 * np.nanmedian(away, axis=0)
    far = away > _APART * np.hypot(spread, data.stderr.values)
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
    """Return a table with one row for each lever: value and standard error of each quantity."""
    columns = {
        f"{name}{kind}{'_K' if name == INVERSION else ''}": ("lever", of.sel(quantity=name).data)
        for name in data.quantity.values
        for kind, of in (("", data.value), ("_stderr", data.stderr))
    }
    table = xr.Dataset(columns, {"lever": data.lever.data})
    return frame_text(table.to_dataframe(), float_format="%.8g")
