"""Materials as the sections of a probe file hold them, and those that no file can hold.

A file says which of its materials follow laws of their own, those of a class made of a kind in
Python; it is read where that class is at hand, so that reading it does not give another lever.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hotlever.errors import InputError, counted, excerpt, quoted, unknown_name
from hotlever.materials.kinds import KINDS, Kind, class_name
from hotlever.materials.parameters import HIGH_DOPED, LOW_DOPED, STATED
from hotlever.materials.presets import PRESETS, Material, usual_values
from hotlever.materials.stated import Table
from hotlever.records import Record
from hotlever.tables import read_table
from hotlever.text import with_unit
from hotlever.units import name_and_unit, product_conversion, unknown_unit


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
    own = {**material.model_dump(exclude_none=True), **values}
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
