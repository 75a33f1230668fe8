"""Raman spectra that are measured, with or without a thermometer."""

from __future__ import annotations

from hotlever.errors import InputError
from hotlever.files import write_text
from hotlever.raman.series import to_csv
from hotlever.tasks.files import draw
from hotlever.tasks.measured_requests import RamanRequest
from hotlever.tasks.reporter import Listener
from hotlever.tasks.thermometry import set_up


def measure_spectra(listener: Listener, request: RamanRequest) -> str:
    """Find the silicon line in spectra and, calibrated, the temperature; return the table.

    Raises
    ------
    InputError
        If there is no spectrum with a line, or no calibration to be saved.
    """
    outputs = request.outputs()
    setup = set_up(listener, request)
    if request.save_calibration is not None and setup.calibration is None:
        raise InputError("--save-calibration: there is no calibration; give --calibrate-from")
    lines, table = setup.measure(request.spectra)
    text = to_csv(table)
    with outputs.together():
        if len(lines) == 1 and setup.calibration is None:
            draw(request.plot, lambda figures: figures.one_spectrum(lines[0]))
        else:
            of = setup.calibration, setup.hot_plate
            draw(request.plot, lambda figures: figures.thermometry(lines, table, *of))
        if request.save_calibration is not None and setup.calibration is not None:
            setup.calibration.save(request.save_calibration)
        if request.output is not None:
            write_text(request.output, text)
    return text
