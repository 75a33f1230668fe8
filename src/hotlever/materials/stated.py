"""Laws that a probe file states, by a table or a formula, in place of a number.

Between its lowest and its highest temperature such a law is what the file says, to the letter. No
lever is solved beyond: there it goes on along its tangent and levels off, so that an iterate of
Newton's method that strays can come back.
"""

from __future__ import annotations

import ast
import re
import warnings
from abc import abstractmethod
from collections.abc import Callable, Mapping
from functools import cached_property
from types import NoneType
from typing import Annotated, Any, ClassVar, Self, get_args

import numpy as np
from numpy.typing import ArrayLike
from pydantic import (
    Field,
    GetPydanticSchema,
    PlainSerializer,
    Strict,
    WrapValidator,
    model_validator,
)

from hotlever.errors import InputError, counted, excerpt, unknown_name
from hotlever.materials.heat import STANDARD_TEMPERATURE
from hotlever.materials.laws import FORMULA_FROM, FORMULA_TO, LEVELLING, Evaluated
from hotlever.piecewise import Piecewise, monotone_cubic
from hotlever.records import Record
from hotlever.text import with_unit
from hotlever.types import Array

# A list, which becomes a tuple.
_Numbers = Annotated[tuple[float, ...], Strict(False), PlainSerializer(list)]


class StatedLaw(Record):
    """A law of the temperature that a probe file states; called, it is one of `laws.Law`."""

    #: What it is called.
    noun: ClassVar[str]
    #: Temperatures at which the slope steps.
    steps: ClassVar[tuple[float, ...]] = ()
    #: Temperatures (K) that it may be stated for.
    least_K: ClassVar[float] = 1.0
    most_K: ClassVar[float] = 1e4
    #: Nodes and weights of Gauss's rule of eighth order, on −1 to 1.
    rule: ClassVar = np.polynomial.legendre.leggauss(4)

    @property
    def names(self) -> tuple[str, ...]:
        """The parameters that it has."""
        return ()

    @property
    @abstractmethod
    def temperature_range(self) -> tuple[float, float]:
        """The temperatures (K) between which it says something."""

    @property
    @abstractmethod
    def source(self) -> str:
        """Where it is from."""

    @property
    @abstractmethod
    def stated(self) -> Any:
        """What a file holds of it."""

    @property
    @abstractmethod
    def edges(self) -> Array:
        """Temperatures (K) between which it is smooth, for integrals."""

    @abstractmethod
    def inside(self, T: Array, parameters: Mapping[str, float]) -> Evaluated:
        """Return values between its ends, with derivatives by ``T`` and parameters."""

    def __call__(self, T: ArrayLike, parameters: Mapping[str, float] | None = None) -> Evaluated:
        """Return values at any temperature (K), with derivatives by ``T`` and parameters."""
        T = np.asarray(T, dtype=float)
        inside = np.clip(T, *self.temperature_range)
        value, by = self.inside(inside, parameters or {})
        outside = T - inside
        if not outside.any():
            return value, by
        slope = by["T"]
        with np.errstate(divide="ignore"):
            # it loses no more than half of a value while it levels off
            width = np.minimum(LEVELLING, 0.5 * np.abs(value / np.where(slope, slope, np.nan)))
        width = np.where(np.isfinite(width) & (width > 0.0), width, 1.0)
        beyond = np.tanh(outside / width)
        rise = np.where(np.abs(value) > 0.0, slope * width * beyond, 0.0)
        return value + rise, {**by, "T": slope * (1.0 - beyond**2)}

    def integral(self, T: ArrayLike, parameters: Mapping[str, float] | None = None) -> Evaluated:
        """Return the integral from 298.15 K on, with derivatives by ``T`` and parameters."""
        T = np.asarray(T, dtype=float)
        edges = self.edges
        value, by = self(T, parameters)
        names = [None, *(name for name in by if name != "T")]
        held = []
        for name in names:
            cells = self._gauss(edges[:-1], edges[1:], parameters, name)
            up_to = np.append(0.0, np.cumsum(cells))
            both = []
            for end in (T, np.asarray(STANDARD_TEMPERATURE)):
                before = np.clip(np.searchsorted(edges, end) - 1, 0, edges.size - 2)
                both.append(up_to[before] + self._gauss(edges[before], end, parameters, name))
            held.append(both[0] - both[1])
        rest = {name: integral for name, integral in zip(names[1:], held[1:], strict=True) if name}
        return held[0], {**rest, "T": value}

    def _gauss(
        self, low: Array, high: Array, parameters: Mapping[str, float] | None, name: str | None
    ) -> Array:
        """Return the integrals between temperatures (K) of the law or of one of its derivatives."""
        total = np.zeros(np.broadcast_shapes(np.shape(low), np.shape(high)))
        for node, weight in zip(*self.rule, strict=True):
            value, by = self(low + 0.5 * (1.0 + node) * (high - low), parameters)
            total += 0.5 * weight * (value if name is None else by[name])
        return np.asarray(total * (high - low))

    def fault(
        self,
        parameters: Mapping[str, float],
        within: tuple[float, float],
        unit: str,
        from_K: float,
        to_K: float,
    ) -> str:
        """Say where its value is none that can be, between temperatures (K); empty if nowhere."""
        ends = from_K, min(to_K, self.temperature_range[1])
        # between the rows of a table it is monotone
        rows = self.edges[(self.edges > ends[0]) & (self.edges < ends[1])]
        T = np.union1d(np.linspace(*ends, 401), rows)
        value, by = self.inside(T, parameters)
        low, high = within
        wrong = ~((value >= low) & (value <= high)) | ~np.isfinite(by["T"])
        if not wrong.any():
            return ""
        first = int(wrong.argmax())
        wrong_value = value[first] if not low <= value[first] <= high else by["T"][first]
        kind = "" if wrong_value == value[first] else "a slope of "
        return (
            f"is {kind}{with_unit(f'{wrong_value:.4g}', unit)} at {T[first]:.4g} K, expected "
            f"{low:.4g} to {high:.4g} from {T[0]:.4g} to {T[-1]:.4g} K"
        )


