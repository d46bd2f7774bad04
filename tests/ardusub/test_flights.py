"""A plan flown beside ArduSub, the fake one and the firmware: by sticks, within limits, and every failure's end."""

import random
import sys

import numpy as np
import pytest
from fakes.ardusub import ALT_HOLD, DISARM_BUTTON, MANUAL, Ardusub, Quirks
from fakes.firmware import Firmware
from pymavlink.dialects.v20 import ardupilotmega as dialect
from rig import FILE, Aboard, Pilot, arm, ready
from test_dvl_and_recording import WITH_DVL, Dvl

from bench.ardusub.firmware import SteppedLink
from bridge.files import state_folder
from bridge.flight.flight import End, State
from bridge.flight.limits import FlightLimits
from bridge.onboard.orders import Ground
from bridge.onboard.program import LEAVE_WITHIN_S
from bridge.vehicle.legs import Leg
from bridge.vehicle.mode import Mode
from bridge.wire.framing import Encoder, Framer, decode
from gcs_plugin.flying.session import FlightSession
from tui.flight_recording import recorded_crew

LIMITS = FlightLimits(0.3, 8.0, 1.0, 6.0, 0.9, 25.0, 12.0, 900.0, hold_s=3.0)
WAVE = (Leg(2.0, push_surge_n=8.0), Leg(4.0, push_surge_n=-8.0, alternate=3), Leg(2.0, push_surge_n=8.0))
BATTERY = {"BATT_MONITOR": 4, "BATT_VOLT_PIN": 13, "BATT_CURR_PIN": 12, "SIM_BATT_VOLTAGE": 16}
COUNTDOWN_S = 4.0
DEPTH_M = 4.0
BACK_M = 0.5
SOONEST_S = 4.5


class Flown:
    """A companion, its DVL, and a ground that flies it. `ground` False: no word of the ground arrives any more."""

    def __init__(self, autopilot, limits=LIMITS, **options):
        self.autopilot, self.limits, self.ground, self.alone = autopilot, limits, True, 0
        self.pilot, self.session = Pilot(autopilot), FlightSession((1, 191), 1000)
        self.pilot.flies, self.options = False, options
        feed = self.pilot.framer.feed
        self.pilot.framer.feed = lambda data: [self._heard(frame) for frame in feed(data)]
        self.start()

    def start(self):
        """A companion starts, in place of one before it."""
        self.aboard = Aboard(self.autopilot, file=WITH_DVL, store=state_folder() / "sticks", **self.options)
        self.dvl = Dvl(self.autopilot, self.aboard, (0.0, 0.0, 0.0))

    @property
    def flight(self):
        return self.aboard.companion.flights.flight

    @property
    def pwm(self):
        return {round(us) for us in self.aboard.companion.heard.pwm_us[:6]}

    @property
    def armed(self):
        """By the autopilot's own word to the ground."""
        beats = [m for m in self.pilot.of("HEARTBEAT") if m.get_srcComponent() == 1]
        return bool(beats[-1].base_mode & 128)

    def away_m(self):
        return float(np.hypot(*self.autopilot.body.state[:2])) if self.autopilot.is_firmware else 0.0

    def __call__(self):
        for act in (self.aboard, self.dvl):
            act()
        self.pilot.beats = self.ground
        self.pilot()
        for message in self.session.tick(self.autopilot.clock.boot_s()):
            if self.ground:
                self.pilot.send(message)

    def run(self, seconds):
        self.autopilot.run(seconds, self)
        return self

    def until(self, over, within_s=90.0):
        assert self.autopilot.until(over, within_s, self), (
            self.flight.state, self.flight.end, self.flight.pose, self.session.failure, self.pilot.texts(),
        )  # fmt: skip
        return self

    def afloat(self, mode=MANUAL):
        """Known to the companion, disarmed."""
        ready(self.autopilot, self.aboard, self.pilot, self.dvl)
        self.until(lambda: self.aboard.companion.no_flight(self.autopilot.clock.boot_s()) == "")
        self.autopilot.set_mode(mode)
        self.until(lambda: self.aboard.companion.heard.mode == mode)
        return self.run(4.0)

    def begin(self):
        depth_m = self.aboard.bridge.navigation.depth_m
        self.session.begin(self.limits, depth_m, COUNTDOWN_S)
        return self.until(lambda: self.session.ready or self.session.over)

    def flying(self, seconds=3.0):
        self.begin()
        self.session.fly(WAVE)
        self.until(lambda: self.flight.state is State.FLYING)
        self.run(seconds)
        assert self.flight.state is State.FLYING
        assert self.pwm != {1500}
        return self

    def is_free(self):
        """The sticks are the pilot's again."""
        assert self.pilot.read("SYSID_MYGCS") == 255
        return True

    def _heard(self, frame):
        self.session.on_frame(frame, self.autopilot.clock.boot_s())
        return frame


