"""Draw the reference probe.

python tools/reference_drawing.py src/hotlever/examples/reference-probe.gds
"""

from __future__ import annotations

import sys
from datetime import datetime

import gdstk

from hotlever import Probe

#: Layer of each part, and how far the windows of the low-doped parts stick out (µm).
SILICON, LOW_DOPED, CONTACTS = (
    1,
    {"heater": 2, "reader": 3},
    {"supply": 10, "ground": 11, "reader": 12},
)
BEYOND = 1.0
#: Tenths of a nanometre: the heater is 1.645 µm wide, half of which is no whole nanometre.
PRECISION = 1e-10


def reference_library() -> gdstk.Library:
    """Return the reference probe as a cell LEVER."""
    layout = Probe.reference().layout()
    library = gdstk.Library("reference probe", unit=1e-6, precision=PRECISION)
    cell = library.new_cell("LEVER")
    for region in layout.regions:
        cell.add(gdstk.Polygon(region.outline, layer=SILICON))
        if region.name in LOW_DOPED:
            (x0, y0), (x1, y1) = region.box.tolist()
            window = (x0, y0 - BEYOND), (x1, y1 + BEYOND)
            cell.add(gdstk.rectangle(*window, layer=LOW_DOPED[region.name]))
    for terminal in layout.terminals:
        (x, y), end = terminal.start, terminal.end
        cell.add(gdstk.rectangle((x - BEYOND, y), end, layer=CONTACTS[terminal.name]))
    cell.add(gdstk.Label("tip", layout.tip, layer=SILICON))
    return library


if __name__ == "__main__":
    reference_library().write_gds(sys.argv[1], timestamp=datetime(2017, 5, 3))
