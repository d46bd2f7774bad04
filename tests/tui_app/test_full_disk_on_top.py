"""A recording whose disk is full, or whose dive somebody moves, as the top line tells it by way of its state file."""

import errno
import os

from made_view import view
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.clock import SimulatedClock
from bridge.links.memory import memory_pair
from bridge.wire.framing import Encoder
from bridge.wire.tlog import read_tlog
from gcs_plugin.dives.folder import About, new_folder
from gcs_plugin.recording.recorder import Recorder
from tui.app import recorder as of_app
from tui.app.header import header
from tui.app.view import View
from tui.commands.record import RecordingState


class Disk:
    """The writes of a recording; fails them while it is full."""

    full = False

    def write(self, file, data):
        if self.full:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return os.pwrite(file, data, os.fstat(file).st_size)

    def free(self):
        return 0 if self.full else 1 << 40


class OpenLinks:
    """An opener of links that are not signed."""

    def words(self, _):
        return ""

    trouble = words


class At:
    """A recording into a folder, with what the top of the app tells of it."""

    def __init__(self, folder, monkeypatch):
        self.folder, self.disk, self.clock = new_folder(folder, 0.0, ""), Disk(), SimulatedClock()
        self.sent, self._vehicle = 0, Encoder(1, 1)
        monkeypatch.setattr("bridge.wire.tlog.os.write", self.disk.write)
        here, self._there = memory_pair()
        self.recorder = Recorder(
            [here],
            lambda number: self.folder.open_telemetry(number, About()),
            self.clock,
            self.disk.free,
            lambda _: None,
        )
        self._state = RecordingState(self.clock, ("udpin:",), self.folder.path, "", OpenLinks())

    def sails(self, seconds):
        """So many frames come, one a second; what stands on top then, and how it looks."""
        for _ in range(seconds):
            self.clock.advance_to(self.clock.now_s + 1.0)
            message = dialect.MAVLink_system_time_message(0, self.sent)
            self._there.write(self._vehicle.encode(message))
            self.sent += 1
            self.recorder.step(0.0)
        self.recorder.sync()
        self._state.tell(self.recorder)
        now_s = self.clock.unix_s()
        shown = View(view().picture, now_s, of_app.recording(now_s))
        lines = header(shown, (), 80)
        (clock,) = [(text, role) for text, role in lines[0] if "REC" in text or "WRITTEN" in text]
        return clock, " ".join("".join(text for text, _ in line).strip() for line in lines[2:])


def test_a_full_disk_stands_on_top_with_its_reason_until_all_that_waited_is_written(tmp_path, monkeypatch):
    at = At(tmp_path, monkeypatch)
    (well, role), banner = at.sails(10)
    assert (well.startswith("REC 00:00:10  "), role, banner) == (True, "plain", "")
    at.disk.full = True
    assert at.sails(7) == (
        (" REC 00:00:17  NOT WRITTEN ", "lost"),
        "NOTHING IS WRITTEN, 7 frames wait in memory: telemetry.tlog: can't be written (No space left on "
        "device); free disk space",
    )
    at.disk.full = False
    (well, role), banner = at.sails(10)
    assert (well.startswith("REC 00:00:27  "), role, banner) == (True, "plain", "")
    at.recorder.close()
    files = at.folder.telemetry()
    assert [len(list(read_tlog(path))) for path in files] == [10, 17]


def test_a_clock_that_is_set_leaves_the_top_line_counting(tmp_path, monkeypatch):
    at = At(tmp_path, monkeypatch)
    at.sails(10)
    at.clock.unix_at_boot_s -= 86_400.0
    (well, role), _ = at.sails(10)
    assert (well.startswith("REC 00:00:20  "), role) == (True, "plain")
    at.recorder.close()
