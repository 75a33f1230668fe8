"""Probe files that a user edited stay: they are not replaced, forgotten or redrawn."""

from __future__ import annotations

import asyncio
import tempfile
import tomllib
from pathlib import Path
from typing import Any

import gdstk
import pytest
from elements import all_of, images, of, press
from nicegui import ui
from nicegui.testing import User
from nicegui.testing.user_interaction import UserInteraction
from test_app_pages import LENGTH, drop, text_of, until, visit
from test_pages_at_work import at_once

from hotlever.app import probe_files
from hotlever.app.project import EXAMPLES
from hotlever.app.session import Session

DROPPED = "dropped own.gds"
OWN = (EXAMPLES / "reference-probe.gds").read_bytes()


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
        await until(lambda: "second.toml" in text_of(user, "role=alert"))
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
    draw = probe_files.drawn_text

    def counted(*arguments: Any) -> Any:
        drawn.append(arguments[2])
        return draw(*arguments)

    monkeypatch.setattr(probe_files, "drawn_text", counted)

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
        assert text_of(user, "role=alert").strip() == ""

    visit(tmp_path, story)
