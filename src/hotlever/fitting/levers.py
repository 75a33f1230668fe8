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

    Parameters
    ----------
    fits : mapping of str to mapping
        The contents of fit files (`hotlever.fitting.result.Fit.content`), by the name of the lever.

    Returns
    -------
    xarray.Dataset
        On (``lever``, ``quantity``), the quantities being the parameters of the materials, and
        ``inversion_temperature`` if there is one: ``value`` and ``stderr`` (NaN where there is
        none). On
        ``quantity``: ``mean``; ``scatter``, the standard deviation between levers (NaN for one
        lever); ``mean_stderr``; ``chi_square`` of the values about their weighted mean, NaN
        where a standard error is missing.

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
    value, stderr = rows[..., 0], rows[..., 1]
    known = np.isfinite(stderr) & (stderr > 0)
    weights = np.where(known, 1.0 / np.where(known, stderr, 1.0) ** 2, np.nan)
    middle = (weights * value).sum(axis=0) / weights.sum(axis=0)
    scatter = value.std(axis=0, ddof=1) if len(rows) > 1 else np.full(len(quantities), np.nan)
    with np.errstate(invalid="ignore"):  # no error at all is none on average
        mean_stderr = np.where(known, stderr, 0.0).sum(axis=0) / known.sum(axis=0)
    return labelled(
        {
            "value": (("lever", "quantity"), value),
            "stderr": (("lever", "quantity"), stderr),
            "mean": value.mean(axis=0),
            "scatter": scatter,
            "mean_stderr": mean_stderr,
            "chi_square": (weights * (value - middle) ** 2).sum(axis=0),
        },
        "quantity",
        {"lever": list(fits), "quantity": quantities, "unit": ("quantity", list(units.values()))},
    )


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
    """Say in words whether the levers differ by more than their errors, and which stand apart."""
    count, chi_square = data.sizes["lever"], data.chi_square.values
    if count < 2 or np.isnan(chi_square).all():
        return []
    limit = chdtri(count - 1, _RARE)
    found = [
        f"the levers differ in {_said(str(one.quantity.item()))}: they scatter by "
        f"{one.scatter.item() / abs(one['mean'].item()):.1%}, "
        f"{one.scatter.item() / one.mean_stderr.item():.1f} times the mean standard error"
        for one in (data.isel(quantity=place) for place in np.flatnonzero(chi_square > limit))
    ]
    alike = data.quantity.values[chi_square <= limit]
    if alike.size:
        found.append(
            f"the scatter of {_listed([_said(name) for name in alike])} between the levers is no "
            "larger than the standard errors explain"
        )
    if count >= _FEWEST:
        found += [
            f"{lever} stands apart from the other levers in {_listed(names)}"
            for lever, names in _apart(data.isel(quantity=np.isfinite(chi_square))).items()
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
    """Return a table with one row for each lever: value and standard error of each quantity."""
    columns = {
        f"{name}{kind}{'_K' if name == INVERSION else ''}": ("lever", of.sel(quantity=name).data)
        for name in data.quantity.values
        for kind, of in (("", data.value), ("_stderr", data.stderr))
    }
    table = xr.Dataset(columns, {"lever": data.lever.data})
    return frame_text(table.to_dataframe(), float_format="%.8g")
