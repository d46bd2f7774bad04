"""One thread for each process of a batch: with as many processes as cores, a second thread would have no core."""

import os
import sys

_COUNTS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")


def one_thread() -> None:
    """Limit numpy, numba and torch to one thread each in this process, whether they are imported yet or not."""
    for name in _COUNTS:
        os.environ.setdefault(name, "1")
    if (torch := sys.modules.get("torch")) is not None:
        torch.set_num_threads(1)
    if (numba := sys.modules.get("numba")) is None:
        os.environ.setdefault("NUMBA_NUM_THREADS", "1")
    else:
        # A loaded numba reads the variable again when it compiles, and refuses a count other than its first.
        numba.set_num_threads(1)
