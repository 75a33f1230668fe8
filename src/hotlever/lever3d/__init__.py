"""The full three-dimensional simulation: a lever of its true thickness, in still air.

The silicon uses the equations of `hotlever.lever` on tetrahedra; the air is solved by NGSolve,
the extra ``hotlever[air3d]``.
"""

from hotlever.lever3d.solid_lever import SolidLever
from hotlever.lever3d.still_air import OpenAir

__all__ = ["OpenAir", "SolidLever"]
