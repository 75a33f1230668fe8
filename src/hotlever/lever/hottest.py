"""How hot a lever gets anywhere, between the states of its branch.

Which place is the hottest changes along a branch: a leg may overtake the heater. So the
temperatures of all places that come into question are read off their own smooth curves, and the
highest of them is taken last. A curve through the highest temperatures of the states would not
know of the bend where one place overtakes another.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hotlever.lever.curve import smooth_curve
from hotlever.types import Array

if TYPE_CHECKING:
    from hotlever.lever.branch import Branch

#: Places along a branch that are looked at together.
_AT_ONCE = 64
#: Elements with this share of the highest rise at a state nearby come into question.
_NEARLY = 0.85
#: Points at which a temperature is looked for between two states, and how often between those.
_POINTS, _ROUNDS = 17, 3


def highest_rises(branch: Branch, u: Array) -> Array:
    """Return the highest rise of the temperature (K) in a lever at places of its branch, (n,)."""
    found, order = np.empty(u.size), np.argsort(u)
    for some in np.split(order, range(_AT_ONCE, u.size, _AT_ONCE)):
        if some.size:
            found[some] = _between_few(branch, u[some])
    return found


def where_it_reaches(branch: Branch, rise: float) -> float:
    """Return the first u at which the highest rise of a branch is `rise` (K), as it is at its end.

    The place lies before the first state that is as hot.
    """
    after = int(np.flatnonzero(branch.highest_rise >= rise)[0])
    if after == 0:
        return float(branch.u[0])
    low, high = branch.u[after - 1 : after + 1]
    for _ in range(_ROUNDS):
        u = np.linspace(low, high, _POINTS)
        rises = highest_rises(branch, u)
        above = max(1, int(np.argmax(rises >= rise)))
        (low, high), ends = u[above - 1 : above + 1], rises[above - 1 : above + 1]
    return float(np.interp(rise, ends, [low, high]))


def _between_few(branch: Branch, u: Array) -> Array:
    """Return the highest rises at few u in rising order."""
    first, last = np.searchsorted(branch.u, u[[0, -1]])
    # the curve between two states depends on the next ones on either side
    near = slice(max(first - 2, 0), last + 2)
    nodes, unit = branch.u[near], np.eye(branch.u[near].size)
    weights = smooth_curve(
        nodes, np.hstack([unit, 0.0 * unit]), np.hstack([0.0 * unit, unit]), branch.steps
    )(u)
    equations, elements = branch.equations, branch.equations.space.elements
    rises = equations.nodal_rises(branch.x[:, near])
    slopes = equations.space.nodal_rises(branch.slopes[:, near])
    dofs = elements.dofs[elements.near_highest(rises, _NEARLY)]
    used, dofs = np.unique(dofs, return_inverse=True)
    values = np.hstack([rises[used], slopes[used]]) @ weights.T
    return elements.highest(values, dofs.reshape(-1, elements.dofs.shape[1]))
