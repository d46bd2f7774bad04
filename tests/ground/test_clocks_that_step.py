"""Recordings whose clocks were set, or began anew, while they ran: every frame once, and dated by the dive's clock."""

import random
from collections import Counter

import pytest
from diving_vehicle import Dive

from bridge.errors import LogError
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
def test_a_clock_that_was_set_costs_no_frame_and_dates_none_wrong(tmp_path, frames, by_s) -> None:
    ground, other = ([frames[0], *of_it(frames[1:], share=0.7, seed=seed)] for seed in (1, 2))
    at_us = frames[0][0] + round(STEP_AT_S * 1e6)
    found = put_together(tmp_path, ground, set_by([(s + 500_000, raw) for s, raw in other], by_s, at_us))
    assert Counter(raw for _, raw in found.records) == Counter({raw for _, raw in (*ground, *other)})
    assert found.beyond == 0
    assert most_off_s(found, frames) < 0.01
    (step,) = found.steps
    assert step.by_us * 1e-6 == pytest.approx(by_s, abs=0.01)
    assert step.at_us == pytest.approx(at_us - 500_000, abs=200_000)


def test_a_clock_that_goes_on_evenly_has_no_step_however_silent_its_link_was(tmp_path, frames) -> None:
    other = of_it(frames, 0.0, 20.0) + of_it(frames, 40.0)
    found = put_together(tmp_path, of_it(frames, share=0.7, seed=1), other)
    assert found.steps == ()
    assert most_off_s(found, frames) < 0.01


def test_a_vehicle_that_starts_anew_on_a_bare_clock_is_dated_piece_by_piece(tmp_path) -> None:
    dive = Dive(tmp_path / "ring")
    dive.dive(30.0)
    first, dive.heard = dive.heard, []
    dive.switch_on()
    dive.dive(30.0)
    # Its clock has no battery: each boot begins in the same second.
    bare = [
        (1_000_000 + stamp_us - part[0][0], raw) for part in (first, dive.heard) for stamp_us, raw in part
    ]
    both = first + dive.heard
    found = put_together(tmp_path, of_it(both, share=0.7, seed=1), bare)
    assert [raw for _, raw in found.records] == [raw for _, raw in both]
    assert max(abs(one[0] - true[0]) for one, true in zip(found.records, both, strict=True)) < 10_000
    assert found.holes == ()


def test_what_of_a_clock_that_was_set_nobody_else_heard_is_called_a_guess(tmp_path, frames) -> None:
    at_us = frames[0][0] + round(STEP_AT_S * 1e6)
    (tmp_path / "dive").mkdir()
    heard = of_it(frames, 0.0, 10.0) + of_it(frames, 58.0)
    write_records(tmp_path / "dive" / "telemetry.tlog", heard)
    other = tmp_path / "other.tlog"
    write_records(other, set_by(of_it(frames, 0.0, 45.0), -60.0, at_us))
    words = merge(DiveFolder(tmp_path / "dive"), other).words
    unheard = len([1 for stamp_us, _ in of_it(frames, STEP_AT_S, 45.0)])
    assert f"When {unheard} frames of it were sent is a guess" in words
    # What follows on 45 s nobody has.
    assert "13 s of it, from 0:44 on, nobody has" in words


@pytest.mark.parametrize("by_s", [-2.0, -60.0])
def test_a_dive_whose_own_clock_was_set_back_dates_nothing_and_says_so(tmp_path, frames, by_s) -> None:
    at_us = frames[0][0] + round(STEP_AT_S * 1e6)
    with pytest.raises(LogError, match=f"its own clock was set back by {-by_s:.1f} s while it was recorded"):
        put_together(tmp_path, set_by(of_it(frames), by_s, at_us), of_it(frames))


def test_a_dive_whose_own_clock_leaps_is_refused_where_frames_would_come_twice(tmp_path, frames) -> None:
    at_us = frames[0][0] + round(20.0 * 1e6)
    with pytest.raises(LogError, match=r"go by no common time: of .* are up to 40 s apart"):
        put_together(tmp_path, set_by(of_it(frames), 40.0, at_us), of_it(frames))
