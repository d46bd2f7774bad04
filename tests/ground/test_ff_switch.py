"""FF_MODE is switched when the vehicle has said so twice over, whatever link and vehicle do on the way."""

import random

import pytest
from fakes.lossy import Lossy
from fakes.vehicle import SMALL, FakeVehicle, QuietLink

from bridge.vehicle.mode import Mode
from bridge.wire.framing import Encoder, Framer
from gcs_plugin.feedforward.switch import Switch
from gcs_plugin.peers import GROUND_STATION, KnownVehicle, Peers

STEP_S = 0.02


class Craft(FakeVehicle):
    """A small vehicle whose feed-forward acts, on a link that the test steps."""

    name = "craft:"

    def __init__(self, clock, source=(1, 1), mode=3.0, autopilot=0, phase_s=0.0, booted_s=0.0):
        super().__init__(
            clock, source, vehicle=SMALL, mode=mode, autopilot=autopilot, phase_s=phase_s, booted_s=booted_s,
            steps=False,
        )  # fmt: skip


class Both(QuietLink):
    """Several vehicles on one link."""

    name = "both:"

    def __init__(self, *craft):
        self.craft = craft

    def read(self, timeout_s):
        return b"".join(craft.read(timeout_s) for craft in self.craft)

    def write(self, data):
        for craft in self.craft:
            craft.write(data)


def drive(switch, link, clock, seconds, twins=None, each=lambda: None):
    """Run until it is done; False where time runs out."""
    encoder, framer, end_s = Encoder(*GROUND_STATION), Framer(), clock.now_s + seconds
    while clock.now_s < end_s:
        if twins is not None:
            switch.twins = twins.fault()
        for message in switch.tick(clock.now_s):
            link.write(encoder.encode(message))
        clock.advance_to(clock.now_s + STEP_S)
        for frame in framer.feed(link.read(STEP_S)):
            if twins is not None:
                twins.on_frame(frame, link.name, clock.now_s)
            switch.on_frame(frame, clock.now_s)
        each()
        if switch.done:
            return True
    return False


@pytest.fixture
def craft(clock):
    return Craft(clock)


@pytest.mark.parametrize("armed", [True, False])
@pytest.mark.parametrize("mode", Mode)
def test_a_vehicle_takes_every_mode_that_it_can(clock, mode, armed):
    craft = Craft(clock, mode=0.0)
    craft.armed = armed
    craft.server.unproven = lambda: ""
    switch = Switch(mode)
    assert drive(switch, craft, clock, 5.0)
    assert craft.server.mode == mode
    assert switch.words.endswith("as read back and as its telemetry says")
    assert not switch.refusal


@pytest.mark.parametrize("armed", [False, True])
def test_a_mode_that_was_agreed_to_for_a_disarmed_vehicle_is_sent_to_no_armed_one(clock, armed):
    craft = Craft(clock, mode=0.0)
    craft.armed = armed
    craft.server.unproven = lambda: ""
    switch = Switch(Mode.BOTH, while_disarmed=True)
    assert drive(switch, craft, clock, 5.0) is not armed
    assert bool(craft.sets) is not armed
    assert switch.refusal == (
        "the vehicle was armed meanwhile: both was not sent; look, and ask again" * armed
    )


def test_nothing_is_sent_before_a_vehicle_is_heard(craft, clock):
    craft.mute = True
    switch = Switch(Mode.OFF)
    assert not drive(switch, craft, clock, 30.0)
    assert (craft.sets, switch.sent, switch.heard) == ([], 0, False)
    assert switch.words == "no vehicle heard, nothing is sent yet"
    craft.mute = False
    assert drive(switch, craft, clock, 5.0)


def test_it_says_how_often_it_was_sent_and_for_how_long_nobody_answers(craft, clock):
    craft.deaf = True
    craft.tells_mode = False
    switch = Switch(Mode.OFF)
    seen = []
    drive(switch, craft, clock, 3.7, each=lambda: seen.append(switch.words))
    assert "vehicle 1: heard, nothing is sent yet" in seen
    assert "vehicle 1: sent 4 times, no answer for 1.9 s, no telemetry of it" in seen
    craft.deaf, craft.tells_mode = False, True
    craft.stuck = True
    drive(switch, craft, clock, 2.0)
    assert switch.words.endswith("times, it answers both, its telemetry says both")


