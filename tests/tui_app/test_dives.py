"""The screen Dives: its list, its keys, its lines, and which dive is meant."""

import asyncio
import math
from dataclasses import replace
from pathlib import Path

import pytest
from made_dives import DAMAGED, DECK, DIVES, HOVERING, FakeVerbs, desk, dive
from made_view import FixedViews, view
from pymavlink.dialects.v20 import ardupilotmega as dialect
from screen_text import made, pressed, run, text
from textual import events
from textual.widgets import Input

from bridge.wire.framing import Encoder
from gcs_plugin.dives.conditions import Conditions
from gcs_plugin.dives.folder import DiveFolder
from tui.app.drawing import width
from tui.app.screens.dives import DivesScreen
from tui.app.screens.dives_lines import details, known_to, length, listed, row_under, table, usual, window
from tui.app.screens.overlays import AskScreen, FormScreen
from tui.commands.dives import clock_text

SIZES = ((80, 24), (160, 50))
NARROW = SIZES[0]


async def opened(app, pilot):
    """Open the screen, until its list is there."""
    await pressed(pilot, "2")
    await shown(app, pilot)


async def shown(app, pilot):
    while app.desk.jobs.runs("dives"):
        await pilot.pause()
    app._show()
    await pilot.pause()


def test_the_mark_stands_at_the_dive_that_is_meant_and_moves_by_keys_and_clicks():
    async def work(app, pilot):
        await opened(app, pilot)
        for keys, name in (((), "hovering"), (("up",), "deck"), (("up",), "deck"), (("end",), "survey")):
            await pressed(pilot, *keys)
            assert name in next(line for line in text(app).splitlines() if line.startswith("▶"))
        await pilot.click("#dive-table", offset=(20, 2))
        await pilot.pause()
        assert "deck ───" in text(app)

    run(made(FixedViews(), desk=desk()), NARROW, work)


def test_enter_chooses_the_dive_that_the_other_screens_show():
    async def work(app, pilot):
        await opened(app, pilot)
        await pressed(pilot, "end", "enter")
        assert app.desk.dive == Path(DIVES[0]["folder"])
        assert "▶◆" in text(app)

    run(made(FixedViews(), desk=desk()), NARROW, work)


def test_the_list_is_read_again_whenever_the_screen_is_opened():
    verbs = FakeVerbs()

    async def work(app, pilot):
        await opened(app, pilot)
        await pressed(pilot, "1", "2")
        await shown(app, pilot)
        await pressed(pilot, "ctrl+r")
        await shown(app, pilot)

    run(made(FixedViews(), desk=desk(verbs)), NARROW, work)
    assert verbs.words == [("dives", "dives", "--otherwise", "ruvifist:hovering")] * 3


def test_a_folder_that_can_t_be_listed_says_why():
    verbs = FakeVerbs({"dives": None}, 2, ("dives: no such folder; give the one that holds the dives",))

    async def work(app, pilot):
        await opened(app, pilot)
        assert "dives: no such folder; give the one that holds the dives" in text(app)

    run(made(FixedViews(), desk=desk(verbs)), NARROW, work)


def test_an_empty_folder_says_so():
    async def work(app, pilot):
        await opened(app, pilot)
        assert "dives: holds no dive yet; a recording makes one" in text(app)

    run(made(FixedViews(), desk=desk(FakeVerbs({"dives": []}))), NARROW, work)


class Held(FakeVerbs):
    """Lists only once it is let go."""

    go = None

    async def __call__(self, words, hear):
        Held.go = asyncio.Event()
        await Held.go.wait()
        return await super().__call__(words, hear)


