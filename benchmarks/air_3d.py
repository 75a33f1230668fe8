"""The full 3-D simulation of the reference probe in air: its numbers, and what moves them.

python benchmarks/air_3d.py [points|operator|study|vacuum|sweep]
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence

import numpy as np
import xarray as xr
from scipy.interpolate import PchipInterpolator

from hotlever.air.operator import PanelledAir
from hotlever.lever import Lever
from hotlever.lever3d import SolidLever
from hotlever.probe import Probe
from hotlever.probe.solid import SolidMeshOptions
from problems import BIAS, table

#: Biases of the published operating points on the reference probe (V).
POINTS = (7.22, 8.268, 10.748)

AIR = Probe.reference().in_medium("air")
BASE = AIR.circuit.base_temperature_K

#: What is varied, and how.
STUDY: dict[str, dict] = {
    "default": {},
    "quadratic elements in the air": {"air_order": 2},
    "quadratic, sizes × 1.5": {"air_order": 2, "mesh": SolidMeshOptions(refinement=2 / 3)},
    "quadratic, sizes / 1.5": {"air_order": 2, "mesh": SolidMeshOptions(refinement=1.5)},
    "edges of the plate × 2": {"mesh": SolidMeshOptions(rim=4.0)},
    "edges of the plate / 1.5": {"mesh": SolidMeshOptions(rim=4 / 3)},
    "sphere of 45 µm": {"sphere_radius_um": 45.0},
    "sphere of 90 µm": {"sphere_radius_um": 90.0},
}


def scale_factor(sweep: xr.Dataset, vacuum: xr.Dataset) -> np.ndarray:
    """Power in air over power in vacuum at the same tip temperature."""
    in_vacuum = PchipInterpolator(vacuum.tip_K, vacuum.power_mW)(sweep.tip_K)
    return sweep.power_mW.values / in_vacuum


def points() -> None:
    """Print temperature, power and heat into the air at the operating points."""
    probe = AIR
    vacuum = Lever(Probe.reference()).sweep(np.linspace(1.0, 11.5, 200))
    sweep = SolidLever(probe).sweep(POINTS)
    columns = ("tip_K", "current_mA", "lever_V", "power_mW", "air_heat_mW")
    rows = [
        (
            f"{sweep.bias_V.values[k]:g}",
            *(f"{sweep[name].values[k]:.4f}" for name in columns),
            f"{sweep.air_heat_mW.values[k] / sweep.power_mW.values[k]:.4f}",
            f"{factor:.4f}",
        )
        for k, factor in enumerate(scale_factor(sweep, vacuum))
    ]
    table(("bias_V", *columns, "air share", "k"), rows)


def operator(names: Sequence[str] = tuple(STUDY)) -> None:
    """Print the energy ∫θq of θ rising linearly from the leg ends, by volumes and by panels.

    Volumes come to the limit from above and panels from below. Heat of a lever at one temperature
    would not compare them: θ would jump at the leg ends, which have no panels.
    """
    length = np.ptp([x for region in AIR.layout().regions for x, _ in region.outline])
    rows = []
    for name in names:
        air = SolidLever(AIR, **STUDY[name]).space.air.operator
        theta = air.sites[:, 0] / length
        coefficients, heat = air.solve(theta)
        far = f"{air.at_infinity(coefficients) / heat.sum() - 1:+.1e}"
        rows.append((f"volumes: {name}", air.size, f"{theta @ heat:.3f}", far))
        print(rows[-1], file=sys.stderr, flush=True)
    for refinement in (0.5, 1.0, 1.5, 2.0):
        air = PanelledAir(AIR.layout(), AIR.surroundings, BASE, refinement).operator()
        theta = air.sites[:, 0] / length
        name = f"panels: sizes / {refinement:g}"
        rows.append((name, len(air.sites), f"{theta @ air.matrix @ theta:.3f}", ""))
    table(("variant", "unknowns", "energy over θ² (µm)", "heat at infinity (relative)"), rows)


def study(names: Sequence[str] = tuple(STUDY)) -> None:
    """Print what mesh, sphere and order do to the observables."""
    probe = AIR
    rows = []
    for name in names:
        began = time.perf_counter()
        lever = SolidLever(probe, **STUDY[name])
        sweep = lever.sweep(POINTS[:1])
        seconds = time.perf_counter() - began
        balance = (sweep.end_heat_mW + sweep.air_heat_mW) / sweep.power_mW - 1
        rows.append(
            (
                name,
                lever.space.mesh.elements.nelements,
                lever.space.air.operator.size,
                f"{sweep.tip_K.item():.3f}",
                f"{sweep.current_mA.item():.6f}",
                f"{sweep.air_heat_mW.item():.6f}",
                f"{np.abs(balance).max().item():.0e}",
                f"{seconds:.0f}",
            )
        )
    print(f"bias {POINTS[0]:g} V\n")
    table(
        (
            "variant",
            "tetrahedra",
            "air unknowns",
            "T_tip (K)",
            "I_h (mA)",
            "air heat (mW)",
            "balance",
            "s",
        ),
        rows,
    )


def vacuum() -> None:
    """Print the 3-D lever without air against the 2-D lever."""
    probe = Probe.reference()
    flat = Lever(probe).sweep(BIAS)
    rows = []
    for refinement in (0.5, 1.0, 1.5):
        lever = SolidLever(probe, SolidMeshOptions(refinement=refinement))
        sweep = lever.sweep(BIAS)
        rows.append(
            (
                f"{refinement:g}",
                lever.space.mesh.elements.nelements,
                f"{np.abs(sweep.tip_K - flat.tip_K).max().item():.3f}",
                f"{np.abs(sweep.current_mA / flat.current_mA - 1).max().item():.1e}",
                f"{np.abs(sweep.reader_V / flat.reader_V - 1).max().item():.1e}",
            )
        )
    table(("refinement", "tetrahedra", "T_tip (K)", "I_h (relative)", "V_r (relative)"), rows)


def sweep() -> None:
    """Print the fast model against the full 3-D sweep of 25 biases, and its time."""
    lever = SolidLever(AIR)
    wall, processor = time.perf_counter(), time.process_time()
    full = lever.sweep(BIAS)
    wall, processor = time.perf_counter() - wall, time.process_time() - processor
    fast = Lever(AIR).sweep(BIAS)
    rows = [
        (
            f"{bias:.3f}",
            f"{full.tip_K.values[k]:.2f}",
            f"{fast.tip_K.values[k] - full.tip_K.values[k]:+.2f}",
            f"{100 * (fast.tip_K.values[k] - full.tip_K.values[k]) / rise:+.2f}",
            f"{fast.current_mA.values[k] / full.current_mA.values[k] - 1:+.1e}",
            f"{fast.air_heat_mW.values[k] / full.air_heat_mW.values[k] - 1:+.1e}",
        )
        for k, (bias, rise) in enumerate(zip(BIAS, full.tip_K.values - BASE, strict=True))
    ]
    print("fast less full 3-D\n")
    table(("bias (V)", "T_tip (K)", "T_tip (K)", "% of the rise", "I_h", "air heat"), rows)
    print(
        f"\nfull 3-D: {wall:.0f} s, of which {processor:.0f} s on the processor; states found in "
        "the cache are not solved again"
    )


def main() -> None:
    """Print the tables asked for."""
    tables = (points, operator, study, vacuum, sweep)
    known = {one.__name__: one for one in tables}
    for name in sys.argv[1:] or known:
        print(f"\n## {name}\n")
        known[name]()


if __name__ == "__main__":
    main()
