"""The screen Watch: only what changed is drawn again, its panes, and a replay on it."""

import math
from dataclasses import replace
from pathlib import Path

import pytest
from fake_verbs import FakeVerbs, desk
from made_dives import HOVERING, record
from made_view import SAID, SENSORS, UNIX_S, FixedViews, StillReplay, picture, replayed, view
from screen_text import (
    NARROW,
    WIDE,
    Lacks,
    Sees,
    looks,
    made,
    plain,
    play,
    played,
    resized,
    run,
    shows,
    strips,
    text,
    worked,
)
from soak import rest_in_soak

from gcs_plugin.monitor.gap import AxisGap, Gap
from gcs_plugin.watch.picture import Alarm, Armed, Condition, Freshness, Kind, Said, SensorRow
from tui.app.drawing import width
from tui.app.screens.watch import WatchScreen
from tui.app.screens.watch_lines import (
    gap_lines,
    replay_line,
    sensors,
    signed_bar,
    thrusters,
    thrusters_heading,
    words,
    worst,
)
from tui.app.view import Replay


@pytest.mark.parametrize("size", rest_in_soak((NARROW, WIDE)))
def test_what_is_drawn_again_in_part_is_what_would_be_drawn_anew(size):
    before = view()
    lost = replace(before.picture.sensors[1], age_s=40.0, freshness=Freshness.GONE)
    after = replace(
        before,
        unix_s=before.unix_s + 1,
        trouble="refused",
        picture=replace(
            before.picture,
            now_s=before.picture.now_s + 3.0,
            sensors=(lost, *before.picture.sensors[1:]),
            said=before.picture.said[:2],
            armed=Armed.FAILSAFE,
        ),
    )

    async def anew(app, _):
        return looks(app)

    async def in_part(app, pilot):
        views.shown = after
        app._show()
        await pilot.pause()
        await pilot.pause()
        return looks(app)

    views = FixedViews(before)
    assert run(made(views), size, in_part) == run(made(FixedViews(after)), size, anew)


def test_what_a_vehicle_says_can_neither_steer_the_terminal_nor_push_a_row_out_of_line():
    said = Said(UNIX_S, 4, "\x1b[2J wiped \U0001f480 \u6c34 \u0301 end")
    shown = replace(view(), picture=replace(view().picture, said=(said,)))

    def is_in_line(app):
        return all(strip.cell_length == 80 for strip in strips(app))

    played(desk(), Sees("?[2J wiped ? ? ? end"), is_in_line, views=FixedViews(shown))


def test_every_cell_that_changed_is_drawn_again_and_few_others():
    before = view()
    sensors = tuple(replace(row, age_s=row.age_s + 0.3) for row in before.picture.sensors)
    views = FixedViews(before)

    def cells(widget):
        return [[(c, role) for text, role in line for c in text] for line in widget._lines]

    async def work(app, pilot):
        widget = app.screen.query_one("#sensors")
        old, drawn = cells(widget), set()

        def note(*regions, **_):
            drawn.update((x, y) for region in regions for y in region.line_range for x in region.column_range)

        widget.refresh = note
        views.shown = replace(before, picture=replace(before.picture, sensors=sensors))
        app._show()
        await pilot.pause()
        new = cells(widget)
        changed = {
            (x, y) for y, row in enumerate(new) for x, cell in enumerate(row) if old[y][x : x + 1] != [cell]
        }
        assert changed
        assert changed <= drawn
        assert len(drawn) < 3 * len(changed)

    run(made(views), (80, 24), work)


FRESH, STALE, GONE = Freshness
IMU = replace(SENSORS[2], freshness=GONE, age_s=40.0, condition=Condition.MISSING)
GYRO = replace(IMU, name="fibre-optic gyro", words="silent for 40 s, and more")
LOST = replace(picture().links[0], lost=True, age_s=12.0)


