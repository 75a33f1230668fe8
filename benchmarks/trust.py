"""Can a fit be trusted? Coverage of its intervals over noisy twins, and its starting points.

python benchmarks/trust.py [TWINS] [STARTS]
"""

from __future__ import annotations

import sys
from functools import partial

import numpy as np

from hotlever.errors import ComputationError
from hotlever.estimation import Measurement, fit, read_measurement
from hotlever.estimation.experiment import ExperimentAtRest, experiment_of
from hotlever.lever import Lever
from hotlever.lever.lever import COARSE
from hotlever.lever.reduced.response_surface import PAPER, ParameterDomain
from hotlever.lever.similar import SimilarLevers
from hotlever.materials import PARAMETERS
from hotlever.probe import Probe
from hotlever.probe.parameters import usual_parameters
from problems import BIAS, EXAMPLE, table

#: Noise of a twin: of its own value, or of the largest; K for the temperature.
ELECTRICAL, KELVIN = 0.002, 6.0
#: The geometry is reduced once, for all fits.
REDUCED = partial(experiment_of, reduce=True)


def twin(sweep, rng, proportional):
    """Return noisy data of a sweep."""

    def noisy(values):
        size = values if proportional else values.max()
        return values + ELECTRICAL * size * rng.normal(size=values.size)

    tip = sweep.tip_K.values
    spread = KELVIN * (1.0 + (tip - tip[0]) / 600.0) if proportional else KELVIN
    return Measurement(
        BIAS,
        noisy(sweep.current_mA.values),
        noisy(sweep.reader_V.values),
        tip + spread * rng.normal(size=tip.size),
        np.full(tip.size, np.nan),
    )


def coverage(probe, twins, proportional):
    """Print how often the intervals of a fit hold the truth."""
    sweep, rng = Lever(probe).sweep(BIAS), np.random.default_rng(1)
    names = [*PARAMETERS, "T_tip, hottest", "T_tip, 900 K"]
    hot, warm = BIAS.size - 1, int(np.argmin(np.abs(sweep.tip_K.values - 900.0)))
    pulls = []
    for _ in range(twins):
        fitted = fit(twin(sweep, rng, proportional), probe, model=REDUCED)
        pull = [
            (fitted.parameters[name].value - getattr(probe.material, name))
            / fitted.parameters[name].stderr
            for name in PARAMETERS
        ]
        missed = (fitted.band.tip_K.values - sweep.tip_K.values) / fitted.band.tip_stderr_K.values
        pulls.append([*pull, missed[hot], missed[warm]])
    pulls = np.array(pulls)
    kind = "noise in proportion to each value" if proportional else "constant noise"
    print(f"\n{twins} twins of Table 1's option III, {kind}\n")
    rows = [
        (
            name,
            f"{column.mean():+.2f}",
            f"{column.std():.2f}",
            f"{100 * (np.abs(column) < 1.0).mean():.0f} %",
            f"{100 * (np.abs(column) < 1.96).mean():.0f} %",
        )
        for name, column in zip(names, pulls.T, strict=True)
    ]
    every = np.abs(pulls)
    rows.append(
        (
            "all",
            "",
            "",
            f"{100 * (every < 1.0).mean():.0f} %",
            f"{100 * (every < 1.96).mean():.0f} %",
        )
    )
    table(("", "mean pull", "spread", "in the 68 % interval", "in the 95 % interval"), rows)


def coarse(probe, bias):
    """Return the model of a geometry never reduced, whose fits start at the probe's material."""
    coarse, full = (SimilarLevers(Lever(probe, mesh)) for mesh in (COARSE, None))
    return ExperimentAtRest(coarse, full, bias, usual_parameters(probe))


def starts(count, model, name):
    """Print how far from each other fits from random materials end."""
    data, rng = read_measurement(EXAMPLE), np.random.default_rng(2)
    probe = Probe.reference()
    best = fit(data, probe, model=REDUCED)
    apart = []
    for _ in range(count):
        material = ParameterDomain.of(probe).probe(probe, rng.random(len(PAPER))).material
        material = material.with_(c_kappa=rng.uniform(0.4, 1.0))
        try:
            fitted = fit(data, probe.model_copy(update={"material": material}), model=model)
        except ComputationError:
            apart.append(np.inf)
            continue
        apart.append(
            max(
                abs(fitted.parameters[name].value - parameter.value) / parameter.stderr
                for name, parameter in best.parameters.items()
            )
        )
    apart = np.array(apart)
    print(
        f"\n{count} random starting points, {name}: {int((apart < 0.05).sum())} end at the same "
        f"optimum; the largest distance of a parameter is {apart.max():.1e} standard errors."
    )


if __name__ == "__main__":
    TWINS = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    STARTS = int(sys.argv[2]) if len(sys.argv) > 2 else 100
    for each in (True, False):
        coverage(Probe.reference(), TWINS, each)
    starts(STARTS, REDUCED, "with the start found from the data")
    starts(STARTS, coarse, "Levenberg-Marquardt straight from there, geometry never reduced")
