"""A fit in words and tables: its parameters, what they lean on, what the data leave open."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr

from hotlever.estimation.result import Fit
from hotlever.materials.parameters import scale_of, scaled_unit
from hotlever.probe.parameters import of_materials, parameters_of
from hotlever.probe.priors import PriorUse
from hotlever.text import NOT_DETERMINED, aligned, value_with_error, with_unit

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
            texts.append(
                f"{name} is not determined by these data: its standard error is larger than its "
                "value"
                if value == NOT_DETERMINED
                else f"{name} is only bounded by these data: {with_unit(value, fitted.unit)} (95 %)"
            )
        elif (share := fitted.stderr / abs(fitted.value)) > _POOR:
            texts.append(
                f"{name} is poorly determined by these data: its standard error is {share:.0%} of "
                "its value"
            )
    of_material = [name for name in of_materials(fit.probe, in_time=True) if name in fit.names]
    texts += [
        f"{name} ended at the bound of what it may be, "
        f"{with_unit(f'{bound:g}', declared[name].unit)}: these data would have it beyond"
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
