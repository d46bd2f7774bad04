"""The pulses of the wet check as orders to a vehicle: never without a yes, never on against trouble."""

from dataclasses import replace

import pytest
from fakes.vehicle import QuietLink
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.clock import SimulatedClock
from bridge.errors import ConfigError, LinkError, LinkTimeout
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.thrusters import thrust_curve
from bridge.wire.framing import Encoder, Framer, decode
from bridge.wire.readings import Reading, encode
from gcs_plugin.doctor.motor_orders import arm
from gcs_plugin.doctor.pulse_plan import duration_s, pulses
from gcs_plugin.doctor.pulses import run_pulses
from gcs_plugin.doctor.wet_record import find_pulses, record_of

FILE = load_vehicle("ruvifist")
PLANNED = pulses(FILE.vehicle, "hovering", thrust_curve(FILE.vehicle.thrust_curve, FILE.path.parent))


class ObedientVehicle(QuietLink):
    """Turns its thrusters as ordered, for as long as ordered; its faults are attributes."""

    name, autopilot, told_every_s = "obedient:", 0, 0.05

    def __init__(self):
        self.clock, self.encoder, self.framer = SimulatedClock(), Encoder(1, 1), Framer()
        self.queue = []
        self.next_beat_s = self.next_pwm_s = 0.0
        self.armed, self.state, self.beats = True, dialect.MAV_STATE_ACTIVE, True
        self.result = dialect.MAV_RESULT_ACCEPTED
        self.mute = 0
        self.at = {}
        self.orders = []
        self.until_s = {}
        self.pwm = [1500.0] * 8

    def read(self, timeout_s):
        self.clock.advance_to(self.clock.now_s + timeout_s)
        now_s = self.clock.now_s
        for when_s in [w for w in self.at if now_s >= w]:
            self.at.pop(when_s)(self)
        self.live(now_s)
        if self.beats and now_s >= self.next_beat_s:
            self.next_beat_s = now_s + 1.0
            mode = 128 if self.armed else 0
            self.say(dialect.MAVLink_heartbeat_message(12, self.autopilot, mode, 0, self.state, 3))
        if now_s >= self.next_pwm_s:
            self.next_pwm_s = now_s + self.told_every_s
            self.tell_pwm(now_s)
        out, self.queue = b"".join(self.queue), []
        return out

    def live(self, now_s):
        """End the pulses whose time is up."""
        for channel, end_s in list(self.until_s.items()):
            if now_s >= end_s:
                self.pwm[channel] = 1500.0
                del self.until_s[channel]

    def tell_pwm(self, now_s):
        values = [*self.pwm, *[0.0] * 24]
        self.say(dialect.MAVLink_actuator_output_status_message(round(now_s * 1e6), 255, values))

    def write(self, data):
        for frame in self.framer.feed(data):
            order = decode(frame)
            assert (order.target_system, order.target_component) == (1, 1)
            assert order.command == dialect.MAV_CMD_DO_MOTOR_TEST
            assert order.param2 == dialect.MOTOR_TEST_THROTTLE_PWM
            channel = int(order.param1) - 1
            self.orders.append((self.clock.now_s, channel, order.param3))
            if self.mute:
                self.mute -= 1
                continue
            if self.result == dialect.MAV_RESULT_ACCEPTED:
                self.pwm[channel] = order.param3
                self.until_s[channel] = self.clock.now_s + order.param4
            self.say(dialect.MAVLink_command_ack_message(order.command, self.result, 0, 0, 255, 190))

    def close(self):
        self.beats = False

    def say(self, message):
        self.queue.append(self.encoder.encode(message))


@pytest.fixture
def vehicle():
    return ObedientVehicle()


@pytest.mark.parametrize("asker", [(254, 190), (1, 191)])
def test_the_answer_to_another_grounds_order_to_arm_is_not_taken_for_its_own(vehicle, asker):
    vehicle.write = lambda _: vehicle.say(
        dialect.MAVLink_command_ack_message(dialect.MAV_CMD_COMPONENT_ARM_DISARM, 0, 0, 0, *asker)
    )
    with pytest.raises(LinkTimeout, match="an answer to the order to arm did not come"):
        arm(vehicle, vehicle.clock, (1, 1))


