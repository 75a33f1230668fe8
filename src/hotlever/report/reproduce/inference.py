"""What follows from measurements: fits, the thermometer, and calibrations of levers never seen."""

from __future__ import annotations

from importlib.resources import as_file, files
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from hotlever.estimate import Fit, Measurement, fit
from hotlever.estimate.fit_summary import parameter_rows
from hotlever.figures import correlation_matrix, judged_calibrations, raman_check, thermometry
from hotlever.materials import PARAMETERS
from hotlever.raman import Thermometer, calibrate_from, measure, read_lines, read_spectra
from hotlever.report.fit_pages import add_fit
from hotlever.report.reproduce.findings import Findings, example
from hotlever.report.reproduce.vacuum import PARAMETER_COLUMNS
from hotlever.spieser2017 import NOMINAL_DOPING
from hotlever.steps import each
from hotlever.studies.raman_check import conclusion, paper_check
from hotlever.studies.simulation_based_calibration import (
    DEPARTURES,
    ESTIMATE,
    LEVELS,
    WAYS,
    concatenated,
    judge,
    summary,
)

#: Levers of the page, and of its quick form; each is made with either law of the mobility.
_MANY, _FEW = 12, 2
#: What a lever departs in that has the mobility of the model.
_EQ8 = tuple(name for name in DEPARTURES if name != "mobility")
#: Less than this of the true temperatures in the 95 % band: the band is too narrow.
_TOO_FEW = 0.85


def fit_section(page: Findings) -> None:
    """Option III on the virtual lab's first lever."""
    page.say("fit")
    result = page.fitted_example
    add_fit(page, result)
    page.claim("cost_of_a_fit", holds=result.seconds > 3600.0, fit=result)


def data_section(page: Findings) -> None:
    """Options I to III on both levers of the virtual lab (Figs. 3 and 4, Table I)."""
    page.say("options")
    for name in ("lever-a.csv", "lever-b.csv"):
        _compare_options(page, example(name))


def _compare_options(page: Findings, measurement: Measurement) -> None:
    name = Path(measurement.path).stem
    choices: dict[str, dict[str, Any]] = {
        "I": {"observables": ["current"]},
        "II": {"observables": ["current", "reader"]},
        "III": {},
        "III, n_d fixed": {"fixed": {"n_d": NOMINAL_DOPING}},
    }
    probe, rows, coupling = page.lever.probe, [], []
    fits = {option: fit(measurement, probe, **choice) for option, choice in choices.items()}
    for option, result in fits.items():
        cells = [value for _, value, _, _ in parameter_rows(result)]
        inversion, rms = result.inversion_temperature_K, result.residual_rms["tip_K"]
        rows.append((f"option {option}", *cells, f"{inversion:.0f}", f"{rms:.1f}"))
        one_noise, own_noise = _between_groups(result)
        errors = (f"{one_noise:.2f}", f"{own_noise:.2f}", f"{_hot_error(result):.0f}")
        coupling.append((option, *errors))
    columns = [name, *PARAMETER_COLUMNS, "T_i (K)", "rms T_tip (K)"]
    page.tabulate("options", columns, rows, name=name)
    for option in ("I", "II", "III"):
        result = fits[option]
        figure = correlation_matrix(result.names, result.common_noise_correlation)
        file = f"{name}_correlation_{option}"
        page.draw("correlation", figure, file, name=name, option=option)
    columns = ["option", "strongest correlation between groups, one noise for all"]
    columns += ["the same, each observable its own noise", "largest T_tip error above 850 K (K)"]
    page.tabulate("coupling", columns, coupling, name=name)
    _option_claims(page, name, fits)
    free, held = fits["III"].parameters, fits["III, n_d fixed"].parameters
    changes = ", ".join(
        f"{PARAMETERS[key].symbol} {held[key].value / free[key].value - 1:+.1%}"
        for key in PARAMETERS
        if key != "n_d"
    )
    page.say("doping_held", name=name, changes=changes)


