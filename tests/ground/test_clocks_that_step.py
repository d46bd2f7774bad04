"""Recordings whose clocks were set, or began anew, while they ran, or that have no frame in common with the dive."""

import random
from collections import Counter

import pytest
from diving_vehicle import Dive

from bridge.errors import LogError
from bridge.ring.segments import Segment
from gcs_plugin.dives.folder import DiveFolder
from gcs_plugin.fetch.whole import made_whole, write_records
from tui.merging import merge

pytestmark = pytest.mark.usefixtures("switched_off")

BUSIEST = (1, 191)
STEP_AT_S = 30.0


@pytest.fixture(scope="module")
def frames(tmp_path_factory):
    """What the vehicle sent in a minute, each other than all others, dated by the ground's clock."""
    dive = Dive(tmp_path_factory.mktemp("sent"))
    dive.dive(60.0)
    often = Counter(raw for _, raw in dive.heard)
    return [(stamp_us, raw) for stamp_us, raw in dive.heard if often[raw] == 1]


def of_it(frames, begins_s=0.0, ends_s=1e9, share=1.0, seed=0):
    """What a recorder heard between two times, with a jitter of 3 ms."""
    rng, first_us, newest_us, out = random.Random(seed), frames[0][0], 0, []
    for stamp_us, raw in frames:
        if begins_s <= (stamp_us - first_us) * 1e-6 < ends_s and rng.random() < share:
            newest_us = max(newest_us, stamp_us + rng.randrange(3000))
            out.append((newest_us, raw))
    return out


def set_by(records, by_s, at_us):
    return [(stamp_us + round(by_s * 1e6) * (stamp_us >= at_us), raw) for stamp_us, raw in records]


def put_together(tmp_path, ground, other):
    write_records(tmp_path / "ground.tlog", ground)
    write_records(tmp_path / "other.tlog", other)
    return made_whole([tmp_path / "ground.tlog"], [tmp_path / "other.tlog"], BUSIEST)


def most_off_s(found, frames):
    dated = {raw: stamp_us for stamp_us, raw in frames}
    return max(abs(stamp_us - dated[raw]) * 1e-6 for stamp_us, raw in found.records)


@pytest.mark.parametrize("by_s", [-86_400.0, -60.0, -2.0, -0.5, 0.5, 2.0, 60.0, 3600.0, 86_400.0])
def test_a_clock_that_was_set_is_refused_with_the_reason(tmp_path, frames, by_s) -> None:
    ground, other = ([frames[0], *of_it(frames[1:], share=0.7, seed=seed)] for seed in (1, 2))
    at_us = frames[0][0] + round(STEP_AT_S * 1e6)
    with pytest.raises(
        LogError, match=rf"other.tlog: its clock was set by {'[+]' if by_s > 0 else ''}{by_s:.1f} s"
    ):
        put_together(tmp_path, ground, set_by([(s + 500_000, raw) for s, raw in other], by_s, at_us))


def test_a_clock_that_goes_on_evenly_has_no_step_however_silent_its_link_was(tmp_path, frames) -> None:
    other = of_it(frames, 0.0, 20.0) + of_it(frames, 40.0)
    found = put_together(tmp_path, of_it(frames, share=0.7, seed=1), other)
    assert found.missing
    assert most_off_s(found, frames) < 0.01


def bare_boots(tmp_path):
    """What a vehicle without a clock of its own sent in two boots: as heard, and as its ring keeps each boot."""
    dive = Dive(tmp_path / "ring")
    dive.dive(30.0)
    first, dive.heard = dive.heard, []
    dive.switch_on()
    dive.dive(30.0)
    bare = [
        [(1_000_000 + stamp_us - part[0][0], raw) for stamp_us, raw in part] for part in (first, dive.heard)
    ]
    return first, dive.heard, bare


@pytest.mark.parametrize("second_heard", [True, False])
def test_a_ring_of_a_vehicle_that_starts_anew_on_a_bare_clock_is_dated_boot_by_boot(
    tmp_path, second_heard
) -> None:
    first, second, bare = bare_boots(tmp_path)
    files = [tmp_path / Segment(boot, 7 + boot, 0, 0).name for boot in (1, 2)]
    for file, part in zip(files, bare, strict=True):
        write_records(file, part)
    heard = of_it(first + second, share=0.7, seed=1) if second_heard else of_it(first, share=0.7, seed=1)
    write_records(tmp_path / "ground.tlog", heard)
    found = made_whole([tmp_path / "ground.tlog"], files, BUSIEST)
    sent = first + second if second_heard else first
    assert [raw for _, raw in found.records] == [raw for _, raw in sent]
    assert max(abs(one[0] - true[0]) for one, true in zip(found.records, sent, strict=True)) < 10_000
    assert (found.guessed > 0, found.holes) == (not second_heard, ())


def test_another_recorder_whose_clock_began_anew_is_refused(tmp_path) -> None:
    first, second, bare = bare_boots(tmp_path)
    with pytest.raises(LogError, match=r"other.tlog: its clock was set by -"):
        put_together(tmp_path, of_it(first + second, share=0.7, seed=1), [*bare[0], *bare[1]])


@pytest.mark.parametrize(("begins_s", "ends_s"), [(40.0, 60.0), (20.0, 30.0)])
def test_a_recording_without_a_common_frame_is_refused_with_the_reason(
    tmp_path, frames, begins_s, ends_s
) -> None:
    (tmp_path / "dive").mkdir()
    write_records(tmp_path / "dive" / "telemetry.tlog", of_it(frames, 0.0, 18.0) + of_it(frames, 32.0, 38.0))
    write_records(tmp_path / "other.tlog", of_it(frames, begins_s, ends_s))
    with pytest.raises(LogError, match="has hardly a frame in common with the dive; check"):
        merge(DiveFolder(tmp_path / "dive"), tmp_path / "other.tlog")


@pytest.mark.parametrize("by_s", [-2.0, -60.0])
def test_a_dive_whose_own_clock_was_set_back_dates_nothing_and_says_so(tmp_path, frames, by_s) -> None:
    at_us = frames[0][0] + round(STEP_AT_S * 1e6)
    with pytest.raises(LogError, match=f"its own clock was set back by {-by_s:.1f} s while it was recorded"):
        put_together(tmp_path, set_by(of_it(frames), by_s, at_us), of_it(frames))


def test_a_dive_whose_own_clock_leaps_is_refused_where_frames_would_come_twice(tmp_path, frames) -> None:
    at_us = frames[0][0] + round(20.0 * 1e6)
    with pytest.raises(LogError, match=r"go by no common time: of .* are up to 40 s apart"):
        put_together(tmp_path, set_by(of_it(frames), 40.0, at_us), of_it(frames))
