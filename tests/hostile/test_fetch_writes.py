"""A fetch writes files of its own folder alone, and compares bytes without a checksum."""

import errno
import random

import pytest
import strange_things
from lying_vehicle import VEHICLE, Vehicle
from strange_things import THINGS, put
from test_fetching import (
    KEPT,
    LONGEST_S,
    PATIENCE_S,
    SEGMENTS,
    fetched,
    heard,
    is_fetched_whole,
    ring,
    segment,
)

from bridge.files import PART
from bridge.wire.tlog import STAMP_BYTES, read_tlog, record_of
from bridge.wire.whole_recording import WHOLE
from gcs_plugin.dives.folder import About
from gcs_plugin.fetch.mirror import LOCK, doubtful
from tui.commands.fetch import MIRROR, Fetcher

ours = strange_things.ours

NAME = segment(0).name


def said(dive):
    """The error of a fetch from an honest vehicle; empty if it fetched."""
    place = dive.path.parents[1] / "ring"
    return fetched(Vehicle(ring(place, SEGMENTS), None, random.Random(0), 1e9, LONGEST_S), dive)


@pytest.mark.parametrize("thing", THINGS)
@pytest.mark.parametrize("name", [LOCK, NAME + PART])
def test_what_is_no_file_is_named_and_neither_written_nor_waited_for(tmp_path, ours, name, thing):
    dive, mirror = heard(tmp_path), tmp_path / "dives" / MIRROR
    mirror.mkdir()
    put(mirror / name, thing, ours)
    assert said(dive) == f"{mirror / name}: is no file; take it away and fetch again"
    assert ours.read_text(encoding="utf-8") == "ours"
    assert not ours.with_name("nothing").exists()
    (mirror / name).rmdir() if thing == "a folder" else (mirror / name).unlink()
    is_fetched_whole(tmp_path, dive)


@pytest.mark.parametrize("thing", ["a pipe", "a link", "a link to nothing", "a link to a device"])
def test_what_lies_under_the_name_of_a_whole_file_and_is_none_is_fetched(tmp_path, ours, thing):
    dive, mirror = heard(tmp_path), tmp_path / "dives" / MIRROR
    mirror.mkdir()
    put(mirror / NAME, thing, ours)
    is_fetched_whole(tmp_path, dive)
    assert not (mirror / NAME).is_symlink()
    assert ours.read_text(encoding="utf-8") == "ours"


@pytest.mark.parametrize("is_there", [True, False])
def test_a_mirror_that_leads_elsewhere_is_refused_and_nothing_is_written_there(tmp_path, is_there):
    dive, mirror, outside = heard(tmp_path), tmp_path / "dives" / MIRROR, tmp_path / "outside"
    if is_there:
        outside.mkdir()
    mirror.symlink_to(outside)
    assert said(dive) == f"{mirror}: leads elsewhere; take that link away and fetch again"
    assert list(outside.iterdir() if is_there else []) == []
    assert outside.exists() == is_there
    mirror.unlink()
    is_fetched_whole(tmp_path, dive)


def test_where_files_can_t_be_locked_a_dive_is_fetched_all_the_same(tmp_path, monkeypatch):
    def unable(*_):
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr("bridge.locks.fcntl.flock", unable)
    dive = heard(tmp_path)
    assert said(dive) == ""
    is_fetched_whole(tmp_path, dive)


GROWING = segment(SEGMENTS - 1).name
RECORDS = [record_of(*record) for record in KEPT[0][:10]]


def fetcher(root):
    vehicle = Vehicle(root / "ring", None, random.Random(0), 1e9, LONGEST_S)
    return Fetcher(vehicle, vehicle.world, PATIENCE_S, lambda *_: None)


def fetch(root, dive):
    return fetcher(root).whole(dive)


def hurt(path, begin, end):
    data = path.read_bytes()
    path.write_bytes(data[:begin] + bytes(byte ^ 0xA5 for byte in data[begin:end]) + data[end:])


def test_every_byte_of_a_frame_that_is_damaged_is_in_doubt():
    whole, begin = b"".join(RECORDS), 0
    assert doubtful(whole) == doubtful(b"") == []
    for record in RECORDS:
        for at in range(begin + STAMP_BYTES, begin + len(record)):
            data = bytearray(whole)
            data[at] ^= 0x40
            assert any(first <= at < first + size for first, size in doubtful(bytes(data)))
        begin += len(record)


def test_a_frame_of_a_kind_that_nobody_knows_and_a_stamp_that_is_none_are_in_doubt():
    unknown = record_of(KEPT[0][3][0], b"\xfd\3\0\0\0\1\xbf\x60\xea\0abcde")
    before, after = b"".join(RECORDS[:3]), b"".join(RECORDS[3:])
    assert doubtful(before + unknown + after) == [(len(before), len(unknown))]
    assert doubtful(before + b"\xff" * STAMP_BYTES + after[STAMP_BYTES:]) == [(len(before), STAMP_BYTES)]
    assert doubtful(before + after[:-1]) == [(len(before + after) - len(RECORDS[-1]), len(RECORDS[-1]) - 1)]


@pytest.mark.parametrize(("begin", "end"), [(900, 1600), (0, 1), (20, 21), (1000, 1001), (8, 3000)])
def test_damage_in_the_middle_of_what_still_grows_is_fetched_again(tmp_path, begin, end):
    dive = heard(tmp_path)
    is_fetched_whole(tmp_path, dive)
    hurt(tmp_path / "dives" / MIRROR / (GROWING + PART), begin, end)
    (dive.path / WHOLE).unlink()
    is_fetched_whole(tmp_path, dive)
    assert fetch(tmp_path, dive).damaged == 0


@pytest.mark.parametrize(("begin", "end"), [(900, 1600), (20, 21)])
def test_damage_on_the_vehicle_itself_is_kept_as_it_is_and_counted(tmp_path, begin, end):
    dive, growing = heard(tmp_path), ring(tmp_path / "ring", SEGMENTS) / GROWING
    hurt(growing, begin, end)
    first = fetch(tmp_path, dive)
    assert "The vehicle's recording is damaged (places: 1); what stood there may be missing" in first.words
    assert "the dive is whole" not in first.words
    mirrored = tmp_path / "dives" / MIRROR / (GROWING + PART)
    assert mirrored.read_bytes() == growing.read_bytes()
    made = (dive.path / WHOLE).read_bytes()
    again = fetch(tmp_path, dive)
    assert (again.fetched_bytes, again.damaged) == (0, 1)
    assert "nothing is missing" not in again.words
    assert (dive.path / WHOLE).read_bytes() == made
    # A record more on the vehicle: only that is fetched.
    more = record_of(*KEPT[SEGMENTS][0])
    with growing.open("ab") as file:
        file.write(more)
    assert fetch(tmp_path, dive).fetched_bytes == len(more)


def test_a_dive_of_which_nothing_was_heard_counts_what_is_damaged_too(tmp_path):
    hurt(ring(tmp_path / "ring", SEGMENTS) / segment(1).name, 900, 1600)
    (tmp_path / "ring" / segment(2).name).write_bytes(b"\0" * 500)
    done = fetcher(tmp_path).new(tmp_path / "dives", VEHICLE, None, "new", About())
    assert done.damaged == 2
    assert len(list(read_tlog(done.path))) == done.frames < SEGMENTS * len(KEPT[0])
