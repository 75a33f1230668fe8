"""Drawn levers: against parametric ones, in air, and how good the doping by distances is.

python benchmarks/drawings.py [same|edges|doping|air|solid]

same: the reference probe as a drawing against the parametric one: results, times of a sweep and of
a layout, and of loading what each needs; derivatives by the logarithms of its dimensions, where a
function draws it, with the tip below the step of κ_Si and above, and what they change by on finer
meshes. edges: the drawn reference probe whose outline or heater's window is shifted against one
that is drawn so, which has other parts. doping: the distance to each border against diffusion
solved in the plane, for heaters of several shapes; between parallel borders both are the same,
which shows how good the diffusion is solved. air: the panels of each lever, what making its
operator costs beside a parametric lever of as many panels, and what finer panels change. solid:
levers in air against the full 3-D simulation.
"""

from __future__ import annotations

import inspect
import subprocess
import sys
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import xarray as xr
from scipy.sparse.linalg import splu
from scipy.special import erfcinv
from skfem import Basis, ElementTriP1
from skfem.models.poisson import laplace, mass

from hotlever.air.operator import PanelledAir
from hotlever.air.surface import lever_surface
from hotlever.lever import Lever
from hotlever.lever.branch import Reach
from hotlever.lever.full_space import FullSpace
from hotlever.lever.layers_at_points import PlacedFilm
from hotlever.lever.similar import SimilarLevers
from hotlever.lever3d import SolidLever
from hotlever.materials import LOW_DOPED
from hotlever.materials.heat import STEP
from hotlever.probe import Layout, MeshOptions, Probe, mesh_layout
from hotlever.probe.drawing import Drawing
from hotlever.probe.drawing.shape import build_layout
from hotlever.probe.shapes import ThreeLeg
from hotlever.probe.surroundings import Surroundings
from hotlever.spieser2017 import BASE_TEMPERATURE_K
from hotlever.work import one_blas_thread
from problems import BIAS, box, drawn_reference, processor_seconds, table

REFERENCE = ThreeLeg.reference()
#: Of the diffusion in the plane: largest edge in the heater (share of its width), and time steps.
FINE, STEPS = MeshOptions(heater=0.02, lever=0.05), 400
#: What has to be loaded for a probe by its dimensions, and for one that is drawn.
LOADED = {"parametric": "hotlever.probe.probe", "drawn": "hotlever.probe.drawing.kit"}
#: By how much edges are shifted (µm).
SHIFT = 0.1
#: Biases of levers in air (V).
IN_AIR = [4.0, 12.0]


def drawn(silicon: Any, heater: Any, tip: Any, supply: Any, ground: Any) -> Probe:
    """A lever of lists of points."""
    sections = {
        "probe": {"shape": "drawing", "thickness_um": 0.4, "tip_um": tip},
        "layers": {"silicon": silicon, "heater": heater},
        "terminals": {"supply": supply, "ground": ground},
    }
    return Probe.from_sections(sections, "benchmark")


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
    probe = Probe.from_drawing(Drawing.of_layout(layout))
    sweeps, rows = {}, []
    for name, compared in {"parametric": reference, "drawn": probe}.items():
        lever = Lever(compared)
        seconds = processor_seconds(lambda lever=lever: fresh(lever).sweep(BIAS), 7)
        layouts = processor_seconds(lambda compared=compared: hundred_layouts(compared), 3)
        sweeps[name] = sweep = lever.sweep(BIAS)
        first = sweeps["parametric"]
        rows.append(
            [
                name,
                lever.space.size,
                f"{1000 * seconds:.0f}",
                f"{10 * layouts:.2f}",
                f"{processor_seconds(lambda name=name: loaded(LOADED[name]), 5):.2f}",
                *(f"{float(np.abs(sweep[key] / first[key] - 1).max()):.1e}"
                  for key in ("current_mA", "lever_V", "reader_V")),
                f"{float(np.abs(sweep.tip_K - first.tip_K).max()):.4f}",
            ]
        )  # fmt: skip
    columns = ["lever", "unknowns", "sweep (ms)", "layout (ms)", "load (s)"]
    table([*columns, "I_h", "V_l", "V_r", "T_tip (K)"], rows)
    print("\nderivatives of I_h, V_l and V_r by dimensions against the parametric lever's, largest")
    function = Probe.from_drawing(three_leg)
    first = derivatives(reference, 1.0)
    rows = []
    for name, compared in {"parametric": reference, "drawn": function}.items():
        for refinement in (1.0, 2.0):
            apart = np.abs(derivatives(compared, refinement)[1] - first[1]).max(axis=(1, 2))
            below = first[0] < STEP - BASE_TEMPERATURE_K
            kinds = (f"{apart[some].max():.1e}" for some in (below, ~below))
            rows.append([name, f"sizes / {refinement:g}", *kinds])
    table(["lever", "mesh", f"tip below {STEP:g} K", "above"], rows)


