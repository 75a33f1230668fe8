"""Report pages: of a fit with how sure it is, a calibration, many levers, and one lever in time."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import get_args

import numpy as np
import xarray as xr

from hotlever import figures
from hotlever.errors import InputError
from hotlever.estimate.estimate import Estimate
from hotlever.estimate.many import Batch, law_rows, lever_rows, statements
from hotlever.estimate.summary import (
    NEAREST,
    calibration_parts,
    conclusions,
    linear_words,
    parameter_rows,
)
from hotlever.estimate.tip_table import OF_THE_CONTACT, STATED, TABLE_COLUMNS, even_rows
from hotlever.estimate.uncertainty import Uncertainty
from hotlever.estimate.uncertainty_budget import Budget, InputQuantity, TemperatureBudget
from hotlever.lever import Lever
from hotlever.lever.transient import pulse, rise_times, simulate, spectrum, step, time_constants
from hotlever.lever.transient.frequency_domain import harmonics
from hotlever.lever.transient.modes import Source
from hotlever.materials.parameters import sentence
from hotlever.quantities import QUANTITIES
from hotlever.report.report_page import Page
from hotlever.text import significant, with_unit
from hotlever.types import Array, Progress
from hotlever.work import each


def estimate_page(estimate: Estimate) -> Page:
    """Return the report page of an estimate, be it a fit or a calibration."""
    return calibration_page(estimate) if estimate.route else fit_page(estimate)


# --- of a fit -----------------------------------------------------------------------------------


def fit_page(fit: Estimate, uncertainty: Uncertainty | None = None) -> Page:
    """Return the report page of one fit, and of what was sampled and profiled of it."""
    page = Page(
        f"Fit of {fit.measurement.path}",
        f"Material parameters of a {fit.probe.shape.shape} lever from its measured "
        f"{', '.join(fit.observables)}.",
    )
    add_fit(page, fit)
    if uncertainty is not None:
        _add_uncertainty(page, uncertainty)
    return page


def add_fit(page: Page, fit: Estimate) -> None:
    """Add tables and figures of a fit to a page."""
    if not fit.describes_data:
        page.sentences(fit.doubt, NEAREST)
    page.tabulate(_of(fit, "fit"), ("parameter", "value", "unit", ""), parameter_rows(fit))
    page.sentences(*fit.notes)
    page.text(f"{'; '.join(conclusions(fit))}.")
    (_draw_in_time if fit.in_time else _draw_at_rest)(page, fit)


def _of(estimate: Estimate, name: str) -> str:
    """Return the name of a text, that of the nearest lever where an estimate is no more."""
    return name if estimate.describes_data else f"nearest_{name}"


def _draw_at_rest(page: Page, fit: Estimate) -> None:
    measured = fit.measurement.dataset(fit.probe.circuit)
    # solved once for both
    lever = Lever(fit.probe)
    touches = fit.probe.contact is not None
    model = fit.model().sortby("bias") if touches else lever.sweep(measured.bias.values)
    page.draw("fit_data_and_model", figures.data_and_model(measured, model, fit.observables))
    _add_correlation(page, fit)
    band = figures.tip_band(fit.band, measured)
    page.draw(_of(fit, "fit_tip_band"), band, "fit_tip_band")
    low, high = measured.bias.values[[0, -1]].tolist()
    # points of a curve without visible corners
    curve = lever.sweep(np.linspace(low, high, 110))
    page.draw("fit_iv", figures.iv_curves({"model": curve}, measured=measured))
    if not fit.probe.circuit.starts_cold:
        return
    base = fit.probe.circuit.base_temperature_K
    by_power = figures.temperature_power(curve, measured=measured, base_temperature_K=base)
    page.draw("fit_temperature_power", by_power)


def _add_correlation(page: Page, fit: Estimate) -> None:
    if len(fit.names) > 1 and fit.describes_data:
        matrix = figures.correlation_matrix(fit.names, fit.correlation, fit.probe.title)
        page.draw("fit_correlation", matrix)


def _draw_in_time(page: Page, fit: Estimate) -> None:
    measured = fit.measurement.dataset(fit.probe.circuit)
    figure = figures.data_and_model(measured, fit.model(), fit.observables, fit.band)
    page.draw(_of(fit, "fit_in_time"), figure, "fit_in_time")
    _add_correlation(page, fit)


def _add_uncertainty(page: Page, uncertainty: Uncertainty) -> None:
    page.heading("How sure")
    page.sentences(*uncertainty.statements())
    for caption, columns, rows in uncertainty.tables():
        page.table(columns, rows, caption)
    fit = uncertainty.fit
    if uncertainty.profiles:
        page.draw("profiles", figures.profile_curves(list(uncertainty.profiles.values())))
    if uncertainty.posterior is not None:
        optimum = {name: fit.parameters[name].value for name in fit.names}
        optimum["inversion_temperature"] = fit.inversion_temperature_K
        page.draw("posterior", figures.posterior_corner(uncertainty.posterior, optimum))
    if uncertainty.band is not None:
        measured = fit.measurement.dataset(fit.probe.circuit)
        page.draw("tip_band_posterior", figures.tip_band(uncertainty.band, measured))


# --- of a calibration ---------------------------------------------------------------------------


def calibration_page(calibration: Estimate) -> Page:
    """Return the report page of a calibration, which two sheets of paper hold."""
    page = Page(f"Calibration of {calibration.measurement.path}")
    before, tables, after = calibration_parts(calibration)
    page.sentences("; ".join(before), *after)
    for caption, (head, *rows) in tables:
        page.table(head, rows, caption or "The standard error of the tip temperature, by source.")
    curves = figures.calibration_curves(calibration)
    page.draw(_of(calibration, "calibration"), curves, "calibration")
    names = [
        name
        for name in (*TABLE_COLUMNS, *OF_THE_CONTACT)
        if name in calibration.tip_table
        and (calibration.describes_data or not (name in STATED or "stderr" in name))
    ]
    columns = even_rows(calibration.heating, names, "tip_K", fewest=15)
    head = [f"{QUANTITIES[name].meaning} ({QUANTITIES[name].unit})" for name in names]
    rows = [[f"{value:.4g}" for value in row] for row in zip(*columns.values(), strict=True)]
    page.tabulate(_of(calibration, "calibration"), head, rows)
    if calibration.gum is not None:
        _add_largest(page, calibration.gum)
    page.sentences(*calibration.notes)
    return page


def budget_page(calibration: Estimate) -> Page:
    """Return the uncertainty budget of a temperature, with nothing left out.

    Raises
    ------
    InputError
        If the calibration has none.
    """
    stated = calibration.gum
    if stated is None:
        raise InputError(
            "an uncertainty budget: expected a calibration that describes its data, by a probe or "
            "a fit (of a tip or apex at rest; the errors of a pulse by source are in its table)"
        )
    budget = stated.budget.largest_first()
    page = Page(f"Uncertainty budget of {calibration.measurement.path}", one_sheet=True)
    page.table(
        ["", ""],
        [
            ["measurand", f"{stated.measurand}, at rest"],
            ["probe", calibration.probe.title],
            ["estimate", f"{stated.estimate_K:.1f} K"],
            ["combined standard uncertainty", f"{significant(budget.u)} K"],
            ["effective degrees of freedom", _dof(budget.dof) or "not known: rows are correlated"],
            ["coverage factor", f"{budget.coverage_factor():.2f}, for 95 %"],
            ["expanded uncertainty", f"{significant(budget.expanded())} K"],
            ["Monte Carlo method", _linear(stated) or "not done"],
        ],
        prose=True,
    )
    _add_rows(page, budget)
    if budget.correlation is not None:
        _add_row_correlation(page, budget, budget.correlation)
    page.say("budget")
    return page


def _add_largest(page: Page, stated: TemperatureBudget) -> None:
    """Add the largest contributions of an uncertainty budget."""
    budget = stated.budget.largest_first()
    free = f"{_dof(budget.dof)} effective degrees of freedom, " if np.isfinite(budget.dof) else ""
    _add_rows(
        page,
        budget,
        f"The uncertainty budget after the GUM (JCGM 100) of the {stated.measurand}, "
        f"{stated.estimate_K:.1f} K: standard uncertainty {significant(budget.u)} K, {free}"
        f"k = {budget.coverage_factor():.2f}, expanded uncertainty "
        f"{significant(budget.expanded())} K (95 %). {_linear(stated)}".rstrip(),
        most=10,
    )


def _linear(stated: TemperatureBudget) -> str:
    words = linear_words(stated)
    return words and sentence(words)


def _add_rows(page: Page, budget: Budget, caption: str = "", most: int | None = None) -> None:
    """Add the rows of a budget, but for `most` of them together; with degrees of freedom.

    Of rows that are correlated these would say nothing.
    """
    cells = [_cells(row) for row in budget.inputs[:most]]
    rest = budget.part(np.arange(len(cells), len(budget.inputs)))
    if rest.inputs:
        cells.append([f"{len(rest.inputs)} more, together", *[""] * 6, f"{rest.u:.1f}", ""])
    head = [
        *["quantity", "estimate", "prior", "u", "type", "distribution", "sensitivity"],
        "in K",
        "dof",
    ]
    columns = len(head) if budget.correlation is None else -1
    page.table(head[:columns], [row[:columns] for row in cells], caption)


def _cells(row: InputQuantity) -> list[str]:
    return [
        row.quantity,
        with_unit(f"{row.estimate:.4g}", row.unit),
        "" if row.prior is None else with_unit(f"{row.prior:.4g}", row.unit),
        with_unit(significant(row.u), row.unit),
        row.type,
        row.distribution,
        with_unit(f"{row.sensitivity:.3g}", _per(row.unit)),
        f"{row.contribution:.1f}",
        _dof(row.dof),
    ]


def _dof(dof: float) -> str:
    return f"{dof:.0f}" if np.isfinite(dof) else "∞" if np.isinf(dof) else ""


def _per(unit: str) -> str:
    """Return the unit of kelvins per another one."""
    return {"K": "1", "1": "K"}.get(unit, f"K/({unit})" if " " in unit else f"K/{unit}")


def _add_row_correlation(page: Page, budget: Budget, correlation: Array) -> None:
    """Add the correlation of those rows that are not independent of all others."""
    numbers = np.flatnonzero(np.count_nonzero(correlation, axis=0) > 1)
    among = correlation[np.ix_(numbers, numbers)]
    page.tabulate(
        "correlated_rows",
        ["", *(str(number) for number in range(1, numbers.size + 1))],
        [
            [
                f"{number} {budget.inputs[row].quantity}",
                *(str(round(100.0 * value)) for value in values),
            ]
            for number, (row, values) in enumerate(zip(numbers, among, strict=True), start=1)
        ],
    )


# --- of many levers -----------------------------------------------------------------------------


def levers_page(batch: Batch, levers: xr.Dataset) -> Page:
    """Return the report page of many levers, of which one is estimated or more.

    Parameters
    ----------
    batch : Batch
    levers : xarray.Dataset
        From `hotlever.estimate.many.compare_levers`.
    """
    count, results = levers.sizes["lever"], batch.results.values()
    by_tip = "tip_K" in levers.quantity
    if by_tip:
        page = Page(
            f"Calibrations of {count} levers",
            "Tip temperatures of levers from their I-V curves, and where they differ.",
        )
    else:
        observables = " or ".join(sorted({", ".join(fit.observables) for fit in results}))
        page = Page(
            f"Fits of {count} levers",
            f"Material parameters of levers from their measured {observables}.",
        )
    page.sentences(*statements(levers))
    if by_tip:
        page.draw("calibrated_levers", figures.calibrated_levers(batch.results, levers))
    else:
        page.draw("lever_parameters", figures.lever_parameters(levers))
    head, *rows = lever_rows(levers)
    page.tabulate("levers", head, rows)
    if by_tip:
        head, *rows = law_rows(levers)
        page.table(head, rows, "Power laws in vacuum.")
    noted = [*batch.undescribed.items()]
    noted += [(name, text) for name, each in batch.results.items() for text in each.notes]
    if noted:
        page.heading("What single levers say")
        page.table(("lever", "note"), noted, prose=True)
    if batch.failures:
        page.heading("Not estimated")
        reasons = [(path, str(error)) for path, error in batch.failures.items()]
        page.table(("file", "reason"), reasons, prose=True)
    return page


# --- of a lever in time ---------------------------------------------------------------------------


def transient_page(
    lever: Lever, progress: Progress | None = None, *, pulses: int = 10, frequencies: int = 49
) -> Page:
    """Return the page of a lever in time.

    Parameters
    ----------
    lever : Lever
    progress : callable, optional
        Called with the sections done and their number.
    pulses : int
        Of the train.
    frequencies : int
        Of spectra and harmonics, from 10 Hz to 10 MHz.

    Raises
    ------
    ComputationError
        If the lever cannot be solved or followed.
    """
    branch = lever.branch_past_knee()
    knee = branch.knee
    highest = float(
        branch.bias([branch.hottest_K], lever.circuit)[0]
        if knee is None
        else lever.circuit.bias(knee.lever_V, knee.current_mA)
    )
    # shares of the bias of the knee: beyond it a lever may run away
    biases = [round(share * highest, 2) for share in (0.25, 0.5, 0.75, 0.9)]
    page = Page(
        "A lever in time",
        f"A {lever.probe.shape.shape} lever in {lever.medium}, with "
        f"{lever.circuit.series_resistance_ohm:g} Ω in series. "
        + (
            f"Biases are shares of {highest:.2f} V, where it is hottest."
            if knee is None
            else f"Biases are shares of {highest:.2f} V, that of its knee."
        ),
    )
    swept_Hz = np.geomspace(10.0, 1e7, frequencies)
    sections: dict[str, Callable[[Page, Lever, list[float]], None]] = {
        "A step": _step,
        "A train of pulses": partial(_train, count=pulses),
        "Time constants": _time_constants,
        "Small signals": partial(_small_signals, frequencies_Hz=swept_Hz),
        "Harmonics": partial(_harmonics, frequencies_Hz=swept_Hz),
    }
    for heading, section in each(sections.items(), progress):
        page.heading(heading)
        section(page, lever, biases)
    return page


def _step(page: Page, lever: Lever, biases: list[float]) -> None:
    bias = biases[-1]
    history = simulate(lever, step(bias), per_step=8)
    page.draw("step", figures.history_overview(history), bias=bias)
    times = [1.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0]
    rows = []
    for bias in biases:
        tip = simulate(lever, step(bias), at=times).tip_K.values
        rows.append([f"{bias:g}", *(f"{value:.0f}" for value in tip)])
    heads = ["bias (V)", *(f"{time:g} µs" for time in times)]
    page.tabulate("step", heads, rows)
    page.sentences(*filter(None, history.attrs["notes"].split("\n")))


def _train(page: Page, lever: Lever, biases: list[float], count: int) -> None:
    wave = pulse(biases[-1], 5.0, 50.0, count)
    history = simulate(lever, wave, per_step=8)
    page.figure("train", figures.history_overview(history), f"{sentence(wave.text)}")
    accounted_nJ = history.stored_nJ + history.air_stored_nJ + history.lost_nJ
    off = float(np.abs(history.supplied_nJ - accounted_nJ).max() / history.supplied_nJ.max())
    page.say("train", off=off)


def _time_constants(page: Page, lever: Lever, biases: list[float]) -> None:
    columns = {
        source: time_constants(lever, biases, source, count=1) for source in get_args(Source)
    }
    times = rise_times(lever, biases)
    rows = []
    for index, bias in enumerate(biases):
        slowest = [constants.time_constant_us.values[index, 0] for constants in columns.values()]
        around = [times.heating_us.values[index], times.cooling_us.values[index]]
        tip = times.tip_K.values[index]
        rows.append([f"{bias:g}", f"{tip:.0f}", *(f"{time:.1f}" for time in (*slowest, *around))])
    held = [f"{source} held" for source in columns]
    heads = ["bias (V)", "tip (K)", *held, "heating", "cooling"]
    page.tabulate("time_constants", heads, rows)


def _small_signals(page: Page, lever: Lever, biases: list[float], frequencies_Hz: Array) -> None:
    for bias in (biases[1], biases[-1]):
        (state,) = lever.solve([bias])
        figure = figures.small_signals(spectrum(state, frequencies_Hz))
        page.draw("spectrum", figure, f"spectrum_{bias:g}V", bias=bias, tip_K=state.tip_K)


def _harmonics(page: Page, lever: Lever, biases: list[float], frequencies_Hz: Array) -> None:
    bias = biases[1]
    drive = 0.05 * bias
    figure = figures.harmonics(harmonics(lever, bias, drive, frequencies_Hz))
    page.draw("harmonics", figure, drive=drive, bias=bias)
