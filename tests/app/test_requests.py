"""What a page asks of a task is what the command line asks by the line that the page shows."""

from __future__ import annotations

import shlex
from typing import Any

import pytest
import typer

from hotlever.app.jobs import Task, request_of
from hotlever.cli.commands import command_line
from hotlever.errors import HotleverError
from hotlever.tasks.commands import Command

TASKS = [
    Task("sweep", ("-a.toml",), {"hold_power": "1mW:4mW:7", "set": ["n_d=5e17"], "fields": "f"}),
    Task("sweep", (), {"bias": "-8.1V", "medium": None, "set": [], "output": "a.csv"}),
    Task("pulse", (), {"step": "-3", "until": "5us", "output": "a.csv"}),
    Task("pulse", (), {"pulse": "10V,5us", "period": "20us", "count": "5.5", "output": "a.csv"}),
    Task("contact", (), {"sample": "polymer, 100nm, silicon", "radius": "5nm", "bias": "8V"}),
    Task("reader", (), {"set": ["surface_tilt_deg=-3"], "amplifier": "0nV", "hooge": 1e-5}),
    Task("spectrum", (), {"bias": "0", "frequency": "1Hz:1e7Hz:71", "amplitude": ""}),
    Task("fit", ("my data.csv",), {"column": ["I_h (uA)=Current"], "fix": ["p"], "robust": True}),
    Task("fit", ("a.csv", "b.csv"), {"probe": "p.toml", "output": "fits", "report": "levers"}),
    Task("calibrate", ("a.csv",), {"power_law": "f.json", "prior": ["usual"], "table": "t.csv"}),
    Task("next", ("a.json",), {"at": "800K", "stay_below": "900.5K", "output": "n.csv"}),
    Task("raman", ("tip",), {"calibrate_from": ["plate"], "law": "", "plot": "r.svg"}),
    Task("probe new", (), {"shape": "u-shape", "output": "u.toml"}),
    Task("probe show", ("a.toml",), {"plot": "a.svg", "mesh": True}),
]


def by_line(line: str, monkeypatch: pytest.MonkeyPatch) -> Any:
    """Return the request of a command line, or the line that refuses it."""
    requests: list[Any] = []
    monkeypatch.setattr(Command, "do", lambda self, _, request: requests.append(request))
    words = shlex.split(line)[1:]
    try:
        command = command_line(words[0])
        with command.make_context("hotlever", words) as context:
            command.invoke(context)
    except typer.Exit:
        pass
    except typer.TyperException as error:
        return error.format_message()
    return requests[0]


@pytest.mark.parametrize("task", TASKS, ids=lambda task: task.line)
def test_a_task_asks_what_its_line_asks(task: Task, monkeypatch: pytest.MonkeyPatch) -> None:
    request: Any
    try:
        request = request_of(task)
    except HotleverError as error:
        request = str(error)
    assert request == by_line(task.line, monkeypatch)
