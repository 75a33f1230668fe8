"""What estimates cost: solves by phase; samples of a posterior; many levers on two processes.

    python benchmarks/solves.py [ARGUMENTS OF hotlever fit OR calibrate ...]
    python benchmarks/solves.py posterior [SAMPLES]           what samples cost and are worth
    python benchmarks/solves.py many [LEVERS] [RUNS]          24 levers, 3 runs by default
    python benchmarks/solves.py many LEVERS killed

Curves are levers that are linearised, with the derivatives that are asked for. Factorisations
and solves are those of sparse matrices, one for each state and right-hand side. The search is that
of the optimiser, a confirmation a curve on the full mesh between two searches; profile and budget
belong to a calibration.

Many levers are fitted on one and on two processes: levers per second, and the efficiency
t(1) / (2 t(2)); the seconds run from the call to the last fit file, with the start and end of the
processes, without reducing the geometry, which is in the cache by then. The two numbers of
processes are measured in turn; medians. With `killed` all levers are fitted on two processes, one
of which is killed after a third of them, and one process fits a hundred of them.

Other work on the machine takes its share of two busy processors, but hardly of one, so the load
is printed. The processor time of all processes, parent and scheduler included, does not mind: with
N processes it shows what spreading the work costs.
"""

from __future__ import annotations

import os
import shlex
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, redirect_stdout
from functools import wraps
from io import StringIO
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
import psutil

import hotlever.estimate.tip_temperature as tips
from hotlever.cache import CACHE_VARIABLE
from hotlever.cli import main as command
from hotlever.estimate import fit, read_measurement
from hotlever.estimate.experiment import Predictor, experiment_of
from hotlever.estimate.many import fit_many
from hotlever.estimate.sampling import predictive_band, sample_posterior
from hotlever.estimate.search import Optimiser
from hotlever.lever.full_space import FullSpace, SparseFactors
from hotlever.lever.similar import SimilarLevers
from hotlever.materials import PUBLISHED
from hotlever.probe import Probe
from problems import BIAS, EXAMPLE, processor_time, table

COMMANDS = (f"fit {EXAMPLE} -o out.json", f"calibrate {EXAMPLE} -o out.json")
KINDS = ("curves", "states", "factorisations", "solves")


class Count:
    """Counts what is solved while commands run, by phase and by the unknowns of the mesh."""

    def __init__(self) -> None:
        self.phases = ["rest"]
        self.counts: Counter[tuple[str, int, str]] = Counter()

    def add(self, size: int, kind: str, number: int = 1) -> None:
        """Count some in the phase that is under way."""
        self.counts[self.phases[-1], size, kind] += number

    def phase(self, owner: Any, method: str, name: str) -> None:
        """Call what a function does by the name of a phase."""

        def during(function: Callable[..., Any], *args: Any, **named: Any) -> Any:
            self.phases.append(name)
            try:
                return function(*args, **named)
            finally:
                self.phases.pop()

        _wrap(owner, method, during)

    def start(self) -> None:
        """Count from now on."""
        self.phase(Optimiser, "solve", "search")
        self.phase(Predictor, "confirm", "confirm")
        self.phase(tips, "profile_of_tip", "profile")

        def linearised(function: Callable[..., Any], levers: Any, *args: Any, **named: Any) -> Any:
            found = function(levers, *args, **named)
            size = found.branch.equations.space.size
            self.add(size, "curves")
            self.add(size, "states", found.branch.u.size)
            return found

        def factorised(function: Callable[..., Any], space: Any, tangent: Any, *args: Any) -> Any:
            self.add(space.size, "factorisations", tangent.sigma.shape[-1])
            return function(space, tangent, *args)

        def solved(
            function: Callable[..., Any], factors: Any, right: Any, *args: Any, **named: Any
        ) -> Any:
            self.add(len(right) - 1, "solves", right[0].size)
            return function(factors, right, *args, **named)

        _wrap(SimilarLevers, "linearised", linearised)
        _wrap(FullSpace, "factorised", factorised)
        _wrap(SparseFactors, "solve", solved)


def _wrap(owner: Any, name: str, around: Callable[..., Any]) -> None:
    function = getattr(owner, name)

    @wraps(function)
    def wrapped(*args: Any, **named: Any) -> Any:
        return around(function, *args, **named)

    setattr(owner, name, wrapped)


@contextmanager
def empty_folder() -> Iterator[None]:
    """Work in a folder of its own, with nothing in hotlever's cache."""
    with tempfile.TemporaryDirectory() as folder:
        os.environ[CACHE_VARIABLE] = os.path.join(folder, "cache")
        os.chdir(folder)
        yield
        os.chdir("/")


def solves_of(asked: Sequence[str]) -> None:
    """Print what commands solve, by phase."""
    count = Count()
    count.start()
    for words in map(shlex.split, asked):
        count.counts.clear()
        with empty_folder(), redirect_stdout(StringIO()):
            try:
                command(words)
            except SystemExit as end:
                if end.code:
                    raise
        print(f"\nhotlever {words[0]}\n")
        rows = sorted({(phase, size) for phase, size, _ in count.counts})
        table(
            ("phase", "unknowns", *KINDS),
            [
                (phase, size, *(count.counts[phase, size, kind] for kind in KINDS))
                for phase, size in rows
            ],
        )


# --- samples of a posterior -----------------------------------------------------------------------


