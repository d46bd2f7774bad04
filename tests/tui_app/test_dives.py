"""The screen Dives: its list, its keys, its lines, and which dive is meant."""

import asyncio
import math
from dataclasses import replace
from pathlib import Path

import pytest
from made_dives import DAMAGED, DECK, DIVES, HOVERING, FakeVerbs, desk, dive
from made_view import FixedViews, view
from pymavlink.dialects.v20 import ardupilotmega as dialect
from screen_text import Lacks, Sees, made, play, pressed, run, text
from textual import events
from textual.widgets import Input

from bridge.wire.framing import Encoder
from gcs_plugin.dives.conditions import Conditions
from gcs_plugin.dives.folder import DiveFolder
from tui.app.drawing import width
from tui.app.screens.dives import DivesScreen
from tui.app.screens.dives_lines import details, known_to, listed, row_under, table, usual, window
from tui.app.screens.overlays import AskScreen, FormScreen

NARROW = (80, 24)


async def shown(app, pilot):
    while app.desk.jobs.runs("dives"):
        await pilot.pause()
    app._show()
    await pilot.pause()


def on_dives(at, *steps, views=None, size=NARROW):
    """Open the screen, wait for its list, and play the steps."""

    async def work(app, pilot):
        await pressed(pilot, "2")
        await shown(app, pilot)
        await play(app, pilot, shown, *steps)

    run(made(views or FixedViews(), desk=at), size, work)


def marked(name):
    """Whether the mark stands at that dive."""
    return lambda app: name in next(line for line in text(app).splitlines() if line.startswith("▶"))


def shows(kind):
    return lambda app: isinstance(app.screen, kind)


def begins_a_line(head):
    return lambda app: any(line.startswith(head) for line in text(app).splitlines())


def test_the_mark_stands_at_the_dive_that_is_meant_and_moves_by_keys_and_clicks():
    def click(app):
        app.screen._go_to_line(2)

    keys = (marked("hovering"), "up", marked("deck"), "up", marked("deck"), "end", marked("survey"))
    on_dives(desk(), *keys, click, Sees("deck ───"))


def test_enter_chooses_the_dive_that_the_other_screens_show():
    chosen = Path(DIVES[0]["folder"])
    on_dives(desk(), "end", "enter", lambda app: app.desk.dive == chosen, Sees("▶◆"))


def test_the_list_is_read_again_whenever_the_screen_is_opened():
    verbs = FakeVerbs()
    on_dives(desk(verbs), "1", "2", "ctrl+r")
    assert verbs.words == [("dives", "dives", "--otherwise", "ruvifist:hovering")] * 3


def test_a_folder_that_can_t_be_listed_or_is_empty_says_so():
    why = "dives: no such folder; give the one that holds the dives"
    on_dives(desk(FakeVerbs({"dives": None}, 2, (why,))), Sees(why))
    on_dives(desk(FakeVerbs({"dives": []})), Sees("dives: holds no dive yet; a recording makes one"))


class Held(FakeVerbs):
    """Lists only once it is let go."""

    def __init__(self, results=None):
        super().__init__(results)
        self.go = asyncio.Event()

    async def __call__(self, words, hear):
        await self.go.wait()
        return await super().__call__(words, hear)


def let_go(app):
    app.desk.jobs._work.go.set()


def on_held_list(at, *steps):
    """Play the steps, and wait for the list once it is let go."""

    async def settle(app, pilot):
        if at.jobs._work.go.is_set():
            await shown(app, pilot)
        app._show()
        await pilot.pause()

    run(made(FixedViews(), desk=at), NARROW, lambda app, pilot: play(app, pilot, settle, *steps))


def dives_on_disk(tmp_path, verbs=FakeVerbs):
    """A desk whose list is of two folders that are there: the earlier one was made in salt water."""
    older, newer = tmp_path / "2026-11-20T0252Z-hovering", tmp_path / "2026-11-21T0452Z-deck"
    for folder in (older, newer):
        folder.mkdir()
    DiveFolder(older).set_conditions(Conditions(water_temperature_c=11.0, salinity=35.0))
    listed = [HOVERING | {"folder": str(older)}, DECK | {"folder": str(newer)}]
    return DiveFolder(newer), desk(verbs({"dives": listed}))


