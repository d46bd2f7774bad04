"""The screen Parameters: what is typed before anything is written, early keys, writing, and what became of it."""

import json

import pytest
from made_parameters import (
    BEFORE,
    NARROW,
    FakeVehicle,
    desk,
    done,
    line_of,
    on_screen,
    plan,
    receipt,
    rows,
    staged,
    typed,
    views,
)
from screen_text import made, pressed, run, text
from soak import rest_in_soak
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
from tui.app.screens.parameters import ParametersScreen


@pytest.mark.parametrize(
    "keys",
    rest_in_soak(
        [("enter",), ("7", "7", "enter"), ("6", "enter"), ("enter", "enter"), ("y", "enter")], keep=2
    ),
)
def test_an_enter_alone_or_another_number_writes_nothing(keys):
    vehicle = FakeVehicle()

    async def work(app, pilot):
        await typed(app, pilot, "u", *keys)
        assert "is not '7': nothing was sent" in text(app)

    on_screen(vehicle, work)
    assert vehicle.writes == []


def test_a_refusal_is_forgotten_once_something_is_written():
    vehicle = FakeVehicle()

    async def work(app, pilot):
        await typed(app, pilot, "u", "2", "enter", "backspace", "7", "enter")
        assert "nothing was sent" not in text(app)

    on_screen(vehicle, work)
    assert len(vehicle.writes) == 1


def test_escape_asks_no_longer_and_writes_nothing():
    vehicle = FakeVehicle()

    async def work(app, pilot):
        await typed(app, pilot, "u", "7", "escape")
        assert "type 7" not in text(app)
        await typed(app, pilot, "enter")

    on_screen(vehicle, work)
    assert vehicle.writes == []


def test_a_number_that_is_typed_opens_no_other_screen_and_the_off_switch_still_works():
    shown = views()

    async def work(app, pilot):
        await typed(app, pilot, "u", "1", "ctrl+x")
        assert app.screen.query_one(Input).value == "1"

    on_screen(FakeVehicle(), work, shown=shown)
    assert shown.forced == 1


@pytest.mark.parametrize("armed", [Armed.ARMED, Armed.FAILSAFE])
def test_an_armed_vehicle_is_written_to_once_the_word_is_typed_too(armed):
    vehicle = FakeVehicle()

    async def work(app, pilot):
        await typed(app, pilot, "u", "7", "enter")
        assert "is not 'ARMED 7'" in text(app)
        assert vehicle.writes == []
        await typed(app, pilot, *"armed", "space", "7", "enter")

    on_screen(vehicle, work, shown=views(armed))
    assert "--armed" in vehicle.writes[0]


def test_one_that_is_armed_while_the_number_is_typed_asks_for_the_word():
    vehicle, shown = FakeVehicle(), views()

    async def work(app, pilot):
        await typed(app, pilot, "u", "7")
        shown.shown = views(Armed.ARMED).shown
        app._show()
        await typed(app, pilot, "enter")
        assert "is not 'ARMED 7'" in text(app)

    on_screen(vehicle, work, shown=shown)
    assert vehicle.writes == []


@pytest.mark.parametrize("mode", [2, 3])
def test_while_the_feed_forward_of_an_armed_vehicle_acts_nothing_is_asked(mode):
    vehicle = FakeVehicle()

    async def work(app, pilot):
        await typed(app, pilot, "u")
        assert "force it off first, by ^x" in " ".join(text(app).split())
        await typed(app, pilot, "7", "enter")

    on_screen(vehicle, work, shown=views(Armed.ARMED, mode))
    assert vehicle.writes == []


def test_what_is_doubted_as_a_whole_needs_a_word_and_what_is_doubted_in_a_line_is_told():
    vehicle = FakeVehicle(plan(outcome="stopped at a bound"))

    async def work(app, pilot):
        assert "ended with 'stopped at a bound'" in text(app)
        await typed(app, pilot, "down", "down")
        assert "doubted: depth was never pushed" in text(app)
        await typed(app, pilot, "u", "7", "enter")
        assert vehicle.writes == []
        await typed(app, pilot, *"doubted", "7", "enter")

    on_screen(vehicle, work)
    assert "--despite-doubts" in vehicle.writes[0]


