"""The material laws of the peer, stated in UFL from the sources.

Each kind of material has two functions of the temperature [K]: its thermal conductivity
[mW/(um K)] and, if it conducts, its electrical conductivity [mA/(V um)].  Doping and carrier
densities are in cm^-3 and mobilities in cm^2/(V s), as they are printed.  Equations are those of
Spieser et al., J. Appl. Phys. 121, 174503 (2017), by their number ("dp" is the doping profile,
which has none).  The sign of Eq. 1 is corrected; the ratio of the hole and electron impurity
mobilities is the printed 0.746, which is not (0.33 / 0.55)^(1/2) = 0.775.
"""

from itertools import pairwise

import dolfin as df
import ufl

BOLTZMANN_EV_PER_K = 8.617333262e-5
ELEMENTARY_CHARGE_C = 1.6e-19
IMPURITY_MOBILITY_RATIO = 0.746  # hole / electron, as printed below Eq. 9
PHONON_MOBILITY_RATIO = 0.279  # hole / electron, Eq. 10
REFERENCE_TEMPERATURE_K = 300.0
LORENZ_NUMBER = 2.443e-8  # V^2/K^2, Sommerfeld's
METAL_STATED_AT_K = 293.0
BORON_MEASURED_AT_K = 296.0  # by Thurber et al.

MA_PER_V_UM_FROM_S_PER_CM = 0.1  # 1 S/cm = 0.1 mA/(V um)
MW_PER_UM_K_FROM_W_PER_CM_K = 0.1  # 1 W/(cm K) = 0.1 mW/(um K)


# --- Silicon --------------------------------------------------------------------------------


def enthalpy(temperature):
    """Return the heat [nJ/um^3] of silicon, by Shomate's equation (NIST Chemistry WebBook)."""
    t = temperature / 1000.0
    kilojoule_per_mol = (
        22.81719 * t
        + 3.899510 * t**2 / 2.0
        - 0.082885 * t**3 / 3.0
        + 0.042111 * t**4 / 4.0
        + 0.354063 / t
    )
    return kilojoule_per_mol * 2.329 / 28.0855  # 1 kJ/cm^3 = 1 nJ/um^3


def silicon_heat(temperature, material):
    """Return kappa, Eq. 4.

    The argument of tanh is clipped at +-40, where tanh is +-1 to machine precision, because UFL
    differentiates tanh to a ratio of cosh that overflows for large arguments.
    """
    above_step = temperature - 680.0
    clipped = ufl.max_value(ufl.min_value(above_step, 40.0), -40.0)
    resistivity_cm_k_per_w = (
        0.707
        + 3.15e-3 * (temperature - REFERENCE_TEMPERATURE_K)
        + 5.25e-4 * (1.0 + ufl.tanh(clipped)) * above_step
    )
    return MW_PER_UM_K_FROM_W_PER_CM_K * material["c_kappa"] / resistivity_cm_k_per_w


def high_doped_charge(temperature, material, doping):
    """Return sigma_hd, Eq. 11; the doping is in its resistivity."""
    resistivity_ohm_cm = material["a0"] + material["a1"] * (temperature - REFERENCE_TEMPERATURE_K)
    return MA_PER_V_UM_FROM_S_PER_CM / resistivity_ohm_cm


def states(temperature):
    """Return the effective density of states of a band, Eq. 7."""
    return 2.70e19 * (temperature / REFERENCE_TEMPERATURE_K) ** 1.5


def carriers(temperature, material, doping, narrowing_ev):
    """Return majority and minority carriers, Eqs. 6 and 7; the intrinsic ones may be scaled."""
    band_gap_ev = 1.17 - 4.73e-4 * temperature**2 / (temperature + 636.0) - narrowing_ev
    intrinsic = (
        material["intrinsic_scale"]
        * states(temperature)
        * ufl.exp(-band_gap_ev / (2.0 * BOLTZMANN_EV_PER_K * temperature))
    )
    majority = (doping + ufl.sqrt(doping**2 + 4.0 * intrinsic**2)) / 2.0
    return majority, intrinsic**2 / majority


def mobility_beside_phosphorus(temperature, material, doping, impurity_ratio=1.0, phonon_ratio=1.0):
    """Return the mobility of electrons, or with the ratios that of holes, Eqs. 8 to 10.

    The impurities' share does not depend on the temperature in Eq. 9.
    """
    relative = temperature / REFERENCE_TEMPERATURE_K
    impurity = impurity_ratio * 4.1e11 / ufl.sqrt(doping) * by_exponent(relative, material)
    phonon = phonon_ratio * 1.6e3 * relative ** (-material["p"])
    return 1.0 / (1.0 / impurity + 1.0 / phonon)


def by_exponent(relative, material):
    """Return the power of a temperature by which impurities scatter less, 1 where none is given."""
    exponent = material.get("impurity_exponent")
    return 1.0 if exponent is None else relative**exponent


def n_silicon_carried(temperature, material, doping):
    """Return the carriers of silicon doped with phosphorus, Eqs. 5 to 10.

    Of each kind the sign of its charge, its density, and its conductivity [S/cm].
    """
    narrowing_ev = 0.025 * (doping / 1e18) ** (1.0 / 3.0)
    electrons, holes = carriers(temperature, material, doping, narrowing_ev)
    ratios = IMPURITY_MOBILITY_RATIO, PHONON_MOBILITY_RATIO
    of_electrons = electrons * mobility_beside_phosphorus(temperature, material, doping)
    of_holes = holes * mobility_beside_phosphorus(temperature, material, doping, *ratios)
    return [
        (-1, electrons, ELEMENTARY_CHARGE_C * of_electrons),
        (+1, holes, ELEMENTARY_CHARGE_C * of_holes),
    ]


