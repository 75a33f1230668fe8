"""Materials as the sections of a probe file hold them, and those that no file can hold.

A file says which of its materials follow laws of their own, those of a class made of a kind in
Python, so that reading it does not give another lever.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from hotlever.errors import InputError, quoted, shown, unknown_name
from hotlever.materials.kind import Kind
from hotlever.materials.kinds import KINDS
from hotlever.materials.parameters import HIGH_DOPED, LOW_DOPED
from hotlever.materials.presets import PRESETS, usual_values
from hotlever.materials.table_files import with_tables

#: Names of materials.
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")
#: The section of stored values in which the classes are named.
LAWS = "laws"


def material_of(
    values: Mapping[str, Any],
    where: str,
    folder: Path | None = None,
    like: Kind | None = None,
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
    like : Kind, optional
        One of the same kind whose class it is to have, with laws of its own.

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
    made = type(like) if like is not None and like.kind == kind else KINDS[kind]
    try:
        stated = with_tables(values, folder)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None
    # of a metal that follows a table the coefficient of a preset has no use
    useless = made.without_use({**usual, **stated})
    usual = {name: value for name, value in usual.items() if name not in useless}
    return made.from_values({**usual, **stated}, where)


def materials_of(
    sections: Mapping[str, Any],
    where: str,
    reserved: Collection[str],
    folder: Path | None = None,
    like: Mapping[str, Kind] | None = None,
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
    like : mapping of str to Kind, optional
        Materials whose classes those of the same name and kind are to have.

    Raises
    ------
    InputError
        See `material_of`.
    """
    materials = {}
    for name, section in sections.items():
        if not _NAME.fullmatch(name) or name in (*reserved, LOW_DOPED, HIGH_DOPED):
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
        materials[name] = material_of(section, here, folder, (like or {}).get(name))
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


# --- laws of their own ----------------------------------------------------------------------------


def own_laws(kinds: Mapping[str, Kind]) -> dict[str, str]:
    """Return the classes of materials that are of no kind of ``KINDS`` itself, by material."""
    return {
        name: f"{type(kind).__module__}.{type(kind).__qualname__}"
        for name, kind in kinds.items()
        if type(kind) is not KINDS.get(kind.kind)
    }


def refuse_own_laws(values: Mapping[str, Any], where: str) -> None:
    """Refuse stored values of a lever with laws of its own.

    Raises
    ------
    InputError
        Naming the first material and its class.
    """
    laws = values.get(LAWS)
    if laws:
        name, law = next(iter(laws.items())) if isinstance(laws, Mapping) else ("material", laws)
        raise InputError(
            f"{where}: '{shown(str(name))}' follows laws of its own, those of the Python class "
            f"{shown(str(law), 80)}, which no file holds: expected the probe made in Python"
        )
