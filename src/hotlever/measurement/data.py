"""Measured data of one lever, and the probe that can have shown them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from hotlever.datasets import labelled
from hotlever.errors import InputError, unknown_name
from hotlever.lever.dataset import circuit_of
from hotlever.lever.transient.history import checked_times
from hotlever.lever.transient.waveform import Waveform
from hotlever.probe import Circuit, Probe
from hotlever.probe.surroundings import Medium
from hotlever.quantities import FITTED, MEASURANDS, OBSERVABLES, OF_A_CONTACT
from hotlever.types import Array, Mask

if TYPE_CHECKING:
    import xarray as xr

#: The columns that a measurement keeps: the bias, observables and standard errors.
MEASURED = [measurand for symbol, measurand in MEASURANDS.items() if symbol not in ("t", "V_l")]


def as_attributes(columns: Mapping[str, Array]) -> dict[str, Any]:
    """Return the attributes of a `Measurement` that hold columns, (n,) each, of these names.

    What has no column has no data.
    """
    nothing = np.full(columns["bias_V"].shape, np.nan)
    always = ("bias_V", "current_mA", "reader_V", "tip_K", "tip_error_K")
    own: dict[str, Any] = {name: columns.get(name, nothing) for name in always}
    own["distance_um"] = columns.get("distance_um")
    return own | {"further": {name: columns[name] for name in columns if name not in own}}


@dataclass(frozen=True)
class Measurement:
    """One lever's data, row by row as in the file; NaN where a cell was empty.

    Attributes
    ----------
    bias_V, current_mA, reader_V, tip_K, tip_error_K : ndarray, shape (n,)
        The last is the standard error of each tip temperature, independent of the others'.
    further : dict of str to ndarray, shape (n,)
        What else was measured, by the names of `hotlever.quantities`: standard errors, as
        ``current_error_mA``, the voltage of a bridge, ``bridge_output_V``, and of a tip in contact
        ``apex_K`` and ``surface_K``, the temperature of the sample under it. Where a sample begins
        to melt, that is its melting temperature.
    distance_um : ndarray, shape (n,), or None
        From the apex to the sample; the tip touches it at 0 or less, and where nothing is said.
    series_resistance_ohm, base_temperature_K : float or None
        If the file gives them.
    medium : {"vacuum", "air"} or None
        If the file says it.
    gas_conductivity, pressure_mbar : float or None
        Of the gas, over that of dry air, and its pressure, if the file says them.
    raman_scale : float or None
        By what share of the rise all tip temperatures may be off together, if the file says it.
    path, sha256 : str
        Origin; empty for data made in memory.
    notes : tuple of str
        What of the file was not understood, and what looks wrong in it.
    unused : tuple of str
        Which of its columns were not used, and why.
    understood : tuple of tuple of str
        What each column and setting of the file was taken for, as rows of a table.
    rows : ndarray, shape (n,), or None
        Of how many rows of the file each is the mean, if they were averaged.
    time_us : ndarray, shape (n,), or None
        When each row was measured (µs, rising) of a lever that was cold before; None at rest.
    waveform : Waveform or None
        Of the bias, for what was measured in time.
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
    further: dict[str, Array] = field(default_factory=dict)
    distance_um: Array | None = None
    gas_conductivity: float | None = None
    pressure_mbar: float | None = None
    raman_scale: float | None = None
    unused: tuple[str, ...] = ()
    understood: tuple[tuple[str, ...], ...] = ()
    rows: Array | None = None
    time_us: Array | None = None
    waveform: Waveform | None = None

    @property
    def columns(self) -> dict[str, Array]:
        """All that was measured, by name."""
        own = {each.name: getattr(self, each.name) for each in fields(self)} | self.further
        every = {column.name: own.get(column.name) for column in MEASURED}
        return {name: values for name, values in every.items() if values is not None}

    @classmethod
    def in_time(
        cls,
        time_us: ArrayLike,
        waveform: Waveform,
        current_mA: ArrayLike | None = None,
        reader_V: ArrayLike | None = None,
        **more: Any,
    ) -> Measurement:
        """Return what was measured of a cold lever under a wave form.

        Times, (n,), rise from 0 on; of the columns, (n,), one may be left out, and is NaN where
        nothing was measured. `more` are other attributes.

        Raises
        ------
        InputError
            If the times do not rise, or a column has another shape.

        Examples
        --------
        >>> from hotlever.lever.transient import step
        >>> Measurement.in_time([1.0, 2.0], step(4.0), [0.577, 0.576]).observables
        ('current',)
        """
        times = checked_times(time_us)
        nothing = np.full(times.shape, np.nan)
        current, reader = (
            nothing if values is None else np.asarray(values, dtype=float)
            for values in (current_mA, reader_V)
        )
        if not (np.array_equal(times, time_us) and times.shape == current.shape == reader.shape):
            raise InputError("expected times that rise, and one current and reader voltage each")
        columns: Any = {"tip_K": nothing, "tip_error_K": nothing, **more}
        return cls(
            waveform.bias(times), current, reader, **columns, time_us=times, waveform=waveform
        )

    @property
    def along(self) -> tuple[Array, str]:
        """What tells the rows apart, and its unit: the time (µs), or at rest the bias (V)."""
        return (self.bias_V, "V") if self.time_us is None else (self.time_us, "µs")

    def need_rest(self, what: str) -> None:
        """Refuse what was measured in time.

        Raises
        ------
        InputError
            If it was; the text says that `what` needs a sweep.
        """
        if self.time_us is not None:
            raise InputError(
                f"{self.path or 'measurement'}: was measured in time, within "
                f"{np.ptp(self.time_us):.4g} µs; {what} expects a slow sweep of the bias"
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
        circuit = circuit_of(sweep)
        names = ["bias_V", *(measurand.name for measurand in OBSERVABLES.values())]
        columns = {name: sweep[name].values for name in names if name in sweep}
        return cls(
            **as_attributes(columns),
            series_resistance_ohm=circuit.series_resistance_ohm,
            base_temperature_K=circuit.base_temperature_K,
            medium=sweep.attrs["medium"],
        )

    def dataset(self, circuit: Circuit) -> xr.Dataset:
        """Return the data by the names that a sweep has, V_l and P_l included.

        Rising in bias, or in time; the current as in `current`.
        """
        columns = self.columns
        current = columns["current_mA"] = self.current(circuit)
        columns["lever_V"] = circuit.lever_voltage(self.bias_V, current)
        columns["power_mW"] = circuit.power(self.bias_V, current)
        if self.time_us is not None:
            return labelled(columns, "time", {"time": self.time_us})
        return labelled(columns, coordinates={"bias": self.bias_V}).sortby("bias")

    def observable(self, name: str, *, error: bool = False) -> Array:
        """Return the data of one of `hotlever.quantities.FITTED`, NaN where there are none.

        With `error`, their standard errors.

        Raises
        ------
        InputError
            If there is no observable of this name.
        """
        if name not in FITTED:
            raise unknown_name("observable", name, FITTED)
        symbol = f"{'d' * error}{FITTED[name].symbol}"
        values = self.columns.get(MEASURANDS[symbol].name)
        return np.full(self.bias_V.shape, np.nan) if values is None else values

    def current(self, circuit: Circuit) -> Array:
        """Return the heater current (mA), measured or as the bridge of a circuit shows it."""
        bridge = circuit.current_of_bridge(self.observable("bridge"), self.bias_V)
        return np.where(np.isnan(self.current_mA), bridge, self.current_mA)

    @property
    def out_of_contact(self) -> Mask:
        """Which rows were measured at a distance from the sample, (n,)."""
        if self.distance_um is None:
            return np.zeros(self.bias_V.shape, dtype=bool)
        return np.asarray(self.distance_um > 0.0)

    def part(self, rows: Mask) -> Measurement:
        """Return some rows, (n,) of bool, as a measurement."""
        own = {each.name: getattr(self, each.name) for each in fields(self)}
        columns: Any = {name: v[rows] for name, v in own.items() if isinstance(v, np.ndarray)}
        further = {name: values[rows] for name, values in self.further.items()}
        return replace(self, **columns, further=further)

    @property
    def observables(self) -> tuple[str, ...]:
        """Names of the observables that have any data."""
        return tuple(name for name in FITTED if np.isfinite(self.observable(name)).any())


def with_measured_circuit(
    probe: Probe, measurement: Measurement, medium: str | None = None
) -> tuple[Probe, list[str]]:
    """Return the probe in circuit and medium of the measurement, and a note on each difference.

    A `medium` that is asked for wins over both.

    Raises
    ------
    InputError
        If the pressure matters, and the probe does not say how the temperature jumps.
    """
    notes = []
    measured_in, assumed_in = measurement.medium, probe.surroundings.medium
    changes: dict[str, Any] = {"medium": medium or measured_in or assumed_in}
    if measured_in not in (None, changes["medium"]):
        notes.append(f"medium: {medium}, as asked, although the data file says {measured_in}")
    elif medium is None and changes["medium"] != assumed_in:
        notes.append(f"medium: the data file's {measured_in} is used, not the probe's {assumed_in}")
    elif medium is measured_in is None and "medium" not in probe.surroundings.model_fields_set:
        notes.append(
            f"medium: {assumed_in} is assumed, since neither the data file nor the probe file says "
            "it; a lever in another one may be explained as well: --medium unknown tries both"
        )
    names = ["series_resistance_ohm", "base_temperature_K"]
    if changes["medium"] == measured_in == "air":
        names.append("gas_conductivity")
        # between these the pressure is no matter to a lever without a temperature jump
        low, high = 700.0, 1200.0
        if probe.surroundings.accommodation is not None:
            names.append("pressure_mbar")
        elif not low <= (measurement.pressure_mbar or low) <= high:
            raise InputError(
                f"{measurement.path}: the pressure is {measurement.pressure_mbar:g} mbar, expected "
                "accommodation in [surroundings] of the probe file, with which it counts, such as "
                "accommodation = 0.9"
            )
    values = {**dict(probe.circuit), **dict(probe.surroundings)}
    for name in names:
        measured, assumed = getattr(measurement, name), values[name]
        if measured is not None and not np.isclose(measured, assumed, rtol=1e-9):
            changes[name] = measured
            notes.append(
                f"{name}: the data file's {measured:g} is used, not the probe's {assumed:g}"
            )
    return probe.with_(**changes), notes


def check_sample(measurement: Measurement, probe: Probe) -> list[str]:
    """Refuse what no such probe shows of a sample; return a note on what does not count.

    Raises
    ------
    InputError
        If the tip touches nothing, or not where a temperature of the contact was measured; or one
        is not above the base temperature.
    """
    where = measurement.path or "measurement"
    base_K = probe.circuit.base_temperature_K
    for name, column in OF_A_CONTACT.items():
        values = measurement.observable(name)
        if np.isnan(values).all():
            continue
        if probe.contact is None:
            raise InputError(
                f"{where}: {column.symbol}: the tip of the probe touches nothing, expected a "
                "section [contact] in the probe file; if it is T_tip, where the tip stands on the "
                "lever, say so with --column"
            )
        for wrong, expected in (
            (values <= base_K, f"more than the base temperature, {base_K:g} K"),
            (np.isfinite(values) & measurement.out_of_contact, "D of 0, in contact"),
        ):
            if wrong.any():
                row = int(np.argmax(wrong))
                raise InputError(
                    f"{where}: {column.symbol} is {values[row]:.4g} K at "
                    f"{measurement.bias_V[row]:.4g} V, expected {expected}"
                )
    if measurement.distance_um is None or np.isnan(measurement.distance_um).all():
        return []
    if measurement.time_us is not None:
        raise InputError(f"{where}: D counts at rest only, expected no column of the time")
    if probe.contact is None:
        return ["D: the probe has no [contact], so that distances do not count"]
    return []


def noise_about_neighbours(values: Array) -> float:
    """Return by how much three data or more in a row, (n,), scatter about their neighbours.

    Neither a slope nor a gentle bend counts.
    """
    # the variance of one datum twice less its neighbours is six times that of white noise
    return 1.4826 * float(np.median(np.abs(np.diff(values, 2)))) / float(np.sqrt(6.0))


def colder_than_base(
    tip_K: Array, error_K: Array, base_K: float, offset_K: float = 20.0, errors: float = 4.0
) -> Mask:
    """Return where a tip seems colder than its base by more than an offset or noise explain."""
    margin = np.maximum(offset_K, errors * np.nan_to_num(error_K))
    return np.asarray(tip_K < base_K - margin)


def resolution_of(values: Array) -> float:
    """Return the step of which all values, (n,), are multiples; 0 if there is none.

    It is the smallest difference of two values, some of which are the same: a resistor in equal
    steps has multiples too.
    """
    present = values[np.isfinite(values)]
    levels = np.unique(present)
    if not 1 < levels.size < present.size:
        return 0.0
    step = float(np.diff(levels).min())
    multiples = levels / step
    return step if np.allclose(multiples, np.round(multiples), rtol=0.0, atol=0.02) else 0.0
