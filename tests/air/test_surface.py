"""Panels on a lever: they cover its faces once, whatever its outline."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from plates import disc, plate, turned
from shapely import LineString, Polygon

from hotlever.air.surface import lever_surface
from hotlever.probe import Layout, Probe

POINTED = [(0, 10), (0, 4), (40, 2), (40, -2), (0, -4), (0, -10), (46, -6), (52, 0), (46, 6)]
LAYOUTS = {
    "three legs": Probe.reference().layout(),
    "U": Probe.u_shape().layout(),
    "turned": turned(Probe.reference().layout(), 0.7, (1e3, -2e3)),
    "pointed": plate(POINTED, 0.4),
    "with holes": plate(
        [(0, 0), (20, 0), (20, 12), (0, 12)], 0.4,
        [[(3, 3), (3, 6), (9, 5)], [(12, 4), (12, 9), (17, 9), (17, 4)]],
    ),
    "disc": disc(10.0, 0.4),
    "needle": plate([(0, 0), (30, 0), (0.3, 3)], 0.2),
    "a comb of thin slits": plate(
        [(0, 0), (10, 0), (10, 8), (6, 8), (6, 1), (5.9, 1), (5.9, 8), (3, 8), (3, 1), (2, 1),
         (2, 8), (0, 8)], 1.0,
    ),
    "thicker than wide": plate([(0, 0), (10, 0), (10, 0.7), (0, 0.5)], 2.0),
}  # fmt: skip


def faces(layout: Layout) -> tuple[Polygon, float]:
    """The top face, and length of the outline without the leg ends."""
    face = shapely.union_all(
        [Polygon(one.outline, one.holes) for one in layout.regions], grid_size=1e-9
    )
    ends = [LineString([one.start, one.end]) for one in layout.terminals]
    return face, face.boundary.difference(shapely.union_all(ends).buffer(1e-5)).length


def is_level(surface):
    return np.ptp(surface.panels.corners[..., 2], axis=1) < 1e-9


@pytest.mark.parametrize("name", LAYOUTS)
@pytest.mark.parametrize("mirrored", [True, False])
def test_panels_cover_every_face_once(name, mirrored):
    layout = LAYOUTS[name]
    surface = lever_surface(layout, mirrored=mirrored)
    share = 0.5 if mirrored else 1.0
    face, outline = faces(layout)
    flat = is_level(surface)
    assert surface.panels.areas[flat].sum() == pytest.approx(2 * share * face.area, rel=1e-5)
    sides = share * layout.thickness_um * outline
    assert surface.panels.areas[~flat].sum() == pytest.approx(sides, rel=1e-5)
    half = layout.thickness_um / 2
    heights = surface.panels.corners[..., 2]
    assert heights.max() == pytest.approx(half)
    assert heights.min() == pytest.approx(0.0 if mirrored else -half)
    # nothing is covered twice, and nothing beside the lever
    top = flat & (surface.panels.centres[:, 2] > 0)
    cells = shapely.polygons(surface.panels.corners[top][:, :, :2])
    assert shapely.union_all(cells, grid_size=1e-8).area == pytest.approx(face.area, rel=1e-5)
    assert shapely.covers(face.buffer(0.01), cells).all()
    assert shapely.distance(shapely.points(surface.sites), face).max() < 1e-6


@pytest.mark.parametrize("name", LAYOUTS)
def test_panels_are_convex(name):
    corners = lever_surface(LAYOUTS[name]).panels.corners
    sides = np.roll(corners, -1, axis=1) - corners
    # with the next side, or the one after it in a triangle
    around = np.cross(sides, np.roll(sides, -1, axis=1))
    sense = around.sum(axis=1)
    sense /= np.linalg.norm(sense, axis=1, keepdims=True)
    assert np.einsum("nkd,nd->nk", around, sense).min() > -1e-6


@pytest.mark.parametrize("name", ["three legs", "pointed"])
def test_each_panel_lies_at_its_site(name):
    surface = lever_surface(LAYOUTS[name], mirrored=False)
    at = surface.panels.centres[:, :2]
    assert np.abs(surface.sites[surface.site] - at).max() < 1e-8
    assert np.unique(surface.site).size == len(surface.sites)


@pytest.mark.parametrize("name", ["three legs", "turned"])
def test_panels_are_small_at_edges_and_in_the_heater(name):
    layout = LAYOUTS[name]
    surface = lever_surface(layout)
    heater = np.linalg.norm(surface.panels.centres[:, :2] - layout.tip, axis=1) < 0.8
    assert surface.panels.radii[heater].max() < 0.3 * 1.645
    finer = lever_surface(layout, 2.0)
    assert len(finer.panels) == pytest.approx(4 * len(surface.panels), rel=0.35)


@pytest.mark.parametrize("name", ["three legs", "pointed", "disc", "with holes"])
def test_strips_along_edges_are_narrow(name):
    layout = LAYOUTS[name]
    surface = lever_surface(layout)
    cells = shapely.polygons(surface.panels.corners[is_level(surface)][:, :, :2])
    face, _ = faces(layout)
    ends = shapely.union_all([LineString([t.start, t.end]) for t in layout.terminals])
    edges = face.boundary.difference(ends.buffer(1e-5)).buffer(0.02)
    along = shapely.area(shapely.intersection(cells, edges)) / 0.02
    # at a leg end a panel inside touches the end of an edge
    beside = (along > 0.1) & (shapely.distance(cells, ends) > 0.1)
    assert beside.sum() > 50
    widths = shapely.area(cells)[beside] / along[beside]
    assert widths.max() < 0.8 * layout.thickness_um
    assert np.median(widths) < 0.4 * layout.thickness_um


def test_a_lever_has_the_same_panels_anywhere_on_a_wafer():
    layout = LAYOUTS["three legs"]
    here, there = lever_surface(layout), lever_surface(turned(layout, 2.0, (-300.0, 800.0)))
    assert len(here.panels) == len(there.panels)
    np.testing.assert_allclose(
        np.sort(here.panels.areas), np.sort(there.panels.areas), rtol=1e-6, atol=1e-9
    )
    # most panels are rectangles, whose integrals are closed
    assert np.mean(there.panels.frame[0] >= 0) > 0.9


def test_an_arc_of_many_short_lines_takes_no_more_panels():
    few, many = (lever_surface(disc(10.0, 0.4, corners)) for corners in (96, 768))
    assert len(many.panels) < 1.5 * len(few.panels)
