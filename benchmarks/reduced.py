"""The reduced lever: how accurate, how well it knows that, how fast, and what a fit costs with it.

python benchmarks/reduced.py [CASES]     (the FEniCS rows need benchmarks/fenics/install.sh)
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

import numpy as np

from hotlever.cache import CACHE_VARIABLE
from hotlever.fitting import fit, read_measurement
from hotlever.fitting.models import full_model
from hotlever.lever import Lever
from hotlever.lever.certificate import estimated_error
from hotlever.lever.continuation import AT_BIAS
from hotlever.lever.newton import NewtonOptions, newton
from hotlever.lever.reduced_cache import cached_reduction
from hotlever.lever.reduced_lever import ReducedLever
from hotlever.lever.reduction import BOX, material_in_box
from hotlever.probe import Probe
from problems import BIAS, peer_problem, solve_with_peer, table

RUNS = 7
EXACT = NewtonOptions(tolerance=1e-9)
#: Biases compared with the full lever in each case.
BIASES = 5


def seconds(action, runs=RUNS):
    times = []
    for _ in range(runs):
        began = time.perf_counter()
        action()
        times.append(time.perf_counter() - began)
    return median(times)


def random_material(lever, rng):
    material = material_in_box(lever.probe.material, rng.random(len(BOX)))
    return material.with_(c_kappa=rng.uniform(0.6, 0.76))


def accuracy(lever, reduced, cases):
    """Compare with the full lever at random materials and biases, and with the estimate."""
    rng = np.random.default_rng(11)
    errors, bounded = [], 0
    for _ in range(cases):
        material = random_material(lever, rng)
        states = reduced.solve(material, np.sort(rng.uniform(1.0, 11.0, BIASES)))
        estimate = estimated_error(lever, reduced.space, states)
        equations = lever.with_material(material).equations
        exact = [
            newton(equations.pinned(AT_BIAS, x[-1]), reduced.space.expanded(x), EXACT).x
            for x in states.x.T
        ]
        full = np.stack([equations.measured(x) for x in exact], axis=1)
        error = np.abs(states.observables - full)
        bounded += bool(np.all(error <= estimate))
        size = np.abs(full)
        size[2] = 1.0
        errors.append((error / size).max(axis=1))
    print(
        f"Reduced against full lever, {cases} random parameter sets of the box, "
        f"{BIASES} random biases each\n"
    )
    table(
        ("", "I_h (relative)", "V_r (relative)", "T_tip (K)"),
        [
            (name, *(f"{value:.1e}" for value in statistic(np.array(errors), axis=0)))
            for name, statistic in (("median", np.median), ("largest", np.max))
        ],
    )
    print(
        f"\nThe estimate bounds the error of all three in {100 * bounded / cases:.1f} % of cases."
    )


def cold_command():
    """Return the seconds of the whole command with an empty cache."""
    with tempfile.TemporaryDirectory() as folder:
        command = [Path(sys.executable).parent / "hotlever", "fit", "examples/lever-a.csv"]
        environment = {**os.environ, CACHE_VARIABLE: folder}
        began = time.perf_counter()
        subprocess.run(command, env=environment, check=True, capture_output=True)
        return time.perf_counter() - began


def main():
    cases = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    data = read_measurement("examples/lever-a.csv")
    probe = Probe.reference()
    lever = Lever(probe)
    with tempfile.TemporaryDirectory() as folder:
        os.environ[CACHE_VARIABLE] = folder
        began = time.perf_counter()
        space = cached_reduction(lever)
        reduction = time.perf_counter() - began
        warm = seconds(lambda: fit(data))
    reduced = ReducedLever(space, probe.circuit)
    accuracy(lever, reduced, cases)
    rng = np.random.default_rng(5)
    anywhere = seconds(
        lambda: reduced.linearise(reduced.solve(random_material(lever, rng), BIAS)), runs=25
    )
    near = reduced.linearise(reduced.solve(probe.material, BIAS))
    step = probe.material.with_(n_d=1.05 * probe.material.n_d, delta=1.02 * probe.material.delta)
    nearby = seconds(lambda: reduced.linearise(reduced.solve(step, BIAS, near)), runs=25)
    full = seconds(lambda: lever.sweep(BIAS, sensitivities=True))
    full_fit = seconds(lambda: fit(data, model=full_model), runs=1)
    problem = peer_problem(probe, lever.space.mesh, degree=3, quadrature=5, bias=BIAS)
    peer = median(solve_with_peer(problem, plain=True)["seconds"] for _ in range(RUNS))
    print("\nTime (s)\n")
    table(
        ("", "seconds"),
        [
            ("25-point sweep with sensitivities, reduced, anywhere in the box", f"{anywhere:.3f}"),
            ("the same next to a known one, as in a fit", f"{nearby:.3f}"),
            ("the same, full lever", f"{full:.2f}"),
            ("the same, plain FEniCS, seven sweeps for the derivatives", f"{7 * peer:.1f}"),
            ("one plain FEniCS sweep without derivatives", f"{peer:.2f}"),
            ("reducing a geometry", f"{reduction:.1f}"),
            ("option-III fit of lever-a.csv, reduced lever at hand", f"{warm:.2f}"),
            ("the same, cold: whole command, empty cache", f"{cold_command():.1f}"),
            ("the same, full lever throughout", f"{full_fit:.1f}"),
            ("FEniCS over reduced, with sensitivities", f"{7 * peer / anywhere:.0f} times"),
        ],
    )


if __name__ == "__main__":
    main()
