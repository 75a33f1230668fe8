"""What files of a project say, told in tables, words and figures. Runs in a worker process.

The figures are those of `hotlever.figures`, the pages those of `hotlever.report`.
"""

from __future__ import annotations

import io
import re
import tempfile
import zipfile
from collections.abc import Callable, Mapping
from functools import lru_cache
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from hotlever import figures
from hotlever.app.jobs import probe_of
from hotlever.app.project import CALIBRATIONS, file_stamp
from hotlever.app.workers import Report
from hotlever.calibration import Calibration, read_calibration
from hotlever.calibration.levers import calibration_rows, compare_calibrations
from hotlever.calibration.table import interpolated
from hotlever.errors import InputError
from hotlever.estimation import Fit, read_fit
from hotlever.estimation.summary import parameter_rows
from hotlever.lever.meshing import chosen_space
from hotlever.lever.transient.waveform_texts import waveform_from_text
from hotlever.measurands import FITTED
from hotlever.measurement import (
    FileColumn,
    file_columns,
    parse_columns,
    read_measurement,
    read_measurement_of,
)
from hotlever.probe import Layout, Probe
from hotlever.probe.file_sections import read_sections
from hotlever.probe.shapes import PARAMETRIC
from hotlever.raman import read_spectra
from hotlever.report.budget_pages import budget_page
from hotlever.report.calibration_pages import calibration_page
from hotlever.report.fit_pages import fit_page
from hotlever.report.page import Block, Page

#: Results kept, whose figures may be asked for as files.
_KEPT = 4
#: No part of a drawing of a probe lies beyond (µm).
_DRAWABLE_UM = 1e5
#: Points of a measurement that are shown.
_POINTS = 1000
#: Names of columns that all tables have which hotlever writes of levers.
_OF_RESULTS = {"bias_V", "current_mA", "lever_V", "tip_K", "power_mW"}


