"""What a probe consists of, before it is a file: shape, circuit, materials, surroundings, tip.

And monitors, where temperature and potential are to be reported, and the chip that holds it. Heat
spreads from the small ends of the legs into the chip, within microseconds, and from there through
its holder, in milliseconds or more. At rest both count, in pulses the spreading alone.
"""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Annotated, Any, Self

import numpy as np
from numpy.typing import ArrayLike
from pydantic import BeforeValidator, ConfigDict, Field, SerializeAsAny, model_validator

from hotlever.errors import InputError, quoted, unknown_name
from hotlever.materials import HIGH_DOPED, KINDS, LOW_DOPED, REFERENCE, Kind, Material, full_name
from hotlever.materials.heat import thermal_conductivity
from hotlever.materials.kinds import HighDopedSilicon, LowDopedSilicon, class_name
from hotlever.probe.circuit import Circuit, Wiring
from hotlever.probe.layout import Layout
from hotlever.probe.shapes import SHAPE_SECTIONS, Shape
from hotlever.probe.surroundings import Physics, Surroundings
from hotlever.probe.tip import SampleContact, Tip
from hotlever.quantities import OBSERVABLES, QUANTITIES
from hotlever.records import Record, bounded
from hotlever.types import Array, Mask
from hotlever.units import PER_CM_TO_MILLI_PER_UM


def _as_tuples(value: Any) -> Any:
    """Return lists, as files have them, as tuples."""
    return tuple(map(_as_tuples, value)) if isinstance(value, list | tuple) else value


Coordinate = Annotated[float, Field(ge=-1e6, le=1e6)]
Place = Annotated[tuple[Coordinate, Coordinate], BeforeValidator(_as_tuples)]


class Monitor(Record):
    """A point, a line or a region of a lever (section ``[monitor.NAME]`` of a probe file).

    What it shows is the temperature and the potential there, in the middle of the lever's
    thickness, or their means over the region.

    Examples
    --------
    >>> Monitor(line_um=[[0, 0], [40, 0]], points=3).positions.tolist()
    [[0.0, 0.0], [20.0, 0.0], [40.0, 0.0]]
    """

    point_um: Place | None = Field(default=None, description="a place [x, y]")
    line_um: Annotated[tuple[Place, Place], BeforeValidator(_as_tuples)] | None = Field(
        default=None, description="from one place to another, which lie on the lever"
    )
    points: int | None = bounded("of the line; 101 if left out", 2, 1000, None)
    region: str | None = Field(
        default=None, description="a region, part, layer or material of the lever: a mean over it"
    )

    @model_validator(mode="after")
    def _is_one_of_three(self) -> Self:
        if sum(each is not None for each in (self.point_um, self.line_um, self.region)) != 1:
            raise ValueError("expected one of point_um, line_um and region")
        if self.points is not None and self.line_um is None:
            raise ValueError("points go with line_um")
        return self

    @property
    def _ends(self) -> tuple[Place, ...]:
        return self.line_um or (() if self.point_um is None else (self.point_um,))

    @property
    def positions(self) -> Array:
        """The points (µm), shape (n, 2); none of a region."""
        if self.line_um is not None:
            return np.linspace(*self.line_um, self.points or 101)
        return np.reshape(self._ends, (-1, 2))

    def __str__(self) -> str:
        if self.region is not None:
            return f"mean over {self.region}"
        ends = " to ".join(f"({x:g}, {y:g})" for x, y in self._ends)
        return f"{'at' if self.line_um is None else 'from'} {ends} µm"

    def check(self, layout: Layout, where: str) -> None:
        """Check that it is on a lever: of a line both ends, gaps between may be bridged.

        Raises
        ------
        InputError
            If it is not, with the nearest place that is; or there is no such region.
        """
        if self.region is not None and not layout.named(self.region):
            names = dict.fromkeys(name for region in layout.regions for name in region.names)
            raise unknown_name("region", self.region, names, where)
        for x, y in self._ends:
            if not on_lever(layout, [(x, y)]).all():
                import shapely

                line = shapely.shortest_line(layout.polygon, shapely.Point(x, y))
                near_x, near_y = line.coords[0]
                raise InputError(
                    f"{where}: ({x:g}, {y:g}) µm lies off the lever, expected a place on it; "
                    f"the nearest is ({near_x:.6g}, {near_y:.6g})"
                )


