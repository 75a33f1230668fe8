"""Mistakes of users: whether they are found, and what is said of them.

Forty mistakes are made with levers of `twins.py`, of a richer model, that differ from their
drawing, and each file is calibrated by the command line. A mistake counts as named when what is
said of it (notes and the closing line on standard error) has the likeliest cause in it. Where a
temperature is stated all the same, the table says how far it is off at most, and in standard errors
(rms over the rows): a mistake that is within these does no harm. Then follow things that are no
mistakes, and GOOD levers as they are: none of these may alarm.

Run: python benchmarks/mistakes.py [GOOD] [FIRST]      (FIRST lever of the mistakes)
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import NamedTuple

import numpy as np

from hotlever.cache import CACHE_VARIABLE
from hotlever.errors import HotleverError
from hotlever.estimate import Measurement, calibrate
from hotlever.probe import Probe
from hotlever.studies.simulation_based_calibration import DEPARTURES, draw, measure
from hotlever.text import BAND
from hotlever.types import Array
from problems import processor_time, table

COMMAND = [sys.executable, "-c", "from hotlever.cli import main; main()", "calibrate"]
#: Outliers are among the mistakes, and another law leaves data that few parameters describe.
DEPARTED = [name for name in DEPARTURES if name not in ("mobility", "outliers")]
#: Characters of what is said that the table shows.
SHOWN = 150


@dataclass
class Bench:
    """What a user has: a table with its headings and comments, a probe file, and options."""

    columns: dict[str, Array]
    probe: Probe
    true: Probe
    rng: np.random.Generator
    #: Biases (V), and the tip temperatures (K) that the lever had at these.
    truth: tuple[Array, Array]
    comments: list[str] = field(default_factory=list)
    options: list[str] = field(default_factory=list)
    probe_text: str = ""
    fit_of: int | None = None
    number: int = 0

    @classmethod
    def of_lever(cls, number: int, medium: str = "vacuum", what: str = "iv") -> Bench:
        rng = np.random.default_rng(number)
        true, nominal = draw(rng, number, medium)
        data, tip, _ = measure(true, rng, what, DEPARTED)
        return cls(columns_of(data), nominal, true, rng, (data.bias_V, tip), number=number)

    @property
    def bias(self) -> Array:
        return self.columns["V_b (V)"]

    @property
    def current(self) -> Array:
        return self.columns["I_h (mA)"]

    def set(self, **changed: Array) -> None:
        """Put other values for V_b, I_h, V_r or T_tip."""
        for heading in self.columns:
            symbol = heading.split()[0]
            if symbol in changed:
                self.columns[heading] = np.asarray(changed[symbol], dtype=float)

    def keep(self, rows: Array) -> None:
        self.columns = {heading: values[rows] for heading, values in self.columns.items()}

    def files(self, folder: Path) -> list[str]:
        """Write the files; return the arguments of the command."""
        lines = [*self.comments, ",".join(self.columns)]
        for row in zip(*self.columns.values(), strict=True):
            lines.append(",".join("" if np.isnan(value) else f"{value:.7g}" for value in row))
        data, probe = folder / "data.csv", folder / "probe.toml"
        data.write_text("\n".join(lines) + "\n")
        if self.fit_of is not None:
            other = Bench.of_lever(self.fit_of)
            os.mkdir(folder / "other")
            own, _, at = other.files(folder / "other")
            fitted = folder / "fit.json"
            fit = [*COMMAND[:-1], "fit", own, "--probe", at, "--fix", "a1", "-o", str(fitted)]
            subprocess.run(fit, check=True, capture_output=True)
            return [str(data), "--fit", str(fitted), *self.options]
        probe.write_text(self.probe_text or self.probe.to_toml())
        return [str(data), "--probe", str(probe), *self.options]


def columns_of(data: Measurement) -> dict[str, Array]:
    columns = {"V_b (V)": data.bias_V, "I_h (mA)": data.current_mA}
    if np.isfinite(data.reader_V).any():
        columns["V_r (mV)"] = 1e3 * data.reader_V
    if np.isfinite(data.tip_K).any():
        columns |= {"T_tip (K)": data.tip_K, "dT_tip (K)": data.tip_error_K}
    return columns


class Mistake(NamedTuple):
    """What is done to a bench, and what must be said of it (a regular expression)."""

    name: str
    make: Callable[[Bench], object]
    named: str
    medium: str = "vacuum"
    what: str = "iv"


# --- the mistakes --------------------------------------------------------------------------------


def drawing(**factors: float) -> Callable[[Bench], None]:
    """Return what puts wrong values into the probe file."""

    def make(bench: Bench) -> None:
        values = bench.probe.values(list(factors)) * list(factors.values())
        bench.probe = bench.probe.with_(**dict(zip(factors, values.tolist(), strict=True)))

    return make


def other_drawing(bench: Bench) -> None:
    three = bench.probe.shape.shape == "three-leg"
    bench.probe = Probe.u_shape() if three else Probe.reference()


def swapped(bench: Bench) -> None:
    bench.set(V_b=bench.current, I_h=bench.bias)


def lever_voltage(bench: Bench) -> None:
    ohm = bench.true.circuit.series_kohm
    bench.set(V_b=bench.bias - ohm * bench.current)


def other_terminal(bench: Bench) -> None:
    """The meter is at a terminal that nothing flows through: the noise of its input."""
    bench.set(I_h=2e-5 * np.abs(bench.rng.standard_normal(bench.bias.size)))


def remeasured(bench: Bench, true: Probe) -> Array:
    """Return the current of another lever at the same bias, or at the last that it can take.

    From then on the bench has that lever.
    """
    data, tip, _ = measure(true, bench.rng, "iv", DEPARTED, float(bench.bias.max()))
    bench.truth = data.bias_V, tip
    return np.interp(bench.bias, data.bias_V, data.current_mA)


def hot_plate(bench: Bench) -> None:
    bench.set(I_h=remeasured(bench, bench.true.with_(base_temperature_K=353.0)))


def contact(bench: Bench) -> None:
    ohm = bench.true.circuit.series_resistance_ohm + 800.0
    bench.set(I_h=remeasured(bench, bench.true.with_(series_resistance_ohm=ohm)))


def half_of_another(bench: Bench) -> None:
    own, half = bench.truth[1], bench.bias.size // 2
    other = remeasured(bench, draw(bench.rng, bench.number + 2, "vacuum")[0])
    bench.truth = bench.bias, np.append(own[:half], np.interp(bench.bias, *bench.truth)[half:])
    bench.set(I_h=np.concatenate([bench.current[:half], other[half:]]))


def with_fit_of_another(bench: Bench) -> None:
    bench.fit_of = bench.number + 2


def up_and_down(bench: Bench) -> None:
    """Up and down, while the current's zero drifts by 4 % of the largest current."""
    current = np.concatenate([bench.current, bench.current[::-1]])
    drift = 0.04 * current.max() * np.linspace(0.0, 1.0, current.size)
    bias = np.concatenate([bench.bias, bench.bias[::-1]])
    bench.columns = {"V_b (V)": bias, "I_h (mA)": current + drift}


