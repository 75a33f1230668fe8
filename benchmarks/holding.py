"""Levers held at a resistance: states at rest, poles of the closed loop, an unstable loop in full.

States are compared with `Lever.solve` at their bias behind the usual resistor. Poles are compared
with small steps of the set point in time, both ways, of which the odd part is taken: a
least-squares fit of an oscillation and a decay to what is left of them, and the whole answer with
the sum of the poles.

    python benchmarks/holding.py
"""

from __future__ import annotations

import time

import numpy as np
from scipy.optimize import least_squares

from hotlever import Lever, Probe
from hotlever.lever.lever import COARSE, State
from hotlever.lever.set_points import hold
from hotlever.lever.transient import Controller, simulate
from hotlever.lever.transient.closed_loop import ClosedLoop

REFERENCE = Probe.reference()
READER = {
    "circuit.reader.kind": "supply",
    "circuit.reader.bias_V": 2.0,
    "circuit.reader.series_resistance_ohm": 500.0,
}
PROBES = {
    "vacuum": REFERENCE,
    "air": REFERENCE.in_medium("air"),
    "thermoelectric": REFERENCE.with_physics(("thermoelectric", "radiation"), "benchmark"),
    "held reader": REFERENCE.with_(**READER),
    "R_s = 0": REFERENCE.with_(series_resistance_ohm=0.0),
}
#: Set points (Ω), and gains (V/kΩ, V/(kΩ ms)) up to their sign.
SET_POINTS = (2000.0, 3000.0)
GAINS = ((0.0, 30.0), (1.0, 100.0), (10.0, 30000.0), (0.1, 25000.0))
#: Times of an answer; steps of the set point (Ω), and slowest time constants that it lasts: of a
#: stable loop, and of one that grows, whose answer must stay small.
TIMES, STEPS, LASTS = 240, (3.0, 0.05), (4.0, 2.0)


def stepped(state: State, gains: tuple[float, float], at: np.ndarray, step: float) -> np.ndarray:
    """Return how far the resistance is off its set point at times (µs), per step, odd part."""
    held = 1000.0 * state.lever_V / state.current_mA
    off = []
    for each in (step, -step):
        controller = Controller(held + each, *gains, state.bias_V, 2.0 * state.bias_V)
        history = simulate(state.lever, controller, at=at, start=state, tolerance_K=1e-4)
        off.append((history.resistance_ohm.values - held - each) / each)
    return (off[0] + off[1]) / 2.0


def fitted(at: np.ndarray, off: np.ndarray, pole: complex, decay: float) -> complex:
    """Return the pole of an oscillation, beside which something decays, that fits best."""

    def missed(rates: np.ndarray) -> np.ndarray:
        growth, turns, other = rates
        terms = np.exp(growth * at) * np.cos(turns * at), np.exp(growth * at) * np.sin(turns * at)
        basis = np.stack([*terms, np.exp(other * at)], axis=1)
        return basis @ np.linalg.lstsq(basis, off, rcond=None)[0] - off

    begin = np.array([pole.real, abs(pole.imag), decay])
    found = least_squares(missed, begin, x_scale=np.abs(begin), xtol=1e-12, ftol=1e-12).x
    return complex(found[0], found[1])


