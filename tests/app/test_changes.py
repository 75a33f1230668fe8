"""What the app writes into a project can be undone, whoever writes it."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from test_pages_at_work import done

from hotlever.app import changes as changes_module
from hotlever.app.changes import Changes
from hotlever.app.jobs import Task
from hotlever.app.project import EXAMPLES, Project
from hotlever.errors import InputError
from hotlever.files import write_text


@pytest.fixture
def project(tmp_path: Path) -> Project:
    return Project(tmp_path / "project")


def test_a_file_is_what_it_was_and_undoing_is_undone(project: Project) -> None:
    path = project.path("own.toml")
    path.write_text("edited by hand")
    project.write("own.toml", "of the app", "saved own.toml")
    project.write("new.toml", "of the app", "saved new.toml")
    new, saved = project.changes.latest()
    assert (new.what, new.before) == ("saved new.toml", {"new.toml": None})
    project.changes.undo(saved)
    assert path.read_text() == "edited by hand"
    project.changes.undo(new)
    assert project.probes == ["own.toml"]
    removed, undone, *_ = project.changes.latest()
    assert (removed.what, undone.what) == ("undone: saved new.toml", "undone: saved own.toml")
    project.changes.undo(removed)
    project.changes.undo(undone)
    assert (path.read_text(), project.path("new.toml").read_text()) == ("of the app",) * 2
    again, *_ = project.changes.latest()
    assert again.what == "done again: saved own.toml"
    project.changes.undo(again)
    assert path.read_text() == "edited by hand"


def test_what_a_command_of_the_app_replaces_is_kept(
    project: Project, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(project.folder)
    before = {"own.toml": b"mine\r\n", "own.svg": b"\x00\xff"}
    for name, content in before.items():
        project.path(name).write_bytes(content)
    drawing = project.take_example("reference-probe.gds")
    task = Task("probe import", (drawing,), {"output": "own.toml", "plot": "own.svg"})
    assert done(task, project.folder)[0].standing == "done"
    change, _ = project.changes.latest()
    assert change.what == f"hotlever probe import {drawing} -o own.toml --plot own.svg"
    assert set(change.before) == set(before)
    assert b"hotlever probe file" in project.path("own.toml").read_bytes()
    project.changes.undo(change)
    assert {name: project.path(name).read_bytes() for name in before} == before


def test_files_are_undone_all_or_none(project: Project) -> None:
    for name in "ab":
        project.path(name).write_text("before")
    with project.changes.recorded("both"):
        for name in "ab":
            write_text(project.path(name), "first")
            write_text(project.path(name), "after")
    (change,) = project.changes.latest()
    (change.folder / str(change.before["b"])).unlink()
    with pytest.raises(InputError, match="b: what was there before is not kept any more"):
        project.changes.undo(change)
    assert project.path("a").read_text() == "after"


def test_nothing_is_written_where_the_version_before_cannot_be_kept(project: Project) -> None:
    path = project.path("own.toml")
    path.write_text("mine")
    project.hidden.write_text("a file where a folder is needed")
    with pytest.raises(InputError, match="cannot be made a folder"):
        project.write("own.toml", "of the app", "saved")
    assert path.read_text() == "mine"


@pytest.mark.parametrize(
    "entry",
    [
        {"file": "../secret", "before": "0"},
        {"file": "a", "before": "../../../secret"},
        {"file": "../secret", "before": None},
    ],
)
def test_a_list_that_somebody_else_wrote_leads_nowhere(
    project: Project, entry: dict[str, Any]
) -> None:
    secret = project.folder.parent / "secret"
    secret.write_text("secret")
    folder = project.hidden / "changes" / "1"
    folder.mkdir(parents=True)
    (folder / "0").write_text("other")
    lines = [{"schema": 1, "what": "x"}, entry]
    (folder / "files.jsonl").write_text("\n".join(map(json.dumps, lines)))
    for change in project.changes.latest():
        with pytest.raises(InputError, match="not in the folder"):
            project.changes.undo(change)
    assert secret.read_text() == "secret"
    assert not project.path("a").exists()


@pytest.mark.parametrize("text", ["", "{", "[1]\n", '{"schema": 2, "what": "x"}\n', "\xff"])
def test_a_damaged_list_is_none(project: Project, text: str) -> None:
    folder = project.hidden / "changes" / "1"
    folder.mkdir(parents=True)
    (folder / "files.jsonl").write_text(text, encoding="latin-1")
    assert project.changes.latest() == []
    project.write("own.toml", "a", "saved")
    assert len(project.changes.latest()) == 1


def test_the_oldest_changes_are_forgotten(
    project: Project, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(changes_module, "_MOST", 3)
    for number in range(6):
        project.write("own.toml", str(number), f"saved {number}")
    assert [one.what for one in project.changes.latest()] == ["saved 5", "saved 4", "saved 3"]
    monkeypatch.setattr(changes_module, "_MOST_BYTES", 10)
    project.write("own.toml", "x" * 100, "long")
    project.write("own.toml", "y", "short")  # the one before is larger than all may be: kept
    assert [one.what for one in project.changes.latest()] == ["short"]


def test_an_example_replaces_no_spectra(project: Project) -> None:
    own = project.take("tip_00.txt", b"my own", "tip")
    with pytest.raises(InputError, match=r"tip/tip_00\.txt: is no file of the example"):
        project.take_example_folders("raman", "hot-plate", "tip")
    assert project.path(own).read_bytes() == b"my own"
    assert not project.spectra("hot-plate")
    project.path(own).unlink()
    for _ in range(2):
        project.take_example_folders("raman", "hot-plate", "tip")
    assert len(project.spectra("tip")) == len(list((EXAMPLES / "raman" / "tip").iterdir()))


def test_the_probe_file_of_a_drawing_is_told_from_others_of_its_name(project: Project) -> None:
    drawing = project.take_example("reference-probe.gds")
    assert project.probe_of_drawing(drawing) == ("reference-probe.toml", False)
    path = project.path("reference-probe.toml")
    path.write_text("[probe]\nshape = 'three-leg'\n")  # of something else
    assert project.probe_of_drawing(drawing) == ("reference-probe-2.toml", False)
    path.write_text("[probe]\nfile = 'reference-probe.gds'\n")
    assert project.probe_of_drawing(drawing) == ("reference-probe.toml", True)
    path.write_text("[probe\nfile = 'reference-")  # being edited
    assert project.probe_of_drawing(drawing) == ("reference-probe.toml", True)


def test_an_output_that_is_named_on_the_command_line_is_replaced(
    project: Project, run: Callable[..., Any]
) -> None:
    path = project.path("own.toml")
    path.write_text("mine")
    assert run("probe", "new", "-o", str(path))[0] == 0
    assert "three-leg" in path.read_text()
    assert not Changes(project.folder).latest()  # what is no app keeps nothing
