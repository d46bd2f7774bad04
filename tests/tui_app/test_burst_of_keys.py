"""Keys typed faster than any screen is drawn: none of them ends the app."""

import asyncio

import pytest
from made_dives import DIVES, FakeVerbs, desk
from made_view import FixedViews
from screen_text import made
from textual import events

from tui.app.palette import ActionPalette
from tui.app.screens.table import SCREENS
from tui.app.screens.watch import WatchScreen


def typed(key):
    """The event of a key, as a terminal's driver makes it."""
    return events.Key(key, key if len(key) == 1 else None)


def left_after(keys):
    """How an app ends that was given all `keys` at once, the first before it shows anything, and then those that leave:
    0 where it was left."""

    async def work():
        app = made(FixedViews(), desk=desk(FakeVerbs({"dives": DIVES, "identify": {}, "params diff": None})))
        async with app.run_test(size=(80, 24)):
            for key in (*keys, "escape", "escape", "escape", "ctrl+q", "ctrl+q"):
                app.post_message(typed(key))
            # Not by the pilot's pauses: they give up on a slow machine.
            while app.return_code is None:
                await asyncio.sleep(0)
            return app.return_code

    return asyncio.run(work())


@pytest.mark.parametrize("row", SCREENS, ids=lambda row: row.id)
def test_every_key_right_behind_the_key_that_opens_its_screen(row):
    own = [key for action in row.actions for key in action.keys.split(",")]
    assert left_after([key for own_key in own for key in (row.key, own_key, "2")]) == 0


def test_a_palette_that_is_closed_twice_at_once_leaves_the_screen_below_as_it_is():
    async def work():
        app = made(FixedViews())
        async with app.run_test(size=(80, 24)) as pilot:
            app.action_command_palette()
            await pilot.pause()
            palette = app.screen
            palette.dismiss()
            palette.dismiss()
            await pilot.pause()
            return type(app.screen), type(palette)

    assert asyncio.run(work()) == (WatchScreen, ActionPalette)
