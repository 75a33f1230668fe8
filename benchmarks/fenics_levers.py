"""Levers of every kind against legacy FEniCS on the same mesh with the same cubic element.

    python benchmarks/fenics_levers.py              (needs benchmarks/fenics/install.sh)

Drawn heaters of several outlines, boron-doped silicon, films that lie on one another, and other
circuits than the paper's. Each is solved at the biases of the table, by itself, with no curve
between states. Targets: 1e-8 of the largest current and voltage, 1e-6 K.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from drawings import levers
from hotlever.lever import Lever
from hotlever.probe import Probe
from problems import EXAMPLE, peer_problem, solve_with_peer, table

#: Relative, and in kelvin.
TARGETS = 1e-8, 1e-6
#: Both solve to less than what is compared.
TOLERANCE_K = 1e-9


def wired(probe: Probe, name: str, **contact: Any) -> Probe:
    """Return a lever with something else wired to one terminal."""
    return probe.with_(**{f"circuit.{name}.{key}": value for key, value in contact.items()})


def compared() -> dict[str, tuple[Probe, list[float]]]:
    """Levers and biases (V) by what is special about them."""
    boron, film = (
        Probe.from_file(EXAMPLE.with_name(f"{name}.toml"))
        for name in ("boron-lever", "palladium-on-nitride")
    )
    bias = [2.0, 5.0, 8.0]
    reference = Probe.reference()
    scattering = reference.with_(impurity_exponent=0.5, intrinsic_scale=1.2)
    hot_boron = boron.with_(**{"hot.impurity_exponent": 0.5, "hot.intrinsic_scale": 0.85})
    held = wired(reference, "reader", kind="supply", bias_V=2.0, series_resistance_ohm=500.0)
    warm = wired(reference, "ground", kind="ground", base_temperature_K=350.0)
    current = wired(reference, "reader", kind="supply", current_mA=0.3)
    ground = wired(reference, "reader", kind="ground", series_resistance_ohm=2000.0)
    drawn = {f"drawn: {name}": (probe, bias) for name, probe in levers().items()}
    return drawn | {
        "n-type, hot impurities": (scattering, bias),
        "p-type, slanted": (boron, [2.0, 4.5, 6.0]),
        "p-type, hot impurities": (hot_boron, [2.0, 4.0]),
        "metal film on a dielectric": (film, [0.2, 0.4, 0.6]),
        "metal film, κ given": (film.with_(**{"film.kappa": 0.5}), [0.2, 0.4, 0.6]),
        "two supplies": (held, [0.0, *bias]),
        "two supplies, one of a current": (current, [0.0, *bias]),
        "second ground, behind a resistor": (ground, bias),
        "a warm leg end": (warm, bias),
        "p-type, two supplies": (
            wired(boron, "ground", kind="supply", bias_V=-1.0, series_resistance_ohm=300.0),
            [0.0, 2.0, 3.0],
        ),
    }


def differences(probe: Probe, bias: list[float]) -> dict[str, float]:
    """Return the largest ones by quantity: shares of its largest value, and kelvins."""
    lever = Lever(probe)
    own = lever.dataset(lever.solve(bias))
    problem = peer_problem(
        probe, lever.space.mesh, degree=3, quadrature=5, bias=bias, tolerance_K=TOLERANCE_K
    )
    found = solve_with_peer(problem)
    apart = {}
    for name in ("current_mA", "lever_V", "reader_V", "reader_mA", "ground_mA"):
        if name in found and name in own:
            ours, theirs = own[name].values, np.array(found[name])
            apart[name] = float(np.abs(theirs - ours).max() / np.abs(ours).max())
    apart["tip_K"] = float(np.abs(np.array(found["tip_K"]) - own.tip_K.values).max())
    return apart


def main() -> None:
    rows, worst = [], np.zeros(2)
    names = {"current_mA": "I_h", "lever_V": "V_l", "reader_V": "V_r", "tip_K": "T_tip (K)"}
    others = ("reader_mA", "ground_mA")
    for kind, (probe, bias) in compared().items():
        apart = differences(probe, bias)
        relative = max(value for name, value in apart.items() if name != "tip_K")
        worst = np.maximum(worst, (relative, apart["tip_K"]))
        held = max((apart[name] for name in others if name in apart), default=None)
        shown = [apart.get(name) for name in names]
        cells = ["" if one is None else f"{one:.1e}" for one in (*shown, held)]
        rows.append([kind, " ".join(f"{one:g}" for one in bias), *cells])
    table(["lever", "biases (V)", *names.values(), "other current"], rows)
    print(f"\nlargest: {worst[0]:.1e} (target {TARGETS[0]:g}), {worst[1]:.1e} K ({TARGETS[1]:g})")


if __name__ == "__main__":
    main()
