"""Levers whose laws are not the paper's: are stated errors of calibrations those that are made?

Levers are solved by `foreign_solver`, which shares nothing with hotlever, with laws that depart
from Eqs. 4 to 11 within what is published:

film      additional thermal resistivity, of which a share of 0 to 1 does not grow with temperature
carriers  0 to 1 of the way from Eq. 7 to what was measured: Morin and Maita and Putley and Mitchell
          (Hall effect), Misiakos and Tsamakis (diodes)
mobility  0 to 1 of the way from Eqs. 8 to 10 to Arora, Hauser and Roulston
profile   0 to 1 of the way from erfc to phosphorus that diffuses by vacancies, as a front, and 0 to
          5 % of the dopant has diffused up to 1.6 times as far
legs      resistivity bent by up to 20 % at 1000 K, either way
chip      ends of the legs warm up by 0 to 4 K/mW of the lever's power

This referee and the priors of hotlever.materials.departures are two readings of the literature: it
goes evenly from the paper's law to one other law, they are the spread of many, and neither was
changed to suit the other. Where they differ, errors are not what is stated, and that is the answer.
Of the profile both know one source, by which it solves for the diffusion and they shift erfc.

Their parameters, dimensions and doping are off the owner's probe file by what is usual (dimensions
5 %, doping 15 %), currents and reader have 0.2 % of noise, and five Raman temperatures have 5 K
each, which is stated, and 1.5 % of the rise in common. That error is one number a lever, so that
few levers drawn at random have by chance larger or smaller ones than all: it is drawn in strata, of
which each run of levers has every one. In air losses are those of a plate in free air, whose
conductivity is off by 3 %. Of each `hotlever calibrate` is asked, as a user would.

Sources: Asheghi et al., J. Appl. Phys. 91, 5079 (2002) and Liu and Asheghi, J. Heat Transfer 128,
75 (2006) for films; Arora et al., IEEE Trans. Electron Devices 29, 292 (1982); Chapman et al., J.
Appl. Phys. 34, 3291 (1963) for legs; those of carriers and phosphorus stand in the solver.

    python benchmarks/foreign_levers.py [LEVERS]          14 if left out; all departures together
        [--families all|each|none|film,legs,...] [--kinds current,reader,spectra]
        [--media vacuum,air] [--first K] [--options '--laws paper'] [--processes N]
        [--told]                beside estimates told that no other law departs
        [--fineness 0.5]        coarser elements, at a third of the price; --check prints the error
        [--coarse]              calibrations on coarse meshes, in this process, at two thirds of it
        [--results FILE]        append a line for each, and go on with those that are not there
    python benchmarks/foreign_levers.py --check           levers without departures, beside hotlever
    python benchmarks/foreign_levers.py --paper           the paper's lever, beside its Eq. 12
    python benchmarks/foreign_levers.py --write DIR ...   data and probe files instead
"""

from __future__ import annotations

import argparse
import json
import shlex
import subprocess
import sys
import tempfile
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from dataclasses import astuple, dataclass, replace
from functools import partial
from itertools import pairwise, product
from multiprocessing import get_context
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from scipy.special import ndtri

from foreign_solver import Laws, Lever, Sweep
from problems import table

