"""Silicon: carriers, mobilities and electrical conductivity, and the doping of a heater.

Equations 5 to 11 of Spieser et al., J. Appl. Phys. 121, 174503 (2017),
doi:10.1063/1.4981883, called "the paper" below. Units are the paper's: cm, V, A, W, K.

The laws take arrays of the temperature `T` (K), the local doping concentration `n` (cm⁻³, see
`tapered_doping`) and the phonon scattering exponent `p`; `carrier` is "electron" or
"hole". What they return, and what happens outside a law's range: `hotlever.materials.laws`. Doped
with boron, whose concentration `n` is then, holes are the majority and electrons the minority.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from hotlever.errors import InputError
from hotlever.materials.laws import FORMULA_TO, Evaluated, Law, law
from hotlever.types import Array

Carrier = Literal["electron", "hole"]
# Density (cm⁻³) and mobility (cm² V⁻¹ s⁻¹) of carriers, and what they are.
Carried = tuple[Evaluated, Evaluated, Carrier]

#: Melting point (K): no state of a lever beyond it is meaningful.
MELTING_POINT = 1687.0
#: Boltzmann constant (eV/K), CODATA 2018.
BOLTZMANN = 8.617333262e-5
#: Elementary charge (C) as rounded in Eq. 5.
ELEMENTARY_CHARGE = 1.6e-19


@law(
    meant_for=(200.0, 1300.0), source="Eq. 7; Berggren and Sernelius, Phys. Rev. B 24, 1971 (1981)"
)
def band_gap(T: ArrayLike, n: ArrayLike) -> Evaluated:
    """Band gap of doped silicon with band-gap narrowing, in eV (Eq. 7, second line).

    Examples
    --------
    >>> band_gap(300.0, 0.0)[0].round(4).item()
    1.1245
    """
    T, n = np.asarray(T, dtype=float), np.asarray(n, dtype=float)
    narrowing = 0.025 * np.cbrt(n / 1e18)
    gap = 1.17 - 4.73e-4 * T**2 / (T + 636.0) - narrowing
    with np.errstate(divide="ignore", invalid="ignore"):
        d_n = -narrowing / (3.0 * n)
    return gap, {"T": -4.73e-4 * T * (T + 2 * 636.0) / (T + 636.0) ** 2, "n": d_n}


@law(meant_for=(200.0, 1300.0), source="Eq. 7; Altermatt et al. (1999)")
def density_of_states(T: ArrayLike) -> Evaluated:
    """Effective density of states of a band of silicon, in cm⁻³ (Eq. 7, first line).

    Eq. 7 has the root of the product of both bands' densities; they differ by some ten per cent,
    and each is taken to be the root.

    Examples
    --------
    >>> f"{density_of_states(300.0)[0]:.2e}"
    '2.70e+19'
    """
    T = np.asarray(T, dtype=float)
    states = 2.70e19 * (T / 300.0) ** 1.5
    return states, {"T": 1.5 * states / T}


@law(meant_for=(200.0, 1300.0), source="Eq. 7; Altermatt et al. (1999)")
def intrinsic_density(
    T: ArrayLike, n: ArrayLike, intrinsic_scale: float = 1.0, gap_law: Law = band_gap
) -> Evaluated:
    """Intrinsic carrier density, in cm⁻³ (Eq. 7, first line); doping narrows the gap.

    Published formulas differ where silicon is hot (`hotlever.materials.parameters`):
    `intrinsic_scale` multiplies that of Eq. 7.

    Examples
    --------
    >>> n_i, _ = intrinsic_density(300.0, 0.0)
    >>> f"{n_i:.2e}"
    '9.68e+09'
    """
    T, (gap, d_gap) = np.asarray(T, dtype=float), gap_law.formula(T, n)
    two_kT = 2.0 * BOLTZMANN * T
    unscaled = density_of_states.formula(T)[0] * np.exp(-gap / two_kT)
    n_i = intrinsic_scale * unscaled
    return n_i, {
        "T": n_i * (1.5 / T + (gap / T - d_gap["T"]) / two_kT),
        "n": -n_i * d_gap["n"] / two_kT,
        "intrinsic_scale": unscaled,
    }


def carriers(
    T: ArrayLike, n: ArrayLike, gap_law: Law, intrinsic_scale: float
) -> tuple[Evaluated, Evaluated]:
    """Return majority and minority carriers (cm⁻³) of doped silicon, which share n_i (Eq. 6)."""
    n = np.asarray(n, dtype=float)
    n_i, d_i = intrinsic_density.formula(T, n, intrinsic_scale, gap_law)
    root = np.sqrt(n**2 + 4.0 * n_i**2)
    majority = 0.5 * (n + root)
    minority = n_i**2 / majority
    # n_e - n_h = n and n_e n_h = n_i² give (n_e + n_h) dn_e = n_e dn + 2 n_i dn_i
    by_pair = {name: 2.0 * n_i * d / root for name, d in d_i.items()}
    d_n = majority / root + by_pair["n"]
    return (majority, {**by_pair, "n": d_n}), (minority, {**by_pair, "n": d_n - 1.0})


@law(meant_for=(290.0, 1300.0), source="Eq. 9")
def impurity_mobility(
    T: ArrayLike, n: ArrayLike, impurity_exponent: float = 0.0, carrier: Carrier = "electron"
) -> Evaluated:
    """Mobility limited by impurity scattering, in cm² V⁻¹ s⁻¹ (Eq. 9).

    It does not depend on the temperature in the paper. Ionised impurities scatter fast carriers
    less, as T^1.5 without screening (Brooks and Herring): an `impurity_exponent` s other than 0
    multiplies by (T / 300 K)^s.

    Examples
    --------
    >>> impurity_mobility(600.0, 1e18)[0].item(), impurity_mobility(600.0, 1e18, 1.0)[0].item()
    (410.0, 820.0)
    """
    T, n = np.asarray(T, dtype=float), np.asarray(n, dtype=float)
    hot = T / 300.0
    # for holes Eq. 9 prints 0.746 for (m_e/m_h)^½; the masses it quotes, 0.33 and 0.55, give 0.775.
    # The printed number is used because the published parameters were fitted with it
    ratio = 1.0 if carrier == "electron" else 0.746
    mobility = ratio * 4.1e11 / np.sqrt(n) * hot**impurity_exponent
    return mobility, {
        "T": impurity_exponent * mobility / T,
        "n": -0.5 * mobility / n,
        "impurity_exponent": mobility * np.log(hot),
    }


@law(meant_for=(290.0, 1300.0), source="Eq. 10; Dürig, J. Appl. Phys. 98, 044906 (2005)")
def phonon_mobility(T: ArrayLike, p: float, carrier: Carrier = "electron") -> Evaluated:
    """Mobility limited by phonon scattering, in cm² V⁻¹ s⁻¹ (Eq. 10).

    Examples
    --------
    >>> phonon_mobility(600.0, p=2.0)[0].item()
    400.0
    """
    T = np.asarray(T, dtype=float)
    cold = 300.0 / T
    ratio = 1.0 if carrier == "electron" else 0.279  # (m_e/m_h)^(5/2)
    mobility = ratio * 1.6e3 * cold**p
    return mobility, {"T": -p * mobility / T, "p": mobility * np.log(cold)}


@law(meant_for=(290.0, 1300.0), source="Eq. 8")
def mobility(
    T: ArrayLike,
    n: ArrayLike,
    p: float,
    impurity_exponent: float = 0.0,
    carrier: Carrier = "electron",
) -> Evaluated:
    """Carrier mobility by Matthiessen's rule, in cm² V⁻¹ s⁻¹ (Eq. 8)."""
    return matthiessen(
        impurity_mobility.formula(T, n, impurity_exponent, carrier),
        phonon_mobility.formula(T, p, carrier),
    )


