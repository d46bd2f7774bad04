"""The screen Parameters: keys that come before it is ready for them."""

import pytest
from made_parameters import FakeVehicle, desk
from parameters_shown import NARROW, done, on_screen, typed, views
from screen_text import made, pressed, run, text
from textual import events
from textual.widgets import Input

from tui.app.screens.parameters import ParametersScreen


def test_a_screen_that_is_not_composed_yet_offers_no_upload_and_takes_no_key():
    """Keys in a burst come to a screen before its widgets do."""

    async def work(_app, _pilot):
        screen = ParametersScreen("Parameters", ())
        assert not any(screen.check_action(action, ()) for action in ("upload", "back", "read", "choose"))
        assert not await screen.take(events.Key("u", "u"))

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
