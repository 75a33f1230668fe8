"""Raman thermometry: from silicon's spectra to the tip temperature with its error.

Section III of Spieser et al. 2017. A spectrum (`spectrum`) is read from a file (`spectrum_reading`;
`text_layout` knows which parts of a table are spectra) and fitted for its line (`lineshape`,
`detector_noise`, `line_fit`), with what is said of it by hand (`spectrum_tables`); a hot-plate
series (`series`) calibrates the thermometer (`thermometer`) that turns line positions into
temperatures.
"""
# ruff: noqa: F401 (what is imported here is what the package offers)

from hotlever.raman.line_fit import fit_peak
from hotlever.raman.lineshape import NoSiliconLine, Peak, PeakOptions
from hotlever.raman.series import calibrate_from, measure, read_lines
from hotlever.raman.spectrum import Spectrum
from hotlever.raman.spectrum_reading import read_spectra, read_spectrum
from hotlever.raman.spectrum_tables import SpectrumCorrection, read_corrections
from hotlever.raman.thermometer import (
    Point,
    RamanCalibration,
    Thermometer,
    calibrate_raman,
    laser_heating,
    published_raman_calibration,
    read_raman_calibration,
)
