"""The uncertainty budget of the tip temperature at one bias, after the GUM (JCGM 100:2008).

Its rows are what the standard errors by source of a table sum up, one by one: noise of each
observable, scales, priors, and what the model leaves out. They are independent of each other.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

import numpy as np

from hotlever.estimation.gum import Budget, InputQuantity
from hotlever.estimation.inverse_problem import Estimate
from hotlever.estimation.outcome import Section
from hotlever.measurands import FITTED
from hotlever.probe.parameters import parameters_of
from hotlever.probe.priors import SCALES, PriorUse
from hotlever.records import Number
from hotlever.types import Array

#: What a fit to other data of the lever leaves: one row, of which no degrees of freedom are known.
_FIT = "fit"


def correction(quantity: str, u: float) -> InputQuantity:
    """Return the row of a correction of the tip temperature (K) that is zero with an error."""
    dof = np.nan if quantity == _FIT else np.inf
    return InputQuantity(quantity, 0.0, "K", u, "B", "normal", 1.0, dof)


def budget_of_estimate(
    estimate: Estimate, priors: Mapping[str, PriorUse], slopes: Array, model: Mapping[str, float]
) -> Budget:
    """Return the budget of a tip temperature.

    Parameters
    ----------
    estimate : Estimate
    priors : mapping of str to PriorUse
        Of the parameters and the scales.
    slopes : ndarray, shape (p,)
        Derivatives of the tip temperature by what is varied.
    model : mapping of str to float
        Standard errors (K) beside those of the parameters, by source.
    """
    residuals, objective = estimate.residuals, estimate.objective
    moved = {name: slopes @ by for name, by in estimate.posterior.influences.items()}
    u = residuals.noise(estimate.prediction.values).tolist()
    leverage = objective.leverage(estimate.prediction.slopes, objective.point(estimate.probe))
    dof = residuals.errors.degrees_of_freedom(leverage).tolist()
    rows = []
    for name, size, free in zip(residuals.observables, u, dof, strict=True):
        sensitivity = float(np.linalg.norm(moved.pop(name))) / size
        kind: Literal["A", "B"] = "A" if np.isfinite(free) else "B"
        noise, unit = f"noise of {name}", FITTED[name].unit
        rows.append(InputQuantity(noise, 0.0, unit, size, kind, "normal", sensitivity, free))
    units = {name: each.unit for name, each in parameters_of(estimate.probe, anywhere=True).items()}
    for name, by in moved.items():
        if name == _FIT:
            rows.append(correction(name, float(np.linalg.norm(by))))
            continue
        use, unit = priors[name], "1" if name in SCALES else units[name]
        rows.append(
            InputQuantity(
                quantity=name,
                estimate=use.value,
                unit=unit,
                u=use.spread,
                type="B",
                distribution=use.distribution,
                sensitivity=by.item() / use.spread,
            )
        )
    return Budget((*rows, *(correction(name, error) for name, error in model.items())))


class InputSection(Section):
    """A row of a budget as calibration files hold it.

    Without degrees of freedom its uncertainty is taken as exact; or it is that of a fit, of which
    none are known.
    """

    quantity: str
    estimate: Number
    unit: str
    u: Number
    type: Literal["A", "B"]
    distribution: str
    sensitivity: Number
    contribution_K: Number = np.nan
    dof: Number = np.nan

    @classmethod
    def of(cls, row: InputQuantity) -> InputSection:
        """Return the section of a row."""
        return cls.holding(row, contribution_K=row.contribution)

    def row(self) -> InputQuantity:
        """Return the row."""
        unknown = np.isnan(self.dof) and self.quantity != _FIT
        values = self.attributes_of(InputQuantity)
        return InputQuantity(**values | ({"dof": np.inf} if unknown else {}))
