"""A vehicle file proposed by an ArduSub's own parameters, and motors that the motion contradicts."""

import json
import math
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from built_recordings import recording, servos, write
from fakes.shared import shared
from pymavlink.dialects.v20 import ardupilotmega as mav

from bridge.errors import ConfigError, LogError
from bridge.firmware.ardusub import ARDUSUB, wiring
from bridge.vehicle.config import load_vehicle
from identify.checks.actuation.motors import miswired, miswired_doubts
from identify.checks.actuation.thrust_response import mounted_otherwise
from identify.dive import Dive, Signal
from identify.doubt import Outcome
from identify.ingest.mavlink.autopilot_parameters import autopilot_parameters
from identify.ingest.open import read_dive
from identify.run.vehicle_of_log import guess
from tui.cli import main

DATA = Path(__file__).resolve().parents[1] / "data"
FILE = load_vehicle("bluerov2")
PLAIN = {"FRAME_CONFIG": 1.0} | {f"SERVO{n}_FUNCTION": 32.0 + n for n in range(1, 7)}
MOTORS = {"vectored": 6, "vectored_6dof": 8}


def tlog(path, values, autopilot=mav.MAV_AUTOPILOT_ARDUPILOTMEGA, moving=()):
    """A `.tlog` with a heartbeat and parameters of the autopilot, and one of a companion's own; `moving` are the pulses
    and the rate of yaw of each tenth of a second after them."""
    stamped = [(0.0, 1, 1, mav.MAVLink_heartbeat_message(12, autopilot, 0, 0, 4, 3))]
    for n, (name, value) in enumerate(values.items()):
        message = mav.MAVLink_param_value_message(name.encode(), value, 9, len(values), n)
        stamped.append((0.0, 1, 1, message))
    stamped.append((0.0, 1, 191, mav.MAVLink_param_value_message(b"FF_MODE", 0.0, 9, 1, 0)))
    for n, (pulses, turn) in enumerate(moving):
        stamped.append((1 + n / 10, 1, 1, servos(100_000 * n, pulses)))
        stamped.append((1 + n / 10, 1, 1, mav.MAVLink_attitude_message(100 * n, 0, 0, 0, 0, 0, turn)))
    return write(path, recording(stamped))


def test_the_autopilots_parameters_are_read_and_no_companions(tmp_path):
    assert autopilot_parameters(tlog(tmp_path / "a.tlog", PLAIN)) == (ARDUSUB, PLAIN)


def test_parameters_that_a_ground_station_logged_as_another_components_are_the_autopilots(tmp_path):
    # MAVProxy fetches them as a file; the autopilot's own component then tells changes alone.
    stamped = [(0.0, 1, 1, mav.MAVLink_heartbeat_message(12, mav.MAV_AUTOPILOT_ARDUPILOTMEGA, 0, 0, 4, 3))]
    for name, value in PLAIN.items():
        stamped.append((0.0, 1, 190, mav.MAVLink_param_value_message(name.encode(), value, 9, len(PLAIN), 0)))
    for component, name, value in ((191, "FF_MODE", 0.0), (1, "SERVO1_FUNCTION", 34.0)):
        stamped.append((1.0, 1, component, mav.MAVLink_param_value_message(name.encode(), value, 9, 1, 0)))
    log = write(tmp_path / "a.tlog", recording(stamped))
    assert autopilot_parameters(log) == (ARDUSUB, PLAIN | {"SERVO1_FUNCTION": 34.0})


def test_a_log_of_another_autopilot_is_refused(tmp_path):
    with pytest.raises(LogError, match="its autopilot is no ArduPilot"):
        autopilot_parameters(tlog(tmp_path / "a.tlog", PLAIN, mav.MAV_AUTOPILOT_PX4))