FAMILIES = ("film", "carriers", "mobility", "profile", "legs", "chip")
CARRIERS = ("Morin and Maita", "Misiakos and Tsamakis", "Putley and Mitchell")
#: The law that departs in each, as priors name it.
LAW_OF = {
    "film": "kappa",
    "carriers": "n_i",
    "mobility": "mobility",
    "legs": "legs",
    "profile": "profile",
}
KINDS, MEDIA = ("current", "reader", "spectra"), ("vacuum", "air")
#: What the owner believes to have.
NOMINAL: dict[str, dict[str, float]] = {
    "three-leg": {
        "length_um": 54.4,
        "centre_leg_width_um": 6.44,
        "outer_leg_width_um": 3.46,
        "gap_um": 3.2,
        "bridge_width_um": 3.82,
        "heater_length_um": 4.0,
        "heater_width_um": 1.645,
        "thickness_um": 0.4,
    },
    "u-shape": {
        "length_um": 60.0,
        "leg_width_um": 6.0,
        "gap_um": 6.0,
        "bridge_width_um": 4.0,
        "heater_length_um": 4.0,
        "heater_width_um": 1.645,
        "thickness_um": 0.4,
    },
}
#: By how much levers scatter about it, as shares: of silicon half as much again as Table II.
DIMENSIONS, DOPING, SERIES, BASE_K, AIR = 0.05, 0.15, 1e-3, 1.0, 0.03
SILICON = {"c_kappa": 0.085, "delta": 0.17, "p": 0.053, "a0": 0.086, "a1": 0.088}
ROWS, NOISE = 40, 2e-3
SPECTRA, SPECTRUM_K, COMMON = 5, 5.0, 0.015
#: Where the data end: the tip (K), from and to, and the highest bias (V).
ENDS_K, HIGHEST_V = (1000.0, 1300.0), {"vacuum": 13.0, "air": 15.0}
#: Borders between the ranges of the true temperature (K) for which errors are compared.
RANGES = (400.0, 600.0, 800.0, 1000.0, 1300.0)
#: Half the width of a band of 95 %, in standard deviations.
BAND = 1.96


@dataclass(frozen=True)
class Task:
    """A lever that is measured in one way: number, departures, medium and kind of data.

    And what the estimate is told: as usual nothing, or that no other laws depart.
    """

    number: int
    family: str
    medium: str
    kind: str
    told: bool = False

    @property
    def options(self) -> list[str]:
        """What the command is told of the laws."""
        exact = [law for family, law in LAW_OF.items() if self.told and family != self.family]
        return [word for law in exact for word in ("--prior", f"law.{law}=exact")]


def foreign_lever(number: int, family: str, medium: str, fineness: float = 1.0) -> Lever:
    """Return the lever of a number; the same with all departures, one, or none of them."""
    rng = np.random.default_rng(number)
    shape = "three-leg" if number % 2 == 0 else "u-shape"

    def off(value: float, spread: float) -> float:
        return float(value * np.exp(spread * rng.standard_normal()))

    dimensions = {name: off(size, DIMENSIONS) for name, size in NOMINAL[shape].items()}
    plain = Laws()
    silicon = {name: off(getattr(plain, name), spread) for name, spread in SILICON.items()}
    laws = replace(plain, n_d=off(plain.n_d, DOPING), **silicon)
    series, base = off(5.6, SERIES), 293.0 + BASE_K * rng.standard_normal()
    air = off(1.0, AIR)
    departures: dict[str, dict[str, Any]] = {
        "film": {"surface_share": rng.uniform(0.0, 1.0)},
        "carriers": {
            "carriers": str(rng.choice(CARRIERS)),
            "carriers_share": rng.uniform(0.0, 1.0),
        },
        "mobility": {"arora_share": rng.uniform(0.0, 1.0)},
        "profile": {
            "tail_share": rng.uniform(0.0, 0.05),
            "tail_length": rng.uniform(1.0, 1.6),
            "front_share": rng.uniform(0.0, 1.0),
        },
        "legs": {"legs_bend": rng.uniform(-0.2, 0.2)},
    }
    chip = float(rng.uniform(0.0, 4.0))
    for name, changes in departures.items():
        if family in ("all", name):
            laws = replace(laws, **changes)
    return Lever(
        shape,
        dimensions,
        laws,
        series_kohm=series,
        base_K=base,
        chip_K_per_mW=chip if family in ("all", "chip") else 0.0,
        in_air=medium == "air",
        air_scale=air,
        fineness=fineness,
    )


