"""OFF of several vehicles, against a raise, in MAVProxy, and in a roll back."""

import os
import random
import time

import pytest
from fakes.lossy import Lossy
from fakes.vehicle import QuietLink
from pymavlink.dialects.v20 import ardupilotmega as mav
from soak import rest_in_soak
from test_ff_switch import STEP_S, Both, Craft, drive, heard_before

from bridge.clock import SimulatedClock
from bridge.vehicle.mode import Mode
from bridge.vehicle.parameters import MODE
from bridge.wire.framing import Encoder, Framer
from bridge.wire.readings import Reading, encode
from gcs_plugin.feedforward import off_orders
from gcs_plugin.feedforward.off_orders import OffMarks, OffOrders
from gcs_plugin.feedforward.switch import Switch
from gcs_plugin.fleet import Fleet
from gcs_plugin.mavproxy.switching import Switching
from gcs_plugin.params.plan import not_raised
from gcs_plugin.peers import GROUND_STATION


class Ground:
    """One program with a switch on a link of its own; `marks` where it is on the computer of the others."""

    def __init__(self, switch, link, clock, starts_s):
        self.switch, self.link, self.clock, self.starts_s = switch, link, clock, starts_s
        self.encoder, self.framer = Encoder(*GROUND_STATION), Framer()
        self.marks, self.orders = OffMarks(), OffOrders()
        self.done_s = None

    def step(self, data):
        now_s, switch = self.clock.now_s, self.switch
        if now_s < self.starts_s:
            self.orders = OffOrders()
            return
        for frame in self.framer.feed(data):
            switch.on_frame(frame, now_s)
        if switch.done or (switch.mode is not Mode.OFF and switch.refusal):
            self.done_s = self.done_s or now_s
            return
        if switch.mode is not Mode.OFF:
            switch.overruled = switch.overruled or self.orders.has_ordered_off(1)
        messages = switch.tick(now_s)
        self.marks.mark(messages)
        for message in messages:
            self.link.write(self.encoder.encode(message))


def test_an_off_that_is_ordered_while_a_program_looks_for_earlier_ones_counts(monkeypatch):
    """The computer's clock is read after the marks: else such a mark would be of the future, and none."""
    began_unix_s, touched = time.time(), off_orders._touched
    OffMarks().mark([mav.MAVLink_param_set_message(7, 1, MODE.encode(), 0.0, mav.MAV_PARAM_TYPE_REAL32)])

    def touched_meanwhile(file):
        os.utime(file, ns=(time.time_ns(),) * 2)
        return touched(file)

    monkeypatch.setattr(off_orders, "_touched", touched_meanwhile)
    orders = OffOrders(began_unix_s)
    monkeypatch.setattr(off_orders, "_touched", touched)
    assert orders.has_ordered_off(7)


class Port(QuietLink):
    """A program's view of the vehicle, as through a hub: all frames."""

    name = "port:"

    def __init__(self, craft):
        self.craft, self.heard = craft, b""

    def read(self, _):
        heard, self.heard = self.heard, b""
        return heard

    def write(self, data):
        self.craft.write(data)


def fight(seed, off_after_s, mode=Mode.BOTH, before=0.0, loss=0.0, seconds=40.0):
    """A raise at 0.5 s, OFF so long after; the vehicle's mode in the end, and both grounds."""
    clock, draw = SimulatedClock(), random.Random(seed)
    craft = Craft(clock, mode=before, phase_s=draw.uniform(0.0, 1.0))
    ports = [Port(craft), Port(craft)]
    links = [
        Lossy(
            port,
            random.Random(draw.random()),
            clock,
            loss=loss,
            duplicate=loss / 3,
            delay_s=draw.uniform(0, 0.2),
        )
        for port in ports
    ]
    raising = Ground(Switch(mode, 1, was=before), links[0], clock, 0.5)
    off = Ground(Switch(Mode.OFF, 1), links[1], clock, 0.5 + off_after_s)
    while clock.now_s < seconds:
        clock.advance_to(clock.now_s + STEP_S)
        frames = craft.read(0.0)
        for port in ports:
            port.heard += frames
        for ground, link in zip((raising, off), links, strict=True):
            ground.step(link.read(0.0))
    return craft, raising, off


