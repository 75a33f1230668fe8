"""The lever in still air, freely suspended or over a surface (the paper's Section V)."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import xarray as xr

from hotlever import figures
from hotlever import spieser2017 as paper
from hotlever.estimate.power_law import EQ12
from hotlever.lever.air_fields import AirFields
from hotlever.materials.air import thermal_conductivity_of_air
from hotlever.materials.heat import thermal_conductivity
from hotlever.report.reproduce.findings import Findings
from hotlever.studies import air_scaling
from hotlever.studies.air_scaling import COLD, HOT
from hotlever.studies.knee_study import tip_effects


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
