"""Joule-heated silicon cantilever probes: how hot is the tip, and how sure are we?"""

from __future__ import annotations

from importlib import import_module
from importlib.metadata import version
from typing import Any

__version__ = version("hotlever")

#: What the package offers at its top, and the module it lives in. Loaded when first used, so
#: that the command line starts fast.
_PUBLIC = {
    "Lever": "hotlever.lever",
    "sweep": "hotlever.lever",
    "read_sweep": "hotlever.lever",
    "write_sweep": "hotlever.lever",
    "Probe": "hotlever.probe",
    "MeshOptions": "hotlever.probe",
    "Material": "hotlever.materials",
    "published": "hotlever.materials.spieser2017",
    "read_measurement": "hotlever.fitting",
    "fit": "hotlever.fitting",
    "save_figure": "hotlever.report.style",
}

__all__ = ["__version__", *_PUBLIC]


def __getattr__(name: str) -> Any:
    if name not in _PUBLIC:
        raise AttributeError(f"module 'hotlever' has no attribute {name!r}")
    return getattr(import_module(_PUBLIC[name]), name)


def __dir__() -> list[str]:
    return sorted(__all__)
