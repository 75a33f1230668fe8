"""Thermoelectricity: Seebeck coefficients of carriers by Fermi integrals, and of silicon.

With thermoelectricity the current density is −σ∇V − β∇T and the heat flux −κ₀∇T − T(β∇V + γ∇T),
where σ, β = Σ σ_i S_i and γ = Σ σ_i S_i² are sums over carriers that conduct beside each other. The
heat flux is −κ∇T + S T J with S = β/σ and κ = κ₀ + T(γ − β²/σ), whose last part is the bipolar one:
electrons and holes that carry heat without a current (G. S. Nolas, J. Sharp and H. J. Goldsmid,
Thermoelectrics, Springer 2001). Peltier and Thomson heat follow from the two fluxes.

Units are those of `hotlever.materials.silicon`; S is in V/K, β in A cm⁻¹ K⁻¹, γ in W cm⁻¹ K⁻².
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.polynomial.chebyshev import Chebyshev, chebpts1
from numpy.typing import ArrayLike

from hotlever.materials.laws import Evaluated, law
from hotlever.materials.silicon import (
    BOLTZMANN,
    Carried,
    Carrier,
    carried_in_n_silicon,
    carried_in_p_silicon,
    conducted,
    conductivity_high_doped,
    density_of_states,
)
from hotlever.piecewise import hermite_cubic
from hotlever.types import Array


class _Cubic(NamedTuple):
    """A function by cubics on even cells from 0 on, looked up without a search.

    The coefficients (4, cells) are those of a `Piecewise`.
    """

    cell: float
    coefficients: Array

    @classmethod
    def of(cls, function: Chebyshev) -> _Cubic:
        """Return a smooth function's, with its values and slopes at the ends of the cells."""
        ends, cell = np.linspace(0.0, function.domain[1], 2001, retstep=True)
        return cls(float(cell), hermite_cubic(ends, function(ends), function.deriv()(ends)).c)

    def __call__(self, w: Array) -> tuple[Array, Array]:
        """Return the function and its slope."""
        cell = np.minimum((w / self.cell).astype(np.intp), self.coefficients.shape[1] - 1)
        along = w - cell * self.cell
        d, c, b, a = (each[cell] for each in self.coefficients)
        value = a + along * (b + along * (c + along * d))
        return value, b + along * (2.0 * c + along * 3.0 * d)


@lru_cache(maxsize=64)
def _reduced_seebeck(scattering_exponent: float) -> tuple[_Cubic, _Cubic]:
    """Tabulate the reduced Seebeck coefficient of a parabolic band.

    It is S e/k_B in size plus the logarithm of the density, by w = ln(1 + density / that of
    states); and its derivative by the scattering exponent.

    With the relaxation time τ ∝ E^r it is the mean energy of the transport less the Fermi energy,
    both over k_B T: ⟨x⟩ − η, with weights x^(r + 3/2) (−∂f/∂x).
    """
    # x = exp(t − exp(−t)): both ends of the integrals fall faster than exponentially
    t, step = np.linspace(-4.0, 8.0, 6000, retstep=True)
    x = np.exp(t - np.exp(-t))
    measure = step * x * (1.0 + np.exp(-t))
    # up to 1e4 carriers for each state
    domain = 0.0, math.log1p(1e4)
    degree = 60
    nodes = 0.5 * (chebpts1(degree + 1) + 1.0) * domain[1]
    density = np.expm1(nodes)
    eta = _fermi_level(density, x, measure)
    weight = _edge(x, eta) * x ** (scattering_exponent + 1.5) * measure
    weight /= weight.sum(axis=-1, keepdims=True)
    log_x = np.log(x)
    mean, mean_log = weight @ x, weight @ log_x
    rows = mean - eta + np.log(density), weight @ (x * log_x) - mean * mean_log
    value, by_exponent = (Chebyshev.fit(nodes, row, degree, domain=domain) for row in rows)
    return _Cubic.of(value), _Cubic.of(by_exponent)


