"""Files are read with limits, and written whole or not at all."""

from __future__ import annotations

import errno
import json
import os
import resource
import socket
import time
from pathlib import Path
from threading import Thread

import pytest

from hotlever import files
from hotlever.errors import HotleverError, InputError
from hotlever.files import (
    FOLDER,
    check_outputs,
    json_text,
    output_folder,
    read_bytes,
    read_json,
    read_text,
    whole_file,
    write_text,
)

# --- reading ------------------------------------------------------------------------------------


def special(path: Path, kind: str) -> Path:
    """Make what is no regular file."""
    if kind == "folder":
        path.mkdir()
    elif kind == "pipe":
        os.mkfifo(path)
    elif kind == "socket":
        with socket.socket(socket.AF_UNIX) as one:
            one.bind(str(path))
    else:
        path.symlink_to("/dev/zero")
    return path


@pytest.mark.parametrize("kind", ["folder", "pipe", "socket", "device"])
def test_only_regular_files_are_read_or_written(tmp_path, monkeypatch, kind):
    monkeypatch.chdir(tmp_path)  # a socket's name must be short
    special(Path("x"), kind)
    monkeypatch.setattr(files, "PATIENCE_S", 0.1)
    with pytest.raises(InputError, match=r"x: (is a|cannot be read|a pipe without data)"):
        read_text("x")
    with pytest.raises(InputError, match=f"x: is a {kind}, expected a file name to write to"):
        write_text("x", "text")


def test_a_pipe_is_read_to_its_end_however_slow_its_writer(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)

    def write():
        time.sleep(0.1)
        with pipe.open("wb") as file:
            for _ in range(3):
                file.write(b"x" * 100_000)
                file.flush()
                time.sleep(0.05)

    writer = Thread(target=write)
    writer.start()
    content = read_bytes(pipe)
    writer.join()
    assert content == b"x" * 300_000


def test_a_file_is_read_where_only_sockets_can_be_waited_for(tmp_path, monkeypatch):
    """As on Windows."""
    (tmp_path / "a.csv").write_bytes(b"1,2\n")
    monkeypatch.delattr(os, "O_NONBLOCK")
    monkeypatch.setattr("select.select", None)
    assert read_bytes(tmp_path / "a.csv") == b"1,2\n"


def test_a_pipe_that_nobody_writes_to_is_given_up(tmp_path, monkeypatch):
    monkeypatch.setattr(files, "PATIENCE_S", 0.1)
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(InputError, match=r"pipe: a pipe without data for 0\.1 s"):
        read_bytes(tmp_path / "pipe")


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("x" * 5000, "cannot be read .File name too long"),
        ("a\0b", "cannot be read"),
    ],
)
def test_what_is_no_file_gets_one_line(name, words):
    for read in (read_bytes, read_text):
        with pytest.raises(InputError, match=words):
            read(name)


def test_large_files_are_refused_unread(tmp_path):
    with open(tmp_path / "x", "wb") as file:
        file.truncate(10**12)
    with pytest.raises(InputError, match=r"x: larger than the 67\.1 MB that such a file may have"):
        read_text(tmp_path / "x")
    assert len(read_bytes(Path(__file__), 10**6)) > 1000


def test_a_mark_at_the_beginning_is_no_text(tmp_path):
    (tmp_path / "x").write_bytes("\ufeffµ".encode())
    assert read_text(tmp_path / "x") == "µ"
    (tmp_path / "x").write_bytes(b"ab\xff")
    with pytest.raises(InputError, match=r"x: not a text file in utf-8 \(byte 2\)"):
        read_text(tmp_path / "x")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "not valid JSON: Expecting value"),
        ("[" * 100_000, "nested too deeply"),
        ('{"a": ' * 100_000, "nested too deeply"),
        ('{"a": NaN}', "found NaN, expected a finite number"),
        ('{"a": -Infinity}', "found -Infinity, expected a finite number"),
        ('{"a": 1e999}', "found 1e999, expected a finite number"),
        ('{"a": 1' + "0" * 5000 + "}", "found 1000.*, expected a finite number"),
        ('{"a": {"b": 1, "c": 2, "b": 3}}', "the key 'b' is there twice"),
        ("[1, 2]", "holds a list, expected an object"),
        ('{"a": "\x00"}', "Invalid control character"),
    ],
)
def test_json_that_is_none_is_one_line(tmp_path, text, message):
    (tmp_path / "x").write_text(text)
    with pytest.raises(InputError, match=message) as caught:
        read_json(tmp_path / "x")
    assert len(str(caught.value)) < 200
    assert "\n" not in str(caught.value)


