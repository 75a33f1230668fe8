"""What a worker process does for a page: tasks of `hotlever.tasks`, in the folder of a project.

The options of a task have the names and texts that the command line has.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from hotlever.app.changes import Changes
from hotlever.app.jobs import Task
from hotlever.app.workers import Report
from hotlever.tasks.calibrating import calibrate_files
from hotlever.tasks.designing import vary_design
from hotlever.tasks.fitting import fit_files
from hotlever.tasks.importing import propose_probe
from hotlever.tasks.measured_requests import CalibrateRequest, FitRequest, RamanRequest
from hotlever.tasks.requests import (
    DesignRequest,
    ImportRequest,
    PulseRequest,
    SpectrumRequest,
    SweepRequest,
)
from hotlever.tasks.simulating import simulate_in_time
from hotlever.tasks.small_signals import respond
from hotlever.tasks.spectra import measure_spectra
from hotlever.tasks.sweeping import sweep

#: By command: what its files are to the request, the request, and the task that takes it.
_TASKS: dict[str, tuple[str, type, Callable[[Report, Any], Any]]] = {
    "fit": ("data", FitRequest, fit_files),
    "calibrate": ("data", CalibrateRequest, calibrate_files),
    "sweep": ("probe", SweepRequest, sweep),
    "pulse": ("probe", PulseRequest, simulate_in_time),
    "spectrum": ("probe", SpectrumRequest, respond),
    "design": ("probe", DesignRequest, vary_design),
    "raman": ("spectra", RamanRequest, measure_spectra),
    "probe import": ("drawing", ImportRequest, propose_probe),
}
#: Commands that take several files.
_OF_SEVERAL = ("fit", "calibrate", "raman")


def run(report: Report, folder: Path, task: Task) -> None:
    """Do a task in a folder; what it writes there can be undone.

    Raises
    ------
    HotleverError
        If it cannot be done, or only in part.
    """
    os.chdir(folder)
    files_are, request, do = _TASKS[task.command]
    options = {
        name: value for name, value in task.options.items() if value not in (None, "", False, [])
    }
    switched_off = [name for name in options if name.startswith("no_")]
    options |= {name.removeprefix("no_"): not options.pop(name) for name in switched_off}
    if task.files:
        options[files_are] = task.files if task.command in _OF_SEVERAL else task.files[0]
    with Changes(folder).recorded(task.line):
        do(report, TypeAdapter(request).validate_python(options))
