"""The replay of a dive on Watch: speed, pause, seek, and no chance to take it for the vehicle."""

import math
from dataclasses import replace
from pathlib import Path

import pytest
from made_dives import HOVERING, FakeVerbs, desk
from made_replay import StillReplay, replayed
from made_view import FixedViews, picture
from pymavlink.dialects.v20 import ardupilotmega as dialect
from screen_text import made, pressed, run, text

from bridge.framing import Encoder
from bridge.tlog import TlogWriter
from tui.app.drawing import width
from tui.app.screens.watch import WatchScreen, replay_line
from tui.app.view import BEFORE_S, SPEEDS, Replay

SIZES = ((80, 24), (160, 50))
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
    assert replay.shown().picture == (math.ceil(300.5 - BEFORE_S), 300, BEFORE_S)
    replay.seek(-200.0)
    assert replay.shown().picture == (math.ceil(100.5 - BEFORE_S), 100, BEFORE_S)


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