class Formula(StatedLaw):
    """A law by formula, such as ``1.5 * (T/300)**-1.2``; see `parsed`.

    Examples
    --------
    >>> law = Formula(formula="a * (T/300)**-1.2")
    >>> value, by = law(300.0, {"a": 1.5})
    >>> value.item(), by["T"].item(), by["a"].item()
    (1.5, -0.006, 1.0)
    """

    noun: ClassVar = "formula"

    formula: str = Field(description="of the temperature T and of parameters")
    from_K: float = Field(default=FORMULA_FROM, description="from which it holds")
    to_K: float = Field(default=FORMULA_TO, description="up to which it holds")

    @model_validator(mode="after")
    def _is_a_formula_between_temperatures(self) -> Self:
        if not self.least_K <= self.from_K < self.to_K <= self.most_K:
            raise ValueError(
                f"from_K = {self.from_K:g} and to_K = {self.to_K:g}: expected rising temperatures "
                f"from {self.least_K:g} to {self.most_K:g} K"
            )
        parsed(self.formula)
        return self

    @cached_property
    def _parsed(self) -> tuple[ast.expr, tuple[str, ...]]:
        return parsed(self.formula)

    @property
    def names(self) -> tuple[str, ...]:
        """The parameters that it has."""
        return self._parsed[1]

    @property
    def temperature_range(self) -> tuple[float, float]:
        """The temperatures (K) between which it holds."""
        return self.from_K, self.to_K

    @property
    def source(self) -> str:
        """The formula."""
        return f"formula {excerpt(self.formula, 60)}"

    @property
    def stated(self) -> Any:
        """The text, with the temperatures between which it holds where they are not the usual."""
        usual = self.temperature_range == (FORMULA_FROM, FORMULA_TO)
        return self.formula if usual else self.model_dump()

    @property
    def edges(self) -> Array:
        """Temperatures (K) between which it is integrated."""
        steps = int(np.ceil((self.to_K - self.from_K) / 5.0))
        return np.linspace(self.from_K, self.to_K, steps + 1)

    def inside(self, T: Array, parameters: Mapping[str, float]) -> Evaluated:
        """Return values between its ends, with derivatives by ``T`` and parameters.

        They are not finite where the formula divides by nothing or overflows.
        """
        tree, own = self._parsed
        values: dict[str, Dual] = {"T": (T, {"T": 1.0})}
        values |= {name: (np.float64(parameters[name]), {name: 1.0}) for name in own}
        with np.errstate(all="ignore"):
            value, by = _value(tree, values)
        whole = {name: np.broadcast_to(by.get(name, 0.0), T.shape) for name in ("T", *own)}
        return np.broadcast_to(value, T.shape), whole


