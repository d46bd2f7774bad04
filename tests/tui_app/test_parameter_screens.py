"""The screen Parameters: how it looks, what each of its lines tells, and what is told of those without room."""

import pytest
from made_parameters import FakeVehicle, plan
from parameters_shown import line_of, on_screen, typed
from screen_text import text


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
