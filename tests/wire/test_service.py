"""The bridge tells what the devices say, answers the ground, and lets no fault spread."""

import math
from collections import Counter
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.clock import SimulatedClock
from bridge.errors import LinkLost
from bridge.framing import Encoder, Framer, decode
from bridge.link.memory import MemoryLink, memory_pair
from bridge.link.reconnecting import Reconnecting
from bridge.messages import readings
from bridge.messages.readings import Reading
from bridge.parameters import ParameterServer, vehicle_table
from bridge.sensors.kvh1750 import encode_kvh1750
from bridge.sensors.samples import NAN3, DvlSample, EscSample, FogBlock, GnssSample, ImuSample, PressureSample
from bridge.sensors.wayfinder import encode_packet
from bridge.service import Bridge
from bridge.vehicle.autopilot import Actuation
from bridge.vehicle.config import Configuration, Device, Mounting, Sensors, Thruster, Vehicle
from bridge.vehicle.references import Reference

SIX = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)
LEVEL_NORTH_ENU = (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))


def vehicle(**sensors: Device) -> Vehicle:
    thrusters = tuple(Thruster((1.0, 0.0, 0.0), (0.0, 0.2 * i, 0.0)) for i in range(2))
    shape = Configuration(dry_mass_kg=72.0, inertia_kgm2=(2.0, 9.0, 10.0), thrusters=thrusters)
    return Vehicle("test", {"survey": shape, "hovering": shape}, sensors=Sensors(**sensors))


ALL = {
    "dvl": Device("wayfinder"),
    "imu": Device("mti300", mounting=Mounting(rotation_deg=(180.0, 0.0, 0.0))),
    "fog": Device("kvh1750"),
    "depth": Device("bar30"),
    "esc": Device("esc"),
}


class Rig:
    """A bridge in lock-step, and what the ground hears."""

    def __init__(self, system: int = 1, component: int = 1, **options: Any) -> None:
        self.clock = SimulatedClock()
        self.vehicle = vehicle(**ALL)
        near, self.ground = memory_pair()
        self.links: list[Any] = [near]
        self.parameters = ParameterServer(
            None, vehicle_table(self.vehicle), system=system, component=component
        )
        self.bridge = Bridge(self.vehicle, self.clock, self.links, self.parameters, **options)
        self.encoder = Encoder(255, 190)
        self.framer = Framer()

    def step(self, time_s: float | None = None) -> list[Any]:
        if time_s is not None:
            self.clock.advance_to(time_s)
        self.bridge.step()
        return self.heard()

    def heard(self) -> list[Any]:
        """pymavlink messages that came, with their readings kept in `self.readings`."""
        frames = []
        while data := self.ground.read(0.0):
            frames += self.framer.feed(data)
        self.readings = [r for r in map(readings.decode, frames) if r is not None]
        return [decode(frame) for frame in frames]

    def ask(self, message: Any, encoder: Encoder | None = None) -> list[Any]:
        """What comes of a message, the beat left out."""
        self.step(self.clock.now_s)
        self.ground.write((encoder or self.encoder).encode(message))
        return self.step()

    def told(self, signal: str) -> list[Reading]:
        return [r for r in self.readings if r.signal == signal]


def imu(time_s: float, force: tuple[float, float, float] = (0.0, 0.0, 9.81)) -> ImuSample:
    return ImuSample(time_s, force, (0.1, -0.2, -0.3), LEVEL_NORTH_ENU, 18.5)


def fog(end_s: float, rates: list[float]) -> FogBlock:
    count = len(rates)
    return FogBlock(end_s - 1e-3 * np.arange(count)[::-1], np.array(rates), np.ones(count, bool))


