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

from hotlever.raman.lineshape import Array
from hotlever.raman.published import BALKANSKI1983

SECOND_RADIATION = Planck * speed_of_light / Boltzmann * 100.0
"""hc/k, K cm."""


def occupation(wavenumber: float, temperature: ArrayLike) -> tuple[Array, Array]:
    """Bose occupation of a phonon and its derivative with respect to temperature.

    Parameters
    ----------
    wavenumber : float
        cm⁻¹.
    temperature : array_like
        K; at and below 0 K nothing is occupied.

    Returns
    -------
    n, dn_dT : arrays
        Dimensionless, K⁻¹.
    """
    t = np.maximum(np.asarray(temperature, dtype=float), 1e-3)
    ratio = np.minimum(SECOND_RADIATION * wavenumber / t, 500.0)
    n = 1.0 / np.expm1(ratio)
    return n, n * (n + 1.0) * ratio / t


def terms(
    temperature: ArrayLike, bare: float = BALKANSKI1983.bare
) -> tuple[Array, Array, Array, Array]:
    """Temperature factors of A and of B, and their derivatives.

    Returns
    -------
    a, b, da_dT, db_dT : arrays
        a = 1 + 2·n2, b = 1 + 3·n3 + 3·n3².
    """
    n2, dn2 = occupation(bare / 2.0, temperature)
    n3, dn3 = occupation(bare / 3.0, temperature)
    return (
        1.0 + 2.0 * n2,
        1.0 + 3.0 * n3 + 3.0 * n3**2,
        2.0 * dn2,
        (3.0 + 6.0 * n3) * dn3,
    )


def shift(
    temperature: ArrayLike,
    reference: float,
    three_phonon: float = BALKANSKI1983.three_phonon,
    four_phonon: float = BALKANSKI1983.four_phonon,
) -> tuple[Array, Array]:
    """Shift of the line against its place at the reference temperature, and d(shift)/dT.

    Parameters
    ----------
    temperature : array_like
        K.
    reference : float
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
    a, b, da, db = terms(temperature)
    a_ref, b_ref, _, _ = terms(reference)
    return (
        np.asarray(three_phonon * (a - a_ref) + four_phonon * (b - b_ref)),
        np.asarray(three_phonon * da + four_phonon * db),
    )
