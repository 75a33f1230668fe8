"""The noise model: errors of single data, errors that data have in common, and drifting zeros.

Meters have noise of two kinds: the same everywhere, and in proportion to what they show. Which it
is matters where current varies by a factor of thirty: taken for the same everywhere, noise in
proportion is underestimated where the lever is hot, and good data there are taken for outliers.

What all data of an observable have in common is the scale of its meter or thermometer.

The zero of I_h and of V_r may drift: it is a straight line over the order of the rows, which is
that of time. It enters linearly, so for every trial of the parameters the best one follows at once
(variable projection, Golub and Pereyra, Inverse Problems 19, R1 (2003)).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hotlever.measurement import Measurement
from hotlever.probe.priors import SCALES, Moved, Prior
from hotlever.spieser2017 import RAMAN_ERROR_SHARE
from hotlever.types import Array

#: Shares of the variance that are in proportion to the square of what is shown; of all of it, data
#: near zero would count infinitely.
_SHARES = np.array([0.0, 0.5, 0.8, 0.95, 0.99])
#: Degrees of freedom of the t distribution by which residuals tell the shares: with few of them it
#: does not matter how far off outliers are (Lange, Little and Taylor, J. Am. Stat. Assoc. 84, 881
#: (1989), who take 4). Rounds in which the scale of it is found.
_TAILS, _ROUNDS = 4.0, 20
#: A datum that alone decides a parameter says nothing of its noise.
_LEAST_FREE = 0.05
#: Standard error of a meter's scale, relative.
METERS = 1e-3
#: Rise (K) from which a stated error tells the scale of a thermometer.
_WARM_K = 100.0
#: Observables that have a zero, with the unit it is given in.
ZEROED = {"current": "mA", "reader": "V"}
#: A zero is worth a note beyond this many standard errors.
_NOTICED = 7.0


def relative_noise(difference: Array, shown: Array, used_up: Array, usual: float) -> Array:
    """Return the noise of data relative to its root mean square, (n,); one where there is none.

    Parameters
    ----------
    difference : ndarray, shape (n,)
        Data minus prediction; NaN where nothing was measured.
    shown : ndarray, shape (n,)
        The prediction.
    used_up : ndarray, shape (n,)
        Leverage: the share of each datum's noise that the fit has taken up.
    usual : float
        Scatter that counts as one datum more, in the unit of the data.

    Notes
    -----
    The variance of a datum is s² (1 − w + w y² / ⟨y²⟩). For each of some shares w the scale s is
    that of greatest likelihood; precisions are averaged with the likelihoods of the shares, so
    that data that cannot tell them apart are not forced to.
    """
    here = np.isfinite(difference)
    squares = difference[here] ** 2 / np.maximum(1.0 - used_up[here], _LEAST_FREE)
    size = shown[here] ** 2
    shape = 1.0 - _SHARES[:, None] + _SHARES[:, None] * size / np.mean(size)
    by_shape = np.append(squares / shape, np.full((_SHARES.size, 1), usual**2), axis=1)
    scale = np.median(by_shape, axis=1, keepdims=True) + np.mean(by_shape, axis=1, keepdims=True)
    for _ in range(_ROUNDS):
        counting = (_TAILS + 1.0) / (_TAILS + by_shape / scale)
        scale = np.mean(counting * by_shape, axis=1, keepdims=True)
    tails = 0.5 * (_TAILS + 1.0) * np.log1p(by_shape / (_TAILS * scale))
    likelihood = -tails.sum(axis=1) - 0.5 * np.log(shape * scale).sum(axis=1)
    chance = np.exp(likelihood - likelihood.max())
    precision = np.average(1.0 / (shape * scale), axis=0, weights=chance)
    relative = np.ones(difference.shape)
    relative[here] = np.sqrt(1.0 / (precision * np.mean(1.0 / precision)))
    return relative


@dataclass(frozen=True)
class CommonError:
    """An error that all data of an observable have in common, such as that of a meter's scale.

    Attributes
    ----------
    name, observable : str
    share : float
        Its standard deviation, relative to what it is an error of.
    errors : ndarray, shape (rows of the measurement,)
        Its standard deviations.
    """

    name: str
    observable: str
    share: float
    errors: Array


def errors_of_scales(
    measurement: Measurement,
    observables: Sequence[str],
    priors: Mapping[str, Prior],
    base_temperature_K: float,
) -> list[CommonError]:
    """Return the errors of the meters' and the thermometer's scales, as known before.

    That of a thermometer is relative to the rise above the base. Where no prior says how large it
    is, it is as large as what the measurement states of each temperature, or as the paper's.
    """
    errors = []
    for name, observable in SCALES.items():
        if observable not in observables:
            continue
        shown = np.abs(measurement.observable(observable))
        share = METERS
        if observable == "tip":
            shown = np.abs(shown - base_temperature_K)
            stated = measurement.tip_error_K / np.maximum(shown, _WARM_K)
            is_stated = np.isfinite(stated).any()
            share = float(np.nanmedian(stated)) if is_stated else RAMAN_ERROR_SHARE
        if name in priors:
            share = priors[name].spread
        errors.append(CommonError(name, observable, share, share * shown))
    return errors


class CommonCovariance:
    """What errors in common do to weighted differences, whose own errors are independent.

    With unit variances beside them the covariance is 1 + A Aᵀ, where the columns of A are what
    errors of one standard deviation add. They are of different observables, so that they have no
    rows in common.

    Parameters
    ----------
    errors : sequence of CommonError
    pattern : ndarray, shape (N, errors)
        A.
    """

    def __init__(self, errors: Sequence[CommonError], pattern: Array) -> None:
        self._errors, self._pattern = errors, pattern

    def decorrelated(self, rows: Array) -> Array:
        """Return rows (N, ...) times the inverse root of the covariance."""
        if not self._errors:
            return np.asarray(rows)
        size = np.linalg.norm(self._pattern, axis=0)
        along = self._pattern / np.maximum(size, 1e-300)
        kept = 1.0 / np.sqrt(1.0 + size**2) - 1.0
        return np.asarray(rows + along @ (kept * (along.T @ rows).T).T)

    def told(self, differences: Array, slopes: Array, covariance: Array) -> dict[str, Moved]:
        """Return the errors as the data tell them, by name.

        By weighted differences (N,) as if data had no errors in common, and their slopes (N, p) by
        parameters of which the fit leaves this covariance.
        """
        pattern = self._pattern
        own = np.linalg.inv(np.eye(len(self._errors)) + pattern.T @ pattern)
        size = -own @ pattern.T @ differences
        by = own @ pattern.T @ slopes
        left = np.sqrt(np.diag(own + by @ covariance @ by.T))
        moved = map(Moved, size.tolist(), left.tolist())
        return dict(zip((error.name for error in self._errors), moved, strict=True))


class Drift:
    """Straight lines over the rows of some observables.

    Those of `ZEROED` get a line; `present`, (k, n), says which data there are. Weights, by which
    residuals are multiplied, have the same shape.
    """

    def __init__(self, observables: Sequence[str], present: NDArray[np.bool_]) -> None:
        self._present, self._names = present, tuple(observables)
        order = np.linspace(-1.0, 1.0, present.shape[1])
        self._columns = np.zeros((*present.shape, 2 * len(self._names)))
        for place, name in enumerate(self._names):
            if name in ZEROED:
                self._columns[place, :, 2 * place] = 1.0
                self._columns[place, :, 2 * place + 1] = order
        kept = np.any(self._columns, axis=(0, 1))
        self._columns = self._columns[:, :, kept]

    def line(self, difference: Array, weights: Array) -> Array:
        """Return the lines that fit a difference (data minus prediction) best, shape (k, n)."""
        matrix = (weights[..., None] * self._columns)[self._present]
        target = (weights * difference)[self._present]
        return np.asarray(self._columns @ np.linalg.lstsq(matrix, target)[0])

    def removed(self, matrix: Array, weights: Array) -> Array:
        """Return the columns of a weighted matrix, (N, m), without what lines could take up."""
        basis = np.linalg.qr((weights[..., None] * self._columns)[self._present])[0]
        return np.asarray(matrix - basis @ (basis.T @ matrix))

    def noticed(self, residual: Array, jacobian: Array, weights: Array) -> list[str]:
        """Say which observables have a zero that stands out of the scatter.

        By the weighted residual (data minus prediction, N) at the optimum without lines, and by
        what the parameters could take up instead, (N, m).
        """
        columns = (weights[..., None] * self._columns)[self._present]
        basis = np.linalg.qr(jacobian)[0]
        columns = columns - basis @ (basis.T @ columns)
        try:
            inverse = np.linalg.inv(columns.T @ columns)
        except np.linalg.LinAlgError:
            return []
        sizes = inverse @ (columns.T @ residual)
        rest = residual - columns @ sizes
        # each datum's own variance, as in the covariance of the parameters
        influence = inverse @ columns.T * rest
        errors = np.sqrt((influence**2).sum(axis=1))
        out = np.abs(sizes) > _NOTICED * errors
        return self.in_words(self._columns @ sizes, np.any(self._columns, axis=1) @ out)

    def in_words(self, line: Array, which: NDArray[np.bool_] | None = None) -> list[str]:
        """Describe lines from `line`; some of them, if not all."""
        which = np.any(self._columns, axis=(1, 2)) if which is None else which
        return [
            f"{name}: the zero goes from {first:+.3g} to {last:+.3g} {ZEROED[name]} along the file"
            for name, first, last, asked in zip(
                self._names, *line[:, [0, -1]].T, which, strict=True
            )
            if asked
        ]
