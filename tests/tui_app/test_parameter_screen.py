"""The screen Parameters: how its lines read, when the vehicle is read again, which lines are chosen and stay so."""

import os
from dataclasses import replace

import pytest
from made_parameters import (
    NARROW,
    PARAM,
    FakeVehicle,
    desk,
    done,
    line_of,
    on_screen,
    plan,
    receipt,
    typed,
    views,
)
from screen_text import made, run, text

from bridge.vehicle.config import CONFIGS
from gcs_plugin.params.files import Sidecar, write_parameters, write_sidecar
from tui.app.desk import Desk
from tui.app.jobs import Jobs
from tui.app.screens import parameters_lines as lines


def test_each_line_tells_vehicle_file_interval_last_accepted_and_change():
    async def work(app, _):
        row = ["▶■", "FF1_M_U", "kg", "96.5", "111.52", "2.1", "96.5", "+7.2"]
        assert line_of(app, "FF1_M_U").split() == row
        assert "  N m/(rad/s) " in line_of(app, "FF1_D_R")
        assert line_of(app, "FF1_D_U").split()[-1] == "same"
        assert "7 of 7 chosen" in text(app)

    on_screen(FakeVehicle(), work)


def test_between_numbers_there_is_always_a_blank():
    one = {
        **plan()["parameters"][0],
        "present": -0.000123456,
        "target": 16.075,
        "low95": 16.075 - 0.51403,
        "high95": 16.075 + 0.51403,
        "accepted": -123456.0,
        "change": 1234567.0,
    }

    async def work(app, _):
        told = line_of(app, "FF1_M_U").split()
        assert told[3:] == ["-0.00012", "16.075", "0.514", "-1.2e+05", "+1e+06"]

    on_screen(FakeVehicle(plan(parameters=[one])), work)


def test_only_the_side_on_which_lines_are_left_out_is_told():
    one = plan()["parameters"][0]
    many = [{**one, "name": f"FF1_{n}"} for n in range(30)]

    async def work(app, pilot):
        assert "lines below" in text(app)
        assert "above" not in text(app)
        await typed(app, pilot, "end")
        assert "lines above" in text(app)
        assert "below" not in text(app)

    on_screen(FakeVehicle(plan(parameters=many)), work)


def test_lines_that_have_no_room_are_counted_and_a_question_hides_none():
    async def work(app, pilot):
        assert "lines above" not in text(app)
        await typed(app, pilot, "u")
        assert all(row["name"] in text(app) for row in plan()["parameters"])
        await typed(app, pilot, "escape")
        await pilot.resize_terminal(80, 15)
        await typed(app, pilot, "end")
        shown = [row["name"] for row in plan()["parameters"] if f"{row['name']}  " in text(app)]
        assert f"{len(plan()['parameters']) - len(shown)} lines above" in text(app)

    on_screen(FakeVehicle(), work)


@pytest.mark.parametrize(
    ("verdict", "told"),
    [("not on the vehicle", "absent"), ("implausible", "unlikely"), ("refused", "refused")],
)
def test_a_verdict_stands_in_a_whole_word_on_a_narrow_line(verdict, told):
    one = {**plan()["parameters"][0], "verdict": verdict, "reason": "why so"}

    async def work(app, _):
        assert line_of(app, one["name"]).rstrip().endswith(f"  {told}")
        assert f"{verdict}: why so." in text(app)

    on_screen(FakeVehicle(plan(parameters=[one])), work)


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


def test_the_upload_writes_the_chosen_lines_once_their_number_is_typed():
    vehicle = FakeVehicle()

    async def work(app, pilot):
        await typed(app, pilot, "space", "down", "space", "u")
        assert "type 5 and Enter" in text(app)
        await typed(app, pilot, "5", "enter")
        assert "applied: 7 parameters written" in text(app)
        assert "✓ equal" in line_of(app, "FF1_D_V")

    on_screen(vehicle, work)
    (words,) = vehicle.writes
    assert words[:4] == ("params", "upload", str(PARAM), "--yes")
    assert words[words.index("--vehicle") + 1] == str(CONFIGS / "vehicles" / "ruvifist.yaml")
    only = words[words.index("--only") + 1 :]
    assert only == ("FF1_M_W", "FF1_I_R", "FF1_D_V", "FF1_D_W", "FF1_D_R")
    assert "--armed" not in words


