"""The lever's equations with the heat that still air takes from its surface.

The temperature is continuous at the surface, and still air is linear in θ = ∫κ_air dT. So to
the weak heat equation of each node on the surface comes the node's heat into the air: the
open-air operator, applied to θ(T) of all surface nodes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import diags
from scipy.sparse.linalg import LinearOperator, SuperLU, gmres

from hotlever.errors import ComputationError
from hotlever.lever.equations import PER_CM_TO_MILLI_PER_UM, LeverEquations
from hotlever.lever.space import LeverSpace, SparseJacobian, factorised
from hotlever.lever3d.still_air import OpenAir
from hotlever.materials import Material
from hotlever.materials.air import kirchhoff_variable
from hotlever.probe import Circuit

Array = NDArray[np.float64]
Index = NDArray[np.intp]

#: Relative accuracy of the linear solves, and the number of iterations they may take.
GMRES_TOLERANCE, GMRES_ITERATIONS = 1e-6, 80


class AirLoss(NamedTuple):
    """What a state gives to the air.

    Attributes
    ----------
    heat : ndarray, shape (surface nodes,)
        From each node (mW).
    kappa : ndarray, shape (surface nodes,)
        κ_air at the node (mW/(K µm)).
    coefficients : ndarray
        Of θ in the air (mW/µm).
    """

    heat: Array
    kappa: Array
    coefficients: Array


class SolidEquations(LeverEquations):
    """Equations of a lever in air.

    Parameters
    ----------
    space : LeverSpace
        On tetrahedra.
    surface : ndarray of int
        The nodes of the space on the body, in the order of `air`.
    air : OpenAir
    circuit : Circuit
    material : Material

    Attributes
    ----------
    surface_unknowns : ndarray of int, shape (k,)
        Unknowns of the temperatures on the surface that are free.
    nearby : ndarray, shape (k,)
        Heat from each of these nodes by its θ if θ is the same everywhere (µm, times the
        factor from W/cm to mW/µm).
    """

    def __init__(
        self,
        space: LeverSpace,
        surface: Index,
        air: OpenAir,
        circuit: Circuit,
        material: Material,
    ) -> None:
        super().__init__(space, circuit, material)
        self.full, self.surface, self.air = space, surface, air
        unknowns = space.temperature_unknowns[surface]
        self._free = np.flatnonzero(unknowns >= 0)
        self.surface_unknowns = unknowns[self._free]
        self._latest_loss: tuple[Array, AirLoss] | None = None
        # how the heat of a node depends on its own θ if all have the same: close enough to
        # the operator that the linear solver needs few iterations
        _, alike = air.solve(np.ones(surface.size))
        self.nearby = PER_CM_TO_MILLI_PER_UM * np.maximum(alike[self._free], 0.0)

    def loss(self, x: Array) -> AirLoss:
        """Return the heat into the air of a state."""
        if self._latest_loss is None or self._latest_loss[0] is not x:
            base = self.circuit.base_temperature_K
            T = self.full.nodal(x, base)[0][self.surface]
            theta, by = kirchhoff_variable(T, base)
            unit = PER_CM_TO_MILLI_PER_UM
            coefficients, heat = self.air.solve(unit * theta)
            self._latest_loss = (x, AirLoss(heat, unit * by["T"], coefficients))
        return self._latest_loss[1]

    def residual(self, x: Array) -> Array:
        """Return the residual without the pin, shape (size + 1,)."""
        weak = super().residual(x)
        weak[self.surface_unknowns] += self.loss(x).heat[self._free]
        return weak

    def jacobian(self, x: Array) -> AirJacobian:
        """Return the Jacobian of the free values and of the current, ready to be completed."""
        inner = super().jacobian(x)
        assert isinstance(inner, SparseJacobian)
        return AirJacobian(self, inner, self.loss(x).kappa[self._free])

    def into_air(self, change: Array) -> Array:
        """Return the change of each free surface node's heat with θ of these nodes (mW/µm)."""
        theta = np.zeros(self.surface.size)
        theta[self._free] = change
        heat: Array = self.air.solve(theta)[1][self._free]
        return heat

    def observe(self, x: Array) -> dict[str, float]:
        """Return everything that is observed of a solved state; see `LeverEquations.observe`.

        With air also ``air_heat_mW``, the net heat that the lever gives to the air, and
        ``far_heat_mW``, the part that goes to infinity; the rest warms the leg ends' faces.
        """
        loss = self.loss(x)
        return {
            **super().observe(x),
            "air_heat_mW": float(loss.heat[self._free].sum()),
            "far_heat_mW": self.air.at_infinity(loss.coefficients),
        }


class AirJacobian:
    """Linearised equations of a lever in air; see `equations.Jacobian`."""

    def __init__(self, equations: SolidEquations, inner: SparseJacobian, kappa: Array) -> None:
        self._equations, self._inner, self._kappa = equations, inner, kappa
        self.current_gradient = inner.current_gradient

    def completed(
        self, series_resistance_kohm: float, pin_bias: float, pin_tip: float
    ) -> LinearOperator:
        """Return the square matrix as an operator; see `equations.Jacobian`."""
        silicon = self._inner.completed(series_resistance_kohm, pin_bias, pin_tip)
        unknowns = self._equations.surface_unknowns

        def apply(change: Array) -> Array:
            result = silicon @ change.ravel()
            result[unknowns] += self._equations.into_air(self._kappa * change.ravel()[unknowns])
            return result

        return LinearOperator(silicon.shape, matvec=apply)

    def factorised(
        self, series_resistance_kohm: float, pin_bias: float, pin_tip: float
    ) -> AirSolve:
        """Complete and factorise, with a diagonal in place of the air's operator."""
        silicon = self._inner.completed(series_resistance_kohm, pin_bias, pin_tip)
        added = np.zeros(silicon.shape[0])
        added[self._equations.surface_unknowns] = self._equations.nearby * self._kappa
        lu = factorised((silicon + diags(added)).tocsc())
        return AirSolve(self._equations, lu, self._kappa)


class AirSolve:
    """Solves with the Jacobian: GMRES, preconditioned by the factorised silicon.

    Attributes
    ----------
    iterations : int
        Spent so far.
    """

    def __init__(self, equations: SolidEquations, lu: SuperLU, kappa: Array) -> None:
        self._equations, self._lu, self._kappa = equations, lu, kappa
        self.iterations = 0
        size = equations.space.size + 2
        self._operator = LinearOperator((size, size), matvec=self._apply)

    def _apply(self, change: Array) -> Array:
        """The preconditioned Jacobian: the identity and what the diagonal leaves out."""
        equations, unknowns = self._equations, self._equations.surface_unknowns
        theta = self._kappa * change.ravel()[unknowns]
        left_out = np.zeros(change.size)
        left_out[unknowns] = equations.into_air(theta) - equations.nearby * theta
        return change.ravel() + self._lu.solve(left_out)

    def solve(self, right_hand_side: Array) -> Array:
        """Solve for one right-hand side (n,) or several (n, k)."""
        if right_hand_side.ndim == 2:
            return np.column_stack([self.solve(column) for column in right_hand_side.T])

        def count(_: float) -> None:
            self.iterations += 1

        start = self._lu.solve(right_hand_side)
        solution, failed = gmres(
            self._operator,
            start,
            x0=start,
            rtol=GMRES_TOLERANCE,
            restart=GMRES_ITERATIONS,
            maxiter=1,
            callback=count,
            callback_type="pr_norm",
        )
        if failed:
            raise ComputationError("the linear equations of the lever in air were not solved")
        return solution
