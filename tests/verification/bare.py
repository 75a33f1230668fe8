"""Layouts without a heater, on which exact solutions are known."""

from __future__ import annotations

import numpy as np
from skfem import MeshTri
from skfem.element import Element

from hotlever.lever.branch import Branch, Reach
from hotlever.lever.elements import FiniteElements
from hotlever.lever.equations import LeverEquations
from hotlever.lever.following import Follower
from hotlever.lever.full_space import FullSpace
from hotlever.lever.pinned import state_at_bias
from hotlever.materials import Material
from hotlever.probe import Circuit, Layout, ProbeMesh, Region, Taper, Terminal


def bare_equations(
    mesh: MeshTri,
    supply: Terminal,
    ground: Terminal,
    tip: tuple[float, float],
    material: Material,
    *,
    taper: Taper | None = None,
    element: Element | None = None,
    quadrature: int = 6,
) -> LeverEquations:
    """Equations of one piece of silicon between two terminals."""
    region = Region("all", "heater", ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0)), taper)
    layout = Layout((region,), (supply, ground), tip, 0.4)
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
    return LeverEquations(space, material, 293.0)


def state_at(equations: LeverEquations, voltage: float) -> np.ndarray:
    """The state at a voltage between the terminals, solved to rounding errors."""
    circuit = Circuit(series_resistance_ohm=0.0)
    branch: Branch = Follower(equations).until(Reach(circuit, voltage))
    guess = branch.states(branch.read(circuit, np.array([voltage])).u)
    return state_at_bias(equations, circuit, voltage, guess)
