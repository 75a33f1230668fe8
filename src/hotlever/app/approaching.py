"""A reader over a surface that sliders move. Runs in worker processes.

While sliders move, a coarse lever answers that is solved at some distances, once for all biases:
what it shows at another distance is read off the curves through these, whose slopes are exact. When
they rest, the full lever, whose numbers are those of ``hotlever reader``.
"""

from __future__ import annotations

import math
from contextlib import suppress
from functools import lru_cache
from typing import Any

import numpy as np

from hotlever.air.bodies import BaseLine
from hotlever.app.live import coloured
from hotlever.app.session import Task, lever_told, probe_of
from hotlever.app.workers import Report
from hotlever.errors import ComputationError, InputError
from hotlever.lever import Branch, Lever
from hotlever.lever.elements import FiniteElements
from hotlever.lever.lever import COARSE
from hotlever.lever.reader import Reader, Signal, at_distance, over_surface, reading_notes
from hotlever.probe import Layout, Probe
from hotlever.probe.shapes import Shape
from hotlever.tasks.arguments import make_lever, notes_of
from hotlever.tasks.commands import arguments_of
from hotlever.tasks.parsing import parse_bias, parse_distances
from hotlever.tasks.surfaces import (
    jumping_at_tip,
    over_a_surface,
    read_over_a_surface,
    reader_noise,
)
from hotlever.types import Array, Index
from hotlever.work import each, one_blas_thread

#: What is read off by the distance.
_READ = tuple(name for name in Signal._fields if not name.startswith(("source", "crosstalk")))


def described(report: Report, name: str, tilt_deg: float | None) -> dict[str, Any]:
    """Return the distances (µm) that a probe allows, and what its file says of its surroundings."""
    probe = probe_of(name)
    around = probe.surroundings
    tilt = around.surface_tilt_deg if tilt_deg is None else tilt_deg
    line = _Line(probe.layout())
    beyond = (line.end if tilt > 0 else line.start) - line.tip
    height = 0.0 if probe.tip is None else probe.tip.height_um
    # the surface stays clear of every part of the lever
    clear = max(height, math.tan(math.radians(tilt)) * beyond) + 0.1
    nearest = max(0.2, float(f"{1.05 * clear:.2g}"))
    return {
        "nearest_um": nearest,
        "farthest_um": max(5.0, 4.0 * nearest),
        "tilt_deg": around.surface_tilt_deg,
        "accommodation": around.with_jump.accommodation,
    }


@one_blas_thread
def answer(
    report: Report, task: Task, distance: float, quick: bool, jump_K: float | None
) -> dict[str, Any]:
    """Return what a reader shows at a distance (µm), and if `quick` by the distance too.

    Parameters
    ----------
    report : Report
    task : Task
        That of ``hotlever reader``, at a bias, over the distances of the curves.
    distance : float
    quick : bool
        Whether the coarse lever is to answer.
    jump_K : float or None
        The temperature as at which the air jumps for it while the bias moves, so that its levers
        need not be solved anew; that of its own tip if None. The full lever takes the latter.

    Raises
    ------
    HotleverError
        If the reader can show nothing, or has no state at this bias.
    """
    told = arguments_of(task.words)
    noise = reader_noise(told["bandwidth"], told["amplifier"], told["hooge"], told["vibration"])
    ends = parse_distances(told["distance"])
    distances = np.geomspace(ends[0], ends[-1], ends.size)
    probe = read_over_a_surface(report, lever_told(told), distances)
    probe = over_a_surface(report, probe, told["medium"], distances)
    bias = float(parse_bias(told["bias"], probe.lowest_bias_V).item())
    stated = probe.surroundings
    if quick and jump_K is not None:
        probe = probe.with_(jump_temperature_K=jump_K)
    else:
        probe = jumping_at_tip(report, _coarse(probe), bias)
    if quick:
        return _moving(report, Reader(probe, noise), distances, distance, bias)
    lever = make_lever(report, probe.with_(surface_gap_um=distance))
    data = over_surface(lever, [distance], [bias], noise)
    if not np.isfinite(data.tip_K.values).any():
        raise ComputationError(notes_of(data)[0])
    report.note(*notes_of(data))
    values, around = {name: float(data[name].item()) for name in _READ}, probe.surroundings
    return {
        "now": {"bias_V": bias, "surface_gap_um": distance, **values},
        "jump_K": None if around == stated else around.jump_temperature_K,
        "read_at": data.attrs["read_at"],
    }


