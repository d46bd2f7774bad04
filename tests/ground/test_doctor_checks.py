"""The dry checks of the doctor, each by itself."""

import itertools
import math
import re

import pytest
from fakes.vehicle import QuietLink
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.clock import SimulatedClock
from bridge.vehicle.config import load_vehicle
from bridge.wire.framing import Encoder, Framer, decode
from bridge.wire.readings import Reading, encode
from gcs_plugin.doctor.checks import (
    Level,
    check_disk,
    check_parameters,
    dry_findings,
    findings_against_wet,
    ok,
    reported_veh_cfg,
)
from gcs_plugin.doctor.observe import observe

RATES = {
    "imu": (50.0, (0.1, 0.0, -9.81, 0.0, 0.0, 0.0, math.nan)),
    "fog": (50.0, (0.0,)),
    "dvl": (8.0, (0.0, 0.0, 0.0, 0.01)),
    "altitude": (8.0, (2.0,)),
    "pressure": (10.0, (103000.0, 15.0)),
    "attitude": (20.0, (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)),
    "pwm": (20.0, (1500.0,) * 8 + (0.0,) * 24),
    "rpm": (20.0, (0.0,) * 58),
    "battery": (1.0, (16.0, 1.0)),
    "gnss": (1.0, (3.0, 57.0, 10.0, 0.0, 1.0, 0.0, 0.0, 9.0)),
    "tau_cmd": (20.0, (0.0,) * 6),
    "nu_fb": (20.0, (0.0,) * 6),
    "nu_ref": (20.0, (0.0,) * 14),
    "ff_mode": (1.0, (1.0,)),
    "veh_cfg": (1.0, (0.0,)),
    "alive": (1.0, (0.0, 12.0, 0.0)),
    "clock": (1.0, ()),
}


class Talker(QuietLink):
    """A link on which a healthy vehicle talks, in simulated time; `rates` and the rest can be spoilt."""

    name = "talker:"

    def __init__(self, clock):
        self.clock, self.encoder, self.framer = clock, Encoder(1, 1), Framer()
        self.rates = dict(RATES)
        self.due_s = dict.fromkeys(RATES, 0.0)
        self.stops_s = {}
        self.unix_off_s = 0.0
        self.answers_time = True
        self.delay_s = 0.02
        self.skip_every = 0
        self.pending = []
        self.sent = 0

    def read(self, timeout_s):
        self.clock.advance_to(self.clock.now_s + timeout_s)
        now_s = self.clock.now_s
        out = [raw for due_s, raw in self.pending if due_s <= now_s]
        self.pending = [p for p in self.pending if p[0] > now_s]
        for signal, (rate_hz, values) in self.rates.items():
            while self.due_s[signal] <= now_s and now_s < self.stops_s.get(signal, 1e9):
                if signal == "clock":
                    values = (self.clock.unix_s() + self.unix_off_s,)
                raw = self.encoder.frame(*encode(Reading(signal, self.due_s[signal], values)))
                self.sent += 1
                if not (self.skip_every and self.sent % self.skip_every == 0):
                    out.append(raw)
                self.due_s[signal] += 1.0 / rate_hz
        return b"".join(out)

    def write(self, data):
        for frame in self.framer.feed(data):
            message = decode(frame)
            if message.get_type() == "TIMESYNC" and message.tc1 == 0 and self.answers_time:
                answer = dialect.MAVLink_timesync_message(
                    round((self.clock.now_s + 100.0) * 1e9), message.ts1
                )
                self.pending.append((self.clock.now_s + self.delay_s, self.encoder.encode(answer)))

    def close(self):
        self.rates = {}


@pytest.fixture
def talker():
    return Talker(SimulatedClock())


def examined(talker, vehicle="ruvifist", free_bytes=10**12):
    observed = observe(talker, talker.clock, 10.0)
    if vehicle is None:
        result = dry_findings(observed, None, free_bytes, "/dives")
    else:
        file = load_vehicle(vehicle)
        result = dry_findings(observed, file.vehicle, free_bytes, "/dives", configuration=file.configuration)
    return {finding.name: finding for finding in result}


def trouble(findings):
    return {name: f.sentence for name, f in findings.items() if f.level is not Level.OK}


