"""Made-up silicon spectra of known temperature, to test a thermometer or plan a measurement."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hotlever.raman import anharmonic, lineshape
from hotlever.raman.lineshape import Array
from hotlever.raman.published import BALKANSKI1983


@dataclass(frozen=True)
class Instrument:
    """A spectrometer and its silicon line, as in the measurements of Spieser et al. 2017.

    Attributes
    ----------
    start, stop, step : float
        Axis, cm⁻¹.
    offset : float
        Error of the axis, cm⁻¹.
    counts : float
        Height of the line at room temperature, photons; it falls as the line widens.
    background, slope : float
        Photons at mid-axis, photons per cm⁻¹.
    band : float
        Height of the band of disordered silicon at 482 cm⁻¹, photons at 300 K; it grows
        in proportion to temperature.
    spike_rate : float
        Mean number of cosmic rays per spectrum.
    gain, read_noise : float
        Counts per photon, and standard deviation of the read-out, counts.
    resolution : float
        FWHM of the Gaussian response, cm⁻¹.
    fano : float
        Asymmetry 1/q.
    """

    start: float = 440.0
    stop: float = 600.0
    step: float = 0.527
    offset: float = 0.4
    counts: float = 850.0
    background: float = 95.0
    slope: float = 0.05
    band: float = 16.0
    spike_rate: float = 1.0
    gain: float = 1.0
    read_noise: float = 0.0
    resolution: float = 0.0
    fano: float = 0.0


def line_centre(temperature: float) -> float:
    """Centre of silicon's line, cm⁻¹, by the published constants of Balkanski's law."""
    zero = BALKANSKI1983.bare + BALKANSKI1983.three_phonon + BALKANSKI1983.four_phonon
    return zero + float(anharmonic.shift(temperature, 0.0)[0])


def line_width(temperature: float) -> float:
    """Typical full width at half maximum of silicon's line, cm⁻¹: 3 at 300 K, 9 at 1150 K."""
    return float(0.6 + 1.4 * anharmonic.terms(temperature)[0])


def true_line(
    temperature: float, instrument: Instrument | None = None
) -> tuple[float, float, float]:
    """Centre (cm⁻¹), width (cm⁻¹) and area (counts cm⁻¹) of the line in `spectrum`."""
    it = instrument or Instrument()
    width = line_width(temperature)
    height = it.gain * it.counts * line_width(300.0) / width
    area = 0.5 * np.pi * height * width * (1.0 - it.fano**2)
    return line_centre(temperature) + it.offset, width, area


def spectrum(
    temperature: float, rng: np.random.Generator, instrument: Instrument | None = None
) -> tuple[Array, Array]:
    """One noisy spectrum of silicon at a known temperature.

    Parameters
    ----------
    temperature : float
        K.
    rng : numpy.random.Generator
    instrument : Instrument, optional

    Returns
    -------
    x, y : (n,) arrays
        Raman shift (cm⁻¹) and counts.

    Examples
    --------
    >>> x, y = spectrum(300.0, np.random.default_rng(0), Instrument(spike_rate=0.0))
    >>> bool(abs(x[y.argmax()] - 522.2) < 1.0)
    True
    """
    it = instrument or Instrument()
    x = np.arange(it.start, it.stop, it.step)
    width, cold = line_width(temperature), line_width(300.0)
    unit, _ = lineshape.line(
        x,
        line_centre(temperature) + it.offset,
        width,
        it.fano,
        it.resolution * lineshape.SIGMA_PER_FWHM,
    )
    photons = it.counts * cold / width * unit
    photons += it.background + it.slope * (x - x.mean())
    photons += it.band * temperature / 300.0 * lineshape.band(x, 482.0, 23.0)[0]
    y = it.gain * rng.poisson(np.maximum(photons, 0.0)) + it.read_noise * rng.normal(size=x.size)
    for _ in range(rng.poisson(it.spike_rate)):
        at = int(rng.integers(x.size - 1))
        height = it.gain * float(rng.uniform(300.0, 6000.0))
        y[at] += height
        # some hit two neighbours
        if rng.random() < 0.3:
            y[at + 1] += height * float(rng.random())
    return x, y
