"""Fits of levers, judged twins, and files with a fault, made up for tests."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import xarray as xr

from hotlever.datasets import labelled
from hotlever.estimation.levers import compare_levers
from hotlever.materials import PARAMETERS
from hotlever.studies.twins import WAYS, together

#: Not there, which is something else than null.
GONE = object()


def damaged(content: dict[str, Any], *keys: Any, value: Any) -> dict[str, Any]:
    """Return a copy with one entry, found by its keys, replaced, or left out if it is `GONE`."""
    changed = copy.deepcopy(content)
    at: Any = changed
    for key in keys[:-1]:
        at = at[key]
    if value is GONE:
        del at[keys[-1]]
    else:
        at[keys[-1]] = value
    return changed


def levers(count: int, held: tuple[str, ...] = ()) -> xr.Dataset:
    """Return the table of some levers, with parameters that were not fitted."""
    rng = np.random.default_rng(0)
    return compare_levers(
        {
            f"lever-{number}": {
                "parameters": {
                    name: {
                        "value": known.scale * (2 + 0.1 * rng.normal()),
                        "stderr": None if name in held else 0.05 * known.scale,
                    }
                    for name, known in PARAMETERS.items()
                },
                "inversion_temperature_K": 830.0 + 5 * rng.normal(),
                "inversion_temperature_stderr_K": 3.0,
            }
            for number in range(count)
        }
    )


def twins(other_law: bool = False) -> xr.Dataset:
    """Return twins with errors of 0.5, 1.5 and 3 stated ones throughout, and one refused."""
    shape, rows = (len(WAYS), 101), np.arange(101)
    judged = []
    for number, sigma in enumerate((0.5, 1.5, 3.0, np.nan)):
        off = np.full(shape, 10.0 * sigma) * np.arange(1, len(WAYS) + 1)[:, None]
        off[:, :20] = np.nan
        columns = {
            "off_K": (("way", "row"), off),
            "tip_K": ("row", 300.0 + 5.0 * rows),
            "stated_K": ("row", np.full(rows.size, 10.0)),
            "seconds": 1.0,
            "refused": "" if np.isfinite(sigma) else "no lever like this",
            "doubted": "",
        }
        coordinates = {"way": list(WAYS), "twin": number, "other_law": other_law}
        judged.append(labelled(columns, (), coordinates))
    return together(judged)
