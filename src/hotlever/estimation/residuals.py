"""Data minus prediction, weighted: what fits, profiles and posteriors have in common."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy

import numpy as np

from hotlever.datasets import OBSERVABLES
from hotlever.errors import InputError
from hotlever.estimation.noise import CommonCovariance, CommonError, Drift, relative_noise
from hotlever.estimation.options import Weights
from hotlever.measurement import Measurement
from hotlever.measurement.data import noise_about_neighbours
from hotlever.probe.priors import Moved
from hotlever.types import Array

#: Huber's weights lessen from here on; the others are full up to, and nothing beyond, so many
#: standard deviations: data without outliers keep nearly all of theirs, and their scatter.
_HUBER, _FULL, _NONE = 1.345, 3.5, 6.0
#: What is smooth is no noise: data scatter by so many times as much as about their neighbours at
#: most, or a search would be content with a wrong lever and noisy data. So many data tell.
_OF_NOISE, _TELLING = 4.0, 7


class Residuals:
    """The weighted differences of a measurement from predictions.

    Every observable is divided by its largest measured value, or every datum by its standard error.

    Parameters
    ----------
    measurement : Measurement
    observables, weights, drift
        See `hotlever.estimation.options.FitOptions`. An observable without measurement errors
        begins with a hundredth of its largest value for one, see `take_scatter`.
    data_weights : ndarray, shape (observables, rows of the measurement), optional
        What differences are multiplied by instead, as an earlier fit found it; 0 leaves out.
    common : sequence of CommonError, optional
        Errors that data have in common.

    Attributes
    ----------
    bias : ndarray, shape (n,)
        Of the rows that have data (V).
    along, unit : ndarray, shape (n,), and str
        What tells these rows apart: their bias (V), or their time (µs).
    rows : list of int
        Places of the observables among `OBSERVABLES`.
    data, present : ndarray, shape (observables, n)
        NaN where nothing was measured; which data count.
    largest : ndarray, shape (observables, 1)
    down : ndarray, shape (observables, n)
        By how much a robust fit has lessened the weight of each datum: one where it has not.
    without_errors : ndarray of bool, shape (observables,)
        Observables that are to take their scatter for their error.

    Raises
    ------
    InputError
        If all values of an observable are zero, or only some of its data have errors.
    """

    def __init__(
        self,
        measurement: Measurement,
        observables: Sequence[str],
        weights: Weights = "maximum",
        drift: bool = False,
        data_weights: Array | None = None,
        common: Sequence[CommonError] = (),
    ) -> None:
        self._measurement, self._drift = measurement, drift
        self._where = measurement.path or "measurement"
        self.observables = tuple(observables)
        self.rows = [list(OBSERVABLES).index(name) for name in observables]
        every = np.stack([measurement.observable(name) for name in observables])
        self._used = np.isfinite(every).any(axis=0)
        self.bias, self.data = measurement.bias_V[self._used], every[:, self._used]
        along, self.unit = measurement.along
        self.along = along[self._used]
        self.present = np.isfinite(self.data)
        self.largest = np.nanmax(np.abs(self.data), axis=1, keepdims=True)
        for name, size in zip(observables, self.largest, strict=True):
            if size == 0:
                raise InputError(f"{self._where}: all values of {name} are 0")
        self.without_errors = np.zeros(len(self.rows), dtype=bool)
        self.errors_known = weights == "errors" and data_weights is None
        rows = measurement.rows
        #: Of how many rows each is the mean, as a root: by it errors are smaller.
        self._root = np.ones(self.bias.size) if rows is None else np.sqrt(rows[self._used])
        self._scale = self.largest / self._root
        self.down = np.ones(self.data.shape)
        # the noise of each datum over that of its observable
        self._relative = np.ones(self.data.shape)
        if self.errors_known:
            self._scale = self._measured_errors()
        if data_weights is not None:
            self._scale, self.down = np.ones(self.data.shape), data_weights[:, self._used]
            self.present = self.present & (self.down > 0)
        self._lines = Drift(observables, self.present)
        self.common, self._common = common, np.zeros((*self.data.shape, len(common)))
        for number, error in enumerate(common):
            row = self.observables.index(error.observable)
            self._common[row, :, number] = error.errors[self._used]

    def _measured_errors(self) -> Array:
        """Return the standard error of every datum; a hundredth of the largest where unknown."""
        errors = np.stack([self._measurement.error(n)[self._used] for n in self.observables])
        usable = errors > 0
        for row, name in enumerate(self.observables):
            missing = self.along[self.present[row] & ~usable[row]]
            if usable[row].any() and missing.size:
                raise InputError(
                    f"{self._where}: {name} has no error above 0 at {missing[0]:g} {self.unit}, "
                    "expected one for each of its values or none at all"
                )
        self.without_errors = np.all(np.isnan(errors), axis=1)
        guessed = 0.01 * self.largest / self._root
        return np.where(np.isfinite(errors), errors, guessed)

    def afresh(self) -> Residuals:
        """Return the same with weights of its own, as before outliers were weighed."""
        own = copy(self)
        own.down, own._relative = np.ones(self.data.shape), self._relative.copy()
        return own

    @property
    def shown(self) -> Array:
        """All that was measured at these rows, fitted or not, (3, n)."""
        every = [self._measurement.observable(name)[self._used] for name in OBSERVABLES]
        return np.stack(every)

    @property
    def size(self) -> int:
        """How many data count."""
        return int(self.present.sum())

    @property
    def different(self) -> int:
        """How many of them are at different places: the same again tells of noise only."""
        return sum(np.unique(self.along[row]).size for row in self.present)

    @property
    def by(self) -> Array:
        """What differences are multiplied by, shape (observables, n)."""
        return np.asarray(self.down / self._scale)

    @property
    def data_weights(self) -> Array:
        """The same in all rows of the measurement; 0 for what is left out."""
        full = np.zeros((len(self.rows), self._used.size))
        full[:, self._used] = np.where(self.present, self.by, 0.0)
        return full

    # --- for predicted values (3, n) and slopes (3, n, p) ---------------------------------------

    def difference(self, values: Array) -> Array:
        """Return data minus prediction minus drifting zeros, NaN where nothing was measured."""
        difference: Array = self.data - values[self.rows]
        return difference - self._lines.line(difference, self.by) if self._drift else difference

    def weighted(self, values: Array) -> Array:
        """Return the weighted differences, prediction minus data, shape (N,)."""
        return self._common_covariance.decorrelated(self._each(values))

    def jacobian(self, slopes: Array) -> Array:
        """Return the derivatives of `weighted`, shape (N, p)."""
        return self._common_covariance.decorrelated(self._each_by(slopes))

    def _each(self, values: Array) -> Array:
        """Return weighted differences as if data had no errors in common, (N,)."""
        return np.asarray((-self.by * self.difference(values))[self.present])

    def _each_by(self, slopes: Array) -> Array:
        """Return the derivatives of `_each`, (N, p)."""
        jacobian = (self.by[:, :, None] * slopes[self.rows])[self.present]
        return self._lines.removed(jacobian, self.by) if self._drift else np.asarray(jacobian)

    @property
    def _common_covariance(self) -> CommonCovariance:
        pattern = np.nan_to_num((self.by[..., None] * self._common)[self.present])
        return CommonCovariance(self.common, pattern)

    def in_common(self, values: Array, slopes: Array, covariance: Array) -> dict[str, Moved]:
        """Return the errors that data have in common as the data tell them.

        The slopes (3, n, p) are those by parameters of which the fit leaves this covariance.
        """
        each = self._each(values), self._each_by(slopes)
        return self._common_covariance.told(*each, covariance)

    def deviations(self, values: Array) -> Array:
        """Return differences in units of the scatter of their observable; 0 where nothing is.

        Data may be off by their own errors, if they have some.
        """
        difference = self.difference(values) * self._root / self._relative
        scatter = 1.4826 * np.nanmedian(np.abs(difference), axis=1, keepdims=True)
        # data without noise have no scatter to measure against
        least = np.broadcast_to(1e-4 * self.largest, difference.shape)
        if self.errors_known:
            least = np.where(self.without_errors[:, None], least, self._scale * self._root)
        return np.nan_to_num(difference / np.maximum(scatter, least))

    def has_outliers(self, values: Array) -> bool:
        """Whether weights that forget outliers would lessen that of any datum."""
        return bool((np.abs(self.deviations(values)) > _FULL).any())

    def drifting_zeros(self, values: Array, slopes: Array) -> list[str]:
        """Say how the zeros drift, or that they seem to."""
        if self._drift:
            return self._lines.in_words(self._lines.line(self.data - values[self.rows], self.by))
        if self.size <= slopes.shape[2] + 2 * len(self.rows):
            return []
        noticed = self._lines.noticed(-self.weighted(values), self.jacobian(slopes), self.by)
        return [f"{text}; --drift would take that out" for text in noticed]

    def lessen(self, values: Array, gently: bool) -> None:
        """Lessen the weight of data far from a prediction.

        Gently, by Huber's weights, with which a fit has one optimum; or by some that forget
        outliers.
        """
        size = np.abs(self.deviations(values))
        forgetful = np.clip((_NONE - size) / (_NONE - _FULL), 0.0, 1.0)
        self.down = np.sqrt(_HUBER / np.maximum(size, _HUBER)) if gently else forgetful

    def take_scatter(self, values: Array, used_up: Array | float = 0.0, usual: float = 0.0) -> None:
        """Give observables without measurement errors their scatter about a prediction.

        A fit has used up some share of each datum, (observables, n). Outliers count as
        little as they weigh. The `usual` scatter, a share of the largest value, counts as one
        datum more: a few data say little of their own. With it the noise may go with the size of
        what is shown (`hotlever.estimation.noise`), and is not what is smooth; without it is the
        same everywhere.
        """
        weight = np.where(self.present, self.down**2, 0.0)
        difference = self.difference(values) * self._root
        used_up = np.broadcast_to(used_up, difference.shape)
        if usual:
            for row in np.flatnonzero(self.without_errors):
                self._relative[row] = relative_noise(
                    difference[row],
                    values[self.rows[row]],
                    used_up[row],
                    usual * float(self.largest[row, 0]),
                )
        squares = np.nansum(weight * (difference / self._relative) ** 2, axis=1, keepdims=True)
        count = weight.sum(axis=1, keepdims=True)
        if usual:
            squares, count = squares + (usual * self.largest) ** 2, count + 1.0
        free = np.maximum(count - used_up.sum(axis=1, keepdims=True), 1.0)
        scatter = np.maximum(np.sqrt(squares / free), 1e-6 * self.largest)
        if usual:
            least = usual * self.largest
            scatter = np.minimum(scatter, np.maximum(_OF_NOISE * self._noise(difference), least))
        self._scale = np.where(
            self.without_errors[:, None], scatter * self._relative / self._root, self._scale
        )

    def noise_squares(self, values: Array) -> float:
        """Return the mean square of weighted noise, as data scatter about their neighbours.

        Few data, which do not tell, are taken to scatter as they do about a prediction (3, n).
        """
        difference = self.difference(values)
        weighted = np.nan_to_num(self.by * difference)
        every = np.sqrt(np.sum(weighted**2, axis=1) / np.maximum(self.present.sum(axis=1), 1))
        mean = np.sqrt(np.nanmean(np.where(self.present, self.by, np.nan) ** 2, axis=1))
        noise = np.minimum(self._noise(difference * self._root)[:, 0] * mean, every)
        return float(np.average(noise**2, weights=self.present.sum(axis=1)))

    @property
    def normalisation(self) -> float:
        """Minus twice the logarithm of the normal densities' factors, beside the squares.

        An outlier counts as one that is just so far off that it is left out.
        """
        each = 2.0 * np.log(self._scale) + _NONE**2 * (1.0 - self.down**2)
        return float(np.sum(np.broadcast_to(each, self.data.shape)[self.present]))

    @property
    def unit_weight(self) -> float:
        """The largest weighted value of an observable: one, unless weights are those of errors."""
        return float(np.max(np.where(self.present, self.by * self.largest, 0.0)))

    def _noise(self, difference: Array) -> Array:
        """Return how much data scatter about their neighbours, (observables, 1).

        Infinite where few data do not tell.
        """
        ordered = (difference / self._relative)[:, np.argsort(self.along, kind="stable")]
        present = [row[np.isfinite(row)] for row in ordered]
        noise = [noise_about_neighbours(row) if row.size >= _TELLING else np.inf for row in present]
        return np.array(noise)[:, None]

    def rms(self, values: Array) -> dict[str, float]:
        """Return the rms of data minus prediction by column, for every observable with data."""
        difference = self.shown - values
        difference[self.rows] = self.difference(values)
        return {
            column.name: float(np.sqrt(np.nanmean(row**2)))
            for column, row in zip(OBSERVABLES.values(), difference, strict=True)
            if np.isfinite(row).any()
        }

    def reduced_chi_square(self, values: Array, varied: int) -> float | None:
        """Return that of the observables with measurement errors; None without."""
        if not self.errors_known or self.without_errors.all():
            return None
        weighted = (self.difference(values) / self._scale)[~self.without_errors]
        count = np.isfinite(weighted).sum()
        return float(np.nansum(weighted**2) / max(count - varied * count / self.size, 1.0))