def matthiessen(by_impurities: Evaluated, by_phonons: Evaluated) -> Evaluated:
    """Return the mobility of two that limit it together."""
    (impurity, d_impurity), (phonon, d_phonon) = by_impurities, by_phonons
    share = 1.0 / (impurity + phonon)
    by_phonon, by_impurity = (impurity * share) ** 2, (phonon * share) ** 2
    return impurity * phonon * share, {
        "T": by_phonon * d_phonon["T"] + by_impurity * d_impurity["T"],
        "p": by_phonon * d_phonon["p"],
        "n": by_impurity * d_impurity["n"],
        "impurity_exponent": by_impurity * d_impurity["impurity_exponent"],
    }


@law(
    meant_for=(200.0, 500.0),
    source="MINIMOS; Selberherr et al., Solid-State Electron. 33, 1425 (1990)",
)
def minimos_mobility(
    T: ArrayLike, n: ArrayLike, p: float, _: float = 0.0, carrier: Carrier = "electron"
) -> Evaluated:
    """Carrier mobility as in MINIMOS, in cm² V⁻¹ s⁻¹: impurities scatter less when it is hot.

    Selberherr et al., Solid-State Electron. 33, 1425 (1990), in place of Eq. 8, whose
    impurity term has no temperature. The exponent of the lattice is 2 there; it is `p` here, since
    levers have higher ones (Table II).

    Examples
    --------
    >>> minimos_mobility([300.0, 800.0], 4e17, p=2.0)[0].round().tolist()
    [466.0, 172.0]
    """
    T, n = np.asarray(T, dtype=float), np.asarray(n, dtype=float)
    # lattice mobility at 300 K, how its exponent differs from that of electrons, mobility at the
    # highest doping, and the doping that halves what is between (cm⁻³)
    of_carrier = {
        "electron": (1430.0, 0.0, 80.0, 1.12e17),
        "hole": (460.0, 0.18, 45.0, 2.23e17),
    }
    lattice_300, steeper, lowest_300, half_300 = of_carrier[carrier]
    hot = T / 300.0
    exponent = p + steeper
    lattice, lowest = lattice_300 * hot**-exponent, lowest_300 * hot**-0.45
    power, doping = 0.72 * hot**0.065, n / (half_300 * hot**3.2)
    scattered = doping**power
    free = 1.0 / (1.0 + scattered)
    by_scattered = -(lattice - lowest) * free**2 * scattered
    scattered_by_T = power * (0.065 * np.log(doping) - 3.2) / T
    lattice_by_T, lowest_by_T = -exponent * lattice / T, -0.45 * lowest / T
    return lowest + (lattice - lowest) * free, {
        "T": lowest_by_T + (lattice_by_T - lowest_by_T) * free + by_scattered * scattered_by_T,
        "p": -lattice * np.log(hot) * free,
        "n": by_scattered * power / n,
    }


