"""A lever that reads its distance to a surface: signal, noise, resolution.

Air conducts heat from the lever to the surface, the better the nearer it is, so that a heated
resistor cools as the lever approaches. The distance is that of the lever's lower face; that films
bend the lever when it gets warm, which changes the distance, is left out. All holds at frequencies
that the lever follows.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from hotlever.datasets import labelled
from hotlever.errors import ComputationError, InputError
from hotlever.lever.dataset import checked_bias, probe_attributes
from hotlever.lever.lever import Lever
from hotlever.lever.noise import SOURCES, NoiseOptions, Response, spectral_densities
from hotlever.probe import Probe
from hotlever.types import Array, Progress
from hotlever.work import each

if TYPE_CHECKING:
    import xarray as xr

    from hotlever.lever.branch import Branch


class Signal(NamedTuple):
    """What a reader shows at a distance and a bias, named as in `hotlever.quantities`."""

    reader_ohm: float
    reader_V: float
    dV_dz_V_per_um: float
    dlnR_dz_per_um: float
    noise_V_per_rtHz: float
    resolution_nm_per_rtHz: float
    source_V_per_rtHz: Array
    crosstalk_V_per_V: float
    crosstalk_V_per_mW: float
    delay_us: float
    tip_K: float


class Reader:
    """The reader of a probe over a surface.

    It is the terminal ``reader`` if a supply heats it, swept or held, and else the heater itself,
    behind the series resistor of the swept supply.

    Parameters
    ----------
    probe : Probe
    noise : NoiseOptions, optional

    Attributes
    ----------
    probe : Probe
    noise : NoiseOptions
    terminal : str
        Where the voltage is read.
    is_held : bool
        Whether its supply is held while another is swept.

    Raises
    ------
    InputError
        If it cannot show anything: in vacuum, or with its voltage held.
    """

    def __init__(self, probe: Probe, noise: NoiseOptions | None = None) -> None:
        self.probe = probe
        if probe.surroundings.medium == "vacuum":
            raise InputError("in vacuum a reader sees no surface, expected air: --medium air")
        circuit = probe.circuit
        contact, section = circuit.contact("reader"), "[circuit.reader]"
        self.noise, self.is_held = noise or NoiseOptions(), contact.is_held
        self._conductance, self._source_mA = contact.norton
        behind = contact.series_resistance_ohm or contact.current_mA is not None
        if not self.is_held:
            section, behind = "[circuit]", circuit.series_resistance_ohm
            self._conductance = 1.0 / circuit.series_kohm if behind else np.inf
        self.terminal = "reader" if self.is_held else circuit.swept
        if not behind:
            raise InputError(
                f"{section}: found a supply that holds the voltage, which then shows nothing; "
                "expected series_resistance_ohm above 0"
            )

    def signal(self, lever: Lever, branch: Branch, u: float, bias_V: float) -> Signal:
        """Return what it shows of a lever over a surface, from a place of its branch."""
        constraint = branch.parametrisation.constraint(np.array([u]))
        state = lever.polished(branch.states(np.array([u])), bias_V, constraint)
        output = "reader_V" if self.is_held else "lever_V"
        response = Response.of(lever.equations, state.x, constraint, output)
        voltage, current = state.lever_V, state.current_mA
        if self.is_held:
            voltage = state.reader_V
            current = self._source_mA - self._conductance * voltage
        slope, delay = response.by_parameter("surface_gap_um")
        by_source = spectral_densities(response, self.noise, slope)
        noise = float(np.sqrt(by_source.sum()))
        per_V = response.by_bias if self.is_held else np.nan
        return Signal(
            reader_ohm=1e3 * voltage / current,
            reader_V=voltage,
            dV_dz_V_per_um=slope,
            dlnR_dz_per_um=slope * (1.0 / voltage + self._conductance / current),
            noise_V_per_rtHz=noise,
            resolution_nm_per_rtHz=1e3 * noise / abs(slope),
            source_V_per_rtHz=np.sqrt(by_source),
            crosstalk_V_per_V=per_V,
            crosstalk_V_per_mW=per_V / response.power_by_bias,
            delay_us=delay,
            tip_K=state.tip_K,
        )


def over_surface(
    lever: Lever,
    distance_um: ArrayLike,
    bias: ArrayLike,
    noise: NoiseOptions | None = None,
    pressure_mbar: ArrayLike | None = None,
    *,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Read a lever at distances to a surface, over biases, and at pressures of the air.

    Parameters
    ----------
    lever : Lever
        In air.
    distance_um : array_like, shape (k,)
        From the lower face of the lever, at its tip, to the surface (µm).
    bias : array_like, shape (n,)
        Of the swept supply (V).
    noise : NoiseOptions, optional
    pressure_mbar : array_like, shape (m,), optional
        With an accommodation; that of the probe if left out.
    progress : callable, optional
        Called with the distances done and their number.

    Returns
    -------
    xarray.Dataset
        On the dimensions ``distance`` and ``bias``, and ``pressure`` if there are any, one variable
        for each column of `rows_of` and a few more, NaN where a bias is not reached;
        ``source_V_per_rtHz`` by source of the noise as well.

    Raises
    ------
    InputError
        If the reader cannot show anything, see `Reader`; if a bias is not finite, or heats nothing;
        or if the tip or the lever reaches the surface.
    """
    if pressure_mbar is not None:
        return _over_pressures(lever, distance_um, bias, noise, pressure_mbar, progress)
    reader = Reader(lever.probe, noise)
    values, distances = _checked(lever.probe, bias), np.atleast_1d(np.asarray(distance_um, float))
    check_distances(lever.probe, distances)
    nothing = Signal._make([*[np.nan] * 6, np.full(len(SOURCES), np.nan), *[np.nan] * 4])
    rows, notes = [], list[str]()
    for distance in each(distances.tolist(), progress):
        near = at_distance(lever, distance)
        branch, reading, failure = near.read(values)
        if failure is not None:
            notes.append(f"at {distance:.4g} µm: {failure}")
        rows.append(
            [
                nothing if np.isnan(u) else reader.signal(near, branch, u, value)
                for u, value in zip(reading.u, values.tolist(), strict=True)
            ]
        )
    columns: dict[str, Any] = {
        name: np.array([[getattr(signal, name) for signal in row] for row in rows])
        for name in Signal._fields
    }
    by_source = ("distance", "bias", "source"), columns.pop("source_V_per_rtHz")
    columns["surface_gap_um"] = "distance", distances
    columns["bias_V"] = "bias", values
    notes += reading_notes(reader, distances, values, columns)
    return labelled(
        {**columns, "source_V_per_rtHz": by_source},
        ("distance", "bias"),
        {"distance": distances, "bias": values, "source": list(SOURCES)},
        **probe_attributes(lever.probe),
        read_at=reader.terminal,
        notes="\n".join(notes),
    )


