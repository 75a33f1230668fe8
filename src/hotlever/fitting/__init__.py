"""Measured data, and fits of the material parameters to them."""

from hotlever.fitting.estimation import fit
from hotlever.fitting.measurement import Measurement, read_measurement
from hotlever.fitting.options import FitOptions
from hotlever.fitting.result import Fit, FittedParameter, read_fit

__all__ = [
    "Fit",
    "FitOptions",
    "FittedParameter",
    "Measurement",
    "fit",
    "read_fit",
    "read_measurement",
]
