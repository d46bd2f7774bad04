"""The screen Parameters: a vehicle that can't be read or may not be written to, and when it is read again."""

from dataclasses import replace

import pytest
from made_parameters import FakeVehicle, plan, receipt
from parameters_shown import NARROW, done, line_of, on_screen, typed, views
from screen_text import made, run, text

from gcs_plugin.params.files import Sidecar, write_parameters, write_sidecar
from tui.app.desk import Desk
from tui.app.jobs import Jobs


def test_a_vehicle_that_cannot_be_read_says_why_and_what_to_do():
    vehicle = FakeVehicle({}, said=("no vehicle's HEARTBEAT within 5 s",))

    async def work(app, pilot):
        assert "no vehicle's HEARTBEAT" in text(app)
        assert "Nothing was written by this reading; ^r reads the vehicle again." in text(app)
        app.set_keymap({"parameters.read": "f7"})
        await pilot.pause()
        app._show()
        await pilot.pause()
        assert "Nothing was written by this reading; f7 reads the vehicle again." in text(app)
        await typed(app, pilot, "u")
        assert "type" not in text(app)

    on_screen(vehicle, work)


def test_what_was_read_long_ago_is_read_again_before_it_is_asked():
    vehicle, now = FakeVehicle(), [0.0]

    async def work(app, pilot):
        now[0] = 121.0
        await typed(app, pilot, "u")
        assert "type 7 and Enter" in text(app)

    on_screen(vehicle, work, now_s=lambda: now[0])
    assert len(vehicle.words) == 2


def test_a_file_that_was_written_again_since_is_shown_again_and_not_sent(tmp_path):
    file = tmp_path / "identified.param"
    file.write_text("FF1_M_U,1\n", "utf-8")
    vehicle = FakeVehicle(plan(file=str(file)))

    async def work(app, pilot):
        app.desk.dive, app.desk.param = tmp_path, file
        await typed(app, pilot, "1", "5", "u", "7")
        read = len(vehicle.words)
        file.write_text("FF1_M_U,2\n", "utf-8")
        await typed(app, pilot, "enter")
        assert len(vehicle.words) == read + 1
        assert "has changed since it was shown" in " ".join(text(app).split())

    on_screen(vehicle, work)
    assert vehicle.writes == []


@pytest.mark.slow
def test_values_of_another_vehicle_are_refused_with_the_reason_and_the_key_uploads_nothing(tmp_path):
    param = tmp_path / "identified.param"
    write_parameters(param, {"FF0_M_U": 98.0})
    write_sidecar(param, Sidecar("a" * 64, "b" * 64, "hovering", "likelihood", "1", vehicle="someone else's"))
    at = Desk("ruvifist:hovering", tmp_path, tmp_path, param=param, jobs=Jobs())

    async def work(app, pilot):
        await typed(app, pilot, "5")
        said = " ".join(text(app).split())
        assert "is of vehicle 'someone else's', and" in said
        assert "nothing was sent" in said
        await typed(app, pilot, "u")
        assert "Nothing can be sent, for what is said above" in text(app)
        await typed(app, pilot, "y", "enter")
        assert at.jobs.state("params upload") is None

    run(made(views(), desk=at), NARROW, work)


def flies(shown, number, age_s):
    """The vehicle said so long ago that it flies this set."""
    picture = replace(shown.shown.picture, active_set=number, active_set_age_s=age_s)
    shown.shown = replace(shown.shown, picture=picture)


def read_again(vehicle):
    return len([words for words in vehicle.words if "--yes" not in words]) - 1


def test_once_another_set_flies_the_vehicle_is_read_again_and_choices_stay():
    now_s, shown, vehicle = [0.0], views(), FakeVehicle()

    async def work(app, pilot):
        await typed(app, pilot, "space", "down")
        now_s[0] = 12.0
        flies(shown, 4711, 2.0)
        await done(app, pilot)
        assert read_again(vehicle) == 0
        vehicle.compared = plan(active_crc=0.0)
        flies(shown, 0, 2.0)
        await done(app, pilot)
        assert read_again(vehicle) == 1
        await done(app, pilot)
        assert "6 of 7 chosen" in text(app)
        assert line_of(app, "FF1_M_U").startswith(" □")
        now_s[0] = 30.0
        flies(shown, 4711, 25.0)  # as it was told before it was read
        await done(app, pilot)
        assert read_again(vehicle) == 1

    on_screen(vehicle, work, shown=shown, now_s=lambda: now_s[0])


def test_another_vehicles_set_reads_nothing_again():
    now_s, shown, vehicle = (
        [0.0],
        views(),
        FakeVehicle(plan(vehicle={"system": 7, "component": 1, "armed": False})),
    )

    async def work(app, pilot):
        now_s[0] = 12.0
        flies(shown, 0, 2.0)
        await done(app, pilot)
        assert read_again(vehicle) == 0

    on_screen(vehicle, work, shown=shown, now_s=lambda: now_s[0])


def test_the_own_upload_is_shown_until_another_set_flies():
    now_s, shown = [0.0], views()
    vehicle = FakeVehicle(written=receipt() | {"active_crc": 13247})

    async def work(app, pilot):
        await typed(app, pilot, "u", "7", "enter")
        now_s[0] = 5.0
        flies(shown, 13247, 1.0)
        await done(app, pilot)
        assert "✓ applied" in text(app)
        now_s[0] = 20.0
        flies(shown, 0, 1.0)
        await done(app, pilot)
        await done(app, pilot)
        assert "✓" not in text(app)
        assert read_again(vehicle) == 1

    on_screen(vehicle, work, shown=shown, now_s=lambda: now_s[0])


@pytest.mark.parametrize("how", ["the link is lost", "it is another vehicle", "it was long ago"])
def test_what_the_vehicle_held_is_dimmed_and_dated_once_it_may_no_longer_be_so(how):
    now_s, shown = [0.0], views()

    async def work(app, pilot):
        value = "     96.5 "
        assert role_at(app, "FF1_M_U ", value) != "stale"
        assert "was read" not in text(app)
        fresh = shown.shown.picture
        now_s[0] = 121.0 if how == "it was long ago" else 31.0
        link = replace(fresh.links[0], **LINKS[how])
        shown.shown = replace(shown.shown, picture=replace(fresh, links=(link,)))
        app._show()
        await pilot.pause()
        age = "2 min ago" if how == "it was long ago" else "31 s ago"
        assert f"what the vehicle holds was read {age}" in text(app)
        assert f"on the vehicle {age} 96.5 kg" in text(app)
        assert role_at(app, "FF1_M_U ", value) == "stale"
        now_s[0] = 1.0
        shown.shown = replace(shown.shown, picture=fresh)
        app._show()
        await pilot.pause()
        assert "was read" not in text(app)

    on_screen(FakeVehicle(), work, shown=shown, now_s=lambda: now_s[0])


LINKS = {
    "the link is lost": {"lost": True, "age_s": 31.0},
    "it is another vehicle": {"system": 7},
    "it was long ago": {},
}


def role_at(app, name, value):
    """The role of the vehicle's value on the line of that name."""
    table = app.screen._table(80, 20)
    line = next(line for line in table if any(name.strip() == text.strip() for text, _ in line))
    return next(role for text, role in line if text.strip() == value.strip())