def edges() -> None:
    """Print what shifted edges do, and by how much that differs from levers that are drawn so."""
    probe, bias = drawn_reference("", 0.0), np.array([7.0, 8.27])
    plain, rows = Lever(probe).sweep(bias), []
    for layer in ("silicon", "heater"):
        for shift in (-SHIFT, SHIFT):
            shifted = Lever(probe.with_(**{f"{layer}.edge_bias_um": shift})).sweep(bias)
            anew = Lever(drawn_reference(layer, shift)).sweep(bias)
            apart = np.abs(shifted.tip_K.values - anew.tip_K.values)
            current = np.abs(shifted.current_mA.values / anew.current_mA.values - 1.0)
            does = shifted.tip_K.values - plain.tip_K.values
            cells = [[f"{each:.1f}" for each in does], [f"{each:.2f}" for each in apart]]
            rows.append([layer, f"{shift:+g}", *cells[0], *cells[1], f"{current.max():.1e}"])
    head = [f"{what} at {V:g} V (K)" for what in ("does", "apart") for V in bias]
    table(["layer", "shift (µm)", *head, "I_h apart"], rows)


def three_leg(
    length_um=REFERENCE.length_um,
    centre_leg_width_um=REFERENCE.centre_leg_width_um,
    outer_leg_width_um=REFERENCE.outer_leg_width_um,
    gap_um=REFERENCE.gap_um,
    bridge_width_um=REFERENCE.bridge_width_um,
    heater_length_um=REFERENCE.heater_length_um,
    heater_width_um=REFERENCE.heater_width_um,
    reader_length_um=REFERENCE.reader_length_um,
    thickness_um=REFERENCE.thickness_um,
) -> Drawing:
    """The reference probe, drawn by a function."""
    return Drawing.of_layout(ThreeLeg(**locals()).layout())


def derivatives(probe: Probe, refinement: float) -> tuple[np.ndarray, np.ndarray]:
    """Rises of the tip (K), and derivatives of what is shown there by logarithms, relative."""
    names = tuple(inspect.signature(three_leg).parameters)
    similar = SimilarLevers(Lever(probe, MeshOptions(refinement=refinement)))
    solved = similar.linearised(probe, Reach(probe.circuit, 11.0), None, names)
    shown = solved.branch.values[1:, :3, None]
    return solved.branch.u[1:] ** 2, solved.output_slopes[1:, :3] * probe.values(names) / shown


def hundred_layouts(probe: Probe) -> None:
    """Make the layout of a probe again and again, as if it had not been made before."""
    for _ in range(100):
        build_layout.cache_clear()
        probe.shape.layout()


def loaded(module: str) -> None:
    """Load a module in a process of its own."""
    subprocess.run([sys.executable, "-c", f"import {module}"], check=True)


def fresh(lever: Lever) -> Lever:
    """The same lever without its branch."""
    return lever.with_probe(lever.probe)


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


def air() -> None:
    """Print the cost of the operators of the air, and the error of the panels."""
    rows = []
    reference = Probe.reference().layout()
    for name, probe in levers().items():
        layout = probe.layout()
        count, seconds = operator_cost(layout, 1.0)
        # the reference probe with as many panels
        low, high = 0.3, 2.0
        for _ in range(8):
            middle = (low + high) / 2
            few = len(lever_surface(reference, middle).panels) < count
            low, high = (middle, high) if few else (low, middle)
        as_many, parametric = operator_cost(reference, low)
        own, fine = (
            Lever(probe.in_medium("air"), MeshOptions(panels=panels)).sweep(IN_AIR)
            for panels in (1.0, 2.0)
        )
        rows.append(
            [
                name,
                count,
                f"{seconds:.2f}",
                as_many,
                f"{parametric:.2f}",
                f"{seconds / parametric:.2f}",
                *differences(own, fine),
            ]
        )
    print("making the operator: CPU seconds; then panels against those of half the size\n")
    heads = ["heater", "panels", "s", "parametric panels", "s", "ratio (≤ 2)"]
    table([*heads, "rise of T_tip", "I_h", "heat into air"], rows)


def operator_cost(layout: Layout, refinement: float) -> tuple[int, float]:
    """Panels of a lever, and the processor seconds that its operator takes."""
    count = len(lever_surface(layout, refinement).panels)
    make = partial(PanelledAir, layout, Surroundings(), BASE_TEMPERATURE_K, refinement)
    return count, processor_seconds(one_blas_thread(make), 3)


def solid() -> None:
    """Print the fast model less the full 3-D simulation."""
    rows = []
    for name, probe in levers().items():
        in_air = probe.in_medium("air")
        full, fast = (lever.sweep(IN_AIR) for lever in (SolidLever(in_air), Lever(in_air)))
        rows.append([name, f"{full.tip_K.values.max():.0f}", *differences(fast, full)])
    table(["heater", "T_tip (K)", "rise of T_tip (≤ 5e-3)", "I_h (≤ 1e-3)", "heat into air"], rows)


def differences(sweep: xr.Dataset, other: xr.Dataset) -> list[str]:
    """The largest relative ones of rise, current and heat into the air."""
    rise = (sweep.tip_K - BASE_TEMPERATURE_K) / (other.tip_K - BASE_TEMPERATURE_K)
    ratios = (rise, sweep.current_mA / other.current_mA, sweep.air_heat_mW / other.air_heat_mW)
    return [f"{float(np.abs(ratio - 1).max()):.1e}" for ratio in ratios]


def share_by_distance(low: PlacedFilm, delta: float) -> np.ndarray:
    """The share of the high-doped silicon's dopant by `tapered_doping`."""
    from hotlever.materials.silicon import tapered_doping

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
    kinds = {"same": same, "edges": edges, "doping": doping, "air": air, "solid": solid}
    for kind in sys.argv[1:] or kinds:
        kinds[kind]()
