"""What each command costs: processor seconds of a process of its own, the cache empty at first.

How much of it is start-up says a second table: the import of the lever, and a whole sweep, beside
the import of what nothing can do without, each several times in turn. Python's compiled modules
count as there: where PYTHONDONTWRITEBYTECODE is set, hotlever's own are compiled each time.

Run: python benchmarks/commands.py
"""

from __future__ import annotations

import shlex
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from statistics import median

from problems import processor_seconds, run_python, table

EXAMPLES = Path(__file__).parents[1] / "src" / "hotlever" / "examples"
COMMANDS = """
probe new -o probe.toml
probe show probe.toml --plot probe.png
sweep probe.toml --bias 1:11:25 -o sweep.csv --plot sweep.png
sweep --medium air --bias 2:10:5 -o air.csv
sweep --medium air --bias 2:10:5 --set n_d=4e17 -o again.csv
pulse --pulse 8V,5us -o pulse.csv
fit {examples}/lever-a.csv -o fit.json --report fit
calibrate {examples}/lever-a.csv -o calibration.json --plot calibration.png
raman {examples}/raman/tip --calibrate-from {examples}/raman/hot-plate
"""
#: What start-up is compared with, and of what, by Python's arguments; and how often each runs.
LEAST = ("-c", "import numpy, scipy.sparse.linalg")
STARTING = (
    ("-c", "import hotlever; hotlever.Lever"),
    ("-m", "hotlever", "sweep", "--bias", "1:11:25", "-o", "sweep.csv"),
)
ROUNDS = 7


def main() -> None:
    rows = []
    with tempfile.TemporaryDirectory() as folder:

        def seconds(arguments: Sequence[str]) -> float:
            return processor_seconds(lambda: run_python(arguments, folder, Path(folder, "cache")))

        for line in COMMANDS.strip().splitlines():
            words = shlex.split(line.format(examples=EXAMPLES))
            used = seconds(["-m", "hotlever", *words])
            rows.append((line.format(examples="examples"), f"{used:.1f}"))
            print(f"{used:6.1f} s  {line}", file=sys.stderr, flush=True)
        rounds = [[seconds(arguments) for arguments in (LEAST, *STARTING)] for _ in range(ROUNDS)]
    table(("command", "processor seconds"), rows)
    medians = [median(used) for used in zip(*rounds, strict=True)]
    starts = [
        (shlex.join(arguments), f"{used:.2f}", f"{used / medians[0]:.1f}")
        for arguments, used in zip((LEAST, *STARTING), medians, strict=True)
    ]
    table(("python", "processor seconds", "ratio"), starts)


if __name__ == "__main__":
    main()
