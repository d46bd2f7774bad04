"""Orders of a flight on the wire, and what the vehicle makes of good, half-heard and hostile ones."""

import math
import struct
from dataclasses import astuple

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from ideal import LIMITS, SURGE, Ideal
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.errors import ConfigError
from bridge.flight import orders
from bridge.flight.flight import End, State
from bridge.flight.orders import (
    LEG,
    ORDER,
    Order,
    checksum,
    leg_numbers,
    leg_of,
    limit_rows,
    limits_in,
)
from bridge.flight.orders import (
    LIMITS as LIMIT_ROWS,
)
from bridge.onboard.flights import Flights, touched
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.legs import Leg

ACCEPTED, DENIED = dialect.MAV_RESULT_ACCEPTED, dialect.MAV_RESULT_DENIED
AGAIN = dialect.MAV_RESULT_TEMPORARILY_REJECTED
SHAPE = load_vehicle("ruvifist").vehicle.configurations["hovering"]
LEGS = [
    Leg(5.0),
    Leg(1.5, push_surge_n=53.7),
    Leg(2.0, push_surge_n=-53.5, push_sway_n=18.25, alternate=31),
    Leg(2.0, push_surge_n=0.0),
    Leg(5.0, transient_s=5.0, surge_m_s=0.5),
    Leg(4.0, heave_m_s=-0.25, yaw_rad_s=0.375, transient_s=1.0),
]


def heard(numbers):
    """The numbers as they arrive."""
    return struct.unpack(f"<{len(numbers)}f", struct.pack(f"<{len(numbers)}f", *numbers))


@pytest.mark.parametrize("leg", LEGS)
def test_a_leg_arrives_as_it_was_sent(leg):
    arrived = leg_of(heard(leg_numbers(3, leg)))
    assert arrived.push == pytest.approx(leg.push, abs=1e-5)
    assert (arrived.velocity, arrived.duration_s, arrived.alternate) == (
        leg.velocity,
        leg.duration_s,
        leg.alternate,
    )
    assert arrived.transient_s == leg.transient_s


def test_a_leg_that_drives_three_axes_is_not_sent():
    with pytest.raises(ConfigError, match="leg 'all': drives 3 axes"):
        leg_numbers(0, Leg(1.0, "all", surge_m_s=1.0, sway_m_s=1.0, yaw_rad_s=1.0))


def test_limits_and_depth_arrive_as_they_were_sent():
    limits, depth_m = limits_in([heard(row) for row in limit_rows(LIMITS, 1.5)])
    assert astuple(limits) == pytest.approx(astuple(LIMITS))
    assert depth_m == 1.5


def test_the_checksum_is_the_same_before_and_after_the_wire_and_differs_with_any_leg():
    rows = [leg_numbers(n, leg) for n, leg in enumerate(LEGS)]
    assert checksum(rows) == checksum([heard(row) for row in rows])
    assert heard([checksum(rows)]) == (checksum(rows),)
    assert checksum(rows) != checksum(rows[:-1])


@settings(max_examples=200)
@given(st.tuples(*[st.floats(width=32) | st.integers(0, 300).map(float)] * 7))
def test_any_seven_numbers_are_a_leg_or_refused(numbers):
    try:
        leg = leg_of(numbers)
    except ConfigError:
        return
    assert 0.0 < leg.duration_s <= 600.0
    assert 0.0 <= leg.transient_s <= leg.duration_s


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("place", range(7))
def test_a_leg_with_a_number_that_is_none_is_refused(place, value):
    numbers = [0.0, 2.0, 1.0, 1.0, 3.0, 0.2, 0.1]
    leg_of(numbers)
    numbers[place] = value
    with pytest.raises(ConfigError):
        leg_of(numbers)


class Deck:
    """A vehicle's flights, ordered by its ground."""

    def __init__(self):
        self.flights, self.ideal = Flights(SHAPE), Ideal()

    def send(self, command, *numbers):
        padded = (*numbers, *(0.0,) * (7 - len(numbers)))
        message = dialect.MAVLink_command_long_message(1, 1, command, 0, *heard(padded))
        inputs = self.ideal.inputs()
        return self.flights.order(message, inputs.navigation, armed=True, now_s=inputs.time_s)

    def step(self):
        inputs = self.ideal.inputs()
        return self.flights.step(inputs.navigation, armed=True, now_s=inputs.time_s)

    def begin(self, number=7.0):
        rows = limit_rows(LIMITS, 1.5)
        for row in rows:
            self.send(LIMIT_ROWS, *row)
        return self.send(ORDER, Order.BEGIN, number, checksum(rows), 3.0, len(rows))

    @property
    def state(self):
        return self.flights.flight.state


def test_limits_and_an_order_begin_a_flight():
    deck = Deck()
    assert deck.begin() == (ACCEPTED, Order.BEGIN)
    assert deck.state is State.COUNTDOWN
    assert deck.step() is None
    reading = deck.flights.reading(deck.ideal.now_s)
    assert reading.values[:4] == (float(State.COUNTDOWN), float(End.NONE), 7.0, 3.0)


def test_a_ground_that_says_it_is_there_is_missed_where_another_beats_and_one_that_never_does_is_not():
    for says in (True, False):
        deck = Deck()
        deck.begin()
        if says:
            assert deck.send(ORDER, Order.HERE) == (ACCEPTED, Order.HERE)
        for _ in range(40):
            deck.ideal.now_s += 0.1
            deck.flights.hear(dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3), deck.ideal.now_s)
            deck.step()
        assert (deck.flights.flight.end is End.LINK) == says


