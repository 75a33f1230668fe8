"""What `hotlever next` proposes, on levers never seen: is it better, and is it as foretold?

Levers, noise and thermometer are those of `hotlever.studies.simulation_based_calibration`, with all
that it has and the model that calibrates it has not. Each is measured twice: at 40 even biases with
5 spectra at even temperatures, as far as it goes; and at 15 biases, three of them with a spectrum,
that were chosen step by step: four of a lever that nobody has measured, and then three times a few
and one with a spectrum. What counts is the tip temperature at 800 K. In the first two steps
the tip is to stay below 900 K; in the others, as in the even sweep, it may get hotter.

Run: python benchmarks/next_measurement.py [LEVERS] [vacuum|air] [RESULTS.jsonl]

With a file of results a line for each lever is appended to it, and an interrupted run goes on.
"""

from __future__ import annotations

import json
import sys
import time
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from hotlever.errors import BranchEndError, HotleverError
from hotlever.estimate import Estimate, Measurement, calibrate, plan_next
from hotlever.estimate.next_measurement import LinearisedLever
from hotlever.lever import Lever
from hotlever.probe import Probe
from hotlever.studies.simulation_based_calibration import (
    LaboratoryOptions,
    MinimosMaterial,
    draw,
)
from hotlever.text import BAND
from hotlever.types import Array
from problems import table
from twins import two_at_a_time

AT_K, LIMIT_K = 800.0, 900.0
EVEN, SPECTRA = 40, 5
#: Biases without and with a spectrum, step by step.
STEPS = (
    {"bias": 4},
    {"bias": 3, "spectra": 1},
    {"bias": 3, "spectra": 1},
    {"bias": 2, "spectra": 1},
)
OPTIONS = LaboratoryOptions()
#: Of the steps so many keep the tip below the limit.
LIMITED = 2


class Laboratory:
    """A lever, an instrument, and a thermometer that is off by the same share all along."""

    def __init__(self, true: Probe, random: np.random.Generator) -> None:
        self.lever = Lever(true.with_material("material", MinimosMaterial), OPTIONS.mesh)
        self.base_K, self._random = true.circuit.base_temperature_K, random
        self._alone, self._common = OPTIONS.raman_errors
        self._scale = 1.0 + self._common * random.standard_normal()

    def measure(self, bias: Array, spectra: Array) -> Measurement:
        """Measure the current at biases (V), and with a spectrum where `spectra`, (n,), says so."""
        sweep, nothing = self.lever.sweep(bias), np.full(bias.size, np.nan)
        noisy, off = self._random.standard_normal((2, bias.size))
        rise = sweep.tip_K.values - self.base_K
        tip = self.base_K + rise * self._scale * (1.0 + self._alone * off)
        return Measurement(
            sweep.bias_V.values,
            sweep.current_mA.values * (1.0 + OPTIONS.noise * noisy),
            nothing,
            np.where(spectra, tip, np.nan),
            np.where(spectra, np.hypot(self._alone, self._common) * rise, np.nan),
        )

    def even(self, highest_V: float) -> Measurement:
        """Measure at even biases, as far as the lever goes."""
        share = np.linspace(1.0 / EVEN, 1.0, EVEN)
        try:
            tip = self.lever.sweep(highest_V * share).tip_K.values
        except BranchEndError as error:
            highest_V = 0.97 * error.bias_reached
            tip = self.lever.sweep(highest_V * share).tip_K.values
        at = np.linspace(OPTIONS.hot_K, 0.98 * tip.max(), SPECTRA)
        chosen = np.searchsorted(tip, at).clip(0, EVEN - 1)
        return self.measure(highest_V * share, np.isin(np.arange(EVEN), chosen))


def together(first: Measurement | None, second: Measurement) -> Measurement:
    """Return the rows of both."""
    if first is None:
        return second
    names = ("bias_V", "current_mA", "reader_V", "tip_K", "tip_error_K")
    columns: Any = {
        name: np.concatenate([getattr(first, name), getattr(second, name)]) for name in names
    }
    return replace(first, **columns)


def stated(calibration: Estimate, bias: float) -> tuple[float, float]:
    """Return the tip temperature at a bias (V), and its standard error at `AT_K` (K)."""
    rows = calibration.table
    # beyond the measured rows a calibration says nothing, but what it knows does
    stderr = plan_next(calibration, at_K=AT_K, count=1).proposals.stderr_now_K.item()
    if bias <= rows.bias_V.values[-1]:
        return float(np.interp(bias, rows.bias_V, rows.tip_K)), stderr
    return float(LinearisedLever.of_calibration(calibration).tip(np.array([bias]))[0][0]), stderr


