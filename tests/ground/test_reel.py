"""A recording is looked at anywhere: the frames between any two instants, whatever the file went through."""

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.errors import LogError
from bridge.framing import Encoder
from bridge.tlog import TlogWriter, read_tlog
from gcs_plugin.dives.replay import Reel

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


def test_recordings_of_one_dive_stand_one_after_the_other(tmp_path):
    first, second = record(tmp_path / "a.tlog", range(10)), record(tmp_path / "b.tlog", range(20, 30))
    reel = Reel([first, second])
    assert [time_s for time_s, _ in reel.between(0.0, 100.0)] == [*map(float, (*range(10), *range(20, 30)))]


def test_a_time_that_runs_back_is_the_one_before_it(tmp_path):
    reel = Reel([record(tmp_path / "a.tlog", (0.0, 1.0, 0.95, 2.0))])
    assert [time_s for time_s, _ in reel.between(0.0, 9.0)] == [0.0, 1.0, 1.0, 2.0]


def test_damage_takes_its_own_frames_alone(tmp_path):
    path = record(tmp_path / "a.tlog", range(10))
    data = bytearray(path.read_bytes())
    size = len(data) // 10
    data[4 * size + 20] ^= 0xFF
    damaged = tmp_path / "b.tlog"
    damaged.write_bytes(data[:-5])
    times = [time_s for time_s, _ in Reel([damaged]).between(0.0, 100.0)]
    assert times == [0.0, 1.0, 2.0, 3.0, 5.0, 6.0, 7.0, 8.0]


def test_a_file_that_holds_nothing_is_left_out(tmp_path):
    (tmp_path / "empty.tlog").write_bytes(b"")
    first, second = record(tmp_path / "a.tlog", range(3)), record(tmp_path / "b.tlog", range(5, 7))
    reel = Reel([tmp_path / "empty.tlog", first, tmp_path / "empty.tlog", second])
    assert [time_s for time_s, _ in reel.between(0.0, 100.0)] == [0.0, 1.0, 2.0, 5.0, 6.0]
    with pytest.raises(LogError, match="is empty"):
        Reel([tmp_path / "empty.tlog"])


def test_a_file_that_can_t_be_read_is_said(tmp_path):
    with pytest.raises(LogError, match="no such file"):
        Reel([tmp_path / "none.tlog"])
