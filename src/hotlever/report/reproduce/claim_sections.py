"""What the paper says of other levers, and leaves out: radiation and thermoelectricity."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import xarray as xr

from hotlever import figures
from hotlever import spieser2017 as paper
from hotlever.estimate import fit
from hotlever.estimate.power_law import EQ12
from hotlever.estimate.summary import parameter_rows
from hotlever.lever import Lever
from hotlever.lever.fields import AirFields
from hotlever.materials import PARAMETERS
from hotlever.materials.air import thermal_conductivity_of_air
from hotlever.materials.heat import thermal_conductivity
from hotlever.probe.priors import default_priors
from hotlever.report.reproduce.findings import Findings, example
from hotlever.report.reproduce.paper_sections import PARAMETER_COLUMNS, published_biases
from hotlever.studies import air_scaling
from hotlever.studies.air_scaling import COLD, HOT
from hotlever.studies.knee_study import described_without, tip_effects
from hotlever.studies.linear_branch import (
    SPAN_K,
    WITHIN_K,
    all_cases,
    linear_branch_study,
    slope_regression,
)
from hotlever.studies.radiation import radiated_heat, sheet_emissivities
from hotlever.studies.simulation_based_calibration import (
    FREE,
    GEOMETRIES,
    HELD,
    LaboratoryOptions,
    consistency_study,
    largest_deviation,
    published_levers,
)
from hotlever.studies.thermoelectric_shift import of_p_silicon, self_heated, shift_by_heat


def linear_section(page: Findings) -> None:
    """How straight T(P) is above the knee, and what its slope follows."""
    cases = dict(list(all_cases().items())[:: page.extent.every])
    study, explained = linear_branch_study(cases), ("resistance_K_per_mW", "knee_share")
    regression, alone = (slope_regression(study, names) for names in (explained, explained[:1]))
    spread = paper.POWER_LAW_SPREAD_K
    page.draw("linear_branches", figures.linear_branches(study, regression, spread))
    solved = study.isel(case=study.knee_K.notnull().values)
    least, most = solved.min(), solved.max()
    numbers: Any = {"study": study, "solved": solved, "p_type": int((solved.dopant == "p").sum())}
    numbers |= {"least": least, "median": solved.median(), "most": most}
    numbers |= {"regression": regression, "alone": alone, "span": SPAN_K, "within": WITHIN_K}
    page.say("linear_branch", **numbers)
    numbers["by_doping"] = _tabulate_slopes(page, solved)
    page.judge("linear_branch", most.straight_K.item(), **numbers)
    page.judge("proportional_branch", most.proportional_K.item(), **numbers)


def _tabulate_slopes(page: Findings, solved: xr.Dataset) -> float:
    """Tabulate slopes by doping; return the largest change by it alone, a share."""
    by_doping = solved.slope_K_per_mW.isel(case=np.isin(solved.changed, ("", "n_d")))
    kinds = by_doping.to_dataframe().groupby(["shape", "dopant"]).slope_K_per_mW
    slopes = kinds.agg(["size", "min", "max"])
    slopes["growth"] = slopes["max"] / slopes["min"] - 1.0
    rows = [
        (*kind, f"{row['size']:.0f}", f"{row['min']:.0f} to {row['max']:.0f}", f"{row.growth:.0%}")
        for kind, row in slopes.iterrows()
        if row["size"] > 1
    ]
    heads = ("shape", "type", "dopings", "slope (K/mW)", "from the lowest to the highest")
    page.tabulate("slopes_by_doping", heads, rows)
    return float(slopes.growth.max())


def consistency_section(page: Findings) -> None:
    """The parameters of twins, each fitted by itself, beside those of the paper's levers."""
    errors, probe = page.extent.errors, page.lever.probe
    geometries = dict(list(GEOMETRIES.items())[: page.extent.geometries])
    # how near to their mean the paper's levers are said to be
    claimed = 0.1
    study, laboratory = consistency_study(probe, geometries, errors), LaboratoryOptions()
    published = published_levers()
    alone, common = laboratory.raman_errors
    numbers: Any = {"count": len(geometries), "common": common}
    numbers["dimensions"] = default_priors(probe)["thickness_um"].spread
    doping = probe.material.n_d
    page.say("consistency", noise=laboratory.noise, thermometer=alone, doping=doping, **numbers)
    figure = figures.parameter_deviations(study, published, claimed)
    page.draw("parameter_deviations", figure, claimed=claimed)
    ours, theirs = largest_deviation(study), largest_deviation(published)
    rows = [
        (str(error), str(doping), *_shares(ours.sel(error=error, doping=doping)))
        for error in study.error.values
        for doping in study.doping.values
    ]
    rows += [("the paper's", str(way), *_shares(theirs.sel(doping=way))) for way in (FREE, HELD)]
    symbols = [parameter.symbol for parameter in PARAMETERS.values()]
    page.tabulate("consistency", ("errors of the model", "", *symbols), rows)
    # the error of the model that is the same on all levers
    if "mobility" in errors:
        mean = study.value.sel(error="mobility", doping=FREE).mean("lever")
        off, symbol = _worst(abs(mean / study.true_value - 1.0))
        scatter, _ = _worst(ours.sel(error="mobility", doping=FREE))
        page.say("consistent_but_wrong", scatter=scatter, off=off, symbol=symbol)
    worst, symbol = _worst(ours.sel(error="all", doping=FREE))
    of_doping = ours.sel(doping=FREE, parameter="n_d")
    page.claim(
        "consistent_parameters",
        holds=worst < claimed,
        **numbers,
        without=_worst(ours.sel(error="none", doping=FREE))[0],
        worst=worst,
        symbol=symbol,
        held=_worst(ours.sel(error="all", doping=HELD))[0],
        doping=of_doping.sel(error="none"),
        doping_worst=of_doping.sel(error="all"),
        paper_free=_worst(theirs.sel(doping=FREE))[0],
        paper_held=_worst(theirs.sel(doping=HELD))[0],
    )