@pytest.mark.parametrize("loss", [0.0, 0.3])
@pytest.mark.parametrize("seed", rest_in_soak(range(60), keep=4))
def test_in_no_order_does_a_raise_that_began_before_outlast_an_off_that_was_confirmed(seed, loss):
    draw = random.Random(1000 + seed)
    mode, before = draw.choice([Mode.SHADOW, Mode.ALONE, Mode.BOTH]), draw.choice([0.0, 1.0])
    craft, raising, off = fight(seed, draw.uniform(-0.4, 4.0), mode, before, loss)
    assert off.done_s is not None
    if raising.done_s is None or off.done_s > raising.starts_s:
        assert craft.server.mode == 0


def changes(craft):
    return sum(item.value == Mode.BOTH for item in craft.sets)


@pytest.mark.parametrize("off_after_s", [0.0, 0.3, 0.7, 1.2, 1.8, 2.2])
def test_a_raise_gives_up_within_three_seconds_of_an_off_and_says_so(off_after_s):
    craft, raising, _ = fight(3, off_after_s)
    assert craft.server.mode == 0
    assert changes(craft) <= 2
    if not raising.switch.done:
        assert raising.done_s <= 0.5 + off_after_s + 3.0
        assert raising.switch.words == raising.switch.refusal
        assert raising.switch.refusal.startswith("OFF was ordered meanwhile and wins: both is sent no more")


def test_a_raise_sees_an_off_of_another_computer_by_what_the_vehicle_says(monkeypatch):
    monkeypatch.setattr(OffOrders, "has_ordered_off", lambda *_: False)
    craft, raising, _ = fight(5, 0.6)
    assert (craft.server.mode, raising.switch.done) == (0, False)
    assert raising.switch.refusal == (
        "vehicle 1: it says off after both, as if another has switched it: both is sent no more; "
        "look, and ask again if need be"
    )
    assert changes(craft) == 1


def test_a_raise_from_shadow_gives_up_where_the_vehicle_is_off_before_it_is_sent(monkeypatch):
    monkeypatch.setattr(OffOrders, "has_ordered_off", lambda *_: False)
    clock = SimulatedClock()
    craft = Craft(clock, mode=0.0)
    switch, framer = Switch(Mode.BOTH, 1, was=1.0), Framer()
    for frame in framer.feed(craft.read(0.0)):
        switch.on_frame(frame, 0.0)
    assert switch.tick(0.0) == []
    assert switch.refusal.startswith("vehicle 1: it says off after shadow")


def test_off_of_another_vehicle_overrules_nothing():
    orders = OffOrders()
    off = Switch(Mode.OFF, 2)
    OffMarks().mark(off.tick(0.0))
    assert (orders.has_ordered_off(1), orders.has_ordered_off(2)) == (False, True)
    assert not OffOrders().has_ordered_off(2)


def test_what_raises_and_what_only_asks_is_no_order_of_off():
    orders = OffOrders()
    craft = Craft(SimulatedClock(), mode=0.0)
    switch = Switch(Mode.SHADOW, 1)
    for frame in Framer().feed(craft.read(0.0)):
        switch.on_frame(frame, 0.0)
    messages = switch.tick(0.0)
    assert [message.get_type() for message in messages] == ["PARAM_SET", "PARAM_REQUEST_READ"]
    OffMarks().mark(messages)
    assert not orders.has_ordered_off(1)


@pytest.fixture
def half_done(clock):
    """A switch whose vehicle 1 is off and whose vehicle 2 is gone, their link, and vehicle 1."""
    first, gone = Craft(clock, (1, 1)), Craft(clock, (2, 1))
    gone.deaf = gone.mute = True
    link = Both(first, gone)
    switch = Switch(Mode.OFF, known=heard_before(((1, 1), True, 0.0), ((2, 1), True, -3.0)))
    assert not drive(switch, link, clock, 6.0)
    assert switch.waits_for == switch.silent == (2,)
    return switch, link, first


