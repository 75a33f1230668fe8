"""Twins measured in time, without any spectrum: is the tip as hot as their fits say?

    python benchmarks/history_twins.py [COUNT [PULSE_US [SEED]]]

Each twin is a lever of its own material and heat capacity, drawn from what is known beforehand (the
usual priors; 3 % for the heat capacity), on the drawing that its fit knows. Its current alone, or
with the reader, is measured during a pulse of 10 V and fitted with those priors. Noise is 0.1 % of
the largest value, and meters are wrong by 0.1 % as a whole. Levers are coarse ones, twins and
models alike, so that what is compared is what data tell.
"""

from __future__ import annotations

import sys
import time
from functools import partial

import numpy as np

from hotlever.errors import HotleverError
from hotlever.estimation import Measurement, fit
from hotlever.estimation.experiment_in_time import ExperimentInTime
from hotlever.lever.lever import COARSE, Lever
from hotlever.lever.transient import pulse, simulate
from hotlever.materials import PARAMETERS
from hotlever.probe import Probe
from hotlever.probe.priors import Prior, default_priors
from problems import table

COUNT = int(sys.argv[1]) if len(sys.argv) > 1 else 6
LENGTH = float(sys.argv[2]) if len(sys.argv) > 2 else 100.0
SEED = int(sys.argv[3]) if len(sys.argv) > 3 else 1
HEIGHT, NOISE, METERS, HEAT_CAPACITY = 10.0, 1e-3, 1e-3, 0.03
NAMES = (*PARAMETERS, "series_resistance_ohm", "heat_capacity_scale")
TIMES = np.geomspace(0.1, LENGTH, 40)


def main() -> None:
    probe = Probe.reference()
    lever, wave = Lever(probe, COARSE), pulse(HEIGHT, LENGTH)
    usual = default_priors(probe)
    priors = {name: usual[name] for name in NAMES[:-1]}
    priors["heat_capacity_scale"] = Prior(1.0, HEAT_CAPACITY)
    model = partial(ExperimentInTime.of, waveform=wave, names=list(priors), lever=lever)
    rng = np.random.default_rng(SEED)
    rows, off, sure = [], {}, {}
    guess = simulate(lever, wave, at=TIMES).tip_K.values[-1]
    number = 0
    while number < COUNT:
        moved = {name: prior.at(rng.normal()) for name, prior in priors.items()}
        try:
            truth = simulate(lever.with_probe(probe.replace(moved)), wave, at=TIMES)
        except HotleverError:
            continue  # it melts
        number += 1
        shown = [truth.current_mA.values, truth.reader_V.values]
        measured = [
            (1.0 + METERS * rng.normal()) * values
            + NOISE * values.max() * rng.normal(size=values.size)
            for values in shown
        ]
        tip = truth.tip_K.values
        cells = [str(number), f"{tip[-1]:.0f}", f"{guess - tip[-1]:+.0f}"]
        for what, count in (("current", 1), ("current and reader", 2)):
            data = Measurement.in_time(TIMES, wave, *measured[:count])
            began = time.process_time()
            fitted = fit(data, probe, model=model, priors=priors)
            at = fitted.band.isel(time=-1)
            error, stated = at.tip_K.item() - tip[-1], at.tip_stderr_K.item()
            scale = fitted.parameters["heat_capacity_scale"]
            own = 100.0 * (scale.value - moved["heat_capacity_scale"])
            cells += [
                f"{error:+.1f} ± {stated:.1f}",
                f"{own:+.1f} ± {100.0 * scale.stderr:.1f}",
                f"{time.process_time() - began:.0f}",
            ]
            off.setdefault(what, []).append(error)
            sure.setdefault(what, []).append(stated)
        rows.append(cells)
        print(*cells, sep="  ", file=sys.stderr, flush=True)
    names = "twin", "tip at the end (K)", "unfitted (K)"
    each = "off (K)", "heat capacity off (%)", "processor s"
    print(f"Pulse of {HEIGHT:g} V for {LENGTH:g} µs; current alone, then with the reader.\n")
    table((*names, *each, *each), rows)
    for what, errors in off.items():
        share = np.abs(errors) / np.array(sure[what])
        print(
            f"{what}: rms {np.sqrt(np.mean(np.square(errors))):.1f} K, stated "
            f"{np.sqrt(np.mean(np.square(sure[what]))):.1f} K; within 1.96 of it "
            f"{np.sum(share < 1.96)} of {len(errors)}"
        )


if __name__ == "__main__":
    main()
