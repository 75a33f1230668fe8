"""Levers that tests draw with functions of dimensions, where worker processes can import them."""

from __future__ import annotations

from typing import Annotated

from hotlever.probe.drawing import Drawing, Layer, difference, fillet, mirror, rectangle, union
from hotlever.probe.shapes import ThreeLeg

REFERENCE = ThreeLeg.reference()
#: How far windows of low-doped parts stick out (µm).
_BEYOND = 1.0


def three_leg(
    length_um: Annotated[float, "base to front edge"] = REFERENCE.length_um,
    centre_leg_width_um=REFERENCE.centre_leg_width_um,
    outer_leg_width_um=REFERENCE.outer_leg_width_um,
    gap_um=REFERENCE.gap_um,
    bridge_width_um=REFERENCE.bridge_width_um,
    heater_length_um=REFERENCE.heater_length_um,
    heater_width_um=REFERENCE.heater_width_um,
    reader_length_um=REFERENCE.reader_length_um,
    thickness_um=REFERENCE.thickness_um,
) -> Drawing:
    """The reference probe."""
    front = length_um - bridge_width_um
    back = front - heater_length_um
    centre, half = centre_leg_width_um / 2, heater_width_um / 2
    inner = centre + gap_um
    outer = inner + outer_leg_width_um
    reader, reach = 2 / 3 * length_um, reader_length_um / 2
    leg = rectangle(0, inner, front, outer)
    silicon = union(
        rectangle(0, -centre, back, centre),
        rectangle(back, -half, front, half),
        rectangle(front, -outer, length_um, outer),
        leg,
        mirror(leg),
    )
    return Drawing(
        layers={
            "silicon": silicon,
            "heater": rectangle(back, -half - _BEYOND, front, half + _BEYOND),
            "reader": rectangle(reader - reach, -outer - _BEYOND, reader + reach, _BEYOND - inner),
        },
        terminals={
            "supply": [(0, -centre), (0, centre)],
            "ground": [(0, inner), (0, outer)],
            "reader": [(0, -outer), (0, -inner)],
        },
        tip_um=(front - heater_length_um / 2, 0),
        thickness_um=thickness_um,
    )


def pointed(
    length_um=40.0,
    front_um=10.0,
    leg_width_um=5.0,
    slit_um=3.0,
    heater_um=6.0,
    radius_um=1.0,
    hole_radius_um=0.8,
    track_um=0.05,
    thickness_um=0.5,
) -> Drawing:
    """Slanted legs that meet in a rounded front, a hole in one of them, a metal film on the other.

    The borders of its heater are no two parallel lines.
    """
    base, point = leg_width_um + slit_um / 2, length_um + front_um
    outline = [(0, -base), (0, base), (length_um, base * 0.8), (point, 2), (point, -2)]
    outline.append((length_um, -base * 0.8))
    slit = fillet(rectangle(-5, -slit_um / 2, length_um, slit_um / 2), radius_um)
    at = length_um / 3, -base * 0.6
    hole = [(at[0] + hole_radius_um * x, at[1] + hole_radius_um * y) for x, y in _SQUARE]
    silicon = difference(fillet(outline, 1.5, [(point, 2), (point, -2)]), slit, hole)
    window = [(length_um - 3, -3), (point - 4, -heater_um), (point - 4, heater_um)]
    window.append((length_um - 3, 3))
    return Drawing(
        layers={
            "silicon": silicon,
            "heater": difference(window, rectangle(length_um - 4, -0.3, length_um + 1, 0.3)),
            "track": Layer(rectangle(5, slit_um / 2 + 1, 25, base - 2), "gold", track_um),
        },
        terminals={
            "supply": rectangle(-1, -base - 1, 0, -slit_um / 2 + 0.1),
            "ground": rectangle(-1, slit_um / 2 - 0.1, 0, base + 1),
        },
        tip_um=(point - 5, 0),
        thickness_um=thickness_um,
    )


_SQUARE = ((-1, -1), (1, -1), (1, 1), (-1, 1))
GOLD = {"gold": {"kind": "metal-film", "preset": "Au"}}
