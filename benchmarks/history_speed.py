"""How fast levers are followed in time: one pulse on modes against the full lever, and a train.

    python benchmarks/history_speed.py [PULSES]

Processor seconds, without the mesh. The modes are those of the full lever's own history, and their
making is timed too; a user's single pulse is followed by the full lever, trains are on modes.
"""

from __future__ import annotations

import sys
import time

import numpy as np

from hotlever.lever import Lever
from hotlever.lever.transient import followed, pulse
from hotlever.lever.transient.reduced import reduced_in_time
from hotlever.probe import Probe
from problems import table

PULSES = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
ONE, UNTIL = pulse(10.0, 5.0), 100.0
TRAIN = pulse(9.0, 4.0, 20.0, PULSES)


def main() -> None:
    lever, snapshots = Lever(Probe.reference()), []
    began = time.process_time()
    full = followed(lever, ONE, UNTIL, seen=lambda t, state: snapshots.append(state.x))
    times = [time.process_time()]
    reduced = reduced_in_time(lever, np.hstack(snapshots))
    times.append(time.process_time())
    repeats = []
    for _ in range(5):
        start = time.process_time()
        other = followed(reduced, ONE, UNTIL, full.time.values)
        repeats.append(time.process_time() - start)
    off = float(np.abs(other.tip_K - full.tip_K).max())
    start = time.process_time()
    train = lever.pulse(TRAIN)
    whole = time.process_time() - start
    full_s = times[0] - began
    rows = [
        ("full lever, pulse of 5 µs until 100 µs", f"{full_s:.2f}", ""),
        ("making its modes", f"{times[1] - times[0]:.2f}", ""),
        ("the same on modes", f"{min(repeats):.3f}", f"{off:.2g}"),
        (f"train of {PULSES} pulses", f"{whole:.1f}", ""),
    ]
    table(("what", "processor s", "largest difference (K)"), rows)
    print(f"\nThe full lever takes {full_s / min(repeats):.0f} times as long as its modes.")
    print(train.attrs["notes"])


if __name__ == "__main__":
    main()
