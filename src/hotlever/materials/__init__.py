"""Material laws, the doping profile, and the published parameter sets."""

from hotlever.materials.kind import Kind
from hotlever.materials.kinds import KINDS
from hotlever.materials.parameters import (
    HIGH_DOPED,
    LOW_DOPED,
    PARAMETERS,
    Parameter,
    full_name,
)
from hotlever.materials.presets import PUBLISHED, REFERENCE, Material, published

__all__ = [
    "HIGH_DOPED",
    "KINDS",
    "LOW_DOPED",
    "PARAMETERS",
    "PUBLISHED",
    "REFERENCE",
    "Kind",
    "Material",
    "Parameter",
    "full_name",
    "published",
]
