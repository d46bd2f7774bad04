"""A dive is called whole only where nothing of it lacks, and doubtful only for damage that may be of it."""

from pathlib import Path

import pytest
from diving_vehicle import Dive
from fakes.recordings import raws
from merged_dives import SOURCE, all_frames, dive_of, each_once, fetcher_of, of_it

from bridge.files import PART
from bridge.wire.framing import Encoder
from bridge.wire.segments import Segment, segments_in
from bridge.wire.tlog import read_tlog, record_of
from bridge.wire.whole_recording import WHOLE
from gcs_plugin.fetch.merge_order import Hole, as_sent, holes_in, lost_in
from gcs_plugin.fetch.merging import merge_recordings, write_records
from gcs_plugin.peers import ground_heartbeat
from tui.commands.fetch import MIRROR, Fetched
from tui.commands.merge import merge_all

pytestmark = pytest.mark.usefixtures("switched_off")

DAY_US = 86_400_000_000


@pytest.fixture(scope="module")
def frames():
    """The vehicle's frames of 80 s, dated by the ground's clock."""
    return all_frames(80.0)


def bytes_of(records):
    return [raw for _, raw in records]


def ring_of(tmp_path, *parts):
    """Segments of one boot, on a clock of its own."""
    files = []
    for number, part in enumerate(parts):
        files.append(tmp_path / Segment(1, 7, number, 1000 * number).name)
        write_records(files[-1], [(stamp_us - DAY_US, raw) for stamp_us, raw in part])
    return files


def made_of(tmp_path, frames, *kept):
    """A dive of which the ground heard the beginning and the end, and what the vehicle kept between those times."""
    heard = of_it(frames, 0.0, 18.0) + of_it(frames, 70.0)
    folder = dive_of(tmp_path, heard)
    ring = ring_of(tmp_path, *(of_it(frames, begins_s, ends_s) for begins_s, ends_s in kept))
    return merge_recordings(folder.telemetry(), ring, SOURCE)


def fetched_words(made):
    done = Fetched(Path(WHOLE), len(made.records), made.missing, 0, 0, 0, made.holes, made.lost)
    return done.words, done.is_whole


@pytest.mark.parametrize(
    ("kept", "hole"),
    [
        (((0.0, 50.0),), "20 s of it, from 0:49 on"),
        (((40.0, 80.0),), "22 s of it, from 0:17 on"),
        (((0.0, 30.0), (60.0, 80.0)), "30 s of it, from 0:29 on"),
        (((10.0, 19.0), (40.0, 71.0)), "21 s of it, from 0:18 on"),
    ],
)
def test_what_the_vehicle_kept_between_two_times_heard_goes_in_and_the_rest_is_told(
    tmp_path, frames, kept, hole
):
    made = made_of(tmp_path, frames, *kept)
    known = {
        raw
        for begins_s, ends_s in (*kept, (0.0, 18.0), (70.0, 80.0))
        for raw in bytes_of(of_it(frames, begins_s, ends_s))
    }
    assert set(bytes_of(made.records)) == known
    words, is_whole = fetched_words(made)
    assert f"{hole}, nobody has, the vehicle neither" in words
    assert "what there is of the dive is in" in words
    assert not is_whole


def test_a_dive_of_which_all_is_there_is_whole(tmp_path, frames):
    made = made_of(tmp_path, frames, (0.0, 50.0), (50.0, 80.0))
    assert bytes_of(made.records) == bytes_of(frames)
    words, is_whole = fetched_words(made)
    assert "the dive is whole in" in words
    assert is_whole


def test_frames_that_lack_one_by_one_are_told_by_the_vehicles_sequence_numbers(tmp_path, frames):
    gone = {raw for _, raw in frames[500:900:10]}
    left = [frame for frame in frames if frame[1] not in gone]
    folder = dive_of(tmp_path, of_it(left, 0.0, 18.0) + of_it(left, 70.0))
    made = merge_recordings(folder.telemetry(), ring_of(tmp_path, left), SOURCE)
    assert made.lost == sum((raw[5], raw[6]) == SOURCE for raw in gone) > 10
    assert f"{made.lost} single frames, nobody has" in fetched_words(made)[0]


@pytest.mark.parametrize("order", ["ab", "ba"])
def test_two_recordings_that_overlap_each_other_fill_the_dive_in_either_order(tmp_path, frames, order):
    heard = of_it(frames, 0.0, 18.0) + of_it(frames, 70.0)
    folder = dive_of(tmp_path, heard)
    parts = {"a": (10.0, 48.0, 2), "b": (42.0, 80.0, -3)}
    for name, (begins_s, ends_s, days) in parts.items():
        records = [(stamp_us + days * DAY_US, raw) for stamp_us, raw in of_it(frames, begins_s, ends_s)]
        write_records(tmp_path / f"{name}.tlog", records)
    *_, last = merge_all(folder, [tmp_path / f"{name}.tlog" for name in order])
    assert raws(folder.path / WHOLE) == bytes_of(frames)
    assert "the dive is whole" in last.words


def test_what_was_sent_before_and_after_the_dive_is_told(tmp_path, frames):
    folder = dive_of(tmp_path, of_it(frames, 20.0, 60.0))
    write_records(tmp_path / "other.tlog", frames)
    (done,) = merge_all(folder, [tmp_path / "other.tlog"])
    beyond = len(frames) - len(of_it(frames, 20.0, 60.0))
    assert f"{beyond} frames of it were sent before the dive's first frame or after its last" in done.words


