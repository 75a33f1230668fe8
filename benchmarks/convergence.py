"""Do meshes converge, and sweeps?

    python benchmarks/convergence.py mesh
    python benchmarks/convergence.py estimate [COUNT]
    python benchmarks/convergence.py levers [COUNT]

mesh      The default mesh against finer ones, 1 to 11 V, for every published option. States are
          solved by themselves, so that the mesh alone is judged; the last row of each option is a
          sweep as users get it, read off the branch between its states.
estimate  Is the mesh that an estimate chooses fine enough, for levers of any dimensions and doping?
          Random probes, their dimensions over more than a decade and the diffusion length down to
          0.1 µm. The usual mesh and the chosen one are compared with the chosen one in which those
          triangles are split that make 99 % of what is left of the estimate, over 25 biases up to
          just below the largest that the lever takes before it is pulled up, or has 1300 K.
levers    A thousand random levers: every sweep converges, or ends in a typed error with its bias.
"""

from __future__ import annotations

import sys
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from hotlever.errors import BranchEndError, ComputationError, HotleverError, InputError
from hotlever.lever import Lever
from hotlever.lever.discretisation import energy_between_degrees, making
from hotlever.lever.elements import FiniteElements
from hotlever.lever.full_space import FullSpace
from hotlever.materials import published
from hotlever.probe import MeshOptions, Probe, mesh_layout
from problems import BIAS, processor_seconds, table

# --- the default mesh ----------------------------------------------------------------------------


def solved(lever):
    return lever.dataset(lever.solve(BIAS))


def default_mesh():
    layout = Probe.reference().layout()
    best = mesh_layout(layout, MeshOptions(refinement=4.0))
    finest = FullSpace(best, FiniteElements(best.elements, quadrature=8))
    ways = {
        "sizes / 0.5": (0.5, solved),
        "default": (1.0, solved),
        "sizes / 2": (2.0, solved),
        "default, sweep": (1.0, lambda lever: lever.sweep(BIAS)),
    }
    print(f"Largest difference from {best.elements.nelements} cubic triangles (sizes / 4)\n")
    rows = []
    for option in ("option I", "option II", "option III"):
        probe = Probe.reference().model_copy(update={"material": published(option).material})
        reference = solved(Lever(probe, space=finest))
        for name, (refinement, observed) in ways.items():
            options = MeshOptions(refinement=refinement)
            seconds = processor_seconds(lambda options=options: mesh_layout(layout, options))
            lever = Lever(probe, options)
            sweep = observed(lever)

            def apart(column, sweep=sweep, reference=reference):
                return np.abs(sweep[column].values / reference[column].values - 1).max()

            rows.append(
                (
                    option,
                    name,
                    lever.space.mesh.elements.nelements,
                    f"{apart('current_mA'):.1e}",
                    f"{apart('reader_V'):.1e}",
                    f"{np.abs(sweep.tip_K.values - reference.tip_K.values).max():.3f}",
                    f"{seconds:.2f}",
                )
            )
    table(
        (
            "parameters",
            "mesh",
            "triangles",
            "I_h (relative)",
            "V_r (relative)",
            "T_tip (K)",
            "meshing (s of processor)",
        ),
        rows,
    )


# --- the mesh that an estimate chooses -----------------------------------------------------------

#: Least and most of dimensions (µm) and of parameters, drawn with even logarithms.
DRAWN = {
    "length_um": (20, 300),
    "gap_um": (1, 12),
    "bridge_width_um": (1, 12),
    "heater_length_um": (0.8, 15),
    "heater_width_um": (0.3, 6),
    "thickness_um": (0.1, 3),
    "delta": (0.1, 1.2),
    "n_d": (3e16, 3e18),
    "c_kappa": (0.4, 1.0),
    "a0": (4e-4, 1.6e-3),
    "series_resistance_ohm": (100, 4e4),
}
LEGS = {
    "three-leg": {"centre_leg_width_um": (1.5, 20), "outer_leg_width_um": (1, 12)},
    "u-shape": {"leg_width_um": (1, 20)},
}


