"""Data minus prediction, weighted: what fits, profiles and posteriors have in common.

The zeros of I_h, V_r and V_bridge may drift: each is a straight line over the order of the rows,
which is that of time. It enters linearly, so for every trial of the parameters the best one follows
at once (variable projection, Golub and Pereyra, Inverse Problems 19, R1 (2003)).
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy

import numpy as np

from hotlever.errors import InputError
from hotlever.estimate.noise_model import CommonCovariance, CommonError, DataErrors, steepness_of
from hotlever.estimate.options import Numerics, Weights
from hotlever.measurement import Measurement
from hotlever.probe.priors import PriorShift
from hotlever.quantities import FITTED
from hotlever.types import Array


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

        By rows (N, p) of `weighted`; see `hotlever.estimate.noise.CommonCovariance.of_errors`.
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

        See `hotlever.estimate.noise.DataErrors.take_scatter`.
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
