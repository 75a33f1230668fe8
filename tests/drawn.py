"""Drawings that tests make: the reference probe and others, as files and as lists of points."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import ezdxf
import gdstk
import numpy as np
from reference_drawing import PRECISION, reference_library

from hotlever.probe import Probe

TIP = Probe.reference().layout().tip
ANGLE, SHIFT = np.pi / 6, (120.0, -35.0)
LAYERS = {"silicon": "1/0", "heater": "2/0", "reader": "3/0"}
TERMINALS = {"supply": "10/0", "ground": "11/0", "reader": "12/0"}


def turned(points: Any) -> np.ndarray:
    """Places (2, n) turned by `ANGLE` and moved by `SHIFT`."""
    c, s = np.cos(ANGLE), np.sin(ANGLE)
    return np.array([[c, -s], [s, c]]) @ points + np.reshape(SHIFT, (2, 1))


def written(path: Path, library: gdstk.Library | None = None, *, turn: bool = False) -> Path:
    """Write a library, the reference probe's by default, as GDSII or OASIS."""
    library = library or reference_library()
    if turn:
        (cell,) = library.top_level()
        library.new_cell("WAFER").add(gdstk.Reference(cell, SHIFT, rotation=ANGLE))
    if path.suffix == ".oas":
        library.write_oas(path)
    else:
        library.write_gds(path)
    return path


def library_of(*cells: gdstk.Cell) -> gdstk.Library:
    library = gdstk.Library("made by a test", unit=1e-6, precision=PRECISION)
    library.add(*cells)
    return library


def drawn(file: Path | str, tip: Any = TIP, **values: Any) -> Probe:
    """The reference probe of a file; `values` for the section [probe]."""
    shape = {"shape": "drawing", "file": str(file), "thickness_um": 0.4, **values}
    shape["tip_um"] = [float(one) for one in tip]
    sections = {"probe": shape, "layers": LAYERS, "terminals": TERMINALS}
    return Probe.from_sections(sections, "test")


def box(x0: float, y0: float, x1: float, y1: float) -> list[list[float]]:
    return [[x0, y0], [x1, y0], [x1, y1], [x0, y1]]


def reference_points() -> dict[str, dict[str, Any]]:
    """The reference probe as lists of points; its silicon is five boxes."""
    return {
        "probe": {"shape": "drawing", "thickness_um": 0.4, "tip_um": list(TIP)},
        "layers": {
            "silicon": [
                box(0, -3.22, 46.58, 3.22),
                box(46.58, -0.8225, 50.58, 0.8225),
                box(50.58, -9.88, 54.4, 9.88),
                box(0, 6.42, 50.58, 9.88),
                box(0, -9.88, 50.58, -6.42),
            ],
            "heater": box(46.58, -2, 50.58, 2),
            "reader": box(34, -11, 38, -6),
        },
        "terminals": {
            "supply": [[0.0, -3.22], [0.0, 3.22]],
            "ground": [[0.0, 6.42], [0.0, 9.88]],
            "reader": [[0.0, -9.88], [0.0, -6.42]],
        },
    }


def pointed_lever(path: Path, unit_um: float = 1.0) -> Path:
    """Two slanted legs and a rounded front, in DXF: lines whose ends meet, an arc, a hole."""
    document = ezdxf.new("R2010")
    document.units = {1.0: 13, 1000.0: 4}[unit_um]
    space = document.modelspace()
    outer = [(0, 20), (44, 7), (54, 2)]
    inner = [(0, 12), (42, 2)]

    def at(x: float, y: float) -> tuple[float, float]:
        return x / unit_um, y / unit_um

    for sign in (1, -1):
        for line in (outer, inner, [outer[0], inner[0]]):
            for (x0, y0), (x1, y1) in pairwise(line):
                ends = at(x0, sign * y0), at(x1, sign * y1)
                space.add_line(*ends, dxfattribs={"layer": "SI"})
    space.add_line(at(42, -2), at(42, 2), dxfattribs={"layer": "SI"})
    space.add_arc(at(54, 0), 2 / unit_um, -90, 90, dxfattribs={"layer": "SI"})
    space.add_circle(at(8, 14.5), 1 / unit_um, dxfattribs={"layer": "SI"})
    window = [at(*corner) for corner in box(41, -1.5, 60, 1.5)]
    space.add_lwpolyline(window, close=True, dxfattribs={"layer": "HEATER"})
    space.add_line(at(0, 12), at(0, 20), dxfattribs={"layer": "V+"})
    pad = document.blocks.new("PAD")
    pad.add_lwpolyline([at(*corner) for corner in box(-2, -1, 0, 9)], close=True)
    space.add_blockref("PAD", at(0, -20), dxfattribs={"layer": "GND"})
    document.saveas(path)
    return path


def pointed_sections(path: Path, unit_um: float = 1.0) -> dict[str, dict[str, Any]]:
    """A probe file's sections of the pointed lever, whose drawing is written."""
    file = str(pointed_lever(path, unit_um))
    return {
        "probe": {"shape": "drawing", "file": file, "thickness_um": 0.4, "tip_um": [50.0, 0.0]},
        "layers": {"silicon": "SI", "heater": "HEATER"},
        "terminals": {"supply": "V+", "ground": "GND"},
    }
