"""The screen Dives: its list, its keys, its lines, and which dive is meant."""

import math
import shutil
import threading
from dataclasses import replace
from pathlib import Path

import pytest
from fake_verbs import FakeVerbs, desk, let_go
from made_dives import BEGAN_UNIX_S, DAMAGED, DECK, DIVES, HOVERING, dive, record
from made_view import FixedViews, StillReplay, view
from screen_text import Lacks, Sees, made, plain, play, played, run, shows, text, worked
from textual import events
from textual.widgets import Input

from gcs_plugin.dives.conditions import Conditions
from gcs_plugin.dives.folder import DiveFolder
from tui.app.drawing import entry_at, width
from tui.app.screens.dives import DivesScreen
from tui.app.screens.dives_lines import details, known_to, listed, table, usual
from tui.app.screens.overlays import FormScreen, HelpScreen
from tui.app.screens.parameters import ParametersScreen
from tui.app.screens.watch import WatchScreen
from tui.dive_list import Glance


def marked(name):
    """Whether the mark stands at that dive."""
    return lambda app: name in next(line for line in text(app).splitlines() if line.startswith("▶"))


def begins_a_line(head):
    return lambda app: any(line.startswith(head) for line in text(app).splitlines())


def test_the_mark_stands_at_the_dive_that_is_meant_and_moves_by_keys_and_clicks():
    def click(app):
        app.screen._go_to_line(2)

    keys = (marked("hovering"), "up", marked("deck"), "up", marked("deck"), "end", marked("survey"))
    played(desk(), "2", *keys, click, Sees("deck ───"))


def test_home_marks_the_newest_dive_flown_wherever_the_mark_stands_and_pressed_again_the_newest():
    again = ("home", marked("deck"), "home", marked("hovering"))
    played(
        desk(), "2", marked("hovering"), "home", marked("hovering"), *again, "end", "home", marked("hovering")
    )


def test_enter_chooses_the_dive_that_the_other_screens_show_and_each_opening_reads_the_list_again():
    verbs = FakeVerbs()
    chosen = ("end", "enter", lambda app: app.desk.dive == Path(DIVES[0]["folder"]), Sees("▶◆"))
    played(desk(verbs), "2", *chosen, "1", "2", "ctrl+r")
    assert verbs.words == [("dives", "dives", "--otherwise", "ruvifist:hovering")] * 3


def test_a_folder_that_can_t_be_listed_or_is_empty_says_so(tmp_path):
    why = "dives: is a file; give the folder that holds the dives"
    played(desk(FakeVerbs({"dives": None}, 2, [why]), out=tmp_path), "2", Sees(why))
    nothing = Sees("no dive in dives yet; a recording makes one")
    played(desk(FakeVerbs({"dives": None}, 2, ["no such folder"])), "2", nothing)
    played(desk(FakeVerbs({"dives": []})), "2", nothing)


def test_without_a_dive_no_key_is_offered_that_would_work_on_one(tmp_path):
    offered = [Lacks(words) for words in ("i Identify", "d Diagnose", "v Validate", "r Replay", "u Upload")]
    at = desk(FakeVerbs({"dives": []}), out=tmp_path)
    played(at, *(step for key in "23456" for step in (key, *offered)))
    played(desk(), "2", Sees("i Identify"), Sees("r Replay"))


def test_what_the_folder_lacked_is_said_no_more_once_it_is_read_again(tmp_path):
    verbs = FakeVerbs({"dives": None}, 2, ["no such folder"])
    folder = tmp_path / "dives"

    def dive_begins(_):
        (folder / "2026-11-21T0452Z-deck").mkdir(parents=True)
        (folder / "2026-11-21T0452Z-deck" / "telemetry.tlog").touch()
        verbs.held = ("dives",)

    now_there = (dive_begins, "2", Lacks("no such folder"), Sees("2026-11-21 04:52 -- -- … … deck"))
    played(desk(verbs, out=folder), "2", "1", *now_there)


