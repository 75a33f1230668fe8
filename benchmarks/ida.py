"""A step, a pulse and a sine by IDA (SUNDIALS), an independent solver, on the same mesh.

    python benchmarks/ida.py

It needs scikit-sundae, which is no dependency of the package. IDA has methods of its own (BDF of
variable order, Krylov's method) and integrates c(T) dT/dt, not the enthalpy; it takes from
hotlever what a lever is at rest, with its Jacobian as a preconditioner.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from sksundae import ida

from hotlever import Lever, Probe
from hotlever.lever.transient import Waveform, pulse, simulate, sine, step
from hotlever.lever.transient.problem import TransientProblem
from hotlever.lever.transport import Fluxes
from hotlever.threads import one_blas_thread

CASES = (
    (step(4.0), np.array([0.1, 1.0, 5.0, 20.0, 100.0, 200.0])),
    (step(8.268), np.array([5.0, 10.0, 100.0, 200.0])),
    (pulse(10.0, 5.0), np.array([0.1, 1.0, 5.0, 5.1, 6.0, 10.0, 100.0])),
    (sine(3.0, 0.5, 20e3), np.array([5.0, 12.5, 30.0, 50.0, 100.0])),
)


def solved(problem: TransientProblem, x: np.ndarray, stops: np.ndarray) -> np.ndarray:
    """Return the unknowns at some times, the first where they are `x`, (times, size + 1)."""
    equations, space = problem.equations, problem.equations.space
    stored, rate, begins = space.is_temperature, 1e9, float(stops[0])
    known: dict[str, Any] = {}

    def residual(t, y, moving, out):
        state = np.array(y)[:, None]
        T = equations.at(state)[0].T
        rise = space.temperature.at_points(np.array(moving)[:, None])[0]
        heat, nothing = equations.laws.heat_density(T)[1] * rise, np.zeros((2, *T.shape))
        out[:] = (space.weak_form(Fluxes(heat, nothing, nothing)) + problem.residual(t, state))[
            :, 0
        ]

    def prepare(t, y, moving, rest, rate):
        known["factors"] = problem.factorised(np.array(y)[:, None], rate)

    def precondition(t, y, moving, rest, right, out, rate, delta):
        out[:] = known["factors"].solve(np.array(right)[:, None])[:, 0]

    # the potentials that belong to the temperatures, and slopes, as if within an instant
    for _ in range(4):
        rest = problem.residual(begins, x)
        rest[stored] = 0.0
        x = x - problem.factorised(x, rate).solve(rest)
    slope = -rate * problem.factorised(x, rate).solve(problem.residual(begins + 1.0 / rate, x))
    solver = ida.IDA(
        residual,
        algebraic_idx=np.flatnonzero(~stored),
        linsolver="gmres",
        krylov_dim=10,
        precond=ida.IDAPrecond(prepare, precondition),
        rtol=1e-7,
        atol=np.where(stored, 1e-6, 1e-8),
        max_num_steps=100_000,
        first_step=1e-6,
    )
    solution = solver.solve(stops, x[:, 0], slope[:, 0] * stored)
    assert solution.success, solution.message
    return np.asarray(solution.y)


@one_blas_thread
def by_ida(lever: Lever, waveform: Waveform, times: np.ndarray) -> np.ndarray:
    """Return tip temperature (K) and current (mA) at some times, (2, times)."""
    equations, space = lever.equations, lever.space
    x = np.zeros((space.size + 1, 1))
    if waveform.before_V:
        x = lever.solve([waveform.before_V])[0].unknowns
    found: list[list[float]] = []
    for piece in waveform.pieces(float(times[-1])):
        inside = times[(times > piece.start) & (times <= piece.end)]
        stops = np.unique(np.concatenate([[piece.start], inside, [piece.end]]))
        states = solved(TransientProblem(equations, lever.circuit, piece.bias), x, stops)
        for y in states[np.isin(stops, inside)]:
            tip = equations.base_temperature_K + float(space.tip_rise(y))
            found.append([tip, float(equations.observed(y[:, None])[1, 0])])
        x = states[-1][:, None]
    return np.array(found).T


def main() -> None:
    lever = Lever(Probe.reference())
    print(f"{'':28}{'largest difference':>30}{'processor seconds':>28}")
    print(f"{'':28}{'T_tip (K)':>15}{'I_h':>15}{'IDA':>14}{'hotlever':>14}")
    for waveform, times in CASES:
        start = time.process_time()
        tip, current = by_ida(lever, waveform, times)
        middle = time.process_time()
        ours = simulate(lever, waveform, at=times, tolerance_K=0.003)
        end = time.process_time()
        off = np.abs(ours.tip_K.values - tip).max()
        largest = np.abs(current).max()
        off_current = np.abs(ours.current_mA.values - current).max() / largest
        print(
            f"{waveform.text:28}{off:15.4f}{off_current:15.1e}"
            f"{middle - start:14.2f}{end - middle:14.2f}"
        )


if __name__ == "__main__":
    main()
