"""The clock is set by a day while a dive is recorded: times of the dive stay on its recording's clock."""

from datetime import datetime
from itertools import pairwise
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge import exit_codes
from bridge.clock import SimulatedClock
from bridge.links.link import memory_pair
from bridge.wire.framing import Encoder
from bridge.wire.tlog import STAMP, TlogWriter, read_tlog
from gcs_plugin.dives.folder import About
from gcs_plugin.dives.recorded_dives import RecordedDives
from gcs_plugin.recording.recorder import Recorder
from gcs_plugin.recording.state import held, hung
from gcs_plugin.watch.watcher import Watcher
from tui import cli
from tui.app.view import View
from tui.commands import doctor
from tui.commands.record import RecordingState
from tui.links import known_now

DAY_S = 86_400.0
days = pytest.mark.parametrize("set_by_s", [-DAY_S, DAY_S], ids=["back", "forward"])


@pytest.fixture(autouse=True)
def at_home(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.chdir(tmp_path)


class Unsigned:
    """An opener of links that are not signed."""

    def words(self, _):
        return ""

    trouble = words


class Recorded:
    """`seatrial record` on a link with a frame each second: its files and its state."""

    def __init__(self):
        self.clock, self._vehicle, self._sent = SimulatedClock(), Encoder(1, 1), 0
        self.dives = RecordedDives(Path("dives"), "", lambda _: About(), self.clock)
        here, self._there = memory_pair()
        self.recorder = Recorder(
            [here], self.dives.folder.open_telemetry, self.clock, lambda: 1 << 40, lambda _: None
        )
        self.state = RecordingState(self.clock, ("udpin:",), self.dives.folder.path, "", Unsigned())

    def sails(self, seconds):
        for _ in range(seconds):
            self.clock.advance_to(self.clock.now_s + 1.0)
            self._there.write(self._vehicle.encode(dialect.MAVLink_system_time_message(0, self._sent)))
            self._sent += 1
            self.recorder.step(0.0)
        self.state.tell(self.recorder)


def unix_s(utc):
    return datetime.fromisoformat(utc).timestamp()


@days
@pytest.mark.parametrize("since_s", [0, 4], ids=["just now", "a while ago"])
def test_whom_an_off_is_for_is_told_with_how_long_ago_though_the_clock_is_set(set_by_s, since_s, monkeypatch):
    sea = Recorded()
    monkeypatch.setattr("time.monotonic", sea.clock.boot_s)
    for message in (
        dialect.MAVLink_heartbeat_message(dialect.MAV_TYPE_SUBMARINE, 0, 0, 0, 4, 3),
        dialect.MAVLink_param_value_message(b"FF_MODE", 3.0, 9, 1, 0),
    ):
        sea._there.write(sea._vehicle.encode(message))
    sea.sails(8)
    sea.clock.unix_at_boot_s += set_by_s
    if since_s:
        sea.sails(since_s)
    (item,) = known_now(sea.clock)
    assert (item.source, item.holds) == ((1, 1), True)
    assert sea.clock.boot_s() - item.heard_s == pytest.approx(6.0 + since_s, abs=1e-6)
    assert known_now(sea.clock, "serial:/dev/ttyUSB0:57600") == ()
    sea.recorder.close()


@days
def test_a_recording_neither_hangs_nor_ends_in_the_second_in_which_the_clock_is_set(set_by_s):
    sea = Recorded()
    sea.sails(5)
    sea.clock.unix_at_boot_s += set_by_s
    now_unix_s = sea.clock.unix_s()
    holding = held(now_unix_s)
    assert holding is not None
    assert hung(now_unix_s) is None
    assert View(Watcher(None).picture(0.0), now_unix_s, holding).records
    sea.recorder.close()


@days
def test_a_note_lies_among_the_stamps_of_its_dive(set_by_s, monkeypatch):
    sea = Recorded()
    sea.sails(30)
    sea.clock.unix_at_boot_s += set_by_s
    sea.sails(1)
    monkeypatch.setattr("bridge.clock.SystemClock", lambda: sea.clock)
    assert cli.main(["note", "leaves the harbour"]) == exit_codes.DONE
    sea.sails(30)
    sea.recorder.close()
    (event,) = sea.dives.folder.about().events
    stamps = [stamp_us for stamp_us, _ in read_tlog(sea.dives.folder.path / "telemetry.tlog")]
    assert stamps[29] / 1e6 <= unix_s(event.utc) <= stamps[31] / 1e6


@days
def test_the_next_dive_is_named_after_its_own_stamps(set_by_s):
    sea = Recorded()
    first = sea.dives.folder
    sea.sails(60)
    sea.clock.unix_at_boot_s += set_by_s
    sea.dives.go_on(sea.recorder, lambda _: sea.state.begin(sea.dives.folder.path))
    sea.sails(60)
    second = sea.dives.folder
    sea.recorder.close()
    assert first.path.name < second.path.name
    stamps = [stamp for dive in (first, second) for stamp, _ in read_tlog(dive.path / "telemetry.tlog")]
    assert all(after - before == 1_000_000 for before, after in pairwise(stamps))


@days
def test_the_recording_of_a_wet_check_goes_on_evenly(set_by_s, tmp_path):
    clock, vehicle, (near, far) = SimulatedClock(), Encoder(1, 1), memory_pair()
    with TlogWriter(tmp_path / "telemetry.tlog") as writer:
        checked = doctor.Recorded(near, writer, clock)
        for second in range(4):
            clock.advance_to(float(second))
            clock.unix_at_boot_s += set_by_s * (second == 2)
            far.write(vehicle.encode(dialect.MAVLink_system_time_message(0, 1 + second)))
            checked.read(0.0)
    data = (tmp_path / "telemetry.tlog").read_bytes()
    each = len(data) // 4
    stamps = [STAMP.unpack_from(data, n * each)[0] for n in range(4)]
    assert all(after - before == 1_000_000 for before, after in pairwise(stamps))
