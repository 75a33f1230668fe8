"""Newton's method for several systems side by side, with a step limit. It knows no physics."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from hotlever.errors import NewtonError
from hotlever.lever.space import Factors
from hotlever.types import Array, Index


@dataclass(frozen=True)
class NewtonOptions:
    """When to stop, and when to factorise again.

    Attributes
    ----------
    tolerance : float
        Largest error of a root, in units of `Equations.scale`.
    keep_while : float
        A factorised Jacobian is kept while each step is shorter than this share of the last.
    max_iterations : int
    """

    tolerance: float = 1e-8
    keep_while: float = 0.1
    max_iterations: int = 30


class Equations(Protocol):
    """What Newton's method needs: F(x) of several systems, and their factorised Jacobians.

    Attributes
    ----------
    scale : ndarray, shape (unknowns, 1)
        Size of one unit of each unknown, by which kelvin and volts compare.
    step_limit : ndarray, shape (unknowns, 1)
        Largest step of each unknown; a longer step is shortened as a whole.
    """

    scale: Array
    step_limit: Array

    def residual(self, x: Array, which: Index) -> Array:
        """Return F(x), (unknowns, n), of some of the systems."""
        ...

    def factorised(self, x: Array, which: Index) -> Factors:
        """Return the factorised Jacobians of some of the systems at `x`, (unknowns, n)."""
        ...


@dataclass(frozen=True)
class NewtonResult:
    """Roots, (unknowns, n), and Jacobians factorised near them."""

    x: Array
    factors: Factors


def find_roots(
    equations: Equations,
    x: Array,
    options: NewtonOptions,
    factors: Factors | None = None,
    *,
    fresh: bool = False,
) -> NewtonResult:
    """Find the roots of F near `x`, (unknowns, n), beginning with factors of nearby places.

    They may be fresh: those of `x` itself.

    Raises
    ------
    NewtonError
        If a step is not finite or the iteration limit is reached.

    Notes
    -----
    With a fresh Jacobian a step of length s leaves an error of the order of s² (a second
    derivative of one per unit is pessimistic for a lever); with an old one the steps shrink
    by a steady ratio r and leave s r. Both estimates decide when to stop.
    """
    x = x.copy()
    every = np.arange(x.shape[1])
    is_fresh = np.full(every.size, fresh or factors is None)
    factors = factors or equations.factorised(x, every)
    last = np.full(every.size, np.inf)
    active = every
    for iteration in range(1, options.max_iterations + 1):
        here = x[:, active]
        residual = equations.residual(here, active)
        step = -factors.solve(residual, active)
        length = _length(step / equations.scale)
        slow = ~is_fresh[active] & ~(length < options.keep_while * last[active])
        if slow.any():
            again = active[slow]
            factors = factors.replaced(again, equations.factorised(here[:, slow], again))
            is_fresh[again] = True
            step[:, slow] = -factors.solve(residual[:, slow], again)
            length = _length(step / equations.scale)
        if not np.isfinite(length).all():
            raise NewtonError(f"a step was not finite after {iteration} iterations", partial=x)
        shortening = np.maximum(1.0, _length(step / equations.step_limit))
        x[:, active] = here + step / shortening
        # nothing is known yet of an old Jacobian's first step
        has_last = np.isfinite(last[active])
        old = np.where(has_last, length / np.where(has_last, last[active], 1.0), 1.0)
        ratio = np.where(is_fresh[active], length, old)
        done = (shortening == 1.0) & (length * ratio < options.tolerance)
        is_fresh[active], last[active] = False, length
        active = active[~done]
        if not active.size:
            return NewtonResult(x, factors)
    raise NewtonError(f"not converged after {options.max_iterations} iterations", partial=x)


def _length(columns: Array) -> Array:
    return np.asarray(np.abs(columns).max(axis=0))


def refined(
    solve: Callable[[Array], Array],
    missing: Callable[[Array], Array],
    right_hand_side: Array,
    scale: Array,
    accuracy: float,
) -> Array:
    """Solve a linear system with factors of one nearby; what they lack is removed by refinement.

    Parameters
    ----------
    solve : callable
        Solves with the factors.
    missing : callable
        Returns the right-hand side less the system's own matrix times a solution.
    right_hand_side : ndarray, shape (unknowns, ...)
    scale : ndarray, shape (unknowns, ...)
        Size of one unit of each unknown.
    accuracy : float
        Relative, of the largest entry of each column.
    """
    solution = solve(right_hand_side)
    for _ in range(12):  # at most: what does not settle is returned as it is
        correction = solve(missing(solution))
        solution = solution + correction
        sizes = (np.abs(some / scale).max(axis=0) for some in (correction, solution))
        ratio = np.divide(*(np.maximum(size, 1e-300) for size in sizes))
        # the next correction would be smaller by the same ratio once more
        if not np.any(ratio**2 > accuracy):
            break
    return solution
