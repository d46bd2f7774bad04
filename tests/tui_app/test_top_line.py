"""The line at the top of the screen and its alarms, and the notes that alarms leave in a dive."""

import math
from dataclasses import replace
from itertools import product
from pathlib import Path

import pytest
from fake_verbs import FakeVerbs
from fake_verbs import desk as made_desk
from made_view import UNIX_S, FixedViews, picture, recording, view
from screen_text import plain, played

from gcs_plugin.dives.folder import DiveFolder
from gcs_plugin.watch.picture import Alarm, Armed, Kind
from tui.app.alarm_notes import AlarmEvent, AlarmNotes
from tui.app.drawing import changed, harmless
from tui.app.header import Tab, header, tab_at
from tui.app.view import Forcing, aged, silent_after

TABS = (Tab("1", "Watch", True), Tab("2", "Dives", False))


def first(shown, cells=80):
    return header(shown, TABS, cells)[0]


def joined(line):
    return "".join(text for text, _ in line)


def with_picture(**changes):
    return replace(view(), picture=replace(picture(), **changes))


def link(**changes):
    return with_picture(links=(replace(picture().links[0], **changes),))


def recorded(*of_recording, silent_s=0.0, **changes):
    return replace(view(), recording=recording(*of_recording, written_unix_s=UNIX_S - silent_s, **changes))


def forced(words, sent, done=False, waits_for=(), **changes):
    return replace(with_picture(**changes), forcing=Forcing(words, sent, done, waits_for))


NOT_OFF = "vehicle 1: sent 4 times, no answer for 2.0 s"
OFF = "vehicle 1: off, as read back"


@pytest.mark.parametrize(
    ("shown", "cells", "words", "role"),
    [
        (with_picture(armed=Armed.DISARMED), 80, " □ DISARMED ", "plain"),
        (with_picture(armed=Armed.ARMED), 80, " ■ ARMED ", "armed"),
        (with_picture(armed=Armed.FAILSAFE), 80, " ▲ FAILSAFE ", "failsafe"),
        (with_picture(armed=Armed.UNKNOWN), 80, " ? ARMED STATE UNKNOWN ", "lost"),
        (with_picture(armed_age_s=12.0), 80, " ? was ARMED, 12 s ago ", "lost"),
        (view(), 80, "LINK 0.4 s  loss 2 %  sys 1/1", "plain"),
        (link(age_s=12.3, lost=True), 80, " LINK LOST 12 s ", "lost"),
        (link(age_s=math.inf, lost=True), 80, " LINK LOST never heard ", "lost"),
        (link(age_s=math.inf, lost=False), 80, "LINK, no HEARTBEAT yet", "plain"),
        (with_picture(links=()), 80, " NO LINK ", "lost"),
        (view(), 80, "REC 00:12:31  41 h left", "plain"),
        (recorded(751, math.inf), 80, "REC 00:12:31  nothing comes", "plain"),
        (recorded(4, math.inf), 80, "REC 00:00:04", "plain"),
        (recorded(751, 480.0), 80, " REC 00:12:31  8 min left ", "lost"),
        (recorded(446, 1e6, silent_s=4.9), 80, "REC 00:07:26  278 h left", "plain"),
        (recorded(446, 1e6, silent_s=6.0), 80, " NOT RECORDING? silent 6 s ", "lost"),
        (replace(view(), recording=None), 80, " NOT RECORDING ", "lost"),
        (replace(view(), recording=None, over=True), 80, "DIVE OVER", "strong"),
        (replace(view(), recording=None, over=True), 80, "nothing is recorded", "plain"),
        (replace(view(), over=True), 80, "REC 00:12:31  41 h left", "plain"),
        (with_picture(ff_mode=0), 80, "FF off", "plain"),
        (with_picture(ff_mode=3), 80, "FF both", "plain"),
        (with_picture(ff_mode=None), 80, "FF --", "quiet"),
        (with_picture(ff_mode=3, ff_mode_age_s=5.0), 160, "FF both 5.0 s ago", "stale"),
        (with_picture(ff_mode=3, ff_mode_age_s=11.0), 160, "FF --", "quiet"),
        (forced(NOT_OFF, 4), 160, f" FF shadow; OFF: {NOT_OFF} ", "lost"),
        (forced(OFF, 5, True), 160, f"FF OFF, {OFF}", "strong"),
    ],
)
def test_each_state_has_its_words_and_its_role(shown, cells, words, role):
    assert (words, role) in first(shown, cells)


