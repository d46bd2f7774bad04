"""Two recordings of a dive on one clock, and clocks that step: refused with the reason."""

import random
from collections import Counter
from operator import itemgetter

import numpy as np
import pytest
from diving_vehicle import Dive
from fakes.recordings import raws
from merged_dives import SOURCE, all_frames, dive_of, each_once, heard_by, of_it, put_together
from soak import rest_in_soak, rows_rest_in_soak

from bridge.errors import LogError
from bridge.wire.framing import Encoder
from bridge.wire.segments import Segment
from bridge.wire.tlog import read_tlog
from bridge.wire.whole_recording import WHOLE
from gcs_plugin.fetch.merging import merge_recordings, write_records
from gcs_plugin.peers import ground_heartbeat
from tui.commands.merge import merge

pytestmark = pytest.mark.usefixtures("switched_off")


@pytest.mark.parametrize(
    ("offset_s", "drift"), rows_rest_in_soak([(-86_400.0, 40e-6), (0.0, 0.0), (3.25, -150e-6)])
)
def test_a_planted_offset_and_drift_of_two_recorders_are_found_within_what_is_stated(
    tmp_path, offset_s, drift
):
    frames, rng = all_frames(150.0), random.Random(1)
    begin_s = frames[0][0] * 1e-6

    def clock(unix_s):
        return unix_s + offset_s + drift * (unix_s - begin_s)

    ground = heard_by(frames, lambda unix_s: unix_s, rng)
    result = put_together(tmp_path, ground, heard_by(frames, clock, rng))
    time_s = np.linspace(begin_s, begin_s + 150.0, 5)
    truth_s = np.array([clock(time_) - time_ for time_ in time_s])
    within_s = result.clock.within_s(time_s[0], time_s[-1])
    assert np.abs(result.clock.ahead_s(time_s) - truth_s).max() <= within_s < 0.02
    often = Counter(raw for _, raw in frames)
    dated = {raw: stamp_us for stamp_us, raw in frames if often[raw] == 1}
    off_s = [abs(stamp_us - dated[raw]) * 1e-6 for stamp_us, raw in result.records if raw in dated]
    assert max(off_s) < 0.06


def test_every_frame_comes_once_and_in_order_and_originals_stay(tmp_path):
    frames, rng = all_frames(), random.Random(2)
    ground, other = (
        heard_by(frames, lambda unix_s: unix_s, rng),
        heard_by(frames, lambda unix_s: unix_s - 86_400.0, rng),
    )
    folder, theirs = dive_of(tmp_path, ground), tmp_path / "laptop.tlog"
    telemetry = folder.path / "telemetry.tlog"
    write_records(theirs, other)
    before = telemetry.read_bytes(), theirs.read_bytes()
    done = merge(folder, theirs)
    assert done.into == folder.path / WHOLE
    assert "its clock is 86400.00" in done.words or "its clock is 86399.99" in done.words
    assert (telemetry.read_bytes(), theirs.read_bytes()) == before
    sent = [raw for _, raw in frames]
    of_ground, of_other = {raw for _, raw in ground}, {raw for _, raw in other}
    once = {raw for raw, times in Counter(sent).items() if times == 1}
    heard = [k for k, raw in enumerate(sent) if raw in once & of_ground]
    whole = raws(done.into)
    assert [raw for raw in whole if raw in once & of_other] == [
        raw for k, raw in enumerate(sent) if raw in once & of_other and heard[0] <= k <= heard[-1]
    ]
    assert of_ground <= set(whole)
    assert max(Counter(raw for raw in whole if raw in once).values()) == 1
    stamps = [stamp_us for stamp_us, _ in read_tlog(done.into)]
    assert stamps == sorted(stamps)


def test_frames_that_were_recorded_twice_and_out_of_order_come_once(tmp_path):
    frames, rng = all_frames(), random.Random(3)
    ground = heard_by(frames, lambda unix_s: unix_s, rng)
    twice = [*frames, *((stamp_us + rng.randrange(50_000), raw) for stamp_us, raw in frames)]
    twice.sort(key=itemgetter(0))
    result = put_together(tmp_path, ground, twice)
    merged = [raw for _, raw in result.records]
    sent = [raw for _, raw in frames]
    assert merged == sent[sent.index(merged[0]) : sent.index(merged[-1]) + 1]


def test_the_file_of_another_dive_or_vehicle_is_refused_and_changes_nothing(tmp_path):
    folder = dive_of(tmp_path, all_frames(seed=0))
    write_records(tmp_path / "strange.tlog", all_frames(seed=1))
    beats = Encoder(255, 190)
    only_ground = [(1_790_000_000_000_000 + k, beats.encode(ground_heartbeat())) for k in range(300)]
    write_records(tmp_path / "ground.tlog", only_ground)
    hardly = r"has hardly a frame in common with the dive; check that it is of this dive"
    for path, words in (
        (tmp_path / "strange.tlog", f"strange.tlog: {hardly}"),
        (tmp_path / "ground.tlog", f"ground.tlog: {hardly}"),
        (folder.path / "telemetry.tlog", "is this dive's own recording"),
    ):
        with pytest.raises(LogError, match=words):
            merge(folder, path)
    assert [file.name for file in folder.path.iterdir()] == ["telemetry.tlog"]


STEP_AT_S = 30.0


@pytest.fixture(scope="module")
def frames():
    """The vehicle's frames of a minute, all different, dated by the ground's clock."""
    return each_once(all_frames(60.0))


def set_by(records, by_s, at_us):
    return [(stamp_us + round(by_s * 1e6) * (stamp_us >= at_us), raw) for stamp_us, raw in records]


def most_off_s(merged, frames):
    dated = {raw: stamp_us for stamp_us, raw in frames}
    return max(abs(stamp_us - dated[raw]) * 1e-6 for stamp_us, raw in merged.records)


