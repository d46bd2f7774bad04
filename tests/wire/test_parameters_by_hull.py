"""A set of coefficients flies on the hull alone on which it was committed, and is never lost."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from bridge.onboard.parameters import ParameterServer
from bridge.onboard.store import OF_ANOTHER, hull_mark
from bridge.vehicle.config import Configuration, Device, Prior, Sensors, ThrustCurve, Thruster, Vehicle, Water
from bridge.vehicle.parameters import vehicle_table
from bridge.wire.status_codes import Topic, coded

SHAPE = Configuration(
    dry_mass_kg=72.0,
    inertia_kgm2=(2.0, 9.0, 10.0),
    thrusters=(Thruster((1.0, 0.0, 0.0), (0.0, 0.2, 0.0)), Thruster((1.0, 0.0, 0.0), (0.0, -0.2, 0.0))),
)
OURS = Vehicle("ours", {"survey": SHAPE, "hovering": replace(SHAPE, dry_mass_kg=75.0)})
MOVED = replace(SHAPE, thrusters=(SHAPE.thrusters[0], Thruster((1.0, 0.0, 0.0), (0.0, -0.3, 0.0))))
REBUILT = replace(OURS, configurations={**OURS.configurations, "survey": MOVED})
BOTH_ACTS = ["F8 FF both: acts once armed"]
TABLE = "voltage_v,pwm_us,thrust_n\n16,1100,-40\n16,1500,0\n16,1900,{most}\n"


def with_shape(**changes: object) -> Vehicle:
    return replace(OURS, configurations={**OURS.configurations, "survey": replace(SHAPE, **changes)})


def with_curve(**changes: object) -> Vehicle:
    return replace(OURS, thrust_curve=ThrustCurve(**changes))


def boot(path: Path, vehicle: Vehicle = OURS) -> ParameterServer:
    return ParameterServer(path, vehicle_table(vehicle), hull=hull_mark(vehicle, path.parent))


def upload(server: ParameterServer, mass_kg: float) -> int:
    """A set of that mass, committed; its CRC."""
    for name in server.names[:24]:
        assert server.write(name, mass_kg, False) is None
    assert server.write("FF_COMMIT", float(server.staged_crc), False) is None
    return server.active_crc


def nothing_flies(server: ParameterServer) -> bool:
    return (server.active_crc, server.active(0), server.active(1)) == (0, {}, {})


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "parameters.json"


def test_a_set_stays_at_zero_on_another_hull_says_why_and_what_to_do_and_comes_back_with_its_own(path):
    first = boot(path)
    crc = upload(first, 80.0)
    assert first.write("FF_MODE", 3.0, False) is None
    kept = path.read_bytes()

    other = boot(path, REBUILT)
    assert nothing_flies(other)
    assert other.mode == 0
    assert {other.value(name) for name in other.names[:24]} == {0.0}
    assert tuple(other.take_texts()) == OF_ANOTHER
    assert all(len(text) <= 50 for text in OF_ANOTHER)
    assert "upload a set of this vehicle, or put the vehicle file back" in other.trouble
    assert path.read_bytes() == kept

    back = boot(path)
    assert (back.active_crc, back.mode, back.active(0)) == (crc, 3, first.active(0))
    assert (back.take_texts(), back.trouble) == (BOTH_ACTS, "")


def test_a_fresh_upload_puts_it_right_and_each_hull_keeps_its_own_set_and_mode(path):
    ours = upload(boot(path), 80.0)
    rebuilt = boot(path, REBUILT)
    theirs = upload(rebuilt, 90.0)
    assert rebuilt.active(0)["M_u"] == 90.0
    assert rebuilt.write("FF_MODE", 1.0, False) is None
    for _ in range(2):
        again = boot(path)
        assert (again.active_crc, again.mode, again.take_texts()) == (ours, 0, [])
        again = boot(path, REBUILT)
        assert (again.active_crc, again.mode, again.take_texts()) == (theirs, 1, [])


def test_a_set_that_fits_no_more_takes_none_of_another_hull_with_it(path):
    """As after an update of the program that has other parameters."""
    upload(boot(path), 80.0)
    theirs = upload(boot(path, REBUILT), 90.0)
    stored = json.loads(path.read_text())
    stored["hulls"][hull_mark(OURS, path.parent)]["active"]["FF0_OLD"] = 1.0
    path.write_text(json.dumps(stored))
    ours = boot(path)
    assert nothing_flies(ours)
    assert ours.take_texts()[0] == "stored parameters unusable, no set in force"
    assert "FF0_OLD" in path.with_name("parameters.json.damaged-1").read_text()
    assert boot(path, REBUILT).active_crc == theirs
    again = upload(ours, 81.0)
    assert (boot(path).active_crc, boot(path, REBUILT).active_crc) == (again, theirs)


def test_a_set_flies_on_after_an_update_that_knows_more_effects(path):
    before = boot(path)
    upload(before, 80.0)
    assert before.write("FF_MODE", 2.0, False) is None
    stored = json.loads(path.read_text())
    for name in ("FF0_T_OHM", "FF1_T_OHM"):
        del stored["hulls"][hull_mark(OURS, path.parent)]["active"][name]
    path.write_text(json.dumps(stored))
    after = boot(path)
    assert (after.active(0), after.active(1), after.mode) == (before.active(0), before.active(1), 2)
    assert (after.value("FF0_T_OHM"), after.trouble) == (0.0, "")


def test_a_set_that_lacks_a_mass_or_a_damping_does_not_fly(path):
    upload(boot(path), 80.0)
    stored = json.loads(path.read_text())
    del stored["hulls"][hull_mark(OURS, path.parent)]["active"]["FF0_D_U"]
    path.write_text(json.dumps(stored))
    assert nothing_flies(boot(path))


def test_a_mode_that_is_set_meanwhile_loses_no_set_and_the_reason_is_said_again(path):
    crc = upload(boot(path), 80.0)
    other = boot(path, REBUILT)
    other.take_texts()
    assert other.write("FF_MODE", 2.0, False) is None
    assert tuple(other.take_texts()) == OF_ANOTHER
    assert other.write("FF_MODE", 3.0, True) is not None
    assert tuple(other.take_texts()) == (coded(Topic.NO_SET, "FF_MODE refused: no active set"), *OF_ANOTHER)
    again = boot(path, REBUILT)
    assert nothing_flies(again)
    assert (again.mode, tuple(again.take_texts())) == (2, OF_ANOTHER)
    assert (boot(path).active_crc, boot(path).mode) == (crc, 0)


def test_the_model_of_the_file_does_not_fly_in_place_of_a_set_of_another_hull(path):
    upload(boot(path), 80.0)
    other = boot(path, with_shape(dry_mass_kg=90.0, model={"M_u": 120.0, "D_u": 30.0}))
    assert nothing_flies(other)
    assert other.value("FF0_M_U") == 120.0
    assert other.write("FF_COMMIT", float(other.staged_crc), False) is None
    assert other.active(0)["M_u"] == 120.0


def test_where_no_set_was_ever_committed_the_model_of_each_file_waits_for_a_commit(path):
    first = boot(path, with_shape(model={"M_u": 80.0}))
    assert first.write("FF_MODE", 3.0, False) is None
    for mass_kg in (80.0, 85.0):
        same = boot(path, with_shape(model={"M_u": mass_kg}))
        assert (same.value("FF0_M_U"), same.active(0), same.mode, same.take_texts()) == (mass_kg, {}, 3, [])
    other = boot(path, with_shape(dry_mass_kg=90.0, model={"M_u": 120.0}))
    assert (other.value("FF0_M_U"), other.active(0), other.mode, other.take_texts()) == (120.0, {}, 0, [])


@pytest.mark.parametrize(
    "other",
    [
        with_shape(dry_mass_kg=72.1),
        with_shape(inertia_kgm2=(2.0, 9.0, 10.1)),
        with_shape(centre_of_gravity_below_buoyancy_m=0.01),
        with_shape(net_buoyancy_n=1.0),
        with_shape(thruster_limit_n=35.0),
        with_shape(thrusters=SHAPE.thrusters[:1]),
        with_shape(thrusters=SHAPE.thrusters[::-1]),
        with_shape(thrusters=(replace(SHAPE.thrusters[0], gain=0.9), SHAPE.thrusters[1])),
        with_shape(thrusters=(replace(SHAPE.thrusters[0], direction=(-1.0, 0.0, 0.0)), SHAPE.thrusters[1])),
        with_shape(thrusters=(replace(SHAPE.thrusters[0], position_m=(0.0, 0.2, 0.01)), SHAPE.thrusters[1])),
        with_shape(veh_cfg=3),
        replace(OURS, configurations={"survey": SHAPE}),
        replace(OURS, configurations=dict(reversed(OURS.configurations.items()))),
        with_curve(voltage_v=14.0),
        with_curve(lag_s=0.1),
        with_curve(delay_s=0.1),
        with_curve(kind="quadratic"),
        with_curve(forward_n_s2=0.02),
        with_curve(reverse_n_s2=0.02),
    ],
)
def test_whatever_a_model_hangs_on_tells_a_hull_from_another(other, tmp_path):
    assert hull_mark(other, tmp_path) != hull_mark(OURS, tmp_path)


@pytest.mark.parametrize(
    "same",
    [
        replace(OURS, name="renamed", system_id=7),
        replace(OURS, water=Water(1025.0, 1003.0)),
        replace(OURS, sensors=Sensors(dvl=Device("wayfinder", port="/dev/ttyUSB7"))),
        replace(OURS, configurations={"north sea": SHAPE, "hovering": OURS.configurations["hovering"]}),
        with_shape(model={"M_u": 80.0}, priors={"M_u": Prior(80.0, 3.0)}, gains="other"),
        with_shape(dry_mass_std_kg=2.0, veh_cfg=0),
        with_curve(scale_std=0.02),
    ],
)
def test_nothing_else_of_a_vehicle_file_does(same, tmp_path):
    assert hull_mark(same, tmp_path) == hull_mark(OURS, tmp_path)


def test_a_thrust_table_counts_by_its_numbers_and_not_by_its_name_or_comments(tmp_path):
    def marked(name: str, text: str) -> str:
        (tmp_path / name).write_text(text)
        return hull_mark(with_curve(file=name), tmp_path)

    plain = marked("a.csv", TABLE.format(most=50))
    assert marked("b.csv", "# measured in spring\n" + TABLE.format(most="50.0")) == plain
    assert marked("a.csv", TABLE.format(most=50.1)) != plain


def test_the_mark_of_a_hull_stays_what_it_was_from_one_version_to_the_next(tmp_path):
    assert hull_mark(with_curve(kind="quadratic"), tmp_path) == "219d9978d5e69281"


@pytest.mark.parametrize(
    ("mode", "said"), [(0, []), (1, []), (2, ["F8 FF ff: acts once armed"]), (3, BOTH_ACTS)]
)
def test_a_vehicle_says_at_its_start_once_that_the_feed_forward_acts(path, mode, said):
    first = boot(path)
    upload(first, 80.0)
    assert first.write("FF_MODE", float(mode), False) is None
    again = boot(path)
    assert again.take_texts() == said
    assert again.take_texts() == []
    lowered = boot(path)
    assert lowered.write("FF_MODE", 0.0, False) is None
    assert lowered.take_texts() == []


def test_a_vehicle_without_a_set_says_nothing_of_a_feed_forward_that_cannot_act(path):
    assert boot(path).write("FF_MODE", 3.0, False) is None
    assert boot(path).take_texts() == []