def run(vehicle):
    return run_pulses(vehicle, vehicle.clock, (1, 1), PLANNED)


def test_each_thruster_gets_its_one_pulse_on_time(vehicle):
    frames = run(vehicle)
    assert [channel for _, channel, _ in vehicle.orders] == list(range(8))
    assert all(abs(at_s - p.start_s) < 0.1 for (at_s, _, _), p in zip(vehicle.orders, PLANNED, strict=True))
    assert vehicle.clock.now_s < duration_s(PLANNED) + 1.0
    result = find_pulses(record_of(frames, 8).pwm)
    assert [p.thruster for p in result] == list(range(8))
    assert all(0.9 < p.end_s - p.start_s < 1.1 for p in result)


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda v: setattr(v, "armed", False), "the vehicle is disarmed"),
        (lambda v: setattr(v, "state", dialect.MAV_STATE_CRITICAL), "in a failsafe"),
        (lambda v: setattr(v, "beats", False), "no HEARTBEAT for 3 s"),
    ],
)
@pytest.mark.parametrize("at_s", [2.0, 14.7, 30.0])
def test_trouble_stops_the_check_and_the_thruster(vehicle, spoil, words, at_s):
    vehicle.at[at_s] = spoil
    with pytest.raises(LinkError, match=words):
        run(vehicle)
    assert vehicle.clock.now_s < at_s + 4.5
    assert vehicle.orders == [] or vehicle.clock.now_s - vehicle.orders[-1][0] < 8.0
    ran = max((p.thruster for p in PLANNED if p.start_s < vehicle.clock.now_s), default=-1)
    assert {channel for _, channel, _ in vehicle.orders} <= set(range(ran + 1))


def test_a_vehicle_that_was_disarmed_is_told_with_likely_causes_and_its_own_last_words(vehicle):
    def disarms(v):
        v.armed, v.next_beat_s = False, 0.0
        v.say(dialect.MAVLink_statustext_message(2, b"leak detected"))

    vehicle.at[14.0] = disarms
    with pytest.raises(LinkError) as caught:
        run(vehicle)
    assert "its thrusters are at neutral: the vehicle is disarmed: another ground station" in str(
        caught.value
    )
    assert str(caught.value).endswith("run the check again; it said last: 'leak detected'")


def test_a_second_vehicle_with_the_same_id_stops_the_thrusters(vehicle):
    vehicle.at[PLANNED[2].start_s + 0.3] = lambda v: setattr(v, "contested", frozenset(((1, 1),)))
    with pytest.raises(LinkError, match="two vehicles beat as system 1"):
        run(vehicle)
    assert vehicle.orders[-1][1:] == (2, 1500.0)
    assert len(vehicle.orders) == 4


@pytest.mark.parametrize(
    ("result", "words"),
    [
        (dialect.MAV_RESULT_UNSUPPORTED, "nobody on this link answers motor tests"),
        (dialect.MAV_RESULT_DENIED, "arm it and end its mission"),
        (99, "answers 99"),
    ],
)
def test_a_refusal_is_the_end_and_says_why(vehicle, result, words):
    vehicle.result = result
    with pytest.raises(LinkError, match=words):
        run(vehicle)
    assert {pwm for _, _, pwm in vehicle.orders[1:]} <= {1500.0}


def test_an_order_that_was_lost_is_tried_again(vehicle):
    vehicle.mute = 2
    frames = run(vehicle)
    assert [channel for _, channel, _ in vehicle.orders] == [0, 0, 0, 1, 2, 3, 4, 5, 6, 7]
    assert [p.thruster for p in find_pulses(record_of(frames, 8).pwm)] == list(range(8))


def test_a_vehicle_that_never_answers_is_given_up(vehicle):
    vehicle.mute = 99
    with pytest.raises(LinkError, match="does not answer the motor test"):
        run(vehicle)
    assert [pwm != 1500.0 for _, _, pwm in vehicle.orders] == [True, True, True, False]


