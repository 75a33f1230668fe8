"""The tip: a cone under the heater, and the sample that it may touch.

These are the sections ``[tip]`` and ``[contact]`` of a probe file.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field, field_validator

from hotlever.errors import InputError, excerpt
from hotlever.materials.catalogue import sample_conductivity
from hotlever.records import Record, bounded
from hotlever.types import Array
from hotlever.units import product_conversion, quantity

#: Resistance of an interface (K/mW) that lets no heat through: the tip is out of contact.
OUT_OF_CONTACT = 1e12
#: Half-angle (°) of the bluntest cone.
MOST_HALF_ANGLE_DEG = 80.0


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

    height_um: float = bounded("from the lever's surface to the apex", 0.01, 100)
    half_angle_deg: float = bounded("between the axis and the side", 1, MOST_HALF_ANGLE_DEG, 20.0)
    apex_radius_um: float = bounded("of the flat end", 1e-4, 10, 0.02)
    in_air: bool = Field(
        default=False,
        description="whether its surface gives heat to the air too, if the medium is air",
    )
    kappa: float = bounded(
        "W/(cm K), of the hot tip: how heat comes to its surface; counts with in_air",
        1e-3,
        30,
        0.25,
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
        # the first zero of J₁', the slope of the Bessel function: the slowest sideways mode of a
        # cylinder of radius a dies out as exp(−1.841 z/a) along its axis
        base, power = self.base_radius_um, 1.0 + 1.841184 / self.slope
        radius = np.clip(np.asarray(distance, dtype=float), self.apex_radius_um, base)
        thickening: Array = base / (self.slope * power) * (1.0 - (radius / base) ** power)
        return thickening


#: What is meant where a probe file says nothing of its tip.
EXAMPLE = Tip(height_um=0.7)


# --- in contact ---------------------------------------------------------------------------------


class SampleLayer(NamedTuple):
    """A layer of a sample."""

    material: str  #: as it is written
    kappa: float  #: W m⁻¹ K⁻¹
    thickness_um: float | None  #: None of the last, which has no end


class SampleContact(Record):
    """A sample that the tip touches with its flat end, whose radius is that of the contact.

    The sample is at the base temperature, far from the contact.

    Examples
    --------
    >>> [layer.kappa for layer in SampleContact(sample="polymer, 100nm, SiO2").layers]
    [0.2, 1.38]
    """

    sample: str = Field(
        description="layers from the top, each but the last with its thickness; a material or "
        "its W/(m K)"
    )
    interface_K_per_mW: float = bounded(
        "thermal resistance between apex and sample", 0, OUT_OF_CONTACT, 0.0
    )

    @field_validator("sample")
    @classmethod
    def _sample_has_layers(cls, text: str) -> str:
        try:
            parsed_layers(text, "")
        except InputError as error:
            raise ValueError(str(error).removeprefix(": ")) from None
        return text

    @cached_property
    def layers(self) -> tuple[SampleLayer, ...]:
        """The layers, from the top."""
        return parsed_layers(self.sample, "")


def parsed_layers(text: str, where: str) -> tuple[SampleLayer, ...]:
    """Return the layers of a text such as ``polymer,100nm,silicon``, from the top.

    Raises
    ------
    InputError
        If a material is unknown, or a thickness is missing, impossible or too much.
    """
    parts = [part.strip() for part in text.split(",")]
    materials, thicknesses = parts[::2], parts[1::2]
    for part in materials:
        if not part or length_um(part) is not None:
            raise InputError(
                f"{where}: found '{excerpt(part)}', expected the material of a layer, as in "
                "polymer, 100nm, silicon"
            )
    kappas = [sample_conductivity(part, where) for part in materials]
    lengths: list[float | None] = []
    for material, part in zip(materials, thicknesses, strict=False):
        length = length_um(part)
        if length is None or not 1e-4 <= length <= 1e4:
            raise InputError(
                f"{where}: found '{excerpt(part)}', expected the thickness of {excerpt(material)}, "
                "0.1 nm to 10 mm, such as 100nm"
            )
        lengths.append(length)
    if len(lengths) == len(materials):
        raise InputError(
            f"{where}: nothing under {excerpt(parts[-1])} of {excerpt(materials[-1])}, expected a "
            "material without a thickness"
        )
    return tuple(map(SampleLayer, materials, kappas, [*lengths, None]))


def length_um(text: str) -> float | None:
    """Return a length in µm; None if it is none."""
    value, unit = quantity(text)
    factor = product_conversion(unit, "m") if unit else None
    return None if value is None or factor is None else 1e6 * factor * value


def interface_of(text: str, radius_um: float, where: str) -> float:
    """Return the resistance (K/mW) of an interface, stated by itself or for an area.

    Parameters
    ----------
    text : str
        Such as ``1e7 K/W`` or ``3e-8 m2 K/W``; ``none`` lets no heat through.
    radius_um : float
        Of the contact.
    where : str
        Names it in an error.

    Raises
    ------
    InputError
        If it is neither, or negative.

    Examples
    --------
    >>> interface_of("1e7 K/W", 0.005, "--interface"), interface_of("1e-8 m2K/W", 1.0, "")
    (10000.0, 3.183098861837907)
    """
    value, unit = quantity(text)
    of_all, of_area = product_conversion(unit, "K/W"), product_conversion(unit, "m2 K/W")
    if value is not None and value >= 0 and of_all is not None:
        resistance = 1e-3 * of_all * value
    elif value is not None and value >= 0 and of_area is not None:
        # m² K/W to µm² K/mW
        resistance = 1e9 * of_area * value / (math.pi * radius_um**2)
    else:
        raise InputError(
            f"{where}: found '{excerpt(text)}', expected a resistance such as 1e7 K/W, or for an "
            "area as 1e-8 m2 K/W"
        )
    if resistance > OUT_OF_CONTACT:
        raise InputError(f"{where} {excerpt(text)}: expected at most {1e3 * OUT_OF_CONTACT:g} K/W")
    return resistance
