"""The recorder: every frame in a file, whatever fails."""

import subprocess
import sys
import threading
from collections import deque

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.clock import SimulatedClock, SystemClock
from bridge.errors import LinkLost, LogError
from bridge.framing import Encoder, Framer
from bridge.link.memory import memory_pair
from bridge.tlog import TlogWriter, read_tlog
from gcs_plugin.folder import new_folder
from gcs_plugin.recorder import Recorder
from gcs_plugin.station import GROUND_STATION


def frames_of(count, system=1):
    encoder = Encoder(system, 1)
    return [encoder.encode(dialect.MAVLink_system_time_message(0, n)) for n in range(count)]


class FakeLink:
    """Gives what is in `chunks`; an exception in it is raised."""

    def __init__(self, name="fake:"):
        self.name = name
        self.chunks = deque()
        self.sent = []
        self.closed = False

    def read(self, timeout_s):
        assert timeout_s >= 0
        if not self.chunks:
            return b""
        chunk = self.chunks.popleft()
        if isinstance(chunk, Exception):
            raise chunk
        return chunk

    def write(self, data):
        self.sent.append(data)

    def close(self):
        self.closed = True


class Disk:
    """Writers whose n-th write over all files fails, half written; `full` fails every one, `gone` the look at it."""

    def __init__(self, fail_at=()):
        self.fail_at = set(fail_at)
        self.files = []
        self.writes = 0
        self.full = False
        self.free = 1 << 40
        self.gone = False
        self.sync_fails = False
        self.synced = 0

    def space(self):
        if self.gone:
            raise FileNotFoundError("the folder is gone")
        return self.free

    def open(self, number):
        assert number == len(self.files) + 1
        self.files.append([])
        return DiskFile(self, self.files[-1])

    def stored(self):
        return [record for file in self.files for record in file]


class DiskFile:
    def __init__(self, disk, records):
        self.disk = disk
        self.records = records

    def write(self, unix_us, raw):
        self.disk.writes += 1
        if self.disk.full or self.disk.writes in self.disk.fail_at:
            raise LogError("the disk failed; mend it")
        self.records.append((unix_us, raw))

    def sync(self):
        self.disk.synced += 1
        if self.disk.sync_fails:
            raise LogError("the sync failed; mend the disk")

    def close(self):
        pass


class Ground:
    """A recorder over a fake link and a fake disk on a simulated clock."""

    def __init__(self, disk=None, **options):
        self.link, self.disk, self.clock = FakeLink(), disk or Disk(), SimulatedClock()
        self.notices = []
        self.recorder = Recorder(
            [self.link], self.disk.open, self.clock, self.disk.space, self.notices.append, **options
        )

    def hear(self, data, after_s=0.01):
        self.clock.advance_to(self.clock.now_s + after_s)
        self.link.chunks.append(data)
        return self.recorder.step(0.0)

    def sentences(self):
        return [notice.sentence for notice in self.notices]


def test_each_frame_is_in_the_file_when_the_step_returns():
    ground = Ground()
    for number, raw in enumerate(frames_of(5), start=1):
        ground.hear(raw)
        assert len(ground.disk.stored()) == number
    assert [raw for _, raw in ground.disk.stored()] == frames_of(5)


def test_frames_split_over_reads_come_whole():
    ground = Ground()
    stream = b"".join(frames_of(3))
    for byte in stream:
        ground.hear(bytes([byte]))
    assert [raw for _, raw in ground.disk.stored()] == frames_of(3)


def test_a_frame_of_an_unknown_id_is_recorded_raw():
    ground = Ground()
    unknown = bytes([0xFD, 3, 0, 0, 7, 1, 1, 0x11, 0x22, 0x05, 1, 2, 3, 0xAA, 0xBB])
    known = frames_of(1)[0]
    ground.hear(known + unknown + known)
    assert [raw for _, raw in ground.disk.stored()][:2] == [known, unknown]
    health = ground.recorder.health["fake:"].snapshot(ground.clock.now_s)
    assert {message.message_id for message in health.messages} == {2}


@pytest.mark.parametrize("n", range(1, 21))
def test_whichever_write_fails_no_frame_is_missing(n):
    ground = Ground(Disk(fail_at=[n]))
    for raw in frames_of(20):
        ground.hear(raw, after_s=1.5)
    assert [raw for _, raw in ground.disk.stored()] == frames_of(20)
    assert len(ground.disk.files) == 2
    assert "the disk failed; mend it" in ground.sentences()
    assert ground.recorder.lost == 0


