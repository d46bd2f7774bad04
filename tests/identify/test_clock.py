"""Clocks of foreign files."""

import numpy as np
import pytest
from built_recordings import of_table

from bridge.errors import LogError
from identify.ingest.files.clock import iso_s, of_day_s, within_seconds
from identify.ingest.open import date_of

MAP = "time: {column: t, unit: %s}\ndepth: {columns: [z], unit: m}\n"


def dive_of(tmp_path, text, unit):
    return of_table(tmp_path, text, MAP % unit)


@pytest.mark.parametrize(
    "word",
    [
        "1970-01-02T00:00:00.25Z",
        "1970-01-02 00:00:00.25",
        "1970-01-02T02:30:00.250+02:30",
        "1970-01-02T00:00:00,25",
    ],
)
def test_a_date_with_a_time_is_seconds_since_1970_in_utc(word):
    assert iso_s([word]).tolist() == [86_400.25]


def test_a_time_that_is_missing_is_unknown():
    assert np.isnan(iso_s([""])).all()


def test_times_of_day_in_words_are_seconds_that_run_on_past_midnight():
    assert iso_s(["23:59:59", "", "00:00:01.5", "0:00:02"]) == pytest.approx(
        [86_399.0, np.nan, 86_401.5, 86_402.0], nan_ok=True
    )


@pytest.mark.parametrize(
    ("start_s", "date"), [(1_700_000_000.0, (1_700_000_000.0, "its own times")), (0.0, (None, ""))]
)
def test_a_table_is_dated_by_times_since_1970(tmp_path, start_s, date):
    rows = "".join(f"{start_s + k / 4:.2f},1.{k}\n" for k in range(8))
    assert date_of(dive_of(tmp_path, f"t,z\n{rows}", "s")) == date


def test_a_table_with_dates_keeps_their_steps(tmp_path):
    rows = "".join(f"2026-07-19T10:15:{k / 4:05.2f}Z,1.{k}\n" for k in range(8))
    dive = dive_of(tmp_path, f"t,z\n{rows}", "iso")
    assert np.diff(dive.depth.time_s) == pytest.approx(np.full(7, 0.25), abs=1e-6)


@pytest.mark.parametrize(
    ("first", "unit", "said"),
    [
        ("19.07.2026 10:15", "iso", "'19.07.2026 10:15' in 't' is no time that ISO 8601 knows"),
        ("10:15:61", "iso", "'10:15:61' in 't' is no time that ISO 8601 knows"),
        ("01:23.45", "iso", "'01:23.45' in 't' is no time that ISO 8601 knows"),
        ("12.5", "iso", "its times in 't' are numbers, not dates"),
        ("202461", "hhmmss", "202461 in 't' is no time of day"),
        ("206059", "hhmmss", "206059 in 't' is no time of day"),
        ("2026-07-19T10:15:00Z", "s", "its times in 't' are words, as '2026-07-19T10:15:00Z'"),
    ],
)
def test_times_of_another_form_than_the_map_says_are_refused(tmp_path, first, unit, said):
    with pytest.raises(LogError, match=said):
        dive_of(tmp_path, f"t,z\n{first},1\n", unit)


def test_rows_of_a_clock_of_whole_seconds_are_spread_over_each():
    # The log begins within a second, ends within one, and drops a row in between.
    spread = within_seconds(np.repeat([10.0, 11.0, 12.0, 13.0, 14.0], [1, 4, 3, 4, 2]))
    assert spread is not None
    assert spread == pytest.approx(
        [10.75, 11, 11.25, 11.5, 11.75, 12, 12 + 1 / 3, 12 + 2 / 3, 13, 13.25, 13.5, 13.75, 14, 14.25]
    )


def test_a_loop_that_slows_down_and_pauses_keeps_its_rows():
    seconds = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 30.0, 31.0, 32.0, 33.0]
    spread = within_seconds(np.repeat(seconds, [20, 20, 20, 19, 16, 13, 10, 10, 4, 5, 10, 10, 10]))
    assert spread is not None
    assert (np.diff(spread) > 0).all()
    # Before the pause the last part of a second lies at its beginning, and after it at its end.
    assert spread[(spread >= 9.0) & (spread < 31.0)] == pytest.approx(
        [*np.arange(9.0, 9.35, 0.1), *np.arange(30.5, 30.95, 0.1)]
    )


def test_a_row_without_a_time_stays_without_one_and_moves_no_other():
    spread = within_seconds(np.array([1.0, 1.0, 2.0, 2.0, np.nan, 3.0, 3.0]))
    np.testing.assert_array_equal(spread, [1.0, 1.5, 2.0, 2.5, np.nan, 3.0, 3.5])


