"""A real Dask scheduler and real workers on loopback, each a process of its own, for tests."""

import os
import subprocess
import sys
import threading
from contextlib import contextmanager
from pathlib import Path

import batch_jobs
from distributed import Client

START_WITHIN_S = 30.0
DASK = str(Path(sys.executable).with_name("dask"))


class Cluster:
    """`address` of the scheduler, and its processes."""

    def __init__(self, folder):
        self.folder = folder
        self.processes = []
        self.scheduler = self._start(
            "scheduler", "--host", "127.0.0.1", "--port", "0", stderr=subprocess.PIPE
        )
        self.address = self._address()

    def add_worker(self):
        """A worker with one thread, without a nanny that would raise it from the dead."""
        local = ("--local-directory", str(self.folder))
        return self._start("worker", self.address, "--nthreads", "1", "--no-nanny", *local)

    def wait_for(self, workers):
        if not workers:
            return
        with Client(self.address, timeout=START_WITHIN_S, set_as_default=False) as client:
            client.wait_for_workers(workers, timeout=START_WITHIN_S)

    def close(self):
        for process in self.processes:
            process.kill()
            process.communicate()

    def _start(self, *words, stderr=subprocess.DEVNULL):
        process = subprocess.Popen(
            [DASK, *words, "--no-dashboard"],
            stderr=stderr,
            stdout=subprocess.DEVNULL,
            text=True,
            env={**os.environ, "PYTHONPATH": batch_jobs.python_path()},
        )
        self.processes.append(process)
        return process

    def _address(self):
        """The scheduler's address; its end ends the waiting."""
        guard = threading.Timer(START_WITHIN_S, self.scheduler.kill)
        guard.start()
        try:
            said = next(line for line in self.scheduler.stderr if "Scheduler at:" in line)
        finally:
            guard.cancel()
        return said.split()[-1]


@contextmanager
def cluster(folder, workers):
    """A scheduler with so many workers."""
    running = Cluster(folder)
    try:
        for _ in range(workers):
            running.add_worker()
        running.wait_for(workers)
        yield running
    finally:
        running.close()
