"""What is drawn: layers and what they are made of, terminals and what they hold.

One layer is the *body*, the outline of the lever: ``silicon``, or ``body`` where it is something
else. A layer with a thickness of its own is a *film*, which lies on the body; any other is a
*part* of the body, made of another material than the rest. Layers count where the body is.
"""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from typing import Any

from pydantic import Field

from hotlever.errors import InputError, quoted, unknown_name
from hotlever.materials import HIGH_DOPED, KINDS, LOW_DOPED
from hotlever.materials.kinds import HighDopedSilicon, LowDopedSilicon
from hotlever.probe.drawing.outlines import Ring
from hotlever.probe.shapes import EDGE_BIAS, edge_bias
from hotlever.records import Record, bounded


class DrawnPart(Record):
    """What has outlines in a drawing; one of two points is a line."""

    name: str
    drawn: tuple[Ring, ...]

    @property
    def part(self) -> str:
        """How it is named among the parts of a drawing."""
        return self.name

    def scaled(self, scale: float) -> Any:
        """Return it some times as large."""
        rings = tuple(tuple((scale * x, scale * y) for x, y in ring) for ring in self.drawn)
        return self if scale == 1.0 else self.model_copy(update={"drawn": rings})


class DrawnTerminal(DrawnPart):
    """Outlines and lines of one terminal, and whether what lies below them is all contact."""

    by_area: bool

    @property
    def part(self) -> str:
        """How it is named among the parts of a drawing."""
        return terminal_part(self.name)

    def section(self) -> Any:
        """Return its value in ``[terminals]``."""
        return {"area": self.drawn} if self.by_area else self.drawn


class DrawnLayer(DrawnPart):
    """Outlines of one layer, and what they are made of (section ``[layers.NAME]``)."""

    material: str = Field(description="of [materials]")
    thickness_um: float | None = bounded(
        "of a film on the body; left out: a part of the body", 0.001, 20.0, None
    )
    edge_bias_um: float = edge_bias("edges of outline or window lie so far outside the drawing")
    #: That of the material; no key of a probe file.
    kind: str

    @property
    def is_body(self) -> bool:
        """Whether it is the outline of the lever."""
        return self.name in ("silicon", "body")

    @property
    def window_bias_um(self) -> float:
        """How far outside the drawing dopant diffuses from; the outline is no window."""
        return 0.0 if self.is_body else self.edge_bias_um

    @property
    def is_film(self) -> bool:
        """Whether it lies on the body."""
        return self.thickness_um is not None

    @property
    def is_plain(self) -> bool:
        """Whether it is of the silicon of ``[material]``, and so has no section of its own."""
        return self.material in (LOW_DOPED, HIGH_DOPED)

    @property
    def conducts(self) -> bool:
        """Whether it carries a current."""
        return KINDS[self.kind].conducts

    @property
    def is_low_doped(self) -> bool:
        """Whether dopant diffuses into it from high-doped silicon beside it."""
        return issubclass(KINDS[self.kind], LowDopedSilicon)

    @property
    def is_high_doped(self) -> bool:
        """Whether dopant diffuses from it into low-doped silicon beside it."""
        return issubclass(KINDS[self.kind], HighDopedSilicon)

    def section(self) -> Any:
        """Return its value in ``[layers]``."""
        unsaid = {"name", "kind"} | ({"material", "thickness_um"} if self.is_plain else set())
        if not self.edge_bias_um:
            unsaid |= {EDGE_BIAS}
            if self.is_plain:
                return self.drawn
        return self.model_dump(exclude=unsaid)


def terminal_part(name: str) -> str:
    """Return how a terminal is named among the parts of a drawing."""
    return f"terminal '{name}'"


