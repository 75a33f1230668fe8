"""Measuring with a source meter: does the tip stay below its limit, and does the output go off?

The levers are those of `foreign_levers`, all of whose laws depart from what calibrates them, behind
an instrument with the noise that is there. Each is measured as `hotlever measure` does, with 25
rows at most, up to 13 V, and a limit of 900 K, and calibrated; and by 40 even rows up to the same
bias, and up to where the tip is at the limit, of which nobody could know. Counted are the tips that
were hotter, and compared, of one lever in four, what is said at the bias at which the tip is at
800 K.

The ends are those of whole commands that measure a twin, at random moments: Ctrl-C, a kill of the
command and of the process that supervises, a line that is lost, a file that can grow no more.

    python benchmarks/measuring.py levers [COUNT] [RESULTS.jsonl]     10 if left out
    python benchmarks/measuring.py ends [COUNT]                       50 if left out

With a file of results a line for each lever is appended to it, and an interrupted run goes on.
"""

from __future__ import annotations

import json
import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import psutil

from foreign_levers import NOISE, foreign_lever, owners_probe
from hotlever.errors import HotleverError
from hotlever.estimate import Measurement, calibrate
from hotlever.estimate.next_measurement import LinearisedLever
from hotlever.instruments.ramp import Ramp, RampOptions
from hotlever.instruments.source_meter import MeterReading
from hotlever.instruments.twin import RampCurve, TwinBench
from hotlever.probe import Probe
from problems import table
from twins import two_at_a_time

LIMIT_K, AT_K, ROWS, EVEN = 900.0, 800.0, 25, 40
#: Of the elements that true levers are solved with: within 0.5 K, at half the price.
FINENESS = 0.5
#: One in so many levers is calibrated by all ways of measuring it.
COMPARED = 4
HOTTEST_K, HIGHEST_V = 1300.0, 13.0


class Direct:
    """An instrument without a line."""

    def __init__(self, curve: RampCurve, rng: np.random.Generator) -> None:
        self.curve, self._rng, self.hottest_K, self._bias_V = curve, rng, 0.0, 0.0

    def set_bias(self, bias_V: float) -> None:
        """Set the bias (V)."""
        self._bias_V = bias_V

    def read(self) -> MeterReading:
        """Return what is shown, with noise."""
        current, _, tip = self.curve.at(self._bias_V)
        self.hottest_K = max(self.hottest_K, tip)
        noisy = current * (1.0 + NOISE * self._rng.standard_normal())
        return MeterReading(self._bias_V, noisy, float("nan"), False)


def tip_at(measured: Measurement, probe: Probe, bias_V: float) -> tuple[float, float]:
    """Calibrate; return the tip temperature (K) at a bias, and its standard error."""
    lever = LinearisedLever.of_calibration(calibrate(measured, probe=probe))
    tip, slopes = lever.tip(np.array([bias_V]))
    return float(tip[0]), float(lever.information.stderr(slopes)[0])