@pytest.fixture
def dives_on_disk(tmp_path):
    """The newer of two folders that are there, and a desk whose list is of them; the older was made in salt water."""
    older, newer = tmp_path / "2026-11-20T0252Z-hovering", tmp_path / "2026-11-21T0452Z-deck"
    for folder in (older, newer):
        folder.mkdir()
    DiveFolder(older).set_conditions(Conditions(water_temperature_c=11.0, salinity=35.0))
    listed = [HOVERING | {"folder": str(older)}, DECK | {"folder": str(newer)}]

    def made(**how):
        return DiveFolder(newer), desk(FakeVerbs({"dives": listed}, **how))

    return made


@pytest.fixture
def one_more_read(tmp_path):
    """A desk, and a step after which a dive has been made that is still being read: `hovering`, then `both`."""
    folders = [tmp_path / "2026-11-20T0252Z-hovering", tmp_path / "2026-11-21T0452Z-both"]
    folders[0].mkdir()
    listed = [HOVERING | {"folder": str(folders[0])}]
    verbs = FakeVerbs({"dives": listed})

    def dive_ends(_):
        folders[1].mkdir()
        (folders[1] / "telemetry.tlog").touch()
        listed.append(dive("both") | {"folder": str(folders[1])})
        verbs.held = ("dives", "validate")

    return desk(verbs, out=tmp_path), dive_ends


def test_home_waits_for_dives_that_are_being_read_so_that_the_next_key_works_on_the_newest(one_more_read):
    at, dive_ends = one_more_read
    quick = (dive_ends, "2", marked("hovering"), "home", Lacks("▶"), "v", Sees("then validate"))
    played(at, "2", "1", *quick, let_go, lambda app: app.desk.dive.name.endswith("-both"))
    assert [words[0] for words in at.jobs._work.words].count("validate") == 1


def test_home_again_while_dives_are_being_read_marks_the_newest_of_all_and_a_key_that_moves_keeps_the_mark(
    one_more_read,
):
    at, dive_ends = one_more_read
    played(at, "2", "1", dive_ends, "2", "home", "home", marked("both"), "end", marked("hovering"), let_go,
           marked("hovering"))  # fmt: skip


def test_home_while_dives_are_being_read_marks_the_newest_flown_once_they_are(one_more_read):
    at, dive_ends = one_more_read
    played(at, "2", "1", dive_ends, "2", "home", Lacks("▶"), let_go, marked("both"), "home", marked("both"))


def test_what_was_asked_for_before_the_dives_are_read_is_known_to_every_screen_until_it_begins(one_more_read):
    at, dive_ends = one_more_read
    waits = (lambda app: app.desk.then == "identify", let_go, lambda app: app.desk.then == "")
    played(at, dive_ends, "2", "i", *waits)


@pytest.mark.parametrize(("key", "name"), [("n", "note"), ("c", "conditions")])
def test_what_is_asked_for_while_the_list_is_read_opens_with_it_and_its_letters_begin_nothing(
    key, name, dives_on_disk
):
    _, at = dives_on_disk(held=("dives",))
    opened = (let_go, shows(FormScreen), lambda _: not at.jobs.runs("identify"))
    played(at, "2", key, *"tide", Sees(f"then {name}"), *opened)


def test_a_dive_stands_there_by_name_time_and_length_before_its_recording_is_read(tmp_path, dives_on_disk):
    folder, at = dives_on_disk(held=("dives",))
    at.out = tmp_path
    log = folder.path / "telemetry.tlog"
    stamps = (BEGAN_UNIX_S, BEGAN_UNIX_S + 112.0, BEGAN_UNIX_S + 120.0)
    record(log, *stamps[:2])
    longer = (lambda _: record(log, *stamps), "1", "2", Sees("2026-11-21 04:52 00:02:00 -- … … deck"))
    unread = (Sees("2026-11-21 04:52 00:01:52 -- … … deck"), Lacks("▶"), *longer)
    details = ("down", Sees("is being read: what it could tell comes with that"))
    played(at, "2", *unread, *details, let_go, Sees("▶ 2026-11-21 04:52 00:00:41 1.2 % ······ ······ deck"))


