"""A solved state of a lever, by the names of what it holds."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from hotlever.types import Array

if TYPE_CHECKING:
    from hotlever.lever.lever import Lever


@dataclass(frozen=True)
class State:
    """A solved state of a lever in its circuit.

    Attributes
    ----------
    lever : Lever
    x : ndarray, shape (size + 1, 1)
        Unknowns, see `hotlever.lever.space`.
    in_air : ndarray, shape (stores, 1), or None
        Temperatures in the air in time, see `hotlever.lever.heat_in_air`; None at rest.
    """

    lever: Lever
    x: Array
    in_air: Array | None = None

    @cached_property
    def _shown(self) -> list[float]:
        return list(self.lever.equations.observed(self.x)[:, 0].tolist())

    @property
    def lever_V(self) -> float:
        """Lever voltage V_l (V)."""
        return self._shown[0]

    @property
    def current_mA(self) -> float:
        """Heater current I_h (mA)."""
        return self._shown[1]

    @property
    def reader_V(self) -> float:
        """Reader voltage V_r (V); NaN without a reader."""
        return self._shown[2]

    @property
    def bias_V(self) -> float:
        """Bias V_b (V) in the lever's circuit."""
        return float(self.lever.circuit.bias(self.lever_V, self.current_mA))

    @property
    def tip_K(self) -> float:
        """Tip temperature (K)."""
        rise = self.lever.space.tip_rise(self.x)
        return self.lever.circuit.base_temperature_K + float(rise[0])

    @cached_property
    def nodal(self) -> tuple[Array, Array]:
        """Temperature (K) and potential (V) at the nodes of the elements."""
        equations = self.lever.equations
        base = equations.base_temperature_K
        return self.lever.space.nodal(self.x[:, 0], base, equations.end_rises)
