"""However a command ends: one line says how, outputs are whole, nothing is left behind."""

from __future__ import annotations

import io
import os
import re
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import pytest

from hotlever import cli
from hotlever.cli import main, output
from hotlever.cli.output import note, progress
from hotlever.tasks.commands import COMMANDS, command_line
from limits import as_in_a_terminal

COMMAND = [sys.executable, "-c", "from hotlever.cli import main; main()"]
LONG = ("sweep", "--bias", "1:11:10000", "-o", "a.csv")


def start(folder: Path, *arguments: str, ignored: str = "", **options) -> subprocess.Popen:
    command = as_in_a_terminal([*COMMAND, *arguments], ignored)
    return subprocess.Popen(command, cwd=folder, stderr=subprocess.PIPE, text=True, **options)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_stopped_by_a_signal(tmp_path, number):
    (tmp_path / "a.csv").write_text("mine")
    with start(tmp_path, *LONG, stdout=subprocess.PIPE) as process:
        time.sleep(1.0)
        process.send_signal(number)
        out, err = process.communicate(timeout=60)
    assert (process.returncode, out, err) == (1, "", "hotlever: stopped by the user\n")
    assert [path.name for path in tmp_path.iterdir()] == ["a.csv"]
    assert (tmp_path / "a.csv").read_text() == "mine"


def test_nothing_is_searched_for_cycles_as_a_command_ends(tmp_path):
    script = (
        "import atexit, gc, sys; from hotlever.cli import main\n"
        "sys.argv = ['hotlever', 'materials']\n"
        "atexit.register(lambda: print(len(gc.get_objects()), file=sys.stderr)); main()"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert int(done.stderr.splitlines()[-1]) < 1000


IN_A_DESTRUCTOR = """
import signal, sys, time
from hotlever import cli

class Short:
    def __del__(self):
        signal.raise_signal(signal.SIGTERM)

def work(arguments):
    Short()
    time.sleep(30.0)
    return 0

cli._run, sys.argv = work, ["hotlever", "sweep"]
cli.main()
"""


def test_a_signal_that_comes_within_a_destructor_is_not_lost(tmp_path):
    """Python lets no exception out of one, nor of what it calls back as it imports."""
    began = time.monotonic()
    ended = subprocess.run(
        as_in_a_terminal([sys.executable, "-c", IN_A_DESTRUCTOR]),
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert (ended.returncode, ended.stderr) == (1, "hotlever: stopped by the user\n")
    assert time.monotonic() - began < 20.0


def test_an_ignored_signal_stays_ignored(tmp_path):
    with start(tmp_path, "probe", "show", ignored="SIGHUP", stdout=subprocess.PIPE) as process:
        time.sleep(0.5)
        process.send_signal(signal.SIGHUP)
        out, err = process.communicate(timeout=60)
    assert (process.returncode, err) == (0, "")
    assert "three-leg" in out


def test_a_full_standard_output_is_said_after_the_files_are_written(tmp_path):
    arguments = ("probe", "show", "--plot", "a.svg")
    with open("/dev/full", "w") as full, start(tmp_path, *arguments, stdout=full) as process:
        err = process.communicate(timeout=60)[1]
    assert process.returncode == 1
    assert err == "hotlever: standard output: cannot be written (No space left on device)\n"
    assert [path.name for path in tmp_path.iterdir()] == ["a.svg"]


def test_a_reader_that_has_gone_is_told_nothing(tmp_path):
    reading, writing = os.pipe()
    os.close(reading)
    arguments = ("probe", "show", "--plot", "a.svg")
    with start(tmp_path, *arguments, stdout=writing) as process:
        os.close(writing)
        err = process.communicate(timeout=60)[1]
    assert (process.returncode, err) == (1, "")
    assert [path.name for path in tmp_path.iterdir()] == ["a.svg"]


def test_nobody_reads_the_notes_and_the_command_goes_on(monkeypatch):
    class Gone(io.StringIO):
        def write(self, text: str) -> int:
            raise BrokenPipeError

    monkeypatch.setattr("sys.stderr", Gone())
    note("the file says so")
    with progress("work") as update:
        update(1, 2)
    note("and again")


@pytest.mark.parametrize("encoding", ["latin-1", "ascii"])
def test_a_terminal_of_few_characters_gets_escapes(tmp_path, encoding):
    environment = {**os.environ, "PYTHONIOENCODING": encoding}
    done = subprocess.run([*COMMAND, "probe", "new"], capture_output=True, env=environment)
    assert (done.returncode, done.stderr) == (0, b"")
    assert rb"profile, \u0394" in done.stdout


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (ZeroDivisionError("some bug"), "internal error: ZeroDivisionError: some bug"),
        (MemoryError(), "internal error: out of memory"),
        (RecursionError("too deep"), "internal error: RecursionError: too deep"),
    ],
)
def test_what_escapes_is_one_line_that_names_a_log(monkeypatch, tmp_path, run, error, words):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))

    def fails(*_):
        raise error

    monkeypatch.setattr("hotlever.tasks.describing.read_probe", fails)
    status, out, err = run("probe", "show")
    assert (status, out, len(err.splitlines())) == (1, "", 1)
    assert words in err
    [log] = (tmp_path / "state").rglob("*.log")
    assert str(log) in err
    assert f"in fails\n    raise error\n{type(error).__name__}" in log.read_text()
    assert "['hotlever', 'probe', 'show']" in log.read_text()


