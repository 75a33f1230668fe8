"""Calibrations of levers never seen: how wrong they are, and how honest their bands.

How levers are simulated and judged: `hotlever.studies.simulation_based_calibration`. Each is solved
with a richer model than the one that calibrates it, and measured in 40 points, the current with
0.2 % of noise, unless --noise states another share.

Run: python benchmarks/twins.py [LEVERS] [vacuum|air] [iv|reader|raman] [--noise SHARE]
                          [--without DEPARTURE ...]
     python benchmarks/twins.py [LEVERS] all      every medium and kind of data

With --wild, levers of which the owner knows little, and says so (`little_known_levers`):

     python benchmarks/twins.py --wild [--count N] [--first K] [--medium vacuum|air]
                                [--results FILE] [--write DIR]

With --results a line for each of them is appended to a file, and an interrupted run goes on with
those that are not in it. With --write the data and probe file of each, and the true lever's, are
written instead, to try the command line: hotlever calibrate DIR/wild-3.csv --probe DIR/wild-3.toml
"""

from __future__ import annotations

import argparse
import json
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from hotlever.errors import HotleverError
from hotlever.studies.simulation_based_calibration import (
    DEPARTURES,
    HIGHEST_V,
    KINDS,
    LEVELS,
    NOISE,
    concatenated,
    coverage_by_decile,
    judge,
    summary,
)
from little_known_levers import (
    CONTRADICTED,
    DESCRIBED,
    FAILED,
    NOT_CONVERGED,
    judge_little_known,
    little_known_lever,
)
from problems import table


def judged(
    number: int, medium: str, what: str, departures: list[str], noise: float
) -> xr.Dataset | str:
    """Judge the calibration of a lever; the reason in words if there is none of that number."""
    try:
        return judge(number, medium, what, departures, noise)
    except HotleverError as error:
        return str(error)


def report(results: list[xr.Dataset | str], title: str) -> None:
    answers = concatenated([result for result in results if not isinstance(result, str)])
    total = summary(answers)
    refused = answers.isel(lever=(answers.refused != "").values)
    print(f"\n## {title}\n\n{total.answered} levers answered, {refused.sizes['lever']} refused")
    for number in refused.lever.values[:5]:
        print(f"  refused: {number}: {refused.refused.sel(lever=number).item()}")
    for reason in [result for result in results if isinstance(result, str)][:5]:
        print(f"  no lever: {reason}")
    print(f"said not to be described: {int((answers.doubted != '').sum())}\n")
    rows = [
        (way, *(f"{value:.1f}" for value in total.largest_K.sel(way=way).values))
        for way in total.way.values
    ]
    table(("largest error above 400 K (K)", "median", "90 %", "worst"), rows)
    print(f"\npooled rms of error / stated: {total.rms:.2f}")
    print(f"levers within 2 stated errors everywhere: {total.everywhere:.0%}")
    print_coverage(total.coverage.values)
    seconds = answers.seconds.values
    print(f"seconds of processor: median {np.median(seconds):.1f}, worst {seconds.max():.1f}")


def print_coverage(coverage: np.ndarray) -> None:
    """Print what the bands hold, (levels, deciles)."""
    for level, shares in zip(LEVELS, coverage, strict=True):
        by_decile = " ".join(f"{share:.0%}" for share in shares)
        print(f"the {level:.0%} band holds {shares.mean():.0%}, by decile of bias: {by_decile}")


def two_at_a_time(judged: Callable[[int], Any], numbers: list[int]) -> Iterator[Any]:
    """Judge levers on two processes; give each when it is done."""
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        running = [pool.submit(judged, number) for number in numbers]
        for done, future in enumerate(as_completed(running), start=1):
            print(f"{done} of {len(numbers)}", file=sys.stderr)
            yield future.result()


def main(count: int, medium: str, what: str, departures: list[str], noise: float) -> None:
    judge_one = partial(judged, medium=medium, what=what, departures=departures, noise=noise)
    results = list(two_at_a_time(judge_one, [*range(count)]))
    without = [name for name in DEPARTURES if name not in departures]
    ending = f", without {', '.join(without)}" if without else ""
    report(results, f"{medium}, {what}, noise of {noise:g}{ending}")


# --- levers of which little is known -------------------------------------------------------------


def judged_wild(number: int, medium: str | None) -> dict[str, Any]:
    """Judge a lever of which little is known; without one of that number, say why."""
    try:
        record = judge_little_known(number, medium)
    except HotleverError as error:
        record = {"lever": number, "outcome": "no lever", "reason": str(error)}
    return record | {"asked_for": medium}


def wild(numbers: list[int], medium: str | None, results: Path | None) -> None:
    """Judge levers of which little is known, unless in the file of results, and sum all up."""
    lines = results.read_text().splitlines() if results and results.exists() else []
    records = {
        record["lever"]: record
        for record in map(json.loads, lines)
        if record["lever"] in numbers and record["asked_for"] == medium
    }
    missing = [number for number in numbers if number not in records]
    for record in two_at_a_time(partial(judged_wild, medium=medium), missing):
        records[record["lever"]] = record
        if results:
            with results.open("a") as file:
                file.write(json.dumps(record) + "\n")
    report_wild([records[number] for number in numbers], f"wild, {medium or 'vacuum and air'}")