@pytest.fixture(params=["fake", "firmware"])
def flown(request, tmp_path):
    autopilot = Ardusub() if request.param == "fake" else Firmware(tmp_path / "sitl", settings=BATTERY)
    yield Flown(autopilot)
    autopilot.close()


def test_a_plan_is_flown_by_sticks_and_the_vehicle_ends_where_it_began_as_it_was(flown):
    flown.afloat(ALT_HOLD).begin()
    assert flown.pilot.read("SYSID_MYGCS") == 1
    flown.session.fly(WAVE)
    flown.until(lambda: flown.flight.state is State.FLYING).run(1.5)
    assert flown.pwm & set(range(1550, 1650)), "8 N of push"
    flown.until(lambda: flown.session.ready)
    flown.session.finish()
    flown.until(lambda: flown.session.over)
    flown.session.disarm()
    flown.until(lambda: flown.session.idle and not flown.aboard.companion.steering.active).run(2.0)
    assert (flown.flight.end, flown.armed, flown.pwm) == (End.FINISHED, False, {1500})
    assert flown.away_m() < BACK_M
    assert flown.is_free()


@pytest.mark.parametrize("push_n", [2.0, 8.0, 200.0])
def test_the_wrench_recorded_is_that_of_the_sticks_sent_whatever_was_wanted(fake, push_n):
    """Within the dead zone of the thrusters, between, and beyond a full stick."""
    flown = Flown(fake)
    flown.afloat().begin()
    companion = flown.aboard.companion
    actuations, take = [], companion.take_actuations
    companion.take_actuations = lambda: [actuations.append(taken) or taken for taken in take()]
    flown.session.fly((Leg(3.0, push_surge_n=push_n),))
    flown.until(lambda: flown.flight.state is State.FLYING).run(2.0)
    pulses = [*fake.pwm[:4], 1500, 1500]
    surge_n = companion.law._mixer.wrench_of_pulses(pulses)[0]
    assert actuations[-1].tau_cmd[0] == pytest.approx(surge_n, abs=0.25)
    assert actuations[-1].tau_cmd[3:5] == (0.0, 0.0)
    assert (surge_n < 0.9 * push_n) == (push_n > 100)


def test_a_touched_stick_has_the_vehicle_at_once_in_the_mode_it_was_in(flown):
    flown.afloat(ALT_HOLD).flying()
    flown.pilot.flies = True
    flown.run(1.0)
    assert flown.flight.state is State.FLYING, "sticks at rest"
    flown.pilot.sticks["y"] = 300
    flown.run(0.2)
    assert (flown.flight.state, flown.flight.end) == (State.IDLE, End.STICKS)
    flown.run(3.0)
    assert flown.aboard.companion.heard.pwm_us[:4] == pytest.approx((1560, 1440, 1560, 1440), abs=30)
    assert flown.aboard.companion.heard.mode == ALT_HOLD
    assert flown.armed
    assert flown.is_free()


@pytest.mark.parametrize("moved", ["sticks", "override"])
def test_the_sticks_of_any_program_of_the_grounds_system_end_a_flight_though_a_single_one_gives_orders(moved):
    flown = Flown(Ardusub(), ground=Ground(255, 190)).afloat().flying()
    gamepad = Encoder(255, 7)
    away = (1500, 1500, 1500, 1500, 1700, 1500, 65535, 65535)
    message = {
        "sticks": dialect.MAVLink_manual_control_message(1, 800, 0, 500, 0, 0),
        "override": dialect.MAVLink_rc_channels_override_message(1, 0, *away),
    }[moved]
    flown.autopilot.ground.write(gamepad.encode(message))
    flown.run(0.2)
    assert (flown.flight.state, flown.flight.end) == (State.IDLE, End.STICKS)