def test_once_a_second_it_says_that_it_lives_its_clock_its_mode_and_its_configuration() -> None:
    rig = Rig(veh_cfg=1)
    kinds: Counter[str] = Counter()
    for tick in range(1, 61):
        kinds.update(m.get_type() for m in rig.step(tick * 0.05))
        if rig.told("clock"):
            (clock,) = rig.told("clock")
            assert clock.values[0] == pytest.approx(rig.clock.unix_s(), abs=1e-5)
            assert [r.values for r in rig.told("veh_cfg")] == [(1.0,)]
            assert [r.values for r in rig.told("ff_mode")] == [(0.0,)]
    assert kinds["HEARTBEAT"] == kinds["SYSTEM_TIME"] == 4
    assert kinds["NAMED_VALUE_FLOAT"] == 8


@pytest.mark.parametrize(("component", "kind", "autopilot"), [(1, 12, 0), (191, 18, 8)])
def test_it_is_a_submarine_alone_and_a_companion_beside_an_autopilot(
    component: int, kind: int, autopilot: int
) -> None:
    rig = Rig(component=component)
    beat = rig.step(0.0)[0]
    assert (beat.get_type(), beat.type, beat.autopilot, beat.base_mode & 128) == (
        "HEARTBEAT",
        kind,
        autopilot,
        0,
    )
    assert (beat.get_srcSystem(), beat.get_srcComponent()) == (1, component)
    rig.bridge.armed = True
    assert rig.step(1.0)[0].base_mode & 128


def test_bytes_of_a_device_become_its_message_in_body_axes() -> None:
    rig = Rig()
    vector = bytes.fromhex(
        "aa1001620002055b00aa11570000004c00010000181a0b14023703fa00010000003f000080be0000003e0000000000004040666646"
        "409a993940333343403d0a27400080bb44000000000000c0410000bc410000803e30303132333400001c0fc610"
    )
    rig.bridge.receive("dvl", vector[:40], 0.9)
    rig.bridge.receive("dvl", vector[40:], 1.0)
    rig.step(1.0)
    (dvl,) = rig.told("dvl")
    assert (dvl.time_s, dvl.values[:3]) == (1.0, (0.5, -0.25, 0.125))
    assert rig.bridge.navigation.velocity == (0.5, -0.25, 0.125)


def test_noise_on_every_line_ends_no_driver() -> None:
    rig = Rig()
    for slot in ("dvl", "imu", "fog", "esc"):
        for seed in range(20):
            rig.bridge.receive(slot, np.random.default_rng(seed).bytes(500), 0.1 * seed)
    rig.step(2.0)
    rig.bridge.receive("dvl", encode_packet(3, b"\0" * 8), 2.0)
    rig.bridge.receive("fog", encode_kvh1750(np.full(200, 0.25)), 2.1)
    rig.step(2.1)
    assert rig.told("fog")


def test_the_imu_goes_out_at_its_rate_as_means_turned_into_body_axes() -> None:
    rig = Rig(imu_rate_hz=50.0)
    told = []
    for i in range(1, 101):
        rig.bridge.accept("imu", [imu(0.01 * i, (0.01 * i, 0.0, 9.81))])
        if i % 5 == 0:
            rig.step(0.01 * i)
            told += rig.told("imu")
    assert len(told) == pytest.approx(50, abs=1)
    for reading in told[1:]:
        # The force along x equals the time: a mean that was dated otherwise would show.
        assert reading.values[0] == pytest.approx(reading.time_s, abs=1e-5)
        assert reading.values[2:6] == pytest.approx((-9.81, 0.1, 0.2, 0.3), abs=1e-6)


def test_attitude_goes_out_at_the_control_rate_level_and_north() -> None:
    rig = Rig()
    rig.bridge.accept("imu", [imu(0.01), imu(0.02)])
    rig.step(0.05)
    (attitude,) = rig.told("attitude")
    assert attitude.time_s == 0.02
    assert attitude.values[:4] == pytest.approx((1.0, 0.0, 0.0, 0.0), abs=1e-7)
    rig.step(0.1)
    assert rig.told("attitude") == []


