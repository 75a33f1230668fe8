"""Every number that Spieser et al. published and that this package uses, each once.

M. Spieser, C. Rawlings, E. Lörtscher, U. Duerig, A. W. Knoll, "Comprehensive modeling of
Joule heated cantilever probes", J. Appl. Phys. 121, 174503 (2017), doi:10.1063/1.4981883,
arXiv:1711.09582: Tables I and II, the operating points, Eq. 12 and k, the Raman thermometer, and
how the measurements were made. The laws of Eqs. 4 to 11 and 13 are in
`hotlever.materials.silicon` and `hotlever.materials.heat`, the tables as sets of parameters in
`hotlever.materials.presets`.
"""

from __future__ import annotations

import math
import statistics
from dataclasses import dataclass

DOI = "10.1063/1.4981883"

# --- the measurement ----------------------------------------------------------------------------

#: Doping concentration of the wafer (cm⁻³), to which the "n_d fixed" rows are held.
NOMINAL_DOPING = 3.3e17
#: The ramp of the bias (V), 25 of them.
RAMP = tuple(1.0 + row * (10.0 / 24.0) for row in range(25))
#: Nominal thickness of the lever and length of its heater (µm).
THICKNESS_UM, HEATER_LENGTH_UM = 0.4, 4.0
#: Temperature of the leg ends, and room temperature of the thermometer (K).
BASE_TEMPERATURE_K = 293.0
#: Annealing that makes the diffusion length: temperature (K) and time (s).
ANNEALING_K, ANNEALING_S = 1150.0 + 273.15, 1800.0

# --- what follows from it: knees, Eq. 12, k ------------------------------------------------------

#: Tip temperature of the knee (K), measured by Raman with the linear law.
KNEE_MEASURED_K = 943.0
#: Hottest tip (K).
HOTTEST_TIP_K = 1150.0
#: Coefficients a (K/mW), b (K with P in mW), m, c (K/mW) and P_th (mW) of the power law, Eq. 12.
POWER_LAW = {
    "linear_K_per_mW": 103.0,
    "nonlinear_K": 11.2,
    "exponent": 3.1,
    "hot_K_per_mW": 213.0,
    "threshold_mW": 2.95,
}
#: How closely T_tip is said to follow it (K), in vacuum and, with P/k, in air.
POWER_LAW_SPREAD_K = 25.0
#: Power at the hottest tip (mW).
HOTTEST_MW = 4.0
#: What the resistance of the legs adds to the temperature of the knee (K).
KNEE_BY_LEGS_K = 15.0
#: Tip temperatures (K) up to which the heater's resistance is the larger one, and from which on
#: that of the legs is (Fig. 5).
HEATER_PREVAILS_K, LEGS_PREVAIL_K = 1200.0, 1300.0
#: Radius (µm) of the sphere of air around the lever.
SPHERE_UM = 60.0
#: Power in air over the power in vacuum at the same tip temperature.
K_IN_AIR = 1.29

# --- the Raman thermometer (section III) ---------------------------------------------------------

#: T − T_RT = constant (K) + slope (K cm) · shift.
RAMAN_CONSTANT_K, RAMAN_SLOPE_K_CM = 5.0, -41.1
#: Its error: a constant (K), and a share of T − T_RT.
RAMAN_ERROR_K, RAMAN_ERROR_SHARE = 5.0, 0.02
#: Highest temperature of the hot plate (K).
RAMAN_CALIBRATED_TO_K = 900.0
#: Shift by stress (cm⁻¹ MPa⁻¹), an order of magnitude, after Ganesan et al. (1970).
STRESS_SHIFT = 1e-3
#: Share of the laser light that the cantilever absorbs.
ABSORBED_SHARE = 0.10

# --- Tables I and II ------------------------------------------------------------------------------


def _printed(
    c_kappa: float, delta: float, n_d: float, p: float, a0: float, a1: float
) -> dict[str, float]:
    """Return a row: c_κ, Δ (µm), n_d (10¹⁷ cm⁻³), p, a₀ (10⁻⁴ Ω cm), a₁ (10⁻⁶ Ω cm K⁻¹)."""
    first = {"c_kappa": c_kappa, "delta": delta, "n_d": 1e17 * n_d}
    return {**first, "p": p, "a0": 1e-4 * a0, "a1": 1e-6 * a1}


