"""The lever in vacuum: parameters, operating points, characteristics, knee, balances, inference."""

from __future__ import annotations

from importlib.resources import as_file, files
from typing import Any

import numpy as np
import xarray as xr

from hotlever import figures
from hotlever import spieser2017 as paper
from hotlever.estimate import Estimate, fit
from hotlever.estimate.power_law import EQ12, PowerLaw, fit_power_law
from hotlever.estimate.summary import parameter_rows
from hotlever.figures import correlation_matrix, judged_calibrations, raman_check, thermometry
from hotlever.lever import Lever
from hotlever.lever.fields import heater_profile
from hotlever.materials import PARAMETERS, PUBLISHED
from hotlever.materials.silicon import inversion_temperature
from hotlever.probe import MeshOptions
from hotlever.raman import Thermometer, calibrate_from, measure, read_lines, read_spectra
from hotlever.report.reproduce.findings import Findings, example
from hotlever.report.result_pages import add_fit
from hotlever.spieser2017 import NOMINAL_DOPING
from hotlever.studies.knee_study import reasons_of_the_knee, steps_to_the_knee
from hotlever.studies.published_lever.ensemble import REFERENCE, stored_ensemble
from hotlever.studies.published_lever.statements import GROUPS, WELL_COVERED_MW
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
from hotlever.text import value_with_error

#: Headings of the six parameters, in units of their scale.
PARAMETER_COLUMNS = ("c_κ", "Δ (µm)", "n_d (1e17 cm⁻³)", "p", "a₀ (1e-4 Ω cm)", "a₁ (1e-6 Ω cm/K)")


def probe_section(page: Findings) -> None:
    """The layout."""
    page.draw("probe", figures.probe_drawing(page.lever.space.mesh.layout))


def parameter_section(page: Findings) -> None:
    """Tables I and II, and T_i from their values."""
    rows, away = [], []
    for entry in PUBLISHED.values():
        material, error = entry.material, entry.standard_error
        ours = float(inversion_temperature(material.n_d, material.p))
        printed = entry.inversion_temperature_K
        if printed is not None:
            away.append(abs(ours - printed))
        values = (
            value_with_error(getattr(material, name), error.get(name), parameter.scale)
            for name, parameter in PARAMETERS.items()
        )
        printed_cell = "" if printed is None else f"{printed:.0f}"
        rows.append((entry.name, *values, printed_cell, f"{ours:.1f}"))
    page.tabulate("parameters", ("set", *PARAMETER_COLUMNS, "T_i published (K)", "T_i (K)"), rows)
    page.claim("inversion_temperatures", holds=max(away) < 1.0, away=max(away))


def published_biases(lever: Lever) -> list[float]:
    """Bias V_l + R_s I_h of each published operating point, in the lever's circuit."""
    return [lever.circuit.bias(point.lever_V, point.current_mA) for point in paper.OPERATING_POINTS]


def operating_points_section(page: Findings) -> None:
    """The three published points."""
    ours = page.lever.sweep(published_biases(page.lever))
    rows, away = [], []
    for index, point in enumerate(paper.OPERATING_POINTS):
        bias, lever_V, current_mA, tip_K = _point(ours.isel(bias=index))
        off_V, off_mA = lever_V / point.lever_V - 1, current_mA / point.current_mA - 1
        away += [abs(off_V), abs(off_mA)]
        volts = (f"{point.lever_V:.2f}", f"{lever_V:.3f} ({off_V:+.2%})")
        current = (f"{point.current_mA:.2f}", f"{current_mA:.3f} ({off_mA:+.2%})")
        published_K = "" if point.tip_K is None else f"{point.tip_K:.0f}"
        rows.append((point.name, f"{bias:.3f}", *volts, *current, published_K, f"{tip_K:.1f}"))
    bias, lever_V, current_mA, tip = _point(page.lever.knee())
    exact = (f"{bias:.3f}", "", f"{lever_V:.3f}", "", f"{current_mA:.3f}", "", f"{tip:.1f}")
    rows.append(("dV_l/dI_h = 0", *exact))
    columns = ["point", "bias (V)", "V_l published (V)", "V_l (V)"]
    columns += ["I_h published (mA)", "I_h (mA)", "T_tip published (K)", "T_tip (K)"]
    page.tabulate("operating_points", columns, rows)
    page.judge("operating_points", max(away), away=max(away))
    page.judge("simulated_knee", tip, tip=tip)


def _point(state: xr.Dataset) -> list[float]:
    """Bias, V_l, I_h and T_tip of a sweep of one state."""
    return [state[name].item() for name in ("bias_V", "lever_V", "current_mA", "tip_K")]


