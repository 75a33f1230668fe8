"""The mesh of a lever: the usual one, refined where an estimate of its error asks for it.

A lever without power is solved twice on the same triangles, with cubic elements as always and with
quadratic ones. How far the two are apart, in the energy of their currents and of their heat flows,
bounds the error of the resistance and of the temperature per power with quadratic elements. With
cubic ones it is some ten times smaller (``benchmarks/mesh_estimate.py``). Where it is too large,
as for a border of the doping that is sharper than the triangles of a wide heater, the triangles
that make most of it are split.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache

import numpy as np

from hotlever.lever.elements import FiniteElements
from hotlever.lever.equations import LeverEquations
from hotlever.lever.full_space import FullSpace
from hotlever.materials import Kind
from hotlever.probe import Circuit, Layout, MeshOptions, Probe, Wiring, mesh_layout
from hotlever.types import Array, Index

#: Energy (relative) by which quadratic elements may differ from cubic ones: with that, currents
#: are within 2e-4 of a converged mesh, and T_tip within 0.2 K. The reference probe's usual mesh has
#: 2.3e-4.
TOLERANCE = 5e-4
#: Of that energy, the share made by the triangles that are split at once; and how often they are.
_SHARE, _MOST_ROUNDS = 0.8, 10


@lru_cache(maxsize=4)
def flat_space(layout: Layout, mesh: MeshOptions, wiring: Wiring) -> FullSpace:
    """Return mesh and operators of a layout in vacuum; levers of one shape share them."""
    return FullSpace(mesh_layout(layout, mesh, wiring), wiring=wiring)


def chosen_space(probe: Probe) -> FullSpace:
    """Return mesh and operators of a probe in vacuum, fine enough for its shape and materials."""
    # what is behind the swept supply does not matter
    circuit = probe.circuit.model_copy(update={"series_resistance_ohm": 0.0})
    return _chosen(probe.layout(), probe.wiring, circuit, tuple(probe.made_of.items()))


@lru_cache(maxsize=4)
def _chosen(
    layout: Layout,
    wiring: Wiring,
    circuit: Circuit,
    kinds: tuple[tuple[str, Kind], ...],
) -> FullSpace:
    space = flat_space(layout, MeshOptions(), wiring)
    for _ in range(_MOST_ROUNDS):
        by_element = energy_between_degrees(space, dict(kinds), circuit)
        if by_element.sum() <= TOLERANCE:
            break
        space = FullSpace(space.mesh.refined(making(by_element, _SHARE)), wiring=wiring)
    return space


def making(by_element: Array, share: float) -> Index:
    """Return the fewest triangles, by number, that make a share of the whole energy."""
    order = np.argsort(-by_element)
    reached = np.cumsum(by_element[order])
    return np.sort(order[: 1 + np.searchsorted(reached, share * reached[-1])])


def energy_between_degrees(space: FullSpace, kinds: Mapping[str, Kind], circuit: Circuit) -> Array:
    """Return the energy between quadratic and cubic elements, without power, of each triangle.

    It is the sum of ∫ σ (∇δV)² and ∫ κ (∇δT)², with δ what the two differ by, each over the
    same of the whole lever; the first is the difference of the resistances (Galerkin
    orthogonality).

    Parameters
    ----------
    space : FullSpace
        Of cubic triangles, in vacuum.
    kinds : mapping of str to Kind
        The materials by name.
    circuit : Circuit

    Returns
    -------
    ndarray, shape (elements,)
    """
    from skfem import ElementTriP2  # see `hotlever.probe.mesh`

    quadratic = FullSpace(
        space.mesh, FiniteElements(space.mesh.elements, ElementTriP2()), space.wiring
    )
    slopes = []
    for of_degree in (quadratic, space):
        # held supplies and warm leg ends are switched off
        equations = LeverEquations(of_degree, kinds, circuit).driven(0.0)
        potential, rise = (of_degree.fields(x) for x in equations.cold())
        slopes.append((potential.grad_V, rise.grad_T))
    properties = equations.at(np.zeros((space.size + 1, 1)))[1]
    energy = np.zeros(len(space.elements.dofs))
    for coefficient, low, high in zip((properties.sigma, properties.kappa), *slopes, strict=True):
        weight = space.weights * coefficient
        whole = (weight * (high**2).sum(axis=0)).sum()
        apart = weight * ((high - low) ** 2).sum(axis=0)
        energy += apart.reshape(len(energy), -1).sum(axis=1) / whole
    return energy
