"""What the layers of a drawing are made of, and what part that gives them.

One layer is the *body*, the outline of the lever: ``silicon``, or ``body`` where it is something
else. A layer with a thickness of its own is a *film*, which lies on the body; any other is a
*part* of the body, made of another material than the rest. Layers count where the body is.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from pydantic import Field

from hotlever.errors import InputError, quoted, unknown_name
from hotlever.materials import HIGH_DOPED, KINDS, LOW_DOPED, Kind
from hotlever.materials.kinds import HighDopedSilicon, LowDopedSilicon
from hotlever.probe.drawing.outlines import Ring
from hotlever.records import Record

SILICON, BODY, HEATER = "silicon", "body", "heater"
#: Key of a layer's outlines where a section says what it is made of.
DRAWN = "drawn"
#: Thickness that a film may have (µm).
_THINNEST_UM, _THICKEST_UM = 0.001, 20.0


class Made(Record):
    """What a layer is made of (section ``[layers.NAME]`` of a probe file)."""

    material: str = Field(description="of [materials]")
    thickness_um: float | None = Field(
        default=None,
        ge=_THINNEST_UM,
        le=_THICKEST_UM,
        description="of a film on the body; left out: a part of the body",
    )
    #: That of the material; no key of a probe file.
    kind: str


@dataclass(frozen=True)
class DrawnLayer:
    """Outlines of one layer, and what they are made of; `None` of the silicon of ``[material]``."""

    name: str
    rings: tuple[Ring, ...]
    made: Made | None = None

    @property
    def is_body(self) -> bool:
        """Whether it is the outline of the lever."""
        return self.name in (SILICON, BODY)

    @property
    def thickness_um(self) -> float | None:
        """Of a film (µm); None of the body and its parts."""
        return None if self.made is None else self.made.thickness_um

    @property
    def is_film(self) -> bool:
        """Whether it lies on the body."""
        return self.thickness_um is not None

    @property
    def material(self) -> str:
        """The name of its material."""
        if self.made is not None:
            return self.made.material
        return HIGH_DOPED if self.is_body else LOW_DOPED

    @property
    def kind(self) -> type[Kind]:
        """The kind of its material."""
        if self.made is not None:
            return KINDS[self.made.kind]
        return KINDS["high-doped-silicon" if self.is_body else "n-silicon"]

    @property
    def is_low_doped(self) -> bool:
        """Whether dopant diffuses into it from high-doped silicon beside it."""
        return issubclass(self.kind, LowDopedSilicon)

    @property
    def is_high_doped(self) -> bool:
        """Whether dopant diffuses from it into low-doped silicon beside it."""
        return issubclass(self.kind, HighDopedSilicon)


def made_of(
    layers: Mapping[str, Any], materials: Mapping[str, Kind], where: str
) -> tuple[dict[str, Any], dict[str, Made]]:
    """Return what is drawn of each layer, and what those are made of that say so.

    Raises
    ------
    InputError
        If the body or a heater is missing, a key is wrong, or a material does not exist.
    """
    if (SILICON in layers) == (BODY in layers):
        raise InputError(
            f"{where}: {SILICON} is missing"
            if BODY not in layers
            else f"{where}: {SILICON} and {BODY}: expected one of them, the outline of the lever"
        )
    drawn, made = {}, {}
    for name, given in layers.items():
        if not isinstance(given, Mapping):
            drawn[name] = given
            continue
        here = f"{where.removesuffix(']')}.{name}]"
        values = dict(given)
        if DRAWN not in values:
            raise InputError(f"{here}: {DRAWN} is missing")
        drawn[name] = values.pop(DRAWN)
        material = values.get("material")
        if "kind" in values:
            raise unknown_name("key", "kind", (DRAWN, "material", "thickness_um"), here)
        if isinstance(material, str):
            if not materials:
                raise InputError(f"{here}: material = {quoted(material)}: there is no [materials]")
            if material not in materials:
                raise unknown_name("material", material, materials, here)
            values["kind"] = materials[material].kind
        elif material is not None:
            raise InputError(f"{here}: material = {quoted(material)}: expected a name")
        else:
            values["kind"] = ""
        made[name] = Made.from_values(values, here)
    _check_roles(drawn, made, where)
    return drawn, made


def _check_roles(drawn: Mapping[str, Any], made: Mapping[str, Made], where: str) -> None:
    body = SILICON if SILICON in drawn else BODY
    if body == BODY and BODY not in made:
        raise InputError(
            f'{where}: {BODY}: expected a section [layers.{BODY}] with drawn = "1/0" and material'
        )
    if body in made and made[body].thickness_um is not None:
        raise InputError(
            f"{where}: {body}: thickness_um of the body stands in [probe], expected it there only"
        )
    if HEATER not in drawn and not made:
        raise InputError(f"{where}: {HEATER} is missing")
    if not DrawnLayer(body, (), made.get(body)).is_high_doped:
        for name in drawn:
            if name != body and name not in made:
                raise InputError(
                    f"{where}: {name}: without a material it is low-doped silicon, which "
                    f"{body} is not the surroundings of; expected a section [layers.{name}]"
                )
