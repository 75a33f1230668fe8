"""Calibrations of levers never seen: how wrong they are, and how honest their bands.

A twin is solved with a richer model than the one that is calibrated: a finer mesh, a tip under the
heater, dimensions off their drawing by 5 %, a material drawn from the priors, in air a gas and a
temperature jump that nobody told of. The calibration knows the drawing, the nominal doping (15 %)
and the measured curve: 40 points, the current with 0.2 % of noise and a slow drift of 0.05 %.
Half of the twins have three legs, half are U-shaped. Beside it stand the paper's ways: the knee at
the inversion temperature, and the power law (or the model of the drawing) at k times the power.

Run: python benchmarks/twins.py [TWINS] [vacuum|air] [iv|reader|raman]
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np

from hotlever.calibration.knee import IVCurve, find_knee
from hotlever.calibration.power_law import EQ12
from hotlever.calibration.procedure import calibrate
from hotlever.calibration.transfer import curve_of_law, curve_of_model
from hotlever.errors import BranchEndError, HotleverError
from hotlever.fitting import Measurement
from hotlever.lever import Lever
from hotlever.materials.silicon import inversion_temperature
from hotlever.probe import MeshOptions, Probe
from hotlever.probe.priors import default_priors
from hotlever.probe.tip import Tip
from problems import table

POINTS, NOISE, DRIFT = 40, 2e-3, 5e-4
#: Of temperatures, random and common to all (Raman).
RAMAN = 0.01, 0.02
HIGHEST_V = {"vacuum": 11.0, "air": 13.0}
#: Temperatures above which errors count (K).
HOT = 400.0
MESH = MeshOptions(refinement=1.3)


def drawn(rng: np.random.Generator, number: int, medium: str) -> tuple[Probe, Probe]:
    """Return a twin, and what is known of it before."""
    nominal = (Probe.reference() if number % 2 == 0 else Probe.u_shape()).in_medium(medium)
    values = {
        name: prior.value * float(np.exp(prior.spread * rng.standard_normal()))
        for name, prior in default_priors(nominal).items()
        if name != "series_resistance_ohm"
    }
    true = nominal.with_(**values)
    height = float(rng.uniform(0.3, 0.8))
    tip = Tip(height_um=height, half_angle_deg=float(rng.uniform(10, 25)))
    if tip.base_radius_um < 0.45 * true.shape.layout().heater.sides.min():
        true = true.model_copy(update={"tip": tip})
    if medium == "air":
        true = true.with_(accommodation=0.9)
    return true, nominal


def measured(
    true: Probe, rng: np.random.Generator, what: str, highest: float | None = None
) -> tuple[Measurement, np.ndarray, Lever]:
    """Measure a twin up to a bias (V), or as far as it goes; return its true temperatures too."""
    lever, highest = Lever(true, MESH), highest or HIGHEST_V[true.surroundings.medium]
    try:
        sweep = lever.sweep(np.linspace(highest / POINTS, highest, POINTS))
    except BranchEndError as error:
        highest = 0.97 * error.bias_reached
        sweep = lever.sweep(np.linspace(highest / POINTS, highest, POINTS))
    bias, tip = sweep.bias.values, sweep.tip_K.values

    def noisy(values: np.ndarray) -> np.ndarray:
        drift = DRIFT * rng.standard_normal() * np.linspace(0.0, 1.0, POINTS)
        return values * (1.0 + NOISE * rng.standard_normal(POINTS) + drift)

    nothing = np.full(POINTS, np.nan)
    reader = noisy(sweep.reader_V.values) if what == "reader" else nothing
    tips, errors = nothing.copy(), nothing.copy()
    if what == "raman":
        some = np.searchsorted(tip, np.linspace(400.0, 0.98 * tip.max(), 5)).clip(0, POINTS - 1)
        alone, together = RAMAN
        scale = 1.0 + together * rng.standard_normal()
        rise = (tip - 293.0)[some] * scale * (1.0 + alone * rng.standard_normal(some.size))
        tips[some], errors[some] = 293.0 + rise, np.hypot(alone, together) * (tip[some] - 293.0)
    data = Measurement(bias, noisy(sweep.current_mA.values), reader, tips, errors)
    return data, tip, lever


def paper_ways(data: Measurement, nominal: Probe) -> dict[str, Callable]:
    """Return the tip temperature by power as the paper's rules have it."""
    model = Lever(nominal.in_medium("vacuum")).branch()
    curve = IVCurve.of(data.bias_V, data.current_mA, nominal.circuit)
    knee = find_knee(curve, model).power_mW
    inversion = float(inversion_temperature(nominal.material.n_d, nominal.material.p))
    return {
        "knee at T_i": lambda power: 293.0 + (inversion - 293.0) * power / knee,
        "power law, k": lambda power: curve_of_law(EQ12, 293.0).at(power, knee),
        "drawing, k": lambda power: curve_of_model(model).at(power, knee),
    }


