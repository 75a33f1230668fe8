"""The measurements of the worked examples: made with legacy FEniCS, and compared with the truth.

    python benchmarks/example_measurements.py make [EXAMPLE ...]      writes their CSV files
    python benchmarks/example_measurements.py bridge                  the same current by a bridge
    python benchmarks/example_measurements.py compare [EXAMPLE ...]

bridge writes what the bridge of bridge.toml shows where the current is that of reference-probe.csv.
make needs benchmarks/fenics/install.sh. Each lever differs from its probe file in the values of its
materials, as any does, and in what no fit of it looks for: its thickness, and how something in it
goes with the temperature. compare solves the true lever, and calibrates the one of the probe file
with the measurement, as `hotlever calibrate` does.
"""

from __future__ import annotations

import sys
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import xarray as xr

from hotlever.estimate import Estimate, calibrate
from hotlever.files import write_text
from hotlever.lever import Lever
from hotlever.measurement import read_measurement
from hotlever.probe import MeshOptions, Probe
from hotlever.probe.importing import import_drawing
from hotlever.probe.priors import PriorUse
from problems import EXAMPLE, peer_problem, solve_with_peer, table

FOLDER = EXAMPLE.parent
#: Noise of current and reader voltage, as shares; of each temperature, as a share of its rise; and
#: what all temperatures are wrong by together.
CURRENT, READER, TEMPERATURE, THERMOMETER = 1e-3, 2e-3, 0.01, 0.02
#: The peer's mesh is finer than that of a fit.
FINER = MeshOptions(refinement=1.3)
#: Tip temperatures at which both are compared (K).
ASKED = (400.0, 600.0, 800.0, 1000.0)


@dataclass(frozen=True)
class Example:
    """A lever that was drawn, and what its maker does not know of it.

    Attributes
    ----------
    usual, hidden : mapping of str to float
        True values of what a fit varies, and of what it does not.
    bias : tuple of (float, float, int)
        First and last (V), and how many.
    temperatures : tuple of int
        Rows at which the tip temperature was measured.
    head : tuple of str
        Comment lines of the file.
    seed : int
    """

    usual: Mapping[str, float]
    hidden: Mapping[str, float]
    bias: tuple[float, float, int]
    temperatures: tuple[int, ...]
    head: tuple[str, ...]
    seed: int

    @property
    def values(self) -> dict[str, float]:
        """All true values."""
        return {**self.usual, **self.hidden}


EXAMPLES = {
    "reference-probe": Example(
        usual={"c_kappa": 0.67, "delta": 0.7, "n_d": 4.9e17, "p": 2.74, "a0": 9.9e-4, "a1": 1.2e-6},
        hidden={"thickness_um": 0.412, "impurity_exponent": 0.3},
        bias=(0.5, 11.0, 36),
        temperatures=(),
        head=("reference probe of the drawing, vacuum chamber", "R_s (kOhm): 5.6"),
        seed=1,
    ),
    "boron-lever": Example(
        usual={
            "hot.c_kappa": 0.66,
            "hot.delta": 0.7,
            "hot.n_d": 2.8e17,
            "hot.p": 2.5,
            "legs.c_kappa": 0.66,
            "legs.a0": 1.05e-3,
            "legs.a1": 1.25e-6,
        },
        hidden={"thickness_um": 0.388, "hot.impurity_exponent": 0.25},
        bias=(0.25, 6.25, 25),
        temperatures=(9, 13, 15, 17, 20),
        head=("boron-doped lever 7, vacuum chamber", "R_s (kOhm): 2"),
        seed=2,
    ),
    "palladium-on-nitride": Example(
        usual={"film.resistivity": 2.2e-5, "film.tcr": 1.75e-3, "nitride.kappa": 0.028},
        hidden={"thickness_um": 0.412, "film.lorenz_ratio": 1.25},
        bias=(0.05, 0.8, 16),
        temperatures=(3, 5, 7, 9, 11),
        head=("palladium on nitride, vacuum chamber", "R_s (Ohm): 100"),
        seed=3,
    ),
}


def nominal(name: str) -> Probe:
    """Return the lever of an example as its maker knows it."""
    path = FOLDER / f"{name}.toml"
    if path.exists():
        return Probe.from_file(path)
    # what `hotlever probe import` proposes
    proposal = import_drawing(path.with_suffix(".gds"), None, FOLDER).text
    return Probe.from_sections(tomllib.loads(proposal), name, FOLDER)


def true_lever(name: str) -> Lever:
    """Return the lever that was measured."""
    return Lever(nominal(name).with_(**EXAMPLES[name].values), FINER)


