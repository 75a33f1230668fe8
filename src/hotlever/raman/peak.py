"""What is found in a spectrum (the silicon line), and how it may be asked for."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from hotlever.errors import InputError, counted, unknown_name
from hotlever.raman import lineshape
from hotlever.types import Array, Mask

LineShape = Literal["lorentzian", "voigt", "fano"]

#: Part of the spectrum that is fitted, cm⁻¹: the line from 0 K to silicon's melting point
#: with background on both sides, clear of the 2TA (300 cm⁻¹) and 2TO (950 cm⁻¹) bands.
WINDOW = (440.0, 600.0)
LINE_RANGE = (475.0, 535.0)  #: where a silicon line can be, cm⁻¹
MIN_SAMPLES = 12  #: fewer in the window are no spectrum to fit


class NoSiliconLine(InputError):
    """There is no silicon line in the spectrum."""


@dataclass(frozen=True)
class PeakOptions:
    """How to fit the line.

    The shape "voigt" adds the spectrometer's Gaussian response, "fano" the asymmetry of heavily
    doped silicon. A resolution given with "fano" convolves the Fano line too.
    """

    shape: LineShape = "lorentzian"
    #: FWHM of the spectrometer's response, cm⁻¹. Left out with "voigt", it is fitted.
    resolution: float | None = None
    band: bool = True  #: whether a broad band on the low side may be added to the model
    #: Where the line is, cm⁻¹, near enough for the fit to begin there; left out, it is looked for.
    start: float | None = None
    window: tuple[float, float] = WINDOW  #: part of the spectrum that is fitted, cm⁻¹

    def validate(self) -> PeakOptions:
        """Return self, or raise InputError naming the option at fault."""
        if self.shape not in get_args(LineShape):
            raise unknown_name("line shape", str(self.shape), get_args(LineShape))
        low, high = LINE_RANGE
        if self.start is not None and not low < self.start < high:
            raise InputError(
                f"start: found {self.start:g} cm⁻¹, expected a place between {low:g} and {high:g}, "
                "where silicon's line can be"
            )
        low, high = self.window
        if not WINDOW[0] <= low < high <= WINDOW[1]:
            raise InputError(
                f"window: found {low:g} to {high:g} cm⁻¹, expected a part of {WINDOW[0]:g} to "
                f"{WINDOW[1]:g}"
            )
        if self.resolution is None:
            return self
        if not 0 < self.resolution < 50:
            raise InputError(
                f"resolution: found {self.resolution:g}, expected a width in cm⁻¹ between 0 and 50"
            )
        if self.shape == "lorentzian":
            raise InputError("resolution: a Lorentzian has none; use the shape 'voigt' (or 'fano')")
        return self


@dataclass(frozen=True)
class Band:
    """The broad band under or beside the line (Gaussian): cm⁻¹, cm⁻¹, counts."""

    centre: float
    fwhm: float
    height: float


@dataclass(frozen=True)
class Peak:
    """The fitted silicon line: cm⁻¹, and counts."""

    centre: float
    centre_stderr: float
    fwhm: float  #: of the Lorentzian, free of the spectrometer's response where that is modelled
    fwhm_stderr: float
    area: float  #: counts · cm⁻¹
    area_stderr: float
    height: float  #: of the Lorentzian
    background: float  #: at `origin`
    slope: float  #: of the background, counts per cm⁻¹
    origin: float
    fano: float = 0.0  #: asymmetry 1/q; 0 unless fitted
    fano_stderr: float = 0.0
    resolution: float = 0.0  #: FWHM of the spectrometer's response in the model; 0 is none
    band: Band | None = None  #: on the low side, if the data asked for one
    #: Residual variance over that of neighbours' differences: 1 where only noise is left.
    misfit: float = 1.0
    samples: int = 0  #: fitted
    spikes: tuple[float, ...] = ()  #: places of the samples left out as cosmic rays
    clipped: tuple[float, float] | None = None  #: ends of the flat top that was left out
    #: Of "cosmic-ray", "saturated", "low-shoulder", "low-band", "edge", "coarse", "misfit".
    flags: tuple[str, ...] = ()

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


def in_window(x: Array, where: str, window: tuple[float, float] = WINDOW) -> Mask:
    """Samples of an axis (cm⁻¹) that are fitted; InputError if they are too few."""
    low, high = window
    inside = (x >= low) & (x <= high)
    count = int(np.count_nonzero(inside))
    if count < MIN_SAMPLES:
        raise InputError(
            f"{where}{counted(count, 'sample')} between {low:g} and "
            f"{high:g} cm⁻¹, expected at least {MIN_SAMPLES} around silicon's line"
        )
    return np.asarray(inside)


def observed_width(lorentzian: float, gaussian: float) -> float:
    """FWHM of a Voigt line from those of its parts, to 0.02 % (Olivero and Longbothum 1977).

    Examples
    --------
    >>> round(observed_width(3.0, 0.0), 3), observed_width(0.0, 2.0)
    (3.0, 2.0)
    """
    return 0.5346 * lorentzian + math.sqrt(0.2166 * lorentzian**2 + gaussian**2)