def test_without_parameters_the_motion_shows_the_frame_and_the_reversed_motors(tmp_path, monkeypatch):
    dive = moved(np.array((-1.0, -1.0, 1.0, -1.0, -1.0, 1.0)), np.arange(6))
    pulses = np.hstack([dive.pwm.value, np.full((len(dive.pwm), 2), 1500.0)])
    dive = replace(dive, pwm=Signal(dive.pwm.time_s, pulses))
    monkeypatch.setattr("identify.run.vehicle_of_log.read_dive", lambda _path, **_of: dive)
    log, out = tlog(tmp_path / "a.tlog", {}), tmp_path / "ours.yaml"
    guessed = guess(log)
    assert (guessed.by, guessed.base, guessed.wiring.reversed) == ("motion", "bluerov2", (1, 2, 4, 5))
    assert (guessed.findings, guessed.judged) == ((), ("surge", "sway", "heave", "yaw"))
    assert main(["vehicle", "guess", str(log), "--out", str(out)]) == 0
    thrusters = load_vehicle(str(out)).vehicle.configurations["standard"].thrusters
    turned = [
        number
        for number, (ours, plain) in enumerate(
            zip(thrusters, FILE.vehicle.configurations["standard"].thrusters, strict=True), 1
        )
        if np.dot(ours.direction, plain.direction) < 0
    ]
    assert turned == [1, 2, 4, 5]


def test_without_parameters_a_motion_that_follows_no_frame_is_refused(tmp_path, monkeypatch):
    still = moved(np.zeros(6), np.arange(6))
    noise = np.random.default_rng(1).normal(size=still.velocity.value.shape)
    other = replace(still, velocity=Signal(still.velocity.time_s, noise), gyro=None)
    monkeypatch.setattr("identify.run.vehicle_of_log.read_dive", lambda _path, **_of: other)
    with pytest.raises(LogError, match="its motion follows the thrust of no known frame"):
        guess(tlog(tmp_path / "a.tlog", {}))
    monkeypatch.setattr("identify.run.vehicle_of_log.autopilot_parameters", lambda _path: (ARDUSUB, {}))
    with pytest.raises(LogError, match="give the whole log, at whose beginning they stand, or write"):
        guess(tmp_path / "a piece.BIN")


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"FRAME_CONFIG": 3.0}, "no vehicle file comes with the frame vectored_6dof_90deg"),
        ({"FRAME_CONFIG": 2.0}, "no output drives motor 7, 8"),
        ({"FRAME_CONFIG": math.nan}, "FRAME_CONFIG is nan, no whole number: set it in the autopilot"),
        ({"SERVO3_FUNCTION": math.inf}, "SERVO3_FUNCTION is inf, no whole number: set it in the autopilot"),
        ({"SERVO6_FUNCTION": 0.0, "SERVO9_FUNCTION": 38.0}, "the motors are on outputs 1, 2, 3, 4, 5, 9"),
    ],
)
def test_parameters_that_fit_no_file_are_refused_with_the_way_out(changed, words):
    with pytest.raises(ConfigError, match=words):
        wiring(PLAIN | changed, MOTORS)


def test_thrusters_come_in_the_order_and_with_the_signs_of_the_outputs():
    turned = PLAIN | {"SERVO1_FUNCTION": 34.0, "SERVO2_FUNCTION": 33.0, "MOT_2_DIRECTION": -1.0}
    wired = wiring(turned, MOTORS)
    assert (wired.swapped, wired.reversed, wired.is_plain) == (((1, 2), (2, 1)), (2,), False)
    before, after = (
        shape.thrusters
        for shape in (
            FILE.vehicle.configurations["standard"],
            wired.fitted(FILE.vehicle.configurations["standard"]),
        )
    )
    assert after[0].position_m == before[1].position_m
    assert after[0].direction == tuple(-value for value in before[1].direction)
    assert after[1:] == (before[0], *before[2:])


def test_an_output_that_mirrors_another_counts_for_nothing():
    assert wiring(PLAIN | {f"SERVO{n + 8}_FUNCTION": 32.0 + n for n in range(1, 7)}, MOTORS).is_plain


