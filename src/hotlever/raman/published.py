"""Published numbers of Raman thermometry on silicon, each with its source.

Nothing else in the package states them again.
"""

from __future__ import annotations

from dataclasses import dataclass

from hotlever.materials.spieser2017 import OPERATING_POINTS

ROOM_TEMPERATURE = 293.0
"""K; the base temperature of Spieser et al. 2017, taken for T_RT where a file says nothing."""

SILICON_MELTS = 1687.0
"""K; no silicon line above it."""


@dataclass(frozen=True)
class LinearLaw:
    """T − T_RT = constant + slope·shift, with error ±(error_constant + error_fraction·ΔT).

    Attributes
    ----------
    constant : float
        K.
    slope : float
        K cm.
    error_constant : float
        K.
    error_fraction : float
        Of T − T_RT.
    calibrated_to : float
        Highest temperature of the hot plate, K.
    source : str
    """

    constant: float
    slope: float
    error_constant: float
    error_fraction: float
    calibrated_to: float
    source: str


SPIESER2017 = LinearLaw(
    constant=5.0,
    slope=-41.1,
    error_constant=5.0,
    error_fraction=0.02,
    calibrated_to=900.0,
    source="Spieser et al., J. Appl. Phys. 121, 174503 (2017), section III, doi:10.1063/1.4981883",
)

[KNEE_PREDICTED] = [
    point.tip_K for point in OPERATING_POINTS if point.name == "knee" and point.tip_K is not None
]
"""K; tip temperature at the knee by simulation, Spieser et al. 2017."""
KNEE_MEASURED = 943.0
"""K; the same by Raman with the linear law."""
HIGHEST_TIP_TEMPERATURE = 1150.0
"""K; the hottest tip of Spieser et al. 2017."""

STRESS_SHIFT = 1e-3
"""cm⁻¹ MPa⁻¹; order of magnitude, Spieser et al. 2017 after Ganesan et al. 1970."""
HEATER_STRESS = 20.0
"""MPa; upper bound in the heater from thermo-mechanical simulation, Spieser et al. 2017."""
ABSORBED_FRACTION = 0.10
"""Of the laser light, absorbed in the cantilever, Spieser et al. 2017."""


@dataclass(frozen=True)
class AnharmonicConstants:
    """Constants of Balkanski's law, cm⁻¹: bare phonon, three-phonon and four-phonon term."""

    bare: float
    three_phonon: float
    four_phonon: float
    source: str


BALKANSKI1983 = AnharmonicConstants(
    bare=528.0,
    three_phonon=-2.96,
    four_phonon=-0.174,
    source="Balkanski, Wallis and Haro, Phys. Rev. B 28, 1928 (1983), doi:10.1103/PhysRevB.28.1928",
)
