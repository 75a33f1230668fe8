"""Draw a U-shaped lever with slanted legs: python tools/boron_lever_drawing.py LEVER.dxf"""

from __future__ import annotations

import sys
from itertools import pairwise

import ezdxf
from ezdxf.document import Drawing
from ezdxf.enums import InsertUnits

#: Corners of the upper half (µm): outside from the chip to the round front, and of the slot.
OUTSIDE = [(0.0, 20.0), (52.0, 7.0), (60.0, 1.5)]
SLOT = [(0.0, 12.0), (54.0, 2.0)]
#: Half the length of the heater, which lies across the front.
HALF_HEATER = 1.5
#: Place of the tip on the axis.
TIP = 59.0
#: How far windows and contacts stick out of the lever.
BEYOND = 2.0


def boron_lever() -> Drawing:
    """Return the drawing: lines and an arc whose ends meet, and boxes for the rest."""
    document = ezdxf.new("R2010", units=InsertUnits.Microns)
    space = document.modelspace()

    def line(start: tuple[float, float], end: tuple[float, float]) -> None:
        space.add_line(start, end, dxfattribs={"layer": "SILICON"})

    def box(layer: str, *corners: float) -> None:
        (x0, y0, x1, y1) = corners
        points = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
        space.add_lwpolyline(points, close=True, dxfattribs={"layer": layer})

    for side in (1, -1):
        for corners in (OUTSIDE, SLOT, [OUTSIDE[0], SLOT[0]]):
            for (x0, y0), (x1, y1) in pairwise(corners):
                line((x0, side * y0), (x1, side * y1))
    (x_slot, y_slot), (x_front, y_front) = SLOT[-1], OUTSIDE[-1]
    line((x_slot, -y_slot), (x_slot, y_slot))
    space.add_arc((x_front, 0), y_front, -90, 90, dxfattribs={"layer": "SILICON"})
    window = (x_slot - BEYOND, -HALF_HEATER, x_front + y_front + BEYOND, HALF_HEATER)
    box("HEATER", *window)
    box("SUPPLY", -BEYOND, SLOT[0][1], 0.0, OUTSIDE[0][1])
    box("GROUND", -BEYOND, -OUTSIDE[0][1], 0.0, -SLOT[0][1])
    space.add_text("tip", dxfattribs={"layer": "SILICON"}).set_placement((TIP, 0.0))
    return document


if __name__ == "__main__":
    boron_lever().saveas(sys.argv[1])