def _worst(shares: xr.DataArray) -> tuple[float, str]:
    """Return the largest of some shares by parameter, that of n_d apart, and whose it is."""
    apart = shares.sel(parameter=[name for name in PARAMETERS if name != "n_d"])
    return apart.max().item(), PARAMETERS[apart.idxmax("parameter").item()].symbol


def _shares(values: xr.DataArray) -> list[str]:
    return [f"{value:.1%}" if value > 0 else "" for value in values.values]


def radiation_section(page: Findings) -> None:
    """What the lever radiates, as a black body and as silicon."""
    tip = paper.HOTTEST_TIP_K
    black, grey = (
        radiated_heat(page.lever.probe, [tip], epsilon).squeeze() for epsilon in (1.0, None)
    )
    sheets = sheet_emissivities(page.lever.probe, [paper.BASE_TEMPERATURE_K, tip]).emissivity
    share = (black.radiated_mW / black.power_mW).item()
    page.judge(
        "radiation",
        share,
        black=black,
        grey=grey,
        light_uW=1e3 * black.radiated_mW,
        grey_uW=1e3 * grey.radiated_mW,
        heater_uW=1e3 * black.heater_mW,
        share=share,
        ratio=1.0 / share,
    )
    edges = black.edges_mW / black.radiated_mW
    page.say("radiation", edges=edges, least=sheets.min(), most=sheets.max())


