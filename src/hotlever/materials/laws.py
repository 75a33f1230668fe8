"""What every material law has in common: derivatives, a range, and calm beyond it.

A law is a plain function of arrays. It returns its value and a dict of exact partial derivatives,
keyed by argument name, one for each argument that is a number; the first line of its docstring
says the value's unit. The decorator `law` notes the temperature range that the law is meant for
and replaces the temperature by `limited_temperature`, so that an iterate of Newton's method that
strays to 20 K or 10⁵ K meets a finite, smooth, monotone continuation and can come back. Results
outside the range are never silent: the notes of a sweep state them.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, Protocol, cast

import numpy as np
from numpy.typing import ArrayLike

from hotlever.types import Array

# What a law returns.
Evaluated = tuple[Array, dict[str, Array]]

#: Between these temperatures (K) every law follows its formula to the letter.
FORMULA_FROM, FORMULA_TO = 200.0, 1700.0
#: Width (K) over which a law levels off outside.
LEVELLING = 100.0


class Law(Protocol):
    """A material law, ``value, partials = law(T, ...)``; the rest is what `law` notes."""

    temperature_range: tuple[float, float]
    steps: tuple[float, ...]
    source: str
    #: What it is within the range of its formula.
    formula: Callable[..., Evaluated]

    def __call__(self, *args: Any, **kwargs: Any) -> Evaluated:
        """Evaluate the law and its partial derivatives."""
        ...


def limited_temperature(T: ArrayLike) -> tuple[Array, Array]:
    """Return a temperature that levels off outside the laws' formulas, and its derivative by `T`.

    The identity from 200 to 1700 K; beyond, a tanh approaches 100 K and 1800 K. Twice
    continuously differentiable and monotone for any real `T` (K).

    Examples
    --------
    >>> limited, slope = limited_temperature([293.0, 1e6])
    >>> limited.tolist(), slope.tolist()
    ([293.0, 1800.0], [1.0, 0.0])
    """
    T = np.asarray(T, dtype=float)
    inside = np.clip(T, FORMULA_FROM, FORMULA_TO)
    if np.array_equal(inside, T):  # nearly always; the tanh takes as long as a law
        return inside, np.ones_like(inside)
    beyond = np.tanh((T - inside) / LEVELLING)
    return inside + LEVELLING * beyond, 1.0 - beyond**2


def law(
    *, meant_for: tuple[float, float], source: str, steps: tuple[float, ...] = ()
) -> Callable[[Callable[..., Evaluated]], Law]:
    """Make a law of a formula in T: see the module's text.

    Parameters
    ----------
    meant_for : tuple of float
        Temperature range (K) in which the formula describes measurements.
    source : str
        Equation number and reference.
    steps : tuple of float
        Temperatures (K) at which the slope of the formula steps.
    """

    def decorate(formula: Callable[..., Evaluated]) -> Law:
        @functools.wraps(formula)
        def limited(T: ArrayLike, *args: Any, **kwargs: Any) -> Evaluated:
            temperature, slope = limited_temperature(T)
            value, partials = formula(temperature, *args, **kwargs)
            return value, {**partials, "T": partials["T"] * slope}

        notes = {"temperature_range": meant_for, "steps": steps, "formula": formula}
        vars(limited).update(notes, source=source)
        return cast(Law, limited)

    return decorate
