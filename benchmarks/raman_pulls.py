"""Are the standard errors of the line honest? Pulls of synthetic spectra.

Spectra of silicon from 295 to 1150 K with the paper's photon counts, cosmic rays, a sloping
background and the band of disordered silicon are fitted; a pull is (fitted − true)/standard
error, and its width is 1 where errors are honest. Target: within 10 %, and no failed fit. The
peer is what the paper did: an unweighted Lorentzian on a flat background (lmfit).

On coarser axes one line of 400 K is fitted that differs by noise and where its pixels lie, without
a band beside it, with a faint one and with a strong one, each by itself and all together.
Run: python benchmarks/raman_pulls.py [COUNT]
"""

from __future__ import annotations

import sys
from dataclasses import dataclass

import lmfit
import numpy as np

import synthetic_spectra as synthetic
from hotlever.errors import InputError
from hotlever.raman import PeakOptions, fit_peak, measure
from hotlever.raman.spectrum import Spectrum
from synthetic_spectra import Instrument


@dataclass(frozen=True)
class Case:
    name: str
    instrument: Instrument
    options: PeakOptions


CASES = (
    Case("paper's counts, 1 spike each", Instrument(), PeakOptions()),
    Case("3 spikes each", Instrument(spike_rate=3.0), PeakOptions()),
    Case("no band", Instrument(band=0.0), PeakOptions()),
    Case("ten times the counts", Instrument(counts=8500.0), PeakOptions()),
    Case("gain 3, read noise 10", Instrument(gain=3.0, read_noise=10.0), PeakOptions()),
    Case(
        "response 1.5 cm-1, Voigt",
        Instrument(counts=2000.0, resolution=1.5),
        PeakOptions(shape="voigt", resolution=1.5),
    ),
    Case("1/q = -0.05, Fano", Instrument(fano=-0.05), PeakOptions(shape="fano")),
)


def pulls(case: Case, count: int, seed: int = 2017) -> tuple[np.ndarray, int]:
    """Pulls of centre, width and area, (spectra, 3), and the number of failed fits."""
    rng = np.random.default_rng(seed)
    deviations, failed = [], 0
    for _ in range(count):
        temperature = float(rng.uniform(295.0, 1150.0))
        x, y = synthetic.spectrum(temperature, rng, case.instrument)
        centre, fwhm, area = synthetic.true_line(temperature, case.instrument)
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


def peer(case: Case, count: int, seed: int = 2017) -> np.ndarray:
    """Pulls of the centre by an unweighted Lorentzian on a constant."""
    rng = np.random.default_rng(seed)
    model = lmfit.models.LorentzianModel() + lmfit.models.ConstantModel()
    deviations = []
    for _ in range(count):
        temperature = float(rng.uniform(295.0, 1150.0))
        x, y = synthetic.spectrum(temperature, rng, case.instrument)
        centre, _, _ = synthetic.true_line(temperature, case.instrument)
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


def on_coarse_axes() -> None:
    """Print how honest the errors are of one line in many spectra."""
    print(f"\n{ALIKE} spectra of one line: rms of the pulls, within one and two standard errors")
    print(f"{'pixel':>6}{'band':>8}{'rms':>8}{'1 s':>6}{'2 s':>6}{'beside':>8}{'failed':>8}")
    every = {"by itself": list[float](), "together": list[float]()}
    for pixel in PIXELS:
        for name, band in SHOULDERS.items():
            rng, spectra = np.random.default_rng(5), []
            for number in range(ALIKE):
                instrument = Instrument(
                    start=440.0 + pixel * rng.random(),
                    step=pixel,
                    counts=1400.0,
                    background=300.0,
                    gain=30.0,
                    band=band,
                    band_centre=511.0,
                    band_fwhm=16.0,
                    spike_rate=0.0,
                    resolution=1.5 * pixel,
                )
                spectra.append(Spectrum(*synthetic.spectrum(400.0, rng, instrument), str(number)))
            centre, _, _ = synthetic.true_line(400.0, instrument)
            by_itself = [measure([spectrum])[0].peak for spectrum in spectra]
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


def main(count: int = 1000) -> None:
    print(f"{count} spectra each; width of the pulls (target 0.90 to 1.10), worst |pull|, failures")
    print(f"{'case':<32}{'centre':>8}{'fwhm':>8}{'area':>8}{'bias':>8}{'worst':>8}{'failed':>8}")
    for case in CASES:
        deviations, failed = pulls(case, count)
        width = deviations.std(axis=0)
        print(
            f"{case.name:<32}{width[0]:8.3f}{width[1]:8.3f}{width[2]:8.3f}"
            f"{deviations[:, 0].mean():8.3f}{np.abs(deviations[:, 0]).max():8.1f}{failed:8d}"
        )
    print("\nthe peer's centre; its median |pull| would be 0.67")
    few = max(count // 10, 10)
    for case in (CASES[0], Case("no spikes", Instrument(spike_rate=0.0), PeakOptions())):
        deviations = np.abs(peer(case, few))
        name = f"lmfit, {case.name} ({few})"
        print(
            f"{name:<42} median |pull| {np.median(deviations):6.2f}   worst {deviations.max():8.1f}"
        )
    on_coarse_axes()


if __name__ == "__main__":
    main(*(int(word) for word in sys.argv[1:]))