def test_the_operators_stop_puts_the_thruster_to_neutral(vehicle):
    def interrupted(_):
        raise KeyboardInterrupt

    vehicle.at[PLANNED[2].start_s + 0.3] = interrupted
    with pytest.raises(KeyboardInterrupt):
        run(vehicle)
    assert vehicle.orders[-1][1:] == (2, 1500.0)


class ArduSub(ObedientVehicle):
    """Motors count from 0, an order holds until the next; without orders, pilot or ground it disarms."""

    autopilot, told_every_s = dialect.MAV_AUTOPILOT_ARDUPILOTMEGA, 0.5
    booted_s = 4_290.0  # before the companion: its clock wraps during the check

    def __init__(self):
        super().__init__()
        self.ordered_s = self.pilot_s = self.ground_s = self.clock.now_s
        self.testing, self.companion = False, Encoder(1, 191)

    def live(self, now_s):
        if self.testing and now_s > self.ordered_s + 0.5:
            self.disarm("Motor test timed out!")
        if self.testing and now_s > min(self.pilot_s, self.ground_s) + 3.0:
            self.disarm("failsafe")
        self.queue.append(self.companion.frame(*encode(Reading("fog", now_s, (0.0,)))))

    def tell_pwm(self, now_s):
        at_us = round((now_s + self.booted_s) * 1e6) & 0xFFFFFFFF
        pulses_us = [round(pulse) for pulse in self.pwm]
        self.say(dialect.MAVLink_servo_output_raw_message(at_us, 0, *pulses_us, *[0] * 8))
        self.say(dialect.MAVLink_servo_output_raw_message(at_us, 1, *[1900] * 16))

    def disarm(self, words):
        self.armed, self.testing, self.pwm, self.next_beat_s = False, False, [1500.0] * 8, 0.0
        self.say(dialect.MAVLink_statustext_message(6, words.encode()))

    def write(self, data):
        now_s = self.clock.now_s
        for frame in self.framer.feed(data):
            message = decode(frame)
            kind = message.get_type()
            if kind == "HEARTBEAT":
                self.ground_s = now_s
            elif kind == "MANUAL_CONTROL":
                assert (message.x, message.y, message.z, message.r) == (0, 0, 500, 0)
                self.pilot_s = now_s
            elif message.command == dialect.MAV_CMD_SET_MESSAGE_INTERVAL:
                assert message.param1 == dialect.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW
                self.told_every_s = message.param2 / 1e6
            else:
                self.testing, self.ordered_s = True, now_s
                self.pwm = [1500.0] * 8
                self.pwm[int(message.param1)] = message.param3
                self.orders.append((now_s, int(message.param1), message.param3))
                self.say(dialect.MAVLink_command_ack_message(message.command, 0, 0, 0, 255, 190))


def test_ardusub_is_kept_in_its_motor_test_from_the_first_order_to_the_last():
    vehicle = ArduSub()
    record = record_of(run(vehicle), 8)
    assert vehicle.armed
    result = find_pulses(record.pwm)
    assert [p.thruster for p in result] == list(range(8))
    assert all(0.85 < p.end_s - p.start_s < 1.15 for p in result)
    # The commands are told on the autopilot's clock, which wraps, and stand on the companion's.
    assert all(abs(p.start_s - q.start_s) < 0.2 for p, q in zip(result, PLANNED, strict=True))


def test_ardusub_turns_nothing_for_long_when_the_link_dies():
    vehicle = ArduSub()
    vehicle.at[PLANNED[0].start_s + 0.3] = lambda v: setattr(v, "write", lambda _: None)
    with pytest.raises(LinkError, match=r"the vehicle is disarmed.*Motor test timed out!"):
        run(vehicle)
    assert vehicle.clock.now_s < PLANNED[0].start_s + 2.0


def test_thrusters_that_rest_at_another_pulse_are_not_tested():
    curve = replace(FILE.vehicle.thrust_curve, neutral_us=1480.0)
    with pytest.raises(ConfigError, match="tested from rest at 1500 us alone"):
        pulses(FILE.vehicle, "hovering", thrust_curve(curve, FILE.path.parent))
