"""What is chosen is a record, its history a list: undone, redone, there at the next start."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any

import pytest
from elements import all_of, of, press
from nicegui import ui
from nicegui.testing import User
from test_app_pages import LENGTH, text_of, until, visit

from hotlever.app import session as session_module
from hotlever.app.session import CHOICES, History, Session
from hotlever.app.state import Result


def choose(state: History, page: str, **values: Any) -> None:
    """Choose, and have that be a step of its own."""
    state.choices(page).update(values)
    state.keep()


def test_steps_are_undone_and_redone_in_the_dictionaries_that_pages_hold(tmp_path: Path) -> None:
    state = History(tmp_path)
    held, of_fit = state.choices("simulate"), state.choices("fit")
    choose(state, "simulate", changes={"n_d": 5e17})
    choose(state, "simulate", bias=6.0)
    choose(state, "fit", robust=True)
    assert state.step(-1) == {"fit"}
    assert state.remark == "Undone: fit, robust."
    assert (of_fit["robust"], held["bias"]) == (False, 6.0)
    assert state.step(-1) == {"simulate"}
    assert state.step(-1) == {"simulate"}
    assert (held["bias"], held["changes"]) == (8.0, {})
    assert state.step(-1) == set()
    assert state.remark == "There is nothing to undo."
    assert state.step(1) == {"simulate"}
    assert held["changes"] == {"n_d": 5e17}
    # who chooses something else has nothing to redo
    choose(state, "simulate", bias=7.0)
    assert state.step(1) == set()
    assert state.step(-1) == {"simulate"}
    assert (held["bias"], held["changes"]) == (8.0, {"n_d": 5e17})


def test_a_slider_that_moves_is_one_step(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    now = [100.0]
    monkeypatch.setattr(session_module.time, "monotonic", lambda: now[0])
    state = History(tmp_path)
    for bias in (6.0, 6.1, 6.2, 6.3):
        now[0] += 1.0
        choose(state, "simulate", bias=bias)
    now[0] += 60.0
    choose(state, "simulate", bias=9.0)
    assert state.step(-1)
    assert state.choices("simulate")["bias"] == 6.3
    assert state.step(-1)
    assert state.choices("simulate")["bias"] == 8.0
    assert not state.step(-1)
    # one that comes back to where it was is none
    now[0] += 60.0
    choose(state, "simulate", bias=7.0)
    choose(state, "simulate", bias=8.0)
    assert not state.step(-1)


def test_the_history_is_there_after_a_restart_where_it_was_left(tmp_path: Path) -> None:
    state = History(tmp_path)
    state.choices("fit")  # a page that is opened chooses nothing
    state.keep()
    assert not (tmp_path / CHOICES).exists()
    choose(state, "fit", priors="n_d=±15%")
    choose(state, "lever", text="[probe]", name="own.toml")
    state.metadata_of("mine.csv")["columns"] = ["V_b (V)=a"]
    state.keep()
    state.step(-1)
    again = History(tmp_path)
    assert again.metadata_of("mine.csv")["columns"] == []
    assert again.choices("lever")["text"] == "[probe]"
    assert again.step(1) == {"files"}
    assert again.metadata_of("mine.csv")["columns"] == ["V_b (V)=a"]
    for _ in range(3):
        assert again.step(-1)
    assert again.choices("fit")["priors"] == ""


def test_what_a_page_chooses_by_itself_is_no_step(tmp_path: Path) -> None:
    state = History(tmp_path)
    choose(state, "fit", robust=True)
    state.choices("fit")["data"] = "mine.csv"  # the first of the folder
    state.settle()
    assert state.step(-1)
    assert (state.choices("fit")["robust"], state.choices("fit")["data"]) == (False, None)
    # and takes nothing from what can be redone
    state.choices("fit")["data"] = "mine.csv"
    state.settle()
    assert state.step(1)
    assert state.choices("fit")["robust"]


def test_undoing_an_edit_undoes_no_saving(tmp_path: Path) -> None:
    """What was saved tells edits from the file: with the digest of another text they were lost."""
    state = History(tmp_path)
    choose(state, "lever", name="own.toml", text="first", saved="digest of first")
    choose(state, "lever", text="edited")
    choose(state, "lever", saved="digest of edited")
    assert state.step(-1) == {"lever"}
    lever = state.choices("lever")
    assert (lever["text"], lever["saved"]) == ("first", "digest of edited")
    assert History(tmp_path).step(1) == {"lever"}


def test_results_are_there_after_a_restart_and_are_not_undone(tmp_path: Path) -> None:
    state = History(tmp_path)
    options = {"set": ["n_d=5e+17"], "pulse": "10V,5us", "output": "a.csv", "plot": "a.svg"}
    numbers = [("tip, highest", "409.7 K at 5 µs")]
    values = {"command": "pulse", "files": [], "options": options, "numbers": numbers}
    choose(state, "pulse", height=9.0)
    state.results["pulse"] = Result(**values, stamp=time.time())
    state.keep()
    assert state.step(-1) == {"pulse"}
    assert History(tmp_path).results == state.results != {}


def test_the_oldest_steps_are_forgotten(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(session_module, "_MOST", 4)
    state = History(tmp_path)
    for step in range(10):
        choose(state, "fit", priors=f"{step}", robust=bool(step % 2), drift=step % 4 > 1)
        choose(state, "fit", profiles=bool(step % 2))
    steps = 0
    while state.step(-1):
        steps += 1
    assert steps == 3
    monkeypatch.setattr(session_module, "_MOST_TEXT", 1000)
    choose(state, "lever", text="x" * 2000)  # longer than all may be: it is kept alone
    assert len(json.loads((tmp_path / CHOICES).read_text())["history"]) == 1


def test_a_page_shows_what_was_undone(tmp_path: Path) -> None:
    async def story(user: User, session: Session) -> None:
        await user.open("/lever")
        await until(lambda: "length_um = 54.4" in of(user, ui.textarea).value)
        await until(lambda: bool(all_of(user, ui.input, LENGTH)))
        of(user, ui.input, LENGTH).set_value("60")
        await until(lambda: "length_um = 60" in of(user, ui.textarea).value)
        press(user, "Undo")
        await user.open("/lever")
        assert text_of(user, "role=status") == "Undone: lever, text."
        await until(lambda: "length_um = 54.4" in of(user, ui.textarea).value)
        press(user, "Redo")
        await user.open("/lever")
        await until(lambda: "length_um = 60" in of(user, ui.textarea).value)

    visit(tmp_path, story)
