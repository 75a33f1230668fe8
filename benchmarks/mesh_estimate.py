"""Is the mesh that an estimate chooses fine enough, for levers of any dimensions and doping?

python benchmarks/mesh_estimate.py [COUNT]

Random probes, their dimensions over more than a decade and the diffusion length down to 0.1 µm. The
usual mesh and the chosen one are compared with the chosen one in which those triangles are split
that make 99 % of what is left of the estimate, over 25 biases up to just below the largest that the
lever takes before it is pulled up, or has 1300 K.
"""

from __future__ import annotations

import sys

import numpy as np

from hotlever.errors import ComputationError, InputError
from hotlever.lever import Lever
from hotlever.lever.discretisation import energy_between_degrees, making
from hotlever.lever.elements import FiniteElements
from hotlever.lever.full_space import FullSpace
from hotlever.probe import MeshOptions, Probe
from problems import table

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


def random_probe(rng: np.random.Generator) -> Probe:
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
    probe = random_probe(np.random.default_rng(seed))
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


def main():
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 40
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


if __name__ == "__main__":
    main()