def measured(task: Task, sweep: Sweep, base_K: float) -> tuple[str, np.ndarray]:
    """Return the text of a measurement file, and its biases."""
    rng = np.random.default_rng((task.number, 1))
    end = sweep.bias_V[-1]
    bias = np.linspace(end / ROWS, end, ROWS)
    current, reader, tip = sweep.at(bias)
    current = current * (1.0 + NOISE * rng.standard_normal(ROWS))
    reader = reader * (1.0 + NOISE * rng.standard_normal(ROWS))
    columns = {"V_b (V)": bias, "I_h (mA)": current}
    if task.kind == "reader":
        columns["V_r (V)"] = reader
    if task.kind == "spectra":
        common, alone = stratified(task.number), rng.standard_normal(SPECTRA)
        at = np.linspace(RANGES[0], 0.98 * tip[-1], SPECTRA)
        rows = np.searchsorted(tip, at).clip(0, ROWS - 1)
        spectra, errors = np.full(ROWS, np.nan), np.full(ROWS, np.nan)
        rise = (tip[rows] - base_K) * (1.0 + COMMON * common)
        spectra[rows], errors[rows] = base_K + rise + SPECTRUM_K * alone, SPECTRUM_K
        columns |= {"T_tip (K)": spectra, "dT_tip (K)": errors}
    lines = [f"# medium: {task.medium}", ",".join(columns)]
    for cells in zip(*columns.values(), strict=True):
        lines.append(",".join("" if np.isnan(cell) else f"{cell:.7g}" for cell in cells))
    return "\n".join(lines) + "\n", bias


def stratified(number: int) -> float:
    """Return a normal deviate, whose strata any run of numbers fills evenly (golden ratio)."""
    return float(ndtri((0.5 + number * (np.sqrt(5.0) - 1.0) / 2.0) % 1.0))


def owners_probe(shape: str, medium: str) -> str:
    """Return the probe file of the owner."""
    return "\n".join(
        [
            "[probe]",
            f'shape = "{shape}"',
            *(f"{name} = {size}" for name, size in NOMINAL[shape].items()),
            *(["reader_length_um = 4.0"] if shape == "three-leg" else []),
            "[circuit]",
            "series_resistance_ohm = 5600",
            "base_temperature_K = 293",
            "[material]",
            *(f"{name} = {getattr(Laws(), name):.6g}" for name in (*SILICON, "n_d")),
            "[surroundings]",
            f'medium = "{medium}"',
            "",
        ]
    )


def judge(
    levers: list[Task], options: list[str], fineness: float, coarse: bool
) -> list[dict[str, Any]]:
    """Solve the lever that some tasks share, calibrate it by each, and compare with the truth."""
    number, family, medium = levers[0].number, levers[0].family, levers[0].medium
    lever = foreign_lever(number, family, medium, fineness)
    hottest = np.random.default_rng((number, 2)).uniform(*ENDS_K)
    sweep = lever.sweep(hottest, HIGHEST_V[medium])
    return [judged(task, lever, sweep, options, coarse) for task in levers]


def by_command(folder: Path, options: list[str]) -> tuple[dict[str, Any] | None, str]:
    """Return the calibration of a folder's files, or why there is none."""
    words = ["calibrate", "iv.csv", "--probe", "probe.toml", "-o", "out.json", *options]
    command = [sys.executable, "-m", "hotlever", *words]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    if done.returncode and not Path(folder, "out.json").exists():
        return None, done.stderr.strip().rpartition("\n")[2]
    return json.loads(Path(folder, "out.json").read_text()), ""


def here_on_coarse_meshes(folder: Path, options: list[str]) -> tuple[dict[str, Any] | None, str]:
    """Return the same of levers on coarse meshes, without a process of its own."""
    from hotlever import Lever as OurLever
    from hotlever.errors import HotleverError
    from hotlever.estimate import calibrate
    from hotlever.lever.lever import COARSE

    parser = argparse.ArgumentParser()
    parser.add_argument("--prior", action="append", default=[])
    parser.add_argument("--laws", dest="prior", action="append", type=lambda text: f"laws={text}")
    told = parser.parse_args(options)
    priors = dict(text.split("=") for text in told.prior)
    plain = OurLever.__init__

    def on_coarse_mesh(self: Any, probe: Any, mesh: Any = None, **others: Any) -> None:
        plain(self, probe, mesh or COARSE, **others)

    with patch.object(OurLever, "__init__", on_coarse_mesh):
        try:
            found = calibrate(folder / "iv.csv", probe=folder / "probe.toml", priors=priors or None)
        except HotleverError as error:
            return None, str(error)
    return json.loads(found.to_json()), ""


