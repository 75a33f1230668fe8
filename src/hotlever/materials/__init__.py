"""Material laws, the doping profile, and the published parameter sets."""

from hotlever.materials.kinds import KINDS, Kind
from hotlever.materials.material import (
    HIGH_DOPED,
    LOW_DOPED,
    PARAMETERS,
    Material,
    full_name,
    parameter,
)
from hotlever.materials.parameters import Parameter

__all__ = [
    "HIGH_DOPED",
    "KINDS",
    "LOW_DOPED",
    "PARAMETERS",
    "Kind",
    "Material",
    "Parameter",
    "full_name",
    "parameter",
]
