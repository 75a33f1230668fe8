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
from hotlever.probe import Probe
from hotlever.tasks.approaching import approach
from hotlever.tasks.calibrating import calibrate_files
from hotlever.tasks.contacting import touch
from hotlever.tasks.design_requests import DesignRequest, ImportRequest
from hotlever.tasks.designing import vary_design
from hotlever.tasks.fitting import fit_files
from hotlever.tasks.importing import propose_probe
from hotlever.tasks.measured_requests import CalibrateRequest, FitRequest, RamanRequest
from hotlever.tasks.requests import (
    ContactRequest,
    PulseRequest,
    ReaderRequest,
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
    "contact": ("probe", ContactRequest, touch),
    "reader": ("probe", ReaderRequest, approach),
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
    request, do = request_of(task)
    with Changes(folder).recorded(task.line):
        do(report, request)


def request_of(task: Task, folder: Path | None = None) -> tuple[Any, Callable[[Report, Any], Any]]:
    """Return the request of a task, and what takes it; its files are in a folder that is given.

    Raises
    ------
    ValidationError
        If an option is none of the command's.
    """
    files_are, request, do = _TASKS[task.command]
    options = {
        name: value for name, value in task.options.items() if value not in (None, "", False, [])
    }
    switched_off = [name for name in options if name.startswith("no_")]
    options |= {name.removeprefix("no_"): not options.pop(name) for name in switched_off}
    if task.files:
        files = [str(folder / name) for name in task.files] if folder else list(task.files)
        options[files_are] = files if task.command in _OF_SEVERAL else files[0]
    return TypeAdapter(request).validate_python(options), do


def probe_of(folder: Path, name: str | None) -> Probe:
    """Return the probe of a file in a folder, the reference probe where none is named."""
    return Probe.reference() if name is None else Probe.from_file(folder / name)