def make(name: str) -> str:
    """Return the text of a measurement file, of the peer's solution with noise."""
    example, lever = EXAMPLES[name], true_lever(name)
    bias = np.linspace(*example.bias)
    problem = peer_problem(
        lever.probe, lever.space.mesh, degree=3, quadrature=5, bias=bias.tolist()
    )
    solved = {name: np.array(values) for name, values in solve_with_peer(problem).items()}
    rng = np.random.default_rng(example.seed)
    columns = {"V_b (V)": bias, "I_h (mA)": noisy(solved["current_mA"], CURRENT, rng)}
    if "reader_V" in solved:
        columns["V_r (mV)"] = 1e3 * noisy(solved["reader_V"], READER, rng)
    text = {key: [f"{value:.5g}" for value in values] for key, values in columns.items()}
    if example.temperatures:
        rise = solved["tip_K"] - lever.probe.circuit.base_temperature_K
        scale = 1.0 + THERMOMETER * rng.standard_normal()
        tip = solved["tip_K"] + noisy(scale * rise, TEMPERATURE, rng) - rise
        error = np.hypot(THERMOMETER, TEMPERATURE) * rise
        for heading, values in {"T_tip (K)": tip, "dT_tip (K)": error}.items():
            text[heading] = [
                f"{value:.1f}" if row in example.temperatures else ""
                for row, value in enumerate(values)
            ]
    head = [*example.head, "base temperature (K): 293", "medium: vacuum"]
    rows = [",".join(cells) for cells in zip(*text.values(), strict=True)]
    return "\n".join([*(f"# {line}" for line in head), ",".join(text), *rows]) + "\n"


def by_bridge() -> str:
    """Return the text of a measurement file: a current that was measured, as a bridge shows it."""
    circuit = nominal("bridge").circuit
    measured = read_measurement(FOLDER / "reference-probe.csv")
    lever_V = circuit.lever_voltage(measured.bias_V, measured.current_mA)
    shown = 1e3 * circuit.bridge_voltage(lever_V, measured.bias_V)
    head = "# reference probe in the bridge of bridge.toml\n# base temperature (K): 293\n"
    rows = [f"{bias:.5g},{mV:.3f}" for bias, mV in zip(measured.bias_V, shown, strict=True)]
    return "\n".join([f"{head}# medium: vacuum", "V_b (V),V_bridge (mV)", *rows]) + "\n"


def noisy(values: np.ndarray, share: float, rng: np.random.Generator) -> np.ndarray:
    """Return values with noise in proportion to them."""
    return np.asarray(values * (1.0 + share * rng.standard_normal(len(values))))


def compared(name: str) -> tuple[Estimate, xr.Dataset]:
    """Return an example's calibration, and what it says at true tip temperatures (K).

    Both read the power that the true lever takes at that temperature.
    """
    calibration = calibrate(FOLDER / f"{name}.csv", probe=nominal(name))
    true = true_lever(name).sweep(calibration.table.bias_V.values)
    power = np.interp(ASKED, true.tip_K, true.power_mW)
    measured = calibration.table
    tip = np.interp(power, measured.power_mW, measured.tip_K)
    error = np.interp(power, measured.power_mW, measured.tip_stderr_K)
    at = {"true_K": ("true_K", list(ASKED))}
    columns = {"power_mW": power, "tip_K": tip, "tip_stderr_K": error}
    return calibration, xr.Dataset({key: ("true_K", values) for key, values in columns.items()}, at)


def compare(name: str) -> None:
    """Print what an example's calibration says, beside what is true."""
    calibration, at = compared(name)
    columns = (at.true_K, at.power_mW, at.tip_K, at.tip_stderr_K)
    off = (at.tip_K - at.true_K) / at.tip_stderr_K
    rows = zip(*(column.values for column in (*columns, off)), strict=True)
    form = ("{:.0f}", "{:.3f}", "{:.0f}", "{:.0f}", "{:+.1f}")
    shown = [[column.format(cell) for column, cell in zip(form, row, strict=True)] for row in rows]
    table(("T_tip (K), true", "P_l (mW)", "calibrated", "±", "off / ±"), shown)
    print()
    rows = []
    for key, true in EXAMPLES[name].values.items():
        prior = calibration.priors.get(key)
        calibrated = _with_error(prior) if prior else "not looked for"
        rows.append((key, f"{nominal(name).values([key])[0]:.4g}", f"{true:.4g}", calibrated))
    table(("parameter", "probe file", "true", "calibrated"), rows)


def _with_error(use: PriorUse) -> str:
    return f"{use.posterior_value:.4g} ± {use.posterior_spread:.2g}"


def main() -> None:
    action, *names = sys.argv[1:] or [""]
    if [action, *names] == ["bridge"]:
        write_text(FOLDER / "bridge.csv", by_bridge())
        return
    if action not in ("make", "compare") or not set(names) <= set(EXAMPLES):
        sys.exit(__doc__)
    for name in names or EXAMPLES:
        if action == "make":
            write_text(FOLDER / f"{name}.csv", make(name))
        else:
            print(f"\n{name}\n")
            compare(name)


if __name__ == "__main__":
    main()
