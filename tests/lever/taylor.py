"""The Taylor test of a lever's Jacobian, full or reduced."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hotlever.lever.equations import LeverEquations, Pin


def remainder_orders(
    equations: LeverEquations, x: np.ndarray, seed: int, steps: Sequence[float]
) -> np.ndarray:
    """Orders with which F(x + h d) − F(x) − h J d shrinks as the steps h halve."""
    direction = np.random.default_rng(seed).normal(size=x.size) * equations.scale
    pin = Pin(0.7, 0.01)
    pinned = equations.pinned(pin, 0.0)
    slope = equations.jacobian(x).completed(equations.series_kohm, *pin) @ direction
    start = pinned.residual(x)
    rest = [np.abs(pinned.residual(x + h * direction) - start - h * slope).max() for h in steps]
    return np.log2(np.array(rest[:-1]) / rest[1:])
