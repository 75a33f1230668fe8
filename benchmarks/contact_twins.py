"""The resistance of an interface from simulated data of a lever over a sample.

python benchmarks/contact_twins.py [COUNT] [CASE...]

Each twin has a resistance of its own, between a third and three times what resists beside it, and a
material of its own, known to 1 % by priors, as from a fit out of contact. Of its interface nothing
is known but its power of ten. Currents have a noise of 1e-4, and a scale that is off
by 1e-3, as is assumed of a meter; melting points have a noise of 1.5 K.

in: 41 biases in contact. melting: these, and melting points at three of them. in and out: 41
biases in contact and the same out of it. approach: in air, where the gas is known to 5 %, a curve
at 11.5 V of 200 rows from 3 µm to contact and 200 in it, with 21 biases out of contact; the lever
is then near its knee, and its current tells nine times as much of the interface as at 9 V. radius:
in and out, where the apex is known to 10 %.
Simulated and estimated on the same coarse mesh: what is examined is the inference.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from hotlever import Measurement, Probe, fit
from hotlever.contact.law import INTERFACE, ContactLaw
from hotlever.contact.resistances import cold_resistance
from hotlever.estimation.experiment import ExperimentAtRest
from hotlever.estimation.over_a_sample import with_distances
from hotlever.lever import Lever
from hotlever.lever.lever import COARSE
from hotlever.lever.similar import SimilarLevers
from hotlever.probe.parameters import usual_parameters
from hotlever.probe.priors import METERS
from hotlever.quantities import FITTED
from problems import table

#: Noise of the current, and what is known of the material.
NOISE, KNOWN = 1e-4, 0.01
#: Biases (V) of a sweep, of some rows before an approach, and of that.
BIAS, FEW, AT = np.linspace(5.0, 10.5, 41), np.linspace(5.0, 10.5, 21), 11.5
#: Distances of an approach (µm), and temperatures near which samples melt, with their error (K).
DISTANCE, MELTING, MELTING_ERROR = np.geomspace(3.0, 0.003, 200), (333.0, 403.0, 528.0), 1.5
PROBE = Probe.reference().with_(
    **{"tip.height_um": 0.7, "tip.apex_radius_um": 0.02}, sample="glass", interface_K_per_mW=1e4
)
IN_AIR = PROBE.with_(medium="air", surface_gap_um=0.7)
#: Errors that an interface may have where it counts, and the quantile of a band of 95 %.
GOOD, BAND = 0.1, 1.96


class Case(NamedTuple):
    """What is measured: where, and what else than the material is known to a share."""

    probe: Probe
    bias: np.ndarray
    distance: np.ndarray
    melting: bool = False
    known: Mapping[str, float] = MappingProxyType({})


def both(bias: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return biases and distances of rows in contact, and of the same out of it."""
    return np.tile(bias, 2), np.repeat([0.0, 1.0], bias.size)


CASES = {
    "in": Case(PROBE, BIAS, 0.0 * BIAS),
    "melting": Case(PROBE, BIAS, 0.0 * BIAS, melting=True),
    "in and out": Case(PROBE, *both(BIAS)),
    "approach": Case(
        IN_AIR,
        np.concatenate([FEW, np.full(400, AT)]),
        np.concatenate([np.full(FEW.size, 3.0), DISTANCE, np.zeros(200)]),
        known={"gas_conductivity": 0.05},
    ),
    "radius": Case(PROBE, *both(BIAS), known={"apex_radius_um": 0.1}),
}


def model(probe: Probe, bias: np.ndarray, names: Any = None) -> ExperimentAtRest:
    """Return the lever on a coarse mesh, not corrected."""
    names = usual_parameters(probe) if names is None else names
    return ExperimentAtRest(SimilarLevers(Lever(probe, COARSE)), None, bias, names)


def twin(case: Case, number: int) -> tuple[float, float]:
    """Return by how much the logarithm of the resistance is off, and its standard error."""
    random, probe = np.random.default_rng(number), case.probe
    law = ContactLaw(probe)
    assert probe.tip is not None
    beside = law.spreading_K_per_mW + cold_resistance(probe.tip, 293.0)
    known = dict.fromkeys(usual_parameters(probe), KNOWN) | dict(case.known)
    values = dict(zip(known, probe.values(list(known)), strict=True))
    truth = {name: values[name] * np.exp(known[name] * random.normal()) for name in known}
    truth[INTERFACE] = beside * np.exp(random.uniform(-1.0, 1.0) * np.log(3.0))
    experiment = with_distances(model(probe, case.bias), probe, case.distance)
    shown = experiment.measuring(case.bias, None, case.distance).predict(probe.replace(truth))
    rows = {column.name: shown.values[row] for row, column in enumerate(FITTED.values())}
    nothing = np.full(case.bias.size, np.nan)
    shares = 1.0 + NOISE * random.normal(size=nothing.size)
    current = rows["current_mA"] * shares * (1.0 + METERS * random.normal())
    measured = Measurement(case.bias, current, nothing, nothing, nothing)
    measured = replace(measured, distance_um=case.distance)
    if case.melting:
        # of materials that melt at what the rows show: what is between rows is not interpolated
        melts = [int(np.argmin(np.abs(rows["surface_K"] - near))) for near in MELTING]
        at = case.bias[melts]
        found = rows["surface_K"][melts] + MELTING_ERROR * random.normal(size=at.size)
        empty = np.full(at.size, np.nan)
        columns = {
            "bias_V": np.append(case.bias, at),
            "current_mA": np.append(current, empty),
            "surface_K": np.append(nothing, found),
            "surface_error_K": np.append(nothing, np.full(at.size, MELTING_ERROR)),
            "distance_um": np.append(case.distance, 0.0 * at),
        }
        missing = dict.fromkeys(("reader_V", "tip_K", "tip_error_K"), np.append(nothing, empty))
        measured = Measurement(**columns, **missing)
    priors = {name: f"± {100 * share:g}%" for name, share in known.items()}
    result = fit(measured, probe, priors=priors | {INTERFACE: "×/ 10"}, model=model)
    of = result.parameters[INTERFACE]
    error = np.nan if of.stderr is None else of.stderr / of.value
    return float(np.log(of.value / truth[INTERFACE])), error


def main() -> None:
    """Print how far off the resistances are, and how often the bands hold them."""
    count = int(sys.argv[1]) if sys.argv[1:] else 200
    rows = []
    for name in sys.argv[2:] or CASES:
        began = time.process_time()
        off, error = np.array([twin(CASES[name], number) for number in range(count)]).T
        rows.append(
            [
                name,
                f"{count}",
                f"{100 * np.median(np.abs(off)):.1f}",
                f"{100 * np.mean(np.abs(off) < GOOD):.0f}",
                f"{100 * np.mean(np.abs(off) < BAND * error):.1f}",
                f"{np.sqrt(np.mean((off / error) ** 2)):.2f}",
                f"{(time.process_time() - began) / count:.1f}",
            ]
        )
        print(rows[-1], file=sys.stderr)
    heads = ["measured", "twins", "median error (%)", "within 10 % (%)", "held by 95 % (%)"]
    table([*heads, "pulls (rms)", "s each"], rows)


if __name__ == "__main__":
    main()
