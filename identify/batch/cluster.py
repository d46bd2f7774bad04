"""A batch on a Dask cluster: jobs as parcels of bytes, for computers that do not see our disk.

The scheduler reassigns the parcels of a worker that died.
"""

import logging
import os
import tempfile
import time
import zlib
from collections.abc import Generator, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from queue import Empty, SimpleQueue

import dask
from distributed import Client, Future, KilledWorker

from bridge.errors import LinkLost, LinkTimeout
from identify.batch.code_version import our_version
from identify.batch.jobs import (
    Job,
    Result,
    definitions,
    one_thread,
    own_columns,
    run_job,
    thrust_table,
)

FAST = 1
"""Compression level of zlib: a recording shrinks by a third in a quarter of a second."""

ANSWER_WITHIN_S = 10.0
WORKERS_WITHIN_S = 30.0
LOOK_EVERY_S = 1.0
LARGEST_PARCEL = "4GiB"
AHEAD = 2
"""Parcels in flight per worker thread: enough that no thread waits for the network, few enough to limit memory."""

KEPT = "finished dives are kept, run the same again to go on"


@dataclass(frozen=True)
class Parcel:
    """A packed job: the sender's version and folder, and every file that the job reads, by its path, compressed."""

    job: Job
    version: str
    home: Path
    data: Mapping[Path, bytes]

    def place(self, folder: Path, path: Path) -> Path:
        """Where a path of the sender's lies below a folder of the worker's."""
        whole = Path(os.path.normpath(self.home / path))
        return folder / whole.relative_to(whole.anchor)


def pack(job: Job) -> Parcel:
    """Pack a job with every file that it reads. Raises OSError if a file is gone."""
    maybe = (own_columns(job.recording), job.columns, thrust_table(job.vehicle))
    files = (
        *job.recording.files,
        *definitions(job.recording),
        job.vehicle.path,
        *(file for file in maybe if file is not None),
    )
    data = {file: zlib.compress(file.read_bytes(), FAST) for file in files}
    return Parcel(job, our_version(), Path.cwd(), data)


def unpack(parcel: Parcel, folder: Path) -> Job:
    """Write the files below `folder`, as they lie at the sender's, and return the job with their paths."""
    for file, data in parcel.data.items():
        path = parcel.place(folder, file)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(zlib.decompress(data))
    job, recording = parcel.job, parcel.job.recording
    return replace(
        job,
        recording=replace(
            recording,
            path=parcel.place(folder, recording.path),
            files=tuple(parcel.place(folder, file) for file in recording.files),
        ),
        vehicle=replace(job.vehicle, path=parcel.place(folder, job.vehicle.path)),
        columns=parcel.place(folder, job.columns) if job.columns else None,
    )


def run_parcel(parcel: Parcel) -> Result:
    """Unpack a job, run it and delete its files. Errors name the files by the sender's paths.

    Fails if the worker's version of seatrial differs from the sender's.
    """
    if our_version() != parcel.version:
        return parcel.job.failed(
            f"its worker has seatrial {our_version()}, the sender has {parcel.version}; install the same on both",
            final=False,
        )
    one_thread()
    with tempfile.TemporaryDirectory(prefix="seatrial-") as place:
        folder = Path(place)
        result = run_job(unpack(parcel, folder))
        error = result.error
        for path in (*parcel.data, parcel.job.recording.path):
            error = error.replace(str(parcel.place(folder, path)), str(path))
        return replace(result, error=error)