def test_the_log_goes_where_it_can(monkeypatch, tmp_path, run):
    (tmp_path / "state").write_text("a file")
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    monkeypatch.setattr("hotlever.tasks.describing.read_probe", lambda *_: 1 / 0)
    status, _, err = run("probe", "show")
    assert status == 1
    [log] = tmp_path.glob("hotlever-*.log")
    assert str(log) in err


def test_control_characters_do_not_reach_the_terminal(refused):
    line = refused("probe", "show", "\x1b[2Jred\nline\r.toml")
    assert line == "hotlever: [2Jred line .toml: no such file"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("sweep", "--bias", "1:2:2", "--bias", "1:3:3"), "--bias: given twice"),
        (("sweep", "-o", "a.csv", "--output", "b.csv"), "--output: given twice"),
        (("design", "--air", "--no-air"), "--air: given twice"),
        (("sweep", "--set", "p=2", "--set", "p=3"), "--set p: given twice"),
        (("fit", "a.csv", "--fix", "p", "--fix", "p=3"), "--fix p: given twice"),
        (("sweep", "--bias", "0:11:100000"), "COUNT is '100000', expected .* from 1 to 10000"),
        (("sweep", "--bias", "0:11:1e8"), "COUNT is '1e8', expected"),
        (("sweep", "--bias", "0:11:" + "9" * 9000), "COUNT is '9999.*, expected"),
        (("sweep", "--bias", "0:1e999:2"), "found '1e999', expected a number"),
        (("sweep", "--bias", "1e-300:1:2"), "expected 0 or 1e-06 to 10000 V"),
        (("sweep", "--bias", "0:1e300:3"), "found '1e300', expected a number"),
        (("sweep", "--set", "gap_um=inf"), "found 'inf', expected a number"),
        (("sweep", "--set", "gap_um=1e30"), "gap_um = 1e[+]30: .* at most 1000"),
        (("design", "--vary", "gap_um=2:3:99999"), "expected a whole number from 1 to 1000"),
        (("design", "--vary", "gap_um=2:3:1"), "expected START < STOP"),
        (("design", "--vary", "gap_um"), "expected NAME=START:STOP:COUNT"),
        (("design", "--power", "inf"), "--power inf: expected a number from 0.001 to 1000"),
        (("design", "--annealing-K", "1e9"), "--annealing-K 1e[+]09: expected a number"),
        (("fit", "a.csv", "--samples", "10000000"), "--samples 1e[+]07: expected a number from 1"),
        (("fit", "a.csv", "--processes", "100000"), "--processes 100000: expected a number from 1"),
    ],
)
def test_numbers_beyond_reason_and_options_given_twice(refused, tmp_path, arguments, message):
    assert re.search(message, refused(*arguments))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("sweep", "p.toml", "-o", "a.csv", "--plot", "gone/a.svg"), "the folder gone does not"),
        (("sweep", "p.toml", "-o", "a.csv", "--fields", "p.toml"), "cannot be made a folder"),
        (("sweep", "p.toml", "-o", "a.csv", "--fields", "a.csv"), "cannot be made a folder"),
        (("sweep", "p.toml", "-o", "link.csv"), "link.csv: is an input of this command"),
        (("sweep", "p.toml", "-o", "pipe.csv"), "is a pipe, expected a file name to write to"),
        (("probe", "show", "p.toml", "--plot", "folder.png"), "is a folder, expected a file"),
        (("fit", "data.csv", "-o", "data.csv"), "data.csv: is an input of this command"),
        (("fit", "data.csv", "-o", "a.txt"), "a.txt: unknown file type '.txt', expected .json"),
        (("fit", "data.csv", "-o", "/dev/null"), "/dev/null: is a device, expected a file"),
        (("fit", "data.csv", "-o", "a.json", "--report", "a.json"), "two outputs of this name"),
        (("calibrate", "data.csv", "--table", "./data.csv"), "data.csv: is an input of this"),
        (
            ("calibrate", "data.csv", "-o", "x.csv"),
            "x.csv: unknown file type '.csv', expected .json",
        ),
        (("join", "data.csv", "a.csv", "-o", "x.nc"), "unknown file type '.nc', expected .csv"),
        (("probe", "new", "-o", "x.json"), "unknown file type '.json', expected .toml"),
        (("design", "p.toml", "--vary", "gap_um=2:3:2", "-o", "link.csv"), "is an input of this"),
        (("reproduce", "-o", "p.toml"), "p.toml: cannot be made a folder"),
    ],
)
def test_outputs_are_checked_before_any_work(refused, tmp_path, arguments, message):
    (tmp_path / "p.toml").write_text("[probe]\nnothing is read before the outputs are known")
    (tmp_path / "link.csv").symlink_to("p.toml")
    (tmp_path / "data.csv").write_text("V_b (V),I_h (mA)\n1,0.1\n")
    (tmp_path / "a.csv").write_text("mine")
    (tmp_path / "folder.png").mkdir()
    os.mkfifo(tmp_path / "pipe.csv")
    before = sorted(tmp_path.iterdir())
    assert message in refused(*arguments)
    assert sorted(tmp_path.iterdir()) == before
    assert (tmp_path / "a.csv").read_text() == "mine"


