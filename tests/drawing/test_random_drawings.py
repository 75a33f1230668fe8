"""Random drawings, valid and broken: each is solved, in air too, or refused in one line."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hotlever.errors import HotleverError
from hotlever.lever import Lever
from hotlever.lever.lever import COARSE
from hotlever.probe import Probe


def length(least, most):
    return st.floats(least, most, allow_nan=False)


@st.composite
def levers(draw):
    """A lever of two slanted legs and a front, its heater across the front or in it, turned."""
    long, apart, wide = draw(length(15, 150)), draw(length(8, 40)), draw(length(2, 15))
    front, narrow = draw(length(2, 6)), draw(length(0.3, 1.0)) * apart
    outer, inner = apart / 2 + wide, apart / 2
    silicon = [
        (0, outer), (0, inner), (long, narrow / 2), (long, -narrow / 2), (0, -inner),
        (0, -outer), (long + front, -narrow / 2 - wide / 3), (long + 2 * front, 0),
        (long + front, narrow / 2 + wide / 3),
    ]  # fmt: skip
    # a side that starts at the very corner of the front would cut a wedge off too thin to be meant
    half = draw(length(0.1, 0.49)) * narrow
    lean = draw(length(-0.8, 0.8)) * half
    heater = [
        (long - 1, -half), (long + 3 * front, -half - lean),
        (long + 3 * front, half + lean), (long - 1, half),
    ]  # fmt: skip
    angle, shift = draw(length(-np.pi, np.pi)), (draw(length(-5e3, 5e3)), draw(length(-5e3, 5e3)))
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    digits = draw(st.sampled_from([3, 4, 12]))

    def placed(points):
        return (np.array(points, dtype=float) @ turn + shift).round(digits).tolist()

    return {
        "probe": {
            "shape": "drawing",
            "thickness_um": draw(length(0.1, 2)),
            "tip_um": placed([(long + front / 2, 0)])[0],
        },
        "layers": {"silicon": [placed(silicon)], "heater": [placed(heater)]},
        "terminals": {
            "supply": placed([(0, inner), (0, outer)]),
            "ground": placed([(-1, -outer - 1), (0, -outer), (0, -inner), (-1, -inner + 1)]),
        },
    }


@st.composite
def broken(draw):
    """The same with a corner moved, left out or doubled, or with an outline too many."""
    values = draw(levers())
    part = draw(st.sampled_from(["silicon", "heater"]))
    (outline,) = values["layers"][part]
    where = draw(st.integers(0, len(outline) - 1))
    kind = draw(st.sampled_from(["move", "omit", "double", "swap", "add"]))
    step = [draw(st.sampled_from([-1, 1])) * 10 ** draw(length(-4, 2)) for _ in range(2)]
    shifted_corner = [outline[where][0] + step[0], outline[where][1] + step[1]]
    if kind == "move":
        outline[where] = shifted_corner
    elif kind == "omit":
        del outline[where]
    elif kind == "double":
        outline.insert(where, outline[where])
    elif kind == "swap":
        outline[where - 1], outline[where] = outline[where], outline[where - 1]
    else:
        values["layers"][part].append([outline[where - 1], outline[where], shifted_corner])
    return values


def solved(values, **surroundings):
    """What the lever shows at a bias, None if the drawing is refused in one line."""
    try:
        lever = Lever(Probe.from_sections(values, "probe.toml").with_(**surroundings), COARSE)
        dataset = lever.dataset(lever.solve([0.5]))
    except HotleverError as refused:
        return check_told(str(refused))
    # no silent gap: what goes in comes out
    np.testing.assert_allclose(dataset.ground_current_mA, dataset.current_mA, rtol=1e-6)
    np.testing.assert_allclose(
        dataset.end_heat_mW + dataset.air_heat_mW, dataset.power_mW, rtol=1e-6
    )
    assert dataset.current_mA.item() > 0
    return dataset


def check_told(text):
    assert text
    assert "\n" not in text


few = settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.too_slow])


@few
@given(levers())
def test_valid_drawings_are_solved(values):
    assert solved(values) is not None


@few
@given(broken())
def test_broken_drawings_are_solved_or_refused(values):
    solved(values)


@few
@given(levers(), st.booleans())
@pytest.mark.slow
def test_valid_drawings_are_solved_in_air(values, chip):
    dataset = solved(values, medium="air", chip=chip)
    assert 0 < dataset.air_heat_mW.item() < dataset.power_mW.item()


@few
@given(broken())
def test_broken_drawings_are_solved_in_air_or_refused(values):
    solved(values, medium="air")
