"""What a user made stays: choices after a restart, other files."""

from __future__ import annotations

import json
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from elements import named, of, tell_columns
from nicegui import ui
from nicegui.testing import User
from test_app_pages import drop, text_of, until, visit

from hotlever.app import live
from hotlever.app.pages.page import MEDIA
from hotlever.app.project import EXAMPLES, Project
from hotlever.app.session import CHOICES, SCHEMA, Session
from hotlever.probe import Probe


@pytest.mark.parametrize("medium", MEDIA)
@pytest.mark.parametrize("page", ["fit", "calibrate"])
def test_every_medium_of_the_pages_is_kept(tmp_path: Path, page: str, medium: str) -> None:
    chosen = {page: {"medium": medium}}
    hidden = tmp_path / ".hotlever"
    hidden.mkdir()
    (hidden / CHOICES).write_text(json.dumps({"schema": SCHEMA, "history": [chosen]}))
    session = Session(Project(tmp_path))
    assert (session.choices(page)["medium"], session.remark) == (medium, "")


CHOSEN: dict[str, Any] = {
    "lever": {"text": "[probe]", "name": "own.toml", "mesh": True},
    "simulate": {
        "probe": "own.toml",
        "changes": {"n_d": 5e17, "medium": "air", "surface_gap_um": None},
        "bias": 6.5,
        "most": 10.0,
        "view": "time",
    },
    "pulse": {"kind": "train", "height": 7.0, "count": 3, "until": None},
    "raman": {"law": "linear", "spectrum": "tip/a.txt", "calibration": "r.json"},
    "fit": {
        "data": "mine.csv",
        "probe": "own.toml",
        "without": ["tip"],
        "robust": True,
        "medium": "air",
        "fixed": "p",
        "free": "n_d",
        "priors": "n_d=±15%",
    },
    "calibrate": {"data": "mine.csv", "rests": "probe:own.toml", "pulse": "5us"},
    "levers": {"data": ["mine.csv"], "probe": "own.toml"},
    "files": {"mine.csv": {"columns": ["V_b (V)=a", "I_h (mA)=b"], "waveform": ""}},
    "asked": {"tip_K": 650.0},
}


def test_what_was_chosen_is_there_after_a_restart(tmp_path: Path) -> None:
    session = Session(Project(tmp_path))
    session.keep()
    assert not (tmp_path / ".hotlever").exists()  # nothing was chosen
    session.dark = True
    session.chosen.update(deepcopy(CHOSEN))
    session.chosen["calibrate"]["run"] = True  # of this very moment
    session.keep()
    again = Session(Project(tmp_path))
    assert again.remark == ""
    assert again.dark
    for page, chosen in CHOSEN.items():
        assert chosen.items() <= again.choices(page).items()
    assert "run" not in again.chosen["calibrate"]


