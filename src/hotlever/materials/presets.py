"""Published values of materials: the paper's two kinds of silicon, metals and dielectrics."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from pydantic import create_model, model_validator

from hotlever.errors import unknown_name
from hotlever.materials.films import SOMMERFELD
from hotlever.materials.kinds import KINDS, HighDopedSilicon, Kind, NSilicon, ScaleOrByThickness
from hotlever.materials.parameters import HIGH_DOPED, LOW_DOPED, OF_SILICON, field_of
from hotlever.records import Record
from hotlever.spieser2017 import (
    FITTED_OBSERVABLES,
    INVERSION_TEMPERATURES_K,
    PUBLISHED_VALUES,
    STANDARD_ERRORS,
)

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


# --- the paper's silicon --------------------------------------------------------------------------

#: A record with a number for each parameter of silicon.
_Numbers: Any = create_model(
    "_Numbers",
    __base__=Record,
    __module__=__name__,
    **dict[str, Any]({name: (float, field_of(each)) for name, each in OF_SILICON.items()}),
)


class Material(_Numbers):
    """Parameters of the laws in Eqs. 4 to 11 (section ``[material]`` of a probe file).

    They are a preset of two kinds of silicon that share what both have: the n-doped one of heater
    and reader, and the high-doped one around it. A class made of it may have others of these kinds,
    whose own parameters are fields of it too.
    """

    c_kappa: ScaleOrByThickness

    #: What the two are, by name.
    classes: ClassVar[Mapping[str, type[Kind]]] = {
        LOW_DOPED: NSilicon,
        HIGH_DOPED: HighDopedSilicon,
    }

    @model_validator(mode="after")
    def _heater_is_the_low_doped_part(self) -> Material:
        if self.n_d >= self.n_hd:
            raise ValueError(f"n_d = {self.n_d:g} must be below n_hd = {self.n_hd:g}")
        return self

    @property
    def kinds(self) -> dict[str, Kind]:
        """The two kinds of silicon, by `LOW_DOPED` and `HIGH_DOPED`."""
        values = dict(self)
        # unchecked, since the values are checked already: fits make many
        return {
            name: kind.model_construct(**{own: values[own] for own in kind.declared})
            for name, kind in self.classes.items()
        }


@dataclass(frozen=True)
class PublishedSet:
    """One row of a table of the paper."""

    name: str
    observables: tuple[str, ...]  #: that were fitted, of ``current``, ``reader``, ``tip``
    material: Material
    standard_error: Mapping[str, float]  #: by parameter; empty where the table prints none
    inversion_temperature_K: float | None  #: as printed, where the table has it


#: Table I (lever 1, by the observables fitted) and Table II (option III, by lever).
PUBLISHED = {
    name: PublishedSet(
        name,
        FITTED_OBSERVABLES.get(name, FITTED_OBSERVABLES["option III"]),
        Material(**values),
        STANDARD_ERRORS.get(name, {}),
        INVERSION_TEMPERATURES_K.get(name),
    )
    for name, values in PUBLISHED_VALUES.items()
}
#: The silicon of the reference probe.
REFERENCE = PUBLISHED["option III"].material


def published(name: str) -> PublishedSet:
    """Return a published parameter set, such as ``option III`` or ``lever 1, n_d fixed``.

    Raises
    ------
    InputError
        If there is no such set; the text gives the nearest name.

    Examples
    --------
    >>> published("option III").material.c_kappa
    0.686
    >>> published("option III").standard_error["c_kappa"]
    0.005
    """
    if name not in PUBLISHED:
        raise unknown_name("published parameter set", name, PUBLISHED)
    return PUBLISHED[name]


def usual_values(kind: str) -> dict[str, Any]:
    """Return the values that parameters of a kind have where a probe file leaves them out."""
    if KINDS[kind].family is not OF_SILICON:
        return {}
    # lattice mobility exponent of holes: Arora et al., IEEE Trans. Electron Devices 29, 292 (1982)
    own = {"p-silicon": {"p": 2.23}}
    values = REFERENCE.model_dump() | own.get(kind, {})
    return {name: values[name] for name in KINDS[kind].declared if name in values}
