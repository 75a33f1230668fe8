"""What instruments and a thermometer show of a lever in its circuit: the observables.

And their derivatives by material parameters and dimensions, exact, at any bias.

A lever by itself shows V_l, I_h, V_r and the rise of its tip. Each observable follows from these
and from the circuit; all that compares a lever with a measurement has them from here.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hotlever.lever.branch import TIP_RISE, Branch, Reach
from hotlever.lever.continuation import continued
from hotlever.lever.equations import LeverEquations
from hotlever.lever.space import TIP, Constraint, Factors
from hotlever.materials.laws import Evaluated
from hotlever.piecewise import spline_through
from hotlever.probe import Probe
from hotlever.probe.circuit import Circuit
from hotlever.quantities import OBSERVABLES
from hotlever.types import Array


def _bridge_voltage(
    circuit: Circuit, shown: Mapping[str, Array], names: Sequence[str] = ()
) -> Evaluated:
    """Return V_bridge (V), NaN without a bridge; see `FOLLOWING`.

    Parameters
    ----------
    circuit : Circuit
    shown : mapping of str to ndarray, shape (n,)
        What a lever shows by itself, by the names of `hotlever.quantities`: V_b, V_l, I_h, V_r
        and T_tip; or how that changes with parameters, (n, p).
    names : sequence of str, optional
        Of the parameters that it is derived by, the bridge's count.
    """
    bias_V = shown["bias_V"]
    own = (name for name in names if name.startswith("bridge_"))
    by = {name: circuit.bridge_by(name, bias_V) for name in own}
    return circuit.bridge_voltage(shown["lever_V"], bias_V), {
        "lever_V": circuit.bridge_change(1.0, 0.0),
        **by,
    }


#: Of observables that a lever does not show by itself, how they follow from what it shows and its
#: circuit; with derivatives by what it shows and by some parameters, the bias being the same.
FOLLOWING = {"bridge": _bridge_voltage}


def _shown(circuit: Circuit, outputs: Array) -> dict[str, Array]:
    lever_V, current_mA, reader_V, rise_K = outputs
    return {
        "bias_V": circuit.bias(lever_V, current_mA),
        "lever_V": lever_V,
        "current_mA": current_mA,
        "reader_V": reader_V,
        "tip_K": circuit.base_temperature_K + rise_K,
    }


def observed(circuit: Circuit, outputs: Array) -> Array:
    """Return `hotlever.quantities.OBSERVABLES` in the order of that table, (observables, n).

    Parameters
    ----------
    circuit : Circuit
    outputs : ndarray, shape (4, n)
        V_l (V), I_h (mA), V_r (V) and the rise of the tip (K).

    Returns
    -------
    ndarray
        NaN of what probe or circuit do not have.
    """
    shown = _shown(circuit, outputs)
    return np.stack(
        [
            FOLLOWING[name](circuit, shown)[0] if name in FOLLOWING else shown[row.name]
            for name, row in OBSERVABLES.items()
        ]
    )


def with_following(probe: Probe, columns: Mapping[str, Array]) -> dict[str, Array]:
    """Return columns of a sweep or a history with the observables of a probe that follow."""
    following = {
        OBSERVABLES[name].name: follow(probe.circuit, columns)[0]
        for name, follow in FOLLOWING.items()
        if name in probe.observables
    }
    return {**columns, **following}


def observed_by(circuit: Circuit, outputs: Array, slopes: Array, names: Sequence[str]) -> Array:
    """Return how observables change with parameters at a fixed bias, (observables, n, p).

    Parameters
    ----------
    circuit : Circuit
    outputs : ndarray, shape (4, n)
        See `observed`.
    slopes : ndarray, shape (4, n, p)
        How they change at this bias, per unit of each parameter; see `at_fixed_bias`.
    names : sequence of str
        The parameters, those of the circuit among them.
    """
    lever_V, current_mA, reader_V, rise_K = slopes
    shown = _shown(circuit, outputs)
    of_base = [float(name == "base_temperature_K") for name in names]
    changes = {
        "lever_V": lever_V,
        "current_mA": current_mA,
        "reader_V": reader_V,
        "tip_K": rise_K + of_base,
    }

    def change(follow: Callable[..., Evaluated]) -> Array:
        nothing = np.zeros(outputs.shape[1:])
        _, by = follow(circuit, shown, names)
        of_circuit = np.stack([by.get(name, nothing) for name in names], axis=-1)
        moved = (np.reshape(by[own], (-1, 1)) * changes[own] for own in changes if own in by)
        return sum(moved, start=of_circuit)

    return np.stack(
        [
            change(FOLLOWING[name]) if name in FOLLOWING else changes[row.name]
            for name, row in OBSERVABLES.items()
        ]
    )


def at_fixed_bias(
    along: Array, circuit: Circuit, output_slopes: Array, of_circuit: Array | float = 0.0
) -> Array:
    """Return how what a lever shows changes with parameters at a fixed bias.

    A parameter moves the curves at fixed rises of the tip, or another constraint; the circuit then
    moves the state along its branch until the bias is what it was.

    Parameters
    ----------
    along : ndarray, shape (n, 4)
        Derivatives by u of what `Branch.curve` has.
    circuit : Circuit
    output_slopes : ndarray, shape (n, 4, p)
        Derivatives of V_l, I_h, V_r and the rise of the tip, see
        `by_parameter`.
    of_circuit : ndarray, shape (n, p)
        Derivatives of the bias for a given state, see `hotlever.probe.circuit.Circuit.bias_by`.

    Returns
    -------
    ndarray, shape (4, n, p)
        V, mA, V and K per unit of the parameter.
    """
    missing = circuit.bias(output_slopes[:, 0], output_slopes[:, 1]) + of_circuit
    u_by_parameter = -missing / circuit.bias(along[:, 0], along[:, 1])[:, None]
    return np.moveaxis(output_slopes + along[:, :, None] * u_by_parameter[:, None], 1, 0)


def shown_at_knee_by_parameter(branch: Branch, u: Array, output_slopes: Array) -> Array:
    """Return how V_l, I_h, V_r and the rise of the tip where V_l is highest change, (4, p).

    A parameter bends V_l at fixed rises of the tip; its maximum moves until it is level again.

    Parameters
    ----------
    branch : Branch
        One that has a knee.
    u : ndarray, shape (k,)
        Rising; of some of its states about the knee, or of all.
    output_slopes : ndarray, shape (k, 4, p)
        Derivatives of what these show by parameters, see `by_parameter`.
    """
    at = branch.knee_u
    assert at is not None
    slopes = spline_through(u, output_slopes, 5)
    u_by_parameter = -slopes(at, 1)[0] / branch.curve(at, 2)[0]
    return np.asarray(slopes(at) + branch.curve(at, 1)[:, None] * u_by_parameter)


def knee_by_parameter(branch: Branch, output_slopes: Array, names: Sequence[str]) -> Array:
    """Return how the tip temperature where V_l is highest changes with parameters, (p,).

    Parameters
    ----------
    branch : Branch
        One that has a knee.
    output_slopes : ndarray, shape (k, 4, p)
        Derivatives of what its states show, see `by_parameter`.
    names : sequence of str
        The parameters.
    """
    shown = shown_at_knee_by_parameter(branch, branch.u, output_slopes)
    return shown[TIP_RISE] + [float(name == "base_temperature_K") for name in names]


# --- derivatives by parameters --------------------------------------------------------------------


def by_parameter(
    equations: LeverEquations,
    x: Array,
    names: Sequence[str],
    factors: Factors | None = None,
    constraint: Constraint = TIP,
) -> Array:
    """Return how V_l, I_h, V_r and the rise of the tip change with parameters, (n, 4, k).

    The constraint is fixed; if it is the rise of the tip, that does not change. Beside those of the
    material the parameters may be dimensions whose motions the equations know. The states have
    power; factors are those of these very states. Without, each state is factorised and solved for
    before the next, whose pivots it has then, and memory. Adjoint: one solve for each quantity that
    changes and each state, however many parameters there are.
    """
    of_tip = equations.tip_by_parameter(x, names)
    gradient, moves = equations.observed_gradient(x), constraint is not TIP
    if moves:
        unknowns, weights = equations.space.tip
        tip = np.zeros((*x.shape, 1))
        tip[unknowns, :, 0] = weights[:, None]
        gradient = np.concatenate([gradient, tip], axis=-1)
    adjoint, every = np.empty_like(gradient), np.arange(x.shape[1])
    for some in every[:, None] if factors is None else [every]:
        own = factors or equations.factorised(x[:, some], constraint.among(some))
        adjoint[:, some] = own.solve(gradient[:, some], some - some[0], transposed=True)
    # the constraint is the last of the equations; the current itself depends on parameters too
    of_constraint, adjoint[-1] = adjoint[-1].copy(), 0.0
    adjoint[-1, :, 1] = -1.0
    output_slopes = np.zeros((x.shape[1], TIP_RISE + 1, len(names)))
    output_slopes[:, : gradient.shape[-1]] = -equations.tested_by_parameter(x, names, adjoint)
    moved = np.reshape(constraint.tip, (-1, 1)) * of_tip
    output_slopes[:, : gradient.shape[-1]] -= of_constraint[..., None] * moved[:, None]
    output_slopes[:, TIP_RISE] += moves * of_tip
    if equations.space.reader is None:
        output_slopes[:, 2] = np.nan
    return output_slopes


def with_changes(
    equations: LeverEquations, x: Array, names: Sequence[str], factors: Factors
) -> tuple[Array, Array]:
    """Return how the states themselves change, (size + 1, n, k), and what `by_parameter` does.

    The factors may be those of states nearby.
    """
    direct = equations.by_parameter(x, names)
    right_hand_side = -direct
    right_hand_side[-1] = -equations.tip_by_parameter(x, names)
    changes = equations.solve_linear(x, factors, right_hand_side)
    output_slopes = np.zeros((TIP_RISE + 1, *changes.shape[1:]))
    output_slopes[:TIP_RISE] = equations.observed_change(x, changes)
    output_slopes[1] += direct[-1]
    return changes, output_slopes.swapaxes(0, 1)


def sensitivities_of(branch: Branch, u: Array, circuit: Circuit, names: Sequence[str]) -> Array:
    """Return derivatives of the observables by parameters of the lever, at fixed bias.

    They are at any u of a branch, (observables, n, p); see `observed`.
    """
    output_slopes = np.zeros((u.size, TIP_RISE + 1, len(names)))
    # without power nothing depends on the material
    powered = np.flatnonzero(branch.has_power(u))
    # few Jacobians at once: each has a factorised matrix
    together = 20
    for start in range(0, powered.size, together):
        some = powered[start : start + together]
        constraint = branch.parametrisation.constraint(u[some])
        x = branch.states(u[some])
        output_slopes[some] = by_parameter(branch.equations, x, names, constraint=constraint)
    slopes = at_fixed_bias(branch.curve(u, 1), circuit, output_slopes)
    return observed_by(circuit, branch.curve(u).T, slopes, names)


@dataclass(frozen=True)
class Linearised:
    """A branch, and how it changes with some parameters at fixed places of it.

    Places are rises of the tip, or other constraints; see
    `hotlever.lever.solved_states`.

    Attributes
    ----------
    probe : Probe
        Whose branch it is.
    names : tuple of str
        The parameters, by their names in a probe file.
    branch : Branch
    factors : Factors or None
        Of all its states that were solved; None if they were not kept.
    changes : ndarray, shape (size + 1, k, p)
        Derivatives of the states by the parameters; empty if they were not asked for.
    output_slopes : ndarray, shape (k, 4, p)
        Derivatives of V_l, I_h, V_r and the rise of the tip.
    """

    probe: Probe
    names: tuple[str, ...]
    branch: Branch
    factors: Factors | None
    changes: Array
    output_slopes: Array

    @classmethod
    def of(
        cls,
        probe: Probe,
        names: tuple[str, ...],
        branch: Branch,
        enough: Callable[[Branch], bool | np.bool_],
        derivatives: LeverEquations | None = None,
        factors: Factors | None = None,
    ) -> Linearised:
        """Follow a branch until it goes far enough (see `continued`), and differentiate it.

        Factors of its states may be at hand. With equations for the derivatives, which may differ a
        little and cost less, the states are differentiated as well; the factors may then be those
        of states nearby.
        """
        longer = continued(branch.equations, enough, branch)
        x, changes = longer.x[:, longer.solved], np.empty(0)
        constraint = longer.parametrisation.constraint(longer.u[longer.solved])
        equations = derivatives or longer.equations
        if factors is None:
            factors = equations.factorised(x, constraint)
        else:
            before, after = branch.u[branch.solved], longer.u[longer.solved]
            is_added = ~np.isin(after, before)
            added, factors = np.flatnonzero(is_added), factors.among(np.isin(before, after))
            if added.size:
                of_added = equations.factorised(x[:, added], constraint.among(added))
                order = np.argsort(np.append(np.flatnonzero(~is_added), added))
                factors = factors.followed_by(of_added).among(order)
        if derivatives is None:
            output_slopes = by_parameter(longer.equations, x, names, factors, constraint)
        else:
            changes, output_slopes = with_changes(derivatives, x, names, factors)
        if longer.starts_cold:
            # without power nothing depends on the parameters
            cold = int(np.searchsorted(longer.u, 0.0))
            output_slopes = np.insert(output_slopes, cold, 0.0, axis=0)
            changes = np.insert(changes, cold, 0.0, axis=1) if changes.size else changes
        return cls(probe, names, longer, factors, changes, output_slopes)

    def up_to(self, reach: Reach) -> Linearised:
        """Return the same of no more states than a reach asks for."""
        count, branch, factors = reach.count(self.branch.values), self.branch, self.factors
        if count is None:
            return self
        solved = int(np.sum(branch.solved < count))
        return replace(
            self,
            branch=branch.among(np.arange(count)),
            factors=None if factors is None else factors.among(np.arange(solved)),
            changes=self.changes[:, :count] if self.changes.size else self.changes,
            output_slopes=self.output_slopes[:count],
        )

    def states(self, probe: Probe) -> Array:
        """Return the states of a similar probe, (size + 1, k), to first order or roughly.

        Roughly: with the same temperatures, and potentials in proportion to the lever voltage; the
        same states if there are other supplies.
        """
        steps, x = probe.values(self.names) - self.probe.values(self.names), self.branch.x
        if self.changes.size:
            return np.asarray(x + self.changes @ steps)
        if not self.branch.starts_cold:
            return x
        factor, solved = np.ones(x.shape[1]), self.branch.solved
        factor[solved] += self.output_slopes[solved, 0] @ steps / x[-1, solved]
        return np.where(self.branch.equations.space.is_temperature[:, None], x, factor * x)

    def output_slopes_at(self, u: Array) -> Array:
        """Return the ``output_slopes`` at any u, (n, 4, p).

        Between the states they are within some 1e-3 of the largest.
        """
        return np.asarray(spline_through(self.branch.u, self.output_slopes, 5)(u))
