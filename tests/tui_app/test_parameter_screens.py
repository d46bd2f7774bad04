"""The screen Parameters: what it shows, what is chosen, and what has to be typed before anything is written."""

import json
import os
from dataclasses import replace

import pytest
from made_parameters import BEFORE, PARAM, FakeVehicle, desk, plan, receipt, told_lines
from made_view import FixedViews, view
from screen_text import check, made, pressed, run, text
from textual import events
from textual.widgets import Input

from bridge.vehicle.config import CONFIGS
from gcs_plugin.params.files import write_parameters
from gcs_plugin.params.sidecar import Sidecar, write_sidecar
from gcs_plugin.watch.picture import Armed
from tui.app import parameter_lines as lines
from tui.app.desk import Desk
from tui.app.jobs import Jobs
from tui.app.screens.parameters import ParametersScreen
from tui.app.themes import ORDER
from tui.told import WRITING, Told

SIZES = ((80, 24), (160, 50))
NARROW = SIZES[0]


@pytest.fixture(autouse=True)
def _with_colour(monkeypatch):
    monkeypatch.delenv("NO_COLOR", raising=False)


def views(armed=Armed.DISARMED, ff_mode=1):
    made_view = view()
    return FixedViews(replace(made_view, picture=replace(made_view.picture, armed=armed, ff_mode=ff_mode)))


async def done(app, pilot):
    """Until nothing runs, and it is shown."""
    while any(app.desk.jobs.runs(verb) for verb in ("params diff", "params upload")):
        await pilot.pause()
    app._show()
    await pilot.pause()
    while app.screen.has_class("-asking") and not isinstance(app.focused, Input):
        await pilot.pause()


async def typed(app, pilot, *keys):
    for key in keys:
        await pressed(pilot, key)
        await done(app, pilot)


def on_screen(vehicle, work, size=NARROW, shown=None, **what):
    async def begin(app, pilot):
        await typed(app, pilot, "5")
        await work(app, pilot)

    run(made(shown or views(), desk=desk(vehicle, **what)), size, begin)


def line_of(app, name):
    return next(line for line in text(app).splitlines() if name in line)


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("theme", ORDER)
def test_parameters_look_as_they_were_kept(theme, size):
    async def look(app, pilot):
        await typed(app, pilot, "5", "down", "down")
        check(f"parameters-{size[0]}x{size[1]}-{theme}", app)

    run(made(views(), theme=theme, desk=desk()), size, look)


@pytest.mark.parametrize("size", SIZES)
def test_without_colour_they_look_as_they_were_kept(size, monkeypatch):
    monkeypatch.setenv("NO_COLOR", "1")

    async def look(app, pilot):
        await typed(app, pilot, "5", "down", "space")
        check(f"parameters-{size[0]}x{size[1]}-no-colour", app)

    run(made(views(), desk=desk()), size, look)


@pytest.mark.parametrize("theme", ORDER)
def test_what_is_asked_of_an_armed_vehicle_looks_as_it_was_kept(theme):
    async def look(app, pilot):
        await typed(app, pilot, "5", "u", "7")
        check(f"parameters-80x24-armed-{theme}", app)

    run(made(views(Armed.ARMED), theme=theme, desk=desk()), NARROW, look)


def test_writing_and_what_became_of_it_look_as_they_were_kept():
    vehicle = FakeVehicle(tells=told_lines(3, 0.43), waits=True)

    async def look(app, pilot):
        await typed(app, pilot, "5", "u", "7")
        await pressed(pilot, "enter")
        app._show()
        await pilot.pause()
        check("parameters-80x24-writing", app)
        vehicle.go.set()
        await done(app, pilot)
        check("parameters-80x24-written", app)

    run(made(views(), desk=desk(vehicle)), NARROW, look)


