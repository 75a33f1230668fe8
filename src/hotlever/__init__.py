"""Joule-heated AFM probes: how hot is the tip, and how sure are we?

probe = Probe.reference()           or Probe.from_file("probe.toml")
lever = Lever(probe)                meshed; lever.in_medium("air")
data = lever.sweep([2, 4, 8])       an xarray.Dataset, such as data.tip_K
(state,) = lever.solve([8.3])       one state, with its fields
simulate(lever, wave, until=100)    in time; see hotlever.lever.transient

read_measurement("iv.csv")          what an instrument measured
fit("iv.csv", probe=probe)          the material that explains it
calibrate("iv.csv", probe=probe)    tip temperatures for what it shows
plan_next(calibration)              what to measure next, how hot it gets
read_spectra, Thermometer           Raman spectra made temperatures

data.hotlever.plot()                the figure of any dataset made here
figures.temperature_map(state)      maps, films, others; see save_figure

Errors are InputError and ComputationError. dir(hotlever) lists all words,
help(hotlever.Lever) explains one. On the command line all of this is
"hotlever --help", and in the browser "hotlever app".
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

__version__ = "3.0.0"

#: What the package offers at its top, by the module it lives in. Loaded when first used, so that
#: the command line starts fast.
_PUBLIC = {
    name: module
    for module, names in {
        "hotlever.probe": ("Probe", "Circuit", "MeshOptions"),
        "hotlever.materials": ("Material", "published"),
        "hotlever.lever": ("Lever", "Branch", "sweep", "read_sweep", "write_sweep"),
        "hotlever.lever.transient": ("simulate",),
        "hotlever.estimate": (
            *("Measurement", "read_measurement", "FitOptions", "fit", "read_fit"),
            *("calibrate", "read_calibration", "plan_next", "PowerLaw", "read_power_law"),
        ),
        "hotlever.raman": (
            *("read_spectra", "measure", "read_lines", "Thermometer"),
            *("calibrate_from", "read_raman_calibration", "published_raman_calibration"),
        ),
        "hotlever.errors": ("HotleverError", "InputError", "ComputationError", "BranchEndError"),
        "hotlever.figures": ("save_figure",),
    }.items()
    for name in names
}


def __getattr__(name: str) -> Any:
    if name == "figures":
        return import_module("hotlever.figures")
    if name not in _PUBLIC:
        raise AttributeError(f"module 'hotlever' has no attribute {name!r}")
    return getattr(import_module(_PUBLIC[name]), name)


def __dir__() -> list[str]:
    return sorted(("__version__", "figures", *_PUBLIC))