def test_a_full_disk_is_waited_out_in_memory_without_a_litter_of_files():
    ground = Ground()
    first, *rest = frames_of(200)
    ground.hear(first)
    ground.disk.full, ground.disk.free = True, 0
    for raw in rest[:-1]:
        ground.hear(raw, after_s=0.5)
    assert len(ground.disk.files) == 1
    ground.disk.full, ground.disk.free = False, 1 << 40
    ground.hear(rest[-1], after_s=10.0)
    assert [raw for _, raw in ground.disk.stored()] == [first, *rest]
    assert any("the disk has 0.0 MB left" in sentence for sentence in ground.sentences())


def test_a_disk_that_is_pulled_out_is_waited_for_and_nothing_is_missing():
    ground = Ground()
    ground.disk.full = ground.disk.gone = True
    raws = frames_of(5)
    for raw in raws:
        ground.hear(raw, after_s=2.5)
    assert ground.disk.stored() == []
    ground.disk.full = ground.disk.gone = False
    ground.hear(b"", after_s=10.0)
    assert [raw for _, raw in ground.disk.stored()] == raws


def test_a_disk_that_fails_though_it_has_space_is_tried_ever_less_often():
    ground = Ground()
    ground.disk.full = True
    for raw in frames_of(100):
        ground.hear(raw, after_s=1.0)
    assert len(ground.disk.files) < 20
    assert not any("goes on" in sentence for sentence in ground.sentences())
    ground.disk.full = False
    ground.hear(frames_of(1)[0], after_s=10.0)
    assert len(ground.disk.stored()) == 101
    assert sum("goes on in its file" in sentence for sentence in ground.sentences()) == 1


def test_the_wait_in_memory_is_bounded_and_what_is_lost_is_counted(monkeypatch):
    monkeypatch.setattr("gcs_plugin.recorded_files.MOST_WAITING_BYTES", 10 * len(frames_of(2)[1]))
    ground = Ground()
    ground.disk.full, ground.disk.free = True, 0
    for raw in frames_of(60):
        ground.hear(raw)
    assert 45 <= ground.recorder.lost <= 50
    ground.recorder.close()
    assert ground.recorder.lost == 60
    assert any("could not be written and are lost" in sentence for sentence in ground.sentences())


def test_a_failed_sync_begins_a_new_file():
    ground = Ground()
    ground.hear(frames_of(1)[0])
    ground.disk.sync_fails = True
    ground.recorder.sync()
    ground.disk.sync_fails = False
    ground.hear(frames_of(1)[0])
    assert [len(file) for file in ground.disk.files] == [1, 1]


def test_an_early_warning_names_the_minutes_left():
    ground = Ground()
    ground.disk.free = 1_100_000
    for _ in range(5):
        ground.hear(b"".join(frames_of(200)), after_s=1.0)
    warnings = [n for n in ground.notices if n.level == "warning"]
    assert len(warnings) == 1
    assert "min of recording; free some space" in warnings[0].sentence


class JumpingClock(SimulatedClock):
    """Its Unix time can be set by hand, as by a time server."""

    jump_s = 0.0

    def unix_s(self):
        return super().unix_s() + self.jump_s


@pytest.mark.parametrize("jump_s", [-86400.0, 86400.0])
def test_stamps_stay_even_when_the_wall_clock_is_set(jump_s):
    disk, link, clock = Disk(), FakeLink(), JumpingClock()
    recorder = Recorder([link], disk.open, clock, lambda: 1 << 40, lambda _: None)
    start_us = recorder.unix_us()
    for number, raw in enumerate(frames_of(10), start=1):
        clock.advance_to(number * 0.1)
        clock.jump_s = jump_s if number > 5 else 0.0
        link.chunks.append(raw)
        recorder.step(0.0)
    assert [stamp - start_us for stamp, _ in disk.stored()] == [n * 100_000 for n in range(1, 11)]


def test_it_is_silent_unless_asked_to_beat():
    silent, beating = Ground(), Ground(heartbeat=GROUND_STATION)
    for _ in range(35):
        silent.hear(b"")
        beating.hear(b"", after_s=0.1)
    assert silent.link.sent == []
    beats = Framer().feed(b"".join(beating.link.sent))
    assert [(b.system, b.component, b.message_id) for b in beats] == [(255, 190, 0)] * len(beats)
    assert len(beats) == 4


def test_a_lost_link_is_said_and_opened_again_while_the_other_goes_on():
    clock, disk, notices = SimulatedClock(), Disk(), []
    broken, other, again = FakeLink("broken"), FakeLink("other"), FakeLink("broken")
    attempts = []

    def reopen(name):
        assert name == "broken"
        attempts.append(clock.now_s)
        if len(attempts) < 3:
            raise LinkLost("still gone")
        return again

    recorder = Recorder([broken, other], disk.open, clock, lambda: 1 << 40, notices.append, reopen)
    broken.chunks.append(LinkLost("broken: unplugged; plug it in"))
    raws = frames_of(200)
    for raw in raws:
        clock.advance_to(clock.now_s + 0.5)
        other.chunks.append(raw)
        recorder.step(0.0)
    again.chunks.append(frames_of(1, system=9)[0])
    recorder.step(0.0)
    assert broken.closed
    assert [notice.sentence for notice in notices] == ["broken: unplugged; plug it in", "broken is back"]
    assert len(disk.stored()) == 201
    assert len(attempts) == 3