def odd_probe(rng: np.random.Generator) -> Probe:
    while True:
        probe = Probe.reference() if rng.random() < 0.5 else Probe.u_shape()
        ranges = DRAWN | LEGS[probe.shape.shape]
        values = {name: float(np.exp(rng.uniform(*np.log(ends)))) for name, ends in ranges.items()}
        try:
            return probe.with_(**values)
        except InputError:
            continue  # its parts would overlap


def most_bias(lever: Lever) -> float:
    """The largest bias below the fold, or where the lever has 1300 K."""
    branch = lever.branch()
    u = branch.u_at(np.linspace(lever.circuit.base_temperature_K + 1, branch.hottest_K, 200))
    shown = branch.electrical_outputs(u)
    bias = lever.circuit.bias(shown["lever_V"], shown["current_mA"])
    falls = np.flatnonzero(np.diff(bias) < 0)
    return float(bias[falls[0] if falls.size else -1])


def compared(seed: int) -> list[object]:
    """Return a row of the table."""
    probe = odd_probe(np.random.default_rng(seed))
    usual, chosen = Lever(probe, MeshOptions()), Lever(probe)
    rest = energy_between_degrees(chosen.space, probe.made_of, probe.circuit)
    split = chosen.space.mesh.refined(making(rest, 0.99))
    truth = Lever(probe, space=FullSpace(split, FiniteElements(split.elements, quadrature=8)))
    bias = np.linspace(0.1, 0.97, 25) * most_bias(truth)
    expected = truth.sweep(bias)
    estimate = energy_between_degrees(usual.space, probe.made_of, probe.circuit).sum()
    row: list[object] = [seed, probe.shape.shape, f"{estimate:.1e}"]
    for lever in (usual, chosen):
        sweep = lever.sweep(bias)
        row += [
            lever.space.mesh.elements.nelements,
            f"{np.abs(sweep.current_mA / expected.current_mA - 1).max().item():.1e}",
            f"{np.abs(sweep.tip_K - expected.tip_K).max().item():.3f}",
        ]
    return row


def chosen_mesh(count=40):
    rows, failed = [], []
    for seed in range(count):
        try:
            rows.append(compared(seed))
        except ComputationError as error:
            failed.append(f"{seed}: {error}")
    table(
        (
            *("probe", "shape", "estimate"),
            *("triangles", "I_h (relative)", "T_tip (K)"),
            *("chosen", "I_h (relative)", "T_tip (K)"),
        ),
        rows,
    )
    # a leg far hotter than the tip, whose temperature then falls
    print(*failed, sep="\n")


# --- random levers -------------------------------------------------------------------------------


def outcome(seed: int) -> str:
    """Return what a sweep of one of the levers of the tests comes to."""
    sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "verification"))
    from test_lever_physics import BIAS, random_probe

    probe = random_probe(np.random.default_rng(seed))
    try:
        sweep = Lever(probe, MeshOptions(refinement=0.4)).sweep(BIAS)
    except BranchEndError as error:
        kind = "melts" if "melts" in str(error) else "branch ends at a fold"
        named = f"{error.bias_reached:.4f} V" in str(error)
        return f"typed error: {kind}" + ("" if named else ", bias not named")
    except HotleverError as error:
        return f"FAILED, seed {seed}: {error}"
    return "converged, with a jump" if "jumps" in sweep.attrs["notes"] else "converged"


def random_levers(count=1000):
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        outcomes = Counter(pool.map(outcome, range(count), chunksize=10))
    for text, number in outcomes.most_common():
        print(f"{number:5d}  {text}")


if __name__ == "__main__":
    what, *words = sys.argv[1:] or ["mesh"]
    asked = {"mesh": default_mesh, "estimate": chosen_mesh, "levers": random_levers}
    asked[what](*map(int, words))
