"""Calibrations of levers never seen: how wrong they are, and how honest their bands.

How levers are simulated and judged: `hotlever.studies.simulation_based_calibration`. Each is solved
with a richer model than the one that calibrates it, and measured in 40 points, the current with
0.2 % of noise, unless --noise states another share.

Run: python benchmarks/twins.py [LEVERS] [vacuum|air] [iv|reader|raman] [--noise SHARE]
                          [--without DEPARTURE ...] [--laws paper]
     python benchmarks/twins.py [LEVERS] all      every medium and kind of data

With --wild, levers of which the owner knows little, and says so. Those above depart from the model
and are known well; these are levers of the model itself, solved on a finer mesh, whose owner states
doping, dimensions and thickness with wide priors. What is tried is the search: whether it gets to
such a lever from so far away, and whether the errors that it states are those it makes.

     python benchmarks/twins.py --wild [--count N] [--first K] [--medium vacuum|air]
                                [--laws paper] [--obey] [--results FILE] [--write DIR]

With --drawn, three-leg levers whose heater is 10 % longer than it was meant to be: drawn ones,
whose window for the dopant is larger, with a prior of its edges, beside those of the built-in
shape, with a prior of that dimension. Both have the same material, noise and outliers; other
dimensions are as they were meant. The true window is drawn anew, so that it has other parts than
the shifted one.

     python benchmarks/twins.py [LEVERS] --drawn [--noise SHARE] [--laws paper]

With --laws paper calibrations take the laws of silicon to be the paper's, as --laws says. Those of
levers above are the paper's or MINIMOS'; those of the wild ones depart as the model has it, unless
they are to --obey.

With --results a line for each of them is appended to a file, and an interrupted run goes on with
those that are not in it. With --write the data and probe file of each, and the true lever's, are
written instead, to try the command line: hotlever calibrate DIR/wild-3.csv --probe DIR/wild-3.toml
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.random import Generator

from hotlever.errors import HotleverError, InputError
from hotlever.estimate import Measurement, calibrate
from hotlever.lever import Branch, Lever
from hotlever.lever.discretisation import chosen_space, energy_between_degrees, making
from hotlever.lever.full_space import FullSpace
from hotlever.probe import MeshOptions, Probe
from hotlever.probe.parts import PriorTexts
from hotlever.probe.priors import default_priors, updated
from hotlever.probe.probe_parameters import parameters_of
from hotlever.studies.simulation_based_calibration import (
    DEPARTURES,
    LEVELS,
    LaboratoryOptions,
    concatenated,
    coverage_by_decile,
    judge,
    measure,
    stated_on_that_side,
    summary,
    values_from_priors,
)
from hotlever.types import Array
from problems import drawn_reference, table

LABORATORY = LaboratoryOptions()


def judged(
    number: int, medium: str, what: str, departures: list[str], noise: float, laws: str
) -> xr.Dataset | str:
    """Judge the calibration of a lever; the reason in words if there is none of that number."""
    try:
        return judge(number, medium, what, departures, LaboratoryOptions(noise=noise), laws)
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
    stated = np.sqrt(
        (answers.stated_K.where(answers.tip_K > LABORATORY.hot_K) ** 2).mean("row").values
    )
    print(f"stated above 400 K (rms of a lever): median {np.nanmedian(stated):.1f} K")
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
        try:
            for done, future in enumerate(as_completed(running), start=1):
                print(f"{done} of {len(numbers)}", file=sys.stderr)
                yield future.result()
        finally:
            # what is raised is said at once, not when all others are done
            pool.shutdown(cancel_futures=True)


def main(
    count: int, medium: str, what: str, departures: list[str], noise: float, laws: str
) -> None:
    told = {"medium": medium, "what": what, "departures": departures, "noise": noise, "laws": laws}
    judge_one = partial(judged, **told)
    results = list(two_at_a_time(judge_one, [*range(count)]))
    without = [name for name in DEPARTURES if name not in departures]
    ending = f", without {', '.join(without)}" if without else ""
    report(results, f"{medium}, {what}, noise of {noise:g}, {laws} laws{ending}")


# --- drawn levers whose windows are off -----------------------------------------------------------

#: How far the heater ends outside of where it was meant to, at either side (µm), and what is said
#: to be known of that; its own name for it.
_WINDOW_UM = 0.2
_SHIFT = "heater.edge_bias_um"
#: What is known of other dimensions.
_EXACT = "± 0.01%"


def heaters_off() -> dict[str, tuple[Probe, Probe, dict[str, str]]]:
    """The true lever, the nominal one and the prior of its owner, of each kind."""
    meant = Probe.reference()
    length_um = meant.shape.dimensions()["heater_length_um"]
    longer = length_um + 2 * _WINDOW_UM
    return {
        "drawn": (
            drawn_reference("heater", _WINDOW_UM),
            drawn_reference("heater", 0.0),
            {_SHIFT: f"± {_WINDOW_UM}"},
        ),
        "built-in": (
            meant.with_(heater_length_um=longer),
            meant,
            {"heater_length_um": f"{length_um} ± {2 * _WINDOW_UM}"},
        ),
    }


def judge_drawn(number: int, noise: float, laws: str) -> dict[str, dict[str, Any]]:
    """Calibrate the levers of a number, of each kind."""
    return {
        kind: judge_heater(number, *levers, noise, laws) for kind, levers in heaters_off().items()
    }


def judge_heater(
    number: int, true: Probe, nominal: Probe, prior: dict[str, str], noise: float, laws: str
) -> dict[str, Any]:
    """Calibrate a lever, and return its errors, those that are stated, and its heater's."""
    rng = np.random.default_rng(number)
    held = [name for name in Probe.reference().shape.dimensions() if name != "thickness_um"]
    drawn = values_from_priors(Probe.reference(), rng)
    lever = true.with_(**{name: drawn[name] for name in drawn if name not in held})
    data, _, solved = measure(lever, rng, "iv", laboratory=LaboratoryOptions(noise=noise))
    exact = {name: _EXACT for name in held if name in default_priors(nominal)}
    try:
        found = calibrate(data, probe=nominal, priors={"laws": laws, **exact, **prior})
    except HotleverError as error:
        return {"refused": str(error)}
    tip = solved.sweep(found.table.bias_V.values).tip_K.values
    off = found.table.tip_K.values - tip
    hot = tip > LABORATORY.hot_K
    (name,) = prior
    use = found.priors[name]
    heater = np.array([use.value, use.posterior_value, use.posterior_spread])
    return {
        "refused": found.reason,
        "off_K": off[hot],
        "stated_K": stated_on_that_side(found.table, off)[hot],
        # how much longer the heater is
        "heater_um": (heater - [use.value, use.value, 0.0]) * (2.0 if name == _SHIFT else 1.0),
    }


