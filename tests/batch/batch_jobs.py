"""Jobs for tests, importable by name in any process, and a desk at which they report and wait."""

import os
import signal
import socket
import sys
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from bridge.errors import FitError
from bridge.vehicle.config import load_vehicle
from identify.batch.jobs import Job, job_for
from identify.batch.run import run_here

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
PATIENCE_S = 60.0
FILE = load_vehicle("ruvifist:hovering")


def job_on(path, function, file):
    """A job of this module on one recording."""
    # Looking for recordings loads all that reads one, a second in each process that is to run these jobs.
    from identify.batch.recordings import find_recordings

    (recording,) = find_recordings([str(path)]).recordings
    return job_for(f"batch_jobs:{function}", recording, file, "likelihood")


def recordings(folder, count):
    """Files that pass for recordings, each of its own bytes."""
    folder.mkdir()
    for number in range(count):
        (folder / f"dive-{number:02d}.tlog").write_bytes(b"recording %d" % number)
    return sorted(folder.iterdir())


def size(job: Job):
    """How many bytes the recording holds, and who counted them."""
    return {"bytes": sum(file.stat().st_size for file in job.recording.files), "pid": os.getpid()}


def refuse(job: Job):
    raise FitError("says nothing; dive again", of=job.recording.path)


def stumble(job: Job):
    raise ValueError(f"no {job.recording.name}")


def know_nothing(_: Job):
    return {"value": float("nan")}


def die(_: Job):
    os._exit(3)


def threads(_: Job):
    """How many threads the numerical libraries use in this process."""
    import numba
    import torch

    return {"numba": numba.get_num_threads(), "torch": torch.get_num_threads()}


def meet(job: Job):
    """Report at the desk that the environment names, and go on when it says so."""
    host, port = os.environ["TEST_DESK"].split(":")
    with socket.create_connection((host, int(port)), PATIENCE_S) as line:
        line.sendall(f"{os.getpid()} {job.recording.name}\n".encode())
        if not line.recv(1):
            raise ConnectionError("sent away")
    return {"pid": os.getpid()}


@dataclass(frozen=True)
class Visitor:
    """A job that waits at the desk."""

    pid: int
    dive: str
    line: socket.socket

    def go_on(self):
        self.line.sendall(b"!")
        self.line.close()

    def kill(self):
        """Kill its process with nothing left to say."""
        os.kill(self.pid, signal.SIGKILL)
        self.line.close()

    def leaves(self):
        """Wait until its process has hung up."""
        with self.line:
            assert self.line.recv(1) == b""


@contextmanager
def desk(monkeypatch):
    """A place where jobs wait: `next()` gives the next Visitor, or fails after the patience of a test."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.settimeout(PATIENCE_S)
        monkeypatch.setenv("TEST_DESK", "{}:{}".format(*server.getsockname()))

        def visitors():
            while True:
                line, _ = server.accept()
                line.settimeout(PATIENCE_S)
                with line.makefile() as words:
                    pid, dive = words.readline().split()
                yield Visitor(int(pid), dive, line)

        yield visitors()


def python_path():
    """The environment with which another process imports this module and the product."""
    return os.pathsep.join([str(HERE), str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])


def batch_of(folder, function):
    """A batch as a program of its own; exit code 4 where Ctrl-C ends it."""
    # A shell without job control starts its background deaf to Ctrl-C, and so would be what a test starts from there.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    jobs = [job_on(path, function, FILE) for path in sorted(Path(folder).iterdir())]
    try:
        for result in run_here(jobs, 2):
            sys.stdout.write(f"{result.dive}\n")
    except KeyboardInterrupt:
        sys.exit(4)
