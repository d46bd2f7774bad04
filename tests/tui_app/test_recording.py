"""Recordings from the app: begun, gone on with in a new dive, ended."""

from dataclasses import replace
from pathlib import Path

import pytest
from made_dives import DECK, DIVES, HOVERING, OUT, FakeVerbs, desk, dive
from made_view import FixedViews, recording, view
from screen_text import made, pressed, run, settled, text
from soak import rows_rest_in_soak

from bridge.errors import LinkError
from tui.app.jobs import aside
from tui.app.screens.overlays import AskScreen
from tui.app.view import Forcing

SIZE = (80, 24)
SILENT = replace(view(), recording=None)


def said_after_the_key(shown, record, key="ctrl+g"):
    """What the app says once the key was pressed."""

    async def work(app, pilot):
        await pressed(pilot, key)
        await app.workers.wait_for_complete()
        await pilot.pause()
        return [notice.message for notice in app._notifications]

    return run(made(FixedViews(shown), desk=desk(record=record)), SIZE, work)


def test_a_recording_is_begun_where_none_runs():
    begun = []
    assert said_after_the_key(SILENT, lambda: begun.append(1)) == ["a recording has begun"]
    assert begun == [1]


def test_why_none_could_be_begun_is_said():
    def fail():
        raise LinkError("the recording did not start: udpin:127.0.0.1:14550: in use; choose another port")

    assert said_after_the_key(SILENT, fail) == [
        "nothing is recorded: the recording did not start: udpin:127.0.0.1:14550: in use; choose another port"
    ]


def test_beside_one_that_hangs_another_is_begun_and_what_holds_it_up_is_said():
    def fail():
        raise LinkError("the recorder hangs and keeps the link: end it with `kill -9 4711`")

    hangs = replace(view(), recording=replace(view().recording, written_unix_s=0.0))
    for key in ("ctrl+g", "ctrl+x"):
        assert said_after_the_key(hangs, fail, key) == [
            "nothing is recorded: the recorder hangs and keeps the link: end it with `kill -9 4711`"
        ]


def test_an_app_that_records_nothing_says_how_it_would():
    (said,) = said_after_the_key(SILENT, None)
    assert "--unrecorded; leave it and start it without" in said


def test_the_off_key_begins_one_where_it_has_died_for_off_goes_by_its_links():
    begun = []
    assert said_after_the_key(SILENT, lambda: begun.append(1), "ctrl+x") == ["a recording has begun"]
    assert begun == [1]


def said_after(*recordings):
    """What the app says while these recordings are seen one after the other."""

    async def work(app, pilot):
        for one in recordings:
            app._views.shown = replace(view(), recording=one)
            app._refresh_view()
            await pilot.pause()
        return [notice.message for notice in app._notifications]

    return run(made(FixedViews(view()), desk=desk()), SIZE, work)


def test_once_there_is_space_again_it_is_said_that_the_recording_goes_on():
    well = view().recording
    full = replace(well, unwritten="telemetry.tlog: can't be written (No space left on device)", waiting=9)
    assert said_after(well, full, full) == []
    assert said_after(full, None, full, well, well) == [
        "the recording goes on: every frame that waited is written"
    ]
    assert said_after(full, replace(well, lost=12)) == ["the recording goes on: 12 frames are lost"]
    assert said_after(full, recording(lasted_s=60.0)) == []


def begun_after(*shown, end=None):
    """How often a recording was begun, the off key pressed at the first of these views, and then the others came."""
    begun = []

    async def work(app, pilot):
        await pressed(pilot, "ctrl+x")
        if end is not None:
            await pressed(pilot, "ctrl+e", *end, "enter")
        for one in (*shown[1:], *shown[-1:]):
            app._views.shown = one
            app._refresh_view()
            await app.workers.wait_for_complete()
            await pilot.pause()
        return len(begun)

    orders = {"recorded": lambda: OUT, "end_recording": lambda: OUT, "record": lambda: begun.append(1)}
    return run(made(FixedViews(shown[0]), desk=desk(**orders)), SIZE, work)