def test_roll_back_shows_what_it_would_change_and_asks_likewise():
    vehicle = FakeVehicle()

    async def work(app, pilot):
        await typed(app, pilot, "r")
        assert "ROLL BACK to the values before 2026-11-20 10:15 UTC" in text(app)
        assert line_of(app, "FF1_M_U").split()[2:5] == ["kg", "111.52", "96.5"]
        await typed(app, pilot, "enter")
        assert vehicle.writes == []
        await typed(app, pilot, "7", "enter")

    on_screen(vehicle, work)
    (words,) = vehicle.writes
    assert words[:4] == ("params", "rollback", str(BEFORE), "--yes")


def test_a_roll_back_with_nothing_to_go_back_to_says_so():
    vehicle = FakeVehicle(back={}, said=("receipts: no upload to vehicle 1 that stands",))

    async def work(app, pilot):
        await typed(app, pilot, "r")
        assert "no upload to vehicle 1 that stands" in text(app)
        assert "Nothing was written by this reading; escape leaves it" in text(app)
        await typed(app, pilot, "escape")
        assert "identified.param OF hovering" in text(app)

    on_screen(vehicle, work)
    assert vehicle.writes == []


def test_where_nothing_changes_nothing_is_asked():
    same = [{**one, "verdict": "same"} for one in plan()["parameters"]]

    async def work(app, pilot):
        await typed(app, pilot, "u")
        assert "holds all of it already" in text(app)

    on_screen(FakeVehicle(plan(parameters=same, writes=False)), work)


def test_what_the_vehicle_said_before_a_writing_is_not_told_after_it():
    note = "no set is in force on the vehicle (FF_ACTIVE is 0)"
    vehicle = FakeVehicle(plan(notes=[note]))

    async def work(app, pilot):
        assert note in " ".join(text(app).split())
        await typed(app, pilot, "u", "7", "enter")
        assert "✓ applied" in text(app)
        assert note not in " ".join(text(app).split())

    on_screen(vehicle, work)


def test_what_was_refused_is_told_line_by_line():
    failed = receipt("refused", "FF1_D_V refused: the vehicle permits it not", failed=("FF1_D_V",))
    vehicle = FakeVehicle(written=failed, code=1)

    async def work(app, pilot):
        await typed(app, pilot, "u", "7", "enter")
        assert "▲ refused: FF1_D_V refused" in text(app)
        assert line_of(app, "FF1_D_V  ").split()[-2:] == ["▲", "failed"]
        await typed(app, pilot, *["down"] * 5)
        assert "FF1_D_V refused: the vehicle permits it not." in text(app)

    on_screen(vehicle, work)


def test_what_came_into_force_is_told_where_its_receipt_could_not_be_written():
    why = (
        "its receipt still says that it was begun: r-receipt.json: can't be written (No space left on device)"
    )
    vehicle = FakeVehicle(written=receipt() | {"unkept": why}, code=2)

    async def work(app, pilot):
        await typed(app, pilot, "u", "7", "enter")
        shown = " ".join(text(app).split())
        assert "▲ applied: 7 parameters written and read back, set 13247 is active" in shown
        assert why in shown

    on_screen(vehicle, work)


def test_writing_goes_on_while_another_screen_is_looked_at_and_its_end_is_seen():
    vehicle = FakeVehicle(waits=True)

    async def work(app, pilot):
        await typed(app, pilot, "u", "7")
        await pressed(pilot, "enter", "1")
        vehicle.go.set()
        await done(app, pilot)
        await typed(app, pilot, "5")
        assert "applied: 7 parameters written" in text(app)

    on_screen(vehicle, work)
    assert len(vehicle.writes) == 1


