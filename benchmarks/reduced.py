"""The reduced lever: how accurate, how well it knows that, how fast, and what a fit costs with it.

python benchmarks/reduced.py [CASES]     (the FEniCS rows need benchmarks/fenics/install.sh)
python benchmarks/reduced.py buys        what it buys over a lever on a coarse mesh
"""

from __future__ import annotations

import os
import sys
import tempfile
from functools import partial
from statistics import median

import numpy as np

from hotlever.cache import CACHE_VARIABLE
from hotlever.estimate import fit, read_measurement
from hotlever.estimate.experiment import ExperimentAtRest, experiment_of
from hotlever.estimate.objective import Subproblem
from hotlever.estimate.sampling import SampledLever, Trials, draw_samples
from hotlever.estimate.surrogate import Rows
from hotlever.lever import Lever
from hotlever.lever.branch import Reach
from hotlever.lever.lever import COARSE
from hotlever.lever.reduced_lever import cached_reduction, estimated_error
from hotlever.lever.response_surface import PAPER, ParameterDomain
from hotlever.lever.similar import SimilarLevers
from hotlever.probe import Probe
from hotlever.probe.probe_parameters import usual_parameters
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
#: Trials of the posterior of a fit to the current alone.
SAMPLES = 100
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


def buys():
    """Compare with a coarse lever: a slider's step, a fit, and the posterior of the current."""
    data, probe, highest = read_measurement(EXAMPLE), Probe.reference(), 9.0
    full, coarse = Lever(probe), Lever(probe, COARSE)
    reduced, bias = cached_reduction(full), np.linspace(1.0, highest, 9)
    # the fit comes last that finds the geometry reduced
    with tempfile.TemporaryDirectory() as folder:
        os.environ[CACHE_VARIABLE] = folder
        fit_on_coarse = processor_seconds(lambda: fit(data), RUNS)
        reduction = processor_seconds(lambda: cached_reduction(full))
        fit_on_reduced = processor_seconds(lambda: fit(data), RUNS)
    levers = [full.with_probe(probe.replace({"n_d": n_d})) for n_d in (4.0e17, 6.0e17)]
    moved = {
        "coarse": lambda at: Lever(at, space=coarse.space).branch_to(highest),
        "reduced": lambda at: reduced.branch(at, Reach(at.circuit, highest)),
    }
    alone = fit(data, observables=("current",))
    objective = alone.objective(alone.names)
    experiments = {
        name: ExperimentAtRest(fast, SimilarLevers(full), objective.residuals.bias, objective.names)
        for name, fast in (("coarse", SimilarLevers(coarse)), ("reduced", reduced))
    }
    rows = []
    for name, branch_of in moved.items():
        step = median(processor_seconds(partial(branch_of, one.probe), RUNS) for one in levers)
        off = 0.0
        for one in levers:
            branch = branch_of(one.probe)
            tips = branch.tip_K(branch.read(one.circuit, bias).u)
            off = max(off, float(np.abs(tips - one.sweep(bias).tip_K.values).max()))
        lever = SampledLever(experiments[name], alone.probe)
        points, effective = draw_samples(Trials(Subproblem(objective, lever.at)), SAMPLES)
        error = max(
            lever.error_K(objective.at(alone.probe, points[row]))
            for row in range(0, SAMPLES, SAMPLES // 4)
        )
        fitted = {"coarse": fit_on_coarse, "reduced": fit_on_reduced}[name]
        spent = {"coarse": 0.0, "reduced": reduction}[name]
        rows.append(
            (
                name,
                f"{1e3 * step:.0f}",
                f"{off:.2f}",
                f"{fitted:.2f}",
                f"{60 * fitted + spent:.0f}",
                f"{effective:.0f}",
                f"{error:.1f}",
            )
        )
    table(
        (
            "lever",
            "slider's step (ms)",
            "off (K)",
            "fit (s)",
            "sixty fits (s)",
            f"of {SAMPLES} samples, current alone",
            "off at four (K)",
        ),
        rows,
    )


def main():
    if sys.argv[1:] == ["buys"]:
        buys()
        return
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
            model=lambda probe, bias: ExperimentAtRest(
                SimilarLevers(Lever(probe)), None, bias, usual_parameters(probe)
            ),
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
