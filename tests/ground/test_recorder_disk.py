"""The recorder and its disk: full, failing, or with its files deleted or moved."""

import errno
import os
import shutil
import threading

import pytest
from faked_ground import Disk, Ground, frames_of
from fakes.recordings import raws
from fakes.vehicle import FakeLink

from bridge.clock import SimulatedClock
from bridge.errors import LogError
from bridge.wire.tlog import TlogWriter
from gcs_plugin.dives.folder import About, new_folder
from gcs_plugin.locks import is_being_written
from gcs_plugin.recording.recorder import Recorder


@pytest.mark.parametrize("n", range(1, 21))
def test_whichever_write_fails_no_frame_is_missing(n):
    ground = Ground(Disk(fail_at=[n]))
    for raw in frames_of(20):
        ground.hear(raw, after_s=1.5)
    assert ground.disk.raws == frames_of(20)
    assert len(ground.disk.files) == 2
    assert "the disk failed; mend it" in ground.sentences()
    assert ground.recorder.kept.lost == 0


def test_a_full_disk_is_waited_out_in_memory_without_a_litter_of_files():
    ground = Ground()
    first, *further = frames_of(200)
    ground.hear(first)
    assert (ground.recorder.unwritten, ground.recorder.waiting) == ("", 0)
    ground.disk.full, ground.disk.free = True, 0
    for raw in further[:-1]:
        ground.hear(raw, after_s=0.5)
    assert len(ground.disk.files) == 1
    assert (ground.recorder.unwritten, ground.recorder.waiting) == ("the disk failed; mend it", 198)
    assert ground.recorder.disk_left_s == 0.0
    ground.disk.full, ground.disk.free = False, 1 << 40
    ground.hear(further[-1], after_s=10.0)
    assert ground.disk.raws == [first, *further]
    assert (ground.recorder.unwritten, ground.recorder.waiting) == ("", 0)
    assert any("the disk has 0.0 MB left" in sentence for sentence in ground.sentences())


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
    monkeypatch.setattr("gcs_plugin.recording.files.MOST_WAITING_BYTES", 10 * len(frames_of(2)[1]))
    ground = Ground()
    ground.disk.full, ground.disk.free = True, 0
    for raw in frames_of(60):
        ground.hear(raw)
    assert 45 <= ground.recorder.kept.lost <= 50
    ground.recorder.close()
    assert ground.recorder.kept.lost == 60
    assert any("could not be written and are lost" in sentence for sentence in ground.sentences())


def test_a_log_of_the_recording_on_the_disk_that_is_full_ends_no_recording():
    """The recorder's sentences go into a file too where nobody sits at its terminal."""

    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    ground = Ground(before_sync=full)
    ground.recorder._notice = full
    ground.disk.full, ground.disk.free = True, 0
    end_sync = ground.recorder.begin_sync()
    for raw in frames_of(20):
        ground.hear(raw, after_s=1.0)
    waited = threading.Event()
    waited.wait(1.2)
    assert [thread for thread in threading.enumerate() if thread.name == "recorder-sync"]
    end_sync()
    ground.disk.full, ground.disk.free = False, 1 << 40
    ground.hear(frames_of(21)[-1], after_s=10.0)
    assert ground.disk.raws == frames_of(21)


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
    each_second = b"".join(frames_of(200))
    for _ in range(5):
        ground.hear(each_second, after_s=1.0)
    (warning,) = [n.sentence for n in ground.notices if n.level == "warning"]
    minutes = 1_100_000 / len(each_second) / 60
    assert warning == f"the disk has 1.1 MB left, about {minutes:.0f} min of recording; free some space"


def test_it_is_the_rate_of_about_a_minute_and_no_silence_changes_it():
    ground, frame = Ground(), frames_of(1)[0]
    reports = []

    def hear(count, seconds):
        for _ in range(seconds):
            ground.hear(frame * count, after_s=1.0)
            reports.append(ground.recorder.disk_left_s)

    hear(100, 120)
    usual_s = ground.disk.free / (100 * len(frame))
    assert reports[-1] == pytest.approx(usual_s, rel=0.01)
    hear(200, 4)
    assert reports[-1] == pytest.approx(usual_s, rel=0.15)
    hear(100, 120)
    hear(0, 24)
    assert reports[-1] == float("inf")
    hear(100, 4)
    assert reports[-1] == pytest.approx(usual_s, rel=0.05)


class Once:
    """An end of the recording that comes after one round of the thread that syncs."""

    rounds = 0

    def wait(self, _):
        self.rounds += 1
        return self.rounds > 1


def test_others_are_told_before_the_disk_is_synced():
    calls = []
    ground = Ground(Disk(), before_sync=lambda: calls.append("told"))
    ground.disk.calls = calls
    ground.recorder.sync_until(Once())
    assert calls == ["told", "sync"]


UNIX_S = 1_790_000_000.0
ABOUT = About(configuration="hovering", notes="calm")