@pytest.mark.parametrize(
    ("row", "cells", "words", "roles"),
    [
        (SENSORS[2], 34, ["● IMU 50.0 Hz 0.0 s"], {"quiet", "plain"}),
        (SENSORS[2], 60, ["● ok IMU 50.0 / 25 Hz 0.0 s"], {"quiet", "plain"}),
        (SENSORS[0], 34, ["▲ DVL no bottom lock for 3.2 s"], {"bad", "plain"}),
        (replace(SENSORS[0], words="no bottom lock for 3.2 s, nothing"), 34,
         ["▲ DVL", "no bottom lock for 3.2 s, not…"], {"bad", "plain"}),
        (SENSORS[7], 34, ["◐ battery 4.2 s ago"], {"warn", "stale"}),
        (SENSORS[8], 34, ["○ GNSS -- never heard"], {"bad", "stale"}),
        (IMU, 34, ["○ IMU -- 40 s ago"], {"bad", "stale"}),
        (GYRO, 34, ["○ fibre-optic gyro -- 40 s ago"], {"bad", "stale"}),
        (GYRO, 60, ["○ missing fibre-optic gyro -- silent for 40 s, and more"], {"bad", "stale"}),
    ],
    ids=lambda value: value.name if isinstance(value, SensorRow) else None,
)  # fmt: skip
def test_a_sensor_has_rate_and_age_or_what_is_wrong_in_a_line_of_its_own_where_that_is_long(
    row, cells, words, roles
):
    lines = sensors((), (row,), cells)
    assert [" ".join(line.split()) for line in plain(lines)] == words
    assert {role for line in lines for _, role in line} == roles
    assert all(width(line) <= cells for line in lines)


def test_rates_stand_under_each_other_and_a_lost_link_is_said_in_its_row():
    rows = sensors((LOST,), (SENSORS[2], SENSORS[4], SENSORS[1]), 60)
    link, *others = plain(rows)
    assert "lost, heard 12 s ago" in link
    assert len({line.index(" Hz") for line in others}) == 1


@pytest.mark.parametrize(
    ("pwm_us", "bar"),
    [
        (1500, "    │    "),
        (1900, "    │████"),
        (1100, "████│    "),
        (1550, "    │▌   "),
        (1350, "  ▐█│    "),
        (2300, "    │████"),
        (math.nan, "    │    "),
    ],
)
def test_a_bar_goes_to_the_side_of_its_push(pwm_us, bar):
    assert signed_bar(pwm_us, 4) == bar


@pytest.mark.parametrize(("cells", "count"), [(30, 4), (34, 4), (60, 8)])
def test_thrusters_fit_none_is_missing_and_the_unit_is_told_once_where_there_is_little_room(cells, count):
    lines = thrusters(picture().thrusters, cells)
    rows = plain(lines)
    assert len(rows) == count
    assert all(width(line) <= cells for line in lines)
    assert all(f" {n} " in " ".join(["", *rows, ""]) for n in range(1, 9))
    (head,) = plain([thrusters_heading("hovering", cells)])
    assert head.endswith(" hovering")
    assert ("µs" in head) is (cells < 50)
    assert any("µs" in row for row in rows) is (cells >= 50)


def test_an_old_thruster_is_dimmed_and_one_that_is_gone_has_no_number_and_those_with_names_have_them():
    lines = thrusters(picture().thrusters, 60)
    assert "--" in plain(lines)[3]
    assert "14 s ago" in plain(lines)[3]
    assert {role for text, role in lines[4] if text.strip() and text != "│"} == {"quiet", "faded", "stale"}
    named = tuple(replace(row, name=f"bow {row.number}") for row in picture().thrusters)
    assert "bow 3" in plain(thrusters(named, 60))[2]


def test_words_come_newest_first_with_their_severity_in_a_word_and_are_counted():
    lines = words(SAID, 80)
    assert plain(lines)[0] == "08:52:19 ERROR     thruster 4: speed controller silent"
    assert [line[2][1] for line in lines] == ["bad", "warn", "plain", "plain"]
    assert plain(words((Said(math.nan, 2, "x"),), 80))[0].startswith("--:--:-- CRITICAL")
    assert worst((*SAID, *SAID[2:3])) == "1 error, 2 warnings"
    assert worst(SAID[:2]) == ""
    past = tuple(replace(message, past=True) for message in SAID)
    assert worst((*past, SAID[2])) == "1 warning"
    assert {role for line in words(past, 80) for _, role in line} == {"quiet"}


LENGTH_S = 600.0