@pytest.mark.parametrize(
    ("key", "name", "screen"), [("n", "note", AskScreen), ("c", "conditions", FormScreen)]
)
def test_what_is_asked_for_while_the_list_is_read_opens_with_it_and_its_letters_begin_nothing(
    key, name, screen, tmp_path
):
    _, at = dives_on_disk(tmp_path, Held)
    opened = (let_go, shows(screen), lambda _: not at.jobs.runs("identify"))
    on_held_list(at, "2", key, *"tide", Sees(f"then {name}"), *opened)


def test_a_dive_stands_there_by_name_time_and_length_before_its_recording_is_read(tmp_path):
    folder, at = dives_on_disk(tmp_path, Held)
    at.out = tmp_path
    frame = Encoder(1, 1).encode(dialect.MAVLink_heartbeat_message(12, 0, 0, 0, 4, 3))
    stamps = (1_795_236_720_000_000, 1_795_236_832_000_000)
    records = b"".join(stamp.to_bytes(8, "big") + frame for stamp in stamps)
    (folder.path / "telemetry.tlog").write_bytes(records)
    unread = (Sees("2026-11-21 04:52 00:01:52 -- … … deck"), Lacks("▶"))
    details = ("down", Sees("is being read: what it could tell comes with that"))
    on_held_list(
        at, "2", *unread, *details, let_go, Sees("▶ 2026-11-21 04:52 00:00:41 1.2 % ······ ······ deck")
    )


def test_a_dive_that_is_not_begun_because_dives_was_left_is_told(tmp_path):
    _, at = dives_on_disk(tmp_path, Held)

    def told(app):
        (notice,) = app._notifications
        assert notice.message == "nothing was begun: Dives was left before it was read"

    on_held_list(at, "i", "1", told, let_go, lambda _: not at.jobs.runs("identify"))


def test_a_note_is_written_into_the_dive_and_offered_again_where_it_could_not_be(tmp_path):
    folder = tmp_path / "2026-11-21T0352Z-hovering"
    verbs = FakeVerbs({"dives": [HOVERING | {"folder": str(folder)}]})

    def make_folder(_):
        folder.mkdir()

    failed = ("n", shows(AskScreen), "!", "enter", Sees("can't be written"))
    kept = (make_folder, "n", "enter", Lacks("can't be written"))
    on_dives(desk(verbs), *failed, *kept, "n", "x", "escape", shows(DivesScreen))
    assert DiveFolder(folder).about().notes == "new propellers at the quay!"
    assert len(verbs.words) == 4  # read again each time, so that the list has the note


def lines_of_form(app):
    return [line.value for line in app.screen.query(Input)]


def test_conditions_are_asked_with_the_dive_befores_filled_in_and_kept(tmp_path):
    folder, at = dives_on_disk(tmp_path)
    asked = ("home", "c", shows(FormScreen), Sees("as in the dive before"))
    filled = (lambda app: lines_of_form(app)[:2] == ["11", "35"],)
    on_dives(at, *asked, *filled, "backspace", "backspace", *"9,5", "down", "down", *"40", "enter")
    assert folder.about().conditions == Conditions(9.5, 35.0, 40.0)


def test_what_is_typed_into_a_form_in_one_go_lands_in_the_lines_that_it_is_for(tmp_path):
    folder, at = dives_on_disk(tmp_path)

    async def work(app, pilot):
        await pressed(pilot, "2")
        await shown(app, pilot)
        await pressed(pilot, "home")
        first, second = (["backspace", "backspace", *typed] for typed in ("9.5", "34"))
        for key in ("c", *first, "down", *second, "tab", "7", "enter"):
            app.post_message(events.Key(key, key if len(key) == 1 else None))
        while folder.about().conditions == Conditions():
            await pilot.pause()

    run(made(FixedViews(), desk=at), NARROW, work)
    assert folder.about().conditions == Conditions(9.5, 34.0, 7.0)


