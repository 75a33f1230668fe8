"""Derivatives of what is observed by material parameters and dimensions, exact, at any bias."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from hotlever.lever.branch import Branch
from hotlever.lever.curve import spline_through
from hotlever.lever.equations import EXACT, SHOWN, LeverEquations
from hotlever.lever.following import Follower
from hotlever.lever.space import Factors
from hotlever.materials import PARAMETERS
from hotlever.probe import Probe
from hotlever.probe.circuit import Circuit
from hotlever.types import Array

#: States whose Jacobians are factorised at once.
_AT_ONCE = 20


def by_parameter(
    equations: LeverEquations,
    x: Array,
    factors: Factors | None = None,
    names: Sequence[str] = tuple(PARAMETERS),
    accuracy: float = EXACT,
) -> tuple[Array, Array]:
    """Return how states with power change with parameters, at fixed tip temperatures.

    Beside those of the material these may be dimensions whose motions the equations know. The
    factors may be those of states nearby. The first result, (size + 1, n, k), is of the states, the
    second, (n, 3, k), of V_l, I_h and V_r.
    """
    factors = factors or equations.factorised(x)
    direct = equations.by_parameter(x, names)
    right_hand_side = -direct
    right_hand_side[-1] = -equations.tip_by_parameter(x, names)
    changes = equations.solve_linear(x, factors, right_hand_side, accuracy=accuracy)
    shown = equations.observed_change(x, changes)
    shown[1] += direct[-1]
    return changes, shown.swapaxes(0, 1)


def at_fixed_bias(
    along: Array, u: Array, circuit: Circuit, shown: Array, of_circuit: Array | float = 0.0
) -> Array:
    """Return derivatives of I_h, V_r and T_tip by parameters at a fixed bias.

    A parameter moves the curves at fixed tip temperatures; the circuit then moves the state along
    its branch until the bias is what it was.

    Parameters
    ----------
    along : ndarray, shape (n, 3 or more)
        Derivatives of V_l, I_h and V_r by u = √(T_tip − T_base).
    u : ndarray, shape (n,)
    circuit : Circuit
    shown : ndarray, shape (n, 3, p)
        Derivatives of V_l, I_h and V_r at fixed tip temperatures, see `by_parameter`.
    of_circuit : ndarray, shape (n, p)
        Derivatives of the bias for a given state, see `Circuit.bias_by`.

    Returns
    -------
    ndarray, shape (3, n, p)
        In the order of `hotlever.lever.dataset.OBSERVABLES`; mA, V and K per unit of the
        parameter.
    """
    lever_V, current_mA, reader_V = np.moveaxis(shown, 1, 0)
    by_u = along[:, :3, None]
    missing = circuit.bias(lever_V, current_mA) + of_circuit
    moved = -missing / circuit.bias(by_u[:, 0], by_u[:, 1])
    return np.stack(
        [
            current_mA + by_u[:, 1] * moved,
            reader_V + by_u[:, 2] * moved,
            2.0 * u[:, None] * moved,
        ]
    )


def sensitivities_of(branch: Branch, u: Array, circuit: Circuit) -> Array:
    """Return the derivatives of `at_fixed_bias` at any u of a branch, exact."""
    shown = np.zeros((u.size, len(SHOWN), len(PARAMETERS)))
    hot = np.flatnonzero(u > 0)  # without power nothing depends on the material
    for start in range(0, hot.size, _AT_ONCE):
        some = hot[start : start + _AT_ONCE]
        _, shown[some] = by_parameter(branch.equations, branch.states(u[some]))
    return at_fixed_bias(branch.curve(u, 1), u, circuit, shown)


@dataclass(frozen=True)
class Linearised:
    """A branch, and how it changes with some parameters at fixed tip temperatures.

    Attributes
    ----------
    probe : Probe
        Whose branch it is.
    names : tuple of str
        The parameters, by their names in a probe file.
    branch : Branch
    factors : Factors or None
        Of all its states but the first; None if they were not kept.
    changes : ndarray, shape (size + 1, k, p)
        Derivatives of the states by the parameters.
    shown : ndarray, shape (k, 3, p)
        Derivatives of V_l, I_h and V_r.
    """

    probe: Probe
    names: tuple[str, ...]
    branch: Branch
    factors: Factors | None
    changes: Array
    shown: Array

    @classmethod
    def of(
        cls,
        probe: Probe,
        names: tuple[str, ...],
        branch: Branch,
        enough: Callable[[Branch], bool],
        derivatives: LeverEquations,
        factors: Factors | None = None,
        accuracy: float = EXACT,
    ) -> Linearised:
        """Follow a branch until it goes far enough (see `Follower.until`), and differentiate it.

        The derivatives may be taken with equations that differ little and cost less, the factors be
        those of states nearby.
        """
        longer = Follower(branch.equations, branch).until(enough)
        if factors is None or longer is not branch:
            factors = derivatives.factorised(longer.x[:, 1:])
        changes, shown = by_parameter(derivatives, longer.x[:, 1:], factors, names, accuracy)
        # without power nothing depends on the parameters
        changes, shown = np.insert(changes, 0, 0.0, axis=1), np.insert(shown, 0, 0.0, axis=0)
        return cls(probe, names, longer, factors, changes, shown)

    def states(self, probe: Probe) -> Array:
        """Return the states of a similar probe to first order, (size + 1, k)."""
        moved = probe.at(self.names) - self.probe.at(self.names)
        return np.asarray(self.branch.x + self.changes @ moved)

    def shown_at(self, u: Array) -> Array:
        """Return the derivatives of V_l, I_h and V_r at any u, (n, 3, p).

        Between the states they are within some 1e-3 of the largest.
        """
        return np.asarray(spline_through(self.branch.u, self.shown, 5)(u))