def two_media(bench: Bench) -> None:
    air = remeasured(bench, bench.true.in_medium("air"))
    current = np.concatenate([bench.current, air])
    bench.columns = {"V_b (V)": np.tile(bench.bias, 2), "I_h (mA)": current}


def spoilt(*rows: int) -> Callable[[Bench], None]:
    def make(bench: Bench) -> None:
        current = bench.current.copy()
        current[list(rows)] *= np.resize([1.3, 0.7, 1.5], len(rows))
        bench.set(I_h=current)

    return make


def clipped(share: float) -> Callable[[Bench], None]:
    return lambda bench: bench.set(I_h=np.minimum(bench.current, share * bench.current.max()))


def rounded(steps: int) -> Callable[[Bench], None]:
    def make(bench: Bench) -> None:
        step = bench.current.max() / steps
        bench.set(I_h=np.round(bench.current / step) * step)

    return make


def zero(offset: float, drift: float) -> Callable[[Bench], None]:
    """Return what adds to the current shares of the largest, at once and along the rows."""

    def make(bench: Bench) -> None:
        along = np.linspace(0.0, 1.0, bench.bias.size)
        bench.set(I_h=bench.current + (offset + drift * along) * bench.current.max())

    return make


def commented(text: str) -> Callable[[Bench], None]:
    return lambda bench: bench.comments.append(text)


