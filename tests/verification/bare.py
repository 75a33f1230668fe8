"""Layouts without a heater, on which exact solutions are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from skfem import MeshTri
from skfem.element import Element

from hotlever.lever.branch import Branch, Reach
from hotlever.lever.continuation import continued
from hotlever.lever.elements import FiniteElements
from hotlever.lever.equations import LeverEquations
from hotlever.lever.full_space import FullSpace
from hotlever.lever.solved_states import state_at_bias
from hotlever.materials import HIGH_DOPED, LOW_DOPED, Kind, Material
from hotlever.probe import Circuit, Layout, ProbeMesh, Region, Taper, Terminal
from hotlever.probe.layout import Film


def bare_equations(
    mesh: MeshTri,
    supply: Terminal,
    ground: Terminal,
    tip: tuple[float, float],
    material: Material,
    *,
    taper: Taper | None = None,
    stack: dict[str, tuple[Kind, float]] | None = None,
    element: Element | None = None,
    quadrature: int = 6,
) -> LeverEquations:
    """Equations of one piece of silicon, or of a stack, between two terminals.

    A stack gives materials and thicknesses (µm) by name, the body first.
    """
    region = Region(
        *("all", "heater", ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0)), taper),
        material=HIGH_DOPED if taper is None else LOW_DOPED,
    )
    kinds, thickness = material.kinds, 0.4
    if stack is not None:
        (body, (_, thickness)), *films = stack.items()
        on_it = tuple(Film(name, film) for name, (_, film) in films)
        region = replace(region, material=body, films=on_it)
        kinds = {name: kind for name, (kind, _) in stack.items()}
    layout = Layout((region,), (supply, ground), tip, thickness)
    boundary = mesh.boundary_facets()

    def edges(terminal: Terminal):
        a, b = np.array(terminal.start), np.array(terminal.end)
        ends = mesh.p[:, mesh.facets[:, boundary]]
        normal = np.array([-(b - a)[1], (b - a)[0]])
        on = np.abs(np.tensordot(normal, ends - a[:, None, None], axes=1)).max(axis=0) < 1e-9
        return boundary[on]

    probe_mesh = ProbeMesh(
        layout,
        mesh,
        np.zeros(mesh.nelements, dtype=np.intp),
        {"supply": edges(supply), "ground": edges(ground)},
    )
    space = FullSpace(probe_mesh, FiniteElements(mesh, element, quadrature))
    return LeverEquations(space, kinds, Circuit(base_temperature_K=293.0))


def state_at(equations: LeverEquations, voltage: float) -> np.ndarray:
    """The state at a voltage between the terminals, solved to rounding errors."""
    circuit = Circuit(series_resistance_ohm=0.0)
    branch: Branch = continued(equations, Reach(circuit, voltage))
    guess = branch.states(branch.read(circuit, np.array([voltage])).u)
    return state_at_bias(equations, circuit, voltage, guess)
