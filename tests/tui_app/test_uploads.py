"""The screen Parameters: what is typed before anything is written, early keys, writing, and what became of it."""

import json
from dataclasses import replace

import pytest
from fake_verbs import let_go
from made_parameters import (
    BEFORE,
    FakeVehicle,
    desk,
    has,
    line_of,
    lines_written,
    on_screen,
    plan,
    receipt,
    rows,
    staged,
    views,
)
from screen_text import NARROW, WIDE, Lacks, Sees, made, play, played, run, said, shows, text
from textual import events
from textual.widgets import Input

from bridge.reports import WRITING, Report
from gcs_plugin.params.last_accepted import keep_accepted
from gcs_plugin.params.plan import make_plan
from gcs_plugin.params.receipt import begin, finish, new_preimage
from gcs_plugin.params.transfer import Outcome, Result
from gcs_plugin.params.upload import Ending
from gcs_plugin.watch.picture import Armed
from tui.app.desk import Desk
from tui.app.jobs import JobState
from tui.app.screens.parameters import ParametersScreen
from tui.app.screens.parameters_lines import writing

UNIX_S = 1_795_165_923.0


def has_typed(text):
    return lambda app: app.screen.query_one(Input).value == text


def test_only_the_number_of_lines_writes():
    """Not an enter alone, another number, a letter, nor an enter after the question was left."""
    vehicle, refused = FakeVehicle(), ("enter", Sees("is not '7': nothing was sent"))
    wrong = (*refused, "7", "7", *refused, "backspace", "backspace", "y", *refused, "backspace")
    on_screen(vehicle, "u", *wrong, has_typed(""), "7", "escape", Lacks("type 7"), "enter")
    assert vehicle.writes == []


def test_a_number_that_is_typed_opens_no_other_screen_and_the_off_switch_still_works():
    shown = views()
    on_screen(FakeVehicle(), "u", "1", "ctrl+x", has_typed("1"), shown=shown)
    assert shown.forced == 1


@pytest.mark.parametrize("armed", [Armed.ARMED, Armed.FAILSAFE])
def test_an_armed_vehicle_is_written_to_once_the_word_is_typed_too(armed):
    vehicle = FakeVehicle()
    refused = ("u", "7", "enter", Sees("is not 'ARMED 7'"), lambda _: vehicle.writes == [])
    on_screen(vehicle, *refused, *"armed", "space", "7", "enter", shown=views(armed))
    assert "--armed" in vehicle.writes[0]


def of_system(system):
    shown = views().shown
    links = tuple(replace(link, system=system) for link in shown.picture.links)
    return replace(shown, picture=replace(shown.picture, links=links))


def test_of_several_vehicles_that_are_heard_the_one_that_is_shown_is_read():
    """Without its number the verb asks for one, and the app has no other way to tell it."""
    vehicle, shown = FakeVehicle(plan(vehicle={"system": 7, "component": 1, "armed": False})), views()
    shown.shown = of_system(7)
    on_screen(vehicle, "r", "escape", shown=shown)
    reads = [words for words in vehicle.words if words[0] == "params"]
    assert {words[1] for words in reads} == {"diff", "rollback"}
    assert all(words[words.index("--system") + 1] == "7" for words in reads)


def test_what_was_read_of_one_vehicle_is_not_confirmed_by_the_state_of_another_that_is_shown_by_now():
    vehicle, shown = FakeVehicle(), views()
    another = shown.then(of_system(7))
    refused = Sees("vehicle 7 is shown by now, and vehicle 1 was read: read it anew")
    on_screen(vehicle, "u", "7", another, "enter", refused, shown=shown)
    assert vehicle.writes == []
    vehicle.compared = plan(vehicle={"system": 7, "component": 1, "armed": False})
    on_screen(vehicle, "u", Sees("vehicle 7, type 7"), "7", "enter", shown=shown)
    assert len(vehicle.writes) == 1