MISTAKES = [
    Mistake("current in µA under mA", lambda b: b.set(I_h=1e3 * b.current), "µA"),
    Mistake("current in A under mA", lambda b: b.set(I_h=1e-3 * b.current), "A labelled mA"),
    Mistake("bias in mV under V", lambda b: b.set(V_b=1e3 * b.bias), "mV"),
    Mistake("R_s in kOhm under Ohm", commented("# R_s (Ohm): 5.6"), "R_s|series resis"),
    Mistake("bias and current swapped", swapped, "swapped"),
    Mistake("sign of the current", lambda b: b.set(I_h=-b.current), "sign|negative"),
    Mistake(
        "reader's column headed as tip",
        lambda b: b.columns.__setitem__("T_tip (K)", b.columns.pop("V_r (mV)")),
        r"T_tip.*(unit|column)", "vacuum", "reader",
    ),
    Mistake("R_s left out", drawing(series_resistance_ohm=0.0), "series resis"),
    Mistake("R_s doubled", drawing(series_resistance_ohm=2.0), "series resis"),
    Mistake("R_s 3 % off", drawing(series_resistance_ohm=1.03), "series resis"),
    Mistake("R_s 10 % off", drawing(series_resistance_ohm=0.9), "series resis"),
    Mistake("R_s 30 % off", drawing(series_resistance_ohm=1.3), "series resis"),
    Mistake("lever voltage given as bias", lever_voltage, "lever's own voltage"),
    Mistake("meter at another terminal", other_terminal, "terminal"),
    Mistake(
        "air taken for vacuum",
        lambda b: b.options.append("--medium=vacuum"),
        "in air, not", "air",
    ),
    Mistake("vacuum taken for air", lambda b: b.options.append("--medium=air"), "in vacuum, not"),
    Mistake("drawing of another lever", other_drawing, "drawing"),
    Mistake("heater width + 30 %", drawing(heater_width_um=1.3), "heater.width"),
    Mistake("heater length - 30 %", drawing(heater_length_um=0.7), "heater.length"),
    Mistake(
        "thickness in nm",
        lambda b: setattr(b, "probe_text", b.probe.to_toml().replace("= 0.4 ", "= 400 ")),
        "thickness",
    ),
    Mistake("thickness doubled", drawing(thickness_um=2.0), "thickness"),
    Mistake("doping three times", drawing(n_d=3.0), "doping|n_d"),
    Mistake("doping ten times", drawing(n_d=10.0), "doping|n_d"),
    Mistake("hot plate at 353 K not stated", hot_plate, "base temperature"),
    Mistake("base temperature in °C", commented("# base temperature (K): 20"), "base.temperature"),
    Mistake(
        "tip temperatures in °C",
        lambda b: b.set(T_tip=b.columns["T_tip (K)"] - 273.15),
        "°C|Celsius", "vacuum", "raman",
    ),
    Mistake("current clipped at 70 %", clipped(0.7), "clip|saturat|range"),
    Mistake("current clipped at 95 %", clipped(0.95), "clip|saturat|range"),
    Mistake("zero of the current drifts by 5 %", zero(0.0, 0.05), "zero"),
    Mistake("zero of the current off by 3 %", zero(0.03, 0.0), "zero|offset"),
    Mistake("current in 20 steps", rounded(20), "steps|resolution|quanti"),
    Mistake("an outlier", spoilt(17), "standard deviations"),
    Mistake("five outliers", spoilt(8, 15, 22, 30, 37), "standard deviations"),
    Mistake("half of the rows from another lever", half_of_another, "current jump"),
    Mistake("up and down with drift", up_and_down, "drift|zero"),
    Mistake("contact of 800 ohm", contact, "series resis|contact"),
    Mistake("sweeps in vacuum and air in one file", two_media, "two sweeps"),
    Mistake("three points", lambda b: b.keep(np.array([12, 25, 38])), r"\b3 (rows|points|data)"),
    Mistake("cold points only", lambda b: b.keep(np.arange(6)), "only up to"),
    Mistake("fit of another lever", with_fit_of_another, "fit of another lever"),
]  # fmt: skip

