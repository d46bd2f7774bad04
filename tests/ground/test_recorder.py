"""The recorder: every frame in a file once it was said to be, raw, whole and under an even stamp."""

import subprocess
import sys
import threading

import pytest
from faked_ground import Disk, FakeLink, Ground, frames_of

from bridge.clock import SimulatedClock, SystemClock
from bridge.errors import LinkLost, LogError
from bridge.link.memory import memory_pair
from bridge.tlog import TlogWriter, read_tlog
from gcs_plugin.dives.folder import new_folder
from gcs_plugin.recording.recorder import Recorder


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
    (reception,) = ground.recorder.receptions["fake:"]
    assert (reception.system, reception.component) == (1, 1)


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
from gcs_plugin.recording.recorder import Recorder
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
