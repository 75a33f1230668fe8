"""What stands in hotlever's datasets: one name, one unit, one meaning for each quantity."""

from __future__ import annotations

import math
import os
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

import hotlever
from hotlever import __version__
from hotlever.errors import ComputationError, InputError
from hotlever.files import whole_file, write_text
from hotlever.quantities import QUANTITIES
from hotlever.types import Array

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


class PlainVariable(NamedTuple):
    """What a variable of xarray holds: names of its axes, values, and its unit and meaning."""

    dims: tuple[str, ...]
    values: Any
    attrs: Mapping[str, Any]


@dataclass(frozen=True)
class PlainDataset:
    """What a dataset of xarray holds, read by the same words, for tables that wait for no xarray.

    Its import, with that of pandas, takes half as long as to solve a lever.

    Attributes
    ----------
    data_vars, coords : mapping of str to PlainVariable
    attrs : mapping
    """

    data_vars: Mapping[str, PlainVariable]
    coords: Mapping[str, PlainVariable]
    attrs: Mapping[str, Any]

    def __getitem__(self, name: str) -> PlainVariable:
        return self.data_vars[name]

    @property
    def sizes(self) -> dict[str, int]:
        """The lengths of the axes."""
        every = [*self.data_vars.values(), *self.coords.values()]
        lengths = (zip(each.dims, each.values.shape, strict=True) for each in every)
        return dict(chain.from_iterable(lengths))

    def with_(
        self,
        coords: Mapping[str, PlainVariable] | None = None,
        attrs: Mapping[str, Any] | None = None,
        **columns: PlainVariable,
    ) -> PlainDataset:
        """Return the same with other coordinates, attributes and columns, or more of them."""
        more = (columns, coords or {}, attrs or {})
        own = (self.data_vars, self.coords, self.attrs)
        return PlainDataset(*({**had, **new} for had, new in zip(own, more, strict=True)))

    def rows(self, chosen: slice, along: str) -> PlainDataset:
        """Return some of the rows along the first axis of all that has it."""

        def some(each: Mapping[str, PlainVariable]) -> dict[str, PlainVariable]:
            return {
                name: one._replace(values=one.values[chosen]) if along in one.dims else one
                for name, one in each.items()
            }

        return replace(self, data_vars=some(self.data_vars), coords=some(self.coords))

    @cached_property
    def dataset(self) -> xr.Dataset:
        """The same as users have it."""
        import xarray as xr

        offer_plots()
        columns, coordinates = (
            {name: _of_xarray(name, variable) for name, variable in each.items()}
            for each in (self.data_vars, self.coords)
        )
        return xr.Dataset(columns, coordinates, self.attrs)


def dataset_of(work: Callable[[], PlainDataset]) -> xr.Dataset:
    """Return what a computation gives, or has reached where it fails, as users have it.

    Raises
    ------
    ComputationError
        As the computation.
    """
    try:
        return work().dataset
    except ComputationError as error:
        if isinstance(error.partial, PlainDataset):
            error.partial = error.partial.dataset
        raise


def in_a_file(data: xr.Dataset | PlainDataset, columns: Sequence[str]) -> list[str]:
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
    """Return columns as a dataset with units and meanings; see `plain`."""
    return plain(columns, dimensions, coordinates, **attributes).dataset


def plain(
    columns: Mapping[str, Any],
    dimensions: str | Sequence[str] = "bias",
    coordinates: Mapping[str, Any] | None = None,
    **attributes: Any,
) -> PlainDataset:
    """Return what is in a dataset of columns with units and meanings.

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
    return PlainDataset(
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


def quantity(name: str, dimensions: str | Sequence[str], values: Any) -> PlainVariable:
    """Return a variable with its unit and meaning; for tuples see `plain`."""
    own, array, *stated = values if isinstance(values, tuple) else (dimensions, values)
    array, row = np.asarray(array), QUANTITIES.get(name)
    usual = {"units": row.unit, "long_name": row.meaning} if row else {}
    own = (own,) if isinstance(own, str) else tuple(own)
    return PlainVariable(own if array.ndim else (), array, stated[0] if stated else usual)


def _of_xarray(name: str, variable: PlainVariable) -> xr.Variable:
    """Return a variable of xarray.

    Of other arrays xarray would ask whether they are Dask's, and import Dask for that where it is
    installed: a third of a second.
    """
    import pandas as pd
    import xarray as xr

    if variable.dims == (name,) and variable.values.dtype.kind in "ifU":
        return xr.Variable(variable.dims, pd.Index(variable.values), variable.attrs)
    try:
        return xr.Variable(*variable, fastpath=True)
    except TypeError:  # a version of xarray that does not know it
        return xr.Variable(*variable)


def csv_text(data: xr.Dataset | PlainDataset, columns: Sequence[str]) -> str:
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


def write_dataset(
    data: xr.Dataset | PlainDataset, path: str | os.PathLike[str], columns: Sequence[str]
) -> None:
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
        data = data.dataset if isinstance(data, PlainDataset) else data
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
