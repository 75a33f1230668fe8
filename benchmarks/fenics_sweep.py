"""Our sweep against legacy FEniCS: the same answers, and the time for them.

    python benchmarks/fenics_sweep.py [RUNS]        (needs benchmarks/fenics/install.sh)

Both solve 25 biases from 1 to 11 V on the same mesh with the same element. Two ways of using
FEniCS are timed: *plain*, as its own Newton solver works, and *tuned*, with a predictor, reuse of
factors and the fastest LU that Debian's packages offer. Meshing (Netgen, the same mesh) is added
to both sides; the peer's compilation of forms is not counted. Medians of several runs (5 by
default), in seconds of the processor: both use one thread.
"""

from __future__ import annotations

import sys
from statistics import median

import numpy as np
from skfem.element import ElementTriP2, ElementTriP3

from hotlever.lever import Lever
from hotlever.lever.elements import FiniteElements
from hotlever.lever.full_space import FullSpace
from hotlever.probe import MeshOptions, Probe, mesh_layout
from problems import BIAS, peer_problem, processor_seconds, solve_with_peer, table

RUNS = int(sys.argv[1]) if len(sys.argv) > 1 else 5
#: As many biases as a continuous ramp has.
MANY = np.linspace(1.0, 11.0, 1000)


def compare(name, options, element, degree, quadrature):
    probe = Probe.reference()
    mesh = mesh_layout(probe.layout(), options)  # loads Netgen
    mesh_seconds = processor_seconds(lambda: mesh_layout(probe.layout(), options), RUNS)

    def lever():
        space = FullSpace(mesh, FiniteElements(mesh.elements, element, quadrature))
        return Lever(probe, space=space)

    def ours(bias, sensitivities=False):
        return lever().sweep(bias, sensitivities=sensitivities)

    mine = {"sweep": (BIAS, False), "with sensitivities": (BIAS, True), "many": (MANY, False)}
    times, peers = {way: [] for way in mine}, {"plain": [], "tuned": []}
    for _ in range(RUNS):  # in turn, so that a slow spell of the machine meets all
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


def main():
    rows = [
        compare("cubic, default mesh", MeshOptions(), ElementTriP3(), 3, 5),
        compare("quadratic, default mesh", MeshOptions(), ElementTriP2(), 2, 5),
        compare("quadratic, sizes / 2", MeshOptions(refinement=2.0), ElementTriP2(), 2, 5),
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


if __name__ == "__main__":
    main()
