"""A view-only app: what is not marked as looking does not run, whatever way it is asked for."""

import asyncio

import pytest
from made_diagnosis import DIVE, desk_with
from made_view import FixedViews
from screen_text import made, pressed, run, settled, text
from textual.actions import parse
from textual.command import CommandPalette

from tui.app.jobs import Jobs
from tui.app.keys import LOOKS, Action, Gate, looking_work, name_of
from tui.app.screens.table import PLACES, SCREENS

ACTIONS = {action.id: action for place in PLACES for action in place}
NARROW = (80, 24)


class FakeScreen:
    """With an action of ours of each kind."""

    def action_look(self):
        pass

    def action_fly(self):
        pass


FakeScreen.action_look.__module__ = FakeScreen.action_fly.__module__ = "tui.app.screens.fake"
LOOK = Action("fake.look", "l", "Look", "look", LOOKS)
FLY = Action("fake.fly", "f", "Fly", "fly")


def test_what_is_not_marked_as_looking_is_refused():
    gate = Gate((LOOK, FLY))
    assert not gate.refuses(FakeScreen(), "look")
    assert gate.refuses(FakeScreen(), "fly")


def test_an_action_that_stands_in_no_table_is_refused():
    assert Gate(()).refuses(FakeScreen(), "look")


def test_moving_about_is_textuals_own_and_goes_on():
    from textual.containers import VerticalScroll

    assert not Gate(()).refuses(VerticalScroll(), "scroll_down")


def test_the_feed_forward_is_not_even_forced_off():
    assert not ACTIONS["ff.off"].looks


def test_no_method_is_called_both_by_an_action_that_looks_and_by_one_that_does_more():
    looking = {name_of(action) for action in ACTIONS.values() if action.looks}
    assert looking.isdisjoint(name_of(action) for action in ACTIONS.values() if not action.looks)


@pytest.mark.parametrize("row", SCREENS, ids=lambda row: row.id)
def test_no_action_that_does_more_than_look_reaches_its_method(row, monkeypatch):
    done = []

    async def work(app, pilot):
        await app.run_action(f"app.open('{row.id}')")
        await pilot.pause()
        for action in ACTIONS.values():
            where, name, _ = parse(action.call)
            target = app if where == "app" else app.screen
            if action.looks or not hasattr(type(target), f"action_{name}"):
                continue
            method = getattr(type(target), f"action_{name}")

            def instead(*_, name=name):
                done.append(name)

            instead.__module__ = method.__module__
            monkeypatch.setattr(type(target), f"action_{name}", instead)
            await app.run_action(action.call, app.screen)
        await pressed(pilot, "ctrl+x")

    run(made(FixedViews(), view_only=True), NARROW, work)
    assert done == []


def test_a_refused_key_is_answered_by_a_sentence_and_the_mark_is_on_top():
    views = FixedViews()

    async def work(app, pilot):
        assert text(app).splitlines()[0].startswith(" VIEW ONLY ")
        await pressed(pilot, "ctrl+x")
        assert [one.message for one in app._notifications] == ["VIEW ONLY: nothing is done from here"]

    run(made(views, view_only=True), NARROW, work)
    assert views.forced == 0


@pytest.mark.parametrize("row", SCREENS, ids=lambda row: row.id)
def test_footer_and_palette_offer_only_what_looks(row):
    async def work(app, pilot):
        await app.run_action(f"app.open('{row.id}')")
        await settled(app, pilot)
        for _ in range(500):  # the footer comes with a later turn
            if "? Help" in text(app):
                break
            await pilot.pause()
        assert "? Help" in text(app)
        assert all(
            ACTIONS[one.binding.id].looks for one in app.screen.active_bindings.values() if one.binding.id
        )
        assert "FF off" not in text(app)
        names = {hit.text async for hit in next(iter(app.COMMANDS))(app.screen).discover()}
        assert names.isdisjoint(
            {"FF off", "Record", "Parameters: Upload", "Identify: Identify", "Dives: Note"}
        )
        assert "Theme" in names

    run(made(FixedViews(), view_only=True), NARROW, work)


@pytest.mark.parametrize(
    ("key", "said"),
    [
        ("3", "not identified yet; this view only looks, and identifies nothing"),
        ("4", f"{DIVE}; this view only looks, and can't diagnose it."),
        ("6", f"{DIVE}; this view only looks, and can't validate it."),
        ("5", "so there is nothing to compare; this view only looks, and identifies nothing"),
    ],
)
def test_no_sentence_offers_what_a_view_can_t_begin(key, said, tmp_path):
    async def work(app, pilot):
        await pressed(pilot, key)
        assert said in " ".join(text(app).split())

    run(made(FixedViews(), desk=desk_with(tmp_path, found=False), view_only=True), NARROW, work)


def test_the_palette_is_no_way_around():
    views = FixedViews()

    async def work(app, pilot):
        await pressed(pilot, "ctrl+p", *"FF off")
        assert isinstance(app.screen, CommandPalette)
        await pilot.app.workers.wait_for_complete()
        await pressed(pilot, "enter", "enter")

    run(made(views, view_only=True), NARROW, work)
    assert views.forced == 0


def test_a_theme_is_used_and_not_kept():
    kept = []

    async def work(app, pilot):
        await pressed(pilot, "t")
        assert app.theme == "light"

    run(made(FixedViews(), keep_theme=kept.append, view_only=True), NARROW, work)
    assert kept == []


def test_where_all_may_be_done_nothing_is_marked():
    views = FixedViews()

    async def work(app, pilot):
        assert "VIEW ONLY" not in text(app)
        await pressed(pilot, "ctrl+x")

    run(made(views), NARROW, work)
    assert views.forced == 1


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
