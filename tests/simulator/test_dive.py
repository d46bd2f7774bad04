"""The whole chain in lock-step, read back from its frames, also with the mode raised while armed."""

import math
import subprocess
import sys
from collections import defaultdict
from typing import Any

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect
from soak import rest_in_soak

from bridge.errors import ParamRejected
from bridge.links.link import memory_pair
from bridge.onboard.parameters import ParameterServer
from bridge.simulator.body import Start
from bridge.simulator.direct import simulate_truth
from bridge.simulator.dive import SimulatedVehicle, real_time, simulate_dive
from bridge.simulator.missions import dive, rest, run, turn
from bridge.simulator.truth import QUIET, load_truth
from bridge.vehicle.coefficients import BY_NAME
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.legs import Leg, Mission
from bridge.vehicle.mode import Mode
from bridge.vehicle.parameters import COMMIT, vehicle_table
from bridge.vehicle.references import Reference
from bridge.vehicle.thrusters import allocation_matrix, shaft_speed, thrust_curve
from bridge.wire.framing import Encoder, Framer, decode
from bridge.wire.status_codes import CrewText, Topic, decoded

FILE = load_vehicle("ruvifist")
HOVERING = FILE.vehicle.configurations["hovering"]
OUT = Mission(
    "out",
    tuple(
        rest("still", 2.0)
        + run("ahead", 0.4, 0.0, 3.0)
        + run("aside", 0.0, 0.3, 2.0)
        + turn("turn", math.pi / 2, 0.2, "smooth")
    ),
)


def recorded(mission=OUT, **options):
    """The messages of a dive by type, those with a name by name."""
    framer = Framer()
    by_type: dict[str, list[Any]] = defaultdict(list)

    def sink(_unix_s, data):
        for frame in framer.feed(data):
            message = decode(frame)
            kind = message.get_type()
            if kind in ("DEBUG_FLOAT_ARRAY", "NAMED_VALUE_FLOAT"):
                kind = message.name
            elif kind == "HIGHRES_IMU":
                kind += str(message.to_dict()["id"])
            by_type[kind].append(message)

    simulate_dive(FILE, "hovering", mission, seed=options.pop("seed", 7), sink=sink, **options)
    assert framer.counts["checksum"] == framer.counts["skipped"] == 0
    return by_type


def accepted(times=1.0):
    """The parameters of a vehicle that has been given the truth, its mass and damping in surge so many times theirs."""
    server = ParameterServer(None, vehicle_table(FILE.vehicle))
    for configuration in FILE.vehicle.configurations:
        for name, value in load_truth(FILE, configuration).model.items():
            factor = times if name in ("M_u", "D_u") else 1.0
            parameter = BY_NAME[name].parameter_id(FILE.vehicle.veh_cfg(configuration))
            assert server.write(parameter, factor * value, armed=False) is None
    assert server.write(COMMIT, float(server.staged_crc), armed=False) is None
    return server


@pytest.fixture(scope="module")
def out_and_back():
    return recorded()


RATES_HZ = {
    "HEARTBEAT": 1, "SYSTEM_TIME": 1, "HIGHRES_IMU0": 25, "HIGHRES_IMU1": 25, "ODOMETRY": 5, "DISTANCE_SENSOR": 5,
    "SCALED_PRESSURE2": 5, "ATTITUDE_QUATERNION": 10, "ACTUATOR_OUTPUT_STATUS": 10, "BATTERY_STATUS": 1,
    "TAU_PID": 10, "TAU_FF": 10, "TAU_CMD": 10, "NU_FB": 10, "NU_REF": 10, "RPM": 10, "FF_MODE": 1, "VEH_CFG": 1,
}  # fmt: skip


@pytest.mark.parametrize(("signal", "rate_hz"), RATES_HZ.items())
def test_every_signal_of_the_telemetry_contract_comes_at_its_rate(out_and_back, signal, rate_hz):
    assert len(out_and_back[signal]) >= rate_hz * OUT.duration_s


def test_the_vehicle_is_armed_in_the_configuration_that_it_dives_in(out_and_back):
    assert all(message.base_mode & 128 for message in out_and_back["HEARTBEAT"])
    assert {message.value for message in out_and_back["VEH_CFG"]} == {1.0}
    assert not [m.text for m in out_and_back["STATUSTEXT"] if "FF " not in m.text]


