"""Spreading of heat from a disc of one temperature into a sample of layers.

On the surface of a half-space a disc of radius a has the resistance 1/(4 κ a). In layers the
surface answers to a heat flux with the Hankel transform q̃(k) by the temperature z(k) q̃(k)/(κ₁ k),
where z is 1 for a half-space and follows from layer to layer. With the flux of the disc as
∫ φ(t) cos(kt) dt, t from 0 to a, no heat passes outside the disc, and its temperature is uniform if
φ + (2/π) ∫∫ (z − 1) cos(kx) cos(kt) φ(t) dt dk is (I. N. Sneddon, Mixed Boundary Value Problems in
Potential Theory (1966), dual integral equations of Titchmarsh's type). Even Legendre polynomials
for φ make spherical Bessel functions of it, and a small symmetric system.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hotlever.types import Array

#: Polynomials; where z is followed to, over the radius; points in each piece of it.
_TERMS, _FARTHEST, _POINTS = 24, 4000.0, 8
#: Pieces below one over the radius, and from where on.
_PIECES, _NEAREST = 80, 1e-6
#: A layer is thick where z differs from 1 by less than e to the minus this.
_DECAYED = 40.0


def spreading_resistance(
    radius_um: float, kappas: Sequence[float], thicknesses_um: Sequence[float]
) -> float:
    """Return the thermal resistance (K/mW) from a disc of one temperature into layers.

    Parameters
    ----------
    radius_um : float
    kappas : sequence of float
        From the top (W m⁻¹ K⁻¹).
    thicknesses_um : sequence of float
        Of all but the last, which has no end.

    Examples
    --------
    >>> round(spreading_resistance(0.005, [0.2], []), 6)  # 1/(4 κ a) = 2.5e8 K/W
    250000.0
    """
    # 1/(W/(m K) µm) is 1e6 K/W
    half_space = 1e3 / (4.0 * kappas[0] * radius_um)
    if not thicknesses_um:
        return half_space
    from scipy.special import spherical_jn

    depths = np.array(thicknesses_um) / radius_um
    farthest = min(_FARTHEST, max(1.0, _DECAYED / depths[0]))
    near = np.append(0.0, np.geomspace(_NEAREST / max(1.0, depths.sum()), 1.0, _PIECES))
    edges = np.concatenate([near, np.linspace(1.0, farthest, int(farthest) + 1)[1:]])
    nodes, weights = np.polynomial.legendre.leggauss(_POINTS)
    half = np.diff(edges)[:, None] / 2.0
    k = (edges[:-1, None] + half * (1.0 + nodes)).ravel()
    differs = (half * weights).ravel() * (_surface(k, kappas, depths) - 1.0)
    order = np.arange(_TERMS)
    j = np.stack([(-1.0) ** n * spherical_jn(2 * n, k) for n in order])
    system = (2.0 / np.pi) * (j * differs) @ j.T + np.diag(1.0 / (4.0 * order + 1.0))
    unit = (order == 0).astype(float)
    # the heat is the mean of φ, 1 for the half-space
    return half_space / float(np.linalg.solve(system, unit)[0])


def _surface(k: Array, kappas: Sequence[float], depths: Array) -> Array:
    """Return z(k): the surface's temperature by its flux, over that of a half-space of layer 1."""
    z = np.ones_like(k)
    for above, below, depth in zip(kappas[-2::-1], kappas[:0:-1], depths[::-1], strict=True):
        ratio, fall = above / below * z, np.tanh(k * depth)
        z = (ratio + fall) / (1.0 + ratio * fall)
    return z
