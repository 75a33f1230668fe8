"""The temperature-power law of the paper (Eq. 12): as published, read, or fitted to data."""

from __future__ import annotations

import os
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field
from scipy.optimize import elementwise, minimize, minimize_scalar

from hotlever.errors import InputError, counted
from hotlever.files import read_json
from hotlever.lever import Branch
from hotlever.records import Record
from hotlever.spieser2017 import BASE_TEMPERATURE_K, POWER_LAW
from hotlever.types import Array


class PowerLaw(Record):
    """Tip temperature against the power dissipated in the lever (Eq. 12).

    Below the threshold T = T_RT + a P + b P^m, above it T = T_RT + c P, with P in mW.

    Attributes
    ----------
    linear_K_per_mW, nonlinear_K, exponent : float
        a, b and m.
    hot_K_per_mW : float
        c.
    threshold_mW : float
        Power P_th of the transition.

    Notes
    -----
    In general the law is not continuous: see `jump_K`, and `meeting` for a law that is.
    """

    linear_K_per_mW: float
    nonlinear_K: float
    exponent: float
    hot_K_per_mW: float
    threshold_mW: float = Field(gt=0)

    def tip_temperature(
        self, power_mW: ArrayLike, base_temperature_K: float = BASE_TEMPERATURE_K
    ) -> Array:
        """Return the tip temperature (K) at a power (mW).

        Examples
        --------
        >>> EQ12.tip_temperature([2.95, 2.951]).round().tolist()
        [917.0, 922.0]
        """
        power = np.asarray(power_mW, dtype=float)
        rise = np.where(
            power <= self.threshold_mW, self._cold_rise(power), self.hot_K_per_mW * power
        )
        return base_temperature_K + rise

    def _cold_rise(self, power: Array) -> Array:
        # noise may take a power below zero
        heating = np.maximum(power, 0.0)
        return self.linear_K_per_mW * power + self.nonlinear_K * heating**self.exponent

    def power(self, tip_K: ArrayLike, base_temperature_K: float = BASE_TEMPERATURE_K) -> Array:
        """Return the lowest power (mW) that gives a tip temperature (K).

        Temperatures inside the jump belong to the threshold. Where the branches overlap (a
        jump downwards) the power on the cold branch is given.

        Raises
        ------
        InputError
            If a temperature is below the base temperature.

        Examples
        --------
        >>> EQ12.power([293.0, 600.0, 919.0, 1100.0]).round(3).tolist()
        [0.0, 2.02, 2.95, 3.789]
        """
        rise = np.asarray(tip_K, dtype=float) - base_temperature_K
        if np.any(rise < 0):
            raise InputError(
                f"a tip temperature of {np.min(tip_K):g} K, expected "
                f"{base_temperature_K:g} K (no power) or more"
            )
        top = float(self._cold_rise(np.asarray(self.threshold_mW)))
        target_rise = np.minimum(rise, top)
        cold = elementwise.find_root(
            lambda power, target_rise: self._cold_rise(power) - target_rise,
            (np.zeros_like(rise), np.full_like(rise, self.threshold_mW)),
            args=(target_rise,),
        ).x
        hot = np.maximum(rise / self.hot_K_per_mW, self.threshold_mW)
        return np.where(rise <= top, cold, hot)

    @property
    def jump_K(self) -> float:
        """Step of the law at the threshold (K)."""
        below = self.tip_temperature(self.threshold_mW, 0.0)
        return float(self.hot_K_per_mW * self.threshold_mW - below)

    def scaled(self, k: float) -> PowerLaw:
        """Return the law of a lever that needs k times the power for the same temperatures.

        The paper's transfer from vacuum to air: P is replaced by P / k.
        """
        return self.with_(
            linear_K_per_mW=self.linear_K_per_mW / k,
            nonlinear_K=self.nonlinear_K / k**self.exponent,
            hot_K_per_mW=self.hot_K_per_mW / k,
            threshold_mW=self.threshold_mW * k,
        )

    def meeting(self) -> PowerLaw:
        """Return the law with its threshold moved to where the branches meet: continuous.

        The same four coefficients; the temperature changes only between the two thresholds.

        Raises
        ------
        InputError
            If the branches do not meet at a positive power.

        Examples
        --------
        >>> round(EQ12.meeting().threshold_mW, 3)
        2.968
        """
        ratio = (self.hot_K_per_mW - self.linear_K_per_mW) / self.nonlinear_K
        if not ratio > 0 or self.exponent == 1.0:
            raise InputError("the branches of this power law do not meet at a positive power")
        return self.with_(threshold_mW=float(ratio ** (1.0 / (self.exponent - 1.0))))

    def values(self, base_temperature_K: float = BASE_TEMPERATURE_K) -> dict[str, float]:
        """Return the coefficients and ``threshold_K``, as calibration files have them."""
        threshold_K = float(self.tip_temperature(self.threshold_mW, base_temperature_K))
        return {**self.model_dump(), "threshold_K": threshold_K}


