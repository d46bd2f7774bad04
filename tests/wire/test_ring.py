"""The vehicle's own recording: bounded, whole after a kill, going on after a disk that failed."""

import os
import shutil
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest
from fakes.recordings import ring_raws
from pymavlink.dialects.v20 import ardupilotmega as dialect
from service_rig import Rig, imu

from bridge.clock import SimulatedClock
from bridge.errors import LogError
from bridge.onboard import ring as keeper_module
from bridge.onboard.ring import RingFiles, RingKeeper, RingSize
from bridge.wire.framing import Encoder, Framer, decode
from bridge.wire.readings import Reading, encode
from bridge.wire.segments import Segment, segment_named, segments_in

SMALL = RingSize(total=4000, segment=1000)


def frames(count, first=0):
    encoder = Encoder(1, 191)
    made = [encoder.frame(*encode(Reading("ff_mode", float(n), (1.0,)))) for n in range(first + count)]
    return made[first:]


def write_all(ring, wanted, boot_ms=0):
    for n, raw in enumerate(wanted):
        ring.write(1_790_000_000_000_000 + n, boot_ms + n, raw)
    ring.close()


def test_a_segment_is_known_by_its_name():
    segment = Segment(12, 0x3F9A1C00, 3, 754000)
    assert segment.name == "000012-3f9a1c00-000003-0000754000.tlog"
    assert segment_named(segment.name) == segment
    for stranger in ("telemetry.tlog", segment.name + ".part", "../" + segment.name, "x" + segment.name, ""):
        assert segment_named(stranger) is None


def test_a_ring_holds_its_newest_frames_whole_and_in_order_and_never_more_than_it_may(tmp_path):
    sent, ring = frames(400), RingFiles(tmp_path / "ring", SMALL, 7)
    largest = 0
    for n, raw in enumerate(sent):
        ring.write(n, n, raw)
        largest = max(largest, sum(size for _, size in segments_in(tmp_path / "ring")))
    ring.close()
    kept = ring_raws(tmp_path / "ring")
    assert largest <= SMALL.total
    assert kept == sent[-len(kept) :]
    assert sum(len(raw) + 8 for raw in kept) > SMALL.total - 2 * SMALL.segment


def test_a_restart_begins_a_segment_of_its_own_after_those_before(tmp_path):
    sent = frames(30)
    write_all(RingFiles(tmp_path, SMALL, 99), sent[:10])
    write_all(RingFiles(tmp_path, SMALL, 7), sent[10:20])
    write_all(RingFiles(tmp_path, SMALL, 50), sent[20:])
    assert ring_raws(tmp_path) == sent
    assert [(s.boot, s.identity) for s, _ in segments_in(tmp_path)] == [(1, 99), (2, 7), (3, 50)]


def test_files_that_are_no_segments_are_left_alone(tmp_path):
    (tmp_path / "notes.txt").write_bytes(b"x" * 5000)
    write_all(RingFiles(tmp_path, SMALL, 7), frames(400))
    assert (tmp_path / "notes.txt").read_bytes() == b"x" * 5000
    assert ring_raws(tmp_path) == frames(400)[-len(ring_raws(tmp_path)) :]


class Disk:
    """Files whose failure is a switch."""

    identity = 4711

    def __init__(self):
        self.records, self.fault, self.syncs = [], "", 0

    def write(self, _unix_us, _boot_ms, raw):
        if self.fault:
            raise LogError(self.fault)
        self.records.append(raw)

    def sync(self):
        self.syncs += 1

    def close(self):
        pass


def test_the_bridge_keeps_all_that_it_sends_whether_or_not_anybody_can_hear_it():
    disk = Disk()
    rig = Rig(ring=RingKeeper(disk, SimulatedClock()))
    rig.ask(dialect.MAVLink_param_request_list_message(1, 1))
    rig.bridge._ring.write_waiting()
    assert [decode(Framer().feed(raw)[0]).get_type() for raw in disk.records[:2]] == [
        "HEARTBEAT",
        "SYSTEM_TIME",
    ]
    rig.ground.close()
    before = len(disk.records)
    for n in range(1, 61):
        rig.clock.advance_to(n * 0.05)
        rig.bridge.step()
    rig.bridge._ring.write_waiting()
    messages = [decode(Framer().feed(raw)[0]) for raw in disk.records[before:]]
    assert [m.value for m in messages if m.get_type() == "NAMED_VALUE_INT"] == [4711] * 3
    assert "link lost: memory:a" in [m.text for m in messages if m.get_type() == "STATUSTEXT"]