def test_pages_after_a_restart_show_what_was_chosen(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # a reduced lever is not what is tested, and takes long
    monkeypatch.setattr(live, "_can_be_reduced", lambda probe: False)
    (tmp_path / "mine.csv").write_text("a,b\n" + "".join(f"{n / 2},{n / 9}\n" for n in range(20)))

    words = "hotlever fit mine.csv --probe own.toml --column 'V_b (V)=a' --column 'I_h (mA)=b'"

    async def first(user: User, session: Session) -> None:
        session.project.write("own.toml", Probe.reference().to_toml(), "saved")
        await user.open("/simulate")
        of(user, ui.select, "Probe").set_value("own.toml")
        await until(lambda: "full lever" in text_of(user, "aria-live=polite"))
        of(user, ui.slider).set_value(300.0)
        await until(lambda: "base_temperature_K" in session.chosen["simulate"]["changes"])
        await user.open("/fit")
        of(user, ui.select, "Probe").set_value("own.toml")
        # a file whose columns nobody has told is not taken by itself
        of(user, ui.select, "Measurement").set_value("mine.csv")
        await until(lambda: named(user, "Column a is") is not None)
        await tell_columns(user)
        user.find("Hold (n_d=3.3e17, p)").type("p")
        await user.should_see(f"{words} --fix p -o mine.fit.json", retries=50)
        session.keep()

    async def second(user: User, session: Session) -> None:
        await user.open("/fit")
        await user.should_see(f"{words} --fix p -o mine.fit.json", retries=50)
        await until(lambda: named(user, "Column a is").value == "V_b")
        await user.open("/simulate")
        words_of_sweep = "hotlever sweep own.toml --bias 0:12:49 --set base_temperature_K=300"
        await user.should_see(words_of_sweep, retries=100)
        assert of(user, ui.select, "Probe").value == "own.toml"

    visit(tmp_path, first)
    visit(tmp_path, second)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("{", "not valid JSON"),
        ("[]", "expected an object"),
        ('{"schema": 2}', "history is missing"),
        ('{"schema": 2, "history": []}', "history = []: list should have at least 1 item"),
        ('{"schema": 2, "history": [{}], "shown": -1}', "shown = -1: expected at least 0"),
        ('{"schema": 7, "chosen": {}}', "found schema 7, expected 2"),
        ('{"schema": 1}', "history.0 = None: expected keys of"),
        ('{"schema": 1, "chosen": {"fit": {"robust": "perhaps"}}}', "fit.robust"),
        ('{"schema": 1, "chosen": {"lever": {"mesh": "round"}}}', "lever.mesh"),
        ('{"schema": 1, "chosen": {"simulate": {"changes": {"n_d": "air"}}}}', "n_d = air"),
        ('{"schema": 1, "chosen": {"simulate": {"changes": {"medium": 5}}}}', "medium = 5"),
        ('{"schema": 1, "chosen": {"calibrate": {"rests": "x:y"}}}', "calibrate.rests"),
    ],
)
def test_a_damaged_or_foreign_file_of_choices_is_a_line(
    tmp_path: Path, text: str, reason: str
) -> None:
    hidden = tmp_path / ".hotlever"
    hidden.mkdir()
    (hidden / CHOICES).write_text(text)
    session = Session(Project(tmp_path))
    assert session.chosen == {}
    assert session.remark.startswith(f"{hidden / CHOICES}: ")
    assert reason in session.remark
    assert "\n" not in session.remark
    assert (hidden / "choices.unread.json").read_text() == text


def test_the_line_on_an_unread_file_of_choices_is_shown_once(tmp_path: Path) -> None:
    hidden = tmp_path / ".hotlever"
    hidden.mkdir()
    (hidden / CHOICES).write_text("{")

    async def story(user: User, session: Session) -> None:
        await user.open("/fit")
        line = text_of(user, "role=status")
        assert line.startswith(f".hotlever/{CHOICES}: ")
        assert "not valid JSON" in line
        assert "\n" not in line
        await user.open("/raman")
        assert text_of(user, "role=status") == ""

    visit(tmp_path, story)


def test_what_is_unknown_in_a_file_of_choices_is_left_out(tmp_path: Path) -> None:
    hidden = tmp_path / ".hotlever"
    hidden.mkdir()
    chosen = {"dark": True, "fit": {"robust": True, "later": 1}, "another": 2}
    (hidden / CHOICES).write_text(json.dumps({"schema": 1, "chosen": chosen}))  # of version 1
    session = Session(Project(tmp_path))
    assert (session.dark, session.chosen) == (True, {"fit": {"robust": True}})
    assert session.remark == ""


def test_a_chosen_file_that_is_gone_gives_no_other_numbers(tmp_path: Path) -> None:
    (tmp_path / "lever-a.csv").write_bytes((EXAMPLES / "lever-a.csv").read_bytes())

    async def story(user: User, session: Session) -> None:
        session.chosen |= {"fit": {"probe": "gone.toml"}, "calibrate": {"rests": "fit:gone.json"}}
        await user.open("/fit")
        await until(lambda: "gone.toml: no such file" in text_of(user, "role=alert"))
        assert of(user, ui.select, "Probe").value == "gone.toml"
        await user.open("/calibrate")
        await user.should_see("hotlever calibrate lever-a.csv --fit gone.json", retries=50)

    visit(tmp_path, story)


# --- columns --------------------------------------------------------------------------------------