def judged(
    task: Task, lever: Lever, sweep: Sweep, options: list[str], coarse: bool
) -> dict[str, Any]:
    """Calibrate a lever that is solved; return what can be written as JSON.

    By range of the true temperature: ``inside``, the share of rows in the band, and mean squares of
    the error (``off``), of the stated one (``stated``) and of their ratio.
    """
    text, bias = measured(task, sweep, lever.base_K)
    record: dict[str, Any] = {**task.__dict__, "shape": lever.shape, "ranges": {}}
    began = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "iv.csv").write_text(text)
        Path(folder, "probe.toml").write_text(owners_probe(lever.shape, task.medium))
        calibrated = here_on_coarse_meshes if coarse else by_command
        found, reason = calibrated(Path(folder), [*task.options, *options])
        record["seconds"] = round(time.perf_counter() - began, 1)
        if found is None:
            return record | {"outcome": "refused", "reason": reason}
    outcomes = {True: "described", False: "not described", None: "not converged"}
    record |= {"outcome": outcomes[found["describes_data"]], "reason": found["reason"]}
    rows = [r for r in found["table"] if r["tip_K"] is not None and r["tip_low_K"] is not None]
    rows = [r for r in rows if bias[0] <= r["bias_V"] <= bias[-1]]
    low, tip, high = (
        np.array([r[name] for r in rows]) for name in ("tip_low_K", "tip_K", "tip_high_K")
    )
    true = sweep.at(np.array([r["bias_V"] for r in rows]))[2]
    off = tip - true
    stated = np.where(off > 0, tip - low, high - tip) / BAND
    for start, end in pairwise(RANGES):
        there = (true >= start) & (true < end)
        if there.any():
            record["ranges"][f"{start:g}"] = {
                "inside": float(np.mean((low <= true) & (true <= high), where=there)),
                "off": float(np.mean(off**2, where=there)),
                "stated": float(np.mean(stated**2, where=there)),
                "ratio": float(np.mean((off / stated) ** 2, where=there)),
                "mean": float(np.mean(off, where=there)),
            }
    return record


def summary(records: list[dict[str, Any]]) -> list[list[str]]:
    """Return rows of the table, for each range and pooled; each lever counts once."""
    described = [record for record in records if record["outcome"] == "described"]
    rows = []
    for start, end in pairwise(RANGES):
        some = [r["ranges"][f"{start:g}"] for r in described if f"{start:g}" in r["ranges"]]
        rows.append([f"{start:g}–{end:g} K", *cells(some)])
    pooled = []
    for record in described:
        if parts := list(record["ranges"].values()):
            pooled.append({name: np.mean([p[name] for p in parts]) for name in parts[0]})
    return [*rows, ["pooled", *cells(pooled)]]


def cells(parts: list[dict[str, float]]) -> list[str]:
    """Return the cells of a row: levers, error made, stated, both together, share inside."""
    if not parts:
        return ["0", "", "", "", "", ""]
    mean = {name: float(np.mean([part[name] for part in parts])) for name in parts[0]}
    made, stated, ratio = (np.sqrt(mean[name]) for name in ("off", "stated", "ratio"))
    inside, off = f"{mean['inside']:.0%}", f"{mean['mean']:+.0f} K"
    return [str(len(parts)), f"{made:.1f} K", f"{stated:.1f} K", f"{ratio:.2f}", inside, off]


