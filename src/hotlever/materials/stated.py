"""Laws that a probe file states, by a table or a formula, in place of a number.

Between its lowest and its highest temperature such a law is what the file says, to the letter. No
lever is solved beyond: there it goes on along its tangent and levels off, so that an iterate of
Newton's method that strays can come back.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Mapping
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field, GetPydanticSchema, PlainSerializer, WrapValidator

from hotlever.errors import counted, quoted, shown, unknown_name
from hotlever.materials.formulas import Expression, names_in, parsed
from hotlever.materials.heat import STANDARD_TEMPERATURE
from hotlever.materials.laws import FORMULA_FROM, FORMULA_TO, LEVELLING, Evaluated
from hotlever.piecewise import Piecewise, monotone_cubic
from hotlever.text import with_unit
from hotlever.types import Array

#: Temperatures at which a law is checked, and distance (K) of those between which it is integrated.
_CHECKED, _STEP_K = 401, 5.0
#: Gauss's rule of eighth order, on 0 to 1.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(4)
_NODES, _WEIGHTS = 0.5 * (1.0 + _NODES), 0.5 * _WEIGHTS
#: Part of a value that a law may lose while it levels off.
_MAY_LOSE = 0.5
#: Width (K) of levelling off from a value of zero.
_NARROWEST_K = 1e-3
#: Rows that a table may have, and temperatures (K).
_MOST_ROWS, _LEAST_K, _MOST_K = 2000, 1.0, 1e4


class StatedLaw(ABC):
    """A law of the temperature that a probe file states; called, it is one of `laws.Law`.

    Attributes
    ----------
    lowest_K, highest_K : float
        Between which it says something.
    names : tuple of str
        Of the parameters that it has.
    source : str
    """

    lowest_K: float
    highest_K: float
    #: What it is called.
    noun: ClassVar[str]
    #: Temperatures at which the slope steps.
    steps: tuple[float, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """The parameters that it has."""
        return ()

    @property
    def temperature_range(self) -> tuple[float, float]:
        """The temperatures (K) between which it says something."""
        return self.lowest_K, self.highest_K

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
    def formula(self, T: Array, parameters: Mapping[str, float]) -> Evaluated:
        """Return values between its ends, with derivatives by ``T`` and parameters."""

    def __call__(self, T: ArrayLike, parameters: Mapping[str, float] | None = None) -> Evaluated:
        """Return values at any temperature (K), with derivatives by ``T`` and parameters."""
        T = np.asarray(T, dtype=float)
        inside = np.clip(T, self.lowest_K, self.highest_K)
        value, by = self.formula(inside, parameters or {})
        outside = T - inside
        if not outside.any():
            return value, by
        slope = by["T"]
        with np.errstate(divide="ignore"):
            width = np.minimum(
                LEVELLING, _MAY_LOSE * np.abs(value / np.where(slope, slope, np.nan))
            )
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
        for node, weight in zip(_NODES, _WEIGHTS, strict=True):
            value, by = self(low + node * (high - low), parameters)
            total += weight * (value if name is None else by[name])
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
        T = np.linspace(from_K, min(to_K, self.highest_K), _CHECKED)
        value, by = self.formula(T, parameters)
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
    """A law by formula, such as ``1.5 * (T/300)**-1.2``; see `hotlever.materials.formulas`.

    Parameters
    ----------
    text : str
    from_K, to_K : float
        Between which it holds.

    Raises
    ------
    ValueError
        If the text is no formula, or the temperatures do not rise.

    Examples
    --------
    >>> law = Formula("a * (T/300)**-1.2")
    >>> value, by = law(300.0, {"a": 1.5})
    >>> value.item(), by["T"].item(), by["a"].item()
    (1.5, -0.006, 1.0)
    """

    noun: ClassVar = "formula"

    def __init__(self, text: str, from_K: float = FORMULA_FROM, to_K: float = FORMULA_TO) -> None:
        self.text, self.lowest_K, self.highest_K = text, float(from_K), float(to_K)
        if not _LEAST_K <= self.lowest_K < self.highest_K <= _MOST_K:
            raise ValueError(
                f"from_K = {from_K:g} and to_K = {to_K:g}: expected rising temperatures "
                f"from {_LEAST_K:g} to {_MOST_K:g} K"
            )
        self._expression: Expression = parsed(text)

    @property
    def names(self) -> tuple[str, ...]:
        """The parameters that it has."""
        return self._expression.names

    @property
    def source(self) -> str:
        """The formula."""
        return f"formula {shown(self.text, 60)}"

    @property
    def stated(self) -> Any:
        """The text, with the temperatures between which it holds where they are not the usual."""
        if (self.lowest_K, self.highest_K) == (FORMULA_FROM, FORMULA_TO):
            return self.text
        return {"formula": self.text, "from_K": self.lowest_K, "to_K": self.highest_K}

    @property
    def edges(self) -> Array:
        """Temperatures (K) between which it is integrated."""
        steps = int(np.ceil((self.highest_K - self.lowest_K) / _STEP_K))
        return np.linspace(self.lowest_K, self.highest_K, steps + 1)

    def formula(self, T: Array, parameters: Mapping[str, float]) -> Evaluated:
        """Return values between its ends, with derivatives by ``T`` and parameters."""
        return self._expression(T, parameters)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Formula) and self.stated == other.stated

    def __hash__(self) -> int:
        return hash((self.text, self.lowest_K, self.highest_K))

    def __repr__(self) -> str:
        return f"Formula({self.text!r})"


class Table(StatedLaw):
    """A law by values at some temperatures (K), with a monotone cubic between them.

    Parameters
    ----------
    temperature_K, values : sequence of float
        Rising temperatures, and values in the parameter's unit.
    file : str, optional
        Where they are from.

    Raises
    ------
    ValueError
        If there are less than two of them, or not as many, or the temperatures do not rise.

    Examples
    --------
    >>> law = Table([300.0, 400.0, 600.0], [1.0, 2.0, 3.0])
    >>> law([300.0, 350.0, 400.0])[0].round(4).tolist()
    [1.0, 1.5593, 2.0]
    """

    noun: ClassVar = "table"

    def __init__(
        self, temperature_K: Collection[float], values: Collection[float], file: str | None = None
    ) -> None:
        T, column = (np.asarray(list(each), dtype=float) for each in (temperature_K, values))
        if T.size != column.size or not 2 <= T.size <= _MOST_ROWS:
            raise ValueError(
                f"{counted(T.size, 'temperature')} and {counted(column.size, 'value')}, "
                f"expected as many, 2 to {_MOST_ROWS}"
            )
        if not (np.isfinite(T).all() and np.isfinite(column).all()):
            raise ValueError("a value is no number, expected numbers alone")
        if not (np.diff(T) > 0).all():
            row = int((np.diff(T) <= 0).argmax())
            raise ValueError(
                f"{T[row + 1]:g} K follows {T[row]:g} K, expected temperatures that rise"
            )
        if T[0] < _LEAST_K or T[-1] > _MOST_K:
            raise ValueError(
                f"{T[0]:g} to {T[-1]:g} K, expected temperatures from {_LEAST_K:g} to {_MOST_K:g} K"
            )
        self.temperature_K, self.values = tuple(T.tolist()), tuple(column.tolist())
        self.file = file
        self.lowest_K, self.highest_K = self.temperature_K[0], self.temperature_K[-1]
        self._curve: Piecewise = monotone_cubic(T, column)
        self._slope = self._curve.derivative()

    @property
    def source(self) -> str:
        """The file, and how it is read between its rows."""
        return f"table {self.file or 'of the probe file'}, monotone cubic (PCHIP)"

    @property
    def stated(self) -> Any:
        """The values, and the file they are from."""
        named = {} if self.file is None else {"file": self.file}
        return {**named, "temperature_K": list(self.temperature_K), "values": list(self.values)}

    @property
    def edges(self) -> Array:
        """The temperatures of the table."""
        return np.array(self.temperature_K)

    def formula(self, T: Array, parameters: Mapping[str, float]) -> Evaluated:
        """Return values between its ends, with their derivative by ``T``."""
        return self._curve(T), {"T": self._slope(T)}

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Table) and self.stated == other.stated

    def __hash__(self) -> int:
        return hash((self.temperature_K, self.values))

    def __repr__(self) -> str:
        return f"Table({self.lowest_K:g} to {self.highest_K:g} K, {len(self.values)} values)"


# --- in records -----------------------------------------------------------------------------------


def law_stated(value: Any) -> StatedLaw:
    """Return the law that a text or a section of a probe file states.

    Raises
    ------
    ValueError
        If it states none.
    """
    if isinstance(value, StatedLaw):
        return value
    if isinstance(value, str):
        return Formula(value)
    kind, keys = (Formula, _OF_FORMULAS) if "formula" in value else (Table, _OF_TABLES)
    for key, entry in value.items():
        if key not in keys:
            raise ValueError(str(unknown_name("key", str(key), keys)))
        if not keys[key](entry):
            raise ValueError(f"found {key} = {quoted(entry)}, expected {keys[key].__doc__}")
    missing = [key for key in ("formula", "temperature_K", "values") if key in keys.keys() - value]
    if missing:
        raise ValueError(f"{missing[0]} is missing, expected a formula or temperature_K and values")
    given = dict(value)
    if kind is Formula:
        return Formula(given.pop("formula"), **given)
    return Table(**given)


def _is_text(entry: Any) -> bool:
    """a text"""
    return isinstance(entry, str)


def _is_number(entry: Any) -> bool:
    """a number"""
    return isinstance(entry, int | float) and not isinstance(entry, bool)


def _is_list(entry: Any) -> bool:
    """a list of numbers"""
    return isinstance(entry, list | tuple) and all(map(_is_number, entry))


_OF_FORMULAS = {"formula": _is_text, "from_K": _is_number, "to_K": _is_number}
_OF_TABLES = {"file": _is_text, "temperature_K": _is_list, "values": _is_list}


def number_or_law(within: tuple[float, float], *, or_none: bool = False) -> GetPydanticSchema:
    """Return the annotation of a property of a material: a number within bounds, or a law."""

    def read(value: Any, check: Callable[[Any], Any]) -> Any:
        if or_none and value is None:
            return None
        return law_stated(value) if isinstance(value, str | Mapping | StatedLaw) else check(value)

    def write(value: Any) -> Any:
        return value.stated if isinstance(value, StatedLaw) else value

    low, high = within
    schema = Annotated[float, Field(ge=low, le=high), WrapValidator(read), PlainSerializer(write)]
    return GetPydanticSchema(lambda _, handler: handler(schema))


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
