"""Material laws, the doping profile, and the published parameter sets."""
# ruff: noqa: F401 (what is imported here is what the package offers)

from hotlever.materials.kinds import KINDS, Kind
from hotlever.materials.parameters import (
    HIGH_DOPED,
    LOW_DOPED,
    PARAMETERS,
    Parameter,
    full_name,
)
from hotlever.materials.presets import PUBLISHED, REFERENCE, Material, published
