"""A key begins a recording again where the one before has ended, and says where that fails."""

from dataclasses import replace

from made_dives import OUT, desk
from made_view import FixedViews, view
from screen_text import made, pressed, run, text

from bridge.errors import LinkError
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


def test_one_that_runs_is_let_be():
    begun = []
    assert said_after_the_key(view(), lambda: begun.append(1)) == ["a recording runs already"]
    assert begun == []


def test_why_none_could_be_begun_is_said():
    def fail():
        raise LinkError("the recording did not start: udpin:127.0.0.1:14550: in use; choose another port")

    assert said_after_the_key(SILENT, fail) == [
        "nothing is recorded: the recording did not start: udpin:127.0.0.1:14550: in use; choose another port"
    ]


def test_beside_one_that_hangs_another_is_begun_and_what_holds_it_up_is_said():
    def fail():
        raise LinkError("the recorder hangs and keeps the link: end it with `kill -9 4711`")

    hangs = replace(view(), recording=replace(view().recording, hung_process=4711, reported_unix_s=0.0))
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


def test_the_off_key_leaves_one_that_runs_as_it_is():
    begun = []
    assert said_after_the_key(view(), lambda: begun.append(1), "ctrl+x") == []
    assert begun == []


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
    assert said_after(full, replace(well, began_unix_s=well.began_unix_s + 60.0)) == []


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
