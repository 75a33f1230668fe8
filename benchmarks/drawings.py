"""Drawn levers: against parametric ones, against FEniCS, and how good the doping by distances is.

python benchmarks/drawings.py [same|peer|doping]

same: the reference probe as a drawing against the parametric one, results and time. peer: slanted
levers and a bent heater against legacy FEniCS on the same mesh. doping: the distance to each border
against diffusion solved in the plane, for heaters of several shapes; between
parallel borders both are the same, which shows how good the diffusion is solved.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.sparse.linalg import splu
from scipy.special import erfcinv
from skfem import Basis, ElementTriP1
from skfem.models.poisson import laplace, mass

from hotlever.lever import Lever
from hotlever.lever.full_space import FullSpace
from hotlever.lever.space import PlacedFilm
from hotlever.materials import LOW_DOPED
from hotlever.probe import MeshOptions, Probe, mesh_layout
from problems import BIAS, peer_problem, processor_seconds, solve_with_peer, table

#: Of the diffusion in the plane: largest edge in the heater (share of its width), and time steps.
FINE, STEPS = MeshOptions(heater=0.02, lever=0.05), 400


def box(x0: float, y0: float, x1: float, y1: float) -> list[list[float]]:
    return [[x0, y0], [x1, y0], [x1, y1], [x0, y1]]


def drawn(silicon: Any, heater: Any, tip: Any, supply: Any, ground: Any) -> Probe:
    """A lever of lists of points."""
    sections = {
        "probe": {"shape": "drawing", "thickness_um": 0.4, "tip_um": tip},
        "layers": {"silicon": silicon, "heater": heater},
        "terminals": {"supply": supply, "ground": ground},
    }
    return Probe.from_values(sections, "benchmark")


def levers() -> dict[str, Probe]:
    """Levers of two legs whose heaters differ."""
    legs = [[0, 10], [0, 4], [40, 2], [40, -2], [0, -4], [0, -10], [46, -6], [52, 0], [46, 6]]
    corner = [[0, 8], [0, 5], [20, 5], [20, 0], [23, 0], [23, 8]]
    ends = [[0.0, 4.0], [0.0, 10.0]], [[0.0, -4.0], [0.0, -10.0]]
    flared = [[30, -1.0], [60, -2.6], [60, 2.6], [30, 1.0]]
    block = [box(0, -5, 30, 5)]
    whole = [[0.0, -5.0], [0.0, 5.0]], [[30.0, -5.0], [30.0, 5.0]]
    bent = [[0.0, 5.0], [0.0, 8.0]], [[20.0, 0.0], [23.0, 0.0]]
    return {
        "strip": drawn(block, box(13, -6, 17, 6), [15, 0], *whole),
        "across a point": drawn([legs], box(30, -1.5, 60, 1.5), [44, 0], *ends),
        "flared, across a point": drawn([legs], flared, [44, 0], *ends),
        "bent": drawn([corner], [[17.5, 4], [24, 4], [24, 9], [17.5, 9]], [21.5, 6.5], *bent),
        "slanted border": drawn(block, [[13, -6], [17, -6], [19, 6], [12, 6]], [15, 0], *whole),
    }


def same() -> None:
    """Print the reference probe, drawn, against itself."""
    reference = Probe.reference()
    layout = reference.layout()
    probe = Probe.from_values(
        {
            "probe": {"shape": "drawing", "thickness_um": 0.4, "tip_um": list(layout.tip)},
            "layers": {
                "silicon": [one.outline for one in layout.regions],
                "heater": next(one.outline for one in layout.regions if one.name == "heater"),
                "reader": next(one.outline for one in layout.regions if one.name == "reader"),
            },
            "terminals": {one.name: [one.start, one.end] for one in layout.terminals},
        },
        "benchmark",
    )
    sweeps, rows = {}, []
    for name, one in {"parametric": reference, "drawn": probe}.items():
        lever = Lever(one)
        seconds = processor_seconds(lambda lever=lever: fresh(lever).sweep(BIAS), 7)
        sweeps[name] = sweep = lever.sweep(BIAS)
        first = sweeps["parametric"]
        rows.append(
            [
                name,
                lever.space.size,
                f"{1000 * seconds:.0f}",
                *(f"{float(np.abs(sweep[key] / first[key] - 1).max()):.1e}"
                  for key in ("current_mA", "lever_V", "reader_V")),
                f"{float(np.abs(sweep.tip_K - first.tip_K).max()):.4f}",
            ]
        )  # fmt: skip
    table(["lever", "unknowns", "sweep (ms)", "I_h", "V_l", "V_r", "T_tip (K)"], rows)


def fresh(lever: Lever) -> Lever:
    """The same lever without its branch."""
    return lever.with_probe(lever.probe)


def peer() -> None:
    """Print the differences from legacy FEniCS on the same cubic mesh."""
    rows = []
    bias = [2.0, 5.0, 8.0]
    for name, probe in levers().items():
        lever = Lever(probe)
        own = lever.dataset(lever.solve(bias))
        problem = peer_problem(probe, lever.space.mesh, degree=3, quadrature=5, bias=bias)
        found = solve_with_peer(problem)
        current = np.array(found["current_mA"]) / own.current_mA.values - 1
        tip = np.array(found["tip_K"]) - own.tip_K.values
        rows.append([name, f"{np.abs(current).max():.1e}", f"{np.abs(tip).max():.1e}"])
    table(["heater", "I_h, relative", "T_tip (K)"], rows)


def doping() -> None:
    """Print what doping by the distance to borders is off by, and what that does."""
    rows = []
    for name, probe in levers().items():
        lever = Lever(probe)
        space, material = lever.space, probe.material
        (low,) = (film for film in space.films if film.material == LOW_DOPED)
        share = diffused_share(probe, space.elements.positions[:, low.points])
        own = share_by_distance(low, material.delta)
        other = FullSpace(space.mesh)
        distance = material.delta * erfcinv(2 * np.clip(share, 1e-12, 1 - 1e-12))
        diffused = replace(low, distances=distance[None, :, None])
        other.films = tuple(diffused if film is low else film for film in space.films)
        sweep, exact = (Lever(probe, space=one).sweep([2.0, 5.0, 8.0]) for one in (space, other))
        weights = space.weights[low.points, 0]
        rms = np.sqrt(np.average((own - share) ** 2, weights=weights))
        rows.append(
            [
                name,
                f"{np.abs(own - share).max():.3f}",
                f"{rms:.4f}",
                f"{float(np.abs(sweep.current_mA / exact.current_mA - 1).max()):.1e}",
                f"{float(np.abs(sweep.heater_ohm / exact.heater_ohm - 1).max()):.1e}",
                f"{float(np.abs(sweep.tip_K - exact.tip_K).max()):.2f}",
            ]
        )
    print("distance to borders, less diffusion in the plane; shares of n_hd − n_d in the heater")
    table(["heater", "largest", "rms", "I_h", "R_h", "T_tip (K)"], rows)


def share_by_distance(low: PlacedFilm, delta: float) -> np.ndarray:
    """The share of the high-doped silicon's dopant by `tapered_doping`."""
    from hotlever.materials.doping import tapered_doping

    share, _ = tapered_doping(low.distances[..., 0], 0.0, delta, n_hd=1.0)
    return share


