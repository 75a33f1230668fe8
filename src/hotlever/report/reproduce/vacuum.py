"""The lever in vacuum: parameters, operating points, characteristics, heater, knee, balances."""

from __future__ import annotations

import numpy as np
import xarray as xr

from hotlever.calibration.knee_reasons import knee_reasons
from hotlever.calibration.power_law import EQ12
from hotlever.calibration.power_law_fit import PowerLawFit, fit_power_law
from hotlever.lever import Lever
from hotlever.lever.fields import FieldMapper, heater_profile
from hotlever.lever.lever import OBSERVABLE_COLUMNS
from hotlever.materials import PARAMETERS
from hotlever.materials.silicon import inversion_temperature
from hotlever.materials.spieser2017 import OPERATING_POINTS, PUBLISHED, RAMP
from hotlever.probe import MeshOptions
from hotlever.report.figures import (
    doping_profile,
    field_maps,
    heater_profiles,
    iv_curve,
    probe_drawing,
    resistances,
    temperature_power,
)
from hotlever.report.fit_report import value_with_error
from hotlever.report.reproduce.study import Study

#: Headings of the six parameters, in units of their scale.
PARAMETER_COLUMNS = (
    "c_κ",
    "Δ (µm)",
    "n_d (1e17 cm⁻³)",
    "p",
    "a₀ (1e-4 Ω cm)",
    "a₁ (1e-6 Ω cm/K)",
)
#: Power (mW) up to which the paper's law has data on the published lever's hot branch.
_WELL_COVERED_MW = 3.3
#: Deviation (K) that the paper grants its law.
_PAPERS_SPREAD_K = 25.0


def probe_section(study: Study) -> None:
    """The layout."""
    study.page.heading("The reference probe")
    study.page.figure(
        "probe",
        probe_drawing(study.lever.space.mesh.layout),
        "The reference probe from above. The current enters at the supply, passes the heater and "
        "leaves by the left leg to ground; the right leg senses the potential of the bridge.",
    )


def parameter_section(study: Study) -> None:
    """Tables I and II, and T_i from their values."""
    study.page.heading("Published parameters and inversion temperatures (Tables I and II)")
    rows, away = [], []
    for entry in PUBLISHED.values():
        material, error = entry.material, entry.standard_error
        ours = float(inversion_temperature(material.n_d, material.p))
        printed = entry.inversion_temperature_K
        if printed is not None:
            away.append(abs(ours - printed))
        rows.append(
            (
                entry.name,
                *(
                    value_with_error(getattr(material, name), error.get(name), known.scale)
                    for name, known in PARAMETERS.items()
                ),
                "" if printed is None else f"{printed:.0f}",
                f"{ours:.1f}",
            )
        )
    study.page.table(
        (
            "set",
            *PARAMETER_COLUMNS,
            "T_i published (K)",
            "T_i (K)",
        ),
        rows,
        "Published values; the last column is computed from n_d and p.",
    )
    study.claim(
        "Tables I and II",
        "the inversion temperatures T_i follow from n_d and p",
        f"largest difference {max(away):.1f} K",
        holds=max(away) < 1.0,
        within="1 K",
        because="the laws give other temperatures",
    )


def published_biases(lever: Lever) -> list[float]:
    """Bias V_l + R_s I_h of each published operating point, in the lever's circuit."""
    series = lever.probe.circuit.series_resistance_ohm / 1000.0
    return [point.lever_V + series * point.current_mA for point in OPERATING_POINTS]


def operating_points_section(study: Study) -> None:
    """The three published points."""
    study.page.heading("Published operating points")
    ours = study.lever.sweep(published_biases(study.lever))
    rows, away = [], []
    for place, point in enumerate(OPERATING_POINTS):
        here = ours.isel(bias=place)
        lever_V, current_mA = here.lever_V.item(), here.current_mA.item()
        away += [abs(lever_V / point.lever_V - 1), abs(current_mA / point.current_mA - 1)]
        rows.append(
            (
                point.name,
                f"{here.bias_V.item():.3f}",
                f"{point.lever_V:.2f}",
                f"{lever_V:.3f} ({lever_V / point.lever_V - 1:+.2%})",
                f"{point.current_mA:.2f}",
                f"{current_mA:.3f} ({current_mA / point.current_mA - 1:+.2%})",
                "" if point.tip_K is None else f"{point.tip_K:.0f}",
                f"{here.tip_K.item():.1f}",
            )
        )
    knee = study.knee
    rows.append(
        (
            "dV_l/dI_h = 0",
            f"{knee.bias_V.item():.3f}",
            "",
            f"{knee.lever_V.item():.3f}",
            "",
            f"{knee.current_mA.item():.3f}",
            "",
            f"{knee.tip_K.item():.1f}",
        )
    )
    study.page.table(
        (
            "point",
            "bias (V)",
            "V_l published (V)",
            "V_l (V)",
            "I_h published (mA)",
            "I_h (mA)",
            "T_tip published (K)",
            "T_tip (K)",
        ),
        rows,
        "At the bias V_l + R_s I_h of each published point, with the option-III parameters. The "
        "last row is the exact knee, which the paper reads off its 25 points.",
    )
    study.claim(
        "Figs. 6 and 7",
        "option III gives the three operating points of plateau, knee and hot branch",
        f"largest difference {max(away):.2%} in V_l and I_h",
        holds=max(away) < 0.01,
        within="1 %",
        because="V_l or I_h differs by more; the published layout is not known",
    )
    predicted = next(point.tip_K for point in OPERATING_POINTS if point.tip_K is not None)
    tip = knee.tip_K.item()
    study.claim(
        "Fig. 6",
        f"the simulated knee lies at {predicted:.0f} K",
        f"{tip:.1f} K where dV_l/dI_h = 0",
        holds=abs(tip - predicted) < 10.0,
        within="10 K: the paper reads it off 25 points",
        because="the exact knee lies elsewhere",
    )