@pytest.mark.parametrize(("key", "screen"), [("n", AskScreen), ("c", FormScreen)])
def test_what_is_asked_for_while_the_list_is_read_opens_with_it_and_its_letters_begin_nothing(
    key, screen, tmp_path
):
    _, at = dives_on_disk(tmp_path, Held)

    async def work(app, pilot):
        await pressed(pilot, "2", key, *"tide")
        app._show()
        await pilot.pause()
        assert "then note" in text(app) or "then conditions" in text(app)
        Held.go.set()
        await shown(app, pilot)
        await shown(app, pilot)
        assert isinstance(app.screen, screen)
        assert not at.jobs.runs("identify")

    run(made(FixedViews(), desk=at), NARROW, work)


def test_a_dive_stands_there_by_name_time_and_length_before_its_recording_is_read(tmp_path):
    folder, at = dives_on_disk(tmp_path, Held)
    at.out = tmp_path
    frame = Encoder(1, 1).encode(dialect.MAVLink_heartbeat_message(12, 0, 0, 0, 4, 3))
    stamps = (1_795_236_720_000_000, 1_795_236_832_000_000)
    records = b"".join(stamp.to_bytes(8, "big") + frame for stamp in stamps)
    (folder.path / "telemetry.tlog").write_bytes(records)

    def row(app):
        return next(line for line in text(app).splitlines() if "deck" in line)

    async def work(app, pilot):
        await pressed(pilot, "2")
        assert row(app).split() == ["2026-11-21", "04:52", "00:01:52", "--", "…", "…", "deck"]
        assert "▶" not in text(app)
        await pressed(pilot, "down")
        assert "is being read: what it could tell comes with that" in text(app)
        Held.go.set()
        await shown(app, pilot)
        assert row(app).split() == [
            "▶",
            "2026-11-21",
            "04:52",
            "00:00:41",
            "1.2",
            "%",
            "······",
            "······",
            "deck",
        ]

    run(made(FixedViews(), desk=at), NARROW, work)


def test_a_key_on_a_list_without_a_dive_begins_nothing():
    async def work(app, pilot):
        await pressed(pilot, "2", "d")
        Held.go.set()
        await shown(app, pilot)
        assert "holds no dive yet" in text(app)

    run(made(FixedViews(), desk=desk(Held({"dives": []}))), NARROW, work)


def test_a_dive_that_is_not_begun_because_dives_was_left_is_told(tmp_path):
    _, at = dives_on_disk(tmp_path, Held)

    async def work(app, pilot):
        await pressed(pilot, "i", "1")
        assert [one.message for one in app._notifications] == [
            "nothing was begun: Dives was left before it was read"
        ]
        Held.go.set()
        await shown(app, pilot)
        assert not at.jobs.runs("identify")

    run(made(FixedViews(), desk=at), NARROW, work)


def test_a_note_is_written_into_the_dive(tmp_path):
    folder = tmp_path / "2026-11-21T0352Z-hovering"
    folder.mkdir()
    verbs = FakeVerbs({"dives": [HOVERING | {"folder": str(folder)}]})

    async def work(app, pilot):
        await opened(app, pilot)
        await pressed(pilot, "n")
        assert isinstance(app.screen, AskScreen)
        await pressed(pilot, "!", "enter")
        await shown(app, pilot)
        await pressed(pilot, "n", "x", "escape")
        assert isinstance(app.screen, DivesScreen)

    run(made(FixedViews(), desk=desk(verbs)), NARROW, work)
    assert DiveFolder(folder).about().notes == "new propellers at the quay!"
    assert len(verbs.words) == 3  # read again each time, so that the list has the note


def test_a_note_that_could_not_be_written_is_offered_again_as_it_was_typed(tmp_path):
    folder = tmp_path / "2026-11-21T0352Z-hovering"
    verbs = FakeVerbs({"dives": [HOVERING | {"folder": str(folder)}]})

    async def work(app, pilot):
        await opened(app, pilot)
        await pressed(pilot, "n", "!", "enter")
        await shown(app, pilot)
        assert "can't be written" in text(app)
        folder.mkdir()
        await pressed(pilot, "n", "enter")
        await shown(app, pilot)
        assert "can't be written" not in text(app)

    run(made(FixedViews(), desk=desk(verbs)), NARROW, work)
    assert DiveFolder(folder).about().notes == "new propellers at the quay!"


