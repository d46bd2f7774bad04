"""A plan flown by the simulated vehicle over a link, and each failure in mid-manoeuvre: it ends as documented."""

import random
from dataclasses import replace

import figures
import numpy as np
import pytest
from fakes.lossy import Lossy
from ideal import LIMITS
from pymavlink.dialects.v20 import ardupilotmega as dialect
from soak import rows_rest_in_soak

from bridge.clock import SimulatedClock
from bridge.flight.flight import End, State
from bridge.flight.orders import ORDER, Order
from bridge.links.link import memory_pair
from bridge.simulator.body import Start
from bridge.simulator.dive import SimulatedVehicle
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.legs import Leg
from bridge.vehicle.thrusters import NEUTRAL_US
from bridge.wire.framing import Encoder, Framer
from bridge.wire.readings import Reading, encode
from gcs_plugin.flying.session import ARM, FlightSession
from gcs_plugin.peers import GROUND_STATION, ground_heartbeat

FILE = load_vehicle("ruvifist")
HERE_M = 1.5
WAVE = (Leg(1.0, push_surge_n=40.0), Leg(2.0, push_surge_n=-40.0, alternate=7), Leg(1.0, push_surge_n=40.0))
AWAY = (Leg(20.0, push_surge_n=25.0),)
DOWN = (Leg(20.0, heave_m_s=0.1),)
BACK_M = 0.4


class Sea:
    """The vehicle in the water, its link, and the ground that asks; the faults are attributes.

    `ground` False: no word of the ground arrives; `silent` slots of devices of which nothing arrives.
    """

    def __init__(self, configuration="hovering", limits=LIMITS, depth_m=HERE_M, **lossy):
        self.configuration, self.limits = configuration, replace(limits, hold_s=5.0)
        self.world, self.encoder, self.framer = SimulatedClock(), Encoder(*GROUND_STATION), Framer()
        self.lossy, self.ground, self.silent, self.beat_s = lossy, True, set(), 0.0
        self.switch_on(depth_m)
        self.session = FlightSession((1, 1), 1000)

    def switch_on(self, depth_m):
        near, far = memory_pair()
        self.link = Lossy(far, random.Random(3), self.world, **self.lossy)
        self.vehicle = SimulatedVehicle(FILE, self.configuration, [near], Start(1, depth_m))
        take = self.vehicle.bridge.take
        self.vehicle.bridge.take = lambda arrival: None if arrival.slot in self.silent else take(arrival)

    @property
    def flight(self):
        return self.vehicle._flights.flight

    @property
    def neutral(self):
        return set(self.vehicle.body.pwm_us) == {NEUTRAL_US}

    def send(self, message):
        if self.ground:
            self.link.write(self.encoder.encode(message))

    def tick(self):
        self.world.advance_to(self.world.now_s + 0.05)
        now_s = self.world.now_s
        if now_s >= self.beat_s:
            self.beat_s = now_s + 1.0
            self.send(ground_heartbeat())
        for message in self.session.tick(now_s):
            self.send(message)
        self.state = self.vehicle.rest().state[-1]
        while data := self.link.read(0.0):
            for frame in self.framer.feed(data) if self.ground else ():
                self.session.on_frame(frame, now_s)

    def run(self, seconds):
        for _ in range(round(seconds / 0.05)):
            self.tick()

    def until(self, over, within_s=90.0):
        end_s = self.world.now_s + within_s
        while not over():
            assert self.world.now_s < end_s, (self.flight.state, self.flight.end, self.flight.pose)
            self.tick()
        return self

    def begin(self, depth_m=HERE_M):
        self.run(1.5)
        self.session.begin(self.limits, depth_m, 3.0)
        return self.until(lambda: self.session.ready or self.session.over)

    def flying(self, legs=WAVE, seconds=3.0):
        self.begin()
        self.session.fly(legs)
        self.until(lambda: self.flight.state is State.FLYING)
        self.run(seconds)
        assert self.flight.state is State.FLYING
        return self

    def away_m(self):
        return float(np.hypot(*self.state[:2]))


@pytest.mark.parametrize("configuration", ["hovering", "survey"])
def test_a_plan_is_flown_and_the_vehicle_ends_where_it_began(configuration):
    sea = Sea(configuration, depth_m=0.8).begin()
    sea.session.fly(WAVE)
    sea.until(lambda: sea.session.state is State.FLYING)
    sea.until(lambda: sea.session.ready)
    sea.session.finish()
    sea.until(lambda: sea.session.over)
    sea.session.disarm()
    sea.until(lambda: sea.session.idle and sea.flight.state is State.IDLE)
    assert (sea.flight.end, sea.vehicle.bridge.armed, sea.neutral) == (End.FINISHED, False, True)
    assert sea.away_m() < BACK_M
    assert sea.state[2] == pytest.approx(0.8, abs=0.2)


