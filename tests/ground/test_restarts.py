"""Vehicles that start anew, and two that share an address, are noticed; bad links are neither."""

import random

import pytest
from faked_ground import Ground
from fakes.lossy import Lossy
from fakes.vehicle import FakeLink
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.clock import SimulatedClock
from bridge.links.link import memory_pair
from bridge.wire.framing import Encoder, Framer
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


def reported(frames):
    """Times and words of the restarts reported for bytes that arrive at these times."""
    peers, framer = Peers(), Framer()
    results = []
    for at_s, raw in sorted(frames, key=lambda arrival: arrival[0]):
        for frame in framer.feed(raw):
            peer = peers.on_frame(frame, "udpin:1", at_s)
            if peer is not None and peer.restart is not None:
                results.append((at_s, peer.restart.words(UNIX_S)))
    return results


def life(craft, seconds, late_s=lambda _: 0.0):
    return [(at_s + late_s(at_s), craft.says(at_s)) for at_s in seconds]


def restarted(before_s=100, off_s=4, late_s=lambda _: 0.0, **craft):
    """It runs for so long, is off, and runs again."""
    again_s = before_s + off_s
    first = life(Craft(**craft), range(before_s), late_s)
    return first + life(Craft(again_s - 0.5, **craft), range(again_s, again_s + 60), late_s)


def test_a_vehicle_that_starts_anew_is_told_of_once_within_four_seconds_of_its_first_word():
    words = "vehicle 1 started anew at 14:15:03 UTC (its clock went back to 0 s)"
    assert reported(restarted()) == [(107, words)]


@pytest.mark.parametrize("before_s", [4, 9, 3000])
@pytest.mark.parametrize("off_s", [0, 2, 700])
def test_however_long_it_ran_and_was_off(before_s, off_s):
    assert len(reported(restarted(before_s, off_s))) == 1


def test_a_word_that_came_late_just_before_hides_no_restart():
    assert len(reported([*restarted(), (99.5, Craft().says(96))])) == 1


def test_what_was_told_twice_alone_is_not_believed_yet():
    assert reported(life(Craft(), range(100)) + life(Craft(103.5), [104, 108])) == []


def test_a_boot_clock_that_goes_round_after_seven_weeks_starts_nothing_and_a_start_anew_after_it_is_told():
    class Aged(Craft):
        def says(self, at_s):
            ms = round((at_s - self.booted_s) * 1e3) % 2**32
            return self.encoder.encode(self.beat) + self.encoder.encode(
                dialect.MAVLink_system_time_message(round((UNIX_S + at_s) * 1e6), ms)
            )

    aged = Aged(booted_s=100 - 2**32 / 1e3)
    goes_on = life(aged, [*range(200), *range(4000, 4100)], late_s=lambda at_s: 0.4 * (int(at_s) % 2))
    assert reported(goes_on) == []
    ((at_s, _),) = reported(goes_on + life(Craft(booted_s=4104.0), range(4105, 4120)))
    assert at_s < 4112


def test_a_companion_is_named_by_its_component_and_its_autopilots_clock_is_its_own():
    companion = restarted(source=(1, 191), kind=18, autopilot=8)
    result = reported(companion + life(Craft(-5000.0), range(165)))
    assert [words[:52] for _, words in result] == ["vehicle 1 (component 191) started anew at 14:15:03 U"]


def test_autopilot_and_bridge_with_clocks_of_their_own_on_one_link_start_nothing():
    bridge = Craft(-9.0, source=(1, 191), kind=18, autopilot=8)
    assert reported(life(Craft(-5000.0), range(600)) + life(bridge, range(600))) == []


def test_a_ground_station_that_starts_anew_is_nobodys_vehicle():
    assert reported(restarted(source=(255, 190), kind=dialect.MAV_TYPE_GCS, autopilot=8)) == []


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
    assert reported([item for item in once + again if chance.random() > 0.3]) == []


@pytest.mark.parametrize("late_s", [[3.2, 0, 6.1], [0, 0, 5.5, 3.4], [6.6, 5.6, 4.6, 0, 0]])
def test_words_of_its_first_seconds_that_come_later_than_newer_ones_start_nothing(late_s):
    assert reported(life(Craft(unix_s=0.0), range(60), lambda at_s: late_s[at_s % len(late_s)])) == []