class FakeReel:
    """A frame each second, which is its time."""

    length_s = LENGTH_S
    began_unix_s = 1.79e9

    def between(self, start_s, end_s):
        last = min(end_s, LENGTH_S + 1.0)
        return ((float(n), n) for n in range(math.ceil(start_s), math.ceil(last)))


class FakeWatcher:
    """Keeps what it was fed, and answers with the times of first and last as a picture."""

    def __init__(self, _):
        self.fed = []

    def feed(self, frame, arrived_s, link):
        assert (arrived_s, link) == (float(frame), "hovering")
        self.fed.append(frame)

    def picture(self, now_s):
        del now_s
        return (self.fed[0], self.fed[-1], len(self.fed)) if self.fed else None


class Clock:
    now_s = 100.0

    def __call__(self):
        return self.now_s


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def replay(clock):
    return Replay("hovering", FakeReel(), FakeWatcher, clock)


def test_it_runs_by_the_clock_and_feeds_each_frame_once(replay, clock):
    for second in (1.5, 2.0, 10.5):
        clock.now_s = 100.0 + second
        assert replay.shown().at_s == second
    assert replay.shown().picture == (0, 10, 11)


def test_speed_changes_from_where_it_is(replay, clock):
    clock.now_s += 10.0
    replay.faster(2)
    clock.now_s += 10.0
    assert (replay.at_s, replay.shown().speed) == (50.0, 4.0)
    replay.faster(-100)
    clock.now_s += 40.0
    assert (replay.at_s, replay.shown().speed) == (60.0, 0.25)
    replay.faster(100)
    assert replay.shown().speed == 32.0


def test_a_pause_holds_it_where_it_is_or_is_sent_and_the_next_goes_on_from_there(replay, clock):
    clock.now_s += 10.0
    replay.toggle()
    clock.now_s += 1000.0
    assert (replay.shown().at_s, replay.shown().paused) == (10.0, True)
    replay.seek(20.5)
    assert (replay.shown().at_s, replay.shown().paused) == (30.5, True)
    replay.toggle()
    clock.now_s += 1.0
    assert (replay.shown().at_s, replay.shown().paused) == (31.5, False)


def test_a_leap_has_the_last_minute_before_it_for_the_charts_and_a_short_way_on_reads_on(replay):
    replay.seek(0.5)
    replay.shown()
    replay.seek(10.0)
    assert replay.shown().picture == (0, 10, 11)
    replay.seek(-10.5)
    replay.seek(300.5)
    assert replay.shown().picture == (236, 300, 65.0)
    replay.seek(-200.0)
    assert replay.shown().picture == (36, 100, 65.0)


def test_it_stands_still_at_its_end_with_the_last_frame_and_begins_anew(replay, clock):
    clock.now_s += 10 * LENGTH_S
    for _ in range(2):
        shown = replay.shown()
        assert (shown.at_s, shown.paused, shown.picture[1]) == (LENGTH_S, True, LENGTH_S)
    replay.seek(100.0)
    assert replay.at_s == LENGTH_S
    replay.toggle()
    clock.now_s += 2.5
    assert replay.shown().picture == (0, 2, 3)


def test_the_line_says_what_is_replayed_and_where_in_it_one_is():
    text = replay_line(replayed(), 80)[0][0]
    assert text.startswith(" REPLAY 2026-11-21T0352Z-hovering ")
    assert text.endswith("00:03:12 of 00:13:27  4x     ")
    assert "only the lines above are live" in replay_line(replayed(), 120)[0][0]
    assert replay_line(replayed(paused=True), 80)[0][0].endswith("PAUSED ")


@pytest.mark.parametrize("cells", [40, 80, 160])
def test_the_line_is_as_wide_as_the_screen_and_inverse_throughout(cells):
    line = replay_line(replayed(name="x" * 100), cells)
    assert width(line) == cells
    assert {role for _, role in line} == {"lost"}


def test_what_stands_below_is_the_dive_and_the_lines_above_stay_the_vehicle():
    quiet = replace(picture(), traces={}, thrusters=(), armed=Armed.DISARMED)
    views, at = FixedViews(), desk(replay=StillReplay(replayed(picture=quiet)))
    shown = (Sees("■ ARMED"), Lacks("DISARMED"), Sees("none heard"))
    played(at, *shown, "ctrl+x", "l", Lacks("REPLAY"), Lacks("none heard"), views=views)
    assert views.forced == 1


