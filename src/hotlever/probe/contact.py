"""The contact of a tip with a sample (section ``[contact]`` of a probe file)."""

from __future__ import annotations

import math
from functools import cached_property
from typing import NamedTuple

from pydantic import Field, field_validator

from hotlever.errors import InputError, shown
from hotlever.materials.samples import sample_conductivity
from hotlever.records import Record
from hotlever.units import product_conversion, quantity

#: Thickness that a layer may have (µm).
_THINNEST, _THICKEST = 1e-4, 1e4
#: Resistance of an interface (K/mW) that lets no heat through: the tip is out of contact.
OUT_OF_CONTACT = 1e12
#: m² K/W to µm² K/mW.
_PER_AREA = 1e9


class Layer(NamedTuple):
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
    interface_K_per_mW: float = Field(
        default=0.0,
        ge=0,
        le=OUT_OF_CONTACT,
        description="thermal resistance between apex and sample",
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
    def layers(self) -> tuple[Layer, ...]:
        """The layers, from the top."""
        return parsed_layers(self.sample, "")


def parsed_layers(text: str, where: str) -> tuple[Layer, ...]:
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
                f"{where}: found '{shown(part)}', expected the material of a layer, as in "
                "polymer, 100nm, silicon"
            )
    kappas = [sample_conductivity(part, where) for part in materials]
    lengths: list[float | None] = []
    for material, part in zip(materials, thicknesses, strict=False):
        length = length_um(part)
        if length is None or not _THINNEST <= length <= _THICKEST:
            raise InputError(
                f"{where}: found '{shown(part)}', expected the thickness of {shown(material)}, "
                f"{1e3 * _THINNEST:g} nm to {1e-3 * _THICKEST:g} mm, such as 100nm"
            )
        lengths.append(length)
    if len(lengths) == len(materials):
        raise InputError(
            f"{where}: nothing under {shown(parts[-1])} of {shown(materials[-1])}, expected a "
            "material without a thickness"
        )
    return tuple(map(Layer, materials, kappas, [*lengths, None]))


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
    whole = product_conversion(unit, "K/W")
    per_area = product_conversion(unit, "m2 K/W")
    if value is None or value < 0 or (whole is None and per_area is None):
        raise InputError(
            f"{where}: found '{shown(text)}', expected a resistance such as 1e7 K/W, or for an "
            "area as 1e-8 m2 K/W"
        )
    if whole is not None:
        resistance = 1e-3 * whole * value
    else:
        assert per_area is not None
        resistance = _PER_AREA * per_area * value / (math.pi * radius_um**2)
    if resistance > OUT_OF_CONTACT:
        raise InputError(f"{where} {shown(text)}: expected at most {1e3 * OUT_OF_CONTACT:g} K/W")
    return resistance