def measure(number: int) -> dict[str, Any]:
    """Measure a lever both ways."""
    lever = foreign_lever(number, "all", "vacuum", FINENESS)
    sweep = lever.sweep(HOTTEST_K, HIGHEST_V)
    bias = np.linspace(0.0, sweep.bias_V[-1], 2001)
    curve, rng = RampCurve(bias, *sweep.at(bias)), np.random.default_rng((number, 7))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "owner.toml"
        path.write_text(owners_probe(lever.shape, "vacuum"))
        probe = Probe.coerce(path)
    instrument = Direct(curve, rng)
    ramp = Ramp(
        probe,
        np.linspace(HIGHEST_V / ROWS, HIGHEST_V, ROWS),
        RampOptions(stay_below_K=LIMIT_K, settle_s=0.0),
    )
    began = time.process_time()
    ramp.measure(instrument, lambda *_: None)
    record: dict[str, Any] = {
        "number": number,
        "rows": len(ramp.readings),
        "hottest_K": instrument.hottest_K,
        "beyond": sum(curve.at(step.bias_V)[2] > step.tip_limit_K for step in ramp.steps),
        "reason": "" if ramp.complete else ramp.reason,
        "end": ramp.reason,
        "first_order": sum(step.first_order for step in ramp.steps),
        "seconds": (time.process_time() - began) / max(len(ramp.readings), 1),
    }
    if not ramp.complete or number % COMPARED:
        return record
    aim, at_limit = np.interp((AT_K, LIMIT_K), curve.tip_K, curve.bias_V).tolist()
    last = ramp.readings[-1].bias_V
    ways = {"ramp": ramp.measurement()}
    for way, end in (("even", last), ("limit", at_limit)):
        even, nothing = np.linspace(end / EVEN, end, EVEN), np.full(EVEN, np.nan)
        noisy = curve.at_each(even)[0] * (1.0 + NOISE * rng.standard_normal(EVEN))
        ways[way] = Measurement(even, noisy, nothing, nothing, nothing, medium="vacuum")
    for name, data in ways.items():
        try:
            tip, stderr = tip_at(data, probe, aim)
        except HotleverError as error:
            return record | {"reason": f"{name}: {error}"}
        record |= {f"{name}_off_K": tip - AT_K, f"{name}_stderr_K": stderr}
    return record


def levers(count: int, file: Path | None = None) -> None:
    """Measure levers, and say what came of it."""
    records: list[dict[str, Any]] = []
    if file is not None and file.exists():
        records = [json.loads(line) for line in file.read_text().splitlines()]
    done = {record["number"] for record in records}
    for record in two_at_a_time(measure, [n for n in range(count) if n not in done]):
        records.append(record)
        if file is not None:
            with file.open("a") as lines:
                lines.write(json.dumps(record) + "\n")
    report(sorted(records, key=lambda record: record["number"]))


def report(records: list[dict[str, Any]]) -> None:
    """Print what came of all levers."""
    for record in records:
        if record["reason"]:
            print(f"{record['number']}: {record['reason'][:150]}")
    ways = ("ramp", "even", "limit")
    early = sum(bool(record["reason"]) for record in records)
    good = [record for record in records if "limit_off_K" in record]
    off, stated = (
        {way: np.array([record[f"{way}_{what}_K"] for record in good]) for way in ways}
        for what in ("off", "stderr")
    )
    compared: list[tuple[str, str, str]] = []
    if good:
        rms = [float(np.sqrt(np.mean(off[way] ** 2))) for way in ways]
        stderr = [float(np.median(stated[way])) for way in ways]
        compared = [
            (
                "rms error at 800 K (K): ramp / 40 even rows to its end / 40 to 900 K",
                " / ".join(f"{value:.1f}" for value in rms),
                "as with 40",
            ),
            (
                "stated error there, medians (K)",
                " / ".join(f"{value:.1f}" for value in stderr),
                "",
            ),
        ]
    hot = np.array([record["hottest_K"] for record in records])
    seconds = float(np.median([record["seconds"] for record in records]))
    rows = np.array([record["rows"] for record in records])
    quartiles = " / ".join(f"{value:.0f}" for value in np.quantile(hot, (0.05, 0.5, 0.95)))
    table(
        ("quantity", "value", "wanted"),
        [
            ("levers, ended early", f"{len(records)}, {early}", ""),
            ("of which calibrated by all ways", f"{len(good)}", ""),
            (f"hotter than {LIMIT_K:.0f} K", f"{np.sum(hot > LIMIT_K)} of {hot.size}", "1 %"),
            ("hottest tip (K), 5, 50 and 95 % of the levers below", quartiles, ""),
            ("hottest of all (K)", f"{hot.max():.0f}", ""),
            (
                "rows with a tip hotter than 99 % say",
                f"{sum(record['beyond'] for record in records) / rows.sum():.1%}",
                "1 %",
            ),
            (
                "rows whose limit is known to first order alone",
                f"{sum(record['first_order'] for record in records)} of {rows.sum()}",
                "0",
            ),
            ("rows, median and most", f"{np.median(rows):.0f}, {rows.max()}", f"{ROWS}"),
            *compared,
            ("processor seconds a row, median", f"{seconds:.1f}", "10"),
        ],
    )


