"""The reduced lever: how accurate, how well it knows that, how fast, and what a fit costs with it.

python benchmarks/reduced.py [CASES]     (the FEniCS rows need benchmarks/fenics/install.sh)
"""

from __future__ import annotations

import os
import sys
import tempfile
from statistics import median

import numpy as np

from hotlever.cache import CACHE_VARIABLE
from hotlever.estimate import fit, read_measurement
from hotlever.estimate.experiment import ExperimentAtRest, experiment_of
from hotlever.estimate.surrogate import Rows
from hotlever.lever import Lever
from hotlever.lever.branch import Reach
from hotlever.lever.reduced.lever import estimated_error
from hotlever.lever.reduced.response_surface import PAPER, ParameterDomain
from hotlever.lever.reduced.training import cached_reduction
from hotlever.lever.similar import SimilarLevers
from hotlever.probe import Probe
from problems import (
    BIAS,
    EXAMPLE,
    fit_command,
    peer_problem,
    processor_seconds,
    solve_with_peer,
    table,
)

RUNS = 7
#: Biases compared with the full lever in each case.
BIASES = 5


def random_material(lever, rng):
    material = ParameterDomain.of(lever.probe).probe(lever.probe, rng.random(len(PAPER))).material
    return material.with_(c_kappa=rng.uniform(0.6, 0.76))


def accuracy(lever, reduced, cases):
    """Compare with the full lever at random materials and biases, and with the estimate."""
    rng, circuit = np.random.default_rng(11), lever.circuit
    errors, bounded = [], 0
    for _ in range(cases):
        material = random_material(lever, rng)
        bias = np.sort(rng.uniform(1.0, 11.0, BIASES))
        same = lever.with_material(material)
        branch = reduced.linearised(same.probe, Reach(circuit, bias[-1])).branch
        rows = Rows(bias)
        u, _ = rows.states(branch, circuit)
        shown = rows.values(branch, circuit)[:3]
        guesses = reduced.space.expanded(branch.states(u))
        exact = same.dataset(
            [same.polished(x[:, None], v) for x, v in zip(guesses.T, bias, strict=True)]
        )
        full = np.stack([exact.current_mA, exact.reader_V, exact.tip_K])
        error = np.abs(shown - full)
        bounded += bool(np.all(error <= estimated_error(lever, branch, u)))
        size = np.abs(full)
        size[2] = 1.0
        errors.append((error / size).max(axis=1))
    print(
        f"Reduced against full lever, {cases} random parameter sets of the domain, "
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


def main():
    cases = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    data = read_measurement(EXAMPLE)
    probe = Probe.reference()
    lever = Lever(probe)
    with tempfile.TemporaryDirectory() as folder:
        os.environ[CACHE_VARIABLE] = folder
        cold_fit = processor_seconds(lambda: fit(data), RUNS)
        cold_command = processor_seconds(lambda: fit_command(folder), 3)
        reduction = processor_seconds(lambda: cached_reduction(lever))
        reduced = cached_reduction(lever)
        warm_fit = processor_seconds(lambda: fit(data), RUNS)
        warm_command = processor_seconds(lambda: fit_command(folder), 3)
    accuracy(lever, reduced, cases)
    rng, model = np.random.default_rng(5), experiment_of(probe, BIAS, reduce=True)
    anywhere = processor_seconds(
        lambda: model.predict(lever.with_material(random_material(lever, rng)).probe), 25
    )
    near = model.predict(probe)
    step = probe.with_(n_d=1.05 * probe.material.n_d, delta=1.02 * probe.material.delta)
    nearby = processor_seconds(lambda: model.predict(step, near), 25)
    full = processor_seconds(
        # made anew each time: a lever keeps its branch
        lambda: lever.with_material(probe.material).sweep(BIAS, sensitivities=True),
        RUNS,
    )
    full_fit = processor_seconds(
        lambda: fit(
            data,
            model=lambda probe, bias: ExperimentAtRest(SimilarLevers(Lever(probe)), None, bias),
        )
    )
    problem = peer_problem(probe, lever.space.mesh, degree=3, quadrature=5, bias=BIAS)
    peer = median(solve_with_peer(problem, plain=True)["processor_seconds"] for _ in range(RUNS))
    print("\nTime (s of processor)\n")
    table(
        ("", "seconds"),
        [
            (
                "25-point sweep with sensitivities, reduced, anywhere",
                f"{anywhere:.3f}",
            ),
            ("the same next to a known one, as in a fit", f"{nearby:.3f}"),
            ("the same, full lever", f"{full:.2f}"),
            ("the same, plain FEniCS, seven sweeps for the derivatives", f"{7 * peer:.1f}"),
            ("one plain FEniCS sweep without derivatives", f"{peer:.2f}"),
            ("reducing a geometry", f"{reduction:.1f}"),
            ("option-III fit of lever-a.csv, reduced lever at hand", f"{warm_fit:.2f}"),
            ("the same, geometry never reduced", f"{cold_fit:.2f}"),
            ("the same, full lever throughout", f"{full_fit:.1f}"),
            ("whole command, reduced lever in the cache", f"{warm_command:.1f}"),
            ("the same, empty cache", f"{cold_command:.1f}"),
            ("FEniCS over reduced, with sensitivities", f"{7 * peer / anywhere:.0f} times"),
        ],
    )


if __name__ == "__main__":
    main()
