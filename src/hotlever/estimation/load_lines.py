"""What the rows of a measurement show of a lever: states of its branch, each on its load line.

A row says that V_l + R_s I_h was the bias. A branch that folds has several such states, or none; a
slow ramp takes the first. A search must not jump with its candidates from one part of a branch to
another, so it compares each row with the state nearest to what was measured, and where a candidate
ends before the bias of a row, with that end as if it went on with the resistance it has there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from hotlever.lever.branch import TIP_RISE, Branch
from hotlever.lever.curve import crossing, spline_through
from hotlever.lever.observables import at_fixed_bias, observed, observed_by
from hotlever.piecewise import Piecewise
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
    shown : ndarray, shape (observables, n), optional
        What was measured, `hotlever.measurands.OBSERVABLES`; NaN where nothing was. Without it the
        states are those of a slow ramp.
    """

    bias_V: Array
    shown: Array | None = None

    def states(self, branch: Branch, circuit: Circuit) -> tuple[Array, Array]:
        """Return u of the states that the rows are compared with, and how far these fall short.

        By so much, at least one, the values of a state are to be multiplied to reach the bias.

        Raises
        ------
        BranchEndError
            If a slow ramp finds no state at one of the biases.
        """
        if self.shown is not None:
            return self._nearest(branch, circuit)
        reading = branch.read(circuit, self.bias_V)
        if np.isnan(reading.u).any():
            raise branch.ended(reading)
        return reading.u, np.ones(reading.u.shape)

    def values(self, branch: Branch, circuit: Circuit) -> Array:
        """Return the observables of the states, (observables, n); see `states`."""
        u, short = self.states(branch, circuit)
        return observed(circuit, _reaching(branch, u, short))

    def differentiated(
        self, branch: Branch, by_parameter: Array, circuit: Circuit, names: Sequence[str]
    ) -> tuple[Array, Array]:
        """Return the same, and derivatives (observables, n, p) by parameters; see `states`.

        Parameters
        ----------
        branch : Branch
        by_parameter : ndarray, shape (k, 4, p)
            How its states change, see `hotlever.lever.sensitivities.by_parameter`.
        circuit : Circuit
        names : sequence of str
            The parameters.
        """
        u, short = self.states(branch, circuit)
        shown = _reaching(branch, u, short)
        by_state = spline_through(branch.u, by_parameter)(u)
        of_circuit = np.stack([circuit.bias_by(name, shown[1] / short) for name in names], axis=1)
        along = branch.curve(u, 1)
        if self.shown is not None:
            self._steepen(along, circuit, u)
        slopes = at_fixed_bias(along, circuit, by_state, of_circuit)
        ends = np.flatnonzero(short > 1.0)
        if ends.size:
            # the end of a branch stays where it is, to first order; what it lacks in bias changes
            bias_by = circuit.bias(by_state[ends, 0], by_state[ends, 1]) + of_circuit[ends]
            more = (short[ends] / self.bias_V[ends])[:, None] * bias_by
            slopes[:, ends] = np.moveaxis(by_state[ends], 1, 0)
            slopes[:TIP_RISE, ends] *= short[ends, None]
            slopes[:TIP_RISE, ends] -= shown[:TIP_RISE, ends, None] * more
        return observed(circuit, shown), observed_by(circuit, shown, slopes, names)

    def _nearest(self, branch: Branch, circuit: Circuit) -> tuple[Array, Array]:
        """Return the states nearest to what was measured; see `states`."""
        curve = branch.bias_by_u(circuit)
        cold = branch.begins_cold
        start = float(branch.u[0])
        level = np.sort(curve.derivative().roots())
        ends = [start, *level[(level > start) & (level < branch.end_u)].tolist(), branch.end_u]
        # a cold lever is told apart from itself by the size of the bias only, and has none without
        bias = np.abs(self.bias_V) if cold else self.bias_V
        heated = np.flatnonzero((bias > 0) | (not cold))
        u, distance = np.zeros(bias.shape), np.full(bias.shape, np.inf)
        u[heated] = np.nan
        short = np.ones(bias.shape)
        for low, high in pairwise(ends):
            first, last = float(curve(low)), float(curve(high))
            here = heated[(bias[heated] >= min(first, last)) & (bias[heated] <= max(first, last))]
            if not here.size:
                continue
            sign = 1.0 if last >= first else -1.0
            at = crossing(Piecewise(sign * curve.c, curve.x), low, high, sign * bias[here])
            away = self._distance(observed(circuit, branch.curve(at).T), here)
            nearer = away < distance[here]
            u[here[nearer]], distance[here[nearer]] = at[nearer], away[nearer]
        height = curve(np.array(ends))
        for row in np.flatnonzero(np.isnan(u)).tolist():
            end = int(np.argmax(height) if bias[row] >= height.max() else np.argmin(height))
            u[row] = ends[end]
            short[row] = bias[row] / height[end] if height[end] * bias[row] > 0 else 1.0
        if cold:
            u = np.where(self.bias_V < 0, -np.abs(u), u)
        return u, short

    def _distance(self, values: Array, rows: Index) -> Array:
        """Return how far values (observables, m) are from some rows, as squares of shares."""
        assert self.shown is not None
        shown = self.shown[: len(values)]
        largest = np.nanmax(np.abs(shown), axis=1, keepdims=True, initial=1e-300)
        return np.asarray(np.nansum(((values - shown[:, rows]) / largest) ** 2, axis=0))

    def _steepen(self, along: Array, circuit: Circuit, u: Array) -> None:
        """Let the bias rise where it hardly does, in derivatives by u (n, 5) of what is shown."""
        slope = circuit.bias(along[:, 0], along[:, 1])
        least = _LEAST_SLOPE * np.abs(self.bias_V) / np.maximum(np.abs(u), 1e-9)
        flat = np.abs(slope) < least
        along[flat, 0] += (np.where(slope < 0, -least, least) - slope)[flat]


def _reaching(branch: Branch, u: Array, short: Array) -> Array:
    """Return V_l, I_h, V_r and the rise of the tip at some u, (4, n), as far as the bias goes."""
    shown = branch.curve(u).T.copy()
    shown[:TIP_RISE] *= short
    return shown
