"""Sweeps as datasets, what monitors show in them, and the files they are kept in.

What monitors show of states are combinations of the temperatures and potentials at the nodes, which
are linear in the unknowns. So all that leads from some states to others leads from what is shown of
the one to that of the other: curves along a branch, cubics within a step in time, modes.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csr_matrix, vstack

from hotlever.datasets import (
    checksum,
    in_a_file,
    labelled,
    offer_plots,
    quantity,
    write_dataset,
)
from hotlever.errors import InputError
from hotlever.files import read_text
from hotlever.lever.branch import Branch
from hotlever.lever.equations import (
    BALANCES,
    ELECTRICAL_OUTPUTS,
    LeverEquations,
    balance_columns,
    balance_names,
    balance_slopes,
)
from hotlever.lever.full_space import FullSpace
from hotlever.lever.observables import with_following
from hotlever.materials import Kind
from hotlever.probe import Circuit, Probe
from hotlever.probe.parts import SECTIONS, Monitor, on_lever
from hotlever.probe.probe_parameters import usual_parameters
from hotlever.quantities import OBSERVABLES
from hotlever.types import Array, Mask

if TYPE_CHECKING:
    import xarray as xr


#: Columns of a sweep file.
SWEEP_COLUMNS = (
    *("bias_V", "current_mA", "lever_V", "reader_V"),
    *("tip_K", "power_mW", "heater_ohm", "legs_ohm"),
)


def dataset_of_states(
    probe: Probe, equations: LeverEquations, x: Array, notes: Sequence[str] = ()
) -> xr.Dataset:
    """Return what is observed of solved states (size + 1, n) of a probe's lever."""
    base = equations.base_temperature_K
    outputs = dict(zip(ELECTRICAL_OUTPUTS, equations.observed(x), strict=True))
    outputs["tip_K"] = base + equations.space.tip_rise(x)
    outputs["max_K"] = base + equations.highest_rise(x)
    monitors = MonitorMap(probe, equations)
    outputs |= monitors.columns(monitors.values(x).T)
    return _dataset(probe, equations, outputs, balance_columns(equations, x), notes)


def dataset_of_branch(
    probe: Probe,
    branch: Branch,
    u: Array,
    notes: Sequence[str] = (),
    sensitivities: Array | None = None,
) -> xr.Dataset:
    """Return what is observed of a probe's lever at some places u (n,) of its branch.

    Sensitivities, (observables, n, p), are of `OBSERVABLES` by what a fit usually varies.
    """
    equations, outputs = branch.equations, branch.electrical_outputs(u)
    outputs["tip_K"] = branch.tip_K(u)
    outputs["max_K"] = branch.base_temperature_K + branch.highest_rise_at(u)
    monitors = MonitorMap(probe, equations)
    curves = monitors.values(branch.x).T, monitors.changes(branch.slopes).T
    outputs |= monitors.columns(branch.through(*curves)(u))
    balances = branch.through(
        balance_columns(equations, branch.x), balance_slopes(equations, branch.x, branch.slopes)
    )
    return _dataset(probe, equations, outputs, balances(u), notes, sensitivities)


