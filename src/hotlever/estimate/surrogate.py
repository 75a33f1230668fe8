"""The surrogate of a lever: what it would show for parameters near some, at next to no cost.

Search, profile, posterior and diagnosis all take the levers that they do not solve from here.

What a lever shows is what is read off its branch at the rows of a measurement, each on its load
line: a row says that V_l + R_s I_h was the bias. A branch that folds has several such states, or
none; a slow ramp takes the first. A search must not jump with its candidates from one part of a
branch to another, so it compares each row with the state nearest to what was measured, and where a
candidate ends before the bias of a row, with that end, less a percent for each of the bias that is
beyond it. Of a tip in contact, temperatures of the contact follow from that of the tip.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass
from itertools import pairwise
from typing import Self

import numpy as np

from hotlever.contact.law import contact_of
from hotlever.lever.branch import TIP_RISE, Branch, branch_end
from hotlever.lever.equations import LeverEquations
from hotlever.lever.newton import NewtonResult
from hotlever.lever.observables import (
    Linearised,
    at_fixed_bias,
    observed,
    observed_by,
    with_changes,
)
from hotlever.lever.reduced_lever import ReducedLever
from hotlever.piecewise import Piecewise, crossing, spline_values
from hotlever.probe import Circuit, Probe
from hotlever.probe.probe_parameters import parameters_of
from hotlever.quantities import OBSERVABLES
from hotlever.types import Array, Index
from hotlever.work import one_blas_thread


@dataclass(frozen=True)
class Rows:
    """Rows of a measurement as what candidates are compared with.

    Attributes
    ----------
    bias_V : ndarray, shape (n,)
    measured : ndarray, shape (observables, n), optional
        What was measured, `hotlever.quantities.OBSERVABLES`; NaN where nothing was. Without it the
        states are those of a slow ramp.
    steepness : float
        Near a fold the states at a bias move without limit as parameters change; their derivatives
        count as if the bias rose along the branch by at least this share of its mean slope up to
        there.
    shortfall : float
        Where a branch ends below a bias, what its end shows counts less by this much for each
        percent of the bias that is beyond it (%). At one per cent, levers without a state at the
        last rows described currents that fall there.
    """

    bias_V: Array
    measured: Array | None = None
    steepness: float = 0.03
    shortfall: float = 3.0

    def states(self, branch: Branch, circuit: Circuit) -> tuple[Array, Array]:
        """Return u of the states that the rows are compared with, and how far these fall short.

        That is the bias of a row over that of its state: one, or more where a branch ends before.

        Raises
        ------
        BranchEndError
            If a slow ramp finds no state at one of the biases.
        """
        if self.measured is not None:
            return self._nearest(branch, circuit)
        reading = branch.read(circuit, self.bias_V)
        if np.isnan(reading.u).any():
            raise branch_end(branch, reading)
        return reading.u, np.ones(reading.u.shape)

    def values(self, branch: Branch, circuit: Circuit) -> Array:
        """Return the observables of the states, (observables, n); see `states`."""
        u, short = self.states(branch, circuit)
        return observed(circuit, self._shown(branch.curve(u).T, short))

    def differentiated(
        self, branch: Branch, by_parameter: Array, circuit: Circuit, names: Sequence[str]
    ) -> tuple[Array, Array]:
        """Return the same, and derivatives (observables, n, p) by parameters; see `states`.

        Parameters
        ----------
        branch : Branch
        by_parameter : ndarray, shape (k, 4, p)
            How its states change, see `hotlever.lever.observables.by_parameter`.
        circuit : Circuit
        names : sequence of str
            The parameters.
        """
        u, short = self.states(branch, circuit)
        outputs = branch.curve(u).T
        by_state = spline_values(branch.u, by_parameter, u)
        of_circuit = np.stack([circuit.bias_by(name, outputs[1]) for name in names], axis=1)
        along = branch.curve(u, 1)
        self._steepen(along, circuit, u)
        slopes = at_fixed_bias(along, circuit, by_state, of_circuit)
        ends = np.flatnonzero(short > 1.0)
        if ends.size:
            # the end of a branch stays where it is, to first order; what it lacks in bias changes
            bias_by = circuit.bias(by_state[ends, 0], by_state[ends, 1]) + of_circuit[ends]
            less = self.shortfall * (short[ends] ** 2 / self.bias_V[ends])[:, None] * bias_by
            slopes[:, ends] = np.moveaxis(by_state[ends], 1, 0)
            slopes[:TIP_RISE, ends] *= self._left(short[ends])[:, None]
            slopes[:TIP_RISE, ends] += outputs[:TIP_RISE, ends, None] * less
        outputs = self._shown(outputs, short)
        return observed(circuit, outputs), observed_by(circuit, outputs, slopes, names)

    def _shown(self, outputs: Array, short: Array) -> Array:
        """Return V_l, I_h, V_r and the tip's rise, (4, n), less where they fall short."""
        outputs = outputs.copy()
        outputs[:TIP_RISE] *= self._left(short)
        return outputs

    def _left(self, short: Array) -> Array:
        """Return the share of what the end of a branch shows that counts beyond it."""
        return 1.0 - self.shortfall * (short - 1.0)

    def _nearest(self, branch: Branch, circuit: Circuit) -> tuple[Array, Array]:
        """Return the states nearest to what was measured; see `states`."""
        curve = branch.bias_by_u(circuit)
        cold = branch.begins_cold
        start = float(branch.u[0])
        level = np.sort(curve.derivative().roots())
        ends = [start, *level[(level > start) & (level < branch.end_u)].tolist(), branch.end_u]
        # a cold lever is told apart from itself by the size of the bias only, and has none without
        bias = np.abs(self.bias_V) if cold else self.bias_V
        heated = np.flatnonzero((bias > 0) | (not cold))
        u, distance = np.zeros(bias.shape), np.full(bias.shape, np.inf)
        u[heated] = np.nan
        short = np.ones(bias.shape)
        for low, high in pairwise(ends):
            first, last = float(curve(low)), float(curve(high))
            here = heated[(bias[heated] >= min(first, last)) & (bias[heated] <= max(first, last))]
            if not here.size:
                continue
            sign = 1.0 if last >= first else -1.0
            at = crossing(Piecewise(sign * curve.c, curve.x), low, high, sign * bias[here])
            away = self._distance(observed(circuit, branch.curve(at).T), here)
            nearer = away < distance[here]
            u[here[nearer]], distance[here[nearer]] = at[nearer], away[nearer]
        height = curve(np.array(ends))
        for row in np.flatnonzero(np.isnan(u)).tolist():
            end = int(np.argmax(height) if bias[row] >= height.max() else np.argmin(height))
            u[row] = ends[end]
            short[row] = bias[row] / height[end] if height[end] * bias[row] > 0 else 1.0
        if cold:
            u = np.where(self.bias_V < 0, -np.abs(u), u)
        return u, short

    def _distance(self, values: Array, rows: Index) -> Array:
        """Return how far values (observables, m) are from some rows, as squares of shares."""
        assert self.measured is not None
        measured = self.measured[: len(values)]
        largest = np.nanmax(np.abs(measured), axis=1, keepdims=True, initial=1e-300)
        return np.asarray(np.nansum(((values - measured[:, rows]) / largest) ** 2, axis=0))

    def _steepen(self, along: Array, circuit: Circuit, u: Array) -> None:
        """Let the bias rise where it hardly does, in derivatives by u (n, 5) of what is shown."""
        slope = circuit.bias(along[:, 0], along[:, 1])
        least = self.steepness * np.abs(self.bias_V) / np.maximum(np.abs(u), 1e-9)
        flat = np.abs(slope) < least
        along[flat, 0] += (np.where(slope < 0, -least, least) - slope)[flat]


