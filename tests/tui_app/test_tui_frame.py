"""The frame: keys, help, palette, themes, and the off switch that works from everywhere."""

import gc
import math
import re
from dataclasses import replace

import pytest
from made_dives import FakeVerbs, desk
from made_replay import StillReplay
from made_view import FixedViews, view
from screen_text import made, pressed, run, text
from textual.command import CommandPalette
from textual.containers import VerticalScroll
from textual.widget import Widget
from textual.widgets import Input

from tui.app.keys import EVERYWHERE
from tui.app.screens.frame import TopLine
from tui.app.screens.overlays import HelpScreen
from tui.app.screens.table import OPENING, SCREENS
from tui.app.screens.watch import WatchScreen
from tui.app.themes import ORDER
from tui.app.view import Forcing

NARROW, WIDE = (80, 24), (160, 50)
PAUSES = 20


def top(app):
    return text(app).splitlines()[0]


@pytest.mark.parametrize("key", ["ctrl+x", "f12"])
def test_one_key_forces_the_feed_forward_off_on_watch(key):
    views = FixedViews()
    run(made(views), NARROW, lambda _, pilot: pressed(pilot, key))
    assert views.forced == 1


@pytest.mark.parametrize("over", ["question_mark", "ctrl+p", "w"])
def test_it_forces_it_off_over_whatever_lies_on_the_screen(over):
    views = FixedViews()
    run(made(views), NARROW, lambda _, pilot: pressed(pilot, over, "ctrl+x"))
    assert views.forced == 1


def test_it_forces_it_off_in_the_middle_of_a_word_that_is_typed():
    views = FixedViews()

    async def work(app, pilot):
        await pressed(pilot, "ctrl+p", "t", "h", "ctrl+x", "e")
        assert app.screen.query_one(Input).value == "the"

    run(made(views), NARROW, work)
    assert views.forced == 1


def test_its_state_stands_in_the_top_line_until_it_is_acknowledged():
    views = FixedViews(replace(view(), forcing=Forcing("sent 4 times, no answer for 2.0 s", 4, False)))

    async def work(app, pilot):
        assert "FF shadow; OFF not confirmed" in top(app)
        assert "REC 00:12:31" in top(app)
        views.shown = replace(view(), forcing=Forcing("off", 5, True))
        app._show()
        await pilot.pause()
        assert "FF OFF, off" in top(app)
        views.shown = replace(view(), picture=replace(view().picture, ff_mode=0))
        app._show()
        await pilot.pause()
        assert top(app).endswith("FF off")

    run(made(views), NARROW, work)


@pytest.mark.parametrize("key", ["question_mark", "f1"])
def test_help_shows_the_live_keys_and_what_marks_mean_and_escape_closes_it(key):
    async def work(app, pilot):
        await pressed(pilot, key)
        assert isinstance(app.screen, HelpScreen)
        shown = text(app)
        for action in (*EVERYWHERE, *WatchScreen.ACTIONS):
            # All charts fit here, so there is no key for more of them; nor is there any replay.
            if action.id != "watch.charts" and not action.id.startswith("replay."):
                assert action.sentence in shown
        assert "the other charts" not in shown
        assert "Next dive go on" in shown  # a name as wide as its column stays apart from its sentence
        assert all(mark in shown and meaning in shown for mark, meaning in WatchScreen.LEGEND)
        await pressed(pilot, "escape")
        assert isinstance(app.screen, WatchScreen)

    run(made(FixedViews()), WIDE, work)


def test_help_says_what_each_mark_means_in_whole_sentences_where_it_is_narrow():
    async def work(app, pilot):
        for row in SCREENS:
            await app.run_action(f"app.open('{row.id}')")
            await pressed(pilot, "question_mark")
            app.screen.query_one(VerticalScroll).scroll_end(animate=False)
            await pilot.pause()
            shown = " ".join(" ".join(line.strip(" │▁▂▃▄▅▆▇█▎▊") for line in text(app).splitlines()).split())
            assert all(f"{mark} {meaning}" in shown for mark, meaning in row.make.LEGEND), row.id
            await pressed(pilot, "escape")

    run(made(FixedViews(), desk=desk()), (80, 48), work)


@pytest.mark.parametrize(("keymap", "key"), [({}, "^q"), ({"app.quit": "f10"}, "f10")])
def test_ctrl_c_leaves_nothing_and_says_in_plain_words_which_key_does(keymap, key):
    async def work(app, pilot):
        await pressed(pilot, "ctrl+c")
        assert [one.message for one in app._notifications] == [f"{key} leaves; the recording goes on"]

    run(made(FixedViews(), keymap=keymap), NARROW, work)


def test_help_shows_keys_as_the_keymap_has_them():
    async def work(app, pilot):
        await pressed(pilot, "f5")
        line = next(line for line in text(app).splitlines() if "sent until" in line)
        assert "f9" in line
        assert "^x" not in line

    run(made(FixedViews(), keymap={"ff.off": "f9", "app.help": "f5"}), WIDE, work)


def test_a_key_of_the_keymap_works_and_the_default_no_longer_does():
    views = FixedViews()

    async def work(_, pilot):
        await pressed(pilot, "ctrl+x")
        assert views.forced == 0
        await pressed(pilot, "f9")
        assert views.forced == 1
        await pressed(pilot, "question_mark", "f9")
        assert views.forced == 2

    run(made(views, keymap={"ff.off": "f9"}), NARROW, work)