def test_what_the_ground_heard_is_what_the_ring_holds_byte_for_byte():
    disk = Disk()
    rig = Rig(ring=RingKeeper(disk, SimulatedClock()))
    heard = b""
    for n in range(40):
        rig.clock.advance_to(n * 0.05)
        rig.bridge.accept("imu", (imu(rig.clock.now_s),))
        rig.bridge.step()
        while data := rig.ground.read(0.0):
            heard += data
    rig.bridge._ring.write_waiting()
    assert b"".join(disk.records) == heard


@pytest.mark.parametrize("days", [50.0, 120.0])
def test_a_bridge_that_runs_for_months_goes_on_and_its_segments_begin_by_the_clock_of_its_boot_id(
    tmp_path, days
):
    """Milliseconds of 32 bits wrap after 49.7 days, and 10 digits of them are passed after 115."""
    clock = SimulatedClock()
    ring = RingKeeper(RingFiles(tmp_path, SMALL, 7), clock)
    rig = Rig(ring=ring)
    clock.advance_to(days * 86_400.0)
    (boot_id,) = (m for m in rig.step(clock.now_s) if m.get_type() == "NAMED_VALUE_INT")
    ring.write_waiting()
    ((segment, size),) = segments_in(tmp_path)
    assert size > 0
    assert segment.begins_ms == boot_id.time_boot_ms == days * 86_400_000 % 2**32


def test_a_disk_that_stalls_never_holds_up_the_loop():
    stuck, go_on = threading.Event(), threading.Event()

    class Stalls(Disk):
        def write(self, *record):
            stuck.set()
            go_on.wait(30.0)
            super().write(*record)

    disk, clock = Stalls(), SimulatedClock()
    ring, sent = RingKeeper(disk, clock), frames(100)
    ring.start()
    ring.put(0, 0.0, sent[:1])
    assert stuck.wait(30.0)
    for raw in sent[1:]:
        ring.put(0, 0.0, [raw])  # returns, although the disk does not
    assert disk.records == []
    go_on.set()
    ring.close()
    assert disk.records == sent


def test_a_disk_that_fails_is_told_once_and_loses_nothing_that_fits_in_memory():
    clock, disk, sent = SimulatedClock(), Disk(), frames(30)
    ring = RingKeeper(disk, clock)
    ring.put(0, 0.0, sent[:10])
    ring.write_waiting()
    disk.fault = "disk full"
    for n in range(10, 20):
        clock.advance_to(float(n))
        ring.put(0, 0.0, sent[n : n + 1])
        ring.write_waiting()
    assert ring.take_texts() == ["ring: not written, disk full"]
    disk.fault = ""
    clock.advance_to(30.0)
    ring.put(0, 0.0, sent[20:])
    ring.write_waiting()
    assert ring.take_texts() == ["ring: written again, 0 frames lost"]
    assert ring.fault == ""
    assert disk.records == sent


def test_a_disk_that_goes_on_failing_is_told_once_a_minute_for_who_joins_later_and_is_one_fault():
    clock, disk = SimulatedClock(), Disk()
    ring = RingKeeper(disk, clock)
    reports = []
    for second in range(150):
        disk.fault = f"disk full at file {second}"
        clock.advance_to(float(second))
        ring.put(0, float(second), frames(1))
        ring.write_waiting()
        reports += [second] * len(ring.take_texts())
        assert ring.fault == "ring: not written, disk full at file 0"
    assert reports == [0, 60, 120]


