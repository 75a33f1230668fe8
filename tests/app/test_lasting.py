"""What a user made stays: probe files that were edited, choices after a restart, other files."""

from __future__ import annotations

import asyncio
import json
import tempfile
import tomllib
from copy import deepcopy
from pathlib import Path
from typing import Any

import gdstk
import pytest
from nicegui import ui
from nicegui.testing import User
from nicegui.testing.user_interaction import UserInteraction
from test_app_pages import LENGTH, drop, shown, until, visit
from test_pages_at_work import at_once

from hotlever.app import live, showing
from hotlever.app.history import CHOICES, SCHEMA
from hotlever.app.pages.page import MEDIA
from hotlever.app.project import EXAMPLES, Project
from hotlever.app.session import Session
from hotlever.probe import Probe

DROPPED = "dropped own.gds"
OWN = (EXAMPLES / "reference-probe.gds").read_bytes()


def all_of(user: User, kind: Any, label: str = "") -> list[Any]:
    """Return the elements of a kind, with some label."""
    there = (one for one in user.client.elements.values() if isinstance(one, kind))
    return [one for one in there if not label or one.props.get("label") == label]


def of(user: User, kind: Any, label: str = "") -> Any:
    """Return the last element of a kind, with some label."""
    return all_of(user, kind, label)[-1]


async def tell_columns(user: User) -> None:
    """Pick what the columns a and b of the file are that Fit shows: bias in V, current in mA."""
    for column, symbol, unit in (("a", "V_b", "V"), ("b", "I_h", "mA")):
        named(user, f"Column {column} is").set_value(symbol)
        await until(lambda c=column: named(user, f"Unit of column {c}").visible)  # type: ignore
        named(user, f"Unit of column {column}").set_value(unit)
        await until(lambda c=column: named(user, f"Column {c} is").value)  # type: ignore
        await asyncio.sleep(0.3)


def named(user: User, name: str) -> Any:
    """Return the last element that has a name for who cannot see it; None without."""
    there = [e for e in user.client.elements.values() if e.props.get("aria-label") == name]
    return there[-1] if there else None


def texts(user: User) -> list[str]:
    """Return what labels say."""
    there = user.client.elements.values()
    return [one.text for one in there if isinstance(one, ui.label) and one.visible]


def images(user: User) -> list[str]:
    """Return what the pictures of a page show."""
    return [one.props["alt"] for one in user.client.elements.values() if one.tag == "img"]


# --- edits ----------------------------------------------------------------------------------------


def test_a_drawing_that_comes_again_leaves_an_edited_probe_file_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "own.toml"

    async def story(user: User, session: Session) -> None:
        at_once(session)
        await user.open("/lever")
        await drop(user, "own.gds", OWN)
        await user.should_see("What the drawing holds", retries=100)
        edited = path.read_text().replace("thickness_um = 0.4", "thickness_um = 0.31")
        path.write_text(edited)
        # dropped where it was dropped, dropped at the start, and chosen under Open
        await drop(user, "own.gds", OWN)
        await user.should_see("own.toml is there already, and was kept as it is.", retries=50)
        assert path.read_text() == edited == of(user, ui.textarea).value
        await user.open("/")
        await drop(user, "own.gds", OWN)
        await user.open("/lever")
        await user.should_see("own.toml is there already", retries=50)
        await user.open("/lever")
        of(user, ui.select, "Open").set_value("own.gds")
        await user.should_see("own.toml is there already", retries=50)
        assert path.read_text() == edited == of(user, ui.textarea).value
        # who wants the proposal asks for it, and has the edits back
        press(user, "Propose anew")
        await until(lambda: path.read_text() != edited)
        await until(lambda: "thickness_um = 0.4 " in of(user, ui.textarea).value)
        press(user, "What the app wrote")
        words = "hotlever probe import own.gds -o own.toml --plot own.svg"
        await user.should_see(words)
        # two were made: the last button of the name is of the first, which made the file
        assert [one.what for one in session.project.changes.latest()] == [words, words, DROPPED]
        buttons = [one for one in user.client.elements.values() if isinstance(one, ui.button)]
        again = next(one for one in buttons if one.props.get("aria-label") == f"Undo: {words}")
        UserInteraction(user, {again}, None).click()
        await until(lambda: path.read_text() == edited)
        await user.open("/lever")
        await until(lambda: of(user, ui.textarea).value == edited)

    visit(tmp_path, story)


def press(user: User, text: str) -> None:
    """Press the last button that says something: that of the page, not the one that leads to it."""
    buttons = [one for one in user.client.elements.values() if isinstance(one, ui.button)]
    named = [one for one in buttons if text in (one.text, one.props.get("aria-label"))]
    UserInteraction(user, {named[-1]}, None).click()


