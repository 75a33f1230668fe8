"""The power law of Eq. 12 fitted to any temperatures against power, simulated or measured."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import minimize, minimize_scalar

from hotlever.calibration.power_law import PowerLaw
from hotlever.errors import InputError
from hotlever.lever import Branch
from hotlever.spieser2017 import BASE_TEMPERATURE_K
from hotlever.types import Array

#: Range in which the exponent of the cold branch is sought. At one, it is the linear term.
_EXPONENTS = (1.2, 12.0)
#: Fewest points that determine a branch, one more than its coefficients.
_FEWEST_COLD, _FEWEST_HOT = 4, 2
#: Powers (over the knee's) at which the law is fitted to a model: even, up to here; at least so
#: many of them above the knee.
_TO, _POINTS, _LEAST_HOT = 1.4, 160, 8


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
    data = _Data.of(power_mW, tip_K, tip_error_K, base_temperature_K)
    law, stderr = _continuous(data) if continuous else _two_branches(data, threshold_mW)
    residual = data.rise_K - law.tip_temperature(data.power_mW, 0.0)
    return PowerLawFit(law, stderr, data.power_mW, residual)


def law_of_model(vacuum: Branch, threshold_mW: float | None) -> tuple[PowerLaw, float]:
    """Fit Eq. 12 to the model in vacuum, with its threshold at the knee; return what it misses."""
    highest = vacuum.highest_power_mW
    if threshold_mW is not None:
        highest = min(highest, _TO * threshold_mW)
    power = np.linspace(0.0, highest, _POINTS + 1)[1:]
    if threshold_mW is not None and np.sum(power > threshold_mW) < _LEAST_HOT:
        # the lever melts right above its knee
        power = np.append(power, np.linspace(threshold_mW, highest, _LEAST_HOT + 1)[1:])
        power = np.unique(power)
    law_fit = fit_power_law(
        power,
        vacuum.tip_temperature(power),
        base_temperature_K=vacuum.base_temperature_K,
        threshold_mW=threshold_mW,
    )
    return law_fit.law, law_fit.largest_residual_K()


def power_turns(branch: Branch, medium: str) -> str:
    """Say where the power of a lever turns in a medium; empty if it does not."""
    turn = branch.power_turns_K
    if turn is None:
        return ""
    return (
        f"in {medium} the power of the lever falls from a tip of {turn:.0f} K on, so that the tip "
        "temperature is no function of it"
    )


@dataclass(frozen=True)
class _Data:
    """Rises of the tip by power, rising in power, and the inverse of their standard errors."""

    power_mW: Array
    rise_K: Array
    weight: Array

    @classmethod
    def of(
        cls, power_mW: ArrayLike, tip_K: ArrayLike, tip_error_K: ArrayLike | None, base_K: float
    ) -> _Data:
        """Sort the rows, and leave out those without power or temperature."""
        given = power_mW, tip_K, 1.0 if tip_error_K is None else tip_error_K
        columns = [np.asarray(column, dtype=float) for column in given]
        data = np.stack(np.broadcast_arrays(*columns))
        data = data[:, np.isfinite(data).all(axis=0) & (data[0] > 0) & (data[2] > 0)]
        power, tip, error = data[:, np.argsort(data[0], kind="stable")]
        fewest = _FEWEST_COLD + _FEWEST_HOT
        if power.size < fewest:
            raise InputError(
                f"{power.size} temperatures with a power above zero, expected at least {fewest} "
                "for a power law"
            )
        return cls(power, tip - base_K, 1.0 / error)

    def solve(self, columns: Array) -> tuple[Array, float]:
        """Solve weighted linear least squares; return coefficients and the sum of squares."""
        weighted, rise = columns * self.weight[:, None], self.rise_K * self.weight
        coefficients: Array = np.linalg.lstsq(weighted, rise, rcond=None)[0].astype(float)
        return coefficients, float(np.sum((rise - weighted @ coefficients) ** 2))

    def covariance(self, slopes: Array, variance: float) -> Array:
        """Return the covariance of parameters by the derivatives of the rises."""
        weighted = slopes * self.weight[:, None]
        return np.asarray(np.linalg.pinv(weighted.T @ weighted) * variance)


def _named(*values: float) -> dict[str, float]:
    return dict(zip(PowerLaw.model_fields, map(float, values), strict=True))


def _two_branches(data: _Data, threshold: float | None) -> tuple[PowerLaw, dict[str, float]]:
    """Fit branches that need not meet, for every row at which the data may be divided."""
    power, last = data.power_mW, data.power_mW.size - _FEWEST_HOT
    splits = list(range(_FEWEST_COLD, last + 1))
    if threshold is not None:
        split = int(np.searchsorted(power, threshold, side="right"))
        if split not in splits:
            raise InputError(
                f"{split} points up to the threshold of {threshold:g} mW and {power.size - split} "
                f"above it, expected at least {_FEWEST_COLD} and {_FEWEST_HOT}"
            )
        splits = [split]
    exponents, squares = np.transpose([_exponent(data, split) for split in splits])
    best = int(np.argmin(squares))
    split, m = splits[best], float(exponents[best])
    variance = squares[best] / max(power.size - 5, 1)
    columns = _columns(power, split, m)
    (a, b, c), _ = data.solve(columns)
    slopes = np.column_stack([columns, b * np.log(power) * columns[:, 1]])
    errors = np.sqrt(np.diag(data.covariance(slopes, variance)))[[0, 1, 3, 2]]
    if threshold is not None:
        return PowerLaw(**_named(a, b, m, c, threshold)), _named(*errors, 0.0)
    alike = np.flatnonzero(squares <= squares[best] + variance)
    spread = (power[splits[alike[-1]]] - power[splits[alike[0]] - 1]) / 2.0
    # between two rows the threshold is where the branches meet, or in the middle
    low, high = power[split - 1], power[split]
    law = PowerLaw(**_named(a, b, m, c, 0.5 * (low + high)))
    with suppress(InputError):
        law = law.meeting() if low <= law.meeting().threshold_mW < high else law
    return law, _named(*errors, spread)


def _exponent(data: _Data, split: int) -> tuple[float, float]:
    """Return the best exponent with so many rows on the cold branch, and the sum of squares."""

    def cost(m: float) -> float:
        return data.solve(_columns(data.power_mW, split, m))[1]

    optimum = minimize_scalar(cost, bounds=_EXPONENTS, method="bounded")
    return float(optimum.x), float(optimum.fun)


def _columns(power: Array, split: int, m: float) -> Array:
    """Return what the coefficients a, b and c of both branches multiply, (n, 3)."""
    cold = np.arange(power.size) < split
    return np.stack([cold * power, cold * power**m, ~cold * power], axis=1)


def _continuous(data: _Data) -> tuple[PowerLaw, dict[str, float]]:
    """Fit branches that meet, T = P (a + b min(P, P_th)^(m-1)), which is linear in a and b."""
    power = data.power_mW

    def columns(m: float, threshold: float) -> Array:
        return np.stack([power, power * np.minimum(power, threshold) ** (m - 1)], axis=1)

    def cost(shape: ArrayLike) -> float:
        return data.solve(columns(*np.asarray(shape)))[1]

    low, high = power[_FEWEST_COLD - 1], power[-_FEWEST_HOT]
    starts = [(m, p) for m in (2.0, 3.0, 5.0) for p in np.linspace(low, high, 8)]
    optimum = minimize(
        cost,
        np.array(min(starts, key=cost)),
        method="Nelder-Mead",
        bounds=[_EXPONENTS, (low, high)],
        options={"xatol": 1e-8, "fatol": 1e-12, "maxiter": 2000, "maxfev": 4000},
    )
    m, threshold = optimum.x.tolist()
    (a, b), squares = data.solve(columns(m, threshold))
    by_b, hot = columns(m, threshold)[:, 1], power > threshold
    by_m = b * np.log(np.minimum(power, threshold)) * by_b
    by_threshold = hot * b * (m - 1) * by_b / threshold
    slopes = np.stack([power, by_b, by_m, by_threshold], axis=1)
    covariance = data.covariance(slopes, squares / max(power.size - 4, 1))
    # the hot slope is the rise at the threshold over the power there
    chord = threshold ** (m - 1)
    by_all = np.array([1.0, chord, b * np.log(threshold) * chord, b * (m - 1) * chord / threshold])
    *errors, threshold_error = np.sqrt(np.diag(covariance))
    hot_error = np.sqrt(by_all @ covariance @ by_all)
    law = PowerLaw(**_named(a, b, m, a + b * chord, threshold))
    return law, _named(*errors, hot_error, threshold_error)
