"""Designs by gradient beside optima that are known.

One is known exactly: a lever's power is at most V_b²/4R_s, whatever heats in it. The others are of
one number each, looked for by SciPy's bounded scalar search to 1e-4 of the range, or as the root
at which a bound is met; the sensitivity of a reader, by levers with panels of their own, to 1e-3.
Targets: 1e-3 of the optimum, at most 30 branches.

Run: python benchmarks/designs.py
"""

from __future__ import annotations

import sys

from scipy.optimize import brentq, minimize_scalar

from hotlever import Lever, Probe
from hotlever.lever.similar import SimilarLevers
from hotlever.studies.optimisation import (
    OF_THE_READER,
    Bounds,
    SolvedDesign,
    WorkingPoint,
    optimise,
)
from problems import table

AT_6_V, AT_8_V = WorkingPoint("bias_V", 6.0), WorkingPoint("bias_V", 8.0)
AT_500_K, AT_700_K = WorkingPoint("tip_K", 500.0), WorkingPoint("tip_K", 700.0)
OVER_A_SURFACE = Probe.reference().with_(medium="air", surface_gap_um=0.5)
LENGTH, WIDTH = "heater_length_um", "heater_width_um"


def start(quantity: str) -> Probe:
    """Return the design to start from: the reference probe, over a surface if it is to read."""
    return OVER_A_SURFACE if quantity in OF_THE_READER else Probe.reference()


def value(quantity: str, point: WorkingPoint, name: str, number: float) -> float:
    """Return a quantity of the design with one number changed, on a mesh of its own."""
    probe = start(quantity).with_(**{name: number})
    return SolvedDesign(SimilarLevers(Lever(probe)), probe, point).value(quantity)


def searched(
    quantity: str, point: WorkingPoint, name: str, low: float, high: float, sign: float
) -> float:
    """Return the least of a quantity over a number, or the greatest, without derivatives."""
    result = minimize_scalar(
        lambda number: sign * value(quantity, point, name, number),
        bounds=(low, high),
        method="bounded",
        options={"xatol": (1e-3 if quantity in OF_THE_READER else 1e-4) * (high - low)},
    )
    return sign * float(result.fun)


def main() -> None:
    matched = 8.0**2 / (4.0 * Probe.reference().circuit.series_kohm)
    shortest = brentq(lambda number: value("bias_V", AT_700_K, LENGTH, number) - 7.0, 4, 8)
    fastest = searched("time_constant_us", AT_700_K, LENGTH, 2, 8, 1.0)
    least_bias = searched("bias_V", AT_700_K, LENGTH, 2, 30, 1.0)
    hottest = searched("tip_K", AT_6_V, WIDTH, 0.4, 3, -1.0)
    most_sensitive = searched("dlnR_dz_per_um", AT_500_K, WIDTH, 0.8, 4.5, -1.0)
    least_power = value("power_mW", AT_700_K, LENGTH, shortest)
    problems: list[tuple[str, WorkingPoint, dict[str, Bounds], bool, float]] = [
        ("power_mW", AT_8_V, {LENGTH: (2, 8)}, True, matched),
        ("bias_V", AT_700_K, {LENGTH: (2, 30)}, False, least_bias),
        ("tip_K", AT_6_V, {WIDTH: (0.4, 3)}, True, hottest),
        ("power_mW", AT_700_K, {LENGTH: (2, 8), "bias_V": (7, None)}, False, least_power),
        ("time_constant_us", AT_700_K, {LENGTH: (2, 8)}, False, fastest),
        ("dlnR_dz_per_um", AT_500_K, {WIDTH: (0.8, 4.5)}, True, most_sensitive),
    ]
    rows = []
    for quantity, point, bounds, greatest, known in problems:
        optimum = optimise(start(quantity), quantity, point, bounds, greatest=greatest)
        here = optimum.best.value(quantity)
        limits = "; ".join(optimum.limits) or "none"
        error = f"{abs(here / known - 1.0):.1e}"
        rows.append((f"{quantity} at {point}", f"{here:.5g}", error, optimum.designs, limits))
        print(rows[-1], file=sys.stderr, flush=True)
    table(("problem", "best", "from the known one", "branches", "limited by"), rows)


if __name__ == "__main__":
    main()
