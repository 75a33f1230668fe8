"""What is around a lever, and the physics that counts.

These are the sections ``[surroundings]`` and ``[physics]`` of a probe file. Everything outside the
lever that takes up heat is at the base temperature.
"""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from hotlever.materials.air import ATMOSPHERE, temperature_jump_length
from hotlever.records import Record, bounded

Medium = Literal["vacuum", "air"]


class Surroundings(Record):
    """What is around a lever: vacuum by default, and free space in air. The rest counts in air.

    The surface is isothermal and tilted about the base line, on which the leg ends lie; its gap is
    the tip's height and what is between tip and surface. The chip is a block behind that line
    (`hotlever.air.bodies`).
    The jump is that of `hotlever.materials.air.temperature_jump_length`; at other surfaces than
    the lever's its length is taken at the base temperature.
    """

    medium: Medium = Field(
        default="vacuum",
        description="vacuum or air; the rest counts in air, all of it at the base temperature",
    )
    surface_gap_um: float | None = bounded(
        "lower face of the lever to a flat surface below, at the tip", 0.001, 1e4, None
    )
    surface_tilt_deg: float = bounded(
        "of that surface; positive: the base is farther away", -45, 45, 0.0
    )
    chip: bool = Field(
        default=False,
        description="whether the chip body behind the legs takes up heat from the air",
    )
    accommodation: float | None = bounded(
        "0.01 to 1: the air's temperature jumps at surfaces; left out: no jump", 0.01, 1, None
    )
    gas_conductivity: float = bounded(
        "of the gas, over that of dry air at the same temperature", 0.01, 20, 1.0
    )
    pressure_mbar: float = bounded(
        "of the air; matters only with accommodation", 1e-6, 1e6, ATMOSPHERE
    )
    jump_temperature_K: float = bounded(
        "of the air at the lever, for the length of the jump", 250, 1700, 600.0
    )

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

    @property
    def with_jump(self) -> Surroundings:
        """The same, the accommodation being full where none is stated.

        In a gap that is hardly wider than the mean free path temperatures jump in any case.
        """
        return self.with_(accommodation=self.accommodation or 1.0)

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


class Physics(Record):
    """Effects that the paper leaves out; off unless they are asked for.

    Examples
    --------
    >>> Physics(thermoelectric=True).effects
    ('thermoelectric',)
    """

    thermoelectric: bool = Field(
        default=False, description="heat that the current carries: Seebeck, Peltier and Thomson"
    )
    radiation: bool = Field(default=False, description="heat that the lever's surface radiates")

    @property
    def at_surface(self) -> bool:
        """Whether heat leaves a lever by itself at its surface, as it does by radiation."""
        return self.radiation

    @property
    def effects(self) -> tuple[str, ...]:
        """Those that are on."""
        return tuple(name for name, on in self if on)

    def __bool__(self) -> bool:
        return bool(self.effects)
