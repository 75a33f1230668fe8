"""The reduced lever: how accurate over its box, how fast, and what a fit costs with it.

python benchmarks/reduced.py [COUNT]     (the FEniCS rows need benchmarks/fenics/install.sh)
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from statistics import median

import numpy as np

from hotlever.cache import CACHE_VARIABLE
from hotlever.fitting import fit, read_measurement
from hotlever.fitting.models import FastModel, full_model
from hotlever.lever import Lever
from hotlever.lever.reduced import BOX, material_in_box
from hotlever.lever.reduced_cache import cached_reduction
from hotlever.probe import Probe
from problems import BIAS, peer_problem, solve_with_peer, table

RUNS = 5


def seconds(action, runs=RUNS):
    times = []
    for _ in range(runs):
        began = time.perf_counter()
        action()
        times.append(time.perf_counter() - began)
    return median(times)


def accuracy(lever, space, count):
    rng = np.random.default_rng(11)
    rows = []
    for _ in range(count):
        material = material_in_box(lever.probe.material, rng.random(len(BOX)))
        material = material.with_(c_kappa=rng.uniform(0.6, 0.76))
        full = lever.with_material(material).sweep(BIAS)
        current, reader, tip = FastModel(lever, space).predict(material, BIAS)[0]
        rows.append(
            (
                np.abs(current / full.current_mA.values - 1).max(),
                np.abs(reader / full.reader_V.values - 1).max(),
                np.abs(tip - full.tip_K.values).max(),
            )
        )
    print(f"Reduced against full lever, {count} random parameter sets of the box, 25 biases\n")
    table(
        ("", "I_h (relative)", "V_r (relative)", "T_tip (K)"),
        [
            (name, *(f"{value:.1e}" for value in statistic(np.array(rows), axis=0)))
            for name, statistic in (("median", np.median), ("largest", np.max))
        ],
    )


def main():
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 50
    data = read_measurement("examples/lever-a.csv")
    probe = Probe.reference()
    with tempfile.TemporaryDirectory() as folder:
        os.environ[CACHE_VARIABLE] = folder
        cold = seconds(lambda: fit(data), runs=1)
        warm = seconds(lambda: fit(data))
        lever = Lever(probe)
        space = cached_reduction(lever)
        accuracy(lever, space, count)
        model = FastModel(lever, space)
        reduced = seconds(lambda: model.predict(probe.material, BIAS))
    full = seconds(lambda: lever.sweep(BIAS, sensitivities=True))
    full_fit = seconds(lambda: fit(data, model=full_model), runs=1)
    problem = peer_problem(probe, lever.space.mesh, degree=3, quadrature=5, bias=BIAS)
    peer = median(solve_with_peer(problem, plain=True)["seconds"] for _ in range(RUNS))
    print("\nTime (s)\n")
    table(
        ("", "seconds"),
        [
            ("25-point sweep with sensitivities, reduced, warm", f"{reduced:.3f}"),
            ("the same, full lever", f"{full:.2f}"),
            ("the same, plain FEniCS, seven sweeps for the derivatives", f"{7 * peer:.1f}"),
            ("option-III fit of lever-a.csv, reduced lever at hand", f"{warm:.2f}"),
            ("the same, geometry never seen", f"{cold:.1f}"),
            ("the same, full lever throughout", f"{full_fit:.1f}"),
        ],
    )
    print(f"\nreduced sweep against FEniCS: {7 * peer / reduced:.0f} times faster")


if __name__ == "__main__":
    main()
