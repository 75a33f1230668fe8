"""What samples are made of: thermal conductivities at room temperature, by name.

Those of levers come from their laws and presets; the rest is here, each with its source.
"""

from __future__ import annotations

import numpy as np

from hotlever.errors import InputError, shown, unknown_name
from hotlever.materials.presets import PRESETS
from hotlever.materials.sections import material_of
from hotlever.materials.silicon import thermal_conductivity
from hotlever.units import product_conversion, quantity

#: Of samples alone: κ (W m⁻¹ K⁻¹), and where it is from.
_OTHERS = {
    "polymer": (
        0.2,
        "amorphous macromolecules have 0.06 to 0.67: X. Xie et al., Phys. Rev. B 95, 035406 (2017)",
    ),
    "glass": (1.14, "borosilicate with 80.6 % SiO₂ at 20 °C: makers' data (0.96 to 1.2)"),
    "quartz": (
        (10.7 * 6.2) ** 0.5,
        "z-cut, as heat spreads: makers' data, 10.7 along the axis and 6.2 across at 25 °C",
    ),
    "sapphire": (
        35.0,
        "300 K: R. L. Aggarwal and A. K. Ramdas, Physical Properties of Diamond and Sapphire "
        "(CRC, 2019), ch. 6, after Cahill et al.",
    ),
}
_AT_K = 300.0
#: What a number may be (W m⁻¹ K⁻¹).
LEAST, MOST = 1e-3, 1e4


def sample_names() -> tuple[str, ...]:
    """Return the materials that a sample may be made of by name."""
    return (*_OTHERS, "silicon", *PRESETS)


def sample_conductivity(text: str, where: str) -> float:
    """Return κ (W m⁻¹ K⁻¹) of a material by its name, or of a number in this unit.

    Raises
    ------
    InputError
        If it is neither; the nearest name is given.

    Examples
    --------
    >>> [round(sample_conductivity(text, "--sample"), 2) for text in ("silicon", "SiO2", "0.3")]
    [141.44, 1.38, 0.3]
    >>> sample_conductivity("2 mW/(cm K)", "--sample")
    0.2
    """
    if text in _OTHERS:
        return _OTHERS[text][0]
    if text == "silicon":
        return 100.0 * float(thermal_conductivity(_AT_K)[0])
    if text in PRESETS:
        kind = material_of({"kind": PRESETS[text].kind, "preset": text}, text)
        return 100.0 * kind.thermal_conductivity(np.array(_AT_K), 1.0)[0].item()
    value, unit = quantity(text)
    if value is None:
        raise unknown_name("material", text, sample_names(), where)
    factor = product_conversion(unit, "W m⁻¹ K⁻¹") if unit else 1.0
    if factor is None or not LEAST <= factor * value <= MOST:
        raise InputError(
            f"{where}: found '{shown(text)}', expected a material or its thermal conductivity, "
            f"{LEAST:g} to {MOST:g} W/(m K)"
        )
    return factor * value


def sources() -> list[list[str]]:
    """Return a row for each material of samples alone: its name, κ (W m⁻¹ K⁻¹), its source."""
    return [[name, f"{kappa:.3g}", source] for name, (kappa, source) in _OTHERS.items()]