@pytest.mark.parametrize(
    ("armed", "words"),
    [
        (Armed.ARMED, [" ? was ARMED, 40 s ago "]),
        (Armed.FAILSAFE, [" ? was FAILSAFE, 40 s ago "]),
        (Armed.DISARMED, []),
        (Armed.UNKNOWN, []),
    ],
)
def test_of_a_dive_that_is_over_the_first_line_says_whether_its_vehicle_was_armed_when_last_heard(
    armed, words
):
    over = replace(with_picture(armed=armed, armed_age_s=40.0), recording=None, over=True)
    told = [text for text, _ in first(over, 80) if "40 s ago" in text]
    assert told == words
    assert ("DIVE OVER", "strong") in first(over, 80)


@pytest.mark.parametrize(
    ("armed", "age_s", "silent"),
    [
        (Armed.DISARMED, 4.0, True),
        (Armed.DISARMED, 1.0, False),
        (Armed.ARMED, 4.0, False),
        (Armed.UNKNOWN, 4.0, False),
    ],
)
def test_a_vehicle_that_was_disarmed_before_it_fell_silent_is_no_alarm(armed, age_s, silent):
    shown = with_picture(armed=armed, links=(replace(picture().links[0], age_s=age_s),))
    assert silent_after(shown) is silent


FULL = "telemetry.tlog: can't be written (No space left on device); free disk space"
TWINS = (
    "two vehicles beat as system 1, component 1: one of them stands on deck and answers to it; switch one off"
)
HANGS = (
    "the recorder hangs since 75 s: end it with `kill -9 4711` (what it wrote is kept), then begin another"
)


@pytest.mark.parametrize(
    ("shown", "words", "rows"),
    [
        (with_picture(twins="two vehicles beat as system 1"), "two vehicles beat as system 1", 1),
        (with_picture(twins=TWINS), TWINS, 2),
        (recorded(0, 1e6, 12), "12 frames are in no file of the dive: check the disk", 1),
        (recorded(90, 0.0, 0, unwritten=FULL, waiting=321),
         f"NOTHING IS WRITTEN, 321 frames wait in memory: {FULL}", 2),
        (recorded(90, math.inf, 0, unwritten="x", waiting=1), "NOTHING IS WRITTEN, 1 frame waits in memory: x", 1),
        (recorded(446, 1e6, silent_s=6.0),
         "the recorder has not reported for 6 s: it may have stopped writing", 1),
        (recorded(446, 1e6, silent_s=75.0), HANGS, 2),
        (replace(view(), trouble="udpin: in use"), "udpin: in use", 1),
        (replace(view(), behind_s=5.0),
         "nothing is read from the link since 5 s: leave the app and start it again", 1),
        (recorded(446, 1e6, silent_s=4.9), "", 0),
    ],
)  # fmt: skip
def test_what_must_not_be_overlooked_has_lines_of_its_own_and_no_word_of_it_is_lost(shown, words, rows):
    lines = header(shown, TABS, 80)[2:]
    assert " ".join(" ".join(plain(lines)).split()) == words
    assert len(lines) == rows
    assert all(line[0][1] == "lost" and len(joined(line)) == 80 for line in lines)


def test_frames_that_are_not_written_are_told_in_the_first_line_too():
    full = recorded(90, math.inf, 0, unwritten=FULL, waiting=321)
    assert (" REC 00:01:30  NOT WRITTEN ", "lost") in first(full)


