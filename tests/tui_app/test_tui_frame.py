"""The frame: keys, help, palette, themes, and the off switch that works from everywhere."""

import gc
import re
import time
import weakref
from dataclasses import replace

import pytest
from fake_verbs import FakeVerbs, desk
from made_view import FixedViews, StillReplay, view
from screen_text import NARROW, WIDE, Lacks, Sees, made, play, played, pressed, run, shows, text
from textual._wait import wait_for_idle
from textual.app import App
from textual.containers import VerticalScroll
from textual.widget import Widget
from textual.widgets import Input

from tui.app.keys import EVERYWHERE
from tui.app.screens.frame import TopLine
from tui.app.screens.overlays import HelpScreen
from tui.app.screens.table import OPENING, SCREENS
from tui.app.screens.watch import WatchScreen
from tui.app.themes import ORDER

SOON_S = 60.0


def top(app):
    return text(app).splitlines()[0]


def test_a_screen_is_styled_anew_in_another_theme_alone_and_is_soon_drawn(monkeypatch):
    styled, held_s, delay_update = [], [], App.delay_update
    monkeypatch.setattr(WatchScreen, "update_node_styles", lambda screen, **_: styled.append(screen))
    monkeypatch.setattr(
        App, "delay_update", lambda app, delay=0.05: (held_s.append(delay), delay_update(app, delay))
    )
    played(
        desk(),
        # As it is mounted it has the classes of its size.
        lambda app: app.screen.has_class("-narrow", "-short") and not styled,
        *("2", "1", lambda _: not styled),
        *("2", "t", "1", lambda _: len(styled) == 1),
    )
    assert set(held_s) == {0.01}


def test_one_key_forces_the_feed_forward_off_over_whatever_lies_on_the_screen():
    views = FixedViews()

    def forced(times):
        return lambda _: views.forced == times

    def is_typed_on(app):
        return app.screen.query_one(Input).value == "te"

    over_help = ("question_mark", shows(HelpScreen), "ctrl+x", forced(3), "escape")
    over_palette = ("ctrl+p", "t", "ctrl+x", forced(4), "e", is_typed_on, "escape")
    over_words = ("w", "ctrl+x", forced(5))
    steps = ("ctrl+x", forced(1), "f12", forced(2), *over_help, *over_palette, *over_words)
    played(desk(), *steps, views=views)


def test_help_shows_the_live_keys_and_the_top_line_stays_live_over_it():
    views = FixedViews()

    def has_all(app):
        shown = text(app)
        for action in (*EVERYWHERE, *WatchScreen.ACTIONS):
            # All charts fit here, so there is no key for more of them; nor is there any replay.
            live = action.id != "watch.charts" and not action.id.startswith("replay.")
            assert (action.sentence in shown) is live, action.id
        assert "Next dive go on" in shown  # a name as wide as its column stays apart from its sentence

    lost = (views.then(replace(view(), recording=None)), lambda app: "NOT RECORDING" in top(app))
    killed = desk(was_killed=lambda _: True)
    played(
        killed, "f1", shows(HelpScreen), has_all, *lost, "escape", shows(WatchScreen), views=views, size=WIDE
    )


def test_help_says_what_each_mark_means_in_whole_sentences_where_it_is_narrow():
    async def work(app, pilot):
        for row in SCREENS:
            await play(app, pilot, row.key, "question_mark")
            app.screen.query_one(VerticalScroll).scroll_end(animate=False)
            await pilot.pause()
            shown = " ".join(" ".join(line.strip(" │▁▂▃▄▅▆▇█▎▊") for line in text(app).splitlines()).split())
            assert all(f"{mark} {meaning}" in shown for mark, meaning in row.make.LEGEND), row.id
            await pressed(pilot, "escape")

    run(made(FixedViews(), desk=desk()), (80, 48), work)


@pytest.mark.parametrize(("keymap", "key"), [({}, "Ctrl-Q"), ({"app.quit": "f10"}, "f10")])
def test_ctrl_c_leaves_nothing_and_says_in_plain_words_which_key_does(keymap, key):
    assert played(desk(), "ctrl+c", keymap=keymap) == [f"{key} leaves; the recording goes on"]


def test_a_key_of_the_keymap_works_stands_in_help_and_in_its_place_and_the_default_no_longer_does():
    views = FixedViews()

    def has_order(app):
        line = text(app).splitlines()[-1]
        words = ["Identify", "Words", "FF off", "Help", "Palette", "Theme", "Quit"]
        assert [word for word in re.split(r"\s+\S+\s(?=[A-Z])", line) if word] == words

    def has_key(app):
        line = next(line for line in text(app).splitlines() if "sent until" in line)
        return "f9" in line and "Ctrl-X" not in line

    dead = ("ctrl+x", lambda _: views.forced == 0)
    keymap = {"ff.off": "f9", "app.help": "f5"}
    played(desk(), has_order, *dead, "f9", "f5", has_key, "f9", views=views, keymap=keymap, size=WIDE)
    assert views.forced == 2


async def in_palette(app, words=""):
    """What the palette holds on this screen, by name; where words are given, what it finds for them."""
    provider = next(iter(app.COMMANDS))(app.screen)
    return {hit.text: hit async for hit in (provider.search(words) if words else provider.discover())}


