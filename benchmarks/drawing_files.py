"""Drawings as CAD programs write them: read as they are seen there, refused, or wrong?

python benchmarks/drawing_files.py

Each is the reference probe in DXF, GDSII or OASIS with one thing more. The areas of its silicon and
heater, as hotlever cuts them, stand beside the right ones: of gdstk's booleans, of closed formulas,
or of what KLayout and AutoCAD are documented to draw. What does not count, though the file has it
on a layer of the lever, has to be said. For three levers the tip at 8 V stands there too.
"""

from __future__ import annotations

import math
import struct
import tempfile
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import ezdxf
import gdstk
import numpy as np
from ezdxf.xclip import XClip

from hotlever.errors import InputError
from hotlever.lever import Lever
from hotlever.lever.lever import COARSE
from hotlever.probe import Probe
from hotlever.probe.importing import import_drawing
from problems import table

REFERENCE = Probe.reference()
LAYOUT = REFERENCE.layout()
#: Number of each layer in GDSII, and its name in DXF.
LAYERS = {"silicon": (1, "SILICON"), "heater": (2, "HEATER"), "reader": (3, "READER")}
ENDS = {"supply": (10, "SUPPLY_PAD"), "ground": (11, "GROUND_PAD"), "reader": (12, "READER_PAD")}
#: Areas within so much (µm²) are the same: an edge of the lever moved by the tolerance of drawings.
SAME_UM2 = 0.02

Points = Sequence[Sequence[float]]


@dataclass(frozen=True)
class Right:
    """What is right of a drawing.

    Attributes
    ----------
    more : float
        Area of the silicon beyond that of the reference probe (µm²).
    heater : float
        The same of the heater.
    said : tuple of str
        What has to be said, in any of these words.
    refused : tuple of str
        Words of the refusal that is expected of drawings that are not read.
    solved : bool
        Whether the tip is that of the reference probe.
    """

    more: float = 0.0
    heater: float = 0.0
    said: tuple[str, ...] = ()
    refused: tuple[str, ...] = ()
    solved: bool = False


def box(x0: float, y0: float, x1: float, y1: float) -> list[tuple[float, float]]:
    return [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]


IN_LEG, IN_BRIDGE = box(10, -1, 14, 1), box(51.5, 3, 53.5, 7)
#: On the edge of the silver side of the centre leg, half of it outside.
BUMP = box(20, 2.22, 24, 4.22)


def outline(points: Points = ()) -> list[tuple[float, float]]:
    """The reference probe's silicon, and some points more, as gdstk unites them."""
    parts = [gdstk.Polygon(region.outline) for region in LAYOUT.regions]
    more = [gdstk.Polygon(points)] if len(points) else []
    (whole,) = gdstk.boolean(parts, more, "or", 1e-6)
    return [tuple(map(float, point)) for point in whole.points]


def area_with(points: Points, operation: str = "or") -> float:
    """What a polygon adds to the silicon (µm²), or takes from it."""
    own = gdstk.Polygon(outline())
    result = gdstk.boolean(own, gdstk.Polygon(points), operation, 1e-6)
    return sum(piece.area() for piece in result) - own.area()


def shifted(points: Points, distance: float) -> list[tuple[float, float]]:
    """An outline moved outwards."""
    (moved,) = gdstk.offset(gdstk.Polygon(points), distance, "miter", 3, 1e-7)
    return [tuple(map(float, point)) for point in moved.points]


# --- DXF ------------------------------------------------------------------------------------------

DXF: dict[str, tuple[Callable[[Any, Any], Any], Right]] = {}
#: Drawings whose silicon is not drawn yet.
BARE: set[str] = set()