@pytest.mark.parametrize(
    ("faults", "before", "kept", "words"),
    [
        pytest.param({"stuck": True}, 3.0, 3.0, "it answers both", id="stuck"),
        pytest.param({"echoes": True}, 3.0, 3.0, "its telemetry says both", id="an echo of a value that is not kept"),
        pytest.param({"tells_mode": False}, 3.0, 0.0, "no telemetry of it", id="answers without telemetry"),
        pytest.param({"deaf": True}, 0.0, 0.0, "no answer for", id="telemetry from before"),
    ],
)  # fmt: skip
def test_no_half_word_is_taken_for_switched_and_nobody_is_given_up(clock, faults, before, kept, words):
    craft = Craft(clock, mode=before)
    vars(craft).update(faults)
    switch = Switch(Mode.OFF)
    assert not drive(switch, craft, clock, 120.0)
    assert switch.sent >= 225 or kept == 0.0
    assert (craft.server.mode, words in switch.words) == (kept, True)
    vars(craft).update(stuck=False, echoes=False, tells_mode=True, deaf=False)
    assert drive(switch, craft, clock, 5.0)
    assert craft.server.mode == 0


def test_telemetry_from_before_the_first_order_is_no_answer_to_it(clock):
    craft = Craft(clock, mode=0.0)
    switch = Switch(Mode.OFF)
    for frame in Framer().feed(craft.read(0.0)):
        switch.on_frame(frame, 0.0)
    craft.tells_mode = False
    assert not drive(switch, craft, clock, 10.0)


def test_one_that_switches_back_before_the_read_back_is_switched_again(craft, clock):
    switch = Switch(Mode.OFF)
    times = []

    def meddle():
        if switch.sent == 2 and "being read back" in switch.words and not times:
            times.append(clock.now_s)
            craft.server.write("FF_MODE", 3.0, False)

    assert drive(switch, craft, clock, 20.0, each=meddle)
    assert times
    assert craft.server.mode == 0
    assert switch.sent > 2


def test_one_that_falls_silent_before_the_read_back_is_sent_it_again(craft, clock):
    switch = Switch(Mode.OFF)

    def fall_silent():
        craft.deaf = craft.deaf or "being read back" in switch.words

    assert not drive(switch, craft, clock, 4.0, each=fall_silent)
    before = switch.sent
    assert not drive(switch, craft, clock, 20.0)
    assert switch.sent > before + 4


@pytest.mark.parametrize("seed", range(40))
def test_thirty_per_cent_of_loss_each_way_only_take_longer(craft, clock, seed):
    link = Lossy(craft, random.Random(seed), clock, loss=0.3, duplicate=0.1, reorder=0.1, delay_s=0.1)
    switch = Switch(Mode.OFF)
    assert drive(switch, link, clock, 40.0)
    assert craft.server.mode == 0


def test_that_a_vehicle_takes_its_orders_from_another_ground_is_said_as_the_reason(craft, clock):
    craft.bound = True
    switch = Switch(Mode.OFF)
    assert not drive(switch, craft, clock, 5.0)
    assert craft.server.mode == Mode.BOTH
    assert switch.refusal == (
        "vehicle 1: the vehicle does not permit it now: it takes no orders from system 255, but from another ground"
    )


def test_off_waits_for_no_companion_and_goes_to_it_as_soon_as_it_beats(clock):
    autopilot, companion = Craft(clock), Craft(clock, (1, 191), autopilot=8, phase_s=0.9)
    autopilot.lacks = True
    switch = Switch(Mode.OFF)
    assert drive(switch, Both(autopilot, companion), clock, 10.0)
    assert [(item.time_s, item.value) for item in autopilot.sets] == [(pytest.approx(STEP_S), 0.0)]
    assert companion.sets[0][::3] == (pytest.approx(0.9, abs=2 * STEP_S), 0.0)
    assert companion.server.mode == 0


def test_a_companion_is_told_before_an_autopilot_where_neither_tells_its_mode(clock):
    autopilot, companion = Craft(clock), Craft(clock, (1, 191), autopilot=8, phase_s=0.9)
    autopilot.lacks = True
    companion.tells_mode = False
    switch = Switch(Mode.SHADOW)
    drive(switch, Both(autopilot, companion), clock, 10.0)
    assert autopilot.sets == []
    assert companion.server.mode == 1


@pytest.mark.parametrize("phase_s", [0.9, 6.0])
def test_off_reaches_a_companion_that_tells_no_mode_though_the_autopilot_has_none(clock, phase_s):
    autopilot, companion = Craft(clock), Craft(clock, (1, 191), autopilot=8, phase_s=phase_s)
    autopilot.lacks = True
    companion.tells_mode = False
    drive(Switch(Mode.OFF), Both(autopilot, companion), clock, 10.0)
    assert companion.server.mode == 0