def _edge(x: Array, eta: Array) -> Array:
    """Return −∂f/∂x of the Fermi function, (levels, points)."""
    return 0.25 / np.cosh(np.clip(0.5 * (x - eta[:, None]), -300.0, 300.0)) ** 2


def _fermi_level(density: Array, x: Array, measure: Array) -> Array:
    """Return η with F½(η) = density, in units of the density of states; by Newton's method."""
    # Joyce and Dixon's first term, and the degenerate limit
    eta = np.log(density) + density / math.sqrt(8.0)
    eta = np.minimum(eta, (0.75 * math.sqrt(math.pi) * density) ** (2.0 / 3.0))
    for _ in range(50):
        edge = _edge(x, eta) * measure / math.gamma(1.5)
        full, slope = edge @ x**1.5 / 1.5, edge @ x**0.5
        # by the logarithm, in which the integral is nearly straight where it is small
        step = np.log(density / full) * full / slope
        eta = eta + step
        if np.abs(step).max() < 1e-13 * max(1.0, float(np.abs(eta).max())):
            break
    return np.asarray(eta)


def seebeck_of_band(
    carriers: Evaluated, states: Evaluated, scattering_exponent: float, carrier: Carrier
) -> Evaluated:
    """Return the Seebeck coefficient (V/K) of carriers of one band.

    Parameters
    ----------
    carriers, states : tuple of ndarray and dict
        Their density, and the effective density of states of the band (cm⁻³), with derivatives.
    scattering_exponent : float
        r in τ ∝ E^r: −1/2 for acoustic phonons, 3/2 for ionised impurities.
    carrier : str

    Returns
    -------
    tuple of ndarray and dict
        With derivatives by what the densities depend on, and by ``scattering_exponent``.

    Examples
    --------
    Few carriers: k_B/e (5/2 + r + ln(states/carriers)).

    >>> few, states = (np.array(2.8e13), {}), (np.array(2.8e19), {})
    >>> S, _ = seebeck_of_band(few, states, -0.5, "electron")
    >>> round(1e6 * S.item()), round(-86.173 * (2 + np.log(1e6)))
    (-1363, -1363)
    """
    (density, d_density), (full, d_full) = carriers, states
    reduced, by_exponent = _reduced_seebeck(scattering_exponent)
    ratio = density / full
    w = np.log1p(ratio)
    scale = -BOLTZMANN if carrier == "electron" else BOLTZMANN
    value, slope = reduced(w)
    by_ratio = scale * (slope / (1.0 + ratio) - 1.0 / ratio)
    names = set(d_density) | set(d_full)
    by = {
        name: by_ratio * (d_density.get(name, 0.0) - ratio * d_full.get(name, 0.0)) / full
        for name in names
    }
    by["scattering_exponent"] = scale * by_exponent(w)[0]
    return scale * (value - np.log(ratio)), by


def _summed(beside: Iterable[tuple[Evaluated, Evaluated]]) -> Evaluated:
    """Return σ, β and γ, (3, ...), by σ (S cm⁻¹) and S (V/K) of carriers beside each other."""
    total: Array = np.zeros(())
    by = dict[str, Array]()
    for (sigma, d_sigma), (S, d_S) in beside:
        powers = np.stack([np.ones_like(S), S, S**2])
        slopes = sigma * np.stack([np.zeros_like(S), np.ones_like(S), 2.0 * S])
        total = total + sigma * powers
        for factor, derivatives in ((powers, d_sigma), (slopes, d_S)):
            for name, value in derivatives.items():
                by[name] = by.get(name, np.zeros(())) + factor * value
    return total, {name: np.broadcast_to(each, total.shape).copy() for name, each in by.items()}


def _bipolar(summed: Evaluated) -> Evaluated:
    """Return the bipolar heat conductivity over the temperature, γ − β²/σ (W cm⁻¹ K⁻²)."""
    (sigma, beta, gamma), by = summed
    S = beta / sigma
    return gamma - beta * S, {name: d[2] - 2.0 * S * d[1] + S**2 * d[0] for name, d in by.items()}


