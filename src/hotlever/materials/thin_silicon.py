"""Heat in thin silicon, whose surfaces scatter phonons: layers and wires.

Both start from the bulk's law, Eq. 4 of the paper (`hotlever.materials.silicon`), and from the
mean free path Λ of the phonons that carry heat in it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from hotlever.materials.laws import Evaluated, law
from hotlever.materials.silicon import STEP, thermal_conductivity
from hotlever.types import Array

#: Mean free path of the phonons that carry heat in bulk silicon at 300 K (µm).
MEAN_FREE_PATH_UM = 0.3


@law(
    meant_for=(290.0, 1300.0),
    source="Sondheimer, Adv. Phys. 1, 1 (1952); Ju and Goodson, Appl. Phys. Lett. 74, 3005 (1999); "
    "Eq. 4",
    steps=(STEP,),
)
def thermal_conductivity_of_layer(T: ArrayLike, thickness_um: ArrayLike) -> Evaluated:
    """Thermal conductivity of a silicon layer along its plane, in W cm⁻¹ K⁻¹.

    That of bulk silicon (Eq. 4) times the share that Fuchs and Sondheimer found for carriers of
    one mean free path Λ that leave the surfaces in all directions. Λ is 0.3 µm at 300 K (Ju and
    Goodson) and is taken to fall with the temperature as κ of bulk silicon does.

    Examples
    --------
    At 20 and 100 nm Liu and Asheghi (Appl. Phys. Lett. 84, 3819 (2004); J. Heat Transfer 128, 75
    (2006)) measured about 22 and 60 W/(m K):

    >>> kappa, _ = thermal_conductivity_of_layer(300.0, [0.02, 0.1, 0.4])
    >>> (100 * kappa).round(1).tolist()  # W/(m K)
    [22.4, 60.6, 105.4]
    """
    T, thickness = np.asarray(T, dtype=float), np.asarray(thickness_um, dtype=float)
    bulk, bulk_by = thermal_conductivity.formula(T)
    cold, _ = thermal_conductivity.formula(300.0)
    depth = thickness * cold / (MEAN_FREE_PATH_UM * bulk)
    share, slope = _share(depth)
    return bulk * share, {
        # a longer mean free path takes back a part of what κ gains
        "T": bulk_by["T"] * (share - depth * slope),
        "thickness_um": bulk * slope * depth / thickness,
    }


@law(
    meant_for=(290.0, 1300.0),
    source="Matthiessen's rule, Λ of Ju and Goodson, Appl. Phys. Lett. 74, 3005 (1999); Eq. 4",
    steps=(STEP,),
)
def thermal_conductivity_of_wire(T: ArrayLike, diameter_um: ArrayLike) -> Evaluated:
    """Thermal conductivity of silicon along a round wire, in W cm⁻¹ K⁻¹.

    Bulk and surface scatter phonons independently (Matthiessen), the surface once a diameter:
    1/Λ + 1/d in place of 1/Λ, Λ as in a layer. Falling as κ does, it adds the same to 1/κ at any T.

    Examples
    --------
    Of wires of 37 nm at room temperature it is stated that they conduct about 87 % less than bulk
    silicon (arXiv:1712.05188, Introduction); the rule says 89 %:

    >>> kappa, _ = thermal_conductivity_of_wire(300.0, [0.037, 0.3, 1e3])
    >>> (100 * kappa).round(1).tolist()  # W/(m K)
    [15.5, 70.7, 141.4]
    """
    diameter = np.asarray(diameter_um, dtype=float)
    bulk, bulk_by = thermal_conductivity.formula(T)
    cold, _ = thermal_conductivity.formula(300.0)
    by_surface = MEAN_FREE_PATH_UM / (cold * diameter)
    kappa = 1.0 / (1.0 / bulk + by_surface)
    return kappa, {
        "T": bulk_by["T"] * (kappa / bulk) ** 2,
        "diameter_um": kappa**2 * by_surface / diameter,
    }


def _share(depth: Array) -> tuple[Array, Array]:
    """Sondheimer's Eq. 12 with diffuse surfaces, by thickness over Λ, and its derivative."""
    # loaded where it is wanted, as every command loads this module
    from scipy.special import expn

    third, fifth = expn(3, depth), expn(5, depth)
    share = 1.0 - 1.5 * (0.25 - third + fifth) / depth
    slope = (1.0 - share) / depth - 1.5 * (expn(2, depth) - expn(4, depth)) / depth
    return share, slope
