"""Two vehicles that share one address, each on a link of its own; one vehicle on two links is one."""

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.framing import Encoder, Framer
from gcs_plugin.twins_across import TwinsAcross

SENTENCE = "a and b: two vehicles beat as system 1, component 1, and both would obey; stop one"


def heard(*told, system=1):
    """The first fault after any of the times since boot: (arrival, link, time since boot), in s."""
    twins, encoder, fault = TwinsAcross(), Encoder(1, 1), ""
    for arrival_s, link, boot_s in sorted(told, key=lambda one: one[0]):
        raw = encoder.encode(dialect.MAVLink_system_time_message(0, round(1000 * boot_s)))
        for frame in Framer().feed(raw):
            twins.on_frame(frame, link, arrival_s)
        fault = fault or twins.fault(system)
    return fault


def clock(link, booted_s, late_s=(0.0,), begin=0, end=60):
    """A clock that is told once a second on a link, each time so late."""
    return [(k + late_s[k % len(late_s)], link, k - booted_s) for k in range(begin, end)]


@pytest.mark.parametrize("apart_s", [6.0, 30.0, 5000.0])
def test_two_boot_clocks_on_two_links_are_two_vehicles_within_seconds(apart_s):
    two = [*clock("a", -10.0, end=6), *clock("b", -10.0 - apart_s, end=6)]
    assert heard(*two).startswith(SENTENCE)
    assert heard(*two, system=2) == ""


def test_one_clock_on_two_links_is_one_vehicle_however_late_one_of_them_is():
    for late_s in ((0.3,), (4.9,), (0.0, 4.9), (0.0, 0.7, 4.5, 3.5)):
        assert heard(*clock("a", -10.0), *clock("b", -10.0, late_s)) == ""


@pytest.mark.parametrize("lag", [0, 1, 5, 15])
def test_a_restart_that_one_link_hears_later_is_no_second_vehicle(lag):
    before = [*clock("a", -1000.0, end=20), *clock("b", -1000.0, end=20)]
    after = [*clock("a", 21.0, begin=22), *clock("b", 21.0, begin=22 + lag)]
    assert heard(*before, *after) == ""


@pytest.mark.parametrize("stop_s", [3, 8, 30])
def test_a_ground_that_reads_all_of_a_stop_at_once_hears_no_twins(stop_s):
    told, period_s = [], stop_s + 2
    for k in range(20 * period_s):
        arrival_s = max(k, k // period_s * period_s + stop_s)
        # Everything of one link, then everything of the other, as an idle moment reads them.
        told += [(arrival_s, "a", k), (arrival_s + 0.01, "b", k)]
    assert heard(*told) == ""


def test_a_second_vehicle_that_has_left_is_forgotten():
    twins, encoder = TwinsAcross(), Encoder(1, 1)

    def tell(link, now_s, boot_s):
        raw = encoder.encode(dialect.MAVLink_system_time_message(0, round(1000 * boot_s)))
        (frame,) = Framer().feed(raw)
        twins.on_frame(frame, link, now_s)

    for k in range(6):
        tell("a", k, k)
        tell("b", k, k + 500.0)
    assert twins.fault(1) != ""
    for k in range(6, 40):
        tell("a", k, k)
    assert twins.fault(1) == ""
