"""How far nature may be from a material law: departures of few coefficients.

Most are a smooth factor exp(δ(T)) of a law of the temperature; that of the doping profile moves it.

A law is known to within a departure δ, a Gaussian process in ln T. Its standard deviation is how
far published values are from the law (the root of their mean square, the law itself being one of
them), and grows with the temperature, where fewer were measured; its correlation length is that of
published departures. The process is written by its first
Karhunen-Loève modes (R. G. Ghanem and P. D. Spanos, Stochastic Finite Elements (1991)), whose
coefficients are independent and normal with a standard deviation of one: parameters of the material
like any other. So the error of a law sits in the law, and all that a lever shows stays consistent
(K. Sargsyan, H. N. Najm and R. Ghanem, Int. J. Chem. Kinet. 47, 246 (2015); J. Brynjarsdóttir and
A. O'Hagan, Inverse Probl. 30, 114007 (2014)).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.polynomial import chebyshev
from numpy.polynomial.legendre import leggauss
from numpy.typing import ArrayLike

from hotlever.materials.laws import FORMULA_FROM, FORMULA_TO
from hotlever.types import Array


@dataclass(frozen=True)
class Departure:
    """The departure of one law, by coefficients of which 0 is the law.

    Attributes
    ----------
    law : str
        Its name in ``[prior]``, after ``law.``, and of the coefficients, before ``_1``.
    words : str
        What it is the law of.
    spread_hot : float
        Its standard deviation, at 1000 K if it depends on the temperature: how far published
        values are from the law at least.
    source : str
        Where that is from.
    count : int
        Of coefficients, each with a standard deviation of one.
    """

    law: str
    words: str
    spread_hot: float
    source: str
    count: int = 1

    @property
    def names(self) -> tuple[str, ...]:
        """The names of its coefficients."""
        return tuple(f"{self.law}_{number + 1}" for number in range(self.count))

    def hot(self, coefficients: Sequence[float]) -> float:
        """Return the departure of some coefficients, at 1000 K if it depends on temperature."""
        return float(self.spread_hot * sum(coefficients))


@dataclass(frozen=True)
class SmoothFactor(Departure):
    """A factor exp(δ(T)) of a law, δ by its modes.

    Attributes
    ----------
    spread_cold : float
        Standard deviation of δ at 300 K, from where it is linear in T.
    low_K, high_K : float
        Temperatures between which the modes are those of the process.

    Examples
    --------
    >>> FACTORS["kappa"].names
    ('kappa_1', 'kappa_2', 'kappa_3')
    """

    spread_cold: float = 0.0
    count: int = 3
    low_K: float = 300.0
    high_K: float = 1300.0

    def spread(self, T: ArrayLike) -> Array:
        """Return the standard deviation of δ at temperatures (K), stated at 300 K and 1000 K."""
        share = (np.asarray(T, dtype=float) - 300.0) / (1000.0 - 300.0)
        return np.asarray(self.spread_cold + share * (self.spread_hot - self.spread_cold))

    def modes(self, T: ArrayLike) -> Array:
        """Return the modes at temperatures (K), (modes, ...): the derivatives of δ."""
        return np.asarray(chebyshev.chebval(_position(np.asarray(T, dtype=float)), self._modes.T))

    def hot(self, coefficients: Sequence[float]) -> float:
        """Return δ at 1000 K."""
        return float(np.asarray(coefficients) @ self.modes(1000.0))

    def departed(self, T: Array, coefficients: Sequence[float]) -> tuple[Array, Array]:
        """Return exp(δ) at temperatures (K), and the derivative of δ by the temperature."""
        powers = np.asarray(coefficients) @ self._powers
        inside = np.clip(T, FORMULA_FROM, FORMULA_TO)
        position = _position(inside)
        # Horner's scheme for both at once, in place: laws are evaluated more often than all else
        delta, slope = np.full_like(position, powers[-1]), np.zeros_like(position)
        for power in powers[-2::-1]:
            slope *= position
            slope += delta
            delta *= position
            delta += power
        slope *= (2.0 / _WIDTH) * (inside == T)
        slope /= inside
        return np.exp(delta), slope

    @property
    def _nodes(self) -> tuple[Array, Array]:
        """Points in ln T and weights, of which the sum is one."""
        points, weights = leggauss(40)
        low, high = np.log(self.low_K), np.log(self.high_K)
        return low + 0.5 * (points + 1.0) * (high - low), 0.5 * weights

    @cached_property
    def _powers(self) -> Array:
        """Coefficients of the powers of the position in each mode, (modes, degree + 1)."""
        return np.array([chebyshev.cheb2poly(mode) for mode in self._modes])

    @cached_property
    def _modes(self) -> Array:
        """Their series of Chebyshev polynomials, (modes, degree + 1)."""
        # Nyström's method: the integral equation at points, and by it the modes anywhere
        x, weights = self._nodes
        spread, root = self.spread(np.exp(x)), np.sqrt(weights)
        kernel = spread[:, None] * _correlation(x, x) * spread
        variances, vectors = np.linalg.eigh(root[:, None] * kernel * root)
        variances, vectors = variances[: -self.count - 1 : -1], vectors[:, : -self.count - 1 : -1]
        # points and degree are both far beyond what smooth modes need
        degree = 14
        at = chebyshev.chebpts1(2 * degree)
        anywhere = np.log(FORMULA_FROM) + 0.5 * (at + 1.0) * _WIDTH
        reach = self.spread(np.exp(anywhere))[:, None] * _correlation(anywhere, x) * spread
        values = reach @ (root[:, None] * vectors) / np.sqrt(variances)
        # the sign of a mode is a convention: it raises the law where that is hot
        values *= np.sign(values[-1])
        return np.asarray(chebyshev.chebfit(at, values, degree).T)


_WIDTH = float(np.log(FORMULA_TO / FORMULA_FROM))


def _position(T: Array) -> Array:
    """Return ln T between −1 and 1 in the range of formulas; the ends beyond it."""
    inside = np.clip(T, FORMULA_FROM, FORMULA_TO)
    return np.asarray(2.0 / _WIDTH * np.log(inside / FORMULA_FROM) - 1.0)


def _correlation(x: Array, y: Array) -> Array:
    """Return the correlation of δ between places in ln T, (x, y)."""
    # published formulas are powers of T and activated, so that they part over a factor of two in T;
    # three modes leave less than a hundredth of the variance then
    away = (x[:, None] - y) / np.log(2.0)
    return np.asarray(np.exp(-0.5 * away**2))


#: By the name of the law. The numbers are those of published formulas, and a test holds them
#: (tests/materials/test_departures.py).
FACTORS = {
    factor.law: factor
    for factor in (
        SmoothFactor(
            "kappa",
            "thermal conductivity of silicon",
            spread_cold=0.07,
            spread_hot=0.18,
            source="films of 0.4 µm between c_κ κ_Si(T) and the scattering at surfaces of Fuchs "
            "and Sondheimer; bulk silicon to 5 %",
        ),
        SmoothFactor(
            "n_i",
            "intrinsic carrier density",
            spread_cold=0.17,
            spread_hot=0.18,
            source="Eq. 7, Morin and Maita (1954), Putley and Mitchell (1958), Slotboom (1977), "
            "Wasserrab (1977), Green (1990), Sproul and Green (1991, 1993), Misiakos and Tsamakis "
            "(1993), Couderc et al. (2014); narrowing by dopants, by half of it",
        ),
        SmoothFactor(
            "mobility",
            "mobility of the carriers in low-doped silicon",
            spread_cold=0.08,
            spread_hot=0.40,
            source="Eq. 8, Dorkel and Leturcq (1981), Arora et al. (1982), MINIMOS (1990), "
            "measured up to 500 K; Eq. 9 with the lattices of Morin and Maita (1954), Ludwig and "
            "Watters (1956), Jacoboni et al. (1977)",
        ),
        SmoothFactor(
            "legs",
            "conductivity of high-doped silicon",
            spread_cold=0.05,
            spread_hot=0.10,
            source="bends of 1/σ at 2e20 cm⁻³ from a straight line up to 600 K, where legs are: "
            "Dorkel and Leturcq (1981), Arora et al. (1982), MINIMOS (1990); Chapman et al. (1963)",
        ),
    )
}
#: How far the front of the dopant has moved into a heater, over the diffusion length: its own
#: diffusion is faster where there is much of it, so that it comes as a front.
PROFILE = Departure(
    "profile",
    "doping profile",
    spread_hot=0.5,
    source="erfc, and phosphorus that diffuses from 2.2e20 cm⁻³ at 1150 °C by vacancies, where Δ "
    "is that of published levers: Fair and Tsai, J. Electrochem. Soc. 124, 1107 (1977)",
)
#: All of them.
DEPARTURES: dict[str, Departure] = {**FACTORS, PROFILE.law: PROFILE}


def departure_of(name: str) -> tuple[Departure, int] | None:
    """Return the departure that a coefficient is of, and its number; None of any other name.

    Examples
    --------
    >>> departure, number = departure_of("n_i_2")
    >>> departure.law, number
    ('n_i', 1)
    """
    law, _, number = name.rpartition("_")
    departure = DEPARTURES.get(law)
    if departure is None or name not in departure.names:
        return None
    return departure, int(number) - 1
