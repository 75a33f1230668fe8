"""What a fit predicts of the tip temperature, with its error: along the bias or in time."""

from __future__ import annotations

import numpy as np
import xarray as xr

from hotlever.datasets import labelled
from hotlever.types import Array

_AT_REST = ("bias_V", "power_mW", "tip_K", "tip_stderr_K")


def band_names(in_time: bool) -> tuple[str, ...]:
    """Return the variables of `hotlever.estimation.result.Fit.band`."""
    return ("time_us", *_AT_REST) if in_time else _AT_REST


def band_dataset(**columns: Array) -> xr.Dataset:
    """Return such a band of its variables, one row per bias or, with ``time_us``, time; rising."""
    in_time = "time_us" in columns
    along, name = ("time", "time_us") if in_time else ("bias", "bias_V")
    rising, order = np.unique(columns[name], return_index=True)
    ordered = {name: columns[name][order] for name in band_names(in_time)}
    return labelled(ordered, along, {along: rising})