HARMLESS = [
    Mistake("sorted backwards", lambda b: b.keep(np.arange(40)[::-1]), ""),
    Mistake("rows twice", lambda b: b.keep(np.repeat(np.arange(40), 2)), ""),
    Mistake("rows shuffled", lambda b: b.keep(b.rng.permutation(40)), ""),
    Mistake("up and down", lambda b: b.keep(np.r_[0:40, 0:40][np.r_[0:40, 79:39:-1]]), ""),
    Mistake("seven points", lambda b: b.keep(np.arange(3, 40, 6)), ""),
    Mistake("up to half of the bias", lambda b: b.keep(np.arange(20)), ""),
    Mistake("noise of 1 %", lambda b: b.set(I_h=b.current * (1 + 0.01 * b.rng.standard_normal(40))),
            ""),
]  # fmt: skip


# --- running them --------------------------------------------------------------------------------


class Outcome(NamedTuple):
    """How a command ended, and how far off a tip is that it states (K, standard errors)."""

    status: int
    said: str
    seconds: float
    off: str


def run(number: int, first: int = 0) -> Outcome:
    """Make a mistake, each with another lever, and calibrate by the command line."""
    mistake = [*MISTAKES, *HARMLESS][number]
    bench = Bench.of_lever(first + number, mistake.medium, mistake.what)
    mistake.make(bench)
    with tempfile.TemporaryDirectory() as folder:
        os.environ[CACHE_VARIABLE] = str(Path(folder, "cache"))
        written = Path(folder, "calibration.json")
        command = [*COMMAND, *bench.files(Path(folder)), "-o", str(written)]
        began = processor_time()
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        seconds = processor_time() - began
        said = done.stderr.replace(f"{folder}/", "")
        off = "" if done.returncode else error_made(written, bench.truth)
    return Outcome(done.returncode, said, seconds, off)


def error_made(written: Path, truth: tuple[Array, Array]) -> str:
    """Return by how much a calibration is off at most, and in standard errors (rms)."""
    rows = [row for row in json.loads(written.read_text())["table"] if row["tip_low_K"] is not None]
    bias, tip, low, high = (
        np.array([row[name] for row in rows])
        for name in ("bias_V", "tip_K", "tip_low_K", "tip_high_K")
    )
    true = np.interp(bias, *truth, left=np.nan, right=np.nan)
    off = tip - true
    stated = np.where(off > 0, tip - low, high - tip) / BAND
    here = np.isfinite(off)
    if not here.any():
        return ""
    farthest = np.nanargmax(np.abs(off))
    return f"{off[farthest]:+.0f} K, {np.sqrt(np.mean((off / stated)[here] ** 2)):.1f} σ"


def good(number: int) -> tuple[int, str, float]:
    """Calibrate a good lever; return what is said against it."""
    bench = Bench.of_lever(number, "air" if number % 4 == 3 else "vacuum")
    began = time.process_time()
    data = Measurement(*bench.columns.values(), *np.full((3, bench.bias.size), np.nan))
    try:
        calibration = calibrate(data, probe=bench.probe)
        said = calibration.reason
    except HotleverError as error:
        said = str(error)
    return number, said, time.process_time() - began


def report(mistakes: list[Mistake], outcomes: list[Outcome]) -> None:
    rows, right = [], 0
    for mistake, outcome in zip(mistakes, outcomes, strict=True):
        named = (
            bool(re.search(mistake.named, outcome.said)) if mistake.named else not outcome.status
        )
        right += named
        said = " / ".join(outcome.said.splitlines())
        rows.append((mistake.name, said[-SHOWN:], outcome.status, "yes" if named else "NO",
                     outcome.off, f"{outcome.seconds:.1f}"))  # fmt: skip
    table(("what was done", "what was said (its end)", "status", "right", "off", "s"), rows)
    seconds = [outcome.seconds for outcome in outcomes]
    print(f"\nright: {right} of {len(rows)}; seconds of processor at most {max(seconds):.1f}\n")


def main(count: int = 40, first: int = 0) -> None:
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        every = range(len(MISTAKES) + len(HARMLESS))
        outcomes = list(pool.map(partial(run, first=first), every))
        report(MISTAKES, outcomes[: len(MISTAKES)])
        report(HARMLESS, outcomes[len(MISTAKES) :])
        alarms = [verdict for verdict in pool.map(good, range(1000, 1000 + count)) if verdict[1]]
    for number, said, seconds in alarms:
        print(f"false alarm: lever {number}, {seconds:.1f} s: {said}")
    print(f"good levers: {count}, false alarms: {len(alarms)}")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
