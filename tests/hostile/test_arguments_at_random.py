"""Arguments of which one at least is wrong: status 2, one line, no number, and nothing touched."""

from __future__ import annotations

import itertools
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from corpus import NUMBERS, WORDS
from size import cases

from hotlever.processes import Patience
from limits import time_limit

LIMIT_S = 20.0
#: How many there are with ``make test-hostile``, in this process and in others.
CASES, PROCESSES = 2000, 80
COMMAND = [sys.executable, "-m", "hotlever"]
#: What is no number in bounds, no range, no file to read, no file to write.
NUMBER = [*(one for one in NUMBERS if one not in ("-0", "0", "1_000")), *WORDS, "1e40"]
#: But these are voltages.
VOLTS = ("1,5", "3 V", "-1", "1e-999")
RANGE = [
    *(
        "",
        ":",
        "::",
        "1",
        "1:2",
        "2:1:5",
        "1:2:0",
        "1:2:-1",
        "1:2:1e3",
        "1:2:1.5",
        "a:b:c",
        "1:1:2",
    ),
    *("nan:1:2", "1:inf:3", "0:1e9:3", "-5:5:3", "1:2:3:4", "1:2:99999999999", "0:1e-9:2", "1:2:½"),
]
MISSING = [*("none.csv", "folder", "a/b/c", "\x1b[2J", "x" * 300, "-", "~", "pipe", "empty.csv")]
NO_FILE = [*("folder", "none/a.csv", "mine.csv/a", "pipe", "a" * 300 + ".csv", "data.csv")]
NAME = [
    "nd",
    "N_D",
    "c-kappa",
    "",
    "=",
    "=3",
    "p=",
    "p=nan",
    "p=1e999",
    "p=x",
    "a0=-1",
    "p p",
    "é=1",
]
SETTING = [
    *("gap_um=0", "gap_um=-1", "gap_um=1e9", "gap_um=true", "chip=1", "medium=lava", "nope=1"),
    *("tip.nope=1", "x.y=1", "gap_um", "shape=round", "a1=1", "=", "gap_um=", "length_um=nan"),
    *("n_d=1e30", "p=99", "thickness_um=none", "heater_width_um=20", "base_temperature_K=20"),
]
PRIOR = [
    *("n_d", "n_d=", "n_d=±", "n_d=±-5%", "n_d=3e17±0", "nd=±5%", "n_d=a±b", "n_d=nan±1", "=±5%"),
    *("n_d=3e17±1e999", "dimensions=5", "dimensions=±900%", "n_d=±5%%", "n_d=3e17+-", "none=1"),
]
TIME = [
    "",
    "5",
    "5 parsec",
    "-5us",
    "0us",
    "nanus",
    "infus",
    "1e400s",
    "us",
    "5us,",
    ",5us",
    "5us5us",
]

