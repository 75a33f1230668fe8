"""Raman thermometry: from silicon's spectra to the tip temperature with its error.

Section III of Spieser et al. 2017. A spectrum (`spectrum`) is read from a file (`reading`; `layout`
knows text, `makers` their own formats) and fitted for its line (`lineshape`, `noise`, `fit`), with
what is said of it by hand (`tables`); a hot-plate series (`series`) gives a calibration
(`calibration`); a thermometer (`thermometer`) turns line positions into temperatures.
"""
# ruff: noqa: F401 (what is imported here is what the package offers)

from hotlever.raman.line_fit import fit_peak
from hotlever.raman.lineshape import NoSiliconLine, Peak, PeakOptions
from hotlever.raman.raman_calibration import (
    Point,
    RamanCalibration,
    calibrate_raman,
    published_raman_calibration,
    read_raman_calibration,
)
from hotlever.raman.series import calibrate_from, measure, read_lines
from hotlever.raman.spectrum import Spectrum
from hotlever.raman.spectrum_reading import read_spectra, read_spectrum
from hotlever.raman.spectrum_tables import Correction, read_corrections
from hotlever.raman.thermometer import Thermometer, laser_heating
