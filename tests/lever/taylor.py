"""The Taylor test of a lever's Jacobian: flat, solid or reduced, in vacuum or air."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hotlever.lever.equations import LeverEquations


def remainder_orders(
    equations: LeverEquations, x: np.ndarray, seed: int, steps: Sequence[float]
) -> np.ndarray:
    """Orders with which F(x + h d) − F(x) − h J d shrinks as the steps h halve."""
    direction = np.random.default_rng(seed).normal(size=x.shape) * equations.scale
    slope, start = equations.balance_change(x, direction), equations.balance(x)
    rest = [np.abs(equations.balance(x + h * direction) - start - h * slope).max() for h in steps]
    return np.log2(np.array(rest[:-1]) / rest[1:])
