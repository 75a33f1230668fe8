"""Calibrations of levers never seen: how wrong they are, and how honest their bands.

How twins are made and judged: `hotlever.studies.twins`. Each is solved with a richer model than
the one that calibrates it, and measured in 40 points, the current with 0.2 % of noise.

Run: python benchmarks/twins.py [TWINS] [vacuum|air] [iv|reader|raman] [--without DEPARTURE ...]
     python benchmarks/twins.py [TWINS] all      every medium and kind of data
"""

from __future__ import annotations

import argparse
import sys
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context

import numpy as np
import xarray as xr

from hotlever.errors import HotleverError
from hotlever.studies.twins import (
    DEPARTURES,
    HIGHEST_V,
    KINDS,
    judge,
    summary,
    together,
)
from problems import table


def judged(number: int, medium: str, what: str, departures: list[str]) -> xr.Dataset | str:
    """Judge a twin; the reason in words if there is none of that number."""
    try:
        return judge(number, medium, what, departures)
    except HotleverError as error:
        return str(error)


def report(results: list[xr.Dataset | str], title: str) -> None:
    found = together([one for one in results if not isinstance(one, str)])
    total = summary(found)
    refused = found.isel(twin=(found.refused != "").values)
    print(f"\n## {title}\n\n{total.answered} twins answered, {refused.sizes['twin']} refused")
    for one in refused.twin.values[:5]:
        print(f"  refused: {one}: {refused.refused.sel(twin=one).item()}")
    for one in [one for one in results if isinstance(one, str)][:5]:
        print(f"  no twin: {one}")
    print(f"said not to be described: {int((found.doubted != '').sum())}\n")
    rows = [
        (way, *(f"{value:.1f}" for value in total.largest_K.sel(way=way).values))
        for way in total.way.values
    ]
    table(("largest error above 400 K (K)", "median", "90 %", "worst"), rows)
    print(f"\npooled rms of error / stated: {total.rms:.2f}")
    print(f"twins within 2 stated errors everywhere: {total.everywhere:.0%}")
    for level in total.level.values:
        shares = total.held.sel(level=level).values
        by_decile = " ".join(f"{share:.0%}" for share in shares)
        print(f"the {level:.0%} band holds {shares.mean():.0%}, by decile of bias: {by_decile}")
    seconds = found.seconds.values
    print(f"seconds of processor: median {np.median(seconds):.1f}, worst {seconds.max():.1f}")


def main(count: int, medium: str, what: str, departures: list[str]) -> None:
    one = partial(judged, medium=medium, what=what, departures=departures)
    results = []
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        for done, found in enumerate(pool.map(one, range(count)), start=1):
            results.append(found)
            print(f"{done} of {count}", file=sys.stderr)
    without = [name for name in DEPARTURES if name not in departures]
    ending = f", without {', '.join(without)}" if without else ""
    report(results, f"{medium}, {what}{ending}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("twins", nargs="?", type=int, default=200)
    parser.add_argument("medium", nargs="?", choices=(*HIGHEST_V, "all"), default="vacuum")
    parser.add_argument("what", nargs="?", choices=KINDS, default="iv")
    listed = "\n".join(f"{name}: {meaning}" for name, meaning in DEPARTURES.items())
    listed = listed.replace("%", "%%")  # argparse formats its help
    parser.add_argument("--without", nargs="+", choices=DEPARTURES, default=[], help=listed)
    given = parser.parse_args()
    chosen = [name for name in DEPARTURES if name not in given.without]
    everything = [(medium, what) for medium in HIGHEST_V for what in KINDS]
    for medium, what in everything if given.medium == "all" else [(given.medium, given.what)]:
        main(given.twins, medium, what, chosen)
