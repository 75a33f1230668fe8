"""Probes: shapes, layouts, meshes and the probe file."""

from hotlever.probe.circuit import Circuit, Wiring
from hotlever.probe.layout import Layout, Region, Taper, Terminal
from hotlever.probe.mesh import MeshOptions, ProbeMesh, mesh_layout
from hotlever.probe.probe import Probe
from hotlever.probe.shapes import ThreeLeg, UShape
from hotlever.probe.tip import Tip

__all__ = [
    "Circuit",
    "Layout",
    "MeshOptions",
    "Probe",
    "ProbeMesh",
    "Region",
    "Taper",
    "Terminal",
    "ThreeLeg",
    "Tip",
    "UShape",
    "Wiring",
    "mesh_layout",
]
