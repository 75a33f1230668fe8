"""A lever that sliders move: what is asked for at some parameters and a bias, at once.

Runs in worker processes. While parameters move, the reduced lever answers, or a coarse one where no
reduced lever of the geometry is at hand; when they rest, the full lever, whose numbers are those of
``hotlever sweep``.
"""

from __future__ import annotations

import io
import os
from contextlib import suppress
from dataclasses import asdict, dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.tri import Triangulation
from numpy.typing import ArrayLike
from PIL import Image

from hotlever.app.session import Task, probe_of, surrounded_probe
from hotlever.app.workers import Report
from hotlever.errors import ComputationError, HotleverError, InputError
from hotlever.figures.style import HEAT
from hotlever.lever import Branch, Lever
from hotlever.lever.branch import Reach, branch_end
from hotlever.lever.fields import current_path
from hotlever.lever.full_space import FullSpace
from hotlever.lever.lever import COARSE
from hotlever.lever.reduced_lever import (
    ReducedLever,
    cached_reduction,
    can_be_reduced,
    known_reduction,
)
from hotlever.lever.response_surface import is_papers
from hotlever.materials.departures import departure_of
from hotlever.materials.parameters import own_name
from hotlever.probe import Circuit, Probe
from hotlever.probe.probe_parameters import of_materials
from hotlever.probe.shapes import EDGE_BIAS
from hotlever.tasks.arguments import make_lever
from hotlever.tasks.commands import arguments_of
from hotlever.types import Array, Index
from hotlever.work import one_blas_thread


class _Map:
    """Temperatures of a lever on a grid of cells, and along the current through the tip.

    Its `potential` (V, at the nodes) is of a state in which a current flows.
    """

    def __init__(self, space: FullSpace, potential: Array) -> None:
        layout = space.mesh.layout
        low, high = layout.box
        step = float(max(high - low)) / 360  # so many cells along the longer side
        self.x, self.y = (np.arange(a + step / 2, b, step) for a, b in zip(low, high, strict=True))
        half = step / 2
        ends = self.x[0] - half, self.x[-1] + half, self.y[0] - half, self.y[-1] + half
        self.box = [float(end) for end in ends]
        points = np.stack(np.meshgrid(self.x, self.y), axis=-1).reshape(-1, 2)
        self._inside = layout.contains(points)
        points = points[self._inside]
        self._cells, _ = space.elements.interpolation(points, _triangles_at(space, points))
        self.outline = layout.outline
        path, along = current_path(space, potential)
        self.along = np.linspace(0.0, along[-1], 361)
        points = np.stack([np.interp(self.along, along, axis) for axis in path.T], axis=-1)
        elements, self._shares, _ = space.elements.at_points(points)
        self._on_path = space.elements.dofs[elements]

    def picture(self, T: Array, low: float, high: float) -> bytes:
        """Return the map as PNG, coloured from `low` to `high` (K), transparent beside the lever.

        A browser shows a picture in a tenth of the time that it takes to draw a map of numbers.
        """
        dots = np.zeros((self._inside.size, 4), dtype=np.uint8)
        dots[self._inside] = coloured(self._cells @ T, low, high)
        rows = dots.reshape(self.y.size, self.x.size, 4)[::-1]
        written = io.BytesIO()
        Image.fromarray(rows).save(written, "png", compress_level=1)
        return written.getvalue()

    def line(self, T: Array) -> Array:
        """Return the temperature (K) along the current."""
        return np.asarray((self._shares * T[self._on_path]).sum(axis=1))


def _triangles_at(space: FullSpace, points: Array) -> Index:
    """Return the triangle at each of many points (n, 2), by a map of trapezoids."""
    mesh = space.mesh.elements
    x, y = mesh.p
    found = np.asarray(Triangulation(x, y, mesh.t.T).get_trifinder()(*points.T))
    outside = found < 0  # by rounding
    found[outside] = space.elements.at_points(points[outside])[0]
    return found


def coloured(T: ArrayLike, low: float, high: float) -> Array:
    """Return temperatures as colours from `low` to `high` (K): four bytes each."""
    shares = np.clip((np.asarray(T) - low) / (high - low), 0.0, 1.0)
    colours = colormaps[HEAT](np.linspace(0.0, 1.0, 256), bytes=True)
    return np.asarray(colours[(shares * (len(colours) - 1)).astype(np.intp)])


#: Maps by mesh; those of one shape share it.
_maps: dict[int, tuple[object, _Map]] = {}