def test_columns_belong_to_the_file_that_they_were_typed_for(tmp_path: Path) -> None:
    rows = "".join(f"{n / 2},{n / 9}\n" for n in range(20))

    async def story(user: User, session: Session) -> None:
        await user.open("/fit")
        await drop(user, "odd.csv", f"a,b\n{rows}".encode())
        await until(lambda: bool(text_of(user, "role=alert").strip()))
        await tell_columns(user)
        words = "odd.csv --column 'V_b (V)=a' --column 'I_h (mA)=b'"
        await user.should_see(f"hotlever fit {words} -o odd.fit.json", retries=50)
        # the next file is another, and of another pulse
        await drop(user, "plain.csv", f"V_b (V),I_h (mA)\n{rows}".encode())
        await user.should_see("hotlever fit plain.csv -o plain.fit.json", retries=50)
        assert not text_of(user, "role=alert").strip()
        assert named(user, "Column a is") is None
        of(user, ui.select, "Measurement").set_value("odd.csv")
        await user.should_see(f"hotlever fit {words} -o odd.fit.json", retries=50)
        await until(lambda: named(user, "Column a is").value == "V_b")
        # the same file has the same columns in the next page
        session.chosen["calibrate"] = {"data": "odd.csv"}
        await user.open("/calibrate")
        await user.should_see(f"hotlever calibrate {words}", retries=50)

    visit(tmp_path, story)


def test_the_group_of_a_tdms_file_is_asked_for_and_kept(tmp_path: Path) -> None:
    nptdms = pytest.importorskip("nptdms")
    bias = np.linspace(0.5, 4.0, 8)
    with nptdms.TdmsWriter(tmp_path / "two.tdms") as writer:
        writer.write_segment(
            [
                nptdms.ChannelObject(f"lever {number}", name, values, {"unit_string": unit})
                for number in (1, 2)
                for name, unit, values in (("V_b", "V", bias), ("I_h", "mA", bias / (6 + number)))
            ]
        )

    async def first(user: User, session: Session) -> None:
        await user.open("/fit")
        of(user, ui.select, "Measurement").set_value("two.tdms")
        await user.should_see("2 groups, each a measurement of its own", retries=50)
        group = of(user, ui.select, "Group of the file")
        assert group.visible
        assert group.options == ["lever 1", "lever 2"]
        group.set_value("lever 2")
        words = "hotlever fit two.tdms --column 'group=lever 2' -o two.fit.json"
        await user.should_see(words, retries=50)
        session.keep()

    async def second(user: User, session: Session) -> None:
        await user.open("/fit")
        await until(lambda: of(user, ui.select, "Group of the file").value == "lever 2")
        # what is told of a column is told beside it
        await until(lambda: named(user, "Column I_h (mA) is") is not None)
        named(user, "Column I_h (mA) is").set_value("")
        expected = ["group=lever 2", "unused=I_h (mA)"]
        await until(lambda: session.metadata_of("two.tdms")["columns"] == expected)

    visit(tmp_path, first)
    visit(tmp_path, second)


def test_a_pulse_belongs_to_the_file_that_it_was_told_for(tmp_path: Path) -> None:
    rows = "".join(f"{0.1 * n},{1.28 - 0.01 * n:.3f}\n" for n in range(20))
    (tmp_path / "rest.csv").write_bytes((EXAMPLES / "lever-a.csv").read_bytes())
    (tmp_path / "timed.csv").write_text(f"t (us),I_h (mA)\n{rows}")

    async def story(user: User, session: Session) -> None:
        session.chosen["fit"] = {"data": "timed.csv"}
        await user.open("/fit")
        await user.should_see("--pulse 10V,5us", retries=50)
        user.find("Pulse of a file in time (10V,20us)").type("9V, 5us")
        await user.should_see("hotlever fit timed.csv --pulse 9V,5us", retries=50)
        of(user, ui.select, "Measurement").set_value("rest.csv")
        await user.should_see("hotlever fit rest.csv -o rest.fit.json", retries=50)
        assert not text_of(user, "role=alert").strip()

    visit(tmp_path, story)
