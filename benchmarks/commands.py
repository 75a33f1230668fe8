"""What whole commands cost: processor seconds, all caches empty.

    python benchmarks/commands.py [--beside FOLDER] [--rounds 5] [NAME ...]
    python benchmarks/commands.py series [--keep] [ROUNDS]

The first compares two versions. Each command is run by both in turn, some rounds of all; printed
are the medians, and their ratio to the other version's sweep command in the same run, which tells
machines and their load apart from the code. The other version is its source folder, as in a
worktree of git::

    git worktree add ../hotlever-2.0.0 cd69493f
    python benchmarks/commands.py --beside ../hotlever-2.0.0/src [--rounds 5] [NAME ...]

Without another version the ratios are those to this one's sweep command.

The second keeps ten performance numbers as a series, so that a loss is seen. Each is the processor
time of a whole command over that of twenty factorisations of one sparse matrix by SciPy in the same
round, so that numbers of different machines can be compared; medians of some rounds. Beside them
stands what the last line of ``series.csv`` has, and by how much more or less it is now. ``--keep``
adds a line, which is done for a release.
"""

from __future__ import annotations

import argparse
import csv
import datetime
import json
import shlex
import sys
import tempfile
from pathlib import Path
from statistics import median

import hotlever
from frozen_cases import STORED
from problems import processor_seconds, run_python, table

SOURCE = Path(hotlever.__file__).parents[1]
EXAMPLES = SOURCE / "hotlever" / "examples"
#: The command that the others are compared with.
YARDSTICK = "sweep"
COMMANDS = {
    YARDSTICK: "sweep --bias 1:11:25 -o out.csv",
    "sweep in air": "sweep --medium air --bias 1:11:25 -o out.csv",
    "fit": "fit {examples}/lever-a.csv -o out.json",
    "calibrate": "calibrate {examples}/lever-a.csv -o out.json",
    "calibrate in air": "calibrate {air} --medium air -o out.json",
    "pulse": "pulse --pulse 8V,5us -o out.csv",
    "pulse in air": "pulse --medium air --pulse 8V,5us -o out.csv",
    "reader, 120 µm": "reader {examples}/uiuc-lever.toml --distance 1um --bias 4 -o out.csv",
    "small signals": "spectrum --bias 6V -o out.csv",
    "spectra": "raman {examples}/raman/tip --calibrate-from {examples}/raman/hot-plate -o out.csv",
}


def seconds(name: str, source: Path) -> float:
    """Return the processor seconds of a command by the version in a folder."""
    with tempfile.TemporaryDirectory() as folder:
        cache, air = Path(folder, "cache"), Path(folder, "air.csv")
        air.write_text("\n".join(json.loads(STORED.read_text())["data"]["twin-air.csv"]) + "\n")
        words = shlex.split(COMMANDS[name].format(examples=EXAMPLES, air=air))
        return processor_seconds(
            lambda: run_python(["-m", "hotlever", *words], folder, cache, source)
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(COMMANDS)}")
    parser.add_argument("--beside", type=Path, help="source folder of another version")
    parser.add_argument("--rounds", type=int, default=5)
    asked = parser.parse_args()
    if unknown := set(asked.names) - set(COMMANDS):
        parser.error(f"found {sorted(unknown)}, expected names of {list(COMMANDS)}")
    sources = [SOURCE, *([asked.beside.resolve()] if asked.beside else [])]
    names = dict.fromkeys([YARDSTICK, *(asked.names or COMMANDS)])
    used: dict[str, list[list[float]]] = {name: [[] for _ in sources] for name in names}
    for number in range(asked.rounds):
        for name, by_source in used.items():
            for times, source in zip(by_source, sources, strict=True):
                times.append(seconds(name, source))
            last = ", ".join(f"{times[-1]:.2f}" for times in by_source)
            print(f"round {number + 1}  {name}: {last} s", file=sys.stderr, flush=True)
    medians = {name: [median(times) for times in by_source] for name, by_source in used.items()}
    yardstick = medians[YARDSTICK][-1]
    rows = [
        (
            name,
            *(f"{time:.2f}" for time in times),
            *(f"{time / yardstick:.2f}" for time in times),
        )
        for name, times in medians.items()
    ]
    versions = ["this", "other"][: len(sources)]
    columns = [f"{name}{what}" for what in (" (s)", " / sweep") for name in versions]
    table(("command", *columns), rows)