def test_a_link_that_takes_its_time_to_open_holds_up_no_other():
    clock, disk = SimulatedClock(), Disk()
    broken, other, again = FakeLink("broken"), FakeLink("other"), FakeLink("broken")
    answered = threading.Event()

    def reopen(_):
        assert answered.wait(10.0)
        return again

    recorder = Recorder([broken, other], disk.open, clock, lambda: 1 << 40, lambda _: None, reopen)
    broken.chunks.append(LinkLost("broken: unplugged; plug it in"))
    for number, raw in enumerate(frames_of(50), start=1):
        clock.advance_to(clock.now_s + 0.1)
        other.chunks.append(raw)
        recorder.step(0.0)
        assert len(disk.stored()) == number
    assert not answered.is_set()
    answered.set()
    again.chunks.append(frames_of(1, system=9)[0])
    for _ in range(500):
        clock.advance_to(clock.now_s + 1.0)
        if recorder.step(0.0):
            break
    assert len(disk.stored()) == 51


def test_a_recording_never_overwrites_another(tmp_path):
    folder = new_folder(tmp_path, 0.0, "x")
    folder.open_telemetry(1).close()
    with pytest.raises(LogError, match="exists already"):
        Recorder([], folder.open_telemetry, SimulatedClock(), lambda: 1, lambda _: None)


class CountingWriter(TlogWriter):
    """Sets `reached` once it holds `wanted` records."""

    def __init__(self, path, wanted):
        super().__init__(path)
        self.left = wanted
        self.reached = threading.Event()

    def write(self, unix_us, raw):
        super().write(unix_us, raw)
        self.left -= 1
        if self.left == 0:
            self.reached.set()


def test_the_loop_records_until_it_is_told_to_stop_and_closes(tmp_path):
    ours, theirs = memory_pair()
    stop = threading.Event()
    writer = CountingWriter(tmp_path / "1.tlog", 50)
    recorder = Recorder([ours], lambda _: writer, SystemClock(), lambda: 1 << 40, lambda _: None)
    for raw in frames_of(50):
        theirs.write(raw)
    loop = threading.Thread(target=recorder.run, args=(stop,))
    loop.start()
    assert writer.reached.wait(10.0)
    stop.set()
    loop.join(10.0)
    assert not loop.is_alive()
    assert [frame.raw for _, frame in read_tlog(tmp_path / "1.tlog")] == frames_of(50)
    with pytest.raises(LinkLost):
        theirs.write(b"x")


KILLED = """
import sys
from pathlib import Path
from bridge.clock import SystemClock
from bridge.link.memory import memory_pair
from bridge.tlog import TlogWriter
from gcs_plugin.recorder import Recorder
from pymavlink.dialects.v20 import ardupilotmega as dialect
from bridge.framing import Encoder
ours, theirs = memory_pair()
file = TlogWriter(Path(sys.argv[1]))
recorder = Recorder([ours], lambda n: file, SystemClock(), lambda: 1 << 40, lambda n: None)
encoder = Encoder(1, 1)
count = 0
while True:
    theirs.write(encoder.encode(dialect.MAVLink_system_time_message(0, count)))
    count += len(recorder.step(0.0))
    sys.stdout.write(f"{count}\\n")
    sys.stdout.flush()
"""


def test_what_was_said_to_be_recorded_survives_a_kill(tmp_path):
    path = tmp_path / "killed.tlog"
    with subprocess.Popen(
        [sys.executable, "-c", KILLED, str(path)], stdout=subprocess.PIPE, text=True
    ) as child:
        lines = [child.stdout.readline() for _ in range(500)]
        child.kill()
        rest = child.stdout.read().split("\n")
    said = max(int(line) for line in lines + rest[:-1] if line.strip())
    assert sum(1 for _ in read_tlog(path)) >= said >= 500


class FakeOutlet:
    """Keeps what it is given; gives what is in `orders`."""

    def __init__(self):
        self.given = b""
        self.orders = []

    def broadcast(self, raw):
        self.given += raw

    def taken(self):
        orders, self.orders = self.orders, []
        return orders


def test_the_outlet_gets_every_frame_of_every_link_as_it_came():
    outlet = FakeOutlet()
    ground = Ground(outlet=outlet)
    sent = frames_of(20)
    for byte in b"".join(sent):
        ground.hear(bytes([byte]))
    assert outlet.given == b"".join(sent)