def reading_notes(
    reader: Reader, distances: Array, biases: Array, columns: Mapping[str, Array]
) -> list[str]:
    """Return what should be known of what a reader shows at distances (µm) and biases (V).

    The `columns` are those of `Signal`, of shape (k, n).
    """
    return [
        *_turns(distances, biases, columns["dV_dz_V_per_um"]),
        *_too_fast(reader.noise, columns["delay_us"]),
        *_jump_of_others(reader.probe, distances, biases, columns["tip_K"]),
    ]


def _turns(distances: Array, biases: Array, slopes: Array) -> list[str]:
    """Say where the voltage turns with the distance, (k, n): there nothing is read."""
    order = np.argsort(distances)
    signs = np.sign(slopes[order])
    notes = []
    for bias, column in zip(biases, signs.T, strict=True):
        for number in np.flatnonzero(column[1:] * column[:-1] < 0)[:1]:
            low, high = distances[order][[number, number + 1]]
            notes.append(
                f"at a bias of {bias:.4g} V the voltage has an extremum between {low:.4g} and "
                f"{high:.4g} µm, where it does not tell the distance"
            )
    return notes


def _too_fast(noise: NoiseOptions, delay_us: Array) -> list[str]:
    """Say where the band ends above what the lever follows."""
    if np.isnan(delay_us).all():
        return []
    slowest = float(np.nanmax(np.abs(delay_us)))
    corner = 1e6 / (2.0 * np.pi * slowest)
    if noise.high_Hz <= corner:
        return []
    return [
        f"the band ends at {1e-3 * noise.high_Hz:g} kHz, above the {1e-3 * corner:.2g} kHz up to "
        f"which the lever follows (a delay of {slowest:.3g} µs): there the signal is smaller"
    ]


def _jump_of_others(probe: Probe, distances: Array, biases: Array, tip_K: Array) -> list[str]:
    """Say how far heat is off where the tip, (k, n), is not as warm as the jump is stated for."""
    around, base = probe.surroundings, probe.circuit.base_temperature_K
    stated, cold = map(around.jump_length_um, (around.jump_temperature_K, base))
    own = np.vectorize(around.jump_length_um, otypes=[float])(tip_K)
    # between plates heat goes with the inverse of the gap and both jump lengths
    off = (own - stated) / (distances[:, None] + stated + cold)
    # a jump length that is off by this share of the heat is worth a note
    if not (np.abs(off) > 0.03).any():
        return []
    at, which = np.unravel_index(np.nanargmax(np.abs(off)), off.shape)
    return [
        f"the temperature of the air jumps as at {around.jump_temperature_K:g} K "
        f"(jump_temperature_K), the tip is at {tip_K[at, which]:.0f} K with "
        f"{biases[which]:.4g} V at {distances[at]:.4g} µm: heat to the surface is off by some "
        f"{100.0 * off[at, which]:+.0f} %"
    ]


