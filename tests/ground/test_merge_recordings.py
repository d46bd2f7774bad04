"""Two recorders of one dive, each with a clock of its own: every frame once, in order, on the clock of the ground."""

import random
from collections import Counter
from operator import itemgetter

import numpy as np
import pytest
from diving_vehicle import Dive
from soak import rows_rest_in_soak

from bridge.errors import LogError
from bridge.framing import Encoder
from bridge.ring.whole import WHOLE
from bridge.tlog import read_tlog
from gcs_plugin.dives.folder import DiveFolder
from gcs_plugin.fetch.whole import made_whole, write_records
from gcs_plugin.peers import ground_heartbeat
from tui.merging import merge

pytestmark = pytest.mark.usefixtures("switched_off")

BUSIEST = (1, 191)


def all_frames(tmp_path, seconds=120.0, seed=0):
    """What the vehicle sent, dated by the ground's clock as if nothing was lost."""
    dive = Dive(tmp_path / f"ring{seed}", seed)
    dive.dive(7.35 * seed)
    dive.heard.clear()
    dive.dive(seconds)
    return dive.heard


def heard_by(frames, clock, rng, share=0.7, latest_s=0.03):
    """What a recorder heard of it: a share, each late by chance, dated by its own clock."""
    out = []
    for stamp_us, raw in frames:
        if rng.random() < share:
            late_s = min(latest_s, rng.expovariate(200.0))
            out.append((round(clock(stamp_us * 1e-6 + late_s) * 1e6), raw))
    return out


def raws(path):
    return [frame.raw for _, frame in read_tlog(path)]


@pytest.mark.parametrize(
    ("offset_s", "drift"), rows_rest_in_soak([(-86_400.0, 40e-6), (0.0, 0.0), (3.25, -150e-6)])
)
def test_a_planted_offset_and_drift_of_two_recorders_are_found_within_what_is_stated(
    tmp_path, offset_s, drift
) -> None:
    frames, rng = all_frames(tmp_path, 600.0), random.Random(1)
    begin_s = frames[0][0] * 1e-6

    def clock(unix_s):
        return unix_s + offset_s + drift * (unix_s - begin_s)

    write_records(tmp_path / "ground.tlog", heard_by(frames, lambda one: one, rng))
    write_records(tmp_path / "other.tlog", heard_by(frames, clock, rng))
    found = made_whole([tmp_path / "ground.tlog"], [tmp_path / "other.tlog"], BUSIEST)
    time_s = np.linspace(begin_s, begin_s + 600.0, 5)
    truth_s = np.array([clock(one) - one for one in time_s])
    within_s = found.clock.within_s(time_s[0], time_s[-1])
    assert np.abs(found.clock.ahead_s(time_s) - truth_s).max() <= within_s < 0.02
    often = Counter(raw for _, raw in frames)
    dated = {raw: stamp_us for stamp_us, raw in frames if often[raw] == 1}
    off_s = [abs(stamp_us - dated[raw]) * 1e-6 for stamp_us, raw in found.records if raw in dated]
    assert max(off_s) < 0.06


def test_every_frame_comes_once_and_in_order_and_originals_stay(tmp_path) -> None:
    frames, rng = all_frames(tmp_path), random.Random(2)
    ground, other = heard_by(frames, lambda one: one, rng), heard_by(frames, lambda one: one - 86_400.0, rng)
    (tmp_path / "dive").mkdir()
    own, theirs = tmp_path / "dive" / "telemetry.tlog", tmp_path / "laptop.tlog"
    write_records(own, ground)
    write_records(theirs, other)
    before = own.read_bytes(), theirs.read_bytes()
    done = merge(DiveFolder(tmp_path / "dive"), theirs)
    assert done.into == tmp_path / "dive" / WHOLE
    assert "its clock is 86400.00" in done.words or "its clock is 86399.99" in done.words
    assert (own.read_bytes(), theirs.read_bytes()) == before
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


def test_frames_that_were_recorded_twice_and_out_of_order_come_once(tmp_path) -> None:
    frames, rng = all_frames(tmp_path), random.Random(3)
    ground = heard_by(frames, lambda one: one, rng)
    twice = frames + [(stamp_us + rng.randrange(50_000), raw) for stamp_us, raw in frames]
    twice.sort(key=itemgetter(0))
    write_records(tmp_path / "ground.tlog", ground)
    write_records(tmp_path / "other.tlog", twice)
    found = made_whole([tmp_path / "ground.tlog"], [tmp_path / "other.tlog"], BUSIEST)
    merged = [raw for _, raw in found.records]
    sent = [raw for _, raw in frames]
    assert merged == sent[sent.index(merged[0]) : sent.index(merged[-1]) + 1]


def test_another_file_and_then_a_third_add_up(tmp_path) -> None:
    frames, rng = all_frames(tmp_path), random.Random(4)
    (tmp_path / "dive").mkdir()
    write_records(tmp_path / "dive" / "telemetry.tlog", heard_by(frames, lambda one: one, rng, 0.5))
    counts = []
    for name in ("a", "b"):
        file = tmp_path / f"{name}.tlog"
        write_records(file, heard_by(frames, lambda one: one + 7.0, rng, 0.5))
        counts.append(len(raws(merge(DiveFolder(tmp_path / "dive"), file).into)))
    assert 0.7 * len(frames) < counts[0] < 0.8 * len(frames) < counts[1]


def test_the_file_of_another_dive_or_vehicle_is_refused_and_changes_nothing(tmp_path) -> None:
    (tmp_path / "dive").mkdir()
    write_records(tmp_path / "dive" / "telemetry.tlog", all_frames(tmp_path, seed=0))
    write_records(tmp_path / "strange.tlog", all_frames(tmp_path, seed=1))
    beats = Encoder(255, 190)
    only_ground = [(1_790_000_000_000_000 + k, beats.encode(ground_heartbeat())) for k in range(300)]
    write_records(tmp_path / "ground.tlog", only_ground)
    for name, words in (
        (
            "strange.tlog",
            r"strange.tlog: has hardly a frame in common with the dive; check that it is of this dive",
        ),
        ("ground.tlog", r"ground.tlog: has hardly a frame in common"),
        ("dive/telemetry.tlog", "is this dive's own recording"),
    ):
        with pytest.raises(LogError, match=words):
            merge(DiveFolder(tmp_path / "dive"), tmp_path / name)
    assert [file.name for file in (tmp_path / "dive").iterdir()] == ["telemetry.tlog"]
