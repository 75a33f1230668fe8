"""A reader over a surface: its slope, panels, plates, noise, and levers beside each other.

python benchmarks/reader.py [slopes|panels|plates|noise|levers]

slopes: the derivative by the distance against differences of fourth order.
panels: what is read with panels of several sizes, against those of two thirds of the usual size in
free space.
plates: the heat from the middle of a wide lever against κ/z and, with jumps, κ/(z + g + g');
and what one jump length for 600 K is off, against plates whose jumps are by the gas at each.
noise: Johnson noise of 2.5 kΩ at 600 K; temperature fluctuations against equipartition.
levers: sensitivity, resolution and thermal resistance of several levers, beside one published
(Z. Dai et al., Nanotechnology 21, 055503 (2010)): levers of other dimensions, so no target.
"""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
from scipy.constants import Boltzmann
from scipy.optimize import fsolve

from hotlever import Lever, Probe
from hotlever.air.operator import PanelledAir
from hotlever.lever.discretisation import plate_of
from hotlever.lever.lever import COARSE, State
from hotlever.lever.noise import NoiseOptions, Response, johnson, of_temperature
from hotlever.lever.reader import best_bias, over_surface
from hotlever.lever.space import TIP
from hotlever.lever.transient.modes import slowest_modes
from hotlever.materials.air import (
    kirchhoff_variable,
    temperature_jump_length,
    thermal_conductivity_of_air,
)
from hotlever.probe.drawing import Drawing, Layer, rectangle
from problems import EXAMPLE, table

OVER = Probe.reference().with_(medium="air", accommodation=1.0, surface_gap_um=1.0)
HEATED = {
    "circuit.reader.kind": "supply",
    "circuit.reader.bias_V": 2.0,
    "circuit.reader.series_resistance_ohm": 500.0,
}
#: Standard pressure (mbar), and that of the surroundings (K).
BAR, BASE = 1013.25, 293.0
PLATE = 0.7


def slopes() -> None:
    """Print the derivatives beside differences."""
    rows = []
    cases = {"heater": {}, "reader": HEATED, "reader, 0.5°": HEATED | {"surface_tilt_deg": 0.5}}
    for name, circuit in cases.items():
        lever = Lever(OVER.with_(**circuit), replace(COARSE, panels=0.4))
        for gap in (1.0, 3.0) if "°" in name else (0.1, 0.3, 1.0, 3.0):
            step = 2e-2 * gap
            here = over_surface(lever, [gap], [6.0])
            sides = over_surface(lever, [gap + n * step for n in (-2, -1, 1, 2)], [6.0])
            voltage, ohm = sides.reader_V.values[:, 0], np.log(sides.reader_ohm.values[:, 0])
            weights = np.array([1.0, -8.0, 8.0, -1.0]) / (12.0 * step)
            found = here.dV_dz_V_per_um.item(), here.dlnR_dz_per_um.item()
            off = [abs(a / (weights @ b) - 1.0) for a, b in zip(found, (voltage, ohm), strict=True)]
            rows.append([name, f"{gap:g}", f"{found[0]:.5g}", *(f"{each:.0e}" for each in off)])
    table(["read at", "distance (µm)", "dV/dz (V/µm)", "off", "d ln R/dz off"], rows)


def panels() -> None:
    """Print how far what is read is from that of fine panels."""
    published = Probe.coerce(EXAMPLE.with_name("uiuc-lever.toml"))
    published = published.with_(accommodation=1.0, surface_gap_um=1.0)
    cases = {
        "reference": (OVER, 8.0, (0.3, 1.0)),
        "reference, no jump": (Probe.reference().with_(medium="air"), 8.0, (0.2,)),
        "reference, reader at 2 V": (OVER.with_(**HEATED), 6.0, (0.5,)),
        "reference, 2°, chip": (OVER.with_(chip=True, surface_tilt_deg=2.0), 8.0, (5.0,)),
        "uiuc-lever": (published, 4.0, (0.2, 1.0, 5.0)),
    }
    rows = []
    for name, (probe, bias, gaps) in cases.items():
        for gap in gaps:
            over, found = probe.with_(surface_gap_um=gap), []
            for size in (1.5, 1.0, 0.7, 0.5):
                mesh = replace(COARSE, panels=size, panels_over_surface=size)
                data = over_surface(Lever(over, mesh), [gap], [bias])
                rise = data.tip_K.item() - BASE
                found.append([data[key].item() for key in ("reader_V", "dV_dz_V_per_um")] + [rise])
                if size < 1.5:
                    off = np.array(found[-1]) / found[0] - 1.0
                    rows.append([name, f"{gap:g}", f"{size:g}", *(f"{each:.0e}" for each in off)])
    table(["lever", "distance (µm)", "panels", "V off", "dV/dz off", "rise off"], rows)


