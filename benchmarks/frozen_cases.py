"""Some forty cases whose results must not move when code does: temperatures, errors, parameters.

    python benchmarks/frozen_cases.py                        compare with frozen_cases.json
    python benchmarks/frozen_cases.py pulse contact          only cases whose names begin so
    python benchmarks/frozen_cases.py --options 'calibrate: --laws paper'
    python benchmarks/frozen_cases.py --write                take what is found now as what must be

Each case is a command line of its own in an empty folder, so that no code stands between: what is
compared is in the files that it writes. A value is the same if it is within 0.2 of its stated error
of what it was, the stated error itself too; where no error is stated, if it is within 0.02 K or
1e-5 of the largest value of its column. Data of levers that are made up are kept beside the values,
so that they do not move with what made them. The exit status is 1 if anything moved.
"""

from __future__ import annotations

import argparse
import csv
import json
import math
import os
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from hotlever.cache import CACHE_VARIABLE
from problems import processor_time, table

STORED = Path(__file__).with_suffix(".json")
EXAMPLES = Path(__file__).parents[1] / "src" / "hotlever" / "examples"
#: How far a value may be from what it was: of its stated error; in kelvin; of its column.
OF_ERROR, KELVIN, RELATIVE = 0.2, 0.02, 1e-5
#: Rows that are kept of a table.
ROWS = 5

#: What is asked, by case: a command line, or several that end in the one whose file is compared.
#: Its file is that of -o. {examples} is the folder of the examples, {data} that of stored data.
CASES = {
    "sweep published III": "sweep --bias 1:11:41",
    "sweep published I": "sweep --set n_d=4.10e17 --set p=2.64 --set c_kappa=0.68",
    "sweep published II": "sweep --set n_d=6.87e17 --set p=2.80 --set delta=0.7",
    "sweep operating points": "sweep --bias 7.22:10.748:3",
    "sweep U-shape": "sweep {data}/u-shape.toml --bias 1:11:25",
    "sweep air": "sweep --medium air --bias 1:13:25",
    "sweep air over a surface": "sweep --medium air --set surface_gap_um=0.5 --set chip=true "
    "--set accommodation=0.9 --bias 8",
    "sweep thermoelectric": "sweep --physics thermoelectric --bias=-8:8:9",
    "sweep radiation": "sweep {examples}/palladium-on-nitride.toml --physics radiation "
    "--bias 0.1:0.7:7",
    "sweep boron": "sweep {examples}/boron-lever.toml --bias 1:6:6",
    "sweep bridge": "sweep {examples}/bridge.toml --bias 1:11:11",
    "sweep tip": "sweep --set tip.height_um=0.7 --set tip.half_angle_deg=20 --bias 2:10:5",
    "sweep held resistance": "sweep --hold-resistance 2kohm,2.5kohm,3kohm",
    "sweep held power": "sweep --hold-power 1mW:4mW:7",
    "sweep drawn": "probe import {examples}/reference-probe.gds -o drawn.toml && "
    "sweep drawn.toml --bias 1:11:25",
    "pulse": "pulse --pulse 8V,5us --at 1us,5us,10us,30us",
    "pulse step": "pulse --step 4V --at 0.1us,1us,2us,5us,10us,20us,50us,100us,200us",
    "pulse air": "pulse --medium air --pulse 8V,5us --at 1us,5us,10us,30us",
    "pulse train": "pulse --pulse 8V,5us --period 30us --count 20 --at 100us,560us,600us",
    "pulse sine": "pulse --sine 3V+0.5V@20kHz --until 120us --at 60us,80us,100us,120us",
    "spectrum": "spectrum --bias 6 --frequency 10Hz:1MHz:6",
    "spectrum harmonics": "spectrum --bias 6 --frequency 1kHz --amplitude 0.5",
    "contact polymer": "contact --sample polymer,100nm,silicon --radius 5nm --bias 2:8:4",
    "contact silicon": "contact --sample silicon --radius 20nm --interface 1e7K/W --bias 2:10:5",
    "reader": "reader --distance 0.5um:0.5um:1 --bias 8",
    "raman anharmonic": "raman {examples}/raman/tip --calibrate-from {examples}/raman/hot-plate",
    "raman linear": "raman {examples}/raman/tip --calibrate-from {examples}/raman/hot-plate "
    "--law linear",
    "design": "design --vary heater_width_um=1:2.5:3",
    "fit lever A": "fit {examples}/lever-a.csv",
    "fit lever B": "fit {examples}/lever-b.csv",
    "fit current alone": "fit {examples}/lever-a.csv --observables current --fix a1",
    "fit in time": "fit {data}/pulse.csv --pulse 9V,20us --fix c_kappa --fix p --fix a0 --fix a1 "
    "--fix delta --free n_d",
    "calibrate lever A": "calibrate {examples}/lever-a.csv",
    "calibrate lever B": "calibrate {examples}/lever-b.csv",
    "calibrate real curve": "calibrate {examples}/uiuc-lever.csv "
    "--probe {examples}/uiuc-lever.toml",
    "calibrate boron": "calibrate {examples}/boron-lever.csv --probe {examples}/boron-lever.toml",
    "calibrate film": "calibrate {examples}/palladium-on-nitride.csv "
    "--probe {examples}/palladium-on-nitride.toml",
    "calibrate bridge": "calibrate {examples}/bridge.csv --probe {examples}/bridge.toml",
    "calibrate power law": "calibrate {examples}/lever-a.csv -o first.json && "
    "calibrate {examples}/lever-b.csv --power-law first.json",
    "calibrate twin, current": "calibrate {data}/twin-current.csv",
    "calibrate twin, reader": "calibrate {data}/twin-reader.csv --probe {data}/u-shape.toml",
    "calibrate twin, air": "calibrate {data}/twin-air.csv --medium air",
    "calibrate twin, spectra": "calibrate {data}/twin-spectra.csv --probe {data}/u-shape.toml",
}
#: How the file of a command ends, where it is no table.
_ENDINGS = {"fit": ".json", "calibrate": ".json"}
#: What is compared of a calibration's table.
_TABLE = ("tip_K", "tip_stderr_K")