@dataclass
class LiveLever:
    """A branch of a lever, in a circuit, and how its states are drawn in the space of a mesh."""

    model: str
    space: FullSpace
    circuit: Circuit
    branch: Branch

    @cached_property
    def curves(self) -> dict[str, Any]:
        """I-V curve, temperature by power and the knee, by the tip temperature of the branch.

        And how hot the lever gets, which may be beside the tip.
        """
        u = np.linspace(0.0, self.branch.end_u, 121)
        observables = self.branch.electrical_outputs(u)
        knee = self.branch.knee
        return {
            "lever_V": observables["lever_V"],
            "current_mA": observables["current_mA"],
            "power_mW": observables["lever_V"] * observables["current_mA"],
            "tip_K": self.branch.tip_K(u),
            "hottest_K": float(self._temperatures(u[-1:]).max()),
            "knee": None if knee is None else asdict(knee),
        }

    def _temperatures(self, u: Array) -> Array:
        """Return the temperatures (K) at the nodes in a state."""
        x = self.branch.equations.space.expanded(self.branch.states(u))[:, 0]
        base_K = self.branch.base_temperature_K
        return np.asarray(self.space.nodal(x, base_K, self.circuit.end_rises())[0])

    @property
    def map(self) -> _Map:
        """How its states are drawn, and those of all levers of this mesh."""
        number = id(self.space.mesh)
        if number not in _maps:
            if len(_maps) >= 3:  # for sliders that go back and forth
                _maps.clear()
            # where it is nearly cold the path of the current is that of the shape
            x = self.branch.states(np.array([0.02 * self.branch.end_u]))
            x = self.branch.equations.space.expanded(x)[:, 0]
            potential = self.space.nodal(x, self.branch.base_temperature_K)[1]
            # the mesh is kept, so that no other gets its number
            _maps[number] = self.space.mesh, _Map(self.space, potential)
        return _maps[number][1]

    def reaches(self, bias: float) -> bool:
        """Whether its branch has a state at a bias (V)."""
        return bool(np.isfinite(self.branch.read(self.circuit, np.array([bias])).u).all())

    def at(self, report: Report, bias: float) -> dict[str, Any]:
        """Return what the lever shows at a bias (V): numbers, map and profile; tell its notes.

        Raises
        ------
        BranchEndError
            If there is no state at this bias.
        """
        reading = self.branch.read(self.circuit, np.array([bias]))
        if not np.isfinite(reading.u).all():
            raise branch_end(self.branch, reading)
        report.note(*reading.notes(np.array([bias])))
        observables = {
            name: float(value[0])
            for name, value in self.branch.electrical_outputs(reading.u).items()
        }
        low, knee = self.branch.base_temperature_K, self.branch.knee
        drawn, T = self.map, self._temperatures(reading.u)
        step_K = 100.0
        high = step_K * np.ceil(max(float(T.max()), low + 1.0) / step_K)
        return {
            **observables,
            "bias_V": bias,
            "tip_K": float(self.branch.tip_K(reading.u)[0]),
            "power_mW": observables["lever_V"] * observables["current_mA"],
            "hottest_K": float(T.max()),
            "knee": np.nan if knee is None else knee.tip_K,
            "knee_V": np.nan if knee is None else knee.lever_V,
            "scale_K": (low, high),
            "picture": drawn.picture(T, low, high),
            "line": drawn.line(T),
        }


# --- called from the app -------------------------------------------------------------------------


@one_blas_thread
def answer(
    report: Report, task: Task, bias: float, most: float, quick: bool, reduced: bool = False
) -> dict[str, Any]:
    """Return what a lever shows at a bias (V), and its curves.

    Parameters
    ----------
    report : Report
    task : Task
        That of ``hotlever sweep``.
    bias, most : float
        V; how far the curves go at least.
    quick : bool
    reduced : bool
        Whether the reduced lever of the geometry has been made.

    Raises
    ------
    InputError
        If the bias is negative.
    BranchEndError
        If the lever has no state at this bias; a reduced lever that ends below leaves the answer to
        a coarse one.
    """
    if bias < 0.0:
        raise InputError(
            f"found a bias of {bias:g} V, expected 0 or more; where polarity counts, with held "
            "supplies or thermoelectricity, hotlever sweep takes negative ones"
        )
    probe, most = surrounded_probe(report, arguments_of(task.words)), max(most, bias)
    live = _quick(probe, most, reduced) if quick else _full(report, probe, most)
    if live.model == "reduced lever" and not live.reaches(bias):
        live = _quick(probe, most, False)
    drawn = live.map
    return {
        "model": live.model,
        "curves": live.curves,
        "now": live.at(report, bias),
        "box": drawn.box,
        "outline": drawn.outline,
        "along": drawn.along,
        "base_K": live.branch.base_temperature_K,
    }