def test_the_gyro_tells_the_mean_since_its_last_message_dated_at_the_middle_of_it() -> None:
    rig = Rig(fog_rate_hz=40.0)
    told = []
    # The rate equals the time in ms at the end of each sample, so a mean tells which samples are in it.
    for tick in range(20):
        rates = [float(tick * 50 + i + 1) for i in range(50)]
        rig.bridge.accept("fog", [fog(0.05 * (tick + 1), rates)])
        rig.step(0.05 * (tick + 1))
        told += rig.told("fog")
    assert len(told) == pytest.approx(40, abs=1)
    # The first interval begins with the first sample, every other one with the end of the one before.
    for reading in told[1:]:
        assert reading.values[0] == pytest.approx(1000 * reading.time_s + 0.5, rel=1e-6)
    assert np.diff([r.time_s for r in told[1:]]) == pytest.approx(0.025, abs=1e-6)


def test_invalid_gyro_samples_are_left_out_of_the_mean() -> None:
    rig = Rig(fog_rate_hz=40.0)
    block = fog(0.1, [1.0] * 100)
    spoilt = np.arange(100) % 3 == 0
    rig.bridge.accept("fog", [FogBlock(block.time_s, np.where(spoilt, 1e3, 1.0), ~spoilt)])
    rig.step(0.1)
    assert [r.values for r in rig.told("fog")] == [(1.0,)] * 3
    for later_s in (0.1, 0.2):
        rig.bridge.accept("fog", [FogBlock(block.time_s + later_s, block.rate, np.zeros(100, bool))])
        rig.step(0.1 + later_s)
    assert rig.told("fog") == []


def test_a_mean_never_reaches_over_a_gap() -> None:
    rig = Rig(fog_rate_hz=40.0)
    rig.bridge.accept("fog", [fog(0.01, [5.0] * 10)])
    rig.bridge.accept("fog", [fog(0.25, [1.0] * 30)])
    rig.step(0.3)
    assert [r.values for r in rig.told("fog")] == [(1.0,)]
    rig.bridge.accept(
        "imu", [imu(0.01, (5.0, 0.0, 9.81)), imu(0.02, (5.0, 0.0, 9.81)), imu(0.03, (5.0, 0.0, 9.81))]
    )
    rig.bridge.accept("imu", [imu(0.5), imu(0.52)])
    rig.step(0.52)
    assert [r.values[0] for r in rig.told("imu")][-2:] == [0.0, 0.0]


def test_navigation_holds_velocity_through_dropouts_and_takes_yaw_from_the_gyro_while_it_speaks() -> None:
    rig = Rig()
    rig.bridge.accept("imu", [imu(0.0)])
    assert rig.bridge.navigation.rate == pytest.approx((0.1, 0.2, 0.3))
    rig.bridge.accept("fog", [fog(0.1, [0.5] * 100)])
    assert rig.bridge.navigation.rate == pytest.approx((0.1, 0.2, 0.5))
    rig.bridge.accept(
        "dvl", [DvlSample(0.1, (0.4, 0.0, 0.0), 0.01, 5.0), DvlSample(0.2, NAN3, math.nan, math.nan)]
    )
    now = rig.bridge.navigation
    assert (now.velocity, now.velocity_time_s) == ((0.4, 0.0, 0.0), 0.1)
    rig.bridge.accept("imu", [imu(1.0)])
    assert rig.bridge.navigation.rate == pytest.approx((0.1, 0.2, 0.3))
    rig.step(1.0)
    lost = rig.told("dvl")[-1]
    assert all(math.isnan(v) for v in lost.values[:3])


def test_depth_comes_from_the_vehicles_own_surface_pressure_and_water() -> None:
    rig = Rig()
    water = rig.vehicle.water
    pressure = 100 * water.surface_pressure_hpa + water.density_kg_m3 * water.gravity_m_s2 * 0.6
    rig.bridge.accept("depth", [PressureSample(0.5, pressure, 12.0)])
    assert rig.bridge.navigation.depth_m == pytest.approx(0.6)
    rig.step(0.5)
    assert rig.told("pressure")[0].values == pytest.approx((pressure, 12.0), rel=1e-6)


