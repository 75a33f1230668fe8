"""What surfaces radiate."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from hotlever.materials.laws import Evaluated

#: Constant of Stefan and Boltzmann (W cm⁻² K⁻⁴), CODATA 2018.
STEFAN_BOLTZMANN = 5.670374419e-12


def grey_emission(T: ArrayLike, emissivity: float, surroundings_K: float) -> Evaluated:
    """Return what a grey face radiates less what it takes up from around, ε σ (T⁴ − T₀⁴).

    Parameters
    ----------
    T : array_like
        K.
    emissivity : float
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