def test_one_that_is_armed_while_the_number_is_typed_asks_for_the_word():
    vehicle, shown = FakeVehicle(), views()
    is_armed = shown.then(views(Armed.ARMED).shown)
    on_screen(vehicle, "u", "7", is_armed, "enter", Sees("is not 'ARMED 7'"), shown=shown)
    assert vehicle.writes == []


@pytest.mark.parametrize("mode", [2, 3])
def test_while_the_feed_forward_of_an_armed_vehicle_acts_nothing_is_asked(mode):
    vehicle = FakeVehicle()
    on_screen(
        vehicle, "u", Sees("force it off first, by Ctrl-X"), "7", "enter", shown=views(Armed.ARMED, mode)
    )
    assert vehicle.writes == []


def test_what_is_doubted_as_a_whole_needs_a_word_and_what_is_doubted_in_a_line_is_told():
    vehicle = FakeVehicle(plan(outcome="stopped at a bound"))
    of_line = ("down", "down", Sees("doubted: depth was never pushed"))
    doubts = (Sees("ended with 'stopped at a bound'"), *of_line)
    on_screen(vehicle, *doubts, "u", "7", "enter", lambda _: vehicle.writes == [], *"doubted", "7", "enter")
    assert "--despite-doubts" in vehicle.writes[0]


def test_roll_back_shows_what_it_would_change_and_asks_likewise():
    vehicle = FakeVehicle()
    on_screen(
        vehicle,
        *("r", Sees("ROLL BACK to the values before 2026-11-20 10:15 UTC")),
        lambda app: line_of(app, "FF1_M_U").split()[2:5] == ["111.52", "→", "96.5"],
        *("enter", lambda _: vehicle.writes == [], "7", "enter"),
    )
    (words,) = vehicle.writes
    assert words[:4] == ("params", "rollback", str(BEFORE), "--yes")


def test_where_nothing_changes_nothing_is_asked():
    same = [{**row, "verdict": "same"} for row in plan()["parameters"]]
    vehicle = FakeVehicle(plan(parameters=same, writes=False))
    on_screen(vehicle, "u", Sees("holds all of it already"), Lacks("type"))


def test_each_line_is_ticked_as_it_is_written():
    vehicle = FakeVehicle(tells=lines_written(3, 0.43), waits=True)
    ticked = (has("FF1_M_V", "✓", "equal"), has("FF1_I_R", "+3.7", "8.25"))
    on_screen(vehicle, "u", "7", "enter", Sees("43 %"), *ticked)


def test_what_was_refused_is_told_line_by_line():
    failed = receipt("refused", "FF1_D_V refused: the vehicle permits it not", failed=("FF1_D_V",))
    on_screen(
        FakeVehicle(written=failed, code=1),
        *("u", "7", "enter", Sees("▲ refused: FF1_D_V refused"), has("FF1_D_V  ", "▲", "failed")),
        *(*["down"] * 5, Sees("FF1_D_V refused: the vehicle permits it not.")),
    )


def test_what_came_into_force_is_told_where_its_receipt_could_not_be_written():
    why = (
        "its receipt still says that it was begun: r-receipt.json: can't be written (No space left on device)"
    )
    applied = Sees("▲ applied: 7 parameters written and read back, set 13247 is active")
    vehicle = FakeVehicle(written=receipt() | {"unkept": why}, code=2)
    on_screen(vehicle, "u", "7", "enter", applied, Sees(why))


def test_writing_goes_on_while_another_screen_is_looked_at_and_the_app_does_not_leave_until_it_has_ended():
    vehicle = FakeVehicle(waits=True)

    def is_kept(app):
        assert said(app) == ["parameters are being written; leave once that has ended"]
        assert not app._exit

    written = (let_go, lambda _: None, Sees("applied: 7 parameters written"), "ctrl+q", lambda app: app._exit)
    on_screen(vehicle, "u", "7", "enter", "1", "ctrl+q", is_kept, *written)
    assert len(vehicle.writes) == 1