def test_what_an_earlier_look_has_shown_of_a_dive_stands_there_while_others_are_read(
    tmp_path, dives_on_disk, monkeypatch
):
    folder, at = dives_on_disk(held=("dives",))
    at.out = tmp_path
    for name in ("2026-11-20T0252Z-hovering", folder.path.name):
        (tmp_path / name / "telemetry.tlog").touch()
    looked = Glance(1_795_142_000.0, 112.0, 0.01, {"M_u": 0.01, "D_v": 0.2})
    kept = {"2026-11-20T0252Z-hovering": looked}
    monkeypatch.setattr("tui.app.screens.dives_lines.kept_glance", lambda dive: kept.get(dive.name))
    played(at, "2", Sees("00:01:52 1.0 % U····· ·v···· hovering"), Sees("-- … … deck"))


@pytest.mark.parametrize(
    ("left", "at", "notices"),
    [
        ((), WatchScreen, []),
        (
            ("5",),
            ParametersScreen,
            [f"{Path(HOVERING['folder']).name} is not replayed: Dives was left before it was read"],
        ),
    ],
)
def test_a_dive_that_is_read_for_a_replay_takes_nobody_away_from_another_screen(
    left, at, notices, monkeypatch
):
    ready = threading.Event()

    def read(*_):
        ready.wait(60.0)
        return StillReplay()

    monkeypatch.setattr("tui.app.screens.dives.open_replay", read)
    is_read = (lambda _: ready.set(), worked, shows(at))
    replays = (lambda app: (app.desk.replay is None) is bool(left),)
    assert played(desk(), "2", marked("hovering"), "r", *left, *is_read, *replays) == notices


def test_a_dive_that_is_not_begun_because_dives_was_left_is_told(dives_on_disk):
    _, at = dives_on_disk(held=("dives",))
    notices = played(at, "2", "i", "1", let_go, lambda _: not at.jobs.runs("identify"))
    assert notices == ["nothing was begun: Dives was left before it was read"]


def test_what_waits_for_the_list_goes_on_after_a_question_was_asked_over_it(dives_on_disk):
    _, at = dives_on_disk(held=("dives",))
    covered = ("question_mark", shows(HelpScreen), "escape", Sees("then identify"))
    notices = played(at, "2", "i", *covered, let_go, lambda _: at.jobs.state("identify") is not None)
    assert not any("nothing was begun" in notice for notice in notices)


def test_a_dive_that_any_program_writes_is_marked_not_meant_and_read_again_once_it_is_over(
    tmp_path, dives_on_disk
):
    folder, _ = dives_on_disk()
    older = tmp_path / "2026-11-20T0252Z-hovering"
    rows = [HOVERING | {"folder": str(older)}, dive("deck") | {"folder": str(folder.path)}]
    at = desk(FakeVerbs({"dives": rows}), out=tmp_path)
    DiveFolder(older).open_telemetry(1).close()
    written = folder.open_telemetry(1)
    assert (at.chosen(), at.written()) == (older, {folder.path.resolve()})
    reads = []

    def ends(app):
        reads.append(len(app.desk.jobs._work.words))
        written.close()

    marks = ("2", Sees("● 2026-11-21 04:52"), marked("hovering"), ends, Lacks("● 2026-11-21 04:52"))
    played(at, *marks, lambda app: len(app.desk.jobs._work.words) == reads[0] + 1)
    assert at.chosen() == folder.path


def test_the_mark_moves_to_the_last_of_the_dives_that_ended_while_another_screen_was_looked_at(
    tmp_path, dives_on_disk
):
    newer, _ = dives_on_disk()
    older = DiveFolder(tmp_path / "2026-11-20T0252Z-hovering")
    rows = [HOVERING | {"folder": str(older.path)}, dive("deck") | {"folder": str(newer.path)}]
    written = older.open_telemetry(1)

    def both_end(_):
        written.close()
        newer.open_telemetry(1).close()

    marks = ("2", Sees("● 2026-11-21 03:52"), "end", marked("hovering"), "1", both_end, "2", marked("deck"))
    played(desk(FakeVerbs({"dives": rows}), out=tmp_path), *marks)


