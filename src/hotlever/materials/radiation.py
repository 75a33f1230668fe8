"""What surfaces radiate."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from hotlever.materials.laws import Evaluated
from hotlever.types import Array

#: Constant of Stefan and Boltzmann (W cm⁻² K⁻⁴), CODATA 2018.
STEFAN_BOLTZMANN = 5.670374419e-12
#: Impedance of free space (Ω), CODATA 2018.
FREE_SPACE_OHM = 376.730313668


def grey_emission(T: ArrayLike, emissivity: float | Array, surroundings_K: float) -> Evaluated:
    """Return what a grey face radiates less what it takes up from around, ε σ (T⁴ − T₀⁴).

    Parameters
    ----------
    T : array_like
        K.
    emissivity : float or ndarray
        ε, the same at all wavelengths and directions, and with it the share that is taken up.
    surroundings_K : float
        T₀ of black surroundings.

    Returns
    -------
    tuple of ndarray and dict
        W cm⁻², with derivatives by ``T``, ``emissivity`` and ``surroundings_K``.

    Examples
    --------
    >>> emission, _ = grey_emission(1150.0, 1.0, 293.0)
    >>> round(10 * emission.item(), 1)  # nW/µm²
    98.8
    """
    T = np.asarray(T, dtype=float)
    cube = T * T * T  # powers take ten times as long
    black = STEFAN_BOLTZMANN * (cube * T - surroundings_K**4)
    slope = 4.0 * STEFAN_BOLTZMANN * emissivity
    return emissivity * black, {
        "T": slope * cube,
        "emissivity": black,
        "surroundings_K": np.full_like(T, -slope * surroundings_K**3),
    }


def sheet_emissivity(sheet_ohm: ArrayLike) -> Array:
    """Return the emissivity of a sheet much thinner than the wavelength, at normal incidence.

    A sheet of x = Z₀/R reflects the share x/(2 + x) of a wave's field and passes 2/(2 + x), since
    the field is the same on either side and the magnetic field steps by the current in the sheet.
    What is left of the power is absorbed, 4 x/(2 + x)², at most a half (S. Li et al., AIP Advances
    4, 017130 (2014), abstract), and by Kirchhoff's law emitted by each face.

    It is an upper bound for silicon: carriers do not follow light as they follow a direct current.

    Parameters
    ----------
    sheet_ohm : array_like
        Sheet resistance R (Ω).

    Examples
    --------
    >>> sheet_emissivity([FREE_SPACE_OHM / 2, 20.0, 2000.0]).round(2).tolist()
    [0.5, 0.17, 0.16]
    """
    x = FREE_SPACE_OHM / np.asarray(sheet_ohm, dtype=float)
    return np.asarray(4.0 * x / (2.0 + x) ** 2)