class ContactTemperatures:
    """Adds `hotlever.quantities.OF_A_CONTACT` to what levers like one show, if it is in contact.

    Parameters
    ----------
    probe : Probe
    names : sequence of str
        The parameters, (p,).
    """

    def __init__(self, probe: Probe, names: Sequence[str]) -> None:
        self._law = contact_of(probe)
        of_law = () if self._law is None else self._law.names
        self._own = [number for number, name in enumerate(names) if name in of_law]
        self._names = [names[number] for number in self._own]
        self._origin = probe.values(self._names)
        self._of_base = np.array([float(name == "base_temperature_K") for name in self._names])

    @property
    def there(self) -> bool:
        """Whether it is in contact."""
        return self._law is not None

    def added(self, observables: Array, parameters: Array) -> Array:
        """Return the observables of levers, and behind them what contacts show, (all, n)."""
        return self.differentiated(
            observables, np.zeros((*observables.shape, parameters.size)), parameters
        )[0]

    def differentiated(
        self, observables: Array, slopes: Array, parameters: Array
    ) -> tuple[Array, Array]:
        """Return the same and its derivatives, (all, n, p), by those of what levers show."""
        if self._law is None:
            return observables, slopes
        ratio = parameters[self._own] / self._origin
        base_K = self._law.base_temperature_K + float(self._of_base @ (self._origin * (ratio - 1)))
        tip = list(OBSERVABLES).index("tip")
        rise = observables[tip] - base_K
        odds, by = self._law.log_odds(rise, self._names)
        powers = np.zeros((*odds.shape, len(self._names)))
        for number, name in enumerate(self._names):
            powers[..., number] = self._origin[number] * by[name]
        share = 1.0 / (1.0 + np.exp(-odds - powers @ np.log(ratio)))
        bent = rise * share * (1.0 - share)
        by_tip = share + bent * by["T"]
        added = by_tip[..., None] * slopes[tip]
        added[..., self._own] += bent[..., None] * powers / (ratio * self._origin)
        added[..., self._own] += (1.0 - by_tip)[..., None] * self._of_base
        return np.concatenate([observables, base_K + rise * share]), np.concatenate([slopes, added])