def sampled(samples: int, observables: tuple[str, ...] | None = None) -> None:
    """Sample the posterior of one fit, and print it beside the standard errors."""
    result = fit(read_measurement(EXAMPLE), observables=observables)
    began = processor_time()
    posterior = sample_posterior(result, samples=samples, processes=2)
    drawn = processor_time()
    predictive_band(result, posterior)
    banded = processor_time()
    print(
        f"\n{', '.join(result.observables)}: {samples} samples, worth "
        f"{posterior.effective_sample_size.item():.0f}, {drawn - began:.0f} s of processor; "
        f"predictive band {banded - drawn:.0f} s; surrogate off by "
        f"{posterior.surrogate_error_K:.1f} K at the outermost samples\n"
    )
    rows = []
    for name in posterior.quantity.values.tolist():
        fitted = result.parameters.get(name)
        value, error = (
            (fitted.value, fitted.stderr)
            if fitted
            else (result.inversion_temperature_K, result.inversion_temperature_stderr_K)
        )
        mean, spread = posterior[name].mean().item(), posterior[name].std().item()
        rows.append((name, f"{value:.4g}", f"{error:.2g}", f"{mean:.4g}", f"{spread:.2g}"))
    table(("", "fit", "standard error", "mean", "spread"), rows)


# --- many levers ----------------------------------------------------------------------------------

#: Relative scatter of the parameters between levers, about that of the paper's Table II.
SCATTER = {"c_kappa": 0.01, "delta": 0.05, "n_d": 0.1, "p": 0.02, "a0": 0.03, "a1": 0.03}
#: Noise, relative to the largest value of each observable.
NOISE = np.array([2e-3, 2e-3, 5e-3])


def write_levers(folder: Path, count: int, seed: int = 0) -> list[Path]:
    """Write measurement files of levers that differ, and are measured with noise."""
    rng = np.random.default_rng(seed)
    probe = Probe.reference().model_copy(update={"material": PUBLISHED["option III"].material})
    model = experiment_of(probe, BIAS, reduce=True)
    paths = []
    for number in range(count):
        changed = {
            name: getattr(probe.material, name) * (1 + share * rng.normal())
            for name, share in SCATTER.items()
        }
        # without a bridge
        values = model.predict(probe.with_(**changed)).values[: NOISE.size]
        values += NOISE[:, None] * values.max(axis=1, keepdims=True) * rng.normal(size=values.shape)
        rows = [",".join(f"{cell:.6g}" for cell in row) for row in np.vstack([BIAS, values]).T]
        text = ["# R_s (kOhm): 5.6", "V_b (V),I_h (mA),V_r (V),T_tip (K)", *rows]
        paths.append(folder / f"lever-{number + 1:04}.csv")
        paths[-1].write_text("\n".join(text) + "\n")
    return paths


def seconds(paths: list[Path], processes: int, kill_at: int = -1) -> tuple[float, float]:
    """Fit all levers into an empty folder; return wall and processor time."""

    def kill_one(done: int, total: int) -> None:
        if done == kill_at:
            children = psutil.Process().children(recursive=True)
            next(one for one in children if "spawn_main" in " ".join(one.cmdline())).kill()

    with tempfile.TemporaryDirectory() as folder:
        began, used = time.perf_counter(), processor_time()
        batch = fit_many(paths, folder, processes=processes, progress=kill_one)
        elapsed = time.perf_counter() - began, processor_time() - used
    if batch.failures:
        sys.exit(f"{len(batch.failures)} levers failed: {next(iter(batch.failures.values()))}")
    return elapsed


def with_one_killed(count: int) -> None:
    """Fit many levers on two processes, one of which is killed on the way."""
    with tempfile.TemporaryDirectory() as folder:
        paths = write_levers(Path(folder), count)
        some = paths[:100]
        one, _ = seconds(some, 1)
        two, _ = seconds(paths, 2, kill_at=count // 3)
    share = 100 * one / len(some) / (2 * two / count)
    print(
        f"{len(some)} levers on 1 process {one:.1f} s; {count} on 2, one killed on the way, "
        f"{two:.1f} s: efficiency {share:.0f} % (target: 90 %), {count / two:.2f} levers per second"
    )


def many_levers(words: list[str]) -> None:
    """Fit a wafer of synthetic levers on one and on two processes, in turn."""
    if words[1:] == ["killed"]:
        with_one_killed(int(words[0]))
        return
    count = int(words[0]) if words else 24
    runs = int(words[1]) if words[1:] else 3
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        paths = write_levers(Path(folder), count)
        for run in range(1, runs + 1):
            (one, used_by_one), (two, used_by_two) = seconds(paths, 1), seconds(paths, 2)
            share, same = 100 * one / (2 * two), 100 * used_by_one / used_by_two
            rows.append((run, one, two, share, used_by_one, used_by_two, same, os.getloadavg()[0]))
            print(f"run {run} of {runs}: {share:.0f} %", file=sys.stderr)
    rows.append(("median", *(median(column) for column in list(zip(*rows, strict=True))[1:])))
    print(f"{count} levers, option III, {os.cpu_count()} processors (target: 90 %)\n")
    table(
        (
            "run",
            "1 process (s)",
            "2 processes (s)",
            "efficiency (%)",
            "processor time, 1 (s)",
            "processor time, 2 (s)",
            "ratio (%)",
            "load",
        ),
        [(row[0], *(f"{value:.1f}" for value in row[1:])) for row in rows],
    )
    print(f"\n{count / rows[-1][2]:.2f} levers per second on 2 processes")


def main() -> None:
    what, *words = sys.argv[1:] or [""]
    if what == "posterior":
        samples = int(words[0]) if words else 1_000
        sampled(samples)
        sampled(samples, ("current",))
    elif what == "many":
        many_levers(words)
    else:
        solves_of([shlex.join([what, *words])] if what else COMMANDS)


if __name__ == "__main__":
    main()
