"""I-V curves as an instrument would measure them on a lever whose characteristic is known."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hotlever.calibration.characteristic import Characteristic
from hotlever.calibration.knee import IVCurve
from hotlever.errors import InputError

Array = NDArray[np.float64]


def measured_curve(
    known: Characteristic,
    rng: np.random.Generator,
    *,
    series_resistance_ohm: float = 5600.0,
    from_V: float = 1.0,
    to_V: float = 11.0,
    points: int = 40,
    noise: float = 0.002,
) -> IVCurve:
    """Measure a lever at unevenly spaced biases, with noise proportional to the current.

    Parameters
    ----------
    known : Characteristic
    rng : numpy.random.Generator
    series_resistance_ohm : float
    from_V, to_V : float
        Range of the bias; it ends earlier where the characteristic does.
    points : int
    noise : float
        Standard deviation of the current over the current.

    Raises
    ------
    InputError
        If the bias does not decide the state: see `current_at`.
    """
    even = np.linspace(from_V, to_V, points)
    spacing = (to_V - from_V) / max(points - 1, 1)
    bias = np.clip(even + rng.uniform(-0.3, 0.3, points) * spacing, from_V, to_V)
    current = current_at(known, bias, series_resistance_ohm)
    here = np.isfinite(current)
    bias, current = bias[here], current[here]
    return IVCurve.of(
        bias, current * (1.0 + noise * rng.standard_normal(bias.size)), series_resistance_ohm
    )


def current_at(known: Characteristic, bias_V: ArrayLike, series_resistance_ohm: float) -> Array:
    """Return the current (mA) at biases (V); NaN beyond the hottest state.

    Raises
    ------
    InputError
        If several states belong to one bias, because the series resistance is too small or too
        large.
    """
    tip = np.linspace(known.base_temperature_K + 0.05, known.hottest_K, 20000)
    lever = known.lever_voltage(tip)
    current = known.power(tip) / lever
    biases = lever + series_resistance_ohm / 1000.0 * current
    if not np.all(np.diff(biases) > 0):
        raise InputError(
            f"with a series resistance of {series_resistance_ohm:g} ohm several states of the "
            "lever belong to one bias"
        )
    return np.interp(np.asarray(bias_V, dtype=float), biases, current, right=np.nan)
