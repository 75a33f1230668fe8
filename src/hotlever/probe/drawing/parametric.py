"""Shapes drawn by a function of dimensions."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Callable, Mapping
from functools import lru_cache
from importlib import import_module
from typing import Annotated, Any, ClassVar, Literal, get_args, get_origin, get_type_hints

from pydantic import Field, create_model

from hotlever.errors import InputError, quoted
from hotlever.probe.drawing.kit import Drawing
from hotlever.probe.drawing.shape import DrawnShape
from hotlever.probe.layout import Layout
from hotlever.probe.parts import PARTS
from hotlever.probe.shapes import EDGE_BIAS, Shape, edge_bias

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