def test_the_recorded_pulses_give_the_commanded_wrench_through_the_vehicles_own_curve(out_and_back):
    curve = thrust_curve(FILE.vehicle.thrust_curve, FILE.path.parent)
    pwm = np.array([message.actuator[:8] for message in out_and_back["ACTUATOR_OUTPUT_STATUS"]])
    wrench = curve.thrust(pwm) @ allocation_matrix(HOVERING).T
    commanded = np.array([message.data[:6] for message in out_and_back["TAU_CMD"]])
    large = (np.abs(curve.thrust(pwm[:, :4])) > 3.0).all(axis=1)
    assert large.sum() > 50
    level = [0, 1, 5]
    np.testing.assert_allclose(wrench[large][:, level], commanded[large][:, level], atol=1e-3)


def test_what_the_controller_used_is_the_dvl_reading_of_that_moment(out_and_back):
    valid_s = np.array([m.time_usec for m in out_and_back["ODOMETRY"]]) / 1e6
    velocity = np.array([(m.vx, m.vy, m.vz) for m in out_and_back["ODOMETRY"]])
    fed_s = np.array([m.time_usec for m in out_and_back["NU_FB"]]) / 1e6
    fed = np.array([m.data[:3] for m in out_and_back["NU_FB"]])
    good = np.isfinite(velocity).all(axis=1)
    latest = np.searchsorted(valid_s[good] + 0.05, fed_s + 1e-6, side="right") - 1
    np.testing.assert_allclose(fed, velocity[good][latest], atol=1e-6)


def test_one_seed_gives_the_same_bytes_twice_and_another_seed_others():
    short = Mission("short", tuple(rest("still", 3.0)))
    runs: list[bytes] = []
    for seed in (1, 1, 2):
        data: list[bytes] = []
        simulate_dive(FILE, "survey", short, seed=seed, sink=lambda _, d, data=data: data.append(d))
        runs.append(b"".join(data))
    assert runs[0] == runs[1]
    assert runs[0] != runs[2]


def test_without_noise_the_chain_of_bytes_dives_as_the_direct_path_does():
    truth = load_truth(FILE, "hovering").calm()
    frames = recorded(noise=QUIET, truth=truth)
    direct = simulate_truth(FILE, "hovering", OUT, seed=0, noise=None, truth=truth)
    last = [m for m in frames["ODOMETRY"] if not math.isnan(m.vx)]
    by_bytes = np.interp(
        np.arange(3.0, 30.0, 0.5), [m.time_usec / 1e6 - 1.0 for m in last], [m.vx for m in last]
    )
    by_truth = np.interp(np.arange(3.0, 30.0, 0.5), direct.time_s, direct.nu[:, 0])
    np.testing.assert_allclose(by_bytes, by_truth, atol=0.03)


def test_with_accepted_parameters_the_feedforward_is_computed_logged_and_applied():
    server = accepted()
    frames = recorded(parameters=server, mode=Mode.BOTH)
    assert {m.value for m in frames["FF_MODE"]} == {3.0}
    assert not [m.text for m in frames["STATUSTEXT"] if " off: " in m.text]
    model = load_truth(FILE, "hovering").model
    for tau, wanted in zip(frames["TAU_FF"], frames["NU_REF"], strict=True):
        surge = model["M_u"] * wanted.data[6] + model["D_u"] * wanted.data[0]
        assert tau.data[0] == pytest.approx(surge, rel=1e-5, abs=1e-4)
        yaw = model["I_r"] * wanted.data[11] + model["D_r"] * wanted.data[5]
        assert tau.data[5] == pytest.approx(yaw, rel=1e-5, abs=1e-4)
    error = [abs(fb.data[0] - ref.data[0]) for fb, ref in zip(frames["NU_FB"], frames["NU_REF"], strict=True)]
    assert np.mean(error) < 0.01


def test_a_mode_that_needs_parameters_is_refused_where_there_are_none():
    with pytest.raises(ParamRejected, match="FF_MODE 2 needs a set of parameters"):
        recorded(mode=Mode.ALONE)


def test_surface_fixes_come_only_while_the_antenna_is_out_of_the_water():
    mission = Mission("down", tuple(rest("afloat", 3.0) + dive("down", 0.4) + rest("below", 3.0)), 0.2)
    fixes = recorded(mission, noise=QUIET)["GPS_RAW_INT"]
    assert fixes[1].fix_type == 3
    assert (fixes[1].lat / 1e7, fixes[1].lon / 1e7) == pytest.approx((44.03, 11.27), abs=1e-5)
    assert fixes[-1].fix_type == 1


