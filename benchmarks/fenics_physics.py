"""Thermoelectric and radiating levers against legacy FEniCS, which states these laws on its own.

    python benchmarks/fenics_physics.py             (needs benchmarks/fenics/install.sh)

Both have the same mesh and cubic triangles. Each lever is solved at 25 biases of either polarity,
by itself, with no curve between states; and swept, as commands do. Beside the differences of both
solvers stands what the effects do, which a wrong law would change.
"""

from __future__ import annotations

import numpy as np

from hotlever.lever import Lever
from hotlever.probe import Probe
from problems import BIAS, EXAMPLE, peer_problem, solve_with_peer, table

#: Of the largest current, and in kelvin.
TARGETS = 1e-6, 0.01
#: Both solve to less than what is compared.
TOLERANCE_K = 1e-9
EFFECTS = {
    "neither": (),
    "thermoelectric": ("thermoelectric",),
    "radiation": ("radiation",),
    "both": ("thermoelectric", "radiation"),
}


def levers() -> dict[str, tuple[Probe, tuple[str, ...], np.ndarray]]:
    """Levers, effects and biases (V) of one polarity, by name."""
    reference, both = Probe.reference(), EFFECTS["both"]
    boron, film, u_shape = (
        Probe.from_file(EXAMPLE.with_name(f"{name}.toml"))
        for name in ("boron-lever", "palladium-on-nitride", "uiuc-lever")
    )
    strong = reference.with_(scattering_exponent=1.5, emissivity=1.0)
    # in vacuum, and doped so that the tip follows the bias without a jump
    vacuum = u_shape.with_(
        medium="vacuum", n_d=reference.material.n_d, series_resistance_ohm=5600.0
    )
    metal = film.with_(**{"film.seebeck": -20.0})
    compared = {f"reference, {name}": (reference, own, BIAS) for name, own in EFFECTS.items()}
    return compared | {
        "reference, r = 1.5, ε = 1": (strong, both, BIAS),
        "p-type, drawn": (boron, both, np.linspace(0.25, 6.0, 25)),
        "U-shape": (vacuum, both, np.linspace(1.0, 14.0, 25)),
        "metal film on a dielectric": (metal, both, np.linspace(0.025, 0.6, 25)),
    }


def differences(probe: Probe, bias: np.ndarray) -> list[float]:
    """Return the largest in I_h (relative) and the tip (K).

    Of solved states, of a sweep, and of states without the effects, which is what they do.
    """
    lever = Lever(probe)
    problem = peer_problem(
        probe, lever.space.mesh, degree=3, quadrature=5, bias=bias, tolerance_K=TOLERANCE_K
    )
    peer = solve_with_peer(problem)
    plain = lever.with_probe(probe.with_physics(())).sweep(np.abs(bias))
    current, tip = np.abs(peer["current_mA"]), np.array(peer["tip_K"])
    apart = []
    for other in (lever.dataset(lever.solve(bias)), lever.sweep(bias), plain):
        apart.append(np.abs(np.abs(other.current_mA.values) / current - 1.0).max())
        apart.append(np.abs(other.tip_K.values - tip).max())
    return apart


def main() -> None:
    rows, worst = [], np.zeros(4)
    for name, (without, effects, bias) in levers().items():
        probe = without.with_physics(effects)
        # without thermoelectricity the polarities are alike
        for sign in (1.0, -1.0) if probe.lowest_bias_V < 0.0 else (1.0,):
            apart = differences(probe, sign * bias)
            worst = np.maximum(worst, apart[:4])
            ends = f"{sign * bias[0]:g} to {sign * bias[-1]:g}"
            rows.append((name, ends, *(f"{value:.1e}" for value in apart)))
    table(
        (
            *("lever", "25 biases (V)", "states: I_h (relative)", "T_tip (K)"),
            *("sweep: I_h (relative)", "T_tip (K)", "effects: I_h (relative)", "T_tip (K)"),
        ),
        rows,
    )
    print(f"\nlargest, states: {worst[0]:.1e} and {worst[1]:.1e} K; "
          f"sweeps: {worst[2]:.1e} and {worst[3]:.1e} K\n"
          f"targets: {TARGETS[0]:.0e} and {TARGETS[1]:g} K")  # fmt: skip


if __name__ == "__main__":
    main()