def drawn(numbers: list[int], noise: float, laws: str) -> None:
    """Judge levers whose heaters are off, drawn and built-in, and sum all up."""
    judged = list(two_at_a_time(partial(judge_drawn, noise=noise, laws=laws), numbers))
    report_drawn(judged, f"noise of {noise:g}, {laws} laws")


def report_drawn(judged: list[dict[str, dict[str, Any]]], title: str) -> None:
    """Print errors and those that are stated, of each kind."""
    print(f"\n## heaters {2 * _WINDOW_UM:g} µm longer than meant, {title}\n")
    rows = []
    for kind in heaters_off():
        every = [one[kind] for one in judged]
        answered = [one for one in every if not one["refused"]]
        if not answered:
            continue
        ratios = [np.abs(one["off_K"]) / one["stated_K"] for one in answered]
        within = coverage_by_decile(ratios).mean(axis=1)
        stated = [np.sqrt(np.mean(one["stated_K"] ** 2)) for one in answered]
        largest = [np.abs(one["off_K"]).max() for one in answered]
        _, found, spread = np.array([one["heater_um"] for one in answered]).T
        rows.append(
            [
                kind,
                f"{len(answered)} of {len(every)}",
                *(f"{share:.0%}" for share in within),
                f"{np.sqrt(np.mean([np.mean(ratio**2) for ratio in ratios])):.2f}",
                f"{np.median(stated):.1f}",
                f"{np.median(largest):.1f}",
                f"{found.mean():.2f}",
                f"{np.median(spread):.2f}",
                f"{np.mean(np.abs(found - 2 * _WINDOW_UM) < 2 * spread):.0%}",
            ]
        )
    bands = [f"in {level:.0%}" for level in LEVELS]
    errors = ["error / stated", "stated (K)", "largest error (K)"]
    heater = ["longer by (µm)", "± (µm)", "within two ±"]
    table(["lever", "described", *bands, *errors, *heater], rows)


