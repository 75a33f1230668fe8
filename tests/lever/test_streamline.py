"""The path of the current through the tip."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever.lever import Lever
from hotlever.lever.fields import current_path
from hotlever.probe import Probe
from hotlever.types import Array


def path_of(probe: Probe) -> tuple[Array, Array, Array]:
    """Return the path, its lengths, and the potential along it, of a lever that is nearly cold."""
    lever = Lever(probe)
    branch = lever.branch_to(0.1)
    x = branch.equations.space.expanded(branch.states(np.array([branch.end_u])))[:, 0]
    potential = lever.space.nodal(x, 293.0)[1]
    points, along = current_path(lever.space, potential)
    elements, shares, _ = lever.space.elements.at_points(points)
    return points, along, (shares * potential[lever.space.elements.dofs[elements]]).sum(axis=1)


@pytest.mark.parametrize(
    ("probe", "legs"),
    [(Probe.reference(), (0.0, 8.15)), (Probe.u_shape(), (-6.0, 6.0))],
    ids=["three-leg", "u"],
)
def test_it_leads_downhill_from_the_supply_through_the_tip_to_the_ground(
    probe: Probe, legs: tuple[float, float]
) -> None:
    points, along, potential = path_of(probe)
    assert np.linalg.norm(points - probe.layout().tip, axis=1).min() == 0.0
    assert np.all(np.diff(along) > 0.0)
    assert np.all(np.diff(potential) < 0.0)
    assert potential[-1] == pytest.approx(0.0, abs=1e-3 * potential[0])
    # a line through the middle of the heater has half of the current on either side: along a leg
    # over which the current is spread evenly it is in the middle
    for end, y in zip((points[0], points[-1]), legs, strict=True):
        assert end == pytest.approx([0.0, y], abs=0.04)
    in_leg = points[(points[:, 0] < 30.0) & (points[:, 1] > 1.0), 1]
    assert in_leg == pytest.approx(legs[1], abs=0.04)