def test_on_a_link_that_loses_a_third_of_all_frames_the_plan_is_flown_all_the_same():
    sea = Sea(loss=0.3, duplicate=0.2, reorder=0.2, delay_s=0.2).begin()
    sea.session.fly(WAVE)
    sea.until(lambda: sea.flight.state is State.FLYING)
    assert sea.flight.left_s == pytest.approx(16.0, abs=0.1)
    sea.until(lambda: sea.session.ready)
    sea.session.finish()
    sea.until(lambda: sea.session.over)
    assert sea.session.words == "finished"


def test_a_row_that_an_old_acknowledgement_stood_for_is_sent_again():
    sea = Sea().begin()
    sea.session.fly(WAVE)
    sea.session._queue.popleft()
    sea.until(lambda: sea.flight.state is State.FLYING, within_s=3.0)
    assert sea.session.failure == ""


def silent(sea):
    sea.ground = False


def dead_program(sea):
    """The program that flies it ends, and another ground of the same address beats on."""
    sea.session.tick = lambda _: []


def low_battery(sea):
    sea.vehicle.bridge._feedback.voltage_v = lambda _: 12.5


def tilted(sea):
    """A wave, or a tether, rolls it by 60 degrees; its weight rights it again."""
    sea.vehicle.body._plant._state[3:7] = (np.cos(np.pi / 6), np.sin(np.pi / 6), 0.0, 0.0)


RETURNS = {
    "the program that flies it dies, another ground beats": (dead_program, {}, WAVE, End.LINK),
    "the distance limit": (None, {"distance_m": 1.0}, AWAY, End.DISTANCE),
    "the tilt limit": (tilted, {}, WAVE, End.TILT),
    "the link is lost": (silent, {}, WAVE, End.LINK),
    "the battery is low": (low_battery, {}, WAVE, End.BATTERY),
    "the depth limit": (None, {"deepest_m": 2.0}, DOWN, End.DEPTH),
    "the speed limit": (None, {"speed_m_s": 0.3}, AWAY, End.SPEED),
    "the altitude limit": (None, {"altitude_m": 6.2}, DOWN, End.ALTITUDE),
}
"""The others are flown at any moment below, or by an ideal vehicle in `test_flight`."""


@pytest.mark.parametrize(
    ("fail", "limits", "legs", "end"), rows_rest_in_soak(RETURNS.values(), keep=3), ids=RETURNS
)
def test_a_limit_brings_it_back_where_it_holds_and_disarms_by_itself(fail, limits, legs, end):
    sea = Sea(limits=replace(LIMITS, **limits)).begin()
    sea.session.fly(legs)
    sea.until(lambda: sea.flight.state is State.FLYING)
    if fail is not None:
        sea.run(2.0)
        fail(sea)
    sea.until(lambda: sea.flight.state is State.RETURNING, within_s=20.0)
    assert sea.flight.end is end
    sea.until(lambda: sea.flight.state is State.HOLDING)
    assert sea.away_m() < BACK_M
    assert sea.state[2] == pytest.approx(HERE_M, abs=0.2)
    sea.run(5.2)
    assert (sea.flight.state, sea.vehicle.bridge.armed, sea.neutral) == (State.IDLE, False, True)
    sea.ground = True
    sea.run(5.0)
    assert sea.neutral


def test_a_silent_dvl_makes_it_hold_without_a_push_and_then_disarm():
    sea = Sea().flying()
    sea.silent.add("dvl")
    sea.until(lambda: sea.flight.state is State.HOLDING, within_s=1.5)
    assert sea.flight.end is End.VELOCITY
    sea.run(4.5)
    assert sea.away_m() < 1.5
    sea.run(1.0)
    assert (sea.flight.state, sea.vehicle.bridge.armed, sea.neutral) == (State.IDLE, False, True)
    assert sea.session.words == "no velocity, it holds"


