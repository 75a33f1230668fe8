"""What files of a project say, told in tables, words and figures. Runs in a worker process.

The figures are those of `hotlever.figures`, the pages those of `hotlever.report`.
"""

from __future__ import annotations

import io
import tempfile
import zipfile
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import fields, replace
from functools import lru_cache
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from hotlever.app.probe_fields import figure_file, svg
from hotlever.app.project import file_stamp
from hotlever.app.session import Task, probe_of
from hotlever.app.workers import Report
from hotlever.errors import HotleverError, InputError
from hotlever.estimate import Estimate, read_calibration, read_fit
from hotlever.estimate.many import compare_levers, lever_rows
from hotlever.estimate.summary import parameter_rows
from hotlever.estimate.tip_table import interpolated
from hotlever.files import read_json
from hotlever.lever.transient.waveform import waveform_from_text
from hotlever.measurement import (
    FileColumn,
    file_columns,
    file_groups,
    parse_columns,
    read_measurement,
    read_measurement_of,
    with_measured_circuit,
)
from hotlever.quantities import FITTED
from hotlever.raman import SpectrumCorrection, measure, read_lines, read_spectra
from hotlever.raman.lineshape import WINDOW, in_window
from hotlever.raman.series import MeasuredLine
from hotlever.raman.spectrum import Spectrum
from hotlever.raman.spectrum_reading import read_file, spectrum_files
from hotlever.raman.spectrum_tables import corrections_text
from hotlever.report.report_page import Page
from hotlever.report.result_pages import budget_page, estimate_page
from hotlever.tasks.commands import arguments_of
from hotlever.tasks.spectra import ThermometerOptions, set_up
from hotlever.types import Array