def _dataset(
    probe: Probe,
    equations: LeverEquations,
    outputs: Mapping[str, Array],
    balances: Array,
    notes: Sequence[str],
    sensitivities: Array | None = None,
) -> xr.Dataset:
    """Return what is observed of n states, of which the balances (n, k) are `balance_columns`.

    The outputs are what instruments see, the tip, the highest temperature, and monitors.
    """
    made_of = equations.laws.made_of
    names = balance_names(probe.wiring)
    columns = {**outputs, **dict(zip(names, balances.T, strict=True))}
    at_terminals = names[len(BALANCES) :]
    columns["bias_V"] = probe.circuit.bias(outputs["lever_V"], outputs["current_mA"])
    columns["power_mW"] = outputs["lever_V"] * outputs["current_mA"]
    for part in ("heater", "leg1", "leg2"):
        columns[f"{part}_ohm"] = _resistance(columns[f"{part}_mW"], outputs["current_mA"])
    if probe.wiring.held:
        # the same current does not pass all parts
        columns["leg2_ohm"] = np.full_like(columns["leg2_ohm"], np.nan)
    columns["legs_ohm"] = columns["leg1_ohm"] + columns["leg2_ohm"]
    # where all of the conductor is the heater there are no legs
    whole = np.where(np.isnan(columns["legs_ohm"]), 0.0, columns["legs_ohm"])
    columns["lever_ohm"] = whole + columns["heater_ohm"]
    more = (
        *("leg1_ohm", "leg2_ohm", "lever_ohm", "max_K"),
        *("ground_current_mA", "end_heat_mW", "air_heat_mW", "radiated_mW", "into_tip_mW"),
    )
    every = dict.fromkeys((*SWEEP_COLUMNS, *at_terminals, *more, *outputs))
    ordered_columns = with_following(probe, {name: columns[name] for name in every})
    variables, coordinates = with_meanings(probe, ordered_columns, "bias")
    coordinates["bias"] = columns["bias_V"]
    if sensitivities is not None:
        variables["sensitivity"] = (("observable", "bias", "parameter"), sensitivities)
        coordinates |= {"observable": list(OBSERVABLES), "parameter": list(usual_parameters(probe))}
    data = labelled(
        variables,
        coordinates=coordinates,
        **probe_attributes(probe),
        notes="\n".join(
            [*notes, *range_notes(made_of, "a bias of {} V", columns["bias_V"], columns["max_K"])]
        ),
    )
    for column in at_terminals:
        meaning = f"current into the lever at terminal {column.removesuffix('_mA')}"
        data[column].attrs = {"units": "mA", "long_name": meaning}
    return data


def at_bias(data: xr.Dataset, bias: Array) -> xr.Dataset:
    """Return a sweep with the biases asked for, to the last digit, not V_l + R_s I_h.

    Rounded sums would be other labels: ``sel`` would miss them, and sweeps of two levers
    would have no bias in common.
    """
    exact = data.assign(bias_V=quantity("bias_V", "bias", bias))
    return exact.assign_coords(bias=quantity("bias", "bias", bias))


def _resistance(heat_mW: Array, current_mA: Array) -> Array:
    """Return Joule heat over the square of the current (Ω); NaN without current."""
    nothing = np.full_like(heat_mW, np.nan)
    return np.divide(1000.0 * heat_mW, current_mA**2, out=nothing, where=current_mA != 0)


def range_notes(made_of: Mapping[str, Kind], where: str, along: Array, max_K: Array) -> list[str]:
    """Say from where on the laws of materials are used beyond the temperatures they are meant for.

    `where` has the place of a number in it, the least of those of `along` that it is true of.
    """
    laws = [law for kind in made_of.values() for law in kind.laws]
    limit = min(law.temperature_range[1] for law in laws)
    beyond = along[max_K > limit]
    if not beyond.size:
        return []
    least = where.format(f"{beyond.min().round(9):.4g}")
    return [
        f"from {least} part of the lever is above {limit:.0f} K, "
        "where the material laws are extrapolated"
    ]


def probe_attributes(probe: Probe) -> dict[str, str]:
    """Return what a dataset says of a probe, which `probe_of` reads."""
    sections = {name: json.dumps(section) for name, section in probe.sections().items()}
    return {**sections, "medium": probe.surroundings.medium, "lever": probe.title}


def write_sweep(data: xr.Dataset, path: str | os.PathLike[str]) -> None:
    """Write a sweep as ``.csv`` (the columns of `SWEEP_COLUMNS`) or ``.nc`` (everything).

    Raises
    ------
    InputError
        If the suffix is neither, or the file cannot be written.
    """
    write_dataset(data, path, in_a_file(data, SWEEP_COLUMNS))


