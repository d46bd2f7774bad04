"""What was fetched of the file that the vehicle still writes is compared with it wherever no checksum speaks for it."""

import random
from pathlib import Path

import pytest
from lying_vehicle import VEHICLE, Vehicle
from test_fetching import KEPT, LONGEST_S, PATIENCE_S, SEGMENTS, heard, is_fetched_whole, ring, segment

from bridge.new_file import PART
from bridge.ring.whole import WHOLE
from bridge.tlog import STAMP_BYTES, read_tlog, record_of
from gcs_plugin.fetch.doubtful import doubtful
from gcs_plugin.folder import About, DiveFolder
from tui.fetched import MIRROR, Fetched, Fetcher

GROWING = segment(SEGMENTS - 1).name
RECORDS = [record_of(*record) for record in KEPT[0][:10]]


def fetcher(root: Path) -> Fetcher:
    vehicle = Vehicle(root / "ring", None, random.Random(0), 1e9, LONGEST_S)
    return Fetcher(vehicle, vehicle.world, PATIENCE_S, lambda *_: None)


def fetch(root: Path, dive: DiveFolder) -> Fetched:
    return fetcher(root).whole(dive)


def hurt(path: Path, begin: int, end: int) -> None:
    data = path.read_bytes()
    path.write_bytes(data[:begin] + bytes(byte ^ 0xA5 for byte in data[begin:end]) + data[end:])


def test_a_recording_without_damage_leaves_nothing_in_doubt() -> None:
    assert doubtful(b"".join(RECORDS)) == []
    assert doubtful(b"") == []


def test_every_byte_of_a_frame_that_is_damaged_is_in_doubt() -> None:
    whole, begin = b"".join(RECORDS), 0
    for record in RECORDS:
        for at in range(begin + STAMP_BYTES, begin + len(record)):
            data = bytearray(whole)
            data[at] ^= 0x40
            assert any(first <= at < first + size for first, size in doubtful(bytes(data)))
        begin += len(record)


def test_a_frame_of_a_kind_that_nobody_knows_and_a_stamp_that_is_none_are_in_doubt() -> None:
    unknown = record_of(KEPT[0][3][0], b"\xfd\3\0\0\0\1\xbf\x60\xea\0abcde")
    before, after = b"".join(RECORDS[:3]), b"".join(RECORDS[3:])
    assert doubtful(before + unknown + after) == [(len(before), len(unknown))]
    assert doubtful(before + b"\xff" * STAMP_BYTES + after[STAMP_BYTES:]) == [(len(before), STAMP_BYTES)]
    assert doubtful(before + after[:-1]) == [(len(before + after) - len(RECORDS[-1]), len(RECORDS[-1]) - 1)]


@pytest.mark.parametrize(("begin", "end"), [(900, 1600), (0, 1), (20, 21), (1000, 1001), (8, 3000)])
def test_damage_in_the_middle_of_what_still_grows_is_fetched_again(
    tmp_path: Path, begin: int, end: int
) -> None:
    dive = heard(tmp_path)
    is_fetched_whole(tmp_path, dive)
    hurt(tmp_path / "dives" / MIRROR / (GROWING + PART), begin, end)
    (dive.path / WHOLE).unlink()
    is_fetched_whole(tmp_path, dive)
    assert fetch(tmp_path, dive).damaged == 0


@pytest.mark.parametrize(("begin", "end"), [(900, 1600), (20, 21)])
def test_damage_on_the_vehicle_itself_is_kept_as_it_is_and_counted(
    tmp_path: Path, begin: int, end: int
) -> None:
    dive, own = heard(tmp_path), ring(tmp_path / "ring", SEGMENTS) / GROWING
    hurt(own, begin, end)
    first = fetch(tmp_path, dive)
    assert "The vehicle's recording is damaged (places: 1); what stood there may be missing" in first.words
    assert "the dive is whole" not in first.words
    mirrored = tmp_path / "dives" / MIRROR / (GROWING + PART)
    assert mirrored.read_bytes() == own.read_bytes()
    made = (dive.path / WHOLE).read_bytes()
    again = fetch(tmp_path, dive)
    assert (again.fetched_bytes, again.damaged) == (0, 1)
    assert "nothing is missing" not in again.words
    assert (dive.path / WHOLE).read_bytes() == made
    # A record more on the vehicle: only that is fetched.
    more = record_of(*KEPT[SEGMENTS][0])
    with own.open("ab") as file:
        file.write(more)
    assert fetch(tmp_path, dive).fetched_bytes == len(more)


def test_damage_here_beside_that_of_the_vehicle_itself_is_fetched_again(tmp_path: Path) -> None:
    dive, own = heard(tmp_path), ring(tmp_path / "ring", SEGMENTS) / GROWING
    hurt(own, 900, 1600)
    fetch(tmp_path, dive)
    mirrored = tmp_path / "dives" / MIRROR / (GROWING + PART)
    hurt(mirrored, 1900, 1910)
    again = fetch(tmp_path, dive)
    assert (again.fetched_bytes, again.damaged) == (own.stat().st_size, 1)
    assert mirrored.read_bytes() == own.read_bytes()


def test_a_dive_of_which_nothing_was_heard_counts_what_is_damaged_too(tmp_path: Path) -> None:
    hurt(ring(tmp_path / "ring", SEGMENTS) / segment(1).name, 900, 1600)
    (tmp_path / "ring" / segment(2).name).write_bytes(b"\0" * 500)
    done = fetcher(tmp_path).new(tmp_path / "dives", VEHICLE, None, "new", About())
    assert done.damaged == 2
    assert len(list(read_tlog(done.path))) == done.frames < SEGMENTS * len(KEPT[0])
