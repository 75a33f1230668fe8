"""The lever in still air (the paper's Section V)."""

from __future__ import annotations

import time

import numpy as np
import xarray as xr

from hotlever import figures
from hotlever import spieser2017 as paper
from hotlever.calibration.power_law import EQ12
from hotlever.lever.air_fields import AirFields
from hotlever.materials.air import thermal_conductivity_of_air
from hotlever.materials.silicon import thermal_conductivity
from hotlever.report.reproduce.findings import MANY, Findings
from hotlever.studies import air_scaling, disc
from hotlever.studies.air_scaling import COLD, HOT
from hotlever.studies.tip_effect import tip_effects


def disc_section(page: Findings) -> None:
    """A disc between two planes, from near to far (Fig. 8)."""
    loss = disc.loss_between_planes()
    page.figure(
        "disc",
        figures.disc_between_planes(loss),
        "Heat lost by a disc midway between two planes, over κ r ΔT: the exact solution between "
        "its two limits.",
    )
    far = disc.loss_between_planes(1e3).loss.item()
    nearest = loss.isel(distance=0)
    near = (nearest.loss / nearest.near).item()
    page.claim(
        "Fig. 8b",
        "a disc far from any surface loses 4 κ r ΔT",
        f"{far:.2f} κ r ΔT",
        holds=abs(far - 4.0) < 0.1,
        because="4 counts one face, while the area in the same formula counts both",
    )
    page.claim(
        "Fig. 8a",
        "a disc between near surfaces loses κ ΔT/h per area",
        f"{near:.3f} of that at h = {nearest.distance.item():.2f} r",
        holds=abs(near - 1.0) < 0.1,
        as_found=f" within {abs(near - 1.0):.1%} at h = {nearest.distance.item():.2f} r",
        because="the edge adds more",
    )


def characteristics_section(page: Findings) -> None:
    """What is measured, in air; and what air costs (Figs. 9 and 10)."""
    ramp = page.air.sweep(paper.RAMP)
    page.figure(
        "air_sweep",
        figures.sweep_overview(ramp),
        "The reference probe in still air, freely suspended, with the material of option III.",
    )
    knees = {"vacuum": page.lever.knee(), "air": page.air.knee()}
    page.figure(
        "air_iv",
        figures.iv_curves({"vacuum": page.lever.sweep(MANY), "air": page.air.sweep(MANY)}, knees),
        "I-V curves in vacuum and in air, with their knees.",
    )
    there = [f"{at.power_mW.item():.2f} mW and {at.tip_K.item():.0f} K" for at in knees.values()]
    page.text(f"The knee moves from {there[0]} in vacuum to {there[1]} in air.")
    balance = abs((ramp.end_heat_mW + ramp.air_heat_mW) / ramp.power_mW - 1).max().item()
    page.text(
        f"Heat through the leg ends and into the air adds up to V_l I_h within {balance:.1e}."
    )
    seconds = []
    for lever in (page.lever, page.air):
        again = lever.with_probe(lever.probe)
        began = time.perf_counter()
        again.solve(paper.RAMP)
        seconds.append(time.perf_counter() - began)
    ratio = seconds[1] / seconds[0]
    page.claim(
        "Section V",
        "air multiplies the cost of a simulation by a thousand",
        f"by {ratio:.1f}, the operator of the air at hand",
        holds=ratio > 100.0,
        because="still air is linear in ∫κ_air dT, so that one matrix stands for all of it",
    )


