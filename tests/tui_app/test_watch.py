"""The screen Watch: only what changed is drawn again, its panes, and a replay on it."""

import math
from dataclasses import replace
from pathlib import Path

import pytest
from made_dives import HOVERING, FakeVerbs, desk
from made_replay import StillReplay, replayed
from made_view import SAID, SENSORS, UNIX_S, FixedViews, picture, view
from pymavlink.dialects.v20 import ardupilotmega as dialect
from screen_text import looks, made, pressed, run, strips, text
from soak import rest_in_soak

from bridge.wire.framing import Encoder
from bridge.wire.tlog import TlogWriter
from gcs_plugin.watch.picture import Armed, Condition, Freshness, Said
from tui.app.drawing import width
from tui.app.screens.watch import (
    WatchScreen,
    replay_line,
    sensors,
    signed_bar,
    thrusters,
    thrusters_heading,
    words,
    worst,
)
from tui.app.view import SPEEDS, Replay

SIZES = ((80, 24), (160, 50))


@pytest.mark.parametrize("size", rest_in_soak(SIZES))
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

    async def work(app, _):
        assert "?[2J wiped ? ? ? end" in text(app)
        assert all(strip.cell_length == 80 for strip in strips(app))

    run(made(FixedViews(shown)), (80, 24), work)


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


NARROW = SIZES[0]
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
    assert (replay.at_s, replay.shown().speed) == (60.0, SPEEDS[0])
    replay.faster(100)
    assert replay.shown().speed == SPEEDS[-1]


def test_a_pause_holds_it_and_the_next_goes_on_from_there(replay, clock):
    clock.now_s += 10.0
    replay.toggle()
    clock.now_s += 1000.0
    assert (replay.shown().at_s, replay.shown().paused) == (10.0, True)
    replay.toggle()
    clock.now_s += 1.0
    assert (replay.shown().at_s, replay.shown().paused) == (11.0, False)


def test_a_pause_moves_to_where_it_is_sent(replay):
    replay.toggle()
    replay.seek(30.5)
    assert (replay.shown().at_s, replay.shown().paused) == (30.5, True)


def test_a_leap_has_the_last_minute_before_it_for_the_charts(replay):
    replay.shown()
    replay.seek(300.5)
    assert replay.shown().picture == (236, 300, 65.0)
    replay.seek(-200.0)
    assert replay.shown().picture == (36, 100, 65.0)


def test_a_short_way_on_reads_on(replay):
    replay.seek(0.5)
    replay.shown()
    replay.seek(10.0)
    assert replay.shown().picture == (0, 10, 11)


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
    quiet = replace(picture(), traces={}, thrusters=(), armed=picture().armed.DISARMED)

    async def work(app, pilot):
        app._show()
        await pilot.pause()
        shown = text(app)
        assert "■ ARMED" in shown
        assert "DISARMED" not in shown
        assert "none heard" in shown
        await pressed(pilot, "l")
        assert "REPLAY" not in text(app)
        assert "none heard" not in text(app)

    run(made(FixedViews(), desk=desk(replay=StillReplay(replayed(picture=quiet)))), NARROW, work)


def test_its_keys_move_in_it_and_are_none_without_it():
    replay = StillReplay()

    async def work(app, pilot):
        app._show()
        await pressed(pilot, "space", "b", "f", "B", "F", "-", "+", "escape", "space", "f")
        assert app.desk.replay is None

    run(made(FixedViews(), desk=desk(replay=replay)), NARROW, work)
    assert replay.told == ["toggle", -10, 10, -60, 60, "-1", "+1"]


def test_the_off_switch_is_the_vehicles_in_a_replay():
    views = FixedViews()
    run(made(views, desk=desk(replay=StillReplay())), NARROW, lambda _, pilot: pressed(pilot, "ctrl+x"))
    assert views.forced == 1


async def until(app, pilot, words):
    """Show views until these words stand on the screen."""
    for _ in range(400):
        if words in " ".join(text(app).split()):
            return
        app._show()
        await pilot.pause(0.01)
    raise AssertionError(text(app))


def test_a_key_on_dives_replays_one_and_a_folder_without_a_recording_says_why(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    folder = Path("2026-11-21T0352Z-hovering")
    folder.mkdir()
    verbs = FakeVerbs({"dives": [HOVERING | {"folder": str(folder)}]})

    async def work(app, pilot):
        await pressed(pilot, "2")
        await until(app, pilot, "UVw")
        await pressed(pilot, "r")
        await until(app, pilot, "holds no telemetry.tlog and no dive.yaml")
        with TlogWriter(folder / "telemetry.tlog") as writer:
            for n in range(30):
                raw = Encoder(1, 1).encode(dialect.MAVLink_heartbeat_message(12, 3, 0, n, 4, 3))
                writer.write(1_790_000_000_000_000 + n * 1_000_000, raw)
        await pressed(pilot, "r")
        await until(app, pilot, "REPLAY 2026-11-21T0352Z-hovering")
        await until(app, pilot, "of 00:00:29")
        assert isinstance(app.screen, WatchScreen)

    run(made(FixedViews(), desk=desk(verbs)), NARROW, work)
