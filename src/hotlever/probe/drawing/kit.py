"""Levers drawn in Python: areas, what they are made of, and where terminals hold them.

Areas are polygons of shapely, one or several, with holes or without, so that all of that library
can be used on them; wherever one is expected a list of points is too (µm). A `Drawing` says what
the sections ``[probe]``, ``[layers]`` and ``[terminals]`` of a probe file say, and goes the same
way to a layout. A function of dimensions that returns one makes a shape (`ParametricDrawing`).
"""

from __future__ import annotations

import inspect
import math
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from importlib import import_module
from typing import (
    Annotated,
    Any,
    ClassVar,
    Literal,
    TypeAlias,
    get_args,
    get_origin,
    get_type_hints,
)

import numpy as np
import shapely
from pydantic import Field, create_model
from shapely import MultiPolygon, Polygon, affinity
from shapely import box as rectangle

from hotlever.errors import InputError, quoted
from hotlever.materials import LOW_DOPED
from hotlever.probe.drawing.outlines import GRID, DrawingError, Ring, polygons, rings_of
from hotlever.probe.drawing.shape import DrawnShape
from hotlever.probe.layout import Layout, Point
from hotlever.probe.parts import PARTS
from hotlever.probe.shapes import EDGE_BIAS, Shape, edge_bias
from hotlever.types import Array

__all__ = ["Drawing", "Layer", "Polygon", "difference", "fillet", "mirror", "rectangle", "union"]

Area: TypeAlias = "Polygon | MultiPolygon | Sequence[Point]"


@dataclass(frozen=True)
class Layer:
    """What is drawn in one layer, and what it is made of.

    Attributes
    ----------
    drawn : area or str
        Or the name of a layer of the drawing's file.
    material : str, optional
        Its name among the materials of the probe; left out: the silicon of ``[material]``.
    thickness_um : float, optional
        Of a film on the body; left out: a part of the body.
    """

    drawn: Area | str
    material: str | None = None
    thickness_um: float | None = None


@dataclass(frozen=True)
class Drawing:
    """A lever as it is drawn; see `hotlever.Probe.from_drawing`.

    Attributes
    ----------
    layers : mapping of str to Layer
        Or to an area of the silicon of ``[material]``: ``silicon`` (or ``body``) is the whole
        lever, ``heater`` and any other name a low-doped part of it.
    terminals : mapping of str to area
        The edges inside it are the terminal; a line of two points is too, and ``{"area": …}`` makes
        all below it one. There are ``supply`` and ``ground``, and ``reader`` if there is one.
    tip_um : tuple of float
        Place of the tip.
    thickness_um : float
        Of the body.
    file, cell : str, optional
        GDSII, OASIS or DXF; layers and terminals may then be names of its layers.
    tolerance_um : float, optional
        What is nearer is the same; left out: 0.0001, of a file 0.002.

    Examples
    --------
    >>> from hotlever import Probe
    >>> leg = rectangle(0, 2, 30, 6)
    >>> drawing = Drawing(
    ...     layers={
    ...         "silicon": union(leg, mirror(leg), rectangle(30, -6, 34, 6)),
    ...         "heater": rectangle(29, -2, 35, 2),
    ...     },
    ...     terminals={"supply": [(0, -6), (0, -2)], "ground": [(0, 2), (0, 6)]},
    ...     tip_um=(32, 0),
    ...     thickness_um=0.4,
    ... )
    >>> sorted(region.name for region in Probe.from_drawing(drawing).layout().regions)
    ['heater', 'silicon at ground', 'silicon at supply']
    """

    layers: Mapping[str, Layer | Area | str]
    terminals: Mapping[str, Area | str | Mapping[str, Area | str]]
    tip_um: Point
    thickness_um: float
    file: str | None = None
    cell: str | None = None
    tolerance_um: float | None = None

    @classmethod
    def of_layout(cls, layout: Layout) -> Drawing:
        """Return the drawing of a lever of a built-in shape."""
        low = {each.name: each.outline for each in layout.regions if each.material == LOW_DOPED}
        return cls(
            layers={"silicon": union(*(region.outline for region in layout.regions)), **low},
            terminals={end.name: (end.start, end.end) for end in layout.terminals},
            tip_um=layout.tip,
            thickness_um=layout.thickness_um,
        )

    def sections(self) -> dict[str, dict[str, Any]]:
        """Return the sections of a probe file that describe it.

        Raises
        ------
        InputError
            If what is drawn is no area.
        """
        probe = {
            name: getattr(self, name)
            for name in ("thickness_um", "tip_um", "file", "cell", "tolerance_um")
            if getattr(self, name) is not None
        }
        if self.file is None:
            # what is drawn by numbers is drawn well: where a dimension moves one of two edges that
            # were the same, they are not the same any more
            probe.setdefault("tolerance_um", 1e-4)
        return {
            "probe": {"shape": "drawing", **probe},
            "layers": {name: _stated(each) for name, each in self.layers.items()},
            "terminals": {name: _stated(each) for name, each in self.terminals.items()},
        }