def wide_plate() -> Probe:
    """A strip far wider than any gap."""
    drawing = Drawing(
        layers={"silicon": Layer(rectangle(0.0, -30.0, 80.0, 30.0), "plate")},
        terminals={name: [(x, -30), (x, 30)] for name, x in (("supply", 0.0), ("ground", 80.0))},
        tip_um=(40.0, 0.0),
        thickness_um=0.4,
    )
    materials = {"plate": Probe.reference().kinds["low-doped"]}
    return Probe.from_sections({**drawing.sections(), "materials": materials}, "plate")


def from_the_middle(gap: float, **more: object) -> float:
    """The heat flux over θ (1/µm) from the lower face of a wide plate, in its middle."""
    probe = wide_plate().with_(medium="air", surface_gap_um=gap, **more)
    air = PanelledAir(plate_of(probe), probe.surroundings, BASE, PLATE)
    flux = air.densities(np.ones((len(air.surface.sites), 1)))[:, 0]
    lower = air.surface.across[:, 1]
    away = np.linalg.norm(air.panels.centres[lower] - [40.0, 0.0, -0.2], axis=1)
    face = air.panels.centres[lower[[away.argmin()]]]
    # the slope of θ below the face
    below = [[0.0, 0.0, -share * gap] for share in (0.05, 0.15)]
    near, far = air.theta(face + below, flux)
    return float((near - far) / (0.1 * gap))


def jump(T: float) -> float:
    return float(temperature_jump_length(T, BAR, 1.0)[0])


def between_plates(hot: float, gap: float) -> float:
    """The heat flux (W/(cm µm)) between plates whose jumps are by the gas at each of them."""

    def missing(unknown: np.ndarray) -> list[float]:
        flux, near, far = unknown
        theta = kirchhoff_variable([near, far], BASE)[0]
        kappa = thermal_conductivity_of_air([near, far])[0]
        return [
            1e3 * (flux * gap - (theta[0] - theta[1])),
            hot - near - jump(near) * flux / kappa[0],
            far - BASE - jump(far) * flux / kappa[1],
        ]

    start = float(kirchhoff_variable(hot, BASE)[0]) / (gap + 0.4)
    return float(fsolve(missing, [start, 0.7 * hot + 0.3 * BASE, 0.3 * hot + 0.7 * BASE])[0])


def plates() -> None:
    """Print the limit of plates, and what one jump length is off."""
    rows, both = [], jump(600.0) + jump(BASE)
    for gap in (0.03, 0.1, 0.3, 1.0):
        row = [f"{gap:g}"]
        for more, jumps in (({}, 0.0), ({"accommodation": 1.0}, both)):
            near, far = (from_the_middle(factor * gap, **more) for factor in (0.95, 1.05))
            here = from_the_middle(gap, **more) * (gap + jumps)
            rise = np.log((1.05 * gap + jumps) / (0.95 * gap + jumps))
            row += [f"{here:.4f}", f"{np.log(far / near) / rise:.4f}"]
        rows.append(row)
    print(f"g + g' = {both:.4f} µm; of a wide plate, in units of κ/z and κ/(z + g + g')")
    table(["z (µm)", "no jump", "exponent", "jump", "exponent"], rows)
    rows = []
    for hot in (400.0, 500.0, 600.0, 800.0, 1000.0, 1200.0):
        row = [f"{hot:g}"]
        theta = float(kirchhoff_variable(hot, BASE)[0])
        for gap in (0.1, 0.3, 1.0, 3.0):
            exact = [between_plates(hot, factor * gap) for factor in (0.999, 1.0, 1.001)]
            one_g = [theta / (factor * gap + both) for factor in (0.999, 1.0, 1.001)]
            slope = (one_g[2] - one_g[0]) / (exact[2] - exact[0])
            row.append(f"{100 * (one_g[1] / exact[1] - 1):+.1f}, {100 * (slope - 1):+.1f}")
        rows.append(row)
    print("\nheat, and its slope by z: how far one g for 600 K is off (%)")
    table(["lever (K)", "0.1 µm", "0.3 µm", "1 µm", "3 µm"], rows)


