"""Layouts and their meshes."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hotlever.errors import InputError
from hotlever.probe import MeshOptions, Probe, mesh_layout

PROBES = {"three-leg": Probe.reference(), "u-shape": Probe.u_shape()}


def polygon_area(outline):
    x, y = np.array(outline).T
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


@pytest.mark.parametrize("name", PROBES)
def test_mesh_tiles_every_region(name):
    layout = PROBES[name].layout()
    mesh = mesh_layout(layout)
    corners = mesh.elements.p[:, mesh.elements.t]
    (ax, ay), (bx, by) = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    areas = np.abs(ax * by - ay * bx) / 2
    for index, region in enumerate(layout.regions):
        assert areas[mesh.region == index].sum() == pytest.approx(polygon_area(region.outline))


@pytest.mark.parametrize("name", PROBES)
def test_terminals_have_edges_of_their_full_length(name):
    layout = PROBES[name].layout()
    mesh = mesh_layout(layout)
    for terminal in layout.terminals:
        a, b = mesh.elements.p[
            :, mesh.elements.facets[:, mesh.terminal_facets[terminal.name]]
        ].T.swapaxes(0, 1)
        length = np.linalg.norm(a - b, axis=1).sum()
        assert length == pytest.approx(math.dist(terminal.start, terminal.end))


def test_reference_probe_has_the_published_parts():
    layout = Probe.reference().layout()
    assert {terminal.name for terminal in layout.terminals} == {"supply", "ground", "reader"}
    assert layout.tip == (pytest.approx(48.58), 0.0)
    assert layout.heater_taper.length_um == 4.0
    assert [region.name for region in layout.regions if region.taper] == ["heater", "reader"]


@pytest.mark.parametrize("name", ["three-leg", "u-shape"])
def test_etching_moves_every_edge_but_those_of_the_doping(name):
    probe, bias = PROBES[name], 0.1
    before, after = (one.layout() for one in (probe, probe.with_(edge_bias_um=bias)))
    for old, new in zip(before.regions, after.regions, strict=True):
        (low, high), (new_low, new_high) = old.box, new.box
        if "leg" in old.name and old.name != "right leg front":
            assert new_low[1] - low[1] == pytest.approx(-bias)
            assert new_high[1] - high[1] == pytest.approx(bias)
    assert after.box[1] - before.box[1] == pytest.approx([bias, bias])
    long, wide = np.sort(before.heater.sides)[::-1]
    # the shoulders at its ends are edges too; what the dopant comes from is none
    assert np.sort(after.heater.sides)[::-1] == pytest.approx([long - 2 * bias, wide + 2 * bias])
    assert after.heater_taper.length_um == before.heater_taper.length_um
    assert after.heater_taper.centre == pytest.approx(before.heater_taper.centre)
    assert after.tip == pytest.approx(before.tip)


def test_a_heater_that_fills_its_gap_does_so_after_etching():
    probe = Probe.u_shape().with_(heater_length_um=6.0, edge_bias_um=0.25)
    assert (probe.shape.etched.gap_um, probe.shape.etched.heater_length_um) == (5.5, 5.5)
    assert probe.layout().heater_taper.length_um == 6.0


@pytest.mark.parametrize(("bias", "left"), [(1.7, "gap_um is -0.2"), (-0.9, "heater_width_um is")])
def test_etching_leaves_something(bias, left):
    with pytest.raises(InputError, match=f"edge_bias_um = {bias}, {left}.* µm, expected 0.01"):
        Probe.reference().with_(edge_bias_um=bias)


def test_reentrant_corners_of_the_reference_probe():
    corners = Probe.reference().layout().reentrant_corners()
    expected = [(46.58, 0.8225), (50.58, 0.8225), (50.58, 6.42)]
    assert sorted(corners) == sorted([*expected, *((x, -y) for x, y in expected)])


def test_mesh_is_graded_to_heater_and_corners():
    layout = Probe.reference().layout()
    mesh = mesh_layout(layout)
    p, facets = mesh.elements.p, mesh.elements.facets
    length = np.linalg.norm(p[:, facets[0]] - p[:, facets[1]], axis=0)
    middle = p[:, facets].mean(axis=1)
    for corner in layout.reentrant_corners():
        near = np.linalg.norm(middle - np.array(corner)[:, None], axis=0) < 0.1
        assert length[near].min() < 0.06
        assert length[near].max() < 0.25
    assert length.max() > 2.0


def test_refinement_divides_the_sizes():
    layout = Probe.reference().layout()
    coarse, fine = (
        mesh_layout(layout, MeshOptions(refinement=r)).elements.nelements for r in (1.0, 2.0)
    )
    assert fine > 1.8 * coarse


def test_the_tip_lies_in_the_heater_and_outside_points_are_refused(coarse):
    elements, tip = coarse.space.elements, np.array([coarse.space.mesh.layout.tip])
    (element,), (weights,), slopes = elements.at_points(tip)
    x = elements.nodes[:, elements.dofs[element]]
    np.testing.assert_allclose(x @ weights, (48.58, 0.0), atol=1e-9)
    np.testing.assert_allclose(x @ slopes[:, 0].T, np.eye(2), atol=1e-9)
    with pytest.raises(InputError, match="outside the lever"):
        elements.at_points(np.array([[0.0, 100.0]]))


@settings(max_examples=15, deadline=None)
@given(
    st.floats(30, 120),
    st.floats(2, 10),
    st.floats(1.5, 6),
    st.floats(1.5, 8),
    st.floats(1.5, 8),
    st.floats(1.5, 8),
    st.floats(0.4, 3),
)
def test_any_sensible_three_leg_lever_meshes(length, centre, outer, gap, bridge, heater, width):
    probe = Probe.reference().with_(
        length_um=length,
        centre_leg_width_um=centre,
        outer_leg_width_um=outer,
        gap_um=gap,
        bridge_width_um=bridge,
        heater_length_um=heater,
        heater_width_um=width,
        reader_length_um=3.0,
    )
    mesh = mesh_layout(probe.layout())
    assert 100 < mesh.elements.nelements < 6000
