"""Heat that the air around a lever takes up, as stores that lag behind it.

What leaves a body for air at rest is Y(0) θ. Where θ changes as exp(st) it is Y(s) θ, of the single
layer with the kernel exp(−qR)/(4πR), q² = s/α (`hotlever.air.screened_layer`): for a sphere of
radius a, 4πa(1 + qa). Air without an end answers along a cut of the complex plane::

    Y(s) − Y(0) = ∫ s/(s + p) Im Y(−p + i0)/π dp/p

with Im Y positive semi-definite, since −Im exp(−ikR)/R = sin(kR)/R is. Over ln p the integrand is
smooth, so that the trapezoidal rule converges exponentially: a few stores, each of which takes up
heat through a conductance at a rate of its own. Nothing is fitted, and no store can give more than
it took. What would answer faster than all stores is a heat capacity that goes with the lever.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hotlever.air.operator import PanelledAir
from hotlever.types import Array

#: Of the wave numbers of the stores, times the length of the lever: the lowest, and how many times
#: it is doubled. Shorter waves than the highest would need finer panels, and matter to nothing:
#: the lever itself holds a thousand times as much heat as air that is so near.
_LOWEST, _DOUBLED = 0.1, 9
#: Where the heat capacity is read off, as a share of the highest wave number.
_READ_OFF = 0.25


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
    waves: Array = _LOWEST / length_um * np.power(2.0, np.arange(_DOUBLED + 1))
    still, some = panelled.admittances(np.array([1e-9, _READ_OFF]) * waves[-1], shapes)
    found = panelled.admittances(1j * waves, shapes)
    rates = np.square(waves)
    conductances = np.log(4.0) / np.pi * np.array([_positive(one) for one in found.imag])
    # all that is slower goes as √p, and adds up as a geometric series
    conductances[0] *= 2.0
    at = (_READ_OFF * waves[-1]) ** 2
    slower = np.tensordot(at / (at + rates), conductances, axes=1)
    bound = (still - found.real) / rates[:, None, None]
    return AirStores(
        rates, conductances, _positive((some - still - slower) / at - inside), bound - inside
    )


def _positive(matrix: Array) -> Array:
    """Return a symmetric matrix without what rounding and quadrature made negative of it."""
    values, vectors = np.linalg.eigh(matrix)
    return np.asarray((vectors * np.maximum(values, 0.0)) @ vectors.T)
