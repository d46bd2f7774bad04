"""Keys typed faster than any screen is drawn: none of them ends the app."""

import asyncio

import pytest
from made_dives import DIVES, FakeVerbs, desk
from made_view import FixedViews
from screen_text import made
from textual import events

from tui.app.screens.table import SCREENS
from tui.app.screens.watch import WatchScreen


def typed(key):
    """The event of a key, as a terminal's driver makes it."""
    return events.Key(key, key if len(key) == 1 else None)


def survives(keys):
    """Whether an app that was given all `keys` at once, the first before it shows anything, opens Watch after them."""

    async def work():
        app = made(FixedViews(), desk=desk(FakeVerbs({"dives": DIVES, "identify": {}, "params diff": None})))
        async with app.run_test(size=(80, 24)):
            for key in (*keys, "escape", "escape", "escape", "2", "1"):
                app.post_message(typed(key))
            handled = asyncio.Event()
            app.call_later(handled.set)
            await handled.wait()
            # Not by the pilot's pauses: they give up on a slow machine.
            while app.is_running and not isinstance(app.screen, WatchScreen):
                await asyncio.sleep(0)
            return app.return_code is None

    return asyncio.run(work())


@pytest.mark.parametrize("row", SCREENS, ids=lambda row: row.id)
def test_every_key_right_behind_the_key_that_opens_its_screen(row):
    own = [key for action in row.actions for key in action.keys.split(",")]
    assert survives([key for own_key in own for key in (row.key, own_key, "2")])
