"""Balkanski's law: how the phonon of silicon softens with temperature.

An optical phonon decays into two of half its energy (three-phonon process) or into three of
a third (four-phonon process). With the thermal occupation n(ω) = 1/(exp(hcω/kT) − 1) its
wavenumber is (Balkanski, Wallis and Haro, Phys. Rev. B 28, 1928 (1983), eq. 3.6)::

    ω(T) = ω0 + A·(1 + 2·n2) + B·(1 + 3·n3 + 3·n3²),   n2 = n(ω0/2), n3 = n(ω0/3).

The law is linear in A and B once ω0 in the occupations is given; ω0 itself cancels from
shifts. For kT ≫ hcω0 the A term grows like T and the B term like T², which is why a line
fitted below 900 K reads too hot above.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.constants import Boltzmann, Planck, speed_of_light

from hotlever.types import Array

#: Bare phonon, three-phonon and four-phonon term (cm⁻¹).
BARE, THREE_PHONON, FOUR_PHONON = 528.0, -2.96, -0.174
SOURCE = "Balkanski, Wallis and Haro, Phys. Rev. B 28, 1928 (1983), doi:10.1103/PhysRevB.28.1928"


def terms(temperature: ArrayLike) -> tuple[Array, Array, Array, Array]:
    """Temperature factors of A and of B, 1 + 2·n2 and 1 + 3·n3 + 3·n3², and their derivatives."""
    n2, dn2 = _occupation(BARE / 2.0, temperature)
    n3, dn3 = _occupation(BARE / 3.0, temperature)
    return 1.0 + 2.0 * n2, 1.0 + 3.0 * n3 + 3.0 * n3**2, 2.0 * dn2, (3.0 + 6.0 * n3) * dn3


def _occupation(wavenumber: float, temperature: ArrayLike) -> tuple[Array, Array]:
    """Bose occupation of a phonon and its derivative; at and below 0 K nothing is occupied."""
    t = np.maximum(np.asarray(temperature, dtype=float), 1e-3)
    second_radiation = Planck * speed_of_light / Boltzmann * 100.0  # hc/k, K cm
    ratio = np.minimum(second_radiation * wavenumber / t, 500.0)
    n = 1.0 / np.expm1(ratio)
    return n, n * (n + 1.0) * ratio / t


def gradient(temperature: ArrayLike, reference: float) -> Array:
    """Derivatives of the line's place to that at the reference temperature, A and B; (n, 3)."""
    a, b, _, _ = terms(temperature)
    a_reference, b_reference, _, _ = terms(reference)
    return np.stack([np.ones_like(a), a - a_reference, b - b_reference], axis=-1)


def shift(
    temperature: ArrayLike,
    reference: float,
    three_phonon: float = THREE_PHONON,
    four_phonon: float = FOUR_PHONON,
) -> tuple[Array, Array]:
    """Shift of the line against its place at the reference temperature, and d(shift)/dT.

    Parameters
    ----------
    temperature, reference : array_like, float
        K.
    three_phonon, four_phonon : float
        A and B, cm⁻¹; the published constants unless given.

    Returns
    -------
    shift, slope : arrays
        cm⁻¹, cm⁻¹ K⁻¹.

    Examples
    --------
    >>> value, slope = shift(900.0, reference=293.0)
    >>> round(float(value), 1), round(float(slope), 3)
    (-14.9, -0.03)
    """
    _, _, da, db = terms(temperature)
    return (
        np.asarray(gradient(temperature, reference) @ [0.0, three_phonon, four_phonon]),
        np.asarray(three_phonon * da + four_phonon * db),
    )
