"""Measurements made by the model itself, whose parameters are known."""

from __future__ import annotations

from functools import cache

import numpy as np

from hotlever.estimate import Measurement
from hotlever.lever import Lever

TRUTH = {"c_kappa": 0.66, "delta": 0.69, "n_d": 4.6e17, "p": 2.72, "a0": 9.9e-4, "a1": 1.18e-6}
BIAS = np.linspace(1, 11, 13)


@cache
def true_sweep(lever: Lever):
    return lever.with_material(lever.probe.material.with_(**TRUTH)).sweep(BIAS)


def twin(lever: Lever, noise: float = 0.0, seed: int = 5, **settings) -> Measurement:
    """A measurement made by the model itself; noise in units of each largest value.

    That is what the weights of a fit assume.
    """
    sweep = true_sweep(lever)
    rng = np.random.default_rng(seed)

    def noisy(values):
        return values.values + noise * values.values.max() * rng.normal(size=values.size)

    empty = np.full(BIAS.size, np.nan)
    return Measurement(
        BIAS, noisy(sweep.current_mA), noisy(sweep.reader_V), noisy(sweep.tip_K), empty, **settings
    )