@law(meant_for=(290.0, 1300.0), source="Eq. 5")
def conductivity_low_doped(
    T: ArrayLike,
    n: ArrayLike,
    p: float,
    impurity_exponent: float = 0.0,
    mobility_law: Law = mobility,
    intrinsic_scale: float = 1.0,
) -> Evaluated:
    """Electrical conductivity of the low-doped heater and reader, in S cm⁻¹ (Eq. 5)."""
    return conducted(
        carried_in_n_silicon(T, n, p, impurity_exponent, mobility_law, intrinsic_scale)
    )


def carried_in_n_silicon(
    T: ArrayLike,
    n: ArrayLike,
    p: float,
    impurity_exponent: float = 0.0,
    mobility_law: Law = mobility,
    intrinsic_scale: float = 1.0,
) -> list[Carried]:
    """Return the carriers of n-doped silicon (Eqs. 6 to 10)."""
    return [
        (density, mobility_law.formula(T, n, p, impurity_exponent, carrier), carrier)
        for density, carrier in zip(
            carriers(T, n, band_gap, intrinsic_scale), get_args(Carrier), strict=True
        )
    ]


def conducted(carried: Iterable[Carried]) -> Evaluated:
    """Return the conductivity (S cm⁻¹) of carriers of some densities and mobilities (Eq. 5)."""
    sigma: Array = np.zeros(())
    names = ("T", "n", "p", "impurity_exponent", "intrinsic_scale")
    total: dict[str, Array] = dict.fromkeys(names, sigma)
    for (density, d_density), (speed, d_speed), _ in carried:
        sigma = sigma + ELEMENTARY_CHARGE * density * speed
        total = {
            name: total[name]
            + ELEMENTARY_CHARGE
            * (density * d_speed.get(name, 0.0) + d_density.get(name, 0.0) * speed)
            for name in total
        }
    return sigma, total


