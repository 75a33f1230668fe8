"""What whole commands cost, beside those of another version: processor seconds, cache empty.

Each command is run by both versions in turn, some rounds of all; printed are the medians, and their
ratio to the other version's sweep command in the same run, which tells machines and their load
apart from the code. The other version is its source folder, as in a worktree of git::

    git worktree add ../hotlever-2.0.0 cd69493f
    python benchmarks/commands.py --beside ../hotlever-2.0.0/src [--rounds 5] [NAME ...]

Without another version the ratios are those to this one's sweep command.
"""

from __future__ import annotations

import argparse
import shlex
import sys
import tempfile
from pathlib import Path
from statistics import median

import hotlever
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
    "calibrate in air": "calibrate {examples}/lever-a.csv --medium air -o out.json",
    "pulse": "pulse --pulse 8V,5us -o out.csv",
    "pulse in air": "pulse --medium air --pulse 8V,5us -o out.csv",
    "reader, 120 µm": "reader {examples}/uiuc-lever.toml --distance 1um --bias 4 -o out.csv",
    "small signals": "spectrum --bias 6V -o out.csv",
    "spectra": "raman {examples}/raman/tip --calibrate-from {examples}/raman/hot-plate -o out.csv",
}


def seconds(name: str, source: Path) -> float:
    """Return the processor seconds of a command by the version in a folder."""
    words = shlex.split(COMMANDS[name].format(examples=EXAMPLES))
    with tempfile.TemporaryDirectory() as folder:
        cache = Path(folder, "cache")
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


if __name__ == "__main__":
    main()
