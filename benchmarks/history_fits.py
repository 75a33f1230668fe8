"""How well what is measured in time tells the tip temperature, without any spectrum.

    python benchmarks/history_fits.py [NOISE]

Standard errors, linearised at the reference lever, of the tip at the end of a pulse and of the
scale of the heat capacity: by the current alone or with the reader, in the pulse or at rest (25
biases up to 10 V), with what is known beforehand or without. Every datum has the same noise, a
share of the largest (1e-3 by default). The drawing is taken as known, for there are no derivatives
in time by dimensions.
"""

from __future__ import annotations

import sys

import numpy as np
import xarray as xr

from hotlever.lever.lever import COARSE, Lever
from hotlever.lever.transient import pulse
from hotlever.lever.transient.sensitivities import with_sensitivities
from hotlever.materials import PARAMETERS
from hotlever.probe import Probe
from hotlever.probe.priors import default_priors
from hotlever.quantities import observables_of
from problems import table

NOISE = float(sys.argv[1]) if len(sys.argv) > 1 else 1e-3
HEIGHT, LENGTH = 10.0, 100.0
TIMES = np.geomspace(0.1, LENGTH, 40)
BIASES = np.linspace(0.4, 10.0, 25)
NAMES = (*PARAMETERS, "series_resistance_ohm", "heat_capacity_scale")
HEAT_CAPACITY = 0.03


def shown(data: xr.Dataset) -> np.ndarray:
    """Return the observables, (3, n)."""
    return observables_of(data)


def information(values: np.ndarray, slopes: np.ndarray, places: list[int]) -> np.ndarray:
    """Return the Fisher information of some observables, (3, n) and (3, n, p)."""
    size = np.abs(values[places]).max(axis=1)[:, None, None]
    rows = (slopes[places] / (NOISE * size)).reshape(-1, len(NAMES))
    return rows.T @ rows


def main() -> None:
    probe = Probe.reference()
    lever = Lever(probe, COARSE)
    history = with_sensitivities(lever, pulse(HEIGHT, LENGTH), TIMES, NAMES)
    values = shown(history)
    slopes = history.sensitivity.values
    rest = lever.sweep(BIASES, sensitivities=True)
    at_rest, around = shown(rest), []
    for share in (1.0, -1.0):
        ohm = probe.circuit.series_resistance_ohm + share
        around.append(shown(lever.with_probe(probe.with_(series_resistance_ohm=ohm)).sweep(BIASES)))
    by_rest = np.zeros((*at_rest.shape, len(NAMES)))
    by_rest[..., : len(PARAMETERS)] = rest.sensitivity.values
    by_rest[..., len(PARAMETERS)] = (around[0] - around[1]) / 2.0
    priors = default_priors(probe)
    spread = np.array([priors[name].absolute for name in NAMES[:-1]] + [HEAT_CAPACITY])
    beforehand = np.diag(spread**-2.0)
    tip, scale = slopes[2, -1], probe.values(NAMES)
    rows = []
    for what, places in (("current", [0]), ("current and reader", [0, 1])):
        moving = information(values, slopes, places)
        still = information(at_rest, by_rest, places)
        for data, told in (
            ("in the pulse, nothing beforehand", moving),
            ("in the pulse", moving + beforehand),
            ("at rest", still + beforehand),
            ("both", moving + still + beforehand),
        ):
            scaled = np.linalg.pinv(told * np.outer(scale, scale), rcond=1e-15, hermitian=True)
            covariance = scaled * np.outer(scale, scale)
            error = np.sqrt(tip @ covariance @ tip)
            rows.append((what, data, f"{error:.1f}", f"{100 * np.sqrt(covariance[-1, -1]):.2f}"))
    rows.append(
        ("nothing", "beforehand", f"{np.sqrt(tip**2 @ spread**2):.1f}", f"{100 * spread[-1]:.2f}")
    )
    print(
        f"Pulse of {HEIGHT:g} V for {LENGTH:g} µs: the tip ends at {values[2, -1]:.0f} K. "
        f"Noise {NOISE:g} of the largest.\n"
    )
    table(("measured", "when", "error of the tip (K)", "of the heat capacity (%)"), rows)


if __name__ == "__main__":
    main()