def _option_claims(page: Findings, name: str, fits: dict[str, Fit]) -> None:
    (first, _), (third, own) = _between_groups(fits["I"]), _between_groups(fits["III"])
    page.claim("dependent_parameters", holds=first > 0.8, name=name, first=first)
    page.claim("decoupled_groups", holds=third < 0.6, name=name, third=third, own=own)
    first, third = (_hot_error(fits[option]) for option in ("I", "III"))
    page.claim("current_alone", holds=first > 1.5 * third, name=name, first=first, third=third)
    free, held = fits["III"], fits["III, n_d fixed"]
    shift_K = abs(held.inversion_temperature_K - free.inversion_temperature_K)
    worse = held.residual_rms["tip_K"] - free.residual_rms["tip_K"]
    page.claim("doping_held", holds=worse < 2.0, name=name, shift_K=shift_K, worse=worse)


def _between_groups(result: Fit) -> list[float]:
    """Largest absolute correlation between parameters of different groups.

    The first number is that from one noise for all observables, the second from one for each.
    """
    group = {"c_kappa": 0, "a0": 1, "a1": 1, "delta": 2, "n_d": 2, "p": 2}
    groups = np.array([group[name] for name in result.names])
    apart = groups[:, None] != groups[None, :]
    correlations = (result.common_noise_correlation, result.correlation)
    return [float(np.abs(correlation[apart]).max()) for correlation in correlations]


def _hot_error(result: Fit) -> float:
    """Largest difference of predicted and measured tip temperature above 850 K."""
    order = np.argsort(result.measurement.bias_V)
    measured = result.measurement.tip_K[order]
    return float(np.nanmax(np.abs(measured - result.band.tip_K.values)[measured > 850]))


def thermometer_section(page: Findings) -> None:
    """Fig. 2, and what the linear law does beyond its calibration."""
    with as_file(files("hotlever") / "examples" / "raman") as folder:
        calibration, series = calibrate_from(read_spectra([folder / "hot-plate"]))
        lines = measure(read_spectra([folder / "tip"]), calibration.options)
    table = read_lines(lines, Thermometer(calibration, "anharmonic"))
    page.draw("raman_calibration", thermometry(lines, table, calibration, series))
    check = paper_check()
    page.draw("raman_check", raman_check(check), conclusion=conclusion(check))

    published = check.isel(line=0)
    off, explained = abs(published.error_at_hottest.item()), published.explained.item()
    page.claim("raman_law", holds=off < 25.0, published=published)
    page.claim("knee_by_raman", holds=explained < 0.25, published=published)


def levers_section(page: Findings) -> None:
    """Levers with more physics than the model, calibrated from their I-V curve."""
    count = _FEW if page.quick else _MANY
    page.say("levers", count=count)
    cases = [(number, law) for law in (_EQ8, tuple(DEPARTURES)) for number in range(count)]
    judged = concatenated(
        [judge(number, departures=law) for number, law in each(cases, page.progress)]
    )
    by_law = [summary(judged.isel(lever=judged.other_law.values == law)) for law in (False, True)]
    for total, law in zip(by_law, ("the mobility of Eq. 8", "the other law"), strict=True):
        _say_errors(page, total, law)
    page.draw("simulated-levers", judged_calibrations(judged))
    rows = []
    for way in WAYS:
        cells = [f"{value:.0f}" for total in by_law for value in total.largest_K.sel(way=way)]
        rows.append((way, *cells, "no" if way == ESTIMATE else "yes"))
    numbers = [f"{law}{n}" for law in ("", "other law, ") for n in ("median", "90 %", "worst")]
    page.tabulate("ways", ("largest error (K)", *numbers, "needs a knee"), rows)


def _say_errors(page: Findings, total: xr.Dataset, law: str) -> None:
    """Say how wrong the ways are with a law of the mobility, and whether the stated errors hold."""
    median = {way: total.largest_K.sel(way=way, percentile=50).item() for way in WAYS}
    best, *_, worst = sorted(WAYS[1:], key=median.__getitem__)
    in_68, in_95 = (total.coverage.sel(level=level).mean().item() for level in LEVELS)
    narrow = "; the stated errors do not cover this departure from the model"
    page.say(
        "errors",
        law=law,
        estimate=median[ESTIMATE],
        in_68=in_68,
        in_95=in_95,
        best=best,
        best_K=median[best],
        worst=worst,
        worst_K=median[worst],
        narrow=narrow if in_95 < _TOO_FEW else "",
    )
