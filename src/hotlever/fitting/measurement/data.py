"""Measured data sets: bias, current, reader voltage and tip temperature of one lever."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from hotlever.datasets import labelled
from hotlever.errors import InputError, unknown_name
from hotlever.lever.dataset import OBSERVABLES, probe_of
from hotlever.probe import Circuit
from hotlever.probe.surroundings import Medium
from hotlever.types import Array

#: Quantities of a measurement file: symbol in the header, attribute, unit inside.
COLUMNS = {
    "V_b": ("bias_V", "V"),
    "I_h": ("current_mA", "mA"),
    "V_r": ("reader_V", "V"),
    "T_tip": ("tip_K", "K"),
    "dT_tip": ("tip_error_K", "K"),
    "dI_h": ("current_error_mA", "mA"),
    "dV_r": ("reader_error_V", "V"),
}
#: The columns a fit can compare, by the name users give it.
OBSERVABLE_SYMBOLS = {"current": "I_h", "reader": "V_r", "tip": "T_tip"}


@dataclass(frozen=True)
class Measurement:
    """One lever's data, row by row as in the file; NaN where a cell was empty.

    Attributes
    ----------
    bias_V, current_mA, reader_V, tip_K, tip_error_K : ndarray, shape (n,)
        The last is the standard error of the tip temperature.
    current_error_mA, reader_error_V : ndarray, shape (n,), or None
        Standard errors of the others.
    series_resistance_ohm, base_temperature_K : float or None
        If the file gives them.
    medium : {"vacuum", "air"} or None
        If the file says it.
    gas_conductivity, pressure_mbar : float or None
        Of the gas, over that of dry air, and its pressure, if the file says them.
    path, sha256 : str
        Origin; empty for data made in memory.
    notes : tuple of str
        What of the file was not used or not understood, and what looks wrong in it.
    understood : tuple of tuple of str
        What each column and setting of the file was taken for, as rows of a table.
    rows : ndarray, shape (n,), or None
        Of how many rows of the file each is the mean, if they were averaged.
    """

    bias_V: Array
    current_mA: Array
    reader_V: Array
    tip_K: Array
    tip_error_K: Array
    series_resistance_ohm: float | None = None
    base_temperature_K: float | None = None
    medium: Medium | None = None
    path: str = ""
    sha256: str = ""
    notes: tuple[str, ...] = ()
    current_error_mA: Array | None = None
    reader_error_V: Array | None = None
    gas_conductivity: float | None = None
    pressure_mbar: float | None = None
    understood: tuple[tuple[str, ...], ...] = ()
    rows: Array | None = None

    @classmethod
    def given(cls, measurement: Measurement | str | os.PathLike[str]) -> Measurement:
        """Return a measurement as it is, or read one from a measurement file.

        Raises
        ------
        InputError
            If it is neither, or the file is at fault.
        """
        if isinstance(measurement, Measurement):
            return measurement
        if isinstance(measurement, str | os.PathLike):
            from hotlever.fitting.measurement.reading import read_measurement

            return read_measurement(measurement)
        raise InputError(
            f"found {type(measurement).__name__}, expected a Measurement or a measurement file"
        )

    @classmethod
    def of_sweep(cls, sweep: xr.Dataset) -> Measurement:
        """Return a sweep as if it had been measured, without noise, with its circuit and medium.

        Examples
        --------
        >>> from hotlever import Probe, sweep
        >>> Measurement.of_sweep(sweep(Probe.reference(), [1.0, 2.0])).observables
        ('current', 'reader', 'tip')
        """
        probe, names = probe_of(sweep), ("bias_V", *OBSERVABLES.values())
        columns: dict[str, Any] = {name: sweep[name].values for name in names}
        return cls(
            **columns,
            tip_error_K=np.full(sweep.bias_V.size, np.nan),
            **probe.circuit.model_dump(),
            medium=probe.surroundings.medium,
        )

    def dataset(self, circuit: Circuit) -> xr.Dataset:
        """Return the data by the names that a sweep has, V_l and P_l included, rising in bias."""
        named = ((name, getattr(self, name)) for name, _ in COLUMNS.values())
        columns = {name: values for name, values in named if values is not None}
        columns["lever_V"] = circuit.lever_voltage(self.bias_V, self.current_mA)
        columns["power_mW"] = circuit.power(self.bias_V, self.current_mA)
        return labelled(columns, coordinates={"bias": self.bias_V}).sortby("bias")

    def observable(self, name: str) -> Array:
        """Return the data of ``current`` (mA), ``reader`` (V) or ``tip`` (K).

        Raises
        ------
        InputError
            If there is no observable of this name.
        """
        if name not in OBSERVABLES:
            raise unknown_name("observable", name, OBSERVABLES)
        values: Array = getattr(self, OBSERVABLES[name])
        return values

    def error(self, name: str) -> Array:
        """Return the standard errors of an observable's data, NaN where there are none."""
        self.observable(name)
        values = getattr(self, COLUMNS["d" + OBSERVABLE_SYMBOLS[name]][0])
        return np.full(self.bias_V.shape, np.nan) if values is None else values

    @property
    def observables(self) -> tuple[str, ...]:
        """Names of the observables that have any data."""
        return tuple(name for name in OBSERVABLES if np.isfinite(self.observable(name)).any())
