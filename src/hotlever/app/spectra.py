"""Spectra of a project, one by one, as the command measures them. Runs in a worker process."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from hotlever.app.workers import Report
from hotlever.errors import HotleverError, InputError
from hotlever.raman import measure, read_lines
from hotlever.raman.lineshape import WINDOW, in_window
from hotlever.raman.reading import read_file, spectrum_files
from hotlever.raman.series import Line
from hotlever.raman.spectrum import Spectrum
from hotlever.tasks.measured_requests import ThermometerRequest
from hotlever.tasks.reporter import Silence
from hotlever.tasks.thermometry import Thermometry, set_up
from hotlever.types import Array

#: Points of the fitted curve.
_POINTS = 800


def names(report: Report, folders: Sequence[str]) -> list[str]:
    """Return the names of the spectra in some folders of a project, each with its folder."""
    spectra: list[str] = []
    for name in folders:
        # there may be none yet, and other files among them, of which the command says so
        with suppress(InputError):
            for file, _ in spectrum_files([Path(name)]):
                with suppress(InputError, OSError):
                    spectra += (
                        f"{name}/{spectrum}" for spectrum in _names(file, file.stat().st_mtime)
                    )
    return spectra


def measured(report: Report, name: str, asked: dict[str, Any]) -> dict[str, Any]:
    """Return the counts of a spectrum, its fit, and what is read from it, in words.

    Parameters
    ----------
    report : Report
    name : str
        As `names` has it.
    asked : dict
        Of the thermometer: ``calibration``, ``calibrate_from`` and ``corrections`` are files
        or folders, or empty, and ``law`` is one.
    """
    spectrum = _spectrum(name)
    setup, doubt = _setup(asked)
    (line,) = measure([spectrum], setup.options, corrections=setup.corrections)
    table = read_lines([line], setup.thermometer)
    inside = in_window(spectrum.x, "")
    x, y = spectrum.x[inside], spectrum.y[inside]
    low, high = line.window
    curves, heights = [(x, y), *[(x[:0], y[:0])] * 3], _with_room(y)
    if line.peak is not None:
        fine = np.linspace(max(low, x[0]), min(high, x[-1]), _POINTS)
        model = line.peak.model(fine)
        # a cosmic ray may be many times higher than the line
        heights = _with_room(np.append(model, np.percentile(y, (1, 99))))
        hit = np.isin(x, line.peak.spikes)
        marks = x[hit], np.minimum(y[hit], heights[1])
        curves[1:] = [(fine, model), (fine, line.peak.baseline(fine)), marks]
    return {
        "curves": curves,
        "heights": heights,
        "ends": WINDOW,
        "window": line.window,
        "centre": None if line.peak is None else line.peak.centre,
        "text": "; ".join(filter(None, (_summary(line, table), doubt))),
    }


def _with_room(values: Array) -> list[float]:
    """Return the ends of an axis that shows some values."""
    low, high = float(values.min()), float(values.max())
    room = 0.08 * (high - low) or 1.0
    return [low - room, high + room]


def _summary(line: Line, table: Any) -> str:
    """Say what was read from a line, with the digits of the command's table."""
    flags = ", ".join(line.flags)
    if line.peak is None:
        return flags
    peak, T = line.peak, float(table.temperature_K.values[0])
    error = float(table.temperature_error_K.values[0])
    text = f"{peak.centre:.4f} ± {peak.centre_stderr:.4f} cm⁻¹, width {peak.fwhm:.3f} cm⁻¹"
    if np.isfinite(T):
        text += f", {T:.2f} ± {error:.2f} K"
    return f"{text} ({flags})" if flags else text


def _setup(asked: dict[str, Any]) -> tuple[Thermometry, str]:
    """Return the thermometer; one without temperatures, and why, if that cannot be made."""
    by_hand = Path(asked["corrections"]) if asked["corrections"] else None
    options: dict[str, Any] = {"law": asked["law"], "corrections": by_hand}
    calibrated: dict[str, Any] = {}
    if asked["calibration"]:
        calibrated = {"calibration": asked["calibration"]}
    elif asked["calibrate_from"]:
        calibrated = {"calibrate_from": [Path(asked["calibrate_from"])]}
    try:
        return set_up(Silence(), ThermometerRequest(**calibrated, **options)), ""
    except HotleverError as error:
        doubt = f"no temperature: {error}"
    return set_up(Silence(), ThermometerRequest(**options)), doubt


def _spectrum(name: str) -> Spectrum:
    where, _, last = name.rpartition("/")
    for file, _ in spectrum_files([Path(where)]):
        if last == file.name or last.startswith(f"{file.name}["):
            for spectrum in read_file(file):
                if spectrum.name == last:
                    return spectrum
    raise InputError(f"{name}: no such spectrum any more")


@lru_cache(maxsize=5000)
def _names(file: Path, stamp: float) -> list[str]:
    return [spectrum.name for spectrum in read_file(file)]