@law(meant_for=(290.0, 1300.0), source="Eq. 11; Chapman et al., J. Appl. Phys. 34, 3291 (1963)")
def conductivity_high_doped(T: ArrayLike, a0: float, a1: float) -> Evaluated:
    """Electrical conductivity of the quasi-metallic high-doped silicon, in S cm⁻¹ (Eq. 11).

    Parameters
    ----------
    T : array_like
        Meant for temperatures above 300 K.
    a0 : float
        Resistivity at 300 K (Ω cm).
    a1 : float
        Temperature coefficient of the resistivity (Ω cm K⁻¹).

    Examples
    --------
    >>> sigma, _ = conductivity_high_doped(300.0, a0=1e-3, a1=1e-6)
    >>> sigma.item()
    1000.0
    """
    above = np.asarray(T, dtype=float) - 300.0
    sigma = 1.0 / (a0 + a1 * above)
    by_resistivity = -(sigma**2)
    return sigma, {
        "T": by_resistivity * a1,
        "a0": by_resistivity,
        "a1": by_resistivity * above,
    }


def inversion_temperature(
    n: ArrayLike,
    p: ArrayLike,
    impurity_exponent: ArrayLike = 0.0,
    intrinsic_scale: ArrayLike = 1.0,
    conductivity: Callable[..., Evaluated] = conductivity_low_doped,
) -> Array:
    """Temperature T_i (K) at which the resistivity of low-doped silicon is highest, dρ/dT = 0.

    Parameters
    ----------
    n, p, impurity_exponent, intrinsic_scale : array_like
        See `conductivity_low_doped`.
    conductivity : callable
        Law by temperature and these.

    Returns
    -------
    ndarray
        Of the common shape of the arguments; NaN where the resistivity has no maximum between 300
        and 1700 K, as at very high doping.

    Examples
    --------
    >>> inversion_temperature([4.10e17], p=2.64).round(0).tolist()
    [805.0]
    """
    arguments = np.broadcast_arrays(
        *(np.asarray(each, dtype=float) for each in (n, p, impurity_exponent, intrinsic_scale))
    )
    cold, hot = (np.full(arguments[0].shape, T) for T in (300.0, FORMULA_TO))

    def slope(T: Array, n: Array, p: Array, exponent: Array, scale: Array) -> Array:
        others = {"p": p, "impurity_exponent": exponent, "intrinsic_scale": scale}
        sigma, partials = conductivity(T, n, **others)
        return partials["T"] / sigma

    # takes a quarter of a second to load, which not every command has to wait for
    from scipy.optimize import elementwise

    root = elementwise.find_root(slope, (cold, hot), args=tuple(arguments))
    return np.where(root.success, root.x, np.nan)


# --- doped by boron ------------------------------------------------------------------------------


@law(
    meant_for=(200.0, 1300.0),
    source="Klaassen, Slotboom and de Graaff, Solid-State Electron. 35, 125 (1992); gap of Eq. 7",
)
def band_gap_p(T: ArrayLike, n: ArrayLike) -> Evaluated:
    """Band gap of boron-doped silicon with band-gap narrowing, in eV.

    Examples
    --------
    >>> band_gap_p(300.0, [1e16, 1e18])[0].round(4).tolist()
    [1.1239, 1.0955]
    """
    T, n = np.asarray(T, dtype=float), np.asarray(n, dtype=float)
    gap, d_gap = band_gap.formula(T, 0.0)
    log = np.log(n / 1.3e17)
    root = np.sqrt(log**2 + 0.5)
    # the gap narrows by 6.92e-3 eV for each factor e in the doping (cm⁻³) above this
    narrowing = 6.92e-3 * (log + root)
    return gap - narrowing, {"T": d_gap["T"], "n": -narrowing / (root * n)}


