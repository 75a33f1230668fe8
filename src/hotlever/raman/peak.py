"""What is found in a spectrum (the silicon line), and how it may be asked for."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal, get_args

import numpy as np

from hotlever.errors import InputError, unknown_name
from hotlever.raman import lineshape
from hotlever.raman.lineshape import Array

Shape = Literal["lorentzian", "voigt", "fano"]

WINDOW = (440.0, 600.0)
"""Part of the spectrum that is fitted, cm⁻¹: the line from 0 K to silicon's melting point
with background on both sides, clear of the 2TA (300 cm⁻¹) and 2TO (950 cm⁻¹) bands."""
LINE_RANGE = (475.0, 535.0)
"""Where a silicon line can be, cm⁻¹."""
MIN_SAMPLES = 12
"""Fewer samples than this in the window are no spectrum to fit."""


class NoSiliconLine(InputError):
    """There is no silicon line in the spectrum."""


@dataclass(frozen=True)
class PeakOptions:
    """How to fit the line.

    Attributes
    ----------
    shape : {"lorentzian", "voigt", "fano"}
        "voigt" adds the spectrometer's Gaussian response, "fano" the asymmetry of heavily
        doped silicon. A resolution given with "fano" convolves the Fano line too.
    resolution : float, optional
        FWHM of the spectrometer's response, cm⁻¹. Left out with "voigt", it is fitted.
    band : bool
        Whether a broad band on the low side may be added to the model.
    """

    shape: Shape = "lorentzian"
    resolution: float | None = None
    band: bool = True

    def validate(self) -> PeakOptions:
        """Return self, or raise InputError naming the option at fault."""
        if self.shape not in get_args(Shape):
            raise unknown_name("line shape", str(self.shape), get_args(Shape))
        if self.resolution is not None:
            if not (math.isfinite(self.resolution) and 0 < self.resolution < 50):
                raise InputError(
                    f"resolution: found {self.resolution:g}, expected a width in cm⁻¹ "
                    "between 0 and 50"
                )
            if self.shape == "lorentzian":
                raise InputError(
                    "resolution: a Lorentzian has none; use the shape 'voigt' (or 'fano')"
                )
        return self


@dataclass(frozen=True)
class Band:
    """The broad band under or beside the line (Gaussian): cm⁻¹, cm⁻¹, counts."""

    centre: float
    fwhm: float
    height: float


@dataclass(frozen=True)
class Peak:
    """The fitted silicon line.

    Attributes
    ----------
    centre, centre_stderr : float
        cm⁻¹.
    fwhm, fwhm_stderr : float
        Full width of the Lorentzian, free of the spectrometer's response where that is part
        of the model, cm⁻¹.
    area, area_stderr : float
        Counts · cm⁻¹.
    height : float
        Of the Lorentzian, counts.
    background, slope : float
        At `origin`, counts, and counts per cm⁻¹.
    fano, fano_stderr : float
        Asymmetry 1/q; 0 unless fitted.
    resolution : float
        FWHM of the spectrometer's response in the model, cm⁻¹; 0 is none.
    band : Band or None
        The low-side band, if the data asked for one.
    misfit : float
        Residual variance over the variance of neighbouring differences: 1 where noise is
        all that is left.
    samples : int
        Samples fitted.
    spikes : tuple of float
        Positions of the samples left out as cosmic rays, cm⁻¹.
    clipped : (float, float) or None
        Ends of the flat top that was left out, cm⁻¹.
    flags : tuple of str
        Of "cosmic-ray", "saturated", "low-shoulder", "low-band", "edge", "coarse", "misfit".
    """

    centre: float
    centre_stderr: float
    fwhm: float
    fwhm_stderr: float
    area: float
    area_stderr: float
    height: float
    background: float
    slope: float
    origin: float
    fano: float = 0.0
    fano_stderr: float = 0.0
    resolution: float = 0.0
    band: Band | None = None
    misfit: float = 1.0
    samples: int = 0
    spikes: tuple[float, ...] = ()
    clipped: tuple[float, float] | None = None
    flags: tuple[str, ...] = field(default=())

    def model(self, x: Array) -> Array:
        """The whole fitted curve at `x` (cm⁻¹), counts."""
        x = np.asarray(x, dtype=float)
        sigma = self.resolution * lineshape.SIGMA_PER_FWHM
        value = self.height * lineshape.line(x, self.centre, self.fwhm, self.fano, sigma)[0]
        value = value + self.baseline(x)
        if self.band is not None:
            value += self.band.height * lineshape.band(x, self.band.centre, self.band.fwhm)[0]
        return np.asarray(value)

    def baseline(self, x: Array) -> Array:
        """The sloping background at `x` (cm⁻¹), counts."""
        return np.asarray(self.background + self.slope * (np.asarray(x) - self.origin))


def observed_width(lorentzian: float, gaussian: float) -> float:
    """FWHM of a Voigt line from those of its parts, to 0.02 % (Olivero and Longbothum 1977).

    Examples
    --------
    >>> round(observed_width(3.0, 0.0), 3), observed_width(0.0, 2.0)
    (3.0, 2.0)
    """
    return 0.5346 * lorentzian + math.sqrt(0.2166 * lorentzian**2 + gaussian**2)
