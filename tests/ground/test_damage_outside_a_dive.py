"""A dive is doubtful for damage of the vehicle's recording only where what was damaged may be of it."""

import pytest
from diving_vehicle import Dive

from bridge.new_file import PART
from bridge.ring.segments import segments_in
from bridge.tlog import read_tlog, record_of
from gcs_plugin.dives.folder import DiveFolder
from gcs_plugin.fetch.mirror import damaged_before
from gcs_plugin.fetch.whole import made_whole, newest_frames, write_records
from tui.fetched import MIRROR, Fetcher

pytestmark = pytest.mark.usefixtures("switched_off")

BOARD_US = 40_000_000
"""By how much the ground's clock is ahead."""
SOURCE = (1, 191)


@pytest.fixture(scope="module")
def sent(tmp_path_factory):
    """The frames of two minutes, each other than all others, and by the ground's clock."""
    dive = Dive(tmp_path_factory.mktemp("sent"))
    dive.dive(120.0)
    first = {raw: stamp_us for stamp_us, raw in reversed(dive.heard)}
    return [(stamp_us, raw) for stamp_us, raw in dive.heard if first.pop(raw, None) is not None]


def place(sent, second):
    """The number of the first frame so long after the first of all."""
    return next(k for k, (stamp_us, _) in enumerate(sent) if stamp_us - sent[0][0] >= second * 1e6)


def ring_of(path, sent, hurt):
    """The vehicle's recording, in which the frames of those numbers can't be read any more."""
    records = [record_of(stamp_us - BOARD_US, raw) for stamp_us, raw in sent]
    for k in hurt:
        records[k] = b"\xa5" * len(records[k])
    path.write_bytes(b"".join(records))
    return path


def damage(tmp_path, sent, hurt, unheard=()):
    """What it comes to for the dive between 50 s and 80 s: damaged in it, and beyond."""
    ring = ring_of(tmp_path / "ring.tlog", sent, hurt)
    heard = [sent[k] for k in range(place(sent, 50.0), place(sent, 80.0) + 1) if k not in unheard]
    write_records(tmp_path / "ground.tlog", heard)
    made = made_whole([tmp_path / "ground.tlog"], [ring], SOURCE)
    assert made.beyond + len(made.records) >= len(sent) - len(hurt)
    return made.damaged, made.damaged_beyond


@pytest.mark.parametrize("seconds", [(0.0,), (1.0,), (119.0,), (0.0, 1.0, 100.0, 119.0)])
def test_damage_before_the_dive_or_after_it_costs_it_nothing(tmp_path, sent, seconds):
    assert damage(tmp_path, sent, [place(sent, second) for second in seconds]) == (0, len(seconds))


def test_damage_at_the_very_end_of_the_recording_is_after_the_dive(tmp_path, sent):
    assert damage(tmp_path, sent, [len(sent) - 2, len(sent) - 1]) == (0, 1)


@pytest.mark.parametrize("second", [50.5, 65.0, 79.5])
def test_damage_within_the_dive_makes_it_doubtful(tmp_path, sent, second):
    assert damage(tmp_path, sent, [place(sent, second)]) == (1, 0)


def test_damage_just_within_the_first_and_the_last_frame_that_was_heard_makes_the_dive_doubtful(
    tmp_path, sent
):
    hurt = [place(sent, 50.0) + 1, place(sent, 80.0) - 1]
    assert damage(tmp_path, sent, hurt, unheard=hurt) == (2, 0)


def test_damage_next_to_the_first_and_the_last_frame_that_was_heard_is_beyond(tmp_path, sent):
    hurt = [place(sent, 50.0) - 1, place(sent, 80.0) + 1]
    assert damage(tmp_path, sent, hurt) == (0, 2)


@pytest.mark.parametrize("second", [50.0, 80.0])
def test_damage_of_the_first_or_the_last_frame_that_was_heard_makes_the_dive_doubtful(tmp_path, sent, second):
    """Who knows which of the damaged frames was sent after it."""
    middle = place(sent, second)
    assert damage(tmp_path, sent, range(middle - 3, middle + 4)) == (1, 0)


def test_where_a_frame_may_have_been_on_its_way_for_long_damage_shortly_before_is_no_longer_certain(
    tmp_path, sent
):
    """The vehicle's recording lacks the first that was heard, so that nobody knows when it was sent."""
    hurt = [place(sent, 10.0), place(sent, 30.0), place(sent, 50.0), place(sent, 110.0)]
    assert damage(tmp_path, sent, hurt) == (2, 2)


@pytest.mark.parametrize(("second", "count"), [(10.0, 0), (105.0, 0), (115.0, 1)])
def test_of_the_newest_seconds_alone_damage_before_them_costs_nothing(tmp_path, sent, second, count):
    ring = ring_of(tmp_path / "ring.tlog", sent, [place(sent, second)])
    assert newest_frames([ring], 10_000_000)[1] == count
    assert newest_frames([ring], None)[1] == 1


def test_damage_stands_before_the_record_that_follows_it(sent):
    records = [record_of(*one) for one in sent[:6]]
    assert damaged_before(b"".join(records)) == []
    records[2] = b"\xa5" * len(records[2])
    assert damaged_before(b"".join(records)) == [2]
    records[0] = b"\xa5" * len(records[0])
    assert damaged_before(b"".join(records)) == [0, 1]
    records[5] = b"\xa5" * len(records[5])
    assert damaged_before(b"".join(records)) == [0, 1, 3]
    assert damaged_before(b"".join(records[3:5]) + records[4][:-1]) == []


def test_a_fetch_says_that_the_dive_is_whole_and_where_else_there_is_damage(tmp_path):
    dive = Dive(tmp_path / "ring")
    dive.dive(5.0)
    dive.heard.clear()
    dive.dive(4.0)
    folder = DiveFolder(tmp_path / "dives" / "2026-11-20T0912Z-lake")
    folder.path.mkdir(parents=True)
    write_records(folder.path / "telemetry.tlog", dive.heard[:20] + dive.heard[-20:])
    (segment, _), *_ = segments_in(dive.folder)
    own = dive.folder / segment.name
    data = own.read_bytes()
    own.write_bytes(data[:1500] + b"\xa5" * 600 + data[2100:])
    done = Fetcher(dive, dive.world, 60.0, lambda *_: None).whole(folder)
    assert "frames had not been heard: " not in done.words
    assert "frames had not been heard; the dive is whole in" in done.words
    assert "damaged before or after this dive (places: 1), which costs it nothing" in done.words
    assert "may be missing" not in done.words
    assert (done.damaged, done.damaged_beyond) == (0, 1)
    mirrored = folder.path.parent / MIRROR / segment.name
    assert (mirrored if mirrored.exists() else mirrored.with_name(mirrored.name + PART)).read_bytes()[
        1500:2100
    ] == b"\xa5" * 600
    assert len(list(read_tlog(done.path))) == done.frames
