"""Ten performance numbers, kept as a series, so that a loss is seen.

Each is the processor time of a whole command with an empty cache, over that of a yardstick in the
same round: twenty factorisations of one sparse matrix by SciPy. So numbers of different machines
can be compared; medians of some rounds. Beside them stands what the last line of ``series.csv``
has, and by how much more or less it is now. ``--keep`` adds a line, which is done for a release.

Run: python benchmarks/series.py [--keep] [ROUNDS]
"""

from __future__ import annotations

import csv
import datetime
import shlex
import sys
import tempfile
from pathlib import Path
from statistics import median

import hotlever
from problems import processor_seconds, run_python, table

SERIES = Path(__file__).with_suffix(".csv")
EXAMPLES = Path(hotlever.__file__).parent / "examples"
YARDSTICK = """
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


def main(keep: bool, rounds: int) -> None:
    ratios: dict[str, list[float]] = {name: [] for name in MEASURED}
    for _ in range(rounds):
        yardstick = measured(["-c", YARDSTICK])
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
    numbers = [int(word) for word in sys.argv[1:] if word != "--keep"]
    main("--keep" in sys.argv, *(numbers or [3]))