def test_shaft_speeds_have_the_sign_of_their_thrust_and_its_square_root(out_and_back):
    curve = thrust_curve(FILE.vehicle.thrust_curve, FILE.path.parent)
    thrust = {m.time_usec: curve.thrust(m.actuator[:8]) for m in out_and_back["ACTUATOR_OUTPUT_STATUS"]}
    checked = 0
    for message in out_and_back["RPM"]:
        ticks = [thrust.get(message.time_usec - 50_000 * back) for back in (1, 2, 3, 4, 5)]
        if any(tick is None for tick in ticks):
            continue
        steady = np.ptp(ticks, axis=0) < 0.02 * np.abs(ticks[0])
        for i in np.flatnonzero(steady & (np.abs(ticks[0]) > 2.0)):
            wanted = 60 * shaft_speed(FILE.vehicle.thrust_curve, ticks[0][i])
            assert message.data[i] == pytest.approx(wanted, rel=0.05)
            checked += 1
    assert checked > 40


def test_progress_runs_up_to_one_and_the_pace_is_asked_every_tick():
    shares: list[float] = []
    asked: list[float] = []
    short = Mission("short", tuple(rest("still", 10.0)))
    recorded(short, progress=shares.append, pace=asked.append)
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    np.testing.assert_allclose(asked, np.arange(1, 221) * 0.05)


def test_an_idle_vehicle_answers_the_ground_while_simulated_time_passes():
    near, far = memory_pair()
    vehicle = SimulatedVehicle(FILE, "survey", (near,), Start(0), accepted())
    for _ in range(40):
        vehicle.tick(None)
    assert vehicle.clock.boot_s() == pytest.approx(2.0)
    assert vehicle.body.pwm_us == (1500.0,) * 8
    assert far.read(0.0)


def test_a_pace_of_twice_real_time_waits_for_half_the_time_that_is_left_and_never_backwards():
    now, waits = [100.0], list[float]()
    pace = real_time(2.0, lambda: now[0], waits.append)
    pace(1.0)
    now[0] = 100.4
    pace(1.0)
    now[0] = 103.0
    pace(2.0)
    assert waits == pytest.approx([0.5, 0.1])


def test_a_vehicles_computer_never_loads_the_compiler():
    program = "import sys, bridge.onboard.ports, bridge.vehicle.autopilot; sys.exit('numba' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0


def test_disarmed_in_the_middle_of_a_mission_the_thrusters_stop_at_once_and_the_telemetry_goes_on():
    near, far = memory_pair()
    vehicle = SimulatedVehicle(FILE, "hovering", [near], Start(7, 0.6))
    ahead = Reference((0.4, 0, 0, 0, 0, 0), (0.0,) * 6, 0.0, 0.6)
    assert vehicle.bridge.arm(True)
    for _ in range(40):
        vehicle.tick(ahead)
    assert any(pulse != 1500.0 for pulse in vehicle.body.pwm_us)
    disarm = dialect.MAVLink_command_long_message(1, 1, 400, 0, 0.0, 0, 0, 0, 0, 0, 0)
    far.write(Encoder(255, 190).encode(disarm))
    vehicle.tick(ahead)
    while far.read(0.0):
        pass
    vehicle.tick(ahead)
    assert vehicle.body.pwm_us == (1500.0,) * 8
    messages = [m for f in Framer().feed(far.read(0.0)) if (m := decode(f)).get_type() == "DEBUG_FLOAT_ARRAY"]
    arrays = {m.name: m.data[:6] for m in messages}
    assert arrays["TAU_CMD"] == arrays["TAU_PID"] == [0.0] * 6
    assert arrays["NU_REF"][0] == pytest.approx(0.4)


def test_armed_again_the_controller_starts_without_an_old_integral():
    vehicle = SimulatedVehicle(FILE, "hovering", [], Start(7, 0.6))
    ahead = Reference((0.4, 0, 0, 0, 0, 0), (0.0,) * 6, 0.0, 0.6)
    vehicle.bridge.arm(True)
    for _ in range(100):
        vehicle.tick(ahead)
    vehicle.bridge.arm(False)
    for _ in range(600):
        vehicle.tick(ahead)
    vehicle.bridge.arm(True)
    still = Reference(
        (0.0,) * 6, (0.0,) * 6, vehicle.bridge.navigation.heading_rad, vehicle.bridge.navigation.depth_m
    )
    vehicle.tick(still)
    assert max(abs(pulse - 1500.0) for pulse in vehicle.body.pwm_us) < 30.0


