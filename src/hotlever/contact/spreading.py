"""Heat from a disc of one temperature, through an interface, into a sample of layers.

On the surface of a half-space a disc of radius a has the resistance 1/(4 κ a). In layers the
surface answers to a heat flux with the Hankel transform q̃(k) by the temperature z(k) q̃(k)/(κ₁ k),
where z is 1 for a half-space and follows from layer to layer. The flux is a sum of Zernike's radial
polynomials (Legendre's of 1 − 2r²/a²), whose transforms are Bessel functions over k, and the
temperature is uniform above the interface in the mean over each of them (Galerkin). The flux of an
ideal interface is infinite at the rim, where the polynomials leave 5e-5 of the resistance; with a
resistance of its own it is not, and they converge faster than any power.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hotlever.types import Array

#: Polynomials; where z is followed to, over the radius; points in each piece of it.
_TERMS, _FARTHEST, _POINTS = 48, 4000.0, 8
#: Pieces below one over the radius, and from where on.
_PIECES, _NEAREST = 80, 1e-6
#: Beyond this over its depth, a layer hides what is below it.
_DECAYED = 18.0


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
    # 1/(W/(m K) µm) is 1e6 K/W
    unit = 1e3 / (kappas[0] * radius_um)
    order = np.arange(_TERMS, dtype=float)
    system = _half_space(order)
    if len(thicknesses_um):
        system = system + _layers(order, kappas, np.array(thicknesses_um) / radius_um)
    interface = np.pi * interface_K_per_mW / unit
    system = system + np.diag(interface / (4.0 * order + 2.0))
    mean = np.linalg.solve(system, 0.5 * (order == 0))[0]
    return float(unit / (np.pi * mean))


def _half_space(order: Array) -> Array:
    """Return ∫ J₂ₘ₊₁ J₂ₙ₊₁ k⁻² dk, by Weber's and Schafheitlin's formula."""
    from scipy.special import gammaln

    total, apart = np.add.outer(order, order), np.subtract.outer(order, order)
    ratio = np.exp(gammaln(total + 0.5) - gammaln(total + 2.5))
    return np.asarray(ratio * np.cos(np.pi * apart) / (4.0 * np.pi * (0.25 - apart**2)))


def _layers(order: Array, kappas: Sequence[float], depths: Array) -> Array:
    """Return the same integral with z − 1, which falls exponentially."""
    from scipy.special import jv

    farthest = min(_FARTHEST, max(1.0, _DECAYED / depths[0]))
    near = np.append(0.0, np.geomspace(_NEAREST / max(1.0, depths.sum()), 1.0, _PIECES))
    edges = np.concatenate([near, np.linspace(1.0, farthest, int(farthest / 2.0) + 2)[1:]])
    nodes, weights = np.polynomial.legendre.leggauss(_POINTS)
    half = np.diff(edges)[:, None] / 2.0
    k = (edges[:-1, None] + half * (1.0 + nodes)).ravel()
    differs = (half * weights).ravel() * (_surface(k, kappas, depths) - 1.0)
    transforms = jv(2 * order[:, None] + 1, k) / k
    return np.asarray((transforms * differs) @ transforms.T)


def _surface(k: Array, kappas: Sequence[float], depths: Array) -> Array:
    """Return z(k): the surface's temperature by its flux, over that of a half-space of layer 1."""
    z = np.ones_like(k)
    for above, below, depth in zip(kappas[-2::-1], kappas[:0:-1], depths[::-1], strict=True):
        ratio, fall = above / below * z, np.tanh(k * depth)
        z = (ratio + fall) / (1.0 + ratio * fall)
    return z
