"""Published values of materials, and materials of what a probe file says of them."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

from hotlever.errors import InputError, quoted, unknown_name
from hotlever.materials.kinds import KINDS, Kind
from hotlever.materials.material import HIGH_DOPED, LOW_DOPED
from hotlever.materials.metal import SOMMERFELD
from hotlever.spieser2017 import published

_CRC = (
    "CRC Handbook of Chemistry and Physics, resistivity at 293 and 400 K, κ at 300 K, heat "
    "capacity at 298 K"
)


@dataclass(frozen=True)
class Preset:
    """Values of one material, and where they are from."""

    kind: str
    values: Mapping[str, float]
    source: str


def _metal(
    at_293: float, at_400: float, kappa: float, melts_K: float, heat_capacity: float, source: str
) -> Preset:
    """Make a preset of two resistivities (µΩ cm), κ at 300 K (W m⁻¹ K⁻¹) and c (J cm⁻³ K⁻¹)."""
    tcr = (at_400 / at_293 - 1.0) / 107.0
    by_electrons = SOMMERFELD * 300.0 / (1e-6 * at_293 * (1.0 + 7.0 * tcr))
    values = {
        "resistivity": round(1e-6 * at_293, 9),
        "tcr": round(tcr, 6),
        "lorenz_ratio": round(0.01 * kappa / by_electrons, 3),
        "melting_point_K": melts_K,
        "heat_capacity": heat_capacity,
    }
    return Preset("metal-film", values, source)


#: By the name that goes with ``preset = "..."``.
PRESETS: dict[str, Preset] = {
    "Pt": _metal(10.5, 14.6, 71.6, 2041.0, 2.85, _CRC),
    "Pd": _metal(10.54, 14.48, 71.8, 1828.0, 2.93, f"{_CRC}; Matula, JPCRD 8, 1147 (1979)"),
    "Cr": _metal(12.5, 15.8, 93.9, 2180.0, 3.21, _CRC),
    "Au": _metal(2.214, 3.107, 318.0, 1337.0, 2.49, f"{_CRC}; Matula, JPCRD 8, 1147 (1979)"),
    "NiCr": _metal(
        *(108.0, 109.3, 13.4, 1673.0, 3.78),
        "80 % Ni, 20 % Cr: makers' data (108 µΩ cm and 1.1e-4 K⁻¹ at 293 K, κ 13.4 W/(m K), "
        "0.45 J/(g K))",
    ),
    "SiN": Preset(
        "dielectric",
        {"kappa": 0.032, "kappa_exponent": 0.33, "heat_capacity": 2.1},
        "LPCVD, low stress: Mastrangelo et al., Sens. Actuators A 23, 856 (1990), 3.0 g/cm³ and "
        "0.7 J/(g K); m of SiO₂",
    ),
    "SiO2": Preset(
        "dielectric",
        {"kappa": 0.0138, "kappa_exponent": 0.33, "heat_capacity": 1.63},
        "fused: Touloukian et al., Thermophysical Properties of Matter 2 (1970), 300 to 600 K",
    ),
}

#: Lattice mobility exponent of holes; Arora et al., IEEE Trans. Electron Devices 29, 292 (1982).
_HOLES = 2.23
#: Names of materials.
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")


def _reference() -> dict[str, Any]:
    """Return values for all parameters of silicon: those of the reference probe."""
    return published("option III").material.model_dump()


def usual_values(kind: str) -> dict[str, Any]:
    """Return the values that parameters of a kind have where a probe file leaves them out."""
    if not kind.endswith("silicon"):
        return {}
    known = _reference() | ({"p": _HOLES} if kind == "p-silicon" else {})
    return {name: known[name] for name in KINDS[kind].declared}


def material_of(values: Mapping[str, Any], where: str) -> Kind:
    """Make a material of a section of a probe file.

    Parameters
    ----------
    values : mapping
        ``kind``, and parameters; those left out are of the ``preset`` if there is one, and in
        silicon those of the reference probe.
    where : str
        Names the section in an error.

    Raises
    ------
    InputError
        If the kind or the preset is unknown, or a parameter is missing, misspelt or impossible.

    Examples
    --------
    >>> material_of({"kind": "metal-film", "preset": "Pt", "tcr": 2e-3}, "here").resistivity
    1.05e-05
    """
    kind = values.get("kind")
    if kind is None:
        raise InputError(f"{where}: kind is missing (one of: {', '.join(KINDS)})")
    if not isinstance(kind, str) or kind not in KINDS:
        raise unknown_name("kind", str(kind), KINDS, where)
    given = {**usual_values(kind), **_preset(values.get("preset"), kind, where), **values}
    return KINDS[kind].from_values(given, where)


def materials_of(
    sections: Mapping[str, Any], where: str, reserved: Collection[str]
) -> dict[str, Kind]:
    """Make all materials of the section ``[materials]`` of a probe file.

    Parameters
    ----------
    sections : mapping
        Of `material_of`, by name.
    where : str
        Names the file in an error.
    reserved : collection of str
        Names that no material may have.

    Raises
    ------
    InputError
        See `material_of`.
    """
    found = {}
    for name, section in sections.items():
        if not _NAME.fullmatch(name) or name in (*reserved, LOW_DOPED, HIGH_DOPED):
            raise InputError(
                f"{where}: [materials]: {quoted(name)} cannot be the name of a material, expected "
                "a letter, then letters, digits, - or _; and no section's name"
            )
        here = f"{where}: [materials.{name}]"
        if not isinstance(section, dict):
            raise InputError(f"{here} must be a section, found {quoted(section)}")
        found[name] = material_of(section, here)
    return found


def _preset(name: Any, kind: str, where: str) -> Mapping[str, float]:
    if name is None:
        return {}
    known = [one for one, preset in PRESETS.items() if preset.kind == kind]
    if not known:
        raise InputError(f"{where}: preset = {quoted(name)}: {kind} has no presets")
    if name not in known:
        raise unknown_name("preset", str(name), known, where)
    return PRESETS[name].values