def test_its_keys_move_in_it_and_are_none_without_it():
    replay = StillReplay()
    keys = ("space", "b", "f", "B", "F", "-", "+", "escape", "space", "f")
    played(desk(replay=replay), *keys, lambda app: app.desk.replay is None)
    assert replay.told == ["toggle", -10, 10, -60, 60, "-1", "+1"]


def test_keys_go_to_the_other_charts_and_to_all_words_where_not_all_fits():
    charts = (Lacks("pitch q"), "c", Sees("pitch q"), Lacks("surge u"), "c", Sees("surge u"))
    devices = "6 devices, hovering"
    said = (Lacks(devices), "w", Sees(devices), Lacks("surge u"), "w", Sees("surge u"))
    played(desk(), *charts, *said)


def test_a_key_on_dives_replays_one_and_a_folder_without_a_recording_says_why(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    folder = Path("2026-11-21T0352Z-hovering")
    folder.mkdir()
    verbs = FakeVerbs({"dives": [HOVERING | {"folder": str(folder)}]})

    why = ("2", "r", worked, Sees("holds no telemetry.tlog and no dive.yaml"))
    recorded = (lambda _: record(folder / "telemetry.tlog", *range(1_790_000_000, 1_790_000_030)),)
    shown = (shows(WatchScreen), Sees("REPLAY 2026-11-21T0352Z-hovering"), Sees("of 00:00:29"))
    played(desk(verbs), *why, *recorded, "r", worked, *shown)


ALARM = Alarm(Kind.BATTERY, "", "battery 13.8 V, below 14 V")
GAP = Gap(
    tuple(
        AxisGap(dof, 1e-3 * drift, 1e-3 * floor, drift > 3 * floor)
        for dof, (drift, floor) in enumerate(
            [(49.1, 5.1), (29.9, 8.8), (5.0, 3.3), (2.0, 2.9), (2.1, 2.0), (57.1, 2.9)]
        )
    )
)


def test_the_gap_shows_every_axis_where_there_is_room_and_else_the_worst():
    assert gap_lines(None, "", 60) == ()
    assert plain(gap_lines(None, "needs a vehicle file", 34)) == [
        "MODEL ─────────────── not compared",
        "needs a vehicle file",
    ]
    (learns,) = gap_lines(Gap(learns_s=34.0), "", 34)
    assert plain((learns,))[0].endswith("its floor is learnt, 34 s")
    assert plain(gap_lines(GAP, "", 34)) == ["MODEL ─ yaw 3.27, floor 0.17 deg/s"]
    heading, *rows = gap_lines(GAP, "", 60)
    assert plain((heading,))[0].endswith("off in 5 s / floor, mm/s and deg/s")
    assert plain(rows) == [
        "surge   49.1 /  5.1 sway    29.9 /  8.8 heave    5.0 /  3.3",
        "roll    0.11 / 0.17 pitch   0.12 / 0.11 yaw     3.27 / 0.17",
    ]
    assert ("  3.27", "bad") in rows[1]


def test_no_figure_of_the_gap_is_cut_off_where_the_room_is_narrow():
    for cells in range(34, 64):
        assert all(width(line) <= cells for line in gap_lines(GAP, "", cells)), cells


def test_the_gap_of_a_vehicle_that_is_not_heard_is_dated_and_has_no_figures():
    assert plain(gap_lines(GAP, "", 34, 3.0)) == ["MODEL ─ yaw 3.27, floor 0.17 deg/s"]
    assert plain(gap_lines(GAP, "", 34, 190.0)) == ["MODEL ──── last compared 3 min ago"]


def test_a_vehicle_that_was_never_compared_with_its_model_is_not_said_to_have_been_once_it_is_silent():
    lacks = "no identified model is known here"
    assert gap_lines(None, lacks, 34, 190.0) == gap_lines(None, lacks, 34)
    assert gap_lines(None, "", 34, 190.0) == ()


def test_once_a_dive_is_over_its_last_minute_stays_on_the_charts_with_its_age_whatever_screen_it_was_on():
    views = FixedViews()
    slower = {"u": replace(picture().traces["u"], value=picture().traces["u"].value - 0.1)}
    goes_on = replace(view(), picture=replace(picture(), traces=picture().traces | slower))
    gone = tuple(replace(link, age_s=100.0, lost=True) for link in picture().links)
    nothing = {
        key: replace(trace, time_s=trace.time_s[:0], value=trace.value[:0], reference=None, age_s=100.0)
        for key, trace in picture().traces.items()
    }
    later = {"now_s": picture().now_s + 100.0, "armed": Armed.DISARMED, "links": gone, "traces": nothing}
    ended = replace(view(), picture=replace(picture(), **later))
    live = (Sees("surge u 0.349 m/s ref 0.400"), Lacks("its last 60 s"))
    elsewhere = ("3", views.then(goes_on), Lacks("surge u"), views.then(ended), "1")
    over = (Sees("DIVE OVER"), Sees("its last 60 s"), Sees("surge u 0.249 m/s 100 s ago"), Sees("-60 s"))
    played(desk(), *live, *elsewhere, *over, views=views, size=WIDE)


def test_every_velocity_and_the_depth_have_their_value_however_many_rows_the_words_around_them_take():
    long = (
        "a trouble of the link that takes two lines, for it says what has happened and what is to be done now"
    )
    silent = tuple(replace(link, age_s=9.0, lost=True) for link in picture().links)
    loud = replace(picture(), links=silent, alarms=(ALARM,), gap=GAP)
    values = [*map(Sees, ("surge u 0.349", "sway v 0.010", "heave w 0.018", "yaw r -9.0", "depth 1.99"))]

    async def work(app, pilot):
        for size in (NARROW, (80, 30), (40, 24), (48, 30)):
            await resized(app, pilot, size)
            await play(app, pilot, *values)

    views = FixedViews(replace(view(), picture=loud, trouble=long))
    run(made(views, desk=desk()), NARROW, work)


def test_an_alarm_rings_once_and_stands_on_every_screen(monkeypatch):
    views = FixedViews(replace(view(), picture=replace(picture(), gap=GAP, alarms=(ALARM,))))
    rung = []
    monkeypatch.setattr("tui.app.app.SeatrialApp.bell", lambda _: rung.append("rung"))

    async def work(app, pilot):
        await pilot.press("2")
        await pilot.press("1")
        return text(app)

    shown = run(made(views), WIDE, work)
    assert f"ALARM {ALARM.words}" in shown
    assert "MODEL" in shown
    assert rung == ["rung"]


def test_an_alarm_rings_while_the_terminal_is_behind_and_takes_no_drawing(monkeypatch):
    views, rung = FixedViews(), []
    monkeypatch.setattr("tui.app.app.SeatrialApp.bell", lambda _: rung.append("rung"))

    async def work(app, pilot):
        monkeypatch.setattr("tui.app.terminal.RefreshRate.may_draw", lambda *_: False)
        views.then(replace(view(), picture=replace(picture(), alarms=(ALARM,))))(app)
        await pilot.pause()

    run(made(views), NARROW, work)
    assert rung == ["rung"]


def test_the_sensors_of_a_dive_that_is_over_are_no_faults():
    silent = tuple(replace(row, condition=Condition.MISSING) for row in picture().sensors)
    views = FixedViews(replace(view(), picture=replace(picture(), sensors=silent)))

    ended = views.then(replace(views.shown, recording=None))
    over = (ended, Sees("the dive is over: nothing is measured"), Lacks("missing"))
    played(desk(), Sees("missing"), *over, views=views, size=WIDE)


def test_where_the_words_leave_room_the_supply_stands_below_them_and_the_other_charts_have_its_rows():
    async def work(app, pilot):
        for size, beside in (((140, 40), True), ((140, 34), False), ((120, 40), False)):
            await resized(app, pilot, size)
            supply, heading = (
                app.screen.query_one(f"#{name}").region.height
                for name in ("beside-chart-voltage", "chart-heading")
            )
            assert ("SUPPLY" in text(app)) is beside is (supply > 0), size
            assert text(app).count("battery     15.90 V") == 1
            assert heading >= 9 or not beside

    run(made(FixedViews()), NARROW, work)