def read_power_law(path: str | os.PathLike[str]) -> PowerLaw:
    """Read a power law: a JSON file with its coefficients, or a calibration file.

    Raises
    ------
    InputError
        If the file cannot be read, or a coefficient is missing, misspelt or not positive.
    """
    content = read_json(path)
    section = content.get("power_law", content)
    if not content.get("describes_data", True):
        raise InputError(
            f"{path}: expected the calibration of a lever that shows its data; this one does not: "
            f"{content.get('reason') or 'its file does not say why'}"
        )
    if not isinstance(section, dict):
        raise InputError(f"{path}: found no power law, expected an object with its coefficients")
    coefficients = {name: value for name, value in section.items() if name != "threshold_K"}
    law = PowerLaw.from_values(coefficients, str(path))
    largest = 1e5  # K/mW, K, an exponent or mW
    for name, value in law:
        if not 0 < value <= largest:
            expected = "a positive number" if not value > 0 else f"at most {largest:g}"
            raise InputError(f"{path}: {name} = {value:g}, expected {expected}")
    return law


#: As published, doi:10.1063/1.4981883.
EQ12 = PowerLaw(**POWER_LAW)


# --- fitted ---------------------------------------------------------------------------------------


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
    >>> from hotlever.estimate import EQ12
    >>> power = np.linspace(0.2, 4.0, 40)
    >>> fit = fit_power_law(power, EQ12.tip_temperature(power))
    >>> round(fit.law.exponent, 3), round(fit.law.hot_K_per_mW, 3)
    (3.1, 213.0)
    """
    columns = power_mW, tip_K, 1.0 if tip_error_K is None else tip_error_K
    rows = np.stack(np.broadcast_arrays(*(np.asarray(column, dtype=float) for column in columns)))
    rows = rows[:, np.isfinite(rows).all(axis=0) & (rows[0] > 0) & (rows[2] > 0)]
    power, tip, error = rows[:, np.argsort(rows[0], kind="stable")]
    if power.size < (fewest := _Rises.fewest_cold + _Rises.fewest_hot):
        raise InputError(
            f"{counted(power.size, 'temperature')} with a power above zero, expected at least "
            f"{fewest} for a power law"
        )
    data = _Rises(power, tip - base_temperature_K, 1.0 / error)
    law, stderr = _continuous(data) if continuous else _two_branches(data, threshold_mW)
    return PowerLawFit(law, stderr, power, data.rise_K - law.tip_temperature(power, 0.0))


def law_of_model(vacuum: Branch, threshold_mW: float | None) -> tuple[PowerLaw, float]:
    """Fit Eq. 12 to the model in vacuum, with its threshold at the knee; return what it misses."""
    highest = vacuum.by_power.highest_mW
    if threshold_mW is not None:
        highest = min(highest, 1.4 * threshold_mW)
    power = np.linspace(0.0, highest, 161)[1:]
    if threshold_mW is not None and np.sum(power > threshold_mW) < 8:
        # the lever melts right above its knee
        power = np.union1d(power, np.linspace(threshold_mW, highest, 9)[1:])
    tip, base = vacuum.tip_temperature(power), vacuum.base_temperature_K
    fit = fit_power_law(power, tip, base_temperature_K=base, threshold_mW=threshold_mW)
    return fit.law, fit.largest_residual_K()


def power_turns(branch: Branch, medium: str) -> str:
    """Say where the power of a lever that starts cold turns in a medium; empty if it does not."""
    turn = branch.power_turns_K if branch.starts_cold else None
    if turn is None:
        return ""
    return (
        f"in {medium} the power of the lever falls from a tip of {turn:.0f} K on, so that the tip "
        "temperature is no function of it"
    )


@dataclass(frozen=True)
class _Rises:
    """Rises of the tip by power, rising in power, and the inverse of their standard errors.

    So many points at least, one more than its coefficients, determine a branch; and in this range
    the exponent of the cold one is sought: at one, it is the linear term.
    """

    power_mW: Array
    rise_K: Array
    weight: Array
    fewest_cold: int = 4
    fewest_hot: int = 2
    exponents: tuple[float, float] = (1.2, 12.0)

    def solve(self, columns: Array) -> tuple[Array, float]:
        """Solve weighted linear least squares; return coefficients and the sum of squares."""
        weighted, rise = columns * self.weight[:, None], self.rise_K * self.weight
        coefficients: Array = np.linalg.lstsq(weighted, rise, rcond=None)[0].astype(float)
        return coefficients, float(np.sum((rise - weighted @ coefficients) ** 2))

    def covariance(self, slopes: Array, squares: float, parameters: int) -> Array:
        """Return the covariance of the coefficients by the derivatives of the rises, (n, p)."""
        weighted = slopes * self.weight[:, None]
        variance = squares / max(self.power_mW.size - parameters, 1)
        return np.asarray(np.linalg.pinv(weighted.T @ weighted) * variance)


def _fitted(values: ArrayLike, errors: ArrayLike) -> tuple[PowerLaw, dict[str, float]]:
    """Return the law of some coefficients, and their standard errors by name."""
    law, stderr = (
        dict(zip(PowerLaw.model_fields, np.asarray(row, dtype=float).tolist(), strict=True))
        for row in (values, errors)
    )
    return PowerLaw(**law), stderr


def _two_branches(data: _Rises, threshold: float | None) -> tuple[PowerLaw, dict[str, float]]:
    """Fit branches that need not meet, for every row at which the data may be divided."""
    power, last = data.power_mW, data.power_mW.size - data.fewest_hot
    splits = list(range(data.fewest_cold, last + 1))
    if threshold is not None:
        split = int(np.searchsorted(power, threshold, side="right"))
        if split not in splits:
            raise InputError(
                f"{split} points up to the threshold of {threshold:g} mW and {power.size - split} "
                f"above it, expected at least {data.fewest_cold} and {data.fewest_hot}"
            )
        splits = [split]

    def columns(m: float, split: int) -> Array:
        """Return what a, b and c multiply with so many rows on the cold branch, (n, 3)."""
        cold = np.arange(power.size) < split
        return np.stack([cold * power, cold * power**m, ~cold * power], axis=1)

    def squares(m: float, split: int) -> float:
        return data.solve(columns(m, split))[1]

    optima = [
        minimize_scalar(squares, args=(split,), bounds=data.exponents, method="bounded")
        for split in splits
    ]
    sums = np.array([optimum.fun for optimum in optima])
    best = int(np.argmin(sums))
    split, m = splits[best], float(optima[best].x)
    multiplied = columns(m, split)
    (a, b, c), _ = data.solve(multiplied)
    slopes = np.insert(multiplied, 2, b * np.log(power) * multiplied[:, 1], axis=1)
    errors = np.sqrt(np.diag(data.covariance(slopes, sums[best], 5)))
    if threshold is not None:
        return _fitted([a, b, m, c, threshold], [*errors, 0.0])
    alike = np.flatnonzero(sums <= sums[best] + sums[best] / max(power.size - 5, 1))
    spread = (power[splits[alike[-1]]] - power[splits[alike[0]] - 1]) / 2.0
    # between two rows the threshold is where the branches meet, or in the middle
    low, high = power[split - 1], power[split]
    law, stderr = _fitted([a, b, m, c, 0.5 * (low + high)], [*errors, spread])
    with suppress(InputError):
        law = law.meeting() if low <= law.meeting().threshold_mW < high else law
    return law, stderr


def _continuous(data: _Rises) -> tuple[PowerLaw, dict[str, float]]:
    """Fit branches that meet, T = P (a + b min(P, P_th)^(m-1)), which is linear in a and b."""
    power = data.power_mW

    def columns(m: float, threshold: float) -> Array:
        return np.stack([power, power * np.minimum(power, threshold) ** (m - 1)], axis=1)

    def squares(shape: ArrayLike) -> float:
        return data.solve(columns(*np.asarray(shape)))[1]

    low, high = power[data.fewest_cold - 1], power[-data.fewest_hot]
    starts = [(m, p) for m in (2.0, 3.0, 5.0) for p in np.linspace(low, high, 8)]
    optimum = minimize(
        squares,
        np.array(min(starts, key=squares)),
        method="Nelder-Mead",
        bounds=[data.exponents, (low, high)],
        options={"xatol": 1e-8, "fatol": 1e-12, "maxiter": 2000, "maxfev": 4000},
    )
    m, threshold = optimum.x.tolist()
    (a, b), least = data.solve(columns(m, threshold))
    by_b = columns(m, threshold)[:, 1]
    by_m = b * np.log(np.minimum(power, threshold)) * by_b
    by_threshold = (power > threshold) * b * (m - 1) * by_b / threshold
    covariance = data.covariance(np.stack([power, by_b, by_m, by_threshold], axis=1), least, 4)
    # the hot slope c is the rise at the threshold over the power there
    chord = threshold ** (m - 1)
    by_all = np.array([1.0, chord, b * np.log(threshold) * chord, b * (m - 1) * chord / threshold])
    errors = np.insert(np.sqrt(np.diag(covariance)), 3, np.sqrt(by_all @ covariance @ by_all))
    return _fitted([a, b, m, a + b * chord, threshold], errors)
