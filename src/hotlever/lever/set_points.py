"""States at rest of a lever that is held at a resistance or at a power, as controllers hold one.

The branch is one curve by tip temperature, so that the states at a set point are the roots of a
smooth function along it: V_l − R I_h, or V_l I_h − P. A resistance that turns has a state on either
side of its maximum. Roots are then moved to where the equations have them, at tip temperatures that
stay what they are while a state is solved: so it is as well posed at the maximum as elsewhere.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from hotlever.datasets import labelled
from hotlever.errors import InputError, as_far_as_possible, unknown_name
from hotlever.lever.branch import TIP_RISE, Branch
from hotlever.lever.dataset import dataset_of_branch, dataset_of_states
from hotlever.lever.lever import Lever, State
from hotlever.lever.newton import NewtonOptions
from hotlever.lever.solved_states import solve_at
from hotlever.piecewise import Piecewise
from hotlever.types import Array, Progress
from hotlever.work import one_blas_thread

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class HeldQuantity:
    """What a controller measures of a lever, by its voltage V and its current I.

    Attributes
    ----------
    unit, column, slope_column : str
        Its unit, and what datasets call a set point and the slope by the tip temperature.
    of : callable
        Its value by V (V) and I (mA).
    missed : callable
        A polynomial of V, I and a value that is zero where it has the value; of numbers, arrays or
        curves along a branch.
    level : callable
        The curve, of V and I, that is zero where it has a maximum or a minimum.
    slope : callable
        Its slope along the branch by that curve and I.
    """

    unit: str
    column: str
    slope_column: str
    of: Callable[[Any, Any], Any]
    missed: Callable[[Any, Any, Any], Any]
    level: Callable[[Piecewise, Piecewise], Piecewise]
    slope: Callable[[Array, Array], Array]


#: What a lever may be held at: V_l/I_h, without the series resistor, and V_l I_h.
HELD = {
    "resistance": HeldQuantity(
        *("ohm", "set_ohm", "slope_ohm_per_K"),
        of=lambda V, mA: 1000.0 * V / mA,
        missed=lambda V, mA, ohm: V - mA * (ohm / 1000.0),
        level=lambda V, mA: V.derivative() * mA - V * mA.derivative(),
        slope=lambda level, mA: 1000.0 * level / mA**2,
    ),
    "power": HeldQuantity(
        *("mW", "set_mW", "slope_mW_per_K"),
        of=lambda V, mA: V * mA,
        missed=lambda V, mA, mW: V * mA - mW,
        level=lambda V, mA: (V * mA).derivative(),
        slope=lambda level, mA: level,
    ),
}


@dataclass(frozen=True)
class HeldStates:
    """States at set points, in the order of these, and those of one by tip temperature.

    Attributes
    ----------
    data : xarray.Dataset
        As of a sweep, one row for each state.
    states : list of State
    curve : xarray.Dataset
        What a sweep has, all along the branch.
    """

    data: xr.Dataset
    states: list[State]
    curve: xr.Dataset


@one_blas_thread
def hold(
    lever: Lever, held: str, set_points: ArrayLike, *, progress: Progress | None = None
) -> HeldStates:
    """Find the states of a lever that is held at some resistances or powers.

    Parameters
    ----------
    lever : Lever
    held : {"resistance", "power"}
        V_l/I_h (Ω) or V_l I_h (mW) of the swept supply, without its series resistor.
    set_points : array_like, shape (n,)
        Above zero.
    progress : callable, optional
        Called with the states of the branch and how many there usually are.

    Returns
    -------
    HeldStates
        Its data have the columns of a sweep, and ``set_ohm`` or ``set_mW``, ``state``, from 1 on
        for each set point, and ``slope_ohm_per_K`` or ``slope_mW_per_K``: how the held quantity
        changes with the tip temperature along the branch.

    Raises
    ------
    InputError
        If the lever has no state at a set point; the text names what it has.
    ComputationError
        If a state is not found.

    Examples
    --------
    >>> from hotlever import Lever, Probe
    >>> held = hold(Lever(Probe.reference()), "resistance", [3000.0])
    >>> held.data.tip_K.values.round().tolist(), held.data.state.values.tolist()
    ([752.0, 959.0], [1, 2])
    """
    if held not in HELD:
        raise unknown_name("quantity to hold", held, HELD)
    targets = np.atleast_1d(np.asarray(set_points, dtype=float))
    if not targets.size or not (np.isfinite(targets) & (targets > 0.0)).all():
        raise InputError(f"held {held}: expected finite set points above 0 {HELD[held].unit}")
    branch, failure = as_far_as_possible(lambda: lever.branch(np.inf, progress))
    held_states = _HeldAlong(lever, branch, HELD[held]).held_at(targets)
    if failure is not None:
        held_states.data.attrs["notes"] += f"\nno hotter state was looked for: {failure}"
    return held_states


class _HeldAlong:
    """A quantity along a branch, as far as the swept supply heats the lever."""

    def __init__(self, lever: Lever, branch: Branch, quantity: HeldQuantity) -> None:
        self._lever, self._branch, self._quantity = lever, branch, quantity
        curve = branch.curve
        lever_V, current = (Piecewise(curve.c[..., k], curve.x) for k in (0, 1))
        self._curves, self._level = (lever_V, current), quantity.level(lever_V, current)
        reversals = np.concatenate([[0.0], lever_V.roots(), current.roots()])
        self._start = float(reversals[reversals < branch.end_u].max())
        # nearer to the state without power (K^½) there is none
        self._lowest = self._start + 1e-3
        self._turns = self._within(self._level)

    def held_at(self, targets: Array) -> HeldStates:
        """Return the states at set points."""
        roots = [
            self._within(self._quantity.missed(*self._curves, value)) for value in targets.tolist()
        ]
        for value, u in zip(targets.tolist(), roots, strict=True):
            if not u.size:
                raise self._never(value)
        values = np.repeat(targets, [u.size for u in roots])
        number = np.concatenate([np.arange(1, u.size + 1) for u in roots])
        u = np.concatenate(roots)
        # few at once: each has a factorised matrix
        together = 16
        some = [slice(k, k + together) for k in range(0, u.size, together)]
        solved = [self._solved(u[part], values[part]) for part in some]
        u, x = (np.concatenate(parts, axis=-1) for parts in zip(*solved, strict=True))
        branch, quantity = self._branch, self._quantity
        slope = quantity.slope(self._level(u), self._curves[1](u)) / branch.curve(u, 1)[:, TIP_RISE]
        notes = self._notes(values, number, slope, branch.tip_K(u))
        data = dataset_of_states(self._lever.probe, branch.equations, x, notes)
        own = {quantity.column: values, "state": number, quantity.slope_column: slope}
        states = [State(self._lever, x[:, [k]]) for k in range(u.size)]
        return HeldStates(data.assign(labelled(own).variables), states, self._whole())

    def _within(self, curve: Piecewise) -> Array:
        """Return where a curve is zero while the supply heats the lever."""
        u = curve.roots()
        return np.asarray(u[(u > self._lowest) & (u <= self._branch.end_u)])

    def _solved(self, u: Array, values: Array) -> tuple[Array, Array]:
        """Return where the equations have the values near some places, and the states there."""
        branch = self._branch
        x, factors = branch.states(u), None
        for _ in range(6):
            root = solve_at(
                branch.equations, u, x, NewtonOptions(), factors, branch.parametrisation
            )
            x, factors = root.x, root.factors
            lever_V, current, _ = branch.equations.observed(x)
            missed, whole = (
                self._quantity.missed(lever_V, current, value) for value in (values, 0.0)
            )
            off = np.abs(missed / whole)
            if off.max() < 1e-10:
                return u, x
            corrected_u = self._corrected_u(u, missed, values)
            x, u = x + (branch.states(corrected_u) - branch.states(u)), corrected_u
        # the curve is a little higher at its top than the states are
        raise self._never(float(values[off.argmax()]))

    def _corrected_u(self, u: Array, missed: Array, values: Array) -> Array:
        """Return the roots of the parabolas with the slope and the bend of the curve, from some u.

        Each is on its side of where the quantity turns, or there if there is none.
        """
        bounds = np.concatenate([[self._start], self._turns, [self._branch.end_u]])
        part = np.clip(np.searchsorted(bounds, u), 1, bounds.size - 1)
        low, high = bounds[part - 1], bounds[part]
        rising = np.sign(self._level(0.5 * (low + high)))
        curves = [self._quantity.missed(*self._curves, value) for value in values.tolist()]
        slope, bend = (
            np.array([curve(at, order) for curve, at in zip(curves, u.tolist(), strict=True)])
            for order in (1, 2)
        )
        square = slope**2 - 2.0 * bend * missed
        root = slope + rising * np.sqrt(np.maximum(square, 0.0))
        with np.errstate(divide="ignore", invalid="ignore"):
            step = np.where(square > 0.0, -2.0 * missed / root, -slope / bend)
        return np.asarray(np.clip(u + step, low, high))

    # --- what is said -----------------------------------------------------------------------------

    def _extremes(self) -> tuple[Array, Array]:
        """Return the quantity and the tip temperature at both ends, and where it turns."""
        branch = self._branch
        u = np.concatenate([[self._lowest], self._turns, [branch.end_u]])
        return self._quantity.of(*(curve(u) for curve in self._curves)), branch.tip_K(u)

    def _never(self, value: float) -> InputError:
        """Return the error for a value that the quantity never has."""
        at, tip = self._extremes()
        unit, (low, high) = self._quantity.unit, (int(at.argmin()), int(at.argmax()))
        return InputError(
            f"found a set point of {value:g} {unit}, expected one that the lever has: from "
            f"{at[low]:.5g} {unit} (tip at {tip[low]:.0f} K) to {at[high]:.5g} {unit} (tip at "
            f"{tip[high]:.0f} K)"
        )

    def _whole(self) -> xr.Dataset:
        """Return the branch as a sweep, from its start to its end."""
        # as many points as a figure has
        u = np.linspace(self._lowest, self._branch.end_u, 200)
        return dataset_of_branch(self._lever.probe, self._branch, u)

    def _notes(self, values: Array, number: Array, slope: Array, tip_K: Array) -> list[str]:
        """Say where a set point tells little of the tip, and why."""
        at, tips = self._extremes()
        error = 1e-3  # of a set point
        tip_errors = error * values / np.maximum(np.abs(slope), 1e-300)
        rise = tip_K - self._branch.base_temperature_K
        unit, notes = self._quantity.unit, []
        # a note is due where it moves the tip by more than this share of its rise
        for k in np.flatnonzero(tip_errors > 0.02 * rise).tolist():
            near = int(np.abs(tips - tip_K[k]).argmin())
            why = (
                "the swept supply hardly heats it"
                if near == 0
                else f"it turns at {at[near]:.5g} {unit}, where the tip is at {tips[near]:.0f} K"
            )
            notes.append(
                f"{values[k]:.5g} {unit} tells little of the tip in state {number[k]} "
                f"({tip_K[k]:.0f} K): {why}; {error:.1%} of it is {tip_errors[k]:.2g} K"
            )
        return notes