def read_sweep(path: str | os.PathLike[str]) -> xr.Dataset:
    """Read a sweep written by `write_sweep` as NetCDF.

    Raises
    ------
    InputError
        If the file is not a sweep, or is damaged.
    """
    import xarray as xr  # see `hotlever.datasets.labelled`

    offer_plots()
    if not Path(path).is_file():
        read_text(path)  # says why
    try:
        with xr.open_dataset(path, engine="netcdf4") as data:
            loaded = data.load()
        # files of 1.0 have none
        damaged = loaded.attrs.pop("checksum", None) not in (None, checksum(loaded))
    except Exception as error:
        # a damaged file raises what its libraries think of
        raise InputError(f"{path}: not a NetCDF file, or a damaged one") from error
    if damaged:
        raise InputError(f"{path}: the file is damaged: its numbers are not those written")
    missing = [name for name in SWEEP_COLUMNS if name not in loaded.variables]
    if missing:
        raise InputError(f"{path}: not a sweep: variable '{missing[0]}' is missing")
    return loaded


def probe_of(data: xr.Dataset) -> Probe:
    """Return the probe that a sweep was made of.

    Raises
    ------
    InputError
        If it does not say, or has a material with laws of its own, whose class is not at hand.
    """
    # every dataset has a circuit, without which the probe would be in the reference's
    names = [name for name in (*SECTIONS, "laws") if name in data.attrs or name == "circuit"]
    return Probe.from_sections({name: _section(data, name) for name in names}, "sweep")


def _section(data: xr.Dataset, name: str) -> dict[str, Any]:
    """Return a section of the probe file that a dataset holds."""
    try:
        section = json.loads(data.attrs[name])
    except (KeyError, TypeError, ValueError):
        section = None
    if not isinstance(section, dict):
        raise InputError(f"sweep: [{name}] is missing or damaged")
    return section


def circuit_of(data: xr.Dataset) -> Circuit:
    """Return the circuit in which a sweep was made.

    Raises
    ------
    InputError
        If it does not say.
    """
    return Circuit.from_values(_section(data, "circuit"), "sweep: [circuit]")


def with_ramp(data: xr.Dataset, up: Mask) -> xr.Dataset:
    """Return a sweep whose rows, (n,), are known to be of the way up or of that down."""
    return data.assign_coords(ramp=quantity("ramp", "bias", np.where(up, "up", "down")))


def checked_bias(bias: ArrayLike, probe: Probe, and_back: bool = False) -> Array:
    """Return biases as an array; those of a ramp that goes back as well rise from 0 V or more.

    Raises
    ------
    InputError
        If one is not finite or there is none; or one is negative, unless that is another state
        than the positive one; or they do not rise where they must.
    """
    values = np.atleast_1d(np.asarray(bias))
    if values.ndim > 1 or values.dtype.kind not in "iuf":
        raise InputError(
            f"found biases as {values.dtype} of shape {values.shape}, expected a row of numbers"
        )
    values = values.astype(float)
    lowest = probe.lowest_bias_V
    wrong = values[~np.isfinite(values) | (values < lowest)]
    if wrong.size:
        of = f" of {lowest:g} or more" if np.isfinite(lowest) else ""
        raise InputError(f"found a bias of {wrong[0]:g} V, expected finite biases{of}")
    if not values.size:
        raise InputError("no bias, expected one or more")
    if and_back and (values[0] < 0.0 or (np.diff(values) <= 0.0).any()):
        raise InputError(
            f"found biases from {values[0]:g} to {values[-1]:g} V up and back, expected some that "
            "rise from 0 V or more"
        )
    return values


# --- monitors -------------------------------------------------------------------------------------


