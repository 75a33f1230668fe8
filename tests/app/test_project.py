"""The folder of a project: names, kinds, and what is dropped into it."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hotlever.app.project import LARGEST_FILE, Project, safe_name
from hotlever.errors import InputError


@given(st.text(max_size=300))
def test_names_of_dropped_files_stay_in_the_folder_and_are_no_options(name):
    file_name = safe_name(name)
    assert Path(file_name).name == file_name
    assert file_name[0] not in "-. "
    assert file_name.isprintable()
    assert not set(file_name) & set("<>&\"'`$\\/|;*?")
    assert len(file_name) <= 100


def test_a_dropped_file_replaces_none_of_the_same_name(tmp_path):
    project = Project(tmp_path)
    assert project.take("a.csv", b"1") == "a.csv"
    assert project.take("a.csv", b"2") == "a-2.csv"
    assert project.take("a.csv", b"1") == "a.csv"
    assert project.take("b.txt", b"3", "tip") == "tip/b.txt"
    assert (tmp_path / "a.csv").read_bytes() == b"1"
    assert project.spectra("tip") == ["b.txt"]


def test_what_is_written_has_a_new_name(tmp_path):
    project = Project(tmp_path)
    assert project.free("a", ".toml", ".svg") == "a"
    project.write("a.toml", "1")
    (tmp_path / "a-2.svg").write_text("2")
    assert project.free("a", ".toml", ".svg") == "a-3"
    with pytest.raises(InputError, match=r"a\.toml: is there already, .* such as a-2\.toml"):
        project.write("a.toml", "3")
    assert (tmp_path / "a.toml").read_text() == "1"


def test_nothing_outside_of_the_folder_is_read_or_written(tmp_path):
    project = Project(tmp_path / "inner")
    (tmp_path / "secret.csv").write_text("")
    (tmp_path / "inner" / "link.csv").symlink_to(tmp_path / "secret.csv")
    for name in ("../secret.csv", "/etc/passwd", "link.csv"):
        with pytest.raises(InputError, match="not in the folder"):
            project.path(name)


def test_a_file_that_is_too_large_is_refused(tmp_path):
    with pytest.raises(InputError, match="64 MB"):
        Project(tmp_path).take("a.csv", bytes(LARGEST_FILE + 1))


def test_files_are_told_apart_by_what_they_hold(tmp_path):
    (tmp_path / "one.fit.json").write_text('{"correlation": 1}')
    (tmp_path / "fits-2").mkdir()
    (tmp_path / "fits-2" / "b.json").write_text("{}")
    (tmp_path / "cal.json").write_text('{"route": 1, "power_law": {}}')
    (tmp_path / "bad.json").write_text("{")
    (tmp_path / "list.json").write_text("[1]")
    (tmp_path / "p.toml").write_text("")
    (tmp_path / "m.csv").write_text("")
    (tmp_path / "m.table.csv").write_text("")
    (tmp_path / ".hidden.csv").write_text("")
    (tmp_path / "l.GDS").write_text("")
    project = Project(tmp_path)
    assert project.fits == ["one.fit.json", "fits-2/b.json"]
    assert project.calibrations == ["cal.json"]
    assert project.laws == ["cal.json"]
    assert project.probes == ["p.toml"]
    assert project.data == ["m.csv"]
    assert project.drawings == ["l.GDS"]


def test_a_file_is_no_folder(tmp_path):
    (tmp_path / "a").write_text("")
    with pytest.raises(InputError, match="expected a folder"):
        Project(tmp_path / "a")