def diffused_share(probe: Probe, points: np.ndarray) -> np.ndarray:
    """The same by diffusion in the plane over Δ = 2 √(D t), outlines being tight."""
    layout = probe.layout()
    mesh = mesh_layout(layout, FINE)
    basis = Basis(mesh.elements, ElementTriP1())
    high = np.array([region.taper is None for region in layout.regions])[mesh.region]
    inertia, stiffness = mass.assemble(basis).tocsc(), laplace.assemble(basis).tocsc()
    # the dopant, which is in the high-doped elements, as a load
    some = Basis(mesh.elements, ElementTriP1(), elements=np.flatnonzero(high))
    dopant = mass.assemble(some) @ np.ones(basis.N)
    share = splu(inertia).solve(dopant)
    step = (probe.material.delta**2 / 4) / STEPS
    # four implicit half-steps take out what the jump leaves, then the trapezoidal rule
    implicit = splu(inertia + step / 2 * stiffness)
    share = implicit.solve(dopant)
    for _ in range(3):
        share = implicit.solve(inertia @ share)
    for _ in range(STEPS - 2):
        share = implicit.solve(inertia @ share - step / 2 * (stiffness @ share))
    return np.asarray(basis.probes(points) @ share)


if __name__ == "__main__":
    kinds = {"same": same, "peer": peer, "doping": doping}
    for kind in sys.argv[1:] or kinds:
        kinds[kind]()
