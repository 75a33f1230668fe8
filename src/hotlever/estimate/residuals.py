"""Data minus prediction, weighted: what fits, profiles and posteriors have in common.

Meters have noise of two kinds: the same everywhere, and in proportion to what they show. Which it
is matters where current varies by a factor of thirty: taken for the same everywhere, noise in
proportion is underestimated where the lever is hot, and good data there are taken for outliers.
What all data of an observable have in common is the scale of its meter or thermometer.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hotlever.errors import InputError
from hotlever.estimate.options import DataNoiseOptions, Numerics, Weights
from hotlever.measurement import Measurement
from hotlever.measurement.data import noise_about_neighbours
from hotlever.probe.priors import SCALES, USUAL_SCALES, Prior, PriorShift
from hotlever.quantities import FITTED, OBSERVABLES
from hotlever.types import Array


def relative_noise(
    difference: Array,
    predicted: Array,
    leverage: Array,
    least: float,
    options: DataNoiseOptions | None = None,
) -> Array:
    """Return the noise of data relative to its root mean square, (n,); one where there is none.

    Parameters
    ----------
    difference : ndarray, shape (n,)
        Data minus prediction; NaN where nothing was measured.
    predicted : ndarray, shape (n,)
        The prediction.
    leverage : ndarray, shape (n,)
        The share of each datum's noise that the fit has taken up.
    least : float
        Counts as one datum more, in the unit of the data.
    options : DataNoiseOptions, optional

    Notes
    -----
    The variance of a datum is s² (1 − w + w y² / ⟨y²⟩). For each of some shares w the scale s is
    that of greatest likelihood; precisions are averaged with the likelihoods of the shares, so
    that data that cannot tell them apart are not forced to.
    """
    options = options or DataNoiseOptions()
    shares, freedom = np.array(options.shares), options.freedom
    here = np.isfinite(difference)
    squares = difference[here] ** 2 / np.maximum(1.0 - leverage[here], options.least_free)
    size = predicted[here] ** 2
    shape = 1.0 - shares[:, None] + shares[:, None] * size / np.mean(size)
    by_shape = np.append(squares / shape, np.full((shares.size, 1), least**2), axis=1)
    scale = np.median(by_shape, axis=1, keepdims=True) + np.mean(by_shape, axis=1, keepdims=True)
    for _ in range(options.rounds):
        counting = (freedom + 1.0) / (freedom + by_shape / scale)
        scale = np.mean(counting * by_shape, axis=1, keepdims=True)
    tails = 0.5 * (freedom + 1.0) * np.log1p(by_shape / (freedom * scale))
    likelihood = -tails.sum(axis=1) - 0.5 * np.log(shape * scale).sum(axis=1)
    chance = np.exp(likelihood - likelihood.max())
    precision = np.average(1.0 / (shape * scale), axis=0, weights=chance)
    relative = np.ones(difference.shape)
    relative[here] = np.sqrt(1.0 / (precision * np.mean(1.0 / precision)))
    return relative


def steepness_of(bias_V: Array, data: Array) -> Array:
    """Return by how much data (observables, n) change with a share of the bias, (observables, n).

    That is the greater of the changes from the row before and to the one after, in the order in
    which rows were measured, beyond the largest value, by which a resistor's would change at most:
    on one side of a jump data do not tell how far it is.
    """
    steepness = np.zeros(data.shape)
    size = np.abs(bias_V)
    for own, values in zip(steepness, data, strict=True):
        rows = np.flatnonzero(np.isfinite(values) & (size > 0))
        way, change = np.abs(np.diff(np.log(size[rows]))), np.abs(np.diff(np.abs(values[rows])))
        # rows of one bias differ by noise, or by what else was changed
        rate = np.where(way > 1e-3, change / np.maximum(way, 1e-3), 0.0)
        either = np.maximum(np.append(rate, 0.0), np.append(0.0, rate))
        own[rows] = np.maximum(either - np.abs(values[rows]).max(initial=0.0), 0.0)
    return steepness


class DataErrors:
    """Standard errors of data, each by itself, and how little outliers count.

    Differences are data minus prediction, (observables, n), NaN where nothing was measured.

    Parameters
    ----------
    present : ndarray of bool, shape (observables, n)
        Which data count.
    largest : ndarray, shape (observables, 1)
        The largest value of each observable: the error of each datum, unless it is known better.
    along : ndarray, shape (n,)
        By which data have neighbours.
    root : ndarray, shape (n,)
        Of how many rows of a file each is the mean, as a root: by it errors are smaller.
    steepness : ndarray, shape (observables, n)
        By how much data change with a share of the bias, see `steepness_of`.
    measured : ndarray, shape (observables, n), optional
        Standard errors. An observable without them begins with a hundredth of its largest value.
    options : DataNoiseOptions, optional

    Attributes
    ----------
    scale : ndarray, shape (observables, n)
        The standard errors.
    down : ndarray, shape (observables, n)
        By how much a robust fit has lessened the weight of each datum: one where it has not.
    measured : bool
        Whether errors were measured.
    without : ndarray of bool, shape (observables,)
        Observables that are to take their scatter for their error.
    """

    def __init__(
        self,
        present: NDArray[np.bool_],
        largest: Array,
        along: Array,
        root: Array,
        steepness: Array,
        measured: Array | None = None,
        options: DataNoiseOptions | None = None,
    ) -> None:
        self._options = options or DataNoiseOptions()
        self.present, self.largest, self._root = present, largest, root
        self._steepness = steepness
        self._order = np.argsort(along, kind="stable")
        self.measured, self.without = measured is not None, np.zeros(len(present), dtype=bool)
        self.scale = np.broadcast_to(largest / root, present.shape)
        if measured is not None:
            self.without = np.all(np.isnan(measured), axis=1)
            self.scale = np.where(np.isfinite(measured), measured, 0.01 * largest / root)
        # what was stated, and what a model is off by beside it
        self._stated, self._discrepancy = self.scale, np.zeros(present.shape)
        self.down = np.ones(present.shape)
        # the noise of each datum over that of its observable
        self._relative = np.ones(present.shape)

    def fix(self, weights: Array) -> None:
        """Take the weights that a fit has found, (observables, n); 0 leaves out."""
        self.scale, self.down = np.ones(weights.shape), weights
        self.present = self.present & (weights > 0)

    def afresh(self) -> DataErrors:
        """Return the same as before outliers were weighed."""
        own = copy(self)
        own.down, own._relative = np.ones(self.down.shape), self._relative.copy()
        return own

    @property
    def weights(self) -> Array:
        """What differences are multiplied by, (observables, n)."""
        return np.asarray(self.down / self.scale)

    def deviations(self, difference: Array) -> Array:
        """Return differences in units of the scatter of their observable; 0 where nothing is.

        Data may be off by their own errors, if they have some.
        """
        difference = difference * self._root / self._relative
        scatter = 1.4826 * np.nanmedian(np.abs(difference), axis=1, keepdims=True)
        # data without noise have no scatter to measure against
        least = np.broadcast_to(1e-4 * self.largest, difference.shape)
        if self.measured:
            least = np.where(self.without[:, None], least, self.scale * self._root)
        return np.nan_to_num(difference / np.maximum(scatter, least))

    def has_outliers(self, difference: Array) -> bool:
        """Whether weights that forget outliers would lessen that of any datum."""
        return bool((np.abs(self.deviations(difference)) > self._options.full_weight).any())

    def lessen(self, difference: Array, gently: bool) -> None:
        """Lessen the weight of data far from a prediction.

        Gently, by Huber's weights, with which a fit has one optimum; or by some that forget
        outliers.
        """
        size, options = np.abs(self.deviations(difference)), self._options
        if gently:
            self.down = np.sqrt(options.huber / np.maximum(size, options.huber))
        else:
            full, none = options.full_weight, options.no_weight
            self.down = np.clip((none - size) / (none - full), 0.0, 1.0)

    def take_scatter(
        self,
        difference: Array,
        predicted: Array,
        leverage: Array | float = 0.0,
        discrepancy: float = 0.0,
    ) -> None:
        """Give observables without measurement errors their scatter about a prediction.

        Outliers count as little as they weigh. The `leverage`, (observables, n), is the share of
        each datum's noise that a fit has taken up. The `discrepancy` is by how much a model is off
        that describes the data, a share of the largest value, and of the bias: it is an error of
        every datum beside its scatter, or beside what was measured of it. With it the noise may go
        with the size of what is predicted (see `relative_noise`), and is not what is smooth;
        without it is the same
        everywhere.
        """
        weight = np.where(self.present, self.down**2, 0.0)
        difference = difference * self._root
        leverage = np.broadcast_to(leverage, difference.shape)
        least = discrepancy * self.largest
        options = self._options
        if discrepancy:
            for row in np.flatnonzero(self.without):
                self._relative[row] = relative_noise(
                    difference[row], predicted[row], leverage[row], float(least[row, 0]), options
                )
        squares = np.nansum(weight * (difference / self._relative) ** 2, axis=1, keepdims=True)
        free = np.maximum(np.sum(weight - leverage, axis=1, keepdims=True), 1.0)
        scatter = np.maximum(np.sqrt(squares / free), 1e-6 * self.largest)
        if discrepancy:
            of_noise = options.most_of_noise * self._noise(difference)
            most = np.maximum(of_noise, options.most_of_discrepancy * least)
            scatter = np.minimum(scatter, most)
        # the mean of many rows of a file has less noise, but no better model
        self._discrepancy = np.hypot(self._relative * least, discrepancy * self._steepness)
        noise = np.where(self.without[:, None], self._relative * scatter / self._root, self._stated)
        self.scale = np.hypot(noise, self._discrepancy)

    def degrees_of_freedom(self, leverage: Array) -> Array:
        """Return those of the errors of each observable, (observables,); infinite of stated ones.

        A scatter has as many as data count, less what a fit has taken up. Those of its sum with a
        discrepancy, which is no estimate, follow from Welch and Satterthwaite's equation.
        """
        count = np.sum(np.where(self.present, self.down**2, 0.0), axis=1)
        free = np.maximum(count - leverage.sum(axis=1), 1.0)
        estimated = 1.0 - (self._discrepancy / self.scale) ** 2
        share = np.mean(estimated, axis=1, where=self.present)
        with np.errstate(divide="ignore"):
            free = free / share**2
        return np.where(self.without | (not self.measured), free, np.inf)

    def noise_squares(self, difference: Array) -> float:
        """Return the mean square of weighted noise, as data scatter about their neighbours.

        Few data, which do not tell, are taken to scatter as they do about a prediction.
        """
        count, weights = self.present.sum(axis=1), self.weights
        squares = np.nan_to_num(weights * difference) ** 2
        every = np.sqrt(np.sum(squares, axis=1) / np.maximum(count, 1))
        # neighbours tell the noise of a row of a file, of which a datum may be the mean of many
        of_row = np.where(self.present, weights / self._root, np.nan)
        mean = np.sqrt(np.nanmean(of_row**2, axis=1))
        noise = np.minimum(self._noise(difference * self._root)[:, 0] * mean, every)
        return float(np.average(noise**2, weights=count))

    def _noise(self, difference: Array) -> Array:
        """Return how much data scatter about their neighbours, (observables, 1).

        Infinite where few data do not tell.
        """
        ordered = (difference / self._relative)[:, self._order]
        present = [row[np.isfinite(row)] for row in ordered]
        fewest = self._options.fewest_neighbours
        noise = [noise_about_neighbours(row) if row.size >= fewest else np.inf for row in present]
        return np.array(noise)[:, None]

    @property
    def normalisation(self) -> float:
        """Minus twice the logarithm of the normal densities' factors, beside the squares.

        An outlier counts as one that is just so far off that it is left out.
        """
        each = 2.0 * np.log(self.scale) + self._options.no_weight**2 * (1.0 - self.down**2)
        return float(np.sum(each[self.present]))

    @property
    def unit_weight(self) -> float:
        """The largest weighted value of an observable: one, unless weights are those of errors."""
        return float(np.max(np.where(self.present, self.weights * self.largest, 0.0)))

    def reduced_chi_square(self, difference: Array, leverage: Array) -> float | None:
        """Return that of the observables with measurement errors, by these; None without.

        The `leverage`, (observables, n), is the share of each datum's noise that a fit has taken
        up: with priors that is less than a datum for each parameter.
        """
        if not self.measured or self.without.all():
            return None
        weighted = (difference / self._stated)[~self.without]
        free = np.isfinite(weighted).sum() - np.nansum(leverage[~self.without])
        return float(np.nansum(weighted**2) / max(free, 1.0))


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

    That of a thermometer is relative to the rise above the base. A prior says how large it is, else
    the measurement, else it is the usual one. What a measurement states of each temperature is no
    part of it.
    """
    errors = []
    for name, observable in SCALES.items():
        if observable not in observables:
            continue
        magnitudes, share = np.abs(measurement.observable(observable)), USUAL_SCALES[name]
        if OBSERVABLES[observable].is_temperature:
            magnitudes = np.abs(magnitudes - base_temperature_K)
        if observable == "tip" and measurement.raman_scale is not None:
            share = measurement.raman_scale
        if name in priors:
            share = priors[name].spread
        errors.append(CommonError(name, observable, share, share * magnitudes))
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
        eigenvalue_changes = 1.0 / np.sqrt(1.0 + size**2) - 1.0
        return np.asarray(rows + along @ (eigenvalue_changes * (along.T @ rows).T).T)

    def of_errors(self, rows: Array) -> tuple[Array, dict[str, Array]]:
        """Return how estimates follow errors of one standard deviation, independent of each other.

        By decorrelated rows (N, p) of which each tells how an estimate follows a datum: for the
        errors of single data (N, p), and by name for the data's scales, (1, p) each.
        """
        own = self.decorrelated(rows)
        names = (error.name for error in self._errors)
        # a meter that is known to show too much has data that are corrected downwards
        return own, dict(zip(names, np.expand_dims(-self._pattern.T @ own, 1), strict=True))

    def sizes(self, differences: Array) -> Array:
        """Return the errors that explain weighted differences (N,) best, in standard deviations."""
        return np.asarray(-self._left @ (self._pattern.T @ differences))

    @property
    def _left(self) -> Array:
        """The covariance of the errors after data without unknown parameters."""
        precision = np.eye(len(self._errors)) + self._pattern.T @ self._pattern
        return np.asarray(np.linalg.inv(precision), dtype=float)

    def leverage(self, rows: Array, covariance: Array) -> Array:
        """Return the share of each datum's noise that parameters and these errors take up, (N,).

        By decorrelated slopes (N, p), and the covariance of the parameters that a fit leaves.
        """
        own = self.decorrelated(rows)
        common_leverage = np.einsum("ij,jk,ik->i", self._pattern, self._left, self._pattern)
        return np.asarray(common_leverage + np.einsum("ij,jk,ik->i", own, covariance, own))

    def estimates(
        self, differences: Array, slopes: Array, covariance: Array
    ) -> dict[str, PriorShift]:
        """Return the errors as the data tell them, by name.

        By weighted differences (N,) as if data had no errors in common, and their slopes (N, p) by
        parameters of which the fit leaves this covariance.
        """
        by = self.sizes(slopes)
        left = np.sqrt(np.diag(self._left + by @ covariance @ by.T))
        shifts = map(PriorShift, self.sizes(differences).tolist(), left.tolist())
        return dict(zip((error.name for error in self._errors), shifts, strict=True))