def test_a_healthy_vehicle_has_nothing_wrong(talker):
    result = examined(talker)
    assert trouble(result) == {}
    assert result["imu"].sentence.startswith("IMU: 50")
    assert result["link"].sentence.startswith("talker:: a vehicle beats, disarmed")
    assert result["loss"].sentence.endswith("frames of system 1, component 1 arrived")
    assert len(result) == 24
    assert findings_against_wet(list(result.values())) == []


def test_silence_is_a_failed_link(talker):
    talker.rates, talker.answers_time = {}, False
    result = examined(talker)
    assert result["link"].sentence == "talker:: nothing arrived in 10 s; check cable and address"
    assert set(result) == {"link", "disk"}


def test_losses_are_told(talker):
    talker.skip_every = 5
    losses = re.fullmatch(
        r"talker:: (\d+) of (\d+) frames of system 1, component 1 lost, as seen here \((19|20)%\); better the link",
        examined(talker)["loss"].sentence,
    )
    assert int(losses[1]) / int(losses[2]) == pytest.approx(0.2, abs=0.01)


def test_what_a_router_keeps_back_of_another_ground_station_is_no_loss(talker):
    """Its sticks go to the vehicle alone, and leave gaps in the numbers of its heartbeats."""
    ground, read = Encoder(255, 190), talker.read

    def beside(timeout_s):
        data = read(timeout_s)
        ground.encode(dialect.MAVLink_manual_control_message(1, 0, 0, 500, 0, 0))
        return data + ground.encode(dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))

    talker.read = beside
    assert trouble(examined(talker)) == {}


def test_beside_an_autopilot_its_pulses_and_the_dvl_in_its_form_are_heard_and_a_companion_tells_no_loss(
    talker,
):
    """So it is with a companion of ArduSub, whose one link has a router."""
    autopilot, read, count = Encoder(1, 1), talker.read, itertools.count()
    for signal in ("dvl", "pwm"):
        talker.rates.pop(signal)
    talker.encoder, talker.skip_every = Encoder(1, 191), 5

    def beside(timeout_s):
        data = read(timeout_s)
        pulses = dialect.MAVLink_servo_output_raw_message(next(count), 0, *(1500,) * 8)
        delta = dialect.MAVLink_vision_position_delta_message(0, 100000, (0.0,) * 3, (0.01, 0.0, 0.0), 100.0)
        undated = dialect.MAVLink_system_time_message(0, 1000)
        ours = talker.encoder.encode(delta)
        return data + ours + b"".join(map(autopilot.encode, (pulses, undated)))

    talker.read = beside
    result = examined(talker)
    assert trouble(result) == {}
    assert result["pwm"].sentence.startswith("thruster commands: 20")
    assert result["loss"].sentence.endswith("frames of system 1, component 1 arrived")


@pytest.mark.parametrize(
    ("component", "advice"), [(1, ""), (191, ", at least 10 Hz is needed; check its settings")]
)
def test_an_autopilots_own_messages_may_be_as_seldom_as_any_ground_station_asks_for_them(
    talker, component, advice
):
    """ArduSub sends a ground station its pulses at a few hertz; its companion keeps to the contract."""
    talker.encoder = Encoder(1, component)
    ardusub = float(dialect.MAV_AUTOPILOT_ARDUPILOTMEGA)
    talker.rates.update(alive=(1.0, (0.0, 12.0, ardusub)), pwm=(4.0, RATES["pwm"][1]))
    assert examined(talker)["pwm"].sentence == f"thruster commands: 4.0 Hz{advice}"


def test_an_autopilot_that_does_not_know_its_date_is_not_said_to_be_decades_behind(talker):
    talker.rates.pop("clock")
    read = talker.read
    undated = dialect.MAVLink_system_time_message(0, 1000)
    talker.read = lambda timeout_s: read(timeout_s) + talker.encoder.encode(undated)
    assert "does not know its date" in examined(talker)["date"].sentence


def test_a_link_without_a_vehicle_is_told_with_the_frames_that_came(talker):
    talker.rates.pop("alive")
    talker.answers_time = False
    said = examined(talker)["link"].sentence
    assert said == f"talker:: {talker.sent} frames, but no vehicle's HEARTBEAT; is this the vehicle?"


CAMERA = (0.0, 30.0, 8.0)