def dives_on_disk(tmp_path, verbs=FakeVerbs):
    """A desk whose list is of two folders that are there: the earlier one was made in salt water."""
    older, newer = tmp_path / "2026-11-20T0252Z-hovering", tmp_path / "2026-11-21T0452Z-deck"
    for folder in (older, newer):
        folder.mkdir()
    DiveFolder(older).set_conditions(Conditions(water_temperature_c=11.0, salinity=35.0))
    listed = [HOVERING | {"folder": str(older)}, DECK | {"folder": str(newer)}]
    return DiveFolder(newer), desk(verbs({"dives": listed}))


def test_conditions_are_asked_with_the_dive_befores_filled_in_and_kept(tmp_path):
    folder, at = dives_on_disk(tmp_path)

    async def work(app, pilot):
        await opened(app, pilot)
        await pressed(pilot, "home")
        await pressed(pilot, "c")
        assert isinstance(app.screen, FormScreen)
        assert "as in the dive before" in text(app)
        assert [line.value for line in app.screen.query(Input)][:2] == ["11", "35"]
        await pressed(pilot, "backspace", "backspace", *"9,5", "down", "down", *"40", "enter")
        await shown(app, pilot)

    run(made(FixedViews(), desk=at), NARROW, work)
    assert folder.about().conditions == Conditions(9.5, 35.0, 40.0)


@pytest.mark.parametrize("next_line", ["down", "tab"])
def test_what_is_typed_into_a_form_in_one_go_lands_in_the_lines_that_it_is_for(next_line, tmp_path):
    folder, at = dives_on_disk(tmp_path)

    async def work(app, pilot):
        await opened(app, pilot)
        await pressed(pilot, "home")
        first, second = (["backspace", "backspace", *typed] for typed in ("9.5", "34"))
        for key in ("c", *first, next_line, *second, next_line, "7", "enter"):
            app.post_message(events.Key(key, key if len(key) == 1 else None))
        while folder.about().conditions == Conditions():
            await pilot.pause()

    run(made(FixedViews(), desk=at), NARROW, work)
    assert folder.about().conditions == Conditions(9.5, 34.0, 7.0)


def test_a_bad_number_is_told_at_its_line_and_all_that_was_typed_stays_until_it_is_mended(tmp_path):
    folder, at = dives_on_disk(tmp_path)

    async def work(app, pilot):
        await opened(app, pilot)
        await pressed(pilot, "home", "c", "x", "down", "down", *"40", *["down"] * 4, *"swell")
        lines = text(app).splitlines()
        line = next(n for n, row in enumerate(lines) if "water temperature" in row)
        assert "▲ '11x' is no number; give one such as 12.5, or leave it empty" in lines[line + 1]
        await pressed(pilot, "enter")
        assert isinstance(app.screen, FormScreen)
        assert app.screen.focused.name == "water_temperature_c"
        assert [one.value for one in app.screen.query(Input)] == ["11x", "35", "40", "", "", "", "swell"]
        assert folder.about().conditions == Conditions()
        await pressed(pilot, "backspace")
        assert "no number" not in text(app)
        await pressed(pilot, "enter")
        await shown(app, pilot)

    run(made(FixedViews(), desk=at), NARROW, work)
    assert folder.about().conditions == Conditions(11.0, 35.0, 40.0, weather="swell")


def test_conditions_that_can_not_be_are_named_and_escape_changes_nothing(tmp_path):
    folder, at = dives_on_disk(tmp_path)

    async def work(app, pilot):
        await opened(app, pilot)
        await pressed(pilot, "home", "c", *"00", "enter")
        assert "▲ must lie from -2 to 40, it is 1100; mend it" in text(app)
        await pressed(pilot, "escape")
        assert isinstance(app.screen, DivesScreen)

    run(made(FixedViews(), desk=at), NARROW, work)
    assert folder.about().conditions == Conditions()


