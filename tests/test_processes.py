"""Local workers: nobody else can connect, nothing is lost, nothing left behind."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import psutil
import pytest

from hotlever.errors import ComputationError, InputError
from hotlever.processes import Patience, WorkerDiedError, local_executor, run_all
from limits import as_in_a_terminal, processes_below

# --- tasks --------------------------------------------------------------------------------------


def square(number: int) -> int:
    return number**2


def slow(seconds: float) -> float:
    time.sleep(seconds)
    return seconds


def die_once(mark: str) -> str:
    if not Path(mark).exists():
        Path(mark).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return "done"


def die(number: int) -> int:
    if number == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def stop_once(mark: str) -> str:
    if not Path(mark).exists():
        Path(mark).touch()
        os.kill(os.getpid(), signal.SIGSTOP)
    return "done"


def makes_what_cannot_be_sent() -> object:
    return lambda: 1


def fail(kind: str) -> None:
    raise {"input": InputError, "other": ZeroDivisionError}[kind]("the reason")


@pytest.fixture(scope="module")
def workers():
    with local_executor(2) as processes:
        yield processes


# --- tests --------------------------------------------------------------------------------------


def test_every_task_is_done_once_and_known_by_its_number(workers):
    results = dict(run_all(workers, square, ((number,) for number in range(20))))
    assert results == {number: number**2 for number in range(20)}
    assert list(run_all(workers, square, [])) == []


def test_errors_come_back_as_errors(workers):
    results = dict(run_all(workers, fail, [("input",), ("other",)]))
    assert isinstance(results[0], InputError)
    assert str(results[0]) == "the reason"
    assert isinstance(results[1], ComputationError)
    assert str(results[1]) == "ZeroDivisionError: the reason"


def test_a_dead_worker_s_task_is_done_again(workers, tmp_path):
    tasks = [(str(tmp_path / name),) for name in "abc"]
    assert dict(run_all(workers, die_once, tasks)) == dict.fromkeys(range(3), "done")


def test_a_task_that_kills_its_workers_is_given_up_and_the_others_go_on(workers):
    results = dict(run_all(workers, die, [(number,) for number in range(4)]))
    assert str(results.pop(1)) == "every process that tried it died; too little memory?"
    assert results == {0: 0, 2: 2, 3: 3}


def test_a_worker_that_takes_too_long_is_replaced(tmp_path):
    with local_executor(2, Patience(task_s=2.0)) as workers:
        tasks = [(str(tmp_path / name),) for name in "ab"]
        assert dict(run_all(workers, stop_once, tasks)) == dict.fromkeys(range(2), "done")


def test_processes_stopped_at_work_are_ended_by_one_thread_at_a_time(tmp_path, monkeypatch):
    """By whoever ends all, or by the thread that hears of the death: both would close one pipe."""
    shutdown, inside, most = ProcessPoolExecutor.shutdown, [], []

    def slowly(self, **how):
        inside.append(self)
        time.sleep(0.3)
        most.append(inside.count(self))
        shutdown(self, **how)
        inside.remove(self)

    monkeypatch.setattr(ProcessPoolExecutor, "shutdown", slowly)
    with local_executor(1) as workers:
        task = workers.submit(stop_once, str(tmp_path / "mark"))
        while not (tmp_path / "mark").exists():
            time.sleep(0.01)
    assert isinstance(task.exception(), WorkerDiedError)
    # by both, one after the other
    assert most == [1, 1]


def test_nobody_can_connect_to_them():
    """Another user of the machine finds no port: they listen to their pipes."""
    before = psutil.Process().net_connections("inet")
    with local_executor(2):
        assert psutil.Process().net_connections("inet") == before
        assert len(processes_below()) >= 2
        assert not any(process.net_connections("inet") for process in processes_below())


def test_a_task_that_cannot_be_sent_is_an_error(workers):
    results = dict(run_all(workers, square, [(lambda: 1,), (2,)]))
    assert "local object" in str(results[0])
    assert results[1] == 4
    assert "local object" in str(dict(run_all(workers, makes_what_cannot_be_sent, [()]))[0])


SCRIPT = """
import os, sys
from hotlever.processes import local_executor, run_all
sys.path.insert(0, {folder!r})
from limits import processes_below
from test_processes import slow
if __name__ == "__main__":
    with local_executor(2) as workers:
        for _ in run_all(workers, slow, [(0.01,), (0.01,), (60.0,), (60.0,)]):
            print(*(process.pid for process in processes_below()), flush=True)
"""


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGINT])
def test_workers_and_their_folder_end_with_their_parent(tmp_path, number):
    """However it ends; without a cache the workers share a temporary folder."""
    (tmp_path / "script.py").write_text(SCRIPT.format(folder=str(Path(__file__).parent)))
    (tmp_path / "tmp").mkdir()
    environment = {**os.environ, "HOTLEVER_CACHE": "", "TMPDIR": str(tmp_path / "tmp")}
    command = [sys.executable, str(tmp_path / "script.py")]
    with subprocess.Popen(
        as_in_a_terminal(command),
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    ) as process:
        pids = [int(pid) for pid in process.stdout.readline().split()]
        process.send_signal(number)
    assert len(pids) == 2
    deadline = time.monotonic() + 10
    while any(map(psutil.pid_exists, pids)) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not any(map(psutil.pid_exists, pids))
    while list((tmp_path / "tmp").iterdir()) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert list((tmp_path / "tmp").iterdir()) == []


def test_without_a_cache_workers_share_a_folder_that_goes(monkeypatch):
    monkeypatch.setenv("HOTLEVER_CACHE", "")
    with local_executor(1) as workers:
        [(_, folder)] = run_all(workers, os.getenv, [("HOTLEVER_CACHE",)])
        assert Path(folder).parent == Path(tempfile.gettempdir())
    assert not Path(folder).exists()
    assert os.environ["HOTLEVER_CACHE"] == ""


def test_workers_that_do_not_start_are_said(tmp_path):
    """A script without the guard that spawn needs."""
    script = "from hotlever.processes import local_executor\nwith local_executor(1):\n    pass\n"
    (tmp_path / "script.py").write_text(script)
    ended = subprocess.run(
        [sys.executable, str(tmp_path / "script.py")], capture_output=True, text=True, check=False
    )
    assert "ComputationError: the worker processes could not be started" in ended.stderr
