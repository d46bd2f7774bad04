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
from screen_text import made, pressed, run, text

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


def test_two_keys_identify_the_dive_that_one_comes_from(dive):
    verbs = FakeVerbs({"dives": [HOVERING | {"folder": str(dive)}], "identify": {}}, leave=leave)

    async def work(app, pilot):
        await pilot.press("2", "i")
        await ended(app, pilot)
        assert isinstance(app.screen, IdentifyScreen)
        assert "11 of 12 coefficients" in text(app)
        assert app.desk.dive == dive

    run(made(FixedViews(), desk=desk(verbs)), NARROW, work)
    assert verbs.words[-1] == words_for(str(dive), "ruvifist:hovering", places(dive))


def test_it_goes_on_while_another_screen_is_looked_at_and_is_cancelled_by_a_key(dive):
    async def work(app, pilot):
        await pressed(pilot, "3", "i", "1", "3")
        await shown(app, pilot)
        assert "IDENTIFYING" in text(app)
        assert "pass 3" in text(app)
        assert "i Identify" not in text(app).splitlines()[-1]
        await pressed(pilot, "x")
        await ended(app, pilot)
        assert not app.desk.jobs.runs("identify")
        assert "stopped by you" in text(app)
        assert "i Identify" in text(app).splitlines()[-1]

    run(made(FixedViews(), desk=desk(WAITING(), dive=dive)), NARROW, work)


def test_the_curves_can_be_looked_at_afterwards_and_escape_goes_back(dive):
    verbs = FakeVerbs({"identify": {}}, tells=passes(), leave=leave)

    async def work(app, pilot):
        await pressed(pilot, "3", "i")
        await ended(app, pilot)
        assert "┤" not in text(app)
        await pressed(pilot, "c")
        await shown(app, pilot)
        assert "┤" in text(app)
        await pressed(pilot, "escape")
        await shown(app, pilot)
        assert "┤" not in text(app)

    run(made(FixedViews(), desk=desk(verbs, dive=dive)), NARROW, work)


def test_the_result_is_there_and_goes_to_parameters_while_its_page_is_still_written(dive):
    verbs = FakeVerbs({}, tells=(*passes(), answer(), answer("pinn"), PAGE))

    async def work(app, pilot):
        await pressed(pilot, "3")
        leave(words_for(str(dive), "", places(dive)))
        await pressed(pilot, "i")
        await shown(app, pilot)
        assert app.desk.jobs.runs("identify")
        assert "11 of 12 coefficients" in text(app)
        assert "25 %  writing the page" in text(app)
        await pressed(pilot, "p")
        assert isinstance(app.screen, ParametersScreen)
        assert app.desk.jobs.runs("identify")

    run(made(FixedViews(), desk=desk(verbs, dive=dive)), NARROW, work)
    assert verbs.words[-1][:3] == ("params", "diff", str(places(dive)["--param"]))


class Held(FakeVerbs):
    """Identifies only once it is let go."""

    go = None

    async def __call__(self, words, hear):
        if words[0] == "identify":
            self.go = asyncio.Event()
            await self.go.wait()
        return await super().__call__(words, hear)


@pytest.mark.parametrize(
    ("code", "screen"), [(exit_codes.DONE, ParametersScreen), (exit_codes.NO + 1, IdentifyScreen)]
)
def test_parameters_asked_for_while_it_runs_come_with_its_values_and_never_with_older_ones(
    code, screen, identified
):
    verbs = Held({"identify": {}}, code)

    async def work(app, pilot):
        await pressed(pilot, "3", "i", "p")
        await shown(app, pilot)
        assert "then parameters" in text(app)
        verbs.go.set()
        while app.desk.jobs.runs("identify"):
            await pilot.pause()
        await shown(app, pilot)
        assert isinstance(app.screen, screen)

    run(made(FixedViews(), desk=desk(verbs, dive=identified)), NARROW, work)


def test_who_leaves_the_screen_is_not_called_to_parameters(identified):
    verbs = Held({"identify": {}})

    async def work(app, pilot):
        await pressed(pilot, "3", "i", "p", "1")
        verbs.go.set()
        while app.desk.jobs.runs("identify"):
            await pilot.pause()
        await shown(app, pilot)
        assert isinstance(app.screen, WatchScreen)

    run(made(FixedViews(), desk=desk(verbs, dive=identified)), NARROW, work)