ASKED = Forcing("vehicle 1: sent 4 times, no answer for 2.0 s", 4, False)
RUNS, DEAD = replace(view(), forcing=ASKED), replace(SILENT, forcing=ASKED)


def test_the_off_key_begins_one_where_it_dies_unnoticed_or_before_off_is_acknowledged():
    assert begun_after(view(), RUNS, DEAD) == 1


def test_one_press_begins_no_second_one_where_that_dies_too():
    assert begun_after(view(), DEAD, RUNS, DEAD) == 1


def test_none_is_begun_where_off_was_acknowledged_before_it_died():
    done = Forcing("vehicle 1: off, as read back", 5, True)
    assert begun_after(view(), replace(view(), forcing=done), replace(SILENT, forcing=done)) == 0


def test_none_is_begun_where_the_crew_itself_ended_it():
    assert begun_after(RUNS, DEAD, end="END") == 0


def test_while_nothing_is_recorded_the_top_names_the_key_that_records_by_its_live_binding():
    def on_top(record, shown=SILENT, **what):
        async def look(app, pilot):
            await pilot.pause()
            return text(app).splitlines()[2].strip()

        return run(made(FixedViews(shown), desk=desk(record=record), **what), SIZE, look)

    assert on_top(print) == "no recording runs; ^g begins one"
    assert on_top(print, keymap={"recording.begin": "f7"}) == "no recording runs; f7 begins one"
    lost = replace(SILENT, trouble="no recording runs that could be listened to")
    assert on_top(print, lost) == "no recording runs that could be listened to; ^g begins one"
    assert "begins one" not in on_top(None)
    assert "begins one" not in on_top(print, view_only=True)


SECOND = dive("second", duration_s=3.0)


class Boat:
    """A recording into the dive `deck`, as the app meets it."""

    def __init__(self, fails=""):
        self.recorded, self.asked, self.fails = OUT / Path(DECK["folder"]).name, [], fails
        self.verbs = FakeVerbs()
        self.desk = desk(
            self.verbs, recorded=lambda: self.recorded, next_dive=self._next, end_recording=self._end
        )

    def _next(self):
        finished = self._end("next")
        self.recorded = Path(SECOND["folder"])
        self.verbs.results["dives"] = [*DIVES, SECOND]
        return finished

    def _end(self, word="end"):
        self.asked.append(word)
        if self.fails:
            raise LinkError(self.fails)
        finished, self.recorded = self.recorded, None
        return finished


def after(keys, boat, shown=None, then=None):
    """What the app says once the keys were pressed; `then(app)` looks further."""

    async def work(app, pilot):
        await pressed(pilot, *keys)
        await app.workers.wait_for_complete()
        await pilot.pause()
        said = [notice.message for notice in app._notifications]
        return (said, await then(app, pilot)) if then else said

    return run(made(FixedViews(shown), desk=boat.desk), SIZE, work)


def test_one_key_begins_the_next_dive_and_the_newest_finished_one_is_chosen(tmp_path):
    boat = Boat()
    boat.recorded = tmp_path
    boat.desk.dive = OUT / HOVERING["name"]
    assert after(["ctrl+n"], boat) == [f"{tmp_path.name} is finished; the next dive is recorded"]
    assert boat.asked == ["next"]
    assert boat.desk.dive is None


def test_a_dive_in_which_nothing_arrived_is_said_not_to_be_kept():
    (said,) = after(["ctrl+n"], Boat())
    assert said.endswith("deck is not kept, since nothing arrived in it; the next dive is recorded")


@pytest.mark.parametrize("key", ["ctrl+n", "ctrl+e"])
def test_where_nothing_is_recorded_the_key_says_so(key):
    boat = Boat()
    assert after([key], boat, SILENT) == ["no recording runs that the app could speak to"]
    boat.desk.record = print
    (said,) = after([key], boat, SILENT)
    assert said == "no recording runs that the app could speak to; ^g begins one"
    assert boat.asked == []


def test_why_there_is_no_next_dive_is_said():
    boat = Boat("dives: this dive has only just begun; ask again in 5 s")
    assert after(["ctrl+n"], boat) == ["dives: this dive has only just begun; ask again in 5 s"]


