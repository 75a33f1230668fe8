"""Levers against legacy FEniCS, which states all laws on its own, and the time that each takes.

    python benchmarks/fenics_peer.py sweep [RUNS]              (needs benchmarks/fenics/install.sh)
    python benchmarks/fenics_peer.py levers|physics|time
    python benchmarks/fenics_peer.py fit [RUNS] [plain] [tuned]

Both have the same mesh and the same element. Two ways of using FEniCS are timed: *plain*, as its
own Newton solver works, and *tuned*, with a predictor, reuse of factors and the fastest LU that
Debian's packages offer. Times are medians of several runs (5 by default), in seconds of the
processor: both use one thread.

sweep    25 biases from 1 to 11 V. Meshing (Netgen, the same mesh) is added to both sides; the
         peer's compilation of forms is not counted.
levers   Drawn heaters of several outlines, boron-doped silicon, films that lie on one another, and
         other circuits than the paper's, each solved at the biases of the table, by itself, with no
         curve between states. Targets: 1e-8 of the largest current and voltage, 1e-6 K.
physics  Thermoelectric and radiating levers at 25 biases of either polarity, by themselves, and
         swept, as commands do. Beside the differences stands what the effects do, which a wrong law
         would change.
time     Steps of the bias. The peer steps the enthalpy by BDF2 with steps that grow by a factor;
         with their logarithm halved its error falls to a fourth, which tells it.
fit      The option-III fit of the shipped lever-a.csv. The paper's stack is legacy FEniCS, lmfit's
         Levenberg-Marquardt and finite differences. It gets the same data, weights, bounds,
         tolerances, mesh and element, and starts from the reference probe's material, which is
         close to the optimum; ours finds its own start. What it would have to pay as well is given
         to it for nothing: starting Python, meshing, compiling forms. *Warm* is `hotlever.fit` with
         the geometry reduced before, *cold* the whole command `hotlever fit` with an empty cache
         (median of up to 3 runs).
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from statistics import median
from typing import Any

import lmfit
import numpy as np
from skfem.element import ElementTriP2, ElementTriP3

from drawings import levers as drawn_levers
from hotlever.cache import CACHE_VARIABLE
from hotlever.estimate import fit, read_measurement
from hotlever.lever import Lever
from hotlever.lever.elements import FiniteElements
from hotlever.lever.full_space import FullSpace
from hotlever.lever.reduced_lever import cached_reduction
from hotlever.lever.transient import simulate, step
from hotlever.materials import PARAMETERS
from hotlever.measurement import with_measured_circuit
from hotlever.probe import MeshOptions, Probe, mesh_layout
from hotlever.quantities import OBSERVABLES
from hotlever.spieser2017 import FITTED_OBSERVABLES
from problems import (
    BIAS,
    EXAMPLE,
    fit_command,
    peer_problem,
    peer_server,
    processor_seconds,
    processor_time,
    solve_with_peer,
    table,
)

# --- sweeps --------------------------------------------------------------------------------------

#: As many biases as a continuous ramp has.
MANY = np.linspace(1.0, 11.0, 1000)


def swept(runs, name, options, element, degree, quadrature):
    probe = Probe.reference()
    mesh = mesh_layout(probe.layout(), options)  # loads Netgen
    mesh_seconds = processor_seconds(lambda: mesh_layout(probe.layout(), options), runs)

    def lever():
        space = FullSpace(mesh, FiniteElements(mesh.elements, element, quadrature))
        return Lever(probe, space=space)

    def ours(bias, sensitivities=False):
        return lever().sweep(bias, sensitivities=sensitivities)

    mine = {"sweep": (BIAS, False), "with sensitivities": (BIAS, True), "many": (MANY, False)}
    times, peers = {way: [] for way in mine}, {"plain": [], "tuned": []}
    for _ in range(runs):  # in turn, so that a slow spell of the machine meets all
        for way, asked in mine.items():
            times[way].append(processor_seconds(lambda asked=asked: ours(*asked)))
        for way, results in peers.items():
            problem = peer_problem(probe, mesh, degree=degree, quadrature=quadrature, bias=BIAS)
            results.append(solve_with_peer(problem, plain=way == "plain"))
    peer, solved = peers["plain"][0], lever()
    apart = []
    for found in (solved.dataset(solved.solve(BIAS)), ours(BIAS)):
        apart.append(np.abs(np.array(peer["current_mA"]) / found.current_mA.values - 1).max())
        apart.append(np.abs(np.array(peer["tip_K"]) - found.tip_K.values).max())
    ours_s, slopes_s, many_s = (median(found) + mesh_seconds for found in times.values())
    plain, tuned = (
        median(result["processor_seconds"] for result in results) + mesh_seconds
        for results in peers.values()
    )
    agreement = (
        *(name, mesh.elements.nelements, peer["unknowns"]),
        *(f"{value:.1e}" for value in apart),
    )
    speed = (
        name,
        *(f"{seconds:.2f}" for seconds in (ours_s, slopes_s, many_s, plain, tuned)),
        f"{plain / ours_s:.1f}",
        f"{tuned / ours_s:.1f}",
        f"{many_s / ours_s:.1f}",
        # the peer has no derivatives: six parameters cost six more sweeps
        f"{(7 * (plain - mesh_seconds) + mesh_seconds) / slopes_s:.1f}",
    )
    return agreement, speed


def sweep(runs="5"):
    count = int(runs)
    rows = [
        swept(count, "cubic, default mesh", MeshOptions(), ElementTriP3(), 3, 5),
        swept(count, "quadratic, default mesh", MeshOptions(), ElementTriP2(), 2, 5),
        swept(count, "quadratic, sizes / 2", MeshOptions(refinement=2.0), ElementTriP2(), 2, 5),
    ]
    print("Agreement, largest over 25 biases: of states solved by themselves, and of a sweep\n")
    table(
        (
            *("mesh and element", "triangles", "unknowns"),
            *("states: I_h (relative)", "T_tip (K)", "sweep: I_h (relative)", "T_tip (K)"),
        ),
        [agreement for agreement, _ in rows],
    )
    print("\nTime of a 25-point sweep (s of processor), mesh included\n")
    table(
        (
            *("mesh and element", "hotlever", "with sensitivities", "1 000 biases"),
            *("FEniCS plain", "FEniCS tuned", "plain / ours", "tuned / ours"),
            *("1 000 / 25 biases", "7 plain sweeps / ours with sensitivities"),
        ),
        [speed for _, speed in rows],
    )


# --- levers of every kind ------------------------------------------------------------------------

#: Targets, relative and in kelvin.
OF_LEVERS = 1e-8, 1e-6
#: Both solve to less than what is compared.
TOLERANCE_K = 1e-9


def wired(probe: Probe, name: str, **contact: Any) -> Probe:
    """Return a lever with something else wired to one terminal."""
    return probe.with_(**{f"circuit.{name}.{key}": value for key, value in contact.items()})


def compared() -> dict[str, tuple[Probe, list[float]]]:
    """Levers and biases (V) by what is special about them."""
    boron, film = (
        Probe.from_file(EXAMPLE.with_name(f"{name}.toml"))
        for name in ("boron-lever", "palladium-on-nitride")
    )
    bias = [2.0, 5.0, 8.0]
    reference = Probe.reference()
    scattering = reference.with_(impurity_exponent=0.5, intrinsic_scale=1.2)
    hot_boron = boron.with_(**{"hot.impurity_exponent": 0.5, "hot.intrinsic_scale": 0.85})
    held = wired(reference, "reader", kind="supply", bias_V=2.0, series_resistance_ohm=500.0)
    warm = wired(reference, "ground", kind="ground", base_temperature_K=350.0)
    current = wired(reference, "reader", kind="supply", current_mA=0.3)
    ground = wired(reference, "reader", kind="ground", series_resistance_ohm=2000.0)
    drawn = {f"drawn: {name}": (probe, bias) for name, probe in drawn_levers().items()}
    return drawn | {
        "n-type, hot impurities": (scattering, bias),
        "p-type, slanted": (boron, [2.0, 4.5, 6.0]),
        "p-type, hot impurities": (hot_boron, [2.0, 4.0]),
        "metal film on a dielectric": (film, [0.2, 0.4, 0.6]),
        "metal film, κ given": (film.with_(**{"film.kappa": 0.5}), [0.2, 0.4, 0.6]),
        "two supplies": (held, [0.0, *bias]),
        "two supplies, one of a current": (current, [0.0, *bias]),
        "second ground, behind a resistor": (ground, bias),
        "a warm leg end": (warm, bias),
        "p-type, two supplies": (
            wired(boron, "ground", kind="supply", bias_V=-1.0, series_resistance_ohm=300.0),
            [0.0, 2.0, 3.0],
        ),
    }


def apart_at_rest(probe: Probe, bias: list[float]) -> dict[str, float]:
    """Return the largest ones by quantity: shares of its largest value, and kelvins."""
    lever = Lever(probe)
    own = lever.dataset(lever.solve(bias))
    problem = peer_problem(
        probe, lever.space.mesh, degree=3, quadrature=5, bias=bias, tolerance_K=TOLERANCE_K
    )
    found = solve_with_peer(problem)
    apart = {}
    for name in ("current_mA", "lever_V", "reader_V", "reader_mA", "ground_mA"):
        if name in found and name in own:
            ours, theirs = own[name].values, np.array(found[name])
            apart[name] = float(np.abs(theirs - ours).max() / np.abs(ours).max())
    apart["tip_K"] = float(np.abs(np.array(found["tip_K"]) - own.tip_K.values).max())
    return apart


def kinds() -> None:
    rows, worst = [], np.zeros(2)
    names = {"current_mA": "I_h", "lever_V": "V_l", "reader_V": "V_r", "tip_K": "T_tip (K)"}
    others = ("reader_mA", "ground_mA")
    for kind, (probe, bias) in compared().items():
        apart = apart_at_rest(probe, bias)
        relative = max(value for name, value in apart.items() if name != "tip_K")
        worst = np.maximum(worst, (relative, apart["tip_K"]))
        held = max((apart[name] for name in others if name in apart), default=None)
        shown = [apart.get(name) for name in names]
        cells = ["" if one is None else f"{one:.1e}" for one in (*shown, held)]
        rows.append([kind, " ".join(f"{one:g}" for one in bias), *cells])
    table(["lever", "biases (V)", *names.values(), "other current"], rows)
    print(
        f"\nlargest: {worst[0]:.1e} (target {OF_LEVERS[0]:g}), {worst[1]:.1e} K ({OF_LEVERS[1]:g})"
    )


# --- thermoelectricity and radiation -------------------------------------------------------------

#: Targets, of the largest current and in kelvin.
OF_EFFECTS = 1e-6, 0.01
EFFECTS = {
    "neither": (),
    "thermoelectric": ("thermoelectric",),
    "radiation": ("radiation",),
    "both": ("thermoelectric", "radiation"),
}


def levers_with_effects() -> dict[str, tuple[Probe, tuple[str, ...], np.ndarray]]:
    """Levers, effects and biases (V) of one polarity, by name."""
    reference, both = Probe.reference(), EFFECTS["both"]
    boron, film, u_shape = (
        Probe.from_file(EXAMPLE.with_name(f"{name}.toml"))
        for name in ("boron-lever", "palladium-on-nitride", "uiuc-lever")
    )
    strong = reference.with_(scattering_exponent=1.5, emissivity=1.0)
    # in vacuum, and doped so that the tip follows the bias without a jump
    vacuum = u_shape.with_(
        medium="vacuum", n_d=reference.material.n_d, series_resistance_ohm=5600.0
    )
    metal = film.with_(**{"film.seebeck": -20.0})
    compared = {f"reference, {name}": (reference, own, BIAS) for name, own in EFFECTS.items()}
    return compared | {
        "reference, r = 1.5, ε = 1": (strong, both, BIAS),
        "p-type, drawn": (boron, both, np.linspace(0.25, 6.0, 25)),
        "U-shape": (vacuum, both, np.linspace(1.0, 14.0, 25)),
        "metal film on a dielectric": (metal, both, np.linspace(0.025, 0.6, 25)),
    }


def apart_with_effects(probe: Probe, bias: np.ndarray) -> list[float]:
    """Return the largest in I_h (relative) and the tip (K).

    Of solved states, of a sweep, and of states without the effects, which is what they do.
    """
    lever = Lever(probe)
    problem = peer_problem(
        probe, lever.space.mesh, degree=3, quadrature=5, bias=bias, tolerance_K=TOLERANCE_K
    )
    peer = solve_with_peer(problem)
    plain = lever.with_probe(probe.with_physics(())).sweep(np.abs(bias))
    current, tip = np.abs(peer["current_mA"]), np.array(peer["tip_K"])
    apart = []
    for other in (lever.dataset(lever.solve(bias)), lever.sweep(bias), plain):
        apart.append(np.abs(np.abs(other.current_mA.values) / current - 1.0).max())
        apart.append(np.abs(other.tip_K.values - tip).max())
    return apart


def physics() -> None:
    rows, worst = [], np.zeros(4)
    for name, (without, effects, bias) in levers_with_effects().items():
        probe = without.with_physics(effects)
        # without thermoelectricity the polarities are alike
        for sign in (1.0, -1.0) if probe.lowest_bias_V < 0.0 else (1.0,):
            apart = apart_with_effects(probe, sign * bias)
            worst = np.maximum(worst, apart[:4])
            ends = f"{sign * bias[0]:g} to {sign * bias[-1]:g}"
            rows.append((name, ends, *(f"{value:.1e}" for value in apart)))
    table(
        (
            *("lever", "25 biases (V)", "states: I_h (relative)", "T_tip (K)"),
            *("sweep: I_h (relative)", "T_tip (K)", "effects: I_h (relative)", "T_tip (K)"),
        ),
        rows,
    )
    print(f"\nlargest, states: {worst[0]:.1e} and {worst[1]:.1e} K; "
          f"sweeps: {worst[2]:.1e} and {worst[3]:.1e} K\n"
          f"targets: {OF_EFFECTS[0]:.0e} and {OF_EFFECTS[1]:g} K")  # fmt: skip


# --- steps in time -------------------------------------------------------------------------------

TIMES = [0.1, 1.0, 5.0, 20.0, 100.0, 200.0]
GROWTH = 1.04


def stepped(bias: float) -> tuple[object, ...]:
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


def in_time() -> None:
    table(
        (
            *("bias (V)", "steps", f"tip (K) at {', '.join(f'{t:g}' for t in TIMES)} µs"),
            *("apart (K)", "of the peer's steps (K)", "I_h (relative)", "FEniCS (s)"),
        ),
        [stepped(bias) for bias in (4.0, 8.268)],
    )


# --- fits ----------------------------------------------------------------------------------------

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
    names = FITTED_OBSERVABLES["option III"]
    data = np.stack([measurement.observable(name)[order] for name in names])
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
            model = np.stack([answer[OBSERVABLES[name].name] for name in names])
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


def fits(*words):
    numbers = [int(word) for word in words if word.isdecimal()]
    runs = numbers[0] if numbers else 5
    ways = [word for word in words if word in WAYS] or WAYS
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
    what, *words = sys.argv[1:] or ["sweep"]
    asked = {"sweep": sweep, "levers": kinds, "physics": physics, "time": in_time, "fit": fits}
    asked[what](*words)