def loops(name: str, state: State, sign: float) -> None:
    """Print the poles of one state with all gains beside steps in time."""
    loop = ClosedLoop.at(state)
    for gains in GAINS:
        P, per_ms = (sign * gain for gain in gains)
        poles, shares = loop.closed(P, per_ms)
        seen = poles[np.abs(shares) > 0.05]
        grows = int(seen[0].real > 0.0)
        lasts = LASTS[grows] / abs(seen[0].real)
        at = np.linspace(0.05 * lasts, lasts, TIMES)
        off = stepped(state, (P, per_ms), at, STEPS[grows])
        sum_of_poles = (shares * np.exp(np.multiply.outer(at, poles))).sum(axis=1).real
        whole = np.abs(off - sum_of_poles).max() / np.abs(off).max()
        row = f"{name:15} {state.tip_K:7.1f} {P:6g} {per_ms:8g}"
        row += f" {seen[0].real:9.5f} {abs(seen[0].imag):8.5f}"
        # of what does not oscillate, or is not the slowest, no fit tells the rates
        if abs(seen[0].imag) > 0.2 * abs(seen[0].real):
            pole = complex(seen[0].real, abs(seen[0].imag))
            others = [other.real for other in seen if abs(other.imag) < 0.1 * pole.imag]
            late = slice(TIMES // 5, None)
            truth = fitted(at[late], off[late], pole, (others or [3.0 * pole.real])[0])
            error = (pole - truth) / abs(truth)
            row += f" {error.real:+9.2%} {error.imag:+9.2%}"
        else:
            row += 2 * f" {'–':>9}"
        print(f"{row} {whole:9.2%}")


def unstable_in_full(state: State) -> None:
    """Print what an unstable loop does until its bias meets the limits."""
    P, per_ms = 0.1, 25000.0
    poles, _ = ClosedLoop.at(state).closed(P, per_ms)
    resistance = 1000.0 * state.lever_V / state.current_mA
    controller = Controller(resistance + 1.0, P, per_ms, state.bias_V, 1.5 * state.bias_V)
    history = simulate(state.lever, controller, until=150.0, start=state, tolerance_K=0.02)
    off = np.abs(history.resistance_ohm.values - controller.set_ohm)
    time_us, bias = history.time.values, history.bias_V.values
    kept = history.supplied_nJ - (history.stored_nJ - history.stored_nJ[0]) - history.lost_nJ
    print(
        f"\nunstable, P = {P:g}, I = {per_ms:g}: predicted {poles[0]:.4f} /µs; off by "
        f"{off[time_us < 10].max():.2f} Ω within 10 µs, {off[time_us > 130].max():.0f} Ω after "
        f"130 µs;\nbias then from {bias[time_us > 130].min():.2f} to "
        f"{bias[time_us > 130].max():.2f} V, limits {0.015 * state.bias_V:.2f} and "
        f"{1.5 * state.bias_V:.2f} V; energy balance "
        f"{np.abs(kept).max().item() / history.supplied_nJ.values[-1]:.1e}"
    )


def main() -> None:
    """Print the tables."""
    levers = {name: Lever(probe, COARSE) for name, probe in PROBES.items()}
    print("states at a resistance beside Lever.solve at their bias: largest error of the tip (K)")
    found = {}
    for name, lever in levers.items():
        begin = time.process_time()
        held = hold(lever, "resistance", SET_POINTS)
        took = time.process_time() - begin
        found[name] = held
        # a ramp finds them all where there is a resistor; what a lever shows does not depend on it
        usual = lever.with_probe(lever.probe.with_(series_resistance_ohm=5600.0))
        biases = [usual.circuit.bias(state.lever_V, state.current_mA) for state in held.states]
        pairs = zip(usual.solve(biases), held.states, strict=True)
        errors = [abs(solved.tip_K - state.tip_K) for solved, state in pairs]
        tips = ", ".join(f"{state.tip_K:.1f}" for state in held.states)
        told = [f"{error:.0e}" for error in errors]
        print(f"{name:15} tips {tips} K: {', '.join(told)} ({took:.2f} s)")
    print(
        "\npoles (1/µs) beside steps in time: errors of decay and frequency as shares of the pole"
    )
    print(
        "and of the whole answer; of loops that grow, whose steps are small, those of the steps too"
    )
    print(f"{'lever':15} {'tip_K':>7} {'P':>6} {'I':>8} {'decay':>9} {'freq.':>8}", end="")
    print(f" {'decay':>9} {'freq.':>9} {'answer':>9}")
    for name, held in found.items():
        for state, slope in zip(held.states, held.data.slope_ohm_per_K.values, strict=True):
            if 1000.0 * state.lever_V / state.current_mA > 2999.0:
                loops(name, state, float(np.sign(slope)))
    unstable_in_full(found["vacuum"].states[2])


if __name__ == "__main__":
    main()