def test_a_run_that_fails_says_why_and_an_older_result_stays(identified):
    said = ("the recording is too short; dive longer",)
    verbs = FakeVerbs({"identify": None}, exit_codes.NO + 1, said)

    async def work(app, pilot):
        await pressed(pilot, "3", "i")
        await ended(app, pilot)
        assert "the recording is too short; dive longer" in text(app)
        assert "11 of 12 coefficients" in text(app)

    run(made(FixedViews(), desk=desk(verbs, dive=identified)), NARROW, work)


def test_without_a_dive_or_a_vehicle_file_it_says_what_to_do(dive):
    async def none(app, pilot):
        await pressed(pilot, "3", "i")
        await shown(app, pilot)
        assert "holds no dive yet; a recording makes one" in text(app)

    async def unnamed(app, pilot):
        app.desk.vehicle = ""
        await pressed(pilot, "3", "i")
        await shown(app, pilot)
        assert "names no vehicle file" in text(app)

    elsewhere = desk(WAITING())
    elsewhere.out = dive / "none"
    run(made(FixedViews(), desk=elsewhere), NARROW, none)
    run(made(FixedViews(), desk=desk(WAITING(), dive=dive.relative_to(Path.cwd()))), NARROW, unnamed)


def test_a_dive_that_was_not_identified_says_which_key_does(dive):
    async def work(app, pilot):
        await pressed(pilot, "2", "3")
        await shown(app, pilot)
        assert "not identified yet; i identifies it" in text(app)
        await pressed(pilot, "2")
        assert isinstance(app.screen, DivesScreen)

    run(made(FixedViews(), desk=desk(WAITING(), dive=dive)), NARROW, work)


def on_watch(dives, work, **what):
    verbs = FakeVerbs({"dives": dives, "identify": {}}, leave=leave)

    async def begin(app, pilot):
        await work(app, pilot)
        await ended(app, pilot)
        assert isinstance(app.screen, IdentifyScreen)
        return [notice.message for notice in app._notifications]

    said = run(made(FixedViews(), desk=desk(verbs, **what)), NARROW, begin)
    return verbs.words[-1][1], said


def test_one_key_on_watch_identifies_the_dive_just_made_wherever_the_mark_stood(dive):
    older = HOVERING | {"folder": str(dive.with_name("older")), "name": "older", "began_unix_s": 0.0}

    async def work(app, pilot):
        await pressed(pilot, "2", "end", "enter", "1")
        await shown(app, pilot)
        assert app.desk.dive == Path(older["folder"])
        await pressed(pilot, "i")
        await ended(app, pilot)

    assert on_watch([older, HOVERING | {"folder": str(dive)}], work) == (str(dive), [])


def test_a_newer_recording_that_can_tell_nothing_is_said_to_be_passed_over(dive):
    async def work(app, pilot):
        await pressed(pilot, "i")
        await ended(app, pilot)

    named, said = on_watch([HOVERING | {"folder": str(dive)}, DECK], work)
    assert named == str(dive)
    assert said == ["hovering; deck, recorded since, can tell nothing yet"]


def test_a_second_one_is_not_begun_while_one_runs(dive):
    verbs = FakeVerbs({"dives": [HOVERING | {"folder": str(dive)}]}, tells=passes())

    async def work(app, pilot):
        for _ in range(2):
            await pressed(pilot, "1", "i")
            while app.desk.jobs.runs("dives"):
                await pilot.pause()
            await shown(app, pilot)
        assert isinstance(app.screen, IdentifyScreen)

    run(made(FixedViews(), desk=desk(verbs)), NARROW, work)
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
    async def work(app, pilot):
        await pressed(pilot, "3", "i")
        await ended(app, pilot)
        seen = " ".join(text(app).split())
        assert "11 of 12 coefficients identified" in seen
        assert WHY in seen
        assert "identified.html: the report can't be written" in seen
        assert "its values are below, and kept nowhere" in seen
        assert "not identified yet" not in seen

    run(made(FixedViews(), desk=desk(unkept(), dive=dive)), SIZES[1], work)


def test_values_of_before_are_neither_shown_nor_uploaded_for_newer_ones_without_room(identified):
    async def work(app, pilot):
        await pressed(pilot, "3", "i", "p")
        await ended(app, pilot)
        assert "5 of 12 coefficients identified" in text(app)
        await pressed(pilot, "p")
        assert isinstance(app.screen, IdentifyScreen)
        assert app.desk.param is None

    run(made(FixedViews(), desk=desk(unkept(5), dive=identified)), SIZES[1], work)