# --- ends -----------------------------------------------------------------------------------------


def _prepare(most_bytes: int | None) -> None:
    # what a shell starts in its background ignores Ctrl-C, and so would a command started by it
    signal.signal(signal.SIGINT, signal.default_int_handler)
    if most_bytes is not None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (most_bytes, most_bytes))


def end(
    kind: str, twin: TwinBench, folder: Path, rng: np.random.Generator
) -> tuple[float, int, str]:
    """Measure, and end it.

    Return after how many seconds the output was off, or infinity, how many rows were told, and what
    was said of the end.
    """
    output = folder / "iv.csv"
    output.unlink(missing_ok=True)
    words = ["measure", "--source", twin.source, "--settle", "50ms", "-o", str(output)]
    # the lines above the rows take some 250
    most_bytes = int(rng.integers(200, 450))
    with subprocess.Popen(
        [sys.executable, "-m", "hotlever", *words, "--laws", "paper"],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {"PYTHONUNBUFFERED": "1"},
        preexec_fn=partial(_prepare, most_bytes if kind == "disk" else None),
    ) as process:
        while not twin.output_on and process.poll() is None:
            time.sleep(0.01)
        if kind != "disk":
            time.sleep(rng.uniform(0.0, 15.0))
        began = time.monotonic()
        if kind == "disk":
            while twin.output_on and process.poll() is None:
                time.sleep(0.005)
            # what fitted is written last, at most a row before what did not
            written = output.stat().st_mtime if output.exists() else time.time()
            began = time.monotonic() - (time.time() - written)
        elif kind == "line":
            twin.break_lines()
        elif kind == "supervisor":
            for child in psutil.Process(process.pid).children():
                if "spawn_main" in " ".join(child.cmdline()):
                    child.kill()
        else:
            process.send_signal({"ctrl-c": signal.SIGINT, "kill": signal.SIGKILL}[kind])
        while twin.output_on and time.monotonic() < began + 20.0:
            time.sleep(0.005)
        after = time.monotonic() - began if not twin.output_on else float("inf")
        with suppress(subprocess.TimeoutExpired):
            process.wait(60)
        process.kill()
        assert process.stderr is not None
        said = process.stderr.read()
        return after, said.count(" tip expected at "), said


def ends(count: int) -> None:
    """End commands, and say what came of it."""
    rng = np.random.default_rng(5)
    kinds = ("ctrl-c", "kill", "supervisor", "line", "disk")
    curve = RampCurve.of_probe(Probe.reference())
    seconds: dict[str, list[float]] = {kind: [] for kind in kinds}
    aloud = rows = lost = 0
    with tempfile.TemporaryDirectory() as folder:
        for number in range(count):
            kind = kinds[number % len(kinds)]
            with TwinBench(curve, seed=number) as twin:
                after, told, text = end(kind, twin, Path(folder), rng)
            seconds[kind].append(after)
            aloud += "MAY STILL BE ON" in text
            # an end that comes before the first row leaves no file
            output = Path(folder) / "iv.csv"
            lines = output.read_text().splitlines() if output.exists() else []
            whole = [line.count(",") == 1 for line in lines if line[0] not in "#V"]
            rows += sum(whole)
            lost += max(told - sum(whole), 0)
            print(number, kind, round(after, 2), len(whole), file=sys.stderr, flush=True)
    table(
        ("end", "times", "output off after (s, largest)", "said aloud"),
        [
            (
                kind,
                str(len(each)),
                f"{max(each, default=0.0):.2f}",
                str(aloud) if kind == "line" else "",
            )
            for kind, each in seconds.items()
        ],
    )
    print(f"{rows} whole rows on disk; {lost} that were told are not there")


if __name__ == "__main__":
    words = sys.argv[1:]
    if words[:1] not in (["levers"], ["ends"]):
        sys.exit(__doc__)
    number = int(words[1]) if len(words) > 1 else None
    if words[0] == "ends":
        ends(number or 50)
    else:
        levers(number or 10, Path(words[2]) if len(words) > 2 else None)