def test_an_upload_that_was_never_finished_is_told_as_the_app_begins(tmp_path):
    begun = {
        "number": 1,
        "outcome": "begun",
        "vehicle": {"system": 1, "component": 1},
        "parameters": [{"name": "FF1_M_U", "target": 96.5, "outcome": "begun"}],
        "active_crc": 13247,
    }
    (tmp_path / "2026-11-20T101500Z-receipt.json").write_text(json.dumps(begun), encoding="utf-8")
    assert played(Desk(receipts=tmp_path)) == [
        "warning: the upload that was begun at 2026-11-20T101500Z was never finished; Parameters tells more"
    ]


@pytest.mark.parametrize("key", ["u", "r"])
def test_a_writing_that_found_no_vehicle_says_that_nothing_was_written_and_how_to_try_again(key):
    vehicle = FakeVehicle(written={}, code=3, errors=["vehicle 1: no HEARTBEAT for 5 s; check the link"])
    again = Sees(f"Nothing was written; {key} tries it again.")
    on_screen(vehicle, key, "7", "enter", Sees("no HEARTBEAT for 5 s"), again)


@pytest.mark.parametrize(
    ("of", "stage", "words"),
    [
        ("looking for the vehicle", "", "The vehicle is read before anything is written."),
        (WRITING, "STAGE", "The parameters are being written."),
        (WRITING, "COMMIT", "All lines are read back; the vehicle is told to fly them."),
        (WRITING, "UNDO", "It failed: what was written is taken back."),
    ],
)
def test_what_goes_on_while_it_is_written_is_told_by_its_stage_however_little_is_done(of, stage, words):
    at_work = JobState(("params",), 0.0, (Report(of, 0.0, "x", stage=stage),))
    assert writing(at_work, 80, "u")[0] == ((words, "strong"),)


BACK_AT_THE_FILE = (Lacks("ROLL BACK"), Lacks("type"), Sees("FF1_M_U"))


def test_with_nothing_left_to_take_back_the_table_stays_with_the_sentence_and_no_file_is_asked_for():
    vehicle = FakeVehicle(
        back={}, code=2, errors=["no upload stands; give the -before.param"], names=["NothingLeft"]
    )
    why = Sees("no upload to this vehicle that stands is kept here: there is nothing to take back")
    again = ("u", Sees("type 7 and Enter"))
    on_screen(vehicle, "r", lambda _: None, *BACK_AT_THE_FILE, why, Lacks("before.param"), *again)


def test_where_the_vehicle_holds_the_values_before_already_no_empty_roll_back_is_left():
    same = [{**row, "verdict": "same"} for row in rows()]
    vehicle = FakeVehicle(back=plan(file=str(BEFORE), parameters=same))
    already = Sees("already: there is nothing to take back")
    on_screen(vehicle, "r", lambda _: None, *BACK_AT_THE_FILE, already)


def test_after_an_upload_the_title_says_what_was_done_and_no_values_before_are_named_where_none_differ():
    written = receipt(sentence="8 staged parameters read back, set 8205 is active")
    written["parameters"] = [{**line, "before": line["target"]} for line in written["parameters"]]
    applied = (Sees("✓ applied: 8 staged parameters read back"), Sees("8 put in force"))
    vehicle = FakeVehicle(staged(), written=written)
    on_screen(vehicle, Sees("8 staged"), "u", "8", "enter", *applied, Lacks("values before"))