def run_on_cluster(
    jobs: Iterable[Job], address: str, workers_within_s: float = WORKERS_WITHIN_S
) -> Generator[Result, None, None]:
    """Yield the result of each job as it arrives, in no order.

    Closing the generator, or Ctrl-C, cancels the unfinished jobs. A recording travels to its worker as bytes, so a
    worker needs seatrial but no access to our disk. Raises LinkTimeout if no scheduler answers within
    ANSWER_WITHIN_S, or if the scheduler has no worker for longer than `workers_within_s`; LinkLost if the scheduler
    goes away.
    """
    waiting = iter(jobs)
    done: SimpleQueue[Future[Result]] = SimpleQueue()
    under_way: dict[Future[Result], Job] = {}
    with _client(address) as client:
        manned_s = time.monotonic()
        room = 0
        try:
            while True:
                threads = _threads(client, address)
                if threads:
                    manned_s, room = time.monotonic(), AHEAD * threads
                elif time.monotonic() - manned_s > workers_within_s:
                    raise LinkTimeout(
                        f"{address}: the scheduler has no worker; start one: dask worker {address} --nthreads 1; {KEPT}"
                    )
                while len(under_way) < room and (job := next(waiting, None)) is not None:
                    future = _send(client, job)
                    if isinstance(future, Result):
                        yield future
                        continue
                    under_way[future] = job
                    future.add_done_callback(done.put)
                if room and not under_way:
                    return
                for future in _ready(done):
                    yield _result(future, under_way.pop(future), address)
        finally:
            if under_way and client.status == "running":
                client.cancel(list(under_way))


@contextmanager
def _client(address: str) -> Iterator[Client]:
    """A client of the scheduler at `address`. Its own log is silenced: its errors are reported here instead."""
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    settings = {
        "distributed.admin.large-graph-warning-threshold": LARGEST_PARCEL,
        "distributed.comm.timeouts.connect": f"{ANSWER_WITHIN_S:g}s",
    }
    with dask.config.set(settings):
        try:
            client = Client(address, timeout=ANSWER_WITHIN_S, set_as_default=False)
        except (OSError, TimeoutError, ValueError) as error:
            raise LinkTimeout(
                f"{address}: no Dask scheduler answers there ({_first_line(error)}); start one with 'dask scheduler', "
                "or leave out --scheduler to use this computer's cores"
            ) from None
        try:
            yield client
        finally:
            client.close(timeout=ANSWER_WITHIN_S)


def _threads(client: Client, address: str) -> int:
    """Number of threads of the cluster's workers now. Raises LinkLost if the scheduler is gone."""
    if client.status == "running":
        try:
            return sum(client.nthreads().values())
        except (OSError, RuntimeError):
            pass
    raise LinkLost(f"{address}: the scheduler went away; {KEPT}")


def _send(client: Client, job: Job) -> "Future[Result] | Result":
    """Submit a job and return its future; if its files are gone by now, a failed result that says so."""
    try:
        parcel = pack(job)
    except OSError as error:
        return job.failed(f"{error.filename}: can't be read any more ({error.strerror})", final=False)
    return client.submit(run_parcel, parcel, pure=False)


def _ready(done: "SimpleQueue[Future[Result]]") -> "list[Future[Result]]":
    """The next finished future; empty if none finishes within LOOK_EVERY_S."""
    try:
        return [done.get(timeout=LOOK_EVERY_S)]
    except Empty:
        return []


def _result(future: "Future[Result]", job: Job, address: str) -> Result:
    """Result of a finished future, with the job's names on this computer (the worker saw other paths)."""
    if future.status == "cancelled":
        raise LinkLost(f"{address}: the scheduler dropped the work or went away; {KEPT}")
    if future.status == "error":
        return job.failed(_why(future.exception()), final=False)
    result: Result = future.result()
    if result.answer is not None:
        return job.done(result.answer)
    return job.failed(result.error, result.final)


def _why(error: BaseException) -> str:
    """Explain a worker's failure to the user who sent the job."""
    if isinstance(error, KilledWorker):
        return "each worker that took it died, perhaps for want of memory; run again with fewer workers a computer"
    reason = f"{type(error).__name__}: {_first_line(error)}"
    return f"its worker could not begin ({reason}); install the same seatrial there"


def _first_line(error: BaseException) -> str:
    return str(error).strip().partition("\n")[0]
