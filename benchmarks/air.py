"""Air by boundary elements: what the operator costs, what a sweep costs, what the panels do.

python benchmarks/air.py
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from functools import partial
from statistics import median
from unittest.mock import patch

import numpy as np

from hotlever.air import surface
from hotlever.air.operator import PanelledAir
from hotlever.cache import CACHE_VARIABLE
from hotlever.estimation.experiment import experiment_of
from hotlever.lever import Lever
from hotlever.lever.reduced.response_surface import PAPER, ParameterDomain
from hotlever.probe import Probe
from hotlever.probe.surroundings import Surroundings
from hotlever.spieser2017 import BASE_TEMPERATURE_K, K_IN_AIR
from hotlever.studies.air_scaling import HOT, error_of_one_factor, find_scale_factor
from problems import BIAS, processor_seconds, table

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


def main():
    if "--build" in sys.argv:
        build(sys.argv[-1])
        return
    building()
    with tempfile.TemporaryDirectory() as folder:
        os.environ.setdefault(CACHE_VARIABLE, folder)
        vacuum = Lever(Probe.reference())
        air = vacuum.in_medium("air")
        accuracy(air, speed(vacuum, air))
        refinement(vacuum, air)
        surroundings(vacuum)
        scale_factor(vacuum, air)


if __name__ == "__main__":
    main()