def scale_section(page: Findings) -> None:
    """One factor of the power: is it one?"""
    vacuum, air = page.lever.branch(), page.air.branch()
    ramp, curve = page.air.sweep(paper.RAMP), page.air.sweep(MANY)
    hottest = float(ramp.tip_K.max())
    found = air_scaling.find_scale_factor(vacuum, air, hottest)
    page.figure(
        "air_temperature_power",
        figures.temperature_power(curve, EQ12.scaled(paper.K_IN_AIR)),
        "Tip temperature against power in air, beside Eq. 12 with the power over "
        f"{paper.K_IN_AIR}.",
    )
    page.figure(
        "scale_factor",
        figures.scale_factor({"free space": found.k}, paper.K_IN_AIR),
        "Power in air over power in vacuum at the same tip temperature.",
    )
    paper_error = air_scaling.error_of_one_factor(vacuum, air, paper.K_IN_AIR, hottest)
    cold, hot = found.k.interp(tip_K=[COLD, HOT]).values
    best, left = found.best_k.item(), found.best_error_K.item()
    page.text(
        f"k rises from {cold:.3f} at {COLD:.0f} K to {hot:.3f} at {HOT:.0f} K. The best single "
        f"factor is {best:.3f}; with it the temperature is wrong by up to {left:.0f} K below "
        f"{hottest:.0f} K, with {paper.K_IN_AIR} by up to {paper_error:.0f} K."
    )
    law_error = np.abs(
        EQ12.scaled(paper.K_IN_AIR).tip_temperature(curve.power_mW) - curve.tip_K
    ).max()
    page.claim(
        "Section V",
        f"Eq. 12 with the power over k = {paper.K_IN_AIR} gives T(P) in air within "
        f"{paper.POWER_LAW_SPREAD_K:.0f} K",
        f"{law_error.item():.0f} K from our curve in air; our own vacuum curve at P/"
        f"{paper.K_IN_AIR} {paper_error:.0f} K, at the best single k = {best:.2f} {left:.0f} K",
        holds=law_error.item() < paper.POWER_LAW_SPREAD_K,
        because=f"k rises from {cold:.2f} to {hot:.2f} with the temperature",
    )
    share, coldest = (ramp.air_heat_mW / ramp.power_mW).values, ramp.tip_K.values[0]
    tips = np.array([COLD, HOT])
    low, high = thermal_conductivity_of_air(tips)[0] / thermal_conductivity(tips)[0]
    page.claim(
        "Section V",
        "air takes a constant share of the power at any tip temperature",
        f"{share[0]:.0%} at {coldest:.0f} K, {share[-1]:.0%} at {hottest:.0f} K",
        holds=abs(share[-1] / share[0] - 1.0) < 0.1,
        because=f"κ_air/κ_Si grows {high / low:.1f}-fold from {COLD:.0f} to {HOT:.0f} K "
        f"and k − 1 with it, {air_scaling.unevenness(found):.1f}-fold",
    )
    if air.knee is not None and vacuum.knee is not None:
        by_knee = air.knee.power_mW / vacuum.knee.power_mW
        error = air_scaling.error_of_one_factor(vacuum, air, by_knee, hottest)
        page.claim(
            "Section V",
            "k follows from the power at the knee, k = P_knee/P_th",
            f"{by_knee:.3f}, which leaves {error:.0f} K",
            holds=error < paper.POWER_LAW_SPREAD_K,
            as_found=f" within {error:.0f} K",
            because=f"a k that is right at the knee leaves {error:.0f} K elsewhere",
        )


def map_section(page: Findings) -> None:
    """The flux into the air on the lever, and by region."""
    states = page.air.solve(paper.RAMP)
    fields = AirFields(page.air)
    shares, hottest = fields.shares(states), states[-1]
    layout, title = page.air.probe.layout(), f"bias {hottest.bias_V:.1f} V"
    page.figure(
        "air_loss",
        figures.air_loss(layout, fields.panels, fields.flux(hottest), shares, title),
        "Heat flux from the top face into the air at the highest bias, and the share of the power "
        "that each region loses to the air.",
    )
    last: xr.DataArray = shares.air_heat_mW.isel(bias=-1)
    page.text(
        f"At {hottest.bias_V:.1f} V the region that loses most is the "
        f"{last.idxmax('region').item()}: {(last.max() / last.sum()).item():.0%} of the heat into "
        "the air."
    )


def geometry_section(page: Findings) -> None:
    """How k depends on size, gap and pressure, and where it would be constant."""
    found = air_scaling.surroundings_study(page.lever.probe)
    page.figure(
        "scale_factor_map",
        figures.scale_factor(
            {str(case): found.k.sel(case=case) for case in found.case.values}, paper.K_IN_AIR
        ),
        "Power in air over power in vacuum at the same tip temperature, for other sizes and "
        "surroundings.",
    )
    columns = {
        "": (found.case, ""),
        **{f"k at {tip:.0f} K": (found.k.interp(tip_K=tip), ".3f") for tip in (COLD, HOT)},
        "growth of k − 1": (found.unevenness, ".2f"),
        "best single k": (found.best_k, ".3f"),
        "error it leaves (K)": (found.best_error_K, ".0f"),
    }
    page.columns(columns, f"Up to {HOT:.0f} K.")
    steadiest = abs(found.unevenness - 1.0).idxmin("case").item()
    page.text(
        f"k − 1 is steadiest for '{steadiest}', where it grows "
        f"{found.unevenness.sel(case=steadiest).item():.2f}-fold. "
        "A constant k needs a heat loss whose conductance falls with the temperature as that of "
        "silicon does; the conductance of air rises in dense air whatever the geometry."
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
        "a tipless fit misses the knee by (K)": (effects.missed_K, "+.1f"),
    }
    page.columns(
        columns,
        "Cones on the heater as a thickening of the lever, in vacuum; the last column fits a lever "
        "without tip to the data of the lever with it, as the paper did.",
    )
    gap, missed = paper.KNEE_MEASURED_K - paper.KNEE_PREDICTED_K, effects.missed_K.values
    page.claim(
        "Conclusions",
        f"the missing tip is responsible for the {gap:.0f} K that the knee is off",
        f"a tipless fit misses the knee by {missed.min():+.1f} to {missed.max():+.1f} K",
        holds=bool(missed.max() > 0.75 * gap),
        because=f"tips of plausible size move it by {missed.max():+.1f} K at most",
    )
