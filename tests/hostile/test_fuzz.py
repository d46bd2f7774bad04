"""Whatever bytes come, by wire or file: an answer or one sentence, soon, in bounded memory; the next is read."""

import os
import random
import resource
import shutil
import signal
import sys
import warnings
from contextlib import contextmanager
from itertools import product

import pytest
from figures import keep
from fuzz_bytes import KINDS, pieces
from fuzz_files import READERS
from fuzz_streams import STREAMS

from bridge.errors import SeatrialError

SHORT, LONG = 10**5, 10**7
LONGEST_CPU_S = 20.0
MOST_MORE_MB = 400
GOOD_AGAIN = 60


class Opened:
    """The files that this process opens to read, from when this is made."""

    def __init__(self):
        self.paths: set[str] = set()
        # None can be taken away again.
        sys.addaudithook(self._hear)

    def _hear(self, event, arguments):
        if event != "open":
            return
        path, _, flags = arguments
        reads = isinstance(flags, int) and flags & (os.O_WRONLY | os.O_RDWR) == 0
        if reads and isinstance(path, str | os.PathLike):
            self.paths.add(os.fspath(path))


@pytest.fixture(scope="module")
def opened():
    return Opened()


@contextmanager
def soon(data):
    """Fails where one piece takes the processor too long, however busy it is with others."""

    def late(*_):
        raise AssertionError(f"hangs on {data[:2000].hex()}")

    before = signal.signal(signal.SIGVTALRM, late)
    signal.setitimer(signal.ITIMER_VIRTUAL, LONGEST_CPU_S)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        signal.signal(signal.SIGVTALRM, before)


def most_mb():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3


def feed_hostile(stream, kind, total, seed):
    rng, feed, time_s = random.Random(f"{stream.name} {kind} {seed}"), stream.make(), 0.0
    before_mb = most_mb()
    for piece in pieces(kind, total, (stream.good,), stream.craft, rng):
        time_s += 0.001
        with soon(piece):
            feed(piece, time_s)
    assert most_mb() - before_mb < MOST_MORE_MB
    results = []
    for _ in range(GOOD_AGAIN):
        time_s += 0.1
        results.append(bool(feed(stream.good, time_s)))
    assert any(results), "the next good ones are not found"
    assert sum(results[GOOD_AGAIN // 2 :]) >= GOOD_AGAIN // 4


def read_hostile(reader, kind, total, seed, folder):
    rng = random.Random(f"{reader.name} {kind} {seed}")
    before_mb = most_mb()
    for piece in pieces(kind, total, reader.good, reader.craft, rng):
        read(reader, piece, folder)
    assert most_mb() - before_mb < MOST_MORE_MB
    for good in reader.good:
        assert read(reader, good, folder) == ""


def read(reader, data, folder):
    """The sentence that it is refused with; empty where it is read."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    (folder / reader.name).write_bytes(data)
    try:
        with soon(data), warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)
            reader.read(folder)
    except SeatrialError as error:
        return str(error)
    except Exception as error:
        raise AssertionError(f"{type(error).__name__} on {data[:4000]!r}") from error
    return ""


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("stream", STREAMS, ids=lambda stream: stream.name)
def test_no_stream_stops_a_parser(stream, kind):
    feed_hostile(stream, kind, SHORT // len(KINDS), 0)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("reader", READERS, ids=lambda reader: reader.name)
def test_no_file_gets_more_than_a_sentence(reader, kind, tmp_path):
    read_hostile(reader, kind, SHORT // len(KINDS), 0, tmp_path / "f")


@pytest.mark.parametrize("reader", READERS, ids=lambda reader: reader.name)
def test_each_reader_opens_the_file_that_it_is_given_and_what_replaces_it(reader, tmp_path, opened):
    folder = tmp_path / "f"
    for data in (*reader.good, b"", reader.good[0]):
        opened.paths.clear()
        read(reader, data, folder)
        assert str(folder / reader.name) in opened.paths


@pytest.mark.soak
def test_no_stream_of_any_length_stops_a_parser():
    """Some three minutes of one core. What the ground hears is the slowest: 0.1 MB/s of frames that are hurt."""
    for stream, kind in product(STREAMS, KINDS):
        feed_hostile(stream, kind, LONG // len(KINDS), 1)
    keep("hostile_streams", f"{LONG:.0e} bytes for each of {len(STREAMS)} parsers, no exception")


@pytest.mark.soak
def test_no_number_of_files_gets_more_than_a_sentence_each(tmp_path):
    """Some eight minutes of one core."""
    for reader, kind in product(READERS, KINDS):
        read_hostile(reader, kind, LONG // len(KINDS), 1, tmp_path / "f")
    keep("hostile_files", f"{LONG:.0e} bytes for each of {len(READERS)} readers, no exception")
