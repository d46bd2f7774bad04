"""A motor test turns one thruster, gently bounded, for as long as it was asked and no longer."""

import math

import pytest
from fakes.vehicle import FakeVehicle
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.errors import LinkError, LinkTimeout
from bridge.onboard.orders import MotorTests, answer_command
from bridge.wire.framing import Encoder
from gcs_plugin.doctor.motor_orders import arm, disarm

ACCEPTED, DENIED = dialect.MAV_RESULT_ACCEPTED, dialect.MAV_RESULT_DENIED
NEUTRAL = (1500.0, 1500.0, 1500.0)


def order(thruster=2, pwm_us=1560.0, for_s=1.0, kind=dialect.MOTOR_TEST_THROTTLE_PWM):
    command = dialect.MAV_CMD_DO_MOTOR_TEST
    return dialect.MAVLink_command_long_message(1, 1, command, 0, thruster, kind, pwm_us, for_s, 1, 0, 0)


def test_the_thruster_asked_for_turns_and_stops_by_itself():
    tests = MotorTests(3)
    assert tests.ask(order(), True, 10.0) == ACCEPTED
    assert tests.pwm_us(True, 10.0) == (1500.0, 1560.0, 1500.0)
    assert tests.pwm_us(True, 10.95) == (1500.0, 1560.0, 1500.0)
    assert tests.pwm_us(True, 11.0) == NEUTRAL
    assert tests.pwm_us(True, 10.5) == NEUTRAL


def test_disarming_ends_a_test_for_good():
    tests = MotorTests(3)
    tests.ask(order(), True, 10.0)
    assert tests.pwm_us(False, 10.1) == NEUTRAL
    assert tests.pwm_us(True, 10.2) == NEUTRAL


def test_a_second_order_replaces_the_first():
    tests = MotorTests(3)
    tests.ask(order(thruster=1), True, 10.0)
    tests.ask(order(thruster=3), True, 10.5)
    assert tests.pwm_us(True, 10.6) == (1500.0, 1500.0, 1560.0)


@pytest.mark.parametrize(
    "wrong",
    [
        {"thruster": 0},
        {"thruster": 4},
        {"thruster": 1.5},
        {"thruster": math.nan},
        {"pwm_us": 1000.0},
        {"pwm_us": 2000.0},
        {"pwm_us": math.nan},
        {"for_s": 3.1},
        {"for_s": -1.0},
        {"for_s": math.inf},
        {"kind": dialect.MOTOR_TEST_THROTTLE_PERCENT},
    ],
)
def test_what_is_out_of_bounds_is_denied_and_turns_nothing(wrong):
    tests = MotorTests(3)
    assert tests.ask(order(**wrong), True, 10.0) == DENIED
    assert tests.pwm_us(True, 10.0) == NEUTRAL


def test_a_disarmed_vehicle_turns_nothing():
    tests = MotorTests(3)
    assert tests.ask(order(), False, 10.0) == dialect.MAV_RESULT_TEMPORARILY_REJECTED
    assert tests.pwm_us(True, 10.0) == NEUTRAL


def test_a_bridge_without_thrusters_says_that_it_knows_no_motor_test():
    message = order()
    message._header = dialect.MAVLink_header(76, srcSystem=255, srcComponent=190)
    (answer,) = answer_command(message, lambda _: True)
    assert answer.result == dialect.MAV_RESULT_UNSUPPORTED


def test_arming_is_done_when_the_vehicle_answers_and_disarming_is_ordered_until_two_heartbeats_say_so():
    vehicle = FakeVehicle()
    arm(vehicle, vehicle.clock, (1, 1))
    assert vehicle.orders == [1.0]
    began_s = vehicle.clock.boot_s()
    disarm(vehicle, vehicle.clock, (1, 1))
    assert {*vehicle.orders[1:]} == {0.0}
    assert 1.0 <= vehicle.clock.boot_s() - began_s <= 2.1


def test_a_refusal_is_told():
    vehicle = FakeVehicle()
    vehicle.result = DENIED
    with pytest.raises(LinkError, match="refused to arm"):
        arm(vehicle, vehicle.clock, (1, 1))


def test_a_mute_vehicle_is_asked_again_and_then_given_up():
    vehicle = FakeVehicle()
    vehicle.mute = True
    with pytest.raises(LinkTimeout, match="a HEARTBEAT that says disarmed did not come"):
        disarm(vehicle, vehicle.clock, (1, 1))
    assert len(vehicle.orders) == 10
    assert vehicle.clock.boot_s() < 5.1


def test_the_answer_of_another_vehicle_counts_for_nothing():
    vehicle = FakeVehicle(source=(2, 1))
    vehicle.encoder = Encoder(1, 1)
    with pytest.raises(LinkTimeout):
        arm(vehicle, vehicle.clock, (2, 1))
