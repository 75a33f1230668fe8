"""The default mesh against finer ones, 1 to 11 V, for every published option.

python benchmarks/mesh_convergence.py

States are solved by themselves, so that the mesh alone is judged; the last row of each option is a
sweep as users get it, read off the branch between its states.
"""

from __future__ import annotations

import numpy as np

from hotlever.lever import Lever
from hotlever.lever.elements import FiniteElements
from hotlever.lever.full_space import FullSpace
from hotlever.materials import published
from hotlever.probe import MeshOptions, Probe, mesh_layout
from problems import BIAS, processor_seconds, table


def solved(lever):
    return lever.dataset(lever.solve(BIAS))


def main():
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


if __name__ == "__main__":
    main()
