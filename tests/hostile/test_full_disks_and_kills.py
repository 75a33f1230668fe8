"""Full disks, folders that may not be written, and kills, at random bytes and moments."""

from __future__ import annotations

import json
import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import pytest
from size import SHARE, cases

from hotlever.files import Outputs
from hotlever.lever import Lever

Run = Callable[..., tuple[int, str, str]]
COMMAND = [sys.executable, "-m", "hotlever"]
#: How many there are of each with ``make test-hostile``.
DISKS, KILLS = 40, 200
#: Commands, and the files that each writes together.
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
def test_a_disk_that_is_full_at_any_byte_leaves_what_was_there(
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
        assert contents(tmp_path) == before, limit


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
                Outputs().file(tmp_path / name)
                ended = 2
            os._exit(ended)
        assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 1, name
    assert contents(tmp_path) == {"a.csv": b"mine"}


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_a_command_killed_at_any_moment_writes_all_or_nothing(number: int, tmp_path: Path):
    rng = np.random.default_rng(number)
    command = [*COMMAND, "sweep", "--bias", "1:2:3", "-o", "a.csv", "--plot", "a.svg"]
    subprocess.run(command, cwd=tmp_path, check=True, capture_output=True)
    whole = {(tmp_path / "a.csv").read_bytes()}
    (tmp_path / "a.csv").write_text("mine")
    for _ in range(cases(40)):
        with subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.PIPE, text=True) as process:
            with suppress(subprocess.TimeoutExpired):
                process.wait(rng.uniform(0.05, 4.0))
            process.send_signal(number)
            err = process.communicate(timeout=60)[1]
        assert process.returncode in (0, 1, -number)
        assert "Traceback" not in err
        if process.returncode == 0:
            whole.add((tmp_path / "a.csv").read_bytes())
        assert (tmp_path / "a.csv").read_bytes() in {b"mine", *whole}
        names = {path.name for path in tmp_path.iterdir()}
        if number == signal.SIGTERM:
            assert names <= {"a.csv", "a.svg"}
        if "a.svg" not in names:
            assert not whole
    assert len(whole) <= 1


# --- many kills of a batch ------------------------------------------------------------------------


def without_times(path: Path) -> dict[str, Any]:
    content = dict(json.loads(path.read_text()))
    del content["seconds"]
    return content


def workers(parent: int) -> list[psutil.Process]:
    with suppress(psutil.NoSuchProcess):
        every = psutil.Process(parent).children(recursive=True)
        return [one for one in every if any("spawn_main" in word for word in one.cmdline())]
    return []


@pytest.mark.skipif(SHARE < 1, reason="takes many minutes; run with `make test-hostile`")
def test_a_batch_killed_again_and_again_ends_with_the_same_fits(lever: Lever, tmp_path: Path):
    """Parent and workers are killed at random; its scheduler lives in the parent."""
    bias = np.linspace(2.0, 11.0, 9)
    names = [f"lever-{number}.csv" for number in range(6)]
    for number, name in enumerate(names):
        made = lever.with_material(lever.probe.material.with_(c_kappa=0.64 + 0.01 * number))
        sweep = made.sweep(bias)
        rows = zip(bias, sweep.current_mA.values, sweep.tip_K.values, strict=True)
        text = "\n".join(",".join(map(str, row)) for row in rows)
        (tmp_path / name).write_text(f"V_b (V),I_h (mA),T_tip (K)\n{text}\n")
    (tmp_path / "tmp").mkdir()
    environment = {**os.environ, "TMPDIR": str(tmp_path / "tmp")}
    held = [word for name in ("n_d", "p", "a0", "a1") for word in ("--fix", name)]

    def start(out: str) -> subprocess.Popen[str]:
        command = [*COMMAND, "fit", *names, *held, "--processes", "2", "-o", out]
        pipes: Any = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE, "text": True}
        return subprocess.Popen(command, cwd=tmp_path, env=environment, **pipes)

    with start("whole") as process:
        assert process.communicate()[1] is not None
    expected = {path.name: without_times(path) for path in (tmp_path / "whole").glob("*.json")}
    assert len(expected) == len(names)
    rng, kills, batches = np.random.default_rng(7), {"parent": 0, "worker": 0}, 0
    deadline = time.monotonic() + float(os.environ.get("HOTLEVER_KILLS_S", "2400"))
    while sum(kills.values()) < cases(KILLS) and time.monotonic() < deadline:
        batches += 1
        out, ended = f"out-{batches}", None
        while ended is None:
            with start(out) as process:
                while process.poll() is None:
                    late = sum(kills.values()) >= cases(KILLS) or time.monotonic() > deadline
                    with suppress(subprocess.TimeoutExpired):
                        process.wait(None if late else rng.uniform(0.2, 10.0))
                        break
                    if rng.random() < 0.15:
                        kills["parent"] += 1
                        process.kill()
                    elif found := workers(process.pid):
                        kills["worker"] += 1
                        with suppress(psutil.NoSuchProcess):
                            found[rng.integers(len(found))].kill()
                err = process.stderr.read() if process.stderr is not None else ""
            assert "Traceback" not in err, err[-2000:]
            # what was given up, since too many of its workers died, is fitted by the next
            ended = True if process.returncode == 0 else None
        fits = {path.name: without_times(path) for path in (tmp_path / out).glob("*.json")}
        assert fits == expected
    until = time.monotonic() + 20
    while list((tmp_path / "tmp").iterdir()) and time.monotonic() < until:
        time.sleep(0.2)
    print(f"{kills} in {batches} batches")
    assert list((tmp_path / "tmp").iterdir()) == []
