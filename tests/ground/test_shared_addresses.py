"""Two vehicles that share one MAVLink address, on one link or two, are noticed; one that starts anew is one."""

import random

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.clock import SimulatedClock
from bridge.framing import Encoder, Framer
from bridge.link.lossy import Lossy
from bridge.link.memory import memory_pair
from gcs_plugin.peers import Peers

SENTENCE = "memory:a: two vehicles beat as system 1, component 1, and both would obey; stop one"


class Craft:
    """Says `per_step` frames twenty times a second, and its boot time once a second."""

    def __init__(self, booted_s=0.0, sequence=0, per_step=10, source=(1, 1), kind=12):
        self.booted_s, self.per_step, self.kind = booted_s, per_step, kind
        self.encoder = Encoder(*source)
        for _ in range(sequence):
            self.encoder.frame(0, bytes(9))

    def step(self, tick):
        now_s = 0.05 * tick
        out = [self.encoder.frame(30, bytes(28)) for _ in range(self.per_step)]
        if tick % 20 == 0:
            beat = dialect.MAVLink_heartbeat_message(self.kind, 0, 0, 0, 4, 3)
            clock = dialect.MAVLink_system_time_message(0, round((now_s - self.booted_s) * 1000))
            out += [self.encoder.encode(beat), self.encoder.encode(clock)]
        return b"".join(out)


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


def test_one_vehicle_is_one():
    assert watched((*ALWAYS, Craft())).fault() == ""


def test_two_boot_clocks_that_take_turns_are_two_vehicles():
    slow = [Craft(0.0, 0, 0), Craft(-30.0, 5, 0)]
    assert watched(*[(*ALWAYS, craft) for craft in slow]).fault().startswith(SENTENCE)


@pytest.mark.parametrize("apart", [40, 100, 128, 200])
def test_two_runs_of_sequence_numbers_that_take_turns_are_two_vehicles(apart):
    pair = [(*ALWAYS, Craft(0.0, 0)), (*ALWAYS, Craft(0.0, apart, 7))]
    assert watched(*pair, seconds=2).fault(1).startswith(SENTENCE)


@pytest.mark.parametrize("at_s", [1.0, 2.35, 3.9])
def test_a_vehicle_that_starts_anew_is_still_one(at_s):
    assert watched((0.0, at_s, Craft(-100.0, 77)), (at_s + 0.5, 1e9, Craft(at_s))).fault() == ""


def test_a_bad_link_makes_no_twins():
    faults = {"loss": 0.3, "duplicate": 0.2, "reorder": 0.2, "corrupt": 0.02, "delay_s": 0.2}
    assert watched((*ALWAYS, Craft()), seconds=30, faults=faults).fault() == ""


def test_two_components_and_two_systems_are_no_twins_of_each_other():
    others = [Craft(-50.0, 30, source=(1, 191)), Craft(-90.0, 90, source=(2, 1))]
    assert watched((*ALWAYS, Craft()), *[(*ALWAYS, craft) for craft in others]).fault() == ""


def test_twins_that_are_not_the_system_asked_for_do_not_matter():
    twins = watched(*[(*ALWAYS, Craft(-9.0 * n, 90 * n, source=(2, 1))) for n in range(2)])
    assert twins.fault(1) == ""
    assert "two vehicles beat as system 2" in twins.fault(2)


def test_two_ground_stations_with_one_id_are_usual():
    stations = [Craft(-9.0 * n, 90 * n, source=(255, 190), kind=dialect.MAV_TYPE_GCS) for n in range(2)]
    assert watched(*[(*ALWAYS, craft) for craft in stations]).fault() == ""


def test_when_the_second_vehicle_has_left_all_is_well_again():
    pair = [(*ALWAYS, Craft()), (0.0, 2.0, Craft(0.0, 100))]
    assert watched(*pair, seconds=1).fault() != ""
    pair = [(*ALWAYS, Craft()), (0.0, 2.0, Craft(0.0, 100))]
    assert watched(*pair, seconds=15).fault() != ""
    pair = [(*ALWAYS, Craft()), (0.0, 2.0, Craft(0.0, 100))]
    assert watched(*pair, seconds=25).fault() == ""


