"""Where a fit starts: found from the data, so that nobody has to guess.

The atlas of a reduced lever predicts a whole measurement in a tenth of a millisecond, to some
ten kelvin: enough to compare many materials with the data, and to improve the best of them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import least_squares

from hotlever.fitting.residuals import Residuals
from hotlever.lever.atlas import Atlas
from hotlever.probe import Probe
from hotlever.types import Array

#: c_κ is sought in this range; the others in their box, and a little beyond.
_C_KAPPA = (0.3, 1.1)
_BEYOND = 0.1
#: Materials compared, and how many of the best are improved.
_COMPARED, _IMPROVED = 64, 3
#: Differences of this share of the largest datum still count in full.
_SOFT = 0.03


def quick_prediction(atlas: Atlas, probe: Probe, bias: Array) -> Array:
    """Return I_h (mA), V_r (V) and T_tip (K) at some biases, (3, n), read off an atlas.

    Beyond its ends the curves go on level.
    """
    lever, current, reader = atlas.shown(probe).T
    rising = np.maximum.accumulate(probe.circuit.bias(lever, current))
    tip = probe.circuit.base_temperature_K + atlas.u**2
    return np.stack([np.interp(bias, rising, values) for values in (current, reader, tip)])


def starting_probe(
    atlas: Atlas, given: Probe, varied: Sequence[str], residuals: Residuals
) -> Probe:
    """Find a probe to start a fit from.

    The parameters that are not varied stay as they are in `given`, itself one of the candidates.
    """
    ranges = atlas.box
    box = [name for name in varied if name in ranges.names]
    scale = [name for name in varied if name == ranges.scale]
    home, places = ranges.place(given), [ranges.names.index(name) for name in box]

    def probe(point: Array) -> Probe:
        shares = home.copy()
        shares[places] = point[: len(box)]
        moved = ranges.values(shares)
        values = {name: moved[name] for name in box}
        low, high = _C_KAPPA
        values |= {name: low + float(point[-1]) * (high - low) for name in scale}
        return given.moved(values)

    def differences(of: Probe) -> Array:
        values = quick_prediction(atlas, of, residuals.bias)[residuals.rows]
        return np.asarray(((values - residuals.data) / residuals.largest)[residuals.present])

    def badness(of: Probe) -> float:
        # one glitch must not decide
        return float(np.sum(np.log1p((differences(of) / _SOFT) ** 2)))

    from scipy.stats import qmc  # takes long, and most fits start elsewhere

    candidates = qmc.Sobol(len(box) + len(scale), seed=0).random(_COMPARED)
    best = sorted(candidates, key=lambda point: badness(probe(point)))[:_IMPROVED]
    improved = [
        least_squares(
            lambda point: differences(probe(point)),
            point,
            bounds=(-_BEYOND, 1.0 + _BEYOND),
            loss="cauchy",
            f_scale=_SOFT,
            x_scale=0.3,
            max_nfev=15,
        ).x
        for point in best
    ]
    return min([given, *map(probe, improved)], key=badness)
