"""Tip, contact and sample in one picture, whose lengths lie decades apart.

Heights above and below the contact, and radii, are drawn as asinh(length/r), r the radius of the
contact: in proportion near it, by their logarithm far from it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hotlever.contact.law import contact_of
from hotlever.probe import Probe
from hotlever.probe.tip import SampleContact
from hotlever.types import Array


@dataclass(frozen=True)
class ContactPicture:
    """What is drawn of a tip in contact; heights and widths are of the picture.

    Attributes
    ----------
    pieces : list of (corners, float)
        Lever, cone, and what is under the contact along its axis, with temperatures (K).
    outlines : list of corners
        Lines around lever and cone, and between the layers.
    layers : list of (str, float, float)
        Name and thickness, top and bottom; a layer too thin for its name has it in the next one's.
    ticks : list of (float, str)
        Heights, and their lengths in words.
    height, temperature_K : ndarray
        From the lever down along the axis.
    apex : int
        Place of the flat end in these; the next one is the surface of the sample.
    half_width, bottom, top : float
    """

    pieces: list[tuple[list[tuple[float, float]], float]]
    outlines: list[list[tuple[float, float]]]
    layers: list[tuple[str, float, float]]
    ticks: list[tuple[float, str]]
    height: Array
    temperature_K: Array
    apex: int
    half_width: float
    bottom: float
    top: float


def contact_picture(probe: Probe, tip_K: float) -> ContactPicture:
    """Return the picture of a probe in contact, by the temperature of the tip at the lever."""
    tip, contact, law = probe.tip, probe.contact, contact_of(probe)
    assert tip is not None
    assert contact is not None
    assert law is not None
    end = tip.apex_radius_um

    def coordinate(length_um: Array | float) -> Array:
        return np.asarray(np.arcsinh(np.asarray(length_um) / end))

    films = sum(layer.thickness_um or 0.0 for layer in contact.layers)
    # the sample is shown as deep as 30 radii, or three times its films, whichever is more
    deepest = max(30.0 * end, 3.0 * films)
    slices = 40
    down = end * np.sinh(np.linspace(0.0, float(coordinate(deepest)), slices + 1))
    down[0] = 1e-3 * end  # at the surface itself the depth has no logarithm
    height, cone_K, under_K = law.along_axis(tip_K, down)
    up = np.linspace(float(coordinate(tip.height_um)), 0.0, slices + 1)
    along_K = np.interp(up, coordinate(height), cone_K)
    half = coordinate(end + tip.slope * end * np.sinh(up))
    below = -coordinate(down)
    below[0] = 0.0
    # wide enough for names beside the contact
    width = max(3.0, 1.2 * float(half[0]))
    low = float(up[0])
    top = low + 0.7
    bar = [(-width, low), (width, low), (width, top), (-width, top)]
    column = np.full_like(below, float(coordinate(end)))
    pieces = [
        (bar, tip_K),
        *_slices(up, half, along_K),
        *_slices(below, column, under_K),
    ]
    edges = np.cumsum([0.0, *(layer.thickness_um or deepest for layer in contact.layers)])
    floors = -coordinate(np.minimum(edges, deepest))
    sides = [
        [(way * float(x), float(y)) for x, y in zip(half, up, strict=True)] for way in (-1.0, 1.0)
    ]
    level = [[(-width, y), (width, y)] for y in floors.tolist()]
    return ContactPicture(
        pieces,
        [*sides, [*bar, bar[0]], *level],
        _named(contact, floors.tolist()),
        _ticks(end, tip.height_um, deepest),
        np.concatenate([up, below]),
        np.concatenate([along_K, under_K]),
        slices,
        width,
        float(floors[-1]),
        top,
    )


def _named(contact: SampleContact, floors: list[float]) -> list[tuple[str, float, float]]:
    """Return the names of layers that are thick enough for theirs, with top and bottom."""
    named, above = [], ""
    for layer, top, bottom in zip(contact.layers, floors, floors[1:], strict=False):
        thick = "" if layer.thickness_um is None else f", {_length(layer.thickness_um)}"
        name = f"{above}{layer.material}{thick}"
        # a layer that is thinner in the picture has no room for its name
        above = f"{name} on\n" if top - bottom < 0.4 else ""
        named.append(("" if above else name, top, bottom))
    return named


def _slices(
    heights: Array, halves: Array, T: Array
) -> list[tuple[list[tuple[float, float]], float]]:
    """Return slices between heights, each of its mean temperature."""
    slices = []
    for number in range(heights.size - 1):
        # each reaches below the next one, so that no gap shows between them
        lower = min(number + 2, heights.size - 1)
        (high, low), (wide, narrow) = heights[[number, lower]], halves[[number, lower]]
        corners = [(-wide, high), (wide, high), (narrow, low), (-narrow, low)]
        outline = [(float(x), float(y)) for x, y in corners]
        slices.append((outline, float(T[number : number + 2].mean())))
    return slices


def _ticks(end_um: float, height_um: float, depth_um: float) -> list[tuple[float, str]]:
    """Return lengths of one significant digit above and below the contact, zero among them."""
    ticks = [(0.0, "0")]
    for way, farthest in ((1.0, height_um), (-1.0, depth_um)):
        first = math.ceil(math.log10(end_um))
        for power in range(first, math.floor(math.log10(farthest)) + 1):
            ticks.append((way * math.asinh(10.0**power / end_um), _length(10.0**power)))
    return ticks


def _length(length_um: float) -> str:
    """Return a length in words, nm below a µm."""
    return f"{length_um:.3g} µm" if length_um >= 0.9995 else f"{1e3 * length_um:.3g} nm"
