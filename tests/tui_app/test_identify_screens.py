"""The screen Identify: from a dive to its result by one key, cancelled by another."""

import asyncio
import os
from functools import partial
from pathlib import Path

import made_identified
import pytest
from made_dives import DECK, HOVERING, FakeVerbs, desk
from made_identified import PAGE, answer, leave, passes
from made_view import UNIX_S, FixedViews
from screen_text import Lacks, Sees, made, play, run, text

from bridge import exit_codes
from bridge.reports import UNKEPT, Report
from tui.app.screens.dives import DivesScreen
from tui.app.screens.identify import IdentifyScreen
from tui.app.screens.identify_lines import places, words_for
from tui.app.screens.parameters import ParametersScreen
from tui.app.screens.watch import WatchScreen

SIZES = ((80, 24), (160, 50))
NARROW = SIZES[0]
WAITING = partial(FakeVerbs, tells=passes())


@pytest.fixture
def dive(tmp_path, monkeypatch):
    """A dive's folder, under a name that is the same each time."""
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / "dives" / "2026-11-21T0352Z-hovering"
    folder.mkdir(parents=True)
    (folder / "telemetry.tlog").write_bytes(b"")
    return folder


@pytest.fixture
def identified(dive):
    """One with a result of yesterday beside it."""
    at = places(dive)
    leave(words_for(str(dive), "", at))
    for path in at.values():
        if path.exists():
            os.utime(path, (UNIX_S, UNIX_S))
    return dive


async def shown(app, pilot, count=2):
    for _ in range(count):
        app._show()
        await pilot.pause()


async def ended(app, pilot):
    while any(app.desk.jobs.runs(verb) for verb in ("dives", "identify")):
        await pilot.pause()
    await shown(app, pilot)


def on_screens(at, *steps, settle=shown, size=NARROW):
    run(made(FixedViews(), desk=at), size, lambda app, pilot: play(app, pilot, settle, *steps))


def is_on(screen):
    return lambda app: isinstance(app.screen, screen)


def key_line(app):
    return text(app).splitlines()[-1]


def test_two_keys_identify_the_dive_that_one_comes_from(dive):
    verbs = FakeVerbs({"dives": [HOVERING | {"folder": str(dive)}], "identify": {}}, leave=leave)
    told = (is_on(IdentifyScreen), Sees("11 of 12 coefficients"), lambda app: app.desk.dive == dive)
    on_screens(desk(verbs), "2", "i", *told, settle=ended)
    assert verbs.words[-1] == words_for(str(dive), "ruvifist:hovering", places(dive))


def test_it_goes_on_while_another_screen_is_looked_at_and_is_cancelled_by_a_key(dive):
    runs = (Sees("IDENTIFYING"), Sees("pass 3"), lambda app: "i Identify" not in key_line(app))
    stopped = (lambda app: not app.desk.jobs.runs("identify"), Sees("stopped by you"))
    again = (lambda app: "i Identify" in key_line(app),)
    on_screens(desk(WAITING(), dive=dive), "3", "i", "1", "3", *runs, "x", *stopped, *again)


def test_the_curves_can_be_looked_at_afterwards_and_escape_goes_back(dive):
    verbs = FakeVerbs({"identify": {}}, tells=passes(), leave=leave)
    looked = ("c", Sees("┤"), "escape", Lacks("┤"))
    on_screens(desk(verbs, dive=dive), "3", "i", Lacks("┤"), *looked, settle=ended)


def test_the_result_is_there_and_goes_to_parameters_while_its_page_is_still_written(dive):
    verbs = FakeVerbs({}, tells=(*passes(), answer(), answer("pinn"), PAGE))

    def runs(app):
        return app.desk.jobs.runs("identify")

    def leave_values(_):
        leave(words_for(str(dive), "", places(dive)))

    told = (runs, Sees("11 of 12 coefficients"), Sees("25 % writing the page"))
    on_screens(desk(verbs, dive=dive), "3", leave_values, "i", *told, "p", is_on(ParametersScreen), runs)
    assert verbs.words[-1][:3] == ("params", "diff", str(places(dive)["--param"]))


class Held(FakeVerbs):
    """Identifies only once it is let go."""

    def __init__(self, *of_verbs):
        super().__init__(*of_verbs)
        self.go = asyncio.Event()

    async def __call__(self, words, hear):
        if words[0] == "identify":
            await self.go.wait()
        return await super().__call__(words, hear)


def on_held_screens(at, *steps):
    """Play the steps, let go, and see where the app is then."""
    *before, at_last = steps

    async def work(app, pilot):
        await play(app, pilot, shown, *before)
        at.jobs._work.go.set()
        await play(app, pilot, ended, lambda _: None, at_last)

    run(made(FixedViews(), desk=at), NARROW, work)


