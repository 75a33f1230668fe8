"""Levers in time: what data in time tell without any spectrum, how fast they are followed, and IDA.

    python benchmarks/history.py fits [NOISE]
    python benchmarks/history.py twins [COUNT [PULSE_US [SEED]]]
    python benchmarks/history.py speed [PULSES]
    python benchmarks/history.py ida                (needs scikit-sundae, which is no dependency)

fits   Standard errors, linearised at the reference lever, of the tip at the end of a pulse and of
       the scale of the heat capacity: by the current alone or with the reader, in the pulse or at
       rest (25 biases up to 10 V), with what is known beforehand or without. Every datum has the
       same noise, a share of the largest (1e-3 by default). The drawing is taken as known, for
       there are no derivatives in time by dimensions.
twins  Each is a lever of its own material and heat capacity, drawn from what is known beforehand
       (the usual priors; 3 % for the heat capacity), on the drawing that its fit knows. Its current
       alone, or with the reader, is measured during a pulse of 10 V and fitted with those priors.
       Noise is 0.1 % of the largest value, and meters are wrong by 0.1 % as a whole. Levers are
       coarse ones, twins and models alike, so that what is compared is what data tell.
speed  One pulse on modes against the full lever, trains, fits: processor seconds, without the mesh,
       medians of several runs. The modes are those of the full lever's own history, and making
       them is timed too; a user's single pulse is followed by the full lever, trains are on modes.
       Fits in time follow a coarse lever with derivatives, some four times.
ida    A step, a pulse and a sine by IDA (SUNDIALS), an independent solver, on the same mesh. IDA
       has methods of its own (BDF of variable order, Krylov's method) and integrates c(T) dT/dt,
       not the enthalpy; it takes from hotlever what a lever is at rest, with its Jacobian as a
       preconditioner.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from hotlever.errors import HotleverError
from hotlever.estimate import Measurement, fit
from hotlever.estimate.experiment_in_time import ExperimentInTime
from hotlever.lever.lever import COARSE, Lever
from hotlever.lever.transient import Waveform, integrate, pulse, simulate, sine, step
from hotlever.lever.transient.reduced import reduced_in_time
from hotlever.lever.transient.sensitivities import with_sensitivities
from hotlever.lever.transient.transient_problem import TransientProblem
from hotlever.lever.transport import Fluxes
from hotlever.materials import PARAMETERS
from hotlever.probe import Probe
from hotlever.probe.priors import Prior, default_priors, draw_values
from hotlever.quantities import observables_of
from hotlever.work import one_blas_thread
from problems import table

#: What is fitted, and what is known of the heat capacity beforehand.
NAMES = (*PARAMETERS, "series_resistance_ohm", "heat_capacity_scale")
HEAT_CAPACITY = 0.03
#: A pulse (V, µs), and the noise of what is measured in it, a share of the largest value.
HEIGHT, LENGTH, NOISE = 10.0, 100.0, 1e-3


def times(length: float = LENGTH) -> np.ndarray:
    """Return the times (µs) of the rows of a pulse."""
    return np.geomspace(0.1, length, 40)


# --- what data in time tell ----------------------------------------------------------------------

BIASES = np.linspace(0.4, 10.0, 25)


def shown(data: xr.Dataset) -> np.ndarray:
    """Return the observables, (3, n)."""
    return observables_of(data)


def information(
    values: np.ndarray, slopes: np.ndarray, places: list[int], noise: float
) -> np.ndarray:
    """Return the Fisher information of some observables, (3, n) and (3, n, p)."""
    size = np.abs(values[places]).max(axis=1)[:, None, None]
    rows = (slopes[places] / (noise * size)).reshape(-1, len(NAMES))
    return rows.T @ rows


def tells(noise: float = NOISE) -> None:
    probe = Probe.reference()
    lever = Lever(probe, COARSE)
    history = with_sensitivities(lever, pulse(HEIGHT, LENGTH), times(), NAMES)
    values = shown(history)
    slopes = history.sensitivity.values
    rest = lever.sweep(BIASES, sensitivities=True)
    at_rest, around = shown(rest), []
    for share in (1.0, -1.0):
        ohm = probe.circuit.series_resistance_ohm + share
        around.append(shown(lever.with_probe(probe.with_(series_resistance_ohm=ohm)).sweep(BIASES)))
    by_rest = np.zeros((*at_rest.shape, len(NAMES)))
    by_rest[..., : len(PARAMETERS)] = rest.sensitivity.values
    by_rest[..., len(PARAMETERS)] = (around[0] - around[1]) / 2.0
    priors = default_priors(probe)
    spread = np.array([priors[name].absolute for name in NAMES[:-1]] + [HEAT_CAPACITY])
    beforehand = np.diag(spread**-2.0)
    tip, scale = slopes[2, -1], probe.values(NAMES)
    rows = []
    for what, places in (("current", [0]), ("current and reader", [0, 1])):
        moving = information(values, slopes, places, noise)
        still = information(at_rest, by_rest, places, noise)
        for data, told in (
            ("in the pulse, nothing beforehand", moving),
            ("in the pulse", moving + beforehand),
            ("at rest", still + beforehand),
            ("both", moving + still + beforehand),
        ):
            scaled = np.linalg.pinv(told * np.outer(scale, scale), rcond=1e-15, hermitian=True)
            covariance = scaled * np.outer(scale, scale)
            error = np.sqrt(tip @ covariance @ tip)
            rows.append((what, data, f"{error:.1f}", f"{100 * np.sqrt(covariance[-1, -1]):.2f}"))
    rows.append(
        ("nothing", "beforehand", f"{np.sqrt(tip**2 @ spread**2):.1f}", f"{100 * spread[-1]:.2f}")
    )
    print(
        f"Pulse of {HEIGHT:g} V for {LENGTH:g} µs: the tip ends at {values[2, -1]:.0f} K. "
        f"Noise {noise:g} of the largest.\n"
    )
    table(("measured", "when", "error of the tip (K)", "of the heat capacity (%)"), rows)


# --- fits of twins -------------------------------------------------------------------------------

#: Share by which meters are wrong as a whole.
METERS = 1e-3


def twins(count: float = 6, length: float = LENGTH, seed: float = 1) -> None:
    rows_at = times(length)
    probe = Probe.reference()
    lever, wave = Lever(probe, COARSE), pulse(HEIGHT, length)
    usual = default_priors(probe)
    priors = {name: usual[name] for name in NAMES[:-1]}
    priors["heat_capacity_scale"] = Prior(1.0, HEAT_CAPACITY)
    model = partial(ExperimentInTime.of, waveform=wave, names=list(priors), lever=lever)
    rng = np.random.default_rng(int(seed))
    rows, off, sure = [], {}, {}
    guess = simulate(lever, wave, at=rows_at).tip_K.values[-1]
    number = 0
    while number < count:
        moved = draw_values(priors, rng)
        try:
            truth = simulate(lever.with_probe(probe.replace(moved)), wave, at=rows_at)
        except HotleverError:
            continue  # it melts
        number += 1
        shown = [truth.current_mA.values, truth.reader_V.values]
        measured = [
            (1.0 + METERS * rng.normal()) * values
            + NOISE * values.max() * rng.normal(size=values.size)
            for values in shown
        ]
        tip = truth.tip_K.values
        cells = [str(number), f"{tip[-1]:.0f}", f"{guess - tip[-1]:+.0f}"]
        for what, columns in (("current", 1), ("current and reader", 2)):
            data = Measurement.in_time(rows_at, wave, *measured[:columns])
            began = time.process_time()
            fitted = fit(data, probe, model=model, priors=priors)
            at = fitted.band.isel(time=-1)
            error, stated = at.tip_K.item() - tip[-1], at.tip_stderr_K.item()
            scale = fitted.parameters["heat_capacity_scale"]
            own = 100.0 * (scale.value - moved["heat_capacity_scale"])
            cells += [
                f"{error:+.1f} ± {stated:.1f}",
                f"{own:+.1f} ± {100.0 * scale.stderr:.1f}",
                f"{time.process_time() - began:.0f}",
            ]
            off.setdefault(what, []).append(error)
            sure.setdefault(what, []).append(stated)
        rows.append(cells)
        print(*cells, sep="  ", file=sys.stderr, flush=True)
    names = "twin", "tip at the end (K)", "unfitted (K)"
    each = "off (K)", "heat capacity off (%)", "processor s"
    print(f"Pulse of {HEIGHT:g} V for {length:g} µs; current alone, then with the reader.\n")
    table((*names, *each, *each), rows)
    for what, errors in off.items():
        share = np.abs(errors) / np.array(sure[what])
        print(
            f"{what}: rms {np.sqrt(np.mean(np.square(errors))):.1f} K, stated "
            f"{np.sqrt(np.mean(np.square(sure[what]))):.1f} K; within 1.96 of it "
            f"{np.sum(share < 1.96)} of {len(errors)}"
        )


# --- speed ---------------------------------------------------------------------------------------

ONE, UNTIL = pulse(10.0, 5.0), 100.0


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


def speed(pulses: float = 1000) -> None:
    sequence = pulse(9.0, 4.0, 20.0, int(pulses))
    lever, coarse = Lever(Probe.reference()), Lever(Probe.reference(), COARSE)
    full, full_s = timed(lambda: integrate(lever, ONE, UNTIL), 3)
    snapshots: list[np.ndarray] = []
    integrate(lever, ONE, UNTIL, callback=lambda t, state: snapshots.append(state.x))
    reduced, made_s = timed(lambda: reduced_in_time(lever, np.hstack(snapshots)), 1)
    other, reduced_s = timed(lambda: integrate(reduced, ONE, UNTIL, full.time.values), 21)
    off = float(np.abs(other.tip_K - full.tip_K).max())
    train, train_s = timed(lambda: simulate(lever, sequence), 1)
    _, derived_s = timed(
        lambda: with_sensitivities(coarse, pulse(HEIGHT, LENGTH), times(), NAMES), 3
    )
    rows = [
        ("full lever, pulse of 5 µs until 100 µs", f"{full_s:.2f}", "", f"{imbalance(full):.0e}"),
        ("making its modes", f"{made_s:.2f}", "", ""),
        ("the same on modes", f"{reduced_s:.3f}", f"{off:.2g}", f"{imbalance(other):.0e}"),
        (f"train of {pulses:g} pulses", f"{train_s:.1f}", "", f"{imbalance(train):.0e}"),
        (f"coarse lever, pulse of 100 µs by {len(NAMES)} parameters", f"{derived_s:.1f}", "", ""),
    ]
    table(("what", "processor s", "largest difference (K)", "imbalance"), rows)
    print(f"\nThe full lever takes {full_s / reduced_s:.0f} times as long as its modes.")
    print(train.attrs["notes"])


# --- IDA -----------------------------------------------------------------------------------------

WAVEFORMS = (
    (step(4.0), np.array([0.1, 1.0, 5.0, 20.0, 100.0, 200.0])),
    (step(8.268), np.array([5.0, 10.0, 100.0, 200.0])),
    (pulse(10.0, 5.0), np.array([0.1, 1.0, 5.0, 5.1, 6.0, 10.0, 100.0])),
    (sine(3.0, 0.5, 20e3), np.array([5.0, 12.5, 30.0, 50.0, 100.0])),
)


def solved(problem: TransientProblem, x: np.ndarray, stops: np.ndarray) -> np.ndarray:
    """Return the unknowns at some times, the first where they are `x`, (times, size + 1)."""
    from sksundae import ida

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


def by_another_solver() -> None:
    lever = Lever(Probe.reference())
    print(f"{'':28}{'largest difference':>30}{'processor seconds':>28}")
    print(f"{'':28}{'T_tip (K)':>15}{'I_h':>15}{'IDA':>14}{'hotlever':>14}")
    for waveform, times in WAVEFORMS:
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
    what, *words = sys.argv[1:] or ["fits"]
    asked = {"fits": tells, "twins": twins, "speed": speed, "ida": by_another_solver}
    asked[what](*(float(word) for word in words))
