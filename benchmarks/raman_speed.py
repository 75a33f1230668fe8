"""Time to read and fit 1 000 silicon spectra. Target: under 10 s.

The spectra are made with the paper's photon counts, written as two-column text and read back.
Run: python benchmarks/raman_speed.py [COUNT]
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import synthetic_spectra as synthetic
from hotlever.raman import PeakOptions, fit_peak, read_spectrum

TARGET = 10.0


def main(count: int = 1000) -> None:
    rng = np.random.default_rng(2017)
    with tempfile.TemporaryDirectory() as name:
        files = []
        for i in range(count):
            x, y = synthetic.spectrum(float(rng.uniform(295.0, 1150.0)), rng)
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
        for spectrum in spectra:
            fit_peak(spectrum.x, spectrum.y, options)
        fitting = time.perf_counter() - started
        print(
            f"{'fit, ' + shape:<24}{fitting:9.2f}{1e3 * fitting / count:9.2f}"
            f"{reading + fitting:14.2f}{TARGET:8.1f}"
        )


if __name__ == "__main__":
    main(*(int(word) for word in sys.argv[1:]))