@pytest.mark.parametrize("stop_s", [3, 8, 30])
def test_a_ground_that_is_stopped_and_hears_all_at_once_hears_no_restart(stop_s):
    period_s = stop_s + 2
    frames = life(Craft(), range(300), lambda at_s: max(0, stop_s - at_s % period_s))
    assert reported(frames) == []


@pytest.mark.parametrize("unix_s", [UNIX_S, 0.0])
def test_a_second_link_that_lags_and_alone_remains_starts_nothing(unix_s):
    first, second = Craft(-60.0, unix_s=unix_s), Craft(-60.0, unix_s=unix_s)
    lagging = [(at_s + 12.0, raw) for at_s, raw in life(second, range(300))]
    assert reported(life(first, range(150)) + lagging) == []


@pytest.mark.parametrize(("begins_s", "unix_s"), [(0, UNIX_S), (300, UNIX_S), (900, 0.0)])
def test_a_replay_that_begins_anew_starts_nothing(begins_s, unix_s):
    recorded = life(Craft(unix_s=unix_s), range(begins_s, begins_s + 120))
    again = [(at_s + AGES_S, raw) for at_s, raw in recorded]
    assert reported(recorded + again) == []


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
    assert len(reported(frames)) == 1


def test_a_recorder_warns_of_it_and_goes_on():
    ground = Ground(clock=SimulatedClock(unix_at_boot_s=UNIX_S))
    frames = restarted()
    for at_s, raw in frames:
        ground.hear(raw, after_s=at_s - ground.clock.now_s)
    assert [(notice.level, notice.sentence) for notice in ground.notices] == [
        ("warning", "vehicle 1 started anew at 14:15:03 UTC (its clock went back to 0 s)")
    ]
    assert len(ground.disk.stored()) == 2 * len(frames)


SENTENCE = "memory:a: two vehicles beat as system 1, component 1, and both would obey; stop one"


class Twin(Craft):
    """Says `per_step` frames twenty times a second besides; its sequence numbers begin at `sequence`."""

    def __init__(self, booted_s=0.0, sequence=0, per_step=10, **craft):
        super().__init__(booted_s, unix_s=0.0, **craft)
        self.per_step = per_step
        for _ in range(sequence):
            self.encoder.frame(0, bytes(9))

    def step(self, tick):
        out = b"".join(self.encoder.frame(30, bytes(28)) for _ in range(self.per_step))
        return out if tick % 20 else out + self.says(0.05 * tick)


def watched(*craft, seconds=6, link=None, faults=None):
    """The watch after so long; `craft` may hold (from, to, craft) in seconds."""
    near, far = memory_pair()
    twins, framer = Peers(link), Framer()
    clock = SimulatedClock()
    carrier = Lossy(near, random.Random(1), clock, **faults) if faults else near
    for tick in range(20 * seconds):
        clock.advance_to(0.05 * tick)
        said = b""
        for begin, end, who in craft:
            if begin <= clock.now_s < end:
                said += who.step(tick)
        far.write(said or b"\0")
        while data := carrier.read(0.0):
            for frame in framer.feed(data):
                twins.on_frame(frame, "memory:a", clock.now_s)
    return twins


ALWAYS = (0.0, 1e9)


@pytest.mark.parametrize("apart", [40, 100, 128, 200])
def test_two_runs_of_sequence_numbers_that_take_turns_are_two_vehicles(apart):
    pair = [(*ALWAYS, Twin(0.0, 0)), (*ALWAYS, Twin(0.0, apart, 7))]
    assert watched(*pair, seconds=2).fault(1).startswith(SENTENCE)


@pytest.mark.parametrize("at_s", [1.0, 2.35, 3.9])
def test_a_vehicle_that_starts_anew_is_still_one(at_s):
    assert watched((0.0, at_s, Twin(-100.0, 77)), (at_s + 0.5, 1e9, Twin(at_s))).fault() == ""


def test_a_bad_link_makes_no_twins():
    faults = {"loss": 0.3, "duplicate": 0.2, "reorder": 0.2, "corrupt": 0.02, "delay_s": 0.2}
    assert watched((*ALWAYS, Twin()), seconds=30, faults=faults).fault() == ""


