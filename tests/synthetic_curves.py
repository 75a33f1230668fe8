"""I-V curves as an instrument would measure them on a lever whose characteristic is known."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from hotlever.errors import InputError
from hotlever.estimate import Measurement
from hotlever.estimate.knee import IVCurve
from hotlever.lever import Branch
from hotlever.probe import Circuit
from hotlever.types import Array


def measured_curve(
    branch: Branch,
    rng: np.random.Generator,
    *,
    circuit: Circuit | None = None,
    from_V: float = 1.0,
    to_V: float = 11.0,
    points: int = 40,
    noise: float = 0.002,
) -> IVCurve:
    """Measure a lever at unevenly spaced biases, with noise proportional to the current.

    Parameters
    ----------
    branch : Branch
    rng : numpy.random.Generator
    circuit : Circuit, optional
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
    circuit = circuit or Circuit()
    spacing = (to_V - from_V) / max(points - 1, 1)
    bias = np.linspace(from_V, to_V, points) + rng.uniform(-0.3, 0.3, points) * spacing
    current = current_at(branch, bias := np.clip(bias, from_V, to_V), circuit)
    here = np.isfinite(current)
    current[here] *= 1.0 + noise * rng.standard_normal(here.sum())
    return IVCurve.of(bias, current, circuit)


def current_at(branch: Branch, bias_V: ArrayLike, circuit: Circuit) -> Array:
    """Return the current (mA) at biases (V); NaN beyond the hottest state.

    Raises
    ------
    InputError
        If several states belong to one bias, because the series resistance is too small or too
        large.
    """
    bias = np.asarray(bias_V, dtype=float)
    reading = branch.read(circuit, bias.ravel())
    # where the bias falls along the branch, a ramp jumps, or ends before the branch does
    if reading.jumps or reading.last_K < branch.hottest_K:
        raise InputError(
            f"with a series resistance of {circuit.series_resistance_ohm:g} ohm several states of "
            "the lever belong to one bias"
        )
    return branch.electrical_outputs(reading.u)["current_mA"].reshape(bias.shape)


def measurement_of(curve: IVCurve) -> Measurement:
    """Return a curve as a measurement of the current alone."""
    nothing = np.full(curve.bias_V.size, np.nan)
    return Measurement(curve.bias_V, curve.current_mA, nothing, nothing, nothing)
