"""A reduced lever solved at all biases at once.

Two sets of quadrature points share the work. Newton's method runs on the few points of the
empirical rule; then residuals at all points, with the same Jacobians, remove what the rule
lacks. So the rule decides how fast a state is found, and the modes alone how accurate it is.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hotlever.errors import NewtonError
from hotlever.lever.continuation import MELTING_POINT, BranchFollower
from hotlever.lever.equations import LeverEquations
from hotlever.lever.lever import checked_bias
from hotlever.lever.reduced import ReducedSpace, Samples, StackedJacobian, StackedSpace
from hotlever.lever.reduction import place_in_box
from hotlever.materials import PARAMETERS, Material
from hotlever.probe.probe import Circuit
from hotlever.threads import one_blas_thread

Array = NDArray[np.float64]
# states and inverse Jacobians
Found = tuple[Array, Array]

#: Error left (1 K or 10 mV) on the few points, and at the end.
_NEARLY, _DONE = 1e-2, 1e-3
_MOST_STEPS = 12
#: Ratio of two steps with one Jacobian from which a new one is cheaper, at few and at all points.
_SLOW, _SLOW_AT_ALL_POINTS = 0.2, 0.5
#: Ratio of the error to the first step with the Jacobians of the few points.
_FIRST_RATIO = 0.05
#: A guess further than this from its root (K) may belong to another branch.
_FAR = 150.0


@dataclass(frozen=True)
class ReducedStates:
    """Solved states of a reduced lever.

    Attributes
    ----------
    material : Material
    bias : ndarray, shape (n,)
        V, rising.
    x : ndarray, shape (size + 2, n)
        Unknowns of `ReducedSpace`, one column for each bias.
    observables : ndarray, shape (3, n)
        I_h (mA), V_r (V), T_tip (K), in the order of `OBSERVABLES`.
    """

    material: Material
    bias: Array
    x: Array
    observables: Array


@dataclass(frozen=True)
class Linearised:
    """Solved states, and how they change with the material at fixed bias.

    Attributes
    ----------
    states : ReducedStates
    inverses : ndarray, shape (n, size + 1, size + 1)
        Of the Jacobians.
    changes : ndarray, shape (size + 1, n, 6)
        Derivatives of the unknowns by the parameters.
    sensitivities : ndarray, shape (3, n, 6)
        Derivatives of the observables, in the order of `OBSERVABLES` and of `PARAMETERS`.
    """

    states: ReducedStates
    inverses: Array
    changes: Array
    sensitivities: Array


class ReducedLever:
    """A reduced space in a circuit.

    Parameters
    ----------
    space : ReducedSpace
    circuit : Circuit
    """

    def __init__(self, space: ReducedSpace, circuit: Circuit) -> None:
        self.space, self.circuit = space, circuit

    def equations(self, material: Material) -> LeverEquations:
        """Return the equations of one state on the few points."""
        return LeverEquations(self.space, self.circuit, material)

    def stacked(self, material: Material, samples: Samples) -> LeverEquations:
        """Return the equations of states side by side."""
        space = StackedSpace(self.space, samples)
        return LeverEquations(cast(Any, space), self.circuit, material)

    @one_blas_thread
    def solve(
        self,
        material: Material,
        bias: ArrayLike,
        near: Linearised | None = None,
        *,
        rough: bool = False,
    ) -> ReducedStates:
        """Find the states that a slow ramp of the bias from zero passes.

        Parameters
        ----------
        material : Material
        bias : array_like, shape (n,)
            Biases (V) in any order; repeated ones are solved once.
        near : Linearised, optional
            States at the same biases to start from; without them, or where they lead nowhere, the
            atlas of the space gives a guess, and if that fails the ramp is followed.
        rough : bool
            Stay on the few points.

        Raises
        ------
        ComputationError
            If the lever has no state below the melting point at one of them.
        """
        values = np.unique(checked_bias(bias))
        few = self.stacked(material, self.space.few_points)
        found = self._from_near(few, near) if near is not None else None
        found = found or self._from_atlas(few, values) or self._from_ramp(few, values)
        x, inverses = found
        final = few
        if not rough:
            final = self.stacked(material, self.space.all_points)
            x, _ = self._newton(final, x, inverses, _DONE, slow=_SLOW_AT_ALL_POINTS)
        return ReducedStates(material, values, x, self._observables(final, x))

    @one_blas_thread
    def linearise(self, states: ReducedStates) -> Linearised:
        """Find how solved states change with the material."""
        equations = self.stacked(states.material, self.space.few_points)
        x = states.x
        matrices = cast(StackedJacobian, equations.jacobian(x))
        inverses = matrices.inverses(equations.series_kohm)
        by_parameter = equations.by_parameter(x)
        current = by_parameter[-1].copy()
        by_parameter[-1] *= equations.series_kohm
        changes = -np.einsum("bij,jbp->ibp", inverses, by_parameter, optimize=True)
        current += np.einsum("bj,jbp->bp", matrices.matrices[:, -1], changes)
        tip = np.tensordot(self.space.tip[1], changes[self.space.tip[0]], axes=1)
        reader = self.space.reader_weights()
        voltage = (
            np.full_like(current, np.nan)
            if reader is None
            else np.tensordot(reader[1], changes[reader[0]], axes=1)
        )
        return Linearised(states, inverses, changes, np.stack([current, voltage, tip]))

    # --- where to start: each returns states on the few points and inverse Jacobians -------------

    def _from_near(self, few: LeverEquations, near: Linearised) -> Found | None:
        """Start from solved states of another material."""
        origin, material = near.states, few.material
        moved = [getattr(material, name) - getattr(origin.material, name) for name in PARAMETERS]
        guess = origin.x.copy()
        guess[:-1] += near.changes @ np.array(moved)
        return self._from_guess(few, guess, near.inverses)

    def _from_atlas(self, few: LeverEquations, bias: Array) -> Found | None:
        """Start from the branches that the modes were made of."""
        material, atlas = few.material, self.space.atlas
        if atlas is None:
            return None
        stretched = ~self.space.is_temperature()
        place = place_in_box(material)
        guess = atlas.guess(place, stretched, material.c_kappa, few.series_kohm, bias)
        if guess is None:
            return None
        return self._from_guess(few, guess, self._inverses(few, guess))

    def _from_guess(self, few: LeverEquations, guess: Array, inverses: Array) -> Found | None:
        try:
            x, inverses = self._newton(few, guess, inverses, _NEARLY, slow=_SLOW)
        except NewtonError:
            return None
        space = self.space
        tip = space.tip_temperature(x)
        far = np.abs(tip - space.tip_temperature(guess)) > _FAR
        molten = space.highest_temperature(x) > MELTING_POINT
        # along one branch the tip gets hotter with the bias
        return None if np.any(far | molten) or np.any(np.diff(tip) < 0) else (x, inverses)

    def _from_ramp(self, few: LeverEquations, bias: Array) -> Found:
        """Follow the branch from zero bias."""
        ramp = BranchFollower(self.equations(few.material)).ramp(bias.tolist())
        x = np.stack([state.x for state in ramp], axis=1)
        return x, self._inverses(few, x)

    def _newton(
        self,
        equations: LeverEquations,
        x: Array,
        inverses: Array,
        tolerance: float,
        slow: float,
    ) -> Found:
        """Solve at fixed bias from guesses with the inverses at hand, renewed where they are slow.

        Returns
        -------
        x, inverses : ndarray

        Raises
        ------
        NewtonError
            If a step is not finite or the limit of steps is reached.
        """
        x, inverses = x.copy(), inverses.copy()
        scale, limit = equations.scale[:-1, None], equations.step_limit[:-1, None]
        last = np.full(x.shape[1], np.inf)
        active = np.arange(x.shape[1])
        for _ in range(_MOST_STEPS):
            here = x[:, active]
            residual = equations.residual(here)
            step = -np.einsum("bij,jb->ib", inverses[active], residual)
            length = np.abs(step / scale).max(axis=0)
            renewed = ~(length < slow * last[active])
            if renewed.any():
                inverses[active[renewed]] = self._inverses(equations, here[:, renewed])
                step[:, renewed] = -np.einsum(
                    "bij,jb->ib", inverses[active[renewed]], residual[:, renewed]
                )
                length = np.abs(step / scale).max(axis=0)
            if not np.isfinite(length).all():
                raise NewtonError("a step of the reduced lever was not finite")
            shortening = np.maximum(1.0, np.abs(step / limit).max(axis=0))
            x[:-1, active] += step / shortening
            known = ~renewed & np.isfinite(last[active])
            ratio = np.where(known, length / last[active], np.maximum(length, _FIRST_RATIO))
            left = length * ratio
            last[active] = length
            active = active[(left > tolerance) | (shortening > 1.0)]
            if not active.size:
                return x, inverses
        raise NewtonError(f"the reduced lever did not converge in {_MOST_STEPS} steps")

    def _inverses(self, equations: LeverEquations, x: Array) -> Array:
        return cast(StackedJacobian, equations.jacobian(x)).inverses(equations.series_kohm)

    def _observables(self, equations: LeverEquations, x: Array) -> Array:
        reader, space = self.space.reader_weights(), self.space
        current = (
            (x[-1] - x[-2]) / equations.series_kohm
            if equations.series_kohm
            else equations.measured(x)[0]
        )
        voltage = np.full_like(current, np.nan) if reader is None else reader[1] @ x[reader[0]]
        return np.stack([current, voltage, space.tip_temperature(x)])
