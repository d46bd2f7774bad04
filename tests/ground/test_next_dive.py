"""The recorder goes on in the next dive's files: each frame lies in exactly one of both dives."""

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.clock import SimulatedClock
from bridge.errors import LogError
from bridge.links.memory import memory_pair
from bridge.wire.framing import Encoder
from gcs_plugin.recording.recorder import Count, Recorder


def frames_of(count):
    encoder = Encoder(1, 1)
    return [encoder.encode(dialect.MAVLink_system_time_message(1, 1000 + n)) for n in range(count)]


class Dive:
    """Files that are kept in memory; `full` fails every write, `refuses` every new file."""

    def __init__(self, name=""):
        self.name = name
        self.files = []
        self.full = self.refuses = False
        self.calls = []

    def open(self, number):
        if self.refuses:
            raise LogError(f"{self.name}: can't be made; choose another")
        assert number == len(self.files) + 1
        self.files.append([])
        return DiveFile(self, self.files[-1])

    @property
    def raws(self):
        return [raw for file in self.files for raw in file]


class DiveFile:
    def __init__(self, dive, raws):
        self.dive, self.raws = dive, raws

    def write(self, unix_us, raw):
        assert unix_us > 0
        if self.dive.full:
            raise LogError("the disk failed; mend it")
        self.raws.append(raw)

    def sync(self):
        self.dive.calls.append("sync")

    def look(self):
        """It lies where it was made."""

    def close(self):
        self.dive.calls.append("close")


class Sea:
    def __init__(self):
        self.first, self.second, self.clock = Dive("first"), Dive("second"), SimulatedClock()
        self.far, near = memory_pair()
        self.notices, self.counts = [], []
        self.recorder = Recorder([near], self.first.open, self.clock, lambda: 1 << 40, self.notices.append)

    def hear(self, data):
        self.clock.advance_to(self.clock.boot_s() + 0.5)
        self.far.write(data)
        return self.recorder.step(0.0)

    def go_on(self):
        self.recorder.go_on(self.second.open, self.counts.append)


def test_frames_go_into_the_dive_before_and_from_then_on_into_the_next_one():
    sea, raws = Sea(), frames_of(20)
    for raw in raws[:12]:
        sea.hear(raw)
    sea.go_on()
    for raw in raws[12:]:
        sea.hear(raw)
    assert (sea.first.raws, sea.second.raws) == (raws[:12], raws[12:])
    assert sea.counts == [Count(1, 12, 12, 12 * len(raws[0]), 0)]
    assert sea.recorder.count == Count(1, 8, 8, 8 * len(raws[0]), 0)
    assert sea.notices == []


@pytest.mark.parametrize("cut", range(1, len(frames_of(1)[0])))
def test_a_frame_that_has_come_by_half_lies_whole_in_the_next_dive(cut):
    sea, (before, torn) = Sea(), frames_of(2)
    sea.hear(before)
    sea.hear(torn[:cut])
    sea.go_on()
    sea.hear(torn[cut:])
    assert (sea.first.raws, sea.second.raws) == ([before], [torn])


def test_the_dive_before_is_put_on_the_disk_and_closed_by_who_syncs_and_not_by_who_reads():
    sea = Sea()
    sea.hear(frames_of(1)[0])
    sea.go_on()
    sea.hear(b"")
    assert sea.first.calls == []
    sea.recorder.sync()
    assert sea.first.calls == ["sync", "close"]
    assert sea.second.calls == ["sync"]


def test_one_that_ends_at_once_closes_both():
    sea = Sea()
    sea.go_on()
    sea.recorder.close()
    assert sea.first.calls == sea.second.calls == ["sync", "close"]
    assert sea.counts == [Count(1, 0, 0, 0, 0)]


def test_what_the_disk_would_not_take_yet_lies_in_the_next_dive():
    sea, raws = Sea(), frames_of(4)
    sea.hear(raws[0])
    sea.first.full = True
    for raw in raws[1:3]:
        sea.hear(raw)
    sea.go_on()
    sea.hear(raws[3])
    assert (sea.first.raws, sea.second.raws) == (raws[:1], raws[1:])
    assert sea.recorder.lost == 0


def test_a_folder_that_can_not_be_made_leaves_the_dive_as_it_is():
    sea, raws = Sea(), frames_of(2)
    sea.hear(raws[0])
    sea.second.refuses = True
    with pytest.raises(LogError, match="second: can't be made"):
        sea.go_on()
    sea.hear(raws[1])
    assert sea.first.raws == raws
    assert sea.counts == []


def test_a_second_one_is_refused_while_the_first_waits():
    sea = Sea()
    sea.go_on()
    with pytest.raises(LogError, match="waits for the disk"):
        sea.recorder.go_on(Dive("third").open, sea.counts.append)


def test_what_was_lost_on_the_way_is_told_of_the_dive_in_which_it_was():
    sea, raws = Sea(), frames_of(30)
    for raw in raws[:10]:
        sea.hear(raw)
    sea.hear(raws[14])
    sea.go_on()
    sea.hear(raws[15])
    sea.hear(raws[18])
    assert [(count.lost, count.missed) for count in (*sea.counts, sea.recorder.count)] == [(0, 4), (0, 2)]