def report_wild(records: list[dict[str, Any]], title: str) -> None:
    of = {
        outcome: [record for record in records if record["outcome"] == outcome]
        for outcome in (DESCRIBED, CONTRADICTED, NOT_CONVERGED, FAILED, "no lever")
    }
    print(f"\n## {title}\n")
    rows = []
    for record in records:
        answer = ["", "", ""]
        if record.get("off_K"):
            off, stated = np.abs([record["off_K"], record["stated_K"]])
            at = int(np.argmax(off))
            # of data that are not described no error may be stated
            most = [stated[at], np.max(off / stated)] if np.isfinite(stated).all() else []
            answer[: 1 + len(most)] = [f"{value:.1f}" for value in (off[at], *most)]
        if record in of["no lever"]:
            rows.append([record["lever"], *[""] * 10, record["reason"][:60]])
            continue
        own = [record[name] for name in ("lever", "shape", "medium", "rows")]
        data = "picture" if record["digitised"] else "noise"
        end = f"{record['end_K']:.0f}{' <' * record['below_knee']}{' J' * record['jumps']}"
        what = f"{record['exception'] or record['outcome']}: {record['reason']}"[:90].rstrip(": ")
        doping, seconds = f"{record['n_d']:.1e}", f"{record['seconds']:.1f}"
        rows.append([*own, doping, data, end, *answer, seconds, what])
    heads = ["lever", "shape", "medium", "rows", "n_d", "data", "end (K)"]
    table([*heads, "off (K)", "stated (K)", "most stated errors", "s", "what happened"], rows)
    print("<: stops below the knee; J: beyond a jump of the ramp\n")
    judged = [record for record in records if record not in of["no lever"]]
    if not judged:
        return
    rows = [
        (outcome, f"{len(of[outcome])} of {len(judged)}", f"{len(of[outcome]) / len(judged):.1%}")
        for outcome in (DESCRIBED, CONTRADICTED, NOT_CONVERGED, FAILED)
    ]
    table(("what happened", "levers", "share"), rows)
    kinds = Counter(record["exception"] for record in of[FAILED])
    print("\nerrors by type:", ", ".join(f"{n} {kind}" for kind, n in kinds.items()) or "none")
    repeated = sum(record["repeated"] for record in judged)
    print(f"levers drawn anew because they could not be drawn, meshed or solved: {repeated}")
    seconds = [record["seconds"] for record in judged]
    print(f"seconds of processor: median {np.median(seconds):.1f}, worst {max(seconds):.1f}")
    if not of[DESCRIBED]:
        return
    print(f"\nof the {len(of[DESCRIBED])} described:")
    off = [np.abs(record["off_K"]) for record in of[DESCRIBED]]
    stated = [np.array(record["stated_K"]) for record in of[DESCRIBED]]
    ratios = [error / band for error, band in zip(off, stated, strict=True)]
    print_coverage(coverage_by_decile(ratios))
    largest = [float(error.max()) for error in off]
    there = [float(band[np.argmax(error)]) for error, band in zip(off, stated, strict=True)]
    print(f"largest error: median {np.median(largest):.1f} K, worst {max(largest):.1f} K")
    print(f"stated there: median {np.median(there):.1f} K")
    most = [float(ratio.max()) for ratio in ratios]
    print(f"largest error in stated errors: median {np.median(most):.1f}, worst {max(most):.1f}")


def write(numbers: list[int], medium: str | None, folder: Path) -> None:
    """Write levers of which little is known: measurement, the owner's probe, the true one."""
    folder.mkdir(parents=True, exist_ok=True)
    for number in numbers:
        lever = little_known_lever(number, medium)
        name = f"wild-{number}"
        (folder / f"{name}.csv").write_text(lever.measurement_csv())
        lever.nominal.to_file(folder / f"{name}.toml")
        lever.true.to_file(folder / f"{name}-true.toml")
        print(folder / f"{name}.csv")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("levers", nargs="?", type=int, default=200)
    parser.add_argument("medium", nargs="?", choices=(*HIGHEST_V, "all"), default="vacuum")
    parser.add_argument("what", nargs="?", choices=KINDS, default="iv")
    listed = "\n".join(f"{name}: {meaning}" for name, meaning in DEPARTURES.items())
    listed = listed.replace("%", "%%")  # argparse formats its help
    parser.add_argument("--without", nargs="+", choices=DEPARTURES, default=[], help=listed)
    parser.add_argument("--noise", type=float, default=NOISE, help="of meters, a share")
    parser.add_argument("--wild", action="store_true", help="levers of which little is known")
    parser.add_argument("--count", type=int, default=200, help="of levers of which little is known")
    parser.add_argument("--first", type=int, default=0, help="number of the first of them")
    parser.add_argument("--medium", dest="around", choices=[*HIGHEST_V], help="of all of them")
    parser.add_argument("--results", type=Path, metavar="FILE", help="one line for each of them")
    parser.add_argument("--write", type=Path, metavar="DIR", help="their data, not judged")
    given = parser.parse_args()
    if given.wild:
        numbers = [*range(given.first, given.first + given.count)]
        if given.write:
            write(numbers, given.around, given.write)
        else:
            wild(numbers, given.around, given.results)
        sys.exit()
    chosen = [name for name in DEPARTURES if name not in given.without]
    everything = [(medium, what) for medium in HIGHEST_V for what in KINDS]
    for medium, what in everything if given.medium == "all" else [(given.medium, given.what)]:
        main(given.levers, medium, what, chosen, given.noise)