# --- data minus prediction ------------------------------------------------------------------------


class Residuals:
    """The weighted differences of a measurement from predictions.

    Every observable is divided by its largest measured value, or every datum by its standard error.

    Parameters
    ----------
    measurement : Measurement
    observables, weights
        See `hotlever.estimate.options.FitOptions`. An observable without measurement errors
        begins with a hundredth of its largest value for one, see `take_scatter`.
    data_weights : ndarray, shape (observables, rows of the measurement), optional
        What differences are multiplied by instead, as an earlier fit found it; 0 leaves out.
    common : sequence of CommonError, optional
        Errors that data have in common.
    numerics : Numerics, optional

    Attributes
    ----------
    bias : ndarray, shape (n,)
        Of the rows that have data (V).
    along, unit : ndarray, shape (n,), and str
        What tells these rows apart: their bias (V), or their time (µs).
    distance_um : ndarray, shape (n,), or None
        From the apex to a sample, at most 0 in contact.
    rows : list of int
        Places of the observables among `FITTED`.
    data, present : ndarray, shape (observables, n)
        NaN where nothing was measured; which data count.
    largest : ndarray, shape (observables, 1)
    errors : DataErrors
        What the data may be off by, each by itself.
    common : sequence of CommonError
    numerics : Numerics
        What steers an estimate by these data.

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
        data_weights: Array | None = None,
        common: Sequence[CommonError] = (),
        numerics: Numerics | None = None,
    ) -> None:
        self.numerics = numerics or Numerics()
        self._measurement = measurement
        self._where = measurement.path or "measurement"
        self.observables = tuple(observables)
        self.rows = [list(FITTED).index(name) for name in observables]
        every = np.stack([measurement.observable(name) for name in observables])
        self._used = np.isfinite(every).any(axis=0)
        self.bias, self.data = measurement.bias_V[self._used], every[:, self._used]
        along, self.unit = measurement.along
        self.along = along[self._used]
        distance = measurement.distance_um
        self.distance_um = None if distance is None else np.nan_to_num(distance[self._used])
        self.present = np.isfinite(self.data)
        self.largest = np.nanmax(np.abs(self.data), axis=1, keepdims=True)
        for name, size in zip(observables, self.largest, strict=True):
            if size == 0:
                raise InputError(f"{self._where}: all values of {name} are 0")
        rows = measurement.rows
        root = np.ones(self.bias.size) if rows is None else np.sqrt(rows[self._used])
        measured = self._measured_errors() if weights == "errors" and data_weights is None else None
        at_rest = measurement.time_us is None
        steepness = steepness_of(self.bias, self.data) if at_rest else np.zeros(self.data.shape)
        of_noise = self.numerics.noise
        self.errors = DataErrors(
            self.present, self.largest, self.along, root, steepness, measured, of_noise
        )
        if data_weights is not None:
            self.errors.fix(data_weights[:, self._used])
            self.present = self.errors.present
        self.common, self._common = common, np.zeros((*self.data.shape, len(common)))
        for number, error in enumerate(common):
            row = self.observables.index(error.observable)
            self._common[row, :, number] = error.errors[self._used]

    def _measured_errors(self) -> Array:
        """Return the standard error of every datum; NaN of an observable that has none."""
        errors = np.stack(
            [
                self._measurement.observable(name, error=True)[self._used]
                for name in self.observables
            ]
        )
        usable = errors > 0
        for row, name in enumerate(self.observables):
            missing = self.along[self.present[row] & ~usable[row]]
            if usable[row].any() and missing.size:
                raise InputError(
                    f"{self._where}: {name} has no error above 0 at {missing[0]:g} {self.unit}, "
                    "expected one for each of its values or none at all"
                )
        return errors

    def afresh(self) -> Residuals:
        """Return the same with weights of its own, as before outliers were weighed."""
        own = copy(self)
        own.errors = self.errors.afresh()
        return own

    @property
    def measured(self) -> Array:
        """All that was measured at these rows, fitted or not, (observables, n)."""
        every = [self._measurement.observable(name)[self._used] for name in FITTED]
        return np.stack(every)

    @property
    def at_rest(self) -> tuple[Array, Array, Array | None]:
        """The biases of these rows, what was measured there, and how far from a sample."""
        return self.bias, self.measured, self.distance_um

    @property
    def size(self) -> int:
        """How many data count."""
        return int(self.present.sum())

    @property
    def different(self) -> int:
        """How many of them are at different places: the same again tells of noise only."""
        distance = np.zeros(self.along.size) if self.distance_um is None else self.distance_um
        settings = np.stack([self.along, distance])
        return sum(np.unique(settings[:, row], axis=1).shape[1] for row in self.present)

    @property
    def data_weights(self) -> Array:
        """The same in all rows of the measurement; 0 for what is left out."""
        full = np.zeros((len(self.rows), self._used.size))
        full[:, self._used] = np.where(self.present, self.errors.weights, 0.0)
        return full

    # --- for predicted values (observables, n) and slopes (observables, n, p) -------------------

    def difference(self, values: Array) -> Array:
        """Return data minus prediction, NaN where nothing was measured."""
        difference: Array = self.data - values[self.rows]
        return difference

    def weighted(self, values: Array) -> Array:
        """Return the weighted differences, prediction minus data, shape (N,)."""
        return self._common_covariance.decorrelated(self._each(values))

    def jacobian(self, slopes: Array) -> Array:
        """Return the derivatives of `weighted`, shape (N, p)."""
        return self._common_covariance.decorrelated(self._each_by(slopes))

    def own_difference(self, values: Array) -> Array:
        """Return `difference` without what errors in common explain of it: that is no scatter."""
        sizes = self._common_covariance.sizes(self._each(values))
        return self.difference(values) - self._common @ sizes

    def leverage(self, jacobian: Array, covariance: Array) -> Array:
        """Return the share of each datum's noise that a fit takes up, (observables, n).

        By the derivatives of `weighted`, and the covariance that a fit leaves of what they are by.
        """
        leverage = np.zeros(self.data.shape)
        leverage[self.present] = self._common_covariance.leverage(jacobian, covariance)
        return leverage

    def _each(self, values: Array) -> Array:
        """Return weighted differences as if data had no errors in common, (N,)."""
        return np.asarray((-self.errors.weights * self.difference(values))[self.present])

    def _each_by(self, slopes: Array) -> Array:
        """Return the derivatives of `_each`, (N, p)."""
        jacobian = (self.errors.weights[:, :, None] * slopes[self.rows])[self.present]
        return np.asarray(jacobian)

    @property
    def _common_covariance(self) -> CommonCovariance:
        pattern = np.nan_to_num((self.errors.weights[..., None] * self._common)[self.present])
        return CommonCovariance(self.common, pattern)

    def in_common(self, values: Array, slopes: Array, covariance: Array) -> dict[str, PriorShift]:
        """Return the errors that data have in common as the data tell them.

        The slopes (observables, n, p) are those by parameters of which the fit leaves this
        covariance.
        """
        each = self._each(values), self._each_by(slopes)
        return self._common_covariance.estimates(*each, covariance)

    def of_errors(self, rows: Array) -> dict[str, Array]:
        """Return how estimates follow independent errors, by observable and by scale, (m, p) each.

        By rows (N, p) of `weighted`; see `CommonCovariance.of_errors`.
        """
        single, scales = self._common_covariance.of_errors(rows)
        row = np.nonzero(self.present)[0]
        noise = {name: single[row == number] for number, name in enumerate(self.observables)}
        return noise | scales

    def noise(self, values: Array) -> Array:
        """Return the root mean square of the data's errors, (observables,)."""
        errors = self.errors.scale if self.errors.measured else self.difference(values)
        return np.sqrt(np.nanmean(np.where(self.present, errors, np.nan) ** 2, axis=1))

    def deviations(self, values: Array) -> Array:
        """Return differences in units of the scatter of their observable; 0 where nothing is."""
        return self.errors.deviations(self.own_difference(values))

    def take_scatter(
        self, values: Array, leverage: Array | float = 0.0, discrepancy: float = 0.0
    ) -> None:
        """Give observables without measurement errors their scatter about a prediction.

        See `DataErrors.take_scatter`.
        """
        difference = self.own_difference(values)
        if self.distance_um is not None and np.unique(self.distance_um).size > 1:
            # a model is off by nearly the same near a sample and away from it: so much is left in
            # the difference, which is what rows at several distances tell
            discrepancy *= 0.05
        self.errors.take_scatter(difference, values[self.rows], leverage, discrepancy)

    def drifting_zeros(self, values: Array, slopes: Array) -> list[str]:
        """Say of which observables the zeros seem to drift, beyond the scatter.

        What no thermometer shows has a zero, which gets a straight line over the rows. Residuals
        at the optimum without lines tell it, less what the parameters could take up instead.
        """
        if self.size <= slopes.shape[2] + 2 * len(self.rows):
            return []
        order = np.linspace(-1.0, 1.0, self.present.shape[1])
        zeros = np.zeros((*self.present.shape, 2 * len(self.observables)))
        for row, name in enumerate(self.observables):
            if not FITTED[name].is_temperature:
                zeros[row, :, 2 * row] = 1.0
                zeros[row, :, 2 * row + 1] = order
        zeros = zeros[:, :, np.any(zeros, axis=(0, 1))]
        residual, jacobian = -self.weighted(values), self.jacobian(slopes)
        columns = (self.errors.weights[..., None] * zeros)[self.present]
        columns = self._common_covariance.decorrelated(columns)
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
        out = np.abs(sizes) > 7.0 * errors
        lines, which = zeros @ sizes, np.any(zeros, axis=1) @ out
        return [
            f"{name}: the zero seems to go from {first:+.3g} to {last:+.3g} "
            f"{FITTED[name].unit} along the file"
            for name, first, last, is_out in zip(
                self.observables, *lines[:, [0, -1]].T, which, strict=True
            )
            if is_out
        ]

    def rms(self, values: Array) -> dict[str, float]:
        """Return the rms of data minus prediction by column, for every observable with data."""
        difference = self.measured[: len(values)] - values
        difference[self.rows] = self.difference(values)
        return {
            column.name: float(np.sqrt(np.nanmean(row**2)))
            for column, row in zip(FITTED.values(), difference, strict=False)
            if np.isfinite(row).any()
        }