class Table(StatedLaw):
    """A law by values at some temperatures (K), with a monotone cubic between them.

    Examples
    --------
    >>> law = Table(temperature_K=[300.0, 400.0, 600.0], values=[1.0, 2.0, 3.0])
    >>> law([300.0, 350.0, 400.0])[0].round(4).tolist()
    [1.0, 1.5593, 2.0]
    """

    noun: ClassVar = "table"

    file: str | None = Field(default=None, description="that they are from")
    temperature_K: _Numbers = Field(description="rising")
    values: _Numbers = Field(description="in the unit of the property")

    @model_validator(mode="after")
    def _has_rising_temperatures_with_values(self) -> Self:
        T = self.edges
        if T.size != len(self.values) or not 2 <= T.size <= 2000:
            raise ValueError(
                f"{counted(T.size, 'temperature')} and {counted(len(self.values), 'value')}, "
                "expected as many, 2 to 2000"
            )
        if not (np.diff(T) > 0).all():
            row = int((np.diff(T) <= 0).argmax())
            raise ValueError(
                f"{T[row + 1]:g} K follows {T[row]:g} K, expected temperatures that rise"
            )
        if T[0] < self.least_K or T[-1] > self.most_K:
            raise ValueError(
                f"{T[0]:g} to {T[-1]:g} K, expected temperatures from {self.least_K:g} to "
                f"{self.most_K:g} K"
            )
        return self

    @cached_property
    def _curve(self) -> Piecewise:
        return monotone_cubic(self.edges, np.array(self.values))

    @cached_property
    def _slope(self) -> Piecewise:
        return self._curve.derivative()

    @property
    def temperature_range(self) -> tuple[float, float]:
        """The first and the last temperature (K)."""
        return self.temperature_K[0], self.temperature_K[-1]

    @property
    def source(self) -> str:
        """The file, and how it is read between its rows."""
        return f"table {self.file or 'of the probe file'}, monotone cubic (PCHIP)"

    @property
    def stated(self) -> Any:
        """The values, and the file they are from."""
        return self.model_dump(exclude_none=True)

    @property
    def edges(self) -> Array:
        """The temperatures of the table."""
        return np.array(self.temperature_K)

    def inside(self, T: Array, parameters: Mapping[str, float]) -> Evaluated:
        """Return values between its ends, with their derivative by ``T``."""
        return self._curve(T), {"T": self._slope(T)}

    def __repr__(self) -> str:
        # a file may hold thousands
        low, high = self.temperature_range
        return f"Table({low:g} to {high:g} K, {len(self.values)} values)"


# --- in records -----------------------------------------------------------------------------------


def law_stated(value: str | Mapping[str, Any] | StatedLaw) -> StatedLaw:
    """Return the law that a text or a section of a probe file states.

    Raises
    ------
    ValueError
        If it states none.
    """
    if isinstance(value, StatedLaw):
        return value
    section = {"formula": value} if isinstance(value, str) else dict(value)
    kind = Formula if "formula" in section else Table
    try:
        return kind.from_values(section, "")
    except InputError as error:
        missing = str(error).endswith(" is missing")
        hint = ", expected a formula or temperature_K and values" if missing else ""
        raise ValueError(f"{error}{hint}") from None


def number_or_law(within: tuple[float, float]) -> GetPydanticSchema:
    """Return the annotation of a property of a material: a number within bounds, or a law."""

    def read(value: Any, check: Callable[[Any], Any]) -> Any:
        return law_stated(value) if isinstance(value, str | Mapping | StatedLaw) else check(value)

    def write(value: Any) -> Any:
        return value.stated if isinstance(value, StatedLaw) else value

    low, high = within
    schema: Any = Annotated[
        float, Field(ge=low, le=high), WrapValidator(read), PlainSerializer(write)
    ]

    def of_type(annotated: Any, handler: Callable[[Any], Any]) -> Any:
        return handler(schema | None if NoneType in get_args(annotated) else schema)

    return GetPydanticSchema(of_type)