def understood(report: Report, name: str, metadata: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a measurement file was understood as, in its circuit, as it is fitted in.

    Beside it may be told its columns, the file of the probe, the medium, and the pulse that was
    measured.
    """
    probe = probe_of(metadata.get("probe", ""))
    assigned = parse_columns(metadata.get("columns") or [])
    pulse, medium = metadata.get("waveform"), metadata.get("medium")
    waveform = waveform_from_text("pulse", pulse) if pulse else None
    measurement = read_measurement_of(probe, Path(name), assigned, waveform)
    asked = medium if medium in ("vacuum", "air") else None
    measured_probe, differences = with_measured_circuit(probe, measurement, asked)
    data = measurement.dataset(measured_probe.circuit)
    (along,) = data.sizes
    data = data.isel({along: slice(None, None, data.sizes[along] // 1000 + 1)})
    in_time = {"time_us": data.time.values.tolist()} if along == "time" else {}
    columns_shown = ["bias_V", "lever_V", *(column.name for column in FITTED.values())]
    head, *rows = measurement.understood
    return {
        "rows": [(Path(name).name, *head[1:]), *rows],
        # those that were not used are among the columns, all of which the page shows
        "notes": [*measurement.notes, *differences],
        "observables": list(measurement.observables),
        "data": in_time
        | {column: data[column].values.tolist() for column in columns_shown if column in data},
    }


def measurements(report: Report, names: list[str], most: int) -> list[str]:
    """Return those of some files, `most` of them, that are measurements of levers.

    Logs and spectra are none, nor are tables that hotlever has written, under whatever name.
    """
    paths = (Path(name) for name in names)
    measured = (path.name for path in paths if _is_measurement(path, file_stamp(path)))
    return list(islice(measured, most))


@lru_cache(maxsize=2000)
def _is_measurement(path: Path, stamp: float) -> bool:
    try:
        read_measurement(path)
    except InputError:
        return False
    # all tables have these columns which hotlever writes of levers
    of_results = {"bias_V", "current_mA", "lever_V", "tip_K", "power_mW"}
    with path.open(encoding="utf-8", errors="replace") as file:
        return not set(file.readline().strip().split(",")) >= of_results


def columns(report: Report, name: str, metadata: Mapping[str, Any]) -> list[FileColumn]:
    """Return the columns of a measurement file, and what they are used as; see `understood`."""
    try:
        assigned = parse_columns(metadata.get("columns") or [])
    except InputError:
        assigned = {}
    return file_columns(Path(name), assigned, driven=bool(metadata.get("waveform")))


def groups(report: Report, name: str) -> list[str]:
    """Return the groups of a binary file, of which one is a measurement; see `file_groups`."""
    return file_groups(Path(name))


def result(report: Report, name: str) -> dict[str, Any]:
    """Return what a fit or a calibration file says: its kind, data, doubt and page."""
    path, stamp = Path(name), file_stamp(Path(name))
    estimate, shown = _estimate(path, stamp), _page(path, stamp)
    kind = "calibration" if estimate.route else "fit"
    blocks = [
        {**block, "figure": svg(block["figure"])} if block["kind"] == "figure" else block
        for block in shown.blocks
    ]
    data = read_json(name).get("data", {}).get("path", "")
    return {"kind": kind, "data": data, "doubt": estimate.doubt, "blocks": blocks}


def drawn(report: Report, name: str, figure_name: str, suffix: str) -> bytes:
    """Return a figure of a result as the content of a file."""
    shown = _page(Path(name), file_stamp(Path(name)))
    figure = next(block["figure"] for block in shown.blocks if block.get("name") == figure_name)
    return figure_file(figure, suffix)


def budget(report: Report, name: str) -> bytes:
    """Return the uncertainty budget of a calibration as a page that one sheet of paper holds.

    Raises
    ------
    InputError
        If it has none.
    """
    stated = budget_page(_calibration(name))
    return stated.html().encode()


def settings(report: Report, name: str, along: str, value: float) -> dict[str, float] | None:
    """Return what to set, and what follows, for a tip temperature, a bias or a power.

    None outside the calibrated range, and where the lever jumps.

    Raises
    ------
    InputError
        If the data of the calibration are not described.
    """
    calibration = _calibration(name)
    calibration.need_described("what to set")
    table = calibration.tip_table
    if along == "tip_K":
        bias = float(calibration.bias_for(value))
    elif along == "power_mW":
        bias = float(calibration.bias_for(calibration.tip_temperature(value)))
    else:
        bias = float(interpolated(table, value, "bias_V", "bias_V"))
    if not np.isfinite(bias):
        return None
    row = {
        column: float(np.interp(bias, table["bias_V"], table[column]))
        for column in calibration.columns
    }
    return {**row, "bias_V": bias, **({along: value} if along != "bias_V" else {})}


def refused(report: Report, names: list[str], spectra: bool) -> list[str]:
    """Return a line for each file that is no measurement, or no spectrum."""
    lines = []
    for name in names:
        try:
            if spectra:
                read_spectra([Path(name)])
            else:
                read_measurement(name)
        except InputError as error:
            lines.append(str(error))
    return lines


def spectra(report: Report, folders: Sequence[str]) -> list[str]:
    """Return the names of the spectra in some folders of a project, each with its folder."""
    names: list[str] = []
    for name in folders:
        # there may be none yet, and other files among them, of which the command says so
        with suppress(InputError):
            for file, _ in spectrum_files([Path(name)]):
                with suppress(InputError, OSError):
                    names += (
                        f"{name}/{spectrum}" for spectrum in _names(file, file.stat().st_mtime)
                    )
    return names


def spectrum(
    report: Report, name: str, task: Task, corrections: Mapping[str, SpectrumCorrection]
) -> dict[str, Any]:
    """Return the counts of a spectrum, its fit, and what is read from it, in words.

    Parameters
    ----------
    report : Report
    name : str
        As `spectra` has it.
    task : Task
        That of ``hotlever raman``, by whose thermometer it is read.
    corrections : mapping of str to SpectrumCorrection
        By hand, which may be in no file yet.
    """
    counted, told, doubt = _spectrum(name), arguments_of(task.words), ""
    with tempfile.TemporaryDirectory() as folder:
        by_hand = Path(folder, "by-hand.csv") if corrections else None
        if by_hand is not None:
            by_hand.write_text(corrections_text(corrections), encoding="utf-8")
        told = {field.name: told[field.name] for field in fields(ThermometerOptions)}
        options = ThermometerOptions(**{**told, "corrections": by_hand})
        try:
            setup = set_up(report, options)
        except HotleverError as error:
            doubt = f"no temperature: {error}"
            setup = set_up(report, replace(options, calibration=None, calibrate_from=None))
    (line,) = measure([counted], setup.options, corrections=setup.corrections)
    table = read_lines([line], setup.thermometer)
    inside = in_window(counted.x, "")
    x, y = counted.x[inside], counted.y[inside]
    low, high = line.window
    curves, heights = [(x, y), *[(x[:0], y[:0])] * 3], _with_room(y)
    if line.peak is not None:
        fine = np.linspace(max(low, x[0]), min(high, x[-1]), 800)
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


def levers(report: Report, names: list[str]) -> dict[str, Any]:
    """Return the table of the fits, or of the calibrations, that are there."""
    fits, calibrations = dict[str, Estimate](), dict[str, Estimate]()
    for name in names:
        with suppress(InputError):  # being written, or another kind of file
            estimate = _estimate(Path(name), file_stamp(Path(name)))
            (calibrations if estimate.route else fits)[Path(name).stem] = estimate
    rows, head = [], ["lever"]
    for lever, fit in fits.items():
        cells = parameter_rows(fit)
        head = ["lever", *(f"{label} ({unit})" if unit else label for label, _, unit, _ in cells)]
        rows.append([lever, *(value for _, value, _, _ in cells), fit.doubt])
    if calibrations:
        head, *all_rows = lever_rows(compare_levers(calibrations))
        # what follows from all of them is on their page
        rows = [[*row, calibrations[row[0]].doubt] for row in all_rows if row[0] in calibrations]
    return {"head": [*head, "remark"], "rows": rows}


def packed(report: Report, paths: list[Path]) -> bytes:
    """Return files as the content of one."""
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        for path in paths:
            archive.write(path, path.name)
    return content.getvalue()


@lru_cache(maxsize=2000)
def _estimate(path: Path, stamp: float) -> Estimate:
    return read_calibration(path) if "route" in read_json(path) else read_fit(path)


@lru_cache(maxsize=4)
def _page(path: Path, stamp: float) -> Page:
    return estimate_page(_estimate(path, stamp))


def _calibration(name: str) -> Estimate:
    estimate = _estimate(Path(name), file_stamp(Path(name)))
    if not estimate.route:
        raise InputError(f"{name}: is a fit, expected a calibration")
    return estimate


def _with_room(values: Array) -> list[float]:
    """Return the ends of an axis that shows some values."""
    low, high = float(values.min()), float(values.max())
    room = 0.08 * (high - low) or 1.0
    return [low - room, high + room]


def _summary(line: MeasuredLine, table: Any) -> str:
    """Say what was read from a line, with the digits of the command's table."""
    flags = str(table.flags.item()).replace(";", ", ")
    if line.peak is None:
        return flags
    peak, T = line.peak, float(table.temperature_K.values[0])
    error = float(table.temperature_error_K.values[0])
    text = f"{peak.centre:.4f} ± {peak.centre_stderr:.4f} cm⁻¹, width {peak.fwhm:.3f} cm⁻¹"
    if np.isfinite(T):
        text += f", {T:.2f} ± {error:.2f} K"
    return f"{text} ({flags})" if flags else text


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
