"""What a tip in contact takes from its lever, by the temperature at its base: one law.

Resistances in series: the cone, the interface, and spreading in the sample; and air beside the
cone. Heat flows as at rest: the cone follows within 0.1 µs, and the sample within the time in which
heat spreads over a few radii, or through the films.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hotlever.contact.resistances import (
    AirBeside,
    axis_rise,
    cold_resistance,
    contact_resistance,
    up_the_cone,
)
from hotlever.materials.laws import Evaluated
from hotlever.probe import Probe
from hotlever.types import Array

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

#: By this name the interface stands in probe files and fits.
INTERFACE = "interface_K_per_mW"


class AtTheContact(NamedTuple):
    """Where heat goes in some states, shape (n,) each."""

    apex_K: Array
    surface_K: Array  #: of the sample under the apex, its mean over the contact
    sample_mW: Array  #: through the contact
    beside_mW: Array  #: from the side of the cone through the air to the sample
    tip_K_per_mW: Array  #: resistance of the cone


class ContactLaw:
    """The heat that enters a tip in contact, by the temperature at its base.

    Parameters
    ----------
    probe : Probe
        With a tip and a contact.
    step : float
        Share of a parameter, or of all resistances, by which it is changed for a derivative.

    Attributes
    ----------
    interface_K_per_mW, spreading_K_per_mW, below_apex_K_per_mW : float
        Resistances of interface and sample, and their sum. Spreading depends a little on the
        interface, which makes the flux more uniform.
    """

    def __init__(self, probe: Probe, step: float = 1e-3) -> None:
        tip, contact = probe.tip, probe.contact
        assert tip is not None
        assert contact is not None
        self._probe, self._tip, self._step = probe, tip, step
        self._others: dict[tuple[str, float], ContactLaw] = {}
        self.base_temperature_K = probe.circuit.base_temperature_K
        layers = contact.layers
        self.interface_K_per_mW = contact.interface_K_per_mW
        thicknesses = [layer.thickness_um for layer in layers if layer.thickness_um is not None]
        kappas = [layer.kappa for layer in layers]
        self._below = tip.apex_radius_um, kappas, thicknesses, self.interface_K_per_mW
        self.below_apex_K_per_mW = contact_resistance(*self._below)
        self.spreading_K_per_mW = self.below_apex_K_per_mW - self.interface_K_per_mW
        self._air: AirBeside | None = None
        around = probe.surroundings
        if around.medium == "air":
            # near the contact the gap is always below the mean free path
            jump = around.with_jump.jump_length_um
            hot, cold = map(jump, (around.jump_temperature_K, self.base_temperature_K))
            away = max((around.surface_gap_um or 0.0) - tip.height_um, 0.0)
            self._air = AirBeside(around.gas_conductivity, hot, cold, away)

    @cached_property
    def _table(self) -> CubicSpline:
        """Heat at base and apex, rise of the apex, resistance of the cone, by the base's rise."""
        from scipy.interpolate import CubicSpline  # takes long, and few levers are in contact

        below = self.below_apex_K_per_mW
        above = cold_resistance(self._tip, self.base_temperature_K)
        # where nothing else conducts and the cone is cold, this is the rise at the base
        highest_K = 1500.0
        driving = _rises(highest_K)
        for _ in range(2):
            at_apex = driving / (1.0 + above / below)
            heat = driving / (below + above)
            base, air = self.base_temperature_K, self._air
            _, T, into_tip, cone = up_the_cone(self._tip, base + at_apex, heat, base, air)
            rise = T[-1] - base
            # a hot cone resists more: no more of the table than is of use
            driving = _rises(float(np.interp(highest_K, rise, driving)))
        return CubicSpline(rise, np.stack([into_tip[-1], heat, at_apex, cone[-1]], axis=1))

    def heat(self, rise: Array, names: Sequence[str] = ()) -> Evaluated:
        """Return the heat (mW) that enters the tip at rises (K) of its base.

        With its derivatives by the temperature, ``T``, and by numbers of the probe at the same
        rise: those of `names`, and zero by any others.
        """
        inside = np.clip(rise, self._table.x[0], self._table.x[-1])
        slope = self._table(inside, 1)[..., 0]
        value = self._table(inside)[..., 0] + slope * (rise - inside)
        by = {name: self._by(name, lambda law: law.heat(rise)[0], value) for name in names}
        return value, {**by, "T": slope}

    def at(self, tip_K: Array) -> AtTheContact:
        """Return where heat goes at temperatures (K) of the tip's base."""
        into_tip, heat, apex, cone = np.moveaxis(
            self._table(np.asarray(tip_K) - self.base_temperature_K), -1, 0
        )
        surface = self.spreading_K_per_mW * heat
        base = self.base_temperature_K
        return AtTheContact(base + apex, base + surface, heat, into_tip - heat, cone)

    def log_odds(self, rise: Array, names: Sequence[str] = ()) -> Evaluated:
        """Return how rises (K) of the tip's base are divided, (n,): at apex and surface, (2, n).

        It is the logarithm of how much warmer than the base temperature each is over how much
        colder than the tip: that of a ratio of resistances, which go as powers of what is unknown.
        With its derivatives by ``T`` and by numbers of the probe at the same rise, zero by those on
        which the law does not depend.
        """
        # the ratio of a tip that is hardly warm is that of one that is a little warmer
        least_K = 1.0
        warm = np.maximum(rise, least_K)

        def odds(law: ContactLaw, more: float = 1.0) -> Array:
            tip = more * warm
            at = law.at(law.base_temperature_K + tip)
            risen = np.stack([at.apex_K, at.surface_K]) - law.base_temperature_K
            return np.asarray(np.log(risen / (tip - risen)))

        value = odds(self)
        by = {name: self._by(name, odds, value) for name in names}
        change = odds(self, 1.0 + self._step) - odds(self, 1.0 - self._step)
        return value, {**by, "T": np.where(rise > least_K, change / (2.0 * self._step * warm), 0.0)}

    def along_axis(self, tip_K: float, depth_um: Array) -> tuple[Array, Array, Array]:
        """Return heights (µm) on the cone, the temperatures (K) there, and those under its middle.

        By the temperature of the tip's base, and for depths (µm) in the sample, above zero.
        """
        apex, _, heat, *_ = self.at(np.array([tip_K]))
        height, T, *_ = up_the_cone(self._tip, apex, heat, self.base_temperature_K, self._air)
        rise = (apex - self.base_temperature_K) * axis_rise(*self._below, depth_um)
        return height, T[:, 0], self.base_temperature_K + rise

    @property
    def sum_by_interface(self) -> float:
        """How the sum of the resistances changes with that of the interface."""
        step = self._step * self.below_apex_K_per_mW
        more = self._changed(INTERFACE, self.interface_K_per_mW + step)
        return (more.below_apex_K_per_mW - self.below_apex_K_per_mW) / step

    @property
    def names(self) -> tuple[str, ...]:
        """The numbers of a probe on which the law depends."""
        return (
            INTERFACE,
            *("height_um", "half_angle_deg", "apex_radius_um", "base_temperature_K"),
            *(("gas_conductivity",) if self._air else ()),
        )

    def _by(self, name: str, what: Callable[[ContactLaw], Array], here: Array) -> Array:
        """Return how what something of the law is here changes with a number of the probe."""
        if name not in self.names:
            return np.zeros_like(here)
        (value,) = self._probe.values([name])
        step = self._step * (self.below_apex_K_per_mW if name == INTERFACE else value)
        # an interface may have none, and no less: by both sides further up, then
        ways = (0.0, 1.0, 2.0) if name == INTERFACE else (-1.0, 0.0, 1.0)
        low, middle, high = (what(self._changed(name, value + way * step)) for way in ways)
        slope = (high - low) / (2.0 * step)
        return np.asarray(slope - (high - 2.0 * middle + low) / step if ways[0] == 0.0 else slope)

    def _changed(self, name: str, value: float) -> ContactLaw:
        key = name, value
        if key not in self._others:
            self._others[key] = ContactLaw(self._probe.replace({name: value}))
        return self._others[key]


def _rises(highest: float) -> Array:
    """Return rises (K) at which the law is tabulated, zero among them."""
    cooler = np.linspace(-60.0, 0.0, 5, endpoint=False)
    return np.concatenate([cooler, np.linspace(0.0, highest, 115)])


@lru_cache(maxsize=16)
def contact_of(probe: Probe) -> ContactLaw | None:
    """Return the law of a probe's contact; None if it touches nothing."""
    return None if probe.contact is None else ContactLaw(probe)