def test_a_short_tap_on_a_button_that_ends_a_flight_is_obeyed_by_the_autopilot_too():
    flown = Flown(Ardusub()).afloat().flying()
    flown.pilot.flies = True
    flown.run(0.2)
    flown.pilot.send(dialect.MAVLink_manual_control_message(1, **flown.pilot.sticks, buttons=DISARM_BUTTON))
    flown.run(0.2)
    assert (flown.flight.end, flown.autopilot.armed) == (End.STICKS, False)


def test_a_battery_that_is_not_told_any_more_counts_as_too_low_after_2_s_from_its_last_reading():
    flown = Flown(Ardusub()).afloat().flying(0.5)
    flown.autopilot.voltage_v = 0.0
    last_s = flown.aboard.companion.heard.voltage_s
    flown.until(lambda: flown.flight.state is State.RETURNING, 4.0)
    assert flown.flight.end is End.BATTERY
    assert 2.2 < flown.autopilot.clock.boot_s() - last_s < 2.4, "2 s, and a quarter for every limit"


@pytest.mark.parametrize("mode", [Mode.OFF, Mode.SHADOW])
def test_no_set_is_put_in_force_in_a_flight_whose_loop_would_wait_for_the_disk(mode):
    flown = Flown(Ardusub(), mode=mode).afloat().flying(0.5)
    parameters, kept = flown.aboard.parameters, []
    parameters._memory.save = lambda *stored: kept.append(stored)
    active = parameters.active_crc
    flown.pilot.write("FF_COMMIT", 0.0, component=191)
    flown.run(0.2)
    assert (parameters.active_crc, kept) == (active, [])
    assert "FF_COMMIT refused: in a flight, end it first" in flown.pilot.texts()
    flown.autopilot.arm(False)
    flown.until(lambda: flown.flight.state is State.IDLE, 3.0)
    flown.pilot.write("FF_COMMIT", 0.0, component=191)
    flown.run(0.2)
    assert (parameters.active_crc, len(kept)) == (0, 1)


def test_the_end_key_holds_it_and_a_second_press_disarms_it(flown):
    flown.afloat().flying()
    flown.session.stop()
    flown.until(lambda: flown.flight.state is State.HOLDING, 0.5)
    flown.session.disarm()
    flown.until(lambda: flown.session.idle and not flown.armed, 3.0).run(0.5)
    assert flown.pwm == {1500}


def test_an_end_key_just_after_the_arming_leaves_it_disarmed():
    """The autopilot says once a second whether it is armed: its last word is of before."""
    flown = Flown(Ardusub()).afloat()
    flown.session.begin(flown.limits, flown.aboard.bridge.navigation.depth_m, COUNTDOWN_S)
    flown.until(lambda: flown.autopilot.armed)
    assert not flown.aboard.companion.heard.armed
    flown.session.stop()
    flown.until(lambda: flown.flight.state is State.IDLE, 0.5).run(3.0)
    assert not flown.autopilot.armed
    assert flown.is_free()


def test_a_stick_touched_just_after_the_change_of_mode_has_the_mode_that_was_before():
    """The autopilot says its mode once a second: its last word is of before."""
    flown = Flown(Ardusub()).afloat(ALT_HOLD)
    arm(flown.autopilot, flown.aboard, flown.pilot, flown.dvl)
    flown.run(1.5)
    flown.session.begin(flown.limits, flown.aboard.bridge.navigation.depth_m, COUNTDOWN_S)
    flown.until(lambda: flown.autopilot.mode == MANUAL)
    assert flown.aboard.companion.heard.mode == ALT_HOLD
    flown.pilot.flies, flown.pilot.sticks["y"] = True, 300
    flown.until(lambda: flown.flight.state is State.IDLE, 0.5).run(3.0)
    assert (flown.flight.end, flown.autopilot.mode, flown.autopilot.armed) == (End.STICKS, ALT_HOLD, True)
    assert flown.is_free()