def test_a_bad_number_is_told_at_its_line_and_all_that_was_typed_stays_until_it_is_mended(tmp_path):
    folder, at = dives_on_disk(tmp_path)
    why = "▲ '11x' is no number; give one such as 12.5, or leave it empty"

    def stays(app):
        lines = text(app).splitlines()
        line = next(n for n, row in enumerate(lines) if "water temperature" in row)
        assert why in lines[line + 1]
        assert app.screen.focused.name == "water_temperature_c"
        assert lines_of_form(app) == ["11x", "35", "40", "", "", "", "swell"]
        assert folder.about().conditions == Conditions()

    typed = ("home", "c", "x", "down", "down", *"40", *["down"] * 4, *"swell", Sees(why))
    beyond = (*"00", "enter", Sees("▲ must lie from -2 to 40, it is 1100; mend it"), "backspace", "backspace")
    on_dives(at, *typed, "enter", stays, "backspace", Lacks("no number"), *beyond, "enter")
    assert folder.about().conditions == Conditions(11.0, 35.0, 40.0, weather="swell")


def test_conditions_that_can_not_be_written_stay_in_the_form(tmp_path):
    folder, at = dives_on_disk(tmp_path)

    def take_folder(_):
        folder.path.rmdir()

    def give_folder(_):
        folder.path.mkdir()

    typed = ("home", "c", *["down"] * 6, *"calm", take_folder, "enter")
    on_dives(at, *typed, Sees("dive.yaml: can't be written"), Sees("calm"), give_folder, "enter")
    assert folder.about().conditions == Conditions(11.0, 35.0, weather="calm")


@pytest.mark.parametrize("key", ["n", "c"])
def test_what_lies_over_the_screen_hides_no_line_of_it_and_the_room_is_given_back(key, tmp_path):
    _, at = dives_on_disk(tmp_path)
    two_lines = (
        "two vehicles beat as system 1, component 1, and both would obey; stop one, or give one another id"
    )
    views = FixedViews(replace(view(), picture=replace(view().picture, twins=two_lines)))
    before = []
    visible = (Sees("give one another id"), begins_a_line("DIVES ───"), begins_a_line("▶"), Lacks("Widget"))
    given_back = ("escape", lambda app: text(app) == before[0])
    on_dives(at, lambda app: before.append(text(app)), key, *visible, *given_back, views=views)


DECK_DIVE, HOVERING_DIVE, DAMAGED_DIVE = listed(DIVES)


def said(lines):
    return ["".join(text for text, _ in line) for line in lines]


def details_of(data, recorded=False, **changes):
    """The details of a dive so changed, each run of blanks as one."""
    (one,) = listed([data | changes])
    return [" ".join(line.split()) for line in said(details(one, recorded, 80))]


def test_dives_are_listed_the_newest_first():
    assert [one.name for one in listed(DIVES)] == ["deck", "hovering", "survey"]
    assert listed(None) == ()


def test_the_newest_that_could_identify_anything_is_meant():
    assert usual(listed(DIVES), None) == HOVERING_DIVE.folder
    assert usual(listed([DECK, DAMAGED]), Path("other")) == Path("other")


def test_what_a_dive_could_tell_is_in_percent_or_no_or_unknown():
    told = [known_to(std) for std in (0.0068, 0.3, 0.31, math.inf, math.nan)]
    assert told == [
        ("0.7 %", "strong"),
        ("30.0 %", "strong"),
        ("no", "warn"),
        ("no", "warn"),
        ("--", "quiet"),
    ]


def test_a_row_has_length_loss_letters_and_what_was_made_of_it():
    lines = said(table(listed(DIVES), 1, HOVERING_DIVE.folder, DECK_DIVE.folder, 80, 10))
    assert " ".join(lines[1].split()) == "● 2026-11-21 04:52 00:00:41 1.2 % ······ ······ deck"
    assert lines[2].startswith("▶◆  2026-11-21 03:52  00:13:27   1.2 %  UVw··R UVWP·R  hovering")
    assert lines[2].endswith("identified")
    assert " ".join(lines[3].split()) == "2026-11-20 02:52 -- -- ------ ------ survey"