def test_the_app_does_not_leave_while_it_writes():
    vehicle = FakeVehicle(waits=True)

    async def work(app, pilot):
        await typed(app, pilot, "u", "7")
        await pressed(pilot, "enter", "1", "ctrl+q")
        assert not app._exit
        assert [one.message for one in app._notifications] == [
            "parameters are being written; leave once that has ended"
        ]
        vehicle.go.set()
        await done(app, pilot)
        await pressed(pilot, "ctrl+q")
        assert app._exit

    on_screen(vehicle, work)


def test_an_upload_that_was_never_finished_is_told_as_the_app_begins(tmp_path):
    begun = {
        "outcome": "begun",
        "vehicle": {"system": 1, "component": 1},
        "parameters": [{"name": "FF1_M_U", "target": 96.5, "outcome": "begun"}],
        "active_crc": 13247,
    }
    receipt = tmp_path / "2026-11-20T101500Z-receipt.json"
    receipt.write_text(json.dumps(begun), encoding="utf-8")

    async def look(app, pilot):
        await pilot.pause()
        (notice,) = app._notifications
        assert notice.message == (
            "warning: the upload that was begun at 2026-11-20T101500Z was never finished; Parameters tells more"
        )

    run(made(views(), desk=Desk(receipts=tmp_path)), NARROW, look)


@pytest.mark.parametrize(
    ("key", "typed_", "words"), [("u", "7", "u tries it again"), ("r", "7", "r tries it again")]
)
def test_a_writing_that_found_no_vehicle_says_that_nothing_was_written_and_how_to_try_again(
    key, typed_, words
):
    vehicle = FakeVehicle(written={}, code=3, said=("vehicle 1: no HEARTBEAT for 5 s; check the link",))

    async def work(app, pilot):
        await typed(app, pilot, key, typed_, "enter")
        assert "no HEARTBEAT for 5 s" in text(app)
        assert f"Nothing was written; {words}." in text(app)

    on_screen(vehicle, work)


@pytest.mark.parametrize(
    ("of", "stage", "told"),
    [
        ("looking for the vehicle", "", "The vehicle is read before anything is written."),
        (WRITING, "STAGE", "The parameters are being written."),
        (WRITING, "COMMIT", "All lines are read back; the vehicle is told to fly them."),
        (WRITING, "UNDO", "It failed: what was written is taken back."),
    ],
)
def test_what_goes_on_while_it_is_written_is_told_by_its_stage_however_little_is_done(of, stage, told):
    vehicle = FakeVehicle(tells=(Report(of, 0.0, "x", stage=stage),), waits=True)

    async def work(app, pilot):
        await typed(app, pilot, "r", "7")
        await pressed(pilot, "enter")
        app._show()
        await pilot.pause()
        assert told in text(app)
        vehicle.go.set()
        await done(app, pilot)

    on_screen(vehicle, work)


NONE_LEFT = "no upload to this vehicle that stands is kept here"
UNIX_S = 1_795_165_923.0


class NothingLeft(FakeVehicle):
    """Its roll back has no upload to take back."""

    async def __call__(self, words, hear):
        found = await super().__call__(words, hear)
        if words[1] != "rollback":
            return found
        said = (
            "receipts: no upload to vehicle 1 that stands is kept there; give the -before.param to go back to"
        )
        return type(found)(2, None, errors=(said,), error_names=("NothingLeft",))


def is_back_at_the_file(app):
    shown = text(app)
    assert "ROLL BACK" not in shown
    assert "FF1_M_U" in shown
    assert "type" not in shown


def test_with_nothing_left_to_take_back_the_table_stays_with_the_sentence_and_no_file_is_asked_for():
    async def work(app, pilot):
        await typed(app, pilot, "r")
        await done(app, pilot)
        is_back_at_the_file(app)
        shown = " ".join(text(app).split())
        assert f"{NONE_LEFT}: there is nothing to take back" in shown
        assert "before.param" not in shown
        await typed(app, pilot, "u")
        assert "type 7 and Enter" in " ".join(text(app).split())

    on_screen(NothingLeft(), work)


