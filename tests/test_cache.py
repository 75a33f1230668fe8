"""The cache: only ever saves time, whatever happens to its files."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from hotlever import cache
from hotlever.cache import cache_file, kept_files, store_arrays, stored
from hotlever.errors import InputError

ARRAYS = {"matrix": np.arange(12.0).reshape(3, 4), "names": np.array(["a", "b"])}


@pytest.fixture
def folder(tmp_path, monkeypatch) -> Path:
    monkeypatch.setenv("HOTLEVER_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


def write_cache_file(number: int = 0) -> Path:
    path = cache_file("kind", {"number": number})
    store_arrays(path, ARRAYS)
    return path


def test_what_is_stored_comes_back(folder):
    path = write_cache_file()
    assert path.parent == folder / "kind"
    found = stored(path, dict)
    np.testing.assert_equal(found, ARRAYS)
    assert stored(cache_file("kind", {"number": 1}), dict) is None


def test_any_damage_means_making_it_again(folder):
    path = write_cache_file()
    whole = path.read_bytes()
    header = range(200), range(len(whole) - 200, len(whole))
    for place in (place for part in header for place in part):
        for changed in (whole[place] ^ 0xFF, whole[place] ^ 0x08):
            path.write_bytes(whole[:place] + bytes([changed]) + whole[place + 1 :])
            found = stored(path, lambda arrays: (arrays["matrix"], arrays["names"]))
            if found is not None:
                np.testing.assert_equal(found, tuple(ARRAYS.values()))
            path.unlink(missing_ok=True)
    for content in (b"", b"PK\x03\x04", os.urandom(500), whole[: len(whole) // 2]):
        path.write_bytes(content)
        assert stored(path, dict) is None
        assert not path.exists()


def test_a_file_of_another_content_is_made_again(folder):
    assert stored(write_cache_file(), lambda arrays: arrays["none"]) is None
    assert kept_files(folder) == []


@pytest.mark.parametrize("kind", ["file", "folder", "loop"])
def test_a_cache_that_cannot_be_used_is_no_reason_to_stop(tmp_path, monkeypatch, kind):
    place = tmp_path / "cache"
    monkeypatch.setenv("HOTLEVER_CACHE", str(place))
    path = cache_file("kind", {})
    if kind == "file":
        place.write_text("mine")
    elif kind == "folder":
        path.mkdir(parents=True)
    else:
        place.symlink_to(place)
    store_arrays(path, ARRAYS)
    assert stored(path, dict) is None


def test_keys_follow_the_code(folder, monkeypatch):
    before = cache_file("kind", {"number": 1})
    assert cache_file("kind", {"number": 1}) == before
    monkeypatch.setattr(cache, "_code", lambda: b"another law")
    assert cache_file("kind", {"number": 1}) != before


@pytest.mark.parametrize(
    ("changed", "matters"),
    [
        ("materials/silicon.py", True),
        ("lever/transient/modes.py", True),
        ("spieser2017.py", True),
        ("cli/levers.py", False),
        ("figures/maps.py", False),
    ],
)
def test_a_changed_law_meets_no_old_state(tmp_path, changed, matters):
    package = Path(cache.__file__).parent
    copy = tmp_path / "hotlever"
    shutil.copytree(package, copy, ignore=shutil.ignore_patterns("__pycache__", "examples"))
    before = cache.code_digest(copy)
    assert before == cache.code_digest(package)
    with (copy / changed).open("a") as file:
        file.write("# changed\n")
    assert (cache.code_digest(copy) != before) is matters


def test_all_that_the_makers_import_is_in_the_digest():
    """A package that they begin to import has to be named as one of them."""
    names = [f"hotlever.{name}" for name in cache._MAKERS]
    script = (
        "import importlib, pkgutil, sys\n"
        f"for package in map(importlib.import_module, {names}):\n"
        "    for one in pkgutil.walk_packages(package.__path__, package.__name__ + '.'):\n"
        "        importlib.import_module(one.name)\n"
        "print(*{name.split('.')[1] for name in sys.modules if name.startswith('hotlever.')})"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    package = Path(cache.__file__).parent
    beside = {file.stem for file in package.glob("*.py")}
    assert set(done.stdout.split()) <= {*cache._MAKERS, *beside}


@pytest.mark.skipif(os.geteuid() != 0, reason="needs to become another user")
def test_a_cache_that_may_not_be_read_or_written_only_costs_time(folder):
    path = write_cache_file()
    for mode in (0o000, 0o500):
        child = os.fork()
        if child == 0:  # permissions do not hold for root
            # what waits for a lock that a thread had before the fork ends here
            signal.signal(signal.SIGALRM, signal.SIG_DFL)
            signal.alarm(60)
            os.chmod(folder, mode)
            os.setuid(65534)
            ended = 1
            with suppress(BaseException):
                store_arrays(path, ARRAYS)
                ended = int(stored(path, dict) is not None)
            os._exit(ended)
        assert os.waitpid(child, 0)[1] == 0
    os.chmod(folder, 0o700)
    assert stored(path, dict) is not None


def test_what_was_not_used_for_longest_goes_first(folder, monkeypatch):
    size = write_cache_file().stat().st_size
    paths = [write_cache_file(number) for number in range(4)]
    for age, path in enumerate(paths):
        os.utime(path, (1000 + age, 1000 + age))
    assert stored(paths[0], dict) is not None
    monkeypatch.setenv("HOTLEVER_CACHE_GB", str(3.5 * size / 1e9))
    last = write_cache_file(4)
    assert {path for _, path in kept_files(folder)} == {paths[0], paths[3], last}


@pytest.mark.parametrize("size", ["much", "-1", "nan"])
def test_a_size_that_is_none_is_said(folder, monkeypatch, size):
    monkeypatch.setenv("HOTLEVER_CACHE_GB", size)
    with pytest.raises(InputError, match=f"HOTLEVER_CACHE_GB = {size}: expected a number"):
        write_cache_file()


def test_the_command_shows_and_clears_and_leaves_other_files(folder, run, monkeypatch):
    write_cache_file()
    foreign = folder / "kind" / "mine.npz"
    foreign.write_text("mine")
    status, out, _ = run("cache")
    assert status == 0
    assert out.splitlines()[0] == f"{folder} (at most 2 GB)"
    assert out.splitlines()[1].split()[:3] == ["kind", "1", "files"]
    assert run("cache", "--clear")[1].splitlines()[-1].split()[:3] == ["in", "all", "0"]
    assert list(folder.rglob("*.npz")) == [foreign]
    monkeypatch.setenv("HOTLEVER_CACHE", "")
    assert "switched off" in run("cache")[1]
