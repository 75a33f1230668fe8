"""The tip's surface as panels, and how heat comes to them through the tip.

The tip is a cone with a flat end. Its panels belong to the places of the lever above them. What a
panel gives to the air comes from there along the cone, in one dimension: its θ is lower than the
lever's by the resistance of the way that its heat has in common with that of every other panel.
"""

from __future__ import annotations

import math

import numpy as np

from hotlever.air.panelling import divided
from hotlever.air.panels import Panels
from hotlever.materials.air import thermal_conductivity_of_air
from hotlever.probe.tip import Tip
from hotlever.types import Array

#: Panels in a ring; at the ends of the side and at the rim of the flat end, as a share of the
#: radius there; and their growth with the distance from these.
_AROUND, _AT_END, _GROWTH = 12, 0.5, 0.5
#: Temperature (K) at which tip and air are taken to conduct: a hot tip's, where it matters most.
HOT_K = 900.0


def cone_panels(cone: Tip, refinement: float = 1.0) -> Panels:
    """Return panels on the side of a cone and on its flat end.

    Its axis is that of z, and it points down from z = 0. The base, where it meets the lever, is
    no surface.

    Parameters
    ----------
    cone : Tip
    refinement : float
        Divides all sizes.
    """
    base, apex, fine = cone.base_radius_um, cone.apex_radius_um, 1.0 / refinement
    length = math.hypot(cone.height_um, base - apex)
    side = _breaks(length, fine * _AT_END * base, fine * _AT_END * apex, fine * _GROWTH)
    end = _breaks(apex, fine * _AT_END * apex, apex, fine * _GROWTH)[1:]
    radius = np.append(base + side * (apex - base), apex * (1.0 - end))
    depth = np.append(side, np.ones(end.size)) * cone.height_um
    return revolved(np.stack([radius, -depth], axis=1), round(_AROUND * refinement))


def _breaks(length: float, first: float, last: float, growth: float) -> Array:
    """Return where panels on a line meet, from 0 to 1, of their sizes (µm) at its ends."""
    # sizes differ by orders of magnitude: they are read at distances that do so too
    away = np.append(0.0, np.geomspace(0.01 * min(first, last, length), length / 2, 400))
    along = np.concatenate([away, length - away[-2::-1]])
    size = np.minimum(first + growth * along, last + growth * (length - along))
    return divided(along / length, size / length)


def revolved(profile: Array, around: int) -> Panels:
    """Return panels on a surface of revolution about the axis of z.

    Parameters
    ----------
    profile : ndarray, shape (k, 2)
        Radius and height (µm) at which rings of panels meet, from one end to the other.
    around : int
        Panels in a ring: a polygon of the area of the circle.
    """
    angle = 2.0 * np.pi * np.arange(around + 1) / around
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1) / np.sqrt(np.sinc(2.0 / around))
    lines = np.empty((len(profile), around + 1, 3))
    lines[..., :2] = profile[:, 0, None, None] * circle
    lines[..., 2] = profile[:, 1, None]
    # of a triangle the last two corners are the same: those on the axis
    from_axis = (profile[:-1, 0] == 0)[:, None, None]
    first = np.where(from_axis, lines[1:], lines[:-1])
    last = np.where(from_axis, lines[:-1], lines[1:])
    corners = np.stack([first[:, :-1], first[:, 1:], last[:, 1:], last[:, :-1]], axis=2)
    return Panels(corners.reshape(-1, 4, 3))


def conduction(cone: Tip, panels: Panels) -> Array:
    """Return by how much θ on `panels` is below that of the lever, per heat from each.

    Between the base and a depth z, where the radius is r, a cone of base radius r₀ has the
    resistance z / (π κ r₀ r). Air and cone conduct as at `HOT_K`.

    Parameters
    ----------
    cone : Tip
    panels : Panels, n
        Of `cone_panels`.

    Returns
    -------
    ndarray, shape (n, n)
        1/µm, symmetric and positive semi-definite.
    """
    depth, base = -panels.centres[:, 2], cone.base_radius_um
    to_panel = depth / (np.pi * base * (base - depth * cone.slope))
    of_air, _ = thermal_conductivity_of_air(HOT_K)
    # what two panels have in common is the way to the nearer one
    return np.asarray(of_air / cone.kappa * np.minimum.outer(to_panel, to_panel))