@pytest.mark.parametrize("keys", [(), ("escape",)])
def test_where_the_vehicle_holds_the_values_before_already_no_empty_roll_back_is_left(keys):
    same = [{**one, "verdict": "same"} for one in rows()]

    async def work(app, pilot):
        await typed(app, pilot, "r", *keys)
        await done(app, pilot)
        is_back_at_the_file(app)
        assert "already: there is nothing to take back" in " ".join(text(app).split())

    on_screen(FakeVehicle(back=plan(file=str(BEFORE), parameters=same)), work)


def test_after_an_upload_the_title_says_what_was_done_and_no_values_before_are_named_where_none_differ():
    staged = [{**one, "present": one["target"], "verdict": "staged", "change": 0.0} for one in rows()]
    written = receipt(sentence="8 staged parameters read back, set 8205 is active")
    written["parameters"] = [{**line, "before": line["target"]} for line in written["parameters"]]
    held = FakeVehicle(plan(parameters=staged, active_crc=0.0, staged_crc=8205), written=written)

    async def work(app, pilot):
        assert "8 staged" in text(app)
        await typed(app, pilot, "u", "8", "enter")
        assert "✓ applied: 8 staged parameters read back" in text(app)
        assert "8 put in force" in text(app)
        assert "8 staged" not in text(app).replace("8 staged parameters", "")
        assert "values before" not in text(app)

    on_screen(held, work)


def test_after_an_upload_that_changes_values_the_title_says_so_and_the_values_before_are_named():
    async def work(app, pilot):
        assert "7 of 7 chosen" in text(app)
        await typed(app, pilot, "u", "7", "enter")
        assert "7 written" in text(app)
        assert "values before: receipts/2026-11-21T085300Z-before.param" in text(app)

    on_screen(FakeVehicle(), work)


def test_after_a_roll_back_last_accepted_is_what_stands_then(tmp_path):
    made = make_plan({"FF1_M_U": 101.25}, {"FF1_M_U": 90.0})
    begun = begin(made, (1, 1), new_preimage(tmp_path, UNIX_S), None, UNIX_S)
    results = {"FF1_M_U": Result(Outcome.APPLIED, "", 101.25)}
    keep_accepted(finish(begun, made, Ending(Outcome.APPLIED, "", results), 1.0), None, True)

    async def work(app, pilot):
        assert "101.25" not in text(app)
        await typed(app, pilot, "r", "7", "enter")
        assert "✓ applied" in text(app)
        assert line_of(app, "FF1_M_U").count("101.25") == 1
        assert line_of(app, "FF1_I_R").partition("✓")[0].split()[-3:] == ["--"] * 3, "nothing of it stands"
        assert "last accepted 101.25 kg (2026-11-20 09:12 UTC)" in " ".join(text(app).split())

    on_screen(FakeVehicle(), work, receipts=tmp_path)


def test_a_screen_that_is_not_composed_yet_offers_no_upload():
    async def work(_app, _pilot):
        screen = ParametersScreen("Parameters", ())
        assert not any(screen.check_action(action, ()) for action in ("upload", "back", "read", "choose"))

    run(made(views(), desk=desk(FakeVehicle())), NARROW, work)


async def burst(app, pilot, *keys):
    """Keys that come at once, as a slow link brings them."""
    await pilot.pause()
    for key in keys:
        app.post_message(events.Key(key, key if len(key) == 1 else None))
    await done(app, pilot)
    await pilot.pause()


def test_a_number_that_comes_at_once_with_its_key_is_typed_and_opens_no_screen():
    vehicle = FakeVehicle()

    async def work(app, pilot):
        await burst(app, pilot, "u", "7", "enter")
        assert isinstance(app.screen, ParametersScreen)
        await done(app, pilot)

    on_screen(vehicle, work)
    assert len(vehicle.writes) == 1


