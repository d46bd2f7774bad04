"""The dry doctor: what was heard, judged one check at a time."""

import math
import re

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.clock import SimulatedClock
from bridge.errors import LinkTimeout
from bridge.framing import Encoder, Framer, decode
from bridge.messages.readings import Reading, encode
from bridge.vehicle.config import load_vehicle
from gcs_plugin.doctor.checks import check_disk, check_parameters, dry_findings
from gcs_plugin.doctor.findings import Level, fail, ok, warn, worst
from gcs_plugin.doctor.observe import observe

RATES = {
    "imu": (50.0, (0.1, 0.0, -9.81, 0.0, 0.0, 0.0, math.nan)),
    "fog": (50.0, (0.0,)),
    "dvl": (8.0, (0.0, 0.0, 0.0, 0.01)),
    "altitude": (8.0, (2.0,)),
    "pressure": (10.0, (103000.0, 15.0)),
    "attitude": (20.0, (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)),
    "pwm": (20.0, (1500.0,) * 8 + (0.0,) * 24),
    "tau_cmd": (20.0, (0.0,) * 6),
    "nu_fb": (20.0, (0.0,) * 6),
    "nu_ref": (20.0, (0.0,) * 14),
    "ff_mode": (1.0, (1.0,)),
    "veh_cfg": (1.0, (0.0,)),
    "alive": (1.0, (0.0, 12.0, 0.0)),
    "clock": (1.0, ()),
}


class Talker:
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
    file = load_vehicle(vehicle) if vehicle else None
    found = dry_findings(observed, file.vehicle if file else None, free_bytes, "/dives")
    return {finding.name: finding for finding in found}


def trouble(found):
    return {name: f.sentence for name, f in found.items() if f.level is not Level.OK}


def test_a_healthy_vehicle_has_nothing_wrong(talker):
    found = examined(talker)
    assert trouble(found) == {}
    assert found["imu"].sentence.startswith("IMU: 50")
    assert found["link"].sentence.startswith("talker:: a vehicle beats, disarmed")
    assert len(found) == 19


def test_silence_is_a_failed_link(talker):
    talker.rates, talker.answers_time = {}, False
    found = examined(talker)
    assert found["link"].sentence == "talker:: nothing arrived in 10 s; check cable and address"
    assert set(found) == {"link", "disk"}


def test_frames_without_a_heartbeat_are_no_vehicle(talker):
    del talker.rates["alive"]
    assert "no vehicle's HEARTBEAT" in examined(talker)["link"].sentence


def test_a_heart_that_stopped_is_told_with_its_age(talker):
    talker.stops_s["alive"] = 4.0
    assert "the vehicle went silent" in examined(talker)["link"].sentence


def test_losses_are_told(talker):
    talker.skip_every = 5
    assert re.fullmatch(
        r"talker:: (19|20)\.\d% of 1/1 lost, as seen here; better the link", examined(talker)["loss"].sentence
    )


def test_a_vehicle_that_does_not_tell_the_time_is_said(talker):
    talker.answers_time = False
    assert "nobody answers TIMESYNC" in examined(talker)["time"].sentence


def test_a_slow_link_is_said_with_its_round_trip(talker):
    talker.delay_s = 0.5
    assert "round trip 500 ms" in examined(talker)["time"].sentence


@pytest.mark.parametrize(("off_s", "way"), [(86400.0, "ahead of"), (-3600.0, "behind")])
def test_a_wrong_date_is_said(talker, off_s, way):
    talker.unix_off_s = off_s
    assert way in examined(talker)["date"].sentence


@pytest.mark.parametrize("signal", ["imu", "fog", "dvl", "pressure", "pwm", "veh_cfg"])
def test_a_sensor_that_says_nothing_fails(talker, signal):
    del talker.rates[signal]
    found = examined(talker)
    assert found[signal].level is Level.FAIL
    assert "nothing arrived in 10 s" in found[signal].sentence


@pytest.mark.parametrize("signal", ["tau_cmd", "nu_fb", "nu_ref"])
def test_what_only_a_mission_says_is_no_failure_without_one(talker, signal):
    del talker.rates[signal]
    assert trouble(examined(talker))[signal].endswith("it comes while a mission runs")
    assert examined(talker)[signal].level is Level.WARN


def test_a_sensor_that_went_silent_is_told_with_its_age(talker):
    talker.stops_s["dvl"] = 5.0
    assert trouble(examined(talker))["dvl"] == "DVL: the last value is 5.1 s old; it went silent"


def test_a_slow_sensor_is_told_with_its_rate(talker):
    talker.rates["imu"] = (5.0, RATES["imu"][1])
    assert trouble(examined(talker)) == {"imu": "IMU: 5.0 Hz, the contract asks for 25; check its settings"}


def test_a_sensor_that_the_vehicle_does_not_have_is_not_missed(talker):
    for signal in ("imu", "fog", "dvl", "altitude", "pressure", "attitude"):
        del talker.rates[signal]
    assert trouble(examined(talker, "ardusub_vectored")) == {}


def test_a_dvl_out_of_the_water_is_no_failure(talker):
    talker.rates["dvl"] = (8.0, (math.nan, math.nan, math.nan, math.nan))
    found = examined(talker)
    assert found["bottom lock"].level is Level.WARN
    assert "bottom lock in 0% of its pings" in found["bottom lock"].sentence


@pytest.mark.parametrize(
    ("force", "words"),
    [
        ((0.0, 0.0, 9.81), "zacc is positive at rest, so it is mounted upside down"),
        ((9.81, 0.0, 0.0), "its x axis points up or down"),
        ((0.0, -9.81, 0.0), "its y axis points up or down"),
        ((0.0, 0.0, -1.0), "feels 1.00 m/s2 at rest, not 9.81"),
    ],
)
def test_an_imu_that_feels_gravity_wrongly_fails(talker, force, words):
    talker.rates["imu"] = (50.0, (*force, 0.0, 0.0, 0.0, math.nan))
    assert words in trouble(examined(talker))["gravity"]


@pytest.mark.parametrize(("free", "level"), [(10**7, Level.FAIL), (10**8, Level.WARN), (10**10, Level.OK)])
def test_the_disk_is_judged_by_what_a_dive_needs(free, level):
    assert check_disk(free, "/dives").level is level


def test_parameters_that_can_not_be_read_are_the_errors_own_sentence():
    def broken():
        raise LinkTimeout("no vehicle; check the cable")

    assert check_parameters(broken) == fail("parameters", "no vehicle; check the cable")
    assert check_parameters(lambda: {"A": 1.0}) == ok("parameters", "1 parameters read")


def test_the_worst_finding_counts():
    assert worst([]) is Level.OK
    assert worst([ok("a", ""), warn("b", "")]) is Level.WARN
    assert worst([fail("c", ""), warn("b", "")]) is Level.FAIL
    assert warn("b", "x", 0.51239).to_json() == {
        "name": "b",
        "level": "warning",
        "sentence": "x",
        "confidence": 0.512,
    }
