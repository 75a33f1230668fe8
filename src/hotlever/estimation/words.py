"""Fits in words and tables: one, many side by side, and how sure they are."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np

from hotlever.estimation.levers import statements
from hotlever.probe.parameters import of_materials, parameters_of
from hotlever.text import (
    NOT_DETERMINED,
    aligned,
    heading,
    parameter_named,
    scale_of,
    scaled_unit,
    value_with_error,
)

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
    inversion = value_with_error(fit.inversion_temperature_K, fit.inversion_temperature_stderr_K)
    has_one = np.isfinite(fit.inversion_temperature_K)
    rms = (
        f"{name.rsplit('_', 1)[0]} {value:.3g} {name.rsplit('_', 1)[1]}"
        for name, value in fit.residual_rms.items()
    )
    return [
        *_tip_in_time(fit),
        *([f"inversion temperature: {inversion} K"] if has_one else []),
        f"rms of data - model: {', '.join(rms)}",
        f"fitted to {', '.join(fit.observables)} in {fit.steps} steps, {fit.seconds:.1f} s",
    ]


def _tip_in_time(fit: Fit) -> list[str]:
    """Say how hot the tip became, if it was followed in time."""
    if not fit.in_time:
        return []
    hottest, last = fit.band.isel(time=fit.band.tip_K.argmax("time")), fit.band.isel(time=-1)
    said = [
        f"{value_with_error(one.tip_K.item(), one.tip_stderr_K.item())} K after "
        f"{one.time_us.item():.4g} µs"
        for one in (hottest, last)
    ]
    if hottest.time_us.item() == last.time_us.item():
        return [f"tip temperature: {said[0]}, at its hottest and last"]
    return [f"tip temperature: {said[0]}, at its hottest, {said[1]}, at last"]


def prior_lines(priors: Mapping[str, PriorUse]) -> list[str]:
    """Say which priors an answer leans on, and which the data moved far."""
    leaned, moved = [], []
    for name, use in priors.items():
        if use.left > _LEANED_ON:
            leaned.append(name)
        if abs(use.moved) > _MOVED:
            moved.append(f"{name} by {use.moved:+.1f} σ to {use.posterior_value:.4g}")
    lines = []
    if moved:
        lines.append(f"moved by the data beyond what was known before: {', '.join(moved)}")
    if leaned:
        lines.append(f"as known before, since the data do not tell: {', '.join(leaned)}")
    return lines


def fit_text(fit: Fit) -> str:
    """Return the result of a fit as lines of text; first that it describes no data, if so."""
    lines = [] if fit.describes_data else [fit.doubt, NEAREST]
    lines += [*aligned(parameter_rows(fit)), *conclusions(fit), *prior_lines(fit.priors)]
    return "\n".join(lines)


def undetermined(fit: Fit) -> list[str]:
    """Say in words what the data do not determine, and what that means for the tip temperature."""
    found, declared = [], parameters_of(fit.probe, in_time=True)
    for name in fit.names:
        fitted = fit.parameters[name]
        if fitted.stderr is None:
            if fit.describes_data:
                found.append(f"{name}: no standard error could be estimated")
        elif fitted.stderr >= abs(fitted.value):
            said = value_with_error(fitted.value, fitted.stderr, bounds=declared[name].bounds)
            unit = "" if fitted.unit == "1" else f" {fitted.unit}"
            found.append(
                f"{name} is not determined by these data: its standard error is larger than its "
                "value"
                if said == NOT_DETERMINED
                else f"{name} is only bounded by these data: {said}{unit} (95 %)"
            )
        elif (share := fitted.stderr / abs(fitted.value)) > _POOR:
            found.append(
                f"{name} is poorly determined by these data: its standard error is {share:.0%} of "
                "its value"
            )
    for name, known in of_materials(fit.probe, in_time=True).items():
        if name not in fit.names:
            continue
        value = fit.parameters[name].value
        for bound in (known.lower, known.upper):
            if abs(value - bound) < _AT_THE_BOUND * abs(bound):
                found.append(
                    f"{name} ended at the bound of what it may be, {bound:g} {known.unit}: these "
                    "data would have it beyond"
                )
    correlation = np.tril(fit.correlation, -1)
    for first, second in np.argwhere(np.abs(correlation) > _ENTANGLED):
        found.append(
            f"{fit.names[second]} and {fit.names[first]} are hardly told apart by these "
            f"data (correlation {correlation[first, second]:+.2f})"
        )
    largest = float(fit.band.tip_stderr_K.max())
    if found and np.isfinite(largest):
        found.append(
            "the tip temperature that follows has nevertheless a standard error of at most "
            f"{largest:.1f} K from the fitted parameters"
        )
    return found


def lever_rows(levers: xr.Dataset) -> list[list[str]]:
    """Return the table of `compare_levers`: columns, levers, then the mean and the scatter."""
    names = levers.quantity.values.tolist()
    scales = np.array([scale_of(name) for name in names])
    bounds = [parameter_named(name).bounds for name in names]
    rows = [["lever", *map(heading, names)]]
    means = levers["mean"].values, levers.mean_stderr.values
    of_levers = zip(levers.value.values, levers.stderr.values, strict=True)
    labels = [*map(str, levers.lever.values), "weighted mean"]
    for label, (values, errors) in zip(labels, [*of_levers, means], strict=True):
        cells = zip(values, errors, scales, bounds, strict=True)
        rows.append([label, *("" if np.isnan(one[0]) else value_with_error(*one) for one in cells)])
    scatter = levers.scatter.values
    for label, numbers, form in (
        ("scatter between levers", scatter / scales, ".3g"),
        ("scatter, relative", scatter / np.abs(levers["mean"].values), ".1%"),
        ("Birge ratio", levers.birge_ratio.values, ".2g"),
    ):
        rows.append([label, *("" if np.isnan(one) else f"{one:{form}}" for one in numbers)])
    return rows


def levers_text(levers: xr.Dataset) -> str:
    """Return the table of many levers and what follows from it as lines of text."""
    lines = aligned(lever_rows(levers))
    lines.insert(1 + levers.sizes["lever"], "-" * max(map(len, lines)))
    return "\n".join(lines + statements(levers))


def uncertainty_tables(found: Uncertainty) -> Iterator[Table]:
    """Give the intervals of profiles and the quantiles of a posterior as tables."""
    if found.profiles:
        first = next(iter(found.profiles.values()))
        columns = ["profile likelihood"]
        for level in first.level.values:
            columns += [f"{100 * level:.0f} % from", "to"]
        rows = [
            [heading(name), *_cells(profile.interval.values.ravel(), name, "open")]
            for name, profile in found.profiles.items()
        ]
        yield "Confidence intervals of the profile likelihoods.", columns, rows
    if found.posterior is not None and found.band is not None:
        posterior, quantiles = found.posterior, found.band["quantile"].values
        columns = ["posterior", *(f"{quantile:g} %" for quantile in quantiles)]
        columns += ["effective samples", "R̂"]
        rows = []
        for name in posterior.quantity.values.tolist():
            one, cells = posterior.sel(quantity=name), np.percentile(posterior[name], quantiles)
            settled = f"{one.effective_sample_size.item():.0f}", f"{one.rhat.item():.3f}"
            rows.append([heading(name), *_cells(cells, name), *settled])
        count = posterior.sizes["chain"] * posterior.sizes["draw"]
        yield f"Quantiles of {count} posterior samples.", columns, rows


def _cells(values: np.ndarray, name: str, unknown: str = "") -> list[str]:
    return [unknown if np.isnan(value) else f"{value / scale_of(name):.4g}" for value in values]


def uncertainty_text(found: Uncertainty) -> str:
    """Return the intervals of profiles and the quantiles of a posterior as lines of text."""
    tables = (aligned([columns, *rows]) for _, columns, rows in uncertainty_tables(found))
    return "\n".join(line for table in tables for line in table)