def test_the_heading_runs_on_past_half_a_turn() -> None:
    rig = Rig()
    for i in range(200):
        # Device x points to `heading` east of north; in ENU that is a yaw of pi/2 - heading.
        heading = 0.1 * i
        yaw = math.pi / 2 - heading
        attitude = (math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2))
        rig.bridge.accept("imu", [replace(imu(0.01 * i), attitude=attitude)])
        assert rig.bridge.navigation.heading_rad == pytest.approx(heading, abs=1e-9)


def test_the_velocity_of_the_origin_leaves_out_what_turning_adds_at_the_transducer() -> None:
    rig = Rig()
    device = Device("wayfinder", mounting=Mounting(position_m=(0.5, 0.0, 0.0)))
    moved = vehicle(**(ALL | {"dvl": device}))
    bridge = Bridge(moved, rig.clock, [], rig.parameters)
    bridge.accept("imu", [imu(0.0)])
    bridge.accept("dvl", [DvlSample(0.0, (0.4, 0.15, -0.1), 0.01, 5.0)])
    assert bridge.navigation.velocity == pytest.approx((0.4, 0.0, 0.0), abs=1e-12)


def tick(time_s: float, pwm: tuple[float, ...] = (1600.0, 1400.0)) -> Actuation:
    return Actuation(time_s, SIX, SIX, SIX, SIX, Reference(SIX, SIX, 7.5, 0.6), pwm, 1, 1)


def test_a_control_tick_goes_out_whole_and_sets_the_configuration() -> None:
    rig = Rig()
    rig.step(0.0)
    rig.bridge.publish(tick(1.0))
    rig.step(1.0)
    signals = {r.signal for r in rig.readings}
    assert {"pwm", "tau_pid", "tau_ff", "tau_cmd", "nu_fb", "nu_ref"} <= signals
    assert rig.told("veh_cfg")[0].values == (1.0,)
    assert rig.told("nu_fb")[0] == Reading("nu_fb", 1.0, SIX)


def test_shaft_speeds_take_the_sign_of_the_command_and_silent_ones_are_nan() -> None:
    rig = Rig()
    rig.bridge.publish(tick(0.1, (1400.0, 1600.0)))
    rig.bridge.accept("esc", [EscSample(0.1, 0, 900.0, 16.0, 2.0, 30.0, 1.0)])
    rig.step(0.1)
    (rpm,) = rig.told("rpm")
    assert (rpm.time_s, rpm.values[0]) == (0.1, -900.0)
    assert math.isnan(rpm.values[1])
    assert rpm.values[2:] == (0.0,) * 56
    rig.bridge.publish(tick(0.2, (1500.0, 1500.0)))
    rig.bridge.accept(
        "esc",
        [EscSample(0.2, 0, 200.0, 16.0, 2.0, 30.0, 1.0), EscSample(0.2, 1, 100.0, 15.0, 1.0, 30.0, 1.0)],
    )
    rig.step(1.05)
    assert rig.told("rpm")[0].values[:2] == (-200.0, 100.0)
    assert rig.told("battery")[0].values == (15.5, 3.0)
    rig.step(1.1)
    assert rig.told("rpm") == []


def test_a_surface_fix_is_told() -> None:
    rig = Rig()
    bridge = Bridge(vehicle(gnss=Device("ublox")), rig.clock, rig.links, rig.parameters)
    bridge.accept("gnss", [GnssSample(1.0, 3, 45.44, 12.33, 1.0, 2.0, 0.5, 1.0, 9)])
    bridge.step()
    rig.heard()
    assert rig.told("gnss")[0].values[:3] == (3.0, 45.44, 12.33)


def test_timesync_is_answered_on_the_link_that_asked_with_both_clocks() -> None:
    rig = Rig()
    rig.clock.advance_to(2.5)
    other_near, other_ground = memory_pair()
    bridge = Bridge(rig.vehicle, rig.clock, [*rig.links, other_near], rig.parameters)
    rig.ground.write(rig.encoder.encode(dialect.MAVLink_timesync_message(0, 123_456)))
    rig.ground.write(rig.encoder.encode(dialect.MAVLink_timesync_message(77, 88)))
    bridge.step()
    (answer,) = [m for m in rig.heard() if m.get_type() == "TIMESYNC"]
    assert (answer.tc1, answer.ts1) == (2_500_000_000, 123_456)
    while data := other_ground.read(0.0):
        assert all(frame.message_id != dialect.MAVLINK_MSG_ID_TIMESYNC for frame in Framer().feed(data))