@dataclass(frozen=True)
class LinearSurrogate:
    """What is shown, to first order in the parameters: that of a history in time.

    Attributes
    ----------
    parameters : ndarray, shape (k,)
    values, slopes : ndarray, shapes (observables, n) and (observables, n, k)
        At the parameters.
    """

    parameters: Array
    values: Array
    slopes: Array

    def predict(self, parameters: Array) -> tuple[Array, Array]:
        """See `CurveSurrogate.predict`."""
        return self.values_at(parameters), self.slopes.copy()

    def values_at(self, parameters: Array) -> Array:
        """Return the values of `predict` alone."""
        return self.values + self.slopes @ (parameters - self.parameters)


class CurveSurrogate:
    """The branch of a lever, and how it changes with the parameters at equal rises of the tip.

    There voltages and currents are nearly powers of the parameters, much more so than anything is
    at a fixed bias. With held supplies they may be of either sign, and go straight.

    Parameters
    ----------
    probe : Probe
    names : tuple of str
        The parameters.
    branch : Branch
        Of this probe.
    by_parameter : ndarray, shape (k, 4, p)
        Its derivatives, see `hotlever.lever.observables.by_parameter`.
    rows : Rows
        What is shown of it.
    """

    def __init__(
        self, probe: Probe, names: tuple[str, ...], branch: Branch, by_parameter: Array, rows: Rows
    ) -> None:
        self.probe, self.names, self.branch, self.rows = probe, names, branch, rows
        self.by_parameter, self.contact = by_parameter, ContactTemperatures(probe, names)
        self._origin = probe.values(names)
        every = parameters_of(probe, anywhere=True)
        scale = np.array([every[name].scale for name in names])
        self.unit = np.maximum(np.abs(self._origin), 0.1 * scale)
        self._rates = by_parameter * self.unit
        self._straight = not branch.begins_cold
        if not self._straight:
            powers = self._rates[1:] / branch.values[1:, :, None]
            # without power everything is zero; its ratios are those of a barely warm lever
            self._rates = np.concatenate([powers[:1], powers])
        self._slopes = spline_values(branch.u, self._rates, branch.u, 1)

    def reading(self, rows: Rows) -> Self:
        """Return the same of other rows."""
        other = copy(self)
        other.rows = rows
        return other

    def branch_at(self, parameters: Array) -> Branch:
        """Return the branch for some values of the parameters (p,)."""
        away = self.distance(parameters)
        if self._straight:
            return self.branch.shifted(self._rates @ away, self._slopes @ away)
        return multiplied(self.branch, np.exp(self._rates @ away), self._slopes @ away)

    def distance(self, parameters: Array) -> Array:
        """Return how far parameters (..., p) are from the probe's, in the units of the rates."""
        return np.asarray((parameters - self._origin) / self.unit)

    def rates_at(self, u: Array) -> Array:
        """Return how logarithms of V_l, I_h, V_r and the rise change at some u, (n, 4, p).

        By the distance of each parameter, of a lever that only the swept supply heats.
        """
        return spline_values(self.branch.u, self._rates, u)

    def powers(self, u: Array) -> Array:
        """Return with which powers of the parameters V_l, I_h and V_r go at some u, (n, 4, p).

        Of a lever that only the swept supply heats; the rise of its tip does not change.
        """
        return self.rates_at(u) * self._origin / self.unit

    def predict(self, parameters: Array) -> tuple[Array, Array]:
        """Return the observables (m, n), and their derivatives (m, n, k), by parameters (k,).

        Raises
        ------
        ComputationError
            If such a lever has no such states.
        """
        branch = self.branch_at(parameters)
        by_parameter = self._rates
        if not self._straight:
            by_parameter = branch.values[:, :, None] * self._rates
        circuit = self.circuit(parameters)
        prediction = self.rows.differentiated(branch, by_parameter / self.unit, circuit, self.names)
        return self.contact.differentiated(*prediction, parameters)

    def values_at(self, parameters: Array) -> Array:
        """Return the values of `predict` alone."""
        values = self.rows.values(self.branch_at(parameters), self.circuit(parameters))
        return self.contact.added(values, parameters)

    def circuit(self, parameters: Array) -> Circuit:
        """Return the circuit, with those of the parameters that are its own."""
        named = zip(self.names, parameters.tolist(), strict=True)
        own = {name: value for name, value in named if name in Circuit.model_fields}
        return self.probe.circuit.model_copy(update=own)