def test_one_that_was_raised_since_is_told_as_it_says_now_and_not_fought(half_done, clock):
    switch, link, first = half_done
    first.server.write("FF_MODE", 3.0, False)
    orders = len(first.sets)
    drive(switch, link, clock, 3.0)
    assert switch.words.startswith(
        "vehicle 1: was off, as read back; its telemetry says both now; vehicle 2: "
    )
    assert (switch.waits_for, switch.silent, len(first.sets)) == ((1, 2), (), orders)


def test_a_second_press_is_sent_at_once_to_one_that_was_off_before(half_done, clock):
    switch, link, first = half_done
    first.server.write("FF_MODE", 3.0, False)
    drive(switch, link, clock, 3.0)
    orders, pressed_s = len(first.sets), clock.now_s
    switch.again()
    drive(switch, link, clock, 4.0)
    assert first.sets[orders][::3] == (pressed_s, 0.0)
    assert first.server.mode == 0
    assert switch.words.startswith("vehicle 1: off, as read back and as its telemetry says; vehicle 2: ")


def test_what_was_done_once_stays_done_though_it_is_raised_afterwards(clock):
    craft = Craft(clock)
    switch = Switch(Mode.OFF)
    assert drive(switch, craft, clock, 6.0)
    craft.server.write("FF_MODE", 3.0, False)
    drive(switch, craft, clock, 3.0)
    assert switch.done


class Sea:
    def __init__(self):
        self.clock, self.fleet, self.said = SimulatedClock(50.0), Fleet(), []
        self.switching = Switching(self.fleet, self.clock, self.said.append)

    def tells_its_mode(self, system):
        for frame in Framer().feed(Encoder(system, 1).frame(*encode(Reading("ff_mode", 0.0, (3.0,))))):
            self.fleet.on_frame(frame, "udpin:1", self.clock.now_s)
            self.switching.on_frame(frame)

    def orders(self):
        return [
            (m.target_system, m.param_value) for m in self.switching.tick() if m.get_type() == "PARAM_SET"
        ]


@pytest.mark.parametrize(("chosen", "orders"), [(None, [(1, 0.0), (2, 0.0)]), (2, [(2, 0.0)])])
def test_off_goes_to_the_vehicle_chosen_else_to_all_that_were_heard_without_another_word_of_theirs(
    chosen, orders
):
    sea = Sea()
    sea.tells_its_mode(1)
    sea.tells_its_mode(2)
    sea.clock.advance_to(62.0)
    sea.fleet.chosen = chosen
    assert sea.switching.command(["off"])
    assert sea.orders() == orders
    sea.clock.advance_to(62.5)
    assert sea.orders() == orders
    assert sea.switching.status()[0].endswith("vehicle 2: sent 2 times, not heard for 12 s: not confirmed")


GOES_BACK = {
    (Mode.SHADOW, Mode.OFF), (Mode.BOTH, Mode.OFF), (Mode.BOTH, Mode.SHADOW), (Mode.ALONE, Mode.OFF),
    (Mode.ALONE, Mode.SHADOW), (Mode.ALONE, Mode.BOTH),
}  # fmt: skip


@pytest.mark.parametrize("before", Mode)
@pytest.mark.parametrize("present", Mode)
def test_a_mode_comes_back_only_where_it_leaves_no_more_to_the_feed_forward(before, present):
    targets = {"FF_MODE": float(before), "FF0_M_U": 24.0}
    kept = not_raised(targets, {"FF_MODE": float(present)})
    assert ("FF_MODE" in kept) == (before is present or (present, before) in GOES_BACK)
    assert kept["FF0_M_U"] == 24.0


def test_a_mode_that_nobody_knows_does_not_come_back():
    assert not_raised({"FF_MODE": 9.0}, {"FF_MODE": 3.0}) == {}
    assert not_raised({"FF_MODE": 0.0}, {}) == {"FF_MODE": 0.0}
