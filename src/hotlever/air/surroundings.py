"""What is around a lever (section ``[surroundings]`` of a probe file).

Everything outside the lever that takes up heat is at the base temperature, so θ = 0 there. A flat
surface is an image: every panel has a mirror panel of opposite density behind it.
"""

from __future__ import annotations

import math
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from hotlever.air.panels import Mirror
from hotlever.materials.air import ATMOSPHERE, temperature_jump_length
from hotlever.records import Record

Medium = Literal["vacuum", "air"]


class Surroundings(Record):
    """What is around a lever: vacuum by default, and free space in air. The rest counts in air.

    Attributes
    ----------
    medium : {"vacuum", "air"}
    surface_gap_um : float or None
        Distance from the lever's lower face, at the tip, to a flat isothermal surface below
        (µm): the tip's height, and what is between tip and surface. None: no surface.
    surface_tilt_deg : float
        Tilt of that surface about the lever's y axis; positive where the base is farther from
        the surface than the front.
    chip : bool
        Whether the chip body that holds the lever takes up heat: a block behind x = 0 with its
        lower face in the plane of the lever's lower face. Without it the legs end in free space.
    accommodation : float or None
        Thermal accommodation coefficient of the surfaces; with it the temperature jumps there
        (`hotlever.materials.air.temperature_jump_length`). None: no jump.
    pressure_mbar : float
        Pressure of the air, which matters to the jump only.
    jump_temperature_K : float
        Temperature of the air at the lever for which the jump length is taken; at the other
        surfaces it is the base temperature.
    """

    medium: Medium = "vacuum"
    surface_gap_um: Annotated[float, Field(gt=0)] | None = None
    surface_tilt_deg: Annotated[float, Field(ge=-45, le=45)] = 0.0
    chip: bool = False
    accommodation: Annotated[float, Field(gt=0, le=1)] | None = None
    pressure_mbar: Annotated[float, Field(gt=0)] = ATMOSPHERE
    jump_temperature_K: Annotated[float, Field(ge=250, le=1700)] = 600.0

    @model_validator(mode="after")
    def _each_value_counts(self) -> Surroundings:
        if self.surface_tilt_deg != 0 and self.surface_gap_um is None:
            raise ValueError("surface_tilt_deg means nothing without surface_gap_um")
        if self.accommodation is None and self.pressure_mbar != ATMOSPHERE:
            raise ValueError(
                "pressure_mbar means nothing without accommodation: the conductivity of dense air "
                "does not depend on the pressure"
            )
        return self

    @classmethod
    def description(cls) -> dict[str, str]:
        """Return what each value is, by key, for the comments of a probe file."""
        return {
            "medium": "vacuum or air; the rest counts in air, all of it at the base temperature",
            "surface_gap_um": "lower face of the lever to a flat surface below, at the tip",
            "surface_tilt_deg": "of that surface; positive: the base is farther away",
            "chip": "whether the chip body behind the legs takes up heat from the air",
            "accommodation": "0 to 1: the air's temperature jumps at surfaces; left out: no jump",
            "pressure_mbar": "of the air; matters only with accommodation",
            "jump_temperature_K": "of the air at the lever, for the length of the jump",
        }

    @property
    def symmetric(self) -> bool:
        """Whether what is above the lever's mid-plane mirrors what is below."""
        return self.surface_gap_um is None and not self.chip

    def jump_length_um(self, temperature_K: float) -> float:
        """Return the jump length (µm) in air of some temperature; 0 without a jump."""
        if self.accommodation is None:
            return 0.0
        length, _ = temperature_jump_length(temperature_K, self.pressure_mbar, self.accommodation)
        return float(length)

    def surface(
        self, tip: tuple[float, float], thickness_um: float, base_temperature_K: float
    ) -> list[Mirror]:
        """Return the mirror of the flat surface; none in free space.

        A jump length g at the surface moves the mirror back by g: θ falls to zero there.
        """
        if self.surface_gap_um is None:
            return []
        tilt = math.radians(self.surface_tilt_deg)
        normal = np.array([-math.sin(tilt), 0.0, math.cos(tilt)])
        below_tip = np.array([*tip, -thickness_um / 2 - self.surface_gap_um])
        point = below_tip - self.jump_length_um(base_temperature_K) * normal
        return [Mirror.in_plane(point, normal, -1.0)]
