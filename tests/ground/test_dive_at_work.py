"""A dive that is still recorded, or that somebody else puts together: refused by name, and nothing is hidden."""

import fcntl
import os
import random
import threading
from dataclasses import replace

import pytest
from diving_vehicle import Dive
from fakes.recordings import raws
from fakes.telling import telling
from merged_dives import all_frames, fetcher_of, heard_by

from bridge import exit_codes
from bridge.errors import LogError
from bridge.locks import holder_of
from bridge.wire.framing import Encoder
from bridge.wire.redaction import FILE_TRANSFER
from bridge.wire.whole_recording import WHOLE, unmerged_words, with_unmerged_frames
from gcs_plugin import locks
from gcs_plugin.dives.folder import DiveFolder
from gcs_plugin.fetch.merging import write_records
from gcs_plugin.locks import LockedTlogWriter, is_being_written, merge_lock
from gcs_plugin.peers import ground_heartbeat
from gcs_plugin.recording.state import release, write_holding
from tui import cli
from tui.commands import merge as merging
from tui.commands.merge import merge

pytestmark = pytest.mark.usefixtures("switched_off")


@pytest.fixture(autouse=True)
def at_once(monkeypatch, tmp_path):
    """Nobody is waited for."""
    monkeypatch.setattr("gcs_plugin.fetch.into_dive.CLOSED_WITHIN_S", 0.0)
    monkeypatch.setattr(locks, "MERGE_S", 0.0)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))


@pytest.fixture
def frames():
    return all_frames()


@pytest.fixture
def folder(tmp_path):
    made = tmp_path / "dives" / "2026-11-20T0912Z-lake"
    made.mkdir(parents=True)
    return DiveFolder(made)


@pytest.fixture
def other(tmp_path, frames):
    """Another recorder's recording of the dive."""
    write_records(tmp_path / "other.tlog", heard_by(frames, lambda unix_s: unix_s, random.Random(1)))
    return tmp_path / "other.tlog"


def recorded(folder, frames):
    """Its recorder has written so much, and has the file open."""
    writer = folder.open_telemetry(1)
    for stamp_us, raw in frames:
        writer.write(stamp_us, raw)
    return writer


def of_a_recorder(folder):
    """The state of a recording by this process into that dive."""
    return telling(hub="", links=("serial:/dev/x:9600",), folder=str(folder.path))


def test_a_file_is_told_as_written_until_its_recorder_closes_it(tmp_path):
    path = tmp_path / "telemetry.tlog"
    with LockedTlogWriter(path):
        assert is_being_written(path)
        assert holder_of(path) in (os.getpid(), None)
    assert not is_being_written(path)


def test_a_lock_that_somebody_has_for_a_moment_is_had_with_the_next_sync(tmp_path):
    path = tmp_path / "telemetry.tlog"
    with LockedTlogWriter(path) as writer:
        writer.close()
        writer._file = os.open(path, os.O_RDWR)
        with path.open("rb") as looking:
            fcntl.flock(looking, fcntl.LOCK_SH)
            writer.sync()
        assert not is_being_written(path)
        writer.sync()
        assert is_being_written(path)