def understood(report: Report, name: str, told: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Return what a measurement file was understood as.

    Beside it may be told its columns, the file of the probe, and the pulse that was measured.
    """
    told = told or {}
    probe = probe_of(told.get("probe"))
    assigned = parse_columns(told.get("columns") or [])
    pulse = told.get("waveform")
    waveform = waveform_from_text("pulse", pulse) if pulse else None
    measurement = read_measurement_of(probe, Path(name), assigned, waveform)
    data = measurement.dataset(probe.circuit)
    (along,) = data.sizes
    data = data.isel({along: slice(None, None, data.sizes[along] // _POINTS + 1)})
    in_time = {"time_us": data.time.values.tolist()} if along == "time" else {}
    columns_shown = ["bias_V", "lever_V", *(column.name for column in FITTED.values())]
    head, *rows = measurement.understood
    return {
        "rows": [(Path(name).name, *head[1:]), *rows],
        # those that were not used are among the columns, all of which the page shows
        "notes": list(measurement.notes),
        "observables": list(measurement.observables),
        "medium": measurement.medium,
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
    with path.open(encoding="utf-8", errors="replace") as file:
        return not set(file.readline().strip().split(",")) >= _OF_RESULTS


def columns(report: Report, name: str, told: Mapping[str, Any]) -> list[FileColumn]:
    """Return the columns of a measurement file, and what they are used as; see `understood`."""
    try:
        assigned = parse_columns(told.get("columns") or [])
    except InputError:
        assigned = {}
    return file_columns(Path(name), assigned, driven=bool(told.get("waveform")))


def page(report: Report, kind: str, name: str) -> None:
    """Send the blocks of the page of a result, a fit or a calibration, as they are drawn."""

    def send(block: Block) -> None:
        drawing = {"figure": _svg(block["figure"])} if block["kind"] == "figure" else {}
        report.send("block", {**block, **drawing})

    _page(kind, Path(name), send)


def drawn(report: Report, kind: str, name: str, figure: str, suffix: str) -> bytes:
    """Return a figure of a result as the content of a file."""
    blocks = _page(kind, Path(name)).blocks
    made = next(block["figure"] for block in blocks if block.get("name") == figure)
    return _file(made, suffix)


def budget(report: Report, name: str) -> bytes:
    """Return the uncertainty budget of a calibration as a page that one sheet of paper holds.

    Raises
    ------
    InputError
        If it has none.
    """
    stated = budget_page(_calibration(Path(name), file_stamp(Path(name))))
    return stated.html().encode()


def doubted(report: Report, name: str) -> str:
    """Return why a calibration does not say what to set; empty if it does."""
    return _calibration(Path(name), file_stamp(Path(name))).doubt


def settings(report: Report, name: str, along: str, value: float) -> dict[str, float] | None:
    """Return what to set, and what follows, for a tip temperature, a bias or a power.

    None outside the calibrated range, and where the lever jumps.

    Raises
    ------
    InputError
        If the data of the calibration are not described.
    """
    calibration = _calibration(Path(name), file_stamp(Path(name)))
    calibration.need_described("what to set")
    table = calibration.table
    if along == "tip_K":
        bias = float(calibration.bias_for(value))
    elif along == "power_mW":
        bias = float(calibration.bias_for(calibration.tip_temperature(value)))
    else:
        bias = float(interpolated(table, value, "bias_V", "bias_V"))
    if not np.isfinite(bias):
        return None
    row = {
        column: float(np.interp(bias, table.bias_V, table[column]))
        for column in calibration.columns
    }
    return {**row, "bias_V": bias, **({along: value} if along != "bias_V" else {})}


def probe_of_text(report: Report, text: str, title: str, mesh: bool = False) -> dict[str, Any]:
    """Return the drawing of a probe file that is being written."""
    with tempfile.NamedTemporaryFile("w", suffix=".toml", dir=".", prefix=".hotlever-") as file:
        file.write(text)
        file.flush()
        try:
            probe = Probe.from_file(file.name)
        except InputError as error:
            fault = str(error).replace(file.name, title)
            return _at_fault(error, fault, lambda: read_sections(file.name)["probe"])
    return _described(probe, title, mesh)


def probe_file(report: Report, name: str, suffix: str, mesh: bool = False) -> bytes:
    """Return the drawing of a probe as the content of a file."""
    probe = probe_of(name)
    triangles = chosen_space(probe).mesh if mesh else None
    return _file(figures.probe_drawing(probe.layout(), name, mesh=triangles), suffix)


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


def levers(report: Report, names: list[str]) -> dict[str, Any]:
    """Return the table of the fits, or of the calibrations, that are there."""
    rows, head = [], ["lever"]
    calibrations = dict[str, Calibration]()
    for name in names:
        path, lever = Path(name), Path(name).name.split(".")[0]
        try:
            if path.parent.name == CALIBRATIONS:
                calibrations[lever] = _calibration(path, file_stamp(path))
                continue
            fit = _fit(path, file_stamp(path))
        except InputError:
            continue  # being written, or another kind of file
        cells = parameter_rows(fit)
        head = ["lever", *(f"{label} ({unit})" if unit else label for label, _, unit, _ in cells)]
        rows.append([lever, *(value for _, value, _, _ in cells), fit.doubt])
    if calibrations:
        head, *all_rows = calibration_rows(compare_calibrations(calibrations))
        # what follows from all of them is on their page
        rows = [[*row, calibrations[row[0]].doubt] for row in all_rows if row[0] in calibrations]
    return {"head": [*head, "remark"], "rows": rows}


def design_numbers(report: Report, name: str | None) -> dict[str, float]:
    """Return what can be varied of a probe, what is asked for first before the rest."""
    from hotlever.studies.design import Design

    design = Design(probe_of(name))
    numbers = design.numbers
    return {key: numbers[key] for key in dict.fromkeys((*design.usual, *numbers)) if numbers[key]}


def materials(report: Report, name: str | None) -> dict[str, Any]:
    """Return all materials, or those of a probe file, in words and as curves."""
    from hotlever.materials import catalogue

    if name is None:
        made_of, curves = None, catalogue.curves()
    else:
        probe = probe_of(name)
        made_of = probe.made_of
        curves = catalogue.curves(made_of, probe.layout().thickness_um)
    return {"kinds": catalogue.sections(made_of), "figure": _svg(figures.material_curves(curves))}


def packed(report: Report, paths: list[Path]) -> bytes:
    """Return files as the content of one."""
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        for path in paths:
            archive.write(path, path.name)
    return content.getvalue()


def _described(probe: Probe, title: str, with_mesh: bool) -> dict[str, Any]:
    layout, mesh = probe.layout(), chosen_space(probe).mesh if with_mesh else None
    return {
        "figure": _svg(figures.probe_drawing(layout, title, mesh=mesh)),
        "fault": "",
        "rows": _regions(layout),
        "triangles": 0 if mesh is None else mesh.elements.nelements,
    }


def _regions(layout: Layout) -> list[tuple[str, str, str]]:
    return [(region.name, region.part, f"{region.area:.4g} µm²") for region in layout.regions]


def _at_fault(
    error: InputError, fault: str, section: Callable[[], Mapping[str, Any]]
) -> dict[str, Any]:
    """Return the picture of what is wrong with a drawing, or with the dimensions of a section.

    Raises
    ------
    InputError
        If neither has a place in a picture.
    """
    from hotlever.probe.drawing.outlines import DrawingError

    if isinstance(error, DrawingError):
        made = figures.outlines_drawing(error.outlines, fault=fault, fault_at=error.place)
        return {"figure": _svg(made), "fault": fault}
    try:
        # a section may hold anything
        return {"figure": _svg(_impossible(section(), fault)), "fault": fault}
    except (InputError, ArithmeticError, AttributeError, LookupError, TypeError, ValueError):
        raise InputError(fault) from None


def _impossible(values: Mapping[str, Any], fault: str) -> Figure:
    """Draw dimensions that do not go together, and mark the part that a line about them names.

    Raises
    ------
    ValueError
        If it names none of them, or no picture has room for them.
    """
    shape, words = PARAMETRIC[values["shape"]], set(re.findall(r"\w+", fault))
    if not words & set(shape.model_fields):
        raise ValueError(fault)
    regions = shape.model_construct(**values).layout().regions
    if not np.abs([region.rings[0] for region in regions]).max() < _DRAWABLE_UM:
        raise ValueError(fault)
    parts = {word.partition("_")[0] for word in words}
    wrong = next((region for region in regions if region.name.partition(" ")[0] in parts), None)
    fault_at = None if wrong is None else np.mean(wrong.rings[0], axis=0).tolist()
    outlines = {region.name: region.rings for region in regions}
    return figures.outlines_drawing(outlines, fault=fault, fault_at=fault_at)


#: Pages of results, whose figures may be asked for as files; the latest last.
_pages: dict[tuple[str, Path, float], Page] = {}


def _page(kind: str, path: Path, added: Callable[[Block], None] | None = None) -> Page:
    """Return the page of a result, telling of its blocks as soon as they are there."""
    key = kind, path, file_stamp(path)
    if key in _pages:
        if added is not None:
            for block in _pages[key].blocks:
                added(block)
    elif kind == "fit":
        _pages[key] = fit_page(_fit(path, key[2]), added=added)
    else:
        _pages[key] = calibration_page(_calibration(path, key[2]), added)
    if len(_pages) > _KEPT:
        del _pages[next(iter(_pages))]
    return _pages[key]


@lru_cache(maxsize=_KEPT)
def _calibration(path: Path, stamp: float) -> Calibration:
    return read_calibration(path)


def _svg(made: Figure) -> str:
    return _file(made, ".svg").decode("utf-8")


def _file(made: Figure, suffix: str) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, f"figure{suffix}")
        figures.save_figure(made, path)
        return path.read_bytes()


@lru_cache(maxsize=2000)
def _fit(path: Path, stamp: float) -> Fit:
    return read_fit(path)