def layer_values(
    section: Mapping[str, Any], kinds: Mapping[str, str], where: str
) -> dict[str, dict[str, Any]]:
    """Return what ``[layers]`` says of each layer, its outlines as they are given.

    Raises
    ------
    InputError
        If the body or a heater is missing, a key is wrong, or a material does not exist.
    """
    if "silicon" in section and "body" in section:
        raise InputError(
            f"{where}: silicon and body: expected one of them, the outline of the lever"
        )
    body = "body" if "body" in section else "silicon"
    if body not in section:
        raise _missing("silicon", section, where)
    # of the silicon of [material] more than outlines may be said
    named = {
        name
        for name, entry in section.items()
        if isinstance(entry, Mapping) and entry.keys() != {"drawn", EDGE_BIAS}
    }
    layers = {}
    for name, entry in section.items():
        own = dict(entry) if isinstance(entry, Mapping) else {"drawn": entry}
        if name in named:
            own = _of_material(entry, kinds, f"{where.removesuffix(']')}.{name}]")
        elif name == body:
            own |= {"material": HIGH_DOPED, "kind": "high-doped-silicon"}
        else:
            own |= {"material": LOW_DOPED, "kind": "n-silicon"}
        layers[name] = {"name": name, **own}
    if "body" in section and "body" not in named:
        raise InputError(
            f'{where}: body: expected a section [layers.body] with drawn = "1/0" and material'
        )
    if layers[body].get("thickness_um") is not None:
        raise InputError(
            f"{where}: {body}: thickness_um of the body stands in [probe], expected it there only"
        )
    if "heater" not in layers and not named:
        raise InputError(f"{where}: heater is missing")
    low_doped = next((name for name in layers if name != body and name not in named), None)
    if low_doped and not issubclass(KINDS[layers[body]["kind"]], HighDopedSilicon):
        raise InputError(
            f"{where}: {low_doped}: without a material it is low-doped silicon, which "
            f"{body} is not the surroundings of; expected a section [layers.{low_doped}]"
        )
    return layers


def _missing(name: str, section: Mapping[str, Any], where: str) -> InputError:
    """Return the error for a name that a section lacks, with the one that may be meant by it."""
    near = difflib.get_close_matches(name, section, n=1)
    hint = f"; is it meant by {quoted(near[0])}?" if near else ""
    return InputError(f"{where}: {name} is missing{hint}")


def _of_material(entry: Mapping[str, Any], kinds: Mapping[str, str], where: str) -> dict[str, Any]:
    """Return what a section says of a layer, with the kind of its material."""
    if "drawn" not in entry:
        raise InputError(f"{where}: drawn is missing")
    for key in ("name", "kind"):
        if key in entry:
            keys = ("drawn", "material", "thickness_um", EDGE_BIAS)
            raise unknown_name("key", key, keys, where)
    if "material" not in entry:
        raise InputError(f"{where}: material is missing")
    material = entry["material"]
    if not isinstance(material, str):
        raise InputError(f"{where}: material = {quoted(material)}: expected a name")
    if not kinds:
        raise InputError(f"{where}: material = {quoted(material)}: there is no [materials]")
    if material not in kinds:
        raise unknown_name("material", material, kinds, where)
    return {**entry, "kind": kinds[material]}


def terminal_values(section: Mapping[str, Any], where: str) -> dict[str, dict[str, Any]]:
    """Return what ``[terminals]`` says of each terminal, its outlines as they are given.

    Raises
    ------
    InputError
        If a required one is missing, or a key is wrong.
    """
    for name in ("supply", "ground"):
        if name not in section:
            raise _missing(name, section, where)
    terminals = {}
    for name, entry in section.items():
        by_area, here = isinstance(entry, Mapping), f"{where.removesuffix(']')}.{name}]"
        others = [key for key in entry if key != "area"] if by_area else []
        if others:
            raise unknown_name("key", others[0], ("area",), here)
        if by_area and not entry:
            raise InputError(f"{here}: area is missing")
        drawn = entry["area"] if by_area else entry
        terminals[name] = {"name": name, "drawn": drawn, "by_area": by_area}
    return terminals
