"""Parametric probe shapes: the dimensions a designer draws with, made into a layout.

The base of the lever is at x = 0, the legs run along +x, and y = 0 is the line of symmetry.
"""

from __future__ import annotations

from abc import abstractmethod
from typing import Annotated, Literal

from pydantic import Field, model_validator

from hotlever.errors import InputError, unknown_name
from hotlever.probe.layout import Layout, Part, Region, Taper, Terminal, rectangle
from hotlever.records import Record

Length = Annotated[float, Field(gt=0)]


class Shape(Record):
    """A parametric shape (section ``[probe]`` of a probe file); lengths in µm."""

    shape: str

    @abstractmethod
    def layout(self) -> Layout:
        """Return the regions, terminals and tip of this shape."""

    @abstractmethod
    def description(self) -> dict[str, str]:
        """Return what each dimension is, by key, for the comments of a probe file."""


def _need(condition: bool, text: str) -> None:
    if not condition:
        raise ValueError(text)


class ThreeLeg(Shape):
    """The three-legged lever of the paper: heater on the centre leg, reader on the right one.

    Current enters by the centre leg, passes the heater into the front bridge and leaves by
    the left leg; the right leg senses the potential of the bridge and carries the reader.
    """

    shape: Literal["three-leg"] = "three-leg"
    length_um: Length
    centre_leg_width_um: Length
    outer_leg_width_um: Length
    gap_um: Length
    bridge_width_um: Length
    heater_length_um: Length
    heater_width_um: Length
    thickness_um: Length
    reader_length_um: Length
    reader_centre_um: Length | None = None

    @model_validator(mode="after")
    def _parts_fit(self) -> ThreeLeg:
        front = self.length_um - self.bridge_width_um
        _need(
            self.heater_length_um < front,
            f"bridge_width_um + heater_length_um = {self.bridge_width_um + self.heater_length_um:g}"
            f" must be less than length_um = {self.length_um:g}",
        )
        widest = self.centre_leg_width_um + 2 * self.gap_um
        _need(
            self.heater_width_um < widest,
            f"heater_width_um = {self.heater_width_um:g} must be less than the {widest:g} µm "
            "between the outer legs",
        )
        half, centre = self.reader_length_um / 2, self._reader_centre
        _need(
            half < centre < front - half,
            f"the reader ({centre - half:g} to {centre + half:g} µm) must lie between the base "
            f"and the bridge (0 to {front:g} µm); see reader_length_um and reader_centre_um",
        )
        return self

    @property
    def _reader_centre(self) -> float:
        if self.reader_centre_um is not None:
            return self.reader_centre_um
        return 2 / 3 * self.length_um

    def layout(self) -> Layout:
        """Return the regions, terminals and tip of this shape."""
        front = self.length_um - self.bridge_width_um
        heater_from = front - self.heater_length_um
        centre, heater = self.centre_leg_width_um / 2, self.heater_width_um / 2
        inner = centre + self.gap_um
        outer = inner + self.outer_leg_width_um
        reader_from = self._reader_centre - self.reader_length_um / 2
        reader_to = reader_from + self.reader_length_um
        along_x = (1.0, 0.0)
        tip = (heater_from + self.heater_length_um / 2, 0.0)
        reader_middle = (self._reader_centre, -(inner + outer) / 2)

        def right_leg(name: str, x0: float, x1: float, taper: Taper | None = None) -> Region:
            return Region(name, "reader branch", rectangle(x0, -outer, x1, -inner), taper)

        return Layout(
            regions=(
                Region("centre leg", "leg 1", rectangle(0, -centre, heater_from, centre)),
                Region(
                    "heater",
                    "heater",
                    rectangle(heater_from, -heater, front, heater),
                    Taper(tip, along_x, self.heater_length_um),
                ),
                Region("bridge", "leg 2", rectangle(front, -outer, self.length_um, outer)),
                Region("left leg", "leg 2", rectangle(0, inner, front, outer)),
                right_leg("right leg", 0, reader_from),
                right_leg(
                    "reader",
                    reader_from,
                    reader_to,
                    Taper(reader_middle, along_x, self.reader_length_um),
                ),
                right_leg("right leg front", reader_to, front),
            ),
            terminals=(
                Terminal("supply", (0, -centre), (0, centre)),
                Terminal("ground", (0, inner), (0, outer)),
                Terminal("reader", (0, -outer), (0, -inner)),
            ),
            tip=tip,
            thickness_um=self.thickness_um,
        )

    def description(self) -> dict[str, str]:
        """Return what each dimension is, by key."""
        return {
            "length_um": "base to front edge",
            "centre_leg_width_um": "leg that the current enters by",
            "outer_leg_width_um": "left leg (to ground) and right leg (reader)",
            "gap_um": "between the centre leg and each outer leg",
            "bridge_width_um": "front bar, along the lever",
            "heater_length_um": "low-doped part behind the bridge, tip at its centre",
            "heater_width_um": "across the lever",
            "thickness_um": "of the silicon",
            "reader_length_um": "low-doped part of the right leg",
            "reader_centre_um": "base to the reader's centre; left out: 2/3 of the length",
        }