def arm(value: float, system: int = 1, component: int = 1, command: int = 400) -> Any:
    return dialect.MAVLink_command_long_message(system, component, command, 0, value, 0, 0, 0, 0, 0, 0)


@pytest.mark.parametrize(
    ("message", "result", "armed"),
    [
        (arm(1.0), dialect.MAV_RESULT_ACCEPTED, True),
        (arm(0.0), dialect.MAV_RESULT_ACCEPTED, False),
        (arm(0.5), dialect.MAV_RESULT_DENIED, False),
        (arm(math.nan), dialect.MAV_RESULT_DENIED, False),
        (arm(1.0, command=22), dialect.MAV_RESULT_UNSUPPORTED, False),
    ],
)
def test_a_command_is_acknowledged(message: Any, result: int, armed: bool) -> None:
    rig = Rig()
    (ack,) = rig.ask(message)
    assert (ack.get_type(), ack.command, ack.result) == ("COMMAND_ACK", message.command, result)
    assert (ack.target_system, ack.target_component) == (255, 190)
    assert rig.bridge.armed is armed


@pytest.mark.parametrize(("system", "component"), [(2, 1), (1, 191), (0, 0)])
def test_a_command_to_someone_else_is_left_to_them(system: int, component: int) -> None:
    rig = Rig()
    assert rig.ask(arm(1.0, system, component)) == []
    assert not rig.bridge.armed


def test_arming_waits_for_a_set_when_the_mode_applies_it() -> None:
    rig = Rig()
    rig.parameters.write("FF_MODE", 2.0, False)
    ack, words = rig.ask(arm(1.0))[::-1]
    assert ack.result == dialect.MAV_RESULT_DENIED
    assert words.text == "arming refused: FF_MODE needs an active set"
    for name in rig.parameters.names[:24]:
        rig.parameters.write(name, 20.0, False)
    rig.parameters.write("FF_COMMIT", float(rig.parameters.staged_crc), False)
    rig.step()
    assert rig.ask(arm(1.0))[0].result == dialect.MAV_RESULT_ACCEPTED


def test_parameters_are_listed_paced_written_and_guarded_while_armed() -> None:
    rig = Rig()
    listed = rig.ask(dialect.MAVLink_param_request_list_message(1, 1))
    assert len(listed) == 5
    while more := rig.step():
        listed += more
    assert [m.param_index for m in listed] == list(range(28))
    (value,) = rig.ask(dialect.MAVLink_param_set_message(1, 1, b"FF0_M_U", 96.5, 9))
    assert (value.get_type(), value.param_value) == ("PARAM_VALUE", 96.5)
    rig.bridge.armed = True
    crc = float(rig.parameters.staged_crc)
    kinds = [m.get_type() for m in rig.ask(dialect.MAVLink_param_set_message(1, 1, b"FF_COMMIT", crc, 9))]
    assert sorted(kinds) == ["PARAM_ERROR", "PARAM_VALUE", "STATUSTEXT"]


def test_orders_from_a_stranger_are_refused_aloud_once_and_his_questions_answered() -> None:
    rig = Rig()
    stranger = Encoder(42, 1)
    write = dialect.MAVLink_param_set_message(1, 1, b"FF0_M_U", 96.5, 9)
    (words,) = rig.ask(write, stranger)
    assert words.text == "orders from system 42 are refused"
    assert rig.ask(arm(1.0), stranger) == []
    assert not rig.bridge.armed
    assert rig.parameters.value("FF0_M_U") == 0.0
    assert rig.bridge.counts["refused"] == 2
    (value,) = rig.ask(dialect.MAVLink_param_request_read_message(1, 1, b"FF0_M_U", -1), stranger)
    assert value.param_value == 0.0


