"""Keys typed faster than any screen is drawn: none of them ends the app."""

import asyncio

import pytest
from made_dives import DIVES, FakeVerbs, desk
from made_view import FixedViews
from screen_text import made
from textual import events

from tui.app.screens.dives import DivesScreen
from tui.app.screens.table import SCREENS, ActionPalette
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


def after_a_key_that_is_never_over(key, patience_s, monkeypatch):
    """The app and its views, given `key` while the effect of another never comes."""
    monkeypatch.setattr("tui.app.in_turn.PATIENCE_S", patience_s)
    views = FixedViews()

    async def work():
        app = made(views, desk=desk(FakeVerbs({"dives": DIVES})))
        async with app.run_test(size=(80, 24)) as pilot:
            await pilot.pause()
            await app.on_event(typed("c"))
            app._turn += 1  # of whatever is behind it nobody hears any more
            app.post_message(typed(key))
            await pilot.pause()
            app._refresh_view()
            await pilot.pause()
            return type(app.screen), list(app._typed)

    return asyncio.run(work()), views


def test_the_key_that_forces_the_feed_forward_off_waits_for_no_other(monkeypatch):
    _, views = after_a_key_that_is_never_over("ctrl+x", 1e9, monkeypatch)
    assert views.forced == 1


def test_another_key_waits_for_the_one_before_it_and_at_the_longest_for_its_patience(monkeypatch):
    (screen, waiting), _ = after_a_key_that_is_never_over("2", 1e9, monkeypatch)
    assert screen is WatchScreen
    assert [event.key for event in waiting] == ["2"]
    (screen, waiting), _ = after_a_key_that_is_never_over("2", 0.0, monkeypatch)
    assert screen is DivesScreen
    assert waiting == []
