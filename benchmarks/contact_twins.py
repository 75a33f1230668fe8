"""The resistance of an interface from the current of a lever in contact, over simulated data.

python benchmarks/contact_twins.py [COUNT]

Each twin has a resistance of its own, between a tenth and twice what resists beside it, and is
measured at 41 biases with a noise of 1e-4 of the current. `known`: the material of the lever is
known. `priors`: it is known to 0.1 %, by a prior each, as from a fit out of contact.
"""

from __future__ import annotations

import sys

import numpy as np

from hotlever import Measurement, Probe, fit
from hotlever.contact.cone import cold_resistance
from hotlever.contact.law import INTERFACE, ContactLaw
from hotlever.lever import Lever
from hotlever.probe.parameters import usual_parameters
from problems import table

#: Biases (V), noise of the current, and how well the material is known in the second case.
BIAS, NOISE, KNOWN = np.linspace(5.0, 10.5, 41), 1e-4, "±0.1%"
PROBE = Probe.reference().with_(
    **{"tip.height_um": 0.7, "tip.apex_radius_um": 0.02}, sample="glass", interface_K_per_mW=5e3
)


def twin(number: int) -> list[tuple[float, float]]:
    """Return by how much the logarithm is off, and its standard error, known and with priors."""
    random = np.random.default_rng(number)
    law = ContactLaw(PROBE)
    assert PROBE.tip is not None
    beside = law.spreading_K_per_mW + cold_resistance(PROBE.tip, 293.0)
    truth = beside * np.exp(random.uniform(np.log(0.1), np.log(2.0)))
    names = usual_parameters(PROBE)
    usual = dict(zip(names, PROBE.values(names), strict=True))
    off = {name: value * (1 + 1e-3 * random.normal()) for name, value in usual.items()}
    noise = 1.0 + NOISE * random.normal(size=BIAS.size)
    nothing = np.full(BIAS.size, np.nan)
    results = []
    for material in ({}, off):
        lever = Lever(PROBE.with_(**material, interface_K_per_mW=truth))
        current = lever.sweep(BIAS).current_mA.values * noise
        measured = Measurement(BIAS, current, nothing, nothing, nothing)
        if material:
            given = {"priors": dict.fromkeys(names, KNOWN)}
        else:
            given = {"fixed": dict.fromkeys(names)}
        found = fit(measured, PROBE, free=(INTERFACE,), observables=("current",), **given)
        of = found.parameters[INTERFACE]
        results.append((float(np.log(of.value / truth)), of.stderr / of.value))
    return results


def main() -> None:
    """Print how far off the resistances are, and how often the bands hold them."""
    count = int(sys.argv[1]) if sys.argv[1:] else 200
    twins = np.array([twin(number) for number in range(count)])
    rows = []
    for case, name in enumerate(("known", "priors")):
        off, error = twins[:, case].T
        held = np.abs(off) < 1.96 * error
        rows.append(
            [
                name,
                f"{100 * np.median(np.abs(off)):.2f}",
                f"{100 * np.mean(np.abs(off) < 0.1):.0f}",
                f"{100 * held.mean():.0f}",
            ]
        )
    table(["material", "median error (%)", "within 10 % (%)", "held by 95 % (%)"], rows)


if __name__ == "__main__":
    main()