def test_the_top_line_stays_live_under_help():
    views = FixedViews()

    async def work(app, pilot):
        await pressed(pilot, "question_mark")
        assert "■ ARMED" in top(app)
        views.shown = replace(view(), recording=None)
        app._show()
        await pilot.pause()
        assert "NOT RECORDING" in top(app)

    run(made(views), NARROW, work)


def test_the_palette_has_every_action():
    async def work(app, pilot):
        await pressed(pilot, "ctrl+p")
        assert isinstance(app.screen, CommandPalette)
        provider = next(iter(app.COMMANDS))(app.screen_stack[-2])
        names = {hit.text async for hit in provider.discover()}
        live = [action for action in WatchScreen.ACTIONS if not action.id.startswith("replay.")]
        expected = {action.words for action in (*EVERYWHERE, *OPENING, *live)} - {"Palette"}
        assert names >= expected | {f"Theme: {name}" for name in ORDER}
        others = names - expected - {f"Theme: {name}" for name in ORDER}
        assert {"Dives: Note", "Identify: Cancel", "Parameters: Upload", "Validate: Validate"} < others
        assert not any(name.startswith("Watch: ") for name in others)

    run(made(FixedViews()), NARROW, work)


def test_what_moves_is_in_the_palette_of_its_own_screen_while_it_does_something():
    async def found(app, words):
        provider = next(iter(app.COMMANDS))(app.screen)
        return words in [hit.text async for hit in provider.search(words)]

    async def on_watch(app, _):
        return [await found(app, words) for words in ("Slower", "+10 s", "Newest")]

    async def on_dives(app, pilot):
        await pressed(pilot, "2")
        return [await found(app, words) for words in ("Slower", "+10 s", "Newest")]

    assert run(made(FixedViews(), desk=desk()), NARROW, on_watch) == [False, False, False]
    assert run(made(FixedViews(), desk=desk(replay=StillReplay())), NARROW, on_watch) == [True, True, False]
    assert run(made(FixedViews(), desk=desk()), NARROW, on_dives) == [False, False, True]


def test_an_action_of_another_screen_opens_that_screen_and_says_where_it_does_nothing_there():
    async def work(app, pilot):
        provider = next(iter(app.COMMANDS))(app.screen)
        (hit,) = [hit async for hit in provider.discover() if hit.text == "Identify: Cancel"]
        await hit.command()
        await pilot.pause()
        assert app.screen.title == "Identify"
        assert [one.message for one in app._notifications] == [
            "Cancel: there is nothing for it to do on Identify now"
        ]

    run(made(FixedViews(), desk=desk()), NARROW, work)


def test_an_action_of_another_screen_is_done_there():
    verbs = FakeVerbs()

    async def work(app, pilot):
        provider = next(iter(app.COMMANDS))(app.screen)
        (hit,) = [hit async for hit in provider.discover() if hit.text == "Dives: Read"]
        await hit.command()
        await pilot.pause()
        assert app.screen.title == "Dives"
        assert app._notifications._notifications == {}

    run(made(FixedViews(), desk=desk(verbs)), NARROW, work)
    assert [words[0] for words in verbs.words] == ["dives"]


@pytest.mark.parametrize("keymap", [{}, {"ff.off": "f9"}])
def test_a_key_of_the_keymap_keeps_its_place_in_the_footer(keymap):
    async def work(app, _):
        words = ["Identify", "Charts", "Words", "FF off", "Help", "Palette", "Theme", "Quit"]
        line = text(app).splitlines()[-1]
        assert [word for word in re.split(r"\s+\S+\s(?=[A-Z])", line) if word] == words

    run(made(FixedViews(), keymap=keymap), NARROW, work)


def test_one_key_goes_through_the_themes_and_each_is_kept():
    kept = []

    async def work(app, pilot):
        for name in ("light", "sunlight", "dark"):
            await pressed(pilot, "t")
            assert app.theme == name

    run(made(FixedViews(), keep_theme=kept.append), NARROW, work)
    assert kept == ["light", "sunlight", "dark"]


def test_the_digit_keys_and_the_tabs_open_screens():
    async def work(app, pilot):
        await pressed(pilot, "question_mark", "escape", "1")
        assert isinstance(app.screen, WatchScreen)
        await pressed(pilot, "w")
        await pilot.click(TopLine, offset=(3, 1))
        await pilot.pause()
        assert isinstance(app.screen, WatchScreen)
        assert "surge u" in text(app)

    run(made(FixedViews()), NARROW, work)
    assert [row.key for row in SCREENS] == [str(n + 1) for n in range(len(SCREENS))]


async def settled(pilot, most):
    """How many widgets there are, once those that are still being taken away are gone, as far as that ever happens."""
    for _ in range(PAUSES):
        gc.collect()
        count = sum(issubclass(type(one), Widget) for one in gc.get_objects())
        if count <= most:
            break
        await pilot.pause()
    return count


def test_screens_that_come_and_go_leave_nothing_in_memory():
    async def work(_, pilot):
        counts = []
        for _ in range(2):
            for _ in range(2):
                await pressed(pilot, "question_mark", "escape")
                await pilot.resize_terminal(*WIDE)
                await pilot.resize_terminal(*NARROW)
            counts.append(await settled(pilot, counts[0] if counts else math.inf))
        assert max(counts) == counts[0]

    run(made(FixedViews()), NARROW, work)
