"""Newton's method with a step limit. It knows no physics."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from hotlever.errors import NewtonError

Array = NDArray[np.float64]


class LinearSolve(Protocol):
    """A factorised matrix."""

    def solve(self, right_hand_side: Array) -> Array:
        """Solve for one right-hand side (n,) or several (n, k)."""
        ...


@dataclass(frozen=True)
class NewtonOptions:
    """When to stop, and when to factorise again.

    Attributes
    ----------
    tolerance : float
        Largest error of the root, in units of `Equations.scale`.
    keep_while : float
        A factorised Jacobian is kept while each step is shorter than this share of the last.
    max_iterations : int
    """

    tolerance: float = 1e-8
    keep_while: float = 0.1
    max_iterations: int = 30


class Equations(Protocol):
    """What Newton's method needs: F(x), and a factorised dF/dx.

    Attributes
    ----------
    scale : ndarray, shape (n,)
        Size of one unit of each unknown, by which kelvin and volts compare.
    step_limit : ndarray, shape (n,)
        Largest step of each unknown; a longer step is shortened as a whole.
    """

    scale: Array
    step_limit: Array

    def residual(self, x: Array) -> Array:
        """Return F(x), shape (n,)."""
        ...

    def factorised(self, x: Array) -> LinearSolve:
        """Return the factorised Jacobian at `x`."""
        ...


@dataclass(frozen=True)
class NewtonResult:
    """A root, and the Jacobian factorised last, near it."""

    x: Array
    jacobian: LinearSolve
    iterations: int


def newton(
    equations: Equations,
    x: Array,
    options: NewtonOptions,
    jacobian: LinearSolve | None = None,
) -> NewtonResult:
    """Find a root of F near `x`.

    Parameters
    ----------
    equations : Equations
    x : ndarray, shape (n,)
        Start.
    options : NewtonOptions
    jacobian : LinearSolve, optional
        Of a nearby place, to begin with; made at `x` by default.

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
    fresh, last = jacobian is None, np.inf
    jacobian = jacobian or equations.factorised(x)
    for iteration in range(1, options.max_iterations + 1):
        residual = equations.residual(x)
        step = -jacobian.solve(residual)
        length = _length(step, equations.scale)
        if not fresh and not length < options.keep_while * last:
            jacobian, fresh = equations.factorised(x), True
            step = -jacobian.solve(residual)
            length = _length(step, equations.scale)
        if not np.isfinite(length):
            raise NewtonError(f"a step was not finite after {iteration} iterations", partial=x)
        shortening = max(1.0, _length(step, equations.step_limit))
        x = x + step / shortening
        # nothing is known yet of an old Jacobian's first step
        ratio = length if fresh else length / last if np.isfinite(last) else 1.0
        if shortening == 1.0 and length * ratio < options.tolerance:
            return NewtonResult(x, jacobian, iteration)
        fresh, last = False, length
    raise NewtonError(f"not converged after {options.max_iterations} iterations", partial=x)


def _length(step: Array, unit: Array) -> float:
    return float(np.max(np.abs(step / unit)))
