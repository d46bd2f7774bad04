"""The screen Parameters: what it tells while the vehicle is written to, and what became of it."""

import json

import pytest
from made_parameters import FakeVehicle, plan, receipt
from parameters_shown import NARROW, done, line_of, on_screen, typed, views
from screen_text import made, pressed, run, text

from bridge.reports import WRITING, Report
from tui.app.desk import Desk


def test_what_the_vehicle_said_before_a_writing_is_not_told_after_it():
    note = "no set is in force on the vehicle (FF_ACTIVE is 0)"
    vehicle = FakeVehicle(plan(notes=[note]))

    async def work(app, pilot):
        assert note in " ".join(text(app).split())
        await typed(app, pilot, "u", "7", "enter")
        assert "✓ applied" in text(app)
        assert note not in " ".join(text(app).split())

    on_screen(vehicle, work)


def test_what_was_refused_is_told_line_by_line():
    failed = receipt("refused", "FF1_D_V refused: the vehicle permits it not", failed=("FF1_D_V",))
    vehicle = FakeVehicle(written=failed, code=1)

    async def work(app, pilot):
        await typed(app, pilot, "u", "7", "enter")
        assert "▲ refused: FF1_D_V refused" in text(app)
        assert line_of(app, "FF1_D_V  ").split()[-2:] == ["▲", "failed"]
        await typed(app, pilot, *["down"] * 5)
        assert "FF1_D_V refused: the vehicle permits it not." in text(app)

    on_screen(vehicle, work)


def test_what_came_into_force_is_told_where_its_receipt_could_not_be_written():
    why = (
        "its receipt still says that it was begun: r-receipt.json: can't be written (No space left on device)"
    )
    vehicle = FakeVehicle(written=receipt() | {"unkept": why}, code=2)

    async def work(app, pilot):
        await typed(app, pilot, "u", "7", "enter")
        shown = " ".join(text(app).split())
        assert "▲ applied: 7 parameters written and read back, set 13247 is active" in shown
        assert why in shown

    on_screen(vehicle, work)


def test_writing_goes_on_while_another_screen_is_looked_at_and_its_end_is_seen():
    vehicle = FakeVehicle(waits=True)

    async def work(app, pilot):
        await typed(app, pilot, "u", "7")
        await pressed(pilot, "enter", "1")
        vehicle.go.set()
        await done(app, pilot)
        await typed(app, pilot, "5")
        assert "applied: 7 parameters written" in text(app)

    on_screen(vehicle, work)
    assert len(vehicle.writes) == 1


def test_the_app_does_not_leave_while_it_writes():
    vehicle = FakeVehicle(waits=True)

    async def work(app, pilot):
        await typed(app, pilot, "u", "7")
        await pressed(pilot, "enter", "1", "ctrl+q")
        assert not app._exit
        assert [one.message for one in app._notifications] == [
            "parameters are being written; leave once that has ended"
        ]
        vehicle.go.set()
        await done(app, pilot)
        await pressed(pilot, "ctrl+q")
        assert app._exit

    on_screen(vehicle, work)


def test_an_upload_that_was_never_finished_is_told_as_the_app_begins(tmp_path):
    begun = {
        "outcome": "begun",
        "vehicle": {"system": 1, "component": 1},
        "parameters": [{"name": "FF1_M_U", "target": 96.5, "outcome": "begun"}],
        "active_crc": 13247,
    }
    receipt = tmp_path / "2026-11-20T101500Z-receipt.json"
    receipt.write_text(json.dumps(begun), encoding="utf-8")

    async def look(app, pilot):
        await pilot.pause()
        (notice,) = app._notifications
        assert notice.message == (
            "warning: the upload that was begun at 2026-11-20T101500Z was never finished; Parameters tells more"
        )

    run(made(views(), desk=Desk(receipts=tmp_path)), NARROW, look)


@pytest.mark.parametrize(
    ("key", "typed_", "words"), [("u", "7", "u tries it again"), ("r", "7", "r tries it again")]
)
def test_a_writing_that_found_no_vehicle_says_that_nothing_was_written_and_how_to_try_again(
    key, typed_, words
):
    vehicle = FakeVehicle(written={}, code=3, said=("vehicle 1: no HEARTBEAT for 5 s; check the link",))

    async def work(app, pilot):
        await typed(app, pilot, key, typed_, "enter")
        assert "no HEARTBEAT for 5 s" in text(app)
        assert f"Nothing was written; {words}." in text(app)

    on_screen(vehicle, work)


@pytest.mark.parametrize(
    ("of", "stage", "told"),
    [
        ("looking for the vehicle", "", "The vehicle is read before anything is written."),
        (WRITING, "STAGE", "The parameters are being written."),
        (WRITING, "COMMIT", "All lines are read back; the vehicle is told to fly them."),
        (WRITING, "UNDO", "It failed: what was written is taken back."),
    ],
)
def test_what_goes_on_while_it_is_written_is_told_by_its_stage_however_little_is_done(of, stage, told):
    vehicle = FakeVehicle(tells=(Report(of, 0.0, "x", stage=stage),), waits=True)

    async def work(app, pilot):
        await typed(app, pilot, "r", "7")
        await pressed(pilot, "enter")
        app._show()
        await pilot.pause()
        assert told in text(app)
        vehicle.go.set()
        await done(app, pilot)

    on_screen(vehicle, work)