def beats(times_s, first=0, skip=0):
    """Heartbeats of one sender, whose sequence numbers skip so many after half of them."""
    encoder, out = Encoder(1, 191), []
    for number, time_s in enumerate(times_s):
        for _ in range(first if number == 0 else skip if number == len(times_s) // 2 else 0):
            encoder.encode(ground_heartbeat())
        out.append((round(time_s * 1e6), encoder.encode(ground_heartbeat())))
    return out


def test_a_vehicle_that_was_silent_by_design_has_no_hole():
    quiet = [*range(10), *range(70, 80)]
    assert holes_in(beats([*quiet, *range(140, 150)]), SOURCE) == ()
    assert holes_in(beats(quiet, skip=60), SOURCE) == (Hole(9.0, 61.0),)
    assert holes_in(beats(range(0, 60, 5), skip=1), SOURCE) == ()
    assert holes_in([], SOURCE) == ()
    assert lost_in(beats([0.1 * k for k in range(10)], skip=3), SOURCE) == 3


def test_frames_of_a_sender_come_in_its_order_where_stamps_differ_by_jitter():
    sent = beats([0.01 * k for k in range(600)], first=200)
    mixed = sent[:]
    mixed[10:14] = [mixed[12], mixed[10], mixed[13], mixed[11]]
    mixed[300], mixed[301] = mixed[301], mixed[300]
    stamped = [(stamp_us, raw) for (stamp_us, _), (_, raw) in zip(sent, mixed, strict=True)]
    assert as_sent(stamped) == sent


def test_a_sender_that_starts_anew_or_was_long_unheard_is_left_in_its_order():
    first = beats([0.01 * k for k in range(100)])
    again = [(stamp_us + 5_000_000, raw) for stamp_us, raw in beats([0.01 * k for k in range(100)])]
    assert as_sent(first + again) == first + again
    skipped = beats([0.5 * k for k in range(100)], skip=200)
    assert as_sent(skipped) == skipped


BOARD_US = 40_000_000
"""By how much the ground's clock is ahead."""


@pytest.fixture(scope="module")
def sent():
    """The frames of two minutes, each other than all others, and by the ground's clock."""
    return each_once(all_frames())


def place(sent, second):
    """The number of the first frame so long after the first of all."""
    return next(k for k, (stamp_us, _) in enumerate(sent) if stamp_us - sent[0][0] >= second * 1e6)


def ring_with_damage(path, sent, hurt):
    """The vehicle's recording, in which the frames of those numbers can't be read any more."""
    records = [record_of(stamp_us - BOARD_US, raw) for stamp_us, raw in sent]
    for k in hurt:
        records[k] = b"\xa5" * len(records[k])
    path.write_bytes(b"".join(records))
    return path


def damage(tmp_path, sent, hurt, unheard=()):
    """Damaged places in the dive between 50 s and 80 s, and beyond it."""
    ring = ring_with_damage(tmp_path / "ring.tlog", sent, hurt)
    heard = [sent[k] for k in range(place(sent, 50.0), place(sent, 80.0) + 1) if k not in unheard]
    write_records(tmp_path / "ground.tlog", heard)
    made = merge_recordings([tmp_path / "ground.tlog"], [ring], SOURCE)
    assert made.beyond + len(made.records) >= len(sent) - len(hurt)
    return made.damaged, made.damaged_beyond


@pytest.mark.parametrize("seconds", [(0.0,), (1.0,), (119.0,), (0.0, 1.0, 100.0, 119.0)])
def test_damage_before_the_dive_or_after_it_costs_it_nothing(tmp_path, sent, seconds):
    assert damage(tmp_path, sent, [place(sent, second) for second in seconds]) == (0, len(seconds))


@pytest.mark.parametrize("second", [50.5, 65.0, 79.5])
def test_damage_within_the_dive_makes_it_doubtful(tmp_path, sent, second):
    assert damage(tmp_path, sent, [place(sent, second)]) == (1, 0)


def test_damage_just_within_the_first_and_the_last_frame_that_was_heard_makes_the_dive_doubtful(
    tmp_path, sent
):
    first, last = place(sent, 50.0), place(sent, 80.0)
    within = [first + 1, last - 1]
    assert damage(tmp_path, sent, within, unheard=within) == (2, 0)
    assert damage(tmp_path, sent, [first - 1, last + 1]) == (0, 2), "next to them, it is beyond"


def test_where_a_frame_may_have_been_on_its_way_for_long_damage_shortly_before_is_no_longer_certain(
    tmp_path, sent
):
    """The vehicle's recording lacks the first that was heard, so that nobody knows when it was sent."""
    hurt = [place(sent, 10.0), place(sent, 30.0), place(sent, 50.0), place(sent, 110.0)]
    assert damage(tmp_path, sent, hurt) == (2, 2)


def test_a_fetch_says_that_the_dive_is_whole_and_where_else_there_is_damage(tmp_path):
    dive = Dive(tmp_path / "ring")
    dive.dive(5.0)
    dive.heard.clear()
    dive.dive(4.0)
    folder = dive_of(tmp_path, dive.heard[:20] + dive.heard[-20:])
    (segment, _), *_ = segments_in(dive.folder)
    on_disk = dive.folder / segment.name
    data = on_disk.read_bytes()
    on_disk.write_bytes(data[:1500] + b"\xa5" * 600 + data[2100:])
    done = fetcher_of(dive).whole(folder)
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
