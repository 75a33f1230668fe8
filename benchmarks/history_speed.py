"""How fast levers are followed in time: one pulse on modes against the full lever, trains, fits.

    python benchmarks/history_speed.py [PULSES]

Processor seconds, without the mesh, medians of several runs. The modes are those of the full
lever's own history, and their making is timed too; a user's single pulse is followed by the full
lever, trains are on modes. Fits in time follow a coarse lever with derivatives, some four times.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import xarray as xr

from hotlever.lever import Lever
from hotlever.lever.lever import COARSE
from hotlever.lever.transient import integrate, pulse, simulate
from hotlever.lever.transient.reduced import reduced_in_time
from hotlever.lever.transient.sensitivities import with_sensitivities
from hotlever.materials import PARAMETERS
from hotlever.probe import Probe
from problems import table

PULSES = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
ONE, UNTIL = pulse(10.0, 5.0), 100.0
TRAIN = pulse(9.0, 4.0, 20.0, PULSES)
FITTED, TIMES = pulse(10.0, 100.0), np.geomspace(0.1, 100.0, 40)
NAMES = (*PARAMETERS, "series_resistance_ohm", "heat_capacity_scale")


def timed(work: Callable[[], Any], repeats: int) -> tuple[Any, float]:
    """Return what some work returns, and the processor seconds it usually takes."""
    seconds = []
    for _ in range(repeats):
        began = time.process_time()
        found = work()
        seconds.append(time.process_time() - began)
    return found, float(np.median(seconds))


def imbalance(data: xr.Dataset) -> float:
    """Return the heat that is neither stored nor lost at the end, over all that was supplied."""
    end = data.isel(time=-1)
    return float(1.0 - (end.stored_nJ + end.lost_nJ) / end.supplied_nJ)


def main() -> None:
    lever, coarse = Lever(Probe.reference()), Lever(Probe.reference(), COARSE)
    full, full_s = timed(lambda: integrate(lever, ONE, UNTIL), 3)
    snapshots: list[np.ndarray] = []
    integrate(lever, ONE, UNTIL, callback=lambda t, state: snapshots.append(state.x))
    reduced, made_s = timed(lambda: reduced_in_time(lever, np.hstack(snapshots)), 1)
    other, reduced_s = timed(lambda: integrate(reduced, ONE, UNTIL, full.time.values), 21)
    off = float(np.abs(other.tip_K - full.tip_K).max())
    train, train_s = timed(lambda: simulate(lever, TRAIN), 1)
    _, derived_s = timed(lambda: with_sensitivities(coarse, FITTED, TIMES, NAMES), 3)
    rows = [
        ("full lever, pulse of 5 µs until 100 µs", f"{full_s:.2f}", "", f"{imbalance(full):.0e}"),
        ("making its modes", f"{made_s:.2f}", "", ""),
        ("the same on modes", f"{reduced_s:.3f}", f"{off:.2g}", f"{imbalance(other):.0e}"),
        (f"train of {PULSES} pulses", f"{train_s:.1f}", "", f"{imbalance(train):.0e}"),
        (f"coarse lever, pulse of 100 µs by {len(NAMES)} parameters", f"{derived_s:.1f}", "", ""),
    ]
    table(("what", "processor s", "largest difference (K)", "imbalance"), rows)
    print(f"\nThe full lever takes {full_s / reduced_s:.0f} times as long as its modes.")
    print(train.attrs["notes"])


if __name__ == "__main__":
    main()
