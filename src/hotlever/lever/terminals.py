"""What is wired to the terminals of a lever, in its equations, and how warm its leg ends are.

Each terminal gives its potential V one equation, and the leg end there the temperature at which the
chip holds it, the base temperature; or all of them one temperature, above it by ``chip_K_per_mW``
times the heat that enters the chip:

=======  =========================================  ===========================================
kind     what it is                                 equation of the potential
=======  =========================================  ===========================================
ground   wired to ground, nothing between           V = 0, no unknown
held     a supply of its own, of a voltage behind   one unknown, the same all over the contact;
         a resistor or of a current, or a ground    current into the lever I = J − G V
         behind a resistor (Norton)
sense    floating                                   no current density; V is the mean over it
swept    the supply that is swept                   V_l, the last unknown: a constraint selects
                                                    a state, or the circuit V_l + R_s I_h = V_b
=======  =========================================  ===========================================

Which terminals are what is a matter of the space, whose unknowns depend on it; what is behind them
and how warm the leg ends are is one of the circuit.
"""

from __future__ import annotations

from copy import copy

import numpy as np

from hotlever.lever.space import Space
from hotlever.lever.transport import Fields
from hotlever.probe.circuit import Circuit
from hotlever.types import Array


class Terminals:
    """What is wired to the terminals of a lever, in its equations; see the module's text.

    Parameters
    ----------
    space : Space
    circuit : Circuit

    Attributes
    ----------
    conductance : ndarray, shape (held,)
        G of the held terminals (mA/V).
    chip_mW_per_K : float
        Of the chip below the leg ends; infinite if it stays at the base temperature.
    source_mA : ndarray, shape (held,)
        J of the held terminals.
    end_rises : dict of str to float
        How much warmer than the base temperature leg ends are (K), if they are.
    """

    def __init__(self, space: Space, circuit: Circuit) -> None:
        self._space, self._held = space, np.array(list(space.held.values()), dtype=int)
        self.conductance, self.source_mA = circuit.norton(space.held)
        self.chip_mW_per_K = np.inf if space.chip is None else 1.0 / circuit.chip_K_per_mW
        self.end_rises = circuit.end_rises()

    def scaled(self, sources: float, rises: float) -> Terminals:
        """Return the same with so many times the sources, and the rises of leg ends."""
        other = copy(self)
        other.source_mA = sources * self.source_mA
        other.end_rises = {name: rises * rise for name, rise in self.end_rises.items()}
        return other

    @property
    def behind(self) -> Array:
        """The conductances behind all unknowns that have one, that of the chip last."""
        chip = [] if self._space.chip is None else [self.chip_mW_per_K]
        return np.append(self.conductance, chip)

    def add_heat_into_chip(self, weak: Array, x: Array, mW_per_K: float | None = None) -> None:
        """Add what the chip takes up of states or changes of them, or by another conductance."""
        if self._space.chip is None:
            return
        unknowns, weights = self._space.chip
        rise = np.tensordot(weights, x[unknowns], axes=1)
        heat = (self.chip_mW_per_K if mW_per_K is None else mW_per_K) * rise
        weak[unknowns] += np.multiply.outer(weights, heat)

    def add_currents(self, weak: Array, x: Array) -> None:
        """Add what held terminals take from states (size + 1, n), G V − J, to the balances there.

        Of an ideal supply both parts are large, so that the difference is taken first.
        """
        weak[self._held] += self._conducted(x) - self.source_mA[:, None]

    def add_current_changes(self, weak: Array, change: Array) -> None:
        """Do the same with changes of the unknowns, (size + 1, n) or (size + 1, n, k)."""
        weak[self._held] += self._conducted(change)

    def _conducted(self, x: Array) -> Array:
        conductance = self.conductance.reshape(-1, *(1,) * (x.ndim - 1))
        return np.asarray(conductance * x[self._held])

    def power(self, x: Array, into: Array) -> Array:
        """Return the power (mW) that supplies put into states, (n,), by the currents (mA) there.

        These are the weak form of the fluxes, (size + 1, n).
        """
        by_held = (x[self._held] * into[self._held]).sum(axis=0)
        return np.asarray(x[-1] * into[-1] + by_held)

    def warmed(self, T: Array, grad_T: Array) -> tuple[Array, Array]:
        """Return temperatures and slopes at the points with leg ends as warm as they are held."""
        for name, rise in self.end_rises.items():
            value, slope = np.split(self._space.end_tests[name][..., None], [1])
            T, grad_T = T + rise * value[0], grad_T + rise * slope
        return T, grad_T

    def warmed_by_base(self, fields: Fields) -> Fields:
        """Return how fields change with the base temperature: leg ends of their own stay."""
        warmer, slope = np.ones_like(fields.T), np.zeros_like(fields.grad_T)
        for name in self.end_rises:
            value, slopes = np.split(self._space.end_tests[name][..., None], [1])
            warmer, slope = warmer - value[0], slope - slopes
        return Fields(warmer, slope, np.zeros_like(fields.grad_V))
