"""The mesh is the usual one, or finer where an estimate of its error asks for it."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever.lever import Lever
from hotlever.lever.discretisation import chosen_space, energy_between_degrees
from hotlever.lever.full_space import FullSpace
from hotlever.probe import MeshOptions, Probe

#: A wide heater with a sharp border: its usual triangles are ten times as long as its doping takes.
SHARP = {
    "heater_width_um": 5.0,
    "heater_length_um": 8.0,
    "centre_leg_width_um": 11.0,
    "delta": 0.1,
}
BIAS = [4.0]


@pytest.fixture(scope="module")
def sharp():
    return Probe.reference().with_(**SHARP)


def energy(probe, space):
    return energy_between_degrees(space, probe.made_of, probe.circuit)


def test_the_usual_mesh_does_for_the_reference_probe():
    probe = Probe.reference()
    chosen, usual = chosen_space(probe), Lever(probe, MeshOptions()).space
    np.testing.assert_array_equal(chosen.mesh.elements.p, usual.mesh.elements.p)
    assert energy(probe, usual).sum() < 2.5e-4


@pytest.mark.slow
def test_a_border_sharper_than_the_triangles_gets_smaller_ones(sharp):
    usual, chosen = Lever(sharp, MeshOptions()), Lever(sharp)
    assert energy(sharp, usual.space).sum() > 2.5e-3
    assert energy(sharp, chosen.space).sum() <= 5e-4
    mesh = chosen.space.mesh
    everywhere = mesh.refined(np.arange(mesh.elements.nelements))
    truth, by_usual, by_chosen = (
        lever.dataset(lever.solve(BIAS))
        for lever in (Lever(sharp, space=FullSpace(everywhere)), usual, chosen)
    )
    of_usual, of_chosen = (
        np.abs(data.current_mA.values / truth.current_mA.values - 1).max()
        for data in (by_usual, by_chosen)
    )
    assert of_chosen < 2e-5 < 4e-4 < of_usual
    assert np.abs(by_chosen.tip_K.values - truth.tip_K.values).max() < 0.1


def test_split_triangles_are_of_the_same_regions_and_terminals(sharp):
    mesh = Lever(sharp, MeshOptions()).space.mesh
    finer = mesh.refined(np.flatnonzero(mesh.region == 1))
    assert finer.elements.nelements > mesh.elements.nelements

    def areas(one):
        corners = one.elements.p[:, one.elements.t]
        (ax, ay), (bx, by) = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        return np.bincount(one.region, np.abs(ax * by - ay * bx) / 2)

    np.testing.assert_allclose(areas(finer), areas(mesh), rtol=1e-12)

    def lengths(one):
        ends = one.elements.p[:, one.elements.facets]
        length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=0)
        return {name: length[facets].sum() for name, facets in one.terminal_facets.items()}

    assert lengths(finer) == pytest.approx(lengths(mesh))


def test_the_energy_is_the_difference_of_resistances(sharp):
    """Galerkin orthogonality, but for the quadrature of a sharp border."""
    from skfem.element import ElementTriP2

    from hotlever.lever.elements import FiniteElements

    space = chosen_space(sharp)
    mesh = space.mesh
    quadratic = FullSpace(mesh, FiniteElements(mesh.elements, ElementTriP2()))
    low, high = (
        Lever(sharp, space=one).sweep([1e-3]).lever_ohm.item() for one in (quadratic, space)
    )
    assert 1 - low / high == pytest.approx(energy(sharp, space).sum(), rel=0.5)


def test_given_sizes_are_taken_as_they_are(sharp):
    explicit, default = Lever(sharp, MeshOptions()), Lever(sharp)
    assert explicit.space.mesh.elements.nelements < default.space.mesh.elements.nelements