def test_a_vehicle_whose_dvl_falls_silent_stays_at_its_depth_and_heading():
    vehicle = SimulatedVehicle(FILE, "hovering", [], Start(7, 0.6))
    hold = Reference((0.0,) * 6, (0.0,) * 6, 0.0, 0.6)
    vehicle.bridge.arm(True)
    for _ in range(200):
        vehicle.tick(hold)
    vehicle.bridge.parsers["dvl"].feed = lambda _data, _time_s: []
    states = [vehicle.tick(hold).state[-1] for _ in range(600)]
    assert all(0.45 < state[2] < 0.75 for state in states)
    assert all(abs(state[12]) < 0.05 for state in states)


GROUND = Encoder(255, 190)
AHEAD = Leg(12.0, "ahead", "steady", surge_m_s=0.4, transient_s=5.0)
BACK = Leg(12.0, "back", "steady", surge_m_s=-0.4, transient_s=5.0)
TO_AND_FRO = Mission("to and fro", (AHEAD, BACK) * 3)


class Dive:
    """The vehicle under way, and its ground."""

    def __init__(self, times=1.0, mode=Mode.SHADOW):
        near, self.ground = memory_pair()
        self.parameters = accepted(times)
        self.parameters.write("FF_MODE", float(mode), armed=False)
        self.vehicle = SimulatedVehicle(FILE, "hovering", [near], Start(7, 0.6), self.parameters)
        assert self.vehicle.bridge.arm(True)
        self.framer = Framer()
        self.ticks = 0

    def fly(self, seconds):
        for _ in range(round(seconds * 20)):
            self.vehicle.tick(TO_AND_FRO.reference(self.ticks / 20))
            self.ticks += 1

    def asks(self, mode):
        """The answers to the ground's order, without telemetry."""
        self.heard()
        self.ground.write(GROUND.encode(dialect.MAVLink_param_set_message(1, 1, b"FF_MODE", float(mode), 9)))
        self.fly(0.1)
        return [m for m in self.heard() if m.get_type() in ("PARAM_VALUE", "PARAM_ERROR", "STATUSTEXT")]

    def heard(self):
        frames = []
        while data := self.ground.read(0.0):
            frames += self.framer.feed(data)
        return [decode(frame) for frame in frames]


@pytest.mark.slow
def test_armed_it_is_raised_once_a_minute_of_shadow_has_been_good_and_not_before():
    dive = Dive()
    dive.fly(30.0)
    error, held, first, second = sorted(dive.asks(Mode.BOTH), key=lambda m: m.get_type())
    assert (error.error, held.param_value) == (3, 1.0)
    assert decoded(first.text).topic is Topic.UNPROVEN
    assert decoded(second.text) == CrewText("shadow: 28 of 60 s flown", Topic.SHADOW)
    dive.fly(33.0)
    (held,) = dive.asks(Mode.BOTH)
    assert held.param_value == 3.0
    assert dive.parameters.mode == Mode.BOTH


@pytest.mark.slow
@pytest.mark.parametrize("times", rest_in_soak([0.3, 2.0]))
def test_armed_a_model_that_the_water_contradicts_is_not_raised_however_long_it_was_shadowed(times):
    dive = Dive(times)
    dive.fly(66.0)
    texts = [m.text for m in dive.asks(Mode.BOTH) if m.get_type() == "STATUSTEXT"]
    assert texts[1].endswith("% of surge explained, needs 70")
    assert dive.parameters.mode == Mode.SHADOW
    assert dive.vehicle.bridge.arm(False)
    (held,) = dive.asks(Mode.BOTH)
    assert held.param_value == 3.0


def test_a_ground_that_falls_silent_or_whose_link_breaks_changes_no_pulse_on_board():
    heard, silent, broken = (Dive(mode=Mode.BOTH) for _ in range(3))
    beat = GROUND.encode(dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
    pulses: list[list[tuple[float, ...]]] = [[], [], []]
    for second in range(12):
        heard.ground.write(beat)
        if second < 5:
            silent.ground.write(beat)
            broken.ground.write(beat)
        if second == 5:
            broken.ground.close()
        for each, flown in zip((heard, silent, broken), pulses, strict=True):
            for _ in range(20):
                each.fly(0.05)
                flown.append(tuple(each.vehicle.body.pwm_us))
    assert pulses[0] == pulses[1] == pulses[2]
    assert len(set(pulses[0])) > 200
    assert all(dive.vehicle.bridge.armed and dive.parameters.mode == Mode.BOTH for dive in (silent, broken))
    assert "memory" in " ".join(broken.vehicle.bridge.link_faults.values())