def names_stated(values: Mapping[str, Any]) -> set[str]:
    """Return the names in all formulas of a section of a probe file, parsed or not."""
    names = set[str]()
    for value in values.values():
        if isinstance(value, StatedLaw):
            names.update(value.names)
        text = value.get("formula") if isinstance(value, Mapping) else value
        if isinstance(text, str):
            names |= names_in(text)
    return names


# --- formulas -------------------------------------------------------------------------------------

# A formula has numbers, the temperature `T` (K), names of parameters, + - * / **, parentheses and
# some functions; it is parsed, never run as code. Its derivatives by the temperature and by each
# parameter are exact: each step hands on its value and its derivatives (forward mode; A. Griewank
# and A. Walther, Evaluating Derivatives, SIAM 2008, ch. 3).

# Value and derivatives, by name.
Dual = tuple[Any, dict[str, Any]]

#: Functions and their derivatives by the argument, which are given the value too.
FUNCTIONS: dict[str, tuple[Callable[..., Any], Callable[[Any, Any], Any]]] = {
    "exp": (np.exp, lambda x, y: y),
    "log": (np.log, lambda x, y: 1.0 / x),
    "log10": (np.log10, lambda x, y: 1.0 / (x * np.log(10.0))),
    "sqrt": (np.sqrt, lambda x, y: 0.5 / y),
    "sin": (np.sin, lambda x, y: np.cos(x)),
    "cos": (np.cos, lambda x, y: -np.sin(x)),
    "sinh": (np.sinh, lambda x, y: np.cosh(x)),
    "cosh": (np.cosh, lambda x, y: np.sinh(x)),
    "tanh": (np.tanh, lambda x, y: 1.0 - y * y),
    "atan": (np.arctan, lambda x, y: 1.0 / (1.0 + x * x)),
}
#: Operators, and their derivatives by what stands before and behind them.
_OPERATORS: dict[type[ast.operator], Callable[[Any, Any], tuple[Any, Any, Any]]] = {
    ast.Add: lambda x, y: (x + y, 1.0, 1.0),
    ast.Sub: lambda x, y: (x - y, 1.0, -1.0),
    ast.Mult: lambda x, y: (x * y, y, x),
    ast.Div: lambda x, y: (x / y, 1.0 / y, -x / (y * y)),
    # 0**y is flat by y
    ast.Pow: lambda x, y: (x**y, y * x ** (y - 1.0), x**y * np.log(np.where(x == 0, 1.0, x))),
}


def names_in(text: str) -> set[str]:
    """Return the names in a text that may be those of parameters.

    Examples
    --------
    >>> sorted(names_in("rho0 * exp(1e-3*(T - T0))"))
    ['T0', 'rho0']
    """
    return set(re.findall(r"(?<![\w.])[A-Za-z_]\w*", text)) - {"T", "pi", *FUNCTIONS}


def parsed(text: str) -> tuple[ast.expr, tuple[str, ...]]:
    """Parse a formula: return its tree, and the names of its parameters.

    Raises
    ------
    ValueError
        If it is none: the text says at which character, what was found and what is expected.

    Examples
    --------
    >>> parsed("rho0 * (1 + tcr*(T - 293))")[1]
    ('rho0', 'tcr')
    """
    if len(text) > 1000:
        raise ValueError(f"a formula of {len(text)} characters, expected at most 1000")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            tree = ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        offset = getattr(error, "offset", None)
        where = f"character {offset}: " if offset else ""
        raise ValueError(
            f"{where}not a formula, expected one of T such as 1.5 * (T/300)**-1.2, or the name "
            "of a table's file that ends in .csv, .txt, .tsv or .dat"
        ) from None
    if isinstance(tree, ast.Constant):
        raise ValueError("found a number in quotes, expected it without them, or a formula of T")
    names: dict[str, None] = {}
    _check(tree, names, text.strip(), 0, [0])
    return tree, tuple(names)


