"""Layouts that tests of the air make: plates without leg ends, and levers turned on a wafer."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hotlever.materials import LOW_DOPED
from hotlever.probe import Layout, Region, Taper, Terminal


def plate(outline, thickness, holes=()) -> Layout:
    """A plate of one region whose leg end lies far away."""
    outline, *holes = (tuple((float(x), float(y)) for x, y in ring) for ring in (outline, *holes))
    middle = tuple(np.mean(outline, axis=0).tolist())
    taper = Taper(middle, (1.0, 0.0), 1.0)
    region = Region("plate", "heater", outline, taper, tuple(holes), material=LOW_DOPED)
    return Layout((region,), (Terminal("supply", (1e3, 0.0), (1e3, 1.0)),), middle, thickness)


def disc(radius, thickness, corners=96) -> Layout:
    angle = 2 * np.pi * np.arange(corners) / corners
    # as large as the disc
    radius = radius / np.sqrt(np.sinc(2 / corners))
    return plate(radius * np.stack([np.cos(angle), np.sin(angle)], axis=1), thickness)


def turned(layout, angle, shift=(0.0, 0.0)) -> Layout:
    cosine, sine = np.cos(angle), np.sin(angle)

    def at(place):
        x, y = place
        return (cosine * x - sine * y + shift[0], sine * x + cosine * y + shift[1])

    regions = tuple(
        replace(
            one,
            outline=tuple(map(at, one.outline)),
            holes=tuple(tuple(map(at, hole)) for hole in one.holes),
        )
        for one in layout.regions
    )
    terminals = tuple(replace(t, start=at(t.start), end=at(t.end)) for t in layout.terminals)
    return replace(layout, regions=regions, terminals=terminals, tip=at(layout.tip))