def test_a_ground_that_flies_is_missed_also_where_another_asked_in_vain_for_a_flight_meanwhile():
    deck = Deck()
    deck.begin()
    deck.send(ORDER, Order.HERE)
    assert deck.begin(number=9.0) == (DENIED, Order.BEGIN)
    for _ in range(40):
        deck.ideal.now_s += 0.1
        deck.flights.hear(dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3), deck.ideal.now_s)
        deck.step()
    assert deck.flights.flight.end is End.LINK


def test_a_repeated_order_is_acknowledged_and_not_obeyed_again():
    deck = Deck()
    deck.begin()
    assert deck.send(ORDER, Order.END, 8.0) == (ACCEPTED, Order.END)
    assert deck.state is State.IDLE
    assert deck.begin(number=8.0) == (ACCEPTED, Order.BEGIN)
    assert deck.state is State.IDLE


def test_an_order_repeated_late_after_the_one_that_ended_it_is_not_obeyed_again():
    """As on a second, slower way to the vehicle."""
    deck = Deck()
    deck.begin(number=7.0)
    deck.send(ORDER, Order.END, 8.0)
    assert deck.begin(number=7.0) == (ACCEPTED, Order.BEGIN)
    assert deck.state is State.IDLE
    assert deck.begin(number=9.0) == (ACCEPTED, Order.BEGIN)
    assert deck.state is State.COUNTDOWN


def test_what_arrived_in_part_is_not_begun_and_asked_for_again():
    deck = Deck()
    rows = limit_rows(LIMITS, 1.5)
    deck.send(LIMIT_ROWS, *rows[0])
    assert deck.send(ORDER, Order.BEGIN, 7.0, checksum(rows), 3.0, len(rows)) == (AGAIN, Order.BEGIN)
    assert deck.send(ORDER, Order.FLY, 8.0, 0.0, 0.0, 0.0) == (AGAIN, Order.FLY)
    assert deck.state is State.IDLE
    deck.send(LIMIT_ROWS, *rows[1])
    assert deck.send(ORDER, Order.BEGIN, 7.0, checksum(rows), 3.0, len(rows)) == (ACCEPTED, Order.BEGIN)


def test_what_the_vehicle_refuses_it_tells_the_crew():
    deck = Deck()
    deck.ideal.voltage_v = 12.0
    assert deck.begin() == (DENIED, Order.BEGIN)
    assert deck.send(ORDER, 9.0, 8.0) == (DENIED, 9)
    assert deck.flights.take_texts() == [
        "no flight: battery is 12.00 V, below battery_v 13 of the limits",
        "no flight: there is no such order",
    ]


def test_more_legs_heard_before_than_are_flown_now_do_no_harm():
    deck = Deck()
    for number in range(5):
        deck.send(LEG, *leg_numbers(number, SURGE[0]))
    deck.begin()
    deck.ideal.flight = deck.flights.flight
    deck.ideal.until(State.WAITING)
    rows = [leg_numbers(number, leg) for number, leg in enumerate(SURGE)]
    for row in rows:
        assert deck.send(LEG, *row) == (ACCEPTED, int(row[0]))
    assert deck.send(ORDER, Order.FLY, 9.0, checksum(rows), 0.0, len(rows)) == (ACCEPTED, Order.FLY)
    assert deck.flights.flight.left_s == pytest.approx(8.0)


@pytest.mark.parametrize("place", [-1.0, 0.5, 100.0, math.nan, math.inf])
def test_an_impossible_place_is_denied(place):
    assert Deck().send(LEG, place, 1.0) == (DENIED, 0)
    assert orders.MOST_LEGS == 100


def sticks(x=0, y=0, z=500, r=0, buttons=0, **more):
    return dialect.MAVLink_manual_control_message(1, x, y, z, r, buttons, **more)


@pytest.mark.parametrize(
    "moved",
    [
        *({"x": 51}, {"y": -51}, {"z": 551}, {"z": 449}, {"r": 60}, {"buttons": 1}, {"buttons2": 1}),
        *({"enabled_extensions": 1, "s": -60}, {"enabled_extensions": 3, "t": 51}),
    ],
)
def test_any_stick_and_any_button_is_a_touch(moved):
    assert touched(sticks(**moved))
    deck = Deck()
    deck.begin()
    deck.flights.hear(sticks(**moved), deck.ideal.now_s)
    assert deck.step() is None
    assert (deck.state, deck.flights.flight.end) == (State.IDLE, End.STICKS)
    assert deck.flights.take_texts() == ["flight ends: sticks moved, they have control"]


@pytest.mark.parametrize(
    ("pulses_us", "is_touch"),
    [
        ((1500,) * 6, False),
        ((0, 65535, 1519, 1481, 0, 1500), False),
        ((1500, 1500, 1500, 1500, 1521, 1500), True),
        ((65535, 65535, 1100, 65535, 65535, 65535), True),
    ],
)
def test_inputs_that_are_overridden_off_their_rest_are_a_touch_too(pulses_us, is_touch):
    """A pilot whose program sends RC_CHANNELS_OVERRIDE flies no less than one with MANUAL_CONTROL."""
    override = dialect.MAVLink_rc_channels_override_message(1, 1, *pulses_us, 1900, 1100)
    assert touched(override) is is_touch


@pytest.mark.parametrize(
    "still", [{}, {"x": 50, "y": -50, "z": 540, "r": 3}, {"x": 32767, "r": 32767}, {"s": 600}]
)
def test_sticks_at_rest_and_axes_not_in_use_are_none(still):
    assert not touched(sticks(**still))
