"""Fits of levers, and files with a fault, made up for tests."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import xarray as xr

from hotlever.fitting.levers import compare_levers
from hotlever.materials import PARAMETERS

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