def union(*areas: Area) -> Polygon | MultiPolygon:
    """Return all that lies in any of some areas.

    Raises
    ------
    DrawingError
        If an outline crosses itself.
    """
    return shapely.union_all([_area(area, "union") for area in areas], grid_size=GRID)


def difference(area: Area, *others: Area) -> Polygon | MultiPolygon:
    """Return an area without what lies in others.

    Raises
    ------
    DrawingError
        If an outline crosses itself, or nothing is left.
    """
    whole = _area(area, "difference")
    rest = shapely.difference(whole, union(*others), grid_size=GRID)
    if rest.is_empty:
        raise DrawingError("nothing is left", "difference", place=whole)
    return rest


def mirror(area: Area, *, x_um: float | None = None, y_um: float = 0.0) -> Polygon | MultiPolygon:
    """Return an area seen in the line y = y_um, or x = x_um if that is given (µm).

    Raises
    ------
    DrawingError
        If an outline crosses itself.

    Examples
    --------
    >>> mirror(rectangle(0, 1, 4, 3)).bounds, mirror(rectangle(0, 1, 4, 3), x_um=4).bounds
    ((0.0, -3.0, 4.0, -1.0), (4.0, 1.0, 8.0, 3.0))
    """
    across, about = ((1, -1), (0, y_um)) if x_um is None else ((-1, 1), (x_um, 0))
    return affinity.scale(_area(area, "mirror"), *across, origin=about)


def fillet(
    area: Area, radius_um: float, at: Sequence[Point] | None = None, *, quarter: int = 8
) -> Polygon | MultiPolygon:
    """Return an area with rounded corners.

    An arc is made of straight lines, as many for each corner whatever the radius is, so that it
    can be a dimension.

    Parameters
    ----------
    area : area
    radius_um : float
    at : sequence of points, optional
        Round the corners nearest to these; all if left out.
    quarter : int
        Lines that stand for a quarter of a circle.

    Raises
    ------
    DrawingError
        If an edge has no room for the radius, or an outline crosses itself.

    Examples
    --------
    >>> round(fillet(rectangle(0, 0, 4, 4), 1.0, quarter=100).area - (16 - 4 + math.pi), 3)
    -0.0
    """
    # without corners that are none, where areas were joined
    whole = _area(area, "fillet").normalize().simplify(GRID)
    if not radius_um > 0:
        raise InputError(f"fillet: found a radius of {radius_um:g} µm, expected one above 0")
    corners = shapely.get_coordinates(whole)
    if at is not None:
        points = np.array(at, dtype=float).reshape(-1, 1, 2)
        corners = corners[np.linalg.norm(points - corners, axis=2).argmin(axis=1)]
    rounded = []
    for part in shapely.get_parts(whole):
        outline, *holes = (_rounded(ring, corners, radius_um, quarter) for ring in rings_of(part))
        rounded.append(Polygon(outline, holes))
    return union(*rounded)


def _rounded(outline: Ring, chosen: Array, radius: float, quarter: int) -> Array:
    """Return a ring, (n, 2), with arcs in place of chosen corners."""
    ring = np.array(outline)
    before, after = np.roll(ring, 1, axis=0) - ring, np.roll(ring, -1, axis=0) - ring
    room = np.linalg.norm(after, axis=1)
    cross = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    turn = math.pi - np.abs(np.arctan2(cross, (before * after).sum(axis=1)))
    here = (ring[:, None] == chosen).all(axis=2).any(axis=1) & (turn > 1e-6)
    cut = np.where(here, radius * np.tan(turn / 2), 0.0)
    lacking = cut + np.roll(cut, -1) - room
    if lacking.max() > 0:
        worst = int(lacking.argmax())
        raise DrawingError(
            f"with a radius of {radius:g} µm its arcs need {(lacking + room)[worst]:.4g} µm of an "
            f"edge of {room[worst]:.4g} µm, expected a radius of at most "
            f"{radius * room[worst] / (lacking + room)[worst]:.4g} µm",
            "fillet",
            place=ring[worst],
        )
    points: list[Array] = []
    for corner, to_before, to_after, angle, length in zip(
        ring, before, after, turn, cut, strict=True
    ):
        if not length:
            points.append(corner[None])
            continue
        back, on = to_before / np.linalg.norm(to_before), to_after / np.linalg.norm(to_after)
        middle = corner + (back + on) * length / (1 + float(back @ on))
        first, last = corner + length * back - middle, corner + length * on - middle
        steps = max(1, round(angle / (math.pi / 2) * quarter))
        share = np.linspace(0.0, angle, steps + 1)[:, None]
        # along the circle from one point of contact to the other
        points.append(
            middle + (np.sin(angle - share) * first + np.sin(share) * last) / math.sin(angle)
        )
    return np.concatenate(points)


