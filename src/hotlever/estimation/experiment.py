"""An experiment: the forward map from a lever's parameters to what is measured, with derivatives.

A lever is measured at rest (`hotlever.estimation.experiment_at_rest`) or in time
(`hotlever.estimation.experiment_in_time`). Either solves a lever that is fast, and can be corrected
by the full one at the probe of a prediction.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol, Self

from hotlever.estimation.surrogate import Surrogate
from hotlever.measurands import FITTED
from hotlever.probe import Probe
from hotlever.types import Array

#: Where predictions have the tip temperature.
TIP = list(FITTED).index("tip")


@dataclass(frozen=True)
class Prediction:
    """What an instrument and a thermometer would show of a probe.

    Attributes
    ----------
    probe : Probe
    values : ndarray, shape (observables, n)
        `hotlever.measurands.OBSERVABLES` at the rows of the measurement, and behind them those of
        a contact, if there is one.
    slopes : ndarray, shape (observables, n, k)
        Derivatives by the experiment's parameters.
    surrogate : Surrogate
        Predictions for similar probes.
    columns : dict of str to ndarray, shape (m,)
        What it shows where it was solved, by the names that a sweep or a history has, first that of
        the bias or the time; ``bias_V``, ``current_mA`` and ``tip_K`` among them.
    tip_slopes : ndarray, shape (m, k)
        Derivatives of the last.
    """

    probe: Probe
    values: Array
    slopes: Array
    surrogate: Surrogate
    columns: dict[str, Array]
    tip_slopes: Array


def named(values: Array) -> dict[str, Array]:
    """Return what is shown, (observables, n), by the names that a sweep or a history has."""
    return {column.name: row for column, row in zip(FITTED.values(), values, strict=False)}


class Experiment(Protocol):
    """Predicts a measurement for any probe that is similar to the one it was made of."""

    @property
    def names(self) -> tuple[str, ...]:
        """The parameters of the derivatives, (k,)."""
        ...

    def predict(self, probe: Probe, near: Any = None) -> Prediction:
        """Predict the measurement of a probe, starting from the prediction for a similar one.

        Raises
        ------
        ComputationError
            If the lever cannot be solved.
        """
        ...

    def confirmed(self, at: Any) -> Self:
        """Return an experiment that is exact at the probe of a prediction.

        Raises
        ------
        ComputationError
            If the full lever cannot be solved there.
        """
        ...
