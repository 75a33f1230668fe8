"""The tip: a cone under the heater."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field

from hotlever.records import Record
from hotlever.types import Array

#: First zero of J₁', the slope of the Bessel function: the slowest sideways mode of a cylinder
#: of radius a dies out as exp(−1.841 z/a) along its axis.
SIDEWAYS_MODE = 1.841184


class Tip(Record):
    """A cone of silicon that points down from the heater (section ``[tip]`` of a probe file).

    Its doping is that of the heater above it. In the flat lever it thickens the heater; its surface
    in the air is left out, as in the paper, unless `in_air` asks for it. In full 3-D it is a body,
    and its surface is in the air always.

    Examples
    --------
    >>> round(Tip(height_um=0.5, half_angle_deg=45, apex_radius_um=0.02).base_radius_um, 6)
    0.52
    """

    height_um: float = Field(ge=0.01, le=100, description="from the lever's surface to the apex")
    half_angle_deg: float = Field(
        default=20.0, ge=1, le=80, description="between the axis and the side"
    )
    apex_radius_um: float = Field(default=0.02, ge=1e-4, le=10, description="of the flat end")
    in_air: bool = Field(
        default=False,
        description="whether its surface gives heat to the air too, if the medium is air",
    )
    kappa: float = Field(
        default=0.25,
        ge=1e-3,
        le=30,
        description="W/(cm K), of the hot tip: how heat comes to its surface; counts with in_air",
    )

    @property
    def slope(self) -> float:
        """How much radius is lost per height, the tangent of the half-angle."""
        return math.tan(math.radians(self.half_angle_deg))

    @property
    def base_radius_um(self) -> float:
        """Radius where the cone meets the lever (µm)."""
        return self.apex_radius_um + self.height_um * self.slope

    def thickening_um(self, distance: ArrayLike) -> Array:
        """Return what the lever must be thicker to conduct along its plane as with the cone.

        A current along the lever enters the cone only near its base. In a slice of radius a
        its slowest mode dies out as exp(−1.841 z/a); followed through the shrinking slices,
        the share that is left at the radius a is (a/base radius)^(1.841/slope). The thickening
        is this share, integrated over the height of the cone above the point. A flat cone
        counts in full, a steep one with at most 0.54 base radii.

        All in µm: by the distance from the cone's axis, and zero beyond the base.

        A lever takes it at the points of its mesh, some thirty of which are under a cone with a
        base of 0.3 µm: the cone's share is integrated to about 3 %, and how it changes with height
        and angle, in steps as points come under the base, to about 20 %. It is a small share: by
        it twice the height changes the current by less than 1 %.
        """
        base, power = self.base_radius_um, 1.0 + SIDEWAYS_MODE / self.slope
        radius = np.clip(np.asarray(distance, dtype=float), self.apex_radius_um, base)
        thickening: Array = base / (self.slope * power) * (1.0 - (radius / base) ** power)
        return thickening


#: What is meant where a probe file says nothing of its tip.
EXAMPLE = Tip(height_um=0.7)
