"""One thread a process: as many processes as cores leave no core for a second thread of any."""

import os
import sys

_COUNTS = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
)
_NUMBA_COUNT = "NUMBA_NUM_THREADS"


def one_thread() -> None:
    """Hold numpy, numba and torch to one thread each in this process, whether or not they are loaded yet."""
    for name in _COUNTS:
        os.environ.setdefault(name, "1")
    if (torch := sys.modules.get("torch")) is not None:
        torch.set_num_threads(1)
    if (numba := sys.modules.get("numba")) is None:
        os.environ.setdefault(_NUMBA_COUNT, "1")
    else:
        # Once it is loaded it reads that again when it compiles, and refuses another count than it began with.
        numba.set_num_threads(1)
