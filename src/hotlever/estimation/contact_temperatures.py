"""What a tip shows of the sample that it touches: its apex, and the surface that melts under it.

Both follow from the temperature of the tip by the law of the contact. Near a probe the ratios of
its resistances are taken for powers of the parameters, as voltages of a lever are.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hotlever.contact.law import contact_of
from hotlever.lever.laws import BASE
from hotlever.measurands import OBSERVABLES
from hotlever.probe import Probe
from hotlever.types import Array

#: Where the observables have the tip temperature.
_TIP = list(OBSERVABLES).index("tip")


class ContactTemperatures:
    """Adds `hotlever.measurands.OF_A_CONTACT` to what levers like one show, if it is in contact.

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
        self._of_base = np.array([float(name == BASE) for name in self._names])

    def shown(self, shown: Array, parameters: Array) -> Array:
        """Return the observables of levers, and behind them what contacts show, (all, n)."""
        return self.differentiated(shown, np.zeros((*shown.shape, parameters.size)), parameters)[0]

    def differentiated(self, shown: Array, slopes: Array, parameters: Array) -> tuple[Array, Array]:
        """Return the same and its derivatives, (all, n, p), by those of what levers show."""
        if self._law is None:
            return shown, slopes
        ratio = parameters[self._own] / self._origin
        base_K = self._law.base_temperature_K + float(self._of_base @ (self._origin * (ratio - 1)))
        rise = shown[_TIP] - base_K
        odds, by = self._law.log_odds(rise, self._names)
        powers = np.zeros((*odds.shape, len(self._names)))
        for number, name in enumerate(self._names):
            powers[..., number] = self._origin[number] * by[name]
        share = 1.0 / (1.0 + np.exp(-odds - powers @ np.log(ratio)))
        bent = rise * share * (1.0 - share)
        by_tip = share + bent * by["T"]
        added = by_tip[..., None] * slopes[_TIP]
        added[..., self._own] += bent[..., None] * powers / (ratio * self._origin)
        added[..., self._own] += (1.0 - by_tip)[..., None] * self._of_base
        return np.concatenate([shown, base_K + rise * share]), np.concatenate([slopes, added])
