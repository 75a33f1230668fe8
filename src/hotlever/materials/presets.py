"""Materials by published values and as files state them: presets, ``[material]``, ``[materials]``.

Presets are the paper's two kinds of silicon, metals and dielectrics. A file says which of its
materials follow laws of their own, those of a class made of a kind in Python; it is read where that
class is at hand, so that reading it does not give another lever.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from pydantic import create_model, model_validator

from hotlever.errors import InputError, counted, excerpt, quoted, unknown_name
from hotlever.materials.films import SOMMERFELD
from hotlever.materials.kinds import (
    KINDS,
    HighDopedSilicon,
    Kind,
    NSilicon,
    ScaleOrByThickness,
    class_name,
)
from hotlever.materials.parameters import HIGH_DOPED, LOW_DOPED, OF_SILICON, STATED, field_of
from hotlever.materials.stated import Table
from hotlever.records import Record
from hotlever.spieser2017 import (
    FITTED_OBSERVABLES,
    INVERSION_TEMPERATURES_K,
    PUBLISHED_VALUES,
    STANDARD_ERRORS,
)
from hotlever.tables import read_table
from hotlever.text import with_unit
from hotlever.units import name_and_unit, product_conversion, unknown_unit

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


# --- sections of a probe file ---------------------------------------------------------------------


def material_of(
    values: Mapping[str, Any],
    where: str,
    folder: Path | None = None,
    material_class: type[Kind] | None = None,
) -> Kind:
    """Make a material of a section of a probe file.

    Parameters
    ----------
    values : mapping
        ``kind``, and parameters; those left out are of the ``preset`` if there is one, and in
        silicon those of the reference probe.
    where : str
        Names the section in an error.
    folder : path, optional
        What names of files of tables are relative to.
    material_class : type, optional
        A class of this kind with laws of its own.

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
    usual = {**usual_values(kind), **_preset(values.get("preset"), kind, where)}
    if material_class is None or not issubclass(material_class, KINDS[kind]):
        material_class = KINDS[kind]
    try:
        stated = with_tables(values, folder)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None
    # of a metal that follows a table the coefficient of a preset has no use
    return material_class.from_values(material_class.useful({**usual, **stated}, stated), where)


def without_preset(values: Mapping[str, Any], stated: Collection[str]) -> dict[str, Any]:
    """Return values of a section, where another preset is to come, without those of its preset.

    What differs from the preset was said beside it, and stays, as do those that are `stated`.
    """
    preset = PRESETS.get(values.get("preset", ""))
    of_preset = {} if preset is None else preset.values
    return {
        name: value
        for name, value in values.items()
        if name in stated or name not in of_preset or value != of_preset[name]
    }


def remade(
    material: Kind | Material, material_class: type[Record], values: Mapping[str, Any], name: str
) -> Record:
    """Return a material as one of a class of one's own; see `Probe.with_material`.

    Raises
    ------
    InputError
        If the class is none for it, or a value is impossible.
    """
    base = KINDS[material.kind] if isinstance(material, Kind) else Material
    if not issubclass(material_class, base):
        raise InputError(
            f"{name}: found {material_class.__name__}, expected a class made of {base.__name__}"
        )
    own = material.model_dump(exclude_none=True)
    if values.get("preset") is not None:
        own = without_preset(own, values)
    own = {**own, **values}
    if not issubclass(material_class, Kind):
        return material_class.from_values(own, f"[{name}]")
    own = material_class.useful(own, values)
    return material_of(own, f"[{name}]", material_class=material_class)


def materials_of(
    sections: Mapping[str, Any],
    where: str,
    reserved: Collection[str],
    folder: Path | None = None,
    classes: Mapping[str, type[Record]] | None = None,
) -> dict[str, Kind]:
    """Make all materials of the section ``[materials]`` of a probe file.

    Parameters
    ----------
    sections : mapping
        Of `material_of`, or materials as they are, by name.
    where : str
        Names the file in an error.
    reserved : collection of str
        Names that no material may have.
    folder : path, optional
        What names of files are relative to.
    classes : mapping of str to type, optional
        Those that materials are to have, as far as they are of the kind.

    Raises
    ------
    InputError
        See `material_of`.
    """
    materials = {}
    for name, section in sections.items():
        taken = name in (*reserved, LOW_DOPED, HIGH_DOPED)
        if taken or not re.fullmatch("[A-Za-z][A-Za-z0-9_-]*", name):
            raise InputError(
                f"{where}: [materials]: {quoted(name)} cannot be the name of a material, expected "
                "a letter, then letters, digits, - or _; and no section's name"
            )
        here = f"{where}: [materials.{name}]"
        if isinstance(section, Kind):
            materials[name] = section
            continue
        if not isinstance(section, dict):
            raise InputError(f"{here} must be a section, found {quoted(section)}")
        material_class: Any = (classes or {}).get(name)
        materials[name] = material_of(section, here, folder, material_class)
    return materials


