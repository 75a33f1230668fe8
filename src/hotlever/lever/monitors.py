"""What monitors show of states: combinations of the temperatures and potentials at the nodes.

They are linear in the unknowns. So all that leads from some states to others leads from what is
shown of the one to that of the other: curves along a branch, cubics within a step in time, modes.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from scipy.sparse import csr_matrix, vstack

from hotlever.lever.equations import LeverEquations
from hotlever.lever.full_space import FullSpace
from hotlever.probe import Probe
from hotlever.probe.parts import Monitor, on_lever
from hotlever.types import Array, Mask


class _Weights(NamedTuple):
    """Weights of the nodes for one column (k, nodes), and where there is something to show."""

    of_nodes: csr_matrix
    there: Mask


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
            every[f"{name}_V"] = _Weights(mean, np.ones(1, dtype=bool))
        for name, monitor in probe.monitors.items():
            every |= {f"{name}_{unit}": _weights(full, monitor, unit) for unit in ("K", "V")}
        self._sizes = {name: weights.there.size for name, weights in every.items()}
        self.size = sum(self._sizes.values())
        none = _Weights(csr_matrix((0, full.elements.size)), np.empty(0, dtype=bool))
        of_nodes, there = zip(none, *every.values(), strict=True)
        weights = vstack(of_nodes, format="csr")
        is_T = np.repeat([name.endswith("_K") for name in every], [*self._sizes.values()])
        of_T = csr_matrix(weights.multiply(is_T[:, None]))
        self._map = space.combined(of_T, weights - of_T)
        warm = of_T @ equations.nodal_rises(np.zeros((space.size + 1, 1)))
        warm += equations.base_temperature_K * is_T[:, None]
        self._constant = np.where(np.concatenate(there)[:, None], warm, np.nan)

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


def _weights(full: FullSpace, monitor: Monitor, unit: str) -> _Weights:
    """Return the weights for the temperature or the potential that a monitor shows."""
    elements, layout = full.elements, full.mesh.layout
    counts = full.conducting if unit == "V" else np.ones(full.conducting.shape, dtype=bool)
    if monitor.region is not None:
        # the mean over some elements
        here = counts & np.isin(full.mesh.region, layout.named(monitor.region))
        weights = elements.weights * np.repeat(here, elements.per_element)
        row = csr_matrix(weights / max(weights.sum(), np.finfo(float).tiny))
        return _Weights(row @ elements.sampling[: weights.size], np.array([here.any()]))
    there = on_lever(layout, monitor.positions)
    at, element = elements.interpolation(monitor.positions[there])
    # rows without weights where there is no lever
    rows = at.data, at.indices, np.append(0, np.cumsum(there)) * elements.dofs.shape[1]
    there[there] = counts[element]
    return _Weights(csr_matrix(rows, shape=(there.size, elements.size)), there)
