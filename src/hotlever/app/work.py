"""What a worker process does for a page: tasks of `hotlever.tasks`.

The options of a task have the names and texts that the command line has.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from hotlever.app.changes import Changes
from hotlever.app.jobs import Task
from hotlever.app.workers import Report
from hotlever.errors import InputError
from hotlever.probe import Probe
from hotlever.tasks.commands import COMMANDS


def run(report: Report, task: Task) -> None:
    """Do a task; what it writes can be undone.

    Raises
    ------
    HotleverError
        If it cannot be done, or only in part.
    """
    request = request_of(task)
    with Changes(Path()).recorded(task.line):
        COMMANDS[task.command].do(report, request)


def request_of(task: Task) -> Any:
    """Return the request of a task.

    Raises
    ------
    InputError
        As the command line says, if a value is not of its option's type.
    """
    command, options = COMMANDS[task.command], task.given
    switched_off = [name for name in options if name.startswith("no_")]
    options |= {name.removeprefix("no_"): not options.pop(name) for name in switched_off}
    if task.files:
        (argument,) = command.arguments
        several = "list" in str(argument.type)
        options[argument.name] = list(task.files) if several else task.files[0]
    try:
        return TypeAdapter(command.request).validate_python(options)
    except ValidationError as error:
        (first, *_) = error.errors()
        name = str(first["loc"][0]).replace("_", "-")
        raise InputError(f"Invalid value for '--{name}': {first['msg']}") from None


def probe_of(name: str | None) -> Probe:
    """Return the probe of a file, the reference probe where none is named."""
    return Probe.reference() if name is None else Probe.from_file(name)
