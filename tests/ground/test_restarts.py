"""A vehicle that starts anew while it is listened to is told of; what a bad link does to its frames is not."""

import random
from itertools import chain

import pytest
from faked_ground import Ground
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.clock import SimulatedClock
from bridge.framing import Encoder, Framer
from bridge.link.lossy import Lossy
from bridge.link.memory import memory_pair
from gcs_plugin.peers import Peers

UNIX_S = 1_790_000_000.0  # 14:13:20 UTC
AGES_S = 600.0


class Craft:
    """Beats and says its boot time each second from `booted_s` on; `unix_s` is its own date at the ground's zero."""

    def __init__(self, booted_s=0.0, source=(1, 1), kind=12, autopilot=0, unix_s=UNIX_S):
        self.booted_s, self.unix_s = booted_s, unix_s
        self.encoder = Encoder(*source)
        self.beat = dialect.MAVLink_heartbeat_message(kind, autopilot, 0, 0, 4, 3)

    def says(self, at_s):
        unix_us = round((self.unix_s + at_s) * 1e6) if self.unix_s else 0
        clock = dialect.MAVLink_system_time_message(unix_us, round((at_s - self.booted_s) * 1e3))
        return self.encoder.encode(self.beat) + self.encoder.encode(clock)


def told(frames):
    """What is told in words of the bytes that arrive at these times, and when."""
    peers, framer = Peers(), Framer()
    found = []
    for at_s, raw in sorted(frames, key=lambda one: one[0]):
        for frame in framer.feed(raw):
            peer = peers.on_frame(frame, "udpin:1", at_s)
            if peer is not None and peer.restart is not None:
                found.append((at_s, peer.restart.words(UNIX_S)))
    return found


def life(craft, seconds, late_s=lambda _: 0.0):
    return [(at_s + late_s(at_s), craft.says(at_s)) for at_s in seconds]


def restarted(before_s=100, off_s=4, late_s=lambda _: 0.0, **craft):
    """It runs for so long, is off, and runs again."""
    again_s = before_s + off_s
    first = life(Craft(**craft), range(before_s), late_s)
    return first + life(Craft(again_s - 0.5, **craft), range(again_s, again_s + 60), late_s)


def test_a_vehicle_that_starts_anew_is_told_of_once_within_four_seconds_of_its_first_word():
    words = "vehicle 1 started anew at 14:15:03 UTC (its clock went back to 0 s)"
    assert told(restarted()) == [(107, words)]


@pytest.mark.parametrize("before_s", [4, 9, 3000])
@pytest.mark.parametrize("off_s", [0, 2, 700])
def test_however_long_it_ran_and_was_off(before_s, off_s):
    assert len(told(restarted(before_s, off_s))) == 1


def test_each_of_several_restarts_is_told():
    lives = [life(Craft(20.0 * n), range(20 * n, 20 * n + 18)) for n in range(5)]
    assert len(told(chain(*lives))) == 4


def test_a_word_that_came_late_just_before_hides_no_restart():
    assert len(told([*restarted(), (99.5, Craft().says(96))])) == 1


def test_what_was_told_twice_alone_is_not_believed_yet():
    assert told(life(Craft(), range(100)) + life(Craft(103.5), [104, 108])) == []


def test_one_that_knows_no_date_is_told_of():
    assert len(told(restarted(unix_s=0.0))) == 1


def test_a_companion_is_named_by_its_component_and_its_autopilots_clock_is_its_own():
    companion = restarted(source=(1, 191), kind=18, autopilot=8)
    found = told(companion + life(Craft(-5000.0), range(165)))
    assert [words[:52] for _, words in found] == ["vehicle 1 (component 191) started anew at 14:15:03 U"]


def test_autopilot_and_bridge_with_clocks_of_their_own_on_one_link_start_nothing():
    bridge = Craft(-9.0, source=(1, 191), kind=18, autopilot=8)
    assert told(life(Craft(-5000.0), range(600)) + life(bridge, range(600))) == []