def test_conditions_that_can_not_be_written_stay_in_the_form(tmp_path):
    folder, at = dives_on_disk(tmp_path)

    async def work(app, pilot):
        await opened(app, pilot)
        await pressed(pilot, "home", "c", *["down"] * 6, *"calm")
        folder.path.rmdir()
        await pressed(pilot, "enter")
        assert "dive.yaml: can't be written" in " ".join(text(app).split())
        assert "calm" in text(app)
        folder.path.mkdir()
        await pressed(pilot, "enter")
        await shown(app, pilot)

    run(made(FixedViews(), desk=at), NARROW, work)
    assert folder.about().conditions == Conditions(11.0, 35.0, weather="calm")


@pytest.mark.parametrize("key", ["n", "c"])
def test_what_lies_over_the_screen_hides_none_of_it_and_the_room_is_given_back(key, tmp_path):
    _, at = dives_on_disk(tmp_path)

    async def work(app, pilot):
        await opened(app, pilot)
        before = text(app).splitlines()
        await pressed(pilot, key)
        await shown(app, pilot)
        assert all(
            any(line.startswith(head) for line in text(app).splitlines()) for head in ("DIVES ───", "▶")
        )
        assert "deck" in text(app)
        assert "Widget" not in text(app)
        await pressed(pilot, "escape")
        await shown(app, pilot)
        assert text(app).splitlines() == before

    run(made(FixedViews(), desk=at), NARROW, work)


@pytest.mark.parametrize("key", ["n", "c"])
def test_what_lies_over_the_screen_hides_no_line_of_a_banner(key, tmp_path):
    _, at = dives_on_disk(tmp_path)
    two_lines = (
        "two vehicles beat as system 1, component 1, and both would obey; stop one, or give one another id"
    )
    views = FixedViews(replace(view(), picture=replace(view().picture, twins=two_lines)))

    async def work(app, pilot):
        await opened(app, pilot)
        await pressed(pilot, key)
        await shown(app, pilot)
        assert "give one another id" in text(app)
        assert any(line.startswith("DIVES ───") for line in text(app).splitlines())

    run(made(views, desk=at), NARROW, work)


def test_keys_that_have_no_room_are_counted_beside_the_help_and_none_is_cut():
    async def work(app, pilot):
        await opened(app, pilot)
        assert text(app).splitlines()[-1].endswith("^x FF off  ? Help, 3 more")
        await pilot.resize_terminal(120, 24)
        await pilot.pause()
        assert text(app).splitlines()[-1].endswith("? Help  ^p Palette  t Theme  ^q Quit")

    run(made(FixedViews(), desk=desk()), NARROW, work)


DECK_DIVE, HOVERING_DIVE, DAMAGED_DIVE = listed(DIVES)


def said(lines):
    return ["".join(text for text, _ in line) for line in lines]


def test_dives_are_listed_the_newest_first():
    assert [one.name for one in listed(DIVES)] == ["deck", "hovering", "survey"]
    assert listed(None) == ()


def test_the_newest_that_could_identify_anything_is_meant():
    assert usual(listed(DIVES), None) == HOVERING_DIVE.folder
    assert usual(listed([DECK, DAMAGED]), Path("other")) == Path("other")


def test_what_a_dive_could_tell_is_in_percent_or_no_or_unknown():
    assert known_to(0.0068) == ("0.7 %", "strong")
    assert known_to(0.3) == ("30.0 %", "strong")
    assert known_to(0.31) == ("no", "warn")
    assert known_to(math.inf) == ("no", "warn")
    assert known_to(math.nan) == ("--", "quiet")