def shift_section(page: Findings) -> None:
    """The shift of the hot spot, heat by heat, for either kind of silicon."""
    points = published_biases(page.lever)
    biases = sorted([4.0, 5.0, 6.0, 9.0, 10.0, *points])
    n_type = shift_by_heat(page.lever, biases)
    p_type = shift_by_heat(Lever(of_p_silicon(page.lever.probe)), biases)
    page.draw("thermoelectric_shift", figures.thermoelectric_shift(n_type, p_type))
    base = page.lever.circuit.base_temperature_K
    columns = ["doped with", "bias (V)", "T_tip (K)", "moved along the current (nm)"]
    columns += ["by Peltier heat, supply", "ground", "by Thomson heat"]
    columns += ["Peltier heat, supply (mW)", "ground (mW)"]
    rows = [
        _row(name, shift.sel(polarity=polarity).sel(bias=bias, method="nearest"), base)
        for name, shift in (("phosphorus", n_type), ("boron", p_type))
        for polarity in (1, -1)
        for bias in points
    ]
    page.tabulate("thermoelectric_shift", columns, rows)
    shift_nm, at_bias = abs(n_type.moved_nm).max("polarity"), n_type.bias[0]
    at_points = n_type.sel(bias=points, method="nearest")
    largest = abs(at_points.moved_nm).max().item()
    numbers: Any = {"largest": largest, "cold": shift_nm[0], "bias": at_bias}
    page.judge("thermoelectric_size", largest, **numbers)
    thomson = at_points.share_nm.sel(heat="Thomson").sum("side")
    silicon = page.lever.probe.heater_silicon
    assert silicon is not None
    strip = self_heated(silicon, np.arange(500.0, 1301.0, 25.0))
    boron = [p_type.sel(polarity=1).sel(bias=bias, method="nearest") for bias in points[:2]]
    page.judge(
        "thermoelectric_direction",
        at_points.moved_nm.max().item(),
        least=at_points.moved_nm.max(),
        most=at_points.moved_nm.min(),
        thomson=thomson.min(),
        strip=_turn(strip),
        boron=boron,
        boron_K=[base + at.centre_rise_K for at in boron],
    )


def _row(name: str, at: xr.Dataset, base: float) -> tuple[str, ...]:
    """Return what thermoelectricity does at a bias, as cells."""
    peltier = [f"{value:+.0f}" for value in at.share_nm.sel(heat="Peltier").values]
    heats = [f"{value:+.3f}" for value in at.heat_mW.sel(heat="Peltier").values]
    bias, tip = f"{at.polarity * at.bias:+.2f}", f"{base + at.centre_rise_K:.0f}"
    thomson = at.share_nm.sel(heat="Thomson").sum()
    return (name, bias, tip, f"{at.moved_nm:+.0f}", *peltier, f"{thomson:+.0f}", *heats)


def _turn(strip: xr.Dataset) -> float:
    """Return the temperature (K) at which the shift of a strip turns for the last time."""
    shift_nm, tip = strip.moved_nm.values, strip.tip_K.values
    before = int(np.flatnonzero(np.diff(np.sign(shift_nm)))[-1])
    near = slice(before, before + 2)
    order = np.argsort(shift_nm[near])
    return float(np.interp(0.0, shift_nm[near][order], tip[near][order]))


def prediction_section(page: Findings) -> None:
    """What a fit gains by thermoelectricity."""
    probe = page.lever.probe
    fits = {
        with_it: fit(example("lever-a.csv"), probe.with_physics(effects))
        for with_it, effects in ((False, ()), (True, ("thermoelectric",)))
    }
    rms = {with_it: result.residual_rms for with_it, result in fits.items()}
    values = {
        with_it: np.array([result.parameters[name].value for name in PARAMETERS])
        for with_it, result in fits.items()
    }
    rows = []
    for with_it, model in ((False, "without"), (True, "with")):
        cells = [f"{value:.3g}" for value in rms[with_it].values()]
        in_units = [value for _, value, _, _ in parameter_rows(fits[with_it])]
        rows.append([model, *cells, *in_units])
    columns = ["", "rms I_h (mA)", "rms V_r (V)", "rms T_tip (K)", *PARAMETER_COLUMNS]
    page.tabulate("thermoelectric_fit", columns, rows)
    changes = abs(values[True] / values[False] - 1.0)
    off = described_without(probe).off_K.max().item()
    page.judge(
        "thermoelectric_prediction",
        off,
        without=rms[False],
        with_it=rms[True],
        symbol=list(PARAMETERS.values())[changes.argmax()].symbol,
        change=changes.max(),
        off=off,
    )


