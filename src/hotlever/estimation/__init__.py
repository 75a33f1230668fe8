"""Measured data, and fits of the material parameters to them."""

from hotlever.estimation.estimator import fit
from hotlever.estimation.options import FitOptions
from hotlever.estimation.result import Fit, FittedParameter, read_fit
from hotlever.measurement import Measurement, read_measurement

__all__ = [
    "Fit",
    "FitOptions",
    "FittedParameter",
    "Measurement",
    "fit",
    "read_fit",
    "read_measurement",
]