@pytest.mark.parametrize(
    "time_s",
    [
        np.arange(0.0, 5.0, 0.25),
        np.arange(20.0),
        np.repeat([1.0, 2.0, 3.0, 4.0, 5.0, 6.0], [4, 20, 4, 40, 3, 4]),
        np.repeat([3.0, 2.0, 1.0], 4),
        np.repeat([1.0, 2.0], 4),
        np.zeros(0),
    ],
)
def test_another_clock_is_left_as_it_is(time_s):
    assert within_seconds(time_s) is None


def test_a_table_with_whole_seconds_loses_no_row_and_says_how_it_was_read(tmp_path):
    rows = "".join(f"{k // 5},{k}.5\n" for k in range(40))
    dive = dive_of(tmp_path, f"t,z\n{rows}", "s")
    assert dive.depth.time_s == pytest.approx(np.arange(40) / 5)
    assert any("whole seconds" in note for note in dive.notes)


def test_rows_that_hold_a_part_of_a_sample_each_stay_one_sample(tmp_path):
    columns = MAP % "s" + "altitude: {columns: [h], unit: m}\nvoltage: {columns: [v], unit: V}\n"
    rows = "".join(f"{k},{k}.5,,\n{k},,{9 - k}.5,\n{k},,,12\n" for k in range(6))
    dive = of_table(tmp_path, f"t,z,h,v\n{rows}", columns)
    assert dive.depth.time_s.tolist() == dive.altitude.time_s.tolist() == [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]


def test_rows_that_overtake_each_other_at_midnight_stay_in_one_night():
    words = ["23:59:59.9", "00:00:00", "23:59:59.95", "00:00:00.05", "00:00:00.1"]
    assert iso_s(words) - 86_400.0 == pytest.approx([-0.1, 0.0, -0.05, 0.05, 0.1], abs=1e-9)


def test_a_pause_of_more_than_half_a_day_is_no_midnight_before_the_first():
    assert iso_s(["06:00:00", "19:00:00", "01:00:00"]).tolist() == [21_600.0, 68_400.0, 90_000.0]


def test_a_time_of_day_as_a_number_runs_on_over_minutes_and_midnight():
    stamps = np.array([202459.0, 202500.5, np.nan, 235959.0, 0.0, 101.0])
    expected = [73_499.0, 73_500.5, np.nan, 86_399.0, 86_400.0, 86_461.0]
    np.testing.assert_array_equal(of_day_s(stamps), expected)


def test_a_time_of_day_of_whole_seconds_is_spread_over_them(tmp_path):
    rows = "".join(f"{stamp},{k}.5\n" for stamp in (202458, 202459, 202500, 202501) for k in range(4))
    dive = dive_of(tmp_path, f"t,z\n{rows}", "hhmmss")
    assert np.diff(dive.depth.time_s) == pytest.approx(np.full(15, 0.25))


def test_a_stamp_that_is_no_time_of_day_costs_its_row_alone(tmp_path):
    stamps = [202400 + k for k in range(60)] + [202500 + k for k in range(60)]
    stamps[70] = 126061
    dive = dive_of(tmp_path, "t,z\n" + "".join(f"{t},{k}.5\n" for k, t in enumerate(stamps)), "hhmmss")
    assert dive.depth.value[:, 0].tolist() == [k + 0.5 for k in range(120) if k != 70]
    assert "Times that are no time of day, first 126061: 1 row was left out." in dive.notes
    assert not any("of its own" in note for note in dive.notes)


@pytest.mark.parametrize("at", [0, 70])
@pytest.mark.parametrize("day", ["2026-07-19T", ""], ids=["dates", "times of day"])
def test_a_date_that_can_not_be_read_costs_its_row_alone(tmp_path, at, day):
    words = [f"{day}{10 + k // 60}:{k % 60:02d}:00.5" for k in range(120)]
    words[at] = "20#6-07-19T10:1"
    dive = dive_of(tmp_path, "t,z\n" + "".join(f"{t},{k}.5\n" for k, t in enumerate(words)), "iso")
    assert dive.depth.value[:, 0].tolist() == [k + 0.5 for k in range(120) if k != at]
    said = "Times that ISO 8601 does not know, first '20#6-07-19T10:1': 1 row was left out."
    assert said in dive.notes
    assert not any("of its own" in note for note in dive.notes)


def test_a_clock_of_which_many_stamps_are_no_time_of_day_is_another():
    stamps = np.array([202400.0 + k for k in range(60)])
    assert np.count_nonzero(np.isnan(of_day_s(np.where(np.arange(60) < 3, 126061, stamps)))) == 3
    with pytest.raises(ValueError, match="126061"):
        of_day_s(np.where(np.arange(60) < 4, 126061, stamps))
