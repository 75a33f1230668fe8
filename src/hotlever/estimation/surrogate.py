"""The surrogate of a lever: what it would show for parameters near some, at next to no cost.

Search, profile, posterior and diagnosis all take the levers that they do not solve from here.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, replace
from typing import Protocol, Self

import numpy as np

from hotlever.estimation.contact_temperatures import ContactTemperatures
from hotlever.estimation.load_lines import Rows
from hotlever.estimation.prior_density import Coordinates
from hotlever.lever.branch import TIP_RISE, Branch, shifted
from hotlever.lever.curve import spline_through
from hotlever.lever.reduced.lever import ReducedLever
from hotlever.lever.sensitivities import Linearised
from hotlever.probe import Circuit, Probe
from hotlever.threads import one_blas_thread
from hotlever.types import Array


class Surrogate(Protocol):
    """A local model of what a lever shows, exact at the parameters of one that was solved."""

    def predict(self, parameters: Array) -> tuple[Array, Array]:
        """Return the observables (m, n), and their derivatives (m, n, k), by parameters (k,).

        Raises
        ------
        ComputationError
            If such a lever has no such states.
        """
        ...

    def shown(self, parameters: Array) -> Array:
        """Return the values of `predict` alone."""
        ...


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
        """See `Surrogate`."""
        return self.shown(parameters), self.slopes.copy()

    def shown(self, parameters: Array) -> Array:
        """See `Surrogate`."""
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
        Its derivatives, see `hotlever.lever.sensitivities.by_parameter`.
    rows : Rows
        What is shown of it.
    """

    def __init__(
        self, probe: Probe, names: tuple[str, ...], branch: Branch, by_parameter: Array, rows: Rows
    ) -> None:
        self.probe, self.names, self.branch, self.rows = probe, names, branch, rows
        self.by_parameter, self.contact = by_parameter, ContactTemperatures(probe, names)
        self._origin = probe.values(names)
        scale = Coordinates.of(probe, names).scale
        self._unit = np.maximum(np.abs(self._origin), 0.1 * scale)
        self._rates = by_parameter * self._unit
        self._straight = not branch.begins_cold
        if not self._straight:
            powers = self._rates[1:] / branch.values[1:, :, None]
            # without power everything is zero; its ratios are those of a barely warm lever
            self._rates = np.concatenate([powers[:1], powers])
        self._slopes = spline_through(branch.u, self._rates)(branch.u, 1)

    def reading(self, rows: Rows) -> Self:
        """Return the same of other rows."""
        other = copy(self)
        other.rows = rows
        return other

    def branch_at(self, parameters: Array) -> Branch:
        """Return the branch for some values of the parameters (p,)."""
        away = (parameters - self._origin) / self._unit
        if self._straight:
            return shifted(self.branch, self._rates @ away, self._slopes @ away)
        return multiplied(self.branch, np.exp(self._rates @ away), self._slopes @ away)

    def powers(self, u: Array) -> Array:
        """Return with which powers of the parameters V_l, I_h and V_r go at some u, (n, 4, p).

        Of a lever that only the swept supply heats; the rise of its tip does not change.
        """
        return np.asarray(spline_through(self.branch.u, self._rates)(u) * self._origin / self._unit)

    def predict(self, parameters: Array) -> tuple[Array, Array]:
        """See `Surrogate`."""
        branch = self.branch_at(parameters)
        by_parameter = self._rates
        if not self._straight:
            by_parameter = branch.values[:, :, None] * self._rates
        circuit = self.circuit(parameters)
        shown = self.rows.differentiated(branch, by_parameter / self._unit, circuit, self.names)
        return self.contact.differentiated(*shown, parameters)

    def shown(self, parameters: Array) -> Array:
        """See `Surrogate`."""
        shown = self.rows.values(self.branch_at(parameters), self.circuit(parameters))
        return self.contact.shown(shown, parameters)

    def circuit(self, parameters: Array) -> Circuit:
        """Return the circuit, with those of the parameters that are its own."""
        named = zip(self.names, parameters.tolist(), strict=True)
        own = {name: value for name, value in named if name in Circuit.model_fields}
        return self.probe.circuit.model_copy(update=own)


class ReducedSurrogate(CurveSurrogate):
    """A branch times what a reduced lever changes by at equal rises of the tip: good far away too.

    The reduced lever stays on its few points, and each of its states starts at a root; so this
    costs little more than powers do. Derivatives are those of the powers.

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
        self._shown = self._on_few_points(local.probe)

    def _on_few_points(self, probe: Probe) -> Array:
        """Return V_l, I_h and V_r of the states of a probe, (k, 3)."""
        guess = self._linearised.states(probe)[:, 1:]
        u = self.branch.u[1:]
        few, states = self._reduced.solved(probe, u, guess, self._linearised.factors)
        return np.asarray(few.observed(states.x).T)

    @one_blas_thread
    def branch_at(self, parameters: Array) -> Branch:
        """See `CurveSurrogate.branch_at`.

        Raises
        ------
        ComputationError
            If such a lever has no such states.
        """
        named = zip(self.names, parameters.tolist(), strict=True)
        few = self._on_few_points(self.probe.replace(dict(named))) / self._shown
        ratio = np.ones(self.branch.values.shape)
        ratio[1:, :TIP_RISE] = few
        # without power the ratio is that of a barely warm lever
        ratio[0] = ratio[1]
        growth = spline_through(self.branch.u, ratio)(self.branch.u, 1) / ratio
        return multiplied(self.branch, ratio, growth)


def multiplied(branch: Branch, factor: Array, growth: Array) -> Branch:
    """Return a branch with V_l, I_h, V_r and the rise of the tip times factors (k, 4).

    `growth` is the derivative of the factors' logarithms by u.
    """
    slopes = factor * (branch.value_slopes + branch.values * growth)
    return replace(branch, values=branch.values * factor, value_slopes=slopes)
