"""Spoilt files of every kind: what is read is sound, all else is one line, and soon."""

from __future__ import annotations

import math
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
import pytest
from corpus import Family, families, spoilt
from pydantic import BaseModel
from size import cases
from xarray import Dataset

from hotlever.errors import InputError
from limits import time_limit

#: Seconds in which a file is read or refused; and the longest line that says why, without its name.
LIMIT_S, LINE = 20.0, 600
#: How many there are with ``make test-hostile``, of all kinds together.
CASES = 11_900
NAMES = [
    *("measurement", "in time", "columns", "probe", "fit", "calibration", "power law"),
    *("raman calibration", "spectrum", "wdf", "spc", "jcamp", "sweep", "bias log", "waveform"),
    *("temperatures", "corrections"),
]


@pytest.fixture(scope="module")
def known(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Family]:
    return families(tmp_path_factory.mktemp("good"))


def infinite(found: Any) -> str:
    """Say where something that was read holds an infinite number; empty if nowhere.

    NaN stands for what is not known.
    """
    if isinstance(found, np.ndarray):
        return "an array" if found.dtype.kind == "f" and np.isinf(found).any() else ""
    if isinstance(found, float):
        return "a number" if math.isinf(found) else ""
    parts: dict[Any, Any] = {}
    if isinstance(found, Dataset):
        parts = {name: found[name].values for name in found.variables}
    elif is_dataclass(found):
        parts = {one.name: getattr(found, one.name) for one in fields(found)}
    elif isinstance(found, BaseModel):
        parts = dict(found)
    elif isinstance(found, dict):
        parts = found
    elif isinstance(found, list | tuple):
        parts = dict(enumerate(found))
    return next((f"{name}: {place}" for name, one in parts.items() if (place := infinite(one))), "")


def test_the_names_are_those_of_all_families(known):
    assert list(known) == NAMES


@pytest.mark.parametrize("name", NAMES)
def test_a_good_file_is_read(known, name, tmp_path):
    for number, raw in enumerate(known[name].good):
        path = tmp_path / f"{number}{known[name].suffix}"
        path.write_bytes(raw)
        if b"x.gds" not in raw:  # a drawing that is not there
            assert known[name].read(path) is not None


@pytest.mark.parametrize("name", NAMES)
def test_a_spoilt_file_is_read_or_refused_in_one_line(known, name, tmp_path):
    family, path = known[name], tmp_path / f"spoilt{known[name].suffix}"
    read, found = 0, []
    for number in range(cases(CASES) // len(NAMES)):
        raw = spoilt(family, number)
        path.write_bytes(raw)
        try:
            with time_limit(LIMIT_S):
                content = family.read(path)
        except InputError as error:
            line = str(error).replace(str(tmp_path), "")
            if "\n" in line or "spoilt" not in line or len(line) > LINE:
                found.append(f"number {number}: {line[: 2 * LINE]!r}")
        except Exception as error:
            found.append(f"number {number}: {type(error).__name__}: {str(error)[:LINE]}")
        else:
            read += 1
            if place := infinite(content):
                found.append(f"number {number}: infinite: {place}")
        assert path.read_bytes() == raw, number
        assert [one.name for one in tmp_path.iterdir()] == [path.name], number
    print(f"{name}: {read} read, {number + 1 - read} refused")
    assert not found, "\n".join(found)