@pytest.mark.parametrize("forcing", [(NOT_OFF, 14), (f"{OFF} and as its telemetry says", 5, True)])
@pytest.mark.parametrize(
    ("armed", "armed_age_s"), [(Armed.ARMED, 0.4), (Armed.FAILSAFE, 4.0), (Armed.UNKNOWN, 4.0)]
)
def test_the_clock_of_the_recording_and_the_disk_stay_while_the_off_switch_is_told(
    armed, armed_age_s, forcing
):
    words = joined(first(forced(*forcing, armed=armed, armed_age_s=armed_age_s)))
    assert "REC 00:12:31  41 h left" in words
    assert ("FF OFF, " if len(forcing) == 3 else "FF shadow; OFF not ") in words
    assert len(words) <= 80


@pytest.mark.parametrize(
    ("mode", "age_s", "is_now"),
    [(3, 0.4, "FF both"), (3, 5.0, "FF was both"), (3, 11.0, "FF --"), (None, math.inf, "FF --")],
)
def test_an_off_that_another_vehicle_has_not_acknowledged_hides_not_what_this_one_flies(mode, age_s, is_now):
    words = "vehicle 1: off, as read back; vehicle 2: sent 518 times, no answer for 300.0 s"
    shown = forced(words, 518, False, (2,), ff_mode=mode, ff_mode_age_s=age_s)
    assert f" {is_now}; OFF of 2 " in joined(first(shown, 80))
    assert f" {is_now}; OFF: {words} " in joined(first(shown, 200))
    assert "OFF not done" in joined(first(shown, 60))


def test_an_off_that_is_not_done_says_so_at_every_width():
    """Orders that a silent recorder was handed count as not sent."""
    cases = product((0, 1, 14), Armed, (0.4, 12.0), (False, True), (0.0, 8.0), (60, 80, 100))
    for sent, armed, armed_age_s, lost, silent_s, cells in cases:
        links = (replace(picture().links[0], age_s=8.0, lost=True) if lost else picture().links[0],)
        state = {
            "armed": armed,
            "armed_age_s": armed_age_s,
            "links": links,
            "ff_mode": 3,
            "ff_mode_age_s": 8.0,
        }
        shown = forced(
            "vehicle 1: sent 14 times, not heard for 8 s: not confirmed", sent, False, (1,), **state
        )
        words = joined(
            first(replace(shown, recording=recorded(446, 1e6, silent_s=silent_s).recording), cells)
        )
        unsent = "OFF not sent" in words
        assert unsent == (sent == 0 or silent_s > 0.0), words
        assert unsent or "OFF not done" in words or "not confirmed" in words, words
        assert len(words) <= cells, words


def test_the_off_switch_that_is_done_is_never_told_by_the_words_of_one_that_is_not():
    never = replace(picture().links[0], age_s=math.inf, lost=True)
    shown = forced(OFF, 5, True, armed=Armed.UNKNOWN, links=(never,))
    assert joined(first(shown)).rstrip().endswith(("FF OFF, acknowledged", "FF OFF, done"))


@pytest.mark.parametrize("cells", [60, 80, 160])
@pytest.mark.parametrize("shown", [view(), forced(NOT_OFF, 14, armed=Armed.UNKNOWN)])
def test_nothing_is_wider_than_the_terminal(cells, shown):
    assert all(len(joined(line)) <= cells for line in header(replace(shown, trouble="x" * 200), TABS, cells))


def test_a_click_finds_its_tab():
    def tab(cells, x, y):
        at = tab_at(view(), TABS, cells, x, y)
        return at and at.title

    assert [tab(80, x, 1) for x in (0, 8, 9, 17, 18)] == ["Watch", "Watch", "Dives", "Dives", None]
    assert tab(80, 0, 0) is None
    assert [tab(48, 0, y) for y in (1, 2, 3)] == [None, "Watch", None]
    assert [tab(17, 0, y) for y in (4, 5)] == ["Watch", "Dives"]


