"""Probe shapes: what a layout is made of.

A parametric shape is made of the dimensions a designer draws with: the base of the lever is at
x = 0, the legs run along +x, and y = 0 is the line of symmetry. The other kind of shape is a
drawing (`hotlever.probe.drawing.shape`).
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar, Literal, Self

from pydantic import model_validator

from hotlever.materials import LOW_DOPED
from hotlever.probe.layout import Layout, Part, Region, Taper, Terminal, rectangle
from hotlever.records import Record, bounded

#: The dimension that is the same for all edges, and how far off it is at most (µm).
EDGE_BIAS, MOST_EDGE_BIAS = "edge_bias_um", 2.0


def _length(meaning: str, least: float = 0.05, most: float = 1000.0, **default: Any) -> Any:
    """Return a dimension's bounds (µm), within which any lever lies by far, and what it is."""
    return bounded(meaning, least, most, **default)


def thickness(meaning: str = "of the silicon") -> Any:
    """Return the bounds of a lever's thickness (µm), and what it is."""
    return _length(meaning, 0.01, 20)


def edge_bias(meaning: str = "all etched edges lie so far outside the drawing") -> Any:
    """Return the bounds of how far edges are outside the drawing (µm), and what that is."""
    return bounded(meaning, -MOST_EDGE_BIAS, MOST_EDGE_BIAS, 0.0)


def full_bias_name(layer: str) -> str:
    """Return how the shift of a layer's edges is called among the dimensions of a drawing."""
    return f"{layer}.{EDGE_BIAS}"


class Shape(Record):
    """What a probe is made to look like (section ``[probe]`` of a probe file); lengths in µm."""

    #: Whether all of the outline follows dimensions, each of which may be off by a share.
    outline_moves: ClassVar[bool] = True
    #: Keys of a probe file that count while it is read, and mean nothing to what was read.
    read_with: ClassVar[tuple[str, ...]] = ()

    shape: str

    @property
    def title(self) -> str:
        """What it is in a few words."""
        return f"{self.shape} lever"

    @property
    def materials(self) -> tuple[str, ...]:
        """The names of the materials, beside ``[material]``, that it says it is made of."""
        return ()

    def layer_records(self) -> dict[str, type[Record]]:
        """Return what the sections ``[layers.NAME]`` hold, by the names of the layers."""
        return {}

    @abstractmethod
    def dimensions(self) -> dict[str, float]:
        """Return the dimensions (µm) that are given and can change, by name."""

    def named(self, name: str) -> str:
        """Return the name of a dimension that a file may name otherwise."""
        return name

    def with_dimensions(self, values: Mapping[str, float]) -> Self:
        """Return a copy with some of its dimensions changed, unchecked."""
        return self.model_copy(update=dict(values))

    def notes(self) -> list[str]:
        """Return what a user should hear of it before anything is solved."""
        return []

    def tied(self) -> tuple[str, ...]:
        """Return dimensions that cannot change by themselves, since parts would come apart."""
        return ()

    def sections(self) -> dict[str, dict[str, Any]]:
        """Return the sections of a probe file that describe it."""
        return {"probe": self.model_dump()}

    @abstractmethod
    def layout(self) -> Layout:
        """Return the regions, terminals and tip of this shape."""

    def check(self) -> None:
        """Raise a ValueError if it cannot be drawn and meshed."""
        self.layout()

    @model_validator(mode="after")
    def _is_checked(self) -> Self:
        self.check()
        return self


class Parametric(Shape):
    """A shape made of dimensions, as drawn, and what etching makes of them.

    No part is smaller than ``smallest_um``, nor are two that do not touch nearer to each other.
    """

    smallest_um: ClassVar[float] = 0.01
    if TYPE_CHECKING:
        # a field of each shape, after its drawing: fields stand in probe files as they come
        edge_bias_um: float

    def dimensions(self) -> dict[str, float]:
        """Return the dimensions (µm) that are given, by name."""
        return self.model_dump(exclude={"shape"}, exclude_none=True)

    @abstractmethod
    def _by_edge_bias(self) -> dict[str, float]:
        """Return how dimensions change with the bias of the edges."""

    @property
    def etched(self) -> Self:
        """The shape with its edges where etching leaves them."""
        if self.edge_bias_um == 0.0:
            return self
        own = {
            name: getattr(self, name) + share * self.edge_bias_um
            for name, share in self._by_edge_bias().items()
        }
        return self.model_copy(update={**own, EDGE_BIAS: 0.0})

    @abstractmethod
    def _parts_fit(self) -> None:
        """Raise a ValueError if the parts do not fit together."""

    def check(self) -> None:
        """Raise a ValueError if it cannot be drawn and meshed."""
        etched = self.etched
        for name in self._by_edge_bias() if self.edge_bias_um else ():
            size_um = getattr(etched, name)
            _need(
                size_um >= self.smallest_um,
                f"with edge_bias_um = {self.edge_bias_um:g}, {name} is {size_um:.2g} µm, expected "
                f"{self.smallest_um} µm or more",
            )
        etched._parts_fit()
        layout = self.layout()
        for region in layout.regions:
            narrow, long = region.sides
            _need(
                narrow >= self.smallest_um,
                f"the {region.name} is {narrow:.2g} µm long or wide, expected "
                f"{self.smallest_um} µm or more",
            )
            # a heater is meshed in steps of its narrow side
            slender = 30.0
            _need(
                region is not layout.heater or long <= slender * narrow,
                f"the heater is {long:g} µm by {narrow:g} µm, expected at most {slender:g} times "
                "as long as wide",
            )


