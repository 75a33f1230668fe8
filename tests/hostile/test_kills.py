"""Kills of commands, of batches and of what does their work, at random moments."""

from __future__ import annotations

import json
import math
import os
import signal
import socket
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import pytest
from size import SHARE, cases

from hotlever.lever import Lever
from limits import processes_below

COMMAND = [sys.executable, "-m", "hotlever"]
#: How many there are with ``make test-hostile``: of batches on this machine and on a cluster, and
#: of posteriors.
KILLS = {"local": 140, "cluster": 60, "posterior": 20}
#: Held, so that a fit is quick.
HELD = [word for name in ("n_d", "p", "a0", "a1") for word in ("--fix", name)]
MANY = pytest.mark.skipif(SHARE < 1, reason="takes many minutes; run with `make test-hostile`")


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


def same(content: Any, expected: Any) -> bool:
    """Whether two files hold the same, up to rounding.

    The pivots of a factorisation may be those of a matrix that the same process had before.
    """
    if isinstance(content, dict) and isinstance(expected, dict):
        return content.keys() == expected.keys() and all(
            same(content[name], value) for name, value in expected.items()
        )
    if isinstance(content, list) and isinstance(expected, list):
        return len(content) == len(expected) and all(map(same, content, expected))
    if isinstance(content, float) and isinstance(expected, float):
        return math.isclose(content, expected, rel_tol=1e-5, abs_tol=1e-12)
    return bool(content == expected)


def write_levers(lever: Lever, folder: Path) -> list[str]:
    bias, names = np.linspace(2.0, 11.0, 9), [f"lever-{number}.csv" for number in range(6)]
    for number, name in enumerate(names):
        similar_lever = lever.with_material(
            lever.probe.material.with_(c_kappa=0.64 + 0.01 * number)
        )
        sweep = similar_lever.sweep(bias)
        rows = zip(bias, sweep.current_mA.values, sweep.tip_K.values, strict=True)
        text = "\n".join(",".join(map(str, row)) for row in rows)
        (folder / name).write_text(f"V_b (V),I_h (mA),T_tip (K)\n{text}\n")
    return names


class Cluster:
    """A scheduler and two workers of this machine, started again when something is missing."""

    def __init__(self) -> None:
        with socket.create_server(("127.0.0.1", 0)) as found:
            self.address = f"tcp://127.0.0.1:{found.getsockname()[1]}"
        self._processes: list[subprocess.Popen[bytes]] = []

    @property
    def options(self) -> list[str]:
        return ["--scheduler", self.address]

    def ready(self) -> None:
        if self._processes and all(one.poll() is None for one in self._processes):
            return
        self.end()
        port = self.address.rpartition(":")[2]
        commands = (
            ["scheduler", "--host", "127.0.0.1", "--port", port, "--no-dashboard"],
            ["worker", self.address, "--nworkers", "2", "--nthreads", "1", "--no-dashboard"],
        )
        quiet: Any = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        for command in commands:
            words = [sys.executable, "-m", "distributed.cli.dask_" + command[0], *command[1:]]
            self._processes.append(subprocess.Popen(words, start_new_session=True, **quiet))

    def kill(self, rng: np.random.Generator) -> str:
        scheduler, nannies = (psutil.Process(one.pid) for one in self._processes)
        workers = processes_below(nannies)
        if not workers or rng.random() < 0.15:
            scheduler.kill()
            return "scheduler"
        workers[rng.integers(len(workers))].kill()
        return "worker"

    def end(self) -> None:
        for one in self._processes:
            with suppress(ProcessLookupError):
                os.killpg(one.pid, signal.SIGKILL)
            one.wait()
        self._processes = []


class Local:
    """Worker processes of the command itself; its scheduler lives in it."""

    options = ("--processes", "2")

    def ready(self) -> None:
        pass

    def kill(self, rng: np.random.Generator) -> str:
        """Return what was killed, if anything was there."""
        workers = processes_below()
        if workers:
            workers[rng.integers(len(workers))].kill()
        return "worker" if workers else ""

    def end(self) -> None:
        pass


