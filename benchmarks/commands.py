"""What each command costs: processor seconds of a process of its own, the cache empty at first.

Run: python benchmarks/commands.py
"""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path
from resource import RUSAGE_CHILDREN, getrusage

from hotlever.cache import CACHE_VARIABLE
from problems import table

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


def main() -> None:
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        surroundings = {**os.environ, CACHE_VARIABLE: str(Path(folder, "cache"))}
        for line in COMMANDS.strip().splitlines():
            words = shlex.split(line.format(examples=EXAMPLES))
            before = getrusage(RUSAGE_CHILDREN)
            command = [sys.executable, "-m", "hotlever", *words]
            subprocess.run(command, cwd=folder, env=surroundings, check=True, capture_output=True)
            after = getrusage(RUSAGE_CHILDREN)
            used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
            rows.append((line.format(examples="examples"), f"{used:.1f}"))
            print(f"{used:6.1f} s  {line}", file=sys.stderr, flush=True)
    table(("command", "processor seconds"), rows)


if __name__ == "__main__":
    main()