class Monitors(Record):
    """Monitors by name (sections ``[monitor.NAME]`` of a probe file)."""

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, Monitor]

    @classmethod
    def from_values(cls, values: dict[str, Any], where: str) -> Self:
        """Check monitors, or what their sections hold; `where` names their origin in an error."""
        monitors = {
            name: section
            if isinstance(section, Monitor)
            else Monitor.from_values(section, f"{where}: {name}")
            for name, section in values.items()
        }
        return cls.model_validate(monitors)

    @property
    def named(self) -> dict[str, Monitor]:
        """Each by its name."""
        return self.model_extra or {}

    def check(self, layout: Layout, where: str) -> None:
        """Check that all are on a lever, and have names for columns of their own.

        Raises
        ------
        InputError
            If one is not, see `Monitor.check`.
        """
        existing_columns = {*QUANTITIES, *(f"{name}_V" for name in layout.terminal_names)}
        for name, monitor in self.named.items():
            if not re.fullmatch(r"[A-Za-z]\w*", name, re.ASCII):
                raise InputError(
                    f"{where}: found the name {quoted(name)}, expected a letter first, and then "
                    "letters, digits and _"
                )
            for column in (name, f"{name}_K", f"{name}_V"):
                if column in existing_columns:
                    raise InputError(
                        f"{where}: the name {quoted(name)} is taken, there is a column {column}: "
                        "expected another"
                    )
            monitor.check(layout, f"{where}: {name}")


def on_lever(layout: Layout, points: Array | Sequence[Place]) -> Mask:
    """Return which points (n, 2) are on a lever, as far as rounding tells, (n,)."""
    import shapely  # not every probe has monitors

    return np.asarray(shapely.distance(layout.polygon, shapely.points(np.asarray(points))) <= 1e-6)


class PriorTexts(Record):
    """What is known of a lever beforehand (section ``[prior]`` of a probe file), as text."""

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, str]

    @model_validator(mode="before")
    @classmethod
    def _names_may_have_dots(cls, values: Any) -> Any:
        if not isinstance(values, Mapping):
            return values
        flat = dict[str, Any]()
        for name, value in values.items():
            inner = value.items() if isinstance(value, Mapping) else ()
            flat |= {f"{name}.{own}": text for own, text in inner} if inner else {name: value}
        return flat


#: What the sections of a probe file hold, beside the shape in ``[probe]``.
PARTS: dict[str, type[Record]] = {
    "circuit": Circuit,
    "material": Material,
    "surroundings": Surroundings,
    "tip": Tip,
    "contact": SampleContact,
    "physics": Physics,
    "prior": PriorTexts,
    "monitor": Monitors,
}
#: All sections of a probe file.
SECTIONS = (*SHAPE_SECTIONS, "materials", *PARTS)


def with_values(section: Mapping[str, Any]) -> dict[str, Any]:
    """Return a section without the keys that have no value."""
    return {
        key: with_values(value) if isinstance(value, Mapping) else value
        for key, value in section.items()
        if value is not None
    }


