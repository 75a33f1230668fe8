"""Panels on a lever: they cover its faces once."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever.air.surface import PanelOptions, lever_surface
from hotlever.errors import InputError
from hotlever.probe import Layout, Probe, Region, Taper, Terminal


def faces(layout: Layout) -> tuple[float, float]:
    """Area of the top face, and length of the outline without the leg ends."""
    boxes = [np.array(region.outline) for region in layout.regions]
    area = sum(np.prod(np.ptp(box, axis=0)) for box in boxes)
    perimeter = sum(2 * np.ptp(box, axis=0).sum() for box in boxes)
    for one in range(len(boxes)):
        for other in range(one):
            low = np.maximum(boxes[one].min(axis=0), boxes[other].min(axis=0))
            high = np.minimum(boxes[one].max(axis=0), boxes[other].max(axis=0))
            perimeter -= 2 * max((high - low).max(), 0.0) * ((high - low).min() > -1e-9)
    ends = [np.subtract(t.end, t.start) for t in layout.terminals]
    return area, perimeter - sum(np.linalg.norm(end) for end in ends)


@pytest.mark.parametrize("probe", [Probe.reference(), Probe.u_shape()])
@pytest.mark.parametrize("mirrored", [True, False])
def test_panels_cover_every_face_once(probe, mirrored):
    layout = probe.layout()
    surface = lever_surface(layout, mirrored=mirrored)
    share = 0.5 if mirrored else 1.0
    top, outline = faces(layout)
    flat = surface.panels.flat_axis == 2
    assert surface.panels.areas[flat].sum() == pytest.approx(2 * share * top, rel=1e-9)
    sides = share * layout.thickness_um * outline
    assert surface.panels.areas[~flat].sum() == pytest.approx(sides, rel=1e-9)
    heights = surface.panels.corners[..., 2]
    assert heights.max() == pytest.approx(0.2)
    assert heights.min() == pytest.approx(0.0 if mirrored else -0.2)


def test_each_panel_lies_at_its_site():
    surface = lever_surface(Probe.reference().layout(), mirrored=False)
    at = surface.panels.centres[:, :2]
    assert np.abs(surface.sites[surface.site] - at).max() < 1e-8
    assert np.unique(surface.site).size == len(surface.sites)


def test_panels_are_small_at_edges_and_in_the_heater():
    layout = Probe.reference().layout()
    surface, options = lever_surface(layout), PanelOptions()
    heater = np.linalg.norm(surface.panels.centres[:, :2] - layout.tip, axis=1) < 0.8
    assert surface.panels.radii[heater].max() < options.heater * 1.645
    finer = lever_surface(layout, PanelOptions(refinement=2.0))
    assert len(finer.panels) == pytest.approx(4 * len(surface.panels), rel=0.35)


def test_a_region_that_is_no_rectangle_is_refused():
    outline = ((0, 0), (10, 0), (12, 4), (0, 4))
    layout = Layout(
        (Region("slanted", "heater", outline, Taper((5, 2), (1, 0), 4.0)),),
        (Terminal("supply", (0, 0), (0, 4)),),
        (5, 2),
        0.4,
    )
    with pytest.raises(InputError, match="region 'slanted'"):
        lever_surface(layout)