def test_each_line_tells_vehicle_file_interval_last_accepted_and_change():
    async def work(app, _):
        row = ["▶■", "FF1_M_U", "kg", "96.5", "111.52", "2.1", "96.5", "+7.2"]
        assert line_of(app, "FF1_M_U").split() == row
        assert "  N m/(rad/s) " in line_of(app, "FF1_D_R")
        assert line_of(app, "FF1_D_U").split()[-1] == "same"
        assert "7 of 7 chosen" in text(app)

    on_screen(FakeVehicle(), work)


def test_the_upload_writes_the_chosen_lines_once_their_number_is_typed():
    vehicle = FakeVehicle()

    async def work(app, pilot):
        await typed(app, pilot, "space", "down", "space", "u")
        assert "type 5 and Enter" in text(app)
        await typed(app, pilot, "5", "enter")
        assert "applied: 7 parameters written" in text(app)
        assert "✓ equal" in line_of(app, "FF1_D_V")

    on_screen(vehicle, work)
    (words,) = vehicle.writes
    assert words[:4] == ("params", "upload", str(PARAM), "--yes")
    assert words[words.index("--vehicle") + 1] == str(CONFIGS / "vehicles" / "ruvifist.yaml")
    only = words[words.index("--only") + 1 :]
    assert only == ("FF1_M_W", "FF1_I_R", "FF1_D_V", "FF1_D_W", "FF1_D_R")
    assert "--armed" not in words


def test_of_all_lines_none_is_named_so_that_the_model_goes_whole():
    vehicle = FakeVehicle()
    on_screen(vehicle, lambda app, pilot: typed(app, pilot, "u", "7", "enter"))
    assert "--only" not in vehicle.writes[0]