def test_saving_asks_before_another_file_is_replaced(tmp_path: Path) -> None:
    path = tmp_path / "my-lever.toml"
    path.write_text("mine, made elsewhere")

    async def story(user: User, session: Session) -> None:
        await user.open("/lever")
        await until(lambda: "length_um = 54.4" in of(user, ui.textarea).value)
        question = "my-lever.toml is there already"
        for button in ("Save", "Simulate", "PNG"):
            press(user, button)
            await user.should_see(question, retries=50)
            press(user, "Keep it")
            await user.should_not_see(question, retries=50)
            assert path.read_text() == "mine, made elsewhere"
        press(user, "Save")
        await user.should_see(question, retries=50)
        press(user, "Replace it")
        await until(lambda: "three-leg" in path.read_text())
        # what was saved here is saved again without a question, unless another has written it
        await until(lambda: bool(all_of(user, ui.input, LENGTH)))
        of(user, ui.input, LENGTH).set_value("60")
        await until(lambda: "length_um = 60" in of(user, ui.textarea).value)
        press(user, "Save")
        await until(lambda: "length_um = 60" in path.read_text())
        path.write_text("edited elsewhere")
        press(user, "Save")
        await user.should_see(question, retries=50)
        for change in session.project.changes.latest():
            session.project.changes.undo(change)
        assert path.read_text() == "mine, made elsewhere"

    visit(tmp_path, story)


def test_edits_that_are_not_saved_are_asked_about(tmp_path: Path) -> None:
    for name in ("a.toml", "b.toml"):
        (tmp_path / name).write_text(f"# {name}")

    async def story(user: User, session: Session) -> None:
        await user.open("/lever")
        of(user, ui.select, "Open").set_value("a.toml")
        await until(lambda: of(user, ui.textarea).value == "# a.toml")
        of(user, ui.textarea).set_value("# edited")
        await until(lambda: session.chosen["lever"]["text"] == "# edited")
        of(user, ui.select, "Open").set_value("b.toml")
        await user.should_see("edits that are not saved", retries=50)
        press(user, "Go on with it")
        await until(lambda: of(user, ui.select, "Open").value is None)
        assert of(user, ui.textarea).value == "# edited"

    visit(tmp_path, story)


# --- the lever that is shown ----------------------------------------------------------------------


def drawing_of(*boxes: tuple[int, float, float, float, float]) -> bytes:
    """Return the bytes of a drawing with some boxes, each of a layer."""
    library = gdstk.Library(unit=1e-6, precision=1e-12)
    cell = library.new_cell("TOP")
    for layer, x0, y0, x1, y1 in boxes:
        cell.add(gdstk.rectangle((x0, y0), (x1, y1), layer=layer))
    with tempfile.TemporaryDirectory() as folder:
        library.write_gds(f"{folder}/a.gds")
        return Path(folder, "a.gds").read_bytes()


def test_a_second_drawing_leaves_nothing_of_the_first(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    second = drawing_of((1, 0, 0, 50, 10))  # a plate: no heater, no terminals

    async def story(user: User, session: Session) -> None:
        at_once(session)
        await user.open("/lever")
        await drop(user, "first.gds", OWN)
        await user.should_see("What the drawing holds", retries=100)
        await until(lambda: len(images(user)) == 2)
        await drop(user, "second.gds", second)
        await until(lambda: of(user, ui.input, "Save as").value == "second.toml")
        await until(lambda: "All outlines of the drawing, by layer" in images(user))
        await until(lambda: "second.toml" in shown(user, "role=alert"))
        heads = [one for one in user.client.elements.values() if isinstance(one, ui.expansion)]
        assert [one.text for one in heads].count("What the drawing holds") == 1
        assert "The lever from above: regions, terminals and tip" not in images(user)
        assert not [one for one in user.client.elements.values() if isinstance(one, ui.table)]
        # nor does one that cannot be read
        await drop(user, "first.gds", OWN)
        await until(lambda: "The lever from above" in " ".join(images(user)))
        await drop(user, "third.gds", b"no drawing")
        await until(lambda: not images(user))
        assert of(user, ui.textarea).value == ""
        press(user, "Save")
        await user.should_see("there is no probe here yet", retries=50)
        assert sorted(session.project.probes) == ["first.toml", "second.toml"]

    visit(tmp_path, story)


def test_what_nobody_typed_is_drawn_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # what is put into the field of the probe file is no edit, however late its event is handled:
    # the picture would be drawn again, without what the drawing holds
    monkeypatch.chdir(tmp_path)
    drawn: list[str] = []
    draw = showing.probe_of_text

    def counted(*arguments: Any) -> Any:
        drawn.append(arguments[2])
        return draw(*arguments)

    monkeypatch.setattr(showing, "probe_of_text", counted)

    async def story(user: User, session: Session) -> None:
        at_once(session)
        await user.open("/lever")
        await drop(user, "first.gds", OWN)
        await user.should_see("What the drawing holds", retries=100)
        probe = session.project.path("first.toml").read_bytes()
        await drop(user, "second.toml", probe)
        await until(lambda: len(images(user)) == 1)
        await asyncio.sleep(0.5)
        assert drawn == ["my-lever.toml", "first.toml", "second.toml"]

    visit(tmp_path, story)


def test_what_is_typed_of_a_material_that_is_being_replaced_goes_with_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    text = (EXAMPLES / "palladium-on-nitride.toml").read_text(encoding="utf-8")

    async def story(user: User, session: Session) -> None:
        session.chosen["lever"] = {"text": text, "name": "mine.toml"}
        await user.open("/lever")
        await until(lambda: bool(all_of(user, ui.select, "made of")))
        typed = of(user, ui.input, "temperature coefficient of the resistivity, α (K⁻¹)")
        of(user, ui.select, "made of").set_value("+metal-film/Pt")
        typed.set_value("0.0123")  # before the fields of the former material are gone
        await until(lambda: "Pt" in of(user, ui.textarea).value)
        assert list(tomllib.loads(of(user, ui.textarea).value)["materials"]) == ["nitride", "Pt"]
        await until(lambda: "Pt: metal film" in str([one.text for one in all_of(user, ui.label)]))
        assert shown(user, "role=alert").strip() == ""

    visit(tmp_path, story)


# --- a restart ------------------------------------------------------------------------------------


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
    "dark": True,
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
    session.chosen.update(deepcopy(CHOSEN))
    session.chosen["calibrate"]["run"] = True  # of this very moment
    session.keep()
    again = Session(Project(tmp_path))
    assert again.remark == ""
    assert again.chosen.pop("dark")
    for page, chosen in CHOSEN.items():
        if page != "dark":
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
        await until(lambda: "full lever" in shown(user, "aria-live=polite"))
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
    ("text", "said"),
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
    tmp_path: Path, text: str, said: str
) -> None:
    hidden = tmp_path / ".hotlever"
    hidden.mkdir()
    (hidden / CHOICES).write_text(text)
    session = Session(Project(tmp_path))
    assert session.chosen == {}
    assert session.remark.startswith(f"{hidden / CHOICES}: ")
    assert said in session.remark
    assert "\n" not in session.remark
    assert (hidden / "choices.unread.json").read_text() == text