@law(
    meant_for=(290.0, 1300.0),
    source="Thurber et al., J. Electrochem. Soc. 127, 2291 (1980); ASTM F723",
)
def hole_mobility(
    T: ArrayLike, n: ArrayLike, p: float, impurity_exponent: float = 0.0
) -> Evaluated:
    """Mobility of holes in boron-doped silicon, in cm² V⁻¹ s⁻¹.

    At 296 K it gives the resistivity by the concentration of boron that Thurber et al. measured,
    which is of the form of Matthiessen's rule. Its share by phonons goes with the temperature as in
    Eq. 10; that by impurities does not, or by an `impurity_exponent` as in
    `impurity_mobility`. Boron that is not ionised at room temperature
    counts as lower mobility.

    Examples
    --------
    >>> hole_mobility(296.0, [1e15, 1e18], p=2.2)[0].round().tolist()
    [470.0, 143.0]
    """
    T, n = np.asarray(T, dtype=float), np.asarray(n, dtype=float)
    hot = T / 296.0
    # resistivity of boron-doped silicon at 23 °C (Thurber et al.; ASTM F723): resistivity times
    # doping (Ω cm⁻²) by phonons and, at the highest doping, by impurities; the inverse of the
    # doping (cm³) above which the latter hardly grows; and the power of its fall below
    phonon = hot**-p / (ELEMENTARY_CHARGE * 1.305e16)
    falls = -0.737
    fallen = (2.58e-19 * n) ** falls
    per_fallen = hot**impurity_exponent / (ELEMENTARY_CHARGE * 1.133e17)
    impurity = per_fallen * (1.0 + fallen)
    return matthiessen(
        (
            impurity,
            {
                "T": impurity_exponent * impurity / T,
                "n": per_fallen * falls * fallen / n,
                "impurity_exponent": impurity * np.log(hot),
            },
        ),
        (phonon, {"T": -p * phonon / T, "p": -phonon * np.log(hot)}),
    )


@law(
    meant_for=(290.0, 1300.0),
    source="Eq. 5; holes: Thurber et al., J. Electrochem. Soc. 127, 2291 (1980); gap: Klaassen et "
    "al., Solid-State Electron. 35, 125 (1992)",
)
def conductivity_p(
    T: ArrayLike,
    n: ArrayLike,
    p: float,
    impurity_exponent: float = 0.0,
    intrinsic_scale: float = 1.0,
) -> Evaluated:
    """Electrical conductivity of silicon doped with boron, in S cm⁻¹.

    Electrons, the minority, move as in silicon doped with as much phosphorus (Eqs. 8 to 10).

    Examples
    --------
    >>> sigma, _ = conductivity_p(296.0, [1e15, 1e20], p=2.2)
    >>> (1.0 / sigma).round(5).tolist()  # Ω cm
    [13.30622, 0.00117]
    """
    return conducted(carried_in_p_silicon(T, n, p, impurity_exponent, intrinsic_scale))


def carried_in_p_silicon(
    T: ArrayLike,
    n: ArrayLike,
    p: float,
    impurity_exponent: float = 0.0,
    intrinsic_scale: float = 1.0,
) -> list[Carried]:
    """Return the carriers of silicon doped with boron; see `conductivity_p`."""
    holes, electrons = carriers(T, n, band_gap_p, intrinsic_scale)
    return [
        (holes, hole_mobility.formula(T, n, p, impurity_exponent), "hole"),
        (electrons, mobility.formula(T, n, p, impurity_exponent), "electron"),
    ]


# --- the doping of a heater -----------------------------------------------------------------------

# The dopant diffuses into the heater from high-doped silicon beside it, while that is annealed.


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
    # of some thousand values, in less time than the import of SciPy's takes
    erfc = np.vectorize(math.erfc, otypes=[float])
    share = 0.5 * erfc(ratio).sum(axis=0)
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