def heard(*boot_and_arrival_s):
    """The first fault, after any message, of a link that says times since boot alone, each as it arrives."""
    twins, framer, encoder = Peers(), Framer(), Encoder(1, 1)
    fault = ""
    for boot_s, arrival_s in boot_and_arrival_s:
        told = dialect.MAVLink_system_time_message(0, round(1000 * boot_s))
        for frame in framer.feed(encoder.encode(told)):
            twins.on_frame(frame, "memory:a", arrival_s)
        fault = fault or twins.fault()
    return fault


@pytest.mark.parametrize(
    "late_s", [[0, 0, 0.7], [0, 0.9], [0, 0, 4.0, 3.0], [0, 0.7, 0, 2.6, 0, 0, 4.0, 3.5]]
)
def test_frames_that_a_busy_ground_reads_late_make_no_twins(late_s):
    assert heard(*((float(k), k + late_s[k % len(late_s)]) for k in range(200))) == ""


@pytest.mark.parametrize("stop_s", [3, 8, 30])
def test_a_ground_that_is_stopped_again_and_again_hears_no_twins(stop_s):
    # Awake for two seconds, then all of a stop at once.
    period_s = stop_s + 2
    arrival_s = [max(k, k // period_s * period_s + stop_s) for k in range(40 * period_s)]
    assert heard(*((float(k), float(arrived_s)) for k, arrived_s in enumerate(arrival_s))) == ""


def test_a_vehicle_that_starts_anew_again_and_again_while_the_ground_is_busy_is_one():
    told = [(uptime_s, 8 * start + uptime_s) for start in range(20) for uptime_s in range(1, 7)]
    assert heard(*((boot_s, k + (3.0 if k % 4 == 0 else 0.0)) for boot_s, k in told)) == ""


def test_two_boot_clocks_are_two_vehicles_though_the_ground_is_busy():
    pair = [(k + booted_s, k + late_s) for k in range(12) for booted_s, late_s in ((50, k % 2), (4, 1))]
    assert heard(*pair).startswith(SENTENCE)


def test_gaps_in_one_run_of_sequence_numbers_are_no_second_vehicle():
    random_gaps, craft = random.Random(3), Craft(0.0)
    twins, framer = Peers(), Framer()
    for tick in range(20 * 600):
        data = craft.step(tick)
        if random_gaps.random() < 0.9:
            for frame in framer.feed(data):
                twins.on_frame(frame, "memory:a", 0.05 * tick)
        elif random_gaps.random() < 0.2:
            for _ in range(random_gaps.randrange(256)):
                craft.encoder.frame(0, bytes(9))
        assert twins.fault() == ""


def test_what_the_link_knows_of_its_peers_counts():
    class Udp:
        name = "memory:a"
        contested = frozenset(((1, 1), (3, 1)))

    assert watched((*ALWAYS, Craft()), link=Udp()).fault().startswith(SENTENCE)


# Each on a link of its own.

ON_BOTH = "a and b: two vehicles beat as system 1, component 1, and both would obey; stop one"


def heard_on_links(*told, system=1):
    """The first fault after any of the times since boot: (arrival, link, time since boot), in s."""
    twins, encoder, fault = Peers(), Encoder(1, 1), ""
    for arrival_s, link, boot_s in sorted(told, key=lambda reading: reading[0]):
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
    told, period_s = [], stop_s + 2
    for k in range(20 * period_s):
        arrival_s = max(k, k // period_s * period_s + stop_s)
        # Everything of one link, then everything of the other, as an idle moment reads them.
        told += [(arrival_s, "a", k), (arrival_s + 0.01, "b", k)]
    assert heard_on_links(*told) == ""


def test_a_second_vehicle_that_has_left_is_forgotten():
    twins, encoder = Peers(), Encoder(1, 1)

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
