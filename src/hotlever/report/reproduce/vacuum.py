"""The lever in vacuum: parameters, operating points, characteristics, heater, knee, balances."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from hotlever import figures
from hotlever import spieser2017 as paper
from hotlever.estimate.power_law import EQ12, PowerLaw, fit_power_law
from hotlever.lever import Lever
from hotlever.lever.fields import heater_profile
from hotlever.materials import PARAMETERS, PUBLISHED
from hotlever.materials.silicon import inversion_temperature
from hotlever.probe import MeshOptions
from hotlever.report.reproduce.findings import MANY, Findings
from hotlever.studies.knee import (
    IN_AIR,
    TOGETHER,
    compare_suspects,
    reasons_of_the_knee,
    steps_to_the_knee,
)
from hotlever.text import value_with_error

#: Headings of the six parameters, in units of their scale.
PARAMETER_COLUMNS = ("c_κ", "Δ (µm)", "n_d (1e17 cm⁻³)", "p", "a₀ (1e-4 Ω cm)", "a₁ (1e-6 Ω cm/K)")
#: Power (mW) up to which the paper's law has data on the published lever's hot branch.
_WELL_COVERED_MW = 3.3


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
    page.claim("operating_points", holds=max(away) < 0.01, away=max(away))
    page.claim("simulated_knee", holds=abs(tip - paper.KNEE_PREDICTED_K) < 10.0, tip=tip)


def _point(state: xr.Dataset) -> list[float]:
    """Bias, V_l, I_h and T_tip of a sweep of one state."""
    return [state[name].item() for name in ("bias_V", "lever_V", "current_mA", "tip_K")]


def characteristics_section(page: Findings) -> None:
    """I-V curve, T(P) and resistances (Figs. 5 and 6)."""
    curve, knee = page.lever.sweep(MANY), page.lever.knee()
    page.draw(
        "iv",
        figures.iv_curves({"vacuum": curve}, {"vacuum": knee}, published=paper.OPERATING_POINTS),
    )
    page.draw("temperature_power", figures.temperature_power(curve))
    _power_law(page, curve)
    page.draw("resistances", figures.resistances(curve))


def _power_law(page: Findings, curve: xr.Dataset) -> None:
    """Compare Eq. 12 with the computed characteristic, as published and fitted again."""
    difference = np.abs(curve.tip_K - EQ12.tip_temperature(curve.power_mW))
    below = difference.where(curve.power_mW <= _WELL_COVERED_MW).max().item()
    last = difference.values[-1]
    rows = [("published", *_coefficients(EQ12), f"{below:.0f}", f"{last:.0f}")]
    for name, continuous in (("fitted", False), ("fitted, continuous", True)):
        refit = fit_power_law(curve.power_mW, curve.tip_K, continuous=continuous)
        cold = refit.largest_residual_K(to_mW=_WELL_COVERED_MW)
        hot = refit.largest_residual_K(from_mW=_WELL_COVERED_MW)
        rows.append((name, *_coefficients(refit.law), f"{cold:.0f}", f"{hot:.0f}"))
    columns = ["Eq. 12", "a (K/mW)", "b (K)", "m", "c (K/mW)", "P_th (mW)", "jump (K)"]
    columns += [f"residual to {_WELL_COVERED_MW} mW (K)", "above (K)"]
    page.tabulate("power_law", columns, rows)
    most, spread = difference.max().item(), paper.POWER_LAW_SPREAD_K
    numbers: Any = {"most": most, "below": below, "last": last, "hottest": curve.isel(bias=-1)}
    page.claim("power_law", holds=most < spread, covered=_WELL_COVERED_MW, **numbers)
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
    page.claim("heater_length", holds=0.35 < numbers["share"] < 0.65, **numbers)
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
    legs = kelvins["the legs have a resistance"]
    numbers = {"legs": legs, "off": abs(legs - 15.0), "without": -legs}
    page.claim("knee_by_legs", holds=7.5 < legs < 22.5, **numbers)
    rest = reasons.knee_K.sel(lever="as it is").item() - reasons.inversion_K - legs
    doping = kelvins["the doping is not uniform"]
    others = "; ".join(f"{name} ({step:+.0f} K)" for name, step in list(kelvins.items())[:2])
    holds = abs(doping - rest) < 0.25 * abs(rest)
    page.claim("knee_by_doping", holds=holds, doping=doping, rest=rest, others=others)


def discrepancy_section(page: Findings) -> None:
    """What remains of the 50 K that the knee is off: each suspect, in vacuum and in air.

    Quickly in vacuum alone, without the uncertain layout.
    """
    probe, media = page.lever.probe, ("vacuum",) if page.quick else ("vacuum", "air")
    options: Any = {"layout": not page.quick, "progress": page.progress}
    studies = {
        medium: compare_suspects(probe.in_medium(medium), page.fitted_example, **options)
        for medium in media
    }
    vacuum = studies["vacuum"]
    page.draw("knee_discrepancy", figures.knee_discrepancy(studies))
    rows = []
    for suspect in vacuum.suspect.values:
        rows.append([str(suspect)])
        for study in studies.values():
            rows[-1] += map(_shift, study[["moved_K", "shift_K"]].sel(suspect=suspect).values())
    for name in vacuum.uncertainty.values:
        errors = [study.stderr_K.sel(uncertainty=name) for study in studies.values()]
        rows.append([str(name), *(cell for error in errors for cell in ("", f"± {error:.1f}"))])
    left = [f"{study.left_K:.0f} ± {study.total_stderr_K:.0f}" for study in studies.values()]
    rows.append(["what remains", *(cell for value in left for cell in ("", value))])
    headings = [f"{way}, in {medium} (K)" for medium in media for way in ("not fitted", "fitted")]
    page.tabulate("knee_discrepancy", ["suspect", *headings], rows)
    together = vacuum.shift_K.sel(suspect=TOGETHER)
    page.say("knee_discrepancy", together=together, left=vacuum.left_K)
    if "air" in studies:
        carried = studies["air"].shift_K.sel(suspect=IN_AIR).item()
        page.claim("tip_in_air", holds=carried > 0.75 * paper.KNEE_OFF_K, carried=carried)


def _shift(value: xr.DataArray) -> str:
    """Return a shift of the knee (K), or that its suspect does not count in the medium."""
    return "–" if np.isnan(value) else f"{value:+.1f}"


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
