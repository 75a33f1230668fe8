"""Fits of levers, judged calibrations, and files with a fault, made up for tests."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np
import xarray as xr

from hotlever.datasets import labelled
from hotlever.estimate import FittedParameter
from hotlever.estimate.many import compare_levers
from hotlever.materials import PARAMETERS
from hotlever.studies.simulation_based_calibration import WAYS, concatenated

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


def fit_of(
    values: Mapping[str, float],
    stderr: Mapping[str, float | None],
    inversion: tuple[float, float] = (830.0, np.nan),
    described: bool | None = True,
) -> Any:
    """Return what of a fit is compared with those of other levers."""
    return SimpleNamespace(
        parameters={
            name: FittedParameter(values[name], stderr.get(name), known.unit, True)
            for name, known in PARAMETERS.items()
        },
        inversion_temperature_K=inversion[0],
        inversion_temperature_stderr_K=inversion[1],
        describes_data=described,
        doubt="" if described else "no such lever shows these data: current differs by 5%",
        route="",
        measurement=SimpleNamespace(path="lever.csv"),
    )


def levers(count: int, held: tuple[str, ...] = ()) -> xr.Dataset:
    """Return the table of some levers, with parameters that were not fitted."""
    rng = np.random.default_rng(0)
    stderr = {name: 0.05 * known.scale for name, known in PARAMETERS.items() if name not in held}
    fits = {}
    for number in range(count):
        values = {
            name: known.scale * (2 + 0.1 * rng.normal()) for name, known in PARAMETERS.items()
        }
        fits[f"lever-{number}"] = fit_of(values, stderr, (830.0 + 5 * rng.normal(), 3.0))
    return compare_levers(fits)


def judged_levers(other_law: bool = False) -> xr.Dataset:
    """Return levers with errors of 0.5, 1.5 and 3 stated ones throughout, and one refused."""
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
        coordinates = {"way": list(WAYS), "lever": number, "other_law": other_law}
        judged.append(labelled(columns, (), coordinates))
    return concatenated(judged)
