"""The paper's results, computed: one page that puts ours beside the published ones."""

from __future__ import annotations

from collections.abc import Callable
from importlib.resources import as_file, files

import numpy as np
import xarray as xr

from hotlever.calibration.power_law import EQ12
from hotlever.fitting import fit, read_measurement
from hotlever.lever import Lever
from hotlever.lever.equations import OBSERVABLES
from hotlever.lever.fields import FieldMapper, heater_profile
from hotlever.lever.lever import OBSERVABLE_COLUMNS
from hotlever.materials.silicon import inversion_temperature
from hotlever.materials.spieser2017 import DOI, OPERATING_POINTS, PUBLISHED, published
from hotlever.probe import MeshOptions, Probe
from hotlever.raman import (
    Thermometer,
    calibrate_from,
    measure,
    paper_check,
    read_lines,
    read_spectra,
)
from hotlever.raman.figures import paper_check as draw_paper_check
from hotlever.raman.figures import thermometry
from hotlever.report.figures import (
    doping_profile,
    field_maps,
    heater_profiles,
    iv_curve,
    probe_drawing,
    resistances,
    temperature_power,
)
from hotlever.report.fit_report import add_fit, value_with_error
from hotlever.report.page import Page

#: The paper's ramp: 1 to 11 V in 25 steps.
BIAS = np.linspace(1.0, 11.0, 25)


def reproduce_page(quick: bool, progress: Callable[[int, int], None]) -> Page:
    """Compute everything and return the page.

    Parameters
    ----------
    quick : bool
        Leave out the study of the mesh.
    progress : callable
        Called with the sections done and their number.
    """
    probe = Probe.reference().with_values(published("option III").material.model_dump())
    lever = Lever(probe)
    page = Page(
        "Joule-heated cantilever probes: the published results, computed",
        f"Spieser et al., J. Appl. Phys. 121, 174503 (2017), doi:{DOI}, with hotlever's reference "
        "probe, whose dimensions are inferred: no drawing of the published lever exists.",
    )
    sections: list[Callable[[Page, Lever], None]] = [
        _probe_section,
        _parameter_section,
        _operating_points_section,
        _characteristics_section,
        _heater_section,
        _fit_section,
        _thermometer_section,
        _balance_section,
    ]
    if not quick:
        sections.append(_mesh_section)
    for number, section in enumerate(sections, start=1):
        section(page, lever)
        progress(number, len(sections))
    return page


def _probe_section(page: Page, lever: Lever) -> None:
    page.heading("The reference probe")
    page.figure(
        "probe",
        probe_drawing(lever.space.mesh.layout),
        "The reference probe from above. The current enters at the supply, passes the heater and "
        "leaves by the left leg to ground; the right leg senses the potential of the bridge.",
    )


def _parameter_section(page: Page, lever: Lever) -> None:
    page.heading("Published parameters and inversion temperatures (Tables I and II)")
    rows = []
    for entry in PUBLISHED.values():
        material, error = entry.material, entry.standard_error
        ours = float(inversion_temperature(material.n_d, material.p))
        printed = entry.inversion_temperature_K
        rows.append(
            (
                entry.name,
                *(
                    value_with_error(getattr(material, name), error.get(name), scale)
                    for name, scale in (
                        ("c_kappa", 1),
                        ("delta", 1),
                        ("n_d", 1e17),
                        ("p", 1),
                        ("a0", 1e-4),
                        ("a1", 1e-6),
                    )
                ),
                "" if printed is None else f"{printed:.0f}",
                f"{ours:.1f}",
            )
        )
    page.table(
        (
            "set",
            "c_κ",
            "Δ (µm)",
            "n_d (1e17 cm⁻³)",
            "p",
            "a₀ (1e-4 Ω cm)",
            "a₁ (1e-6 Ω cm/K)",
            "T_i published (K)",
            "T_i (K)",
        ),
        rows,
        "Published values; the last column is computed from n_d and p.",
    )


def _published_biases(lever: Lever) -> list[float]:
    """Bias V_l + R_s I_h of each published operating point, in the lever's circuit."""
    series = lever.probe.circuit.series_resistance_ohm / 1000.0
    return [point.lever_V + series * point.current_mA for point in OPERATING_POINTS]