# --- levers of which little is known, reported ---------------------------------------------------


def judged_wild(number: int, medium: str | None, laws: str, obey: bool) -> dict[str, Any]:
    """Judge a lever of which little is known; without one of that number, say why."""
    try:
        record = judge_little_known(number, medium, laws, obey)
    except HotleverError as error:
        record = {"lever": number, "outcome": "no lever", "reason": str(error)}
    return record | {"asked_for": [medium, laws, obey]}


def wild(
    numbers: list[int], medium: str | None, laws: str, obey: bool, results: Path | None
) -> None:
    """Judge levers of which little is known, unless in the file of results, and sum all up."""
    lines = results.read_text().splitlines() if results and results.exists() else []
    records = {
        record["lever"]: record
        for record in map(json.loads, lines)
        if record["lever"] in numbers and record["asked_for"] == [medium, laws, obey]
    }
    missing = [number for number in numbers if number not in records]
    judge_one = partial(judged_wild, medium=medium, laws=laws, obey=obey)
    for record in two_at_a_time(judge_one, missing):
        records[record["lever"]] = record
        if results:
            with results.open("a") as file:
                file.write(json.dumps(record) + "\n")
    title = f"wild{', obeying' * obey}, {medium or 'vacuum and air'}, {laws} laws"
    report_wild([records[number] for number in numbers], title)


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
    pooled = np.sqrt(np.mean([np.mean(ratio**2) for ratio in ratios]))
    sizes = [float(np.sqrt(np.mean(band**2))) for band in stated]
    print(f"rms of error / stated: {pooled:.2f}; stated (rms), median {np.median(sizes):.1f} K")
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


# --- levers of which little is known, drawn, measured and judged ---------------------------------

SHAPES = ("three-leg", "u-shape", "drawing")
MEDIA = ("vacuum", "air")
#: What the owner says of the lever, beside the usual priors; of the doping one of two.
PRIORS = {"delta": "± 35%", "thickness_um": "± 20%", "dimensions": "± 12%"}
DOPING = ("± 60%", "×/ 2.5")
#: Nominal doping (cm⁻³) from and to; a dimension is the reference's times two factors, one of all
#: dimensions and one of its own, each at most √2 either way.
_DOPING_CM3, _FACTOR = (3e16, 1e18), float(np.sqrt(2.0))
#: Series resistance (Ω), rows, and the first bias over the last.
_SERIES_OHM, _ROWS, _FIRST = (1e3, 1e4), (18, 55), (0.03, 0.12)
#: The coldest tip (K) at which data end; the hottest, as a share of the rise at which it melts.
_COLDEST_END_K, _HOTTEST_END = 350.0, 0.98
#: Noise of the current over the current; of a picture, the error of reading either axis over its
#: full scale, from and to.
_NOISE, _READING = 5e-3, (1e-3, 3e-3)
#: Share of the error estimate whose triangles are split once more than by default; panels of the
#: air, as much smaller.
_SPLIT, _PANELS = 0.8, 1.3
#: Most levers drawn for one number.
_MOST_DRAWN = 200
#: What becomes of a lever: of the last two there is no band to be judged.
DESCRIBED, CONTRADICTED, NOT_CONVERGED, FAILED = (
    "described",
    "not described",
    "not converged",
    "error",
)
_OUTCOMES = {True: DESCRIBED, False: CONTRADICTED, None: NOT_CONVERGED}