def test_a_note_is_written_into_the_dive_and_stays_in_its_line_where_it_could_not_be(tmp_path):
    folder = tmp_path / "2026-11-21T0352Z-hovering"
    folder.mkdir()
    DiveFolder(folder).note("new propellers\nat the quay")
    verbs = FakeVerbs({"dives": [HOVERING | {"folder": str(folder)}]})

    def take_folder(_):
        shutil.rmtree(folder)

    def make_folder(_):
        folder.mkdir()

    failed = ("2", "n", shows(FormScreen), take_folder, "!", "enter", Sees("can't be written"))
    kept = (make_folder, "enter", shows(DivesScreen))
    played(desk(verbs), *failed, *kept, "n", "x", "escape", shows(DivesScreen))
    assert DiveFolder(folder).about().notes == "new propellers at the quay!"
    assert len(verbs.words) == 3  # read again each time, so that the list has the note


def test_a_note_that_another_program_wrote_since_the_list_was_read_is_the_one_that_is_changed(tmp_path):
    folder = tmp_path / "2026-11-21T0352Z-hovering"
    folder.mkdir()
    verbs = FakeVerbs({"dives": [HOVERING | {"folder": str(folder), "notes": "calm"}]})

    def noted(_):
        DiveFolder(folder).note("calm; a line in the propeller")

    played(
        desk(verbs), "2", Sees("noted: calm"), noted, "n", shows(FormScreen), "!", "enter", shows(DivesScreen)
    )
    assert DiveFolder(folder).about().notes == "calm; a line in the propeller!"


def lines_of_form(app):
    return [line.value for line in app.screen.query(Input)]


def test_conditions_are_asked_with_the_dive_befores_filled_in_and_kept(dives_on_disk):
    folder, at = dives_on_disk()
    asked = ("2", "home", "home", "c", shows(FormScreen), Sees("as in the dive before"))
    filled = (lambda app: lines_of_form(app)[:2] == ["11", "35"],)
    played(at, *asked, *filled, "backspace", "backspace", *"9,5", "down", "down", *"40", "enter")
    assert folder.about().conditions == Conditions(9.5, 35.0, 40.0)


def test_what_is_typed_into_a_form_in_one_go_lands_in_the_lines_that_it_is_for(dives_on_disk):
    folder, at = dives_on_disk()

    async def work(app, pilot):
        await play(app, pilot, "2", "home", "home")
        first, second = (["backspace", "backspace", *typed] for typed in ("9.5", "34"))
        for key in ("c", *first, "down", *second, "tab", "7", "enter"):
            app.post_message(events.Key(key, key if len(key) == 1 else None))
        while folder.about().conditions == Conditions():
            await pilot.pause()

    run(made(FixedViews(), desk=at), (80, 24), work)
    assert folder.about().conditions == Conditions(9.5, 34.0, 7.0)


def test_a_bad_number_is_told_at_its_line_and_all_that_was_typed_stays_until_it_is_mended(dives_on_disk):
    folder, at = dives_on_disk()
    why = "▲ '11x' is no number; give one such as 12.5, or leave it empty"

    def stays(app):
        lines = text(app).splitlines()
        line = next(n for n, row in enumerate(lines) if "water temperature" in row)
        assert why in lines[line + 1]
        assert app.screen.focused.name == "water_temperature_c"
        assert lines_of_form(app) == ["11x", "35", "40", "", "", "", "swell"]
        assert folder.about().conditions == Conditions()

    typed = ("2", "home", "home", "c", "x", "down", "down", *"40", *["down"] * 4, *"swell", Sees(why))
    warm = Sees("▲ must lie from -2 to 40 °C, it is 1100; mend it")
    beyond = (*"00", "enter", warm, "backspace", "backspace")
    played(at, *typed, "enter", stays, "backspace", Lacks("no number"), *beyond, "enter")
    assert folder.about().conditions == Conditions(11.0, 35.0, 40.0, weather="swell")