def prepare(report: Report, task: Task) -> bool:
    """Make the reduced lever of a task's probe, if it can have one; return whether it has."""
    with suppress(OSError, AttributeError):
        os.nice(10)  # sliders come first
    probe = surrounded_probe(report, arguments_of(task.words))
    if not _can_be_reduced(probe):
        return False
    with report.progress_bars("air", "live sliders") as (meshing, training):
        cached_reduction(Lever(probe, progress=meshing), training)
    return True


def described(report: Report, name: str) -> dict[str, Any]:
    """Return what sliders need of a probe: by group names, values, bounds and units."""
    probe = probe_of(name)
    sliders: dict[str, list[Any]] = {"material": [], "dimensions": [], "circuit": []}
    parameters = {
        name: parameter
        for name, parameter in of_materials(probe).items()
        if departure_of(own_name(name)) is None
    }
    values = probe.values(list(parameters)).tolist()
    for (key, parameter), value in zip(parameters.items(), values, strict=True):
        low, high = max(parameter.lower, value / 2), min(parameter.upper, value * 2)
        if value == 0.0:
            low, high = -0.2 * parameter.scale, 0.2 * parameter.scale
        ends = min(low, value), max(high, value)
        sliders["material"].append((key, value, *ends, parameter.unit))
    for key, value in probe.shape.dimensions().items():
        if key not in probe.shape.tied():
            low, high = (0.8 * value, 1.2 * value) if own_name(key) != EDGE_BIAS else (-0.2, 0.2)
            ends = min(low, value), max(high, value)
            sliders["dimensions"].append((key, value, *ends, "µm"))
    circuit = probe.circuit
    resistance, base = circuit.series_resistance_ohm, circuit.base_temperature_K
    top = max(2 * resistance, 1000.0)
    sliders["circuit"] = [
        ("series_resistance_ohm", resistance, 0.0, top, "Ω"),
        ("base_temperature_K", base, 250.0, 400.0, "K"),
    ]
    return {
        "sliders": sliders,
        "meanings": probe.shape.description() | probe.circuit.description(),
        "around": {
            "medium": probe.surroundings.medium,
            "surface_gap_um": probe.surroundings.surface_gap_um,
            **dict(probe.physics),
        },
        "reduced": _can_be_reduced(probe),
    }


@lru_cache(maxsize=3)
def _full(report: Report, probe: Probe, most: float) -> LiveLever:
    lever = make_lever(report, probe)
    return LiveLever("full lever", lever.space, lever.circuit, _branch(lever, most))


@lru_cache(maxsize=3)
def _quick(probe: Probe, most: float, is_reduced: bool) -> LiveLever:
    """Return the reduced lever of a probe, or else a coarse one."""
    reduced = _reduced(_geometry(probe)) if is_reduced else None
    if reduced is not None:
        full, small = reduced
        try:
            branch = small.branch(probe, Reach(probe.circuit, most))
            return LiveLever("reduced lever", full.space, probe.circuit, branch)
        except HotleverError:
            pass  # beyond what it is made for
    lever = Lever(probe, COARSE)
    return LiveLever("coarse lever", lever.space, probe.circuit, _branch(lever, most))


def _can_be_reduced(probe: Probe) -> bool:
    """Whether a reduced lever serves wherever sliders move: its ranges must not move with them."""
    return is_papers(probe) and can_be_reduced(probe, ())


def _geometry(probe: Probe) -> Probe:
    """Return a probe of the same geometry, surroundings and base temperature."""
    usual = Probe.reference()
    base = probe.circuit.base_temperature_K
    same = {"material": usual.material, "circuit": usual.circuit.with_(base_temperature_K=base)}
    return probe.model_copy(update=same)


@lru_cache(maxsize=3)
def _reduced(probe: Probe) -> tuple[Lever, ReducedLever] | None:
    """Return the full and the reduced lever of a geometry."""
    lever = Lever(probe)
    reduced = known_reduction(lever)
    return None if reduced is None else (lever, reduced)


def _branch(lever: Lever, most: float) -> Branch:
    """Return a branch that reaches a bias and the knee, or as far as it goes."""
    try:
        lever.branch_to(most)
        return lever.branch_past_knee()
    except ComputationError as error:
        if isinstance(error.partial, Branch):
            return error.partial
        raise