def test_two_components_and_two_systems_are_no_twins_of_each_other():
    others = [Twin(-50.0, 30, source=(1, 191)), Twin(-90.0, 90, source=(2, 1))]
    assert watched((*ALWAYS, Twin()), *[(*ALWAYS, craft) for craft in others]).fault() == ""


def test_two_ground_stations_with_one_id_are_usual():
    stations = [Twin(-9.0 * n, 90 * n, source=(255, 190), kind=dialect.MAV_TYPE_GCS) for n in range(2)]
    assert watched(*[(*ALWAYS, craft) for craft in stations]).fault() == ""


@pytest.mark.parametrize(("seconds", "is_told"), [(1, True), (15, True), (25, False)])
def test_when_the_second_vehicle_has_left_all_is_well_again(seconds, is_told):
    pair = [(*ALWAYS, Twin()), (0.0, 2.0, Twin(0.0, 100))]
    assert bool(watched(*pair, seconds=seconds).fault()) == is_told


def test_two_boot_clocks_are_two_vehicles_though_the_ground_is_busy():
    ours, other = clock("memory:a", -50.0, (0.0, 1.0), end=12), clock("memory:a", -4.0, (1.0,), end=12)
    assert heard_on_links(*ours, *other).startswith(SENTENCE)


def test_what_the_link_knows_of_its_peers_counts():
    udp = FakeLink("memory:a")
    udp.contested = frozenset(((1, 1), (3, 1)))
    assert watched((*ALWAYS, Twin()), link=udp).fault().startswith(SENTENCE)


# Each on a link of its own.

ON_BOTH = "a and b: two vehicles beat as system 1, component 1, and both would obey; stop one"


def heard_on_links(*readings, system=1):
    """The first fault after any of the times since boot: (arrival, link, time since boot), in s."""
    twins, encoder, fault = Peers(), Encoder(1, 1), ""
    for arrival_s, link, boot_s in sorted(readings, key=lambda reading: reading[0]):
        raw = encoder.encode(dialect.MAVLink_system_time_message(0, round(1000 * boot_s)))
        for frame in Framer().feed(raw):
            twins.on_frame(frame, link, arrival_s)
        fault = fault or twins.fault(system)
    return fault


def clock(link, booted_s, late_s=(0.0,), begin=0, end=60):
    """Boot times once a second on a link, each so late."""
    return [(k + late_s[k % len(late_s)], link, k - booted_s) for k in range(begin, end)]


@pytest.mark.parametrize("apart_s", [6.0, 30.0, 5000.0])
def test_two_boot_clocks_on_two_links_are_two_vehicles_within_seconds(apart_s):
    two = [*clock("a", -10.0, end=6), *clock("b", -10.0 - apart_s, end=6)]
    assert heard_on_links(*two).startswith(ON_BOTH)
    assert heard_on_links(*two, system=2) == ""


def test_one_clock_on_two_links_is_one_vehicle_however_late_one_of_them_is():
    for late_s in ((0.3,), (4.9,), (0.0, 4.9), (0.0, 0.7, 4.5, 3.5)):
        assert heard_on_links(*clock("a", -10.0), *clock("b", -10.0, late_s)) == ""


@pytest.mark.parametrize("lag", [0, 1, 5, 15])
def test_a_restart_that_one_link_hears_later_is_no_second_vehicle(lag):
    before = [*clock("a", -1000.0, end=20), *clock("b", -1000.0, end=20)]
    after = [*clock("a", 21.0, begin=22), *clock("b", 21.0, begin=22 + lag)]
    assert heard_on_links(*before, *after) == ""


@pytest.mark.parametrize("stop_s", [3, 8, 30])
def test_a_ground_that_reads_all_of_a_stop_at_once_hears_no_twins(stop_s):
    readings, period_s = [], stop_s + 2
    for k in range(20 * period_s):
        arrival_s = max(k, k // period_s * period_s + stop_s)
        # Everything of one link, then everything of the other, as an idle moment reads them.
        readings += [(arrival_s, "a", k), (arrival_s + 0.01, "b", k)]
    assert heard_on_links(*readings) == ""