def noise() -> None:
    """Print noise beside what thermodynamics says."""
    warm = Lever(Probe.reference().with_(base_temperature_K=600.0, series_resistance_ohm=1e7))
    (state,) = warm.solve([1.0])
    found = johnson(Response.of(warm.equations, state.x, TIP, "lever_V"))
    ohm = 1e3 * state.lever_V / state.current_mA
    alone = np.sqrt(found * 2500.0 / ohm) * (1.0 + ohm / 1e7)
    exact = np.sqrt(4.0 * Boltzmann * 600.0 * 2500.0)
    rows = [
        ["Johnson noise of 2.5 kΩ at 600 K (nV/√Hz)", f"{1e9 * alone:.4f}", f"{1e9 * exact:.4f}"]
    ]
    lever = Lever(Probe.reference())
    cold = np.zeros((lever.space.size + 1, 1))
    taus, modes = slowest_modes(State(lever, cold))
    for number, (tau, mode) in enumerate(zip(taus, modes.T, strict=True)):
        shape = np.where(lever.space.is_temperature, mode, 0.0)[:, None]
        capacity = 1e-9 * (shape * lever.equations.storage_change(cold, shape)).sum()
        cold_lever = Response(lever.equations, cold, shape, 0.0, 0.0, np.negative)
        fluxes = 1e-6 * of_temperature(cold_lever)
        # the integral of S over all frequencies, of a mode that decays in τ
        variance = fluxes * 1e-6 * tau / (4.0 * capacity**2)
        thermal = Boltzmann * BASE**2 / capacity
        text = f"variance of mode {number + 1}, τ = {tau:.3g} µs, over k_B T²/C"
        rows.append([text, f"{variance / thermal:.6f}", "1"])
    table(["", "found", "exact"], rows)


def levers() -> None:
    """Print several levers beside a published one."""
    cases = {
        "reference, its heater": OVER,
        "reference, its reader at 2 V": OVER.with_(**HEATED),
        "half as thick": OVER.with_(thickness_um=0.2),
        "legs twice as long": OVER.with_(length_um=108.8),
        "U-shape": Probe.u_shape().with_(medium="air", accommodation=1.0, surface_gap_um=1.0),
    }
    rows = []
    for name, probe in cases.items():
        lever = Lever(probe, COARSE)
        plain, with_flicker = NoiseOptions(), NoiseOptions(hooge=1e-5)
        gap = 0.5
        bias = best_bias(lever, [gap], 11.0, with_flicker)
        white, all_ = (over_surface(lever, [gap], [bias], each) for each in (plain, with_flicker))
        vacuum = lever.in_medium("vacuum") if "reader" not in probe.circuit.contacts else None
        rows.append(
            [
                name,
                f"{bias:.3g}",
                f"{all_.tip_K.item():.0f}",
                f"{1e-3 * abs(all_.dlnR_dz_per_um.item()):.2g}",
                f"{1e3 * white.resolution_nm_per_rtHz.item():.2g}",
                f"{1e3 * all_.resolution_nm_per_rtHz.item():.2g}",
                "" if vacuum is None else f"{1e3 * rise_by_power(vacuum):.2g}",
            ]
        )
    rows.append(["Dai et al.", "", "", "1.3e-4", "", "7", "> 1e5"])
    head = ["lever, at 0.5 µm", "bias (V)", "tip (K)", "d ln R/dz (1/nm)"]
    table([*head, "white (pm/√Hz)", "with 1/f, α = 1e-5", "K/W in vacuum"], rows)


def rise_by_power(lever: Lever) -> float:
    """The rise of the tip by the power (K/mW) of a lever that is hardly heated."""
    (state,) = lever.solve([1.0])
    return (state.tip_K - BASE) / (state.lever_V * state.current_mA)


if __name__ == "__main__":
    parts = {"slopes": slopes, "panels": panels, "plates": plates, "noise": noise, "levers": levers}
    for name in sys.argv[1:] or parts:
        parts[name]()
        print()