class ProbeParts(Record):
    """Everything that a solve needs of one lever, and what is known before it is measured."""

    shape: Shape
    circuit: Circuit = Circuit()
    material: Material = REFERENCE
    materials: dict[str, SerializeAsAny[Kind]] = Field(default_factory=dict)
    surroundings: Surroundings = Surroundings()
    tip: Tip | None = None
    contact: SampleContact | None = None
    physics: Physics = Physics()
    prior: PriorTexts | None = None
    monitor: Monitors | None = None

    @model_validator(mode="after")
    def _tip_fits(self) -> Self:
        if self.tip is not None:
            room = self.shape.layout().heater.narrow_um / 2
            if not self.tip.base_radius_um < room:
                raise ValueError(
                    f"the tip's base has a radius of {self.tip.base_radius_um:.4g} µm, expected "
                    f"less than {room:.4g} µm, half the heater's narrow side"
                )
        elif self.contact is not None:
            raise ValueError("[contact] means nothing without a section [tip]")
        if self.tip and self.contact and self.surroundings.medium == "air":
            gap, height = self.surroundings.surface_gap_um, self.tip.height_um
            if gap is None or not math.isclose(gap, height, rel_tol=1e-6):
                raise ValueError(
                    f"surface_gap_um = {'none' if gap is None else f'{gap:g}'}: expected the "
                    f"height of the tip in contact, {height:g}"
                )
            if self.tip.in_air:
                raise ValueError("in_air: the air beside a tip in contact counts by itself")
        return self

    @model_validator(mode="after")
    def _materials_make_sense(self) -> Self:
        kinds = self.kinds
        for region in self.layout().regions:
            low, high = kinds[region.material], kinds[region.dopant_from]
            if (
                region.taper is not None
                and isinstance(low, LowDopedSilicon)
                and isinstance(high, HighDopedSilicon)
                and low.n_d >= high.n_hd
            ):
                raise ValueError(
                    f"{full_name(region.material, 'n_d')} = {low.n_d:g} must be below "
                    f"{full_name(region.dopant_from, 'n_hd')} = {high.n_hd:g}"
                )
        # a leg end may be colder than the others
        coldest_K = self.circuit.base_temperature_K + min([0.0, *self.circuit.end_rises().values()])
        for name, kind in self.made_of.items():
            if reason := kind.impossible(coldest_K):
                of = f"{name}: " if name in self.materials else ""
                raise ValueError(of + reason)
        return self

    def __hash__(self) -> int:
        parts = tuple(getattr(self, name) for name in PARTS)
        return hash((self.shape, tuple(self.materials.items()), *parts))

    @property
    def title(self) -> str:
        """What it is in a few words: its shape, medium, and effects beyond the paper."""
        own = f"{self.shape.title} in {self.surroundings.medium}"
        return ", ".join([own, *self.physics.effects])

    @property
    def stated_priors(self) -> dict[str, str]:
        """What its file says of its priors, by name."""
        texts = (self.prior and self.prior.model_extra) or {}
        return {self.shape.named(name): text for name, text in texts.items()}

    @property
    def monitors(self) -> dict[str, Monitor]:
        """Where temperature and potential are reported, by name."""
        return {} if self.monitor is None else self.monitor.named

    @property
    def parts(self) -> dict[str, Record]:
        """Those of its parts that matter, beside the shape, by the section of a probe file."""
        parts = {name: getattr(self, name) for name in PARTS if getattr(self, name)}
        if not self.has_plain_silicon:
            del parts["material"]
        return parts

    @property
    def has_plain_silicon(self) -> bool:
        """Whether any of it is made of the silicon of ``[material]``."""
        return not {LOW_DOPED, HIGH_DOPED}.isdisjoint(self.layout().materials)

    @property
    def kinds(self) -> dict[str, Kind]:
        """All its materials by name, the two of ``[material]`` among them."""
        return {**self.material.kinds, **self.materials}

    @property
    def classes(self) -> dict[str, type[Record]]:
        """Of its materials those that are of a class of one's own, by section."""
        own: dict[str, type[Record]] = {
            name: type(kind)
            for name, kind in self.materials.items()
            if type(kind) is not KINDS[kind.kind]
        }
        if type(self.material) is not Material and self.has_plain_silicon:
            own["material"] = type(self.material)
        return own

    @property
    def laws(self) -> dict[str, str]:
        """The names of these classes, as files state them."""
        return {name: class_name(record_class) for name, record_class in self.classes.items()}

    @property
    def made_of(self) -> dict[str, Kind]:
        """The materials that its layout has, by name."""
        kinds = self.kinds
        return {name: kinds[name] for name in self.layout().materials}

    @property
    def heater_silicon(self) -> LowDopedSilicon | None:
        """The low-doped silicon of the heater; None if it is of another material."""
        kind = self.kinds[self.layout().heater.material]
        return kind if isinstance(kind, LowDopedSilicon) else None

    @property
    def lowest_bias_V(self) -> float:
        """Bias (V) below which the lever is as at the opposite bias, with the signs reversed.

        There is none, −∞, with held supplies or thermoelectricity: there the polarity counts.
        """
        counts = self.physics.thermoelectric or not self.circuit.starts_cold
        return -math.inf if counts else 0.0

    @property
    def wiring(self) -> Wiring:
        """Which of its terminals are what."""
        return self.circuit.wiring(self.layout().terminal_names)

    @property
    def observables(self) -> tuple[str, ...]:
        """Which of `hotlever.quantities.OBSERVABLES` it can show."""
        without = {
            "reader": "reader" not in self.wiring.measurable,
            "bridge": not self.circuit.has_bridge,
        }
        return tuple(name for name in OBSERVABLES if not without.get(name))

    def layout(self) -> Layout:
        """Return the regions, terminals and tip."""
        return dataclasses.replace(self.shape.layout(), cone=self.tip)

    def sections(self) -> dict[str, dict[str, Any]]:
        """Return the sections as plain values: what `Probe.from_sections` takes, or refuses."""
        sections: dict[str, dict[str, Any]] = self.shape.sections()
        if self.materials:
            sections["materials"] = {
                name: kind.model_dump() for name, kind in self.materials.items()
            }
        sections |= {name: part.model_dump() for name, part in self.parts.items()}
        if self.laws:
            sections["laws"] = dict(self.laws)
        return {name: with_values(section) for name, section in sections.items()}

    def _owner(self, name: str) -> tuple[str, Record | None]:
        """Return the section with a value, by its name in a probe file, and what that holds."""
        material, dot, _ = name.partition(".")
        if dot:
            return material, self.materials[material]
        parts = [("probe", self.shape), *((part, getattr(self, part)) for part in PARTS)]
        owners = ((part, own) for part, own in parts if own and name in type(own).model_fields)
        return next(owners, ("", None))

    def values(self, names: Sequence[str]) -> Array:
        """Return some of its values by their names in a probe file, shape (len(names),)."""
        dimensions = self.shape.dimensions()
        numbers = [
            dimensions[name]
            if name in dimensions
            else getattr(self._owner(name)[1], name.rpartition(".")[2])
            for name in names
        ]
        return np.array(numbers, dtype=float)

    def replace(self, values: Mapping[str, float]) -> Self:
        """Return a copy with some values changed, as `with_` does but unchecked and fast."""
        changed = dict[str, tuple[Record, dict[str, float]]]()
        dimensions = {
            name: value for name, value in values.items() if name in self.shape.dimensions()
        }
        for name, value in values.items():
            section, record = self._owner(name) if name not in dimensions else ("", None)
            if record is not None:
                changed.setdefault(section, (record, {}))[1][name.rpartition(".")[2]] = value
        copies: dict[str, Any] = {
            section: record.model_copy(update=own) for section, (record, own) in changed.items()
        }
        materials = {name: copies.pop(name, kind) for name, kind in self.materials.items()}
        shape = copies.pop("probe", self.shape).with_dimensions(dimensions)
        return self.model_copy(update={**copies, "shape": shape, "materials": materials})

    def with_physics(self, effects: Iterable[str], where: str = "physics") -> Self:
        """Return the probe with some effects beyond the paper, and no others.

        Raises
        ------
        InputError
            If there is no such effect; the nearest name is given.
        """
        effects = tuple(effects)
        for name in effects:
            if name not in Physics.model_fields:
                raise unknown_name("effect", name, Physics.model_fields, where)
        return self.model_copy(update={"physics": Physics(**dict.fromkeys(effects, True))})

    @property
    def usual_chip_K_per_mW(self) -> float:
        """What a chip in its holder usually has: spreading, and a holder."""
        # a holder, glue or a clip usually adds as much (K/mW), of which nothing is known but its
        # size
        return spreading_K_per_mW(self.layout(), self.circuit.base_temperature_K) + 1.0

    def in_pulses(self) -> Self:
        """Return the probe as it is in pulses, while the holder of its chip stays cold."""
        at_rest = self.circuit.chip_K_per_mW
        if not at_rest:
            return self
        spreading = spreading_K_per_mW(self.layout(), self.circuit.base_temperature_K)
        return self if at_rest <= spreading else self.replace({"chip_K_per_mW": spreading})