def test_a_row_has_length_loss_letters_and_what_was_made_of_it():
    lines = said(table(listed(DIVES), 1, HOVERING_DIVE.folder, DECK_DIVE.folder, 80, 10))
    assert lines[1].split() == [
        "●",
        "2026-11-21",
        "04:52",
        "00:00:41",
        "1.2",
        "%",
        "······",
        "······",
        "deck",
    ]
    assert lines[2].startswith("▶◆  2026-11-21 03:52  00:13:27   1.2 %  UVw··R UVWP·R  hovering")
    assert lines[2].endswith("identified")
    assert lines[3].split() == ["2026-11-20", "02:52", "--", "--", "------", "------", "survey"]


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
    (row,) = said(
        table(listed([dive(name, worked_on=["identified", "diagnosed"])]), 0, None, None, cells, 2)
    )[1:]
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
    lines = said(details(HOVERING_DIVE, False, 80))
    assert lines[2].split() == [
        "surge",
        "M_u",
        "0.7",
        "%",
        "D_u",
        "0.7",
        "%",
        "806",
        "s",
        "46.0",
        "N",
        "0.80",
        "m/s",
    ]
    assert lines[6].split() == [
        "pitch",
        "I_q",
        "no",
        "D_q",
        "no",
        "806",
        "s",
        "9.2",
        "N",
        "m",
        "9.2",
        "deg/s",
    ]
    assert "noted: new propellers at the quay" in lines
    assert "noted at 2026-11-21T03:58:12Z tether caught on the ladder" in lines
    assert "identified by likelihood: converged" in lines


def test_the_details_of_one_that_can_t_be_read_say_why_and_show_no_axes():
    lines = said(details(DAMAGED_DIVE, False, 80))
    assert lines[1].startswith(f"can't be read: {DAMAGED['error'][:40]}")
    assert not any("surge" in line for line in lines)


def test_what_could_not_be_judged_says_why():
    unknown = listed([HOVERING | {"excitation": None, "why_not": "no vehicle file is known"}])[0]
    assert "what it could identify is not known: no vehicle file is known" in said(
        details(unknown, False, 80)
    )
    still = listed([DECK | {"why_not": "no thrust"}])[0]
    assert "nothing to identify: no thrust" in said(details(still, False, 80))
    assert "is being recorded: this is what it holds so far" in said(details(still, True, 80))


def test_bytes_that_belong_to_no_message_are_told():
    (spoilt,) = listed([HOVERING | {"stray": "telemetry.tlog: 9 bytes at its end belong to no message"}])
    assert "telemetry.tlog: 9 bytes at its end belong to no message." in said(details(spoilt, False, 80))


def test_a_restart_and_the_run_that_is_used_are_told():
    (restarted,) = listed([HOVERING | {"restarts": "The vehicle restarted 1 time; of 2 runs one is used."}])
    assert "The vehicle restarted 1 time; of 2 runs one is used." in said(details(restarted, False, 80))


def test_a_damaged_dive_yaml_is_told_beside_what_the_dive_could_tell():
    (damaged,) = listed([HOVERING | {"damaged": "dives/a/dive.yaml: line 2: no YAML"}])
    lines = said(details(damaged, False, 80))
    assert "dives/a/dive.yaml: line 2: no YAML" in lines
    assert not any("not known" in line or "nothing to identify" in line for line in lines)


@pytest.mark.parametrize("seconds", [111.4, 111.5, 112.49, 0.4, 3599.6])
def test_a_dive_is_as_long_as_the_verb_says(seconds):
    assert length(seconds).lstrip("0:") == clock_text(seconds).lstrip("0:")


def test_what_was_not_heard_is_told():
    note = "Nothing was heard of the vehicle for 58 s at a stretch, from 0:10 on: `seatrial fetch` brings it."
    (one,) = listed([{**HOVERING, "unheard": note}])
    assert note in " ".join(" ".join(said(details(one, False, 80))).split())


def test_a_dive_that_is_recorded_and_holds_nothing_yet_shows_that_alone():
    (one,) = listed([{**DECK, "underway": "is being recorded, nothing heard yet"}])
    lines = said(details(one, True, 80))
    assert "is being recorded, nothing heard yet" in lines
    assert not [line for line in lines if "so far" in line or "could tell" in line or "can't" in line]
