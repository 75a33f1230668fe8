"""The paper's results, computed: one page that puts ours beside the published ones."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from importlib.resources import as_file, files
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from hotlever.calibration.power_law import EQ12
from hotlever.fitting import Fit, Measurement, fit, read_measurement
from hotlever.lever import Lever
from hotlever.lever.equations import OBSERVABLES
from hotlever.lever.fields import FieldMapper, heater_profile
from hotlever.lever.lever import OBSERVABLE_COLUMNS
from hotlever.materials import PARAMETERS
from hotlever.materials.silicon import inversion_temperature
from hotlever.materials.spieser2017 import (
    DOI,
    NOMINAL_DOPING,
    OPERATING_POINTS,
    PUBLISHED,
    published,
)
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
    correlation_matrix,
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
#: Headings of the six parameters, in units of their scale.
_PARAMETER_COLUMNS = (
    "c_κ",
    "Δ (µm)",
    "n_d (1e17 cm⁻³)",
    "p",
    "a₀ (1e-4 Ω cm)",
    "a₁ (1e-6 Ω cm/K)",
)


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
        _options_section,
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
                    value_with_error(getattr(material, name), error.get(name), known.scale)
                    for name, known in PARAMETERS.items()
                ),
                "" if printed is None else f"{printed:.0f}",
                f"{ours:.1f}",
            )
        )
    page.table(
        (
            "set",
            *_PARAMETER_COLUMNS,
            "T_i published (K)",
            "T_i (K)",
        ),
        rows,
        "Published values; the last column is computed from n_d and p.",
    )


@cache
def _ramp(lever: Lever) -> xr.Dataset:
    """The paper's ramp; several sections look at the same one."""
    return lever.sweep(BIAS)


@cache
def _knee(lever: Lever) -> xr.Dataset:
    return lever.knee()


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
    knee = _knee(lever)
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
    sweep = _ramp(lever)
    curve = lever.sweep(np.linspace(0.1, BIAS[-1], 110))
    page.figure(
        "iv",
        iv_curve(sweep, _knee(lever), curve=curve),
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
    add_fit(page, fit(_example("lever-a.csv"), lever.probe))


def _options_section(page: Page, lever: Lever) -> None:
    page.heading("What each observable adds (options I to III, Figs. 3 and 4, Table I)")
    page.text(
        "lever-a.csv follows the model that is fitted. lever-b.csv comes from a richer one, with a "
        "tip on the heater, so that the fit cannot be perfect."
    )
    for name in ("lever-a.csv", "lever-b.csv"):
        _compare_options(page, _example(name), lever.probe)


def _compare_options(page: Page, measurement: Measurement, probe: Probe) -> None:
    name = Path(measurement.path).stem
    choices: dict[str, dict[str, Any]] = {
        "I": {"observables": ["current"]},
        "II": {"observables": ["current", "reader"]},
        "III": {},
        "III, n_d fixed": {"fixed": {"n_d": NOMINAL_DOPING}},
    }
    fits = {option: fit(measurement, probe, **choice) for option, choice in choices.items()}
    page.table(
        (name, *_PARAMETER_COLUMNS, "T_i (K)", "rms T_tip (K)"),
        [
            (
                f"option {option}",
                *(
                    value_with_error(found.value, found.stderr, PARAMETERS[key].scale)
                    for key, found in result.parameters.items()
                ),
                f"{result.inversion_temperature_K:.0f}",
                f"{result.residual_rms['tip_K']:.1f}",
            )
            for option, result in fits.items()
        ],
        f"{name}: parameters by what was fitted.",
    )
    for option in ("I", "II", "III"):
        result = fits[option]
        page.figure(
            f"{name}_correlation_{option}",
            correlation_matrix(result.names, result.correlation),
            f"{name}, option {option}: correlation of the fitted parameters.",
        )
    page.table(
        ("option", "strongest correlation between groups", "largest T_tip error above 850 K (K)"),
        [
            (option, f"{_between_groups(result):.2f}", f"{_hot_error(result):.0f}")
            for option, result in fits.items()
        ],
        f"{name}: coupling of the groups {{c_κ}}, {{a₀, a₁}} and {{Δ, n_d, p}}, and how far the "
        "predicted temperature is from the measured one.",
    )
    free, held = fits["III"].parameters, fits["III, n_d fixed"].parameters
    changes = ", ".join(
        f"{PARAMETERS[key].symbol} {held[key].value / free[key].value - 1:+.1%}"
        for key in PARAMETERS
        if key != "n_d"
    )
    page.text(
        f"{name}: holding n_d at the nominal {NOMINAL_DOPING:.2g} cm⁻³ changes the other "
        f"parameters by {changes}."
    )


def _between_groups(result: Fit) -> float:
    """Largest correlation between parameters of different groups, in absolute value."""
    group = {"c_kappa": 0, "a0": 1, "a1": 1, "delta": 2, "n_d": 2, "p": 2}
    groups = np.array([group[name] for name in result.names])
    apart = groups[:, None] != groups[None, :]
    return float(np.abs(result.correlation[apart]).max())


def _hot_error(result: Fit) -> float:
    """Largest difference of predicted and measured tip temperature above 850 K."""
    order = np.argsort(result.measurement.bias_V)
    measured = result.measurement.tip_K[order]
    return float(np.nanmax(np.abs(measured - result.band.tip_K.values)[measured > 850]))


def _example(name: str) -> Measurement:
    with as_file(files("hotlever") / "examples" / name) as path:
        return read_measurement(path)


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
    sweep = _ramp(lever)
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
        f"Largest difference over 1 to 11 V from a mesh of {fine.space.mesh.elements.nelements} "
        "triangles (sizes / 3).",
    )


def mesh_row(name: str, lever: Lever, fine: Lever) -> tuple[str, str, str, str, str]:
    """Return the largest differences of a sweep from that on a finer mesh, as text."""
    ours, best = _ramp(lever), _ramp(fine)
    differences: dict[str, xr.DataArray] = {
        observable: abs(ours[OBSERVABLE_COLUMNS[observable]] - best[OBSERVABLE_COLUMNS[observable]])
        for observable in OBSERVABLES
    }
    return (
        name,
        str(lever.space.mesh.elements.nelements),
        f"{(differences['current'] / best.current_mA).max().item():.1e}",
        f"{(differences['reader'] / best.reader_V).max().item():.1e}",
        f"{differences['tip'].max().item():.3f}",
    )