def characteristics_section(page: Findings) -> None:
    """I-V curve, T(P) and resistances (Figs. 5 and 6)."""
    curve, knee = page.lever.sweep(page.curve_V), page.lever.knee()
    page.draw(
        "iv",
        figures.iv_curves({"vacuum": curve}, {"vacuum": knee}, published=paper.OPERATING_POINTS),
    )
    page.draw("temperature_power", figures.temperature_power(curve))
    _power_law(page, curve)
    page.draw("resistances", figures.resistances(curve))
    reference = _reference_numbers()
    page.judge("legs_prevail", reference.legs_prevail_K.item(), reference=reference)


def _reference_numbers() -> xr.Dataset:
    """Return what is stored of the reference probe among the layouts."""
    return stored_ensemble().numbers.sel(layout=REFERENCE)


def _power_law(page: Findings, curve: xr.Dataset) -> None:
    """Compare Eq. 12 with the computed characteristic, as published and fitted again."""
    difference = np.abs(curve.tip_K - EQ12.tip_temperature(curve.power_mW))
    below = difference.where(curve.power_mW <= WELL_COVERED_MW).max().item()
    last = difference.values[-1]
    rows = [("published", *_coefficients(EQ12), f"{below:.0f}", f"{last:.0f}")]
    for name, continuous in (("fitted", False), ("fitted, continuous", True)):
        refit = fit_power_law(curve.power_mW, curve.tip_K, continuous=continuous)
        cold = refit.largest_residual_K(to_mW=WELL_COVERED_MW)
        hot = refit.largest_residual_K(from_mW=WELL_COVERED_MW)
        rows.append((name, *_coefficients(refit.law), f"{cold:.0f}", f"{hot:.0f}"))
    columns = ["Eq. 12", "a (K/mW)", "b (K)", "m", "c (K/mW)", "P_th (mW)", "jump (K)"]
    columns += [f"residual to {WELL_COVERED_MW} mW (K)", "above (K)"]
    page.tabulate("power_law", columns, rows)
    most, spread = difference.max().item(), paper.POWER_LAW_SPREAD_K
    numbers: Any = {"most": most, "below": below, "last": last, "hottest": curve.isel(bias=-1)}
    page.judge("power_law", most, covered=WELL_COVERED_MW, **numbers)
    page.claim("two_branches", holds=abs(EQ12.jump_K) < spread, law=EQ12)


def _coefficients(law: PowerLaw) -> list[str]:
    """The five coefficients of a power law and its jump, as cells."""
    forms = (".1f", ".2f", ".2f", ".1f", ".2f")
    cells = [f"{value:{form}}" for (_, value), form in zip(law, forms, strict=True)]
    return [*cells, f"{law.jump_K:+.1f}"]


def heater_section(page: Findings) -> None:
    """Doping, resistivity and temperature along the heater (Fig. 7)."""
    states = page.lever.solve(published_biases(page.lever))
    names = [point.name for point in paper.OPERATING_POINTS]
    profiles = {name: heater_profile(state) for name, state in zip(names, states, strict=True)}
    profile, layout = profiles[names[0]], page.lever.space.mesh.layout
    page.draw("doping_profile", figures.doping_profile(profile))
    lowly = profile.doping < 2.0 * page.lever.probe.material.n_d
    length = float(lowly.mean() * np.ptp(profile.position.values))
    nominal = layout.heater_taper.length_um
    numbers = {"length": length, "nominal": nominal, "share": length / nominal}
    page.judge("heater_length", numbers["share"], **numbers)
    page.draw("heater_profiles", figures.heater_profiles(profiles))
    knee = states[names.index("knee")]
    page.draw("field_maps", figures.field_maps(knee))


def knee_section(page: Findings) -> None:
    """The ways from T_i to the knee."""
    reasons = reasons_of_the_knee(page.lever)
    kelvins, at = dict(steps_to_the_knee(reasons)), reasons.inversion_K
    rows = [("inversion temperature T_i", "", f"{at:.1f}")]
    for name, step in kelvins.items():
        at += step
        rows.append((name, f"{step:+.1f}", f"{at:.1f}"))
    page.tabulate("knee", ("from T_i to the knee", "step (K)", "T_tip (K)"), rows)
    voltage = kelvins["the voltage is highest above where the resistance is"]
    page.judge("knee_condition", voltage, voltage=voltage)
    legs = kelvins["the legs have a resistance"]
    numbers = {"legs": legs, "off": abs(legs - paper.KNEE_BY_LEGS_K), "without": -legs}
    page.judge("knee_by_legs", legs, **numbers)
    rest = reasons.knee_K.sel(lever="as it is").item() - reasons.inversion_K - legs
    doping = kelvins["the doping is not uniform"]
    others = "; ".join(f"{name} ({step:+.0f} K)" for name, step in list(kelvins.items())[:2])
    page.judge("knee_by_doping", doping / rest, doping=doping, rest=rest, others=others)