def _area(area: Any, what: str) -> Polygon | MultiPolygon:
    """Return what is given as an area as one that is valid; `what` names it in an error."""
    if isinstance(area, Polygon | MultiPolygon):
        if area.is_valid:
            return area
        # says where, if it is one outline that is wrong
        outlines = polygons(what, rings_of(area), 0.0)
        raise DrawingError("outlines that cross or touch each other", what, place=outlines[0])
    try:
        ring = tuple((float(x), float(y)) for x, y in area)
    except (TypeError, ValueError):
        raise InputError(
            f"{what}: found {quoted(area)}, expected a polygon or points such as "
            "[(0, 0), (4, 0), (4, 2)] (µm)"
        ) from None
    return polygons(what, [ring], 0.0)[0]


def _stated(entry: Any) -> Any:
    """Return what a section says of a layer, of an area, or of an area that is all contact."""
    if isinstance(entry, Layer):
        own = {"material": entry.material, "thickness_um": entry.thickness_um}
        own = {key: value for key, value in own.items() if value is not None}
        return {"drawn": _stated(entry.drawn), **own} if own else _stated(entry.drawn)
    if isinstance(entry, Mapping):
        return {key: _stated(area) for key, area in entry.items()}
    # the name of a layer, or a list of points, stays as it is
    return rings_of(entry) if isinstance(entry, Polygon | MultiPolygon) else entry


# --- drawn by a function of dimensions ------------------------------------------------------------

#: The shapes of functions that probes of this process were made of, by the functions' names.
_SHAPES: dict[str, type[ParametricDrawing]] = {}


class ParametricDrawing(Shape):
    """A lever that a function draws; its dimensions (µm) are the function's arguments.

    Each function makes a class of its own. Files name the function and hold the dimensions, and are
    read where a probe was made of that function.
    """

    draw: ClassVar[Callable[..., Drawing]]

    shape: Literal["parametric-drawing"] = "parametric-drawing"
    function: str
    edge_bias_um: float = edge_bias()
    #: That of each material, by name; no key of a probe file.
    kinds: tuple[tuple[str, str], ...] = Field(default=(), exclude=True, repr=False)

    @classmethod
    def of(cls, function: Callable[..., Drawing]) -> type[ParametricDrawing]:
        """Return the class of a function's shapes.

        Raises
        ------
        InputError
            If an argument is no dimension with a default.
        """
        name = f"{_module(function)}.{function.__qualname__}"
        shape_class = _SHAPES.get(name)
        if shape_class is None or shape_class.draw is not function:
            fields: dict[str, Any] = {"function": (str, name), **_dimensions(function)}
            shape_class = create_model(function.__name__, __base__=ParametricDrawing, **fields)
            shape_class.draw = staticmethod(function)
            _SHAPES[name] = shape_class
        return shape_class

    @classmethod
    def read(
        cls, values: Mapping[str, Any], where: str, kinds: Mapping[str, str]
    ) -> ParametricDrawing:
        """Make a shape of the section ``[probe]`` of a probe file.

        Raises
        ------
        InputError
            If no probe was made of its function, or a dimension is missing or wrong.
        DrawingError
            If what the function draws is at fault.
        """
        name = str(values.get("function"))
        # a file does not name what is run
        shape_class = cls if hasattr(cls, "draw") else _SHAPES.get(name)
        if shape_class is None or shape_class.name() != name:
            raise InputError(
                f"{where}: [probe]: function = {quoted(name)} is Python, which no file holds: "
                "expected Probe.from_drawing(function) before it is read, or a lever saved as "
                "GDSII"
            )
        own = {**values, "kinds": tuple(kinds.items())}
        return shape_class.from_values(own, f"{where}: [probe]")

    @classmethod
    def name(cls) -> str:
        """Return the function's name, with that of its module."""
        return str(cls.model_fields["function"].default)

    def __reduce_ex__(self, protocol: Any) -> Any:
        function = type(self).draw
        module = _module(function)
        # what was typed into an interpreter is in no file
        in_file = hasattr(sys.modules.get(module), "__file__")
        if not in_file or _imported(module, function.__qualname__) is not function:
            raise InputError(
                f"{type(self).name()} cannot be sent to other processes: expected a function at "
                "the top of a module that they can import"
            )
        values = {**self.model_dump(), "kinds": self.kinds}
        return _received, (module, function.__qualname__, values)

    def dimensions(self) -> dict[str, float]:
        """Return the arguments of the function (µm), and the bias of the edges, by name."""
        return self.model_dump(exclude={"shape", "function"})

    @property
    def drawn(self) -> DrawnShape:
        """What the function draws, as the shape of any drawing."""
        return _drawn(self)

    @property
    def materials(self) -> tuple[str, ...]:
        """The names of the materials that layers are said to be made of."""
        return self.drawn.materials

    def layout(self) -> Layout:
        """Return the regions, terminals and tip of this shape."""
        return self.drawn.layout()

    def notes(self) -> list[str]:
        """Say which contacts cover more of a leg than they count for."""
        return self.drawn.notes()