@dataclass(frozen=True)
class LittleKnownLever:
    """A lever that is measured, and what its owner knows of it.

    Attributes
    ----------
    number : int
    true, nominal : Probe
        The lever, and the owner's probe with the owner's priors in ``[prior]``.
    branch : Branch
        Of the true lever, until something melts.
    measurement : Measurement
    digitised : bool
        Whether the data were read from a picture; the current has noise otherwise.
    jumps : bool
        Whether the ramp of the bias passed a fold.
    repeated : int
        Levers drawn before that could not be drawn, meshed or solved.
    """

    number: int
    true: Probe
    nominal: Probe
    branch: Branch
    measurement: Measurement
    digitised: bool
    jumps: bool
    repeated: int

    def tip_K(self, bias_V: Array) -> Array:
        """Return the true tip temperature (K) on a ramp of the bias; NaN where it has ended."""
        return self.branch.tip_K(self.branch.read(self.true.circuit, bias_V).u)

    @property
    def below_knee(self) -> bool:
        """Whether the data stop below the knee."""
        knee = self.branch.knee
        return knee is None or float(np.nanmax(self.tip_K(self.measurement.bias_V))) < knee.tip_K

    def measurement_csv(self) -> str:
        """Return the data as a measurement file."""
        rows = zip(self.measurement.bias_V, self.measurement.current_mA, strict=True)
        lines = ["V_b (V),I_h (mA)", *(f"{bias:.7g},{current:.7g}" for bias, current in rows)]
        return "\n".join(lines) + "\n"


def little_known_lever(
    number: int, medium: str | None = None, obey: bool = False
) -> LittleKnownLever:
    """Draw and measure the lever of a number, the same each time.

    Parameters
    ----------
    number : int
        Decides the shape in turn, and the rest by chance.
    medium : {"vacuum", "air"}, optional
        By default, either by chance.
    obey : bool
        Whether its laws are the paper's.

    Raises
    ------
    HotleverError
        If no lever that was drawn could be solved: the reason of the last.
    """
    rng = np.random.default_rng(number)
    reason = HotleverError()
    for repeated in range(_MOST_DRAWN):
        by_chance = MEDIA[int(rng.random() < 0.5)]
        try:
            nominal = _nominal(rng, SHAPES[number % len(SHAPES)]).in_medium(medium or by_chance)
            true = _drawn(rng, nominal, obey)
            branch = _finer(true).branch(np.inf)
            measurement, digitised, jumps = _measured(rng, true, branch)
        except HotleverError as error:
            reason = error
            continue
        return LittleKnownLever(
            number, true, nominal, branch, measurement, digitised, jumps, repeated
        )
    raise reason


def _factor(rng: Generator, most: float = _FACTOR) -> float:
    """Draw a factor, evenly by its logarithm."""
    return float(most ** rng.uniform(-1.0, 1.0))