def test_a_camera_alone_is_no_vehicle(talker):
    talker.rates["alive"] = (1.0, CAMERA)
    assert "but no vehicle's HEARTBEAT" in examined(talker)["link"].sentence


def test_a_vehicle_is_armed_as_its_autopilot_says_and_not_a_camera_or_a_computer_aboard(talker):
    talker.rates["alive"] = (1.0, (1.0, 12.0, 3.0))
    read, camera, computer = talker.read, Encoder(1, 100), Encoder(1, 194)

    def with_others(timeout_s):
        others = [encoder.frame(*encode(Reading("alive", 0.0, beat))) for encoder, beat in (
            (camera, CAMERA), (computer, (0.0, 18.0, 8.0)),
        )]  # fmt: skip
        return read(timeout_s) + b"".join(others)

    talker.read = with_others
    assert "a vehicle beats, armed" in examined(talker)["link"].sentence


def feels(*force):
    """Makes the IMU feel another gravity."""
    return lambda talker: talker.rates.update(imu=(50.0, (*force, 0.0, 0.0, 0.0, math.nan)))


@pytest.mark.parametrize(
    ("spoil", "name", "words"),
    [
        (lambda t: t.stops_s.update(alive=4.0), "link", "the vehicle went silent"),
        (lambda t: setattr(t, "answers_time", False), "time", "nobody answers TIMESYNC"),
        (lambda t: setattr(t, "delay_s", 0.5), "time", "round trip 500 ms"),
        (lambda t: setattr(t, "unix_off_s", 86400.0), "date", "ahead of"),
        (lambda t: setattr(t, "unix_off_s", -3600.0), "date", "behind"),
        (lambda t: t.stops_s.update(dvl=5.0), "dvl", "DVL: the last value is 5.1 s old; it went silent"),
        (
            lambda t: t.rates.update(imu=(5.0, RATES["imu"][1])),
            "imu",
            "IMU: 5.0 Hz, at least 25 Hz is needed; check its settings",
        ),
        (
            lambda t: t.rates.update(dvl=(8.0, (math.nan,) * 4)),
            "bottom lock",
            "bottom lock in 0% of its pings",
        ),
        *(
            (
                lambda t, signal=signal: t.rates.pop(signal),
                signal,
                "nothing arrived in 10 s; check the device",
            )
            for signal in ("imu", "fog", "dvl", "pressure", "rpm", "battery", "gnss")
        ),
        *(
            (
                lambda t, signal=signal: t.rates.pop(signal),
                signal,
                "nothing arrived in 10 s; start the program aboard that sends it",
            )
            for signal in ("pwm", "ff_mode", "veh_cfg")
        ),
        (feels(0.0, 0.0, 9.81), "gravity", "zacc is positive at rest, so it is mounted upside down"),
        (feels(9.81, 0.0, 0.0), "gravity", "its x axis points up or down"),
        (feels(0.0, -9.81, 0.0), "gravity", "its y axis points up or down"),
        (feels(0.0, 0.0, -1.0), "gravity", "feels 1.00 m/s2 at rest, not 9.81"),
    ],
)
def test_what_is_wrong_is_said_in_its_own_finding(talker, spoil, name, words):
    spoil(talker)
    assert words in trouble(examined(talker))[name]


@pytest.mark.parametrize("signal", ["tau_cmd", "nu_fb", "nu_ref"])
def test_what_only_a_mission_says_is_no_failure_without_one(talker, signal):
    del talker.rates[signal]
    finding = examined(talker)[signal]
    assert finding.sentence.endswith("none now, it comes while a mission runs")
    assert finding.level is Level.OK


def test_a_sensor_that_the_vehicle_does_not_have_is_not_missed(talker):
    for signal in ("imu", "fog", "dvl", "altitude", "pressure", "attitude", "rpm", "battery", "gnss"):
        del talker.rates[signal]
    talker.rates["pwm"] = (20.0, (1500.0,) * 6)
    assert trouble(examined(talker, "ardusub_vectored")) == {}


def test_without_a_vehicle_file_nobody_misses_a_receiver_or_speed_controllers(talker):
    for signal in ("rpm", "battery", "gnss"):
        del talker.rates[signal]
    result = examined(talker, None)
    assert trouble(result) == {}
    assert not {"rpm", "battery", "gnss"} & set(result)


