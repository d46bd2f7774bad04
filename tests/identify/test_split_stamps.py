"""A stamp in two columns, seconds and nanoseconds, is one time; by the seconds alone rows of a second fell together."""

from pathlib import Path

import numpy as np
import pytest

from identify.ingest.files.json_lines import read_json_lines
from identify.ingest.files.split_stamps import with_whole_stamps
from identify.ingest.files.streams import Stream, Streams
from identify.ingest.mapping.proposal_of_runs import propose
from identify.ingest.open import read_dive, read_streams

STEPS_S = np.random.default_rng(3).uniform(0.03, 0.3, 200)
TIME_S = 1_700_000_000.95 + np.cumsum(STEPS_S)
SECONDS = np.floor(TIME_S)
NANOSECONDS = np.rint(1e9 * (TIME_S - SECONDS))


def stream_of(**columns):
    return Streams((Stream("", dict(columns), {}),))


def table(path, seconds, nanoseconds):
    rows = [f"{seconds},{nanoseconds},surge,yaw_rate,thr_left,thr_right"]
    for whole, beyond, swing in zip(SECONDS, NANOSECONDS, np.sin(TIME_S), strict=True):
        rows.append(f"{whole:.0f},{beyond:.0f},{swing:.4f},{swing:.4f},{1500 + 100 * swing:.0f},1500")
    path.write_text("\n".join(rows) + "\n")
    return path


@pytest.mark.parametrize(
    ("seconds", "nanoseconds", "whole"),
    [
        ("header.stamp.sec", "header.stamp.nanosec", "header.stamp"),
        ("header_stamp_secs", "header_stamp_nsecs", "header_stamp"),
        ("stamp_sec", "stamp_nanosec", "stamp"),
        ("sec", "nanosec", "stamp"),
        ("timestampSec", "timestampNsec", "timestamp"),
    ],
)
def test_rows_come_when_seconds_and_nanoseconds_together_say(tmp_path, seconds, nanoseconds, whole):
    log = table(tmp_path / "log.csv", seconds, nanoseconds)
    columns = propose(read_streams(log).streams, log).columns
    assert (columns.time.column, columns.time.unit) == (whole, "s")
    map_file = tmp_path / "columns.yaml"
    map_file.write_text(
        f"time: {{column: {whole}, unit: s}}\nvelocity: {{columns: [surge, null, null], unit: m/s}}\n"
        "gyro: {columns: [null, null, yaw_rate], unit: rad/s}\npwm: {columns: [thr_left, thr_right], unit: us}\n"
    )
    time_s = read_dive(log, columns=map_file).velocity.time_s
    assert time_s - time_s[0] == pytest.approx(TIME_S - TIME_S[0], abs=1e-6)


def test_a_map_of_the_seconds_alone_finds_its_column_as_before():
    (stream,) = with_whole_stamps(stream_of(stamp_sec=SECONDS, stamp_nanosec=NANOSECONDS, u=STEPS_S)).streams
    assert list(stream.columns) == ["stamp_sec", "stamp_nanosec", "u", "stamp"]


def test_nanoseconds_since_the_beginning_are_no_part_of_a_stamp():
    held = stream_of(stamp_sec=SECONDS, stamp_nsec=1e9 * (TIME_S - TIME_S[0]))
    assert with_whole_stamps(held).streams == held.streams


def test_seconds_of_one_clock_and_nanoseconds_of_another_stay_apart():
    held = stream_of(stamp_sec=SECONDS, time_ref_nsec=NANOSECONDS)
    assert with_whole_stamps(held).streams == held.streams


def test_a_column_that_has_the_stamps_name_is_kept():
    held = stream_of(stamp=TIME_S, stamp_sec=SECONDS, stamp_nsec=NANOSECONDS)
    assert with_whole_stamps(held).streams == held.streams


def test_a_row_without_a_stamp_has_none_in_the_whole_either():
    blank = np.arange(len(SECONDS)) == 7
    held = Streams((Stream("", {"sec": SECONDS, "nsec": NANOSECONDS}, {}),), empty={"sec": blank})
    assert with_whole_stamps(held).empty["stamp"] is blank


def test_a_message_of_json_has_its_stamp_whole(tmp_path: Path):
    log = tmp_path / "log.jsonl"
    lines = [
        f'{{"header": {{"stamp": {{"sec": {whole:.0f}, "nanosec": {beyond:.0f}}}}}, "u": {step:.3f}}}'
        for whole, beyond, step in zip(SECONDS, NANOSECONDS, STEPS_S, strict=True)
    ]
    log.write_text("\n".join(lines) + "\n")
    (stream,) = with_whole_stamps(read_json_lines(log)).streams
    assert stream.columns["header.stamp"] == pytest.approx(TIME_S, abs=1e-6)