def test_a_ground_station_that_starts_anew_is_nobodys_vehicle():
    assert told(restarted(source=(255, 190), kind=dialect.MAV_TYPE_GCS, autopilot=8)) == []


@pytest.mark.parametrize("unix_s", [UNIX_S, 0.0])
@pytest.mark.parametrize(
    ("booted_s", "most_late_s"), [(0.0, 0.4), (0.0, 3.0), (-3000.0, 3.0), (-3000.0, 8.0)]
)
@pytest.mark.parametrize("seed", range(5))
def test_frames_that_come_late_twice_and_out_of_their_order_start_nothing(
    unix_s, booted_s, most_late_s, seed
):
    chance = random.Random(seed)
    once = life(Craft(booted_s, unix_s=unix_s), range(600), lambda _: chance.random() * most_late_s)
    again = [(at_s + chance.random() * most_late_s, raw) for at_s, raw in once if chance.random() < 0.2]
    assert told([one for one in once + again if chance.random() > 0.3]) == []


@pytest.mark.parametrize("late_s", [[3.2, 0, 6.1], [0, 0, 5.5, 3.4], [6.6, 5.6, 4.6, 0, 0]])
def test_words_of_its_first_seconds_that_come_later_than_newer_ones_start_nothing(late_s):
    assert told(life(Craft(unix_s=0.0), range(60), lambda at_s: late_s[at_s % len(late_s)])) == []


@pytest.mark.parametrize("stop_s", [3, 8, 30])
def test_a_ground_that_is_stopped_and_hears_all_at_once_hears_no_restart(stop_s):
    period_s = stop_s + 2
    frames = life(Craft(), range(300), lambda at_s: max(0, stop_s - at_s % period_s))
    assert told(frames) == []


@pytest.mark.parametrize("unix_s", [UNIX_S, 0.0])
def test_a_second_link_that_lags_and_alone_remains_starts_nothing(unix_s):
    first, second = Craft(-60.0, unix_s=unix_s), Craft(-60.0, unix_s=unix_s)
    lagging = [(at_s + 12.0, raw) for at_s, raw in life(second, range(300))]
    assert told(life(first, range(150)) + lagging) == []


def test_two_vehicles_under_one_address_start_nothing():
    assert (
        told(life(Craft(0.0), range(100)) + [(a + 0.5, r) for a, r in life(Craft(-50.0), range(100))]) == []
    )


@pytest.mark.parametrize(("begins_s", "unix_s"), [(0, UNIX_S), (300, UNIX_S), (900, 0.0)])
def test_a_replay_that_begins_anew_starts_nothing(begins_s, unix_s):
    recorded = life(Craft(unix_s=unix_s), range(begins_s, begins_s + 120))
    again = [(at_s + AGES_S, raw) for at_s, raw in recorded]
    assert told(recorded + again) == []


def test_a_restart_is_told_of_over_a_bad_link():
    clock, (near, far) = SimulatedClock(), memory_pair()
    faults = {"loss": 0.3, "duplicate": 0.2, "reorder": 0.2, "corrupt": 0.02, "delay_s": 0.4}
    carrier = Lossy(near, random.Random(4), clock, **faults)
    frames = []
    for at_s, raw in restarted():
        for tick in range(10):
            clock.advance_to(at_s + tick / 10)
            far.write(raw if tick == 0 else b"\0")
            while data := carrier.read(0.0):
                frames.append((clock.now_s, data))
    assert len(told(frames)) == 1


def test_a_recorder_warns_of_it_and_goes_on():
    ground = Ground(clock=SimulatedClock(unix_at_boot_s=UNIX_S))
    frames = restarted()
    for at_s, raw in frames:
        ground.hear(raw, after_s=at_s - ground.clock.now_s)
    assert [(notice.level, notice.sentence) for notice in ground.notices] == [
        ("warning", "vehicle 1 started anew at 14:15:03 UTC (its clock went back to 0 s)")
    ]
    assert len(ground.disk.stored()) == 2 * len(frames)
