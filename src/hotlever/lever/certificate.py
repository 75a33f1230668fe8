"""How wrong a reduced lever is: its states put into the equations of the full one.

Two steps with the full residual and the Jacobian at the reduced state show where the full state
of the same tip temperature lies, up to an error of third order in the distance. No full state has
to be found.
"""

from __future__ import annotations

import numpy as np

from hotlever.errors import ComputationError
from hotlever.lever.branch import Branch, Reach
from hotlever.lever.equations import LeverEquations
from hotlever.lever.lever import Lever
from hotlever.lever.pinned import Pinned
from hotlever.lever.reduced import ReducedLever, ReducedSpace
from hotlever.lever.sensitivities import at_fixed_bias
from hotlever.threads import one_blas_thread
from hotlever.types import Array

#: The estimate is this share larger than the steps say, and larger by the second of them; ...
_SAFETY = 1.1
#: ... and never below what the states are solved to (mA, V, K).
_FLOOR = np.array([2e-8, 2e-8, 5e-5])
#: Error (K) that a certified branch may have, and the places along it where that is looked at.
_WITHIN_K, _PLACES = 0.1, 12


def certified_branch(
    lever: Lever, reduced: ReducedLever, bias_V: float, within_K: float = _WITHIN_K
) -> Branch:
    """Return the branch of a lever from its reduced one, where that is as accurate as asked for.

    A reduced lever is trained for some materials (`hotlever.lever.box.Box`) and may be off by
    kelvins for others within the bounds of a fit. Fits are confirmed by the full lever; by itself
    a reduced one is used through this function only.

    Parameters
    ----------
    lever : Lever
        The full one, with its material and circuit.
    reduced : ReducedLever
        Of its geometry, medium and base temperature.
    bias_V : float
        How far the branch must go.
    within_K : float
        Largest error of the tip temperature (K) at a fixed bias.

    Raises
    ------
    ComputationError
        If the reduced lever may be further off, or has no such states.
    """
    branch = reduced.linearised(lever.probe, Reach(lever.circuit, bias_V)).branch
    end = branch.read(lever.circuit, np.array([bias_V])).u[0]
    last = branch.end_u if np.isnan(end) else end
    u = last * np.arange(1, _PLACES + 1) / _PLACES
    error = float(np.max(estimated_error(lever, branch, u)[2]))
    if not error <= within_K:
        raise ComputationError(
            f"the reduced lever may be off by {error:.2g} K with this material, expected at most "
            f"{within_K:g} K; the full lever has to be solved"
        )
    return branch


@one_blas_thread
def estimated_error(lever: Lever, branch: Branch, u: Array) -> Array:
    """Estimate how far a reduced lever's branch is from the full lever's, at fixed biases.

    Parameters
    ----------
    lever : Lever
        The full one, whose circuit counts.
    branch : Branch
        Of a reduced lever of the same geometry.
    u : ndarray, shape (n,)
        √(T_tip − T_base), where to look; above zero.

    Returns
    -------
    ndarray, shape (3, n)
        Bounds on the errors of I_h (mA), V_r (V) and T_tip (K).
    """
    space = branch.equations.space
    assert isinstance(space, ReducedSpace)
    equations = LeverEquations(lever.space, branch.equations.materials, lever.circuit)
    reduced = branch.states(u)
    x, every = space.expanded(reduced), np.arange(u.size)
    problem = Pinned(equations, u**2)
    factors = problem.factorised(x, every)
    first = x - factors.solve(problem.residual(x, every), every)
    second = -factors.solve(problem.residual(first, every), every)
    # third index: what the steps say, and the second step alone
    away = np.stack(
        [
            equations.observed(first + second) - branch.curve(u)[:, :3].T,
            equations.observed_change(first, second),
        ],
        axis=-1,
    )
    found, remaining = np.moveaxis(
        np.abs(at_fixed_bias(branch.curve(u, 1), lever.circuit, np.swapaxes(away, 0, 1))), 2, 0
    )
    return np.maximum(_SAFETY * found + remaining, _FLOOR[:, None])