@pytest.mark.parametrize(("typed", "asked"), [("END", ["end"]), ("end", ["end"]), ("", []), ("yes", [])])
def test_the_recording_is_ended_only_where_that_is_typed(typed, asked):
    boat = Boat()
    after(["ctrl+e", *typed, "enter"], boat)
    assert boat.asked == asked


def test_the_question_names_the_dive_and_escape_leaves_it():
    boat = Boat()

    async def look(app, pilot):
        assert isinstance(app.screen, AskScreen)
        assert "Type END to end the recording of 2026-11-21T0452Z-deck" in text(app)
        assert "enter ends it, and the link with it, escape leaves it" in text(app)
        await pressed(pilot, *"END", "escape")

    after(["ctrl+e"], boat, then=look)
    assert boat.asked == []


def test_a_recording_begun_since_the_question_was_asked_is_not_ended_by_its_answer():
    boat = Boat()

    async def answer(app, pilot):
        boat.recorded = Path(SECOND["folder"])
        await pressed(pilot, *"END", "enter")
        await app.workers.wait_for_complete()
        return [notice.message for notice in app._notifications]

    _, said = after(["ctrl+e"], boat, then=answer)
    assert said == ["the recording of 2026-11-21T0452Z-deck is over already; nothing was ended"]
    assert boat.asked == []


def test_dives_marks_the_dive_that_is_over_and_the_new_one_is_recorded():
    async def look(app, pilot):
        await settled(app, pilot)
        marked = [line for line in text(app).splitlines() if line.startswith("▶")]
        return marked, app.screen._at, app.screen._recorded

    async def work(app, pilot):
        await pressed(pilot, "2")
        app._show()
        await pilot.pause()
        before = await look(app, pilot)
        await pressed(pilot, "ctrl+n")
        await app.workers.wait_for_complete()
        for _ in range(4):
            app._show()
            await pilot.pause()
        return before, await look(app, pilot)

    boat = Boat()
    before, now = run(made(FixedViews(), desk=boat.desk), SIZE, work)
    assert before[1:] == (Path(HOVERING["folder"]), Path(DECK["folder"]))
    assert now[1:] == (Path(DECK["folder"]), Path(SECOND["folder"]))
    assert before[0] != now[0]


@pytest.fixture
def dives(tmp_path):
    """A dive that has ended, the one that is being recorded, and the one after it, which is not there yet."""
    folders = [tmp_path / f"2026-11-21T0{hour}52Z-hovering" for hour in (3, 4, 5)]
    for folder in folders[:2]:
        lie(folder)
    return folders


def lie(folder):
    folder.mkdir(exist_ok=True)
    (folder / "telemetry.tlog").write_bytes(b"")


@pytest.mark.parametrize(
    ("screen", "key", "verb"),
    rows_rest_in_soak([("3", "i", "identify"), ("4", "d", "diagnose"), ("6", "v", "validate")]),
)
@pytest.mark.parametrize("by_key", [True, False])
def test_a_dive_that_is_worked_on_keeps_its_screens_whatever_ends_meanwhile(screen, key, verb, by_key, dives):
    first, second, third = dives
    recorded = [second]

    def go_on():
        lie(third)
        recorded[0] = third
        return second

    at = desk(FakeVerbs(), recorded=lambda: recorded[0], next_dive=go_on)
    at.out = first.parent

    async def work(app, pilot):
        await pressed(pilot, screen, key)
        assert at.jobs.runs(verb)
        await (pressed(pilot, "ctrl+n") if by_key else aside(go_on))
        await app.workers.wait_for_complete()
        at.jobs.cancel(verb)
        while at.jobs.runs(verb):
            await pilot.pause()
        app._show()
        await pilot.pause()
        assert at.chosen() == first
        assert first.name in text(app)
        said = [notice.message for notice in app._notifications]
        await pressed(pilot, "ctrl+n")
        await app.workers.wait_for_complete()
        assert at.chosen() == second
        return said

    words = f"{second.name} is finished; the next dive is recorded; the screens stay on {first.name}"
    assert run(made(FixedViews(), desk=at), (160, 50), work) == ([words] if by_key else [])
