"""The memory of a fit and of a calibration does not grow with the rows of the data."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from size import SHARE

from hotlever.lever import Lever

#: Rows with ``make test-hostile``; a row took 1.1 MB when all were kept.
ROWS = 100_000
MOST_BYTES = 1_000_000_000

#: Runs the command and prints the most memory that it has had, in kB. What the kernel tells of the
#: resources of a process begins with the memory of the one that started it.
SCRIPT = """
import sys
from pathlib import Path
from hotlever.cli import main
try:
    main()
finally:
    status = Path("/proc/self/status").read_text()
    print(status.split("VmHWM:")[1].split()[0], file=sys.stderr)
"""
HELD = [word for name in ("delta", "n_d", "p", "a0", "a1") for word in ("--fix", name)]


LINUX = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="asks Linux for memory")
LONG = pytest.mark.skipif(SHARE < 1, reason="takes long; run with `make test-hostile`")


@LINUX
@LONG
@pytest.mark.parametrize("command", ["fit", "calibrate"])
def test_many_rows_take_no_more_memory_than_a_few(command: str, lever: Lever, tmp_path: Path):
    knots = np.linspace(0.5, 10.5, 60)
    current = lever.sweep(knots).current_mA.values
    bias = np.linspace(0.5, 10.5, ROWS)
    noise = np.random.default_rng(3).normal(1.0, 1e-3, bias.size)
    measured = np.interp(bias, knots, current) * noise
    lines = (f"{v:.5f},{i:.6f}" for v, i in zip(bias, measured, strict=True))
    (tmp_path / "data.csv").write_text("V_b (V),I_h (mA)\n" + "\n".join(lines) + "\n")
    words = [sys.executable, "-c", SCRIPT, command, "data.csv", "-o", "out.json"]
    words += HELD if command == "fit" else []
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode in (0, 1), done.stderr
    assert (tmp_path / "out.json").exists(), done.stderr
    assert int(done.stderr.split()[-1]) * 1024 < MOST_BYTES
