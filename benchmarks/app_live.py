"""What the app's pages Contact and Reader show while sliders move, beside what the commands give.

python benchmarks/app_live.py [contact|reader]

Times are of the processor, of a step after the first.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from contextlib import nullcontext
from typing import Any

from hotlever.app import approaching, touching
from hotlever.app.jobs import Task
from problems import table


class Silent:
    """A report that nobody hears."""

    def note(self, *_: str) -> None:
        """Say nothing."""

    def progress_bars(self, *labels: str) -> Any:
        """Show nothing."""
        return nullcontext(tuple(lambda done, total: None for _ in labels))

    def progress(self, _: str) -> Any:
        """Show nothing."""
        return nullcontext(lambda done, total: None)


REPORT: Any = Silent()


def timed(ask: Callable[[], dict[str, Any]]) -> tuple[float, dict[str, Any]]:
    """Return the processor seconds of an answer, and its numbers."""
    begin = time.process_time()
    answer = ask()
    return time.process_time() - begin, answer["now"]


def contact() -> None:
    """Print the moving contact beside the full one."""
    rows = []
    for medium in ("vacuum", "air"):
        for sample, radius, interface, bias in (
            ("polymer, 100nm, silicon", "20nm", "0K/W", 8.0),
            ("polymer, 100nm, silicon", "5nm", "0K/W", 8.0),
            ("polymer, 100nm, silicon", "5nm", "1e7K/W", 8.0),
            ("polymer, 100nm, silicon", "5nm", "1e7K/W", 8.1),
            ("SiO2, 300nm, silicon", "100nm", "0K/W", 8.1),
            ("silicon", "100nm", "0K/W", 8.1),
        ):
            options = {"medium": medium, "sample": sample, "radius": radius, "interface": interface}
            task = Task("contact", (), options)

            def ask(quick: bool, task: Task = task, bias: float = bias) -> dict[str, Any]:
                return touching.answer(REPORT, task, bias, 12.0, quick)

            seconds, moving = timed(lambda ask=ask: ask(True))
            full = ask(False)["now"]
            change, off = full["current_change_mA"], moving["current_change_mA"]
            tips = [f"{now[key]:.1f}" for key in ("tip_K", "apex_K") for now in (moving, full)]
            share = f"{100 * (off / change - 1):+.1f}"
            rows.append((medium, sample, radius, interface, bias, f"{seconds:.2f}", *tips, share))
    head = ("medium", "sample", "radius", "interface", "V", "s", "tip (K)", "full", "apex", "full")
    table((*head, "change of I_h, % off"), rows)


def reader() -> None:
    """Print what is read off between distances beside the full lever there."""
    rows = []
    for bias, z in ((9.0, 0.5), (9.0, 0.9), (10.0, 0.5), (11.0, 2.0), (6.0, 0.25), (4.0, 3.3)):
        options = {"distance": "0.2um:5um:10", "medium": "air", "bias": f"{bias}V"}
        ask = (REPORT, Task("reader", (), options), z)
        full = approaching.answer(*ask, False, None)
        again = (*ask, True, full["jump_K"])
        approaching.answer(*again)
        seconds, now = timed(lambda again=again: approaching.answer(*again))
        off = [
            f"{100 * (now[key] / full['now'][key] - 1):+.3f}"
            for key in ("reader_V", "reader_ohm", "dlnR_dz_per_um", "resolution_nm_per_rtHz")
        ]
        slope = f"{full['now']['dV_dz_V_per_um']:.3g}"
        rows.append((bias, z, f"{seconds:.2f}", slope, *off))
    names = ("voltage, % off", "resistance", "d ln R/dz", "resolution")
    table(("V", "µm", "s", "dV/dz (V/µm)", *names), rows)


if __name__ == "__main__":
    for name in sys.argv[1:] or ["contact", "reader"]:
        {"contact": contact, "reader": reader}[name]()
