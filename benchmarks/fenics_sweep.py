"""Our sweep against legacy FEniCS: the same answers, and the time for them.

    python benchmarks/fenics_sweep.py        (needs benchmarks/fenics/install.sh)

Both solve 25 biases from 1 to 11 V on the same mesh with the same element. Two ways of using
FEniCS are timed: *plain*, as its own Newton solver works, and *tuned*, with a predictor, reuse of
factors and the fastest LU that Debian's packages offer. Meshing (Netgen, the same mesh) is added
to both sides; the peer's compilation of forms is not counted. Medians of several runs.
"""

from __future__ import annotations

import time
from statistics import median

import numpy as np
from skfem.element import ElementTriP2, ElementTriP3

from hotlever.lever import Lever
from hotlever.lever.operators import FiniteElements
from hotlever.lever.space import LeverSpace
from hotlever.probe import MeshOptions, Probe, mesh_layout
from problems import BIAS, peer_problem, solve_with_peer, table

RUNS = 5


def timed(action):
    began = time.perf_counter()
    result = action()
    return time.perf_counter() - began, result


def compare(name, options, element, degree, quadrature):
    probe = Probe.reference()
    mesh_layout(probe.layout(), options)  # loads Netgen
    mesh_seconds = median(
        timed(lambda: mesh_layout(probe.layout(), options))[0] for _ in range(RUNS)
    )
    mesh = mesh_layout(probe.layout(), options)

    def ours(sensitivities):
        space = LeverSpace(mesh, FiniteElements(mesh.triangles, element, quadrature))
        return Lever(probe, space=space).sweep(BIAS, sensitivities=sensitivities)

    seconds, with_slopes, peers = [], [], {"plain": [], "tuned": []}
    for _ in range(RUNS):  # in turn, so that a slow spell of the machine meets all
        seconds.append(timed(lambda: ours(False))[0])
        with_slopes.append(timed(lambda: ours(True))[0])
        for way, results in peers.items():
            problem = peer_problem(probe, mesh, degree=degree, quadrature=quadrature, bias=BIAS)
            results.append(solve_with_peer(problem, plain=way == "plain"))
    sweep, peer = ours(False), peers["plain"][0]
    current = np.abs(np.array(peer["current_mA"]) / sweep.current_mA.values - 1).max()
    tip = np.abs(np.array(peer["tip_K"]) - sweep.tip_K.values).max()
    mine = median(seconds) + mesh_seconds
    mine_with_slopes = median(with_slopes) + mesh_seconds
    theirs = {
        way: median(result["seconds"] for result in results) + mesh_seconds
        for way, results in peers.items()
    }
    agreement = (name, mesh.triangles.nelements, peer["unknowns"], f"{current:.1e}", f"{tip:.1e}")
    speed = (
        name,
        f"{mine:.2f}",
        f"{mine_with_slopes:.2f}",
        f"{theirs['plain']:.2f}",
        f"{theirs['tuned']:.2f}",
        f"{theirs['plain'] / mine:.1f}",
        f"{theirs['tuned'] / mine:.1f}",
        # the peer has no derivatives: six parameters cost six more sweeps
        f"{(7 * (theirs['plain'] - mesh_seconds) + mesh_seconds) / mine_with_slopes:.1f}",
    )
    return agreement, speed


def main():
    rows = [
        compare("cubic, default mesh", MeshOptions(), ElementTriP3(), 3, 5),
        compare("quadratic, default mesh", MeshOptions(), ElementTriP2(), 2, 5),
        compare("quadratic, sizes / 2", MeshOptions(refinement=2.0), ElementTriP2(), 2, 5),
    ]
    print("Agreement, largest over 25 biases\n")
    table(
        ("mesh and element", "triangles", "unknowns", "I_h (relative)", "T_tip (K)"),
        [agreement for agreement, _ in rows],
    )
    print("\nTime of a 25-point sweep (s), mesh included\n")
    table(
        (
            "mesh and element",
            "hotlever",
            "with sensitivities",
            "FEniCS plain",
            "FEniCS tuned",
            "plain / ours",
            "tuned / ours",
            "7 plain sweeps / ours with sensitivities",
        ),
        [speed for _, speed in rows],
    )


if __name__ == "__main__":
    main()
