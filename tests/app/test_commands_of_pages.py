"""What a page asks of a command is told by the command line that it shows."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Any

import pytest

from hotlever.app.session import Task
from hotlever.errors import InputError
from hotlever.tasks.commands import arguments_of

#: Tasks, and what their commands are called with besides what is left out.
TASKS: list[tuple[Task, dict[str, Any]]] = [
    (
        Task(
            "sweep", ("-a.toml",), {"hold_power": "1mW:4mW:7", "set": ["n_d=5e17"], "fields": "f"}
        ),
        {
            "probe": Path("-a.toml"),
            "hold_power": "1mW:4mW:7",
            "set": ["n_d=5e17"],
            "fields": Path("f"),
        },
    ),
    (
        Task("sweep", (), {"bias": "-8.1V", "medium": None, "set": [], "output": "a.csv"}),
        {"bias": "-8.1V", "output": Path("a.csv")},
    ),
    (Task("pulse", (), {"step": "-3", "until": "5us"}), {"step": "-3", "until": "5us"}),
    (
        Task("reader", (), {"set": ["surface_tilt_deg=-3"], "amplifier": "0nV", "hooge": 1e-5}),
        {"set": ["surface_tilt_deg=-3"], "amplifier": "0nV", "hooge": 1e-5},
    ),
    (Task("spectrum", (), {"bias": "0", "amplitude": ""}), {"bias": "0"}),
    (
        Task("fit", ("my data.csv", "b.csv"), {"fix": ["p"], "robust": True, "output": "fits"}),
        {
            "data": [Path("my data.csv"), Path("b.csv")],
            "fix": ["p"],
            "robust": True,
            "output": Path("fits"),
        },
    ),
    (
        Task("raman", ("tip",), {"calibrate_from": ["plate"], "law": "", "plot": "r.svg"}),
        {"spectra": [Path("tip")], "calibrate_from": [Path("plate")], "plot": Path("r.svg")},
    ),
    (Task("probe new", (), {"shape": "u-shape"}), {"shape": "u-shape"}),
]


@pytest.mark.parametrize(("task", "expected"), TASKS, ids=lambda one: getattr(one, "line", ""))
def test_a_command_is_called_with_what_a_page_chose(task, expected):
    assert shlex.split(task.line) == ["hotlever", *task.words]
    arguments = arguments_of(task.words)
    left_out = {"probe show": (), "fit": ("a.csv",), "raman": ("a",), "spectrum": ("--bias", "0")}
    usual = arguments_of([*task.command.split(), *left_out.get(task.command, ())])
    told = {name: value for name, value in arguments.items() if value != usual[name]}
    assert {**told, **{name: arguments[name] for name in expected}} == expected


def test_a_value_that_is_none_of_its_option_is_refused_as_on_the_command_line():
    task = Task("pulse", (), {"pulse": "10V,5us", "period": "20us", "count": "5.5"})
    with pytest.raises(InputError, match="'--count': Input should be a valid integer"):
        arguments_of(task.words)