def test_what_the_outlet_sends_goes_out_on_every_link_and_into_the_recording():
    clock, disk, outlet = SimulatedClock(), Disk(), FakeOutlet()
    links = [FakeLink("one"), FakeLink("other")]
    recorder = Recorder(links, disk.open, clock, disk.space, lambda _: None, outlet=outlet)
    heard, orders = frames_of(2), frames_of(3, system=255)
    links[0].chunks.append(heard[0])
    outlet.orders = list(orders)
    recorder.step(0.0)
    links[1].chunks.append(heard[1])
    recorder.step(0.0)
    assert [link.sent for link in links] == [orders, orders]
    assert [raw for _, raw in disk.stored()] == [heard[0], *orders, heard[1]]
    assert outlet.given == b"".join(heard)
    assert (recorder.heard, recorder.recorded) == (2, 5)
    assert [source.system for source in recorder.health["one"].snapshot(0.0).sources] == [1]


def test_an_order_goes_out_though_the_disk_is_full_and_one_link_is_gone():
    clock, disk, outlet = SimulatedClock(), Disk(), FakeOutlet()
    disk.full, disk.free = True, 0
    gone, good = FakeLink("gone"), FakeLink("good")
    recorder = Recorder([gone, good], disk.open, clock, disk.space, lambda _: None, outlet=outlet)
    gone.chunks.append(LinkLost("gone: unplugged; plug it in"))
    outlet.orders = frames_of(1)
    recorder.step(0.0)
    assert good.sent == frames_of(1)
    disk.full, disk.free = False, 1 << 40
    clock.advance_to(20.0)
    recorder.step(0.0)
    assert [raw for _, raw in disk.stored()] == frames_of(1)


def test_the_time_that_the_disk_lasts_is_told_while_something_comes():
    ground = Ground()
    assert ground.recorder.disk_left_s == float("inf")
    size = len(b"".join(frames_of(100)))
    for _ in range(20):
        ground.hear(b"".join(frames_of(100)), after_s=1.0)
    assert ground.recorder.disk_left_s == pytest.approx(ground.disk.free / size, rel=0.15)
    for _ in range(4):
        ground.hear(b"", after_s=1.0)
    assert ground.recorder.disk_left_s == float("inf")


def test_it_is_the_rate_of_about_a_minute_and_no_silence_changes_it():
    ground, frame = Ground(), frames_of(1)[0]
    told = []

    def hear(count, seconds):
        for _ in range(seconds):
            ground.hear(frame * count, after_s=1.0)
            told.append(ground.recorder.disk_left_s)

    hear(100, 120)
    usual_s = ground.disk.free / (100 * len(frame))
    assert told[-1] == pytest.approx(usual_s, rel=0.01)
    hear(200, 4)
    assert told[-1] == pytest.approx(usual_s, rel=0.15)
    hear(100, 120)
    hear(0, 24)
    assert told[-1] == float("inf")
    hear(100, 4)
    assert told[-1] == pytest.approx(usual_s, rel=0.05)


def test_a_full_disk_is_told_as_long_as_frames_wait_for_it_and_lasts_no_longer():
    ground = Ground()
    first, *rest = frames_of(20)
    ground.hear(first)
    assert (ground.recorder.unwritten, ground.recorder.waiting) == ("", 0)
    ground.disk.full, ground.disk.free = True, 0
    for raw in rest[:-1]:
        ground.hear(raw, after_s=1.0)
    assert (ground.recorder.unwritten, ground.recorder.waiting) == ("the disk failed; mend it", 18)
    assert ground.recorder.disk_left_s == 0.0
    ground.disk.full, ground.disk.free = False, 1 << 40
    ground.hear(rest[-1], after_s=10.0)
    assert (ground.recorder.unwritten, ground.recorder.waiting) == ("", 0)


def test_others_are_told_before_each_sync_even_where_the_disk_stalls(monkeypatch, tmp_path):
    monkeypatch.setattr("gcs_plugin.recorder.SYNC_EVERY_S", 0.01)
    ours, _ = memory_pair()
    stop, told, order = threading.Event(), threading.Event(), []

    class StallingWriter(TlogWriter):
        def sync(self):
            order.append("sync")
            stop.wait(10.0)

    def before_sync():
        order.append("told")
        told.set()

    recorder = Recorder(
        [ours],
        lambda _: StallingWriter(tmp_path / "1.tlog"),
        SystemClock(),
        lambda: 1 << 40,
        lambda _: None,
        before_sync=before_sync,
    )
    loop = threading.Thread(target=recorder.run, args=(stop,))
    loop.start()
    assert told.wait(10.0)
    stop.set()
    loop.join(10.0)
    assert not loop.is_alive()
    assert order[0] == "told"
