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
#: Depth of a layer that has no end, over the radius.
_BOTTOMLESS = 1e12
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
    odd: Array = 2.0 * np.arange(_TERMS, dtype=float) + 1.0
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
) -> tuple[Array, float]:
    """Return the polynomials of the flux, over the rise of the disc, and 1/(κ₁ a) (K/mW)."""
    # 1/(W/(m K) µm) is 1e6 K/W
    unit = 1e3 / (kappas[0] * radius_um)
    order = np.arange(_TERMS, dtype=float)
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
    farthest = min(_FARTHEST, max(1.0, _DECAYED / depths[0]))
    near = np.append(0.0, np.geomspace(_NEAREST / max(1.0, depths.sum()), 1.0, _PIECES))
    edges = np.concatenate([near, np.linspace(1.0, farthest, int(farthest / 2.0) + 2)[1:]])
    nodes, weights = np.polynomial.legendre.leggauss(_POINTS)
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
    for number, depth in enumerate([*depths, _BOTTOMLESS]):
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
