"""An alarm is an event of the dive being recorded: once, and only in an app that may act."""

from dataclasses import replace
from pathlib import Path

from fake_verbs import FakeVerbs
from fake_verbs import desk as made_desk
from made_view import UNIX_S, FixedViews, picture, recording, view
from screen_text import played

from gcs_plugin.dives.folder import DiveFolder
from gcs_plugin.watch.picture import Alarm, Kind
from tui.app.alarm_notes import AlarmEvent, AlarmNotes

ALARM = Alarm(Kind.GAP, "", "it departs from its model in surge: thruster 1 gives 50 % less")
EVENT = AlarmEvent(Path("dives/deck"), UNIX_S, f"ALARM {ALARM.words}")


def test_an_alarm_that_comes_back_within_a_minute_is_one_event_and_one_of_the_next_dive_another():
    notes = AlarmNotes()
    assert notes.take((ALARM,), view()) == (EVENT,)
    assert notes.take((ALARM,), replace(view(), unix_s=UNIX_S + 59.0)) == ()
    (again,) = notes.take((ALARM,), replace(view(), unix_s=UNIX_S + 61.0))
    assert again.unix_s == UNIX_S + 61.0
    next_dive = replace(recording(), folder="dives/next")
    (other,) = notes.take((ALARM,), replace(view(), recording=next_dive))
    assert other.folder == Path("dives/next")


def test_without_a_recording_or_where_the_user_only_looks_nothing_is_left():
    assert AlarmNotes().take((ALARM,), replace(view(), recording=None)) == ()
    assert AlarmNotes().take((ALARM,), replace(view(), view_only=True)) == ()


def test_the_app_leaves_the_alarm_with_the_dive(tmp_path):
    folder = tmp_path / "2026-11-21T0840Z-deck"
    folder.mkdir()
    seen = replace(
        view(),
        picture=replace(picture(), alarms=(ALARM,)),
        recording=replace(recording(), folder=str(folder)),
    )
    desk = made_desk(FakeVerbs({}), out=tmp_path)

    def noted(_):
        return bool(DiveFolder(folder).about().events)

    played(desk, noted, views=FixedViews(seen))
    (event,) = DiveFolder(folder).about().events
    assert event.text == EVENT.text
