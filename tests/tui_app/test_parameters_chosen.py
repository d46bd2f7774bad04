"""The screen Parameters: which lines are chosen, what stays so, and which of them an upload names."""

import os

from made_parameters import PARAM, FakeVehicle, desk, plan
from parameters_shown import NARROW, line_of, on_screen, typed, views
from screen_text import made, run, text

from bridge.vehicle.config import CONFIGS
from gcs_plugin.params.files import write_parameters
from tui.app.screens import parameters_lines as lines


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


def test_of_all_lines_none_is_named_so_that_the_model_goes_whole():
    vehicle = FakeVehicle()
    on_screen(vehicle, lambda app, pilot: typed(app, pilot, "u", "7", "enter"))
    assert "--only" not in vehicle.writes[0]


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
