"""Heat lost to air in the equations of a lever.

The air operator is a dense matrix between the sites of the lever's surface. It is kept out of the
sparse Jacobian: linear systems are solved by the factorised Jacobian with a local loss, and
Krylov's method for the rest.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from copy import copy
from functools import cached_property
from typing import Any

import numpy as np
from scipy.linalg.blas import dsymv, ssymv
from scipy.sparse import csr_matrix

from hotlever.air.operator import AirOperator
from hotlever.air.stores import HeatInAir
from hotlever.errors import ComputationError
from hotlever.types import Array, Index, LinearSolver


class AirLoss:
    """The air operator between the unknowns of a finite-element lever.

    What is lost is linear in θ at the sites of the operator.

    Parameters
    ----------
    operator : AirOperator
        Or what has its attributes.
    unknowns : ndarray of int, shape (sites, nodes)
        Unknowns of the temperatures of the element at each site; −1 where the node is held.
    shares : ndarray, shape (sites, nodes)
        Their weights in the temperature at the site.
    add_losses : callable, optional
        Adds to the matrices of elements those of losses at the sites with some slopes (sites,).
    size : int
        Number of unknowns, V_l included.

    Attributes
    ----------
    gas_conductivity : float
        Of the gas, over that of air.
    around : callable, optional
        Makes what a gas of some conductivity takes up in time, once it is asked for; None if it
        takes up nothing. It can be pickled, as a lever can.
    """

    gas_conductivity = 1.0
    around: Callable[[float], HeatInAir] | None = None

    def __init__(
        self,
        operator: Any,
        unknowns: Index,
        shares: Array,
        size: int,
        add_losses: Callable[[Array, Array], None] | None = None,
    ) -> None:
        held = unknowns < 0
        self._held = np.where(held, shares, 0.0).sum(axis=1)
        self._take(operator)
        self._nothing_around = HeatInAir.nothing(size)
        rows = np.broadcast_to(np.arange(len(unknowns))[:, None], unknowns.shape)
        self.sampling = csr_matrix(
            (shares[~held], (rows[~held], unknowns[~held])), shape=(len(unknowns), size)
        )
        self.spreading = self.sampling.T.tocsr()
        self._add_losses = add_losses

    def _take(self, operator: Any) -> None:
        self.operator, self.filling = operator, operator.filling
        self._local = operator.matrix @ np.ones(len(operator.sites))
        # the matrix is symmetric: these rows tell all of the heat, and what leg ends have of it
        self._heats = np.stack([self._local, operator.matrix @ self._held])
        self.rest = operator.less(self._local)

    @classmethod
    def nothing(cls, size: int) -> AirLoss:
        """Return that of a lever in vacuum: air that takes nothing from anywhere."""
        vacuum = AirOperator(np.empty((0, 2)), np.empty((0, 0)), filling=0.0)
        unknowns, shares = np.empty((0, 1), dtype=np.intp), np.empty((0, 1))
        return cls(vacuum, unknowns, shares, size)

    @property
    def medium(self) -> str:
        """What is around the lever: vacuum is air without sites."""
        return "air" if len(self._local) else "vacuum"

    @property
    def stores(self) -> HeatInAir:
        """What the air takes up itself; nothing in vacuum, or where that is not known."""
        if self.around is None:
            return self._nothing_around
        return self.around(self.gas_conductivity)

    def in_gas(self, conductivity: float) -> AirLoss:
        """Return the loss to a gas that conducts so many times as well as air."""
        air = copy(self)
        air.gas_conductivity = conductivity
        return air

    def in_gap(self, gap_um: float) -> AirLoss:
        """Return the loss with the surface below at another distance."""
        air = copy(self)
        air._take(self.operator.at_gap(gap_um))
        return air

    def change_with_gap(self, theta: Array) -> Array:
        """Return the derivative of `weak_form` by the gap (per µm)."""
        return _columnwise(self.spreading, _columnwise(self.operator.matrix_by_gap, theta))

    def rise(self, x: Array) -> Array:
        """Return the rise of the temperature (K) at the sites, (sites, ...)."""
        return _columnwise(self.sampling, x)

    def weak_form(self, theta: Array) -> Array:
        """Return the heat lost for θ (mW/µm) at the sites, tested as the weak equations are."""
        return _columnwise(self.spreading, symmetric_product(self.operator.matrix, theta))

    def heat(self, theta: Array) -> tuple[Array, Array]:
        """Return the heat lost (mW) by each state, and its part that is tested at the leg ends."""
        whole, at_ends = self._heats @ theta
        return np.asarray(whole), np.asarray(at_ends)

    def add_local_loss(self, element_matrices: Array, kappa: Array) -> None:
        """Add a loss ∝ the temperature at each site to the matrices of elements.

        Each site loses as it would in a lever of one temperature.
        """
        if self._add_losses is not None:
            self._add_losses(element_matrices, self._local * kappa)

    def solver(
        self, factors: LinearSolver, kappa: Array, taken_up: Array | None, left: float
    ) -> LinearSolver:
        """Return what solves the whole linear system, of the factors of its local part.

        A share of a right-hand side may be left.
        """
        return AirSolver(factors, self, kappa, taken_up, left) if len(kappa) else factors


class ReducedAir:
    """The air operator between temperature modes; see `AirLoss`."""

    def __init__(self, full: AirLoss, modes: Array, size: int) -> None:
        self.filling, self.gas_conductivity = full.filling, full.gas_conductivity
        self._size, self._count, self.heat = size, len(modes), full.heat
        self._samples = full.sampling[:, : modes.shape[1]] @ modes.T
        self._spread = self._samples.T @ full.operator.matrix
        self._full = full
        self._changes = np.zeros((modes.shape[1] + 1, size + 1))
        self._changes[:-1, : self._count] = modes.T

    @cached_property
    def _stores(self) -> tuple[HeatInAir, Array]:
        return self._full.stores.between(self._changes)

    @property
    def stores(self) -> HeatInAir:
        """Heat that the air takes up itself; see `AirLoss`."""
        return self._stores[0]

    def expanded(self, in_air: Array) -> Array:
        """Return the temperatures in the air around the full lever."""
        shares = self._stores[1]
        stores, columns = len(self.stores.stores.rates), in_air.shape[1]
        many = in_air.reshape(stores, shares.shape[1], columns)
        return np.einsum("mk,skn->smn", shares, many).reshape(stores * len(shares), columns)

    def rise(self, x: Array) -> Array:
        """Return the rise of the temperature (K) at the sites, (sites, ...)."""
        return _columnwise(self._samples, x[: self._count])

    def weak_form(self, theta: Array) -> Array:
        """Return the heat lost for θ (mW/µm) at the sites, tested with the modes."""
        weak = np.zeros((self._size + 1, *theta.shape[1:]))
        weak[: self._count] = _columnwise(self._spread, theta)
        return weak

    def matrix(self, kappa: Array, taken_up: Array | None) -> Array:
        """Return what the air adds to the Jacobian of one state, (modes, modes)."""
        added = self._spread @ (kappa[:, None] * self._samples)
        if taken_up is not None:
            own = self.stores.coordinates[:, : self._count]
            added = added + own.T @ taken_up @ own
        return np.asarray(added)


class AirSolver:
    """Solves (M + Eᵀ R κ E) x = b, with M factorised and R the non-local part of the operator.

    With t = E x this is (1 + E M⁻¹ Eᵀ R κ) t = E M⁻¹ b between the sites, solved by generalised
    conjugate residuals. Search directions are kept for the next right-hand side. Transposed, M⁻¹
    is so too, and R κ becomes κ R. In time E has more rows, the shares of the modes that air takes
    up heat for, and there R κ is what it takes up.
    """

    def __init__(
        self,
        factors: LinearSolver,
        air: AirLoss,
        kappa: Array,
        taken_up: Array | None = None,
        left: float = 1e-5,
    ) -> None:
        sites = len(kappa)

        def sampled(x: Array) -> Array:
            at_sites = air.sampling @ x
            if taken_up is None:
                return np.asarray(at_sites)
            return np.append(at_sites, air.stores.shares(x))

        def spread(lost: Array, t: Array) -> Array:
            weak = air.spreading @ lost
            if taken_up is not None:
                weak += air.stores.tested(taken_up @ t[sites:])
            return np.asarray(weak)

        def lost(t: Array) -> Array:
            return spread(symmetric_product(air.rest, kappa * t[:sites]), t)

        def lost_transposed(t: Array) -> Array:
            return spread(kappa * symmetric_product(air.rest, t[:sites]), t)

        self._ways = {
            False: _Directions(lambda b: factors.solve(b), lost, sampled, left),
            True: _Directions(lambda b: factors.solve(b, True), lost_transposed, sampled, left),
        }

    def solve(self, right_hand_side: Array, transposed: bool = False) -> Array:
        """Solve for one right-hand side (size + 1,) or several (size + 1, k).

        Raises
        ------
        ComputationError
            If the directions do not suffice.
        """
        way = self._ways[transposed]
        if right_hand_side.ndim == 1:
            return way.solve(right_hand_side)
        return np.stack([way.solve(column) for column in right_hand_side.T], axis=1)


class _Directions:
    """Generalised conjugate residuals between the sites, for one of the two systems.

    A share of the right-hand side may be left. At most `most` directions are stored.
    """

    def __init__(
        self,
        near: Callable[[Array], Array],
        lost: Callable[[Array], Array],
        sampled: Callable[[Array], Array],
        left: float,
        most: int = 200,
    ) -> None:
        self._near, self._lost, self._sampled = near, lost, sampled
        self._left, self._most = left, most
        # per direction: its image between the sites (orthonormal), and the change of x
        self._images = self._changes = np.empty((0, 0))
        self._count = 0

    def solve(self, right_hand_side: Array) -> Array:
        """Solve for one right-hand side."""
        x = self._near(right_hand_side)
        residual = self._sampled(x)
        goal = self._left * np.linalg.norm(residual)
        used = restarts = 0
        while True:
            if self._count:
                images = self._images[used : self._count]
                shares = images @ residual
                x += shares @ self._changes[used : self._count]
                residual = residual - shares @ images
                used = self._count
            if not np.linalg.norm(residual) > goal:
                return x
            if used == self._most:
                # those of many other right-hand sides fill the memory; begin again
                used, self._count, restarts = 0, 0, restarts + 1
            if restarts > 5:
                raise ComputationError(
                    f"a linear system in air was not solved with {restarts} times "
                    f"{self._most} directions"
                )
            # of unit length: single precision has no digits left of next to nothing, and the
            # direction would stay for others
            self._add(residual / np.linalg.norm(residual))

    def _add(self, direction: Array) -> None:
        count = self._count
        change = -self._near(self._lost(direction))
        image = direction - self._sampled(change)
        if count == len(self._images):
            # some ten serve most right-hand sides, and of one system alone
            more = min(max(16, count), self._most - count)
            self._images, self._changes = (
                np.concatenate([each.reshape(count, new.size), np.empty((more, new.size))])
                for each, new in ((self._images, image), (self._changes, change))
            )
        shares = self._images[:count] @ image
        image = image - shares @ self._images[:count]
        change = change - shares @ self._changes[:count]
        length = np.linalg.norm(image)
        self._images[count], self._changes[count] = image / length, change / length
        self._count += 1


def symmetric_product(matrix: Any, x: Array) -> Array:
    """Return a symmetric matrix times an array of one, two or three axes, in its precision.

    Of a matrix in memory half is read for one column, which takes half of the time.
    """
    if not isinstance(matrix, np.ndarray) or x.size > len(x) or not x.size:
        return _columnwise(matrix, x.astype(matrix.dtype, copy=False))
    product = {"f": ssymv, "d": dsymv}[matrix.dtype.char]
    # the BLAS has matrices column by column
    return np.asarray(product(1.0, matrix.T, x.ravel()).reshape(x.shape))


def _columnwise(matrix: Any, x: Array) -> Array:
    """Return a matrix times an array of one, two or three axes."""
    if 0 in matrix.shape:  # in vacuum there are no sites; SciPy takes its time over nothing
        return np.zeros((matrix.shape[0], *x.shape[1:]))
    product = matrix @ x.reshape(len(x), math.prod(x.shape[1:]))
    return np.asarray(product).reshape(len(product), *x.shape[1:])
