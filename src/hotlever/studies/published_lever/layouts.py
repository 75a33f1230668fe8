"""The layouts that were found, by name, with their weights."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping
from functools import cache
from importlib.resources import files
from typing import Any

import pandas as pd
from pydantic import Field

from hotlever.materials import published
from hotlever.probe import Probe
from hotlever.records import Record
from hotlever.studies.published_lever.statements import OPTIONS

#: What the reference probe is called among them.
REFERENCE = "reference"
#: Where the data of this package are.
FOLDER = files("hotlever") / "studies" / "published_lever"


class Layout(Record):
    """One layout of the paper's lever."""

    name: str = Field(description="by its length, or by what it is")
    length_um: float = Field(gt=0)
    values: dict[str, float] = Field(
        description="other dimensions (µm), the resistor (Ω), and coefficients of laws that depart"
    )
    drawn: bool = Field(description="found after drawn errors: one of those that have a weight")
    square: float = Field(description="sum of squares of its search")

    def probe(self, option: str = next(iter(OPTIONS))) -> Probe:
        """Return the probe of it, with the silicon of a published option; see `OPTIONS`."""
        return probe_of(self.length_um, self.values, option)


def probe_of(length_um: float, values: Mapping[str, float], option: str) -> Probe:
    """Return the probe of a layout, with the silicon of a published option."""
    material = published(OPTIONS[option]).material
    return Probe.reference().with_(length_um=length_um, **values, **material.model_dump())


def reference(names: Iterable[str]) -> Layout:
    """Return the layout of the reference probe, by the names of its values."""
    probe = Probe.reference()
    values = dict(zip(names, probe.values(list(names)).tolist(), strict=True))
    length = probe.values(["length_um"]).item()
    return Layout(name=REFERENCE, length_um=length, values=values, drawn=False, square=0.0)


def stored_table(name: str, *keys: str) -> pd.DataFrame:
    """Return a table of numbers as ``benchmarks/published_lever.py`` writes it, by some columns."""
    with (FOLDER / name).open(encoding="utf-8") as file:
        return pd.read_csv(file, index_col=list(keys))


@cache
def stored_layouts() -> dict[str, Layout]:
    """Return the layouts by name: the reference, those that suit best, those after drawn errors."""
    stored: dict[str, Any] = tomllib.loads((FOLDER / "layouts.toml").read_text(encoding="utf-8"))
    found = [Layout.from_values(each, "layouts.toml") for each in stored["layout"]]
    return {each.name: each for each in [reference(found[0].values), *found]}
