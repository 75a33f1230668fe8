"""Cases: a published number of a lever or a material, and what was known of it beforehand.

A case is a probe file with a head: what is predicted, from which source, what that states, and what
had to be assumed. Numbers that the quantity asks for stand in ``[given]``, with a spread where they
are uncertain. The prediction is written down before the published number is.
"""

from __future__ import annotations

import os
from importlib import resources
from pathlib import Path
from typing import Any, Self

from pydantic import Field

from hotlever.errors import InputError, unknown_name
from hotlever.probe import Probe
from hotlever.probe.file_sections import read_sections
from hotlever.probe.parts import SECTIONS
from hotlever.probe.priors import Prior, parsed
from hotlever.records import Record
from hotlever.studies.validation.quantities import QUANTITIES, Quantity


class Stored(Record):
    """A prediction as it was written down: the median, and within what it is with 95 %."""

    median: float = Field(gt=0)
    low_95: float = Field(gt=0)
    high_95: float = Field(gt=0)


class Published(Record):
    """What was published, and its standard error as stated or as it can be read."""

    value: float = Field(gt=0)
    error: float = Field(gt=0)
    says: str = Field(description="the words of the source")


class Variant(Record):
    """Another assumption that was tried because the published number is outside the band."""

    why: str
    changes: dict[str, bool | float | str]


class Case(Record):
    """A published number, and what is known of what it is of."""

    name: str
    quantity: str
    group: str
    source: str
    stated: str
    assumed: str
    given: dict[str, float | str] = Field(default_factory=dict)
    lever: dict[str, Any] = Field(default_factory=dict)
    prediction: Stored | None = None
    published: Published | None = None
    remark: str = ""
    outside: str = Field(default="", description="why the published value is not in the band")
    variants: dict[str, Variant] = Field(default_factory=dict)

    @classmethod
    def from_file(cls, path: str | os.PathLike[str]) -> Self:
        """Read a case file.

        Raises
        ------
        InputError
            If it cannot be read, or something of it is missing, unknown or impossible.
        """
        where, values = str(path), read_sections(path)
        lever = {name: values.pop(name) for name in SECTIONS if name in values}
        case = cls.from_values({"name": Path(path).stem, **values, "lever": lever}, where)
        if case.quantity not in QUANTITIES:
            raise unknown_name("quantity", case.quantity, QUANTITIES, where)
        arguments = case.definition.arguments
        for name in case.given:
            if name not in arguments:
                raise unknown_name("key", name, arguments, f"{where}: [given]")
        for name, needed in arguments.items():
            if needed and name not in case.given:
                raise InputError(f"{where}: [given]: {name} is missing")
        if lever and not case.definition.of_a_lever:
            raise InputError(
                f"{where}: [{next(iter(lever))}]: {case.quantity} is of no lever, expected its "
                "arguments in [given]"
            )
        case.numbers(where)
        case.probe(where)
        return case

    @property
    def definition(self) -> Quantity:
        """The quantity."""
        return QUANTITIES[self.quantity]

    def probe(self, where: str = "") -> Probe | None:
        """Return the lever, or what it is taken for; None of a law."""
        if not self.definition.of_a_lever:
            return None
        return Probe.from_sections(self.lever, where or self.name)

    def numbers(self, where: str = "") -> tuple[dict[str, float], dict[str, Prior]]:
        """Return what is given: values, and priors of those that are uncertain."""
        values, priors = dict[str, float](), dict[str, Prior]()
        for name, entry in self.given.items():
            if isinstance(entry, str):
                here = f"{where or self.name}: [given]: {name}"
                value, spread, written = parsed(entry, here)
                if value is None:
                    raise InputError(f"{here} = '{entry}', expected a value before its spread")
                priors[name] = Prior(value, spread, written != "unit")
                entry = value
            values[name] = float(entry)
        return values, priors


def cases() -> list[Case]:
    """Return the cases of the package, by name."""
    with resources.as_file(resources.files(__package__)) as folder:
        return [Case.from_file(path) for path in sorted((folder / "cases").glob("*.toml"))]


def sought() -> list[list[str]]:
    """Return the sources that were sought, what was wanted of each, and why it is no case."""
    with resources.as_file(resources.files(__package__)) as folder:
        entries = read_sections(folder / "sought.toml")
    return [[name, entry["wanted"], entry["found"]] for name, entry in entries.items()]
