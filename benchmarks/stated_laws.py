"""Laws of materials by table and by formula, beside the same laws as code: errors and cost.

    python benchmarks/stated_laws.py [RUNS]

The lever is the palladium track on silicon nitride. The law itself is the metal of Bloch and
Grüneisen of docs/how-to/own-material.md on a nitride of a strong power law, so that neither is a
straight line. Processor seconds of several runs (15 by default) of all kinds in turn; medians, of
the times and of the ratios in each turn.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from scipy.interpolate import PchipInterpolator

from hotlever.lever import Lever
from hotlever.materials.films import wiedemann_franz
from hotlever.materials.kinds import Dielectric, MetalFilm
from hotlever.probe import Probe
from problems import processor_seconds, table

RUNS = int(sys.argv[1]) if len(sys.argv) > 1 else 15
ROOT = Path(__file__).parents[1]
PROBE = ROOT / "src/hotlever/examples/palladium-on-nitride.toml"
BIAS = np.linspace(0.05, 0.65, 25)
STEPS_K = (5, 10, 25, 50, 100)
#: Range of the tables (K), and temperatures of the nitride's law.
FROM_K, TO_K, EXPONENT = 250.0, 1250.0, -1.2
COLUMNS = ("current_mA", "tip_K", "heater_ohm")


def own_classes() -> dict[str, Any]:
    """Return what the how-to defines beside its class."""
    page = (ROOT / "docs/how-to/own-material.md").read_text(encoding="utf-8")
    names: dict[str, Any] = {"__name__": "own_material"}
    blocks = re.findall(r"```python\n(.*?)```", page, re.S)
    exec(next(block for block in blocks if "class BlochGrueneisenMetal" in block), names)
    return names


class ScipyMetal(MetalFilm):
    """A metal by SciPy's interpolation of a table."""

    def electrical_conductivity(self, T: Any, n: Any) -> Any:
        """σ of ρ."""
        rho = PchipInterpolator(self.resistivity.temperature_K, self.resistivity.values)
        return 1.0 / rho(T), {"T": -rho(T, 1) / rho(T) ** 2}

    def thermal_conductivity(self, T: Any, thickness_um: Any) -> Any:
        """κ by Wiedemann and Franz."""
        return wiedemann_franz(T, lambda T: self.electrical_conductivity(T, 0.0), self.lorenz_ratio)


class ScipyDielectric(Dielectric):
    """A dielectric by SciPy's interpolation of a table."""

    def thermal_conductivity(self, T: Any, thickness_um: Any) -> Any:
        """κ."""
        kappa = PchipInterpolator(self.kappa.temperature_K, self.kappa.values)
        return kappa(T), {"T": kappa(T, 1)}


def tabled(probe: Probe, step_K: float) -> Probe:
    """Return the probe with its resistivity and the nitride's conductivity as tables."""
    T = np.arange(FROM_K, TO_K + step_K / 2, step_K)
    sigma, _ = probe.materials["film"].electrical_conductivity(T, 0.0)
    kappa, _ = probe.materials["nitride"].thermal_conductivity(T, 0.4)
    plain = Probe.from_file(PROBE)
    laws = {"film.resistivity": 1.0 / sigma, "nitride.kappa": kappa}
    return plain.with_(
        **{
            name: {"temperature_K": T.tolist(), "values": values.tolist()}
            for name, values in laws.items()
        }
    )


def off(sweep: Any, exact: Any) -> float:
    """Return the largest relative difference of two sweeps, of the rise where it is temperature."""
    base = {"tip_K": 293.0}
    return max(
        float(np.abs((sweep[name] - exact[name]) / (exact[name] - base.get(name, 0.0))).max())
        for name in COLUMNS
    )


def main() -> None:
    plain = Probe.from_file(PROBE)
    lever = Lever(plain)
    own = plain.with_material("film", own_classes()["BlochGrueneisenMetal"])
    exact = own.with_(**{"nitride.kappa_exponent": EXPONENT})
    truth, T = lever.with_probe(exact).sweep(BIAS), np.linspace(FROM_K, TO_K, 20001)
    film, nitride = (exact.materials[name] for name in ("film", "nitride"))
    rho = 1.0 / film.electrical_conductivity(T, 0.0)[0]
    kappa = nitride.thermal_conductivity(T, 0.4)[0]
    rows = []
    for step in STEPS_K:
        probe = tabled(exact, step)
        made, sweep = probe.materials, lever.with_probe(probe).sweep(BIAS)
        rows.append(
            (
                f"{step}",
                f"{np.abs(made['film'].resistivity(T)[0] / rho - 1).max():.1e}",
                f"{np.abs(made['nitride'].kappa(T)[0] / kappa - 1).max():.1e}",
                f"{np.abs(sweep.tip_K - truth.tip_K).max():.1e}",
                f"{np.abs(sweep.current_mA / truth.current_mA - 1).max():.1e}",
            )
        )
    print(f"tables against the laws, to a tip of {truth.tip_K.max().item():.0f} K")
    table(("step (K)", "ρ, relative", "κ, relative", "tip (K)", "current, relative"), rows)

    by_table = tabled(plain, 50.0)
    by_formula = plain.with_(
        **{
            "film.resistivity": "2e-5 * (1 + 2e-3 * (T - 293))",
            "nitride.kappa": "0.032 * (T/300)**0.33",
        }
    )
    in_scipy = by_table.with_material("film", ScipyMetal).with_material("nitride", ScipyDielectric)
    probes = {
        "numbers, the laws as code": plain,
        "the same by formula": by_formula,
        "the same by table, 50 K": by_table,
        "that table by SciPy, as code": in_scipy,
        "Bloch and Grüneisen, a class": own,
    }
    times: dict[str, list[float]] = {}
    sweeps = {}
    for run in range(-1, RUNS):
        for name, probe in probes.items():
            fresh = lever.with_probe(probe)
            seconds = processor_seconds(
                lambda fresh=fresh, name=name: sweeps.update({name: fresh.sweep(BIAS)})
            )
            if run >= 0:  # the first loads what is loaded where it is wanted
                times.setdefault(name, []).append(seconds)
    first, formula, by_rows, scipy, _ = probes
    against = {formula: first, by_rows: scipy}
    rows = []
    for name, seconds in times.items():
        ratio = median(own / code for own, code in zip(seconds, times[first], strict=True))
        other = against.get(name)
        difference = "" if other is None else f"{off(sweeps[name], sweeps[other]):.1e} ({other})"
        rows.append((name, f"{median(seconds):.3f}", f"{ratio:.2f}", difference))
    print("\n25 biases")
    table(("law", "sweep (s)", "times the first", "largest difference from"), rows)


if __name__ == "__main__":
    main()
