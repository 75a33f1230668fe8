"""What a tip in contact takes from its lever, by the temperature at its base: one law.

Resistances in series: the cone, the interface, and spreading in the sample; and air beside the
cone. Heat flows as at rest: the cone follows within 0.1 µs, and the sample within the time in which
heat spreads over a few radii, or through the films.

Heat goes along the cone in one dimension, through spherical shells about its point, as heat spreads
in one; with the conductivity of a wire of the local diameter. Air between the side and the sample
conducts along arcs about the edge of the contact: for a sharp cone, whose arcs are circles about
the apex, that is exact. Temperatures jump at both surfaces, and near the contact it is the jumps
that limit the heat. The lever's own surface is a plate above the sample, and near it the cone adds
nothing to what that plate gives: of the arcs at the height z above the sample, with the plate at H,
a share (1 − z/H)^1.5 counts, whose exponent is fitted to meshes of cone, plate and air
(``benchmarks/contact.py``). Of a cone of height h away from the sample it is less by (h/H)^1.5:
a small one hardly changes what flows between plates.

Into the sample, which has layers, it goes from a disc of one temperature through an interface. On
the surface of a half-space a disc of radius a has the resistance 1/(4 κ a). In layers the surface
answers to a heat flux with the Hankel transform q̃(k) by the temperature z(k) q̃(k)/(κ₁ k), where z
is 1 for a half-space and follows from layer to layer. The flux is a sum of Zernike's radial
polynomials (Legendre's of 1 − 2r²/a²), whose transforms are Bessel functions over k, and the
temperature is uniform above the interface in the mean over each of them (Galerkin). The flux of an
ideal interface is infinite at the rim, where the polynomials leave 5e-5 of the resistance; with a
resistance of its own it is not, and they converge faster than any power.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hotlever.materials.air import kirchhoff_variable
from hotlever.materials.heat import MEAN_FREE_PATH_UM, thermal_conductivity_of_wire
from hotlever.materials.laws import Evaluated
from hotlever.probe import Probe
from hotlever.probe.tip import Tip
from hotlever.types import Array
from hotlever.units import PER_CM_TO_MILLI_PER_UM

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline


# --- the cone -------------------------------------------------------------------------------------


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
        nodes, weights = np.polynomial.legendre.leggauss(16)
        width = (math.pi / 2.0 - half_angle) / 2.0
        angles = half_angle + width * (1.0 + nodes)
        above, whole = height_um + self.distance_um, tip.height_um + self.distance_um
        away, end = above / math.cos(half_angle), tip.apex_radius_um
        along = away * (width * weights / (end + away[..., None] * np.sin(angles))).sum(axis=-1)
        jumps = self.jump_um / (end + away * math.sin(half_angle))
        jumps = jumps + self.jump_at_sample_um / (end + away)
        left = np.clip(1.0 - above / whole, 0.0, 1.0)
        beyond = (left * tip.height_um / whole) ** 1.5
        return np.asarray(2.0 * math.pi / math.cos(half_angle) * beyond / (along + jumps))


def up_the_cone(
    tip: Tip,
    apex_K: Array,
    apex_mW: Array,
    base_temperature_K: float,
    air: AirBeside | None = None,
) -> tuple[Array, Array, Array, Array]:
    """Return heights (µm) from the flat end up to the lever, (k,), and what is there, (k, n) each.

    Temperature (K), heat (mW) and the resistance of the cone below (K/mW), which what its side
    gives does not change but by κ(T). Heat flows down. What the side gives to the air goes to the
    sample, which is at the base temperature.

    Parameters
    ----------
    tip : Tip
    apex_K, apex_mW : ndarray, shape (n,)
    base_temperature_K : float
    air : AirBeside, optional
        None in vacuum.
    """
    # the radius and, where air matters, the jumps set the scale of what happens near the end; with
    # so many steps, even in the logarithm of the distance, temperature and heat are within 5e-6 in
    # vacuum, and within 3e-5 in air, whose share bends where the cone ends
    scale, steps = tip.apex_radius_um, 48 if air is None else 96
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
    T, heat, resistance = np.stack(states, axis=1)
    return height[::2], T, heat, resistance


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


# --- the sample -----------------------------------------------------------------------------------


def contact_resistance(
    radius_um: float,
    kappas: Sequence[float],
    thicknesses_um: Sequence[float] = (),
    interface_K_per_mW: float = 0.0,
) -> float:
    """Return the thermal resistance (K/mW) from a disc of one temperature into layers.

    Parameters
    ----------
    radius_um : float
    kappas : sequence of float
        From the top (W m⁻¹ K⁻¹).
    thicknesses_um : sequence of float
        Of all but the last, which has no end.
    interface_K_per_mW : float
        Resistance between disc and sample, the same everywhere on it.

    Examples
    --------
    1/(4 κ a) is 2.5e8 K/W, and a flux that an interface makes uniform meets 8 % more:

    >>> [round(contact_resistance(0.005, [0.2], (), by) - by) for by in (0.0, 1e8)]
    [250013, 270180]
    """
    flux, unit = _flux(radius_um, kappas, thicknesses_um, interface_K_per_mW)
    return float(unit / (np.pi * flux[0]))


def axis_rise(
    radius_um: float,
    kappas: Sequence[float],
    thicknesses_um: Sequence[float],
    interface_K_per_mW: float,
    depth_um: Array,
) -> Array:
    """Return the rise of the temperature under the middle of the disc, over that of the disc.

    Parameters are those of `contact_resistance`, and depths (µm) above zero.

    Examples
    --------
    On a half-space it is (2/π) arctan(a/z):

    >>> axis_rise(0.005, [0.2], (), 0.0, np.array([0.005, 0.05])).round(3)
    array([0.5  , 0.063])
    """
    depths = np.array(thicknesses_um) / radius_um
    at = np.asarray(depth_um) / radius_um
    flux, _ = _flux(radius_um, kappas, thicknesses_um, interface_K_per_mW)
    odd: Array = 2.0 * np.arange(flux.size, dtype=float) + 1.0
    # in a half-space each polynomial has a closed form, and so has what is left of it at the top
    rise = ((np.sqrt(1.0 + at**2) - at)[:, None] ** odd / odd) @ flux
    if len(depths):
        k, weights = _wavenumbers(depths)
        answers = _fall(k, kappas, depths, at) - np.exp(-np.multiply.outer(at, k))
        rise = rise + answers @ (weights / k * (flux @ _bessel(odd, k)))
    return np.asarray(rise)


def _flux(
    radius_um: float,
    kappas: Sequence[float],
    thicknesses_um: Sequence[float],
    interface_K_per_mW: float,
    count: int = 48,
) -> tuple[Array, float]:
    """Return so many polynomials of the flux, over the rise of the disc, and 1/(κ₁ a) (K/mW)."""
    # 1/(W/(m K) µm) is 1e6 K/W
    unit = 1e3 / (kappas[0] * radius_um)
    order = np.arange(count, dtype=float)
    system = _half_space(order)
    if len(thicknesses_um):
        system = system + _layers(order, kappas, np.array(thicknesses_um) / radius_um)
    interface = np.pi * interface_K_per_mW / unit
    system = system + np.diag(interface / (4.0 * order + 2.0))
    return np.linalg.solve(system, 0.5 * (order == 0)), unit


def _half_space(order: Array) -> Array:
    """Return ∫ J₂ₘ₊₁ J₂ₙ₊₁ k⁻² dk, by Weber's and Schafheitlin's formula."""
    from scipy.special import gammaln

    total, apart = np.add.outer(order, order), np.subtract.outer(order, order)
    ratio = np.exp(gammaln(total + 0.5) - gammaln(total + 2.5))
    return np.asarray(ratio * np.cos(np.pi * apart) / (4.0 * np.pi * (0.25 - apart**2)))


def _layers(order: Array, kappas: Sequence[float], depths: Array) -> Array:
    """Return the same integral with z − 1, which falls exponentially."""
    k, weights = _wavenumbers(depths)
    transforms = _bessel(2.0 * order + 1.0, k) / k
    differs = weights * (_impedances(k, kappas, depths)[0] - 1.0)
    return np.asarray((transforms * differs) @ transforms.T)


def _bessel(order: Array, k: Array) -> Array:
    from scipy.special import jv

    return np.asarray(jv(order[:, None], k))


def _wavenumbers(depths: Array) -> tuple[Array, Array]:
    """Return nodes and weights of an integral over k whose integrand the first layer ends."""
    # k is over the radius, and beyond 18 over its depth a layer hides what is below it
    farthest = min(4000.0, max(1.0, 18.0 / depths[0]))
    near = np.append(0.0, np.geomspace(1e-6 / max(1.0, depths.sum()), 1.0, 80))
    edges = np.concatenate([near, np.linspace(1.0, farthest, int(farthest / 2.0) + 2)[1:]])
    nodes, weights = np.polynomial.legendre.leggauss(8)
    half = np.diff(edges)[:, None] / 2.0
    return (edges[:-1, None] + half * (1.0 + nodes)).ravel(), (half * weights).ravel()


def _impedances(k: Array, kappas: Sequence[float], depths: Array) -> list[Array]:
    """Return z(k) at the top of each layer, over that of a half-space of that layer.

    It is the temperature there by the flux.
    """
    tops = [np.ones_like(k)]
    for above, below, depth in zip(kappas[-2::-1], kappas[:0:-1], depths[::-1], strict=True):
        ratio, fall = above / below * tops[0], np.tanh(k * depth)
        tops.insert(0, (ratio + fall) / (1.0 + ratio * fall))
    return tops


def _fall(k: Array, kappas: Sequence[float], depths: Array, at: Array) -> Array:
    """Return the temperature at depths, (n, k), by the flux into a half-space of layer 1.

    In a layer what falls with the depth below its top is sent back in part by what is below.
    """
    tops = _impedances(k, kappas, depths)
    answer, top, edge = np.empty((at.size, k.size)), tops[0], 0.0
    # the last layer has no end
    for number, depth in enumerate([*depths, 1e12]):
        back = np.zeros_like(k)
        if number < len(depths):
            ratio = kappas[number] / kappas[number + 1] * tops[number + 1]
            back = (ratio - 1.0) / (ratio + 1.0)
        inside = (edge <= at) & (at <= edge + depth)
        below = np.append(at[inside] - edge, depth)[:, None]
        rises = np.exp(-k * below) + back * np.exp(k * (below - 2.0 * depth))
        rises *= top / (1.0 + back * np.exp(-2.0 * k * depth))
        answer[inside], top, edge = rises[:-1], rises[-1], edge + depth
    return answer


# --- the law --------------------------------------------------------------------------------------

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
