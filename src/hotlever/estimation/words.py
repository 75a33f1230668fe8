"""Fits in words and tables: one, many side by side, and how sure they are."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np

from hotlever.estimation.levers import statements
from hotlever.materials.parameters import heading, parameter_named, scale_of, scaled_unit
from hotlever.probe.parameters import of_materials, parameters_of
from hotlever.text import NOT_DETERMINED, aligned, value_with_error

if TYPE_CHECKING:
    import xarray as xr

    from hotlever.estimation.result import Fit
    from hotlever.estimation.uncertainty import Uncertainty
    from hotlever.probe.priors import PriorUse

#: A prior is named as leaned on where its data narrow it to no less than this share, and as moved
#: where they move it by so many of its standard deviations.
_LEANED_ON, _MOVED = 0.9, 1.0
#: A parameter is called poorly determined from this relative standard error.
_POOR = 0.15
#: A parameter is at its bound within this share of it.
_AT_THE_BOUND = 1e-3
#: Two parameters are called hard to tell apart from this correlation.
_ENTANGLED = 0.95
#: What the numbers of a fit are that does not describe its data.
NEAREST = (
    "what follows is of the lever that comes nearest, and no estimate: errors are not stated, "
    "since they would not hold"
)

# Caption, columns and rows.
Table = tuple[str, list[str], list[list[str]]]


def parameter_rows(fit: Fit) -> list[tuple[str, str, str, str]]:
    """Return name, value with error, unit and a remark for each parameter of a fit."""
    rows, declared = [], parameters_of(fit.probe, in_time=True)
    for name, fitted in fit.parameters.items():
        stderr, remark = fitted.stderr, "" if fitted.vary else "fixed"
        if fitted.vary and stderr is None:
            stderr, remark = np.nan, "no error"
        value = value_with_error(fitted.value, stderr, scale_of(name), declared[name].bounds)
        rows.append((name, value, scaled_unit(name), remark))
    return rows


def conclusions(fit: Fit) -> list[str]:
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
    leaned = [name for name, use in priors.items() if use.left > _LEANED_ON]
    moved = [
        f"{name} by {use.moved:+.1f} σ to {use.posterior_value:.4g}"
        for name, use in priors.items()
        if abs(use.moved) > _MOVED
    ]
    lines = {
        "moved by the data beyond what was known before": moved,
        "as known before, since the data do not tell": leaned,
    }
    return [f"{text}: {', '.join(names)}" for text, names in lines.items() if names]


def fit_text(fit: Fit) -> str:
    """Return the result of a fit as lines of text; first that it describes no data, if so."""
    lines = [] if fit.describes_data else [fit.doubt, NEAREST]
    lines += [*aligned(parameter_rows(fit)), *conclusions(fit), *prior_lines(fit.priors)]
    return "\n".join(lines)


def undetermined(fit: Fit) -> list[str]:
    """Say in words what the data do not determine, and what that means for the tip temperature."""
    texts, declared = [], parameters_of(fit.probe, in_time=True)
    for name in fit.names:
        fitted, bounds = fit.parameters[name], declared[name].bounds
        if fitted.stderr is None:
            if fit.describes_data:
                texts.append(f"{name}: no standard error could be estimated")
        elif fitted.stderr >= abs(fitted.value):
            value = value_with_error(fitted.value, fitted.stderr, bounds=bounds)
            unit = "" if fitted.unit == "1" else f" {fitted.unit}"
            texts.append(
                f"{name} is not determined by these data: its standard error is larger than its "
                "value"
                if value == NOT_DETERMINED
                else f"{name} is only bounded by these data: {value}{unit} (95 %)"
            )
        elif (share := fitted.stderr / abs(fitted.value)) > _POOR:
            texts.append(
                f"{name} is poorly determined by these data: its standard error is {share:.0%} of "
                "its value"
            )
    of_material = [name for name in of_materials(fit.probe, in_time=True) if name in fit.names]
    texts += [
        f"{name} ended at the bound of what it may be, {bound:g} {declared[name].unit}: these "
        "data would have it beyond"
        for name in of_material
        for bound in declared[name].bounds
        if abs(fit.parameters[name].value - bound) < _AT_THE_BOUND * abs(bound)
    ]
    correlation = np.tril(fit.correlation, -1)
    texts += [
        f"{fit.names[second]} and {fit.names[first]} are hardly told apart by these "
        f"data (correlation {correlation[first, second]:+.2f})"
        for first, second in np.argwhere(np.abs(correlation) > _ENTANGLED)
    ]
    largest = float(fit.band.tip_stderr_K.max())
    if texts and np.isfinite(largest):
        texts.append(
            "the tip temperature that follows has nevertheless a standard error of at most "
            f"{largest:.1f} K from the fitted parameters"
        )
    return texts


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


def uncertainty_tables(uncertainty: Uncertainty) -> Iterator[Table]:
    """Give the intervals of profiles and the quantiles of a posterior as tables."""
    if uncertainty.profiles:
        first = next(iter(uncertainty.profiles.values()))
        columns = ["profile likelihood"]
        for level in first.level.values:
            columns += [f"{100 * level:.0f} % from", "to"]
        rows = [
            [heading(name), *_cells(profile.interval.values.ravel(), name, "open")]
            for name, profile in uncertainty.profiles.items()
        ]
        yield "Confidence intervals of the profile likelihoods.", columns, rows
    if uncertainty.posterior is not None:
        quantities, sizes = uncertainty.quantities, uncertainty.posterior.sizes
        levels = next(iter(quantities.values())).quantiles
        columns = ["posterior", *(f"{level} %" for level in levels), "effective samples", "R̂"]
        rows = [
            [
                heading(name),
                *_cells(quantity.quantiles.values(), name),
                f"{quantity.effective_sample_size:.0f}",
                f"{quantity.rhat:.3f}",
            ]
            for name, quantity in quantities.items()
        ]
        count = sizes["chain"] * sizes["draw"]
        yield f"Quantiles of {count} posterior samples.", columns, rows


def _cells(values: Iterable[float], name: str, unknown: str = "") -> list[str]:
    return [unknown if np.isnan(value) else f"{value / scale_of(name):.4g}" for value in values]


def uncertainty_text(uncertainty: Uncertainty) -> str:
    """Return the intervals of profiles and the quantiles of a posterior as lines of text."""
    tables = (aligned([columns, *rows]) for _, columns, rows in uncertainty_tables(uncertainty))
    return "\n".join(line for table in tables for line in table)