def report(records: list[dict[str, Any]]) -> None:
    """Print a table for each group of levers, and one of all groups."""
    groups: dict[tuple[str, ...], list[dict[str, Any]]] = {}
    for record in records:
        words = " and told" if record["told"] else ""
        name = record["kind"], record["medium"], record["family"] + words
        groups.setdefault(name, []).append(record)
    heads = ["true temperature", "levers", "error made", "stated", "over stated", "inside", "mean"]
    every = []
    for name, group in groups.items():
        outcomes = Counter(record["outcome"] for record in group)
        rows, described = summary(group), f"{outcomes['described']} of {len(group)}"
        print(f"\n## {name[0]}, in {name[1]}, departures: {name[2]}\n")
        print(f"{described} described, {dict(outcomes)}\n")
        table(heads, rows)
        for record in group:
            if record["outcome"] != "described":
                print(f"  {record['number']}: {record['reason'][:150]}")
        by_range = " ".join(row[5] for row in rows[:-1])
        every.append([*name, described, rows[-1][5], by_range, rows[-1][4], rows[2][2]])
    print("\n## all of them\n")
    heads = ["data", "medium", "departures", "described", "inside", "by range", "over stated"]
    table([*heads, "error made, 800–1000 K"], every)


def check(fineness: float) -> None:
    """Print how far levers without departures are off hotlever's, in currents and temperatures."""
    from hotlever import Lever as OurLever
    from hotlever import Probe

    rows = []
    shapes = ("three-leg", Probe.reference()), ("u-shape", Probe.u_shape())
    for (shape, probe), size in product(shapes, dict.fromkeys((1.0, fineness))):
        for medium in MEDIA:
            lever = Lever(shape, NOMINAL[shape], in_air=medium == "air", fineness=size)
            sweep = lever.sweep(ENDS_K[1], HIGHEST_V[medium])
            bias = np.linspace(1.0, sweep.bias_V[-1], 30)
            current, reader, tip = sweep.at(bias)
            ours = OurLever(probe.in_medium(medium)).sweep(bias)
            apart = [np.abs(current / ours.current_mA.values - 1.0).max()]
            if "reader_V" in ours:
                apart.append(np.abs(reader / ours.reader_V.values - 1.0).max())
            cells = [f"{value:.1e}" for value in apart] + [""] * (2 - len(apart))
            kelvin = np.abs(tip - ours.tip_K.values).max()
            rows.append([shape, medium, f"{fineness:g}", *cells, f"{kelvin:.2f}", f"{tip[-1]:.0f}"])
    heads = [
        "lever",
        "medium",
        "fineness",
        "I_h (relative)",
        "V_r (relative)",
        "T_tip (K)",
        "up to (K)",
    ]
    table(heads, rows)


def the_papers(options: list[str]) -> None:
    """Print what calibrations say of the paper's lever, beside its measured law, Eq. 12.

    Its current and reader's voltage are those that the parameters of option II describe.
    """
    from hotlever import Lever as OurLever
    from hotlever import Probe
    from hotlever.estimate.power_law import EQ12
    from hotlever.spieser2017 import POWER_LAW_SPREAD_K, PUBLISHED_VALUES

    lever = OurLever(Probe.reference().with_(**PUBLISHED_VALUES["option II"]))
    ramp = lever.sweep(np.linspace(0.1, 11.0, 110))
    end = np.interp(4.2, ramp.power_mW.values, ramp.bias.values)
    shown = lever.sweep(np.linspace(end / ROWS, end, ROWS))
    columns = (shown[name].values for name in ("bias", "current_mA", "reader_V"))
    lines = [",".join(f"{cell:.7g}" for cell in row) for row in zip(*columns, strict=True)]
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "iv.csv").write_text("\n".join(["V_b (V),I_h (mA),V_r (V)", *lines]))
        words = ["calibrate", "iv.csv", "-o", "out.json", *options]
        subprocess.run([sys.executable, "-m", "hotlever", *words], cwd=folder, check=False)
        table_ = json.loads(Path(folder, "out.json").read_text())["table"]
    power, tip, low, high = (
        np.array([row[name] for row in table_], dtype=float)
        for name in ("power_mW", "tip_K", "tip_low_K", "tip_high_K")
    )
    for mW in (1.0, 2.0, 3.0, 4.0):
        T, down, up = (float(np.interp(mW, power, each)) for each in (tip, low, high))
        law = float(EQ12.tip_temperature(mW))
        stated = (T - down if law < T else up - T) / BAND
        own = np.hypot(stated, POWER_LAW_SPREAD_K)
        rows.append(
            [f"{mW:g}", f"{law:.0f}", f"{T:.0f}", f"{stated:.0f}", f"{(T - law) / own:+.1f}"]
        )
    heads = ["P_l (mW)", "Eq. 12 (K)", "calibrated (K)", "stated (K)"]
    table([*heads, f"off, in stated and ± {POWER_LAW_SPREAD_K:g} K"], rows)


