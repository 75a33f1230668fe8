"""What a fit predicts of the tip temperature, with its error: along the bias or in time."""

from __future__ import annotations

from typing import Annotated

import numpy as np
import xarray as xr

from hotlever.datasets import labelled
from hotlever.estimation.result_file import Vector
from hotlever.records import stored_as
from hotlever.types import Array

_COLUMNS = {"bias_V", "power_mW", "tip_K", "tip_stderr_K"}


def band_dataset(**columns: Array) -> xr.Dataset:
    """Return `hotlever.estimation.result.Fit.band`: one row per bias or, with ``time_us``, time.

    The rows rise in it.
    """
    along, name = ("time", "time_us") if "time_us" in columns else ("bias", "bias_V")
    rising, order = np.unique(columns[name], return_index=True)
    ordered = {name: values[order] for name, values in columns.items()}
    return labelled(ordered, along, {along: rising})


def _read(columns: dict[str, Array]) -> xr.Dataset:
    if not columns.keys() >= _COLUMNS or len({values.size for values in columns.values()}) > 1:
        raise ValueError(f"expected {', '.join(sorted(_COLUMNS))}, as many of each")
    return band_dataset(**columns)


def _written(band: xr.Dataset) -> dict[str, list[float]]:
    return {str(name): values.values.tolist() for name, values in band.data_vars.items()}


# Such a band as fit files hold it.
Band = Annotated[xr.Dataset, stored_as(dict[str, Vector], _read, _written)]
