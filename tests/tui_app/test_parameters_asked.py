"""The screen Parameters: what has to be typed before anything is written or taken back."""

import pytest
from made_parameters import BEFORE, FakeVehicle, plan
from parameters_shown import line_of, on_screen, typed, views
from screen_text import text
from soak import rest_in_soak
from textual.widgets import Input

from gcs_plugin.watch.picture import Armed


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


def test_escape_leaves_a_roll_back_and_the_file_is_shown_again():
    async def work(app, pilot):
        await typed(app, pilot, "r", "escape", "escape")
        assert "identified.param OF hovering" in text(app)

    on_screen(FakeVehicle(), work)


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
