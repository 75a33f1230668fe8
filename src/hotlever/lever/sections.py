"""Where along a branch a state is, so that the states of similar levers can be compared.

Each place u of a branch has a pin, a line in the plane of tip temperature and lever voltage, and
its state is the one on that line. A lever that starts cold has one state at each tip temperature,
u² above the base. Another one is warm without a bias and may cool at first; its places are lines
across a curve, which is that of a lever like it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import numpy as np

from hotlever.lever.space import TIP, Pin, Space
from hotlever.types import Array

if TYPE_CHECKING:
    from scipy.interpolate import PPoly

#: Units in which changes of the tip (K) and of the lever voltage (V) compare.
UNIT_K, UNIT_V = 60.0, 1.0


def in_plane(space: Space, x: Array) -> Array:
    """Return tip and lever voltage of states, or of changes of them, in their units, (n, 2)."""
    return np.stack([space.tip_rise(x) / UNIT_K, x[-1] / UNIT_V], axis=-1)


class Sections(Protocol):
    """The pins of the places u (n,) of a branch."""

    def pin(self, u: Array) -> Pin:
        """Return the pin of each place."""
        ...

    def values(self, u: Array) -> Array:
        """Return the value that the pin has there, (n,)."""
        ...

    def rate(self, u: Array, space: Space, x: Array) -> Array:
        """Return how fast pins pass states (size + 1, n): change of value for one of u, (n,)."""
        ...


class ByTip:
    """The places of a lever that starts cold: u = √(T_tip − T_base)."""

    def pin(self, u: Array) -> Pin:
        """See `Sections`."""
        return TIP

    def values(self, u: Array) -> Array:
        """See `Sections`."""
        return np.asarray(u**2)

    def rate(self, u: Array, space: Space, x: Array) -> Array:
        """See `Sections`."""
        return np.asarray(2.0 * u)


class Across:
    """Lines across a curve in the plane of tip and lever voltage.

    Parameters
    ----------
    curve : PPoly
        Both by u, see `in_plane`.
    """

    def __init__(self, curve: PPoly) -> None:
        self._curve = curve

    def pin(self, u: Array) -> Pin:
        """See `Sections`."""
        tip, lever = self._curve(u, 1).T
        return Pin(tip / UNIT_K, lever / UNIT_V)

    def values(self, u: Array) -> Array:
        """See `Sections`."""
        return np.asarray((self._curve(u, 1) * self._curve(u)).sum(axis=1))

    def rate(self, u: Array, space: Space, x: Array) -> Array:
        """See `Sections`."""
        along, bend = self._curve(u, 1), self._curve(u, 2)
        # the lines turn, so that they pass faster on the outside of a bend than on the inside
        aside = in_plane(space, x) - self._curve(u)
        return np.asarray((along**2 - bend * aside).sum(axis=1))
