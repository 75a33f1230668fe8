"""Heat lost to air in the equations of a lever.

The air operator is a dense matrix between the sites of the lever's surface. It is kept out of the
sparse Jacobian: linear systems are solved by the factorised Jacobian with a local loss, and
Krylov's method for the rest.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.linalg import LinearOperator, SuperLU

from hotlever.errors import ComputationError
from hotlever.lever.operators import sums_by_index

if TYPE_CHECKING:
    from hotlever.lever.space import SparseJacobian

Array = NDArray[np.float64]
Index = NDArray[np.intp]

#: Krylov's method stops at this residual, relative to the right-hand side: for a step of Newton's
#: method or a tangent, which are corrected later, and for several right-hand sides at once, which
#: are derivatives and are not.
_STEP_TOLERANCE, _TOLERANCE = 1e-5, 1e-7
_MOST_DIRECTIONS = 200


class SurfaceOperator(Protocol):
    """From θ at the sites to the heat lost there: a matrix, or what multiplies like one."""

    @property
    def matrix(self) -> Any:
        """The operator, symmetric and positive semi-definite; see `AirOperator`."""
        ...

    @property
    def sites(self) -> Array:
        """Places (µm), one row each."""
        ...

    @property
    def filling(self) -> float:
        """Share of κ_air to be taken off the silicon; see `AirOperator`."""
        ...

    def less(self, diagonal: Array) -> Any:
        """Return the operator less a diagonal matrix."""
        ...


class AirLoss:
    """The air operator between the unknowns of a finite-element lever.

    Parameters
    ----------
    operator : SurfaceOperator
    unknowns : ndarray of int, shape (sites, nodes)
        Unknowns of the temperatures of the element at each site; −1 where the node is held.
    shares : ndarray, shape (sites, nodes)
        Their weights in the temperature at the site.
    slots : ndarray of int, shape (sites, nodes, nodes)
        Where products of two of them go among the entries of the sparse Jacobian.
    size : int
        Number of unknowns.
    """

    def __init__(
        self, operator: SurfaceOperator, unknowns: Index, shares: Array, slots: Index, size: int
    ) -> None:
        self.sites, self.matrix, self.filling = operator.sites, operator.matrix, operator.filling
        held = unknowns < 0
        self._held = np.where(held, shares, 0.0).sum(axis=1)
        rows = np.broadcast_to(np.arange(len(unknowns))[:, None], unknowns.shape)
        self.sampling = csr_matrix(
            (shares[~held], (rows[~held], unknowns[~held])), shape=(len(unknowns), size)
        )
        self.spreading = self.sampling.T.tocsr()
        self._slots = slots
        self._products = shares[:, :, None] * shares[:, None, :]
        self._local = self.matrix @ np.ones(len(unknowns))
        self.rest = operator.less(self._local)

    def temperature(self, x: Array, base_temperature_K: float) -> Array:
        """Return the temperature (K) at the sites."""
        temperature: Array = self.sampling @ x + base_temperature_K * self._held
        return temperature

    def weak_form(self, theta: Array) -> Array:
        """Return the heat lost for θ (mW/µm) at the sites, tested as the weak equations are."""
        weak: Array = self.spreading @ (self.matrix @ theta)
        return weak[:-1]

    def heat(self, theta: Array) -> tuple[float, float]:
        """Return the heat lost (mW), and its part that is tested at the leg ends."""
        heat = self.matrix @ theta
        return float(heat.sum()), float(self._held @ heat)

    def local_entries(self, kappa: Array, entries: int) -> Array:
        """Return what a loss ∝ the temperature at each site adds to the sparse Jacobian.

        Each site loses as it would in a lever of one temperature.
        """
        values = (self._local * kappa)[:, None, None] * self._products
        return sums_by_index(self._slots, values, entries + 1)[:entries]

    def added(self, jacobian: SparseJacobian, kappa: Array) -> AirJacobian:
        """Return the Jacobian with air; κ_air (mW/(K µm)) at the sites."""
        return AirJacobian(jacobian, self, kappa)


class AirJacobian:
    """The linearised equations with air: a sparse matrix and the air operator."""

    def __init__(self, sparse: SparseJacobian, air: AirLoss, kappa: Array) -> None:
        self._sparse, self._air, self._kappa = sparse, air, kappa
        self.current_gradient = sparse.current_gradient

    def completed(
        self, series_resistance_kohm: float, pin_bias: float, pin_tip: float
    ) -> LinearOperator:
        """Return the square matrix; the last rows are circuit equation and pin."""
        matrix = self._sparse.completed(series_resistance_kohm, pin_bias, pin_tip)
        air, kappa = self._air, self._kappa

        def product(x: Array) -> Array:
            loss: Array = air.spreading @ (air.matrix @ (kappa * (air.sampling @ x)))
            return matrix @ x + loss

        return LinearOperator(matrix.shape, matvec=product, dtype=float)

    def factorised(
        self, series_resistance_kohm: float, pin_bias: float, pin_tip: float
    ) -> AirSolver:
        """Complete, and factorise the sparse part with the local loss."""
        local = self._sparse.plus(self._air.local_entries(self._kappa, self._sparse.entries))
        factors = local.factorised(series_resistance_kohm, pin_bias, pin_tip)
        return AirSolver(factors, self._air, self._kappa)


class AirSolver:
    """Solves (M + Eᵀ R κ E) x = b, with M factorised and R the non-local part of the operator.

    With t = E x this is (1 + E M⁻¹ Eᵀ R κ) t = E M⁻¹ b between the sites, solved by generalised
    conjugate residuals. Search directions are kept for the next right-hand side.
    """

    def __init__(self, factors: SuperLU, air: AirLoss, kappa: Array) -> None:
        self._factors, self._air, self._kappa = factors, air, kappa
        count, size = air.sampling.shape
        # per direction: its image between the sites (orthonormal), and the change of x
        self._images = np.empty((_MOST_DIRECTIONS, count))
        self._changes = np.empty((_MOST_DIRECTIONS, size))
        self._known = 0

    def solve(self, right_hand_side: Array) -> Array:
        """Solve for one right-hand side (n,) or several (n, k)."""
        if right_hand_side.ndim == 1:
            return self._solve(right_hand_side, _STEP_TOLERANCE)
        return np.stack([self._solve(b, _TOLERANCE) for b in right_hand_side.T], axis=1)

    def _solve(self, right_hand_side: Array, tolerance: float) -> Array:
        x: Array = self._factors.solve(right_hand_side)
        residual = self._air.sampling @ x
        goal = tolerance * np.linalg.norm(residual)
        used = 0
        while True:
            images = self._images[used : self._known]
            shares = images @ residual
            x += shares @ self._changes[used : self._known]
            residual = residual - shares @ images
            used = self._known
            if not np.linalg.norm(residual) > goal:
                return x
            if used == _MOST_DIRECTIONS:
                raise ComputationError(
                    f"a linear system in air was not solved with {used} directions"
                )
            self._add_direction(residual)

    def _add_direction(self, direction: Array) -> None:
        air, known = self._air, self._known
        change = -self._factors.solve(air.spreading @ (air.rest @ (self._kappa * direction)))
        image = direction - air.sampling @ change
        shares = self._images[:known] @ image
        image = image - shares @ self._images[:known]
        change = change - shares @ self._changes[:known]
        length = np.linalg.norm(image)
        self._images[known], self._changes[known] = image / length, change / length
        self._known += 1