def test_conditions_that_can_not_be_written_stay_in_the_form(dives_on_disk):
    folder, at = dives_on_disk()

    def take_folder(_):
        folder.path.rmdir()

    def give_folder(_):
        folder.path.mkdir()

    typed = ("2", "home", "home", "c", *["down"] * 6, *"calm", take_folder, "enter")
    played(at, *typed, Sees("dive.yaml: can't be written"), Sees("calm"), give_folder, "enter")
    assert folder.about().conditions == Conditions(11.0, 35.0, weather="calm")


def test_what_lies_over_the_screen_hides_no_line_of_it_and_the_room_is_given_back(dives_on_disk):
    _, at = dives_on_disk()
    two_lines = (
        "two vehicles beat as system 1, component 1, and both would obey; stop one, or give one another id"
    )
    views = FixedViews(replace(view(), picture=replace(view().picture, twins=two_lines)))
    before = []
    visible = (Sees("give one another id"), begins_a_line("DIVES ───"), begins_a_line("▶"), Lacks("Widget"))
    given_back = ("escape", lambda app: text(app) == before[0])
    opened = [step for key in ("n", "c") for step in (key, shows(FormScreen), *visible, *given_back)]
    played(at, "2", lambda app: before.append(text(app)), *opened, views=views)


DECK_DIVE, HOVERING_DIVE, DAMAGED_DIVE = listed(DIVES)


def details_of(data, recorded=False, **changes):
    """The details of a dive so changed, each run of blanks as one."""
    (shown,) = listed([data | changes])
    return [" ".join(line.split()) for line in plain(details(shown, recorded, 80))]


def test_dives_are_listed_the_newest_first_and_the_newest_that_could_identify_anything_is_meant():
    assert [row.name for row in listed(DIVES)] == ["deck", "hovering", "survey"]
    assert listed(None) == ()
    assert usual(listed(DIVES), None) == HOVERING_DIVE.folder
    assert usual(listed([DECK, DAMAGED]), Path("other")) == Path("other")


@pytest.mark.parametrize(
    ("std", "words"),
    [
        (0.0068, ("0.7 %", "strong")),
        (0.3, ("30.0 %", "strong")),
        (0.31, ("no", "warn")),
        (math.inf, ("no", "warn")),
        (math.nan, ("--", "quiet")),
    ],
)
def test_what_a_dive_could_tell_is_in_percent_or_no_or_unknown(std, words):
    assert known_to(std) == words


def test_a_row_has_length_loss_letters_and_what_was_made_of_it():
    lines = plain(table(listed(DIVES), 1, HOVERING_DIVE.folder, {DECK_DIVE.folder}, 80, 10))
    assert " ".join(lines[1].split()) == "● 2026-11-21 04:52 00:00:41 1.2 % ······ ······ deck"
    assert lines[2].startswith("▶◆  2026-11-21 03:52  00:13:27   1.2 %  UVw··R UVWP·R  hovering")
    assert lines[2].endswith("identified")
    assert " ".join(lines[3].split()) == "2026-11-20 02:52 -- -- ------ ------ survey"
    (lossy,) = table(listed([dive("a", loss=0.06)]), 0, None, (), 80, 2)[1:]
    assert (" 6.0 %  ", "warn") in lossy


def test_on_a_narrow_screen_names_have_the_room_of_the_loss_which_its_details_say_where_it_is_large():
    lossy = listed([dive("validation-both", loss=0.06)])
    heads, row = plain(table(lossy, 0, None, (), 60, 2))
    assert heads == "    began, UTC        length    mass   damping dive"
    assert row.endswith(" validation-b…")
    said = "6.0 % of its frames were lost on the link"
    assert said in plain(details(lossy[0], False, 60))
    assert said not in plain(details(listed([dive("a", loss=0.04)])[0], False, 60))


