"""Heat that the air around a lever takes up, in the equations of a lever in time.

Air at rest lets through the heat of `hotlever.lever.air_loss`; what it takes up besides is in the
stores of `hotlever.air.stores`. They are made for the slowest modes of heat conduction in the plane
of the lever, and driven by its rise of temperature with the properties of cold air. For what is
taken up is, by the rise of the temperature, √(κ ρ c_p): with the pressure constant the air expands
as it is heated, and in a coordinate that goes with its mass it diffuses with κρ, which hardly
depends on the temperature (C. R. Illingworth, Proc. Camb. Phil. Soc. 46, 603 (1950)).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from hotlever.air.stores import AirStores
from hotlever.types import Array


class HeatInAir:
    """Stores of heat in air, between the unknowns of a lever.

    Parameters
    ----------
    stores : AirStores
    coordinates : ndarray, shape (m, size + 1)
        From the unknowns to the shares of the modes in the rise of the temperature (K).
    whole, at_ends : ndarray, shape (m,)
        What the heat of each mode is in all, and tested with the function of the leg ends (µm²).
    conductivity, capacity : float
        Of the cold air (mW/(K µm) and nJ/(K µm³)).

    Attributes
    ----------
    size : int
        Number of temperatures in the air: one for each mode in each store.
    rates : ndarray, shape (size, 1)
        At which they follow the lever (1/µs).
    """

    def __init__(
        self,
        stores: AirStores,
        coordinates: Array,
        whole: Array,
        at_ends: Array,
        conductivity: float,
        capacity: float,
    ) -> None:
        self._stores, self.coordinates = stores, coordinates
        self._whole, self._at_ends = whole, at_ends
        self._conductivity, self._capacity = conductivity, capacity
        self._count = len(coordinates)
        self._volumes = stores.conductances / stores.rates[:, None, None]
        self.size = stores.rates.size * self._count
        self.rates = np.repeat(conductivity / capacity * stores.rates, self._count)[:, None]

    def in_gas(self, conductivity: float) -> HeatInAir:
        """Return the same in a gas that conducts so many times as well as air."""
        return self._made(conductivity=conductivity * self._conductivity)

    def _made(self, **changes: Any) -> HeatInAir:
        own: dict[str, Any] = {
            "stores": self._stores,
            "coordinates": self.coordinates,
            "whole": self._whole,
            "at_ends": self._at_ends,
            "conductivity": self._conductivity,
            "capacity": self._capacity,
        }
        return HeatInAir(**(own | changes))

    def between(self, changes: Array) -> tuple[HeatInAir, Array]:
        """Return the same between fewer unknowns, each a change (size + 1, n) of these.

        Exact: what they do not excite is left out. With it comes what its modes are of ours.
        """
        shares, rest = np.linalg.qr(self.coordinates @ changes)

        def seen(matrices: Array) -> Array:
            return np.asarray(shares.T @ matrices @ shares)

        one = self._stores
        stores = AirStores(one.rates, seen(one.conductances), seen(one.volume), seen(one.bound))
        reduced = self._made(
            stores=stores,
            coordinates=rest,
            whole=shares.T @ self._whole,
            at_ends=shares.T @ self._at_ends,
        )
        return reduced, shares

    def follows(self, x: Array) -> Array:
        """Return the temperatures to which the stores tend, (size, n), for states of the lever."""
        return np.tile(self._shares(x), (self._stores.rates.size, 1))

    def held(self, x: Array, in_air: Array) -> Array:
        """Return the heat in the air (nJ) by mode, (m, n), for the temperatures of its stores."""
        many = in_air.reshape(self._stores.rates.size, self._count, -1)
        heat = np.einsum("kij,kjn->in", self._volumes, many)
        return self._capacity * (heat + self._stores.volume @ self._shares(x))

    def _shares(self, x: Array) -> Array:
        return np.asarray(self.coordinates @ x)

    def tested(self, by_mode: Array) -> Array:
        """Return heat by mode (m, n) as the weak equations test it, (size + 1, n)."""
        return np.asarray(self.coordinates.T @ by_mode)

    def heat(self, by_mode: Array) -> tuple[Array, Array]:
        """Return all of the heat, and its part that is tested at the leg ends, for heat by mode."""
        return np.asarray(self._whole @ by_mode), np.asarray(self._at_ends @ by_mode)

    def taken_up(self, rate: Any) -> NDArray[Any]:
        """Return what is taken up (mW/K) where things change as exp(rate × t), (m, m).

        The rate (1/µs) is complex where they oscillate.
        """
        stores, own = self._stores, self.rates[:: self._count, 0]
        lagging = np.tensordot(rate * own / (rate + own), self._volumes, axes=1)
        return np.asarray(self._capacity * (lagging + rate * stores.volume))

    def lagging(self, in_air: Array, rate: float) -> Array:
        """Return the heat by mode, (m, n), in stores that settle at a rate (1/µs) to what is given.

        That is ``(rate + rates) × temperatures = given``.
        """
        many = (in_air / (rate + self.rates)).reshape(-1, self._count, in_air.shape[1])
        return np.asarray(self._capacity * np.einsum("kij,kjn->in", self._volumes, many))

    def settled(self, before: Array, after: Array, period: float) -> Array:
        """Return what temperatures in the air (size, 1) tend to, were each period (µs) the same.

        Given are those before and after one period.
        """
        left = np.exp(-self.rates * period)
        return (after - left * before) / -np.expm1(-self.rates * period)

    def bound(self, rate: float) -> Array:
        """Return the heat capacity (nJ/K) that seems to go with a lever that decays at a rate.

        Of the air the answer has a cut there: this is its mean over both sides, (m, m).
        """
        own = self.rates[:: self._count, 0]
        at = np.interp(np.log(rate), np.log(own), np.arange(own.size))
        low = min(int(at), own.size - 2)
        bound = self._stores.bound
        return self._capacity * ((low + 1 - at) * bound[low] + (at - low) * bound[low + 1])