def test_a_vehicle_that_the_pilot_holds_armed_is_taken_in_the_last_seconds(flown):
    flown.afloat(ALT_HOLD)
    arm(flown.autopilot, flown.aboard, flown.pilot, flown.dvl)
    flown.run(1.5)
    flown.session.begin(flown.limits, flown.aboard.bridge.navigation.depth_m, 6.0)
    flown.run(2.5)
    assert flown.aboard.companion.heard.mode == ALT_HOLD, "it keeps its depth meanwhile"
    flown.until(lambda: flown.session.ready)
    flown.session.finish()
    flown.until(lambda: flown.flight.state is State.HOLDING)


def test_the_grounds_recording_tells_how_late_the_autopilots_rates_are(fake, tmp_path):
    aboard = Aboard(fake, file=WITH_DVL)
    acts = (aboard, Dvl(fake, aboard))
    port = SteppedLink(fake, *acts)
    crew, recorder, folder = recorded_crew(port, FILE, "standard", tmp_path, fake.clock, print)
    assert fake.until(lambda: aboard.companion.settings.complete, 30.0, *acts)
    port.read(0.0)
    crew.find(1)
    for _ in range(60):
        crew.step()
    recorder.close()
    assert {"INS_GYRO_FILTER": 20.0, "INS_ACCEL_FILTER": 20.0}.items() <= _stated(folder).items()


def _stated(folder):
    """What PARAM_VALUE states in a recording, by name."""
    messages = map(decode, Framer().feed((folder.path / "telemetry.tlog").read_bytes()))
    return {m.param_id: m.param_value for m in messages if m and m.get_type() == "PARAM_VALUE"}


def change_mode(flown):
    flown.autopilot.set_mode(ALT_HOLD)


def write_sysid(flown):
    flown.pilot.write("SYSID_MYGCS", 255)


@pytest.mark.parametrize("take", [change_mode, write_sysid])
def test_a_mode_or_sysid_that_another_program_sets_ends_the_flight_with_nothing_steered(flown, take):
    flown.afloat().flying()
    take(flown)
    flown.until(lambda: flown.flight.state is State.IDLE, 8.0)
    assert flown.flight.end is End.TAKEN
    flown.run(3.0)
    if take is change_mode:
        assert flown.aboard.companion.heard.mode == ALT_HOLD
    assert flown.aboard.companion.heard.pwm_us[:4] == pytest.approx((1500,) * 4, abs=60), "heading alone"
    assert flown.is_free()


def test_an_autopilot_that_is_not_heard_any_more_but_hears_is_put_at_rest_and_disarms_by_itself():
    """Only one way of its link is broken: by the flight's last stick it would push on."""
    fake = Ardusub(quirks=Quirks(checks_pilot=False))
    flown = Flown(fake).afloat().flying()
    fake.aboard.read = lambda _timeout_s: b""
    flown.until(lambda: flown.flight.state is State.IDLE, 4.0)
    assert flown.flight.end is End.TAKEN
    flown.run(0.2)
    assert {*fake.pwm[:4]} == {1500}
    flown.until(lambda: not fake.armed, fake.quirks.ground_timeout_s + 1.5)


def test_the_sticks_at_rest_after_a_flight_that_another_program_ends_do_not_hang_on_a_single_message():
    flown = Flown(Ardusub()).afloat().flying()
    fake, write, lost = flown.autopilot, flown.autopilot.aboard.write, []

    def lose_the_first(data):
        rests = [
            f for f in Framer().feed(data)
            if f.message_id == dialect.MAVLINK_MSG_ID_MANUAL_CONTROL and flown.flight.state is State.IDLE
        ]  # fmt: skip
        if rests and not lost:
            lost.extend(rests)
        else:
            write(data)

    fake.aboard.write = lose_the_first
    change_mode(flown)
    flown.until(lambda: flown.flight.state is State.IDLE, 8.0).run(0.5)
    assert lost
    assert fake.sticks == (0, 0, 500, 0)


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
        ("FS_GCS_ENABLE", 0.0, "no flight: FS_GCS_ENABLE must stop the vehicle: set it to 2"),
        (
            "FRAME_CONFIG",
            4.0,
            "no flight: FRAME_CONFIG 4 is not supported: 1 (vectored) and 2 (vectored_6dof) are",
        ),
        ("SYSID_MYGCS", 254.0, "no flight: SYSID_MYGCS is 254, the pilot's system 255"),
    ],
)
def test_what_speaks_against_a_flight_is_said(name, value, reason):
    fake = Ardusub()
    fake.parameters[name] = value
    flown = Flown(fake)
    flown.run(9.0)
    flown.session.begin(LIMITS, 2.0, COUNTDOWN_S)
    flown.run(1.0)
    assert reason in "".join(flown.pilot.texts())
    assert not fake.armed


