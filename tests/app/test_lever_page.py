"""The page Lever: a probe is set as fields and saved as a new file; no file is written over."""

from __future__ import annotations

import asyncio
import tempfile
import tomllib
from pathlib import Path
from typing import Any

import gdstk
import pytest
from elements import all_of, images, named, of, press, texts
from nicegui import ui
from test_app_pages import LENGTH, drawn, drop, text_of, until, visited
from test_pages_at_work import at_once

from hotlever.app.probe_fields import (
    LayerRow,
    opened,
    settable,
    with_layer,
    with_material_renamed,
    with_value,
    written,
)
from hotlever.app.project import EXAMPLES
from hotlever.errors import InputError
from hotlever.probe import Probe

OWN = (EXAMPLES / "reference-probe.gds").read_bytes()
PALLADIUM = "palladium-on-nitride.toml"
FILES = (PALLADIUM, "boron-lever.toml", "uiuc-lever.toml")
REPORT: Any = None


@pytest.fixture
def palladium(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    monkeypatch.chdir(tmp_path)
    return opened(REPORT, str(EXAMPLES / PALLADIUM))


def row_of(sections: dict[str, Any], name: str) -> LayerRow:
    rows = settable(REPORT, sections)["layers"]
    return next(row for row in rows if row.name == name)


@pytest.mark.parametrize("name", FILES)
def test_a_probe_that_is_written_is_what_was_set(name, monkeypatch):
    monkeypatch.chdir(EXAMPLES)
    sections = with_value(opened(REPORT, name), ("circuit",), "base_temperature_K", 301.5)
    text = written(REPORT, sections, "new.toml")
    expected = Probe.from_file(name).with_(base_temperature_K=301.5)
    assert Probe.from_sections(tomllib.loads(text), "new.toml", EXAMPLES) == expected


def test_a_drawing_stays_named_in_what_is_written(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("own.gds").write_bytes(OWN)
    layers = {"silicon": "1/0", "heater": "2/0", "reader": "3/0"}
    sections = {
        "probe": {
            "shape": "drawing",
            "file": "own.gds",
            "thickness_um": 0.4,
            "tip_um": [48.58, 0.0],
        },
        "layers": layers,
        "terminals": {"supply": "10/0", "ground": "11/0", "reader": "12/0"},
    }
    assert tomllib.loads(written(REPORT, sections, "new.toml"))["layers"] == layers


def test_layers_change_what_they_are_made_of(palladium):
    row = row_of(palladium, "track")
    assert (row.role, row.material) == ("film", "film")
    # what was set since the row was shown stays
    sections = with_value(palladium, ("layers", "track"), "thickness_um", 0.1)
    changed = with_layer(sections, row, "film", "+metal-film/Pt")
    # the material that nothing is made of any more is gone, and the layer's own name stays
    assert list(Probe.from_sections(changed, "new").materials) == ["nitride", "Pt"]
    assert changed["layers"]["track"]["thickness_um"] == 0.1
    # what has another name since is still one layer
    assert "track" not in with_layer(changed, row, "", "")["layers"]
    assert list(palladium["materials"]) == ["film", "nitride"]


def test_a_layer_is_named_after_what_it_is_made_of():
    sections = {"probe": {"shape": "drawing"}, "layers": {"heater": "2/0"}, "terminals": {}}
    row = row_of(sections, "heater")
    assert row.role == "heater"
    once = with_layer(sections, row, "film", "+metal-film/Pt")
    assert once["layers"] == {"Pt": {"drawn": "2/0", "material": "Pt"}}
    assert with_layer(once, row, "film", "")["layers"] == {"low-doped": "2/0"}
    assert with_layer(once, row, "supply", "")["terminals"] == {"supply": "2/0"}


def test_the_layer_of_the_heater_is_called_so_whatever_it_is_made_of():
    layers = {"silicon": "1/0", "part": {"drawn": "2/0", "edge_bias_um": 0.1}, "heater": "3/0"}
    sections = {"probe": {"shape": "drawing"}, "layers": layers, "terminals": {}, "material": {}}
    row = row_of(sections, "part")
    changed = with_layer(sections, row, "heater", "")
    # of two heaters the one that was it is none
    assert changed["layers"] == {"silicon": "1/0", "heater": layers["part"]}
    assert changed["material"] == {}
    once = with_layer(changed, row, "heater", "+metal-film/Pt")["layers"]["heater"]
    # edges of a metal have no shift
    assert once == {"drawn": "2/0", "material": "Pt"}


def test_a_material_is_renamed_wherever_it_is_named(palladium):
    palladium |= {"prior": {"film.tcr": "± 3%"}, "monitor": {"track": {"region": "film"}}}
    renamed = Probe.from_sections(with_material_renamed(palladium, "film", "my-film"), "new")
    assert dict(renamed.materials)["my-film"] == Probe.from_sections(
        palladium, "old"
    ).materials.get("film")
    assert renamed.stated_priors == {"my-film.tcr": "± 3%"}
    assert renamed.monitors["track"].region == "my-film"
    with pytest.raises(InputError, match="a name that no material has"):
        with_material_renamed(palladium, "film", "film")


@visited
async def test_a_lever_is_drawn_while_its_fields_change_and_saved_under_a_new_name(
    user, session, tmp_path
):
    (tmp_path / "reference.toml").write_text("mine, made elsewhere")

    await user.open("/lever")
    await until(lambda: bool(all_of(user, ui.input, LENGTH)) and bool(images(user)))
    field = of(user, ui.input, LENGTH)
    assert field.value == "54.4"
    await user.should_see("hotlever probe show --plot reference.svg")
    before = drawn(user)
    field.set_value("1")
    # what is wrong is drawn, and the field marked
    await until(lambda: "length_um" in text_of(user, "role=alert") and drawn(user) != before)
    assert field.props.get("error")
    press(user, "Save")
    await asyncio.sleep(0.3)
    assert session.project.probes == ["reference.toml"]
    field.set_value("50")
    await until(lambda: not text_of(user, "role=alert").strip())
    assert not field.props.get("error")
    plain = len(drawn(user))
    user.find(kind=ui.switch, content="mesh").click()
    await until(lambda: len(drawn(user)) > 1.5 * plain)
    await user.should_see("hotlever probe show reference-2.toml --mesh --plot")
    # a name that is taken is refused, and another one proposed
    of(user, ui.input, "Save as").set_value("reference.toml")
    press(user, "Save")
    await until(lambda: "a new name such as reference-2.toml" in text_of(user, "role=alert"))
    assert (tmp_path / "reference.toml").read_text() == "mine, made elsewhere"
    # what is set and not saved is there when one comes back
    await user.open("/raman")
    await user.open("/lever")
    await until(lambda: bool(all_of(user, ui.input, LENGTH)))
    assert of(user, ui.input, LENGTH).value == "50"
    await user.should_see("Something is set that is not saved.")
    press(user, "Save")
    await until(lambda: session.probe == "reference-2.toml")
    assert Probe.from_file(tmp_path / "reference-2.toml").shape.length_um == 50.0
    await until(lambda: "Something is set that is not saved." not in texts(user))
    assert session.project.names(".svg") == []


def drawing_of(*boxes: tuple[int, float, float, float, float]) -> bytes:
    """Return the bytes of a drawing with some boxes, each of a layer."""
    library = gdstk.Library(unit=1e-6, precision=1e-12)
    cell = library.new_cell("TOP")
    for layer, x0, y0, x1, y1 in boxes:
        cell.add(gdstk.rectangle((x0, y0), (x1, y1), layer=layer))
    with tempfile.TemporaryDirectory() as folder:
        library.write_gds(f"{folder}/a.gds")
        return Path(folder, "a.gds").read_bytes()


@visited
async def test_each_drawing_has_a_probe_file_and_a_picture_of_its_own(
    user, session, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)

    at_once(session)
    await user.open("/lever")
    await drop(user, "own.gds", OWN)
    await until(lambda: session.probe == "own.toml")
    await until(lambda: len(images(user)) == 2 and named(user, "layer 1/0 is made of"))
    # a page that is opened anew, as another one beside it, says as well what the drawing holds
    await user.open("/lever")
    await until(lambda: len(images(user)) == 2 and named(user, "layer 1/0 is made of"))
    edited = "# mine\n" + (tmp_path / "own.toml").read_text()
    (tmp_path / "own.toml").write_text(edited)
    # the same again is proposed beside it
    await drop(user, "own.gds", OWN)
    await until(lambda: session.probe == "own-2.toml")
    assert (tmp_path / "own.toml").read_text() == edited
    # a plate: no heater, no terminals
    await drop(user, "plate.gds", drawing_of((1, 0, 0, 50, 10)))
    await until(lambda: "plate.toml" in text_of(user, "role=alert"))
    assert "The lever from above: regions, terminals and tip" not in images(user)
    assert not all_of(user, ui.table)
    # one that cannot be read leaves the lever as it is
    await drop(user, "third.gds", b"no drawing")
    await until(lambda: "third.gds" in str(texts(user)))
    assert session.probe == "plate.toml"
    assert sorted(session.project.probes) == ["own-2.toml", "own.toml", "plate.toml"]


@visited
async def test_a_proposal_that_comes_late_does_not_replace_what_was_chosen_meanwhile(
    user, session, tmp_path
):
    (tmp_path / "other.toml").write_text(Probe.u_shape().to_toml())

    waiting: list[Any] = []
    at_once(session)
    start = session.jobs.start
    session.jobs.start = lambda page, task: waiting.append((page, task))  # type: ignore
    session.choices("lever", {"edited": {}, "mesh": False})["awaited"] = "own.toml"
    await user.open("/lever")
    session.choose_lever("other.toml")
    await until(lambda: of(user, ui.select, "Lever").value == "other.toml")
    session.jobs.start = start  # type: ignore[method-assign]
    (tmp_path / "own.toml").write_text(Probe.reference().to_toml())
    await user.open("/lever")
    await asyncio.sleep(0.3)
    assert session.probe == "other.toml"


@visited
async def test_what_is_typed_of_a_material_that_is_being_replaced_goes_with_it(
    user, session, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / PALLADIUM).write_bytes((EXAMPLES / PALLADIUM).read_bytes())

    session.probe = PALLADIUM
    await user.open("/lever")
    await until(lambda: bool(all_of(user, ui.select, "made of")))
    typed = of(user, ui.input, "temperature coefficient of the resistivity, α (K⁻¹)")
    of(user, ui.select, "made of").set_value("+metal-film/Pt")
    typed.set_value("0.0123")  # before the fields of the former material are gone
    await until(lambda: "Pt: metal film" in str(texts(user)))
    edited = session.chosen["lever"]["edited"][PALLADIUM]
    assert list(edited["materials"]) == ["nitride", "Pt"]
    assert text_of(user, "role=alert").strip() == ""


@visited
async def test_a_tab_that_closes_over_an_open_dialog_is_no_error(
    user, session, tmp_path, monkeypatch, caplog
):
    """`list.remove(x): x not in list` was an internal error of a tab that had gone."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / PALLADIUM).write_bytes((EXAMPLES / PALLADIUM).read_bytes())

    session.probe = PALLADIUM
    await user.open("/lever")
    await until(lambda: named(user, "Rename film") is not None)
    press(user, "Rename film")
    await user.should_see("Another name")
    dialog = of(user, ui.dialog)
    user.client.delete()
    # the browser's last word on it
    for listener in list(dialog._event_listeners.values()):
        if listener.type == "hide":
            listener.handler(None)  # type: ignore[misc]
    await asyncio.sleep(0.2)
    assert session.followers == []

    assert "list.remove" not in caplog.text