def _moving(
    report: Report, reader: Reader, distances: Array, distance: float, bias: float
) -> dict[str, Any]:
    """Return what coarse levers at some distances show, and between them at another one."""
    probe, signals, states = reader.probe, dict[float, Signal](), {}
    failures: list[ComputationError] = []
    levers = _levers(report, probe, tuple(distances.tolist()))
    for z, lever in zip(distances.tolist(), levers, strict=True):
        branch, reading, failure = lever.read(np.array([bias]))
        if failure is None:
            u = float(reading.u[0])
            signals[z], states[z] = reader.signal(lever, branch, u, bias), (lever, branch, u)
        else:
            failures.append(failure)
    if not signals:
        raise failures[0]
    z = np.array(list(signals))
    columns = {
        name: np.array([getattr(signal, name) for signal in signals.values()]) for name in _READ
    }
    by_bias = {name: values[:, None] for name, values in columns.items()}
    nearest = min(states, key=lambda at: abs(math.log(at / distance)))
    hottest, line = _hottest(*states[nearest]), _Line(probe.layout())
    base, around = probe.circuit.base_temperature_K, probe.surroundings
    drawn = ("reader_V", "dlnR_dz_per_um", "noise_V_per_rtHz", "resolution_nm_per_rtHz", "tip_K")
    return {
        "now": {"bias_V": bias, "surface_gap_um": distance, **_at(distance, z, columns)},
        "curves": {"surface_gap_um": z, **{name: columns[name] for name in drawn}},
        "colours": coloured(hottest, base, max(float(hottest.max()), base + 1.0)),
        "ends": (line.start, line.tip, line.end),
        "thickness_um": probe.layout().thickest_um,
        "tip": None if probe.tip is None else (probe.tip.height_um, probe.tip.base_radius_um),
        "slope": math.tan(math.radians(around.surface_tilt_deg)),
        "read_at": reader.terminal,
        "on_curves": reading_notes(reader, z, np.array([bias]), by_bias),
    }


@lru_cache(maxsize=3)
def _coarse(probe: Probe) -> Lever:
    return Lever(probe, COARSE)


@lru_cache(maxsize=3)
def _levers(report: Report, probe: Probe, distances: tuple[float, ...]) -> list[Lever]:
    """Return coarse levers at some distances (µm)."""
    lever = Lever(probe, COARSE)
    with report.progress("the lever at some distances, once") as update:
        return [at_distance(lever, distance) for distance in each(list(distances), update)]


def _at(distance: float, z: Array, columns: dict[str, Array]) -> dict[str, float]:
    """Return what curves by the distance have at one of them; nothing beyond their ends."""
    from scipy.interpolate import CubicHermiteSpline, PchipInterpolator

    if z.size < 2:
        inside = np.isclose(z[0], distance)
        return {name: float(values[0]) if inside else math.nan for name, values in columns.items()}
    x, at = np.log(z), math.log(distance)
    now = {
        name: float(PchipInterpolator(x, values, extrapolate=False)(at))
        for name, values in columns.items()
    }
    exact = {
        "reader_V": columns["dV_dz_V_per_um"],
        "reader_ohm": columns["reader_ohm"] * columns["dlnR_dz_per_um"],
    }
    for name, slope in exact.items():
        now[name] = float(CubicHermiteSpline(x, columns[name], z * slope, extrapolate=False)(at))
    # where the voltage turns with the distance this has no bounds, and no curve to be read off
    now["resolution_nm_per_rtHz"] = 1e3 * now["noise_V_per_rtHz"] / abs(now["dV_dz_V_per_um"])
    return now


def _hottest(lever: Lever, branch: Branch, u: float, pieces: int = 80) -> Array:
    """Return the highest temperature (K) in each of the `pieces` in which a lever is drawn."""
    x = branch.equations.space.expanded(branch.states(np.array([u])))
    rises = lever.circuit.end_rises()
    T = lever.space.nodal(x[:, 0], branch.base_temperature_K, rises)[0]
    piece, cells = _cells(lever.probe.shape, lever.space.elements, pieces)
    hottest = np.full(pieces, -np.inf)
    np.maximum.at(hottest, piece, cells @ T)
    met = np.flatnonzero(np.isfinite(hottest))
    return np.interp(np.arange(pieces), met, hottest[met])


@lru_cache(maxsize=3)
def _cells(shape: Shape, elements: FiniteElements, pieces: int) -> tuple[Index, Any]:
    """Return cells of a grid inside a lever: the piece that each is of, and what reads it off."""
    layout, line = shape.layout(), _Line(shape.layout())
    low, high = layout.box
    step = float(max(high - low)) / (2 * pieces)
    points = np.stack(
        np.meshgrid(*(np.arange(a + step / 2, b, step) for a, b in zip(low, high, strict=True))),
        axis=-1,
    ).reshape(-1, 2)
    points = points[layout.contains(points)]
    edges = np.linspace(line.start, line.end, pieces + 1)
    return np.searchsorted(edges[1:-1], line.of(points)), elements.basis.probes(points.T)


class _Line:
    """The direction of a lever, from its base to its front; positions (µm) along it."""

    def __init__(self, layout: Layout) -> None:
        self._origin, self._along = np.zeros(2), np.array([1.0, 0.0])
        with suppress(InputError):  # leg ends that are not on one line
            base = BaseLine.of(layout, "the drawing")
            self._origin, self._along = base.origin, base.axes[0]
        outline = self.of(np.array([point for ring in layout.outline for point in ring]))
        self.start, self.end = float(outline.min()), float(outline.max())
        self.tip = float(self.of(np.array(layout.tip)))

    def of(self, points: Array) -> Array:
        """Return where points (n, 2) are along it."""
        return np.asarray((points - self._origin) @ self._along)