def test_on_a_phone_the_parts_are_stacked_and_none_is_cut():
    shown = plain(header(with_picture(armed=Armed.DISARMED), TABS, 48))
    assert [" ".join(line.split()) for line in shown] == [
        "□ DISARMED │ LINK 0.4 s loss 2 % sys 1/1",
        "REC 00:12:31 41 h left │ FF shadow",
        "1 Watch 2 Dives 08:52:31 UTC",
    ]


def test_a_silent_engine_leaves_no_number_bright():
    def freshness(shown):
        return {row.freshness.value for row in (*shown.sensors, *shown.thrusters, *shown.traces.values())}

    old = aged(picture(), 5.0)
    assert old.armed_age_s == pytest.approx(5.4)
    assert all(link.lost for link in old.links)
    assert freshness(old) == {"stale", "gone"}
    assert freshness(aged(picture(), 11.0)) == {"gone"}
    assert aged(picture(), 0.0).sensors == picture().sensors


@pytest.mark.parametrize(
    ("before", "after", "cells"),
    [
        ((("abc", "plain"),), (("abc", "plain"),), (0, 0)),
        ((("a 1.2 s", "plain"),), (("a 1.3 s", "plain"),), (4, 5)),
        ((("ab", "plain"), ("cd", "stale")), (("abcd", "plain"),), (2, 4)),
        ((("abcd", "plain"),), (("a", "plain"),), (1, 4)),
        ((), (("  x", "plain"),), (2, 3)),
    ],
)
def test_only_the_cells_that_changed_are_drawn_again(before, after, cells):
    assert changed(before, after) == cells


def test_all_that_is_drawn_is_one_cell_wide():
    drawn = "●◐▲○□■│┤─░┈▁▂▃▄▅▆▇█▌▐…⠁⣿⡇"
    assert harmless(drawn) == drawn


def test_a_clock_that_is_set_leaves_the_recording_counting():
    set_back = recording(751, set_by_s=-86_400.0, written_unix_s=UNIX_S - 86_400.0)
    line = first(replace(view(), unix_s=UNIX_S - 86_400.0, recording=set_back))
    assert "REC 00:12:31" in joined(line)


BATTERY = Alarm(Kind.BATTERY, "", "battery 13.8 V, below 14 V")
LOST = Alarm(Kind.LINK, "", "nothing heard of the vehicle for 7 s")


def test_the_gravest_alarm_has_a_line_of_its_own_above_other_troubles():
    shown = replace(with_picture(alarms=(LOST, BATTERY)), trouble="the link is refused")
    _, _, alarm, trouble = header(shown, TABS, 80)
    assert alarm[0][1] == "failsafe"
    assert joined(alarm).strip() == f"ALARM {LOST.words} (and 1 more)"
    assert joined(trouble).strip() == "the link is refused"


def test_a_long_alarm_is_cut_and_still_says_that_there_are_more():
    long = replace(
        BATTERY, words="it departs from its model in surge, sway and yaw: " + 9 * "a pull of 3 N, "
    )
    lines = header(with_picture(alarms=(long, LOST)), TABS, 80)[2:]
    assert [len(joined(line)) for line in lines] == [80, 80]
    assert joined(lines[-1]).rstrip().endswith("(and 1 more)")


@pytest.mark.parametrize("others", [(), (LOST, LOST)])
@pytest.mark.parametrize("cells", [44, 48, 60, 80, 160])
def test_the_cause_of_an_alarm_is_never_cut_where_the_model_is_departed_from_in_two_axes(cells, others):
    words = "it departs from its model in surge, yaw: thruster 1 gives 50 % less or a pull of 12 N"
    shown = with_picture(alarms=(replace(BATTERY, words=words), *others))
    lines = plain(tuple(line for line in header(shown, TABS, cells) if line[0][1] == "failsafe"))
    told = " ".join(" ".join(lines).split())
    assert told == f"ALARM {words}" + " (and 2 more)" * bool(others)
    assert all(len(line) <= cells for line in lines)


def test_a_dive_that_is_over_has_no_alarm():
    assert len(header(replace(with_picture(alarms=(LOST,)), over=True), TABS, 80)) == 2


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
