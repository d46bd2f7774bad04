"""Recordings of one dive without a frame in common: put together by the vehicle's boot time, or told what to do."""

import pytest
from diving_vehicle import Dive
from test_clocks_that_step import of_it

from bridge.errors import LogError
from bridge.ring.whole import WHOLE
from bridge.tlog import read_tlog
from gcs_plugin.dives.folder import DiveFolder
from gcs_plugin.fetch.whole import write_records
from identify.ingest.open import recording_files
from tui.merging import merge

pytestmark = pytest.mark.usefixtures("switched_off")

SOURCE = (1, 191)


@pytest.fixture(scope="module")
def frames(tmp_path_factory):
    """What the vehicle sent in a minute and a half, dated by the ground's clock."""
    dive = Dive(tmp_path_factory.mktemp("sent"))
    dive.dive(90.0)
    return dive.heard


def dive_of(tmp_path, records):
    folder = DiveFolder(tmp_path / "lake")
    folder.path.mkdir()
    write_records(folder.path / "telemetry.tlog", records)
    return folder


def other_of(tmp_path, records, ahead_s=0.0):
    file = tmp_path / "other.tlog"
    write_records(file, [(stamp_us + round(ahead_s * 1e6), raw) for stamp_us, raw in records])
    return file


@pytest.mark.parametrize("ahead_s", [0.0, -86_400.0, 7.5])
def test_a_recording_of_the_middle_alone_goes_in_by_the_vehicles_boot_time(tmp_path, frames, ahead_s) -> None:
    folder = dive_of(tmp_path, of_it(frames, 0.0, 20.0) + of_it(frames, 80.0))
    middle = of_it(frames, 30.0, 70.0, seed=1)
    done = merge(folder, other_of(tmp_path, middle, ahead_s))
    whole = [(stamp_us, frame.raw) for stamp_us, frame in read_tlog(folder.path / WHOLE)]
    sent = of_it(frames, 0.0, 20.0) + of_it(frames, 30.0, 70.0) + of_it(frames, 80.0)
    assert [raw for _, raw in whole] == [raw for _, raw in sent]
    assert max(abs(one[0] - true[0]) for one, true in zip(whole, sent, strict=True)) < 10_000
    assert (
        "It has no frame in common with the dive, and is dated by the vehicle's time since boot" in done.words
    )
    assert "10 s of it, from 0:19 on and 10 s of it, from 1:09 on, nobody has" in done.words


def test_a_recording_that_follows_on_says_how_to_put_it_into_the_folder(tmp_path, frames) -> None:
    folder = dive_of(tmp_path, of_it(frames, 0.0, 40.0))
    file = other_of(tmp_path, of_it(frames, 50.0))
    with pytest.raises(
        LogError, match=r"begins 10 s after .* put it into the folder as telemetry.2.tlog, and all"
    ):
        merge(folder, file)
    file.rename(folder.path / "telemetry.2.tlog")
    assert sum(len(list(read_tlog(one))) for one in recording_files(folder.path)) == len(
        of_it(frames, 0.0, 40.0) + of_it(frames, 50.0)
    )


def test_a_recording_that_goes_before_is_told_to_come_first(tmp_path, frames) -> None:
    folder = dive_of(tmp_path, of_it(frames, 50.0))
    with pytest.raises(
        LogError, match=r"ends 10 s before .* put the dive's recordings into the folder of this one"
    ):
        merge(folder, other_of(tmp_path, of_it(frames, 0.0, 40.0)))


def test_a_recording_that_follows_on_by_another_clock_is_not_to_be_read_beside_it(tmp_path, frames) -> None:
    folder = dive_of(tmp_path, of_it(frames, 0.0, 40.0))
    with pytest.raises(LogError, match=r"its clock is 3600.0 s ahead, so that it can't be read beside it"):
        merge(folder, other_of(tmp_path, of_it(frames, 50.0), 3600.0))


def test_a_recording_of_the_next_start_is_of_another_dive(tmp_path) -> None:
    dive = Dive(tmp_path / "ring")
    dive.dive(20.0)
    folder = dive_of(tmp_path, dive.heard)
    dive.heard = []
    dive.switch_on()
    dive.dive(20.0)
    with pytest.raises(LogError, match="has hardly a frame in common with the dive; check"):
        merge(folder, other_of(tmp_path, dive.heard))