def test_json_numbers_keep_their_kind(tmp_path):
    (tmp_path / "x").write_text('{"a": 2, "b": 2.0, "c": 220000000000000000000}')
    values = read_json(tmp_path / "x")
    assert [type(value) for value in values.values()] == [int, float, int]
    assert values["c"] == 220000000000000000000


def test_what_is_no_finite_number_is_null_in_json():
    text = json_text({"a": float("nan"), "b": [1.0, float("inf"), {"c": -float("inf")}], "d": "κ"})
    assert json.loads(text) == {"a": None, "b": [1.0, None, {"c": None}], "d": "κ"}


# --- writing ------------------------------------------------------------------------------------


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


def test_a_full_disk_is_said_with_the_file(tmp_path):
    def fill():
        with whole_file(tmp_path / "a.txt"):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with pytest.raises(HotleverError, match=r"a.txt: cannot be written \(No space left") as caught:
        fill()
    assert caught.value.exit_status == 1
    assert list(tmp_path.iterdir()) == []


def test_a_full_disk_is_known_whatever_the_writer_says(tmp_path):
    """NetCDF, for one, says 'HDF error'."""

    def fill():
        with whole_file(tmp_path / "a.nc"):
            raise RuntimeError("NetCDF: HDF error")

    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, before[1]))
    try:
        with pytest.raises(HotleverError, match=r"a.nc: cannot be written \(File too large\)"):
            fill()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert list(tmp_path.iterdir()) == []


def test_folders_are_refused_as_files_and_files_as_folders(tmp_path):
    with pytest.raises(InputError, match="is a folder"):
        write_text(tmp_path, "x")
    write_text(tmp_path / "a", "x")
    with pytest.raises(InputError, match="cannot be made a folder"):
        output_folder(tmp_path / "a")
    with pytest.raises(InputError, match=r"b: cannot be made a folder \(.*a is a file\)"):
        check_outputs([(tmp_path / "a" / "b", FOLDER)])


def test_a_link_is_followed_and_permissions_are_kept(tmp_path):
    (tmp_path / "there").mkdir()
    target, link = tmp_path / "there" / "data.csv", tmp_path / "link.csv"
    target.write_text("old")
    target.chmod(0o640)
    link.symlink_to(target)
    write_text(link, "new")
    assert link.is_symlink()
    assert target.read_text() == "new"
    assert target.stat().st_mode & 0o777 == 0o640
    write_text(tmp_path / "fresh", "x")
    umask = os.umask(0)
    os.umask(umask)
    assert (tmp_path / "fresh").stat().st_mode & 0o777 == 0o666 & ~umask


@pytest.mark.parametrize("link", [os.link, os.symlink, None])
def test_an_input_is_no_output_by_whatever_name(tmp_path, link):
    data = tmp_path / "data.csv"
    data.write_text("measured")
    name = data
    if link is not None:
        name = tmp_path / "other.csv"
        link(data, name)
    with pytest.raises(InputError, match="is an input of this command"):
        check_outputs([(name, (name.suffix,))], [data])
    assert data.read_text() == "measured"


def test_two_outputs_have_two_names(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    table = "a.csv", (".csv",)
    for other in ((tmp_path / "a.csv", (".csv",)), ("./a.csv", FOLDER)):
        with pytest.raises(InputError, match="two outputs of this name"):
            check_outputs([table, other])


def test_what_cannot_be_an_output_is_known_before(tmp_path):
    with pytest.raises(InputError, match=r"unknown file type '.xls', expected .csv or .nc"):
        check_outputs([(tmp_path / "a.xls", (".csv", ".nc"))])
    with pytest.raises(InputError, match=r"the folder .*none does not exist"):
        check_outputs([(tmp_path / "none" / "a.csv", (".csv",))])
    with pytest.raises(InputError, match=r"cannot be written \(File name too long\)"):
        check_outputs([(tmp_path / ("a" * 300 + ".csv"), (".csv",))])
    check_outputs([(None, (".csv",)), (None, FOLDER)])
    assert list(tmp_path.iterdir()) == []
