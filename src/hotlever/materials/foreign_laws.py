"""Materials with laws of their own: classes made of a kind in Python, which no file can hold.

A file says which of its materials they are, so that reading it does not give another lever.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from hotlever.errors import InputError, shown
from hotlever.materials.kinds import KINDS, Kind

#: The section of stored values in which the classes are named.
LAWS = "laws"


def own_laws(kinds: Mapping[str, Kind]) -> dict[str, str]:
    """Return the classes of materials that are of no kind of `KINDS` itself, by material."""
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
