"""A recording replayed on its clock, and looked at anywhere."""

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.clock import SimulatedClock
from bridge.errors import LogError
from bridge.wire.framing import Encoder, Framer
from bridge.wire.tlog import TlogWriter, read_tlog
from gcs_plugin.dives.replay import Reel, play, schedule


def records_at(times_s):
    encoder, framer = Encoder(1, 1), Framer()
    frames = framer.feed(b"".join(encoder.encode(dialect.MAVLink_system_time_message(0, 1)) for _ in times_s))
    return [(round(1e15 + t * 1e6), frame) for t, frame in zip(times_s, frames, strict=True)]


class SlowClock(SimulatedClock):
    """Sleeps a little longer than asked, as computers do."""

    overshoot_s = 0.003

    def wait(self, seconds):
        self.advance_to(self.now_s + seconds + self.overshoot_s)


def test_no_delay_adds_up_over_a_long_recording():
    clock = SlowClock()
    heard_s = [clock.now_s for _ in play(records_at([n * 0.05 for n in range(2000)]), clock, clock.wait)]
    assert max(abs(heard - n * 0.05) for n, heard in enumerate(heard_s)) < 0.0031


@pytest.mark.parametrize(
    ("times_s", "speed", "start_s", "due_s"),
    [
        ([0, 1, 3], 0.5, 0.0, [0, 2, 6]),
        ([0, 1, 2, 3], 10.0, 1.5, [0, 0.1]),
        ([0, 100, 99, 101], 1.0, 0.0, [0, 100, 100, 102]),
        ([0, 1, -50, -49, -47], 1.0, 0.0, [0, 1, 1, 2, 4]),
        ([0, 1, -50, -49, -47], 1.0, 1.5, [0, 2]),
        ([0, 1, 0.9, 1.1], 1.0, 0.0, [0, 1, 1, 1.1]),
        ([0, 1, 1e9, 1e9 + 2], 1.0, 0.0, [0, 1, 1, 3]),
    ],
)
def test_a_speed_a_start_and_a_clock_that_is_set(times_s, speed, start_s, due_s):
    assert [due for due, _ in schedule(records_at(times_s), speed, start_s)] == due_s


@pytest.mark.parametrize("speed", [0.0, float("nan")])
def test_an_impossible_speed_is_refused(speed):
    with pytest.raises(LogError, match="needs a speed above zero"):
        next(play([], SimulatedClock(), lambda _: None, speed))


FIRST_US = 1_790_000_000_000_000


def record(path, times_s):
    """A heartbeat at each of these times."""
    encoder = Encoder(1, 1)
    with TlogWriter(path) as writer:
        for n, time_s in enumerate(times_s):
            message = dialect.MAVLink_heartbeat_message(12, 3, 0, n, 4, 3)
            writer.write(FIRST_US + round(time_s * 1e6), encoder.encode(message))
    return path


def test_the_frames_between_two_instants_are_those_that_a_reading_of_all_gives(tmp_path):
    path = record(tmp_path / "a.tlog", range(100))
    reel = Reel([path])
    everything = list(read_tlog(path))
    assert (reel.length_s, reel.began_unix_s) == (99.0, FIRST_US / 1e6)
    for start, end in ((0, 100), (0, 1), (10, 20), (99, 200)):
        expected = [(float(n), frame) for n, (_, frame) in enumerate(everything) if start <= n < end]
        assert list(reel.between(float(start), float(end))) == expected
    assert list(reel.between(50.0, 50.0)) == list(reel.between(200.0, 300.0)) == []


def test_damage_takes_its_own_frames_alone(tmp_path):
    path = record(tmp_path / "a.tlog", range(10))
    data = bytearray(path.read_bytes())
    size = len(data) // 10
    data[4 * size + 20] ^= 0xFF
    damaged = tmp_path / "b.tlog"
    damaged.write_bytes(data[:-5])
    times = [time_s for time_s, _ in Reel([damaged]).between(0.0, 100.0)]
    assert times == [0.0, 1.0, 2.0, 3.0, 5.0, 6.0, 7.0, 8.0]


def test_recordings_stand_one_after_the_other_empty_files_left_out_and_no_time_runs_back(tmp_path):
    (tmp_path / "empty.tlog").write_bytes(b"")
    first = record(tmp_path / "a.tlog", (0.0, 1.0, 0.95, 2.0))
    second = record(tmp_path / "b.tlog", range(5, 7))
    reel = Reel([tmp_path / "empty.tlog", first, tmp_path / "empty.tlog", second])
    assert [time_s for time_s, _ in reel.between(0.0, 100.0)] == [0.0, 1.0, 1.0, 2.0, 5.0, 6.0]
    with pytest.raises(LogError, match="is empty"):
        Reel([tmp_path / "empty.tlog"])


def set_back(path):
    """Four seconds at 20 Hz; after the first of them the clock is set back by an hour."""
    return record(path, [n * 0.05 - 3600.0 * (n >= 20) for n in range(80)])


def test_a_dive_whose_clock_was_set_back_is_shown_to_its_end(tmp_path):
    reel = Reel([set_back(tmp_path / "a.tlog")])
    times_s = [time_s for time_s, _ in reel.between(0.0, 100.0)]
    assert times_s == pytest.approx([n * 0.05 - 0.05 * (n >= 20) for n in range(80)])
    assert reel.length_s == times_s[-1]