class MonitorMap:
    """From the states of a probe's lever to what its monitors show, and its sensed terminals.

    Parameters
    ----------
    probe : Probe
    equations : LeverEquations
        Of its lever, full or reduced.

    Attributes
    ----------
    size : int
        Number of rows.
    """

    def __init__(self, probe: Probe, equations: LeverEquations) -> None:
        space, full = equations.space, equations.space.full
        every = {}
        for name in _sensed(probe):
            nodes = full.contact_nodes[name]
            row = np.full(nodes.size, 1.0 / nodes.size), nodes, [0, nodes.size]
            mean = csr_matrix(row, shape=(1, full.elements.size))
            every[f"{name}_V"] = mean, np.ones(1, dtype=bool)
        for name, monitor in probe.monitors.items():
            every |= {f"{name}_{unit}": _weights(full, monitor, unit) for unit in ("K", "V")}
        self._sizes = {name: there.size for name, (_, there) in every.items()}
        self.size = sum(self._sizes.values())
        none = csr_matrix((0, full.elements.size)), np.empty(0, dtype=bool)
        of_nodes, every_there = zip(none, *every.values(), strict=True)
        weights = vstack(of_nodes, format="csr")
        is_T = np.repeat([name.endswith("_K") for name in every], [*self._sizes.values()])
        of_T = csr_matrix(weights.multiply(is_T[:, None]))
        self._map = space.combined(of_T, weights - of_T)
        warm = of_T @ equations.nodal_rises(np.zeros((space.size + 1, 1)))
        warm += equations.base_temperature_K * is_T[:, None]
        self._constant = np.where(np.concatenate(every_there)[:, None], warm, np.nan)

    def values(self, x: Array) -> Array:
        """Return what is shown of states (size + 1, n), (rows, n); NaN where there is nothing."""
        return np.asarray(self._constant + self._map @ x)

    def changes(self, change: Array) -> Array:
        """Return how it changes with changes of the states."""
        return np.asarray(self._map @ change)

    def columns(self, values: Array) -> dict[str, Array]:
        """Return values, here (n, rows), by the names of their columns, (n,) or along a line."""
        parts = np.split(values, np.cumsum([*self._sizes.values()])[:-1], axis=1)
        named = zip(self._sizes.items(), parts, strict=bool(self._sizes))
        return {name: part if size > 1 else part[:, 0] for (name, size), part in named}


def with_meanings(
    probe: Probe, columns: Mapping[str, Any], along: str
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return columns of a dataset, with what those of monitors are, and coordinates of lines.

    Parameters
    ----------
    probe : Probe
    columns : mapping of str to ndarray
        Those of `MonitorMap.columns` among them.
    along : str
        Their dimension.
    """
    variables, coordinates = dict(columns), {}
    for name in _sensed(probe):
        meaning = {"units": "V", "long_name": f"potential of terminal {name}"}
        variables[f"{name}_V"] = along, columns[f"{name}_V"], meaning
    for name, monitor in probe.monitors.items():
        dimensions: tuple[str, ...] = (along,)
        if monitor.line_um is not None:
            dimensions, (first, *_) = (along, name), monitor.positions
            meaning = {"units": "µm", "long_name": f"distance from the start of {name}"}
            coordinates[name] = name, np.linalg.norm(monitor.positions - first, axis=1), meaning
        for unit, what in (("K", "temperature"), ("V", "potential")):
            meaning = {"units": unit, "long_name": f"{what} {monitor}"}
            variables[f"{name}_{unit}"] = dimensions, columns[f"{name}_{unit}"], meaning
    return variables, coordinates


def _sensed(probe: Probe) -> list[str]:
    """Return the terminals whose potential follows, without the reader of the paper's circuit."""
    return [name for name in probe.wiring.measurable if name != "reader"]


def _weights(full: FullSpace, monitor: Monitor, unit: str) -> tuple[csr_matrix, Mask]:
    """Return the weights of the nodes (k, nodes) for what a monitor shows, and where it does, (k,).

    It shows the temperature (K) or the potential (V).
    """
    elements, layout = full.elements, full.mesh.layout
    counts = full.conducting if unit == "V" else np.ones(full.conducting.shape, dtype=bool)
    if monitor.region is not None:
        # the mean over some elements
        here = counts & np.isin(full.mesh.region, layout.named(monitor.region))
        weights = elements.weights * np.repeat(here, elements.per_element)
        row = csr_matrix(weights / max(weights.sum(), np.finfo(float).tiny))
        return row @ elements.sampling[: weights.size], np.array([here.any()])
    there = on_lever(layout, monitor.positions)
    at, element = elements.interpolation(monitor.positions[there])
    # rows without weights where there is no lever
    rows = at.data, at.indices, np.append(0, np.cumsum(there)) * elements.dofs.shape[1]
    there[there] = counts[element]
    return csr_matrix(rows, shape=(there.size, elements.size)), there