@pytest.mark.parametrize(
    "by_s", rest_in_soak([-86_400.0, -0.5, 0.5, 3600.0, -60.0, -2.0, 2.0, 60.0, 86_400.0], keep=4)
)
def test_a_clock_that_was_set_is_refused_with_the_reason(tmp_path, frames, by_s):
    ground, other = ([frames[0], *of_it(frames[1:], share=0.7, seed=seed)] for seed in (1, 2))
    at_us = frames[0][0] + round(STEP_AT_S * 1e6)
    with pytest.raises(
        LogError, match=rf"other.tlog: its clock was set by {'[+]' if by_s > 0 else ''}{by_s:.1f} s"
    ):
        put_together(tmp_path, ground, set_by([(s + 500_000, raw) for s, raw in other], by_s, at_us))


def test_a_clock_that_goes_on_evenly_has_no_step_however_silent_its_link_was(tmp_path, frames):
    other = of_it(frames, 0.0, 20.0) + of_it(frames, 40.0)
    result = put_together(tmp_path, of_it(frames, share=0.7, seed=1), other)
    assert result.missing
    assert most_off_s(result, frames) < 0.01


def held_up(records, stalls_at_s, stall_s):
    """As a link delivers them that stalls at these times, and then gives all that waited at once."""
    for at_s in stalls_at_s:
        begins_us = records[0][0] + round(at_s * 1e6)
        ends_us = begins_us + round(stall_s * 1e6)
        records = [
            (ends_us if begins_us <= stamp_us < ends_us else stamp_us, raw) for stamp_us, raw in records
        ]
    return records


@pytest.mark.parametrize(
    ("stalls_at_s", "stall_s"), [([20.0], 0.6), ([20.0], 5.0), ([10.0, 18.0, 26.0, 34.0, 42.0, 50.0], 2.0)]
)
def test_a_link_that_stalls_and_then_delivers_all_that_waited_is_no_clock_that_was_set(
    tmp_path, frames, stalls_at_s, stall_s
):
    other = held_up(of_it(frames), stalls_at_s, stall_s)
    result = put_together(tmp_path, of_it(frames, share=0.7, seed=1), other)
    assert [raw for _, raw in result.records] == [raw for _, raw in frames]
    assert most_off_s(result, frames) < 0.1


def bare_boots(tmp_path):
    """Two boots of a vehicle without a date: as heard, and as its ring keeps each boot."""
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
def test_a_ring_of_a_vehicle_that_starts_anew_on_a_bare_clock_is_dated_boot_by_boot(tmp_path, second_heard):
    first, second, bare = bare_boots(tmp_path)
    files = [tmp_path / Segment(boot, 7 + boot, 0, 0).name for boot in (1, 2)]
    for file, part in zip(files, bare, strict=True):
        write_records(file, part)
    heard = of_it(first + second, share=0.7, seed=1) if second_heard else of_it(first, share=0.7, seed=1)
    write_records(tmp_path / "ground.tlog", heard)
    result = merge_recordings([tmp_path / "ground.tlog"], files, SOURCE)
    sent = first + second if second_heard else first
    assert [raw for _, raw in result.records] == [raw for _, raw in sent]
    assert max(abs(record[0] - true[0]) for record, true in zip(result.records, sent, strict=True)) < 10_000
    assert (result.guessed > 0, result.holes) == (not second_heard, ())


def test_a_pause_in_the_unheard_end_of_a_boot_is_no_clock_that_was_set(tmp_path):
    """The next boot's clock stands elsewhere, as that of a computer without a battery does."""
    first, second, bare = bare_boots(tmp_path)
    paused = [of_it(bare[0], 0.0, 20.0), of_it(bare[0], 20.5)]
    files = [tmp_path / Segment(boot, 7 + boot, 0, 0).name for boot in (1, 2)]
    for file, part in zip(files, ([*paused[0], *paused[1]], bare[1]), strict=True):
        write_records(file, part)
    write_records(tmp_path / "ground.tlog", of_it(first, 0.0, 10.0) + of_it(second))
    result = merge_recordings([tmp_path / "ground.tlog"], files, SOURCE)
    sent = [raw for part in (*paused, second) for _, raw in part]
    assert [raw for _, raw in result.records] == sent


@pytest.mark.parametrize(("begins_s", "ends_s"), [(40.0, 60.0), (20.0, 30.0)])
def test_a_recording_without_a_common_frame_is_refused_with_the_reason(tmp_path, frames, begins_s, ends_s):
    folder = dive_of(tmp_path, of_it(frames, 0.0, 18.0) + of_it(frames, 32.0, 38.0))
    write_records(tmp_path / "other.tlog", of_it(frames, begins_s, ends_s))
    with pytest.raises(LogError, match="has hardly a frame in common with the dive; check"):
        merge(folder, tmp_path / "other.tlog")


@pytest.mark.parametrize("by_s", [-2.0, -60.0])
def test_a_dive_whose_own_clock_was_set_back_dates_nothing_and_says_so(tmp_path, frames, by_s):
    at_us = frames[0][0] + round(STEP_AT_S * 1e6)
    with pytest.raises(LogError, match=f"its own clock was set back by {-by_s:.1f} s while it was recorded"):
        put_together(tmp_path, set_by(of_it(frames), by_s, at_us), of_it(frames))


def test_a_dive_whose_own_clock_leaps_is_refused_where_frames_would_come_twice(tmp_path, frames):
    at_us = frames[0][0] + round(20.0 * 1e6)
    with pytest.raises(LogError, match=r"go by no common time: of .* are up to 40 s apart"):
        put_together(tmp_path, set_by(of_it(frames), 40.0, at_us), of_it(frames))
