"""Where a fit starts: found from the data, so that nobody has to guess.

The atlas of a reduced lever predicts a whole measurement in a tenth of a millisecond, to some
ten kelvin: enough to compare many materials with the data, and to improve the best of them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.stats import qmc

from hotlever.lever.equations import OBSERVABLES
from hotlever.lever.reduced import ReducedSpace
from hotlever.lever.reduction import BOX, material_in_box, place_in_box
from hotlever.materials import Material
from hotlever.probe.probe import Circuit

Array = NDArray[np.float64]

#: c_κ is sought in this range; the others in their box, and a little beyond.
_C_KAPPA = (0.3, 1.1)
_BEYOND = 0.1
#: Materials compared, and how many of the best are improved.
_COMPARED, _IMPROVED = 64, 3
#: Differences of this share of the largest datum still count in full.
_SOFT = 0.03


class QuickPrediction:
    """A whole measurement, predicted from the atlas of a reduced lever.

    Parameters
    ----------
    space : ReducedSpace
        With an atlas.
    circuit : Circuit
    bias : ndarray, shape (n,)
    """

    def __init__(self, space: ReducedSpace, circuit: Circuit, bias: Array) -> None:
        assert space.atlas is not None
        self._bias, self._kohm = bias, circuit.series_resistance_ohm / 1000.0
        self._atlas, self._stretched = space.atlas, ~space.is_temperature()
        self._tip = circuit.base_temperature_K + space.atlas.grid**2
        # V_l, I_h and V_r as functionals of the unknowns of the atlas
        self._functionals = np.zeros((3, space.size + 2))
        self._functionals[0, -2] = self._functionals[1, -1] = 1.0
        reader = space.reader_weights()
        if reader is not None:
            self._functionals[2, reader[0]] = reader[1]

    def __call__(self, material: Material) -> Array:
        """Return I_h (mA), V_r (V) and T_tip (K), shape (3, n); the ends go on level."""
        lever, current, reader = self._atlas.branch(
            place_in_box(material), self._stretched, material.c_kappa, self._functionals
        )
        bias = np.maximum.accumulate(lever + self._kohm * current)
        return np.stack(
            [np.interp(self._bias, bias, values) for values in (current, reader, self._tip)]
        )


def starting_material(
    space: ReducedSpace,
    circuit: Circuit,
    given: Material,
    varied: Sequence[str],
    bias: Array,
    data: Array,
    scale: Array,
) -> Material:
    """Find a material to start a fit from.

    Parameters
    ----------
    space : ReducedSpace
        Without an atlas the given material is returned.
    circuit : Circuit
    given : Material
        Where the parameters that are not varied stay; itself one of the candidates.
    varied : sequence of str
    bias : ndarray, shape (n,)
    data : ndarray, shape (3, n)
        In the order of `OBSERVABLES`, NaN where nothing was measured or is to be compared.
    scale : ndarray, shape (3, n)
        By which differences are divided.
    """
    if space.atlas is None:
        return given
    quick, present = QuickPrediction(space, circuit, bias), np.isfinite(data)
    box = [name for name in varied if name in BOX]
    free = [*box, *(["c_kappa"] if "c_kappa" in varied else [])]
    home = place_in_box(given)

    def material(point: Array) -> Material:
        shares = home.copy()
        shares[[list(BOX).index(name) for name in box]] = point[: len(box)]
        moved = material_in_box(given, shares) if box else given
        values = {name: getattr(moved, name) for name in box}
        if "c_kappa" in free:
            low, high = _C_KAPPA
            values["c_kappa"] = low + float(point[-1]) * (high - low)
        return given.with_(**values)

    def differences(point: Array) -> Array:
        return np.asarray(((quick(material(point)) - data) / scale)[present])

    def badness(point: Array) -> float:
        # one glitch must not decide
        return float(np.sum(np.log1p((differences(point) / _SOFT) ** 2)))

    candidates = qmc.Sobol(len(free), seed=0).random(_COMPARED)
    best = sorted(candidates, key=badness)[:_IMPROVED]
    improved = [
        least_squares(
            differences,
            point,
            bounds=(-_BEYOND, 1.0 + _BEYOND),
            loss="cauchy",
            f_scale=_SOFT,
            x_scale=0.3,
            max_nfev=15,
        ).x
        for point in best
    ]
    found = min(improved, key=badness)
    known = ((quick(given) - data) / scale)[present]
    if np.sum(np.log1p((known / _SOFT) ** 2)) < badness(found):
        return given
    return material(found)


def aligned(places: Sequence[int], rows: Array) -> Array:
    """Place the rows of some observables among all three, NaN elsewhere."""
    full = np.full((len(OBSERVABLES), *rows.shape[1:]), np.nan)
    full[list(places)] = rows
    return full
