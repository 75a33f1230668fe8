"""Measured data, and fits of the material parameters to them."""

from hotlever.fitting.fit import Fit, FittedParameter, fit
from hotlever.fitting.measurement import Measurement, read_measurement

__all__ = ["Fit", "FittedParameter", "Measurement", "fit", "read_measurement"]
