"""Sensors, thrusters and words: aligned, dated, and none bright that is old."""

import math
from dataclasses import replace

import pytest
from made_view import SAID, SENSORS, picture

from gcs_plugin.watch.picture import Condition, Freshness, Said
from tui.app.screens.panes import sensors, signed_bar, thrusters, thrusters_heading, words, worst

FRESH, STALE, GONE = Freshness


def joined(line):
    return "".join(text for text, _ in line)


def table(*rows, cells=34, links=()):
    return sensors(links, rows, cells)


@pytest.mark.parametrize("cells", [32, 34, 60])
def test_no_row_is_wider_than_the_pane(cells):
    for line in sensors(picture().links, SENSORS, cells):
        assert len(joined(line)) <= cells


def test_a_good_sensor_shows_rate_and_age():
    assert joined(table(SENSORS[2])[0]).split() == ["●", "IMU", "50.0", "Hz", "0.0", "s"]
    assert joined(table(SENSORS[2], cells=60)[0]).split() == [
        "●",
        "ok",
        "IMU",
        "50.0",
        "/",
        "25",
        "Hz",
        "0.0",
        "s",
    ]


def test_rates_stand_under_each_other():
    lines = [joined(line) for line in table(SENSORS[2], SENSORS[4], SENSORS[1], cells=60)]
    assert len({line.index(" Hz") for line in lines}) == 1


def test_what_is_wrong_is_said_and_takes_a_line_of_its_own_where_it_is_long():
    lines = table(SENSORS[0], SENSORS[5])
    assert joined(lines[0]).split() == ["▲", "DVL", "no", "bottom", "lock", "for", "3.2", "s"]
    long = replace(SENSORS[0], words="no bottom lock for 3.2 s, no altitude")
    first, second = table(long)
    assert joined(first).split() == ["▲", "DVL"]
    assert joined(second).startswith("    no bottom lock for 3.2 s")
    assert second[1][1] == "bad"


def test_a_stale_sensor_is_dimmed_and_dated():
    (line,) = table(SENSORS[7])
    assert joined(line).split() == ["◐", "battery", "4.2", "s", "ago"]
    assert {role for _, role in line} == {"warn", "stale"}


def test_a_sensor_that_is_gone_has_no_number():
    (line,) = table(SENSORS[8])
    assert joined(line).split() == ["○", "GNSS", "--", "never", "heard"]
    gone = replace(SENSORS[2], freshness=GONE, age_s=40.0, condition=Condition.MISSING)
    assert "-- 40 s ago" in joined(table(gone)[0])
    silent = replace(gone, name="fibre-optic gyro", words="silent for 40 s, and more")
    assert [joined(line).split("--")[1] for line in table(silent)] == [" 40 s ago"]
    assert "-- silent for 40 s, and more" in joined(table(silent, cells=60)[0])


def test_a_lost_link_is_said_in_its_row():
    link = replace(picture().links[0], lost=True, age_s=12.0)
    assert "lost, heard 12 s ago" in " ".join(joined(line) for line in table(links=(link,)))


@pytest.mark.parametrize(
    ("pwm_us", "bar"),
    [
        (1500, "    │    "),
        (1900, "    │████"),
        (1100, "████│    "),
        (1550, "    │▌   "),
        (1450, "   ▐│    "),
        (1350, "  ▐█│    "),
        (2300, "    │████"),
        (math.nan, "    │    "),
    ],
)
def test_a_bar_goes_to_the_side_of_its_push(pwm_us, bar):
    assert signed_bar(pwm_us, 4) == bar


@pytest.mark.parametrize("cells", [30, 33, 34, 56, 60])
def test_thrusters_fit_and_none_is_missing(cells):
    lines = thrusters(picture().thrusters, cells)
    text = "\n".join(joined(line) for line in lines)
    assert all(len(joined(line)) <= cells for line in lines)
    assert all(f" {n} " in f" {text} " for n in range(1, 9))
    assert len(lines) == (8 if cells >= 50 else 4)


@pytest.mark.parametrize("cells", [32, 60])
def test_the_unit_of_the_pulses_is_told_once_where_there_is_little_room_and_by_each_where_there_is_more(
    cells,
):
    head = joined(thrusters_heading("hovering", cells))
    rows = [joined(line) for line in thrusters(picture().thrusters, cells)]
    assert head.endswith(" hovering")
    assert len(head) == cells
    assert ("µs" in head, all("µs" in row or "ago" in row or "--" in row for row in rows)) == (
        (True, False) if cells == 32 else (False, True)
    )


def test_an_old_thruster_is_dimmed_and_one_that_is_gone_has_no_number():
    lines = thrusters(picture().thrusters, 60)
    assert "--" in joined(lines[3])
    assert "14 s ago" in joined(lines[3])
    assert {role for text, role in lines[4] if text.strip() and text != "│"} == {"quiet", "faded", "stale"}


def test_names_of_thrusters_are_shown_where_there_are_some():
    named = tuple(replace(row, name=f"bow {row.number}") for row in picture().thrusters)
    assert "bow 3" in joined(thrusters(named, 60)[2])


def test_words_come_newest_first_with_their_severity_in_a_word():
    lines = words(SAID, 80)
    assert joined(lines[0]) == "08:52:19 ERROR     thruster 4: speed controller silent"
    assert [line[2][1] for line in lines] == ["bad", "warn", "plain", "plain"]
    assert joined(words((Said(math.nan, 2, "x"),), 80)[0]).startswith("--:--:-- CRITICAL")


def test_how_bad_it_is_is_counted():
    assert worst(SAID) == "1 error, 1 warning"
    assert worst((*SAID, *SAID)) == "2 errors, 2 warnings"
    assert worst(SAID[:2]) == ""
