"""Posterior and profiles of a fit, in words, tables and figures."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from hotlever.fitting.posterior import BAND_QUANTILES
from hotlever.fitting.uncertainty import Uncertainty
from hotlever.materials import PARAMETERS
from hotlever.report.fit_report import scaled_unit, sentence
from hotlever.report.page import Page
from hotlever.report.uncertainty_figures import (
    posterior_corner,
    predictive_bands,
    profile_curves,
)

#: Caption, columns and rows.
Table = tuple[str, list[str], list[list[str]]]


def uncertainty_text(found: Uncertainty) -> str:
    """Return the intervals of profiles and the quantiles of a posterior as lines of text."""
    lines = []
    for _, columns, rows in _tables(found):
        widths = [max(map(len, column)) for column in zip(columns, *rows, strict=True)]
        lines += [
            "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
            for row in (columns, *rows)
        ]
    return "\n".join(lines)


def add_uncertainty(page: Page, found: Uncertainty) -> None:
    """Add what was sampled and profiled of a fit to its page."""
    page.heading("How sure")
    for text in found.statements():
        page.text(sentence(text))
    for caption, columns, rows in _tables(found):
        page.table(columns, rows, caption)
    if found.profiles:
        page.figure(
            "profiles",
            profile_curves(list(found.profiles.values())),
            "Profile likelihoods: how much worse the fit gets with one parameter held and the "
            "others fitted again, beside the parabola of the standard error.",
        )
    if found.posterior is not None:
        page.figure(
            "posterior",
            posterior_corner(found.posterior, found.fit),
            "Posterior of each quantity and pair. Above each histogram: its median and half of "
            "its 68 % interval.",
        )
    if found.band is not None:
        page.figure(
            "tip_band_posterior",
            predictive_bands(
                found.band, found.fit.measurement, found.fit.probe.circuit.series_resistance_ohm
            ),
            "Tip temperature that follows from the posterior, against bias and power (model "
            "errors not included).",
        )


def _tables(found: Uncertainty) -> Iterator[Table]:
    if found.profiles:
        first = next(iter(found.profiles.values()))
        columns = ["profile likelihood"]
        for level in first.level.values:
            columns += [f"{100 * level:.0f} % from", "to"]
        rows = [
            [_label(name), *_cells(profile.interval.values.ravel(), name, "open")]
            for name, profile in found.profiles.items()
        ]
        yield "Confidence intervals of the profile likelihoods.", columns, rows
    if found.posterior is not None:
        posterior = found.posterior
        columns = ["posterior", *(f"{quantile:g} %" for quantile in BAND_QUANTILES)]
        columns += ["effective samples", "R̂"]
        rows = [
            [
                _label(name),
                *_cells(np.percentile(posterior[name], BAND_QUANTILES), name),
                f"{posterior.effective_sample_size.sel(quantity=name).item():.0f}",
                f"{posterior.rhat.sel(quantity=name).item():.3f}",
            ]
            for name in posterior.quantity.values.tolist()
        ]
        count = posterior.sizes["chain"] * posterior.sizes["draw"]
        yield f"Quantiles of {count} posterior samples.", columns, rows


def _label(name: str) -> str:
    if name not in PARAMETERS:
        return "T_i (K)"
    unit = scaled_unit(name)
    return f"{name} ({unit})" if unit else name


def _cells(values: np.ndarray, name: str, unknown: str = "") -> list[str]:
    scale = PARAMETERS[name].scale if name in PARAMETERS else 1.0
    return [unknown if np.isnan(value) else f"{value / scale:.4g}" for value in values]
