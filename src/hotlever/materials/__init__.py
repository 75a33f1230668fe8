"""Material laws, the doping profile, and the published parameter sets."""

from hotlever.materials.material import PARAMETERS, Material, Parameter, parameter

__all__ = ["PARAMETERS", "Material", "Parameter", "parameter"]