@pytest.mark.parametrize(
    ("code", "screen"), [(exit_codes.DONE, ParametersScreen), (exit_codes.NO + 1, IdentifyScreen)]
)
def test_parameters_asked_for_while_it_runs_come_with_its_values_and_never_with_older_ones(
    code, screen, identified
):
    at = desk(Held({"identify": {}}, code), dive=identified)
    on_held_screens(at, "3", "i", "p", Sees("then parameters"), is_on(screen))


def test_who_leaves_the_screen_is_not_called_to_parameters(identified):
    on_held_screens(desk(Held({"identify": {}}), dive=identified), "3", "i", "p", "1", is_on(WatchScreen))


def test_a_run_that_fails_says_why_and_an_older_result_stays(identified):
    why = "the recording is too short; dive longer"
    verbs = FakeVerbs({"identify": None}, exit_codes.NO + 1, (why,))
    told = (Sees(why), Sees("11 of 12 coefficients"))
    on_screens(desk(verbs, dive=identified), "3", "i", *told, settle=ended)


def test_without_a_dive_or_a_vehicle_file_it_says_what_to_do(dive):
    elsewhere, unnamed = desk(WAITING()), desk(WAITING(), dive=dive.relative_to(Path.cwd()))
    elsewhere.out, unnamed.vehicle = dive / "none", ""
    on_screens(elsewhere, "3", "i", Sees("holds no dive yet; a recording makes one"))
    on_screens(unnamed, "3", "i", Sees("names no vehicle file"))


def test_a_dive_that_was_not_identified_says_which_key_does(dive):
    told = Sees("not identified yet; i identifies it")
    on_screens(desk(WAITING(), dive=dive), "2", "3", told, "2", is_on(DivesScreen))


def on_watch(dives, *steps):
    """The dive that was identified last, and what was said."""
    verbs, notices = FakeVerbs({"dives": dives, "identify": {}}, leave=leave), []

    def note(app):
        notices.extend(notice.message for notice in app._notifications)

    on_screens(desk(verbs), *steps, is_on(IdentifyScreen), note, settle=ended)
    return verbs.words[-1][1], notices


def test_one_key_on_watch_identifies_the_dive_just_made_wherever_the_mark_stood(dive):
    older = HOVERING | {"folder": str(dive.with_name("older")), "name": "older", "began_unix_s": 0.0}
    chosen = ("2", "end", "enter", "1", lambda app: app.desk.dive == Path(older["folder"]))
    assert on_watch([older, HOVERING | {"folder": str(dive)}], *chosen, "i") == (str(dive), [])


def test_a_newer_recording_that_can_tell_nothing_is_said_to_be_passed_over(dive):
    said = ["hovering; deck, recorded since, can tell nothing yet"]
    assert on_watch([HOVERING | {"folder": str(dive)}, DECK], "i") == (str(dive), said)


def test_a_second_one_is_not_begun_while_one_runs(dive):
    verbs = FakeVerbs({"dives": [HOVERING | {"folder": str(dive)}]}, tells=passes())

    async def listed(app, pilot):
        while app.desk.jobs.runs("dives"):
            await pilot.pause()
        await shown(app, pilot)

    on_screens(desk(verbs), *("1", "i") * 2, is_on(IdentifyScreen), settle=listed)
    assert [words[0] for words in verbs.words].count("identify") == 1


WHY = "full/identified.json: the JSON can't be written (No space left on device); give another file"


def unkept(count=11):
    """A verb that identified so many coefficients and finds no room for any of its files."""
    missing = [one["name"] for one in made_identified.parameters()[count:]]
    found = made_identified.identified(parameters=made_identified.parameters(missing))
    page = (WHY, "full/identified.html: the report can't be written (No space left on device)")
    tells = (*passes(), Report(UNKEPT, 1.0, WHY, result=found), PAGE)
    return FakeVerbs({"identify": None}, exit_codes.BAD_INPUT, page, tells)


def test_values_that_find_no_room_on_the_disk_are_shown_and_said_to_be_kept_nowhere(dive):
    values = (Sees("11 of 12 coefficients identified"), Sees("its values are below, and kept nowhere"))
    why = (Sees(WHY), Sees("identified.html: the report can't be written"))
    at = desk(unkept(), dive=dive)
    on_screens(at, "3", "i", *values, *why, Lacks("not identified yet"), settle=ended, size=SIZES[1])


def test_values_of_before_are_neither_shown_nor_uploaded_for_newer_ones_without_room(identified):
    at = desk(unkept(5), dive=identified)
    kept = (Sees("5 of 12 coefficients identified"), "p", is_on(IdentifyScreen))
    on_screens(at, "3", "i", "p", *kept, lambda _: at.param is None, settle=ended, size=SIZES[1])