def _check(node: ast.AST, names: dict[str, None], text: str, depth: int, steps: list[int]) -> None:
    """Refuse what no formula has; collect the names of parameters."""
    steps[0] += 1
    where = f"character {getattr(node, 'col_offset', 0) + 1}"
    if depth > 60 or steps[0] > 300:
        raise ValueError(
            f"{where}: nested too deeply or too long, expected at most 60 levels and 300 steps"
        )
    inner: list[ast.expr]
    match node:
        case ast.Constant(value=value) if type(value) in (int, float):
            if not abs(_number(value)) < np.inf:
                raise ValueError(f"{where}: the number is too large")
            return
        case ast.Name(id=name):
            if name in FUNCTIONS:
                raise ValueError(f"{where}: {name} is a function, expected {name}(…)")
            if name not in ("T", "pi"):
                names[name] = None
            return
        case ast.UnaryOp(op=ast.UAdd() | ast.USub(), operand=operand):
            inner = [operand]
        case ast.BinOp(op=op) if type(op) in _OPERATORS:
            inner = [node.left, node.right]
        case ast.BinOp(op=ast.BitXor()):
            where = f"character {(node.left.end_col_offset or 0) + 1}"
            raise ValueError(f"{where}: ^ is no power, expected **")
        case ast.Call(func=ast.Name(id=name), args=[argument], keywords=[]):
            if name not in FUNCTIONS:
                raise ValueError(f"{where}: {unknown_name('function', name, FUNCTIONS)}")
            inner = [argument]
        case ast.Tuple():
            raise ValueError(f"{where}: found a comma, expected decimal points")
        case _:
            part = (
                excerpt(ast.get_source_segment(text, node) or text)
                if hasattr(node, "lineno")
                else ""
            )
            raise ValueError(
                f"{where}: '{part}' cannot be in a formula, expected numbers, T, parameters, "
                f"+ - * / ** ( ) and {', '.join(FUNCTIONS)}"
            )
    for each in inner:
        _check(each, names, text, depth + 1, steps)


def _number(value: Any) -> float:
    """Return a literal as a float; a whole number of hundreds of digits is infinite."""
    try:
        return float(value)
    except OverflowError:
        return np.inf


def _value(node: ast.AST, values: Mapping[str, Dual]) -> Dual:
    """Evaluate a checked tree and its derivatives."""
    match node:
        case ast.Constant(value=value):
            return np.float64(_number(value)), {}
        case ast.Name(id=name):
            return values[name] if name in values else (np.float64(np.pi), {})
        case ast.UnaryOp(op=op, operand=operand):
            x, dx = _value(operand, values)
            return (x, dx) if isinstance(op, ast.UAdd) else (-x, _chain((-1.0, dx)))
        case ast.BinOp(op=op, left=left, right=right):
            (x, dx), (y, dy) = _value(left, values), _value(right, values)
            if isinstance(op, ast.Pow) and not dy:
                return _power(x, dx, y)
            z, by_x, by_y = _OPERATORS[type(op)](x, y)
            return z, _chain((by_x, dx), (by_y, dy))
        case ast.Call(func=ast.Name(id=name), args=[argument]):
            function, derivative = FUNCTIONS[name]
            x, dx = _value(argument, values)
            y = function(x)
            return y, _chain((derivative(x, y), dx)) if dx else {}
    raise AssertionError(f"{node} was not checked")


def _power(x: Any, dx: dict[str, Any], y: Any) -> Dual:
    """Return a power whose exponent is a number; small whole ones are products, which are fast."""
    if y == 2.0:
        return x * x, _chain((2.0 * x, dx))
    if y == 3.0:
        square = x * x
        return square * x, _chain((3.0 * square, dx))
    z = x**y
    if not dx:
        return z, {}
    lower = z / x if np.all(x) else x ** (y - 1.0)
    return z, _chain((y * lower, dx))


def _chain(*terms: Dual) -> dict[str, Any]:
    """Return the sum of derivatives, each times a factor."""
    total: dict[str, Any] = {}
    for factor, by in terms:
        for name, slope in by.items():
            change = factor * slope
            total[name] = total[name] + change if name in total else change
    return total
