"""Somebody deletes or moves what is being recorded: told at once, gone on from in a new file, nothing called kept."""

import shutil

import pytest
from faked_ground import FakeLink, frames_of

from bridge.clock import SimulatedClock
from bridge.errors import LogError
from bridge.tlog import TlogWriter, of_those_that_hold_frames, read_tlog
from gcs_plugin.dives.folder import About, new_folder
from gcs_plugin.recording import past_files
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
        return count.frames, count.lost, count.moved


def held(folder):
    return [
        frame.raw for records in of_those_that_hold_frames(folder.heard(), read_tlog) for _, frame in records
    ]


@pytest.fixture
def lake(tmp_path):
    return Lake(tmp_path / "dives")


def test_a_deleted_folder_is_told_made_anew_and_no_frame_is_missing(lake):
    raws = frames_of(30)
    lake.hear(raws[:10])
    shutil.rmtree(lake.root)
    lake.hear(raws[10:20])
    lake.hear(raws[20:])
    file = lake.folder.path / "telemetry.tlog"
    assert lake.sentences() == [
        f"{file}: was deleted while it was written; a new file is begun in the folder, made anew",
        "the recording goes on in its file 2",
        f"{file}: was deleted, and is written once more: 20 frames",
    ]
    lake.recorder.close()
    assert held(lake.folder) == raws
    assert lake.folder.about() == ABOUT
    assert lake.counts() == (30, 0, 0)


def test_a_deleted_file_alone_is_written_once_more_as_often_as_it_is_deleted(lake):
    raws = frames_of(40)
    for n in range(4):
        lake.hear(raws[10 * n : 10 * n + 10])
        for file in lake.folder.heard():
            file.unlink()
        lake.hear([])
        lake.hear([])
        assert held(lake.folder) == raws[: 10 * n + 10]
    lake.recorder.close()
    assert held(lake.folder) == raws
    assert lake.counts() == (40, 0, 0)


def test_what_is_deleted_just_before_the_end_is_written_once_more_too(lake):
    raws = frames_of(10)
    lake.hear(raws)
    shutil.rmtree(lake.root)
    lake.recorder.close()
    assert held(lake.folder) == raws
    assert lake.counts() == (10, 0, 0)
    assert "was deleted, and is written once more: 10 frames" in lake.sentences()[-1]


def test_a_moved_folder_keeps_what_it_holds_and_is_counted_as_elsewhere(lake, tmp_path):
    raws = frames_of(30)
    lake.hear(raws[:10])
    lake.folder.path.rename(tmp_path / "aside")
    lake.hear(raws[10:20])
    lake.hear(raws[20:])
    lake.recorder.close()
    assert [frame.raw for _, frame in read_tlog(tmp_path / "aside" / "telemetry.tlog")] == raws[:20]
    assert held(lake.folder) == raws[20:]
    assert lake.counts() == (10, 0, 20)
    told = [sentence for sentence in lake.sentences() if "was moved" in sentence]
    assert len(told) == 2
    assert told[1].startswith(f"{lake.folder.path / 'telemetry.tlog'}: was moved with its 20 frames (")


def test_what_was_deleted_and_can_not_be_written_once_more_is_lost_until_it_can(lake, monkeypatch):
    raws = frames_of(20)
    lake.hear(raws[:10])
    shutil.rmtree(lake.root)

    def refuses(_):
        raise LogError("the disk is full")

    with monkeypatch.context() as full:
        full.setattr(TlogWriter, "restore", refuses)
        lake.hear(raws[10:])
        lake.hear([])
        lake.hear([])
        assert lake.counts() == (0, 20, 0)
        assert lake.sentences()[-1] == "the disk is full; its 20 frames are lost with it if that lasts"
        assert lake.sentences().count(lake.sentences()[-1]) == 1
    lake.clock.advance_to(lake.clock.now_s + past_files.AGAIN_S)
    lake.hear([])
    assert lake.counts() == (20, 0, 0)
    assert held(lake.folder) == raws


def test_what_stays_lost_is_counted_once_whatever_dives_follow(lake, monkeypatch):
    ended = []
    lake.hear(frames_of(10))
    shutil.rmtree(lake.root)

    def refuses(_):
        raise LogError("the disk is full")

    monkeypatch.setattr(TlogWriter, "restore", refuses)
    lake.hear([])
    lake.hear([])
    for _ in range(2):
        lake.recorder.go_on(lake.opener(lake.new()), ended.append)
        lake.hear(frames_of(5))
    lake.recorder.close()
    ended.append(lake.recorder.count)
    assert [(count.frames, count.lost) for count in ended] == [(0, 10), (5, 0), (5, 0)]


def test_half_a_copy_is_not_left_where_it_fails(lake, monkeypatch):
    lake.hear(frames_of(10))
    file = lake.folder.path / "telemetry.tlog"
    file.unlink()

    def full(*_):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as broken:
        broken.setattr("os.write", full)
        lake.recorder.close()
    assert not file.exists()
    assert lake.counts() == (0, 10, 0)
    assert "can't be written once more (No space left on device)" in lake.sentences()[-1]


def test_a_disk_that_numbers_files_anew_at_each_look_raises_no_alarm(lake, monkeypatch):
    monkeypatch.setattr("os.path.samestat", lambda *_: False)
    lake.hear(frames_of(10))
    lake.hear(frames_of(10))
    lake.recorder.close()
    assert lake.sentences() == []
    assert lake.counts() == (20, 0, 0)


def test_what_a_network_disk_keeps_only_while_it_is_open_was_deleted(lake):
    raws = frames_of(20)
    lake.hear(raws[:10])
    file = lake.folder.path / "telemetry.tlog"
    kept_open = file.rename(file.with_name(".nfs0000000000000001"))
    lake.hear(raws[10:])
    lake.hear([])
    assert held(lake.folder) == raws
    kept_open.unlink()
    lake.recorder.close()
    assert lake.counts() == (20, 0, 0)


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


def test_where_a_moved_dive_lies_is_told_as_long_as_it_is_recorded(lake):
    raws = frames_of(30)
    lake.hear(raws[:10])
    assert lake.recorder.taken_away == ""
    away = lake.root / "away"
    lake.folder.path.rename(away)
    lake.hear(raws[10:20])
    lake.hear(raws[20:])
    assert lake.recorder.taken_away == (
        f"this dive was moved while it is recorded: 20 frames lie in {away}; the recording goes on in its old place"
    )
    second = lake.new()
    lake.recorder.go_on(lake.opener(second), lambda _: None)
    lake.hear(frames_of(1))
    assert lake.recorder.taken_away == ""


def test_a_deleted_dive_that_is_written_once_more_is_told_for_a_minute(lake):
    raws = frames_of(30)
    lake.hear(raws[:10])
    shutil.rmtree(lake.root)
    lake.hear(raws[10:20])
    lake.hear(raws[20:])
    assert (
        lake.recorder.taken_away == "this dive was deleted while it is recorded: 20 frames are written anew"
    )
    lake.clock.advance_to(lake.clock.now_s + past_files.TOLD_S + 1.0)
    assert lake.recorder.taken_away == ""