def _need(condition: bool, text: str) -> None:
    if not condition:
        raise ValueError(text)


class ThreeLeg(Parametric):
    """The three-legged lever of the paper: heater on the centre leg, reader on the right one.

    Current enters by the centre leg, passes the heater into the front bridge and leaves by
    the left leg; the right leg senses the potential of the bridge and carries the reader.
    """

    shape: Literal["three-leg"] = "three-leg"
    length_um: float = _length("base to front edge", 2, 2000)
    centre_leg_width_um: float = _length("leg that the current enters by")
    outer_leg_width_um: float = _length("left leg (to ground) and right leg (reader)")
    gap_um: float = _length("between the centre leg and each outer leg")
    bridge_width_um: float = _length("front bar, along the lever")
    heater_length_um: float = _length("low-doped part behind the bridge, tip at its centre")
    heater_width_um: float = _length("across the lever")
    thickness_um: float = thickness()
    reader_length_um: float = _length("low-doped part of the right leg")
    reader_centre_um: float | None = _length(
        "base to the reader's centre; left out: 2/3 of the length", 0.05, 2000, default=None
    )
    edge_bias_um: float = edge_bias()

    def _parts_fit(self) -> None:
        front = self.length_um - self.bridge_width_um
        _need(
            self.heater_length_um < front,
            f"bridge_width_um + heater_length_um = {self.bridge_width_um + self.heater_length_um:g}"
            f" must be less than length_um = {self.length_um:g}",
        )
        widest = self.centre_leg_width_um + 2 * self.gap_um
        _need(
            self.heater_width_um < widest - 2 * self.smallest_um,
            f"heater_width_um = {self.heater_width_um:g} must be less than the {widest:g} µm "
            f"between the outer legs, by {2 * self.smallest_um} µm",
        )
        half, centre = self.reader_length_um / 2, self._reader_centre
        _need(
            half < centre < front - half,
            f"the reader ({centre - half:g} to {centre + half:g} µm) must lie between the base "
            f"and the bridge (0 to {front:g} µm); see reader_length_um and reader_centre_um",
        )

    def _by_edge_bias(self) -> dict[str, float]:
        widths = ("centre_leg_width_um", "outer_leg_width_um", "bridge_width_um", "heater_width_um")
        # silicon is wider behind the heater and before it, and grows towards it
        narrower = ("gap_um", "heater_length_um")
        return {"length_um": 1.0, **dict.fromkeys(widths, 2.0), **dict.fromkeys(narrower, -2.0)}

    @property
    def _reader_centre(self) -> float:
        return self.reader_centre_um or 2 / 3 * self.length_um

    @classmethod
    def reference(cls) -> ThreeLeg:
        """Return the shape of the reference probe, see `hotlever.probe.probe.Probe.reference`."""
        return cls(
            length_um=54.4,
            centre_leg_width_um=6.44,
            outer_leg_width_um=3.46,
            gap_um=3.2,
            bridge_width_um=3.82,
            heater_length_um=4.0,
            heater_width_um=1.645,
            thickness_um=0.4,
            reader_length_um=4.0,
        )

    def layout(self) -> Layout:
        """Return the regions, terminals and tip of this shape."""
        here = self.etched
        front = here.length_um - here.bridge_width_um
        heater_from = front - here.heater_length_um
        centre, heater = here.centre_leg_width_um / 2, here.heater_width_um / 2
        inner = centre + here.gap_um
        outer = inner + here.outer_leg_width_um
        reader_from = here._reader_centre - here.reader_length_um / 2
        reader_to = reader_from + here.reader_length_um
        tip = (heater_from + here.heater_length_um / 2, 0.0)
        reader_middle = (here._reader_centre, -(inner + outer) / 2)
        # dopant comes from the window as it is drawn
        taper = Taper(tip, (1.0, 0.0), self.heater_length_um)
        reader_taper = Taper(reader_middle, (1.0, 0.0), here.reader_length_um)
        behind = rectangle(0, -outer, reader_from, -inner)
        reader = rectangle(reader_from, -outer, reader_to, -inner)
        before = rectangle(reader_to, -outer, front, -inner)
        heater_outline = rectangle(heater_from, -heater, front, heater)
        return Layout(
            regions=(
                Region("centre leg", "leg 1", rectangle(0, -centre, heater_from, centre)),
                Region("heater", "heater", heater_outline, taper, material=LOW_DOPED),
                Region("bridge", "leg 2", rectangle(front, -outer, here.length_um, outer)),
                Region("left leg", "leg 2", rectangle(0, inner, front, outer)),
                Region("right leg", "reader branch", behind),
                Region("reader", "reader branch", reader, reader_taper, material=LOW_DOPED),
                Region("right leg front", "reader branch", before),
            ),
            terminals=(
                Terminal("supply", (0, -centre), (0, centre)),
                Terminal("ground", (0, inner), (0, outer)),
                Terminal("reader", (0, -outer), (0, -inner)),
            ),
            tip=tip,
            thickness_um=here.thickness_um,
        )


