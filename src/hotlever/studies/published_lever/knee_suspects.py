"""What carries how much of the 50 K that the paper's knee is off, in some layouts of its lever.

Stored as ``benchmarks/published_lever.py knee`` writes it: `hotlever.studies.knee_study.carried_by`
of each suspect, and of each coefficient of the departures of laws, which are suspects of the size
of a standard deviation. What a law may carry is a standard error: the root of the sum of the
squares over its coefficients.
"""

from __future__ import annotations

import csv
from functools import cache

import numpy as np
import xarray as xr

from hotlever.datasets import labelled
from hotlever.materials import PARAMETERS
from hotlever.materials.departures import DEPARTURES
from hotlever.studies.published_lever.layouts import FOLDER

#: Of what is stored by layout and suspect.
_COLUMNS = ("moved_K", "shift_K", "ramp_K")


@cache
def carried() -> xr.Dataset:
    """Return what is stored.

    Returns
    -------
    xarray.Dataset
        On ``layout`` and ``suspect``: ``moved_K``, ``shift_K`` and ``ramp_K``, see
        `hotlever.studies.knee_study.Carried`; and each fitted parameter, by its name. On ``layout``
        and ``law``: ``stderr_K``, what a law may carry where the model is fitted; NaN where that
        was not computed.
    """
    with (FOLDER / "knee.csv").open(encoding="utf-8") as file:
        rows = {(row["layout"], row["suspect"]): row for row in csv.DictReader(file)}
    layouts = list(dict.fromkeys(layout for layout, _ in rows))
    coefficients = [name for law in DEPARTURES.values() for name in law.names]
    suspects = [
        name for name in dict.fromkeys(name for _, name in rows) if name not in coefficients
    ]

    def column(key: str, names: list[str]) -> np.ndarray:
        nothing = {key: "nan"}
        return np.array(
            [
                [float(rows.get((layout, name), nothing)[key]) for name in names]
                for layout in layouts
            ]
        )

    by_law = [
        np.linalg.norm(column("shift_K", list(law.names)), axis=1) for law in DEPARTURES.values()
    ]
    both = ("layout", "suspect")
    columns = {key: (both, column(key, suspects)) for key in (*_COLUMNS, *PARAMETERS)}
    columns["stderr_K"] = (("layout", "law"), np.transpose(by_law))
    coordinates = {"layout": layouts, "suspect": suspects, "law": list(DEPARTURES)}
    return labelled(columns, both, coordinates)
