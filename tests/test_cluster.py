"""Local workers: nobody else can connect, nothing is lost, nothing left behind."""

from __future__ import annotations

import os
import signal
import socket
import ssl
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path

import dask
import psutil
import pytest
from distributed import LocalCluster, Security

from hotlever.cluster import local_client, remote_client, run_all
from hotlever.errors import ComputationError, InputError

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


def fail(kind: str) -> None:
    raise {"input": InputError, "other": ZeroDivisionError}[kind]("the reason")


@pytest.fixture(scope="module")
def client():
    with local_client(2) as made:
        yield made


def workers() -> list[psutil.Process]:
    found = psutil.Process().children(recursive=True)
    return [one for one in found if any("spawn_main" in word for word in one.cmdline())]


# --- tests --------------------------------------------------------------------------------------


def test_every_task_is_done_once_and_known_by_its_number(client):
    found = dict(run_all(client, square, ((number,) for number in range(20))))
    assert found == {number: number**2 for number in range(20)}
    assert list(run_all(client, square, [])) == []


def test_errors_come_back_as_errors(client):
    found = dict(run_all(client, fail, [("input",), ("other",)]))
    assert isinstance(found[0], InputError)
    assert str(found[0]) == "the reason"
    assert isinstance(found[1], ComputationError)
    assert str(found[1]) == "ZeroDivisionError: the reason"


def test_a_dead_worker_s_task_is_done_again(client, tmp_path):
    tasks = [(str(tmp_path / name),) for name in "abc"]
    assert dict(run_all(client, die_once, tasks)) == dict.fromkeys(range(3), "done")


def test_a_task_that_kills_its_workers_is_given_up_and_the_others_go_on(client):
    found = dict(run_all(client, die, [(number,) for number in range(4)]))
    assert str(found.pop(1)) == "every process that tried it died; too little memory?"
    assert found == {0: 0, 2: 2, 3: 3}


def test_a_stopped_worker_is_replaced(tmp_path, monkeypatch):
    monkeypatch.setattr("hotlever.cluster._SILENT_S", 2)
    with local_client(2) as client:
        tasks = [(str(tmp_path / name),) for name in "ab"]
        assert dict(run_all(client, stop_once, tasks)) == dict.fromkeys(range(2), "done")


def listening() -> set[int]:
    """Ports that this process and its workers listen to."""
    return {
        one.laddr.port
        for process in (psutil.Process(), *workers())
        for one in process.net_connections("inet")
        if one.status == psutil.CONN_LISTEN
    }


def encrypted_hello(port: int) -> None:
    """Connect as anybody could, without a certificate."""
    anybody = ssl.create_default_context()
    anybody.check_hostname, anybody.verify_mode = False, ssl.CERT_NONE
    address = ("127.0.0.1", port)
    with socket.create_connection(address, 2) as plain, anybody.wrap_socket(plain) as encrypted:
        encrypted.sendall(b"hello")
        if not encrypted.recv(1):
            raise ConnectionError("closed")


def test_nobody_without_credentials_is_answered(client):
    """Another user of the machine finds the ports, but neither a scheduler nor a page."""
    ports = listening()
    assert ports
    for port in ports:
        with pytest.raises(OSError, match=r"(?i)ssl|closed|reset"):
            encrypted_hello(port)
        with socket.create_connection(("127.0.0.1", port), 2) as plain, suppress(OSError):
            plain.sendall(b"GET /info/main/workers.html HTTP/1.0\r\n\r\n")
            assert b" 200 " not in plain.recv(4096)


SCRIPT = """
import os, sys
from hotlever.cluster import local_client, remote_client, run_all
sys.path.insert(0, {folder!r})
from test_cluster import slow, workers
if __name__ == "__main__":
    with local_client(2) as client:
        for _ in run_all(client, slow, [(0.01,), (0.01,), (60.0,), (60.0,)]):
            print(*(one.pid for one in workers()), flush=True)
"""


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGINT])
def test_workers_and_their_folder_end_with_their_parent(tmp_path, number):
    """However it ends; without a cache the workers share a temporary folder."""
    (tmp_path / "script.py").write_text(SCRIPT.format(folder=str(Path(__file__).parent)))
    (tmp_path / "tmp").mkdir()
    environment = {**os.environ, "HOTLEVER_CACHE": "", "TMPDIR": str(tmp_path / "tmp")}
    command = [sys.executable, str(tmp_path / "script.py")]
    with subprocess.Popen(
        command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
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
    with local_client(1) as client:
        [(_, folder)] = run_all(client, os.getenv, [("HOTLEVER_CACHE",)])
        assert Path(folder).parent == Path(tempfile.gettempdir())
    assert not Path(folder).exists()
    assert os.environ["HOTLEVER_CACHE"] == ""


def test_workers_that_do_not_start_are_said(tmp_path):
    """A script without the guard that spawn needs."""
    script = "from hotlever.cluster import local_client\nwith local_client(1):\n    pass\n"
    (tmp_path / "script.py").write_text(script)
    ended = subprocess.run(
        [sys.executable, str(tmp_path / "script.py")], capture_output=True, text=True, check=False
    )
    assert "ComputationError: the worker processes could not be started" in ended.stderr


@pytest.fixture
def credentials(tmp_path, monkeypatch):
    """Files of credentials, as the settings name them that the environment makes."""
    made = Security.temporary()
    files = {
        "ca-file": "tls_ca_file",
        "client.cert": "tls_client_cert",
        "client.key": "tls_client_key",
    }
    for attribute in files.values():
        (tmp_path / attribute).write_text(getattr(made, attribute))
    settings = {f"distributed.comm.tls.{key}": str(tmp_path / name) for key, name in files.items()}
    with dask.config.set(settings):
        yield made


def test_a_scheduler_with_tls_is_found_by_dask_s_settings(credentials):
    options = {"n_workers": 1, "threads_per_worker": 1, "processes": False, "protocol": "tls"}
    with (
        LocalCluster(security=credentials, dashboard_address="127.0.0.1:0", **options) as cluster,
        remote_client(cluster.scheduler_address) as client,
    ):
        assert cluster.scheduler_address.startswith("tls://")
        assert dict(run_all(client, square, [(3,)])) == {0: 9}


@pytest.mark.parametrize(
    ("missing", "words"),
    [(None, "no credentials for TLS, expected .*CA_FILE is not set"), ("none.pem", "no such file")],
)
def test_tls_without_credentials_is_one_line(missing, words):
    settings = {"distributed.comm.tls.ca-file": missing}
    with dask.config.set(settings), pytest.raises(InputError, match=words):
        remote_client("tls://127.0.0.1:1").__enter__()