def test_a_touched_stick_ends_it_within_a_tick_and_leaves_it_armed():
    sea = Sea().flying()
    sea.send(dialect.MAVLink_manual_control_message(1, 0, 0, 500, 0, 0))
    sea.run(1.0)
    assert sea.flight.state is State.FLYING
    sea.send(dialect.MAVLink_manual_control_message(1, 200, 0, 500, 0, 0))
    sea.run(0.1)
    assert (sea.flight.state, sea.flight.end, sea.neutral) == (State.IDLE, End.STICKS, True)
    assert sea.vehicle.bridge.armed
    sea.run(10.0)
    assert sea.neutral
    assert sea.session.over
    assert sea.session.words == "sticks moved, they have control"


def test_an_input_that_another_program_overrides_is_a_touched_stick():
    sea = Sea()
    sea.begin()
    sea.send(dialect.MAVLink_rc_channels_override_message(2, 1, *(1700,) * 8))
    sea.run(0.2)
    assert sea.flight.state is State.WAITING
    sea.send(dialect.MAVLink_rc_channels_override_message(1, 1, *(1700,) * 8))
    sea.run(0.1)
    assert (sea.flight.state, sea.flight.end, sea.neutral) == (State.IDLE, End.STICKS, True)


def test_sticks_and_orders_of_a_stranger_or_for_another_vehicle_are_nothing():
    sea = Sea().flying()
    stranger = Encoder(42, 190)
    sea.send(dialect.MAVLink_manual_control_message(2, 200, 0, 500, 0, 0))
    sea.link.write(stranger.encode(dialect.MAVLink_manual_control_message(1, 200, 0, 500, 0, 0)))
    sea.link.write(
        stranger.encode(dialect.MAVLink_command_long_message(1, 1, 31012, 0, 4, 99, 0, 0, 0, 0, 0))
    )
    sea.run(1.0)
    assert sea.flight.state is State.FLYING


def test_the_end_key_makes_it_hold_here_and_a_second_press_disarms_it():
    sea = Sea().flying(AWAY, 5.0)
    sea.session.stop()
    sea.until(lambda: sea.flight.state is State.HOLDING, within_s=0.5)
    assert sea.flight.end is End.KEY
    sea.run(3.0)
    place = sea.state[:3].copy()
    assert abs(sea.state[7]) < 0.05
    sea.session.disarm()
    sea.run(0.3)
    assert sea.session.idle
    assert (sea.flight.state, sea.vehicle.bridge.armed, sea.neutral) == (State.IDLE, False, True)
    assert np.abs(sea.state[:3] - place).max() < 0.1


def test_after_a_failure_the_end_key_still_reaches_the_vehicle_and_what_was_asked_before_does_not():
    sea = Sea().flying(AWAY, 5.0)
    sea.session.fly(AWAY)
    sea.session.fail("the vehicle does not answer")
    assert sea.session.idle
    sea.session.stop()
    sea.until(lambda: sea.flight.state is State.HOLDING, within_s=0.5)
    assert sea.flight.end is End.KEY


@pytest.mark.parametrize("waited_s", [9.9, 11.0], ids=["just before", "after"])
def test_the_end_key_is_sent_again_and_again_around_the_end_of_the_wait_for_an_answer(waited_s):
    """The vehicle is heard, and hears nothing: a frame that is lost must not be the only one."""
    sea = Sea().flying(AWAY, 5.0)
    heard = sea.session.heard
    sea.session.fly(AWAY)
    at_s, sent = 100.0, []
    while at_s < 100.0 + waited_s:
        sea.session.heard, sea.session.heard_s = heard, at_s
        sea.session.tick(at_s)
        at_s += 0.1
    sea.session.stop()
    for _ in range(50):
        sea.session.heard_s = at_s
        sent += sea.session.tick(at_s)
        at_s += 0.1
    assert len([message for message in sent if message.command == ORDER and message.param1 == Order.END]) > 10


def test_a_vehicle_whose_flight_ended_in_the_countdown_is_not_armed_afterwards():
    """The order to arm was not acknowledged before the link broke: it would be sent again once the link is back."""
    session, beside = FlightSession((1, 1), 7), Encoder(1, 1)

    def report(state, end, number, now_s):
        values = (float(state), float(end), number, 0.0, 0.0, 0.0)
        for frame in Framer().feed(beside.frame(*encode(Reading("flight", now_s, values)))):
            session.on_frame(frame, now_s)

    session.begin(LIMITS, HERE_M, 10.0)
    now_s, sent = 0.0, []
    while not sent or sent[-1].command != ARM:
        now_s += 0.3
        sent += session.tick(now_s)
        if sent[-1].command != ARM:
            place = int(sent[-1].param1)
            ack = dialect.MAVLink_command_ack_message(sent[-1].command, 0, 0, place, 255, 190)
            for frame in Framer().feed(beside.encode(ack)):
                session.on_frame(frame, now_s)
    number = sent[-2].param2
    report(State.COUNTDOWN, End.NONE, number, now_s)
    assert [message.command for message in session.tick(now_s + 0.3)] == [ARM]
    report(State.IDLE, End.LINK, number, now_s + 5.0)
    assert session.tick(now_s + 5.3) == []
    assert session.over
    session.disarm()
    assert [message.param1 for message in session.tick(now_s + 5.6)] == [0.0]


