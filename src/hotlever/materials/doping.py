"""The doping profile along a heater that borders high-doped silicon."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import erf

from hotlever.materials.law import Array, Partials


def tapered_doping(
    x: ArrayLike, n_d: float, delta: float, *, length: float, n_hd: float
) -> tuple[Array, Partials]:
    """Doping concentration after diffusion from both ends of a heater.

    The paper's unnumbered equation between Eqs. 4 and 5: the step profile of a heater of
    `length` between high-doped neighbours, smoothed by 1-D diffusion over the length Δ.

    Parameters
    ----------
    x : array_like
        Position along the heater axis from the heater's centre (µm).
    n_d : float
        Doping concentration of the undiffused heater (cm⁻³).
    delta : float
        Diffusion length Δ = 2 √(D t_a) (µm).
    length : float
        Geometrical heater length l_h (µm).
    n_hd : float
        Doping concentration of the high-doped silicon (cm⁻³).

    Returns
    -------
    n : ndarray
        cm⁻³, between `n_d` and `n_hd`.
    partials : dict
        ``n_d``, ``delta``, ``x``.

    Examples
    --------
    >>> n, _ = tapered_doping([0.0, 2.0], 5e17, 0.65, length=4.0, n_hd=2.2e20)
    >>> [f"{value:.3g}" for value in n]
    ['5.03e+17', '1.1e+20']
    """
    x = np.asarray(x, dtype=float)
    right, left = (x - length / 2) / delta, (-x - length / 2) / delta
    high_share = 1.0 + 0.5 * (erf(right) + erf(left))
    bell_right, bell_left = np.exp(-(right**2)), np.exp(-(left**2))
    per_unit = (n_hd - n_d) / np.sqrt(np.pi)
    return n_d + (n_hd - n_d) * high_share, {
        "n_d": 1.0 - high_share,
        "delta": -per_unit * (bell_right * right + bell_left * left) / delta,
        "x": per_unit * (bell_right - bell_left) / delta,
    }
