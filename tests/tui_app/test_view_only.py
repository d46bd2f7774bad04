"""A view-only app: what is not marked as looking does not run, whatever way it is asked for."""

import asyncio

import pytest
from fake_verbs import desk
from made_diagnosis import DIVE, desk_with
from made_view import FixedViews
from screen_text import NARROW, Lacks, Sees, made, play, played, run, shows, text, worked
from textual.actions import parse
from textual.command import CommandPalette
from textual.containers import VerticalScroll

from tui.app.jobs import Jobs
from tui.app.keys import LOOKS, Action, Gate, looking_work, name_of
from tui.app.screens.table import PLACES, SCREENS

REFUSED = {"FF off", "Record", "Parameters: Upload", "Identify: Identify", "Dives: Note"}
ACTIONS = {action.id: action for place in PLACES for action in place}


class FakeScreen:
    """With an action of ours of each kind."""

    def action_look(self):
        pass

    def action_fly(self):
        pass


FakeScreen.action_look.__module__ = FakeScreen.action_fly.__module__ = "tui.app.screens.fake"
LOOK = Action("fake.look", "l", "Look", "look", LOOKS)
FLY = Action("fake.fly", "f", "Fly", "fly")


@pytest.mark.parametrize(
    ("table", "target", "name", "refused"),
    [
        ((LOOK, FLY), FakeScreen(), "look", False),
        ((LOOK, FLY), FakeScreen(), "fly", True),
        ((), FakeScreen(), "look", True),
        ((), VerticalScroll(), "scroll_down", False),
    ],
    ids=["looks", "does more", "stands in no table", "is Textual's own"],
)
def test_only_what_the_table_marks_as_looking_may_run(table, target, name, refused):
    assert Gate(table).refuses(target, name) is refused


def test_no_method_is_called_both_by_an_action_that_looks_and_by_one_that_does_more():
    looking = {name_of(action) for action in ACTIONS.values() if action.looks}
    assert looking.isdisjoint(name_of(action) for action in ACTIONS.values() if not action.looks)
    assert not ACTIONS["ff.off"].looks


def test_nothing_on_a_screen_reaches_a_method_that_does_more_or_is_offered_that_would(monkeypatch):
    done = []

    async def asked_on(app, row):
        live = app.screen.active_bindings.values()
        assert all(ACTIONS[key.binding.id].looks for key in live if key.binding.id), row.id
        names = {hit.text async for hit in next(iter(app.COMMANDS))(app.screen).discover()}
        assert "Theme" in names
        assert names.isdisjoint(REFUSED), row.id
        for action in ACTIONS.values():
            where, name, _ = parse(action.call)
            target = app if where == "app" else app.screen
            if action.looks or not hasattr(type(target), f"action_{name}"):
                continue
            method = getattr(type(target), f"action_{name}")

            def instead(*_, name=name):
                done.append((row.id, name))

            instead.__module__ = method.__module__
            monkeypatch.setattr(type(target), f"action_{name}", instead)
            await app.run_action(action.call, app.screen)

    async def work(app, pilot):
        for row in SCREENS:
            await play(app, pilot, row.key, Sees("? Help"), Lacks("FF off"))
            assert type(app.screen) is row.make
            await asked_on(app, row)

    run(made(FixedViews(), desk=desk(), view_only=True), NARROW, work)
    assert done == []


@pytest.mark.parametrize(("view_only", "forced"), [(True, 0), (False, 1)])
def test_a_refused_key_is_answered_by_a_sentence_and_the_mark_is_on_top(view_only, forced):
    views = FixedViews()

    def is_marked(app):
        return text(app).startswith(" VIEW ONLY ") is view_only

    notices = played(desk(), is_marked, "ctrl+x", views=views, view_only=view_only)
    assert notices == ["VIEW ONLY: nothing is done from here"] * view_only
    assert views.forced == forced


def test_no_sentence_offers_what_a_view_can_t_begin(tmp_path):
    sentences = {
        "3": "not identified yet; this view only looks, and identifies nothing",
        "4": f"{DIVE}; this view only looks, and can't diagnose it.",
        "6": f"{DIVE}; this view only looks, and can't validate it.",
        "5": "so there is nothing to compare; this view only looks, and identifies nothing",
    }
    steps = [step for key, sentence in sentences.items() for step in (key, Sees(sentence))]
    played(desk_with(tmp_path, diagnosed=False), *steps, view_only=True)


def test_the_palette_is_no_way_around():
    views = FixedViews()

    asks = ("ctrl+p", *"FF off", shows(CommandPalette), worked)
    played(desk(), *asks, "enter", "enter", views=views, view_only=True)
    assert views.forced == 0


def test_a_theme_is_used_and_not_kept():
    kept = []
    played(desk(), "t", lambda app: app.theme == "light", keep_theme=kept.append, view_only=True)
    assert kept == []


def test_a_job_that_is_started_all_the_same_runs_nothing():
    async def work():
        jobs = Jobs(looking_work)
        jobs.start("params", ["params", "upload", "x.param"])
        while jobs.runs("params"):
            await asyncio.sleep(0)
        return jobs.state("params").done

    done = asyncio.run(work())
    assert done.code == 1
    assert done.said == ("VIEW ONLY: seatrial params is not run from here",)
