"""How wrong a reduced lever is: its states put into the equations of the full one.

Two steps with the full residual and the Jacobian at the reduced state show where the full state
lies, up to an error of third order in the distance. No full state has to be found.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hotlever.lever.continuation import AT_BIAS
from hotlever.lever.lever import Lever
from hotlever.lever.reduced import ReducedSpace
from hotlever.lever.reduced_lever import ReducedStates
from hotlever.threads import one_blas_thread

Array = NDArray[np.float64]

#: What a reduced lever may be wrong by: relative in I_h and V_r, K in T_tip.
TOLERANCE = np.array([1e-5, 1e-5, 0.02])
#: The estimate is this share larger than the steps say, and larger by the second of them; ...
_SAFETY = 1.1
#: ... and never below what the states are solved to (mA, V, K).
_FLOOR = np.array([2e-8, 2e-8, 5e-5])


@one_blas_thread
def estimated_error(
    lever: Lever, space: ReducedSpace, states: ReducedStates, columns: Sequence[int] | None = None
) -> Array:
    """Estimate how far solved states of a reduced lever are from the full lever's.

    Parameters
    ----------
    lever : Lever
        The full one; the material is that of the states.
    space : ReducedSpace
        That the states belong to.
    states : ReducedStates
    columns : sequence of int, optional
        Which of the states; all by default.

    Returns
    -------
    ndarray, shape (3, columns)
        Bounds on the errors of I_h (mA), V_r (V) and T_tip (K).
    """
    equations = lever.with_material(states.material).equations
    chosen = range(states.bias.size) if columns is None else columns
    errors = []
    for column in chosen:
        x = space.expanded(states.x[:, column])
        pinned = equations.pinned(AT_BIAS, x[-1])
        solver = pinned.factorised(x)
        first = x - solver.solve(pinned.residual(x))
        second = -solver.solve(pinned.residual(first))
        remaining = np.abs(equations.observed_change(first, second))
        found = equations.measured(first + second) - states.observables[:, column]
        errors.append(_SAFETY * np.abs(found) + remaining)
    return np.maximum(np.array(errors).T, _FLOOR[:, None])


def relative_to_tolerance(error: Array, observables: Array) -> float:
    """Return the largest error in units of `TOLERANCE`; an observable without values counts not."""
    size = np.abs(observables)
    size[2] = 1.0
    return float(np.nanmax(error / size / TOLERANCE[:, None]))
