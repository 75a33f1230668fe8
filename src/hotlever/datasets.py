"""What stands in hotlever's datasets: one name, one unit, one meaning for each quantity."""

from __future__ import annotations

import math
import os
import zlib
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import hotlever
from hotlever import __version__
from hotlever.errors import InputError
from hotlever.files import whole_file, write_text
from hotlever.quantities import QUANTITIES
from hotlever.types import Array

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


def in_a_file(data: xr.Dataset, columns: Sequence[str]) -> list[str]:
    """Return the columns of a file: the usual ones, and those that only some levers have.

    These are of a bridge, of set points, and of terminals and monitors, which are named by users.
    """
    own = [str(name) for name in data.data_vars]
    # sweeps of a lever that a controller holds
    held = {"set_ohm", "set_mW", "state", "slope_ohm_per_K", "slope_mW_per_K"}
    some = {name for name in own if "bridge_" in name or name in held}
    return [*columns, *(name for name in own if name in some or name not in QUANTITIES)]


def labelled(
    columns: Mapping[str, Any],
    dimensions: str | Sequence[str] = "bias",
    coordinates: Mapping[str, Any] | None = None,
    **attributes: Any,
) -> xr.Dataset:
    """Return columns as a dataset with units and meanings.

    Parameters
    ----------
    columns : mapping of str to array_like
        Of `hotlever.quantities.QUANTITIES`; a tuple gives the dimensions of its own before the
        values, and unit and meaning of any other after them.
    dimensions : str or sequence of str
        Of the other columns.
    coordinates : mapping, optional
        As xarray has them.
    **attributes
        Of the dataset, beside the version of the software.
    """
    import xarray as xr  # takes half a second, which not every command has to wait for

    offer_plots()
    return xr.Dataset(
        {name: quantity(name, dimensions, values) for name, values in columns.items()},
        {name: quantity(name, name, values) for name, values in (coordinates or {}).items()},
        {**attributes, "software": f"hotlever {__version__}"},
    )


class Plots:
    """What hotlever does with its datasets: ``data.hotlever.plot()`` draws one."""

    def __init__(self, data: xr.Dataset) -> None:
        self._data = data

    def plot(self) -> Figure:
        """Return the figure that belongs to the dataset; see `hotlever.figures.figure_of`.

        `hotlever.save_figure` writes it to a file.

        Examples
        --------
        >>> import hotlever
        >>> sweep = hotlever.sweep(hotlever.Probe.reference(), [1.0, 2.0])
        >>> len(sweep.hotlever.plot().axes)
        4
        """
        figure: Figure = hotlever.figures.figure_of(self._data)
        return figure


@cache
def offer_plots() -> None:
    """Let all datasets of xarray have `Plots`."""
    import xarray as xr

    xr.register_dataset_accessor("hotlever")(Plots)


def quantity(name: str, dimensions: str | Sequence[str], values: Any) -> xr.Variable:
    """Return a variable with its unit and meaning; for tuples see `labelled`.

    Of other arrays xarray would ask whether they are Dask's, and import Dask for that where it is
    installed: a third of a second.
    """
    import pandas as pd
    import xarray as xr

    own, array, *stated = values if isinstance(values, tuple) else (dimensions, values)
    array, row = np.asarray(array), QUANTITIES.get(name)
    usual = {"units": row.unit, "long_name": row.meaning} if row else {}
    attributes = stated[0] if stated else usual
    if array.ndim == 0:
        own = ()
    elif own == name and array.dtype.kind in "ifU":
        return xr.Variable(own, pd.Index(array), attributes)
    try:
        return xr.Variable(own, array, attributes, fastpath=True)
    except TypeError:  # a version of xarray that does not know it
        return xr.Variable(own, array, attributes)


def csv_text(data: xr.Dataset, columns: Sequence[str]) -> str:
    """Return columns of a dataset as CSV text; empty where a value does not exist.

    What lies along a line has a column for each point, counted from 0 behind the name.
    """
    flat: dict[str, Array] = {}
    for name in columns:
        values, (stem, _, unit) = data[name].values, name.rpartition("_")
        lines = {f"{stem}.{point}_{unit}": column for point, column in enumerate(values.T)}
        flat |= {name: values} if values.ndim == 1 else lines
    return columns_text(flat)


def columns_text(columns: Mapping[str, Array], digits: int = 10) -> str:
    """Return columns of numbers as CSV text; empty where a value does not exist."""
    rows = (
        ",".join(f"{value:.{digits}g}" if math.isfinite(value) else "" for value in row)
        for row in zip(*columns.values(), strict=True)
    )
    return "\n".join([",".join(columns), *rows]) + "\n"


def frame_text(frame: Any, **options: Any) -> str:
    """Return a pandas DataFrame, or columns, as CSV text; empty where there is no finite number.

    The options are those of its ``to_csv``.
    """
    import pandas as pd

    finite = pd.DataFrame(frame).replace([math.inf, -math.inf], math.nan)
    return str(finite.to_csv(lineterminator="\n", **options))


def write_dataset(data: xr.Dataset, path: str | os.PathLike[str], columns: Sequence[str]) -> None:
    """Write a dataset as ``.csv`` (some columns) or ``.nc`` (everything).

    Raises
    ------
    InputError
        If the suffix is neither, or the file cannot be written.
    """
    suffix = Path(path).suffix.lower()
    if suffix == ".csv":
        write_text(path, csv_text(data, columns))
    elif suffix == ".nc":
        with whole_file(path) as temporary:
            # any reader knows damaged numbers by sums of their own; only the sum over all knows
            # those whose address in the file is damaged
            numbers = [name for name in data.variables if data[name].dtype.kind in "if"]
            sums = {name: {"fletcher32": True} for name in numbers if data[name].ndim}
            summed = data.assign_attrs(checksum=checksum(data))
            summed.to_netcdf(temporary, engine="netcdf4", encoding=sums)
    else:
        raise InputError(f"{path}: unknown file type '{suffix}', expected .csv or .nc")


def checksum(data: xr.Dataset) -> int:
    """Return a sum over all numbers of a dataset, by which a damaged file is known."""
    total = 0
    for name in sorted(map(str, data.variables)):
        values = data[name].values
        if values.dtype.kind == "f":
            # files do not keep what kind of NaN it was
            total = zlib.crc32(np.where(np.isnan(values), np.nan, values).tobytes(), total)
    return total