def test_what_memory_can_not_hold_is_counted_and_told(monkeypatch):
    clock, disk, sent = SimulatedClock(), Disk(), frames(50)
    monkeypatch.setattr(keeper_module, "MOST_WAITING_BYTES", sum(len(raw) for raw in sent[30:]))
    ring = RingKeeper(disk, clock)
    for raw in sent:
        ring.put(0, 0.0, [raw])
    ring.write_waiting()
    assert disk.records == sent[30:]
    assert ring.take_texts() == [
        "ring: disk too slow or full, frames are lost",
        "ring: written again, 30 frames lost",
    ]


def test_what_was_written_is_put_on_the_disk_twice_a_second():
    clock, disk = SimulatedClock(), Disk()
    ring = RingKeeper(disk, clock)
    for n in range(40):
        clock.advance_to(n * 0.05)
        ring.put(0, clock.now_s, frames(1))
        ring.write_waiting()
    assert disk.syncs == 4


def test_a_full_disk_leaves_no_litter_and_the_ring_goes_on_in_a_new_segment(tmp_path, monkeypatch):
    sent, ring = frames(30), RingFiles(tmp_path, SMALL, 7)
    for n, raw in enumerate(sent[:10]):
        ring.write(n, n, raw)

    def full(*_):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as broken:
        broken.setattr(os, "write", full)
        for _ in range(5):
            with pytest.raises(LogError, match="No space left on device"):
                ring.write(0, 0, sent[10])
    for n, raw in enumerate(sent[10:]):
        ring.write(n, n, raw)
    ring.close()
    assert ring_raws(tmp_path) == sent
    assert all(size for _, size in segments_in(tmp_path))


@pytest.mark.parametrize("fate", ["deleted", "moved away"])
def test_a_ring_that_is_taken_away_is_told_in_one_text_and_begun_anew(tmp_path, fate):
    folder, elsewhere, clock, sent = tmp_path / "ring", tmp_path / "elsewhere", SimulatedClock(), frames(12)
    ring = RingKeeper(RingFiles(folder, SMALL, 7), clock)

    def put(raws):
        clock.advance_to(clock.now_s + 1.0)
        ring.put(0, clock.now_s, raws)
        ring.write_waiting()

    put(sent[:4])
    folder.rename(elsewhere)
    if fate == "deleted":
        shutil.rmtree(elsewhere)
    put(sent[4:8])
    put(sent[8:])
    (text,) = ring.take_texts()
    assert text == f"ring: files were {fate}, it begins anew"
    assert len(text.encode()) <= 50
    assert ring_raws(folder) == sent[8:]
    if fate == "moved away":
        assert ring_raws(elsewhere) == sent[:8]


WRITES = """
import sys
from pathlib import Path
from bridge.clock import SystemClock
from bridge.onboard.ring import RingSize
from bridge.onboard.ring import ring_in
from test_ring import frames

clock = SystemClock()
ring = ring_in(Path(sys.argv[1]), RingSize(20000, 1000), clock)
for n, raw in enumerate(frames(200) * 100):
    ring.put(n, clock.boot_s(), [raw])
    ring.write_waiting()
    sys.stdout.write("x")
    sys.stdout.flush()
"""


def killed_ring(folder, after):
    """How many frames a ring said to have written when it was killed."""
    with subprocess.Popen(
        [sys.executable, "-c", WRITES, str(folder)],
        stdout=subprocess.PIPE,
        env=os.environ | {"PYTHONPATH": os.pathsep.join([str(Path(__file__).parent), *sys.path])},
    ) as process:
        said = process.stdout.read(after)
        process.send_signal(signal.SIGKILL)
        said += process.stdout.read()
    return len(said)


def survives(folder, after):
    written, endless = killed_ring(folder, after), frames(200) * 100
    kept = ring_raws(folder)
    # The frame under way at the kill may be there whole, or not.
    assert kept[-5:] in (endless[written - 5 : written], endless[written - 4 : written + 1])


def test_a_ring_survives_a_kill_with_all_that_it_had_written(tmp_path):
    for number, after in enumerate((20, 777)):
        survives(tmp_path / str(number), after)


@pytest.mark.soak
def test_a_ring_survives_a_hundred_kills(tmp_path):
    import figures

    for number in range(100):
        survives(tmp_path / str(number), 10 + 37 * number)
    figures.keep("ring_killed", "0 of 100 kills lost a frame that was written")