#: Parameters of Table I (lever 1, by the observables fitted) and Table II (option III, by lever).
PUBLISHED_VALUES = {
    "option I": _printed(0.744, 0.681, 4.10, 2.64, 5.87, 1.67),
    "option II": _printed(0.675, 0.649, 6.87, 2.80, 9.32, 1.08),
    "option III": _printed(0.686, 0.647, 5.75, 2.65, 9.34, 1.11),
    "lever 1": _printed(0.686, 0.647, 5.75, 2.65, 9.34, 1.11),
    "lever 1, n_d fixed": _printed(0.692, 0.763, 3.30, 2.74, 9.30, 1.12),
    "lever 2": _printed(0.687, 0.719, 3.64, 2.80, 10.2, 1.25),
    "lever 2, n_d fixed": _printed(0.688, 0.735, 3.30, 2.81, 10.2, 1.26),
    "lever 3": _printed(0.688, 0.646, 3.50, 2.85, 10.3, 1.26),
    "lever 3, n_d fixed": _printed(0.690, 0.659, 3.30, 2.86, 10.3, 1.26),
    "lever 4": _printed(0.613, 0.544, 5.93, 2.86, 10.7, 1.23),
    "lever 4, n_d fixed": _printed(0.686, 0.716, 3.30, 2.99, 10.7, 1.26),
}
#: Of Table I, which alone prints them.
STANDARD_ERRORS = {
    "option I": _printed(0.007, 0.030, 0.62, 0.02, 0.21, 0.10),
    "option II": _printed(0.008, 0.053, 1.40, 0.02, 0.06, 0.03),
    "option III": _printed(0.005, 0.051, 0.94, 0.05, 0.15, 0.05),
}
INVERSION_TEMPERATURES_K = {"option I": 805.0, "option II": 851.0, "option III": 831.0}
FITTED_OBSERVABLES = {
    "option I": ("current",),
    "option II": ("current", "reader"),
    "option III": ("current", "reader", "tip"),
}


def _scatter() -> dict[str, tuple[float, float]]:
    """Return mean and widened standard deviation of the logarithms of the levers' parameters.

    The scatter of those of Table II stands for that of any lever of unknown material; it is
    widened, as four levers of one wafer differ less than those of two makers.
    """
    scatter = {}
    for name in PUBLISHED_VALUES["lever 1"]:
        values = [PUBLISHED_VALUES[f"lever {number}"][name] for number in (1, 2, 3, 4)]
        spread = statistics.stdev(map(math.log, values))
        scatter[name] = statistics.geometric_mean(values), 1.5 * spread
    return scatter


#: What is known of the silicon of any lever, by parameter: geometric mean and relative spread of
#: the published ones, half as much again as that of the four levers.
PUBLISHED_SCATTER = _scatter()


@dataclass(frozen=True)
class PublishedPoint:
    """A published state of lever 1 with the option-III parameters (caption of Fig. 7)."""

    name: str
    lever_V: float
    current_mA: float
    tip_K: float | None = None  #: predicted, where it is given


#: In the order of rising temperature.
OPERATING_POINTS = (
    PublishedPoint("plateau", 1.90, 0.95),
    PublishedPoint("knee", 3.06, 0.93, 893.0),
    PublishedPoint("hot", 2.74, 1.43),
)
#: How closely the current is described by every option (share), Section IV.
CURRENT_ERROR = 0.02
#: How far the tip temperature is off above `MISPREDICTED_FROM_K` where the current alone is fitted
#: (K, at most), and up to where it is described by current and reader voltage (K).
MISPREDICTED_K, MISPREDICTED_FROM_K, DESCRIBED_TO_K = 100.0, 850.0, 1100.0
#: Tip temperature of the simulated knee (K).
[KNEE_PREDICTED_K] = [point.tip_K for point in OPERATING_POINTS if point.tip_K is not None]
#: How far the measured knee lies above the predicted one (K).
KNEE_OFF_K = KNEE_MEASURED_K - KNEE_PREDICTED_K
#: Shift of the temperature by thermoelectricity that is not exceeded (nm), Section IV.
SHIFT_NM = 500.0
