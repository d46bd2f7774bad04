"""The top line: states in word and shape, ages counted up, and nothing that does not fit."""

import math
from dataclasses import replace

import pytest
from made_view import UNIX_S, picture, recording, view

from gcs_plugin.watch.picture import Armed
from tui.app.drawing import changed, harmless
from tui.app.header import Tab, header, tab_at
from tui.app.view import Forcing, aged

TABS = (Tab("1", "Watch", True), Tab("2", "Dives", False))


def first(shown, cells=80):
    return header(shown, TABS, cells)[0]


def joined(line):
    return "".join(text for text, _ in line)


def with_picture(**changes):
    return replace(view(), picture=replace(picture(), **changes))


def role_of(line, word):
    return next(role for text, role in line if word in text)


@pytest.mark.parametrize(
    ("armed", "words", "role"),
    [
        (Armed.DISARMED, "□ DISARMED", "plain"),
        (Armed.ARMED, "■ ARMED", "armed"),
        (Armed.FAILSAFE, "▲ FAILSAFE", "failsafe"),
        (Armed.UNKNOWN, "? ARMED STATE UNKNOWN", "lost"),
    ],
)
def test_each_armed_state_has_its_word_its_shape_and_its_role_and_stands_first(armed, words, role):
    line = first(with_picture(armed=armed))
    assert line[0] == (f" {words} ", role)


def test_a_stale_armed_state_says_what_it_was_and_when():
    line = first(with_picture(armed_age_s=12.0))
    assert line[0] == (" ? was ARMED, 12 s ago ", "lost")


def test_the_link_tells_age_loss_and_who_speaks():
    assert "LINK 0.4 s  loss 2 %  sys 1/1" in joined(first(view()))


def test_a_lost_link_counts_up_its_seconds_inverse():
    link = replace(picture().links[0], age_s=12.3, lost=True)
    line = first(with_picture(links=(link,)))
    assert role_of(line, "LINK LOST 12 s") == "lost"


def test_no_link_at_all_says_so():
    assert role_of(first(with_picture(links=())), "NO LINK") == "lost"
    never = replace(picture().links[0], age_s=math.inf, lost=True)
    assert "LINK LOST never heard" in joined(first(with_picture(links=(never,))))


def test_the_recording_tells_its_time_and_how_long_the_disk_lasts():
    assert "REC 00:12:31  41 h left" in joined(first(view()))
    assert "REC 00:12:31  nothing comes" in joined(
        first(replace(view(), recording=recording(751, math.inf, 0)))
    )


def test_nothing_is_said_to_come_only_once_the_disk_was_looked_at():
    young = first(replace(view(), recording=recording(4, math.inf, 0)))
    assert "REC 00:00:04" in joined(young)
    assert "nothing comes" not in joined(young)


FULL = "telemetry.tlog: can't be written (No space left on device); free disk space"


def test_frames_that_are_not_written_are_told_inverse_with_the_reason():
    full = recording(90, 0.0, 0, unwritten=FULL, waiting=321)
    lines = header(replace(view(), recording=full), TABS, 80)
    assert (" REC 00:01:30  NOT WRITTEN ", "lost") in lines[0]
    assert " ".join(" ".join(map(joined, lines[2:])).split()) == (
        f"NOTHING IS WRITTEN, 321 frames wait in memory: {FULL}"
    )
    assert {line[0][1] for line in lines[2:]} == {"lost"}
    silent = recording(90, math.inf, 0, unwritten=FULL, waiting=1)
    lines = header(replace(view(), recording=silent), TABS, 80)
    assert "nothing comes" not in joined(lines[0])
    assert joined(lines[2]).startswith(" NOTHING IS WRITTEN, 1 frame waits in memory: ")


def test_a_recorder_that_has_told_nothing_for_a_few_seconds_is_not_called_recording():
    def seen(age_s):
        told = recording(446, 1e6, 0, written_unix_s=UNIX_S - age_s)
        return header(replace(view(), recording=told), TABS, 80)

    assert "REC 00:07:26  278 h left" in joined(seen(4.9)[0])
    assert len(seen(4.9)) == 2
    lines = seen(6.0)
    assert (" NOT RECORDING? silent 6 s ", "lost") in lines[0]
    assert joined(lines[2]).strip() == ("the recorder has not reported for 6 s: it may have stopped writing")
    assert lines[2][0][1] == "lost"
    hangs = recording(446, 1e6, 0, written_unix_s=UNIX_S - 75.0)
    lines = header(replace(view(), recording=hangs), TABS, 80)
    assert (" NOT RECORDING? silent 75 s ", "lost") in lines[0]
    assert " ".join(" ".join(map(joined, lines[2:])).split()) == (
        "the recorder hangs since 75 s: end it with `kill -9 4711` (what it wrote is kept), then begin another"
    )


