"""What the paper says of other levers and other surroundings."""

from __future__ import annotations

import numpy as np
import xarray as xr

from hotlever import figures
from hotlever import spieser2017 as paper
from hotlever.materials import PARAMETERS
from hotlever.probe.priors import default_priors
from hotlever.report.reproduce.findings import Findings
from hotlever.studies.air_scaling import COLD, GAPS_UM, HOT, one_sided_study
from hotlever.studies.linear_branch import (
    SPAN_K,
    WITHIN_K,
    all_cases,
    linear_branch_study,
    slope_regression,
)
from hotlever.studies.parameter_consistency import (
    ERRORS,
    FREE,
    GEOMETRIES,
    HELD,
    consistency_study,
    largest_deviation,
    published_levers,
)
from hotlever.studies.radiation import radiated_heat, sheet_emissivities
from hotlever.studies.simulation_based_calibration import NOISE, RAMAN

#: Of the quick form: every so many levers, the first geometries, errors of the model, gaps (µm).
_EVERY, _FIRST, _FEW_ERRORS, _FEW_GAPS_UM = 5, 3, ("none", "all"), (1.0, 10.0, np.inf)
#: What explains the slope.
_EXPLAINED = ("resistance_K_per_mW", "knee_share")
#: The error of the model that is the same on all levers.
_SHARED = "mobility"
#: How near to their mean the paper's levers are said to be.
_CLAIMED = 0.1


def linear_section(page: Findings) -> None:
    """How straight T(P) is above the knee, and what its slope follows."""
    cases = dict(list(all_cases().items())[:: _EVERY if page.quick else 1])
    study = linear_branch_study(cases, progress=page.progress)
    regression, alone = (slope_regression(study, names) for names in (_EXPLAINED, _EXPLAINED[:1]))
    spread = paper.POWER_LAW_SPREAD_K
    page.draw("linear_branches", figures.linear_branches(study, regression, spread), spread=spread)
    solved = study.isel(case=study.knee_K.notnull().values)
    numbers = {
        "count": solved.sizes["case"],
        "p_type": int((solved.dopant == "p").sum()),
        "total": study.sizes["case"],
        "span": SPAN_K,
        "worst": solved.straight_K.max().item(),
        "usual": solved.straight_K.median().item(),
        "within": WITHIN_K,
        "shortest": solved.reach_K.min().item(),
        "longest": solved.reach_K.max().item(),
        "least": solved.proportional_K.min().item(),
        "most": solved.proportional_K.max().item(),
        "flattest": solved.slope_K_per_mW.min().item(),
        "steepest": solved.slope_K_per_mW.max().item(),
        "low_ratio": solved.slope_ratio.min().item(),
        "high_ratio": solved.slope_ratio.max().item(),
        "kappa": solved.kappa_ratio.median().item(),
        "knee_share": solved.knee_share.median().item(),
        "end_share": solved.end_share.median().item(),
        "by_resistance": regression.exponents["resistance_K_per_mW"],
        "by_share": regression.exponents["knee_share"],
        "factor": regression.factor,
        "determination": regression.determination,
        "scatter": regression.scatter,
        "scatter_alone": alone.scatter,
    }
    page.say("linear_branch", **numbers)
    numbers["by_doping"] = _tabulate_slopes(page, solved)
    page.claim("linear_branch", holds=numbers["worst"] < spread, **numbers)
    page.claim("proportional_branch", holds=numbers["most"] < spread, spread=spread, **numbers)


def _tabulate_slopes(page: Findings, solved: xr.Dataset) -> float:
    """Tabulate slopes by doping; return the largest change by it alone, a share."""
    rows, most = [], 0.0
    by_doping = solved.isel(case=np.isin(solved.changed, ("", "n_d")))
    kinds = zip(by_doping["shape"].values, by_doping.dopant.values, strict=True)
    for shape, dopant in sorted(set(kinds)):
        here = ((by_doping["shape"] == shape) & (by_doping.dopant == dopant)).values
        same = by_doping.slope_K_per_mW.values[here]
        low, high = same.min(), same.max()
        most = max(most, high / low - 1.0)
        cells = (f"{same.size}", f"{low:.0f} to {high:.0f}", f"{high / low - 1.0:.0%}")
        rows += [(str(shape), str(dopant), *cells)] if same.size > 1 else []
    heads = ("shape", "type", "dopings", "slope (K/mW)", "from the lowest to the highest")
    page.tabulate("slopes_by_doping", heads, rows)
    return float(most)