def judge(number: int, medium: str) -> dict[str, Any]:
    """Measure the lever of a number both ways."""
    random = np.random.default_rng(number)
    true, nominal = draw(random, number, medium)
    record: dict[str, Any] = {"lever": number, "medium": medium}
    try:
        laboratory = Laboratory(true, random)
        branch = laboratory.lever.branch()
        aim = float(branch.bias(np.array([AT_K]), true.circuit)[0])
        even = calibrate(laboratory.even(OPTIONS.highest_V[medium]), probe=nominal)
        measured, calibration, highest = None, None, 0.0
        foretold, beyond, ratios, seconds = np.nan, 0, [], []
        for step, allowed in enumerate(STEPS):
            limited = step < LIMITED
            began = time.process_time()
            how = (
                {"probe": nominal, "noise": {"current": OPTIONS.noise}}
                if calibration is None
                else {}
            )
            plan = plan_next(
                calibration,
                at_K=AT_K,
                stay_below_K=LIMIT_K if limited else None,
                allowed=allowed,
                count=sum(allowed.values()),
                **how,
            )
            if calibration is not None:
                seconds.append(time.process_time() - began)
            foretold = plan.proposals.stderr_then_K.values[-1]
            # a spectrum that is taken again at a bias is another row
            bias = plan.proposals.bias_V.values + 1e-4 * np.arange(plan.proposals.sizes["proposal"])
            spectra = plan.proposals.what.values == "spectra"
            order = np.argsort(bias)
            more = laboratory.measure(bias[order], spectra[order])
            true_K = laboratory.lever.sweep(bias).tip_K.values
            beyond += int(np.sum(true_K > plan.proposals.tip_limit_K.values))
            if limited:
                highest = max(highest, float(true_K.max()))
            measured = together(measured, more)
            calibration = calibrate(measured, probe=nominal)
            if not calibration.describes_data:
                return record | {"outcome": "chosen: not described", "highest_K": highest}
            tip, now = stated(calibration, aim)
            ratios.append(foretold / now)
        if not even.describes_data:
            return record | {"outcome": "even: not described", "highest_K": highest}
        even_tip, even_now = stated(even, aim)
    except HotleverError as error:
        return record | {"outcome": str(error)}
    return record | {
        "outcome": "",
        "chosen_stderr_K": now,
        "chosen_off_K": tip - AT_K,
        "even_stderr_K": even_now,
        "even_off_K": even_tip - AT_K,
        "foretold_K": foretold,
        "ratios": ratios,
        "highest_K": highest,
        "beyond": beyond,
        "seconds": seconds,
    }


def report(records: list[dict[str, Any]]) -> None:
    """Print what came of all levers."""
    good = [record for record in records if not record["outcome"]]
    print(f"{len(records)} levers, {len(good)} described by both measurements")
    for record in records:
        if record["outcome"]:
            print(f"  {record['lever']}: {record['outcome'][:120]}")
    column = {
        name: np.array([record[name] for record in good])
        for name in ("chosen_stderr_K", "chosen_off_K", "even_stderr_K", "even_off_K", "foretold_K")
    }
    rms = {
        name: float(np.sqrt(np.mean(column[f"{name}_off_K"] ** 2))) for name in ("chosen", "even")
    }
    smaller = np.mean(column["chosen_stderr_K"] <= column["even_stderr_K"])
    # the first step is that of a lever of which little is known
    ratios = np.array([record["ratios"] for record in good])
    over = [record for record in records if record.get("highest_K", 0.0) > LIMIT_K]
    measured = sum("highest_K" in record for record in records)
    off = np.abs(column["chosen_off_K"])
    seconds = np.concatenate([record["seconds"] for record in good])
    each = ", ".join(f"{value:.2f}" for value in np.median(ratios, axis=0))
    errors = " / ".join(f"{np.median(column[f'{way}_stderr_K']):.1f}" for way in rms)
    within = {
        what: f"{np.mean(off < BAND * column[name]):.0%}"
        for what, name in (("foretold", "foretold_K"), ("stated", "chosen_stderr_K"))
    }
    table(
        ("quantity", "value", "wanted"),
        [
            ("standard error at 800 K, chosen / even (K, medians)", errors, ""),
            ("as small or smaller in", f"{smaller:.0%}", "80%"),
            (
                "rms of the errors made, chosen / even (K)",
                f"{rms['chosen']:.1f} / {rms['even']:.1f}",
                "no larger",
            ),
            ("foretold / stated error, by step (medians)", each, "0.8 to 1.25"),
            ("errors within the foretold 95 %", within["foretold"], "92 to 98%"),
            ("errors within the stated 95 %", within["stated"], ""),
            (f"hotter than {LIMIT_K:.0f} K", f"{len(over)} of {measured}", "5 of 200"),
            (
                "proposals with a tip hotter than 99 % say",
                f"{np.sum([record['beyond'] for record in good]) / (15 * len(good)):.1%}",
                "1%",
            ),
            ("a decision (seconds of processor, median)", f"{np.median(seconds):.2f}", "1"),
        ],
    )


def main(count: int, medium: str, file: Path | None) -> None:
    records: list[dict[str, Any]] = []
    if file is not None and file.exists():
        records = [json.loads(line) for line in file.read_text().splitlines()]
        records = [record for record in records if record["medium"] == medium]
    done = {record["lever"] for record in records}
    numbers = [number for number in range(count) if number not in done]
    for record in two_at_a_time(partial(judge, medium=medium), numbers):
        records.append(record)
        if file is not None:
            with file.open("a") as lines:
                lines.write(json.dumps(record) + "\n")
    report(sorted(records, key=lambda record: record["lever"]))


if __name__ == "__main__":
    words = sys.argv[1:]
    main(
        int(words[0]) if words else 20,
        words[1] if len(words) > 1 else "vacuum",
        Path(words[2]) if len(words) > 2 else None,
    )