def test_no_recording_and_a_short_disk_are_inverse():
    assert role_of(first(replace(view(), recording=None)), "NOT RECORDING") == "lost"
    short = first(replace(view(), recording=recording(751, 480.0, 0)))
    assert role_of(short, "8 min left") == "lost"


@pytest.mark.parametrize(
    ("mode", "age_s", "words"),
    [(0, 0.5, "FF off"), (1, 0.5, "FF shadow"), (2, 0.5, "FF ff"), (3, 0.5, "FF both"), (None, 0.5, "FF --")],
)
def test_the_feed_forward_mode_is_a_word(mode, age_s, words):
    assert joined(first(with_picture(ff_mode=mode, ff_mode_age_s=age_s))).endswith(words)


def test_an_old_feed_forward_mode_is_dated_and_then_gone():
    wide = first(with_picture(ff_mode=3, ff_mode_age_s=5.0), 160)
    assert role_of(wide, "FF both 5.0 s ago") == "stale"
    assert "FF --" in joined(first(with_picture(ff_mode=3, ff_mode_age_s=11.0), 160))


def test_the_off_switch_stays_until_it_is_acknowledged():
    asked = replace(view(), forcing=Forcing("vehicle 1: sent 4 times, no answer for 2.0 s", 4, False))
    assert (
        role_of(first(asked, 160), "FF shadow; OFF: vehicle 1: sent 4 times, no answer for 2.0 s") == "lost"
    )
    assert role_of(first(asked), "FF shadow; OFF not ") == "lost"
    done = replace(view(), forcing=Forcing("vehicle 1: off, as read back", 5, True))
    assert role_of(first(done, 160), "FF OFF, vehicle 1: off") == "strong"


@pytest.mark.parametrize(
    "forcing",
    [
        Forcing("vehicle 1: sent 14 times, no answer for 9.0 s", 14, False),
        Forcing("vehicle 1: off, as read back and as its telemetry says", 5, True),
    ],
)
@pytest.mark.parametrize("armed_age_s", [0.4, 4.0])
@pytest.mark.parametrize("armed", Armed)
def test_the_clock_of_the_recording_and_the_disk_stay_while_the_off_switch_is_told(
    armed, armed_age_s, forcing
):
    words = joined(first(replace(with_picture(armed=armed, armed_age_s=armed_age_s), forcing=forcing)))
    assert "REC 00:12:31  41 h left" in words
    assert ("FF OFF, " if forcing.done else "FF shadow; OFF not ") in words
    assert len(words) <= 80


@pytest.mark.parametrize(
    ("mode", "age_s", "is_now"),
    [(3, 0.4, "FF both"), (3, 5.0, "FF was both"), (3, 11.0, "FF --"), (None, math.inf, "FF --")],
)
def test_an_off_that_another_vehicle_has_not_acknowledged_hides_not_what_this_one_flies(mode, age_s, is_now):
    words = "vehicle 1: off, as read back; vehicle 2: sent 518 times, no answer for 300.0 s"
    forcing = Forcing(words, 518, False, (2,))
    shown = replace(with_picture(ff_mode=mode, ff_mode_age_s=age_s), forcing=forcing)
    assert f" {is_now}; OFF of 2 " in joined(first(shown, 80))
    assert f" {is_now}; OFF: {words} " in joined(first(shown, 200))
    assert "OFF not done" in joined(first(shown, 60))


@pytest.mark.parametrize("cells", [60, 80, 100])
@pytest.mark.parametrize("silent_s", [0.0, 8.0])
@pytest.mark.parametrize("lost", [False, True])
@pytest.mark.parametrize("armed_age_s", [0.4, 12.0])
@pytest.mark.parametrize("armed", Armed)
@pytest.mark.parametrize("sent", [0, 1, 14])
def test_an_off_that_is_not_done_says_so_at_every_width(sent, armed, armed_age_s, lost, silent_s, cells):
    link = replace(picture().links[0], age_s=8.0, lost=True) if lost else picture().links[0]
    seen = with_picture(armed=armed, armed_age_s=armed_age_s, links=(link,), ff_mode=3, ff_mode_age_s=8.0)
    told = recording(446, 1e6, 0, written_unix_s=UNIX_S - silent_s)
    forcing = Forcing("vehicle 1: sent 14 times, not heard for 8 s: not confirmed", sent, False, (1,))
    words = joined(first(replace(seen, recording=told, forcing=forcing), cells))
    unsent = "OFF not sent" in words
    assert unsent == (sent == 0 or silent_s > 0.0)
    assert unsent or "OFF not done" in words or "not confirmed" in words
    assert len(words) <= cells


