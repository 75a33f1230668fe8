"""The a-posteriori error of a reduced lever: its states put into the equations of the full one.

Two steps with the full residual and the Jacobian at the reduced state show where the full state
of the same tip temperature lies, up to an error of third order in the distance. No full state has
to be found.
"""

from __future__ import annotations

import numpy as np

from hotlever.lever.branch import TIP_RISE, Branch
from hotlever.lever.equations import LeverEquations
from hotlever.lever.lever import Lever
from hotlever.lever.observables import at_fixed_bias
from hotlever.lever.parametrisation import Constrained
from hotlever.lever.space import TIP
from hotlever.threads import one_blas_thread
from hotlever.types import Array

#: The estimate is this share larger than the steps say, and larger by the second of them; ...
_SAFETY = 1.1
#: ... and never below what the states are solved to (mA, V, K).
_FLOOR = np.array([2e-8, 2e-8, 5e-5])


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
    equations = LeverEquations(
        lever.space, branch.equations.materials, lever.circuit, branch.equations.laws.physics
    )
    x, every = branch.equations.space.expanded(branch.states(u)), np.arange(u.size)
    problem = Constrained(equations, TIP, u**2)
    factors = problem.factorised(x, every)
    first = x - factors.solve(problem.residual(x, every), every)
    second = -factors.solve(problem.residual(first, every), every)
    # third index: what the steps say, and the second step alone
    away = np.zeros((u.size, TIP_RISE + 1, 2))
    away[:, :TIP_RISE, 0] = equations.observed(first + second).T - branch.curve(u)[:, :TIP_RISE]
    away[:, :TIP_RISE, 1] = equations.observed_change(first, second).T
    # without that of V_l, which follows at a bias
    errors = np.abs(at_fixed_bias(branch.curve(u, 1), lever.circuit, away))[1:]
    both, second_alone = np.moveaxis(errors, 2, 0)
    return np.maximum(_SAFETY * both + second_alone, _FLOOR[:, None])