def dxf(name: str, right: Right = Right(), *, bare: bool = False):
    """Take a function that adds something to a document and its model space."""

    def taken(function: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
        DXF[name] = function, right
        if bare:
            BARE.add(name)
        return function

    return taken


def on(layer: str, **attributes: Any) -> dict[str, Any]:
    return {"dxfattribs": {"layer": layer, **attributes}}


def hatch(space: Any, *paths: Points, layer: str = "SILICON", style: int = 0) -> Any:
    own = space.add_hatch(**on(layer, hatch_style=style))
    for path in paths:
        own.paths.add_polyline_path(path, is_closed=True)
    return own


def block(document: Any, points: Points, layer: str = "SILICON") -> str:
    """Make a block of one outline, and return its name."""
    own = document.blocks.new(f"PART{len(document.blocks)}")
    own.add_lwpolyline(points, close=True, **on(layer))
    return own.name


HOLE = area_with(IN_LEG, "not")
NO_EXTENT = ("without extent",)

dxf("arc of radius 0 on another layer")(lambda d, s: s.add_arc((9, 9), 0, 0, 90, **on("NOTES")))
dxf("arc of radius 0 on the silicon", Right(said=NO_EXTENT))(
    lambda d, s: s.add_arc((9, 1), 0, 0, 90, **on("SILICON"))
)
dxf("closed polyline of equal points", Right(said=NO_EXTENT))(
    lambda d, s: s.add_lwpolyline([(9, 1)] * 3, close=True, **on("SILICON"))
)
dxf("polyline of one point on the heater", Right(said=NO_EXTENT))(
    lambda d, s: s.add_lwpolyline([(48, 1)], **on("HEATER"))
)
dxf("old polyline of no points")(lambda d, s: s.add_polyline2d([], **on("NOTES")))
dxf("empty hatch on the silicon", Right(said=NO_EXTENT))(lambda d, s: hatch(s))
dxf("solid of equal points on the heater", Right(said=NO_EXTENT))(
    lambda d, s: s.add_solid([(48, 0)] * 4, **on("HEATER"))
)
dxf("spline of equal points")(lambda d, s: s.add_open_spline([(9, 9)] * 5, **on("NOTES")))
dxf("upright 3DFACE on the silicon", Right(said=("without", "no area")))(
    lambda d, s: s.add_3dface([(9, 0, 0), (19, 0, 0), (19, 0, 1), (9, 0, 1)], **on("SILICON"))
)
dxf("lines whose ends are 1e-7 µm apart", Right(said=NO_EXTENT))(
    lambda d, s: s.add_line((9, 1), (9 + 1e-7, 1), **on("SILICON"))
)

dxf("TRACE in the leg", Right(solved=True))(
    lambda d, s: s.add_trace([(10, -1), (14, -1), (10, 1), (14, 1)], **on("SILICON"))
)
dxf("3DFACE in the bridge")(lambda d, s: s.add_3dface(IN_BRIDGE, **on("SILICON")))
dxf("solid of three corners")(lambda d, s: s.add_solid(IN_LEG[:3], **on("SILICON")))
dxf("solid beyond the edge", Right(area_with(BUMP)))(
    lambda d, s: s.add_solid([*BUMP[:2], BUMP[3], BUMP[2]], **on("SILICON"))
)
dxf("hatch with a hole of its own in the leg", Right(solved=True))(
    lambda d, s: hatch(s, IN_LEG, box(11, -0.5, 13, 0.5))
)
dxf("hatch 0.5 nm outside the outline", Right(area_with(shifted(outline(), 5e-4))))(
    lambda d, s: hatch(s, shifted(outline(), 5e-4))
)
dxf("hatch 0.5 nm inside the outline", Right(solved=True))(
    lambda d, s: hatch(s, shifted(outline(), -5e-4))
)


@dxf("MPOLYGON in the leg")
def _mpolygon(document, space):
    own = space.add_mpolygon(**on("SILICON"))
    own.paths.add_polyline_path(IN_LEG, is_closed=True)


@dxf("hatch alone, with a hole", Right(HOLE), bare=True)
def _hatch_alone(document, space):
    hatch(space, outline(), IN_LEG)


@dxf("hatch of style outer, three paths", Right(HOLE), bare=True)
def _hatch_outer(document, space):
    hatch(space, outline(), IN_LEG, box(11, -0.5, 13, 0.5), style=1)


@dxf("hatch of style ignore, two paths", bare=True)
def _hatch_ignore(document, space):
    hatch(space, outline(), IN_LEG, style=2)


@dxf("hatch between outline and hole", Right(HOLE, said=("hole",)))
def _hatch_between(document, space):
    space.add_lwpolyline(IN_LEG, close=True, **on("SILICON"))
    hatch(space, outline(), IN_LEG)


@dxf("solid that fills a hole")
def _filled(document, space):
    space.add_lwpolyline(IN_LEG, close=True, **on("SILICON"))
    space.add_solid([*box(9, -2, 15, 2)[:2], (9, 2), (15, 2)], **on("SILICON"))


@dxf("round hole", Right(-math.pi, said=("hole",)))
def _round_hole(document, space):
    space.add_circle((12, 0), 1, **on("SILICON"))


@dxf("hole with an island", Right(HOLE + 0.5, said=("hole",), refused=("pieces",)))
def _island(document, space):
    for points in (IN_LEG, box(11, -0.25, 12, 0.25)):
        space.add_lwpolyline(points, close=True, **on("SILICON"))


@dxf("outline twice, once with a corner more", bare=True)
def _twice(document, space):
    points = outline()
    middle = tuple(np.mean([points[0], points[1]], axis=0))
    space.add_lwpolyline(points, close=True, **on("SILICON"))
    space.add_lwpolyline([points[0], middle, *points[1:]], close=True, **on("SILICON"))


@dxf("outline twice, once 0.5 nm inside", bare=True)
def _twice_apart(document, space):
    for points in (outline(), shifted(outline(), -5e-4)):
        space.add_lwpolyline(points, close=True, **on("SILICON"))


@dxf("silicon of solids side by side", bare=True)
def _tiles(document, space):
    for region in LAYOUT.regions:
        a, b, c, e = map(tuple, region.outline)
        space.add_solid([a, b, e, c], **on("SILICON"))


HIDDEN = Right(said=("invisible", "frozen", "off", "hidden"))


@dxf("invisible circle", HIDDEN)
def _invisible(document, space):
    space.add_circle((12, 0), 1, **on("SILICON", invisible=1))


@dxf("heater on a layer that is off", Right(refused=("HEATER", "off")))
def _off(document, space):
    document.layers.get("HEATER").off()


@dxf("heater on a frozen layer, other case", Right(refused=("HEATER", "frozen")))
def _frozen(document, space):
    document.layers.get("HEATER").freeze()
    for entity in space.query("*[layer=='HEATER']"):
        entity.dxf.layer = "Heater"


@dxf("layer in another case", Right(-math.pi, said=("hole",)))
def _other_case(document, space):
    space.add_circle((12, 0), 1, **on("Silicon"))


@dxf("invisible insert", HIDDEN)
def _invisible_insert(document, space):
    part = block(document, IN_LEG)
    space.add_blockref(part, (0, 0), **on("0", invisible=1))


@dxf("insert on a layer that is off, content on layer 0", HIDDEN)
def _insert_off(document, space):
    document.layers.add("LATER").off()
    part = block(document, IN_LEG, "0")
    space.add_blockref(part, (0, 0), **on("LATER"))


@dxf("insert on a layer that is off, content on a layer that is on", Right(HOLE, said=("hole",)))
def _insert_off_content_on(document, space):
    document.layers.add("LATER").off()
    part = block(document, IN_LEG)
    space.add_blockref(part, (0, 0), **on("LATER"))


@dxf("insert in an insert on a frozen layer", HIDDEN)
def _nested_frozen(document, space):
    document.layers.add("LATER").freeze()
    part = block(document, IN_LEG)
    document.blocks.new("OUTER").add_blockref(part, (0, 0), **on("0"))
    space.add_blockref("OUTER", (0, 0), **on("LATER"))


@dxf("insert that is clipped", Right(said=("clip",), refused=("clip",)))
def _clipped(document, space):
    part = block(document, IN_LEG)
    insert = space.add_blockref(part, (0, 0), **on("SILICON"))
    XClip(insert).set_wcs_clipping_path([(0, -9), (5, -9), (5, 9), (0, 9)])


@dxf("insert of a block that is not there", Right(said=("INSERT", "PART"), refused=("PART",)))
def _no_block(document, space):
    space.add_blockref("PART", (0, 0), **on("SILICON"))


@dxf("picture below the silicon", Right(said=("IMAGE",)))
def _image(document, space):
    own = document.add_image_def("photo.png", size_in_pixel=(80, 40))
    space.add_image(own, (10, -1), (4, 2), **on("SILICON"))


@dxf("wipeout below a text", Right(said=("WIPEOUT",)))
def _wipeout(document, space):
    space.add_wipeout(IN_LEG, **on("SILICON"))


@dxf("polyline of constant width", Right(2 * 3.0))
def _const_width(document, space):
    own = space.add_lwpolyline([(20, 2), (20, 5.22)], **on("SILICON"))
    own.dxf.const_width = 3.0
    space.add_lwpolyline([(20, 2), (20, 2.1)], **on("NOTES"))


@dxf("tapered polyline", Right(2 * 3.0))
def _tapered(document, space):
    points = [(20, 3.22, 4.0, 2.0), (20, 5.22, 2.0, 2.0)]
    space.add_lwpolyline(points, format="xyse", **on("SILICON"))


@dxf("old polyline with default widths", Right(2 * 3.0))
def _old_width(document, space):
    points = [(20, 2), (20, 5.22)]
    space.add_polyline2d(points, **on("SILICON", default_start_width=3.0, default_end_width=3.0))


@dxf("donut around the leg's side", Right(math.pi * 2.0**2 / 2, heater=0.0))
def _donut(document, space):
    points = [(20, 3.22, 2.0, 2.0, 1.0), (20 + 2, 3.22, 2.0, 2.0, 1.0)]
    space.add_lwpolyline(
        [(x - 1, *rest) for x, *rest in points], format="xyseb", close=True, **on("SILICON")
    )


@dxf("wide polyline in a block at half the size", Right(2 * 3.0))
def _scaled_width(document, space):
    own = document.blocks.new("PART")
    own.add_lwpolyline([(0, -2.44), (0, 4.0)], **on("0")).dxf.const_width = 6.0
    space.add_blockref("PART", (20, 3.22), **on("SILICON", xscale=0.5, yscale=0.5))


@dxf("fitted polyline with its frame", Right(-math.pi, said=("hole",)))
def _frame(document, space):
    own = space.add_polyline2d([], close=True, **on("SILICON"))
    for angle in np.linspace(0, 2 * math.pi, 97)[:-1]:
        own.append_vertex((12 + math.cos(angle), math.sin(angle)), dxfattribs={"flags": 8})
    for x, y in box(10.5, -1.5, 13.5, 1.5):
        own.append_vertex((x, y), dxfattribs={"flags": 16})
    own.dxf.flags |= 4


@dxf("circle drawn from below", Right(-math.pi, said=("hole",)))
def _from_below(document, space):
    space.add_circle((-12, 0), 1, **on("SILICON", extrusion=(0, 0, -1)))


@dxf("hatch drawn from below", Right(area_with(BUMP)))
def _hatch_below(document, space):
    own = hatch(space, [(-x, y) for x, y in BUMP])
    own.dxf.extrusion = (0, 0, -1)


@dxf("stretched insert of a hatch", Right(area_with(BUMP)))
def _stretched(document, space):
    own = document.blocks.new("PART")
    hatch(own, [(x / 2, y) for x, y in BUMP], layer="0")
    space.add_blockref("PART", (0, 0), **on("SILICON", xscale=2.0))


@dxf("multiline on the silicon", Right(said=("MLINE",), refused=("MLINE",)))
def _mline(document, space):
    space.add_mline([(9, 0), (19, 0)], **on("SILICON"))


@dxf("mesh on the silicon", Right(said=("POLYLINE",), refused=("POLYLINE",)))
def _mesh(document, space):
    own = space.add_polymesh((2, 2), **on("SILICON"))
    for number, (x, y) in enumerate(IN_LEG):
        own.set_mesh_vertex(divmod(number, 2), (x, y, 0))


@dxf("on the sheet of paper only", Right(refused=("no outline",)), bare=True)
def _paper(document, space):
    paper = document.paperspace()
    for entity in list(space):
        space.move_to_layout(entity, paper)


@dxf("feet stated, with curves", Right(refused=("--unit um",)))
def _feet(document, space):
    document.units = 2
    space.add_circle((12, 0), 1, **on("SILICON"))


@dxf("kilometres stated, with curves", Right(refused=("--unit um",)))
def _kilometres(document, space):
    document.units = 7
    space.add_circle((12, 0), 1, **on("SILICON"))


def write_dxf(path: Path, *names: str) -> None:
    """Write the reference probe with one thing more, or several."""
    document = ezdxf.new("R2010")
    document.units = 13
    space = document.modelspace()
    for _, layer in (*LAYERS.values(), *ENDS.values()):
        document.layers.add(layer)
    if not BARE.intersection(names):
        space.add_lwpolyline(outline(), close=True, **on("SILICON"))
    for (_, layer), points in windows():
        space.add_lwpolyline(points, close=True, **on(layer))
    for name in names:
        DXF[name][0](document, space)
    document.saveas(path)


def windows() -> list[tuple[tuple[int, str], Points]]:
    """What is drawn beside the silicon, by layers."""
    drawn: list[tuple[tuple[int, str], Points]] = []
    for region in LAYOUT.regions:
        if region.name in LAYERS:
            (x0, y0), (x1, y1) = region.box.tolist()
            drawn.append((LAYERS[region.name], box(x0, y0 - 1, x1, y1 + 1)))
    for end in LAYOUT.terminals:
        (x, y0), (_, y1) = end.start, end.end
        drawn.append((ENDS[end.name], box(x - 1, y0, x, y1)))
    return drawn


# --- GDSII and OASIS ------------------------------------------------------------------------------

GDS: dict[str, tuple[bytes, bytes, Right]] = {}


def record(kind: int, type_: int, data: bytes = b"") -> bytes:
    return struct.pack(">HBB", 4 + len(data), kind, type_) + data


def words(*values: int) -> bytes:
    return struct.pack(f">{len(values)}h", *values)


def places(points: Points) -> bytes:
    """Coordinates in steps of 0.1 nm."""
    numbers = [round(1e4 * float(one)) for point in points for one in point]
    return record(16, 3, struct.pack(f">{len(numbers)}i", *numbers))


def text(kind: int, word: str) -> bytes:
    return record(kind, 6, word.encode() + b"\0" * (len(word) % 2))


def real(value: float) -> bytes:
    """Eight bytes, base 16."""
    power = 0
    while value >= 1:
        value, power = value / 16, power + 1
    while 0 < value < 1 / 16:
        value, power = value * 16, power - 1
    return bytes([64 + power]) + int(value * 2**56).to_bytes(7, "big")


def element(kind: int, layer: int, *own: bytes, type_: int = 14) -> bytes:
    head = record(kind, 0) + record(13, 2, words(layer)) + record(type_, 2, words(0))
    return head + b"".join(own) + record(17, 0)


def boundary(points: Points, layer: int = 1) -> bytes:
    return element(8, layer, places([*points, points[0]]))


def path(points: Points, width: float, ends: int, beyond: Sequence[float] = ()) -> bytes:
    """A path of the silicon; `beyond` by how far it goes on at its ends."""
    own = [record(33, 2, words(ends)), record(15, 3, struct.pack(">i", round(1e4 * width)))]
    for kind, length in zip((48, 49), beyond, strict=False):
        own.append(record(kind, 3, struct.pack(">i", round(1e4 * length))))
    return element(9, 1, *own, places(points))


def reference(name: str, at: Points, flags: int = 0, size: float = 1, angle: float = 0) -> bytes:
    own = text(18, name) + record(26, 1, struct.pack(">H", flags))
    own += record(27, 5, real(size)) + record(28, 5, real(angle))
    return record(10, 0) + own + places(at) + record(17, 0)


def cell(name: str, content: bytes) -> bytes:
    return record(5, 2, words(*[0] * 12)) + text(6, name) + content + record(7, 0)


def gds(name: str, content: bytes, right: Right = Right(), cells: bytes = b"") -> None:
    GDS[name] = content, cells, right


EDGE = (20.0, 3.22)
#: A box on the leg's side that runs around a hole of 1 µm² beside the leg.
WHOLE, RIM = box(20, 2, 24, 5.5), [(22, 4.8), (22, 3.8), (21, 3.8), (21, 4.8)]
AROUND = [*WHOLE, (20, 4.8), *RIM, (20, 4.8)]
gds("boundary of one point", boundary([(9, 1)]), Right(said=NO_EXTENT))
gds("boundary of equal points", boundary([(9, 1)] * 4), Right(said=NO_EXTENT))
gds("boundary of one point, another layer", boundary([(9, 1)], 77))
gds("square path of two equal points", path([EDGE] * 2, 2, 2), Right(2.0))
gds("square path of three equal points", path([EDGE] * 3, 2, 2), Right(2.0))
gds("round path of two equal points", path([EDGE] * 2, 4, 1), Right(2 * math.pi))
gds("flush path of two equal points", path([EDGE] * 2, 2, 0), Right(said=NO_EXTENT))
gds("square path of one point", path([EDGE], 2, 2), Right(2.0))
gds(
    "path of two equal points, ends of its own",
    path([EDGE] * 2, 2, 4, (1.0, 2.0)),
    Right(said=("path",)),
)
gds("path of no width", path([(9, 1), (12, 1)], 0, 0), Right(said=("without",)))
gds("round path", path([EDGE, (23, 3.22)], 4, 1), Right(3 * 2 + 2 * math.pi))
gds(
    "path of absolute width, twice as large",
    reference("PART", [EDGE], size=2.0),
    Right(2 * 1.0),
    cell("PART", path([(-0.5, 0), (0.5, 0)], -2, 0)),
)
for _flags, _name in ((4, "magnification"), (2, "angle"), (6, "magnification and angle")):
    gds(
        f"absolute {_name} within a reference",
        reference(
            "OUTER", [EDGE], size=1.25 if _flags & 4 else 1.0, angle=90.0 if _flags & 2 else 0.0
        ),
        Right(4.0, said=("bsolute",), refused=("bsolute",)),
        cell("PART", boundary(box(-2, 0, 2, 1)))
        + cell("OUTER", reference("PART", [(0, 0)], _flags, size=1.0)),
    )
gds("node on the silicon", element(21, 1, places([(9, 1), (12, 1)]), type_=42), Right())
gds("box beside the edge", element(45, 1, places([*BUMP, BUMP[0]]), type_=46), Right(4.0))
gds("boundary inside the silicon", boundary(IN_LEG))
gds(
    "boundary inside one that runs around a hole",
    boundary(AROUND) + boundary(box(22.5, 2.5, 23.5, 5)),
    Right(area_with(WHOLE) - 1.0),
)
gds(
    "boundary across itself",
    boundary([(19, 2), (22, 5), (22, 2), (19, 5)]),
    Right(refused=("itself",)),
)


def write_gds(path_: Path, *names: str) -> None:
    """Write the reference probe with one thing more, or several."""
    content, cells = (b"".join(GDS[name][part] for name in names) for part in (0, 1))
    content += boundary(outline()) + b"".join(
        boundary(points, number) for (number, _), points in windows()
    )
    head = record(0, 2, words(600)) + record(1, 2, words(*[0] * 12)) + text(2, "OWN")
    head += record(3, 5, real(1e-4) + real(1e-10))
    path_.write_bytes(head + cells + cell("LEVER", content) + record(4, 0))


# --- read and judged ------------------------------------------------------------------------------


def read(path_: Path) -> tuple[Probe, str]:
    """The lever as a probe file says it, and all that is said of it."""
    imported = import_drawing(path_, None, path_.parent)
    layers, ends = (
        {role: name if path_.suffix == ".dxf" else f"{number}/0" for role, (number, name) in own}
        for own in (LAYERS.items(), ENDS.items())
    )
    tip_um = [float(one) for one in LAYOUT.tip]
    thickness_um = LAYOUT.thickness_um
    own = {"shape": "drawing", "file": str(path_), "thickness_um": thickness_um, "tip_um": tip_um}
    probe = Probe.from_sections({"probe": own, "layers": layers, "terminals": ends}, path_.name)
    return probe, "\n".join([*imported.listing, *imported.notes, *probe.shape.notes()])


def areas(probe: Probe) -> tuple[float, float]:
    """Silicon and heater (µm²)."""
    regions = probe.layout().regions
    heater = sum(region.area for region in regions if region.part == "heater")
    return sum(region.area for region in regions), heater


def judged(path_: Path, right: Right, tip_K: float) -> list[str]:
    """What a drawing is read as, what is right, and the verdict."""
    whole = LAYOUT_UM2[0] + right.more, LAYOUT_UM2[1] + right.heater
    expected = "refused" if right.refused and not right.said else f"{whole[0]:.2f} {whole[1]:.2f}"
    try:
        probe, told = read(path_)
    except InputError as error:
        line = str(error).removeprefix(f"{path_.parent}/")
        named = all(word in line for word in right.refused)
        verdict = "refused with one line" if named and "\n" not in line else "refused, unnamed"
        return [f"refused: {line}"[:60], expected, verdict]
    except Exception as error:
        return [f"{type(error).__name__}: {error}"[:60], expected, "internal error"]
    own = areas(probe)
    found = f"{own[0]:.2f} {own[1]:.2f}"
    said = not right.said or any(word in told for word in right.said)
    same = max(abs(a - b) for a, b in zip(own, whole, strict=True)) < SAME_UM2
    if right.solved:
        kelvin = tip_of(probe)
        found, expected = f"{found}, {kelvin:.1f} K", f"{expected}, {tip_K:.1f} K"
        same = same and abs(kelvin - tip_K) < 1.0
    if right.refused and not right.said:
        return [found, expected, "wrong without a word"]
    if same:
        return [found, expected, "right" if said else "right, but not said"]
    return [found, expected, "said" if right.said and said else "wrong without a word"]


def tip_of(probe: Probe) -> float:
    """The tip at 8 V (K), on a coarse mesh."""
    return float(Lever(probe, COARSE).sweep([8.0]).tip_K[0])


LAYOUT_UM2 = areas(REFERENCE)


def main() -> None:
    """Make each drawing, read it, and count."""
    tip_K = tip_of(REFERENCE)
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        files = [("dxf", write_dxf, DXF), ("gds", write_gds, GDS)]
        for kind, write, drawings in files:
            for name, (*_, right) in drawings.items():
                path_ = Path(folder, f"{len(rows)}.{kind}")
                write(path_, name)
                rows.append([f"{kind} {name}", *judged(path_, right, tip_K)])
    table(["drawing", "as it is read (µm²)", "right", ""], rows)
    print()
    for verdict, count in Counter(row[-1] for row in rows).most_common():
        print(f"{count} of {len(rows)}: {verdict}")


if __name__ == "__main__":
    main()