def one(task: tuple[int, str, str]) -> dict:
    """Calibrate a twin; return errors (K) and stated errors along the bias."""
    number, medium, what = task
    rng = np.random.default_rng(number)
    true, nominal = drawn(rng, number, medium)
    found: dict = {"number": number}
    try:
        data, _, lever = measured(true, rng, what)
    except HotleverError as error:
        return found | {"unmeasured": str(error)}
    began = time.process_time()
    try:
        calibration = calibrate(data, probe=nominal)
    except HotleverError as error:
        return found | {"refused": str(error), "seconds": time.process_time() - began}
    found["seconds"] = time.process_time() - began
    rows = calibration.table
    exact = lever.sweep(rows.bias_V.values).tip_K.values
    hot = exact > HOT
    found["error"] = (rows.tip_K.values - exact)[hot]
    found["stated"] = rows.tip_stderr_K.values[hot]
    found["reason"] = calibration.reason
    try:
        ways = paper_ways(data, nominal)
        power = rows.power_mW.values[hot]
        found["ways"] = {name: way(power) - exact[hot] for name, way in ways.items()}
    except HotleverError:
        found["ways"] = {}
    return found


def report(results: list[dict], title: str) -> None:
    answered = [one for one in results if "error" in one]
    refused = [one for one in results if "refused" in one]
    largest = np.array([np.abs(one["error"]).max() for one in answered])
    sigma = np.array([np.abs(one["error"] / one["stated"]).max() for one in answered])
    ratio = np.concatenate([one["error"] / one["stated"] for one in answered])
    print(f"\n{title}: {len(answered)} twins answered, {len(refused)} refused")
    for one in refused[:5]:
        print(f"  refused: {one['number']}: {one['refused']}")
    doubted = [one for one in answered if one["reason"]]
    print(f"said not to be described: {len(doubted)}")
    deciles = np.array(
        [[np.abs(part).mean() for part in np.array_split(one["error"] / one["stated"], 10)]
         for one in answered]
    )  # fmt: skip
    table(
        ("largest error above 400 K (K)", "median", "90 %", "worst"),
        [("calibrated", *(f"{value:.1f}" for value in np.percentile(largest, (50, 90, 100))))]
        + [
            (name, *(f"{value:.1f}" for value in np.nanpercentile(values, (50, 90, 100))))
            for name in ("knee at T_i", "power law, k", "drawing, k")
            if (
                values := [
                    np.nanmax(np.abs(one["ways"][name])) for one in answered if name in one["ways"]
                ]
            )
        ],
    )
    print(f"\npooled rms of error / stated: {np.sqrt(np.mean(ratio**2)):.2f}")
    print(f"twins within 2 stated errors everywhere: {np.mean(sigma < 2):.0%}")
    inside = [np.mean(deciles < limit, axis=0) for limit in (1.0, 1.96)]
    for name, shares in zip(("68 %", "95 %"), inside, strict=True):
        print(f"the {name} band holds, by decile of bias: {' '.join(f'{x:.0%}' for x in shares)}")
    seconds = np.array([one["seconds"] for one in results if "seconds" in one])
    print(f"seconds of processor: median {np.median(seconds):.1f}, worst {seconds.max():.1f}")


def main(count: int, medium: str, what: str) -> None:
    tasks = [(number, medium, what) for number in range(count)]
    results = []
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        for done, found in enumerate(pool.map(one, tasks), start=1):
            results.append(found)
            print(f"{done} of {count}", file=sys.stderr)
    report(results, f"{medium}, {what}")


if __name__ == "__main__":
    given = sys.argv[1:]
    main(int(given[0]) if given else 200, *(given[1:] + ["vacuum", "iv"][len(given[1:]) :]))
