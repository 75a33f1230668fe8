"""Materials as the sections of a probe file hold them, and those that no file can hold.

A file says which of its materials follow laws of their own, those of a class made of a kind in
Python, so that reading it does not give another lever.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from typing import Any

from hotlever.errors import InputError, quoted, shown, unknown_name
from hotlever.materials.kinds import KINDS, Kind
from hotlever.materials.parameters import HIGH_DOPED, LOW_DOPED
from hotlever.materials.presets import PRESETS, usual_values

#: Names of materials.
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")
#: The section of stored values in which the classes are named.
LAWS = "laws"


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
    materials = {}
    for name, section in sections.items():
        if not _NAME.fullmatch(name) or name in (*reserved, LOW_DOPED, HIGH_DOPED):
            raise InputError(
                f"{where}: [materials]: {quoted(name)} cannot be the name of a material, expected "
                "a letter, then letters, digits, - or _; and no section's name"
            )
        here = f"{where}: [materials.{name}]"
        if not isinstance(section, dict):
            raise InputError(f"{here} must be a section, found {quoted(section)}")
        materials[name] = material_of(section, here)
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


def with_laws_of(before: Any, probe: Any) -> Any:
    """Return a probe whose materials follow the laws that those of the same name had before."""
    if not own_laws(before.kinds):
        return probe
    materials = dict(probe.materials)
    for name, kind in materials.items():
        old = before.materials.get(name)
        if old is not None and old.kind == kind.kind:
            materials[name] = type(old).from_values(kind.model_dump(), name)
    material = type(before.material).from_values(probe.material.model_dump(), "material")
    return probe.model_copy(update={"material": material, "materials": materials})