# --- in still air, freely suspended or over a surface (Section V) ---------------------------------


def disc_section(page: Findings) -> None:
    """A disc between two planes, from near to far (Fig. 8)."""
    loss = air_scaling.loss_between_planes()
    page.draw("disc", figures.disc_between_planes(loss))
    far = air_scaling.loss_between_planes(1e3).loss.item()
    page.claim("disc_far", holds=abs(far - 4.0) < 0.1, far=far)
    nearest = loss.isel(distance=0)
    near = (nearest.loss / nearest.near).item()
    off = abs(near - 1.0)
    page.claim("disc_near", holds=off < 0.1, off=off, near=near, distance=nearest.distance)


def characteristics_section(page: Findings) -> None:
    """What is measured, in air; and what air costs (Figs. 9 and 10)."""
    ramp = page.air.sweep(paper.RAMP)
    page.draw("air_sweep", figures.sweep_overview(ramp))
    knees = {"vacuum": page.lever.knee(), "air": page.air.knee()}
    curves = {
        name: one.sweep(page.curve_V) for name, one in (("vacuum", page.lever), ("air", page.air))
    }
    page.draw("air_iv", figures.iv_curves(curves, knees))
    page.say("knee_in_air", **{medium: knee.squeeze() for medium, knee in knees.items()})
    balance = abs((ramp.end_heat_mW + ramp.air_heat_mW) / ramp.power_mW - 1).max()
    page.say("balance_in_air", balance=balance)
    seconds = []
    for lever in (page.lever, page.air):
        again = lever.with_probe(lever.probe)
        began = time.perf_counter()
        again.solve(paper.RAMP)
        seconds.append(time.perf_counter() - began)
    ratio = seconds[1] / seconds[0]
    page.claim("cost_of_air", holds=ratio > 100.0, ratio=ratio)


def scale_section(page: Findings) -> None:
    """One factor of the power: is it one?"""
    vacuum, air = page.lever.branch(), page.air.branch()
    ramp, curve = page.air.sweep(paper.RAMP), page.air.sweep(page.curve_V)
    hottest = float(ramp.tip_K.max())
    factor = air_scaling.find_scale_factor(vacuum, air, hottest)
    law = EQ12.scaled(paper.K_IN_AIR)
    page.draw("air_temperature_power", figures.temperature_power(curve, law))
    page.draw("scale_factor", figures.scale_factor({"free space": factor.k}, paper.K_IN_AIR))
    cold, hot = factor.k.interp(tip_K=[COLD, HOT]).values
    error = air_scaling.error_of_one_factor(vacuum, air, paper.K_IN_AIR, hottest)
    numbers: Any = {"COLD": COLD, "cold": cold, "HOT": HOT, "hot": hot, "hottest": hottest}
    numbers |= {"factor": factor, "error": error}
    page.say("scale", **numbers)
    law_error = np.abs(law.tip_temperature(curve.power_mW) - curve.tip_K).max().item()
    page.judge("one_factor", law_error, law_error=law_error, **numbers)
    share = (ramp.air_heat_mW / ramp.power_mW).values[[0, -1]]
    tips = np.array([COLD, HOT])
    low, high = thermal_conductivity_of_air(tips)[0] / thermal_conductivity(tips)[0]
    page.judge(
        "constant_share",
        share[1] / share[0],
        share=share,
        coldest=ramp.tip_K[0],
        ratio=high / low,
        growth=air_scaling.unevenness(factor),
        **numbers,
    )
    if air.knee is not None and vacuum.knee is not None:
        by_knee = air.knee.power_mW / vacuum.knee.power_mW
        error = air_scaling.error_of_one_factor(vacuum, air, by_knee, hottest)
        page.judge("factor_of_the_knee", error, by_knee=by_knee, error=error)


