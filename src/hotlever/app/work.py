"""What a worker process does for a page: tasks of `hotlever.tasks`, in the folder of a project.

The options of a task have the names and texts that the command line has.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hotlever.app.changes import Changes
from hotlever.app.jobs import Task
from hotlever.app.workers import Report
from hotlever.files import Outputs
from hotlever.lever import Lever
from hotlever.lever.transient.waveform_texts import waveform_from_text
from hotlever.measurement import parse_columns
from hotlever.tasks import fitting, simulating, spectra, sweeping
from hotlever.tasks.calibrating import Tables, calibrate_file
from hotlever.tasks.files import Files
from hotlever.tasks.importing import propose_probe
from hotlever.tasks.probes import make_lever, read_probe
from hotlever.tasks.texts import parse_timing
from hotlever.tasks.thermometry import set_up
from hotlever.units import setting


def run(report: Report, folder: Path, task: Task) -> None:
    """Do a task in a folder; what it writes there can be undone.

    Raises
    ------
    HotleverError
        If it cannot be done, or only in part.
    """
    os.chdir(folder)
    options = {
        name: Path(value) if name in _PATHS and value else value
        for name, value in task.options.items()
        if value not in (None, "", False, [])
    }
    with Changes(folder).recorded(task.line):
        _TASKS[task.command](report, *map(Path, task.files), **options)


#: Options that name a file or a folder.
_PATHS = {
    *("probe", "fit", "power_law", "calibration", "calibrate_from", "save_calibration"),
    *("corrections", "output", "table", "plot", "fields", "report"),
}


def _fit(
    reporter: Report,
    *data: Path,
    probe: Path | None = None,
    column: Sequence[str] = (),
    pulse: str | None = None,
    posterior: bool = False,
    profiles: bool = False,
    output: Path | None = None,
    report: Path | None = None,
    **asked: Any,
) -> None:
    lever, columns = read_probe(reporter, probe), parse_columns(column)
    options = fitting.fit_options(lever, **asked)
    to = fitting.Destination(Outputs(*data, probe), output, report)
    if len(data) > 1:
        fitting.fit_several(reporter, data, columns, lever, options, to)
        return
    waveform = waveform_from_text("pulse", pulse, mark="--") if pulse else None
    examined = {"samples": _SAMPLES if posterior else None, "profiles": profiles}
    fitting.fit_one(reporter, data[0], columns, waveform, lever, options, examined, to)


def _calibrate(
    reporter: Report,
    data: Path,
    probe: Path | None = None,
    fit: Path | None = None,
    power_law: Path | None = None,
    column: Sequence[str] = (),
    prior: list[str] | None = None,
    pulse: str | None = None,
    medium: str | None = None,
    **files: Path,
) -> None:
    outputs = _outputs([data, probe, fit, power_law], **files)
    like = read_probe(reporter, probe) if fit is None else None
    read = data, parse_columns(column), like, fit, power_law, prior
    timing = None if pulse is None else parse_timing(pulse)
    calibrate_file(reporter, *read, outputs, Tables(**files), medium=medium, pulse=timing)


def _sweep(reporter: Report, probe: Path | None = None, *, bias: str, **asked: Any) -> None:
    first, last, count = bias.split(":")
    biases = np.linspace(float(first), float(last), int(count))
    lever, outputs, files = _lever(reporter, probe, **asked)
    sweeping.sweep(reporter, lever, biases, outputs, files)


def _pulse(
    reporter: Report,
    probe: Path | None = None,
    *,
    step: str | None = None,
    pulse: str | None = None,
    period: str | None = None,
    count: str | None = None,
    until: str | None = None,
    **asked: Any,
) -> None:
    kind, text = ("pulse", pulse) if pulse else ("step", step)
    number = None if count is None else int(count)
    waveform = waveform_from_text(kind, str(text), period, number, mark="--")
    end = None if until is None else setting(until, "us", "--until")
    lever, outputs, files = _lever(reporter, probe, **asked)
    simulating.simulate_in_time(reporter, lever, waveform, end, None, outputs, files)


def _lever(
    reporter: Report,
    probe: Path | None,
    set: Sequence[str] | None = None,
    medium: str | None = None,
    **files: Path,
) -> tuple[Lever, Outputs, Files]:
    """Return the lever that is simulated, and what is written of it."""
    outputs = _outputs([probe], **files)
    read = read_probe(reporter, probe, set)
    read = read if medium is None else read.in_medium(medium)
    return make_lever(reporter, read), outputs, Files(**files)


def _outputs(inputs: Sequence[Path | None], fields: Path | None = None, **files: Path) -> Outputs:
    """Return the outputs of a task, that can be written: files, and a folder of fields."""
    outputs = Outputs(*inputs)
    for path in files.values():
        outputs.file(path)
    outputs.folder(fields)
    return outputs


def _raman(
    reporter: Report,
    folder: Path,
    calibration: Path | None = None,
    calibrate_from: Path | None = None,
    corrections: Path | None = None,
    law: str = "anharmonic",
    **files: Path,
) -> None:
    outputs = _outputs([folder, calibration, calibrate_from, corrections], **files)
    thermometer = set_up(
        reporter,
        calibration=None if calibration is None else str(calibration),
        calibrate_from=None if calibrate_from is None else [calibrate_from],
        corrections=corrections,
        law=law,
    )
    spectra.measure_spectra(thermometer, [folder], outputs, spectra.Files(**files))


def _import(reporter: Report, drawing: Path, output: Path, plot: Path) -> None:
    outputs = _outputs([drawing], output=output, plot=plot)
    propose_probe(reporter, drawing, None, None, outputs, output, plot)


#: Samples of a posterior, as the command line has them.
_SAMPLES = 10_000
_TASKS: dict[str, Callable[..., None]] = {
    "fit": _fit,
    "calibrate": _calibrate,
    "sweep": _sweep,
    "pulse": _pulse,
    "raman": _raman,
    "probe import": _import,
}