def _over_pressures(
    lever: Lever,
    distance_um: ArrayLike,
    bias: ArrayLike,
    noise: NoiseOptions | None,
    pressure_mbar: ArrayLike,
    progress: Progress | None,
) -> xr.Dataset:
    import xarray as xr

    pressures, parts = np.atleast_1d(np.asarray(pressure_mbar, float)), []
    for number, pressure in enumerate(pressures.tolist()):

        def report_progress(done: int, total: int, before: int = number) -> None:
            if progress is not None:
                progress(before * total + done, pressures.size * total)

        thin = lever.with_probe(lever.probe.with_(pressure_mbar=pressure))
        part = over_surface(thin, distance_um, bias, noise, progress=report_progress)
        parts.append(part.expand_dims(pressure=[pressure]))
    data = xr.concat(parts, "pressure", data_vars="minimal", combine_attrs="drop_conflicts")
    notes = [f"{part.pressure.item():g} mbar: {part.notes}" for part in parts if part.notes]
    more = labelled({"pressure_mbar": pressures}, "pressure", {"pressure": pressures})
    return (
        data.assign_coords(more.coords).assign(more.variables).assign_attrs(notes="\n".join(notes))
    )


def rows_of(data: xr.Dataset) -> xr.Dataset:
    """Return the columns of a file of what `over_surface` gives, a row for each point."""
    import xarray as xr

    columns = [
        *("surface_gap_um", "bias_V", "reader_ohm", "reader_V", "dV_dz_V_per_um", "dlnR_dz_per_um"),
        *("noise_V_per_rtHz", "resolution_nm_per_rtHz"),
        *(["pressure_mbar"] if "pressure" in data.sizes else []),
    ]
    order = [name for name in ("pressure", "distance", "bias") if name in data.sizes]
    (full,) = xr.broadcast(data[columns])
    rows = full.stack(row=order)
    return labelled({name: rows[name].values for name in columns}, "row")


def best_bias(
    lever: Lever,
    distance_um: ArrayLike,
    highest_V: float,
    noise: NoiseOptions | None = None,
    progress: Progress | None = None,
) -> float:
    """Return the bias (V), up to a highest one, at which distances are resolved best.

    It is the best for the one that is resolved worst; the voltage changes with all in the same
    sense. Progress is called with the biases tried and their number: of even ones, then of more
    near the best of these.

    Raises
    ------
    InputError, ComputationError
        As `over_surface`.
    """
    reader = Reader(lever.probe, noise)
    tried = highest_V * np.arange(1, 12) / 11
    levers = [at_distance(lever, distance) for distance in np.unique(distance_um).tolist()]

    def resolution(bias_V: float) -> float:
        signals = []
        for near in levers:
            branch, reading, _ = near.read(np.array([bias_V]))
            if np.isnan(reading.u[0]):
                return np.inf
            signals.append(reader.signal(near, branch, reading.u[0], bias_V))
        slopes = np.array([signal.dV_dz_V_per_um for signal in signals])
        same = (slopes > 0).all() or (slopes < 0).all()
        return max(signal.resolution_nm_per_rtHz for signal in signals) if same else np.inf

    resolutions = np.array([resolution(value) for value in each(tried.tolist(), progress)])
    if not np.isfinite(resolutions).any():
        raise ComputationError(f"no bias up to {highest_V:g} V resolves all distances")
    best = int(resolutions.argmin())
    low, high = tried[max(best - 1, 0)], tried[min(best + 1, tried.size - 1)]
    around = np.linspace(low, high, 9)
    finer = [resolution(value) for value in each(around.tolist(), progress)]
    return float(around[int(np.argmin(finer))])


def at_distance(lever: Lever, distance_um: float) -> Lever:
    """Return the lever with a surface below at a distance (µm)."""
    return lever.with_probe(lever.probe.with_(surface_gap_um=distance_um))


def check_distances(probe: Probe, distance_um: Array) -> None:
    """Refuse distances at which the tip reaches the surface.

    Raises
    ------
    InputError
        Naming the nearest, or the contact of a tip that touches a sample.
    """
    if probe.contact is not None:
        raise InputError("[contact]: the tip touches a sample, expected a lever above a surface")
    height = 0.0 if probe.tip is None else probe.tip.height_um
    if not distance_um.size or not (distance_um > height).all():
        stated = f"{distance_um.min():g} µm" if distance_um.size else "none"
        least = "above 0" if probe.tip is None else f"above the tip's height, {height:g} µm"
        raise InputError(f"found a distance of {stated}, expected distances {least}")


def _checked(probe: Probe, bias: ArrayLike) -> Array:
    values = checked_bias(bias, probe)
    if probe.circuit.starts_cold and not values.all():
        raise InputError("found a bias of 0 V, which heats no reader; expected others")
    return values