def test_a_file_transfer_is_refused_at_once_so_that_nobody_waits_for_it() -> None:
    rig = Rig()
    open_file = [7, 0, 3, 4, 16, 0, 0, 0, 0, 0, 0, 0, *b"@PARAM/param.pck"]
    message = dialect.MAVLink_file_transfer_protocol_message(
        0, 1, 1, open_file + [0] * (251 - len(open_file))
    )
    (answer,) = rig.ask(message)
    assert answer.payload[:6] == [8, 0, 3, 129, 1, 4]


def test_its_own_frames_that_come_back_and_damaged_ones_are_ignored() -> None:
    rig = Rig()
    assert rig.ask(arm(1.0), Encoder(1, 1)) == []
    raw = bytearray(rig.encoder.encode(arm(1.0)))
    raw[-1] ^= 1
    rig.ground.write(bytes(raw))
    assert rig.step() == []
    assert not rig.bridge.armed


def test_an_order_behind_a_broken_start_is_heard_after_a_pause() -> None:
    rig = Rig()
    rig.step(1.0)
    order = rig.encoder.encode(arm(1.0))
    rig.ground.write(bytes((order[0], 255)) + order[2:] + order)
    rig.step(1.05)
    assert not rig.bridge.armed
    rig.step(1.5)
    assert rig.bridge.armed


class BrokenLink:
    """A link with switches."""

    name = "serial:/dev/ttyX"

    def __init__(self) -> None:
        self.reads_fail = True
        self.writes_fail = True
        self.written = b""

    def read(self, timeout_s: float) -> bytes:
        del timeout_s
        if self.reads_fail:
            raise LinkLost("gone")
        return b""

    def write(self, data: bytes) -> None:
        if self.writes_fail:
            raise LinkLost("gone")
        self.written += data

    def close(self) -> None: ...


@pytest.mark.parametrize(("reads_fail", "writes_fail"), [(True, True), (True, False), (False, True)])
def test_one_link_that_fails_takes_nothing_from_the_others_and_is_told_once(
    reads_fail: bool, writes_fail: bool
) -> None:
    rig = Rig()
    broken = BrokenLink()
    broken.reads_fail, broken.writes_fail = reads_fail, writes_fail
    bridge = Bridge(rig.vehicle, rig.clock, [broken, *rig.links], rig.parameters)
    texts = []
    for i in range(50):
        rig.clock.advance_to(0.05 * i)
        bridge.publish(tick(0.05 * i))
        bridge.step()
        texts += [m.text for m in rig.heard() if m.get_type() == "STATUSTEXT"]
        assert len(rig.told("tau_cmd")) == 1
    assert texts == ["link lost: serial:/dev/ttyX"]
    assert bridge.link_faults == {"serial:/dev/ttyX": "gone"}
    broken.reads_fail = broken.writes_fail = False
    bridge.publish(tick(3.0))
    bridge.step()
    assert bridge.link_faults == {}
    assert broken.written


def test_a_link_that_mends_itself_is_told_lost_once_while_it_is_away() -> None:
    rig = Rig()
    plugged: list[BrokenLink] = []

    def connect() -> BrokenLink:
        if not plugged:
            raise LinkLost("there is no port")
        return plugged[0]

    link = Reconnecting(connect, rig.clock, "serial:/dev/ttyX")
    bridge = Bridge(rig.vehicle, rig.clock, [link, *rig.links], rig.parameters)
    texts = []
    for i in range(40):
        rig.clock.advance_to(0.05 * i)
        bridge.step()
        texts += [m.text for m in rig.heard() if m.get_type() == "STATUSTEXT"]
    assert texts == ["link lost: serial:/dev/ttyX"]
    assert bridge.link_faults == {"serial:/dev/ttyX": "there is no port"}
    plugged.append(BrokenLink())
    plugged[0].reads_fail = plugged[0].writes_fail = False
    dropped = link.counts["dropped"]
    assert dropped > 0
    rig.clock.advance_to(5.0)
    bridge.step()
    assert bridge.link_faults == {}
    assert plugged[0].written
    rig.heard()
    rig.clock.advance_to(5.05)
    bridge.step()
    said = "".join(m.text for m in rig.heard() if m.get_type() == "STATUSTEXT")
    assert said == f"link back: serial:/dev/ttyX, {dropped} writes lost"


