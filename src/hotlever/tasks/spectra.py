"""Raman spectra that are measured, with or without a thermometer."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from hotlever.errors import InputError
from hotlever.files import Outputs, write_text
from hotlever.raman.series import to_csv
from hotlever.tasks.files import draw
from hotlever.tasks.thermometry import Thermometry


class Files(NamedTuple):
    """What is written: a table (CSV), a figure, and the calibration (JSON)."""

    output: Path | None = None
    plot: Path | None = None
    save_calibration: Path | None = None


def measure_spectra(
    setup: Thermometry, spectra: Sequence[Path], outputs: Outputs, files: Files
) -> str:
    """Find the silicon line in spectra and, calibrated, the temperature; return the table.

    Raises
    ------
    InputError
        If there is no spectrum with a line, or no calibration to be saved.
    """
    if files.save_calibration is not None and setup.calibration is None:
        raise InputError("--save-calibration: there is no calibration; give --calibrate-from")
    lines, table = setup.measure(spectra)
    text = to_csv(table)
    with outputs.together():
        if len(lines) == 1 and setup.calibration is None:
            draw(files.plot, lambda figures: figures.one_spectrum(lines[0]))
        else:
            of = setup.calibration, setup.hot_plate
            draw(files.plot, lambda figures: figures.thermometry(lines, table, *of))
        if files.save_calibration is not None and setup.calibration is not None:
            setup.calibration.save(files.save_calibration)
        if files.output is not None:
            write_text(files.output, text)
    return text
