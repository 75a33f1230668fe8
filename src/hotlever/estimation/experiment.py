"""What a fit compares the data with: a lever that is solved fast, corrected by the full one.

The fast lever is a reduced one where the geometry has been reduced before, or else the same lever
on a coarse mesh. At a material where the full lever is solved too, the difference of the two
branches is added to the fast one's from then on. Parameters are what
`hotlever.probe.parameters` names: of the material, dimensions, the series resistance.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from scipy.interpolate import BSpline

from hotlever.estimation.coordinates import Coordinates
from hotlever.estimation.load_lines import Rows, nearest_states, steepened
from hotlever.lever.branch import Branch, Reach, shifted
from hotlever.lever.curve import spline_through
from hotlever.lever.held import at_places_of, followed
from hotlever.lever.lever import COARSE, Lever
from hotlever.lever.newton import NewtonOptions, find_roots
from hotlever.lever.pinned import Pinned
from hotlever.lever.reduced import ReducedLever, ReducedSpace
from hotlever.lever.reduction import cached_reduction, can_be_reduced, known_reduction
from hotlever.lever.sensitivities import Linearised, at_fixed_bias, by_parameter
from hotlever.lever.similar import SimilarLevers
from hotlever.materials import PARAMETERS
from hotlever.probe import Circuit, Probe
from hotlever.probe.parameters import usual_parameters
from hotlever.threads import one_blas_thread
from hotlever.types import Array

#: How far beyond zero bias the branch of a lever goes that does not start cold: share of the range.
_BEYOND_ZERO = 0.05
#: States at which the full lever corrects a reduced one, whose errors are small and smooth.
_CORRECTED_AT = 10


class BranchSolver(Protocol):
    """A lever that is solved for any similar probe: full, coarse or reduced."""

    def linearised(
        self,
        probe: Probe,
        reach: Reach,
        near: Linearised | None = None,
        names: tuple[str, ...] = ...,
    ) -> Linearised:
        """Return the branch of a probe, with its derivatives by some parameters."""
        ...


@dataclass(frozen=True)
class Prediction:
    """What an instrument and a thermometer would show.

    Attributes
    ----------
    values : ndarray, shape (3, n)
        I_h (mA), V_r (V) and T_tip (K) at the biases.
    slopes : ndarray, shape (3, n, p)
        Derivatives by the model's parameters at fixed bias.
    linearised : Linearised
        What they were read from, but for its offset.
    nearby : Nearby
        Predictions for similar probes.
    """

    values: Array
    slopes: Array
    linearised: Linearised
    nearby: Nearby

    @property
    def probe(self) -> Probe:
        """The probe it is for."""
        return self.linearised.probe

    def columns(self) -> dict[str, Array]:
        """Return what it shows, by the names that a sweep has, each (n,)."""
        bias, (current, reader, tip) = self.nearby.bias, self.values
        lever = self.probe.circuit.lever_voltage(bias, current)
        shown = {"bias_V": bias, "lever_V": lever}
        return shown | {"current_mA": current, "reader_V": reader, "tip_K": tip}


class Nearby:
    """Predictions for probes near one whose branch is known: a branch costs nothing there.

    At a fixed rise of the tip, voltages and currents are nearly powers of the parameters, much
    more so than anything is at a fixed bias. With held supplies they may be of either sign, and go
    straight. What they change by at the branch's states, ``by_parameter``, has the shape
    (k, 3 or 4, p).
    """

    def __init__(
        self,
        probe: Probe,
        names: tuple[str, ...],
        branch: Branch,
        by_parameter: Array,
        rows: Rows,
    ) -> None:
        self._probe, self._names, self._branch, self._rows = probe, names, branch, rows
        self.bias = rows.bias_V
        scale = Coordinates.of(probe, names).scale
        self._origin = probe.at(names)
        self._unit = np.maximum(np.abs(self._origin), 0.1 * scale)
        by_coordinate = by_parameter * self._unit
        self._straight = not branch.equations.circuit.starts_cold
        if self._straight:
            self._rates = by_coordinate
        else:
            powers = by_coordinate[1:] / branch.values[1:, :3, None]
            # without power everything is zero; its ratios are those of a barely warm lever
            self._rates = np.concatenate([powers[:1], powers])
        self._slopes = spline_through(branch.u, self._rates)(branch.u, 1)

    def branch_at(self, values: Array) -> Branch:
        """Return the branch of some values of the parameters (p,)."""
        away = (values - self._origin) / self._unit
        if self._straight:
            return shifted(self._branch, self._rates @ away, self._slopes @ away)
        return multiplied(self._branch, np.exp(self._rates @ away), self._slopes @ away)

    def predict(self, values: Array) -> tuple[Array, Array]:
        """Return I_h, V_r and T_tip (3, n), and their derivatives (3, n, p), for some values (p,).

        Raises
        ------
        BranchEndError
            If the lever has no state below the melting point at one of the biases, and these are
            no rows of a measurement.
        """
        branch = self.branch_at(values)
        by_parameter = self._rates
        if not self._straight:
            by_parameter = branch.values[:, :3, None] * self._rates
        by_parameter = by_parameter / self._unit
        own = [
            (name, value)
            for name, value in zip(self._names, values.tolist(), strict=True)
            if name in Circuit.model_fields
        ]
        circuit = self._probe.circuit.model_copy(update=dict(own))
        return _with_slopes(branch, by_parameter, circuit, self._rows, self._names)


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
    return reading.u, shown_at(branch, circuit, reading.u)


def shown_at(branch: Branch, circuit: Circuit, u: Array) -> Array:
    """Return I_h, V_r and T_tip (3, n) of the states at some u, in the circuit of a similar lever.

    Its base temperature may be another one.
    """
    warmer = circuit.base_temperature_K - branch.base_temperature_K
    shown, tip_K = branch.shown(u), branch.tip_K(u) + warmer
    return np.stack([shown["current_mA"], shown["reader_V"], tip_K])


def _with_slopes(
    branch: Branch, by_parameter: Array, circuit: Circuit, rows: Rows, names: tuple[str, ...]
) -> tuple[Array, Array]:
    """Return I_h, V_r and T_tip at some biases, and their derivatives by parameters."""
    if rows.shown is None:
        short = np.ones(rows.bias_V.shape)
        u, values = shown_at_bias(branch, circuit, rows.bias_V)
    else:
        u, short = nearest_states(branch, circuit, rows)
        values = shown_at(branch, circuit, u)
    slopes = spline_through(branch.u, by_parameter)(u)
    of_circuit = np.stack([circuit.bias_by(name, values[0]) for name in names], axis=1)
    of_base = np.array([circuit.base_by(name) for name in names])
    along = branch.curve(u, 1)
    if rows.shown is not None:
        steepened(along, circuit, u, rows.bias_V)
    by = at_fixed_bias(along, circuit, slopes, of_circuit, of_base)
    ends = np.flatnonzero(short > 1.0)
    if ends.size:
        # the end of a branch stays where it is, to first order; what it lacks in bias changes
        bias_by = circuit.bias(slopes[ends, 0], slopes[ends, 1]) + of_circuit[ends]
        more = short[ends] / rows.bias_V[ends] * short[ends]
        for row, value in enumerate(values[:2, ends]):
            by[row, ends] = short[ends, None] * slopes[ends, row + 1]
            by[row, ends] -= (value * more)[:, None] * bias_by
        by[2, ends] = of_base + (slopes[ends, 3] if slopes.shape[1] > 3 else 0.0)
        values[:2, ends] *= short[ends]
    return values, by


@dataclass(frozen=True)
class Offset:
    """What a fast lever lacks, exact to first order at one place among the parameters.

    `values` are those of V_l (V), I_h (mA) and V_r (V), perhaps of the rise of the tip (K) too, by
    u; `slopes` of their derivatives by the parameters.
    """

    at: Array
    values: BSpline
    slopes: BSpline

    @classmethod
    def through(cls, at: Array, u: Array, values: Array, slopes: Array) -> Offset:
        """Make curves through what is lacking at some u."""
        return cls(at, spline_through(u, values), spline_through(u, slopes))

    def added(self, branch: Branch, at: Array) -> Branch:
        """Return a branch of the fast lever with what it lacks, for some values of parameters."""
        moved, u = at - self.at, branch.u
        changes, slopes = (self.values(u, n) + self.slopes(u, n) @ moved for n in (0, 1))
        return shifted(branch, changes, slopes)


@dataclass(frozen=True)
class Experiment:
    """Predicts a measurement at some biases (V, in any order) with a lever that is solved fast.

    The full lever corrects the fast one, unless it is None. What is predicted depends on the
    probe alone: correcting the model makes another one. Derivatives are by ``names``, and
    are corrected too if ``first_order``. Where it is known what was measured, as ``shown``, each
    bias stands for the state nearest to that (`hotlever.estimation.load_lines`), otherwise for that
    of a slow ramp.
    """

    fast: BranchSolver
    full: SimilarLevers | None
    bias: Array
    names: tuple[str, ...] = tuple(PARAMETERS)
    first_order: bool = True
    offset: Offset | None = None
    shown: Array | None = None

    @property
    def rows(self) -> Rows:
        """The biases, and what was measured there."""
        return Rows(self.bias, self.shown)

    def measuring(self, bias: Array, shown: Array | None) -> Experiment:
        """Return the model at other biases (V), with what was measured there, if that is known."""
        return replace(self, bias=bias, shown=shown)

    @property
    def drawn(self) -> Probe:
        """The probe whose drawing has the meshes that others move."""
        similar = self.fast if isinstance(self.fast, SimilarLevers) else self.full
        assert similar is not None
        return similar.drawn

    def coarse(self) -> Experiment:
        """Return the model with a lever that is solved for any parameters, not corrected."""
        if isinstance(self.fast, SimilarLevers):
            return self
        return replace(self, fast=SimilarLevers(Lever(self.drawn, COARSE)), offset=None)

    def drawn_anew(self, probe: Probe) -> Experiment:
        """Return the model on meshes of a probe's own drawing, not corrected."""
        full = None if self.full is None else SimilarLevers(Lever(probe))
        return replace(self, fast=SimilarLevers(Lever(probe, COARSE)), full=full, offset=None)

    def reach(self, probe: Probe) -> Reach:
        """Return how far the branch of a probe must go: beyond zero if it does not start cold.

        Similar levers have no bias elsewhere.
        """
        lowest, highest = min(float(self.bias.min()), 0.0), max(float(self.bias.max()), 0.0)
        return Reach(probe.circuit, highest, lowest - _BEYOND_ZERO * (highest - lowest))

    @one_blas_thread
    def predict(self, probe: Probe, near: Prediction | None = None) -> Prediction:
        """Predict the measurement of a probe, starting from a similar one's.

        Raises
        ------
        ComputationError
            If the lever has no state below the melting point at one of the biases.
        """
        found = None if near is None else near.linearised
        if found is None or found.probe != probe:
            found = self.fast.linearised(probe, self.reach(probe), found, self.names)
        branch, by_parameter = found.branch, found.shown
        if self.offset:
            branch = self.offset.added(branch, probe.at(self.names))
            by_parameter = by_parameter + self.offset.slopes(branch.u)
        shown = _with_slopes(branch, by_parameter, probe.circuit, self.rows, self.names)
        nearby = Nearby(probe, self.names, branch, by_parameter, self.rows)
        return Prediction(*shown, found, nearby)

    @one_blas_thread
    def confirmed(self, at: Prediction) -> Experiment:
        """Return a model that is exact at the probe of a prediction, if so wanted to first order.

        Raises
        ------
        ComputationError
            If the full lever cannot be solved there.
        """
        if self.full is None:
            return self
        fast, probe = at.linearised.branch, at.probe
        equations = self.full.equations(probe, self.names)
        space = fast.equations.space
        if isinstance(space, ReducedSpace):
            some = np.unique(np.linspace(1, fast.u.size - 1, _CORRECTED_AT).astype(int))
            u, guess = fast.u[some], space.expanded(fast.x[:, some])
            found = find_roots(Pinned(equations, u**2), guess, NewtonOptions(tolerance=1e-5))
            x = found.x
        else:
            branch = at_places_of(fast, followed(equations, self.reach(probe)))
            u, x = branch.u[branch.solved], branch.x[:, branch.solved]
        known = at.linearised.shown_at(u)
        count = known.shape[1]
        shown = np.vstack([equations.observed(x), equations.space.tip_rise(x)])[:count]
        values = shown.T - fast.curve(u)[:, :count]
        lacking = np.zeros(known.shape)
        if self.first_order:
            lacking = by_parameter(equations, x, self.names, pin=fast.sections.pin(u)) - known
        if equations.circuit.starts_cold:
            # without power nothing is lacking
            u = np.append(0.0, u)
            values, lacking = (np.insert(one, 0, 0.0, axis=0) for one in (values, lacking))
        return replace(self, offset=Offset.through(probe.at(self.names), u, values, lacking))