class UShape(Shape):
    """A two-legged lever: the heater lies across the front, between the legs.

    Current enters by the right leg (y < 0), crosses the heater along +y and leaves by the
    left leg. A front bar of `bridge_width_um` joins the legs; its middle `heater_length_um` is
    low-doped and `heater_width_um` wide. There is no reader.
    """

    shape: Literal["u-shape"] = "u-shape"
    length_um: Length
    leg_width_um: Length
    gap_um: Length
    bridge_width_um: Length
    heater_length_um: Length
    heater_width_um: Length
    thickness_um: Length

    @model_validator(mode="after")
    def _parts_fit(self) -> UShape:
        _need(
            self.bridge_width_um < self.length_um,
            f"bridge_width_um = {self.bridge_width_um:g} must be less than "
            f"length_um = {self.length_um:g}",
        )
        _need(
            self.heater_width_um <= self.bridge_width_um,
            f"heater_width_um = {self.heater_width_um:g} must not exceed "
            f"bridge_width_um = {self.bridge_width_um:g}",
        )
        _need(
            self.heater_length_um <= self.gap_um,
            f"heater_length_um = {self.heater_length_um:g} must not exceed "
            f"gap_um = {self.gap_um:g}",
        )
        return self

    def layout(self) -> Layout:
        """Return the regions, terminals and tip of this shape."""
        inner, heater = self.gap_um / 2, self.heater_length_um / 2
        outer = inner + self.leg_width_um
        back = self.length_um - self.bridge_width_um
        middle = back + self.bridge_width_um / 2
        half_width = self.heater_width_um / 2
        tip = (middle, 0.0)

        def side(name: str, part: Part, sign: int) -> list[Region]:
            def mirrored(x0: float, y0: float, x1: float, y1: float) -> tuple:
                low, high = sorted((sign * y0, sign * y1))
                return rectangle(x0, low, x1, high)

            leg = Region(f"{name} leg", part, mirrored(0, inner, self.length_um, outer))
            if heater == inner:
                return [leg]
            bar = mirrored(back, heater, self.length_um, inner)
            return [leg, Region(f"{name} bar", part, bar)]

        return Layout(
            regions=(
                *side("right", "leg 1", -1),
                Region(
                    "heater",
                    "heater",
                    rectangle(middle - half_width, -heater, middle + half_width, heater),
                    Taper(tip, (0.0, 1.0), self.heater_length_um),
                ),
                *side("left", "leg 2", +1),
            ),
            terminals=(
                Terminal("supply", (0, -outer), (0, -inner)),
                Terminal("ground", (0, inner), (0, outer)),
            ),
            tip=tip,
            thickness_um=self.thickness_um,
        )

    def description(self) -> dict[str, str]:
        """Return what each dimension is, by key."""
        return {
            "length_um": "base to front edge",
            "leg_width_um": "both legs",
            "gap_um": "between the legs",
            "bridge_width_um": "front bar, along the lever",
            "heater_length_um": "low-doped middle of the bar, across the lever, tip at its centre",
            "heater_width_um": "along the lever",
            "thickness_um": "of the silicon",
        }


SHAPES: dict[str, type[Shape]] = {"three-leg": ThreeLeg, "u-shape": UShape}


def shape_of(values: dict, where: str) -> Shape:
    """Make the shape that the section ``[probe]`` of a file describes.

    Raises
    ------
    InputError
        If the shape is unknown or a dimension is missing, misspelt or impossible.
    """
    name = values.get("shape")
    if name is None:
        raise InputError(f"{where}: shape is missing (one of: {', '.join(SHAPES)})")
    if name not in SHAPES:
        raise unknown_name("shape", str(name), SHAPES, where)
    return SHAPES[name].of(values, where)
