"""What is set before anything loads NumPy, in the processes that tests start too."""

import os
import sys

import pytest

# Tests run side by side on all processors: BLAS threads that wait for each other take a third of
# the processor time, and on a busy machine most of the rest.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


@pytest.hookimpl(optionalhook=True)
def pytest_handlecrashitem(crashitem: str) -> None:
    """Say at once which test ended its process, for what comes next may hang too."""
    print(f"\nended its process: {crashitem}", file=sys.stderr, flush=True)