@pytest.mark.parametrize(
    ("cells", "name", "ending"),
    [
        (80, "hovering", " hovering    ident. diagn."),
        (80, "validation-shadow", " validation… ident. diagn."),
        (96, "validation-shadow", " validation-shadow   identified, diagnosed"),
        (80, "x" * 200, "… ident. diagn."),
    ],
)
def test_what_was_made_of_a_dive_never_vanishes_for_its_name(cells, name, ending):
    dives = listed([dive(name, worked_on=["identified", "diagnosed"])])
    _, row = table(dives, 0, None, (), cells, 2)
    assert plain([row])[0].endswith(ending)
    assert width(row) == cells


def test_the_row_at_the_mark_is_always_shown_and_a_click_finds_it():
    many = listed([dive(f"d{n}", began_unix_s=1e9 - n) for n in range(30)])
    for at in range(30):
        lines = plain(table(many, at, None, (), 80, 8))
        assert len(lines) == 8
        (y,) = (n for n, line in enumerate(lines) if line.startswith("▶"))
        assert entry_at(y, 30, at, 8) == at
    assert entry_at(0, 30, 0, 8) is None
    assert entry_at(5, 3, 0, 8) is None


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


def test_a_dive_that_has_no_name_but_its_folders_is_named_once():
    folder = Path(DECK["folder"]).name
    assert details_of(DECK)[0].endswith(f"─ {folder}")
    assert details_of(DECK, name=folder)[0].count(folder) == 1


def test_a_dive_that_is_recorded_shows_what_it_holds_so_far_or_that_it_holds_nothing_yet():
    assert "is being recorded: this is what it holds so far" in details_of(DECK, recorded=True)
    lines = details_of(DECK, recorded=True, underway="is being recorded, nothing heard yet")
    assert "is being recorded, nothing heard yet" in lines
    assert not [line for line in lines if "so far" in line or "could tell" in line or "can't" in line]


def test_a_recording_that_grows_is_read_again_and_says_so_no_longer_that_it_holds_nothing(tmp_path):
    next_dive = tmp_path / "2026-11-21T0552Z-next"
    next_dive.mkdir()
    log = next_dive / "telemetry.tlog"
    log.touch()
    listed = dive(
        next_dive.name, folder=str(next_dive), size_bytes=0, underway="is being recorded, nothing heard yet"
    )
    verbs = FakeVerbs({"dives": [listed]})

    def comes(_):
        log.write_bytes(bytes(60_000))
        verbs.results["dives"] = [listed | {"size_bytes": 60_000, "underway": ""}]

    at = desk(verbs, out=tmp_path, recorded=lambda: next_dive)

    def look(app):
        app.screen.show(view())

    def reads_no_more(app):
        before = len(verbs.words)
        look(app)
        return len(verbs.words) == before

    nothing, so_far = Sees("is being recorded, nothing heard yet"), Sees("this is what it holds so far")
    played(at, "2", nothing, comes, look, so_far, Lacks("nothing heard yet"), reads_no_more)


def test_a_recording_that_grows_while_it_is_read_keeps_no_list_from_being_shown(tmp_path):
    recorded = tmp_path / "2026-11-21T0552Z-next"
    recorded.mkdir()
    log = recorded / "telemetry.tlog"
    log.write_bytes(bytes(60_000))
    row = dive(recorded.name, folder=str(recorded), size_bytes=60_000)
    verbs = FakeVerbs({"dives": [row]})

    def grows(app):
        log.write_bytes(bytes(3 * log.stat().st_size))
        verbs.held = ("dives",)
        verbs.results["dives"] = [
            row | {"size_bytes": log.stat().st_size, "notes": f"grew to {log.stat().st_size}"}
        ]
        app.screen.show(view())

    at = desk(verbs, out=tmp_path, recorded=lambda: recorded)
    listed_anew = (let_go, Sees("grew to 540000"))
    played(at, "2", Lacks("grew to"), grows, grows, *listed_anew)


def test_a_recording_that_begins_while_dives_is_open_is_listed_at_once(tmp_path):
    verbs, recorded = FakeVerbs(), []

    def begin(_):
        recorded.append(tmp_path / "2026-11-21T0552Z-next")

    at = desk(verbs, recorded=lambda: recorded[0] if recorded else None)
    played(at, "2", lambda _: len(verbs.words) == 1, begin, lambda _: len(verbs.words) == 2)