class UShape(Parametric):
    """A two-legged lever: the heater lies across the front, between the legs.

    Current enters by the right leg (y < 0), crosses the heater along +y and leaves by the
    left leg. A front bar of `bridge_width_um` joins the legs; its middle `heater_length_um` is
    low-doped and `heater_width_um` wide. There is no reader.
    """

    shape: Literal["u-shape"] = "u-shape"
    length_um: float = _length("base to front edge", 2, 2000)
    leg_width_um: float = _length("both legs")
    gap_um: float = _length("between the legs")
    bridge_width_um: float = _length("front bar, along the lever")
    heater_length_um: float = _length(
        "low-doped middle of the bar, across the lever, tip at its centre"
    )
    heater_width_um: float = _length("along the lever")
    thickness_um: float = thickness()
    edge_bias_um: float = edge_bias()

    def _parts_fit(self) -> None:
        for name, other, fits in (
            ("bridge_width_um", "length_um", "be less than"),
            ("heater_width_um", "bridge_width_um", "not exceed"),
            ("heater_length_um", "gap_um", "not exceed"),
        ):
            size, room = getattr(self, name), getattr(self, other)
            wide = size < room or (size == room and fits == "not exceed")
            _need(wide, f"{name} = {size:g} must {fits} {other} = {room:g}")

    @classmethod
    def reference(cls) -> UShape:
        """Return the shape of a lever with a heater like the reference probe's."""
        return cls(
            length_um=60.0,
            leg_width_um=6.0,
            gap_um=6.0,
            bridge_width_um=4.0,
            heater_length_um=4.0,
            heater_width_um=1.645,
            thickness_um=0.4,
        )

    @property
    def _filled(self) -> bool:
        """Whether the heater fills the gap."""
        return self.heater_length_um == self.gap_um

    def tied(self) -> tuple[str, ...]:
        """Return gap and length of a heater that fills it."""
        return ("heater_length_um", "gap_um") if self._filled else ()

    def _by_edge_bias(self) -> dict[str, float]:
        widths = ("leg_width_um", "bridge_width_um", "heater_width_um")
        # where the bar is wider than the heater, or nothing is between heater and legs, silicon
        # grows towards it
        ends_are_etched = self._filled or self.heater_width_um < self.bridge_width_um
        narrower = ("gap_um", "heater_length_um") if ends_are_etched else ("gap_um",)
        return {"length_um": 1.0, **dict.fromkeys(widths, 2.0), **dict.fromkeys(narrower, -2.0)}

    def layout(self) -> Layout:
        """Return the regions, terminals and tip of this shape."""
        here = self.etched
        inner, heater = here.gap_um / 2, here.heater_length_um / 2
        outer = inner + here.leg_width_um
        back = here.length_um - here.bridge_width_um
        middle, half = back + here.bridge_width_um / 2, here.heater_width_um / 2
        tip = (middle, 0.0)
        # dopant comes from the window as it is drawn
        taper = Taper(tip, (0.0, 1.0), self.heater_length_um)
        across = rectangle(middle - half, -heater, middle + half, heater)

        def side(name: str, part: Part, sign: int) -> list[Region]:
            leg = rectangle(0, sign * inner, here.length_um, sign * outer)
            bar = rectangle(back, sign * heater, here.length_um, sign * inner)
            both = [Region(f"{name} leg", part, leg), Region(f"{name} bar", part, bar)]
            return both[:1] if heater == inner else both

        return Layout(
            regions=(
                *side("right", "leg 1", -1),
                Region("heater", "heater", across, taper, material=LOW_DOPED),
                *side("left", "leg 2", +1),
            ),
            terminals=(
                Terminal("supply", (0, -outer), (0, -inner)),
                Terminal("ground", (0, inner), (0, outer)),
            ),
            tip=tip,
            thickness_um=here.thickness_um,
        )


PARAMETRIC: dict[str, type[Parametric]] = {"three-leg": ThreeLeg, "u-shape": UShape}
#: Sections of a probe file that describe a shape; those of a drawing come first to last.
SHAPE_SECTIONS = ("probe", "layers", "terminals")