def balance_section(page: Findings) -> None:
    """Charge and energy."""
    sweep = page.lever.sweep(paper.RAMP)
    charge = np.abs(sweep.ground_current_mA / sweep.current_mA - 1).max()
    energy = np.abs(sweep.end_heat_mW / sweep.power_mW - 1).max()
    page.say("balances", charge=charge, energy=energy)


def mesh_section(page: Findings) -> None:
    """How far the default mesh is from a much finer one."""
    finer, fine = (Lever(page.lever.probe, MeshOptions(refinement=n)) for n in (2.0, 3.0))
    best, rows = fine.sweep(paper.RAMP), []
    for name, lever in (("default", page.lever), ("sizes / 2", finer)):
        away = abs(lever.sweep(paper.RAMP) - best)
        current, reader = away.current_mA / best.current_mA, away.reader_V / best.reader_V
        cells = [f"{relative.max():.1e}" for relative in (current, reader)]
        triangles = str(lever.space.mesh.elements.nelements)
        rows.append((name, triangles, *cells, f"{away.tip_K.max():.3f}"))
    columns = ("mesh", "triangles", "I_h (relative)", "V_r (relative)", "T_tip (K)")
    page.tabulate("mesh", columns, rows, triangles=fine.space.mesh.elements.nelements)


def fit_section(page: Findings) -> None:
    """Option III on the virtual lab's first lever."""
    page.say("fit")
    result = page.fitted_example
    add_fit(page, result)
    page.claim("cost_of_a_fit", holds=result.seconds > 3600.0, fit=result)


def data_section(page: Findings) -> None:
    """Options I to III on both levers of the virtual lab (Figs. 3 and 4, Table I)."""
    page.say("options")
    fits = [_compare_options(page, name) for name in ("lever-a", "lever-b")]
    _option_claims(page, *fits)


def _compare_options(page: Findings, name: str) -> dict[str, Estimate]:
    """Tabulate and draw fits to an example; return them by option."""
    measurement = example(f"{name}.csv")
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
    free, held = fits["III"].parameters, fits["III, n_d fixed"].parameters
    changes = ", ".join(
        f"{PARAMETERS[key].symbol} {held[key].value / free[key].value - 1:+.1%}"
        for key in PARAMETERS
        if key != "n_d"
    )
    page.say("doping_held", name=name, changes=changes)
    return fits


def _option_claims(page: Findings, *levers: dict[str, Estimate]) -> None:
    """Judge what options I to III tell, by fits to several levers, and by the printed values."""
    first, third = ([_between_groups(fits[name]) for fits in levers] for name in ("I", "III"))
    page.judge("dependent_parameters", min(first)[0], first=first)
    page.judge("decoupled_groups", max(third)[0], third=third)
    hot = [[_hot_error(fits[option]) for option in ("I", "III")] for fits in levers]
    reference = _reference_numbers()
    page.judge("current_alone", reference.tip_I_K.item(), hot=hot, reference=reference)
    free, held = ([fits[name] for fits in levers] for name in ("III", "III, n_d fixed"))
    both = list(zip(held, free, strict=True))
    page.judge(
        "doping_held",
        reference.tip_n_d_held_K.item(),
        reference=reference,
        shift_K=[abs(a.inversion_temperature_K - b.inversion_temperature_K) for a, b in both],
        worse=[a.residual_rms["tip_K"] - b.residual_rms["tip_K"] for a, b in both],
    )


def _between_groups(result: Estimate) -> list[float]:
    """Largest absolute correlation between parameters of different groups.

    The first number is that from one noise for all observables, the second from one for each.
    """
    groups = np.array([GROUPS[name] for name in result.names])
    apart = groups[:, None] != groups[None, :]
    correlations = (result.common_noise_correlation, result.correlation)
    return [float(np.abs(correlation[apart]).max()) for correlation in correlations]


def _hot_error(result: Estimate) -> float:
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
    off = abs(published.error_at_hottest.item())
    page.claim("raman_law", holds=off < 25.0, published=published)


def levers_section(page: Findings) -> None:
    """Levers with more physics than the model, calibrated from their I-V curve."""
    count = page.extent.levers
    page.say("levers", count=count)
    # what levers depart in that have the mobility of the model, and the others
    laws = [name for name in DEPARTURES if name != "mobility"], list(DEPARTURES)
    cases = [(number, law) for law in laws for number in range(count)]
    judged = concatenated([judge(number, departures=law) for number, law in cases])
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
        # with less than this of the true temperatures in the 95 % band it is too narrow
        narrow=narrow if in_95 < 0.85 else "",
    )
