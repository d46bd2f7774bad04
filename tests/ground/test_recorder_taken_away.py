"""Somebody deletes or moves what is being recorded: told at once, gone on from in a new file, nothing called kept."""

import shutil

import pytest
from faked_ground import FakeLink, frames_of

from bridge.clock import SimulatedClock
from bridge.tlog import of_those_that_hold_frames, read_tlog
from gcs_plugin.dives.folder import About, new_folder
from gcs_plugin.recording.files import DiskLeft
from gcs_plugin.recording.recorder import Recorder

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


def held(folder):
    return [
        frame.raw for records in of_those_that_hold_frames(folder.heard(), read_tlog) for _, frame in records
    ]


@pytest.fixture
def lake(tmp_path):
    return Lake(tmp_path / "dives")


def test_a_folder_that_is_deleted_ends_with_an_error_and_goes_on_made_anew(lake):
    raws = frames_of(30)
    lake.hear(raws[:10])
    shutil.rmtree(lake.root)
    lake.hear(raws[10:20])
    lake.hear(raws[20:])
    lake.recorder.close()
    assert lake.sentences() == [
        f"{lake.folder.path / 'telemetry.tlog'}: was deleted while it was written; a new file is begun in the "
        "folder, made anew; its 20 frames are not in the dive's folder any more",
        "the recording goes on in its file 2",
    ]
    assert held(lake.folder) == raws[20:]
    assert lake.folder.about() == ABOUT
    assert lake.counts() == (10, 20)


def test_a_file_that_is_deleted_is_told_as_often_as_that_happens(lake):
    raws = frames_of(30)
    for n in range(3):
        lake.hear(raws[10 * n : 10 * n + 10])
        for file in lake.folder.heard():
            file.unlink()
        lake.hear([])
    assert [sentence.partition(": was ")[2][:7] for sentence in lake.sentences()[::2]] == ["deleted"] * 3
    assert lake.counts() == (0, 30)


def test_a_file_that_is_deleted_just_before_the_end_is_not_called_kept(lake):
    lake.hear(frames_of(10))
    shutil.rmtree(lake.root)
    lake.recorder.close()
    assert lake.counts() == (0, 10)
    assert "its 10 frames are not in the dive's folder any more" in lake.sentences()[-1]


def test_a_folder_that_is_moved_keeps_its_frames_and_the_place_is_told(lake, tmp_path):
    raws = frames_of(30)
    lake.hear(raws[:10])
    lake.folder.path.rename(tmp_path / "aside")
    lake.hear(raws[10:20])
    lake.hear(raws[20:])
    lake.recorder.close()
    assert [frame.raw for _, frame in read_tlog(tmp_path / "aside" / "telemetry.tlog")] == raws[:20]
    assert held(lake.folder) == raws[20:]
    assert lake.counts() == (10, 20)
    assert str(tmp_path / "aside" / "telemetry.tlog") in lake.sentences()[0]


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


def test_a_disk_that_numbers_files_anew_at_each_look_raises_no_alarm(lake, monkeypatch):
    monkeypatch.setattr("os.path.samestat", lambda *_: False)
    lake.hear(frames_of(10))
    lake.hear(frames_of(10))
    lake.recorder.close()
    assert lake.sentences() == []
    assert lake.counts() == (20, 0)


def test_nobody_is_told_of_megabytes_where_the_folder_is_gone(lake):
    lake.hear(frames_of(10))
    shutil.rmtree(lake.root)
    for _ in range(10):
        lake.hear(frames_of(10))
    assert not [sentence for sentence in lake.sentences() if "MB left" in sentence]
    assert lake.recorder.disk_left_s > 600.0


def test_a_disk_that_can_not_be_asked_is_no_full_one():
    def gone():
        raise FileNotFoundError("the folder is gone")

    said = []
    disk = DiskLeft(gone, said.append, 0.0)
    disk.came(1000)
    disk.look(10.0)
    assert said == []
    assert not disk.has_room