@pytest.mark.parametrize(
    ("cells", "name", "ending"),
    [
        (80, "hovering", " hovering    ident. diagn."),
        (80, "validation-shadow", " validation… ident. diagn."),
        (96, "validation-shadow", " validation-shadow   identified, diagnosed"),
        (90, "validation-shadow", " validation-shadow     ident. diagn."),
    ],
)
def test_what_was_made_of_a_dive_never_vanishes_for_its_name(cells, name, ending):
    dives = listed([dive(name, worked_on=["identified", "diagnosed"])])
    (row,) = said(table(dives, 0, None, None, cells, 2))[1:]
    assert row.endswith(ending)
    assert len(row) == cells


def test_much_loss_stands_out():
    (row,) = table(listed([dive("a", loss=0.06)]), 0, None, None, 80, 2)[1:]
    assert ("   6.0 %"[2:] + "  ", "warn") in row


@pytest.mark.parametrize("cells", [60, 80, 120])
def test_no_row_is_wider_than_its_room(cells):
    long = listed([dive("x" * 200)])
    assert all(width(line) <= cells for line in table(long, 0, None, None, cells, 5))


def test_the_row_at_the_mark_is_always_shown():
    many = listed([dive(f"d{n}", began_unix_s=1e9 - n) for n in range(30)])
    for at in range(30):
        lines = said(table(many, at, None, None, 80, 8))
        assert len(lines) == 8
        assert sum(line.startswith("▶") for line in lines) == 1
        y = next(n for n, line in enumerate(lines) if line.startswith("▶"))
        assert row_under(y, 30, at, 8) == at
    assert window(3, 2, 8) == 0
    assert row_under(0, 30, 0, 8) is None
    assert row_under(5, 3, 0, 8) is None


def test_the_details_tell_axes_notes_and_what_was_made_of_it():
    lines = details_of(HOVERING)
    assert lines[2] == "surge M_u 0.7 % D_u 0.7 % 806 s 46.0 N 0.80 m/s"
    assert lines[6] == "pitch I_q no D_q no 806 s 9.2 N m 9.2 deg/s"
    assert "noted: new propellers at the quay" in lines
    assert "noted at 2026-11-21T03:58:12Z tether caught on the ladder" in lines
    assert "identified by likelihood: converged" in lines


@pytest.mark.parametrize(
    ("data", "changes", "sentence"),
    [
        (HOVERING, {"excitation": None, "why_not": "no vehicle file is known"},
         "what it could identify is not known: no vehicle file is known"),
        (DECK, {"why_not": "no thrust"}, "nothing to identify: no thrust"),
        (HOVERING, {"stray": "telemetry.tlog: 9 bytes at its end belong to no message"},
         "telemetry.tlog: 9 bytes at its end belong to no message."),
        (HOVERING, {"restarts": "The vehicle restarted 1 time."}, "The vehicle restarted 1 time."),
        (HOVERING, {"damaged": "dives/a/dive.yaml: line 2: no YAML"}, "dives/a/dive.yaml: line 2: no YAML"),
        (HOVERING, {"unheard": "Nothing was heard for 58 s."}, "Nothing was heard for 58 s."),
        (HOVERING, {"lacking": "It lacks 7 frames."}, "It lacks 7 frames."),
    ],
)  # fmt: skip
def test_what_is_wrong_with_a_dive_or_not_known_of_it_is_told(data, changes, sentence):
    assert sentence in details_of(data, **changes)


def test_the_details_of_one_that_can_t_be_read_say_why_and_show_no_axes():
    lines = details_of(DAMAGED)
    assert lines[1].startswith(f"can't be read: {DAMAGED['error'][:40]}")
    assert not any("surge" in line for line in lines)


def test_a_dive_that_is_recorded_shows_what_it_holds_so_far_or_that_it_holds_nothing_yet():
    assert "is being recorded: this is what it holds so far" in details_of(DECK, recorded=True)
    lines = details_of(DECK, recorded=True, underway="is being recorded, nothing heard yet")
    assert "is being recorded, nothing heard yet" in lines
    assert not [line for line in lines if "so far" in line or "could tell" in line or "can't" in line]