# --- the series ----------------------------------------------------------------------------------

SERIES = Path(__file__).with_name("series.csv")
FACTORISATIONS = """
import scipy.sparse as sparse
from scipy.sparse.linalg import splu

line = sparse.diags_array([-1.0, 2.0, -1.0], offsets=[-1, 0, 1], shape=(150, 150))
one = sparse.eye_array(150)
plane = (sparse.kron(line, one) + sparse.kron(one, line)).tocsc()
for _ in range(20):
    splu(plane)
"""
#: What is measured: a name, and the arguments of Python.
MEASURED = {
    "import": "-c 'import hotlever; hotlever.Lever'",
    "sweep": "-m hotlever sweep --bias 1:11:25 -o out.csv",
    "sweep in air": "-m hotlever sweep --medium air --bias 1:11:25 -o out.csv",
    "thermoelectric sweep": "-m hotlever sweep --physics thermoelectric --bias 1:11:25 -o out.csv",
    "pulse": "-m hotlever pulse --pulse 8V,5us -o out.csv",
    "small signals": "-m hotlever spectrum --bias 6V -o out.csv",
    "contact": "-m hotlever contact --sample polymer,100nm,silicon --radius 5nm -o out.csv",
    "fit": "-m hotlever fit {examples}/lever-a.csv -o out.json",
    "calibration": "-m hotlever calibrate {examples}/lever-a.csv -o out.json",
    "spectra": "-m hotlever raman {examples}/raman/tip "
    "--calibrate-from {examples}/raman/hot-plate -o out.csv",
}


def measured(arguments: list[str]) -> float:
    """Return the processor seconds of Python with these arguments, all caches empty."""
    with tempfile.TemporaryDirectory() as folder:
        return processor_seconds(lambda: run_python(arguments, folder, Path(folder, "cache")))


def series(keep: bool, rounds: int) -> None:
    ratios: dict[str, list[float]] = {name: [] for name in MEASURED}
    for _ in range(rounds):
        yardstick = measured(["-c", FACTORISATIONS])
        for name, line in MEASURED.items():
            used = measured(shlex.split(line.format(examples=EXAMPLES)))
            ratios[name].append(used / yardstick)
            print(f"{used:6.2f} s  {used / yardstick:6.2f}  {name}", file=sys.stderr, flush=True)
    now = {name: median(values) for name, values in ratios.items()}
    with SERIES.open(newline="") as file:
        kept = list(csv.DictReader(file))
    last = kept[-1] if kept else {}
    rows = []
    for name, value in now.items():
        before = float(last[name]) if last else None
        compared = (f"{before:.2f}", f"{value / before - 1:+.0%}") if before else ("", "")
        rows.append((name, f"{value:.2f}", *compared))
    table(("command", "yardsticks", f"{last.get('version', '')} {last.get('date', '')}", ""), rows)
    if keep:
        line = {"date": datetime.date.today().isoformat(), "version": hotlever.__version__}
        with SERIES.open("a", newline="") as file:
            writer = csv.DictWriter(file, [*line, *MEASURED])
            if not kept:
                writer.writeheader()
            writer.writerow(line | {name: f"{value:.3f}" for name, value in now.items()})


if __name__ == "__main__":
    if sys.argv[1:2] == ["series"]:
        numbers = [int(word) for word in sys.argv[2:] if word != "--keep"]
        series("--keep" in sys.argv, *(numbers or [3]))
    else:
        main()