def heard_before(*vehicles):
    return tuple(KnownVehicle(source, holds, heard_s) for source, holds, heard_s in vehicles)


def test_off_is_sent_blindly_and_works_where_the_vehicle_is_heard_no_more_but_is_never_called_done(
    craft, clock
):
    craft.mute = True
    switch = Switch(Mode.OFF, known=heard_before(((1, 1), True, -8.0)))
    assert not drive(switch, craft, clock, 4.1)
    assert craft.server.mode == 0
    assert (switch.heard, switch.done, switch.waits_for) == (False, False, (1,))
    assert switch.words == "vehicle 1: sent 9 times, not heard for 12 s: not confirmed"
    craft.mute = False
    assert drive(switch, craft, clock, 5.0)


def test_one_that_is_heard_no_more_while_it_is_switched_is_told_as_not_heard(craft, clock):
    craft.deaf = True
    switch = Switch(Mode.OFF)
    drive(switch, craft, clock, 2.0)
    craft.mute = True
    drive(switch, craft, clock, 6.0)
    assert switch.words == "vehicle 1: sent 16 times, not heard for 6 s: not confirmed"


@pytest.mark.parametrize("component", [1, 191])
def test_off_of_a_system_that_is_named_is_sent_though_nobody_ever_heard_it(clock, component):
    craft = Craft(clock, (3, component), autopilot=0 if component == 1 else 8)
    craft.mute = True
    other = Craft(clock, (2, 1))
    other.mute = True
    switch = Switch(Mode.OFF, system=3, known=heard_before(((2, 1), True, -1.0)))
    assert not drive(switch, Both(other, craft), clock, 4.1)
    assert (craft.server.mode, other.server.mode, other.sets) == (0, 3, [])
    assert switch.words == "vehicle 3: sent 9 times, never heard: not confirmed"
    craft.mute = False
    assert drive(switch, Both(other, craft), clock, 5.0)
    assert (other.server.mode, other.sets) == (3, [])


def test_a_companion_never_heard_is_sent_off_though_the_autopilot_of_its_system_has_none(clock):
    autopilot, companion = Craft(clock, (3, 1)), Craft(clock, (3, 191), autopilot=8)
    autopilot.lacks = companion.mute = True
    drive(Switch(Mode.OFF, system=3), Both(autopilot, companion), clock, 3.0)
    assert companion.server.mode == 0


def test_a_raise_is_sent_to_nobody_who_is_not_heard(clock):
    craft = Craft(clock, mode=0.0)
    craft.mute = True
    switch = Switch(Mode.BOTH, system=1, known=heard_before(((1, 1), True, 0.0)))
    assert not drive(switch, craft, clock, 10.0)
    assert (craft.sets, switch.sent) == ([], 0)


def test_a_companion_that_is_heard_late_is_found_though_the_autopilot_said_no(clock):
    autopilot, companion = Craft(clock), Craft(clock, (1, 191), autopilot=8, phase_s=6.0)
    autopilot.lacks = True
    switch = Switch(Mode.OFF)
    drive(switch, Both(autopilot, companion), clock, 5.0)
    assert switch.lacking
    assert switch.words == "vehicle 1: has no feed-forward"
    assert drive(switch, Both(autopilot, companion), clock, 10.0)
    assert not switch.lacking


def test_it_is_not_done_while_one_of_them_is_stuck_and_says_which(clock):
    stuck, other = Craft(clock, (1, 1)), Craft(clock, (2, 1), phase_s=0.5)
    other.stuck = True
    switch = Switch(Mode.OFF)
    assert not drive(switch, Both(stuck, other), clock, 10.0)
    first, second = switch.words.split("; ")
    assert first == "vehicle 1: off, as read back and as its telemetry says"
    assert second.startswith("vehicle 2: sent ")


def twins_on(clock):
    first, other = Craft(clock), Craft(clock, phase_s=0.5, booted_s=-40.0)
    link = Both(first, other)
    return first, other, link, Peers(link)


def test_of_two_vehicles_with_one_address_it_is_not_off_while_either_says_otherwise(clock):
    first, other, link, twins = twins_on(clock)
    other.stuck = True
    switch = Switch(Mode.OFF)
    assert not drive(switch, link, clock, 30.0, twins)
    assert "two vehicles beat as system 1" in switch.words
    assert "as answered" not in switch.words
    other.stuck = False
    assert drive(switch, link, clock, 10.0, twins)
    assert (first.server.mode, other.server.mode) == (0, 0)
    assert switch.words.startswith(
        "vehicle 1: off, as answered; but two vehicles answer: both:: two vehicles beat as system 1"
    )