def test_the_palette_has_every_action():
    live = [action for action in WatchScreen.ACTIONS if not action.id.startswith("replay.")]
    of_screen = {action.words for action in (*EVERYWHERE, *OPENING, *live)} - {"Palette"}
    of_screen |= {f"Theme: {name}" for name in ORDER}
    of_others = {"Dives: Note", "Identify: Cancel", "Parameters: Upload", "Validate: Validate"}

    async def holds_all(app):
        names = set(await in_palette(app))
        return names >= of_screen | of_others and not any(name.startswith("Watch: ") for name in names)

    played(desk(), holds_all)


def test_what_moves_is_in_the_palette_of_its_own_screen_while_it_does_something():
    def offers(*offered):
        async def step(app):
            return {words for words in ("Slower", "Newest") if words in await in_palette(app, words)} == {
                *offered
            }

        return step

    played(desk(), offers(), "2", offers("Newest"))
    played(desk(replay=StillReplay()), offers("Slower"))


@pytest.mark.parametrize(
    ("name", "title", "notices"),
    [
        ("Identify: Cancel", "Identify", ["Cancel: there is nothing for it to do on Identify now"]),
        ("Dives: Read", "Dives", []),
    ],
)
def test_an_action_of_another_screen_opens_that_screen_and_says_where_it_does_nothing_there(
    name, title, notices
):
    verbs = FakeVerbs()

    async def chosen(app):
        await (await in_palette(app))[name].command()

    assert played(desk(verbs), chosen, lambda app: app.screen.title == title) == notices
    assert [words[0] for words in verbs.words] == ["dives"] * (title == "Dives")


def test_one_key_goes_through_the_themes_and_each_is_kept():
    kept = []
    steps = [
        step for name in ORDER[1:] + ORDER[:1] for step in ("t", lambda app, name=name: app.theme == name)
    ]
    played(desk(), *steps, keep_theme=kept.append)
    assert kept == ["light", "sunlight", "dark"]


def test_the_digit_keys_and_the_tabs_open_screens():
    async def work(app, pilot):
        await play(app, pilot, "2", Sees("DIVES"), "1", "w", Lacks("surge u"))
        await pilot.click(TopLine, offset=(3, 1))
        await play(app, pilot, lambda _: None, shows(WatchScreen), Sees("surge u"))

    run(made(FixedViews(), desk=desk()), NARROW, work)
    assert [row.key for row in SCREENS] == [str(n + 1) for n in range(len(SCREENS))]


def widgets():
    """The widgets in memory."""
    gc.collect()
    return [thing for thing in gc.get_objects() if issubclass(type(thing), Widget)]


async def forgotten(pilot, opened):
    """Wait until a screen and its widgets are gone from memory, however busy the computer is."""
    end_s = time.monotonic() + SOON_S
    while any(ref() is not None for ref in opened):
        assert time.monotonic() < end_s, [ref() for ref in opened]
        gc.collect()
        await pilot.pause()


def test_screens_that_come_and_go_leave_nothing_in_memory(monkeypatch):
    # What is closed is let go by timers.
    monkeypatch.setattr("textual.app.wait_for_idle", wait_for_idle)
    monkeypatch.setattr("textual.pilot.wait_for_idle", wait_for_idle)

    async def come_and_go(app, pilot):
        await pressed(pilot, "question_mark")
        assert isinstance(app.screen, HelpScreen)
        opened = [weakref.ref(widget) for widget in (app.screen, *app.screen.walk_children())]
        await pressed(pilot, "escape")
        await pilot.resize_terminal(*WIDE)
        await pilot.resize_terminal(*NARROW)
        return opened

    async def work(app, pilot):
        opened, counts = await come_and_go(app, pilot), []
        for _ in range(2):
            # Textual keeps the last screen that was closed, until another is.
            before, opened = opened, await come_and_go(app, pilot)
            await forgotten(pilot, before)
            counts.append(len(widgets()))
        assert counts[1] <= counts[0]

    run(made(FixedViews()), NARROW, work)


def test_help_that_is_longer_than_the_screen_is_laid_out_twice_as_it_opens(monkeypatch):
    """Each layout draws the whole screen, and the key waits for it."""
    layouts, lay_out = [], HelpScreen._refresh_layout

    def counted(screen, *how, **which):
        layouts.append(screen)
        return lay_out(screen, *how, **which)

    def is_longer(app):
        return app.screen.query_one(VerticalScroll).max_scroll_y > 0

    monkeypatch.setattr(HelpScreen, "_refresh_layout", counted)
    played(desk(), "question_mark", shows(HelpScreen), is_longer, Sees("Keys"))
    assert len(layouts) == 2


def test_the_first_drawing_of_help_has_its_keys_in_their_place(monkeypatch):
    """The key's answer would else wait for the second, which is a screen later."""
    drawings, refresh = [], HelpScreen._compositor_refresh

    def seen(screen):
        drawings.append((text(screen.app), screen.query_one("#help-box").region.y))
        return refresh(screen)

    monkeypatch.setattr(HelpScreen, "_compositor_refresh", seen)
    played(desk(), "question_mark", shows(HelpScreen), size=WIDE)
    (first, above), *others = drawings
    assert "Everywhere" in first
    assert {above} == {y for _, y in others}
