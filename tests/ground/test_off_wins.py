"""OFF wins against a raise that was begun before it was confirmed, in whatever order both come and go."""

import random

import pytest
from soak import rest_in_soak
from test_ff_switch import STEP_S, Craft

from bridge.clock import SimulatedClock
from bridge.framing import Encoder, Framer
from bridge.link.lossy import Lossy
from bridge.vehicle.feedforward import Mode
from gcs_plugin.feedforward import Switch
from gcs_plugin.modes import OffMarks, OffOrders
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
            switch.overruled = switch.overruled or self.orders.given(1)
        messages = switch.tick(now_s)
        self.marks.mark(messages)
        for message in messages:
            self.link.write(self.encoder.encode(message))


class Port:
    """What one program hears of the vehicle, as by a hub: all that it says."""

    name = "port:"

    def __init__(self, craft):
        self.craft, self.heard = craft, b""

    def read(self, _):
        heard, self.heard = self.heard, b""
        return heard

    def write(self, data):
        self.craft.write(data)

    def close(self):
        pass


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
        told = craft.read(0.0)
        for port in ports:
            port.heard += told
        for ground, link in zip((raising, off), links, strict=True):
            ground.step(link.read(0.0))
    return craft, raising, off


@pytest.mark.parametrize("loss", [0.0, 0.3])
@pytest.mark.parametrize("seed", rest_in_soak(range(60), keep=12))
def test_in_no_order_does_a_raise_that_began_before_outlast_an_off_that_was_confirmed(seed, loss):
    draw = random.Random(1000 + seed)
    mode, before = draw.choice([Mode.SHADOW, Mode.ALONE, Mode.BOTH]), draw.choice([0.0, 1.0])
    craft, raising, off = fight(seed, draw.uniform(-0.4, 4.0), mode, before, loss)
    assert off.done_s is not None
    if raising.done_s is None or off.done_s > raising.starts_s:
        assert craft.server.mode == 0


def changes(craft):
    return sum(one.value == Mode.BOTH for one in craft.sets)


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
    monkeypatch.setattr(OffOrders, "given", lambda *_: False)
    craft, raising, _ = fight(5, 0.6)
    assert (craft.server.mode, raising.switch.done) == (0, False)
    assert raising.switch.refusal == (
        "vehicle 1: it says off after both, as if another has switched it: both is sent no more; "
        "look, and ask again if need be"
    )
    assert changes(craft) == 1


def test_a_raise_from_shadow_gives_up_where_the_vehicle_is_off_before_it_is_sent(monkeypatch):
    monkeypatch.setattr(OffOrders, "given", lambda *_: False)
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
    assert (orders.given(1), orders.given(2)) == (False, True)
    assert not OffOrders().given(2)


def test_what_raises_and_what_only_asks_is_no_order_of_off():
    orders = OffOrders()
    craft = Craft(SimulatedClock(), mode=0.0)
    switch = Switch(Mode.SHADOW, 1)
    for frame in Framer().feed(craft.read(0.0)):
        switch.on_frame(frame, 0.0)
    messages = switch.tick(0.0)
    assert [message.get_type() for message in messages] == ["PARAM_SET", "PARAM_REQUEST_READ"]
    OffMarks().mark(messages)
    assert not orders.given(1)
