"""What a worker process does for a page: tasks of `hotlever.tasks`, in the folder of a project.

The options of a task have the names and texts that the command line has.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from hotlever.app.changes import Changes
from hotlever.app.jobs import Task
from hotlever.app.workers import Report
from hotlever.probe import Probe
from hotlever.tasks.commands import COMMANDS


def run(report: Report, folder: Path, task: Task) -> None:
    """Do a task in a folder; what it writes there can be undone.

    Raises
    ------
    HotleverError
        If it cannot be done, or only in part.
    """
    os.chdir(folder)
    request = request_of(task)
    with Changes(folder).recorded(task.line):
        COMMANDS[task.command].do(report, request)


def request_of(task: Task, folder: Path | None = None) -> Any:
    """Return the request of a task; its files are in a folder that is given.

    Raises
    ------
    ValidationError
        If an option is none of the command's.
    """
    command = COMMANDS[task.command]
    options = {
        name: value for name, value in task.options.items() if value not in (None, "", False, [])
    }
    switched_off = [name for name in options if name.startswith("no_")]
    options |= {name.removeprefix("no_"): not options.pop(name) for name in switched_off}
    if task.files:
        files = [str(folder / name) for name in task.files] if folder else list(task.files)
        (argument,) = command.arguments
        options[argument.name] = files if "list" in str(argument.type) else files[0]
    return TypeAdapter(command.request).validate_python(options)


def probe_of(folder: Path, name: str | None) -> Probe:
    """Return the probe of a file in a folder, the reference probe where none is named."""
    return Probe.reference() if name is None else Probe.from_file(folder / name)
