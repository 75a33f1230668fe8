"""Steps of the bias against legacy FEniCS, which states the laws and steps in time on its own.

    python benchmarks/fenics_in_time.py        (needs benchmarks/fenics/install.sh)

Both have the same mesh and cubic triangles. The peer steps the enthalpy by BDF2 with steps that
grow by a factor; with their logarithm halved its error falls to a fourth, which tells it.
"""

from __future__ import annotations

import numpy as np

from hotlever.lever import Lever
from hotlever.lever.transient import simulate, step
from hotlever.probe import MeshOptions, Probe, mesh_layout
from problems import peer_problem, solve_with_peer, table

TIMES = [0.1, 1.0, 5.0, 20.0, 100.0, 200.0]
GROWTH = 1.04


def compare(bias: float) -> tuple[object, ...]:
    probe = Probe.reference()
    problem = peer_problem(
        probe, mesh_layout(probe.layout(), MeshOptions()), degree=3, quadrature=5, bias=[bias]
    )
    found = [
        solve_with_peer({**problem, "times_us": TIMES, "growth": growth})
        for growth in (GROWTH, np.sqrt(GROWTH))
    ]
    rough, fine = (np.array([one["tip_K"], one["current_mA"]]) for one in found)
    ours = simulate(Lever(probe), step(bias), at=TIMES, tolerance_K=0.003)
    away = np.abs(fine - np.array([ours.tip_K.values, ours.current_mA.values])).max(axis=1)
    own = np.abs(fine - rough).max(axis=1) / 3.0
    return (
        *(f"{bias:g}", found[1]["steps"], " ".join(f"{one:.2f}" for one in fine[0])),
        *(f"{away[0]:.3f}", f"{own[0]:.3f}", f"{away[1] / fine[1].max():.1e}"),
        f"{found[1]['processor_seconds']:.1f}",
    )


def main() -> None:
    table(
        (
            *("bias (V)", "steps", f"tip (K) at {', '.join(f'{t:g}' for t in TIMES)} µs"),
            *("apart (K)", "of the peer's steps (K)", "I_h (relative)", "FEniCS (s)"),
        ),
        [compare(bias) for bias in (4.0, 8.268)],
    )


if __name__ == "__main__":
    main()