@pytest.mark.parametrize(
    "keys", [("enter",), ("6", "enter"), ("7", "7", "enter"), ("enter", "enter"), ("y", "enter")]
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


def test_a_screen_that_is_not_composed_yet_offers_no_upload_and_takes_no_key():
    """Keys in a burst come to a screen before its widgets do."""

    async def work(_app, _pilot):
        screen = ParametersScreen("Parameters", ())
        assert not any(screen.check_action(action, ()) for action in ("upload", "back", "read", "choose"))
        assert not await screen.take(events.Key("u", "u"))

    run(made(views(), desk=desk(FakeVehicle())), NARROW, work)


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


def test_escape_leaves_a_roll_back_and_the_file_is_shown_again():
    async def work(app, pilot):
        await typed(app, pilot, "r", "escape", "escape")
        assert "identified.param OF hovering" in text(app)

    on_screen(FakeVehicle(), work)


def test_a_roll_back_with_nothing_to_go_back_to_says_so():
    vehicle = FakeVehicle(back={}, said=("seatrial: receipts: no upload to vehicle 1 that stands",))

    async def work(app, pilot):
        await typed(app, pilot, "r")
        assert "no upload to vehicle 1 that stands" in text(app)
        assert "Nothing was written by this reading; escape leaves it" in text(app)
        await typed(app, pilot, "escape")
        assert "identified.param OF hovering" in text(app)

    on_screen(vehicle, work)
    assert vehicle.writes == []


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
    vehicle = FakeVehicle(written=receipt() | {"unkept": why}, code=1)

    async def work(app, pilot):
        await typed(app, pilot, "u", "7", "enter")
        shown = " ".join(text(app).split())
        assert "▲ applied: 7 parameters written and read back, set 13247 is active" in shown
        assert why in shown

    on_screen(vehicle, work)


def test_a_vehicle_that_cannot_be_read_says_why_and_what_to_do():
    vehicle = FakeVehicle({}, said=("seatrial: no vehicle's HEARTBEAT within 5 s",))

    async def work(app, pilot):
        assert "no vehicle's HEARTBEAT" in text(app)
        assert "Nothing was written by this reading; ^r reads the vehicle again." in text(app)
        app.set_keymap({"parameters.read": "f7"})
        await pilot.pause()
        app._show()
        await pilot.pause()
        assert "Nothing was written by this reading; f7 reads the vehicle again." in text(app)
        await typed(app, pilot, "u")
        assert "type" not in text(app)

    on_screen(vehicle, work)


def test_where_nothing_changes_nothing_is_asked():
    same = [{**one, "verdict": "same"} for one in plan()["parameters"]]

    async def work(app, pilot):
        await typed(app, pilot, "u")
        assert "holds all of it already" in text(app)

    on_screen(FakeVehicle(plan(parameters=same, writes=False)), work)


def staged(changed=(), active_crc=0.0):
    """The plan where the vehicle holds all lines but some, and does not fly them."""
    told = [
        one
        if one["name"] in changed
        else {**one, "present": one["target"], "verdict": "staged", "change": 0.0}
        for one in plan()["parameters"]
    ]
    return plan(parameters=told, active_crc=active_crc, staged_crc=8205)


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


@pytest.mark.parametrize("size", SIZES)
def test_what_is_staged_looks_as_it_was_kept(size):
    async def look(app, pilot):
        await typed(app, pilot, "5", "u")
        check(f"parameters-{size[0]}x{size[1]}-staged", app)

    run(made(views(), desk=desk(FakeVehicle(staged(changed=("FF1_M_W",))))), size, look)


def test_a_vehicle_that_never_had_a_set_shows_no_staged_values():
    told = [{**one, "present": 0.0, "verdict": "changed"} for one in plan()["parameters"]]

    async def work(app, _):
        assert "staged" not in text(app)

    on_screen(FakeVehicle(plan(parameters=told, active_crc=0.0, staged_crc=8205)), work)


def test_between_numbers_there_is_always_a_blank():
    one = {
        **plan()["parameters"][0],
        "present": -0.000123456,
        "target": 16.075,
        "low95": 16.075 - 0.51403,
        "high95": 16.075 + 0.51403,
        "accepted": -123456.0,
        "change": 1234567.0,
    }

    async def work(app, _):
        told = line_of(app, "FF1_M_U").split()
        assert told[3:] == ["-0.00012", "16.075", "0.514", "-1.2e+05", "+1e+06"]

    on_screen(FakeVehicle(plan(parameters=[one])), work)


def test_only_the_side_on_which_lines_are_left_out_is_told():
    one = plan()["parameters"][0]
    many = [{**one, "name": f"FF1_{n}"} for n in range(30)]

    async def work(app, pilot):
        assert "lines below" in text(app)
        assert "above" not in text(app)
        await typed(app, pilot, "end")
        assert "lines above" in text(app)
        assert "below" not in text(app)

    on_screen(FakeVehicle(plan(parameters=many)), work)


def test_what_was_left_out_or_taken_by_name_stays_so_when_the_same_file_is_read_again():
    async def work(app, pilot):
        await typed(app, pilot, "space", "down", "space", "ctrl+r")
        assert "5 of 7 chosen" in text(app)
        assert line_of(app, "FF1_M_U").startswith(" □")
        assert line_of(app, "FF1_M_W").startswith(" ■")
        await typed(app, pilot, "r", "escape", "escape")
        assert "5 of 7 chosen" in text(app)
        await typed(app, pilot, "u", "5", "enter", "ctrl+r")
        assert "5 of 7 chosen" in text(app)

    on_screen(FakeVehicle(), work)


def test_of_a_file_that_is_another_since_all_lines_are_chosen_again(tmp_path):
    file = tmp_path / "identified.param"
    write_parameters(file, {"FF1_M_U": 111.5})
    vehicle = FakeVehicle(plan(file=str(file)))

    async def work(app, pilot):
        await typed(app, pilot, "space", "ctrl+r")
        assert "6 of 7 chosen" in text(app)
        os.utime(file, ns=(1, 1))
        await typed(app, pilot, "ctrl+r")
        assert "7 of 7 chosen" in text(app)

    shown = desk(vehicle)
    shown.dive, shown.param = tmp_path, file

    async def begin(app, pilot):
        await typed(app, pilot, "5")
        await work(app, pilot)

    run(made(views(), desk=shown), NARROW, begin)


def test_no_line_chosen_asks_nothing():
    async def work(app, pilot):
        await typed(app, pilot, "a", "u")
        assert "no line is chosen" in text(app)
        await typed(app, pilot, "a")
        assert "7 of 7 chosen" in text(app)

    on_screen(FakeVehicle(), work)


def test_what_was_read_long_ago_is_read_again_before_it_is_asked():
    vehicle, now = FakeVehicle(), [0.0]

    async def work(app, pilot):
        now[0] = 121.0
        await typed(app, pilot, "u")
        assert "type 7 and Enter" in text(app)

    on_screen(vehicle, work, now_s=lambda: now[0])
    assert len(vehicle.words) == 2


def test_a_file_that_was_written_again_since_is_shown_again_and_not_sent(tmp_path):
    file = tmp_path / "identified.param"
    file.write_text("FF1_M_U,1\n", "utf-8")
    vehicle = FakeVehicle(plan(file=str(file)))

    async def work(app, pilot):
        app.desk.dive, app.desk.param = tmp_path, file
        await typed(app, pilot, "1", "5", "u", "7")
        read = len(vehicle.words)
        file.write_text("FF1_M_U,2\n", "utf-8")
        await typed(app, pilot, "enter")
        assert len(vehicle.words) == read + 1
        assert "has changed since it was shown" in " ".join(text(app).split())

    on_screen(vehicle, work)
    assert vehicle.writes == []


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


def test_a_click_goes_to_a_line_and_a_second_one_chooses_it():
    async def work(app, pilot):
        await pilot.click("#parameters-table", offset=(5, 4))
        await pilot.pause()
        assert line_of(app, "FF1_I_R").startswith("▶■")
        await pilot.click("#parameters-table", offset=(5, 4))
        await pilot.pause()
        assert line_of(app, "FF1_I_R").startswith("▶□")

    on_screen(FakeVehicle(), work)


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
    vehicle = FakeVehicle({}, said=("seatrial: no vehicle's HEARTBEAT within 5 s",), silent=True)

    async def work(app, pilot):
        await pressed(pilot, "5", "u", "1")
        vehicle.speaks.set()
        await done(app, pilot)
        await pressed(pilot, "2", "enter")
        assert isinstance(app.screen, ParametersScreen)
        assert "no vehicle's HEARTBEAT" in text(app)

    run(made(views(), desk=desk(vehicle)), NARROW, work)
    assert vehicle.writes == []


def test_lines_that_have_no_room_are_counted_and_a_question_hides_none():
    async def work(app, pilot):
        assert "lines above" not in text(app)
        await typed(app, pilot, "u")
        assert all(row["name"] in text(app) for row in plan()["parameters"])
        await typed(app, pilot, "escape")
        await pilot.resize_terminal(80, 15)
        await typed(app, pilot, "end")
        shown = [row["name"] for row in plan()["parameters"] if f"{row['name']}  " in text(app)]
        assert f"{len(plan()['parameters']) - len(shown)} lines above" in text(app)

    on_screen(FakeVehicle(), work)


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


WHY = "its standard deviation, 153, is as large as the value: the dive did not tell it"


def with_an_implausible_mass():
    first, *others = plan()["parameters"]
    return plan(parameters=[first | {"verdict": "implausible", "reason": WHY}, *others])


def test_an_implausible_line_says_why_and_is_left_out_of_an_upload():
    vehicle = FakeVehicle(with_an_implausible_mass())
    name = plan()["parameters"][0]["name"]

    async def work(app, pilot):
        assert lines.LEFT in line_of(app, name)
        assert WHY in " ".join(text(app).replace("│", " ").split())
        await typed(app, pilot, "u")
        await typed(app, pilot, "6", "enter")

    on_screen(vehicle, work)
    (words,) = vehicle.writes
    assert name not in words
    assert words.count("--only") == 1
    assert "--accept-implausible" not in words


@pytest.mark.parametrize(
    ("verdict", "told"),
    [("not on the vehicle", "absent"), ("implausible", "unlikely"), ("refused", "refused")],
)
def test_a_verdict_stands_in_a_whole_word_on_a_narrow_line(verdict, told):
    one = {**plan()["parameters"][0], "verdict": verdict, "reason": "why so"}

    async def work(app, _):
        assert line_of(app, one["name"]).rstrip().endswith(f"  {told}")
        assert f"{verdict}: why so." in text(app)

    on_screen(FakeVehicle(plan(parameters=[one])), work)


def test_an_implausible_line_that_is_chosen_is_written_for_a_harder_word():
    vehicle = FakeVehicle(with_an_implausible_mass())
    name = plan()["parameters"][0]["name"]

    async def work(app, pilot):
        await typed(app, pilot, "space", "u")
        assert "type DOUBTED 7 and Enter" in text(app)
        await typed(app, pilot, *"DOUBTED7", "enter")

    on_screen(vehicle, work)
    (words,) = vehicle.writes
    assert words[-2:] == ("--accept-implausible", name)
    assert "--only" not in words


@pytest.mark.slow
def test_values_of_another_vehicle_are_refused_with_the_reason_and_the_key_uploads_nothing(tmp_path):
    param = tmp_path / "identified.param"
    write_parameters(param, {"FF0_M_U": 98.0})
    write_sidecar(param, Sidecar("a" * 64, "b" * 64, "hovering", "likelihood", "1", vehicle="someone else's"))
    at = Desk("ruvifist:hovering", tmp_path, tmp_path, param=param, jobs=Jobs())

    async def work(app, pilot):
        await typed(app, pilot, "5")
        said = " ".join(text(app).split())
        assert "is of vehicle 'someone else's', and" in said
        assert "nothing was sent" in said
        await typed(app, pilot, "u")
        assert "Nothing can be sent, for what is said above" in text(app)
        await typed(app, pilot, "y", "enter")
        assert at.jobs.state("params upload") is None

    run(made(views(), desk=at), NARROW, work)


@pytest.mark.parametrize(
    ("key", "typed_", "words"), [("u", "7", "u tries it again"), ("r", "7", "r tries it again")]
)
def test_a_writing_that_found_no_vehicle_says_that_nothing_was_written_and_how_to_try_again(
    key, typed_, words
):
    vehicle = FakeVehicle(
        written={}, code=3, said=("seatrial: vehicle 1: no HEARTBEAT for 5 s; check the link",)
    )

    async def work(app, pilot):
        await typed(app, pilot, key, typed_, "enter")
        assert "no HEARTBEAT for 5 s" in text(app)
        assert f"Nothing was written; {words}." in text(app)

    on_screen(vehicle, work)


def flies(shown, number, age_s):
    """The vehicle said so long ago that it flies this set."""
    picture = replace(shown.shown.picture, active_set=number, active_set_age_s=age_s)
    shown.shown = replace(shown.shown, picture=picture)


def read_again(vehicle):
    return len([words for words in vehicle.words if "--yes" not in words]) - 1


def test_once_another_set_flies_the_vehicle_is_read_again_and_choices_stay():
    now_s, shown, vehicle = [0.0], views(), FakeVehicle()

    async def work(app, pilot):
        await typed(app, pilot, "space", "down")
        now_s[0] = 12.0
        flies(shown, 4711, 2.0)
        await done(app, pilot)
        assert read_again(vehicle) == 0
        vehicle.compared = plan(active_crc=0.0)
        flies(shown, 0, 2.0)
        await done(app, pilot)
        assert read_again(vehicle) == 1
        await done(app, pilot)
        assert "6 of 7 chosen" in text(app)
        assert line_of(app, "FF1_M_U").startswith(" □")
        now_s[0] = 30.0
        flies(shown, 4711, 25.0)  # as it was told before it was read
        await done(app, pilot)
        assert read_again(vehicle) == 1

    on_screen(vehicle, work, shown=shown, now_s=lambda: now_s[0])


def test_another_vehicles_set_reads_nothing_again():
    now_s, shown, vehicle = (
        [0.0],
        views(),
        FakeVehicle(plan(vehicle={"system": 7, "component": 1, "armed": False})),
    )

    async def work(app, pilot):
        now_s[0] = 12.0
        flies(shown, 0, 2.0)
        await done(app, pilot)
        assert read_again(vehicle) == 0

    on_screen(vehicle, work, shown=shown, now_s=lambda: now_s[0])


def test_the_own_upload_is_shown_until_another_set_flies():
    now_s, shown = [0.0], views()
    vehicle = FakeVehicle(written=receipt() | {"active_crc": 13247})

    async def work(app, pilot):
        await typed(app, pilot, "u", "7", "enter")
        now_s[0] = 5.0
        flies(shown, 13247, 1.0)
        await done(app, pilot)
        assert "✓ applied" in text(app)
        now_s[0] = 20.0
        flies(shown, 0, 1.0)
        await done(app, pilot)
        await done(app, pilot)
        assert "✓" not in text(app)
        assert read_again(vehicle) == 1

    on_screen(vehicle, work, shown=shown, now_s=lambda: now_s[0])


@pytest.mark.parametrize(
    ("of", "words", "told"),
    [
        ("looking for the vehicle", "reading", "The vehicle is read before anything is written."),
        (WRITING, "staging", "The parameters are being written."),
        (WRITING, "committing", "All lines are read back; the vehicle is told to fly them."),
        (WRITING, "rolling back, no answer for 4 s", "It failed: what was written is taken back."),
    ],
)
def test_what_goes_on_while_it_is_written_is_told_by_its_stage_however_little_is_done(of, words, told):
    vehicle = FakeVehicle(tells=(Told(of, 0.0, words),), waits=True)

    async def work(app, pilot):
        await typed(app, pilot, "r", "7")
        await pressed(pilot, "enter")
        app._show()
        await pilot.pause()
        assert told in text(app)
        vehicle.go.set()
        await done(app, pilot)

    on_screen(vehicle, work)


@pytest.mark.parametrize("how", ["the link is lost", "it is another vehicle", "it was long ago"])
def test_what_the_vehicle_held_is_dimmed_and_dated_once_it_may_no_longer_be_so(how):
    now_s, shown = [0.0], views()

    async def work(app, pilot):
        value = "     96.5 "
        assert role_at(app, "FF1_M_U ", value) != "stale"
        assert "was read" not in text(app)
        fresh = shown.shown.picture
        now_s[0] = 121.0 if how == "it was long ago" else 31.0
        link = replace(fresh.links[0], **LINKS[how])
        shown.shown = replace(shown.shown, picture=replace(fresh, links=(link,)))
        app._show()
        await pilot.pause()
        age = "2 min ago" if how == "it was long ago" else "31 s ago"
        assert f"what the vehicle holds was read {age}" in text(app)
        assert f"on the vehicle {age} 96.5 kg" in text(app)
        assert role_at(app, "FF1_M_U ", value) == "stale"
        now_s[0] = 1.0
        shown.shown = replace(shown.shown, picture=fresh)
        app._show()
        await pilot.pause()
        assert "was read" not in text(app)

    on_screen(FakeVehicle(), work, shown=shown, now_s=lambda: now_s[0])


LINKS = {
    "the link is lost": {"lost": True, "age_s": 31.0},
    "it is another vehicle": {"system": 7},
    "it was long ago": {},
}


def role_at(app, name, value):
    """The role of the vehicle's value on the line of that name."""
    table = app.screen._table(80, 20)
    line = next(line for line in table if any(name.strip() == text.strip() for text, _ in line))
    return next(role for text, role in line if text.strip() == value.strip())