def test_a_second_output_that_fails_is_not_begun_and_the_first_is_whole(run, tmp_path, monkeypatch):
    def fails(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("matplotlib.figure.Figure.savefig", fails)
    (tmp_path / "a.csv").write_text("mine")
    status, out, err = run("sweep", "--bias", "1:2:2", "-o", "a.csv", "--plot", "a.png")
    assert (status, out) == (1, "")
    assert err == "hotlever: a.png: cannot be written (No space left on device)\n"
    assert len((tmp_path / "a.csv").read_text().splitlines()) == 3
    assert len(list(tmp_path.iterdir())) == 1


def test_every_command_is_registered():
    assert command_line(lambda *_: 0).commands.keys() == {name.split()[0] for name in COMMANDS}
    with pytest.raises(SystemExit) as ended:
        main(["--version"])
    assert ended.value.code == 0


def test_every_argument_and_option_says_what_it_is():
    """Its help stands in a docstring, under a name that nobody would miss."""
    commands = [command_line(lambda *_: 0)]
    for command in commands:
        commands += getattr(command, "commands", {}).values()
    told = [one for command in commands for one in command.params]
    assert len(told) > 150
    assert [one.name for one in told if not one.help] == []


def test_what_a_stopped_import_says_is_not_an_internal_error(monkeypatch):
    """A compiled module whose initialisation is interrupted raises ImportError instead."""
    error = ImportError("initialization failed")
    assert "internal error" in cli._ended(error, [])[1]
    monkeypatch.setattr(cli, "_received", [signal.SIGINT])
    assert cli._ended(error, []) == (1, "stopped by the user")


def test_progress_is_told_in_lines_where_there_is_no_terminal(run, monkeypatch):
    at_once = partial(output._lines, first_s=0.0, next_s=0.0)
    monkeypatch.setattr(output, "_lines", at_once)
    status, out, err = run("sweep", "--bias", "1:2:2")
    assert status == 0
    assert out.startswith("bias_V,")
    assert err.splitlines()[0].startswith("sweep: ")
    assert " of " in err.splitlines()[0]


@pytest.mark.parametrize(("raised", "status"), [("Stopped", 1), ("KeyboardInterrupt", -2)])
def test_a_stop_within_exec_ends_with_the_exit_status(tmp_path, raised, status):
    """Python would end itself by a signal where a plain KeyboardInterrupt was met in `exec`."""
    script = (
        "from hotlever.cli import Stopped\n"
        f"try:\n    exec('raise {raised}')\nexcept KeyboardInterrupt:\n    raise SystemExit(1)"
    )
    (tmp_path / "stopped.py").write_text(script)
    command = as_in_a_terminal([sys.executable, "-m", "stopped"])
    assert subprocess.run(command, cwd=tmp_path).returncode == status