@pytest.mark.parametrize(
    ("vehicle", "veh_cfg", "words"),
    [
        ("ruvifist:hovering", 0.0, "says VEH_CFG 0, survey, and you chose hovering (1); choose survey"),
        ("ruvifist:survey", 2.0, "says VEH_CFG 2, 'ruvifist' has 0 survey, 1 hovering; give this vehicle's"),
        ("bluerov2_heavy", 1.0, "says VEH_CFG 1, 'bluerov2_heavy' has 0 heavy"),
    ],
)
def test_the_file_of_another_vehicle_or_another_shape_fails(talker, vehicle, veh_cfg, words):
    talker.rates["veh_cfg"] = (1.0, (veh_cfg,))
    result = examined(talker, vehicle)
    assert words in result["configuration"].sentence
    (refused,) = findings_against_wet(list(result.values()))
    assert refused.sentence == "not begun, no thruster turned; first mend what failed: 'configuration'"


@pytest.mark.parametrize("veh_cfg", [math.nan, math.inf, -math.inf, 0.5])
def test_a_configuration_that_is_no_whole_number_is_not_said(talker, veh_cfg):
    talker.rates["veh_cfg"] = (1.0, (veh_cfg,))
    assert reported_veh_cfg(observe(talker, talker.clock, 10.0)) is None
    result = examined(talker, "ruvifist:hovering")
    assert findings_against_wet(list(result.values())) == []


@pytest.mark.parametrize("fills_up", [(), (0.0,) * 26])
def test_another_number_of_thrusters_than_the_file_has_fails(talker, fills_up):
    talker.rates["pwm"] = (20.0, ((1500.0,) * 6 + fills_up))
    result = examined(talker, "ruvifist:survey")
    assert trouble(result) == {
        "thrusters": "the vehicle commands 6 thrusters, 'ruvifist:survey' has 8; give this vehicle's own file"
    }
    assert findings_against_wet(list(result.values()))


@pytest.mark.parametrize(
    ("system", "sentence"),
    [(1, "two vehicles beat as system 1, component 1"), (2, "several vehicles beat (systems 1, 2)")],
    ids=["with one id", "each with its own"],
)
def test_signals_of_two_vehicles_are_not_judged_as_those_of_a_single_one_and_forbid_the_wet_check(
    talker, system, sentence
):
    other = Talker(talker.clock)
    other.encoder, other.answers_time = Encoder(system, 1), False
    for _ in range(100):
        other.encoder.frame(0, bytes(9))
    read = talker.read
    talker.read = lambda timeout_s: read(timeout_s) + other.read(0.0)
    result = examined(talker)
    assert sentence in result["vehicles"].sentence
    (refused,) = findings_against_wet(list(result.values()))
    assert refused.level is Level.FAIL


@pytest.mark.parametrize(("free", "level"), [(10**7, Level.FAIL), (10**8, Level.WARN), (10**10, Level.OK)])
def test_the_disk_is_judged_by_what_a_dive_needs(free, level):
    assert check_disk(free, "/dives").level is level


def test_the_settings_that_leave_an_autopilot_alone_without_sticks_or_a_fail_safe_are_warned_of():
    read = {"FRAME_CONFIG": 1.0, "SYSID_THISMAV": 1.0, "SYSID_MYGCS": 1.0, "FS_GCS_ENABLE": 0.0}
    first, *found = check_parameters(lambda: read)
    assert first == ok("parameters", "4 parameters read")
    assert [(finding.level, finding.sentence.split(" is ")[0]) for finding in found] == [
        (Level.WARN, "SYSID_MYGCS"),
        (Level.WARN, "FS_GCS_ENABLE"),
    ]
    assert check_parameters(lambda: read | {"SYSID_MYGCS": 255.0, "FS_GCS_ENABLE": 2.0}) == [first]


@pytest.mark.parametrize("signal", ["imu", "fog", "pressure", "attitude"])
def test_a_device_that_sends_on_time_and_tells_no_number_is_no_good_finding(talker, signal):
    hz, values = RATES[signal]
    talker.rates[signal] = (hz, (math.nan,) * len(values))
    findings = examined(talker)
    assert findings[signal].level is Level.FAIL
    assert findings[signal].sentence.endswith("Hz, and no number in any of it; check the device")
    # What feels no force tells nothing of how it is mounted.
    assert ("gravity" in findings) is (signal != "imu")
