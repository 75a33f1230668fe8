"""The option-III fit of the shipped lever-a.csv: the paper's stack beside ours, in the same run.

    python benchmarks/fenics_fit.py [RUNS] [plain] [tuned]

5 runs of ours, and both ways of using FEniCS, if nothing is said; needs
benchmarks/fenics/install.sh, and some minutes.

The paper's stack is legacy FEniCS, lmfit's Levenberg-Marquardt and finite differences. It gets the
same data, weights, bounds, tolerances, mesh and cubic element as ours, and starts from the
reference probe's material, which is close to the optimum; ours finds its own start. What it would
have to pay as well is given to it for nothing: starting Python, meshing, compiling forms. *Plain*
is FEniCS as its own Newton solver works; *tuned* keeps factors, predicts, and uses the fastest LU
of Debian's packages.

*Warm* is `hotlever.fit` with the geometry reduced before (median of the runs), *cold* the whole
command `hotlever fit` with an empty cache (median of up to 3 runs). All use one thread, but for
BLAS in places; where other work shares the machine, compare the processor time instead.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from statistics import median

import lmfit
import numpy as np

from hotlever.cache import CACHE_VARIABLE
from hotlever.estimation import fit, read_measurement
from hotlever.lever import Lever
from hotlever.lever.reduced.training import cached_reduction
from hotlever.materials import PARAMETERS
from hotlever.measurement import with_measured_circuit
from hotlever.probe import Probe
from hotlever.quantities import OBSERVABLES
from problems import EXAMPLE, fit_command, peer_problem, peer_server, processor_time, table

#: Relative step of the finite differences is its root: far above the solver's tolerance.
EPSFCN = 1e-8
WAYS = ["plain", "tuned"]
#: Residual of parameters for which no solution is found.
FAR = 10.0


def paper_fit(measurement, probe, plain):
    """Fit as the paper did; return lmfit's result, the sweeps it took, and its times."""
    lever = Lever(probe)
    order = np.argsort(measurement.bias_V)
    problem = peer_problem(
        probe, lever.space.mesh, degree=3, quadrature=5, bias=measurement.bias_V[order].tolist()
    )
    data = np.stack([measurement.observable(name)[order] for name in OBSERVABLES])
    largest = np.nanmax(np.abs(data), axis=1, keepdims=True)
    present = np.isfinite(data)
    parameters = lmfit.Parameters()
    for name, parameter in PARAMETERS.items():
        parameters.add(
            name,
            value=getattr(probe.material, name) / parameter.scale,
            min=parameter.lower / parameter.scale,
            max=parameter.upper / parameter.scale,
        )
    sweeps, processor = 0, 0.0

    with peer_server(problem, plain=plain) as ask:

        def residual(trial):
            nonlocal sweeps, processor
            sweeps += 1
            print(f"\rFEniCS: sweep {sweeps}", end="", file=sys.stderr, flush=True)
            values = {
                name: trial[name].value * parameter.scale for name, parameter in PARAMETERS.items()
            }
            answer = ask(values)
            processor += answer["processor_seconds"]
            if "error" in answer:
                return np.full(present.sum(), FAR)
            model = np.stack([answer[column.name] for column in OBSERVABLES.values()])
            return ((model - data) / largest)[present]

        began = time.perf_counter()
        minimizer = lmfit.Minimizer(residual, parameters)
        result = minimizer.leastsq(xtol=1e-5, ftol=1e-6, epsfcn=EPSFCN)
        seconds = time.perf_counter() - began
        print(file=sys.stderr)
        return result, sweeps, (seconds, processor)


def cold_command():
    with tempfile.TemporaryDirectory() as cache:
        fit_command(cache)


def timed(action):
    """Return wall and processor time (s)."""
    began, used = time.perf_counter(), processor_time()
    action()
    return time.perf_counter() - began, processor_time() - used


def medians(times):
    return [median(column) for column in zip(*times, strict=True)]


def main():
    numbers = [int(argument) for argument in sys.argv[1:] if argument.isdecimal()]
    runs = numbers[0] if numbers else 5
    ways = [argument for argument in sys.argv[1:] if argument in WAYS] or WAYS
    measurement = read_measurement(EXAMPLE)
    probe, _ = with_measured_circuit(Probe.reference(), measurement)
    with tempfile.TemporaryDirectory() as folder:
        os.environ[CACHE_VARIABLE] = folder
        cached_reduction(Lever(probe))
        warm_times = [timed(lambda: fit(measurement)) for _ in range(runs)]
        peers = {}
        for way in ways:
            peers[way] = paper_fit(measurement, probe, plain=way == "plain")
            # beside each peer, so that a slow spell of the machine meets both
            warm_times += [timed(lambda: fit(measurement)) for _ in range(runs)]
        ours = fit(measurement)
    cold = medians(timed(cold_command) for _ in range(min(runs, 3)))
    warm = medians(warm_times)

    print("Option-III fit of lever-a.csv: the same optimum\n")
    rows = []
    worst = dict.fromkeys(peers, 0.0)
    for name, parameter in PARAMETERS.items():
        mine = ours.parameters[name]
        row = [name, f"{mine.value / parameter.scale:.5f}", f"{mine.stderr / parameter.scale:.5f}"]
        for way, (result, _, _) in peers.items():
            theirs = result.params[name].value
            apart = abs(theirs - mine.value / parameter.scale) / (mine.stderr / parameter.scale)
            worst[way] = max(worst[way], apart)
            row += [f"{theirs:.5f}", f"{apart:.3f}"]
        rows.append(row)
    columns = ["parameter (in its scale)", "hotlever", "standard error"]
    for way in peers:
        columns += [f"FEniCS {way}", "apart (standard errors)"]
    table(columns, rows)
    apart = max(worst.values())
    print(f"\nlargest distance: {apart:.3f} standard errors (target: at most 0.05)")
    print(f"\nTime; load of the machine at the end {os.getloadavg()[0]:.1f}\n")
    rows = []
    for column, kind in enumerate(("seconds", "processor seconds")):
        for way, (_, sweeps, times) in peers.items():
            ratios = times[column] / warm[column], times[column] / cold[column]
            rows.append(
                (f"FEniCS {way}, lmfit", sweeps, kind, f"{times[column]:.1f}",
                 *(f"{ratio:.0f}" for ratio in ratios))
            )  # fmt: skip
        for name, sweeps, times in (
            ("hotlever, geometry reduced before", ours.evaluations, warm),
            ("hotlever, whole command, empty cache", "", cold),
        ):
            rows.append((name, sweeps, kind, f"{times[column]:.2f}", "", ""))
    table(("", "sweeps", "unit", "time", "times ours warm", "times ours cold"), rows)
    print("\ntargets: 300 times ours warm, 30 times ours cold")


if __name__ == "__main__":
    main()