def characteristics_section(study: Study) -> None:
    """I-V curve, T(P) and resistances (Figs. 5 and 6)."""
    study.page.heading("Characteristics in vacuum (Figs. 5 and 6)")
    sweep = study.ramp
    curve = study.curve
    study.page.figure(
        "iv",
        iv_curve(sweep, study.knee, curve=curve),
        "Heater current against lever voltage, option III, 1 to 11 V in 25 steps, with the knee "
        "dV_l/dI_h = 0.",
    )
    study.page.figure(
        "temperature_power",
        temperature_power(curve),
        "Tip temperature against dissipated power, beside the published law (Eq. 12).",
    )
    power_law(study, curve)
    study.page.figure(
        "resistances",
        resistances(curve),
        "Resistance of the lever, the heater and the legs against tip temperature.",
    )


def power_law(study: Study, curve: xr.Dataset) -> None:
    """Compare Eq. 12 with the computed characteristic, as published and fitted again."""
    difference = np.abs(curve.tip_K - EQ12.tip_temperature(curve.power_mW))
    below = difference.where(curve.power_mW <= _WELL_COVERED_MW).max().item()
    last = curve.isel(bias=-1)
    refits = {
        "fitted": fit_power_law(curve.power_mW, curve.tip_K),
        "fitted, continuous": fit_power_law(curve.power_mW, curve.tip_K, continuous=True),
    }

    def row(name: str, refit: PowerLawFit) -> tuple[str, ...]:
        law = refit.law
        return (
            name,
            f"{law.linear_K_per_mW:.1f}",
            f"{law.nonlinear_K:.2f}",
            f"{law.exponent:.2f}",
            f"{law.hot_K_per_mW:.1f}",
            f"{law.threshold_mW:.2f}",
            f"{law.jump_K:+.1f}",
            f"{refit.largest_residual_K(to_mW=_WELL_COVERED_MW):.0f}",
            f"{refit.largest_residual_K(from_mW=_WELL_COVERED_MW):.0f}",
        )

    study.page.table(
        (
            "Eq. 12",
            "a (K/mW)",
            "b (K)",
            "m",
            "c (K/mW)",
            "P_th (mW)",
            "jump (K)",
            f"residual to {_WELL_COVERED_MW} mW (K)",
            "above (K)",
        ),
        [
            (
                "published",
                f"{EQ12.linear_K_per_mW:.1f}",
                f"{EQ12.nonlinear_K:.2f}",
                f"{EQ12.exponent:.2f}",
                f"{EQ12.hot_K_per_mW:.1f}",
                f"{EQ12.threshold_mW:.2f}",
                f"{EQ12.jump_K:+.1f}",
                f"{below:.0f}",
                f"{difference.values[-1]:.0f}",
            ),
            *(row(name, refit) for name, refit in refits.items()),
        ],
        "Coefficients of the power law, and its largest distance from the computed curve.",
    )
    everywhere = difference.max().item()
    study.claim(
        "Eq. 12",
        f"T_tip follows the power law within {_PAPERS_SPREAD_K:.0f} K",
        f"{below:.0f} K up to {_WELL_COVERED_MW} mW, {difference.values[-1]:.0f} K at "
        f"{last.power_mW.item():.2f} mW ({last.tip_K.item():.0f} K)",
        holds=everywhere < _PAPERS_SPREAD_K,
        because=f"it is left by {everywhere:.0f} K at the hot end, where κ_Si keeps falling and "
        "the law is straight",
    )
    study.claim(
        "Eq. 12",
        "one formula in two branches describes the temperature",
        f"the branches miss each other by {EQ12.jump_K:.1f} K at P_th",
        holds=abs(EQ12.jump_K) < _PAPERS_SPREAD_K,
        within="a jump that the claimed accuracy covers",
        because="the jump is larger than the claimed accuracy",
    )


