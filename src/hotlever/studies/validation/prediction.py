"""What a lever shows with what was known of it: a band by drawing from the priors; and verdicts.

The draws are a Latin hypercube, the same each time. A quantity is taken to be log-normal, since
most are products of what is known to a share, and the logit of a share to be normal.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import ArrayLike
from scipy.stats import norm, qmc

from hotlever.errors import ComputationError, HotleverError, InputError
from hotlever.probe.priors import Prior, as_known, default_priors
from hotlever.studies.validation.case import Case, StoredPrediction
from hotlever.text import BAND
from hotlever.types import Array, Progress
from hotlever.work import each

#: Levers that are drawn from the priors of a case.
DRAWS = 64
#: The verdict on a published number that is in no band.
OUTSIDE = "outside"


@dataclass(frozen=True)
class PredictedNumber:
    """What a case predicts: a normal distribution of the quantity's logarithm, of a share's logit.

    Attributes
    ----------
    centre, spread : float
        Its mean and standard deviation.
    is_share : bool
    impossible, silent : int
        Draws of `DRAWS` that are no lever, and that are one which does not show the quantity.

    Examples
    --------
    >>> half = PredictedNumber(0.0, 1.0, is_share=True)
    >>> [round(value, 3) for value in (half.median, *half.band_95)]
    [0.5, 0.123, 0.877]
    >>> half.verdict(0.9, 0.01)
    'outside'
    """

    centre: float
    spread: float
    is_share: bool = False
    impossible: int = 0
    silent: int = 0

    @classmethod
    def of(
        cls, values: ArrayLike, is_share: bool, impossible: int = 0, silent: int = 0
    ) -> PredictedNumber:
        """Return the prediction that draws of the quantity make."""
        transformed = _transformed(np.asarray(values), is_share)
        centre, spread = float(transformed.mean()), float(transformed.std(ddof=1))
        return cls(centre, spread, is_share, impossible, silent)

    @classmethod
    def as_stored(cls, stored: StoredPrediction, is_share: bool) -> PredictedNumber:
        """Return a prediction as it was written down."""
        numbers = np.array([stored.median, stored.low_95, stored.high_95])
        centre, low, high = _transformed(numbers, is_share).tolist()
        return cls(centre, (high - low) / (2.0 * BAND), is_share)

    def at(self, deviation: float) -> float:
        """Return the quantity so many standard deviations away."""
        value = math.exp(self.centre + deviation * self.spread)
        return value / (1.0 + value) if self.is_share else value

    @property
    def median(self) -> float:
        """What is as probably too high as too low."""
        return self.at(0.0)

    @property
    def band_95(self) -> tuple[float, float]:
        """Within what it is with 95 %."""
        return self.at(-BAND), self.at(BAND)

    def toml(self) -> str:
        """Return it as the section of a case."""
        low, high = self.band_95
        return (
            f"[prediction]\nmedian = {self.median:.4g}\nlow_95 = {low:.4g}\nhigh_95 = {high:.4g}\n"
        )

    def deviation(self, value: float, error: float) -> float:
        """Return how far a published value is off, in standard deviations of both."""
        error /= value * (1.0 - value) if self.is_share else value
        off = float(_transformed(np.array(value), self.is_share)) - self.centre
        return off / math.hypot(self.spread, error)

    def verdict(self, value: float, error: float) -> str:
        """Say where a published value with its standard error is."""
        # from the median, in standard deviations of both
        off = abs(self.deviation(value, error))
        within = {1.0: "inside 68 %", BAND: "inside 95 %"}
        return next((text for limit, text in within.items() if off <= limit), OUTSIDE)


def _transformed(values: Array, is_share: bool) -> Array:
    return np.asarray(np.log(values / (1.0 - values) if is_share else values))


def computed(case: Case, changes: dict[str, Any] | None = None) -> float:
    """Return the quantity of a case with the values that are stated or assumed.

    Raises
    ------
    HotleverError
        If there is no such lever, or it does not show the quantity.
    """
    changes = changes or {}
    values, _ = case.numbers()
    own = {name: float(changes[name]) for name in case.definition.arguments if name in changes}
    lever = {name: value for name, value in changes.items() if name not in own}
    arguments: dict[str, Any] = {**values, **own}
    if (probe := case.probe()) is not None:
        # what was known beforehand need not hold of what is drawn
        without_prior = probe.model_copy(update={"prior": None})
        arguments["probe"] = without_prior.with_(**lever) if lever else without_prior
    value = case.definition.compute(**arguments)
    if not (math.isfinite(value) and value > 0):
        raise ComputationError(f"{case.name}: no {case.quantity} of such a lever")
    return value


def predict(case: Case, progress: Progress | None = None) -> PredictedNumber:
    """Draw from the priors of a case, and return median and spread of its quantity.

    Raises
    ------
    ComputationError
        If too many of the draws do not show it.
    """
    probe, (_, uncertain) = case.probe(), case.numbers()
    of_lever = {} if probe is None else default_priors(as_known(probe, None))
    priors: dict[str, Prior] = {**of_lever, **uncertain}
    draws = norm.ppf(qmc.LatinHypercube(len(priors), seed=30).random(DRAWS))
    values, impossible = [], 0
    for draw in each(list(draws), progress):
        drawn = {
            name: prior.at(float(deviation))
            for (name, prior), deviation in zip(priors.items(), draw, strict=True)
        }
        try:
            values.append(computed(case, drawn))
        except InputError:
            impossible += 1
        except HotleverError:
            continue
    missing = DRAWS - len(values)
    # so many may be no lever, or one that does not show the quantity
    if missing > 0.25 * DRAWS:
        computed(case)  # says what is wrong, if it is wrong with the lever as it is assumed
        raise ComputationError(
            f"{case.name}: {missing} of {DRAWS} draws from the priors show no {case.quantity}"
        )
    return PredictedNumber.of(values, case.definition.is_share, impossible, missing - impossible)


def comparison(cases: list[Case]) -> xr.Dataset:
    """Return cases with what was predicted, what is published, and the verdict.

    Parameters
    ----------
    cases : list of Case
        Each with a stored prediction and a published value.
    """
    rows = []
    for case in cases:
        assert case.prediction is not None
        assert case.published is not None
        value, error = case.published.value, case.published.error
        stored = PredictedNumber.as_stored(case.prediction, case.definition.is_share)
        low, high = stored.band_95
        rows.append(
            {
                "case": case.name,
                "group": case.group,
                "quantity": case.quantity,
                "unit": case.definition.unit,
                "predicted": stored.median,
                "low_95": low,
                "high_95": high,
                "published": value,
                "published_error": error,
                "verdict": stored.verdict(value, error),
                "source": case.source,
            }
        )
    compared: xr.Dataset = pd.DataFrame(rows).set_index("case").to_xarray()
    return compared
