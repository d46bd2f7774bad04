"""A recorder over a fake link and a fake disk, on a simulated clock."""

from pathlib import Path

from fakes.vehicle import FakeLink
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.clock import SimulatedClock
from bridge.errors import LogError
from bridge.wire.framing import Encoder
from gcs_plugin.recording.recorder import Recorder


def frames_of(count, system=1):
    encoder = Encoder(system, 1)
    return [encoder.encode(dialect.MAVLink_system_time_message(0, n)) for n in range(count)]


class Disk:
    """Files in memory whose n-th write over all fails; `full` fails every one, `refuses` every new file.

    `gone`: it can't be asked for its space. `calls` are the syncs and closes of its files.
    """

    def __init__(self, fail_at=()):
        self.fail_at = set(fail_at)
        self.files = []
        self.writes = 0
        self.full = False
        self.free = 1 << 40
        self.gone = self.refuses = self.sync_fails = False
        self.calls = []

    def space(self):
        if self.gone:
            raise FileNotFoundError("the folder is gone")
        return self.free

    def open(self, number):
        if self.refuses:
            raise LogError("the folder can't be made; choose another")
        assert number == len(self.files) + 1
        self.files.append([])
        return DiskFile(self, self.files[-1])

    def stored(self):
        return [record for file in self.files for record in file]

    @property
    def raws(self):
        return [raw for _, raw in self.stored()]


class DiskFile:
    path = Path("nowhere")

    def __init__(self, disk, records):
        self.disk = disk
        self.records = records

    def write(self, unix_us, raw):
        self.disk.writes += 1
        if self.disk.full or self.disk.writes in self.disk.fail_at:
            raise LogError("the disk failed; mend it")
        self.records.append((unix_us, raw))

    def sync(self):
        self.disk.calls.append("sync")
        if self.disk.sync_fails:
            raise LogError("the sync failed; mend the disk")

    def look(self):
        """It lies where it was made."""

    def close(self):
        self.disk.calls.append("close")


class Ground:
    """A recorder over fake links and a fake disk on a simulated clock."""

    def __init__(self, disk=None, clock=None, links=("fake:",), **options):
        self.links, self.disk, self.clock = (
            list(map(FakeLink, links)),
            disk or Disk(),
            clock or SimulatedClock(),
        )
        self.link, self.notices = self.links[0], []
        self.recorder = Recorder(
            self.links, self.disk.open, self.clock, self.disk.space, self.notices.append, **options
        )

    def hear(self, *data, after_s=0.01):
        """A step in which each link has its piece of `data`, or its error."""
        self.clock.advance_to(self.clock.now_s + after_s)
        for link, piece in zip(self.links, data, strict=False):
            link.chunks.append(piece)
        return self.recorder.step(0.0)

    def sentences(self):
        return [notice.sentence for notice in self.notices]
