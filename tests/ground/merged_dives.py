"""Dives of a vehicle with a ring, as the ground and other recorders heard them, to be fetched or merged."""

import random
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

from diving_vehicle import Dive

from gcs_plugin.dives.folder import DiveFolder
from gcs_plugin.fetch.merging import merge_recordings, write_records
from tui.commands.fetch import Fetcher

SOURCE = (1, 191)


def dive_of(tmp_path, records):
    """The folder of a dive of which the ground heard these frames."""
    folder = DiveFolder(tmp_path / "dives" / "2026-11-20T0912Z-lake")
    folder.path.mkdir(parents=True)
    write_records(folder.path / "telemetry.tlog", records)
    return folder


def fetcher_of(dive):
    return Fetcher(dive, dive.world, 60.0, lambda *_: None)


@cache
def all_frames(seconds=120.0, seed=0):
    """All frames that the vehicle sent, dated by the ground's clock."""
    with TemporaryDirectory() as ring:
        dive = Dive(Path(ring), seed)
        dive.dive(7.35 * seed)
        dive.heard.clear()
        dive.dive(seconds)
        dive.ring.close()
    return tuple(dive.heard)


def each_once(frames):
    """Those frames that are other than all before them."""
    first = {raw: stamp_us for stamp_us, raw in reversed(frames)}
    return [(stamp_us, raw) for stamp_us, raw in frames if first.pop(raw, None) is not None]


def heard_by(frames, clock, rng, share=0.7, latest_s=0.03):
    """The frames that a recorder heard: a share, each late by chance, dated by its own clock."""
    out = []
    for stamp_us, raw in frames:
        if rng.random() < share:
            late_s = min(latest_s, rng.expovariate(200.0))
            out.append((round(clock(stamp_us * 1e-6 + late_s) * 1e6), raw))
    return out


def of_it(frames, begins_s=0.0, ends_s=1e9, share=1.0, seed=0):
    """The frames between two times, with a jitter of 3 ms."""
    rng, first_us, newest_us, out = random.Random(seed), frames[0][0], 0, []
    for stamp_us, raw in frames:
        if begins_s <= (stamp_us - first_us) * 1e-6 < ends_s and rng.random() < share:
            newest_us = max(newest_us, stamp_us + rng.randrange(3000))
            out.append((newest_us, raw))
    return out


def put_together(tmp_path, ground, other):
    """Two recordings of a dive, merged."""
    write_records(tmp_path / "ground.tlog", ground)
    write_records(tmp_path / "other.tlog", other)
    return merge_recordings([tmp_path / "ground.tlog"], [tmp_path / "other.tlog"], SOURCE)
