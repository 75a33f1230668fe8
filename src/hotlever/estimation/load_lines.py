"""Which state of a lever a measured row is compared with: the nearest on its load line.

A row says that V_l + R_s I_h was the bias. A branch that folds has several such states, or none; a
slow ramp takes the first. A search must not jump with its candidates from one part of a branch to
another, so it compares each row with the state nearest to what was measured, and where a candidate
ends before the bias of a row, with that end as if it went on with the resistance it has there.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.interpolate import PPoly

from hotlever.lever.branch import Branch
from hotlever.lever.ramp import crossing
from hotlever.probe.circuit import Circuit
from hotlever.types import Array, Index

#: Near a fold the states at a bias move without limit as parameters change; their derivatives
#: count as if the bias rose along the branch by at least this share of its mean slope up to there.
_LEAST_SLOPE = 0.03


@dataclass(frozen=True)
class Rows:
    """Rows of a measurement as what candidates are compared with.

    Attributes
    ----------
    bias_V : ndarray, shape (n,)
    shown : ndarray, shape (3, n), optional
        I_h (mA), V_r (V) and T_tip (K); NaN where nothing was measured. Without them the states
        are those of a slow ramp.
    """

    bias_V: Array
    shown: Array | None = None

    def away(self, values: Array, rows: Index) -> Array:
        """Return how far predicted values (3, m) are from some rows, as squares of shares, (m,)."""
        assert self.shown is not None
        largest = np.nanmax(np.abs(self.shown), axis=1, keepdims=True, initial=1e-300)
        return np.asarray(np.nansum(((values - self.shown[:, rows]) / largest) ** 2, axis=0))


def nearest_states(branch: Branch, circuit: Circuit, rows: Rows) -> tuple[Array, Array]:
    """Return u of the states that rows are compared with, and by how much each falls short, (n,).

    By so much, at least one, the values of a state are to be multiplied to reach the bias.
    """
    curve = PPoly(circuit.bias(branch.curve.c[..., 0], branch.curve.c[..., 1]), branch.curve.x)
    cold = branch.equations.circuit.starts_cold
    start = 0.0 if cold else float(branch.u[0])
    level = np.sort(curve.derivative().roots(extrapolate=False))
    ends = [start, *level[(level > start) & (level < branch.end_u)].tolist(), branch.end_u]
    # a cold lever is told apart from itself by the size of the bias only, and has none without
    bias = np.abs(rows.bias_V) if cold else rows.bias_V
    heated = np.flatnonzero(bias > 0) if cold else np.arange(bias.size)
    u, away = np.zeros(bias.shape), np.full(bias.shape, np.inf)
    u[heated] = np.nan
    short = np.ones(bias.shape)
    for low, high in pairwise(ends):
        first, last = float(curve(low)), float(curve(high))
        here = heated[(bias[heated] >= min(first, last)) & (bias[heated] <= max(first, last))]
        if not here.size:
            continue
        sign = 1.0 if last >= first else -1.0
        at = crossing(PPoly(sign * curve.c, curve.x), low, high, sign * bias[here])
        distance = rows.away(_shown(branch, at), here)
        nearer = distance < away[here]
        u[here[nearer]], away[here[nearer]] = at[nearer], distance[nearer]
    height = curve(np.array(ends))
    for row in np.flatnonzero(np.isnan(u)).tolist():
        end = int(np.argmax(height) if bias[row] >= height.max() else np.argmin(height))
        u[row] = ends[end]
        short[row] = bias[row] / height[end] if height[end] * bias[row] > 0 else 1.0
    if cold:
        u = np.where(rows.bias_V < 0, -np.abs(u), u)
    return u, short


def steepened(along: Array, circuit: Circuit, u: Array, bias: Array) -> None:
    """Let the bias rise where it hardly does, in derivatives by u (n, 5) of what is shown."""
    slope = circuit.bias(along[:, 0], along[:, 1])
    least = _LEAST_SLOPE * np.abs(bias) / np.maximum(np.abs(u), 1e-9)
    flat = np.abs(slope) < least
    along[flat, 0] += (np.where(slope < 0, -least, least) - slope)[flat]


def _shown(branch: Branch, u: Array) -> Array:
    shown = branch.shown(u)
    return np.stack([shown["current_mA"], shown["reader_V"], branch.tip_K(u)])
