"""A wafer of synthetic levers on one and on two processes: levers per second, and efficiency.

    python benchmarks/many_levers.py [LEVERS] [RUNS]      (24 levers, 3 runs by default)
    python benchmarks/many_levers.py LEVERS killed

With `killed` all levers are fitted on two processes, one of which is killed after a third of them,
and one process fits a hundred of them.

The efficiency is t(1) / (2 t(2)); the seconds run from the call to the last fit file, with the
start and end of the processes, without reducing the geometry, which is in the cache by then. The
two numbers of processes are measured in turn; medians.

Other work on the machine takes its share of two busy processors, but hardly of one, so the load
is printed. The processor time of all processes, parent and scheduler included, does not mind: with
N processes it shows what spreading the work costs.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

import numpy as np
import psutil

from hotlever.estimate.experiment import experiment_of
from hotlever.estimate.many import fit_many
from hotlever.materials import PUBLISHED
from hotlever.probe import Probe
from problems import BIAS, processor_time, table

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


def main() -> None:
    if sys.argv[2:] == ["killed"]:
        with_one_killed(int(sys.argv[1]))
        return
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 24
    runs = int(sys.argv[2]) if len(sys.argv) > 2 else 3
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


if __name__ == "__main__":
    main()
