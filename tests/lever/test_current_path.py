"""The path of the current through the tip."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever.lever import Lever
from hotlever.lever.current_path import current_path
from hotlever.lever.lever import COARSE
from hotlever.probe import Probe
from hotlever.types import Array


def path_of(probe: Probe) -> tuple[Array, Array, Array]:
    """Return the path, its lengths, and the potential along it, of a lever that is nearly cold."""
    lever = Lever(probe, COARSE)
    branch = lever.branch_to(0.1)
    x = branch.equations.space.expanded(branch.states(np.array([branch.end_u])))[:, 0]
    potential = lever.space.nodal(x, 293.0)[1]
    points, along = current_path(lever.space, potential)
    return points, along, lever.space.elements.basis.probes(points.T) @ potential


@pytest.mark.parametrize("probe", [Probe.reference(), Probe.u_shape()], ids=["three-leg", "u"])
def test_it_leads_downhill_from_the_supply_through_the_tip_to_the_ground(probe: Probe) -> None:
    points, along, potential = path_of(probe)
    layout, step = probe.layout(), along[1]
    assert np.linalg.norm(np.diff(points, axis=0), axis=1) == pytest.approx(step, rel=0.05)
    assert np.linalg.norm(points - layout.tip, axis=1).min() < 2 * step
    # both ends are leg ends, at the base of the supply's leg and of the ground's
    assert points[[0, -1], 0] == pytest.approx([0.0, 0.0], abs=1.5 * step)
    assert np.all(np.diff(potential) < 0.0)
    assert potential[[0, -1]] == pytest.approx([potential.max(), 0.0], abs=0.01 * potential.max())
    supply, ground = (
        next(end for end in layout.terminals if end.name == name) for name in ("supply", "ground")
    )
    for at, terminal in ((points[0], supply), (points[-1], ground)):
        y = np.array([terminal.start, terminal.end])[:, 1]
        assert y.min() < at[1] < y.max()


def test_in_legs_it_is_straight() -> None:
    """Current spreads evenly over a leg: at its middle the path goes straight along it."""
    points, _, _ = path_of(Probe.u_shape())
    in_leg = points[(points[:, 0] > 5.0) & (points[:, 0] < 35.0)]
    for side in (in_leg[in_leg[:, 1] < 0], in_leg[in_leg[:, 1] > 0]):
        assert np.ptp(side[:, 1]) < 0.02
    # the shape is symmetric, and so is the path
    assert points[0] == pytest.approx(points[-1] * [1.0, -1.0], abs=0.2)
