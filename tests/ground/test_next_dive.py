"""The recorder goes on in the next dive's files: each frame lies in exactly one of both dives."""

import pytest
from faked_ground import Disk, Ground, frames_of
from fakes.recordings import raws

from bridge.clock import SimulatedClock
from bridge.errors import LogError
from gcs_plugin.dives.folder import About
from gcs_plugin.dives.recorded_dives import RecordedDives
from gcs_plugin.recording.files import Kept
from gcs_plugin.recording.recorder import DiveCounts


class Sea(Ground):
    """A recorder into a `first` dive, and the `second` that it may go on in."""

    def __init__(self):
        super().__init__()
        self.first, self.second, self.counts = self.disk, Disk(), []

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
    assert sea.counts == [DiveCounts(1, 12, len(b"".join(raws[:12])), 0, 12)]
    assert sea.recorder.count == DiveCounts(1, 8, len(b"".join(raws[12:])), 0, 8)
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
    assert sea.link.closed
    assert sea.counts == [DiveCounts(1, 0, 0, 0, 0)]


def test_what_the_disk_would_not_take_yet_lies_in_the_next_dive():
    sea, raws = Sea(), frames_of(4)
    sea.hear(raws[0])
    sea.first.full = True
    for raw in raws[1:3]:
        sea.hear(raw)
    sea.go_on()
    sea.hear(raws[3])
    assert (sea.first.raws, sea.second.raws) == (raws[:1], raws[1:])
    assert sea.recorder.count.lost == 0


def test_a_folder_that_can_not_be_made_leaves_the_dive_as_it_is():
    sea, raws = Sea(), frames_of(2)
    sea.hear(raws[0])
    sea.second.refuses = True
    with pytest.raises(LogError, match="the folder can't be made"):
        sea.go_on()
    sea.hear(raws[1])
    assert sea.first.raws == raws
    assert sea.counts == []


def test_a_second_one_is_refused_while_the_first_waits():
    sea = Sea()
    sea.go_on()
    with pytest.raises(LogError, match="waits for the disk"):
        sea.recorder.go_on(Disk().open, sea.counts.append)


def test_what_was_lost_on_the_way_is_told_of_the_dive_in_which_it_was():
    sea, raws = Sea(), frames_of(30)
    for raw in raws[:10]:
        sea.hear(raw)
    sea.hear(raws[14])
    sea.go_on()
    sea.hear(raws[15])
    sea.hear(raws[18])
    assert [(count.lost, count.missed) for count in (*sea.counts, sea.recorder.count)] == [(0, 4), (0, 2)]


class Filled:
    """A recorder whose dive holds 3 GB, and that can't open the next one's file while it `refuses`."""

    kept = Kept(1, 30_000_000, 3_000_000_000, 0)

    def __init__(self):
        self.refuses, self.change = True, None

    def go_on(self, _open_file, change):
        if self.refuses:
            raise LogError("the disk is full")
        self.change = change


def test_a_full_dive_that_could_not_go_on_in_a_next_one_is_tried_again_each_minute_and_then_once(tmp_path):
    clock, recorder, begun = SimulatedClock(), Filled(), []
    dives = RecordedDives(tmp_path, "", lambda _: About(), clock)
    full, tried_s = dives.folder, []
    for second in range(200):
        clock.advance_to(float(second))
        try:
            if dives.go_on_if_full(recorder, begun.append):
                tried_s.append(second)
        except LogError:
            tried_s.append(-second)
        recorder.refuses = second < 100
    assert tried_s == [0, -60, 120]
    assert len(list(tmp_path.iterdir())) == 2
    recorder.change(DiveCounts(1, 1, 1, 0, 1))
    assert [dive.folder for dive in begun] == [full.path]
    assert dives.folder != full


def test_a_silent_dive_that_took_over_frames_of_the_one_before_is_kept(tmp_path):
    ground, sent, over = Ground(Disk()), frames_of(20), []
    dives = RecordedDives(tmp_path / "dives", "", lambda _: About(), ground.clock)
    ground.disk.full, ground.disk.free = True, 0
    for raw in sent:
        ground.hear(raw)
    dives.go_on(ground.recorder, over.append)
    ground.hear(b"")
    ground.recorder.close()
    last = dives.end(ground.recorder.count)
    assert (len(over), last.count.frames, last.count.lost) == (1, 20, 0)
    assert last.folder is not None
    assert raws(last.folder / "telemetry.tlog") == sent
