"""Fits of what was measured in time: current and reader voltage under a wave form.

The same least squares as at rest (`hotlever.fitting.least_squares`), over histories with their
exact derivatives. What data at rest do not know, the scale of the heat capacity, can be among the
parameters.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from hotlever.errors import InputError
from hotlever.fitting.least_squares import LeastSquares
from hotlever.fitting.measurement import Measurement
from hotlever.fitting.options import Weights
from hotlever.fitting.residuals import Residuals
from hotlever.lever.dataset import OBSERVABLES
from hotlever.lever.lever import Lever
from hotlever.lever.similar import SimilarLevers
from hotlever.lever.transient.history import checked_times
from hotlever.lever.transient.sensitivities import with_sensitivities
from hotlever.lever.transient.waveform import Waveform
from hotlever.probe import Probe
from hotlever.probe.priors import Prior
from hotlever.types import Array, Progress


@dataclass(frozen=True)
class HistoryPrediction:
    """What an instrument and a thermometer would show in time.

    Attributes
    ----------
    probe : Probe
        That it is for.
    values : ndarray, shape (3, n)
        I_h (mA), V_r (V) and T_tip (K) at the times.
    slopes : ndarray, shape (3, n, p)
        Their derivatives by the parameters.
    names : tuple of str
        The parameters.
    """

    probe: Probe
    values: Array
    slopes: Array
    names: tuple[str, ...]

    @property
    def nearby(self) -> HistoryPrediction:
        """Predictions for similar probes."""
        return self

    def predict(self, parameters: Array) -> tuple[Array, Array]:
        """Return values and slopes for some values of the parameters, to first order."""
        away = parameters - self.probe.at(self.names)
        return self.values + self.slopes @ away, self.slopes.copy()


class HistoryModel:
    """Predicts histories of levers similar to one; see `hotlever.fitting.models.ForwardModel`.

    Parameters
    ----------
    lever : Lever
    waveform : Waveform
    times : ndarray, shape (n,)
        µs.
    names : sequence of str
        Parameters; see `hotlever.lever.transient.sensitivities.with_sensitivities`.
    tolerance_K : float
    """

    def __init__(
        self,
        lever: Lever,
        waveform: Waveform,
        times: Array,
        names: Sequence[str],
        tolerance_K: float = 0.1,
    ) -> None:
        self.names, self._similar = tuple(names), SimilarLevers(lever)
        self._waveform, self._times, self._tolerance_K = waveform, times, tolerance_K

    def predict(self, probe: Probe, near: HistoryPrediction | None = None) -> HistoryPrediction:
        """Follow the lever of a probe.

        Raises
        ------
        ComputationError
            If silicon melts, or a step fails.
        """
        found = with_sensitivities(
            self._similar.lever(probe),
            self._waveform,
            self._times,
            self.names,
            tolerance_K=self._tolerance_K,
        )
        values = np.stack([found[column].values for column in OBSERVABLES.values()])
        return HistoryPrediction(probe, values, found.sensitivity.values, self.names)

    def confirmed(self, at: HistoryPrediction) -> HistoryModel:
        """Return a model that is exact at the probe of a prediction: this one."""
        return self


@dataclass(frozen=True)
class HistoryFit:
    """A lever fitted to a history.

    Attributes
    ----------
    probe : Probe
    names : tuple of str
        What was varied.
    covariance : ndarray, shape (p, p)
        Of these; with priors that of the posterior.
    prediction : HistoryPrediction
    evaluations : int
        Histories followed.
    """

    probe: Probe
    names: tuple[str, ...]
    covariance: Array
    prediction: HistoryPrediction
    evaluations: int

    @property
    def stderr(self) -> dict[str, float]:
        """Standard errors of the parameters."""
        return dict(zip(self.names, np.sqrt(np.diag(self.covariance)).tolist(), strict=True))

    @property
    def tip_stderr_K(self) -> Array:
        """Standard error (K) of the tip temperature at the times, by the parameters' errors."""
        slopes = self.prediction.slopes[list(OBSERVABLES).index("tip")]
        return np.sqrt(np.einsum("np,pq,nq->n", slopes, self.covariance, slopes))


def fit_history(
    lever: Lever,
    waveform: Waveform,
    times_us: ArrayLike,
    current_mA: ArrayLike,
    varied: Sequence[str],
    *,
    reader_V: ArrayLike | None = None,
    priors: Mapping[str, Prior] | None = None,
    progress: Progress | None = None,
) -> HistoryFit:
    """Fit a cold lever to the current, and the reader voltage, that were measured in time.

    Parameters
    ----------
    lever : Lever
        To start from; what is not varied stays, its mesh too.
    waveform : Waveform
        Of the bias.
    times_us : array_like, shape (n,)
        Rising.
    current_mA, reader_V : array_like, shape (n,)
        NaN where nothing was measured.
    varied : sequence of str
        Such as ``heat_capacity_scale`` and ``n_d``.
    priors : mapping of str to Prior, optional
    progress : callable, optional
        Called with the histories followed and how many there usually are.

    Raises
    ------
    InputError
        If the times do not rise, data are missing, or there are no derivatives by a parameter.
    ComputationError
        If the lever cannot be followed, or the fit does not converge.
    """
    times = checked_times(times_us)
    current = np.asarray(current_mA, dtype=float)
    reader = np.full(times.shape, np.nan) if reader_V is None else np.asarray(reader_V, dtype=float)
    if not np.array_equal(times, np.ravel(times_us)) or not (
        current.shape == reader.shape == times.shape
    ):
        raise InputError("expected times that rise, and one current and reader voltage for each")
    measured = Measurement(
        bias_V=times,  # what tells its rows apart
        current_mA=current,
        reader_V=reader,
        tip_K=np.full(times.shape, np.nan),
        tip_error_K=np.full(times.shape, np.nan),
    )
    if not measured.observables:
        raise InputError("found no current and no reader voltage, expected one of them")
    # beside priors data count by their scatter
    weights: Weights = "errors" if priors else "maximum"
    residuals = Residuals(measured, measured.observables, weights)
    model: Any = HistoryModel(lever, waveform, times, varied)
    search = LeastSquares(model, residuals, lever.probe, list(varied), progress, priors=priors)
    found = search.solve_and_confirm(robust=False)
    prediction = cast("HistoryPrediction", found.prediction)
    covariance = search.objective.covariance(found.prediction)
    return HistoryFit(found.probe, tuple(varied), covariance, prediction, search.evaluations)
