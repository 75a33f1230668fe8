"""Raman thermometry: from silicon's spectra to the tip temperature with its error.

Section III of Spieser et al. 2017. A spectrum (`spectrum`) is fitted for its line (`fit`,
`peak`); a hot-plate series gives a calibration (`calibration`); a thermometer (`thermometer`)
turns line positions into temperatures; `check` asks what the paper's linear law does above the
hot plate's range.
"""

from hotlever.raman.calibration import Calibration, Point, calibrate, load, published
from hotlever.raman.check import paper_check
from hotlever.raman.fit import fit_peak
from hotlever.raman.peak import NoSiliconLine, Peak, PeakOptions
from hotlever.raman.series import calibrate_from, measure, read_lines
from hotlever.raman.spectrum import Spectrum, read_spectra, read_spectrum
from hotlever.raman.thermometer import Thermometer, laser_heating

__all__ = [
    "Calibration",
    "NoSiliconLine",
    "Peak",
    "PeakOptions",
    "Point",
    "Spectrum",
    "Thermometer",
    "calibrate",
    "calibrate_from",
    "fit_peak",
    "laser_heating",
    "load",
    "measure",
    "paper_check",
    "published",
    "read_lines",
    "read_spectra",
    "read_spectrum",
]
