"""Heat in materials: how silicon conducts it, what is held, and what faces radiate.

Silicon conducts by Eq. 4 of Spieser et al., J. Appl. Phys. 121, 174503 (2017),
doi:10.1063/1.4981883, called "the paper". The surfaces of thin silicon, layers and wires, scatter
phonons: both start from Eq. 4 and from the mean free path Λ of the phonons that carry heat in it.

Heat is held per volume: heat capacity and its integral, the enthalpy. The density is that of room
temperature throughout, so that a volume of the layout holds the same mass when it is hot. Shomate's
equation would become negative at 120 K, where only Newton's method may stray to: below 200 K the
heat capacity stays what it is there.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from hotlever.materials.laws import FORMULA_FROM, Evaluated, law
from hotlever.types import Array

#: Where the slope of Eq. 4 steps (K), through a tanh that is 1 K wide.
STEP = 680.0
#: Mean free path of the phonons that carry heat in bulk silicon at 300 K (µm).
MEAN_FREE_PATH_UM = 0.3
#: Coefficients A to E of Shomate's equation for solid silicon (J/(mol K), T in 1000 K).
_SHOMATE = (22.81719, 3.899510, -0.082885, 0.042111, -0.354063)
#: Density (g/cm³) over molar mass (g/mol) of silicon.
_PER_VOLUME = 2.329 / 28.0855
#: Temperature (K) whose enthalpy is zero.
STANDARD_TEMPERATURE = 298.15
#: Constant of Stefan and Boltzmann (W cm⁻² K⁻⁴), CODATA 2018.
STEFAN_BOLTZMANN = 5.670374419e-12
#: Impedance of free space (Ω), CODATA 2018.
FREE_SPACE_OHM = 376.730313668


# --- conducted by silicon -------------------------------------------------------------------------


@law(
    meant_for=(290.0, 1300.0),
    source="Eq. 4; Fulkerson et al., Phys. Rev. 167, 765 (1968)",
    steps=(STEP,),
)
def thermal_conductivity(T: ArrayLike, c_kappa: float = 1.0) -> Evaluated:
    """Thermal conductivity of silicon, c_κ κ_Si(T), in W cm⁻¹ K⁻¹ (Eq. 4).

    Parameters
    ----------
    T : array_like
    c_kappa : float
        Reduction by phonon scattering in a thin structure.

    Examples
    --------
    >>> kappa, _ = thermal_conductivity([300.0, 680.0, 1000.0])
    >>> (100 * kappa).round(1).tolist()  # W/(m K)
    [141.4, 52.5, 30.8]
    """
    T = np.asarray(T, dtype=float)
    above = T - STEP
    step = np.tanh(above)
    resistivity = 0.707 + 3.15e-3 * (T - 300.0) + 5.25e-4 * (1.0 + step) * above
    slope = 3.15e-3 + 5.25e-4 * (1.0 + step + above * (1.0 - step**2))
    silicon = 1.0 / resistivity
    return c_kappa * silicon, {"T": -c_kappa * slope * silicon**2, "c_kappa": silicon}


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
    share, slope = _sondheimer(depth)
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


def _sondheimer(depth: Array) -> tuple[Array, Array]:
    """Sondheimer's Eq. 12 with diffuse surfaces, by thickness over Λ, and its derivative."""
    # loaded where it is wanted, as every command loads this module
    from scipy.special import exp1

    decayed, integrals = np.exp(-depth), [exp1(depth)]
    for order in range(1, 5):  # DLMF 8.19.12; expn would take five times as long
        integrals.append((decayed - depth * integrals[-1]) / order)
    _, second, third, fourth, fifth = integrals
    share = 1.0 - 1.5 * (0.25 - third + fifth) / depth
    slope = (1.0 - share) / depth - 1.5 * (second - fourth) / depth
    return share, slope


# --- held -----------------------------------------------------------------------------------------


@law(
    meant_for=(290.0, 1685.0),
    source="Shomate equation, NIST Chemistry WebBook, SRD 69; Chase, NIST-JANAF (1998)",
)
def heat_capacity(T: ArrayLike) -> Evaluated:
    """Heat capacity of silicon at constant pressure, in J cm⁻³ K⁻¹.

    Examples
    --------
    >>> heat_capacity([300.0, 1000.0])[0].round(4).tolist()
    [1.6624, 2.1827]
    """
    T = np.asarray(T, dtype=float)
    t = np.maximum(T, FORMULA_FROM) / 1000.0
    _, b, c, d, e = _SHOMATE
    slope = (b + (2.0 * c + 3.0 * d * t) * t - 2.0 * e / t**3) / 1000.0
    return _capacity(t), {"T": np.where(T < FORMULA_FROM, 0.0, _PER_VOLUME * slope)}


@law(
    meant_for=(290.0, 1685.0),
    source="Shomate equation, NIST Chemistry WebBook, SRD 69; Chase, NIST-JANAF (1998)",
)
def enthalpy(T: ArrayLike) -> Evaluated:
    """Enthalpy of silicon above that at 298.15 K, in J cm⁻³: the integral of the heat capacity.

    Examples
    --------
    >>> enthalpy([298.15, 1000.0])[0].round(1).tolist()
    [0.0, 1404.8]
    """
    T = np.asarray(T, dtype=float)
    t = np.maximum(T, FORMULA_FROM) / 1000.0
    capacity = _capacity(t)
    below = capacity * np.minimum(T - FORMULA_FROM, 0.0)
    return _integral(t) - _integral(STANDARD_TEMPERATURE / 1000.0) + below, {"T": capacity}


@law(meant_for=(290.0, 600.0), source="values at 298 K; CRC Handbook of Chemistry and Physics")
def enthalpy_by_capacity(T: ArrayLike, heat_capacity: float) -> Evaluated:
    """Enthalpy above that at 298.15 K, in J cm⁻³, of a constant `heat_capacity` (J cm⁻³ K⁻¹).

    Examples
    --------
    >>> enthalpy_by_capacity(398.15, heat_capacity=2.85)[0].item()
    285.0
    """
    above = np.asarray(T, dtype=float) - STANDARD_TEMPERATURE
    return heat_capacity * above, {"T": heat_capacity + 0.0 * above, "heat_capacity": above}


def _capacity(t: Array) -> Array:
    """Shomate's equation by T / 1000 K."""
    a, b, c, d, e = _SHOMATE
    return np.asarray(_PER_VOLUME * (a + (b + (c + d * t) * t) * t + e / t**2))


def _integral(t: Any) -> Any:
    """Return its integral over the temperature."""
    a, b, c, d, e = _SHOMATE
    return 1000.0 * _PER_VOLUME * ((a + (b / 2.0 + (c / 3.0 + d / 4.0 * t) * t) * t) * t - e / t)


# --- radiated -------------------------------------------------------------------------------------


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