def test_a_silent_device_one_that_makes_no_sense_and_one_that_is_back_are_named() -> None:
    rig = Rig()
    texts: list[str] = []
    for i in range(1, 100):
        now_s = 0.1 * i
        rig.clock.advance_to(now_s)
        rig.bridge.accept("depth", [PressureSample(now_s, 1e5, 12.0)])
        rig.bridge.receive("imu", b"\x55" * 20, now_s)
        if now_s > 6.0:
            rig.bridge.accept("fog", [fog(now_s, [0.0] * 100)])
        texts += [m.text for m in rig.step() if m.get_type() == "STATUSTEXT"]
        if i == 50:
            silent = sorted(texts)
    expected = ["dvl silent: check cable", "esc silent: check cable", "fog silent: check cable"]
    assert silent == [*expected, "imu makes no sense: check its baud"]
    assert texts[4:] == ["fog is back"]


def test_a_device_without_a_port_is_not_called_silent_and_is_back_when_it_speaks() -> None:
    rig = Rig()
    slots = ("imu", "fog", "depth", "esc")
    texts: list[str] = []
    faults = []
    for i in range(100):
        now_s = 0.125 * i
        rig.clock.advance_to(now_s)
        for slot in slots:
            rig.bridge.accept(slot, [PressureSample(now_s, 1e5, 12.0)])
        if i == 0:
            rig.bridge.port_fault("dvl", "there is no port /dev/ttyDVL; check the cable")
        if i == 45:
            rig.bridge.port_fault("dvl", "")
        if i == 90:
            rig.bridge.accept("dvl", [DvlSample(now_s, (0.0, 0.0, 0.0), 0.01, 2.0)])
        texts += [m.text for m in rig.step() if m.get_type() == "STATUSTEXT"]
        faults.append(rig.bridge.device_faults.get("dvl", ""))
    no_port = "dvl: there is no port /dev/ttyDVL; check the cable"
    assert texts == [no_port, "dvl silent: check cable", "dvl is back"]
    assert faults == [no_port] * 70 + ["dvl silent: check cable"] * 20 + [""] * 10


def test_long_words_go_out_in_pieces_that_belong_together() -> None:
    rig = Rig()
    rig.step(0.0)
    rig.bridge.say("x" * 120)
    pieces = rig.step()
    assert [len(m.text) for m in pieces] == [50, 50, 20]
    assert [m.chunk_seq for m in pieces] == [0, 1, 2]
    assert len({m.id for m in pieces}) == 1
    assert pieces[0].id != 0


def test_a_value_that_fits_no_message_is_counted_and_the_rest_goes_out() -> None:
    rig = Rig()
    rig.bridge.publish(replace(tick(0.1), tau_pid=(1e300,) * 6))
    rig.step(0.1)
    assert rig.bridge.counts["unfit"] == 1
    assert rig.told("tau_cmd")


def test_writes_stay_small_enough_for_a_datagram_and_hold_whole_frames() -> None:
    rig = Rig()
    for i in range(40):
        rig.bridge.publish(tick(0.01 * i))
    rig.bridge.step()
    chunks = []
    while data := rig.ground.read(0.0):
        chunks.append(data)
    assert max(map(len, chunks)) <= 1200
    assert len(chunks) > 5
    framer = Framer()
    for chunk in chunks:
        assert sum(len(frame.raw) for frame in framer.feed(chunk)) == len(chunk)


def test_it_hears_a_flood_in_parts_and_still_does_its_work() -> None:
    rig = Rig()
    assert isinstance(rig.ground, MemoryLink)
    for _ in range(500):
        rig.ground.write(rig.encoder.encode(dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)))
    rig.bridge.publish(tick(0.1))
    rig.step(0.1)
    assert rig.told("tau_cmd")