def test_nothing_is_armed_without_a_flight_and_a_stopped_companion_leaves_it_disarmed():
    flown = Flown(Ardusub()).afloat()
    assert not flown.aboard.companion.arm(True)
    flown.flying()
    flown.until(lambda: flown.aboard.companion.leave(), 5.0).run(1.0)
    assert (flown.flight.end, flown.armed, flown.pwm) == (End.TAKEN, False, {1500})
    assert flown.is_free()


@pytest.mark.parametrize("armed", [True, False])
def test_a_companion_that_is_stopped_in_a_countdown_disarms_and_proves_the_sticks_given_back_in_time(armed):
    flown = Flown(Ardusub()).afloat(ALT_HOLD)
    flown.session.begin(flown.limits, flown.aboard.bridge.navigation.depth_m, 30.0)
    flown.until(lambda: flown.aboard.companion.heard.mode == MANUAL)
    if armed:
        flown.until(lambda: flown.aboard.companion.armed)
    flown.until(lambda: flown.aboard.companion.leave(), LEAVE_WITHIN_S).run(0.1)
    assert flown.flight.state is State.IDLE
    assert (flown.autopilot.armed, flown.autopilot.mode) == (False, ALT_HOLD)
    assert flown.is_free()


def no_failsafe(flown):
    flown.pilot.write("FS_GCS_ENABLE", 0.0)


def second_companion(flown):
    """It beats on the companion's link, with the address of the first."""
    other = Encoder(1, 191)
    for _ in range(3):
        other.encode(dialect.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3))
        flown.autopilot.ends[1].write(other.encode(dialect.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3)))


def applet_beats(flown):
    flown.autopilot.send(dialect.MAVLink_named_value_float_message(0, b"FF_MODE", 0.0))


def test_a_depth_sensor_that_the_autopilot_reports_as_failed_ends_the_flight_though_its_last_pressure_comes():
    flown = Flown(Ardusub()).afloat().flying()
    flown.autopilot.depth_fails = True
    flown.until(lambda: flown.flight.state is State.HOLDING, 3.0)
    assert flown.flight.end is End.NO_DEPTH
    flown.until(lambda: not flown.autopilot.armed, 10.0)
    flown.session.begin(flown.limits, 2.0, COUNTDOWN_S)
    flown.run(1.0)
    assert "no flight: no depth" in "".join(flown.pilot.texts())


def test_no_flight_begins_where_a_stick_pushes_otherwise_in_heave_than_in_the_other_axes():
    fake = Ardusub()
    fake.parameters["JS_THR_GAIN"] = 0.5
    flown = Flown(fake)
    flown.run(10.0)
    flown.session.begin(flown.limits, 2.0, COUNTDOWN_S)
    flown.run(1.0)
    assert "no flight: JS_THR_GAIN is 0.5: set it to 1" in "".join(flown.pilot.texts())
    flown.until(lambda: flown.aboard.companion.no_flight(fake.clock.boot_s()) != "")
    fake.parameters["JS_THR_GAIN"] = 1.0
    flown.until(lambda: flown.aboard.companion.no_flight(fake.clock.boot_s()) == "")


@pytest.mark.parametrize("change", [no_failsafe, second_companion, applet_beats])
def test_what_would_have_let_no_flight_begin_brings_it_back_under_way(fake, change):
    flown = Flown(fake).afloat().flying()
    change(flown)
    flown.until(lambda: flown.flight.state is State.RETURNING, 2.0)
    assert flown.flight.end is End.UNFIT
    flown.until(lambda: not flown.armed)
    assert any("no feed-forward: " in text for text in flown.pilot.words())
    assert flown.run(3.0).is_free()


