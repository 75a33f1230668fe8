"""The air around the reference probe: by boundary elements, and by the full 3-D simulation.

    python benchmarks/air.py panels
    python benchmarks/air.py [points|operator|study|vacuum|sweep]

panels says what the operator costs, what a sweep costs, and what the panels do; the others print
the numbers of the full 3-D simulation, and what moves them.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from statistics import median
from unittest.mock import patch

import numpy as np
import xarray as xr
from scipy.interpolate import PchipInterpolator

from hotlever.air import surface
from hotlever.air.operator import PanelledAir
from hotlever.cache import CACHE_VARIABLE
from hotlever.estimate.experiment import experiment_of
from hotlever.lever import Lever
from hotlever.lever.response_surface import PAPER, ParameterDomain
from hotlever.lever3d import SolidLever
from hotlever.probe import Probe
from hotlever.probe.mesh import SolidMeshOptions
from hotlever.probe.surroundings import Surroundings
from hotlever.spieser2017 import BASE_TEMPERATURE_K, K_IN_AIR
from hotlever.studies.air_scaling import HOT, error_of_one_factor, find_scale_factor
from problems import BIAS, processor_seconds, table

# --- boundary elements ---------------------------------------------------------------------------

RUNS = 7
PLACES = {
    "free space": Surroundings(),
    "surface 8 µm below": Surroundings(surface_gap_um=8.0),
    "the same, tilted by 10°, and chip": Surroundings(
        surface_gap_um=8.0, surface_tilt_deg=10.0, chip=True
    ),
}


def build(place: str) -> None:
    """Print sites, seconds, CPU seconds and GB of making an operator in a process of its own."""
    layout = Probe.reference().layout()
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    began, began_cpu = time.perf_counter(), time.process_time()
    operator = PanelledAir(layout, PLACES[place], BASE_TEMPERATURE_K, 1.0).operator()
    seconds, cpu = time.perf_counter() - began, time.process_time() - began_cpu
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    memory = (f"{value / 2**20:.2f}" for value in (peak, before))
    print(len(operator.sites), f"{seconds:.2f}", f"{cpu:.2f}", *memory)


def building():
    print("Making the operator of the reference probe, in a process of its own (≤ 10 s, ≤ 4 GB)\n")
    rows = []
    for place in PLACES:
        command = [sys.executable, __file__, "--build", place]
        out = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()
        rows.append((place, *out))
    table(("", "sites", "seconds", "CPU seconds", "peak GB", "of which imports"), rows)


def speed(vacuum, air):
    """Print the times of sweeps; return the reduced model in air."""
    levers = {"vacuum": vacuum, "air": air}
    models = {name: experiment_of(lever.probe, BIAS, reduce=True) for name, lever in levers.items()}
    material = vacuum.probe.material
    kinds = {
        # made anew each time: a lever keeps its branch
        "full lever": lambda name: levers[name].with_material(material).sweep(BIAS),
        "full, with sensitivities": lambda name: (
            levers[name].with_material(material).sweep(BIAS, sensitivities=True)
        ),
        "reduced, with sensitivities": lambda name: models[name].predict(levers[name].probe),
    }
    rows = []
    for kind, action in kinds.items():
        times = {name: [] for name in levers}
        for _ in range(RUNS):  # in turns, so that a slow spell of the machine meets both
            for name in levers:
                times[name].append(processor_seconds(partial(action, name)))
        in_vacuum, in_air = (median(seconds) for seconds in times.values())
        rows.append((kind, f"{in_vacuum:.3f}", f"{in_air:.3f}", f"{in_air / in_vacuum:.2f}"))
    print("\n25-point sweep, operator at hand: CPU seconds, median (air ≤ 2 × vacuum)\n")
    table(("", "vacuum", "air", "ratio"), rows)
    return models["air"]


def accuracy(air, model, count=8):
    rng = np.random.default_rng(5)
    rows = []
    for _ in range(count):
        material = ParameterDomain.of(air.probe).probe(air.probe, rng.random(len(PAPER))).material
        material = material.with_(c_kappa=rng.uniform(0.6, 0.76))
        full = air.with_material(material).sweep(BIAS)
        current, reader, tip, _ = model.predict(air.with_material(material).probe).values
        rows.append(
            (
                np.abs(current / full.current_mA.values - 1).max(),
                np.abs(reader / full.reader_V.values - 1).max(),
                np.abs(tip - full.tip_K.values).max(),
            )
        )
    print(f"\nReduced against full lever in air, {count} random parameter sets, 25 biases\n")
    largest = np.max(rows, axis=0)
    table(
        ("", "I_h (relative)", "V_r (relative)", "T_tip (K)"),
        [("largest", *(f"{value:.1e}" for value in largest))],
    )


def refinement(vacuum, air):
    probe = air.probe
    bias = [4.0, 8.268, 10.748]

    def observed(refinement, **changes):
        operator = PanelledAir(
            probe.layout(), probe.surroundings, BASE_TEMPERATURE_K, refinement
        ).operator()
        space = vacuum.space.in_air(replace(operator, **changes))
        return len(operator.sites), Lever(probe, space=space).sweep(bias)

    def at_half(size):
        with patch.object(surface, size, getattr(surface, size) / 2):
            return observed(1.0)

    _, finest = observed(2.0)
    choices = {
        "sizes × 2": observed(0.5),
        "default": observed(1.0),
        "sizes / 1.5": observed(1.5),
        "half the size at edges only": at_half("EDGE"),
        "half the size in the heater only": at_half("HEATER"),
        "default, κ_Si in the plate, not κ_Si - κ_air": observed(1.0, filling=0.0),
    }
    rows = []
    for name, (count, data) in choices.items():
        tip = (data.tip_K - finest.tip_K) / (finest.tip_K - BASE_TEMPERATURE_K)
        current = data.current_mA / finest.current_mA - 1
        heat = data.air_heat_mW / finest.air_heat_mW - 1
        rows.append((name, count, *(f"{np.abs(x).max().item():.1e}" for x in (heat, tip, current))))
    print("\nPanels: largest relative distance from panels of half the size, 4 to 10.7 V\n")
    table(("", "sites", "heat into air", "rise of T_tip", "I_h"), rows)


def surroundings(vacuum):
    """What is around the lever, at the bias of the knee in vacuum."""
    jump = {"accommodation": 0.9}
    places = {
        "free space": {},
        **{f"surface {gap:g} µm below": {"surface_gap_um": gap} for gap in (100, 10, 1, 0.3)},
        "surface 10 µm below, 10° tilt": {"surface_gap_um": 10.0, "surface_tilt_deg": 10.0},
        "chip": {"chip": True},
        **{
            f"α = 0.9, {pressure:g} mbar": jump | {"pressure_mbar": pressure}
            for pressure in (1013.25, 100.0, 10.0, 1.0, 0.1)
        },
        "α = 0.9, jump of 300 K air": jump | {"jump_temperature_K": 300.0},
        "α = 0.9, jump of 1000 K air": jump | {"jump_temperature_K": 1000.0},
    }
    rows = []
    for name, values in places.items():
        probe = vacuum.probe.with_(**{"medium": "air", **values})
        data = vacuum.with_probe(probe).sweep([8.268])
        share = (data.air_heat_mW / data.power_mW).item()
        rows.append((name, f"{data.tip_K.item():.1f}", f"{100 * share:.1f} %"))
    rows.append(("vacuum", f"{vacuum.sweep([8.268]).tip_K.item():.1f}", "0 %"))
    print("\nSurroundings, at 8.268 V\n")
    table(("", "T_tip (K)", "air's share of the power"), rows)


def scale_factor(vacuum, air):
    """P in air over P in vacuum at the same tip temperature (the paper: 1.29)."""
    tips = np.array([330.0, 400.0, 500.0, 600.0, 700.0, 800.0, 900.0, 1006.0])
    in_vacuum, in_air = vacuum.branch(), air.branch()
    sweep = air.sweep(in_air.bias(tips, air.circuit))
    k = in_air.power(tips) / in_vacuum.power(tips)
    share = (sweep.air_heat_mW / sweep.power_mW).values
    print("\nPower in air over power in vacuum at the same tip temperature\n")
    table(
        ("T_tip (K)", "k", "air's share of the power"),
        [(f"{t:.0f}", f"{a:.3f}", f"{b:.3f}") for t, a, b in zip(tips, k, share, strict=True)],
    )
    factor = find_scale_factor(in_vacuum, in_air)
    published = error_of_one_factor(in_vacuum, in_air, K_IN_AIR)
    print(
        f"\nbest single k: {factor.best_k.item():.3f}, which leaves "
        f"{factor.best_error_K.item():.0f} K; {K_IN_AIR} leaves {published:.0f} K (to {HOT:g} K)"
    )


def panels() -> None:
    """Print what the operator and a sweep cost, and what panels and surroundings do."""
    building()
    with tempfile.TemporaryDirectory() as folder:
        os.environ.setdefault(CACHE_VARIABLE, folder)
        vacuum = Lever(Probe.reference())
        air = vacuum.in_medium("air")
        accuracy(air, speed(vacuum, air))
        refinement(vacuum, air)
        surroundings(vacuum)
        scale_factor(vacuum, air)


# --- full 3-D ------------------------------------------------------------------------------------

#: Biases of the published operating points on the reference probe (V).
POINTS = (7.22, 8.268, 10.748)

AIR = Probe.reference().in_medium("air")
BASE = AIR.circuit.base_temperature_K

#: What is varied, and how.
STUDY: dict[str, dict] = {
    "default": {},
    "quadratic elements in the air": {"air_order": 2},
    "quadratic, sizes × 1.5": {"air_order": 2, "mesh": SolidMeshOptions(refinement=2 / 3)},
    "quadratic, sizes / 1.5": {"air_order": 2, "mesh": SolidMeshOptions(refinement=1.5)},
    "edges of the plate × 2": {"mesh": SolidMeshOptions(rim=4.0)},
    "edges of the plate / 1.5": {"mesh": SolidMeshOptions(rim=4 / 3)},
    "sphere of 45 µm": {"sphere_radius_um": 45.0},
    "sphere of 90 µm": {"sphere_radius_um": 90.0},
}


def factor_by_power(sweep: xr.Dataset, vacuum: xr.Dataset) -> np.ndarray:
    """Power in air over power in vacuum at the same tip temperature."""
    in_vacuum = PchipInterpolator(vacuum.tip_K, vacuum.power_mW)(sweep.tip_K)
    return sweep.power_mW.values / in_vacuum


def points() -> None:
    """Print temperature, power and heat into the air at the operating points."""
    probe = AIR
    vacuum = Lever(Probe.reference()).sweep(np.linspace(1.0, 11.5, 200))
    sweep = SolidLever(probe).sweep(POINTS)
    columns = ("tip_K", "current_mA", "lever_V", "power_mW", "air_heat_mW")
    rows = [
        (
            f"{sweep.bias_V.values[k]:g}",
            *(f"{sweep[name].values[k]:.4f}" for name in columns),
            f"{sweep.air_heat_mW.values[k] / sweep.power_mW.values[k]:.4f}",
            f"{factor:.4f}",
        )
        for k, factor in enumerate(factor_by_power(sweep, vacuum))
    ]
    table(("bias_V", *columns, "air share", "k"), rows)


def operator(names: Sequence[str] = tuple(STUDY)) -> None:
    """Print the energy ∫θq of θ rising linearly from the leg ends, by volumes and by panels.

    Volumes come to the limit from above and panels from below. Heat of a lever at one temperature
    would not compare them: θ would jump at the leg ends, which have no panels.
    """
    length = np.ptp([x for region in AIR.layout().regions for x, _ in region.outline])
    rows = []
    for name in names:
        air = SolidLever(AIR, **STUDY[name]).space.air.operator
        theta = air.sites[:, 0] / length
        coefficients, heat = air.solve(theta)
        far = f"{air.at_infinity(coefficients) / heat.sum() - 1:+.1e}"
        rows.append((f"volumes: {name}", air.size, f"{theta @ heat:.3f}", far))
        print(rows[-1], file=sys.stderr, flush=True)
    for refinement in (0.5, 1.0, 1.5, 2.0):
        air = PanelledAir(AIR.layout(), AIR.surroundings, BASE, refinement).operator()
        theta = air.sites[:, 0] / length
        name = f"panels: sizes / {refinement:g}"
        rows.append((name, len(air.sites), f"{theta @ air.matrix @ theta:.3f}", ""))
    table(("variant", "unknowns", "energy over θ² (µm)", "heat at infinity (relative)"), rows)


def study(names: Sequence[str] = tuple(STUDY)) -> None:
    """Print what mesh, sphere and order do to the observables."""
    probe = AIR
    rows = []
    for name in names:
        began = time.perf_counter()
        lever = SolidLever(probe, **STUDY[name])
        sweep = lever.sweep(POINTS[:1])
        seconds = time.perf_counter() - began
        balance = (sweep.end_heat_mW + sweep.air_heat_mW) / sweep.power_mW - 1
        rows.append(
            (
                name,
                lever.space.mesh.elements.nelements,
                lever.space.air.operator.size,
                f"{sweep.tip_K.item():.3f}",
                f"{sweep.current_mA.item():.6f}",
                f"{sweep.air_heat_mW.item():.6f}",
                f"{np.abs(balance).max().item():.0e}",
                f"{seconds:.0f}",
            )
        )
    print(f"bias {POINTS[0]:g} V\n")
    table(
        (
            "variant",
            "tetrahedra",
            "air unknowns",
            "T_tip (K)",
            "I_h (mA)",
            "air heat (mW)",
            "balance",
            "s",
        ),
        rows,
    )


def vacuum() -> None:
    """Print the 3-D lever without air against the 2-D lever."""
    probe = Probe.reference()
    flat = Lever(probe).sweep(BIAS)
    rows = []
    for refinement in (0.5, 1.0, 1.5):
        lever = SolidLever(probe, SolidMeshOptions(refinement=refinement))
        sweep = lever.sweep(BIAS)
        rows.append(
            (
                f"{refinement:g}",
                lever.space.mesh.elements.nelements,
                f"{np.abs(sweep.tip_K - flat.tip_K).max().item():.3f}",
                f"{np.abs(sweep.current_mA / flat.current_mA - 1).max().item():.1e}",
                f"{np.abs(sweep.reader_V / flat.reader_V - 1).max().item():.1e}",
            )
        )
    table(("refinement", "tetrahedra", "T_tip (K)", "I_h (relative)", "V_r (relative)"), rows)


def sweep() -> None:
    """Print the fast model against the full 3-D sweep of 25 biases, and its time."""
    lever = SolidLever(AIR)
    wall, processor = time.perf_counter(), time.process_time()
    full = lever.sweep(BIAS)
    wall, processor = time.perf_counter() - wall, time.process_time() - processor
    fast = Lever(AIR).sweep(BIAS)
    rows = [
        (
            f"{bias:.3f}",
            f"{full.tip_K.values[k]:.2f}",
            f"{fast.tip_K.values[k] - full.tip_K.values[k]:+.2f}",
            f"{100 * (fast.tip_K.values[k] - full.tip_K.values[k]) / rise:+.2f}",
            f"{fast.current_mA.values[k] / full.current_mA.values[k] - 1:+.1e}",
            f"{fast.air_heat_mW.values[k] / full.air_heat_mW.values[k] - 1:+.1e}",
        )
        for k, (bias, rise) in enumerate(zip(BIAS, full.tip_K.values - BASE, strict=True))
    ]
    print("fast less full 3-D\n")
    table(("bias (V)", "T_tip (K)", "T_tip (K)", "% of the rise", "I_h", "air heat"), rows)
    print(
        f"\nfull 3-D: {wall:.0f} s, of which {processor:.0f} s on the processor; states found in "
        "the cache are not solved again"
    )


TABLES = {one.__name__: one for one in (panels, points, operator, study, vacuum, sweep)}

if __name__ == "__main__":
    if sys.argv[1:2] == ["--build"]:
        build(sys.argv[2])
        sys.exit()
    for name in sys.argv[1:] or ["panels"]:
        print(f"\n## {name}\n")
        TABLES[name]()