@pytest.mark.parametrize("key", ["u", "r"])
def test_what_is_typed_while_the_vehicle_is_still_read_waits_in_the_line_and_is_sent_by_an_enter_after_it(
    key,
):
    vehicle = FakeVehicle(silent=True)

    async def work(app, pilot):
        await pressed(pilot, "5", key, "1", "2", "backspace", "backspace", "7", "enter")
        assert isinstance(app.screen, ParametersScreen)
        assert "still being read: nothing was sent" in text(app)
        assert app.screen.query_one(Input).value == "7"
        vehicle.speaks.set()
        await done(app, pilot)
        await done(app, pilot)
        assert "type 7 and Enter" in text(app)
        assert vehicle.writes == []
        await typed(app, pilot, "enter")

    run(made(views(), desk=desk(vehicle)), NARROW, work)
    assert [words[1] for words in vehicle.writes] == ["upload" if key == "u" else "rollback"]


def test_no_key_begins_anything_else_while_the_vehicle_is_read():
    vehicle = FakeVehicle(silent=True)

    async def work(app, pilot):
        await pressed(pilot, "5", "a", "space", "r", "1", "2", "r", "i", "t", "question_mark")
        assert isinstance(app.screen, ParametersScreen)
        assert app.theme == "dark"

    run(made(views(), desk=desk(vehicle)), NARROW, work)
    assert {words[0] for words in vehicle.words} == {"params"}


def test_a_vehicle_that_could_not_be_read_leaves_what_was_typed_in_the_line():
    vehicle = FakeVehicle({}, said=("no vehicle's HEARTBEAT within 5 s",), silent=True)

    async def work(app, pilot):
        await pressed(pilot, "5", "u", "1")
        vehicle.speaks.set()
        await done(app, pilot)
        await pressed(pilot, "2", "enter")
        assert isinstance(app.screen, ParametersScreen)
        assert "no vehicle's HEARTBEAT" in text(app)

    run(made(views(), desk=desk(vehicle)), NARROW, work)
    assert vehicle.writes == []


def test_what_is_staged_and_does_not_fly_says_so_first_and_is_asked_for_as_that():
    vehicle = FakeVehicle(staged())

    async def work(app, pilot):
        shown = text(app)
        assert "8 staged" in shown
        assert "▲ staged, and none of it flies: commit it with u" in shown
        assert shown.index("commit it with u") < shown.index("FF1_M_U")
        assert line_of(app, "FF1_D_U").split()[-1] == "staged"
        assert " same" not in shown
        await typed(app, pilot, "u")
        assert "To put 8 lines in force on vehicle 1, type 8 and Enter" in text(app)
        await typed(app, pilot, "8", "enter")
        assert "staged, and none of it flies" not in text(app)
        assert "✓ equal" in line_of(app, "FF1_D_U")

    on_screen(vehicle, work)
    assert "--only" not in vehicle.writes[0]


def test_an_upload_that_was_cut_is_still_told_as_staged_once_the_vehicle_is_read_again():
    vehicle = FakeVehicle(staged(changed=("FF1_M_W",), active_crc=4711.0))

    async def work(app, pilot):
        assert "7 staged, 1 of 1 chosen" in text(app)
        assert "▲ staged, and another set flies (4711): commit it with u" in text(app)
        await typed(app, pilot, "u")
        assert "To write 1 line and put the 7 staged in force on vehicle 1, type 8 and" in text(app)
        await typed(app, pilot, "escape", "a", "u")
        assert "To put 7 lines in force on vehicle 1, type 7 and Enter" in text(app)
        await typed(app, pilot, "7", "enter")

    on_screen(vehicle, work)
    (words,) = vehicle.writes
    assert words[words.index("--only") + 1 :] == tuple(
        one["name"] for one in plan()["parameters"] if one["name"] != "FF1_M_W"
    )


def test_a_vehicle_that_never_had_a_set_shows_no_staged_values():
    told = [{**one, "present": 0.0, "verdict": "changed"} for one in plan()["parameters"]]

    async def work(app, _):
        assert "staged" not in text(app)

    on_screen(FakeVehicle(plan(parameters=told, active_crc=0.0, staged_crc=8205)), work)
