"""Heat along the cone of a tip, from its flat end up to the lever, and from its side to the sample.

In one dimension, through spherical shells about the point of the cone, as heat spreads in one; with
the conductivity of a wire of the local diameter. Air between the side and the sample conducts along
arcs about the edge of the contact: for a sharp cone, whose arcs are circles about the apex, that is
exact. Temperatures jump at both surfaces, and near the contact it is the jumps that limit the heat.
The lever's own surface is a plate above the sample, and near it the cone adds nothing to what that
plate gives: of the arcs at the height z above the sample, with the plate at H, a share
(1 − z/H)^1.5 counts, whose exponent is fitted to meshes of cone, plate and air
(``benchmarks/contact_3d.py``). Of a cone of height h away from the sample it is less by
(h/H)^1.5: a small one hardly changes what flows between plates.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from hotlever.materials.air import kirchhoff_variable
from hotlever.materials.thin_silicon import MEAN_FREE_PATH_UM, thermal_conductivity_of_wire
from hotlever.probe.tip import Tip
from hotlever.types import Array
from hotlever.units import PER_CM_TO_MILLI_PER_UM

#: Steps up the cone, evenly spaced in the logarithm of the distance: with them temperature and heat
#: are within 5e-6 in vacuum, and within 3e-5 in air, whose share bends where the cone ends.
_STEPS, _STEPS_IN_AIR = 48, 96
#: Nodes along an arc.
_NODES = 16
#: Exponent of the share of the arcs that counts beyond the lever's own surface.
_BEYOND = 1.5


class AirBeside(NamedTuple):
    """The air between the side of a tip and the sample."""

    gas_conductivity: float  #: over that of air
    jump_um: float  #: temperature jump length at the tip
    jump_at_sample_um: float
    distance_um: float = 0.0  #: from the flat end to the sample

    def conductance(self, tip: Tip, height_um: Array) -> Array:
        """Return the heat that passes per height (µm) and θ: a number for each height.

        It is what passes beyond what the lever's own surface gives, a plate above the sample.
        """
        half_angle = math.radians(tip.half_angle_deg)
        nodes, weights = np.polynomial.legendre.leggauss(_NODES)
        width = (math.pi / 2.0 - half_angle) / 2.0
        angles = half_angle + width * (1.0 + nodes)
        above, whole = height_um + self.distance_um, tip.height_um + self.distance_um
        away, end = above / math.cos(half_angle), tip.apex_radius_um
        along = away * (width * weights / (end + away[..., None] * np.sin(angles))).sum(axis=-1)
        jumps = self.jump_um / (end + away * math.sin(half_angle))
        jumps = jumps + self.jump_at_sample_um / (end + away)
        left = np.clip(1.0 - above / whole, 0.0, 1.0)
        beyond = (left * tip.height_um / whole) ** _BEYOND
        return np.asarray(2.0 * math.pi / math.cos(half_angle) * beyond / (along + jumps))


def up_the_cone(
    tip: Tip,
    apex_K: Array,
    apex_mW: Array,
    base_temperature_K: float,
    air: AirBeside | None = None,
) -> tuple[Array, Array, Array]:
    """Return temperature (K) and heat (mW) where a cone meets the lever, by those at its flat end.

    And the resistance of the cone (K/mW), which what its side gives does not change but by κ(T).

    Heat flows down. What its side gives to the air goes to the sample, which is at the base
    temperature.

    Parameters
    ----------
    tip : Tip
    apex_K, apex_mW : ndarray, shape (n,)
    base_temperature_K : float
    air : AirBeside, optional
        None in vacuum.
    """
    T, heat, resistance = _climbed(tip, apex_K, apex_mW, base_temperature_K, air)[1][-1]
    return T, heat, resistance


def along_the_cone(
    tip: Tip,
    apex_K: float,
    apex_mW: float,
    base_temperature_K: float,
    air: AirBeside | None = None,
) -> tuple[Array, Array]:
    """Return heights (µm) from the flat end up to the lever, and the temperatures (K) there."""
    ends = np.array([apex_K]), np.array([apex_mW])
    height, states = _climbed(tip, *ends, base_temperature_K, air)
    return height, np.array([T for (T,), *_ in states])


def _climbed(
    tip: Tip, apex_K: Array, apex_mW: Array, base_temperature_K: float, air: AirBeside | None
) -> tuple[Array, list[Array]]:
    """Return heights (µm) up the cone; temperatures, heats, resistances below at each of them."""
    # the radius and, where air matters, the jumps set the scale of what happens near the end
    scale, steps = tip.apex_radius_um, _STEPS if air is None else _STEPS_IN_AIR
    position = np.linspace(0.0, math.log1p(tip.height_um / scale), 2 * steps + 1)
    height = scale * np.expm1(position)
    per_step = (height + scale) * (position[-1] / steps)
    radius = tip.apex_radius_um + tip.slope * height
    area = _shell(tip) * math.pi * radius**2
    lost = None if air is None else air.conductance(tip, height)

    def slopes(at: int, state: Array) -> Array:
        T, heat, _ = state
        kappa, _ = thermal_conductivity_of_wire(T, 2.0 * radius[at])
        resistance = 1.0 / (PER_CM_TO_MILLI_PER_UM * kappa * area[at])
        more = np.zeros_like(heat)
        if air is not None and lost is not None:
            theta, _ = kirchhoff_variable(T, base_temperature_K)
            more = PER_CM_TO_MILLI_PER_UM * air.gas_conductivity * lost[at] * theta
        return np.asarray(per_step[at] * np.stack([heat * resistance, more, resistance]))

    state = np.stack([apex_K, apex_mW, np.zeros_like(apex_K)])
    states = [state]
    for at in range(0, 2 * steps, 2):  # classical Runge-Kutta
        first = slopes(at, state)
        second = slopes(at + 1, state + first / 2.0)
        third = slopes(at + 1, state + second / 2.0)
        state = state + (first + 2.0 * (second + third) + slopes(at + 2, state + third)) / 6.0
        states.append(state)
    return height[::2], states


def _shell(tip: Tip) -> float:
    """Return the area of a shell for each height between shells, over that of the cone's slice."""
    cosine = math.cos(math.radians(tip.half_angle_deg))
    return 2.0 * cosine / (1.0 + cosine)


def cold_resistance(tip: Tip, T: float) -> float:
    """Return the resistance of a cone (K/mW) all of which is at one temperature (K), in vacuum.

    In closed form: with a bulk of conductivity κ and what the surface adds to 1/κ, in proportion
    to 1/d.

    Examples
    --------
    >>> tip = Tip(height_um=0.7, half_angle_deg=20, apex_radius_um=0.005)
    >>> round(cold_resistance(tip, 300.0))
    20389
    """
    end, base = tip.apex_radius_um, tip.base_radius_um
    bulk, cold = (float(thermal_conductivity_of_wire(K, math.inf)[0]) for K in (T, 300.0))
    by_bulk = (1.0 / end - 1.0 / base) / bulk
    by_surface = MEAN_FREE_PATH_UM / (4.0 * cold) * (1.0 / end**2 - 1.0 / base**2)
    return (by_bulk + by_surface) / (PER_CM_TO_MILLI_PER_UM * math.pi * tip.slope * _shell(tip))