def heater_section(study: Study) -> None:
    """Doping, resistivity and temperature along the heater (Fig. 7)."""
    study.page.heading("Inside the heater (Fig. 7)")
    states = study.lever.solve(published_biases(study.lever)).states
    names = [point.name for point in OPERATING_POINTS]
    profiles = {
        name: heater_profile(study.lever, state.x)
        for name, state in zip(names, states, strict=True)
    }
    study.page.figure(
        "doping_profile",
        doping_profile(next(iter(profiles.values()))),
        "Doping concentration along the heater and the inversion temperature that follows from it.",
    )
    profile = next(iter(profiles.values()))
    lowly = profile.doping < 2.0 * study.lever.probe.material.n_d
    length = float(lowly.mean() * (profile.position.max() - profile.position.min()))
    layout = study.lever.space.mesh.layout
    drawn = next(region.taper for region in layout.regions if region.part == "heater")
    nominal = float("nan") if drawn is None else drawn.length_um
    study.claim(
        "Fig. 7a",
        "dopant diffusion shortens the heater to about half its drawn length",
        f"doping below 2 n_d over {length:.2f} of {nominal:.2f} µm",
        holds=0.35 < length / nominal < 0.65,
        within=f"a factor of {length / nominal / 0.5:.2f}",
        because=f"{length / nominal:.0%} of the length are left",
    )
    study.page.figure(
        "heater_profiles",
        heater_profiles(profiles),
        "Local resistivity and temperature along the heater at the three published points.",
    )
    knee = states[names.index("knee")]
    study.page.figure(
        "field_maps",
        field_maps(
            FieldMapper(study.lever).map(knee.x),
            study.lever.space.mesh.layout,
            f"bias {knee.bias:.2f} V (knee)",
        ),
        "Temperature, potential and current density at the knee; the heater magnified.",
    )


def knee_section(study: Study) -> None:
    """The ways from T_i to the knee."""
    study.page.heading("Why the knee is not at the inversion temperature")
    reasons = knee_reasons(study.lever)
    kelvins = dict(reasons.steps())
    rows, at = (
        [("inversion temperature T_i", "", f"{reasons.inversion_K:.1f}")],
        reasons.inversion_K,
    )
    for name, step in kelvins.items():
        at += step
        rows.append((name, f"{step:+.1f}", f"{at:.1f}"))
    study.page.table(
        ("from T_i to the knee", "step (K)", "T_tip (K)"),
        rows,
        "Levers without leg resistance, without dopant diffusion, and without both, solved.",
    )
    legs = kelvins["the legs have a resistance"]
    study.claim(
        "Section IV",
        "leg resistance raises the knee by about 15 K",
        f"{legs:+.1f} K",
        holds=7.5 < legs < 22.5,
        within=f"{abs(legs - 15.0):.0f} K",
        because=f"a lever without leg resistance has its knee {-legs:+.0f} K away",
    )
    rest, doping = (
        reasons.knee_K["as it is"] - reasons.inversion_K - legs,
        kelvins["the doping is not uniform"],
    )
    study.claim(
        "Section IV",
        "the rest of the distance from T_i is the non-uniform doping",
        f"{doping:+.1f} K of {rest:+.1f} K",
        holds=abs(doping - rest) < 0.25 * abs(rest),
        because="two more reasons remain with uniform doping: "
        + "; ".join(f"{name} ({step:+.0f} K)" for name, step in list(kelvins.items())[:2]),
    )


def balance_section(study: Study) -> None:
    """Charge and energy."""
    study.page.heading("Balances")
    sweep = study.ramp
    charge = np.abs(sweep.ground_current_mA / sweep.current_mA - 1).max().item()
    energy = np.abs(sweep.end_heat_mW / sweep.power_mW - 1).max().item()
    study.page.text(
        f"Over the 25 biases, the current to ground equals the current from the supply within "
        f"{charge:.1e}, and the heat through the leg ends equals V_l I_h within {energy:.1e} "
        "(relative)."
    )


def mesh_section(study: Study) -> None:
    """How far the default mesh is from a much finer one."""
    study.page.heading("Mesh")
    fine = Lever(study.lever.probe, MeshOptions(refinement=3.0))
    best = fine.sweep(RAMP)

    def row(name: str, lever: Lever, ours: xr.Dataset) -> tuple[str, ...]:
        differences: dict[str, xr.DataArray] = {
            observable: abs(ours[column] - best[column])
            for observable, column in OBSERVABLE_COLUMNS.items()
        }
        return (
            name,
            str(lever.space.mesh.elements.nelements),
            f"{(differences['current'] / best.current_mA).max().item():.1e}",
            f"{(differences['reader'] / best.reader_V).max().item():.1e}",
            f"{differences['tip'].max().item():.3f}",
        )

    finer = Lever(study.lever.probe, MeshOptions(refinement=2.0))
    study.page.table(
        ("mesh", "triangles", "I_h (relative)", "V_r (relative)", "T_tip (K)"),
        [
            row("default", study.lever, study.ramp),
            row("sizes / 2", finer, finer.sweep(RAMP)),
        ],
        f"Largest difference over 1 to 11 V from a mesh of {fine.space.mesh.elements.nelements} "
        "triangles (sizes / 3).",
    )