def test_what_a_recorder_that_hangs_was_handed_is_told_as_not_sent():
    told = recording(446, 1e6, 0, written_unix_s=UNIX_S - 8.0)
    forcing = Forcing("vehicle 1: sent 9 times, not heard for 8 s: not confirmed", 9, False, (1,))
    shown = replace(with_picture(ff_mode=3, ff_mode_age_s=8.0), recording=told, forcing=forcing)
    assert "FF was both; OFF not sent" in joined(first(shown))
    assert " FF was both; OFF not sent, the recorder is silent " in joined(first(shown, 160))


def test_the_off_switch_that_is_done_is_never_told_by_the_words_of_one_that_is_not():
    never = replace(picture().links[0], age_s=math.inf, lost=True)
    done = Forcing("vehicle 1: off, as read back", 5, True)
    shown = replace(with_picture(armed=Armed.UNKNOWN, links=(never,)), forcing=done)
    assert joined(first(shown)).rstrip().endswith(("FF OFF, acknowledged", "FF OFF, done"))


@pytest.mark.parametrize("cells", [60, 80, 100, 160])
@pytest.mark.parametrize("armed", Armed)
@pytest.mark.parametrize(
    "forcing", [None, Forcing("vehicle 1: sent 14 times, no answer for 9.0 s", 14, False)]
)
def test_nothing_is_wider_than_the_terminal(cells, armed, forcing):
    shown = replace(with_picture(armed=armed, armed_age_s=4.0), forcing=forcing, trouble="x" * 200)
    for line in header(shown, TABS, cells):
        assert len(joined(line)) <= cells
    assert joined(header(shown, TABS, cells)[0]).startswith(" ")


def test_utc_stands_in_the_first_line_where_it_fits_and_else_in_the_second():
    assert joined(first(view(), 160)).endswith("08:52:31 UTC ")
    assert joined(header(view(), TABS, 80)[1]).endswith("08:52:31 UTC ")


@pytest.mark.parametrize(
    ("shown", "words"),
    [
        (with_picture(twins="two vehicles beat as system 1"), "two vehicles beat as system 1"),
        (replace(view(), recording=recording(0, 1e6, 12)), "12 frames are in no file of the dive"),
        (replace(view(), trouble="udpin: in use"), "udpin: in use"),
        (replace(view(), behind_s=5.0), "nothing is read from the link since 5 s"),
    ],
)
def test_what_must_not_be_overlooked_has_a_line_of_its_own(shown, words):
    lines = header(shown, TABS, 80)
    assert len(lines) == 3
    assert words in joined(lines[2])
    assert lines[2][0][1] == "lost"


def test_what_is_too_long_for_one_line_has_two_and_no_word_of_it_is_lost():
    words = "two vehicles beat as system 1, component 1: one of them stands on deck and answers to it; switch one off"
    lines = header(with_picture(twins=words), TABS, 80)
    assert len(lines) == 4
    assert " ".join(" ".join(map(joined, lines[2:])).split()) == words
    assert {len(joined(line)) for line in lines[2:]} == {80}
    assert {line[0][1] for line in lines[2:]} == {"lost"}


def test_a_click_finds_its_tab():
    assert [tab_at(TABS, x) and tab_at(TABS, x).title for x in (0, 8, 9, 17, 18)] == [
        "Watch", "Watch", "Dives", "Dives", None
    ]  # fmt: skip


def test_a_silent_engine_leaves_no_number_bright():
    old = aged(picture(), 5.0)
    assert old.armed_age_s == pytest.approx(5.4)
    assert all(link.lost for link in old.links)
    assert all(row.freshness.value != "fresh" for row in (*old.sensors, *old.thrusters, *old.traces.values()))
    older = aged(picture(), 11.0)
    assert all(
        row.freshness.value == "gone" for row in (*older.sensors, *older.thrusters, *older.traces.values())
    )


def test_a_picture_of_just_now_is_as_it_was():
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