def test_a_pipe_and_an_absent_file_are_written_by_nobody(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    assert not is_being_written(tmp_path / "pipe")
    assert not is_being_written(tmp_path / "absent")
    assert holder_of(tmp_path / "absent") is None


def test_a_merge_into_a_dive_that_a_second_recorder_writes_is_refused(folder, frames, other):
    with recorded(folder, frames[: len(frames) // 2]) as writer:
        with pytest.raises(LogError) as refused:
            merge(folder, other)
        assert "is still recorded" in str(refused.value)
        how = "end that recording where it runs (Ctrl-C there; in MAVProxy `seatrial record stop`)"
        assert str(refused.value).endswith(
            f" beside what `seatrial record --end` ends; {how}, and merge again"
        )
        assert not (folder.path / WHOLE).exists()
        for stamp_us, raw in frames[len(frames) // 2 :]:
            writer.write(stamp_us, raw)
    assert merge(folder, other).into == folder.path / WHOLE
    assert frames[-1][1] in raws(folder.path / WHOLE)


def test_a_merge_into_the_dive_of_the_recording_that_runs_is_refused(folder, frames, other):
    write_records(folder.path / "telemetry.tlog", frames)
    write_holding(of_a_recorder(folder))
    with pytest.raises(LogError) as refused:
        merge(folder, other)
    assert str(refused.value) == (
        f"{folder.path}: is still recorded, by process {os.getpid()}; let that go on in the next dive "
        "(`seatrial record --next`) or end it (`seatrial record --end`), and merge again"
    )
    assert not (folder.path / WHOLE).exists()


def test_a_second_recording_is_known_by_its_own_word_where_its_disk_knows_no_locks(folder, frames, other):
    write_records(folder.path / "telemetry.tlog", frames)
    write_holding(replace(of_a_recorder(folder), folder="/dives/elsewhere", pid=os.getppid()))
    write_holding(of_a_recorder(folder), second=True)
    with pytest.raises(LogError) as refused:
        merge(folder, other)
    assert f"is still recorded, by process {os.getpid()}, beside what" in str(refused.value)
    release()
    assert merge(folder, other).into == folder.path / WHOLE


def test_a_fetch_of_a_dive_that_a_second_recorder_writes_asks_the_vehicle_nothing(tmp_path, folder):
    dive = Dive(tmp_path / "fetched")
    dive.dive(5.0)
    before_s = dive.world.now_s
    with recorded(folder, dive.heard), pytest.raises(LogError, match=r"is still recorded.*and fetch again"):
        fetcher_of(dive).whole(folder)
    assert dive.world.now_s == before_s


def test_what_a_recorder_without_a_lock_writes_meanwhile_is_noticed(folder, frames, other, monkeypatch):
    telemetry = folder.path / "telemetry.tlog"
    write_records(telemetry, frames[:-10])
    merge_recordings = merging.merge_recordings

    def slowly(*how):
        result = merge_recordings(*how)
        with telemetry.open("ab") as file:
            file.write(other.read_bytes()[-500:])
        return result

    monkeypatch.setattr(merging, "merge_recordings", slowly)
    with pytest.raises(LogError, match=r"its recording grew meanwhile.*end that recording, and merge again"):
        merge(folder, other)
    assert not (folder.path / WHOLE).exists()


def test_another_merge_or_fetch_of_the_dive_is_refused_by_name(tmp_path, folder, frames, other):
    write_records(folder.path / "telemetry.tlog", frames)
    with merge_lock(folder.path, ""), pytest.raises(LogError, match="another merge or fetch") as refused:
        merge(folder, other)
    assert str(refused.value).endswith("puts recordings of it together; wait for its end and merge again")
    assert sorted(folder.path.iterdir()) == [folder.path / "telemetry.tlog"]
    dive = Dive(tmp_path / "fetched")
    dive.dive(5.0)
    write_records(folder.path / "telemetry.tlog", dive.heard)
    with merge_lock(folder.path, ""), pytest.raises(LogError, match="wait for its end and fetch again"):
        fetcher_of(dive).whole(folder)
    assert not (folder.path / WHOLE).exists()


def test_two_merges_at_once_lose_nothing_of_either(tmp_path, folder, frames, monkeypatch):
    monkeypatch.setattr(locks, "MERGE_S", 60.0)
    rng = random.Random(4)
    write_records(folder.path / "telemetry.tlog", heard_by(frames, lambda unix_s: unix_s, rng, 0.4))
    files = [tmp_path / f"{name}.tlog" for name in "abc"]
    for file in files:
        write_records(file, heard_by(frames, lambda unix_s: unix_s, rng, 0.4))
    together = threading.Barrier(len(files))

    def put(file):
        together.wait()
        merge(folder, file)

    working = [threading.Thread(target=put, args=(file,)) for file in files]
    for item in working:
        item.start()
    for item in working:
        item.join()
    alone = DiveFolder(tmp_path / "alone")
    alone.path.mkdir()
    write_records(alone.path / "telemetry.tlog", [])
    (alone.path / "telemetry.tlog").write_bytes((folder.path / "telemetry.tlog").read_bytes())
    for file in files:
        merge(alone, file)
    assert set(raws(folder.path / WHOLE)) == set(raws(alone.path / WHOLE))
    assert not list(folder.path.glob("*.part"))


def after(folder, frames, other, name):
    """A dive made whole of its beginning, and then all of it, in a recording of that name."""
    third = len(frames) // 3
    write_records(folder.path / "telemetry.tlog", frames[: 2 * third])
    merge(folder, other)
    assert with_unmerged_frames(list(folder.path.iterdir())) == []
    now = frames if name == "telemetry.tlog" else frames[2 * third :]
    write_records(folder.path / name, now)


@pytest.mark.parametrize("name", ["telemetry.tlog", "telemetry.2.tlog"])
def test_what_was_recorded_or_put_there_after_a_dive_was_made_whole_is_told_and_put_in(
    folder, frames, other, name, capsys
):
    after(folder, frames, other, name)
    words = f"{name} has frames that {WHOLE} lacks, and these are not read"
    for verb in (["dives", str(folder.path)], ["import", str(folder.path)]):
        cli.main(verb)
        assert words in " ".join(capsys.readouterr().out.split())
    assert cli.main(["merge", str(folder.path), str(folder.path / name)]) == exit_codes.DONE
    assert "is in it now" in " ".join(capsys.readouterr().out.split())
    assert {raw for _, raw in frames} <= set(raws(folder.path / WHOLE))
    for verb in (["dives", str(folder.path)], ["import", str(folder.path)]):
        cli.main(verb)
        assert "are not read" not in " ".join(capsys.readouterr().out.split())
    assert cli.main(["merge", str(folder.path), str(folder.path / name)]) == exit_codes.BAD_INPUT
    assert "is this dive's own recording" in capsys.readouterr().err


def test_where_several_recordings_lack_in_the_whole_one_a_single_command_adds_them_all(tmp_path):
    first, second = tmp_path / "telemetry.tlog", tmp_path / "telemetry.2.tlog"
    assert unmerged_words(tmp_path, [first, second]).endswith(
        f"`seatrial merge {tmp_path} {first} {second}` adds them."
    )
    assert unmerged_words(tmp_path, []) == ""


def test_the_next_fetch_puts_in_what_came_since_as_well(tmp_path, folder):
    dive = Dive(tmp_path / "fetched")
    dive.dive(20.0)
    write_records(folder.path / "telemetry.tlog", dive.heard[: len(dive.heard) // 2])
    fetcher = fetcher_of(dive)
    fetcher.whole(folder)
    write_records(folder.path / "telemetry.tlog", dive.heard)
    assert with_unmerged_frames(list(folder.path.iterdir())) == [folder.path / "telemetry.tlog"]
    fetcher.whole(folder)
    assert {raw for _, raw in dive.heard} <= set(raws(folder.path / WHOLE))


def test_heartbeats_of_the_ground_and_files_that_went_by_are_not_lacked(folder, frames, other):
    write_records(folder.path / "telemetry.tlog", frames)
    merge(folder, other)
    ground, vehicle = Encoder(255, 190), Encoder(1, 191)
    later = [(frames[-1][0] + k, ground.encode(ground_heartbeat())) for k in range(5)]
    later += [
        (frames[-1][0] + k, vehicle.frame(FILE_TRANSFER, bytes([0, 255, 190, k + 1]))) for k in range(5)
    ]
    write_records(folder.path / "telemetry.tlog", [*frames, *later])
    assert with_unmerged_frames(list(folder.path.iterdir())) == []
    (folder.path / "telemetry.3.tlog").write_bytes(b"")
    (folder.path / "telemetry.4.tlog").write_bytes(b"no recording" * 100)
    assert with_unmerged_frames(list(folder.path.iterdir())) == []
