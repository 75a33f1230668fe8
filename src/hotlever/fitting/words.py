"""Fits in words and tables: one, many side by side, and how sure they are."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np

from hotlever.fitting.levers import statements
from hotlever.text import aligned, heading, scale_of, scaled_unit, value_with_error

if TYPE_CHECKING:
    import xarray as xr

    from hotlever.fitting.result import Fit
    from hotlever.fitting.uncertainty import Uncertainty
    from hotlever.probe.priors import PriorUse

#: A prior is named as leaned on where its data narrow it to no less than this share, and as moved
#: where they move it by so many of its standard deviations.
_LEANED_ON, _MOVED = 0.9, 1.0

# Caption, columns and rows.
Table = tuple[str, list[str], list[list[str]]]


def parameter_rows(fit: Fit) -> list[tuple[str, str, str, str]]:
    """Return name, value with error, unit and a remark for each parameter of a fit."""
    rows = []
    for name, fitted in fit.parameters.items():
        value = value_with_error(fitted.value, fitted.stderr, scale_of(name))
        rows.append((name, value, scaled_unit(name), "" if fitted.vary else "fixed"))
    return rows


def outcome(fit: Fit) -> list[str]:
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
        if use.posterior_spread > _LEANED_ON * use.spread:
            leaned.append(name)
        away = (use.posterior_value - use.value) / use.spread
        if abs(away) > _MOVED:
            moved.append(f"{name} by {away:+.1f} σ to {use.posterior_value:.4g}")
    lines = []
    if moved:
        lines.append(f"moved by the data beyond what was known before: {', '.join(moved)}")
    if leaned:
        lines.append(f"as known before, since the data do not tell: {', '.join(leaned)}")
    return lines


def fit_text(fit: Fit) -> str:
    """Return the result of a fit as lines of text; first that it describes no data, if so."""
    doubt = [] if fit.describes_data else [f"no such lever shows these data: {fit.reason}"]
    found = [*aligned(parameter_rows(fit)), *outcome(fit), *prior_lines(fit.priors)]
    return "\n".join([*doubt, *found])


def lever_rows(levers: xr.Dataset) -> list[list[str]]:
    """Return the table of `compare_levers`: columns, levers, then the mean and the scatter."""
    names = levers.quantity.values.tolist()
    scales = np.array([scale_of(name) for name in names])
    rows = [["lever", *map(heading, names)]]
    for lever in levers.lever.values:
        one = levers.sel(lever=lever)
        pairs = zip(one.value.values, one.stderr.values, scales, strict=True)
        rows.append([str(lever), *(value_with_error(*pair) for pair in pairs)])
    mean, scatter = levers["mean"].values, levers.scatter.values
    for label, numbers, form in (
        ("mean", mean / scales, ".3g"),
        ("scatter between levers", scatter / scales, ".3g"),
        ("mean standard error", levers.mean_stderr.values / scales, ".3g"),
        ("scatter, relative", scatter / np.abs(mean), ".1%"),
    ):
        cells = ("" if np.isnan(number) else f"{number:{form}}" for number in numbers)
        rows.append([label, *cells])
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