#: Command, and its options with what is wrong for each; None is the argument without an option.
WRONG: list[tuple[tuple[str, ...], dict[str | None, list[str]]]] = [
    (
        ("sweep",),
        {
            None: [*MISSING, "data.csv"],
            "--bias": [one for one in RANGE if one != "1"],
            "--set": SETTING,
            "--medium": WORDS,
            "--model": WORDS,
            "-o": [*NO_FILE[:4], "a.xls", "a"],
            "--plot": [*NO_FILE[:4], "a.gif", "a"],
            "--map": [*NO_FILE[:4], "a.gif"],
            "--fields": ["mine.csv", "mine.csv/x"],
            "--nope": ["1"],
        },
    ),
    (
        ("fit", "data.csv"),
        {
            "--probe": [*MISSING, "data.csv"],
            "--observables": ["", "tips", "current,", "current tip", "tip,x", "\0"],
            "--fix": NAME,
            "--free": ["nope", "x.y", "", ",", "gap_um,nope"],
            "--weights": WORDS,
            "--prior": PRIOR,
            "--medium": WORDS,
            "--samples": NUMBER,
            "--processes": NUMBER,
            "--column": ["=", "a=b", "V_b=1=2", "nope", "I_h (K)=1", "V_b (V)=99", "I_h (mA)="],
            "-o": NO_FILE,
            "--report": ["mine.csv", "data.csv", "mine.csv/x"],
            "--scheduler": ["tcp://127.0.0.1:1"],
        },
    ),
    (
        ("fit",),
        {None: MISSING},
    ),
    (
        ("calibrate",),
        {None: MISSING},
    ),
    (
        ("calibrate", "data.csv"),
        {
            "--fit": [*MISSING, "data.csv", "law.json"],
            "--probe": [*MISSING, "data.csv"],
            "--power-law": [*MISSING, "data.csv"],
            "--prior": PRIOR,
            "--medium": WORDS,
            "--pulse": TIME,
            "-o": NO_FILE,
            "--table": [*NO_FILE, "a.xls"],
            "--plot": [*NO_FILE, "a.gif"],
        },
    ),
    (
        ("design",),
        {
            None: [*MISSING, "data.csv"],
            "--vary": [
                "gap_um",
                "nope=1:2:3",
                # values of which some can be drawn make a table that says why the others cannot
                *(f"gap_um={one}" for one in RANGE if one not in ("2:1:5", "-5:5:3")),
            ],
            "--power": NUMBER,
            "--annealing-K": NUMBER,
            "--annealing-min": NUMBER,
            "--set": SETTING,
        },
    ),
    (
        ("pulse", "--until", "1us"),
        {
            None: [*MISSING, "data.csv"],
            "--step": [*(one for one in NUMBER if one not in VOLTS), *TIME[2:]],
            "--pulse": [
                "1V",
                "1V,",
                "1V,1",
                "V,5us",
                "1V,-5us",
                "1V,0us",
                "1e9V,5us",
                "1V,5us,5us",
            ],
            "--ramp": ["1V", "1V,", "1V,1", "V,5us", "1V,-5us", "1e-9V,5us"],
            "--sine": ["1V", "1V+1V", "1V+1V@", "1V+1V@5", "1V+2V@1Hz@", "1V+1V@-5Hz", "@1Hz"],
            "--waveform": [*MISSING, "law.json"],
            "--at": ["1us,x", "-1us", "1", ",", "nan"],
        },
    ),
    (
        ("spectrum", "--bias", "5V"),
        {
            None: [*MISSING, "data.csv"],
            "--frequency": ["1Hz:2Hz", "2Hz:1Hz:5", "1:2:3", "1Hz:2Hz:0", "0Hz:1Hz:3", "x"],
            "--amplitude": [*(one for one in NUMBER if one not in VOLTS), "0V"],
        },
    ),
    (("probe", "new"), {"--shape": WORDS, "-o": NO_FILE[:4]}),
    (
        ("probe", "show"),
        {None: [*MISSING, "data.csv", "law.json"], "--plot": [*NO_FILE[:4], "a.gif"]},
    ),
    (("probe", "import"), {None: [*MISSING, "data.csv", "law.json"], "--cell": [""]}),
    (
        ("raman", "data.csv"),
        {
            "--calibration": [*MISSING, "data.csv", "law.json"],
            "--law": WORDS,
            "--shape": WORDS,
            "--resolution": NUMBER,
            "--stress": NUMBER,
            "-o": NO_FILE,
        },
    ),
    (("join",), {None: MISSING}),
    (("cache",), {"--nope": [""], None: WORDS[:1] + WORDS[2:]}),
    ((), {None: [*WORDS[1:], "swep", "FIT", "--versoin"]}),
]


def wrong_cases(count: int) -> list[list[str]]:
    """Return argument lists that are wrong in one place or more, each value once at least."""
    every = [
        [*command, *([] if option is None else [option]), value]
        for command, options in WRONG
        for option, values in options.items()
        for value in values
    ]
    rng = np.random.default_rng(5)
    rng.shuffle(every)
    return [
        case
        for _, case in zip(range(count), itertools.cycle(every), strict=False)
        if not any("\0" in word for word in case)  # no process can be given one
    ]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("data.csv").write_text("V_b (V),I_h (mA)\n1,0.14\n2,0.28\n3,0.43\n")
    Path("mine.csv").write_text("mine")
    Path("empty.csv").touch()
    Path("law.json").write_text('{"linear_K_per_mW": 110}')
    Path("folder").mkdir()
    os.mkfifo("pipe")
    return tmp_path


def state(folder: Path) -> list[tuple[str, bytes]]:
    paths = sorted(folder.rglob("*"))
    return [(str(path), path.read_bytes() if path.is_file() else b"") for path in paths]


def problems(case: list[str], status: int, out: str, err: str) -> Iterator[str]:
    # notes may stand before it
    lines = [line for line in err.splitlines() if line.startswith("hotlever: ")]
    if status != 2 or len(lines) != 1 or len(lines[0]) > 1500:
        yield f"{case}: status {status}, {len(lines)} lines: {err[-300:]!r}"
    if out:
        yield f"{case}: {out[:200]!r}"
    if "Traceback" in err or "internal error" in err:
        yield f"{case}: {err[-300:]!r}"


def test_wrong_arguments_are_one_line(
    folder: Path, run: Callable[..., tuple[int, str, str]], monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr("hotlever.files.PATIENCE_S", 0.05)
    impatient = Patience(scheduler_s=0.5)
    monkeypatch.setattr("hotlever.processes.ClusterExecutor.patience", impatient)
    before, found = state(folder), []
    for case in wrong_cases(cases(CASES)):
        with time_limit(LIMIT_S):
            found += problems(case, *run(*case))
        assert state(folder) == before, case
    assert not found, "\n".join(found)


def test_wrong_arguments_of_a_process_are_one_line(folder: Path):
    before, found = state(folder), []
    for case in wrong_cases(cases(PROCESSES))[::-1]:
        command = [*COMMAND, *case]
        done = subprocess.run(command, capture_output=True, text=True, timeout=60, errors="replace")
        found += problems(case, done.returncode, done.stdout, done.stderr)
        assert state(folder) == before, case
    assert not found, "\n".join(found)