def sections_of(
    drawing: Drawing | Callable[..., Drawing],
) -> tuple[str, dict[str, dict[str, Any]]]:
    """Return a name of what is drawn, or of the function that draws it, and sections of a file.

    Raises
    ------
    InputError
        If it is neither, or an argument of the function is no dimension.
    """
    if isinstance(drawing, Drawing):
        return "drawing", drawing.sections()
    if not inspect.isfunction(drawing):
        raise InputError(f"found {quoted(drawing)}, expected a Drawing or a function")
    shape_class = ParametricDrawing.of(drawing)
    defaults = {
        name: field.default for name, field in shape_class.model_fields.items() if name != "kinds"
    }
    return drawing.__qualname__, {"probe": defaults}


def _module(function: Callable[..., Drawing]) -> str:
    """Return the name of a function's module, the same in processes that a script starts."""
    return (function.__module__ or "__main__").replace("__mp_main__", "__main__")


def _imported(module: str, name: str) -> Any:
    """Return what has a name, with dots if it is inside something, in a module."""
    inside: Any = import_module(module)
    for part in name.split("."):
        inside = getattr(inside, part, None)
    return inside


def _received(module: str, name: str, values: dict[str, Any]) -> ParametricDrawing:
    """Return a shape that another process has sent."""
    return ParametricDrawing.of(_imported(module, name)).model_construct(**values)


def _dimensions(function: Callable[..., Drawing]) -> dict[str, Any]:
    """Return the fields of a function's arguments."""
    hints, fields = get_type_hints(function, include_extras=True), {}
    for name, argument in inspect.signature(function).parameters.items():
        default, hint = argument.default, hints.get(name)
        if not name.endswith("_um") or type(default) not in (int, float):
            raise InputError(
                f"{function.__qualname__}: argument {name}: expected a dimension in µm with its "
                "default, such as leg_width_um=6.0"
            )
        texts = get_args(hint)[1:] if get_origin(hint) is Annotated else ()
        words = next((text for text in texts if isinstance(text, str)), None)
        meaning = words or name.removesuffix("_um").replace("_", " ")
        fields[name] = (
            float,
            Field(default=float(default), gt=0, le=2000.0, description=meaning),
        )
    owners = {EDGE_BIAS: "every drawing"} | {
        name: f"[{section}]" for section, part in PARTS.items() for name in part.model_fields
    }
    for name in fields.keys() & owners.keys():
        raise InputError(
            f"{function.__qualname__}: argument {name} is a name of {owners[name]}, expected "
            "another"
        )
    return fields


@lru_cache(maxsize=64)
def _drawn(shape: ParametricDrawing) -> DrawnShape:
    """Return what the function of a shape draws."""
    name = type(shape).name()
    arguments = {key: value for key, value in shape.dimensions().items() if key != EDGE_BIAS}
    drawing = type(shape).draw(**arguments)
    if not isinstance(drawing, Drawing):
        raise InputError(f"{name} returned {quoted(drawing)}, expected a Drawing")
    sections = drawing.sections()
    sections["probe"][EDGE_BIAS] = shape.edge_bias_um
    return DrawnShape.read(sections, name, None, dict(shape.kinds))


def drawn_shape(shape: Shape) -> DrawnShape:
    """Return any shape as it would be drawn."""
    if isinstance(shape, DrawnShape):
        return shape
    if isinstance(shape, ParametricDrawing):
        return shape.drawn
    return DrawnShape.read(Drawing.of_layout(shape.layout()).sections(), shape.shape)
