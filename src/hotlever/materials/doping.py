"""The doping profile of a heater that borders high-doped silicon, and what makes it.

The dopant diffuses into the heater while the high-doped silicon is annealed.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from hotlever.errors import InputError
from hotlever.materials.laws import Evaluated, law
from hotlever.types import Array

# of some thousand values, in less time than the import of SciPy's takes
_erfc = np.vectorize(math.erfc, otypes=[float])


def tapered_doping(
    distances: ArrayLike, n_d: float, delta: float, *, n_hd: float, front: float = 0.0
) -> Evaluated:
    """Doping concentration (cm⁻³, from `n_d` to `n_hd`) after diffusion from a heater's borders.

    Every border with high-doped silicon adds its share ½ erfc(d/Δ) at the distance d. Between two
    parallel borders, at d = l_h/2 − x and l_h/2 + x, this is the paper's unnumbered equation
    between Eqs. 4 and 5: a step profile smoothed by 1-D diffusion over the length Δ. A dopant that
    diffuses faster where there is more of it comes as a front, ½ erfc(d/Δ − f). The partial
    derivatives are by ``n_d``, ``delta``, ``n_hd``, ``front`` and, for each border, ``distances``.

    Parameters
    ----------
    distances : array_like, shape (borders, ...)
        From each border into the heater (µm); negative beyond it.
    n_d, n_hd : float
        Doping concentration of the undiffused heater and of the high-doped silicon (cm⁻³).
    delta : float
        Diffusion length Δ = 2 √(D t_a) (µm).
    front : float
        How far the front has moved from a border into the heater, over Δ; 0 in the paper.

    Notes
    -----
    Where more than two borders are near, their shares may add up to more than all: there the
    doping is `n_hd`.

    Examples
    --------
    In the middle and at an end of a heater of 4 µm:

    >>> n, _ = tapered_doping([[2.0, 0.0], [2.0, 4.0]], 5e17, 0.65, n_hd=2.2e20)
    >>> [f"{value:.3g}" for value in n]
    ['5.03e+17', '1.1e+20']
    """
    away = np.asarray(distances, dtype=float) / delta
    ratio = away - front
    share = 0.5 * _erfc(ratio).sum(axis=0)
    full = share >= 1.0
    bell = np.where(full, 0.0, (n_hd - n_d) / (np.sqrt(np.pi) * delta) * np.exp(-(ratio**2)))
    share = np.minimum(share, 1.0)
    return n_d + (n_hd - n_d) * share, {
        "n_d": 1.0 - share,
        "delta": (bell * away).sum(axis=0),
        "n_hd": share,
        "front": delta * bell.sum(axis=0),
        "distances": -bell,
    }


@law(
    meant_for=(1323.0, 1623.0),
    source="C. S. Fuller and J. A. Ditzenberger, J. Appl. Phys. 27, 544 (1956)",
)
def phosphorus_diffusivity(T: ArrayLike) -> Evaluated:
    """Diffusion coefficient of phosphorus in silicon (cm² s⁻¹) at a temperature (K).

    Fuller and Ditzenberger, J. Appl. Phys. 27, 544 (1956): 10.5 cm²/s
    exp(−85 kcal/mol / RT), ± 40 %, for concentrations at which it does not depend on them. Above
    some 10¹⁹ cm⁻³ phosphorus is faster. The paper takes 10⁻¹² cm²/s at 1150 °C.

    Examples
    --------
    >>> from hotlever.spieser2017 import ANNEALING_K
    >>> D, _ = phosphorus_diffusivity(ANNEALING_K)
    >>> f"{D:.1e}"
    '9.3e-13'
    """
    T = np.asarray(T, dtype=float)
    activation_K = 85000.0 / 1.98720  # the activation energy over the gas constant
    D = 10.5 * np.exp(-activation_K / T)
    return D, {"T": D * activation_K / T**2}


def diffusion_length(temperature_K: ArrayLike, time_s: ArrayLike) -> Array:
    """Return the diffusion length Δ = 2 √(D t_a) (µm) of phosphorus after annealing.

    Raises
    ------
    InputError
        If a temperature or a time is not positive.

    Examples
    --------
    >>> from hotlever.spieser2017 import ANNEALING_K, ANNEALING_S
    >>> diffusion_length(ANNEALING_K, ANNEALING_S).round(2).item()
    0.82
    """
    temperature, time = np.asarray(temperature_K, dtype=float), np.asarray(time_s, dtype=float)
    if not (np.all(temperature > 0) and np.all(time > 0)):
        raise InputError("annealing needs a positive temperature (K) and a positive time (s)")
    length: Array = 2.0 * np.sqrt(phosphorus_diffusivity(temperature)[0] * time) * 1e4
    return length
