"""Made-up silicon spectra of known temperature, to test a thermometer or plan a measurement."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hotlever.raman import anharmonic, lineshape
from hotlever.types import Array


@dataclass(frozen=True)
class Instrument:
    """A spectrometer and its silicon line, as in the measurements of Spieser et al. 2017.

    Photons are those at room temperature; the line falls as it widens, the band, that of disordered
    silicon at 482 cm⁻¹, grows in proportion to temperature.
    """

    start: float = 440.0  # axis, cm⁻¹
    stop: float = 600.0
    step: float = 0.527
    offset: float = 0.4  # error of the axis, cm⁻¹
    counts: float = 850.0  # height of the line, photons
    background: float = 95.0  # photons at mid-axis
    slope: float = 0.05  # photons per cm⁻¹
    band: float = 16.0  # height, photons
    band_centre: float = 482.0  # cm⁻¹
    band_fwhm: float = 23.0  # cm⁻¹
    spike_rate: float = 1.0  # mean number of cosmic rays per spectrum
    gain: float = 1.0  # counts per photon
    read_noise: float = 0.0  # standard deviation, counts
    resolution: float = 0.0  # FWHM of the Gaussian response, cm⁻¹
    fano: float = 0.0  # asymmetry 1/q


def line_centre(temperature: float) -> float:
    """Centre of silicon's line, cm⁻¹, by the published constants of Balkanski's law."""
    zero = anharmonic.BARE + anharmonic.THREE_PHONON + anharmonic.FOUR_PHONON
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
    """One noisy spectrum of silicon at a known temperature (K): Raman shift (cm⁻¹) and counts.

    Examples
    --------
    >>> x, y = spectrum(300.0, np.random.default_rng(0), Instrument(spike_rate=0.0))
    >>> bool(abs(x[y.argmax()] - 522.2) < 1.0)
    True
    """
    it = instrument or Instrument()
    x = np.arange(it.start, it.stop, it.step)
    centre, width, _ = true_line(temperature, it)
    sigma = it.resolution * lineshape.SIGMA_PER_FWHM
    height = it.counts * line_width(300.0) / width
    photons = height * lineshape.line(x, centre, width, it.fano, sigma)[0]
    photons += it.background + it.slope * (x - x.mean())
    photons += it.band * temperature / 300.0 * lineshape.band(x, it.band_centre, it.band_fwhm)[0]
    y = it.gain * rng.poisson(np.maximum(photons, 0.0)) + it.read_noise * rng.normal(size=x.size)
    for _ in range(rng.poisson(it.spike_rate)):
        at = int(rng.integers(x.size - 1))
        hit = it.gain * float(rng.uniform(300.0, 6000.0))
        y[at] += hit
        # some hit two neighbours
        if rng.random() < 0.3:
            y[at + 1] += hit * float(rng.random())
    return x, y
