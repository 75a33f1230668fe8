"""Files are written whole or not at all."""

from __future__ import annotations

import pytest

from hotlever.errors import InputError
from hotlever.files import output_folder, whole_file, write_text


def test_a_failure_inside_leaves_the_old_file_and_no_litter(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text("old")

    def fail_half_way():
        with whole_file(path) as temporary:
            temporary.write_text("half")
            raise RuntimeError

    with pytest.raises(RuntimeError):
        fail_half_way()
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_folders_are_refused_as_files_and_files_as_folders(tmp_path):
    with pytest.raises(InputError, match="is a folder"):
        write_text(tmp_path, "x")
    write_text(tmp_path / "a", "x")
    with pytest.raises(InputError, match="cannot be made a folder"):
        output_folder(tmp_path / "a")