def of_record(record: dict[str, Any]) -> tuple[Any, ...]:
    """Return the fields of the task that a record is of."""
    return tuple(record[name] for name in Task.__dataclass_fields__)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("levers", nargs="?", type=int, default=14)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--families", default="all")
    parser.add_argument("--kinds", default="current")
    parser.add_argument("--media", default="vacuum")
    parser.add_argument("--options", default="", help="more words for hotlever calibrate")
    parser.add_argument("--fineness", type=float, default=1.0)
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--coarse", action="store_true")
    parser.add_argument("--told", action="store_true")
    parser.add_argument("--results", type=Path)
    parser.add_argument("--write", type=Path, metavar="DIR")
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--paper", action="store_true")
    told = parser.parse_args()
    if told.check:
        return check(told.fineness)
    if told.paper:
        return the_papers(shlex.split(told.options))
    families = FAMILIES if told.families == "each" else told.families.split(",")
    tasks = [
        Task(number, family, medium, kind, knows)
        for knows in ((False, True) if told.told else (False,))
        for family in families
        for medium in told.media.split(",")
        for number in range(told.first, told.first + told.levers)
        for kind in told.kinds.split(",")
        if kind != "reader" or number % 2 == 0  # a U-shape has no reader
    ]
    records = []
    if told.results and told.results.exists():
        records = [json.loads(line) for line in told.results.read_text().splitlines()]
    done = {of_record(record) for record in records}
    groups: dict[tuple[int, str, str], list[Task]] = {}
    for task in tasks:
        if astuple(task) not in done:
            groups.setdefault((task.number, task.family, task.medium), []).append(task)
    if told.write:
        return write(told.write, list(groups.values()))
    with ProcessPoolExecutor(told.processes, get_context("spawn")) as pool:
        how = {"fineness": told.fineness, "coarse": told.coarse}
        judged_so = partial(judge, options=shlex.split(told.options), **how)
        for found in pool.map(judged_so, groups.values()):
            records += found
            for record in found:
                words = " ".join(map(str, of_record(record)))
                print(f"{words}: {record['outcome']}", file=sys.stderr, flush=True)
                if told.results:
                    with told.results.open("a") as file:
                        file.write(json.dumps(record) + "\n")
    asked = {astuple(task) for task in tasks}
    report([r for r in records if of_record(r) in asked])
    return None


def write(folder: Path, groups: list[list[Task]]) -> None:
    """Write data, probe files and the truth of levers, to try the command line."""
    folder.mkdir(parents=True, exist_ok=True)
    for tasks in groups:
        number, family, medium = tasks[0].number, tasks[0].family, tasks[0].medium
        lever = foreign_lever(number, family, medium)
        hottest = np.random.default_rng((number, 2)).uniform(*ENDS_K)
        sweep = lever.sweep(hottest, HIGHEST_V[medium])
        name = f"{family}-{medium}-{number}"
        (folder / f"{name}.toml").write_text(owners_probe(lever.shape, medium))
        states = np.column_stack([sweep.bias_V, *sweep.rows])
        np.savetxt(folder / f"{name}-true.csv", states, "%.7g", ",", header="V_b,I_h,V_r,T_tip")
        for task in tasks:
            text, _ = measured(task, sweep, lever.base_K)
            (folder / f"{name}-{task.kind}.csv").write_text(text)


if __name__ == "__main__":
    main()
