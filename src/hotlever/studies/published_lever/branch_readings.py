"""A branch read where a statement asks for it, with derivatives by dimensions and parameters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from hotlever.errors import ComputationError
from hotlever.lever.branch import Branch, branch_end
from hotlever.lever.observables import Linearised, knee_by_parameter
from hotlever.piecewise import Piecewise
from hotlever.probe.circuit import Circuit
from hotlever.types import Array


@dataclass(frozen=True)
class Readings:
    """Reads a branch by tip temperature, bias or power, at its knee, or nearest to a point.

    Derivatives are those at a fixed rise of the tip, and what moves the state along the branch
    until the condition holds again.

    Attributes
    ----------
    linearised : Linearised
        The branch, and how it changes with some parameters.
    """

    linearised: Linearised

    @property
    def branch(self) -> Branch:
        """The branch."""
        return self.linearised.branch

    @property
    def circuit(self) -> Circuit:
        """The circuit that biases are of."""
        return self.linearised.probe.circuit

    def at_tip(self, tip_K: ArrayLike) -> tuple[Array, Array]:
        """Return what the lever shows at tip temperatures (K).

        Returns
        -------
        values : ndarray, shape (4, n)
            V_l (V), I_h (mA), V_r (V) and the rise of the tip (K).
        slopes : ndarray, shape (4, n, p)
            Derivatives by the parameters.

        Raises
        ------
        ComputationError
            If the branch ends before.
        """
        u = self.branch.u_at(np.atleast_1d(tip_K))
        if np.isnan(u).any():
            raise ComputationError(f"the branch ends at {self.branch.hottest_K:.0f} K")
        return self._at(u, np.zeros((u.size, len(self.linearised.names))))

    def at_bias(self, bias_V: ArrayLike) -> tuple[Array, Array]:
        """Return the same at biases (V), as a slow ramp meets them.

        Raises
        ------
        BranchEndError
            If the ramp does not reach one of them.
        """
        reading = self.branch.read(self.circuit, np.atleast_1d(np.asarray(bias_V, dtype=float)))
        u = reading.u
        if np.isnan(u).any():
            raise branch_end(self.branch, reading)
        current = self.branch.curve(u)[:, 1]
        names, along = self.linearised.names, self.branch.curve(u, 1)
        slopes = self.linearised.output_slopes_at(u)
        missing = self.circuit.bias(slopes[:, 0], slopes[:, 1])
        missing = missing + np.stack([self.circuit.bias_by(n, current) for n in names], axis=1)
        return self._at(u, -missing / self.circuit.bias(along[:, 0], along[:, 1])[:, None])

    def at_power(self, power_mW: ArrayLike) -> tuple[Array, Array]:
        """Return the same at powers (mW).

        Raises
        ------
        ComputationError
            If one of them has no state, or several.
        """
        u = self.branch.by_power.u(np.atleast_1d(np.asarray(power_mW, dtype=float)))
        if np.isnan(u).any():
            raise ComputationError("a power has no state on the branch, or several")
        lever_V, current = self.branch.curve(u)[:, :2].T[..., None]
        along, slopes = self.branch.curve(u, 1), self.linearised.output_slopes_at(u)
        missing = lever_V * slopes[:, 1] + current * slopes[:, 0]
        return self._at(u, -missing / (lever_V * along[:, [1]] + current * along[:, [0]]))

    def _at(self, u: Array, u_by_parameter: Array) -> tuple[Array, Array]:
        """Return the same at places that move with the parameters, by (n, p)."""
        moved = self.branch.curve(u, 1)[..., None] * u_by_parameter[:, None]
        slopes = self.linearised.output_slopes_at(u) + moved
        return self.branch.curve(u).T, np.moveaxis(slopes, 1, 0)

    def knee_K(self) -> tuple[float, Array]:
        """Return the tip temperature (K) where V_l is highest, and its derivatives, (p,).

        Raises
        ------
        ComputationError
            If V_l rises to the end of the branch.
        """
        knee, solved = self.branch.knee, self.linearised
        if knee is None:
            raise ComputationError("the lever has no knee")
        return knee.tip_K, knee_by_parameter(self.branch, solved.output_slopes, solved.names)

    def off_point(
        self, point: tuple[float, float], unit: tuple[float, float]
    ) -> tuple[float, Array]:
        """Return how far the I-V curve passes a point of V_l (V) and I_h (mA) by.

        Parameters
        ----------
        point, unit : tuple of float
            Distances are counted in units of their own.

        Returns
        -------
        distance : float
            With a sign: positive on the left of the curve, seen in the direction of rising tips.
        slopes : ndarray, shape (p,)
            Derivatives by the parameters.
        """
        curve = self.branch.curve
        away = [
            (Piecewise(curve.c[..., axis], curve.x) - value) * (1.0 / size)
            for axis, (value, size) in enumerate(zip(point, unit, strict=True))
        ]
        square = Piecewise((away[0] * away[0]).c + (away[1] * away[1]).c, curve.x)
        level = self.branch.turns(square)
        u = float(level[np.argmin(square(level))])
        along = np.array([each(u, 1) for each in away]).ravel()
        normal = np.array([along[1], -along[0]]) / np.linalg.norm(along)
        slopes = self.linearised.output_slopes_at(np.array([u]))[0, :2]
        distance = normal @ [each(u).item() for each in away]
        return float(distance), normal @ (slopes / np.reshape(unit, (2, 1)))