def test_after_a_roll_back_last_accepted_is_what_stands_then(tmp_path):
    made = make_plan({"FF1_M_U": 101.25}, {"FF1_M_U": 90.0})
    begun = begin(made, (1, 1), new_preimage(tmp_path, UNIX_S), None, UNIX_S)
    results = {"FF1_M_U": Result(Outcome.APPLIED, "", 101.25)}
    keep_accepted(finish(begun, made, Ending(Outcome.APPLIED, "", results), 1.0), None, True)
    on_screen(
        FakeVehicle(),
        *(Lacks("101.25"), "r", "7", "enter", Sees("✓ applied")),
        lambda app: "101.25" in line_of(app, "FF1_M_U  "),
        # Nothing of the other line stands.
        lambda app: line_of(app, "FF1_I_R").partition("✓")[0].split()[-3:] == ["--"] * 3,
        Sees("accepted 101.25 kg (2026-11-20 09:12 UTC)"),
        receipts=tmp_path,
        size=WIDE,
    )


def test_a_screen_that_is_not_composed_yet_offers_no_upload():
    def offers_none(_):
        screen = ParametersScreen("Parameters", ())
        return not any(screen.check_action(action, ()) for action in ("upload", "back", "read", "choose"))

    on_screen(FakeVehicle(), offers_none)


def test_a_number_that_comes_at_once_with_its_key_is_typed_and_opens_no_screen():
    vehicle = FakeVehicle()

    async def work(app, pilot):
        await play(app, pilot, "5")
        for key in ("u", "7", "enter"):
            app.post_message(events.Key(key, key if len(key) == 1 else None))
        while app.is_typing or not vehicle.writes:
            await pilot.pause()
        await play(app, pilot, shows(ParametersScreen))

    run(made(views(), desk=desk(vehicle)), NARROW, work)
    assert len(vehicle.writes) == 1


@pytest.mark.parametrize(("key", "verb"), [("u", "upload"), ("r", "rollback")])
def test_what_is_typed_while_the_vehicle_is_still_read_waits_in_the_line_and_is_sent_by_an_enter_after_it(
    key, verb
):
    vehicle = FakeVehicle(silent=True)
    waits = (shows(ParametersScreen), Sees("still being read: nothing was sent"), has_typed("7"))
    asked = (lambda _: None, Sees("type 7 and Enter"), lambda _: vehicle.writes == [])
    on_screen(vehicle, key, *"12", "backspace", "backspace", "7", "enter", *waits, let_go, *asked, "enter")
    assert [words[1] for words in vehicle.writes] == [verb]


def test_what_is_staged_and_does_not_fly_says_so_first_and_is_asked_for_as_that():
    vehicle = FakeVehicle(staged())
    on_screen(
        vehicle,
        *(Sees("8 staged"), Sees("▲ staged, and none of it flies: commit it with u")),
        lambda app: text(app).index("commit it with u") < text(app).index("FF1_M_U"),
        *(has("FF1_D_U", "staged"), Lacks(" same")),
        *("u", Sees("To put 8 lines in force on vehicle 1, type 8 and Enter")),
        *("8", "enter", Lacks("staged, and none of it flies"), has("FF1_D_U", "✓", "equal")),
    )
    assert "--only" not in vehicle.writes[0]


def test_an_upload_that_was_cut_is_still_told_as_staged_once_the_vehicle_is_read_again():
    vehicle = FakeVehicle(staged(changed=("FF1_M_W",), active_crc=4711.0))
    on_screen(
        vehicle,
        *(Sees("7 staged, 1 of 1 chosen"), Sees("▲ staged, and another set flies (4711): commit it with u")),
        *("u", Sees("To write 1 line and put the 7 staged in force on vehicle 1, type 8 and")),
        *("escape", "a", "u", Sees("To put 7 lines in force on vehicle 1, type 7 and Enter"), "7", "enter"),
    )
    (words,) = vehicle.writes
    others = tuple(row["name"] for row in plan()["parameters"] if row["name"] != "FF1_M_W")
    assert words[words.index("--only") + 1 :] == others


def test_a_vehicle_that_never_had_a_set_shows_no_staged_values():
    empty = [{**row, "present": 0.0, "verdict": "changed"} for row in plan()["parameters"]]
    on_screen(FakeVehicle(plan(parameters=empty, active_crc=0.0, staged_crc=8205)), Lacks("staged"))