def _between(rng: Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _nominal(rng: Generator, shape: str) -> Probe:
    """Draw the probe that an owner believes to have, with priors."""
    common = _factor(rng)
    if shape == "drawing":
        probe = _drawing(rng, common)
    else:
        probe = Probe.reference() if shape == "three-leg" else Probe.u_shape()
        sizes = probe.shape.dimensions()
        probe = probe.with_(
            **{name: size * common * _factor(rng) for name, size in sizes.items() if size}
        )
    priors = {"n_d": DOPING[int(rng.random() < 0.5)], **PRIORS}
    if not probe.shape.outline_moves:
        del priors["dimensions"]
    probe = probe.with_(
        n_d=_between(rng, *_DOPING_CM3),
        delta=common * probe.material.delta,
        series_resistance_ohm=_between(rng, *_SERIES_OHM),
    )
    return probe.model_copy(update={"prior": PriorTexts.from_values(priors, "priors")})


def _drawing(rng: Generator, common: float) -> Probe:
    """Draw a lever of straight lines: two legs that taper towards a front bar with the heater."""

    def size(usual: float) -> float:
        return usual * common * _factor(rng)

    length, bar, heater = size(60.0), size(1.645), size(4.0)
    gap = heater * rng.uniform(1.1, 1.8)
    wide, narrow, slit = size(8.0), size(4.0), size(8.0)
    back, half = length - bar, gap / 2.0
    corner = half + narrow * rng.uniform(0.3, 1.0)
    left = [
        [0.0, slit / 2.0],
        [0.0, slit / 2.0 + wide],
        [back, half + narrow],
        [length, corner],
    ]
    inner = [[back, -half], [back, half]]
    right = [[x, -y] for x, y in reversed(left)]
    beyond = [back - 1.0, length + 1.0]
    across = [[beyond[0], -heater / 2], [beyond[1], -heater / 2]]
    sections = {
        "probe": {
            "shape": "drawing",
            "thickness_um": size(0.4),
            "tip_um": [length - bar / 2.0, 0.0],
        },
        "layers": {
            "silicon": [[*left, *right, *inner]],
            "heater": [[*across, *([x, -y] for x, y in reversed(across))]],
        },
        "terminals": {"supply": right[-2:], "ground": left[:2]},
    }
    return Probe.from_sections(sections, "drawn lever")


def _drawn(rng: Generator, nominal: Probe, obey: bool) -> Probe:
    """Draw a lever from all that its owner knows.

    Raises
    ------
    InputError
        If it cannot be drawn, or a parameter is beyond what levers have.
    """
    bounds, values = parameters_of(nominal, anywhere=True), dict[str, float]()
    known = default_priors(nominal)
    if obey:
        known = updated(known, {"laws": "paper"}, nominal, "levers")
    for name, prior in known.items():
        values[name] = value = prior.at(float(rng.standard_normal()))
        if not bounds[name].lower <= value <= bounds[name].upper:
            raise InputError(f"{name} = {value:g} is beyond what levers have")
    return nominal.model_copy(update={"prior": None}).with_(**values)


def _finer(true: Probe) -> Lever:
    """Return a lever on a mesh that is finer than the one it has by default."""
    usual = chosen_space(true)
    by_element = energy_between_degrees(usual, true.kinds, true.circuit)
    space = FullSpace(usual.mesh.refined(making(by_element, _SPLIT)), wiring=true.wiring)
    return Lever(true, MeshOptions(panels=_PANELS), space=space)


def _measured(rng: Generator, true: Probe, branch: Branch) -> tuple[Measurement, bool, bool]:
    """Measure a lever; return also whether it is read from a picture, and whether it jumped.

    Half of the sweeps end below the knee, if there is one.

    Raises
    ------
    InputError
        If the ramp of the bias does not heat the tip to 350 K.
    """
    base = branch.base_temperature_K
    coldest, hottest = _COLDEST_END_K, base + _HOTTEST_END * (branch.hottest_K - base)
    below = rng.random() < 0.5
    if branch.knee is not None:
        middle = min(branch.knee.tip_K, hottest)
        coldest, hottest = (coldest, middle) if below else (middle, hottest)
    end_K = rng.uniform(coldest, hottest)
    end_V = float(branch.bias(end_K, true.circuit))
    rows = int(rng.integers(_ROWS[0], _ROWS[1] + 1))
    bias = np.linspace(rng.uniform(*_FIRST) * end_V, end_V, rows)
    digitised = bool(rng.random() < 0.5)
    if digitised:  # points of a picture are not evenly spaced
        bias[1:-1] += rng.uniform(-0.3, 0.3, rows - 2) * (bias[1] - bias[0])
    reading = branch.read(true.circuit, bias)
    tip = branch.tip_K(reading.u)
    if not (np.isfinite(tip).all() and tip[-1] >= _COLDEST_END_K):
        raise InputError("a ramp of the bias does not heat the tip so far")
    current = branch.electrical_outputs(reading.u)["current_mA"]
    if digitised:
        share = rng.uniform(*_READING)
        bias = bias + share * bias.max() * rng.standard_normal(rows)
        current = current + share * current.max() * rng.standard_normal(rows)
        # who reads a picture goes from left to right
        bias = np.maximum(bias, 1e-3 * end_V)
        order = np.argsort(bias)
        bias, current = bias[order], current[order]
    else:
        current = current * (1.0 + _NOISE * rng.standard_normal(rows))
    nothing = np.full(rows, np.nan)
    measurement = Measurement(bias, current, nothing, nothing, nothing)
    jumps = any(fold < end_V for fold, _ in reading.jumps)
    return measurement, digitised, jumps


def judge_little_known(
    number: int, medium: str | None = None, laws: str = "uncertain", obey: bool = False
) -> dict[str, Any]:
    """Make the lever of a number, calibrate it, and compare with its true temperature.

    Returns
    -------
    dict
        What can be written as JSON: what the lever is; ``outcome``, with ``reason`` and, for an
        exception, its type as ``exception``; ``seconds`` of processor; and if there is an answer
        ``tip_K``, the truth, ``off_K``, the error, and ``stated_K``, the one that is stated on
        that side, by row of the calibration's table, where it has a bias and the lever a state.

    Raises
    ------
    HotleverError
        If there is no lever of that number.
    """
    lever = little_known_lever(number, medium, obey)
    probe, data = lever.nominal, lever.measurement
    record: dict[str, Any] = {
        "lever": number,
        "shape": probe.shape.shape,
        "medium": probe.surroundings.medium,
        "n_d": probe.material.n_d,
        "rows": data.bias_V.size,
        "digitised": lever.digitised,
        "jumps": lever.jumps,
        "below_knee": lever.below_knee,
        "end_K": round(float(np.nanmax(lever.tip_K(data.bias_V))), 1),
        "repeated": lever.repeated,
        "exception": "",
        "reason": "",
    }
    began = time.process_time()
    try:
        calibration = calibrate(data, probe=probe, priors={"laws": laws})
    except Exception as error:  # also what should never come is a result here
        record |= {"outcome": FAILED, "exception": type(error).__name__, "reason": str(error)}
        return record | {"seconds": time.process_time() - began}
    record["seconds"] = time.process_time() - began
    table = calibration.table.isel(bias=calibration.table.bias_V.values > 0)
    tip = lever.tip_K(table.bias_V.values)
    there = np.isfinite(tip)
    table, tip = table.isel(bias=there), tip[there]
    off = table.tip_K.values - tip
    return record | {
        "outcome": _OUTCOMES[calibration.describes_data],
        "reason": calibration.reason,
        "tip_K": tip.round(2).tolist(),
        "off_K": off.round(3).tolist(),
        "stated_K": stated_on_that_side(table, off).round(4).tolist(),
    }


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("levers", nargs="?", type=int, default=200)
    parser.add_argument(
        "medium", nargs="?", choices=(*LABORATORY.highest_V, "all"), default="vacuum"
    )
    parser.add_argument("what", nargs="?", choices=("iv", "reader", "raman"), default="iv")
    listed = "\n".join(f"{name}: {meaning}" for name, meaning in DEPARTURES.items())
    listed = listed.replace("%", "%%")  # argparse formats its help
    parser.add_argument("--without", nargs="+", choices=DEPARTURES, default=[], help=listed)
    parser.add_argument("--noise", type=float, default=LABORATORY.noise, help="of meters, a share")
    parser.add_argument("--laws", choices=("uncertain", "paper"), default="uncertain")
    parser.add_argument("--obey", action="store_true", help="wild levers obey the paper's laws")
    parser.add_argument("--drawn", action="store_true", help="levers whose heaters are off")
    parser.add_argument("--wild", action="store_true", help="levers of which little is known")
    parser.add_argument("--count", type=int, default=200, help="of levers of which little is known")
    parser.add_argument("--first", type=int, default=0, help="number of the first of them")
    parser.add_argument(
        "--medium", dest="around", choices=[*LABORATORY.highest_V], help="of all of them"
    )
    parser.add_argument("--results", type=Path, metavar="FILE", help="one line for each of them")
    parser.add_argument("--write", type=Path, metavar="DIR", help="their data, not judged")
    given = parser.parse_args()
    if given.drawn:
        drawn([*range(given.levers)], given.noise, given.laws)
        sys.exit()
    if given.wild:
        numbers = [*range(given.first, given.first + given.count)]
        if given.write:
            write(numbers, given.around, given.write)
        else:
            wild(numbers, given.around, given.laws, given.obey, given.results)
        sys.exit()
    chosen = [name for name in DEPARTURES if name not in given.without]
    everything = [
        (medium, what) for medium in LABORATORY.highest_V for what in ("iv", "reader", "raman")
    ]
    for medium, what in everything if given.medium == "all" else [(given.medium, given.what)]:
        main(given.levers, medium, what, chosen, given.noise, given.laws)
