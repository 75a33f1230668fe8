"""What the fits of many levers say together: means, and the scatter between the levers."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
import xarray as xr
from scipy.special import chdtri

from hotlever.datasets import frame_text, labelled
from hotlever.errors import InputError
from hotlever.estimation.result import Fit
from hotlever.materials.parameters import (
    INVERSION,
    heading,
    is_of_material,
    parameter_named,
    scale_of,
)
from hotlever.text import aligned, value_with_error

#: Levers are said to differ if equal ones would scatter as much less often than this.
_RARE = 0.01
#: A lever stands apart beyond this many standard deviations (median-based) of the others, which
#: takes this many levers to tell.
_APART, _FEWEST = 5.0, 6


def compare_levers(fits: Mapping[str, Fit]) -> xr.Dataset:
    """Put the fits of several levers side by side.

    Levers whose data are not described have no values. Means are weighted by the inverse variance;
    a lever that does not determine a quantity, or has no error of it beside others that have one,
    is left out of its mean. Where no lever has an error of a quantity, all count the same.

    Parameters
    ----------
    fits : mapping of str to Fit
        By lever.

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
        If there is no fit, or they are of levers of different materials.
    """
    if not fits:
        raise InputError("no fits to compare, expected one or more")
    compared = {lever: _quantities(fit) for lever, fit in fits.items()}
    first, names = next((lever, list(quantities)) for lever, quantities in compared.items())
    for lever, quantities in compared.items():
        if missing := [name for name in names if name not in quantities]:
            raise InputError(
                f"{lever}: {_listed(missing)} is missing, expected a lever of the same materials "
                f"as {first}"
            )
    numbers = [[quantities[name] for name in names] for quantities in compared.values()]
    described = xr.DataArray([fit.describes_data is True for fit in fits.values()], dims="lever")
    value, stderr = (
        xr.DataArray(column, dims=("lever", "quantity")).where(described)
        for column in np.moveaxis(np.array(numbers, dtype=float), -1, 0)
    )
    stated = stderr > 0
    positive = xr.DataArray([parameter_named(name).lower >= 0 for name in names], dims="quantity")
    undetermined = stated & positive & (stderr >= np.abs(value))
    counts = value.notnull() & ~undetermined & (stated | ~stated.any("lever"))
    counting, count = value.where(counts), counts.sum("lever")
    freedom = (count - 1).where(count > 1)
    weight = (1.0 / stderr.where(stated, 1.0) ** 2).where(counts)
    total = weight.sum("lever", min_count=1)
    mean = (weight * counting).sum("lever") / total
    chi_square = (weight * (counting - mean) ** 2).sum("lever", min_count=1)
    chi_square = chi_square.where(stated.any("lever"))
    birge_ratio = (chi_square / freedom) ** 0.5
    mean_stderr = (total**-0.5).where(stated.any("lever")) * np.fmax(birge_ratio, 1.0)
    squares = ((counting - counting.mean("lever")) ** 2).sum("lever")
    columns: dict[str, xr.DataArray] = {
        "value": value,
        "stderr": stderr,
        "counts": counts,
        "described": described,
        "mean": mean,
        "mean_stderr": mean_stderr,
        "scatter": (squares / freedom) ** 0.5,
        "chi_square": chi_square,
        "birge_ratio": birge_ratio,
    }
    units = ["K" if name == INVERSION else parameter_named(name).unit for name in names]
    return labelled(
        {name: (column.dims, column.values) for name, column in columns.items()},
        coordinates={"lever": list(fits), "quantity": names, "unit": ("quantity", units)},
    )


def _quantities(fit: Fit) -> dict[str, tuple[float, float | None]]:
    """Return what a lever is compared by, with errors: its materials, the inversion temperature."""
    # dimensions and the like are varied within priors: their scatter is not the levers'
    quantities = {
        name: (fitted.value, fitted.stderr)
        for name, fitted in fit.parameters.items()
        if is_of_material(name)
    }
    if np.isfinite(fit.inversion_temperature_K):
        quantities[INVERSION] = fit.inversion_temperature_K, fit.inversion_temperature_stderr_K
    return quantities


def statements(levers: xr.Dataset) -> list[str]:
    """Say in words which levers are left out, whether the others differ, and which stand apart."""
    count = levers.counts.sum("lever").values
    chi_square = np.where(count > 1, levers.chi_square.values, np.nan)
    limit = chdtri(np.maximum(count - 1, 1), _RARE)
    texts = [
        f"{lever} is left out: its data are not described"
        for lever in levers.lever.values[~levers.described.values]
    ]
    texts += [
        f"{lever} is left out of the mean of {quantities}, which its data do not determine"
        for lever, quantities in _by_lever(~levers.counts & levers.value.notnull())
    ]
    for index in np.flatnonzero(chi_square > limit):
        quantity = levers.isel(quantity=index)
        texts.append(
            f"the levers differ in {_listed([quantity.quantity.item()])}: they scatter by "
            f"{quantity.scatter.item() / abs(quantity['mean'].item()):.1%}, χ² is "
            f"{chi_square[index]:.3g} for {count[index] - 1} degrees of freedom (Birge ratio "
            f"{quantity.birge_ratio.item():.1f})"
        )
    alike = levers.quantity.values[chi_square <= limit]
    if alike.size:
        texts.append(
            f"the scatter of {_listed(alike)} between the levers is no larger than the standard "
            "errors explain"
        )
    many = levers.isel(quantity=np.isfinite(chi_square) & (count >= _FEWEST))
    value = many.value.where(many.counts)
    away = np.abs(value - value.median("lever"))
    # the standard deviation of a normal distribution that has this median
    spread = 1.4826 * away.median("lever")
    return texts + [
        f"{lever} stands apart from the other levers in {quantities}"
        for lever, quantities in _by_lever(away > _APART * np.hypot(spread, many.stderr))
    ]


def _by_lever(chosen: xr.DataArray) -> list[tuple[str, str]]:
    """Return the levers of which some quantities are chosen, with these in words."""
    return [
        (str(row.lever.item()), _listed(row.quantity.values[row.values]))
        for row in chosen
        if row.any()
    ]


def _listed(names: Iterable[str]) -> str:
    *first, last = ["inversion temperature" if name == INVERSION else name for name in names]
    return f"{', '.join(first)} and {last}" if first else str(last)


def lever_rows(levers: xr.Dataset) -> list[list[str]]:
    """Return the table of `compare_levers`: columns, levers, then the mean and the scatter."""
    names = levers.quantity.values.tolist()
    rows = [["lever", *map(heading, names)]]
    labels = [*levers.lever.values.tolist(), "weighted mean"]
    values = np.vstack([levers.value, levers["mean"]])
    errors = np.vstack([levers.stderr, levers.mean_stderr])
    for label, *numbers in zip(labels, values.tolist(), errors.tolist(), strict=True):
        cells = zip(names, *numbers, strict=True)
        rows.append([str(label), *(_with_error(*cell) for cell in cells)])
    scatter = levers.scatter.values
    for label, numbers, form in (
        ("scatter between levers", scatter / [scale_of(name) for name in names], ".3g"),
        ("scatter, relative", scatter / np.abs(levers["mean"].values), ".1%"),
        ("Birge ratio", levers.birge_ratio.values, ".2g"),
    ):
        rows.append(
            [label, *("" if np.isnan(number) else f"{number:{form}}" for number in numbers)]
        )
    return rows


def _with_error(name: str, value: float, stderr: float) -> str:
    if np.isnan(value):
        return ""
    return value_with_error(value, stderr, scale_of(name), parameter_named(name).bounds)


def levers_text(levers: xr.Dataset) -> str:
    """Return the table of many levers and what follows from it as lines of text."""
    lines = aligned(lever_rows(levers))
    lines.insert(1 + levers.sizes["lever"], "-" * max(map(len, lines)))
    return "\n".join(lines + statements(levers))


def levers_csv(levers: xr.Dataset) -> str:
    """Return a table with one row for each lever: value and standard error of each quantity."""
    columns = {
        f"{name}{kind}{'_K' if name == INVERSION else ''}": column.sel(quantity=name, drop=True)
        for name in levers.quantity.values
        for kind, column in (("", levers.value), ("_stderr", levers.stderr))
    }
    return frame_text(xr.Dataset(columns).to_dataframe(), float_format="%.8g")