def test_the_line_on_an_unread_file_of_choices_is_shown_once(tmp_path: Path) -> None:
    hidden = tmp_path / ".hotlever"
    hidden.mkdir()
    (hidden / CHOICES).write_text("{")

    async def story(user: User, session: Session) -> None:
        await user.open("/fit")
        line = shown(user, "role=status")
        assert line.startswith(f".hotlever/{CHOICES}: ")
        assert "not valid JSON" in line
        assert "\n" not in line
        await user.open("/raman")
        assert shown(user, "role=status") == ""

    visit(tmp_path, story)


def test_what_is_unknown_in_a_file_of_choices_is_left_out(tmp_path: Path) -> None:
    hidden = tmp_path / ".hotlever"
    hidden.mkdir()
    chosen = {"dark": True, "fit": {"robust": True, "later": 1}, "another": 2}
    (hidden / CHOICES).write_text(json.dumps({"schema": 1, "chosen": chosen}))  # of version 1
    session = Session(Project(tmp_path))
    assert (session.chosen, session.remark) == ({"dark": True, "fit": {"robust": True}}, "")


def test_a_chosen_file_that_is_gone_gives_no_other_numbers(tmp_path: Path) -> None:
    (tmp_path / "lever-a.csv").write_bytes((EXAMPLES / "lever-a.csv").read_bytes())

    async def story(user: User, session: Session) -> None:
        session.chosen |= {"fit": {"probe": "gone.toml"}, "calibrate": {"rests": "fit:gone.json"}}
        await user.open("/fit")
        await until(lambda: "gone.toml: no such file" in shown(user, "role=alert"))
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
        await until(lambda: bool(shown(user, "role=alert").strip()))
        await tell_columns(user)
        words = "odd.csv --column 'V_b (V)=a' --column 'I_h (mA)=b'"
        await user.should_see(f"hotlever fit {words} -o odd.fit.json", retries=50)
        # the next file is another, and of another pulse
        await drop(user, "plain.csv", f"V_b (V),I_h (mA)\n{rows}".encode())
        await user.should_see("hotlever fit plain.csv -o plain.fit.json", retries=50)
        assert not shown(user, "role=alert").strip()
        assert named(user, "Column a is") is None
        of(user, ui.select, "Measurement").set_value("odd.csv")
        await user.should_see(f"hotlever fit {words} -o odd.fit.json", retries=50)
        await until(lambda: named(user, "Column a is").value == "V_b")
        # the same file has the same columns in the next page
        session.chosen["calibrate"] = {"data": "odd.csv"}
        await user.open("/calibrate")
        await user.should_see(f"hotlever calibrate {words}", retries=50)

    visit(tmp_path, story)


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
        assert not shown(user, "role=alert").strip()

    visit(tmp_path, story)
