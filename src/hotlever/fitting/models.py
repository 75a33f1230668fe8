"""What a fit compares the data with: a lever that is solved fast, corrected by the full one.

The fast lever is a reduced one where the geometry has been reduced before, or else the same lever
on a coarse mesh. At a material where the full lever is solved too, the difference of the two
branches is added to the fast one's from then on.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from scipy.interpolate import BSpline

from hotlever.lever.branch import Branch, Reach
from hotlever.lever.curve import spline_through
from hotlever.lever.following import Follower
from hotlever.lever.lever import COARSE, Lever
from hotlever.lever.newton import NewtonOptions, find_roots
from hotlever.lever.pinned import AtTip
from hotlever.lever.reduced import ReducedLever, ReducedSpace
from hotlever.lever.reduction import cached_reduction, known_reduction
from hotlever.lever.sensitivities import Linearised, at_fixed_bias
from hotlever.lever.sensitivities import by_material as of_material
from hotlever.materials import PARAMETERS, Material
from hotlever.probe import Circuit, Probe
from hotlever.threads import one_blas_thread
from hotlever.types import Array

#: States at which the full lever corrects a reduced one, whose errors are small and smooth.
_CORRECTED_AT = 10


class BranchSolver(Protocol):
    """A lever that is solved for any material: full, coarse or reduced."""

    def linearised(
        self, material: Material, reach: Reach, near: Linearised | None = None
    ) -> Linearised:
        """Return the branch of a material, with its derivatives by the material."""
        ...


@dataclass(frozen=True)
class Prediction:
    """What an instrument and a thermometer would show.

    Attributes
    ----------
    values : ndarray, shape (3, n)
        I_h (mA), V_r (V) and T_tip (K) at the biases.
    slopes : ndarray, shape (3, n, 6)
        Derivatives by the parameters at fixed bias.
    linearised : Linearised
        What they were read from, but for its offset.
    nearby : Nearby
        Predictions for similar materials.
    """

    values: Array
    slopes: Array
    linearised: Linearised
    nearby: Nearby


class Nearby:
    """Predictions for materials near one whose branch is known: a branch costs nothing there.

    At a fixed tip temperature, voltages and currents are nearly powers of the parameters, much
    more so than anything is at a fixed bias. What they change by at the branch's states,
    `by_material`, has the shape (k, 3, 6).
    """

    def __init__(self, branch: Branch, by_material: Array, circuit: Circuit, bias: Array) -> None:
        self._branch, self._circuit, self._bias = branch, circuit, bias
        self._origin = _parameters(branch.equations.material)
        scale = np.array([known.scale for known in PARAMETERS.values()])
        self._unit = np.maximum(np.abs(self._origin), 0.1 * scale)
        powers = by_material[1:] * self._unit / branch.values[1:, :3, None]
        # without power everything is zero; its ratios are those of a barely warm lever
        self._powers = np.concatenate([powers[:1], powers])
        self._slopes = spline_through(branch.u, self._powers)(branch.u, 1)

    def predict(self, material: Material) -> tuple[Array, Array]:
        """Return I_h, V_r and T_tip (3, n), and their derivatives by the parameters (3, n, 6).

        Raises
        ------
        BranchEndError
            If the lever has no state below the melting point at one of the biases.
        """
        away = (_parameters(material) - self._origin) / self._unit
        factor = np.exp(self._powers @ away)
        branch = multiplied(self._branch, factor, self._slopes @ away)
        by_material = branch.values[:, :3, None] * self._powers / self._unit
        return _with_slopes(branch, by_material, self._circuit, self._bias)


def _parameters(material: Material) -> Array:
    return np.array([getattr(material, name) for name in PARAMETERS])


def multiplied(branch: Branch, factor: Array, growth: Array) -> Branch:
    """Return a branch with V_l, I_h and V_r times factors (k, 3).

    `growth` is the derivative of the factors' logarithms by u.
    """
    values, slopes = branch.values.copy(), branch.value_slopes.copy()
    slopes[:, :3] = factor * (slopes[:, :3] + values[:, :3] * growth)
    values[:, :3] *= factor
    return replace(branch, values=values, value_slopes=slopes)


def shown_at_bias(branch: Branch, circuit: Circuit, bias: Array) -> tuple[Array, Array]:
    """Return u of the states that a slow ramp takes at some biases, and I_h, V_r, T_tip (3, n).

    Raises
    ------
    BranchEndError
        If the branch has none at one of them.
    """
    reading = branch.read(circuit, bias)
    if np.isnan(reading.u).any():
        raise branch.ended(reading)
    shown, tip_K = branch.shown(reading.u), branch.base_temperature_K + reading.u**2
    return reading.u, np.stack([shown["current_mA"], shown["reader_V"], tip_K])


def _with_slopes(
    branch: Branch, by_material: Array, circuit: Circuit, bias: Array
) -> tuple[Array, Array]:
    """Return I_h, V_r and T_tip at some biases, and their derivatives by the parameters."""
    u, values = shown_at_bias(branch, circuit, bias)
    slopes = spline_through(branch.u, by_material)(u)
    return values, at_fixed_bias(branch.curve(u, 1), u, circuit, slopes)


@dataclass(frozen=True)
class Offset:
    """What a fast lever lacks, exact to first order at one material.

    `values` are those of V_l (V), I_h (mA) and V_r (V), by u; `slopes` of their derivatives by the
    parameters.
    """

    material: Material
    values: BSpline
    slopes: BSpline

    @classmethod
    def at(cls, material: Material, u: Array, values: Array, slopes: Array) -> Offset:
        """Make curves through what is lacking at some u; without power nothing is."""
        nodes = np.append(0.0, u)

        def curve(known: Array) -> BSpline:
            return spline_through(nodes, np.concatenate([np.zeros_like(known[:1]), known]))

        return cls(material, curve(values), curve(slopes))

    def added(self, branch: Branch) -> Branch:
        """Return a branch of the fast lever with what it lacks."""
        moved = _parameters(branch.equations.material) - _parameters(self.material)
        values, slopes = branch.values.copy(), branch.value_slopes.copy()
        for derivative, known in enumerate((values, slopes)):
            known[:, :3] += self.values(branch.u, derivative)
            known[:, :3] += self.slopes(branch.u, derivative) @ moved
        return replace(branch, values=values, value_slopes=slopes)


@dataclass(frozen=True)
class ForwardModel:
    """Predicts a measurement at some biases (V, in any order) with a lever that is solved fast.

    The full lever corrects the fast one, unless it is None. What is predicted depends on the
    material alone: correcting the model makes another one.
    """

    fast: BranchSolver
    full: Lever | None
    circuit: Circuit
    bias: Array
    offset: Offset | None = None

    @property
    def reach(self) -> Reach:
        """How far a branch must go."""
        return Reach(self.circuit, float(self.bias.max()))

    @one_blas_thread
    def predict(self, material: Material, near: Prediction | None = None) -> Prediction:
        """Predict the measurement of a lever of some material, starting from a similar one's.

        Raises
        ------
        ComputationError
            If the lever has no state below the melting point at one of the biases.
        """
        found = None if near is None else near.linearised
        if found is None or found.branch.equations.material != material:
            found = self.fast.linearised(material, self.reach, found)
        branch, by_material = found.branch, found.shown
        if self.offset:
            branch = self.offset.added(branch)
            by_material = by_material + self.offset.slopes(branch.u)
        known = branch, by_material, self.circuit, self.bias
        return Prediction(*_with_slopes(*known), found, Nearby(*known))

    @one_blas_thread
    def confirmed(self, at: Prediction) -> ForwardModel:
        """Return a model that is exact to first order at the material of a prediction.

        Raises
        ------
        ComputationError
            If the full lever cannot be solved there.
        """
        if self.full is None:
            return self
        fast = at.linearised.branch
        material = fast.equations.material
        equations = self.full.with_material(material).equations
        space = fast.equations.space
        if isinstance(space, ReducedSpace):
            some = np.unique(np.linspace(1, fast.u.size - 1, _CORRECTED_AT).astype(int))
            u, guess = fast.u[some], space.expanded(fast.x[:, some])
            found = find_roots(AtTip(equations, u**2), guess, NewtonOptions(tolerance=1e-5))
            x, factors = found.x, found.factors
        else:
            branch = Follower(equations).until(self.reach)
            u, x, factors = branch.u[1:], branch.x[:, 1:], None
        _, by_material = of_material(equations, x, factors)
        values = equations.observed(x).T - fast.curve(u)[:, :3]
        slopes = by_material - at.linearised.shown_at(u)
        return replace(self, offset=Offset.at(material, u, values, slopes))


def full_model(lever: Lever, bias: Array) -> ForwardModel:
    """Return a lever as forward model, just as it is."""
    return ForwardModel(lever, None, lever.circuit, bias)


def reduced_model(lever: Lever, reduced: ReducedLever, bias: Array) -> ForwardModel:
    """Return a reduced lever, corrected by the full one, as forward model."""
    return ForwardModel(reduced, lever, lever.circuit, bias)


def forward_model(
    probe: Probe,
    bias: Array,
    *,
    reduce: bool = False,
) -> ForwardModel:
    """Return the fastest forward model of a probe.

    Parameters
    ----------
    probe : Probe
    bias : ndarray, shape (n,)
    reduce : bool
        Make and keep a reduced lever (some seconds) if the geometry has none yet: it pays where
        more than one fit is to come.
    """
    lever = Lever(probe)
    reduced = cached_reduction(lever) if reduce else known_reduction(lever)
    fast: BranchSolver = Lever(probe, COARSE) if reduced is None else reduced
    return ForwardModel(fast, lever, probe.circuit, bias)