def kill(flown):
    flown.aboard.alive = False


def lose_link(flown):
    flown.ground = False


def silence_dvl(flown):
    flown.dvl.alive = False


def drain(flown):
    flown.autopilot.voltage_v = 11.5
    flown.pilot.write("SIM_BATT_VOLTAGE", 11.5)


def restart(flown):
    flown.start()


FAILURES = {
    "companion killed": (kill, (), 3.5),
    "link lost": (lose_link, (End.LINK,), BACK_M),
    "DVL silent": (silence_dvl, (End.VELOCITY,), 2.5),
    "battery low": (drain, (End.BATTERY,), BACK_M),
    "191 restarted": (restart, (), 2.5),
}


def ends_as_documented(flown, name, rng):
    """A failure at any moment from the end of the countdown to the way back: disarmed, thrusters at rest, near
    enough to where it began, the sticks the pilot's; return the seconds that took, and metres from the beginning."""
    fail, ends, within_m = FAILURES[name]
    began = flown.autopilot.body.state[:2].copy() if flown.autopilot.is_firmware else np.zeros(2)
    flown.session = FlightSession((1, 191), flown.session._number + 10)
    flown.session.begin(flown.limits, flown.aboard.bridge.navigation.depth_m, COUNTDOWN_S)
    flown.until(lambda: flown.flight.state is State.GOING)
    flight, asked, at_s = flown.flight, False, flown.autopilot.clock.boot_s() + rng.uniform(0.0, 20.0)

    def ask():
        nonlocal asked
        if flown.session.ready and not asked:
            flown.session.fly(WAVE)
            asked = True
        elif flown.session.ready:
            flown.session.finish()
        return flown.autopilot.clock.boot_s() >= at_s

    flown.until(ask)
    state = flight.state
    fail(flown)
    failed_s = flown.autopilot.clock.boot_s()
    flown.until(lambda: not flown.armed, 90.0)
    took_s = flown.autopilot.clock.boot_s() - failed_s
    flown.ground = True
    if name == "companion killed":
        within_s = flown.aboard.disarmed_within_s
        assert took_s < within_s
        # As far as a firmware gets that disarms as soon as 4.5, and further by as much as it takes longer.
        within_m *= within_s / SOONEST_S
        flown.start()
    flown.run(6.0)
    assert (flown.flight.state, flown.armed, flown.pwm) == (State.IDLE, False, {1500})
    assert flown.is_free()
    if ends:
        assert state is State.RETURNING or flight.end in ends
    away_m = (
        float(np.hypot(*(flown.autopilot.body.state[:2] - began))) if flown.autopilot.is_firmware else 0.0
    )
    assert away_m < within_m
    return took_s, away_m


@pytest.mark.parametrize("name", FAILURES)
def test_each_failure_ends_as_documented(flown, name):
    ends_as_documented(flown.afloat(), name, random.Random(1))


def test_a_companion_that_starts_again_leaves_the_vehicle_to_a_pilot_who_is_there():
    flown = Flown(Ardusub()).afloat().flying()
    flown.pilot.flies = True
    flown.run(0.5)
    flown.start()
    flown.run(6.0)
    assert (flown.armed, flown.pwm) == (True, {1500})
    assert flown.is_free()


@pytest.mark.soak
@pytest.mark.parametrize("name", FAILURES)
def test_each_failure_ends_as_documented_twenty_times_with_the_firmware(name, tmp_path):
    ends = []
    for seed in range(20):
        autopilot = Firmware(tmp_path / str(seed), settings=BATTERY)
        try:
            ends.append(ends_as_documented(Flown(autopilot).afloat(), name, random.Random(seed)))
        finally:
            autopilot.close()
    took_s, away_m = zip(*ends, strict=True)
    sys.stderr.write(
        f"\n{name}: {len(ends)} of 20, disarmed {min(took_s):.1f} to {max(took_s):.1f} s after, at most "
        f"{max(away_m):.1f} m from where it began\n"
    )