def consistency_section(page: Findings) -> None:
    """The parameters of twins, each fitted by itself, beside those of the paper's levers."""
    errors = _FEW_ERRORS if page.quick else tuple(ERRORS)
    geometries = dict(list(GEOMETRIES.items())[: _FIRST if page.quick else None])
    probe = page.lever.probe
    study = consistency_study(probe, geometries, errors, progress=page.progress)
    published = published_levers()
    tolerances = {
        "dimensions": default_priors(probe)["thickness_um"].spread,
        "common": RAMAN[1],
    }
    page.say(
        "consistency",
        count=len(geometries),
        hottest=paper.HOTTEST_TIP_K,
        noise=NOISE,
        thermometer=RAMAN[0],
        **tolerances,
        nominal=paper.NOMINAL_DOPING,
        doping=probe.material.n_d,
    )
    figure = figures.parameter_deviations(study, published, _CLAIMED)
    page.draw("parameter_deviations", figure, claimed=_CLAIMED)
    ours, theirs = largest_deviation(study), largest_deviation(published)
    rows = [
        (str(error), str(doping), *_shares(ours.sel(error=error, doping=doping)))
        for error in study.error.values
        for doping in study.doping.values
    ]
    rows += [("the paper's", str(way), *_shares(theirs.sel(doping=way))) for way in (FREE, HELD)]
    symbols = [parameter.symbol for parameter in PARAMETERS.values()]
    page.tabulate("consistency", ("errors of the model", "", *symbols), rows)
    if _SHARED in errors:
        mean = study.value.sel(error=_SHARED, doping=FREE).mean("lever")
        off, symbol = _worst(abs(mean / study.true_value - 1.0))
        scatter, _ = _worst(ours.sel(error=_SHARED, doping=FREE))
        page.say("consistent_but_wrong", scatter=scatter, off=off, symbol=symbol)
    worst, symbol = _worst(ours.sel(error="all", doping=FREE))
    doping = ours.sel(doping=FREE, parameter="n_d")
    page.claim(
        "consistent_parameters",
        holds=worst < _CLAIMED,
        count=len(geometries),
        **tolerances,
        without=_worst(ours.sel(error="none", doping=FREE))[0],
        worst=worst,
        symbol=symbol,
        held=_worst(ours.sel(error="all", doping=HELD))[0],
        doping=doping.sel(error="none").item(),
        doping_worst=doping.sel(error="all").item(),
        paper_free=_worst(theirs.sel(doping=FREE))[0],
        paper_held=_worst(theirs.sel(doping=HELD))[0],
    )


def _worst(shares: xr.DataArray) -> tuple[float, str]:
    """Return the largest of some shares by parameter, that of n_d apart, and whose it is."""
    apart = shares.sel(parameter=[name for name in PARAMETERS if name != "n_d"])
    return apart.max().item(), PARAMETERS[apart.idxmax("parameter").item()].symbol


def _shares(values: xr.DataArray) -> list[str]:
    return [f"{value:.1%}" if value > 0 else "" for value in values.values]


def one_sided_section(page: Findings) -> None:
    """k with a surface below the lever."""
    gaps_um = _FEW_GAPS_UM if page.quick else GAPS_UM
    study = one_sided_study(page.lever.probe, gaps_um, page.progress)
    names = ["free" if np.isinf(gap) else f"{gap:g} µm" for gap in study.gap_um.values]
    curves = {name: study.k.isel(gap_um=number) for number, name in enumerate(names)}
    page.draw("one_sided", figures.scale_factor(curves, paper.K_IN_AIR))
    growth = study.k.max("tip_K") / study.k.min("tip_K") - 1.0
    columns = {
        "gap": (study.gap_um.copy(data=names), ""),
        **{f"k at {tip:.0f} K": (study.k.interp(tip_K=tip), ".3f") for tip in (COLD, HOT)},
        "growth of k": (growth, ".0%"),
        "growth of k − 1": (study.unevenness, ".2f"),
        "best single k": (study.best_k, ".3f"),
        "error it leaves (K)": (study.best_error_K, ".0f"),
    }
    page.columns("one_sided", columns, HOT=HOT)
    free, near = growth.sel(gap_um=np.inf), growth.where(np.isfinite(study.gap_um))
    worst, error = near.idxmax("gap_um").item(), study.best_error_K
    near_growth, free_growth = (study.unevenness.sel(gap_um=gap).item() for gap in (worst, np.inf))
    page.say("one_sided", gap=worst, near_growth=near_growth, free_growth=free_growth)
    page.claim(
        "one_sided",
        holds=error.max().item() < paper.POWER_LAW_SPREAD_K,
        free=free.item(),
        least=near.min().item(),
        most=near.max().item(),
        gap=worst,
        COLD=COLD,
        HOT=HOT,
        free_error=error.sel(gap_um=np.inf).item(),
        error=error.max().item(),
        spread=paper.POWER_LAW_SPREAD_K,
    )


def radiation_section(page: Findings) -> None:
    """What the lever radiates, as a black body and as silicon."""
    tip = paper.HOTTEST_TIP_K
    black, grey = (radiated_heat(page.lever.probe, [tip], epsilon) for epsilon in (1.0, None))
    sheets = sheet_emissivities(page.lever.probe, [paper.BASE_TEMPERATURE_K, tip]).emissivity
    light, power = black.radiated_mW.item(), black.power_mW.item()
    page.claim(
        "radiation",
        holds=power > 1e3 * light,
        tip=tip,
        light=1e3 * light,
        ratio=power / light,
        power=power,
        heater=1e3 * black.heater_mW.item(),
        share=light / power,
        grey=1e3 * grey.radiated_mW.item(),
        grey_ratio=grey.power_mW.item() / grey.radiated_mW.item(),
        fall=black.cooler_K.item(),
        grey_fall=grey.cooler_K.item(),
    )
    page.say(
        "radiation",
        edges=(black.edges_mW / black.radiated_mW).item(),
        least=sheets.min().item(),
        most=sheets.max().item(),
    )