@contextmanager
def emptied(folder: Path) -> Iterator[dict[str, str]]:
    """Give an environment with a temporary folder; in the end nothing is left in it."""
    folder.mkdir()
    yield {**os.environ, "TMPDIR": str(folder)}
    until = time.monotonic() + 20
    while list(folder.iterdir()) and time.monotonic() < until:
        time.sleep(0.2)
    assert list(folder.iterdir()) == []


@MANY
@pytest.mark.parametrize("where", ["local", "cluster"])
def test_a_batch_killed_again_and_again_ends_with_the_same_fits(
    where: str, lever: Lever, tmp_path: Path
):
    """The same command is given again until it ends well."""
    names = write_levers(lever, tmp_path)
    command = [*COMMAND, "fit", *names, *HELD]
    subprocess.run([*command, "-o", "whole"], cwd=tmp_path, check=True, capture_output=True)
    expected = {path.name: without_times(path) for path in (tmp_path / "whole").glob("*.json")}
    assert len(expected) == len(names)
    rng, kills, batches = np.random.default_rng(7), Counter[str](), 0
    many, deadline = cases(KILLS[where]), time.monotonic() + 2400
    with ExitStack() as stack:
        environment = stack.enter_context(emptied(tmp_path / "tmp"))
        workers = Local() if where == "local" else Cluster()
        stack.callback(workers.end)
        pipes: Any = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE, "text": True}
        while kills.total() < many and time.monotonic() < deadline:
            batches += 1
            out, status = f"out-{batches}", None
            # what was given up, since too many workers died or the scheduler is lost, is fitted
            # by the next
            while status != 0:
                workers.ready()
                words = [*command, *workers.options, "-o", out]
                with subprocess.Popen(words, cwd=tmp_path, env=environment, **pipes) as process:
                    while process.poll() is None:
                        late = kills.total() >= many or time.monotonic() > deadline
                        with suppress(subprocess.TimeoutExpired):
                            process.wait(600 if late else rng.uniform(0.2, 10.0))
                            break
                        assert not late, "hangs"
                        if rng.random() < 0.15:
                            process.kill()
                            kills["parent"] += 1
                        elif killed := workers.kill(rng):
                            kills[killed] += 1
                    err = process.stderr.read() if process.stderr is not None else ""
                status = process.returncode
                assert "Traceback" not in err, err[-2000:]
            fits = {path.name: without_times(path) for path in (tmp_path / out).glob("*.json")}
            assert same(fits, expected)
    print(f"{dict(kills)} in {batches} batches")


@MANY
def test_a_posterior_killed_again_and_again_is_the_same_and_leaves_nothing(
    lever: Lever, tmp_path: Path
):
    name = write_levers(lever, tmp_path)[0]
    command = [*COMMAND, "fit", name, *HELD, "--posterior", "--samples", "400"]
    command += ["--processes", "2", "-o"]
    subprocess.run([*command, "whole.json"], cwd=tmp_path, check=True, capture_output=True)
    expected = without_times(tmp_path / "whole.json")
    rng, kills = np.random.default_rng(11), Counter[str]()
    pipes: Any = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE, "text": True}
    with emptied(tmp_path / "tmp") as environment:
        while kills.total() < cases(KILLS["posterior"]):
            (tmp_path / "out.json").write_text("mine")
            words = [*command, "out.json"]
            with subprocess.Popen(words, cwd=tmp_path, env=environment, **pipes) as process:
                with suppress(subprocess.TimeoutExpired):
                    process.wait(rng.uniform(1.0, 15.0))
                of_it = psutil.Process(process.pid).children(recursive=True)
                if rng.random() < 0.5:
                    process.kill()
                    kills["parent"] += 1
                elif killed := Local().kill(rng):
                    kills[killed] += 1
                err = process.communicate(timeout=600)[1]
            assert "Traceback" not in err, err[-2000:]
            if process.returncode == 0:
                assert same(without_times(tmp_path / "out.json"), expected)
            else:
                assert (tmp_path / "out.json").read_text() == "mine"
            # all but those that remove its folder
            _, left = psutil.wait_procs(of_it, timeout=20)
            assert left == []
    print(f"{dict(kills)}")
