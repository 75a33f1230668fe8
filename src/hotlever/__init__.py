"""Joule-heated silicon cantilever probes: how hot is the tip, and how sure are we?

A `Probe` (shape, `Material`, `Circuit`, surroundings) makes a `Lever`, which is solved over a range
of bias. `read_measurement` reads what an instrument measured, `fit` finds the material that
explains it, `calibrate` gives the tip temperature with its error. Raman spectra become temperatures
with `read_spectra`, `calibrate_from` and `Thermometer`. `figures` draws all of it.
"""

from __future__ import annotations

from importlib import import_module
from importlib.metadata import version
from typing import Any

__version__ = version("hotlever")

#: What the package offers at its top, by the module it lives in. Loaded when first used, so that
#: the command line starts fast.
_MODULES = {
    "hotlever.probe": ("Probe", "Circuit", "MeshOptions"),
    "hotlever.materials": ("Material", "published"),
    "hotlever.lever": ("Lever", "Branch", "sweep", "read_sweep", "write_sweep"),
    "hotlever.lever.transient": ("simulate",),
    "hotlever.estimation": ("Measurement", "read_measurement", "FitOptions", "fit", "read_fit"),
    "hotlever.calibration": ("calibrate", "read_calibration", "PowerLaw", "read_power_law"),
    "hotlever.raman": (
        *("read_spectra", "measure", "read_lines", "Thermometer"),
        *("calibrate_from", "read_raman_calibration", "published_raman_calibration"),
    ),
    "hotlever.errors": ("HotleverError", "InputError", "ComputationError", "BranchEndError"),
    "hotlever.figures": ("save_figure",),
}
_PUBLIC = {name: module for module, names in _MODULES.items() for name in names}

__all__ = ["__version__", "figures", *_PUBLIC]


def __getattr__(name: str) -> Any:
    if name == "figures":
        return import_module("hotlever.figures")
    if name not in _PUBLIC:
        raise AttributeError(f"module 'hotlever' has no attribute {name!r}")
    return getattr(import_module(_PUBLIC[name]), name)


def __dir__() -> list[str]:
    return sorted(__all__)
