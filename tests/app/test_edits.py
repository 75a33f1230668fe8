"""Fields of a probe file change what they are of, and leave the rest of its text as it was."""

from __future__ import annotations

import contextlib
import time
import tomllib
from pathlib import Path

import pytest

from hotlever.app.edits import LayerRow, with_layer, with_material_renamed, with_value
from hotlever.app.probe_files import settable
from hotlever.app.project import EXAMPLES
from hotlever.app.workers import Report
from hotlever.errors import InputError
from hotlever.probe import Probe

FILES = ("palladium-on-nitride.toml", "boron-lever.toml", "uiuc-lever.toml")


@pytest.mark.parametrize("name", FILES)
def test_each_number_that_is_set_is_set_and_nothing_else(name: str) -> None:
    text = (EXAMPLES / name).read_text(encoding="utf-8")
    content = tomllib.loads(text)
    for section, values in content.items():
        for key, value in values.items():
            if isinstance(value, float):
                changed = with_value(text, (section,), key, value + 1.0)
                expected = {**content, section: {**values, key: value + 1.0}}
                assert tomllib.loads(changed) == expected
                lines = zip(text.splitlines(), changed.splitlines(), strict=True)
                assert sum(one != other for one, other in lines) == 1
                gone = with_value(text, (section,), key, None)
                assert key not in tomllib.loads(gone).get(section, {})


def test_new_keys_and_sections_find_their_place() -> None:
    text = "[probe]\n# tip_um = [0.0, 0.0]    # not found\n\n[layers]\nsilicon = '1/0'\n"
    text = with_value(text, ("probe",), "tip_um", [1.0, 2.0])
    text = with_value(text, ("layers", "a b"), "drawn", "5/0")
    assert text.splitlines()[1] == "tip_um = [1.0, 2.0]"
    layers = {"silicon": "1/0", "a b": {"drawn": "5/0"}}
    assert tomllib.loads(text) == {"probe": {"tip_um": [1.0, 2.0]}, "layers": layers}


def test_a_file_with_an_outline_of_thousands_of_points_is_edited_at_once() -> None:
    outline = [[float(number), 1.5] for number in range(2000)]
    text = with_value("[probe]\ngap_um = 1\n", ("layers",), "heater", outline)
    start = time.process_time()
    changed = with_value(text, ("probe",), "gap_um", 2.0)
    assert time.process_time() - start < 1.0
    assert changed == text.replace("gap_um = 1", "gap_um = 2.0")


def test_layers_change_what_they_are_made_of(tmp_path: Path) -> None:
    name = "palladium-on-nitride.toml"
    text = (EXAMPLES / name).read_text(encoding="utf-8")
    row = _row(text, tmp_path, "track")
    assert (row.role, row.material, row.thickness_um) == ("film", "film", 0.05)
    # what was typed since the row was shown stays
    text = with_value(text, ("layers", "track"), "thickness_um", 0.1)
    changed = with_layer(text, row, "film", "+metal-film/Pt")
    path = tmp_path / name
    path.write_text(changed, encoding="utf-8")
    probe = Probe.from_file(path)
    # the material that nothing is made of any more is gone, and the layer's own name stays
    assert list(probe.materials) == ["nitride", "Pt"]
    assert tomllib.loads(changed)["layers"]["track"]["thickness_um"] == 0.1
    without = with_layer(changed, _row(changed, tmp_path, "track"), "", "")
    assert "track" not in tomllib.loads(without)["layers"]


def test_a_layer_that_got_another_name_since_it_was_shown_is_still_one_layer(
    tmp_path: Path,
) -> None:
    text = "[probe]\nshape = 'drawing'\n[layers]\nheater = '2/0'\n"
    row = _row(text, tmp_path, "heater")
    once = with_layer(text, row, "film", "+metal-film/Pt")
    assert list(tomllib.loads(once)["layers"]) == ["Pt"]
    assert list(tomllib.loads(with_layer(once, row, "", ""))["layers"]) == []


def _row(text: str, folder: Path, name: str) -> LayerRow:
    with contextlib.chdir(folder):
        rows = settable(Report.__new__(Report), text)["layers"]
    return next(row for row in rows if row.name == name)


def test_a_material_is_renamed_wherever_it_is_named(tmp_path: Path) -> None:
    name, old = FILES[0], "film"
    text = (EXAMPLES / name).read_text(encoding="utf-8")
    text += '[prior]\n"film.tcr" = "± 3%" # of the wafer\n[monitor.track]\nregion = "film"\n'
    (tmp_path / "mine.toml").write_text(with_material_renamed(text, old, "my-film"))
    renamed, before = Probe.from_file(tmp_path / "mine.toml"), Probe.from_file(EXAMPLES / name)
    assert dict(renamed.materials)["my-film"] == dict(before.materials)[old]
    assert renamed.stated_priors == {"my-film.tcr": "± 3%"}
    assert renamed.monitors["track"].region == "my-film"
    with pytest.raises(InputError, match="a name that no material has"):
        with_material_renamed(text, old, old)
    inline = "materials = { a = { kind = 'metal-film' } }\n"
    with pytest.raises(InputError, match="in the text of the probe file"):
        with_material_renamed(inline, "a", "b")