class ReducedSurrogate(CurveSurrogate):
    """A branch times what a reduced lever changes by at equal rises of the tip: good far away too.

    The reduced lever stays on its few points, and each of its states starts at a root; so this
    costs little more than powers do.

    Parameters
    ----------
    local : CurveSurrogate
        Of the lever at which it is exact.
    reduced : ReducedLever
    linearised : Linearised
        The reduced lever there.
    """

    def __init__(
        self, local: CurveSurrogate, reduced: ReducedLever, linearised: Linearised
    ) -> None:
        super().__init__(local.probe, local.names, local.branch, local.by_parameter, local.rows)
        self._reduced, self._linearised = reduced, linearised
        few, states = self._on_few_points(local.probe.values(local.names))
        self._local_outputs = few.observed(states.x).T

    def _on_few_points(self, parameters: Array) -> tuple[LeverEquations, NewtonResult]:
        """Return the equations and the states of a probe with some values of the parameters."""
        named = zip(self.names, parameters.tolist(), strict=True)
        probe = self.probe.replace(dict(named))
        guess = self._linearised.states(probe)[:, 1:]
        return self._reduced.solved(probe, self.branch.u[1:], guess, self._linearised.factors)

    @one_blas_thread
    def branch_at(self, parameters: Array) -> Branch:
        """See `CurveSurrogate.branch_at`.

        Raises
        ------
        ComputationError
            If such a lever has no such states.
        """
        few, states = self._on_few_points(parameters)
        return self._multiplied_by(few.observed(states.x).T)

    def _multiplied_by(self, outputs: Array) -> Branch:
        """Return the branch whose states show V_l, I_h and V_r (k, 3) on few points."""
        ratio = np.ones(self.branch.values.shape)
        ratio[1:, :TIP_RISE] = outputs / self._local_outputs
        # without power the ratio is that of a barely warm lever
        ratio[0] = ratio[1]
        growth = spline_values(self.branch.u, ratio, self.branch.u, 1) / ratio
        return multiplied(self.branch, ratio, growth)

    @one_blas_thread
    def predict(self, parameters: Array) -> tuple[Array, Array]:
        """See `CurveSurrogate.predict`."""
        few, states = self._on_few_points(parameters)
        outputs = few.observed(states.x).T
        branch = self._multiplied_by(outputs)
        _, slopes = with_changes(few, states.x, self.names, states.factors)
        rates = np.zeros((*branch.values.shape, len(self.names)))
        rates[1:, :TIP_RISE] = slopes[:, :TIP_RISE] / outputs[..., None]
        rates[0] = rates[1]
        prediction = self.rows.differentiated(
            branch, branch.values[:, :, None] * rates, self.circuit(parameters), self.names
        )
        return self.contact.differentiated(*prediction, parameters)


#: A local model of what a lever shows, exact at the parameters of one that was solved.
Surrogate = CurveSurrogate | LinearSurrogate


def multiplied(branch: Branch, factor: Array, growth: Array) -> Branch:
    """Return a branch with V_l, I_h, V_r and the rise of the tip times factors (k, 4).

    `growth` is the derivative of the factors' logarithms by u.
    """
    slopes = factor * (branch.value_slopes + branch.values * growth)
    return branch.showing(branch.values * factor, slopes)
