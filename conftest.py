"""What is set before anything loads NumPy, in the processes that tests start too."""

import os

# Tests run side by side on all processors: BLAS threads that wait for each other take a third of
# the processor time, and on a busy machine most of the rest.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
