"""Immutable, checked records: the base of what files hold."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable
from typing import Annotated, Any, Self

import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    GetPydanticSchema,
    PlainSerializer,
    TypeAdapter,
    ValidationError,
    WrapValidator,
)

from hotlever.errors import InputError, excerpt, quoted, unknown_name


def bounded(meaning: str, least: float, most: float, default: Any = ...) -> Any:
    """Return the field of a number between bounds, its default if it has one, and what it is."""
    return Field(default, ge=least, le=most, description=meaning)


def _nan_if_none(value: Any, check: Callable[[Any], Any]) -> Any:
    return math.nan if value is None else check(value)


# A number of a result file, and a standard error; NaN where the file has none.
Number = Annotated[float, WrapValidator(_nan_if_none)]
StandardError = Annotated[float, Field(ge=0), WrapValidator(_nan_if_none)]


def stored_as(
    written: Any,
    read: Callable[..., Any] = np.array,
    write: Callable[[Any], Any] = np.ndarray.tolist,
) -> GetPydanticSchema:
    """Return the annotation of a type that stands in files as another one; by default an array.

    Parameters
    ----------
    written : type
        What a file holds, checked before it is read.
    read : callable
        Makes a value of what was written; given pydantic's validation information too, if it takes
        two arguments.
    write : callable
        Makes what is written of a value.
    """
    schema = Annotated[written, AfterValidator(read), PlainSerializer(write)]
    return GetPydanticSchema(lambda _, handler: handler(schema))


class Record(BaseModel):
    """A frozen pydantic model whose errors are one line that names the key.

    Raises
    ------
    InputError
        From `from_values` and `with_`, on a missing, misspelt or impossible value.
    """

    # strict: a number in quotes, or true, is no number
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, strict=True)

    @classmethod
    def __pydantic_init_subclass__(cls, **_: Any) -> None:
        """Say in the help what each value is, as in the comments of a probe file."""
        values = "\n".join(f"{name}\n    {text}" for name, text in cls.description().items())
        if values:
            cls.__doc__ = (
                f"{inspect.cleandoc(cls.__doc__ or '')}\n\nAttributes\n----------\n{values}\n"
            )

    @classmethod
    def from_values(cls, values: dict[str, Any], where: str) -> Self:
        """Check `values` and make a record; `where`, if any, names their origin in an error."""
        try:
            return cls.model_validate(values)
        except ValidationError as error:
            raise explained(error, cls, where) from None

    @classmethod
    def check_value(cls, key: str, value: float, where: str) -> None:
        """Refuse a number that no such record has under a key, whatever its others are."""
        field = cls.model_fields.get(key)
        if field is not None:
            kind: Any = Annotated[field.annotation, *field.metadata]
            try:
                TypeAdapter(kind).validate_python(value)
            except ValidationError as error:
                raise explained(error, cls, where) from None

    @classmethod
    def description(cls) -> dict[str, str]:
        """Return what each value is, by key, for the comments of a probe file."""
        fields = cls.model_fields.items()
        return {name: field.description for name, field in fields if field.description}

    def with_(self, **changes: Any) -> Self:
        """Return a copy with some values changed, checked again."""
        return type(self).from_values({**self.model_dump(), **changes}, type(self).__name__.lower())


def explained(error: ValidationError, record: type[BaseModel], where: str) -> InputError:
    """Turn pydantic's report into one line: the place, what was found, what is expected.

    A misspelt key also leaves the right one missing, so it is reported first.
    """
    reports = error.errors(include_url=False)
    first = min(reports, key=lambda report: report["type"] != "extra_forbidden")
    # where a number or a word may stand, pydantic adds which of them it has tried
    path = [part for part in first["loc"] if part not in ("float", "constrained-float")]
    key = excerpt(".".join(map(str, path)), 120)
    place = f"{where}: " if where else ""
    if first["type"] == "extra_forbidden" and len(first["loc"]) == 1:
        return unknown_name("key", key, record.model_fields, where)
    if first["type"] == "missing":
        return InputError(f"{place}{key} is missing")
    message = first["msg"].removeprefix("Value error, ")
    own_words = {
        "Input should be": "expected",
        "a valid dictionary or instance of": "keys of",
        "a valid tuple": "a list",
        "a valid string": "a text in quotes",
        "a valid boolean": "true or false",
        "a valid": "a",
    }
    for of_pydantic, words in own_words.items():
        message = message.replace(of_pydantic, words)
    limits = {
        "greater_than_equal": "at least",
        "less_than_equal": "at most",
        "greater_than": "more than",
        "less_than": "less than",
    }
    if first["type"] in limits:
        (limit,) = first["ctx"].values()
        message = f"expected {limits[first['type']]} {limit:g}"
    if not key:
        return InputError(f"{place}{message}")
    input_value = first["input"]
    value = f"{input_value:.12g}" if isinstance(input_value, float) else quoted(input_value)
    return InputError(f"{place}{key} = {value}: {message[0].lower()}{message[1:]}")