def run(command: str, folders: dict[str, str], work: Path, options: dict[str, str]) -> Path:
    """Run the command line of a case; return the file to compare."""
    output = work
    for line in command.split(" && "):
        words = shlex.split(line.format(**folders))
        words += shlex.split(options.get(words[0], ""))
        if "-o" in words:
            output = work / words[words.index("-o") + 1]
        else:
            output = work / f"result{_ENDINGS.get(words[0], '.csv')}"
            words += ["-o", output.name]
        done = subprocess.run(
            [sys.executable, "-m", "hotlever", *words], cwd=work, capture_output=True, text=True
        )
        if done.returncode:
            raise RuntimeError(done.stderr.strip().rpartition("\n")[2])
    return output


def some(values: list[Any]) -> list[Any]:
    """Return a few of many values, the first and the last among them."""
    if len(values) <= ROWS:
        return values
    return [values[round(k * (len(values) - 1) / (ROWS - 1))] for k in range(ROWS)]


def read(path: Path) -> dict[str, list[Any]]:
    """Return what a file says, by quantity: numbers of some rows, None where there is none."""
    if path.suffix == ".csv":
        lines = [line for line in path.read_text().splitlines() if not line.startswith("#")]
        rows = some(list(csv.DictReader(lines)))
        columns = {name: [number(row[name]) for row in rows] for name in rows[0]}
        return {name: column for name, column in columns.items() if any(column)}
    content = json.loads(path.read_text())
    if "table" in content:
        rows = some([row for row in content["table"] if row["tip_K"] is not None])
        found = {name: [number(row.get(name)) for row in rows] for name in _TABLE}
        if (content["knee"] or {}).get("tip_K") is not None:
            solved = [row for row in content["table"] if row["tip_K"] is not None]
            near = min(solved, key=lambda row: abs(row["tip_K"] - content["knee"]["tip_K"]))
            found["knee_K"] = [number(content["knee"]["tip_K"])]
            found["knee_stderr_K"] = [number(near["tip_stderr_K"])]
        for name, one in (content.get("priors") or {}).items():
            found[name] = [number(one["posterior_value"])]
            found[f"{name} stderr"] = [number(one["posterior_spread"])]
        return found
    found = {}
    for name, one in content["parameters"].items():
        found[name], found[f"{name} stderr"] = [number(one["value"])], [number(one["stderr"])]
    return found