def _preset(name: Any, kind: str, where: str) -> Mapping[str, float]:
    if name is None:
        return {}
    names = [preset_name for preset_name, preset in PRESETS.items() if preset.kind == kind]
    if not names:
        raise InputError(f"{where}: preset = {quoted(name)}: {kind} has no presets")
    if name not in names:
        raise unknown_name("preset", str(name), names, where)
    return PRESETS[name].values


# --- laws in files ------------------------------------------------------------------------------


def read_law(path: str | Path, name: str, called: str | None = None) -> Table:
    """Read a law of a property from a file of two columns.

    The first is the temperature (K or °C), the second the property, in any unit of its kind; a
    header row says which. Falling temperatures are turned round.

    Parameters
    ----------
    path : path
    name : str
        ``resistivity``, ``kappa``, ``heat_capacity``, ``seebeck`` or ``emissivity``.
    called : str, optional
        What the table says it is from, in place of the file's name.

    Raises
    ------
    InputError
        If the file holds no such table; the text names file and line.
    """
    unit = STATED[name][0]
    table = read_table(path, f"a header row like 'T (K),{name} ({unit})' and rows of numbers")
    if len(table.names) != 2:
        raise InputError(
            f"{table.where(-1)}: {counted(len(table.names), 'column')}, expected two, temperature "
            f"and {name}"
        )
    units = [name_and_unit(heading)[1] for heading in table.names]
    if units[0] is None or (units[1] is None and unit != "1"):
        heading = table.names[0 if units[0] is None else 1]
        raise InputError(
            f"{table.where(-1)}: column {quoted(heading)} has no unit, expected a header row like "
            f"'T (K),{name} ({unit})'"
        )
    T = table.values(0, "K", "temperature")
    factor = product_conversion(units[1] or "1", unit)
    if factor is None:
        raise unknown_unit(units[1] or "", unit, f"{table.where(-1)}: {table.names[1]}")
    values = factor * table.numbers(1, name)
    empty = np.isnan(T + values)
    if empty.any():
        row = int(empty.argmax())
        raise InputError(f"{table.where(row)}: a cell is empty, expected a number in each")
    low, high = STATED[name][1]
    wrong = ~((values >= low) & (values <= high))
    if wrong.any():
        row = int(wrong.argmax())
        raise InputError(
            f"{table.where(row)}: {name} is {with_unit(f'{values[row]:.4g}', unit)}, expected "
            f"{low:g} to {high:g}"
        )
    if T.size > 1 and T[0] > T[-1]:
        T, values = T[::-1], values[::-1]
    columns = {"temperature_K": T.tolist(), "values": values.tolist()}
    return Table.from_values({"file": called or Path(path).name, **columns}, str(path))


def with_tables(values: Mapping[str, Any], folder: Path | None) -> dict[str, Any]:
    """Return a section of a material with the tables that it names files of.

    Parameters
    ----------
    values : mapping
        In which a property may be the name of a file that ends in .csv, .tsv, .txt or .dat.
    folder : path, optional
        What names of files are relative to.

    Raises
    ------
    InputError
        If a file holds no table of the property.
    """
    read = dict(values)
    for name, value in values.items():
        # a file with a table of two columns, the temperature and the property
        file = r"(?i).+\.(csv|tsv|txt|dat)"
        if name in STATED and isinstance(value, str) and re.fullmatch(file, value.strip()):
            try:
                read[name] = read_law((folder or Path()) / value, name, value)
            except InputError as error:
                raise InputError(f"{name}: {error}") from None
    return read


# --- laws of their own ----------------------------------------------------------------------------


def classes_at_hand(laws: Any, where: str) -> dict[str, type[Record]]:
    """Return the classes that stored values of a lever with laws of its own name, by section.

    A file says which class it was, and holds no law: nothing is imported that a file names.

    Raises
    ------
    InputError
        Naming the first material whose class was not imported before.
    """
    if not isinstance(laws, Mapping):
        raise InputError(f"{where}: [laws] must be a section, found {quoted(laws)}")
    # of classes made again under a name, in a notebook, the last
    classes = {class_name(each): each for base in (Kind, Material) for each in _made_of(base)}
    for name, law in laws.items():
        if str(law) not in classes:
            raise InputError(
                f"{where}: '{excerpt(str(name))}' follows laws of its own, those of the Python "
                f"class {excerpt(str(law), 80)}, which no file holds: expected Python that has "
                "imported it"
            )
    return {name: classes[law] for name, law in laws.items()}


def _made_of(base: type[Record]) -> list[type[Record]]:
    """Return all classes made of one."""
    direct = base.__subclasses__()
    return [*direct, *(each for own in direct for each in _made_of(own))]
