"""Memory that is freed and taken again."""

from __future__ import annotations

import subprocess
import sys

import pytest


@pytest.mark.skipif(sys.platform != "linux", reason="it is the GNU library's")
def test_what_a_step_of_a_search_frees_is_there_for_the_next_one():
    """Else the system clears it page by page each time: a tenth of a fit."""
    script = (
        "import resource, numpy as np; from hotlever.work import give_back; give_back()\n"
        "def faults(): return resource.getrusage(resource.RUSAGE_SELF).ru_minflt\n"
        "np.ones(100_000); before = faults()\n"
        "for _ in range(50): np.ones(100_000)\n"
        "print(faults() - before)"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    assert int(done.stdout) < 200  # of 50 arrays of 200 pages each
