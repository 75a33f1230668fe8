"""The report pages of fits: of one, with how sure it is, and of many levers (Table II)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from hotlever import figures
from hotlever.estimate.estimate import Estimate
from hotlever.estimate.fit_summary import (
    NEAREST,
    compare_levers,
    conclusions,
    lever_rows,
    parameter_rows,
    statements,
)
from hotlever.estimate.many import Batch
from hotlever.estimate.uncertainty import Uncertainty
from hotlever.lever import Lever
from hotlever.materials.parameters import INVERSION
from hotlever.report.report_page import Block, Page

#: Points of a curve without visible corners.
_POINTS = 110


def fit_page(
    fit: Estimate,
    uncertainty: Uncertainty | None = None,
    added: Callable[[Block], None] | None = None,
) -> Page:
    """Return the report page of one fit, and of what was sampled and profiled of it.

    It takes a second; ``added`` is called with each block as soon as it is there.
    """
    page = Page(
        f"Fit of {fit.measurement.path}",
        f"Material parameters of a {fit.probe.shape.shape} lever from its measured "
        f"{', '.join(fit.observables)}.",
        added,
    )
    add_fit(page, fit)
    if uncertainty is not None:
        _add_uncertainty(page, uncertainty)
    return page


def add_fit(page: Page, fit: Estimate) -> None:
    """Add tables and figures of a fit to a page."""
    if not fit.describes_data:
        page.sentences(fit.doubt, NEAREST)
    page.table(
        ("parameter", "value", "unit", ""),
        parameter_rows(fit),
        "Material parameters; standard errors in units of the last digits."
        if fit.describes_data
        else "Material parameters of the nearest lever.",
    )
    page.sentences(*fit.notes)
    page.text(f"{'; '.join(conclusions(fit))}.")
    (_draw_in_time if fit.in_time else _draw_at_rest)(page, fit)


def _draw_at_rest(page: Page, fit: Estimate) -> None:
    measured = fit.measurement.dataset(fit.probe.circuit)
    # solved once for both
    lever = Lever(fit.probe)
    touches = fit.probe.contact is not None
    model = fit.model().sortby("bias") if touches else lever.sweep(measured.bias.values)
    page.figure(
        "fit_data_and_model",
        figures.data_and_model(measured, model, fit.observables),
        "Measured and modelled observables against bias, and their difference. "
        "Grey: the stated error of the measured temperature.",
    )
    _add_correlation(page, fit)
    page.figure(
        "fit_tip_band",
        figures.tip_band(fit.band, measured),
        "The tip temperature that the fit predicts, with the band that follows from the "
        "covariance of the parameters (model errors not included)."
        if fit.describes_data
        else "The tip temperature of the nearest lever, which is no estimate.",
    )
    low, high = measured.bias.values[[0, -1]].tolist()
    curve = lever.sweep(np.linspace(low, high, _POINTS))
    page.figure(
        "fit_iv",
        figures.iv_curves({"model": curve}, measured=measured),
        "Heater current against lever voltage.",
    )
    if not fit.probe.circuit.starts_cold:
        return
    base = fit.probe.circuit.base_temperature_K
    page.figure(
        "fit_temperature_power",
        figures.temperature_power(curve, measured=measured, base_temperature_K=base),
        "Tip temperature against the power dissipated in the lever, beside the published law.",
    )


def _add_correlation(page: Page, fit: Estimate) -> None:
    if len(fit.names) < 2 or not fit.describes_data:
        return
    page.figure(
        "fit_correlation",
        figures.correlation_matrix(fit.names, fit.correlation, fit.probe.title),
        "Correlation of the fitted parameters.",
    )


def _draw_in_time(page: Page, fit: Estimate) -> None:
    measured = fit.measurement.dataset(fit.probe.circuit)
    page.figure(
        "fit_in_time",
        figures.data_and_model(measured, fit.model(), fit.observables, fit.band),
        "Measured and modelled observables against time, and their difference; and the tip "
        + (
            "temperature that the fit predicts, with the 95 % band that follows from the "
            "covariance of the parameters (model errors not included)."
            if fit.describes_data
            else "temperature of the nearest lever, which is no estimate."
        ),
    )
    _add_correlation(page, fit)


def _add_uncertainty(page: Page, uncertainty: Uncertainty) -> None:
    page.heading("How sure")
    page.sentences(*uncertainty.statements())
    for caption, columns, rows in uncertainty.tables():
        page.table(columns, rows, caption)
    fit = uncertainty.fit
    if uncertainty.profiles:
        page.figure(
            "profiles",
            figures.profile_curves(list(uncertainty.profiles.values())),
            "Profile likelihoods: how much worse the fit gets with one parameter held and the "
            "others fitted again, beside the parabola of the standard error.",
        )
    if uncertainty.posterior is not None:
        optimum = {name: fit.parameters[name].value for name in fit.names}
        page.figure(
            "posterior",
            figures.posterior_corner(
                uncertainty.posterior, {**optimum, INVERSION: fit.inversion_temperature_K}
            ),
            "Posterior of each quantity and pair. Above each histogram: its median and half of "
            "its 68 % interval.",
        )
    if uncertainty.band is not None:
        page.figure(
            "tip_band_posterior",
            figures.tip_band(uncertainty.band, fit.measurement.dataset(fit.probe.circuit)),
            "Tip temperature that follows from the posterior, against bias and power (model "
            "errors not included).",
        )


def levers_page(batch: Batch) -> Page:
    """Return the report page of many levers, of which one is fitted or more."""
    levers = compare_levers(batch.results)
    observables = {fit.observables for fit in batch.results.values()}
    page = Page(
        f"Fits of {levers.sizes['lever']} levers",
        "Material parameters of levers from their measured "
        f"{' or '.join(', '.join(names) for names in sorted(observables))}.",
    )
    page.sentences(*statements(levers))
    page.figure(
        "lever_parameters",
        figures.lever_parameters(levers),
        "Each fitted parameter by lever, and the inversion temperature that follows.",
    )
    columns, *rows = lever_rows(levers)
    page.table(columns, rows, "Standard errors in units of the last digits.")
    add_remarks(page, batch, "fit", "fitted")
    return page


def add_remarks(page: Page, batch: Batch, result: str, participle: str) -> None:
    """Add to a page of many levers what their results say, and what could not be made."""
    noted = [*batch.undescribed.items()]
    noted += [(name, text) for name, each in batch.results.items() for text in each.notes]
    if noted:
        page.heading(f"What single {result}s say")
        page.table(("lever", "note"), noted, prose=True)
    if batch.failures:
        page.heading(f"Not {participle}")
        reasons = [(path, str(error)) for path, error in batch.failures.items()]
        page.table(("file", "reason"), reasons, prose=True)