def _operating_points_section(page: Page, lever: Lever) -> None:
    page.heading("Published operating points")
    ours = lever.sweep(_published_biases(lever))
    rows = []
    for place, point in enumerate(OPERATING_POINTS):
        here = ours.isel(bias=place)
        lever_V, current_mA = here.lever_V.item(), here.current_mA.item()
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
    knee = lever.knee()
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
    page.table(
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


def _characteristics_section(page: Page, lever: Lever) -> None:
    page.heading("Characteristics in vacuum (Figs. 5 and 6)")
    sweep = lever.sweep(BIAS)
    curve = lever.sweep(np.linspace(0.1, BIAS[-1], 110))
    page.figure(
        "iv",
        iv_curve(sweep, lever.knee(), curve=curve),
        "Heater current against lever voltage, option III, 1 to 11 V in 25 steps, with the knee "
        "dV_l/dI_h = 0.",
    )
    page.figure(
        "temperature_power",
        temperature_power(curve),
        "Tip temperature against dissipated power, beside the published law (Eq. 12).",
    )
    difference = np.abs(curve.tip_K - EQ12.tip_temperature(curve.power_mW))
    below = difference.where(curve.power_mW <= 3.3).max().item()
    last = curve.isel(bias=-1)
    page.text(
        f"The computed tip temperature is within {below:.0f} K of Eq. 12 up to 3.3 mW and "
        f"{difference.values[-1]:.0f} K from it at {last.power_mW.item():.2f} mW "
        f"({last.tip_K.item():.0f} K). The law itself jumps by {EQ12.jump_K:.1f} K at its "
        "threshold."
    )
    page.figure(
        "resistances",
        resistances(curve),
        "Resistance of the lever, the heater and the legs against tip temperature.",
    )


def _heater_section(page: Page, lever: Lever) -> None:
    page.heading("Inside the heater (Fig. 7)")
    states = lever.solve(_published_biases(lever)).states
    names = [point.name for point in OPERATING_POINTS]
    profiles = {
        name: heater_profile(lever, state.x) for name, state in zip(names, states, strict=True)
    }
    page.figure(
        "doping_profile",
        doping_profile(next(iter(profiles.values()))),
        "Doping concentration along the heater and the inversion temperature that follows from it.",
    )
    page.figure(
        "heater_profiles",
        heater_profiles(profiles),
        "Local resistivity and temperature along the heater at the three published points.",
    )
    knee = states[names.index("knee")]
    page.figure(
        "field_maps",
        field_maps(
            FieldMapper(lever).map(knee.x),
            lever.space.mesh.layout,
            f"bias {knee.bias:.2f} V (knee)",
        ),
        "Temperature, potential and current density at the knee; the heater magnified.",
    )


def _fit_section(page: Page, lever: Lever) -> None:
    page.heading("Material parameters from a measurement (option III)")
    page.text(
        "The data set lever-a.csv was made with an independent solver and instrument noise; its "
        "parameters are not known to the fit, which starts from the published option III."
    )
    with as_file(files("hotlever") / "examples" / "lever-a.csv") as path:
        measurement = read_measurement(path)
    add_fit(page, fit(measurement, lever.probe))


def _thermometer_section(page: Page, lever: Lever) -> None:
    page.heading("The Raman thermometer (Fig. 2)")
    with as_file(files("hotlever") / "examples" / "raman") as folder:
        calibration, series = calibrate_from(read_spectra([folder / "hot-plate"]))
        lines = measure(read_spectra([folder / "tip"]))
    rows = read_lines(lines, Thermometer(calibration, "anharmonic"))
    page.figure(
        "raman_calibration",
        thermometry(lines, rows, calibration, series),
        "Silicon spectra of a hot plate (some of the virtual lab's), the two calibration laws with "
        "tip spectra read by the anharmonic one, and what the laws leave of the hot plate.",
    )
    check = paper_check()
    page.figure("raman_check", draw_paper_check(check), check.conclusion())


def _balance_section(page: Page, lever: Lever) -> None:
    page.heading("Balances")
    sweep = lever.sweep(BIAS)
    charge = np.abs(sweep.ground_current_mA / sweep.current_mA - 1).max().item()
    energy = np.abs(sweep.end_heat_mW / sweep.power_mW - 1).max().item()
    page.text(
        f"Over the 25 biases, the current to ground equals the current from the supply within "
        f"{charge:.1e}, and the heat through the leg ends equals V_l I_h within {energy:.1e} "
        "(relative)."
    )


def _mesh_section(page: Page, lever: Lever) -> None:
    page.heading("Mesh")
    fine = Lever(lever.probe, MeshOptions(refinement=3.0))
    page.table(
        ("mesh", "triangles", "I_h (relative)", "V_r (relative)", "T_tip (K)"),
        [
            mesh_row("default", lever, fine),
            mesh_row("sizes / 2", Lever(lever.probe, MeshOptions(refinement=2.0)), fine),
        ],
        f"Largest difference over 1 to 11 V from a mesh of {fine.space.mesh.triangles.nelements} "
        "triangles (sizes / 3).",
    )


def mesh_row(name: str, lever: Lever, fine: Lever) -> tuple[str, str, str, str, str]:
    """Return the largest differences of a sweep from that on a finer mesh, as text."""
    ours, best = lever.sweep(BIAS), fine.sweep(BIAS)
    differences: dict[str, xr.DataArray] = {
        observable: abs(ours[OBSERVABLE_COLUMNS[observable]] - best[OBSERVABLE_COLUMNS[observable]])
        for observable in OBSERVABLES
    }
    return (
        name,
        str(lever.space.mesh.triangles.nelements),
        f"{(differences['current'] / best.current_mA).max().item():.1e}",
        f"{(differences['reader'] / best.reader_V).max().item():.1e}",
        f"{differences['tip'].max().item():.3f}",
    )
