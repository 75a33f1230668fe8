"""Where a lever jumps: between two measured biases, and nothing says where.

A ramp of the bias that passes a fold leaves the cold part of a branch for the hot one. The rows
tell between which biases that was; there the tip may still be cold, or hot already.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hotlever.lever import Branch
from hotlever.probe import Circuit
from hotlever.types import Array

#: Rows that are on another part of the branch than a ramp takes by more than so many kelvins, so
#: many of them, show no such lever: one or two beside a jump may.
_ASIDE_K, _ROWS = 20.0, 3
#: How far above a fold the state after the jump is read, as a share of the bias.
_BEYOND = 1e-6


@dataclass(frozen=True)
class Jump:
    """A jump of a slow ramp of the bias.

    Attributes
    ----------
    from_V, to_V : float
        The measured biases between which it was.
    cold_K, hot_K : float
        Tip temperatures before and after it.
    """

    from_V: float
    to_V: float
    cold_K: float
    hot_K: float

    @property
    def note(self) -> str:
        """What a user should know of it."""
        return (
            f"between biases of {self.from_V:.4g} and {self.to_V:.4g} V the lever jumps from a tip "
            f"at {self.cold_K:.0f} K to {self.hot_K:.0f} K; the data do not say where"
        )

    def unknown(self, bias: Array) -> Array:
        """Return at which biases (V), (n,), the tip may be on either side."""
        return np.asarray((bias > self.from_V) & (bias < self.to_V))


def jumps_of(branch: Branch, circuit: Circuit, bias: Array, tip_K: Array) -> list[Jump]:
    """Return the jumps of a lever between measured rows, by their bias (V) and tip (K), (n,)."""
    if not bias.size or not circuit.starts_cold:
        return []
    jumps = []
    reading = branch.read(circuit, np.array([float(bias.max())]))
    for fold_V, cold_K in reading.jumps:
        beyond = branch.read(circuit, np.array([fold_V * (1.0 + _BEYOND)]))
        hot_K = float(branch.tip_K(beyond.u[0]))
        if not np.isfinite(hot_K):
            continue
        hot = tip_K > 0.5 * (cold_K + hot_K)
        from_V = float(bias[~hot].max(initial=0.0))
        to_V = float(bias[hot].min(initial=float(bias.max())))
        jumps.append(Jump(min(from_V, fold_V), max(to_V, fold_V), cold_K, hot_K))
    return jumps


def not_of_a_ramp(branch: Branch, circuit: Circuit, bias: Array, tip_K: Array) -> str:
    """Say that rows lie where a slow ramp of the bias does not come; empty if they do not."""
    u = branch.read(circuit, bias).u
    aside = np.abs(branch.tip_K(u) - tip_K) > _ASIDE_K
    if aside.sum() < _ROWS:
        return ""
    return (
        f"the lever that comes nearest jumps, and its rows from {bias[aside].min():.3g} to "
        f"{bias[aside].max():.3g} V lie on another part of its branch than a ramp takes"
    )