def mean_inverse_distance(a: ArrayLike, b: ArrayLike) -> Array:
    """Return the mean of 1/r (1/µm) over all pairs of points of a rectangle of sides a, b (µm).

    Examples
    --------
    >>> mean_inverse_distance(1.0, 1.0).round(4).item()
    2.9732
    """
    a, b = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    diagonal = np.hypot(a, b)
    sides = 2.0 / a * np.arcsinh(a / b) + 2.0 / b * np.arcsinh(b / a)
    return np.asarray(sides + 2.0 / 3.0 * (a**3 + b**3 - diagonal**3) / (a * b) ** 2)


def spreading_K_per_mW(layout: Layout, base_temperature_K: float) -> float:
    """Return by how much leg ends get warmer for the heat that spreads from them into silicon.

    Each end is a rectangle of uniform flux on a half space, and is warmed by the others as by
    points; the heat is shared out so that all ends have one mean temperature.

    Parameters
    ----------
    layout : Layout
    base_temperature_K : float

    Examples
    --------
    >>> from hotlever import Probe
    >>> round(spreading_K_per_mW(Probe.reference().layout(), 293.0), 2)
    0.67
    """
    start, end = np.array([(each.start, each.end) for each in layout.terminals]).swapaxes(0, 1)
    widths = np.linalg.norm(end - start, axis=1)
    apart = np.linalg.norm((start + end)[:, None] - (start + end), axis=2) / 2.0
    np.fill_diagonal(apart, 1.0)
    inverse = 1.0 / apart
    np.fill_diagonal(inverse, mean_inverse_distance(widths, layout.thickness_um))
    kappa = PER_CM_TO_MILLI_PER_UM * float(thermal_conductivity(base_temperature_K)[0])
    return float(1.0 / (2.0 * math.pi * kappa * np.linalg.inv(inverse).sum()))