def test_where_the_frames_own_file_fits_it_is_told_where_it_was_written_too(tmp_path, capsys):
    log, out = tlog(tmp_path / "a.tlog", PLAIN), tmp_path / "ours.yaml"
    assert main(["vehicle", "guess", str(log), "--out", str(out)]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert f"vehicle file: bluerov2 fits as it is; the same is written to {out}" in said
    assert load_vehicle(str(out)).vehicle == FILE.vehicle


def test_a_file_that_is_written_has_the_reversed_thruster_turned(tmp_path):
    log = tlog(tmp_path / "a.tlog", PLAIN | {"MOT_3_DIRECTION": -1.0})
    out, answer = tmp_path / "ours.yaml", tmp_path / "j.json"
    assert main(["vehicle", "guess", str(log), "--out", str(out), "--json", str(answer)]) == 0
    thrusters = load_vehicle(str(out)).vehicle.configurations["standard"].thrusters
    turned = FILE.vehicle.configurations["standard"].thrusters
    assert thrusters[2].direction == tuple(-value for value in turned[2].direction)
    assert json.loads(answer.read_text())["reversed"] == [3]


@pytest.mark.parametrize(
    ("frame", "refused"),
    [(1.0, ""), (2.0, "drives 8 motors .FRAME_CONFIG., and vehicle 'bluerov2' has 6"), (7.0, "")],
)
def test_a_log_of_another_frame_is_refused_with_the_number_of_its_motors(tmp_path, frame, refused):
    moving = [([1500, 1600, 1500, 1500, 1500, 1500, 1500, 1500], 0.0)] * 20
    log = tlog(tmp_path / "a.tlog", PLAIN | {"FRAME_CONFIG": frame}, moving=moving)
    with pytest.raises(LogError, match=refused) if refused else nullcontext():
        read_dive(log, vehicle=FILE)


def test_settings_with_which_a_companion_takes_no_sticks_are_named():
    hints = ARDUSUB.hints({"SYSID_MYGCS": 1.0, "FS_GCS_ENABLE": 1.0, "FS_PILOT_INPUT": 0.0})
    assert [hint.split()[0] for hint in hints] == ["SYSID_MYGCS", "FS_GCS_ENABLE", "FS_PILOT_INPUT"]
    assert ARDUSUB.hints({"SYSID_MYGCS": 255.0, "FS_GCS_ENABLE": 2.0, "FS_PILOT_INPUT": 2.0}) == ()
    (hint,) = ARDUSUB.hints({"FS_GCS_TIMEOUT": 30.0})
    assert hint.startswith("FS_GCS_TIMEOUT is 30: ")
    assert ARDUSUB.hints({"FS_GCS_TIMEOUT": 5.0}) == ()


def moved(signs, order, file=FILE, together=0.0):
    """A dive of a body that answers its thrusters at once behind a lag of 1 s, wired by `signs` and `order`.

    together: pulse, us, by which all vertical motors are driven alike.
    """
    from bridge.vehicle.thrusters import allocation_matrix, thrust_curve

    rng = np.random.default_rng(3)
    time_s = np.arange(0.0, 120.0, 0.05)
    pwm = 1500 + 150 * np.repeat(rng.uniform(-1, 1, (60, len(order))), 40, axis=0)
    pwm[:, 4:] += together * np.repeat(rng.uniform(-1, 1, (60, 1)), 40, axis=0)
    curve = thrust_curve(file.vehicle.thrust_curve, file.path.parent)
    (configuration,) = file.vehicle.configurations.values()
    force = curve.thrust(pwm)[:, order] * signs @ allocation_matrix(configuration).T
    nu = np.zeros_like(force)
    for i in range(1, len(nu)):
        nu[i] = nu[i - 1] + 0.05 * (force[i - 1] / 20 - nu[i - 1])
    level = np.tile((1.0, 0.0, 0.0, 0.0), (len(time_s), 1))
    signals = {"velocity": nu[:, :3], "gyro": nu[:, 3:] * (0.0, 0.0, 1.0), "attitude": level, "pwm": pwm}
    return Dive("d", FILE.path, "0" * 64, **{name: Signal(time_s, value) for name, value in signals.items()})


@pytest.mark.parametrize(
    ("signs", "order", "motors"),
    [
        ((1, 1, 1, 1, 1, 1), (0, 1, 2, 3, 4, 5), None),
        ((1, -1, 1, 1, 1, 1), (0, 1, 2, 3, 4, 5), ((2,), ())),
        ((-1, -1, 1, -1, -1, 1), (0, 1, 2, 3, 4, 5), ((1, 2, 4, 5), ())),
        ((-1, -1, -1, -1, -1, -1), (0, 1, 2, 3, 4, 5), ((1, 2, 3, 4, 5, 6), ())),
        ((1, 1, 1, 1, 1, 1), (3, 1, 2, 0, 4, 5), ((), (1, 4))),
        ((1, 1, 1, -1, 1, 1), (3, 1, 2, 0, 4, 5), ((1,), (1, 4))),
    ],
)
def test_the_motors_that_the_motion_contradicts_are_named(signs, order, motors):
    miswiring = miswired(moved(np.array(signs, dtype=float), np.array(order)), FILE, "standard")
    assert (miswiring and (miswiring.reversed, miswiring.swapped)) == motors


def boat(directions, sides, tmp_path):
    """A boat of two stern thrusters, numbered as they stand."""
    thrusters = [
        f"{{direction: [{x}, 0.0, 0.0], position_m: [-0.4, {y}, 0.0]}}"
        for x, y in zip(directions, sides, strict=True)
    ]
    path = tmp_path / f"boat{directions}{sides}.yaml"
    path.write_text(
        "name: boat\nconfigurations:\n  boat:\n    dry_mass_kg: 15.0\n    inertia_kgm2: [1.0, 2.0, 2.0]\n"
        f"    thrusters: [{', '.join(thrusters)}]\n"
    )
    return load_vehicle(str(path))


def test_a_pair_that_is_swapped_and_reversed_is_told_at_once_and_no_mend_of_one_axis_spoils_another(tmp_path):
    dive = moved(np.ones(2), np.arange(2), boat((-1.0, 1.0), (0.3, -0.3), tmp_path))
    told = {
        (1.0, 1.0): ((1,), (1, 2), None),  # a sign and the sides
        (-1.0, 1.0): ((1, 2), (1, 2), 5),  # the sides alone, which turns the yaw round
    }
    for directions, wrong in told.items():
        found = miswired(dive, boat(directions, (-0.3, 0.3), tmp_path), "boat")
        assert (found.reversed, found.swapped, found.mirrors) == wrong
    assert "or it is the sign of the recorded rate of turn in yaw that is wrong" in found.mend
    assert miswired(dive, boat((-1.0, 1.0), (0.3, -0.3), tmp_path), "boat") is None


def test_swapped_motors_of_a_wrong_sign_are_told_with_the_settings_of_both(tmp_path, monkeypatch):
    dive = moved(np.array((1.0, 1.0, 1.0, -1.0, 1.0, 1.0)), np.array((3, 1, 2, 0, 4, 5)))
    monkeypatch.setattr("identify.run.vehicle_of_log.read_dive", lambda _path, **_of: dive)
    (finding,) = guess(tlog(tmp_path / "a.tlog", PLAIN)).findings
    assert finding.startswith("Motors 1 and 4 are swapped, with a wrong sign (so wired, ")
    assert "SERVO1_FUNCTION 36 and SERVO4_FUNCTION 33; and set MOT_4_DIRECTION -1." in finding


@pytest.mark.parametrize("motor", [5, 8])
def test_one_of_four_vertical_motors_is_named_by_heave_alone(motor):
    heavy = load_vehicle("bluerov2_heavy")
    signs = np.where(np.arange(1, 9) == motor, -1.0, 1.0)
    found = miswired(moved(signs, np.arange(8), heavy, 150.0), heavy, "heavy")
    assert (found.reversed, found.swapped) == ((motor,), ())
    assert miswired(moved(np.ones(8), np.arange(8), heavy, 150.0), heavy, "heavy") is None


def test_a_motor_that_hardly_ran_is_not_called_reversed():
    dive = moved(np.array((-1.0, -1.0, 1.0, 1.0, -1.0, 1.0)), np.arange(6))
    pwm = dive.pwm.value.copy()
    pwm[:, 4] = 1500.0
    miswiring = miswired(replace(dive, pwm=Signal(dive.pwm.time_s, pwm)), FILE, "standard")
    assert miswiring.reversed == (1, 2)


def test_a_turn_that_the_sea_makes_does_not_call_a_motor_reversed_that_hardly_runs():
    """16 s of pushes ahead and aside at once beside the firmware, by motors 2 and 3; turned, motor 1 goes with the
    rate of turn by chance, whose changes go with the given wiring."""
    with np.load(DATA / "pushed_aslant.npz") as flown:
        time_s, nu, command_s, pwm = (flown[name].astype(float) for name in flown.files)
    still = np.zeros_like(time_s)
    level = np.tile((1.0, 0.0, 0.0, 0.0), (len(time_s), 1))
    signals = {
        "velocity": Signal(time_s, nu[:, :3]),
        "gyro": Signal(time_s, np.column_stack([still, still, nu[:, 3]])),
        "attitude": Signal(time_s, level),
        "pwm": Signal(command_s, pwm),
    }
    assert miswired(Dive("d", FILE.path, "0" * 64, **signals), FILE, "standard") is None


def test_reversed_motors_speak_against_every_mass_and_damping():
    (doubt,) = miswired_doubts(
        moved(np.array((1.0, -1.0, 1.0, 1.0, 1.0, 1.0)), np.arange(6)), FILE, "standard"
    )
    assert doubt.outcome is Outcome.DISAGREES
    assert {"M_u", "D_u", "I_r", "D_r"} <= {*doubt.about}
    assert doubt.sentence.startswith("Thruster 2 pushes the other way than the vehicle file says (so wired, ")
    assert doubt.sentence.endswith("turn their directions round in the vehicle file.")
    assert mounted_otherwise((0,), (), [doubt.sentence])[1:] == (doubt.sentence,)


def test_motion_is_not_held_against_the_thrust_of_a_vehicle_that_was_never_armed(tmp_path):
    moving = [([1500 + 100 * (n // 20 % 3 - 1)] * 6, np.sin(0.1 * n)) for n in range(600)]
    guessed = guess(tlog(tmp_path / "a.tlog", PLAIN, moving=moving))
    assert (guessed.findings, guessed.judged) == ((), ())
    assert "never armed" in guessed.unjudged


@pytest.mark.parametrize(
    ("parts", "base", "turned", "judged", "unjudged"),
    [
        (
            ("data", "ardusub_dives", "small.BIN"),
            "bluerov2",
            (1, 2, 4, 5),
            False,
            "too small to turn a propeller",
        ),
        (("data", "ardusub_dives", "small.tlog"), "bluerov2_heavy", (1, 2, 5, 8), True, ""),
    ],
)
def test_real_vehicles_are_guessed_and_go_with_their_thrust_where_they_have_any(
    parts, base, turned, judged, unjudged
):
    guessed = guess(shared(*parts))
    assert (guessed.base, guessed.wiring.reversed, guessed.findings) == (base, turned, ())
    assert ("yaw" in guessed.judged) is judged
    assert unjudged in guessed.unjudged


def test_only_what_a_thruster_drove_is_held_against_thrust(tmp_path, monkeypatch):
    dive = moved(np.ones(6), np.arange(6))
    dive.pwm.value[:, 4:] = 1500.0
    monkeypatch.setattr("identify.run.vehicle_of_log.read_dive", lambda _path, **_of: dive)
    assert guess(tlog(tmp_path / "a.tlog", PLAIN)).judged == ("surge", "sway", "yaw")


def test_thruster_commands_of_which_none_is_left_tell_nothing_of_the_motors():
    time_s = np.arange(0.0, 60.0, 0.1)
    speed = Signal(time_s, np.sin(time_s)[:, None] * np.ones(3))
    dive = Dive("x", Path("x"), "x", velocity=speed, pwm=Signal(np.zeros(0), np.zeros((0, 8))))
    assert miswired(dive, load_vehicle("bluerov2_heavy"), "heavy") is None
