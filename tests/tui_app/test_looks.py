"""Each screen looks as it was kept at two sizes, and Watch in each theme and without colour."""

import os

import pytest
from made_diagnosis import desk_with
from made_dives import FakeVerbs, desk
from made_identified import leave, passes
from made_parameters import FakeVehicle, done, staged, told_lines, typed, views
from made_parameters import desk as with_vehicle
from made_replay import StillReplay
from made_validation import validated_desk
from made_view import UNIX_S, FixedViews
from screen_text import check, made, pressed, run
from soak import rest_in_soak

from gcs_plugin.watch.picture import Armed
from tui.app.screens.identify_lines import places, words_for
from tui.app.themes import ORDER

NARROW, WIDE = (80, 24), (160, 50)
SIZES = pytest.mark.parametrize("size", rest_in_soak((NARROW, WIDE)))


def looks(name, app, size, *keys, after=()):
    """Press keys and hold the screen against the one kept under its name; then press those in `after`, and so on."""

    async def look(app, pilot):
        await pressed(pilot, *keys)
        while app.desk.jobs.runs("dives"):
            await pilot.pause()
        app._show()
        await pilot.pause()
        check(f"{name}-{size[0]}x{size[1]}", app)
        for key, suffix in after:
            await pressed(pilot, key)
            app._show()
            await pilot.pause()
            check(f"{name}-{size[0]}x{size[1]}-{suffix}", app)

    run(app, size, look)


@SIZES
def test_watch_and_a_replay_on_it(size):
    looks("watch", made(FixedViews()), size)
    looks("replay", made(FixedViews(), desk=desk(replay=StillReplay())), size)


def test_the_second_page_of_charts_and_all_words():
    after = (("c", "second-page"), ("w", "words"))
    looks("watch", made(FixedViews()), NARROW, after=after)


@pytest.mark.parametrize("theme", ORDER[1:])
def test_the_other_themes(theme):
    async def look(app, _):
        check(f"watch-80x24-{theme}", app)

    run(made(FixedViews(), theme=theme), NARROW, look)


def test_without_colour(monkeypatch):
    monkeypatch.setenv("NO_COLOR", "1")

    async def look(app, _):
        check("watch-80x24-no-colour", app)

    run(made(FixedViews()), NARROW, look)


def test_help():
    looks("help", made(FixedViews()), WIDE, "question_mark")


@SIZES
def test_dives(size):
    looks("dives", made(FixedViews(), desk=desk()), size, "2")


@SIZES
def test_an_identification_and_a_run(size, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    dive = tmp_path / "dives" / "2026-11-21T0352Z-hovering"
    dive.mkdir(parents=True)
    (dive / "telemetry.tlog").write_bytes(b"")
    leave(words_for(str(dive), "", places(dive)))
    for path in places(dive).values():
        if path.exists():
            os.utime(path, (UNIX_S, UNIX_S))

    app = made(FixedViews(), desk=desk(FakeVerbs(tells=passes()), dive=dive))

    async def look(app, pilot):
        for key, name in (("3", "identify"), ("i", "identify-runs")):
            await pressed(pilot, key)
            for _ in range(2):
                app._show()
                await pilot.pause()
            check(f"{name}-{size[0]}x{size[1]}", app)

    run(app, size, look)


@SIZES
def test_diagnose_and_validate(size, tmp_path):
    looks("diagnose", made(FixedViews(), desk=desk_with(tmp_path / "diagnosed")), size, "4")
    after = (("s", "curves"),) if size == NARROW else ()
    looks("validate", made(FixedViews(), desk=validated_desk(tmp_path / "validated")), size, "6", after=after)


def keys_typed(name, app, size, *keys):
    async def look(app, pilot):
        await typed(app, pilot, *keys)
        check(name, app)

    run(app, size, look)


@SIZES
def test_parameters(size):
    name = f"parameters-{size[0]}x{size[1]}"
    keys_typed(name, made(views(), desk=with_vehicle()), size, "5", "down", "down")


def test_parameters_of_an_armed_vehicle_and_those_that_are_staged():
    armed = made(views(Armed.ARMED), desk=with_vehicle())
    keys_typed("parameters-80x24-armed", armed, NARROW, "5", "u", "7")
    waiting = made(views(), desk=with_vehicle(FakeVehicle(staged(changed=("FF1_M_W",)))))
    keys_typed("parameters-80x24-staged", waiting, NARROW, "5", "u")


def test_writing_and_what_became_of_it():
    vehicle = FakeVehicle(tells=told_lines(3, 0.43), waits=True)

    async def look(app, pilot):
        await typed(app, pilot, "5", "u", "7")
        await pressed(pilot, "enter")
        app._show()
        await pilot.pause()
        check("parameters-80x24-writing", app)
        vehicle.go.set()
        await done(app, pilot)
        check("parameters-80x24-written", app)

    run(made(views(), desk=with_vehicle(vehicle)), NARROW, look)