def test_what_was_left_out_or_taken_by_name_stays_so_when_the_same_file_is_read_again():
    async def work(app, pilot):
        await typed(app, pilot, "space", "down", "space", "ctrl+r")
        assert "5 of 7 chosen" in text(app)
        assert line_of(app, "FF1_M_U").startswith(" □")
        assert line_of(app, "FF1_M_W").startswith(" ■")
        await typed(app, pilot, "r", "escape", "escape")
        assert "5 of 7 chosen" in text(app)
        await typed(app, pilot, "u", "5", "enter", "ctrl+r")
        assert "5 of 7 chosen" in text(app)

    on_screen(FakeVehicle(), work)


def test_of_a_file_that_is_another_since_all_lines_are_chosen_again(tmp_path):
    file = tmp_path / "identified.param"
    write_parameters(file, {"FF1_M_U": 111.5})
    vehicle = FakeVehicle(plan(file=str(file)))

    async def work(app, pilot):
        await typed(app, pilot, "space", "ctrl+r")
        assert "6 of 7 chosen" in text(app)
        os.utime(file, ns=(1, 1))
        await typed(app, pilot, "ctrl+r")
        assert "7 of 7 chosen" in text(app)

    shown = desk(vehicle)
    shown.dive, shown.param = tmp_path, file

    async def begin(app, pilot):
        await typed(app, pilot, "5")
        await work(app, pilot)

    run(made(views(), desk=shown), NARROW, begin)


def test_no_line_chosen_asks_nothing():
    async def work(app, pilot):
        await typed(app, pilot, "a", "u")
        assert "no line is chosen" in text(app)
        await typed(app, pilot, "a")
        assert "7 of 7 chosen" in text(app)

    on_screen(FakeVehicle(), work)


def test_a_click_goes_to_a_line_and_a_second_one_chooses_it():
    async def work(app, pilot):
        await pilot.click("#parameters-table", offset=(5, 4))
        await pilot.pause()
        assert line_of(app, "FF1_I_R").startswith("▶■")
        await pilot.click("#parameters-table", offset=(5, 4))
        await pilot.pause()
        assert line_of(app, "FF1_I_R").startswith("▶□")

    on_screen(FakeVehicle(), work)


WHY = "its standard deviation, 153, is as large as the value: the dive did not tell it"


def with_an_implausible_mass():
    first, *others = plan()["parameters"]
    return plan(parameters=[first | {"verdict": "implausible", "reason": WHY}, *others])


def test_an_implausible_line_says_why_and_is_left_out_of_an_upload():
    vehicle = FakeVehicle(with_an_implausible_mass())
    name = plan()["parameters"][0]["name"]

    async def work(app, pilot):
        assert lines.LEFT in line_of(app, name)
        assert WHY in " ".join(text(app).replace("│", " ").split())
        await typed(app, pilot, "u")
        await typed(app, pilot, "6", "enter")

    on_screen(vehicle, work)
    (words,) = vehicle.writes
    assert name not in words
    assert words.count("--only") == 1
    assert "--accept-implausible" not in words


def test_half_of_a_model_asks_nothing_until_both_halves_are_chosen_or_neither():
    rows = [
        one | {"present": 0.0} if one["coefficient"] in ("I_r", "D_r") else one
        for one in plan()["parameters"]
    ]
    vehicle = FakeVehicle(plan(parameters=rows))
    why = "FF1_D_R: without FF1_I_R the feed-forward of yaw stays off: choose FF1_I_R too, or neither"

    async def work(app, pilot):
        await pilot.click("#parameters-table", offset=(5, 4))
        await pilot.pause()
        await pilot.click("#parameters-table", offset=(5, 4))
        await pilot.pause()
        assert line_of(app, "FF1_I_R").startswith("▶□")
        await typed(app, pilot, "u")
        assert why in " ".join(text(app).replace("│", " ").split())
        assert not app.screen.has_class("-asking")
        await typed(app, pilot, "space", "u")
        await typed(app, pilot, "7", "enter")

    on_screen(vehicle, work)
    (words,) = vehicle.writes
    assert "--only" not in words


def test_an_implausible_line_that_is_chosen_is_written_for_a_harder_word():
    vehicle = FakeVehicle(with_an_implausible_mass())
    name = plan()["parameters"][0]["name"]

    async def work(app, pilot):
        await typed(app, pilot, "space", "u")
        assert "type DOUBTED 7 and Enter" in text(app)
        await typed(app, pilot, *"DOUBTED7", "enter")

    on_screen(vehicle, work)
    (words,) = vehicle.writes
    assert words[-2:] == ("--accept-implausible", name)
    assert "--only" not in words