def _beside_pure(T: Array, n: ArrayLike) -> Array:
    """Return the doping at each temperature and, as a second one, that of pure silicon."""
    n = np.broadcast_to(np.asarray(n, dtype=float), np.broadcast_shapes(T.shape, np.shape(n)))
    # the carriers of silicon itself are all that count where κ was measured hot
    return np.stack([n, np.full_like(n, 1e12)])


def _less_pure(carried: Sequence[Carried], T: Array, exponent: float) -> Evaluated:
    """Return β and γ of carriers at two dopings, the second pure, less what κ of pure silicon has.

    See `_beside_pure`.
    """
    states = density_of_states.formula(T)
    summed, by = _summed(
        (conducted([each]), seebeck_of_band(each[0], states, exponent, each[2])) for each in carried
    )
    pure, pure_by = _bipolar((summed[:, 1], {name: d[:, 1] for name, d in by.items()}))
    pure_by.pop("n")
    values, by = summed[1:, 0], {name: d[1:, 0] for name, d in by.items()}
    values[1] -= pure
    for name, d in pure_by.items():
        by[name][1] -= d
    return values, by


_SOURCE = (
    "Fermi integrals of parabolic bands with the carriers of Eqs. 5 to 10; Nolas, Sharp and "
    "Goldsmid, Thermoelectrics (2001)"
)


@law(meant_for=(300.0, 1300.0), source=_SOURCE)
def thermoelectric_n_silicon(
    T: ArrayLike,
    n: ArrayLike,
    p: float,
    impurity_exponent: float,
    scattering_exponent: float,
    intrinsic_scale: float = 1.0,
) -> Evaluated:
    """Thermoelectricity of n-doped silicon, β (A cm⁻¹ K⁻¹) and γ (W cm⁻¹ K⁻²), (2, ...).

    From γ the bipolar part of pure silicon is taken off: κ of Eq. 4 was measured on pure silicon
    and has it. The phonons' drag on the carriers is left out; it makes S of lightly doped silicon
    larger near and below room temperature.

    Parameters
    ----------
    T, n : array_like
    p, impurity_exponent, intrinsic_scale : float
        See `hotlever.materials.silicon.conductivity_low_doped`.
    scattering_exponent : float
        See `seebeck_of_band`.
    """
    T = np.asarray(T, dtype=float)
    carried = carried_in_n_silicon(
        T, _beside_pure(T, n), p, impurity_exponent, intrinsic_scale=intrinsic_scale
    )
    return _less_pure(carried, T, scattering_exponent)


@law(meant_for=(300.0, 1300.0), source=_SOURCE)
def thermoelectric_p_silicon(
    T: ArrayLike,
    n: ArrayLike,
    p: float,
    impurity_exponent: float,
    scattering_exponent: float,
    intrinsic_scale: float = 1.0,
) -> Evaluated:
    """Thermoelectricity of p-doped silicon, β and γ; see `thermoelectric_n_silicon`."""
    T = np.asarray(T, dtype=float)
    carried = carried_in_p_silicon(T, _beside_pure(T, n), p, impurity_exponent, intrinsic_scale)
    return _less_pure(carried, T, scattering_exponent)


@law(meant_for=(300.0, 1300.0), source=f"{_SOURCE}; σ of Eq. 11")
def thermoelectric_high_doped(
    T: ArrayLike, a0: float, a1: float, n_hd: float, scattering_exponent: float, carrier: Carrier
) -> Evaluated:
    """Thermoelectricity of high-doped silicon, whose carriers are those of its dopant alone."""
    T = np.asarray(T, dtype=float)
    carriers = np.full_like(T, n_hd), {"n_hd": np.ones_like(T)}
    seebeck = seebeck_of_band(carriers, density_of_states.formula(T), scattering_exponent, carrier)
    return of_one_carrier(conductivity_high_doped.formula(T, a0, a1), seebeck)


def of_one_carrier(conductivity: Evaluated, seebeck: Evaluated) -> Evaluated:
    """Return β and γ by σ (S cm⁻¹) and S (V/K) of one kind of carrier, and their derivatives."""
    (_, *values), by = _summed([(conductivity, seebeck)])
    return np.stack(values), {name: d[1:] for name, d in by.items()}