def number(cell: Any) -> float | None:
    """Return a number with seven digits; None of what is none."""
    try:
        value = float(cell)
    except (TypeError, ValueError):
        return None
    return float(f"{value:.7g}") if math.isfinite(value) else None


def error_of(quantity: str, found: dict[str, list[Any]]) -> list[Any] | None:
    """Return the errors that are stated of a quantity, which are also those of its error."""
    kelvin = quantity.removesuffix("_K")
    names = (f"{quantity} stderr", f"{kelvin}_stderr_K", f"{kelvin}_error_K", quantity)
    stated = [name for name in names if name in found]
    is_error = any(word in stated[0] for word in ("stderr", "error"))
    return found[stated[0]] if is_error else None


def moved(before: dict[str, list[Any]], now: dict[str, list[Any]]) -> Iterator[tuple[float, str]]:
    """Give how far values are off, over what they may be, and in words."""
    for name, was in before.items():
        values = now.get(name)
        if values is None or len(values) != len(was):
            yield math.inf, f"{name}: not there as before"
            continue
        errors = error_of(name, before) or [None] * len(was)
        largest = max(abs(value or 0.0) for value in was)
        for old, new, error in zip(was, values, errors, strict=True):
            if (old is None) != (new is None):
                yield math.inf, f"{name}: {old} is {new}"
            elif old is not None:
                kelvin = name.endswith("_K")
                # a column may hold rounding alone, as of the power while a bias is off
                share = RELATIVE * (largest if largest > 1e-12 else 1.0)
                allowed = OF_ERROR * error if error else KELVIN if kelvin else share
                yield abs(new - old) / allowed, f"{name}: {old:g} is {new:g}"


def store(stored: dict[str, Any]) -> None:
    """Write what is stored, a line for each file of data and each case."""
    parts = []
    for part, content in stored.items():
        lines = [f"{json.dumps(name)}: {json.dumps(one)}" for name, one in content.items()]
        parts.append(f"{json.dumps(part)}: {{\n" + ",\n".join(lines) + "\n}")
    STORED.write_text("{" + ",\n".join(parts) + "}\n", encoding="utf-8")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("cases", nargs="*", help="how the names of some cases begin")
    parser.add_argument("--write", action="store_true", help="store what is found")
    parser.add_argument("--options", nargs="*", default=[], help="'COMMAND: what it is told too'")
    arguments = parser.parse_args()
    told = (text.partition(":") for text in arguments.options)
    options = {command.strip(): words for command, _, words in told}
    stored, first = json.loads(STORED.read_text()), tuple(arguments.cases or [""])
    rows, found = [], stored["cases"] if arguments.cases else {}
    with tempfile.TemporaryDirectory() as folder:
        data = Path(folder, "data")
        data.mkdir()
        for name, lines in stored["data"].items():
            (data / name).write_text("\n".join(lines) + "\n")
        os.environ[CACHE_VARIABLE] = str(Path(folder, "cache"))
        folders = {"examples": str(EXAMPLES), "data": str(data)}
        for name, command in CASES.items():
            if not name.startswith(first):
                continue
            work, began = Path(folder, name), processor_time()
            work.mkdir()
            try:
                now = read(run(command, folders, work, options))
                off, words = max(moved(stored["cases"].get(name, {}), now), default=(0.0, "new"))
                found[name] = now
            except RuntimeError as error:
                off, words = math.inf, str(error)
            seconds = processor_time() - began
            rows.append((name, f"{off:.3g}", words[:70], "moved" * (off > 1.0), f"{seconds:.1f}"))
            print(f"{seconds:6.1f} s  {off:9.3g}  {name}", file=sys.stderr, flush=True)
    table(("case", "off over allowed", "farthest off", "", "processor seconds"), rows)
    print(f"\n{len(rows)} cases, {sum(float(row[-1]) for row in rows):.0f} s of processor")
    if arguments.write:
        store({"data": stored["data"], "cases": {k: found[k] for k in CASES if k in found}})
        return 0
    return int(any(row[3] for row in rows))


if __name__ == "__main__":
    sys.exit(main())