def p_silicon_carried(temperature, material, doping):
    """Return the carriers of silicon doped with boron, as of that with phosphorus.

    Holes: the resistivity at 23 C by the boron density N of Thurber et al., J. Electrochem. Soc.
    127, 2291 (1980), as in ASTM F723,

        rho = 1.305e16 / N + 1.133e17 / (N (1 + (2.58e-19 N)^-0.737))   [ohm cm],

    whose first term is taken as that of the phonons, which grows as T^p, and whose second as that
    of the impurities, which falls as T^s (s the impurity exponent).  Electrons, the minority: as
    beside as much phosphorus.  Band gap: its narrowing is that of Klaassen, Slotboom and de Graaff,
    Solid-State Electron. 35, 125 (1992).
    """
    logarithm = ufl.ln(doping / 1.3e17)
    narrowing_ev = 6.92e-3 * (logarithm + ufl.sqrt(logarithm**2 + 0.5))
    holes, electrons = carriers(temperature, material, doping, narrowing_ev)
    relative = temperature / BORON_MEASURED_AT_K
    by_phonons = 1.305e16 / doping * relative ** material["p"]
    by_impurities = 1.133e17 / (doping * (1.0 + (2.58e-19 * doping) ** (-0.737)))
    by_impurities = by_impurities / by_exponent(relative, material)
    # the sum is a resistivity where all carriers are those of the boron
    of_holes = holes / doping / (by_phonons + by_impurities)
    of_electrons = electrons * mobility_beside_phosphorus(temperature, material, doping)
    return [(+1, holes, of_holes), (-1, electrons, ELEMENTARY_CHARGE_C * of_electrons)]


# What carries a current in low-doped silicon of each kind.
CARRIED = {"n-silicon": n_silicon_carried, "p-silicon": p_silicon_carried}


def low_doped_charge(kind):
    """Return the electrical conductivity of low-doped silicon of a kind, Eq. 5, as a function."""

    def charge(temperature, material, doping):
        carried = CARRIED[kind](temperature, material, doping)
        return MA_PER_V_UM_FROM_S_PER_CM * sum(s_per_cm for _, _, s_per_cm in carried)

    return charge


# --- Films ----------------------------------------------------------------------------------


def metal_resistivity(temperature, material):
    """Return the resistivity of a metal film [ohm cm], linear in the temperature."""
    return material["resistivity"] * (1.0 + material["tcr"] * (temperature - METAL_STATED_AT_K))


def metal_charge(temperature, material, doping):
    """Return the electrical conductivity of a metal film."""
    return MA_PER_V_UM_FROM_S_PER_CM / metal_resistivity(temperature, material)


def metal_heat(temperature, material):
    """Return the thermal conductivity of a metal film: stated, or by Wiedemann and Franz."""
    if "kappa" in material:
        return MW_PER_UM_K_FROM_W_PER_CM_K * material["kappa"]
    lorenz = LORENZ_NUMBER * material["lorenz_ratio"]
    w_per_cm_k = lorenz * temperature / metal_resistivity(temperature, material)
    return MW_PER_UM_K_FROM_W_PER_CM_K * w_per_cm_k


def dielectric_heat(temperature, material):
    """Return the thermal conductivity of a dielectric, a power of T / 300 K."""
    relative = temperature / 300.0
    return MW_PER_UM_K_FROM_W_PER_CM_K * material["kappa"] * relative ** material["kappa_exponent"]


# Thermal and electrical conductivity of each kind; None where it does not conduct.
LAWS = {
    "n-silicon": (silicon_heat, low_doped_charge("n-silicon")),
    "p-silicon": (silicon_heat, low_doped_charge("p-silicon")),
    "high-doped-silicon": (silicon_heat, high_doped_charge),
    "metal-film": (metal_heat, metal_charge),
    "dielectric": (dielectric_heat, None),
}


# --- Doping ---------------------------------------------------------------------------------


def doping_in(position, taper, low, high):
    """Return n_ld [cm^-3] at a position of a low-doped part beside a high-doped material.

    The part is a strip with a centre, an axis and a length (Eq. dp), or has any outline and lists
    of points along its borders [um]; then the distance to each border stands in the same error
    functions.
    """
    if "borders_um" in taper:
        distances = [distance_to(position, border) for border in taper["borders_um"]]
    else:
        along = df.dot(position - df.Constant(taper["centre_um"]), df.Constant(taper["axis"]))
        half = df.Constant(taper["length_um"]) / 2.0
        distances = [half - along, half + along]
    share = sum((1.0 - ufl.erf(distance / low["delta"])) / 2.0 for distance in distances)
    if "borders_um" in taper:
        share = ufl.min_value(share, 1.0)
    return low["n_d"] + (high["n_hd"] - low["n_d"]) * share


def distance_to(position, border):
    """Return the distance [um] to a line of points."""
    squares = []
    for start, end in pairwise(border):
        a, along = df.Constant(start), df.Constant([end[0] - start[0], end[1] - start[1]])
        where = df.dot(position - a, along) / df.dot(along, along)
        away = position - a - ufl.max_value(0.0, ufl.min_value(1.0, where)) * along
        squares.append(df.dot(away, away))
    nearest = squares[0]
    for square in squares[1:]:
        nearest = ufl.min_value(nearest, square)
    return ufl.sqrt(nearest)
