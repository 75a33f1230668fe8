"""Probes: shapes, layouts, meshes and the probe file."""
# ruff: noqa: F401 (what is imported here is what the package offers)

from hotlever.probe.circuit import Circuit, Wiring
from hotlever.probe.layout import Layout, Region, Taper, Terminal
from hotlever.probe.mesh import MeshOptions, ProbeMesh, mesh_layout
from hotlever.probe.probe import Probe
from hotlever.probe.shapes import ThreeLeg, UShape
from hotlever.probe.tip import Tip
