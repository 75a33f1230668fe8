"""Disks that are full at random bytes, and folders that may not be written."""

from __future__ import annotations

import os
import resource
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np
import pytest
from size import cases

from hotlever.files import check_outputs

Run = Callable[..., tuple[int, str, str]]
#: How many there are of each command with ``make test-hostile``.
DISKS = 40
#: Commands, and the files that each writes.
WRITERS = {
    ("probe", "new", "-o", "a.toml"): ["a.toml"],
    ("probe", "show", "--plot", "a.svg"): ["a.svg"],
    ("raman", "line.txt", "-o", "a.csv"): ["a.csv"],
    ("sweep", "--bias", "1:2:2", "-o", "a.csv", "--plot", "a.pdf"): ["a.csv", "a.pdf"],
    ("sweep", "--bias", "1:2:2", "-o", "a.nc"): ["a.nc"],
    ("sweep", "--bias", "1:2:2", "--fields", "out"): ["out/fields.pvd"],
}


@contextmanager
def largest_file(size: int) -> Iterator[None]:
    """Let no file grow beyond so many bytes: the disk is full there."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def contents(folder: Path) -> dict[str, bytes]:
    paths = (path for path in folder.rglob("*") if path.is_file())
    return {str(path.relative_to(folder)): path.read_bytes() for path in paths}


def line(folder: Path) -> None:
    x = np.linspace(440.0, 600.0, 161)
    y = 1e3 + 1e4 / (1 + ((x - 520.4) / 2.0) ** 2)
    text = "".join(f"{a:.3f}\t{b:.1f}\n" for a, b in zip(x, y, strict=True))
    (folder / "line.txt").write_text(text)


# writers of PDF and NetCDF leave a file open that they could not write
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.filterwarnings("ignore::ResourceWarning")
@pytest.mark.parametrize("command", WRITERS, ids=" ".join)
def test_a_disk_that_is_full_at_any_byte_leaves_each_file_as_it_was_or_whole(
    command: tuple[str, ...], run: Run, tmp_path: Path
):
    line(tmp_path)
    assert run(*command)[0] == 0
    written = contents(tmp_path)
    sizes = [len(written[name]) for name in written if name != "line.txt"]
    rng = np.random.default_rng(len(command))
    for limit in rng.integers(0, max(sizes), cases(DISKS)).tolist():
        for name in WRITERS[command]:
            (tmp_path / name).write_text("mine")
        before = contents(tmp_path)
        with largest_file(limit):
            status, _, err = run(*command)
        assert status == 1, (limit, err)
        assert len([one for one in err.splitlines() if one.startswith("hotlever: ")]) == 1
        assert "cannot be written (File too large)" in err, (limit, err)
        for name, content in contents(tmp_path).items():
            # a picture in PDF has its date in it, and the same length at any
            whole = name in written and len(content) == len(written[name])
            assert content == before.get(name) or whole, (limit, name)


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A disk of 64 kB of its own."""
    folder = tmp_path / "disk"
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", str(folder)]
    with suppress(FileNotFoundError):
        if subprocess.run(mount, capture_output=True).returncode == 0:
            yield folder
            # NetCDF keeps a file open that it could not write
            subprocess.run(["umount", "--lazy", str(folder)], check=True)
            return
    pytest.skip("a disk cannot be mounted here")


def test_a_real_disk_that_is_full_is_said(small_disk: Path, run: Run):
    (small_disk / "filler").write_bytes(bytes(60_000))
    before = contents(small_disk)
    for name in ("a.csv", "a.svg", "a.nc"):
        option = "--plot" if name == "a.svg" else "-o"
        status, _, err = run("sweep", "--bias", "1:2:100", option, str(small_disk / name))
        assert status == 1, name
        assert "cannot be written (No space left on device)" in err
        assert contents(small_disk) == before


@pytest.mark.skipif(os.geteuid() != 0, reason="needs to become another user")
def test_a_folder_that_may_not_be_written_is_said_before_any_work(tmp_path: Path):
    tmp_path.chmod(0o755)
    (tmp_path / "a.csv").write_text("mine")
    for name in ("a.csv", "b.csv"):
        # permissions do not hold for root
        child = os.fork()
        if child == 0:
            ended = 1
            with suppress(BaseException):
                os.setuid(65534)
                check_outputs([(tmp_path / name, (".csv",))])
                ended = 2
            os._exit(ended)
        assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 1, name
    assert contents(tmp_path) == {"a.csv": b"mine"}
