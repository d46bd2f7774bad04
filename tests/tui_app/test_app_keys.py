"""Keymap files, the line of keys, and keys that come in one burst."""

import asyncio

import pytest
import yaml
from fake_verbs import FakeVerbs, desk
from made_dives import DIVES
from made_view import FixedViews
from screen_text import made, run, text
from textual import events

from bridge.errors import ConfigError
from bridge.vehicle.config import CONFIGS
from tui.app.keys import load_keymap, user_file
from tui.app.screens.dives import DivesScreen
from tui.app.screens.frame import KeyLine, LiveKey, fitting
from tui.app.screens.table import PLACES, SCREENS, ActionPalette
from tui.app.screens.watch import WatchScreen


@pytest.fixture
def keymap_of(tmp_path):
    def load(text):
        file = tmp_path / "keymap.yaml"
        file.write_text(text, encoding="utf-8")
        return load_keymap(file, PLACES)

    return load


def test_the_shipped_example_lists_every_action_with_its_default():
    example = yaml.safe_load((CONFIGS / "keymap.yaml").read_text(encoding="utf-8"))
    assert example == {action.id: action.keys for place in PLACES for action in place}
    assert load_keymap(CONFIGS / "keymap.yaml", PLACES) == example


@pytest.mark.parametrize(
    ("text", "keymap"),
    [
        ('ff.off: "f9, ctrl+o"\nscreen.watch: 9\n', {"ff.off": "f9,ctrl+o", "screen.watch": "9"}),
        ('watch.words: "c"\nwatch.charts: "w"', {"watch.words": "c", "watch.charts": "w"}),
        *((f'theme.next: "{key}"', {"theme.next": key}) for key in
          ("f20", "shift+tab", "alt+x", "pagedown", "full_stop", "ä", "ctrl+underscore")),
    ],
)  # fmt: skip
def test_keys_are_given_by_action_by_any_name_that_a_terminal_sends_and_may_change_places(
    text, keymap, keymap_of
):
    assert keymap_of(text) == keymap


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ('ff.of: "f9"', r"keymap\.yaml: unknown action 'ff\.of'; did you mean 'ff\.off'\?"),
        ('watch.words: "c"', "the key 'c' belongs to both watch.charts and watch.words"),
        ('theme.next: "c"', "the key 'c' belongs to both theme.next and watch.charts"),
        ('theme.next: "?"', "the key 'question_mark' belongs to both app.help and theme.next"),
        ('ff.off: "escape"', "the key 'escape' belongs to both ff.off and app.close"),
        ('theme.next: "-"\napp.help: "minus"', "the key 'minus' belongs to both"),
        *((f"theme.next: {keys}", r"theme\.next: give its keys in quotes") for keys in
          ("no", '""', "[c]", "{c: d}", "1.5")),
        *((f'theme.next: "{key}"', r"theme\.next: '.*' is no key") for key in
          ("ctrl+", "controll+c", "f99", "nokey", "c,,d")),
        ("- c\n- d\n", "it is none"),
    ],
)  # fmt: skip
def test_a_mistake_in_a_keymap_is_named(text, why, keymap_of):
    with pytest.raises(ConfigError, match=why):
        keymap_of(text)


def test_the_users_own_file_is_taken_where_none_is_named(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    assert load_keymap(None, PLACES) == {}
    user_file().parent.mkdir()
    user_file().write_text('theme.next: "f5"', encoding="utf-8")
    assert load_keymap(None, PLACES) == {"theme.next": "f5"}


KEYS = (
    LiveKey("i", "i", "Identify", "identify"),
    LiveKey("ctrl+x", "Ctrl-X", "FF off", "app.force_off"),
    LiveKey("question_mark", "?", "Help", "app.help"),
    LiveKey("ctrl+q", "Ctrl-Q", "Quit", "app.quit"),
)


@pytest.mark.parametrize(
    ("cells", "line"),
    [
        (48, " i Identify  Ctrl-X FF off  ? Help  Ctrl-Q Quit "),
        (47, " i Identify  Ctrl-X FF off  ? Help, 1 more "),
        (42, " i Identify  Ctrl-X FF off  ? Help +1 "),
        (30, " Ctrl-X FF off  ? Help, 2 more "),
        (0, " Ctrl-X FF off  ? Help, 2 more "),
    ],
)
def test_keys_without_room_are_counted_beside_the_help_and_the_off_key_always_stays(cells, line):
    assert "".join(text for key in fitting(KEYS, cells) for text, _ in key.spans) == line


def test_a_click_on_a_key_is_the_key():
    views = FixedViews()

    async def work(app, pilot):
        x = text(app).splitlines()[-1].index("FF off")
        await pilot.click(KeyLine, offset=(x, 0))
        while not views.forced:
            await pilot.pause()
        await pilot.click(KeyLine, offset=(79, 0))
        assert app.screen.title == "Watch"

    run(made(views), (80, 24), work)
    assert views.forced == 1


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
                await asyncio.sleep(0.002)
            return app.return_code

    return asyncio.run(work())


@pytest.mark.parametrize("row", SCREENS, ids=lambda row: row.id)
def test_every_key_right_behind_the_key_that_opens_its_screen(row):
    keys = [key for action in row.actions for key in action.keys.split(",")]
    assert left_after([key for own_key in keys for key in (row.key, own_key, "2")]) == 0


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
    monkeypatch.setattr("tui.app.key_queue.KEY_PATIENCE_S", patience_s)
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
