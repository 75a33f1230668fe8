"""Heat that the air around a lever takes up, as stores that lag behind it.

Air at rest lets heat through (`hotlever.air.operator`): what leaves a body is Y(0) θ. Where θ
changes as exp(st) it is Y(s) θ, of the single layer with the kernel exp(−qR)/(4πR), q² = s/α
(`hotlever.air.single_layer`): for a sphere of radius a, 4πa(1 + qa). Air without an end answers
along a cut of the complex plane::

    Y(s) − Y(0) = ∫ s/(s + p) Im Y(−p + i0)/π dp/p

with Im Y positive semi-definite, since −Im exp(−ikR)/R = sin(kR)/R is. Over ln p the integrand is
smooth, so that the trapezoidal rule converges exponentially: a few stores, each of which takes up
heat through a conductance at a rate of its own. Nothing is fitted, and no store can give more than
it took. What would answer faster than all stores is a heat capacity that goes with the lever.

Stores are made for the slowest modes of heat conduction in the plane of the lever, and driven by
its rise of temperature with the properties of cold air. For what is taken up is, by the rise of the
temperature, √(κ ρ c_p): with the pressure constant the air expands as it is heated, and in a
coordinate that goes with its mass it diffuses with κρ, which hardly depends on the temperature
(C. R. Illingworth, Proc. Camb. Phil. Soc. 46, 603 (1950)).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hotlever.air.operator import PanelledAir
from hotlever.types import Array, Index


@dataclass(frozen=True)
class AirStores:
    """Stores of heat in the air, for some shapes of θ on a lever.

    Attributes
    ----------
    rates : ndarray, shape (k,)
        Of the stores, over the diffusivity of the air (1/µm²).
    conductances : ndarray, shape (k, m, m)
        Between the shapes and each store, over the conductivity (µm).
    volume : ndarray, shape (m, m)
        Of the air that follows the lever at once (µm³).
    bound : ndarray, shape (k, m, m)
        Of the air (µm³) that seems to go with a lever that cools at each of the rates.
    """

    rates: Array
    conductances: Array
    volume: Array
    bound: Array


def stores_of(panelled: PanelledAir, shapes: Array, inside: Array, length_um: float) -> AirStores:
    """Return the stores around a lever.

    Parameters
    ----------
    panelled : PanelledAir
    shapes : ndarray, shape (sites, m)
        At the sites of its surface.
    inside : ndarray, shape (m, m)
        Their products integrated over the plate (µm³), which the single layer fills with air too.
    length_um : float
        Of the lever.
    """
    # shorter waves than the highest would need finer panels, and matter to nothing: the lever
    # itself holds a thousand times as much heat as air that is so near
    waves: Array = 0.1 / length_um * np.power(2.0, np.arange(9 + 1))
    # where the heat capacity is read off, as a share of the highest wave number
    read_off = 0.25
    still, some = panelled.admittances(np.array([1e-9, read_off]) * waves[-1], shapes)
    on_cut = panelled.admittances(1j * waves, shapes)
    rates = np.square(waves)
    conductances = np.log(4.0) / np.pi * np.array([_positive(matrix) for matrix in on_cut.imag])
    # all that is slower goes as √p, and adds up as a geometric series
    conductances[0] *= 2.0
    at = (read_off * waves[-1]) ** 2
    slower = np.tensordot(at / (at + rates), conductances, axes=1)
    bound = (still - on_cut.real) / rates[:, None, None]
    return AirStores(
        rates, conductances, _positive((some - still - slower) / at - inside), bound - inside
    )


def _positive(matrix: Array) -> Array:
    """Return a symmetric matrix without what rounding and quadrature made negative of it."""
    values, vectors = np.linalg.eigh(matrix)
    return np.asarray((vectors * np.maximum(values, 0.0)) @ vectors.T)


@dataclass(frozen=True)
class HeatInAir:
    """Stores of heat in air, between the unknowns of a lever.

    Attributes
    ----------
    stores : AirStores
    coordinates : ndarray, shape (m, size + 1)
        From the unknowns to the shares of the modes in the rise of the temperature (K).
    whole, at_ends : ndarray, shape (m,)
        What the heat of each mode is in all, and tested with the function of the leg ends (µm²).
    conductivity, capacity : float
        Of the cold air (mW/(K µm) and nJ/(K µm³)).

    """

    stores: AirStores
    coordinates: Array
    whole: Array
    at_ends: Array
    conductivity: float
    capacity: float

    @property
    def size(self) -> int:
        """Number of temperatures in the air: one for each mode in each store."""
        return self.stores.rates.size * len(self.coordinates)

    @cached_property
    def rates(self) -> Array:
        """Rates (1/µs) at which these temperatures follow the lever, (size, 1)."""
        return np.repeat(self._rates, len(self.coordinates))[:, None]

    @cached_property
    def _rates(self) -> Array:
        """Rates of the stores (1/µs)."""
        return self.conductivity / self.capacity * self.stores.rates

    @cached_property
    def _volumes(self) -> Array:
        """What each store holds, by modes (µm³), (stores, m, m)."""
        return np.asarray(self.stores.conductances / self.stores.rates[:, None, None])

    @cached_property
    def _between_rises(self) -> tuple[Index, Array]:
        """The unknowns that count, rises of the temperature, and their columns of coordinates."""
        rises = np.flatnonzero(self.coordinates.any(axis=0))
        return rises, np.ascontiguousarray(self.coordinates[:, rises])

    def shares(self, x: Array) -> Array:
        """Return the shares of the modes in states of the lever, (m, ...)."""
        rises, coordinates = self._between_rises
        return np.asarray(coordinates @ x[rises])

    @classmethod
    def nothing(cls, size: int) -> HeatInAir:
        """Return that of surroundings that take up nothing, for a lever of `size` unknowns."""
        none = np.empty(0)
        stores = AirStores(none, np.empty((0, 0, 0)), np.empty((0, 0)), np.empty((0, 0, 0)))
        return cls(stores, np.empty((0, size)), none, none, 1.0, 1.0)

    def in_gas(self, conductivity: float) -> HeatInAir:
        """Return the same in a gas that conducts so many times as well as air."""
        return replace(self, conductivity=conductivity * self.conductivity)

    def between(self, changes: Array) -> tuple[HeatInAir, Array]:
        """Return the same between fewer unknowns, each a change (size + 1, n) of these.

        Exact: what they do not excite is left out. With it comes what its modes are of ours.
        """
        shares, rest = np.linalg.qr(self.coordinates @ changes)

        def seen(matrices: Array) -> Array:
            return np.asarray(shares.T @ matrices @ shares)

        own = self.stores
        stores = AirStores(own.rates, seen(own.conductances), seen(own.volume), seen(own.bound))
        reduced = replace(
            self,
            stores=stores,
            coordinates=rest,
            whole=shares.T @ self.whole,
            at_ends=shares.T @ self.at_ends,
        )
        return reduced, shares

    def follows(self, x: Array) -> Array:
        """Return the temperatures to which the stores tend, (size, n), for states of the lever."""
        shares = self.shares(x)
        repeated = shares[None].repeat(len(self._rates), axis=0)
        return repeated.reshape(len(self._rates) * len(shares), *x.shape[1:])

    def held(self, x: Array, in_air: Array) -> Array:
        """Return the heat in the air (nJ) by mode, (m, n), for the temperatures of its stores."""
        heat = np.einsum("kij,kjn->in", self._volumes, self._by_store(in_air))
        return self.capacity * (heat + self.stores.volume @ self.shares(x))

    def tested(self, by_mode: Array) -> Array:
        """Return heat by mode (m, ...) as the weak equations test it, (size + 1, ...)."""
        rises, coordinates = self._between_rises
        weak = np.zeros((self.coordinates.shape[1], *by_mode.shape[1:]))
        weak[rises] = coordinates.T @ by_mode
        return weak

    def heat(self, by_mode: Array) -> tuple[Array, Array]:
        """Return all of the heat, and its part that is tested at the leg ends, for heat by mode."""
        return np.asarray(self.whole @ by_mode), np.asarray(self.at_ends @ by_mode)

    def taken_up(self, rate: Any) -> NDArray[Any]:
        """Return what is taken up (mW/K) where things change as exp(rate × t), (m, m).

        The rate (1/µs) is complex where they oscillate.
        """
        own, volume = self._rates, self.stores.volume
        lagging = np.tensordot(rate * own / (rate + own), self._volumes, axes=1)
        return np.asarray(self.capacity * (lagging + rate * volume))

    def lagging(self, in_air: Array, rate: float) -> Array:
        """Return the heat by mode, (m, n), in stores that settle at a rate (1/µs) to what is given.

        That is ``(rate + rates) × temperatures = in_air``.
        """
        many = self._by_store(in_air / (rate + self.rates))
        return np.asarray(self.capacity * np.einsum("kij,kjn->in", self._volumes, many))

    def _by_store(self, in_air: Array) -> Array:
        """Return temperatures (size, n) by store and mode, (stores, m, n)."""
        return in_air.reshape(len(self._rates), len(self.coordinates), in_air.shape[1])

    def cyclic(self, before: Array, after: Array, period: float) -> Array:
        """Return what temperatures in the air (size, 1) tend to, were each period (µs) the same.

        Given are those before and after one period.
        """
        left = np.exp(-self.rates * period)
        return (after - left * before) / -np.expm1(-self.rates * period)

    def bound(self, rate: float) -> Array:
        """Return the heat capacity (nJ/K) that seems to go with a lever that decays at a rate.

        Of the air the answer has a cut there: this is its mean over both sides, (m, m).
        """
        own = self._rates
        at = np.interp(np.log(rate), np.log(own), np.arange(own.size))
        low = min(int(at), own.size - 2)
        bound = self.stores.bound
        return self.capacity * ((low + 1 - at) * bound[low] + (at - low) * bound[low + 1])
