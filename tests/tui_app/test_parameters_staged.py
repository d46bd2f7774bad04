"""The screen Parameters: what the vehicle holds and does not fly."""

from made_parameters import FakeVehicle, plan, staged
from parameters_shown import line_of, on_screen, typed
from screen_text import text


def test_what_is_staged_and_does_not_fly_says_so_first_and_is_asked_for_as_that():
    vehicle = FakeVehicle(staged())

    async def work(app, pilot):
        shown = text(app)
        assert "8 staged" in shown
        assert "▲ staged, and none of it flies: commit it with u" in shown
        assert shown.index("commit it with u") < shown.index("FF1_M_U")
        assert line_of(app, "FF1_D_U").split()[-1] == "staged"
        assert " same" not in shown
        await typed(app, pilot, "u")
        assert "To put 8 lines in force on vehicle 1, type 8 and Enter" in text(app)
        await typed(app, pilot, "8", "enter")
        assert "staged, and none of it flies" not in text(app)
        assert "✓ equal" in line_of(app, "FF1_D_U")

    on_screen(vehicle, work)
    assert "--only" not in vehicle.writes[0]


def test_an_upload_that_was_cut_is_still_told_as_staged_once_the_vehicle_is_read_again():
    vehicle = FakeVehicle(staged(changed=("FF1_M_W",), active_crc=4711.0))

    async def work(app, pilot):
        assert "7 staged, 1 of 1 chosen" in text(app)
        assert "▲ staged, and another set flies (4711): commit it with u" in text(app)
        await typed(app, pilot, "u")
        assert "To write 1 line and put the 7 staged in force on vehicle 1, type 8 and" in text(app)
        await typed(app, pilot, "escape", "a", "u")
        assert "To put 7 lines in force on vehicle 1, type 7 and Enter" in text(app)
        await typed(app, pilot, "7", "enter")

    on_screen(vehicle, work)
    (words,) = vehicle.writes
    assert words[words.index("--only") + 1 :] == tuple(
        one["name"] for one in plan()["parameters"] if one["name"] != "FF1_M_W"
    )


def test_a_vehicle_that_never_had_a_set_shows_no_staged_values():
    told = [{**one, "present": 0.0, "verdict": "changed"} for one in plan()["parameters"]]

    async def work(app, _):
        assert "staged" not in text(app)

    on_screen(FakeVehicle(plan(parameters=told, active_crc=0.0, staged_crc=8205)), work)