class Lake:
    """A recording into a folder of its own; `hear` is half a second of it, with the disk synced as in real time."""

    def __init__(self, root):
        self.root, self.link, self.clock, self.said = root, FakeLink(), SimulatedClock(), []
        self.folder = self.new()
        self.recorder = Recorder(
            [self.link], self.opener(self.folder), self.clock, self.folder.free_bytes, self.said.append
        )

    def new(self):
        folder = new_folder(self.root, UNIX_S, "lake")
        folder.describe(ABOUT)
        return folder

    @staticmethod
    def opener(folder):
        return lambda number: folder.open_telemetry(number, ABOUT)

    def hear(self, raws):
        for raw in raws:
            self.link.chunks.append(raw)
            self.recorder.step(0.0)
        self.clock.advance_to(self.clock.now_s + 0.5)
        self.recorder.sync()
        self.recorder.step(0.0)

    def sentences(self):
        return [notice.sentence for notice in self.said]

    def counts(self):
        count = self.recorder.count
        return count.frames, count.lost


@pytest.fixture
def lake(tmp_path):
    return Lake(tmp_path / "dives")


def test_a_folder_that_is_deleted_ends_with_an_error_and_goes_on_made_anew(lake):
    sent = frames_of(30)
    lake.hear(sent[:10])
    shutil.rmtree(lake.root)
    lake.hear(sent[10:20])
    lake.hear(sent[20:])
    lake.recorder.close()
    assert lake.sentences() == [
        f"{lake.folder.path / 'telemetry.tlog'}: was deleted while it was written; a new file is begun in the "
        "folder, made anew; its 20 frames are not in the dive's folder any more",
        "the recording goes on in its file 2",
    ]
    assert raws(*lake.folder.heard()) == sent[20:]
    assert lake.folder.about() == ABOUT
    assert lake.counts() == (10, 20)
    assert lake.recorder.count.files == len(lake.folder.heard()) == 1


def test_a_disk_that_fails_for_hours_though_it_has_space_is_not_littered_with_files(lake, monkeypatch):
    """As where the crew's share of the disk is used up."""
    sent = frames_of(500)

    def fails(*_):
        raise LogError("can't be written (Disk quota exceeded); free disk space")

    lake.hear(sent[:10])
    with monkeypatch.context() as full:
        full.setattr(TlogWriter, "write", fails)
        for raw in sent[10:490]:
            lake.hear([raw])
    assert [path.name for path in lake.folder.heard()] == ["telemetry.tlog"]
    lake.clock.advance_to(lake.clock.now_s + 10.0)
    lake.hear(sent[490:])
    lake.recorder.close()
    assert raws(*lake.folder.heard()) == sent
    assert lake.recorder.count.files == len(lake.folder.heard()) == 2


def test_a_file_that_is_deleted_is_told_as_often_as_that_happens(lake):
    sent = frames_of(30)
    for n in range(3):
        lake.hear(sent[10 * n : 10 * n + 10])
        for file in lake.folder.heard():
            file.unlink()
        lake.hear([])
        assert lake.recorder.count.files == 0
    assert [sentence.partition(": was ")[2][:7] for sentence in lake.sentences()[::2]] == ["deleted"] * 3
    assert lake.counts() == (0, 30)


def test_a_file_that_is_deleted_just_before_the_end_is_not_called_kept(lake):
    lake.hear(frames_of(10))
    shutil.rmtree(lake.root)
    lake.recorder.close()
    assert lake.counts() == (0, 10)
    assert "its 10 frames are not in the dive's folder any more" in lake.sentences()[-1]


def test_a_folder_that_is_moved_keeps_its_frames_and_the_place_is_told(lake, tmp_path):
    sent = frames_of(30)
    lake.hear(sent[:10])
    lake.folder.path.rename(tmp_path / "aside")
    lake.hear(sent[10:20])
    lake.hear(sent[20:])
    lake.recorder.close()
    assert raws(tmp_path / "aside" / "telemetry.tlog") == sent[:20]
    assert raws(*lake.folder.heard()) == sent[20:]
    assert lake.counts() == (10, 20)
    assert str(tmp_path / "aside" / "telemetry.tlog") in lake.sentences()[0]


def test_a_disk_that_fails_even_as_a_file_is_closed_stops_no_sync_and_holds_no_lock(lake, monkeypatch):
    """As a network disk does: the thread that syncs goes on, and so does the end of the recording."""
    sent, close, first = frames_of(20), os.close, lake.folder

    def fails(file):
        close(file)
        raise OSError(errno.EIO, "Input/output error")

    lake.hear(sent[:10])
    lake.recorder.go_on(lake.opener(lake.new()), lambda _: None)
    lake.recorder.step(0.0)
    with monkeypatch.context() as broken:
        broken.setattr(os, "close", fails)
        lake.hear(sent[10:])
        lake.recorder.close()
    dives = sorted(lake.root.iterdir())
    assert raws(*(dive / "telemetry.tlog" for dive in dives)) == sent
    assert dives[0] == first.path
    assert not any(is_being_written(dive / "telemetry.tlog") for dive in dives)


def test_frames_of_a_deleted_file_are_lost_in_their_own_dive_alone(lake):
    ended = []
    lake.hear(frames_of(10))
    shutil.rmtree(lake.root)
    lake.hear([])
    lake.recorder.go_on(lake.opener(lake.new()), ended.append)
    lake.hear(frames_of(5))
    lake.recorder.close()
    ended.append(lake.recorder.count)
    assert [(count.frames, count.lost) for count in ended] == [(0, 10), (5, 0)]
