"""Diffusion of the dopant while the high-doped silicon is annealed."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from hotlever.errors import InputError
from hotlever.materials.law import Array, Partials, law

#: Pre-exponential factor (cm²/s) and activation energy over the gas constant (K).
_FACTOR, _ACTIVATION = 10.5, 85000.0 / 1.98720
#: The paper's annealing: temperature (K) and time (s).
ANNEALING_K, ANNEALING_S = 1150.0 + 273.15, 1800.0


@law(
    meant_for=(1323.0, 1623.0),
    source="C. S. Fuller and J. A. Ditzenberger, J. Appl. Phys. 27, 544 (1956)",
)
def phosphorus_diffusivity(T: ArrayLike) -> tuple[Array, Partials]:
    """Diffusion coefficient of phosphorus in silicon.

    Fuller and Ditzenberger, J. Appl. Phys. 27, 544 (1956): 10.5 cm²/s
    exp(−85 kcal/mol / RT), ± 40 %, for concentrations at which it does not depend on them. Above
    some 10¹⁹ cm⁻³ phosphorus is faster. The paper takes 10⁻¹² cm²/s at 1150 °C.

    Parameters
    ----------
    T : array_like
        Temperature (K); measured from 1323 to 1623 K.

    Returns
    -------
    diffusivity : ndarray
        cm² s⁻¹.
    partials : dict
        ``T``.

    Examples
    --------
    >>> D, _ = phosphorus_diffusivity(ANNEALING_K)
    >>> f"{D:.1e}"
    '9.3e-13'
    """
    T = np.asarray(T, dtype=float)
    D = _FACTOR * np.exp(-_ACTIVATION / T)
    return D, {"T": D * _ACTIVATION / T**2}


def diffusion_length(temperature_K: ArrayLike, time_s: ArrayLike) -> Array:
    """Return the diffusion length Δ = 2 √(D t_a) (µm) of phosphorus after annealing.

    Parameters
    ----------
    temperature_K, time_s : array_like

    Raises
    ------
    InputError
        If a temperature or a time is not positive.

    Examples
    --------
    >>> diffusion_length(ANNEALING_K, ANNEALING_S).round(2).item()
    0.82
    """
    temperature, time = np.asarray(temperature_K, dtype=float), np.asarray(time_s, dtype=float)
    if not (np.all(temperature > 0) and np.all(time > 0)):
        raise InputError("annealing needs a positive temperature (K) and a positive time (s)")
    length: Array = 2.0 * np.sqrt(phosphorus_diffusivity(temperature)[0] * time) * 1e4
    return length
