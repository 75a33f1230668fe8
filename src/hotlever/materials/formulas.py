"""Formulas of the temperature as probe files state them: parsed, never run as code.

A formula has numbers, the temperature ``T`` (K), names of parameters, ``+ - * / **``, parentheses
and some functions. Its derivatives by the temperature and by each parameter are exact: each step
of the formula hands on its value and its derivatives (forward mode; A. Griewank and A. Walther,
Evaluating Derivatives, SIAM 2008, ch. 3).
"""

from __future__ import annotations

import ast
import re
import warnings
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from hotlever.errors import excerpt, unknown_name
from hotlever.materials.laws import Evaluated
from hotlever.types import Array

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
#: What no parameter can be called.
RESERVED_NAMES = {"T", *FUNCTIONS, "pi"}
#: Operators, and their derivatives by what stands before and behind them.
_OPERATORS: dict[type[ast.operator], Callable[[Any, Any], tuple[Any, Any, Any]]] = {
    ast.Add: lambda x, y: (x + y, 1.0, 1.0),
    ast.Sub: lambda x, y: (x - y, 1.0, -1.0),
    ast.Mult: lambda x, y: (x * y, y, x),
    ast.Div: lambda x, y: (x / y, 1.0 / y, -x / (y * y)),
    # 0**y is flat by y
    ast.Pow: lambda x, y: (x**y, y * x ** (y - 1.0), x**y * np.log(np.where(x == 0, 1.0, x))),
}


class Expression(NamedTuple):
    """A formula that was parsed: its tree, and the names of its parameters."""

    tree: ast.expr
    names: tuple[str, ...]

    def __call__(self, T: Array, parameters: Mapping[str, float]) -> Evaluated:
        """Return the value at temperatures (K), with derivatives by ``T`` and all parameters.

        They are not finite where the formula divides by nothing or overflows.
        """
        values: dict[str, Dual] = {"T": (T, {"T": 1.0})}
        values |= {name: (np.float64(parameters[name]), {name: 1.0}) for name in self.names}
        with np.errstate(all="ignore"):
            value, by = _value(self.tree, values)
        names = ("T", *self.names)
        whole = {name: np.broadcast_to(by.get(name, 0.0), T.shape) for name in names}
        return np.broadcast_to(value, T.shape), whole


def names_in(text: str) -> set[str]:
    """Return the names in a text that may be those of parameters.

    Examples
    --------
    >>> sorted(names_in("rho0 * exp(1e-3*(T - T0))"))
    ['T0', 'rho0']
    """
    return set(re.findall(r"(?<![\w.])[A-Za-z_]\w*", text)) - RESERVED_NAMES


def parsed(text: str) -> Expression:
    """Parse a formula.

    Raises
    ------
    ValueError
        If it is none: the text says at which character, what was found and what is expected.

    Examples
    --------
    >>> parsed("rho0 * (1 + tcr*(T - 293))").names
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
    return Expression(tree, tuple(names))


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
            if name not in RESERVED_NAMES:
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
