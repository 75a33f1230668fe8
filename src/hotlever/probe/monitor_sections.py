"""Monitors: where in a lever temperature and potential are to be reported."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Annotated, Any, Self

import numpy as np
from pydantic import BeforeValidator, ConfigDict, Field, model_validator

from hotlever.errors import InputError, quoted, unknown_name
from hotlever.probe.layout import Layout
from hotlever.quantities import QUANTITIES
from hotlever.records import Record, bounded
from hotlever.types import Array, Mask


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