def map_section(page: Findings) -> None:
    """The flux into the air on the lever, and by region."""
    states = page.air.solve(paper.RAMP)
    fields = AirFields(page.air)
    shares, hottest = fields.shares(states), states[-1]
    layout, title = page.air.probe.layout(), f"bias {hottest.bias_V:.1f} V"
    flux = fields.flux(hottest)
    page.draw("air_loss", figures.air_loss(layout, fields.panels, flux, shares, title))
    last: xr.DataArray = shares.air_heat_mW.isel(bias=-1)
    region, share = last.idxmax("region").item(), last.max() / last.sum()
    page.say("regions", bias=hottest.bias_V, region=region, share=share)


def geometry_section(page: Findings) -> None:
    """How k depends on size and pressure, and where it would be constant."""
    study = air_scaling.surroundings_study(page.lever.probe)
    curves = {str(case): study.k.sel(case=case) for case in study.case.values}
    page.draw("scale_factor_map", figures.scale_factor(curves, paper.K_IN_AIR))
    page.columns("geometry", {"": (study.case, ""), **_columns_of_k(study)}, HOT=HOT)
    steadiest = abs(study.unevenness - 1.0).idxmin("case").item()
    page.say("geometry", case=steadiest, growth=study.unevenness.sel(case=steadiest))


def _columns_of_k(
    study: xr.Dataset, growth: xr.DataArray | None = None
) -> dict[str, tuple[xr.DataArray, str]]:
    """Return what a table shows of k, by heading, and how numbers are written."""
    at = {f"k at {tip:.0f} K": (study.k.interp(tip_K=tip), ".3f") for tip in (COLD, HOT)}
    return {
        **at,
        **({} if growth is None else {"growth of k": (growth, ".0%")}),
        "growth of k − 1": (study.unevenness, ".2f"),
        "best single k": (study.best_k, ".3f"),
        "error it leaves (K)": (study.best_error_K, ".0f"),
    }


def one_sided_section(page: Findings) -> None:
    """k with a surface below the lever."""
    study = air_scaling.one_sided_study(page.lever.probe, page.extent.gaps_um)
    names = ["free" if np.isinf(gap) else f"{gap:g} µm" for gap in study.gap_um.values]
    curves = {name: study.k.isel(gap_um=number) for number, name in enumerate(names)}
    page.draw("one_sided", figures.scale_factor(curves, paper.K_IN_AIR))
    growth = study.k.max("tip_K") / study.k.min("tip_K") - 1.0
    gaps = {"gap": (study.gap_um.copy(data=names), "")}
    page.columns("one_sided", gaps | _columns_of_k(study, growth), HOT=HOT)
    near, free = growth.where(np.isfinite(study.gap_um)), study.sel(gap_um=np.inf)
    worst, error = near.idxmax("gap_um").item(), study.best_error_K.max().item()
    near_growth = study.unevenness.sel(gap_um=worst)
    page.say("one_sided", gap=worst, near_growth=near_growth, free_growth=free.unevenness)
    page.judge(
        "one_sided",
        error,
        free=growth.sel(gap_um=np.inf),
        least=near.min(),
        most=near.max(),
        gap=worst,
        COLD=COLD,
        HOT=HOT,
        free_error=free.best_error_K,
        error=error,
    )


def tip_section(page: Findings) -> None:
    """What leaving the tip out does to the knee."""
    effects = tip_effects(page.lever.probe)
    columns = {
        "height (µm)": (effects.height_um, ".1f"),
        "half-angle (°)": (effects.half_angle_deg, ".0f"),
        "knee (K)": (effects.knee_K, ".1f"),
        "moved by (K)": (effects.moved_K, "+.1f"),
        "T at equal power (K)": (effects.at_power_K, "+.1f"),
        "a tipless fit misses the knee by (K)": (effects.missed_K, "+.2f"),
    }
    page.columns("tips", columns)
    least, most = effects.missed_K.min().item(), effects.missed_K.max().item()
    page.judge("missing_tip", most, least=least, most=most)
