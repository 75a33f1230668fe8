"""The base line of a lever, and the chip behind it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from plates import turned

from hotlever.air.bodies import REACH, BaseLine, chip_panels, lever_axes
from hotlever.air.operator import air_operator
from hotlever.errors import InputError
from hotlever.probe import Probe
from hotlever.probe.surroundings import Surroundings

LAYOUT = Probe.reference().layout()
COARSE = 0.4


@pytest.mark.parametrize("angle", [0.0, 0.6, np.pi / 2, -2.5])
def test_the_base_line_goes_through_the_leg_ends(angle):
    line = BaseLine.of(turned(LAYOUT, angle, (10.0, 20.0)), "a test")
    assert line.axes[0] == pytest.approx([np.cos(angle), np.sin(angle)])
    assert line.axes[1] == pytest.approx([-np.sin(angle), np.cos(angle)])
    np.testing.assert_allclose(lever_axes(turned(LAYOUT, angle))[0], line.axes[0], atol=1e-12)


def test_the_chip_turns_with_the_lever():
    angle, shift = 0.6, np.array([10.0, 20.0])
    here, there = chip_panels(LAYOUT), chip_panels(turned(LAYOUT, angle, shift))
    cosine, sine = np.cos(angle), np.sin(angle)
    turn = np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]])
    np.testing.assert_allclose(there.corners, here.corners @ turn.T + [*shift, 0], atol=1e-9)
    length, half = np.ptp(LAYOUT.box[:, 0]), LAYOUT.thickness_um / 2
    assert here.corners[..., 0].min() == pytest.approx(-REACH * length)
    assert here.corners[..., 2].max() == pytest.approx(half + REACH * length)
    assert here.corners[..., 2].min() == pytest.approx(-half)


def with_ground(start, end):
    ends = [replace(one, start=start, end=end) if one.name == "ground" else one
            for one in LAYOUT.terminals]  # fmt: skip
    return replace(LAYOUT, terminals=tuple(ends))


@pytest.mark.parametrize(
    ("layout", "message"),
    [
        (with_ground((5.0, 9.88), (10.0, 9.88)), r"leg ends of supply and ground on one line; \("),
        (with_ground((0.0, 6.42), (1.0, 9.88)), r"leg ends .* \(0, 6.42\) µm is 0.734 µm off"),
        (
            replace(
                LAYOUT,
                regions=(
                    *LAYOUT.regions,
                    replace(LAYOUT.regions[0], outline=((-3, 0), (0, 0), (0, 1), (-3, 1))),
                ),
            ),
            r"in front of the line of its leg ends; \(-3, [01]\) µm is 3 µm behind it",
        ),
    ],
)
def test_without_a_base_line_chip_and_tilt_are_refused_and_nothing_else(layout, message):
    for what in ({"chip": True}, {"surface_gap_um": 9.0, "surface_tilt_deg": 5.0}):
        with pytest.raises(InputError, match=rf"^surroundings: .*{message}") as refused:
            air_operator(layout, Surroundings(**what), refinement=COARSE)
        assert "\n" not in str(refused.value)
    np.testing.assert_array_equal(lever_axes(layout), np.eye(2))
    level = air_operator(layout, Surroundings(surface_gap_um=9.0), refinement=COARSE)
    assert level.matrix.sum() > 0
