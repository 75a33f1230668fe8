"""However a measurement ends, the output is off, or it is said aloud that nobody knows."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator

import psutil
import pytest
from test_source_meter import resistor

from hotlever.errors import InstrumentError
from hotlever.instruments.supervisor import Supervisor, Supply
from hotlever.instruments.twin import TwinBench
from limits import as_in_a_terminal

pytest.importorskip("pyvisa")

#: What is done in a process of its own: the bias is set, then the process waits.
SCRIPT = """
import sys, time
from hotlever.instruments.supervisor import Supervisor, Supply

if __name__ == "__main__":
    with Supervisor(Supply(sys.argv[1], timeout_s=1.0)) as instrument:
        instrument.set_bias(3.0)
        print(instrument._process.pid, flush=True)
        while True:
            time.sleep(0.05)
            instrument.read()
"""


@pytest.fixture
def twin() -> Iterator[TwinBench]:
    with TwinBench(resistor(), noise=0.0) as bench:
        yield bench


@pytest.fixture
def measuring(twin, tmp_path) -> Iterator[tuple[subprocess.Popen[str], int]]:
    """Start a process that measures; gives it, and the process that supervises."""
    script = tmp_path / "measuring.py"
    script.write_text(SCRIPT)
    command = as_in_a_terminal([sys.executable, str(script), twin.source])
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    with subprocess.Popen(command, **pipes) as process:
        try:
            assert process.stdout is not None
            supervisor = int(process.stdout.readline())
            assert (twin.output_on, twin.bias_V) == (True, 3.0)
            yield process, supervisor
        finally:
            process.kill()


def is_off(twin: TwinBench) -> bool:
    """Wait until the output is off."""
    deadline = time.monotonic() + 20.0
    while twin.output_on and time.monotonic() < deadline:
        time.sleep(0.02)
    return not twin.output_on


def test_the_output_is_on_within_the_context_and_off_behind_it(twin):
    with Supervisor(Supply(twin.source, twin.reader)) as instrument:
        instrument.set_bias(2.0)
        assert instrument.read() == pytest.approx((2.0, 0.2, 0.5, False))
        assert twin.output_on
    assert not twin.output_on


def test_it_is_off_after_an_error(twin):
    def measure() -> None:
        with Supervisor(Supply(twin.source)) as instrument:
            instrument.set_bias(2.0)
            assert twin.output_on
            raise OSError("no space left on the disk")

    with pytest.raises(OSError, match="disk"):
        measure()
    assert not twin.output_on


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_it_is_off_after_the_command_is_stopped_or_killed(twin, measuring, number):
    process, _ = measuring
    process.send_signal(number)
    assert is_off(twin)


def test_the_supervising_process_does_not_hear_what_stops_a_command_and_may_be_killed(
    twin, measuring
):
    process, supervisor = measuring
    os.kill(supervisor, signal.SIGINT)
    os.kill(supervisor, signal.SIGTERM)
    time.sleep(0.2)
    assert process.poll() is None
    assert psutil.pid_exists(supervisor)
    assert twin.output_on
    os.kill(supervisor, signal.SIGKILL)
    assert is_off(twin)
    _, err = process.communicate(timeout=60)
    assert "supervises the source meter died" in err
    assert "MAY STILL BE ON" not in err


def test_it_is_off_at_once_though_nothing_is_asked_of_the_process_that_was_killed(twin):
    """A measurement computes for seconds between two readings."""

    def measure() -> None:
        with Supervisor(Supply(twin.source)) as instrument:
            instrument.set_bias(2.0)
            killed = time.monotonic()
            os.kill(instrument._process.pid, signal.SIGKILL)
            assert is_off(twin)
            assert time.monotonic() - killed < 2.0
            instrument.read()

    with pytest.raises(InstrumentError, match="supervises the source meter died") as raised:
        measure()
    assert "MAY STILL BE ON" not in str(raised.value)


def test_a_lost_line_is_said_aloud(twin):
    def measure() -> None:
        with Supervisor(Supply(twin.source, timeout_s=0.5, turn_off_s=0.5)) as instrument:
            instrument.set_bias(2.0)
            twin.break_lines()
            instrument.read()

    with pytest.raises(InstrumentError, match="MAY STILL BE ON"):
        measure()
    assert twin.output_on


def test_a_line_that_is_lost_as_the_output_is_turned_on_is_said_aloud():
    class Breaking(TwinBench):
        def source_answer(self, message: str) -> str | None:
            answer = super().source_answer(message)
            if self.output_on:
                self.break_lines()
            return answer

    with (
        Breaking(resistor()) as twin,
        pytest.raises(InstrumentError, match="MAY STILL BE ON"),
    ):
        Supervisor(Supply(twin.source, timeout_s=0.5, turn_off_s=0.5)).__enter__()
    assert twin.output_on


def test_a_line_lost_when_nobody_is_there_any_more_is_said_too(twin, measuring):
    process, _ = measuring
    twin.break_lines()
    _, err = process.communicate(timeout=60)
    assert process.returncode == 1
    assert "MAY STILL BE ON" in err
