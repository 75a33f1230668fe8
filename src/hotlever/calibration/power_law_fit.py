"""The power law of Eq. 12 fitted to any temperatures against power, simulated or measured."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import minimize, minimize_scalar

from hotlever.calibration.power_law import PowerLaw
from hotlever.errors import InputError
from hotlever.spieser2017 import BASE_TEMPERATURE_K
from hotlever.types import Array

#: Range in which the exponent of the cold branch is sought. At one, it is the linear term.
_EXPONENTS = (1.2, 12.0)
#: Fewest points that determine a branch, one more than its coefficients.
_FEWEST_COLD, _FEWEST_HOT = 4, 2


@dataclass(frozen=True)
class PowerLawFit:
    """A power law found from data.

    Attributes
    ----------
    law : PowerLaw
    stderr : dict of str to float
        Standard error of each coefficient, from the scatter about the law. That of a
        discontinuous law's threshold is half the range of thresholds that describe the data as
        well, within one variance.
    power_mW, residual_K : ndarray, shape (n,)
        Data minus law, rising in power.
    """

    law: PowerLaw
    stderr: dict[str, float]
    power_mW: Array
    residual_K: Array

    @property
    def rms_K(self) -> float:
        """Root mean square of the residuals (K)."""
        return float(np.sqrt(np.mean(self.residual_K**2)))

    def largest_residual_K(self, from_mW: float = 0.0, to_mW: float = np.inf) -> float:
        """Return the largest residual (K) between two powers; NaN if there are no data."""
        here = (self.power_mW >= from_mW) & (self.power_mW <= to_mW)
        return float(np.abs(self.residual_K[here]).max()) if here.any() else float("nan")


def fit_power_law(
    power_mW: ArrayLike,
    tip_K: ArrayLike,
    tip_error_K: ArrayLike | None = None,
    *,
    base_temperature_K: float = BASE_TEMPERATURE_K,
    threshold_mW: float | None = None,
    continuous: bool = False,
) -> PowerLawFit:
    """Fit both branches of Eq. 12 and the threshold between them.

    Parameters
    ----------
    power_mW, tip_K : array_like, shape (n,)
        In any order; rows with a NaN are left out.
    tip_error_K : array_like, shape (n,), optional
        Standard errors of the temperatures; equal ones by default.
    base_temperature_K : float
        Temperature without power.
    threshold_mW : float, optional
        Hold the threshold here, such as at the power of the knee. Not for a continuous law.
    continuous : bool
        Make the branches meet: the hot slope is that of the cold branch's chord at the
        threshold, c = a + b P_th^(m-1), so that T = T_RT + P (a + b min(P, P_th)^(m-1)).

    Raises
    ------
    InputError
        If there are too few points on a branch.

    Examples
    --------
    >>> from hotlever.calibration.power_law import EQ12
    >>> power = np.linspace(0.2, 4.0, 40)
    >>> fit = fit_power_law(power, EQ12.tip_temperature(power))
    >>> round(fit.law.exponent, 3), round(fit.law.hot_K_per_mW, 3)
    (3.1, 213.0)
    """
    power, rise, weight = _data(power_mW, tip_K, tip_error_K, base_temperature_K)
    if continuous:
        law, stderr = _continuous(power, rise, weight)
    else:
        law, stderr = _two_branches(power, rise, weight, threshold_mW)
    return PowerLawFit(law, stderr, power, rise - law.tip_temperature(power, 0.0))


def _data(
    power_mW: ArrayLike, tip_K: ArrayLike, tip_error_K: ArrayLike | None, base: float
) -> tuple[Array, Array, Array]:
    """Return power, rise and weight, rising in power."""
    given = power_mW, tip_K, 1.0 if tip_error_K is None else tip_error_K
    data = np.stack(np.broadcast_arrays(*(np.asarray(one, dtype=float) for one in given)))
    data = data[:, np.isfinite(data).all(axis=0) & (data[0] > 0) & (data[2] > 0)]
    power, tip, error = data[:, np.argsort(data[0], kind="stable")]
    if power.size < _FEWEST_COLD + _FEWEST_HOT:
        raise InputError(
            f"{power.size} temperatures with a power above zero, expected at least "
            f"{_FEWEST_COLD + _FEWEST_HOT} for a power law"
        )
    return power, tip - base, 1.0 / error


# --- two branches that need not meet --------------------------------------------------------------


def _two_branches(
    power: Array, rise: Array, weight: Array, threshold: float | None
) -> tuple[PowerLaw, dict[str, float]]:
    """Fit each branch by itself, for every place at which the data may be divided."""
    last = power.size - _FEWEST_HOT
    if threshold is None:
        splits = list(range(_FEWEST_COLD, last + 1))
    else:
        splits = [int(np.searchsorted(power, threshold, side="right"))]
        if not _FEWEST_COLD <= splits[0] <= last:
            raise InputError(
                f"{splits[0]} points up to the threshold of {threshold:g} mW and "
                f"{power.size - splits[0]} above it, expected at least {_FEWEST_COLD} and "
                f"{_FEWEST_HOT}"
            )
    found = [_divided(power, rise, weight, split) for split in splits]
    squares = np.array([each for _, each in found])
    best = int(np.argmin(squares))
    split, (a, b, m, c) = splits[best], found[best][0]
    law = PowerLaw(**_named(a, b, m, c, power[split - 1]))
    variance = squares[best] / max(power.size - 5, 1)
    spread = 0.0
    if threshold is None:
        threshold = _between(law, float(power[split - 1]), float(power[split]))
        alike = [splits[place] for place in np.flatnonzero(squares <= squares[best] + variance)]
        spread = (power[max(alike)] - power[min(alike) - 1]) / 2.0
    cold, hot = power[:split], power[split:, None]
    slopes = np.stack([cold, cold**m, b * np.log(cold) * cold**m], axis=1)
    covariance = _covariance(slopes, weight[:split], variance)
    (hot_variance,) = _covariance(hot, weight[split:], variance).ravel()
    errors = np.sqrt([*np.diag(covariance), hot_variance])
    return law.with_(threshold_mW=float(threshold)), _named(*errors, spread)


def _between(law: PowerLaw, low: float, high: float) -> float:
    """Place the threshold between two data: where the branches meet, or in the middle."""
    middle = 0.5 * (low + high)
    if law.hot_K_per_mW <= law.linear_K_per_mW or law.nonlinear_K <= 0:
        return middle
    meeting = law.meeting().threshold_mW
    return meeting if low <= meeting < high else middle


def _divided(
    power: Array, rise: Array, weight: Array, split: int
) -> tuple[tuple[float, ...], float]:
    """Fit each branch by itself; return a, b, m and c, and the sum of squares."""
    cold, hot = slice(split), slice(split, None)

    def at(exponent: float) -> tuple[Array, float]:
        columns = np.stack([power[cold], power[cold] ** exponent], axis=1)
        return _linear(columns, rise[cold], weight[cold])

    m = float(minimize_scalar(lambda m: at(m)[1], bounds=_EXPONENTS, method="bounded").x)
    (a, b), squares = at(m)
    (c,), more = _linear(power[hot, None], rise[hot], weight[hot])
    return (a, b, m, c), squares + more


def _linear(columns: Array, rise: Array, weight: Array) -> tuple[Array, float]:
    """Solve weighted linear least squares; return the coefficients and the sum of squares."""
    coefficients: Any = np.linalg.lstsq(columns * weight[:, None], rise * weight, rcond=None)[0]
    return coefficients, float(np.sum((weight * (rise - columns @ coefficients)) ** 2))


def _covariance(columns: Array, weight: Array, variance: float) -> Array:
    """Return the covariance of the coefficients of weighted columns."""
    weighted = columns * weight[:, None]
    return np.asarray(np.linalg.pinv(weighted.T @ weighted) * variance)


# --- branches that meet -----------------------------------------------------------------------


def _continuous(power: Array, rise: Array, weight: Array) -> tuple[PowerLaw, dict[str, float]]:
    """Fit T = P (a + b min(P, P_th)^(m-1)), which is linear in a and b."""

    def at(shape: Array) -> tuple[Array, float]:
        return _linear(_meeting_columns(power, *shape), rise, weight)

    low, high = power[_FEWEST_COLD - 1], power[-_FEWEST_HOT]
    starts = [(m, p) for m in (2.0, 3.0, 5.0) for p in np.linspace(low, high, 8)]
    start = min(starts, key=lambda shape: at(np.array(shape))[1])
    found = minimize(
        lambda shape: at(shape)[1],
        np.array(start),
        method="Nelder-Mead",
        bounds=[_EXPONENTS, (low, high)],
        options={"xatol": 1e-8, "fatol": 1e-12, "maxiter": 2000, "maxfev": 4000},
    )
    m, threshold = map(float, found.x)
    (a, b), squares = at(found.x)
    reached = np.minimum(power, threshold)
    slopes = np.column_stack(
        [
            _meeting_columns(power, m, threshold),
            b * power * np.log(reached) * reached ** (m - 1),
            np.where(power > threshold, b * (m - 1) * power * threshold ** (m - 2), 0.0),
        ]
    )
    covariance = _covariance(slopes, weight, squares / max(power.size - 4, 1))
    by_all = threshold ** (m - 1) * np.array(
        [threshold ** (1 - m), 1.0, b * np.log(threshold), b * (m - 1) / threshold]
    )
    errors = np.sqrt(np.diag(covariance))
    hot_error = np.sqrt(by_all @ covariance @ by_all)
    law = PowerLaw(**_named(a, b, m, a + b * threshold ** (m - 1), threshold))
    return law, _named(*errors[:3], hot_error, errors[3])


def _meeting_columns(power: Array, m: float, threshold: float) -> Array:
    return np.stack([power, power * np.minimum(power, threshold) ** (m - 1)], axis=1)


def _named(*values: float) -> dict[str, float]:
    return dict(zip(PowerLaw.model_fields, map(float, values), strict=True))