def full_experiment(lever: Lever, bias: Array) -> Experiment:
    """Return a lever as forward model, just as it is."""
    return Experiment(SimilarLevers(lever), None, bias, usual_parameters(lever.probe))


def reduced_experiment(lever: Lever, reduced: ReducedLever, bias: Array) -> Experiment:
    """Return a reduced lever, corrected by the full one, as forward model."""
    return Experiment(reduced, SimilarLevers(lever), bias, reduced.names)


def experiment_of(
    probe: Probe,
    bias: Array,
    *,
    names: tuple[str, ...] | None = None,
    reduce: bool = False,
) -> Experiment:
    """Return the fastest forward model of a probe.

    Parameters
    ----------
    probe : Probe
    bias : ndarray, shape (n,)
    names : tuple of str
        Parameters of the derivatives; by default what a fit usually varies. A reduced lever does
        not serve all, see `hotlever.lever.reduction.can_be_reduced`.
    reduce : bool
        Make and keep a reduced lever (some seconds) if the geometry has none yet: it pays where
        more than one fit is to come.
    """
    lever, reduced = Lever(probe), None
    names = usual_parameters(probe) if names is None else names
    if can_be_reduced(probe, names):
        reduced = cached_reduction(lever, names=names) if reduce else known_reduction(lever, names)
    fast: BranchSolver = SimilarLevers(Lever(probe, COARSE)) if reduced is None else reduced
    return Experiment(fast, SimilarLevers(lever), bias, names)
