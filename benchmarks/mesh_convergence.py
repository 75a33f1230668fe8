"""The default mesh against finer ones, 1 to 11 V, for every published option.

python benchmarks/mesh_convergence.py
"""

from __future__ import annotations

import time

import numpy as np

from hotlever.lever import Lever
from hotlever.lever.operators import FiniteElements
from hotlever.lever.space import LeverSpace
from hotlever.materials.spieser2017 import published
from hotlever.probe import MeshOptions, Probe, mesh_layout
from problems import BIAS, table


def main():
    layout = Probe.reference().layout()
    best = mesh_layout(layout, MeshOptions(refinement=4.0))
    finest = LeverSpace(best, FiniteElements(best.triangles, quadrature=8))
    print(f"Largest difference from {best.triangles.nelements} cubic triangles (sizes / 4)\n")
    rows = []
    for option in ("option I", "option II", "option III"):
        probe = Probe.reference().model_copy(update={"material": published(option).material})
        reference = Lever(probe, space=finest).sweep(BIAS)
        for refinement in (0.5, 1.0, 2.0):
            options = MeshOptions(refinement=refinement)
            lever = Lever(probe, options)
            began = time.perf_counter()
            mesh_layout(layout, options)
            seconds = time.perf_counter() - began
            sweep = lever.sweep(BIAS)
            rows.append(
                (
                    option,
                    f"sizes / {refinement:g}" if refinement != 1 else "default",
                    lever.space.mesh.triangles.nelements,
                    f"{np.abs(sweep.current_mA / reference.current_mA - 1).max().item():.1e}",
                    f"{np.abs(sweep.reader_V / reference.reader_V - 1).max().item():.1e}",
                    f"{np.abs(sweep.tip_K - reference.tip_K).max().item():.3f}",
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
            "meshing (s)",
        ),
        rows,
    )


if __name__ == "__main__":
    main()
