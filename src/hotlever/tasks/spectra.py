"""Raman spectra that are measured, with or without a thermometer, and what follows from them."""

from __future__ import annotations

from pathlib import Path

from hotlever.errors import InputError
from hotlever.files import json_text, write_text
from hotlever.raman.series import to_csv
from hotlever.raman.tables import join, read_bias_log
from hotlever.tasks.files import draw
from hotlever.tasks.measured_requests import JoinRequest, RamanCheckRequest, RamanRequest
from hotlever.tasks.reporter import Reporter
from hotlever.tasks.thermometry import calibration_named, set_up


def measure_spectra(reporter: Reporter, request: RamanRequest) -> None:
    """Find the silicon line in spectra and, calibrated, the temperature.

    Raises
    ------
    InputError
        If there is no spectrum with a line, or no calibration to be saved.
    """
    outputs = request.outputs()
    setup = set_up(reporter, request)
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
    _answer(reporter, text, request.output)


def join_spectra(reporter: Reporter, request: JoinRequest) -> None:
    """Join a bias log with tip spectra into a measurement file.

    Raises
    ------
    InputError
        If there is no thermometer, or log and spectra do not belong together.
    """
    outputs = request.outputs()
    log = read_bias_log(request.bias_log)
    setup = set_up(reporter, request)
    if setup.thermometer is None:
        raise InputError("join needs temperatures: give --calibration or --calibrate-from")
    _, table = setup.measure(request.spectra)
    missing = table.file.values[table.temperature_K.isnull().values]
    if missing.size:
        reporter.note(f"no temperature from {', '.join(missing)}: empty cells")
    text = join(log, table)
    if request.output is not None:
        with outputs.together():
            write_text(request.output, text)
    _answer(reporter, text, request.output)


def check_linear_law(reporter: Reporter, request: RamanCheckRequest) -> None:
    """Say how far the paper's linear law of Raman shifts is off above 900 K."""
    from hotlever.studies.raman_check import conclusion, paper_check

    outputs = request.outputs()
    check = paper_check(calibration_named(request.calibration))
    said = conclusion(check)
    with outputs.together():
        draw(request.plot, lambda figures: figures.raman_check(check))
        if request.output is not None:
            lines = check.drop_dims("temperature_K").to_dataframe().rename_axis("name")
            numbers = {"truth": check.truth, "hottest_K": check.hottest_K}
            numbers |= {"lines": lines.reset_index().to_dict("records"), "conclusion": said}
            write_text(request.output, json_text(numbers))
    reporter.give(f"{said}\n")


def _answer(reporter: Reporter, text: str, output: Path | None) -> None:
    """Give the table, or say where it was written."""
    if output is None:
        reporter.give(text)
    else:
        reporter.tell(f"wrote {output}")