def test_a_report_that_is_overtaken_on_the_way_is_no_vehicle_that_started_anew():
    session, vehicle = FlightSession((1, 1), 7), Encoder(1, 1)
    session.begin(LIMITS, HERE_M, 10.0)
    for boot_s, state, number in ((60.3, State.COUNTDOWN, 8.0), (60.1, State.IDLE, 0.0)):
        values = (float(state), 0.0, number, 9.0, 0.0, 0.0)
        for frame in Framer().feed(vehicle.frame(*encode(Reading("flight", boot_s, values)))):
            session.on_frame(frame, 1.0)
    assert (session.failure, session.state) == ("", State.COUNTDOWN)


def test_a_vehicle_that_starts_anew_lies_still_and_its_ground_says_so():
    sea = Sea().flying()
    sea.switch_on(HERE_M)
    sea.run(10.0)
    assert (sea.flight.state, sea.vehicle.bridge.armed, sea.neutral) == (State.IDLE, False, True)
    assert sea.session.failure == "the vehicle started anew, and lies still"
    assert sea.session.over


def test_a_vehicle_that_flies_nothing_by_itself_says_so():
    sea = Sea()
    sea.vehicle.rest = lambda: sea.vehicle.tick(None)
    sea.run(0.1)
    sea.session.begin(LIMITS, HERE_M, 3.0)
    sea.run(2.0)
    assert sea.session.failure == "this vehicle flies no manoeuvres by itself"
    assert not sea.vehicle.bridge.armed


def blind(sea):
    sea.silent.add("dvl")


def touch(sea):
    sea.send(dialect.MAVLink_manual_control_message(1, 0, 0, 500, -300, 0))


def end_key(sea):
    sea.session.stop()


def restart(sea):
    sea.switch_on(HERE_M)


ANYTIME = {
    "link lost": (silent, End.LINK, BACK_M),
    "DVL silent": (blind, End.VELOCITY, 2.5),
    "battery low": (low_battery, End.BATTERY, BACK_M),
    "stick touched": (touch, End.STICKS, 2.5),
    "end key": (end_key, End.KEY, 2.5),
    "restart": (restart, End.NONE, 2.5),
}


def ends_as_documented(name, seed):
    """A failure at any moment of a flight, from its countdown to its way back: it ends disarmed or in the pilot's
    hands, near enough, with its thrusters at rest."""
    fail, end, within_m = ANYTIME[name]
    sea, rng = Sea(), random.Random(seed)
    sea.limits = replace(sea.limits, hold_s=2.0)
    sea.run(1.5)
    sea.session.begin(sea.limits, HERE_M, 3.0)
    at_s, asked = sea.world.now_s + rng.uniform(0.2, 30.0), False
    while sea.world.now_s < at_s:
        if sea.session.ready and asked:
            sea.session.finish()
        elif sea.session.ready:
            sea.session.fly(WAVE)
            asked = True
        sea.tick()
    over = sea.flight.state is State.IDLE
    fail(sea)
    sea.until(lambda: sea.flight.state is State.IDLE, within_s=150.0)
    sea.run(3.0)
    assert sea.neutral
    assert sea.away_m() < within_m
    assert sea.vehicle.bridge.armed == (end is End.STICKS and sea.vehicle.bridge.armed)
    finished = sea.flight.end in (End.FINISHED, End.NONE)
    assert over or finished or sea.flight.end in (end, End.KEY)


@pytest.mark.parametrize("name", ANYTIME)
def test_a_failure_at_any_moment_ends_as_documented(name):
    ends_as_documented(name, 1)


@pytest.mark.soak
def test_each_failure_ends_as_documented_twenty_times():
    for name in ANYTIME:
        for seed in range(20):
            ends_as_documented(name, seed)
    figures.keep(
        "flight_ends", f"{20 * len(ANYTIME)} of {20 * len(ANYTIME)} failures at any moment of a flight"
    )
