"""A fit in words and tables: its parameters, what they lean on, what the data leave open.

Of many levers: means, and the scatter between them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import xarray as xr
from scipy.special import chdtri

from hotlever.datasets import frame_text, labelled
from hotlever.errors import InputError
from hotlever.estimate.estimate import Estimate
from hotlever.materials.parameters import (
    INVERSION,
    heading,
    is_of_material,
    parameter_named,
    scale_of,
    scaled_unit,
)
from hotlever.probe.priors import PriorUse
from hotlever.probe.probe_parameters import parameters_of
from hotlever.text import NOT_DETERMINED, aligned, value_with_error

#: A prior is named as leaned on where its data narrow it to no less than this share, and as moved
#: where they move it by so many of its standard deviations.
_LEANED_ON, _LARGE_SHIFT = 0.9, 1.0
#: What the numbers of a fit are that does not describe its data.
NEAREST = (
    "what follows is of the lever that comes nearest, and no estimate: errors are not stated, "
    "since they would not hold"
)
#: Rows of a table for people that are of all levers: mean, scatter twice, Birge ratio.
_OF_ALL = 4
#: Levers are said to differ if equal ones would scatter as much less often than this.
_RARE = 0.01
#: A lever stands apart beyond this many standard deviations (median-based) of the others, which
#: takes this many levers to tell.
_APART, _FEWEST = 5.0, 6


def parameter_rows(fit: Estimate) -> list[tuple[str, str, str, str]]:
    """Return name, value with error, unit and a remark for each parameter of a fit."""
    rows, declared = [], parameters_of(fit.probe, in_time=True)
    for name, fitted in fit.parameters.items():
        stderr, remark = fitted.stderr, "" if fitted.vary else "fixed"
        if fitted.vary and stderr is None:
            stderr, remark = np.nan, "no error"
        value = value_with_error(fitted.value, stderr, scale_of(name), declared[name].bounds)
        rows.append((name, value, scaled_unit(name), remark))
    return rows


def conclusions(fit: Estimate) -> list[str]:
    """Say what follows from the parameters of a fit, and how well it describes the data."""
    lines = [_tip_in_time(fit.band)] if fit.in_time else []
    if np.isfinite(fit.inversion_temperature_K):
        inversion = value_with_error(
            fit.inversion_temperature_K, fit.inversion_temperature_stderr_K
        )
        unit = "" if inversion == NOT_DETERMINED else " K"
        lines.append(f"inversion temperature: {inversion}{unit}")
    rms = []
    for column, value in fit.residual_rms.items():
        name, _, unit = column.rpartition("_")
        rms.append(f"{name} {value:.3g} {unit}")
    return [
        *lines,
        f"rms of data - model: {', '.join(rms)}",
        f"fitted to {', '.join(fit.observables)} in {fit.steps} steps, {fit.seconds:.1f} s",
    ]


def _tip_in_time(band: xr.Dataset) -> str:
    """Say how hot the tip became."""
    hottest, last = (
        f"{value_with_error(row.tip_K.item(), row.tip_stderr_K.item())} K after "
        f"{row.time_us.item():.4g} µs"
        for row in (band.isel(time=band.tip_K.argmax("time")), band.isel(time=-1))
    )
    if hottest == last:
        return f"tip temperature: {last}, at its hottest and last"
    return f"tip temperature: {hottest}, at its hottest, {last}, at last"


def prior_lines(priors: Mapping[str, PriorUse]) -> list[str]:
    """Say which priors an answer leans on, and which the data moved far."""
    leaned = [name for name, use in priors.items() if use.spread_ratio > _LEANED_ON]
    shifts = [
        f"{name} by {use.shift:+.1f} σ to {use.posterior_value:.4g}"
        for name, use in priors.items()
        if abs(use.shift) > _LARGE_SHIFT
    ]
    lines = {
        "moved by the data beyond what was known before": shifts,
        "as known before, since the data do not tell": leaned,
    }
    return [f"{text}: {', '.join(names)}" for text, names in lines.items() if names]


def fit_text(fit: Estimate) -> str:
    """Return the result of a fit as lines of text; first that it describes no data, if so."""
    lines = [] if fit.describes_data else [fit.doubt, NEAREST]
    lines += [*aligned(parameter_rows(fit)), *conclusions(fit), *prior_lines(fit.priors)]
    return "\n".join(lines)


# --- many levers --------------------------------------------------------------------------------


class Compared(NamedTuple):
    """How a quantity is called and written by which levers are compared."""

    heading: str  #: of its column in a table for people
    unit: str
    column: str  #: in a file; ``{}``, if there is a standard error, where its column says so
    words: str
    scale: float = 1.0  #: unit, of its own, that it is printed in
    lower: float = 0.0
    upper: float = np.inf


def compare_levers(fits: Mapping[str, Estimate]) -> xr.Dataset:
    """Put the fits of several levers side by side; see `compared`.

    The quantities are the parameters of the materials, and ``inversion_temperature`` if there is
    one.

    Raises
    ------
    InputError
        If there is no fit, or they are of levers of different materials.
    """
    quantities = {lever: _quantities(fit) for lever, fit in fits.items()}
    names = list(next(iter(quantities.values()), ()))
    for lever, own in quantities.items():
        if missing := [name for name in names if name not in own]:
            words = _listed([_compared(name).words for name in missing])
            raise InputError(
                f"{lever}: {words} is missing, expected a lever of the same materials as "
                f"{next(iter(fits))}"
            )
    return compared(fits, quantities, {name: _compared(name) for name in names})


def compared(
    results: Mapping[str, Estimate],
    quantities: Mapping[str, Mapping[str, tuple[float, float | None]]],
    written: Mapping[str, Compared],
    more: Mapping[str, Any] | None = None,
) -> xr.Dataset:
    """Put quantities of several levers side by side.

    Levers whose data are not described have no values. Means are weighted by the inverse variance;
    a lever that does not determine a quantity, or has no error of it beside others that have one,
    is left out of its mean. Where no lever has an error of a quantity, all count the same.

    Parameters
    ----------
    results : mapping of str to Estimate or Estimate
        By lever.
    quantities : mapping of str to mapping
        By lever, of each quantity its value and standard error.
    written : mapping of str to Compared
        By quantity.
    more : mapping, optional
        Further columns on ``lever``.

    Returns
    -------
    xarray.Dataset
        On (``lever``, ``quantity``): ``value`` and ``stderr`` (NaN where there is none), and
        ``counts``, whether the value counts in the mean. On ``lever``: ``described``. On
        ``quantity``: what `Compared` has; ``mean`` (NaN where no value counts); ``scatter``, the
        standard deviation between levers (NaN for one lever); ``chi_square`` of the values about
        their mean, NaN without standard errors; ``birge_ratio``, the root of it over the degrees
        of freedom; and ``mean_stderr``, the standard error of the mean, larger by the Birge ratio
        where that is above 1.

    Raises
    ------
    InputError
        If there is no lever.
    """
    if not results:
        raise InputError("no levers to compare, expected one or more")
    names = list(written)
    numbers = [[own[name] for name in names] for own in quantities.values()]
    answers = [result.describes_data is True for result in results.values()]
    described = xr.DataArray(answers, dims="lever")
    value, stderr = (
        xr.DataArray(column, dims=("lever", "quantity")).where(described)
        for column in np.moveaxis(np.array(numbers, dtype=float), -1, 0)
    )
    stated = stderr > 0
    positive = xr.DataArray([each.lower >= 0 for each in written.values()], dims="quantity")
    undetermined = stated & positive & (stderr >= np.abs(value))
    counts = value.notnull() & ~undetermined & (stated | ~stated.any("lever"))
    counting, count = value.where(counts), counts.sum("lever")
    freedom = (count - 1).where(count > 1)
    weight = (1.0 / stderr.where(stated, 1.0) ** 2).where(counts)
    total = weight.sum("lever", min_count=1)
    mean = (weight * counting).sum("lever") / total
    squares = (weight * (counting - mean) ** 2).sum("lever", min_count=1)
    chi_square = squares.where(stated.any("lever"))
    birge_ratio = (chi_square / freedom) ** 0.5
    mean_stderr = (total**-0.5).where(stated.any("lever")) * np.fmax(birge_ratio, 1.0)
    away = counting - counting.mean("lever")
    columns: dict[str, xr.DataArray] = {
        "value": value,
        "stderr": stderr,
        "counts": counts,
        "described": described,
        "mean": mean,
        "mean_stderr": mean_stderr,
        "scatter": ((away**2).sum("lever") / freedom) ** 0.5,
        "chi_square": chi_square,
        "birge_ratio": birge_ratio,
    }
    how = {
        field: ("quantity", [getattr(each, field) for each in written.values()])
        for field in Compared._fields
    }
    return labelled(
        {name: (column.dims, column.values) for name, column in columns.items()}
        | {name: ("lever", values) for name, values in (more or {}).items()},
        coordinates={"lever": list(results), "quantity": names, **how},
    )


def _compared(name: str) -> Compared:
    """Return how a parameter, or the inversion temperature, is called and written."""
    if name == INVERSION:
        return Compared(heading(name), "K", f"{name}{{}}_K", "inversion temperature")
    parameter = parameter_named(name)
    how = parameter.scale, *parameter.bounds
    return Compared(heading(name), parameter.unit, f"{name}{{}}", name, *how)


def _quantities(fit: Estimate) -> dict[str, tuple[float, float | None]]:
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
        f"lever {lever} is left out: its data are not described"
        for lever in levers.lever.values[~levers.described.values]
    ]
    texts += [
        f"lever {lever} is left out of the mean of {quantities}, which its data do not determine"
        for lever, quantities in _by_lever(~levers.counts & levers.value.notnull())
    ]
    for index in np.flatnonzero(chi_square > limit):
        quantity = levers.isel(quantity=index)
        texts.append(
            f"the levers differ in {quantity.words.item()}: they scatter by "
            f"{quantity.scatter.item() / abs(quantity['mean'].item()):.1%}, χ² is "
            f"{chi_square[index]:.3g} for {count[index] - 1} degrees of freedom (Birge ratio "
            f"{quantity.birge_ratio.item():.1f})"
        )
    alike = levers.words.values[chi_square <= limit]
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
        f"lever {lever} stands apart from the other levers in {quantities}"
        for lever, quantities in _by_lever(away > _APART * np.hypot(spread, many.stderr))
    ]


def _by_lever(chosen: xr.DataArray) -> list[tuple[str, str]]:
    """Return the levers of which some quantities are chosen, with these in words."""
    return [
        (str(row.lever.item()), _listed(row.words.values[row.values]))
        for row in chosen
        if row.any()
    ]


def _listed(words: Iterable[str]) -> str:
    *first, last = map(str, words)
    return f"{', '.join(first)} and {last}" if first else last


def lever_rows(levers: xr.Dataset) -> list[list[str]]:
    """Return the table of `compared`: columns, levers, then the mean and the scatter."""
    rows = [["lever", *levers.heading.values]]
    labels = [*levers.lever.values.tolist(), "weighted mean"]
    values = np.vstack([levers.value, levers["mean"]])
    errors = np.vstack([levers.stderr, levers.mean_stderr])
    how = [levers[name].values for name in ("scale", "lower", "upper")]
    for label, *numbers in zip(labels, values, errors, strict=True):
        cells = zip(*numbers, *how, strict=True)
        rows.append([str(label), *(_with_error(*cell) for cell in cells)])
    scatter = levers.scatter.values
    for label, numbers, form in (
        ("scatter between levers", scatter / levers.scale.values, ".3g"),
        ("scatter, relative", scatter / np.abs(levers["mean"].values), ".1%"),
        ("Birge ratio", levers.birge_ratio.values, ".2g"),
    ):
        rows.append(
            [label, *("" if np.isnan(number) else f"{number:{form}}" for number in numbers)]
        )
    return rows


def _with_error(value: float, stderr: float, scale: float, lower: float, upper: float) -> str:
    if np.isnan(value):
        return ""
    return value_with_error(float(value), float(stderr), float(scale), (lower, upper))


def table_text(rows: list[list[str]], remarks: list[str]) -> str:
    """Return a table as `lever_rows` has it as text, mean and scatter below a line; then words."""
    lines = aligned(rows)
    lines.insert(-_OF_ALL, "-" * max(map(len, lines)))
    return "\n".join(lines + remarks)


def levers_csv(levers: xr.Dataset) -> str:
    """Return a table with one row for each lever: value and standard error of each quantity."""
    return frame_text(levers_frame(levers), float_format="%.8g")


def levers_frame(levers: xr.Dataset, more: Sequence[str] = ()) -> pd.DataFrame:
    """Return a table with one row for each lever: its quantities, and further columns."""
    columns = {
        quantity.column.item().format(kind): column.sel(quantity=quantity).reset_coords(drop=True)
        for quantity in levers.quantity
        for kind, column in (("", levers.value), ("_stderr", levers.stderr))
        if not kind or "{}" in quantity.column.item()
    }
    table = xr.Dataset({**columns, **{name: levers[name] for name in more}})
    return table.to_dataframe()
