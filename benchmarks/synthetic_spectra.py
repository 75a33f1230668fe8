"""Made-up silicon spectra of known temperature, and how well and how fast their line is found.

    python benchmarks/synthetic_spectra.py pulls [COUNT]
    python benchmarks/synthetic_spectra.py odd [SEEDS]
    python benchmarks/synthetic_spectra.py speed [COUNT]

pulls  Are the standard errors of the line honest? Spectra of silicon from 295 to 1150 K with the
       paper's photon counts, cosmic rays, a sloping background and the band of disordered silicon
       are fitted; a pull is (fitted − true)/standard error, and its width is 1 where errors are
       honest. Target: within 10 %, and no failed fit. The peer is what the paper did: an unweighted
       Lorentzian on a flat background (lmfit). On coarser axes one line of 400 K is fitted that
       differs by noise and where its pixels lie, without a band beside it, with a faint one and
       with a strong one, each by itself and all together.
odd    Spectra unlike those of the paper: right, flagged, refused, or wrong without a word? Pixels
       of 0.3 to 3.5 cm⁻¹, lines of 3 to 25 cm⁻¹, bands, slopes, cosmic rays, laser lines, clipped
       tops, weak and strong lines, other materials, axes that descend or are in nm. Counts are
       lines that are integrated over each pixel, with photon noise, written to a file and read as
       the command does. Beside the answer stands a plain fit by scipy of the shape that was drawn,
       begun at the true place. A place is right if it is off by less than three standard errors,
       flagged if a flag warns of it; what has no silicon line is to be refused. With other seeds
       the noise is another one: of a thousand honest places three are off by more than three
       standard errors.
speed  Time to read and fit 1 000 spectra, written as two-column text and read back. Target: under
       10 s.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path

import lmfit
import numpy as np
from scipy.optimize import curve_fit
from scipy.special import voigt_profile

from hotlever.errors import InputError
from hotlever.raman import (
    PeakOptions,
    anharmonic,
    fit_peak,
    lineshape,
    measure,
    read_spectra,
    read_spectrum,
)
from hotlever.raman.spectrum import Spectrum
from hotlever.types import Array
from problems import table


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


# --- pulls ---------------------------------------------------------------------------------------


@dataclass(frozen=True)
class PullCase:
    name: str
    instrument: Instrument
    options: PeakOptions


PULL_CASES = (
    PullCase("paper's counts, 1 spike each", Instrument(), PeakOptions()),
    PullCase("3 spikes each", Instrument(spike_rate=3.0), PeakOptions()),
    PullCase("no band", Instrument(band=0.0), PeakOptions()),
    PullCase("ten times the counts", Instrument(counts=8500.0), PeakOptions()),
    PullCase("gain 3, read noise 10", Instrument(gain=3.0, read_noise=10.0), PeakOptions()),
    PullCase(
        "response 1.5 cm-1, Voigt",
        Instrument(counts=2000.0, resolution=1.5),
        PeakOptions(shape="voigt", resolution=1.5),
    ),
    PullCase("1/q = -0.05, Fano", Instrument(fano=-0.05), PeakOptions(shape="fano")),
)


def pulls(case: PullCase, count: int, seed: int = 2017) -> tuple[np.ndarray, int]:
    """Pulls of centre, width and area, (spectra, 3), and the number of failed fits."""
    rng = np.random.default_rng(seed)
    deviations, failed = [], 0
    for _ in range(count):
        temperature = float(rng.uniform(295.0, 1150.0))
        x, y = spectrum(temperature, rng, case.instrument)
        centre, fwhm, area = true_line(temperature, case.instrument)
        try:
            peak = fit_peak(x, y, case.options)
        except InputError:
            failed += 1
            continue
        deviations.append(
            [
                (peak.centre - centre) / peak.centre_stderr,
                (peak.fwhm - fwhm) / peak.fwhm_stderr,
                (peak.area - area) / peak.area_stderr,
            ]
        )
    return np.array(deviations), failed


def peer(case: PullCase, count: int, seed: int = 2017) -> np.ndarray:
    """Pulls of the centre by an unweighted Lorentzian on a constant."""
    rng = np.random.default_rng(seed)
    model = lmfit.models.LorentzianModel() + lmfit.models.ConstantModel()
    deviations = []
    for _ in range(count):
        temperature = float(rng.uniform(295.0, 1150.0))
        x, y = spectrum(temperature, rng, case.instrument)
        centre, _, _ = true_line(temperature, case.instrument)
        start = model.make_params(
            center=x[y.argmax()], sigma=2.0, amplitude=6.0 * np.ptp(y), c=np.median(y)
        )
        result = model.fit(y, start, x=x)
        if result.params["center"].stderr:
            deviations.append(
                (result.params["center"].value - centre) / result.params["center"].stderr
            )
    return np.array(deviations)


PIXELS = (0.5, 1.0, 1.5, 2.0, 2.8, 3.0)  # cm⁻¹
SHOULDERS = {"none": 0.0, "faint": 45.0, "strong": 260.0}  # height, photons
ALIKE = 80  # spectra of one line


def spectra_of_one_line(
    count: int, *, band: float, step: float = 2.8, seed: int = 1, kelvin: float = 400.0
) -> tuple[list[Spectrum], float]:
    """Return spectra of the same line, on pixels that lie elsewhere each time, and its place."""
    rng, spectra = np.random.default_rng(seed), []
    for number in range(count):
        instrument = Instrument(
            start=440.0 + step * rng.random(),
            step=step,
            counts=1400.0,
            background=300.0,
            gain=30.0,
            band=band,
            band_centre=511.0,
            band_fwhm=16.0,
            spike_rate=0.0,
            resolution=1.5 * step,
        )
        spectra.append(Spectrum(*spectrum(kelvin, rng, instrument), str(number)))
    return spectra, true_line(kelvin, instrument)[0]


def on_coarse_axes() -> None:
    """Print how honest the errors are of one line in many spectra."""
    print(f"\n{ALIKE} spectra of one line: rms of the pulls, within one and two standard errors")
    print(f"{'pixel':>6}{'band':>8}{'rms':>8}{'1 s':>6}{'2 s':>6}{'beside':>8}{'failed':>8}")
    every = {"by itself": list[float](), "together": list[float]()}
    for pixel in PIXELS:
        for name, band in SHOULDERS.items():
            spectra, centre = spectra_of_one_line(ALIKE, band=band, step=pixel, seed=5)
            by_itself = [measure([each])[0].peak for each in spectra]
            together = [line.peak for line in measure(spectra)]
            for way, peaks in zip(every, (by_itself, together), strict=True):
                there = [peak for peak in peaks if peak is not None]
                pulls = np.array([(peak.centre - centre) / peak.centre_stderr for peak in there])
                every[way] += pulls.tolist()
                beside = sum(peak.band is not None for peak in there)
                print(
                    f"{pixel:6.1f}{name:>8}{summary(pulls)}{beside:8d}"
                    f"{ALIKE - len(there):8d}  {way}"
                )
    for way, values in every.items():
        print(f"{'all':>14}{summary(np.array(values))}  {way}")


def summary(pulls: np.ndarray) -> str:
    within = (np.mean(np.abs(pulls) < limit) for limit in (1.0, 2.0))
    return f"{np.sqrt(np.mean(pulls**2)):8.2f}" + "".join(f"{share:6.0%}" for share in within)


def pulls_of_cases(count: int = 1000) -> None:
    print(f"{count} spectra each; width of the pulls (target 0.90 to 1.10), worst |pull|, failures")
    print(f"{'case':<32}{'centre':>8}{'fwhm':>8}{'area':>8}{'bias':>8}{'worst':>8}{'failed':>8}")
    for case in PULL_CASES:
        deviations, failed = pulls(case, count)
        width = deviations.std(axis=0)
        print(
            f"{case.name:<32}{width[0]:8.3f}{width[1]:8.3f}{width[2]:8.3f}"
            f"{deviations[:, 0].mean():8.3f}{np.abs(deviations[:, 0]).max():8.1f}{failed:8d}"
        )
    print("\nthe peer's centre; its median |pull| would be 0.67")
    few = max(count // 10, 10)
    for case in (PULL_CASES[0], PullCase("no spikes", Instrument(spike_rate=0.0), PeakOptions())):
        deviations = np.abs(peer(case, few))
        name = f"lmfit, {case.name} ({few})"
        print(
            f"{name:<42} median |pull| {np.median(deviations):6.2f}   worst {deviations.max():8.1f}"
        )
    on_coarse_axes()


# --- odd spectra ---------------------------------------------------------------------------------

#: Flags that tell a user to doubt the place of the line.
WARNING = {"saturated", "misfit", "edge", "coarse", "band-in-doubt"}
WRONG = "WRONG WITHOUT A WORD"
SIGMAS = 3.0
PARTS = 15  # of a pixel, over which a line is integrated
LASER_NM = 532.0


@dataclass(frozen=True)
class Line:
    """A Voigt line: cm⁻¹, counts."""

    centre: float
    lorentzian: float = 3.2
    gaussian: float = 0.0
    height: float = 2000.0

    def counts(self, x: np.ndarray, pitch: float) -> np.ndarray:
        """Return the mean over each pixel."""
        return voigt(x, pitch, self.centre, self.lorentzian, self.gaussian, self.height)


def voigt(
    x: np.ndarray, pitch: float, centre: float, lorentzian: float, gaussian: float, height: float
) -> np.ndarray:
    """Return a Voigt line of a height, integrated over pixels."""
    inside = pitch * ((np.arange(PARTS) + 0.5) / PARTS - 0.5)
    sigma, half = abs(gaussian) / 2.3548200450309493, 0.5 * abs(lorentzian)
    profile = voigt_profile(x[:, None] + inside - centre, sigma, half).mean(axis=1)
    return np.asarray(height * profile / voigt_profile(0.0, sigma, half))


@dataclass(frozen=True)
class Case:
    name: str
    silicon: Line | None
    pitch: float = 0.5
    start: float = 440.0
    stop: float = 600.0
    background: float = 100.0
    slope: float = 0.0  # counts per cm⁻¹
    curved: float = 0.0  # counts at the ends
    bands: tuple[tuple[float, float, float], ...] = ()  # Gaussian: cm⁻¹, cm⁻¹, counts
    others: tuple[Line, ...] = ()  # of lasers, or another material
    spikes: tuple[float, ...] = ()  # places of cosmic rays
    clip: float = np.inf
    read_noise: float = 0.0
    gain: float = 1.0
    written: str = "ascending"  # or "descending", "nm", "nm, descending"
    seed: int = 7

    def spectrum(self) -> tuple[np.ndarray, np.ndarray]:
        """Raman shift (cm⁻¹) and counts."""
        rng = np.random.default_rng(self.seed)
        x = np.arange(self.start, self.stop, self.pitch)
        photons = self.background + self.slope * (x - x[0])
        photons = photons + self.curved * ((x - x.mean()) / (x[-1] - x.mean())) ** 2
        for line in (self.silicon, *self.others):
            if line is not None:
                photons = photons + line.counts(x, self.pitch)
        for centre, fwhm, height in self.bands:
            photons = photons + height * np.exp(-4 * np.log(2) * ((x - centre) / fwhm) ** 2)
        y = self.gain * rng.poisson(photons / self.gain) + self.read_noise * rng.normal(size=x.size)
        for place in self.spikes:
            y[np.argmin(np.abs(x - place))] += 4.0 * photons.max()
        return x, np.minimum(y, self.clip)

    def text(self) -> str:
        """Return the spectrum as a file holds it."""
        x, y = self.spectrum()
        head = "# Raman shift (cm-1)\tcounts\n"
        if self.written.startswith("nm"):
            x = 1e7 / (1e7 / LASER_NM - x)
            head = f"# Laser (nm)= {LASER_NM:g}\n# Wavelength (nm)\tcounts\n"
        if self.written.endswith("descending"):
            x, y = x[::-1], y[::-1]
        return head + "".join(f"{a:.5f}\t{b:.2f}\n" for a, b in zip(x, y, strict=True))

    def plain_fit(self) -> tuple[float, float] | None:
        """Return place and standard error by scipy, of the shape that was drawn; None without."""
        if self.silicon is None:
            return None
        line = self.silicon
        x, y = self.spectrum()
        keep = y < self.clip
        for place in self.spikes:
            keep &= np.abs(x - place) > 0.6 * self.pitch
        x, y = x[keep], y[keep]
        for other in self.others:
            y = y - other.counts(x, self.pitch)
        free = [line.centre, line.lorentzian, line.height, self.background, self.slope, self.curved]
        free += [height for _, _, height in self.bands]

        def model(at: np.ndarray, *p: float) -> np.ndarray:
            u = (at - 0.5 * (self.start + self.stop)) / 80.0
            value = voigt(at, self.pitch, p[0], p[1], line.gaussian, p[2])
            value = value + p[3] + p[4] * u + (p[5] * u**2 if self.curved else 0.0)
            for (centre, fwhm, _), height in zip(self.bands, p[6:], strict=True):
                value = value + height * np.exp(-4 * np.log(2) * ((at - centre) / fwhm) ** 2)
            return np.asarray(value)

        if not self.curved:
            # a parameter that does nothing would leave no covariance
            few = [0, 1, 2, 3, 4, *range(6, len(free))]

            def of_few(at: np.ndarray, *p: float) -> np.ndarray:
                return model(at, *p[:5], 0.0, *p[5:])

            best, covariance = curve_fit(
                of_few, x, y, np.array(free)[few], sigma=np.sqrt(np.maximum(y, 1.0)), maxfev=20000
            )
        else:
            best, covariance = curve_fit(
                model, x, y, free, sigma=np.sqrt(np.maximum(y, 1.0)), maxfev=20000
            )
        return float(best[0]), float(np.sqrt(covariance[0, 0]))


SILICON = Line(520.7)
CASES = (
    # pixels and widths
    Case("fine axis", SILICON, pitch=0.3),
    Case("0.5 cm-1 a pixel", SILICON),
    Case("1 cm-1 a pixel", Line(519.3, 3.5, 1.0), pitch=1.0),
    Case("1.5 cm-1 a pixel", Line(518.2, 3.4, 2.5), pitch=1.5),
    Case("2 cm-1 a pixel", Line(520.4, 3.2, 4.0, 20000.0), pitch=2.0),
    Case("2.8 cm-1 a pixel", Line(520.4, 3.2, 6.0, 40000.0), pitch=2.8, gain=30.0),
    Case("3.5 cm-1 a pixel", Line(521.1, 3.2, 8.0, 40000.0), pitch=3.5, gain=10.0),
    Case("3.5 cm-1 a pixel, narrow line", Line(521.1, 3.2, 2.0, 40000.0), pitch=3.5),
    Case("3.5 cm-1 a pixel, few counts", Line(519.1, 3.2, 8.0, 400.0), pitch=3.5),
    Case("line of 6 cm-1", Line(512.0, 6.0, 0.0, 1500.0)),
    Case("line of 12 cm-1, 0.8 a pixel", Line(505.0, 12.0, 0.0, 1500.0), pitch=0.8),
    Case("line of 15 cm-1, 2.8 a pixel", Line(519.0, 15.0, 0.0, 20000.0), pitch=2.8),
    Case("line of 20 cm-1", Line(515.0, 20.0, 0.0, 3000.0)),
    Case("line of 25 cm-1, 2 a pixel", Line(516.0, 25.0, 0.0, 9000.0), pitch=2.0),
    Case("Gaussian of 7 cm-1, 1 a pixel", Line(520.0, 2.0, 7.0, 5000.0), pitch=1.0),
    Case("Gaussian of 12 cm-1, 3 a pixel", Line(520.0, 2.0, 12.0, 30000.0), pitch=3.0),
    # a band beside the line
    Case("band at 482", Line(514.0, 4.5), bands=((482.0, 23.0, 300.0),)),
    Case("faint band at 482", Line(514.0, 4.5), bands=((482.0, 23.0, 30.0),)),
    Case("strong band, weak line", Line(505.0, 8.0, 0.0, 500.0), bands=((482.0, 25.0, 600.0),)),
    Case("shoulder at 508", Line(516.0, 4.0, 0.0, 4000.0), bands=((508.0, 10.0, 500.0),)),
    Case(
        "shoulder, 2.8 a pixel",
        Line(520.4, 5.0, 3.0, 40000.0),
        pitch=2.8,
        gain=30.0,
        bands=((512.0, 16.0, 9000.0),),
    ),
    Case(
        "faint shoulder, 2.8 a pixel",
        Line(520.4, 5.0, 3.0, 40000.0),
        pitch=2.8,
        gain=30.0,
        bands=((512.0, 16.0, 3000.0),),
    ),
    Case(
        "large shoulder, 2.8 a pixel",
        Line(519.6, 6.0, 0.0, 34000.0),
        pitch=2.8,
        gain=30.0,
        background=9000.0,
        bands=((514.0, 17.0, 13000.0),),
    ),
    Case(
        "band at 482, 2 a pixel",
        Line(512.0, 5.0, 3.0, 9000.0),
        pitch=2.0,
        bands=((482.0, 25.0, 1500.0),),
    ),
    Case("shoulder, 1.5 a pixel", Line(518.0, 4.0, 2.0), 1.5, bands=((510.0, 14.0, 500.0),)),
    Case("microcrystals at 510", SILICON, bands=((510.0, 12.0, 900.0), (482.0, 40.0, 300.0))),
    # backgrounds
    Case("steep slope", SILICON, slope=20.0),
    Case("falling slope", SILICON, background=4000.0, slope=-20.0),
    Case("curved luminescence", SILICON, background=2000.0, curved=1500.0),
    Case("far above zero", SILICON, background=50000.0),
    Case("subtracted background", SILICON, background=0.5),
    # cosmic rays, lines of lasers and lamps
    Case("cosmic ray beside", SILICON, spikes=(500.0,)),
    Case("cosmic ray on the line", SILICON, spikes=(521.0,)),
    Case("five cosmic rays", SILICON, spikes=(455.0, 480.0, 516.0, 526.0, 560.0)),
    Case("cosmic ray, 2 a pixel", Line(520.7, 3.2, 4.0, 5000.0), pitch=2.0, spikes=(490.0,)),
    Case("cosmic ray on it, 2 a pixel", Line(520.7, 3.2, 4.0, 5000.0), 2.0, spikes=(522.0,)),
    Case("laser line at 545", SILICON, others=(Line(545.0, 0.3, 0.8, 800.0),)),
    Case("laser line at 490", Line(518.0, 3.6), others=(Line(490.0, 0.3, 0.8, 700.0),)),
    Case("stronger laser line at 560", SILICON, others=(Line(560.0, 0.3, 0.8, 9000.0),)),
    Case("laser line on the flank", SILICON, others=(Line(527.0, 0.3, 0.8, 500.0),)),
    # the detector
    Case("clipped top", Line(520.7, 4.0, 0.0, 30000.0), clip=12000.0),
    Case("clipped, 1 a pixel", Line(520.7, 4.0, 2.0, 60000.0), pitch=1.0, clip=20000.0),
    Case("clipped, 2.8 a pixel", Line(520.4, 4.0, 6.0, 90000.0), pitch=2.8, clip=50000.0),
    Case("60 counts", Line(516.0, 4.5, 0.0, 60.0), background=40.0),
    Case("25 counts", Line(510.0, 6.0, 0.0, 25.0), background=40.0),
    Case("ten million counts", Line(520.7, 3.2, 0.0, 1e7), background=1e4),
    Case("read noise", Line(517.0, 4.0, 0.0, 300.0), read_noise=25.0),
    Case("end of the axis", SILICON, stop=524.0),
    Case("line cut by the end", SILICON, stop=521.3),
    # axes
    Case("descending axis", Line(515.3, 4.2), written="descending"),
    Case("axis in nm", Line(515.3, 4.2), written="nm"),
    Case("axis in nm, descending", Line(515.3, 4.2, 2.0), pitch=1.2, written="nm, descending"),
    # two lines
    Case("two lines, 519 and 523", Line(523.0, 2.0), others=(Line(519.0, 2.0, 0.0, 1400.0),)),
    Case("hot and cold spot", Line(520.7, 3.2), others=(Line(505.0, 6.0, 0.0, 700.0),)),
    Case("a line above", Line(518.0, 3.5), others=(Line(533.0, 3.0, 0.0, 900.0),)),
    Case("two lines, 2.8 a pixel", Line(520.5, 4.0, 4.0, 9000.0), 2.8, others=(Line(508.0, 6.0),)),
    # no silicon
    Case("nothing", None),
    Case("slope alone", None, slope=5.0),
    Case("amorphous silicon alone", None, bands=((478.0, 70.0, 800.0),)),
    Case("luminescence alone", None, bands=((520.0, 120.0, 3000.0),)),
    Case("a cosmic ray alone", None, spikes=(510.0,)),
    Case("a cosmic ray alone, 2.8 a pixel", None, pitch=2.8, spikes=(510.0,)),
    Case("ceria alone", None, others=(Line(465.0, 9.0, 0.0, 4000.0),)),
    Case("a line at 559 alone", None, others=(Line(559.0, 6.0, 0.0, 4000.0),)),
)


@dataclass(frozen=True)
class Answer:
    verdict: str
    centre: float = np.nan
    error: float = np.nan
    flags: tuple[str, ...] = ()


def judge(case: Case, folder: Path) -> Answer:
    """Read and fit a spectrum as the command does."""
    path = folder / "spectrum.txt"
    path.write_text(case.text(), encoding="utf-8")
    try:
        (line,) = measure(read_spectra([path]))
    except InputError:
        return Answer("refused")
    peak = line.peak
    if peak is None:
        return Answer("refused")
    found = peak.centre, peak.centre_stderr, peak.flags
    right = case.silicon and abs(peak.centre - case.silicon.centre) < SIGMAS * peak.centre_stderr
    if right:
        return Answer("right", *found)
    return Answer("flagged" if WARNING & {*peak.flags} else WRONG, *found)


def odd(seeds: int = 0) -> None:
    rows, counts = [], Counter[str]()
    with tempfile.TemporaryDirectory() as folder:
        for case in CASES:
            answer, fit = judge(case, Path(folder)), case.plain_fit()
            refused = answer.verdict == "refused"
            verdict = "right to refuse" if refused and case.silicon is None else answer.verdict
            counts[verdict] += 1
            row = [case.name]
            row.append(f"{case.silicon.centre:.2f}" if case.silicon else "none")
            row.append(f"{fit[0]:.2f} ± {fit[1]:.2f}" if fit else "")
            row.append("" if refused else f"{answer.centre:.2f} ± {answer.error:.2f}")
            rows.append([*row, verdict, ", ".join(answer.flags)])
        table(("spectrum", "line", "scipy", "found", "verdict", "flags"), rows)
        print(f"\n{len(CASES)} spectra: {', '.join(f'{n} {what}' for what, n in counts.items())}")
        of_seeds = Counter(
            judge(replace(case, seed=seed), Path(folder)).verdict
            for case in CASES
            for seed in range(seeds)
        )
    if seeds:
        print(f"with {seeds} seeds: {', '.join(f'{n} {what}' for what, n in of_seeds.items())}")


# --- speed ---------------------------------------------------------------------------------------

TARGET = 10.0


def speed(count: int = 1000) -> None:
    rng = np.random.default_rng(2017)
    with tempfile.TemporaryDirectory() as name:
        files = []
        for i in range(count):
            x, y = spectrum(float(rng.uniform(295.0, 1150.0)), rng)
            file = Path(name) / f"tip_{i}.txt"
            np.savetxt(file, np.stack([x, y], axis=1), fmt="%.3f\t%.1f")
            files.append(file)
        started = time.perf_counter()
        spectra = [read_spectrum(file) for file in files]
        reading = time.perf_counter() - started
    print(f"{count} spectra of {spectra[0].x.size} samples")
    print(f"{'step':<24}{'seconds':>9}{'ms each':>9}{'with reading':>14}{'target':>8}")
    print(f"{'reading':<24}{reading:9.2f}{1e3 * reading / count:9.2f}")
    for shape in ("lorentzian", "voigt", "fano"):
        options = PeakOptions(shape=shape)
        started = time.perf_counter()
        for one in spectra:
            fit_peak(one.x, one.y, options)
        fitting = time.perf_counter() - started
        print(
            f"{'fit, ' + shape:<24}{fitting:9.2f}{1e3 * fitting / count:9.2f}"
            f"{reading + fitting:14.2f}{TARGET:8.1f}"
        )


if __name__ == "__main__":
    what, *words = sys.argv[1:] or ["pulls"]
    {"pulls": pulls_of_cases, "odd": odd, "speed": speed}[what](*map(int, words))
