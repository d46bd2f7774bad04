"""OFF of several vehicles of which one is gone: what the others say meanwhile, and what a second press sends."""

import pytest
from test_ff_switch import Both, Craft, drive, heard_before

from bridge.clock import SimulatedClock
from bridge.vehicle.feedforward import Mode
from gcs_plugin.feedforward import Switch


@pytest.fixture
def clock():
    return SimulatedClock()


@pytest.fixture
def half_done(clock):
    """A switch whose vehicle 1 is off and whose vehicle 2 is gone, their link, and vehicle 1."""
    one, gone = Craft(clock, (1, 1)), Craft(clock, (2, 1))
    gone.deaf = gone.mute = True
    link = Both(one, gone)
    switch = Switch(Mode.OFF, known=heard_before(((1, 1), True, 0.0), ((2, 1), True, -3.0)))
    assert not drive(switch, link, clock, 6.0)
    assert switch.waits_for == switch.silent == (2,)
    return switch, link, one


def test_one_that_was_raised_since_is_told_as_it_says_now_and_not_fought(half_done, clock):
    switch, link, one = half_done
    one.server.write("FF_MODE", 3.0, False)
    orders = len(one.sets)
    drive(switch, link, clock, 3.0)
    assert switch.words.startswith(
        "vehicle 1: was off, as read back; its telemetry says both now; vehicle 2: "
    )
    assert (switch.waits_for, switch.silent, len(one.sets)) == ((1, 2), (), orders)


def test_a_second_press_is_sent_at_once_to_one_that_was_off_before(half_done, clock):
    switch, link, one = half_done
    one.server.write("FF_MODE", 3.0, False)
    drive(switch, link, clock, 3.0)
    orders, pressed_s = len(one.sets), clock.now_s
    switch.again()
    drive(switch, link, clock, 4.0)
    assert one.sets[orders][::3] == (pressed_s, 0.0)
    assert one.server.mode == 0
    assert switch.words.startswith("vehicle 1: off, as read back and as its telemetry says; vehicle 2: ")


def test_what_was_done_once_stays_done_though_it_is_raised_afterwards(clock):
    craft = Craft(clock)
    switch = Switch(Mode.OFF)
    assert drive(switch, craft, clock, 6.0)
    craft.server.write("FF_MODE", 3.0, False)
    drive(switch, craft, clock, 3.0)
    assert switch.done


def test_none_is_silent_while_one_that_is_heard_is_waited_for(clock):
    stuck, gone = Craft(clock, (1, 1)), Craft(clock, (2, 1))
    stuck.stuck = gone.deaf = gone.mute = True
    switch = Switch(Mode.OFF, known=heard_before(((1, 1), True, 0.0), ((2, 1), True, -3.0)))
    drive(switch, Both(stuck, gone), clock, 6.0)
    assert (switch.waits_for, switch.silent) == ((1, 2), ())
