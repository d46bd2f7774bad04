"""Who speaks, how many of their frames were lost, and which vehicle is meant."""

import tracemalloc

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect
from soak import rest_in_soak

from bridge.errors import LinkError, LinkTimeout
from bridge.wire.framing import Encoder, Frame, Framer
from bridge.wire.readings import Reading, encode
from gcs_plugin.fleet import Fleet
from gcs_plugin.peers import KnownVehicle, Peers
from gcs_plugin.watch.watcher import Watcher

LINK = "udpin:1"
PLACES, GONE_S = 256, 60.0
FULL, MORE = 3000, (4000, 10_000)
A_MEGABYTE = 1_000_000


def only(peers, now_s=0.0):
    (reception,) = peers.receptions(LINK, now_s)
    return reception


def heard(sequences, step_s=0.1, known=True):
    peers = Peers()
    for index, sequence in enumerate(sequences):
        peers.on_frame(Frame(b"", 7, 1, 1, sequence, known), LINK, index * step_s)
    return peers


@pytest.mark.parametrize(
    ("sequences", "step_s", "counts"),
    [
        pytest.param([0, 1, 4, 5, 7], 0.1, (5, 3), id="gaps are losses"),
        pytest.param([254, 255, 0, 1], 0.1, (4, 0), id="the sequence runs round"),
        pytest.param([0, 2, 1, 3, 3], 0.1, (4, 0), id="a late frame takes its loss back, a duplicate counts nothing"),
        pytest.param([0, 2, 5, 2, 5, 4, 2, 7, 5], 0.1, (5, 3), id="a duplicate, however late, takes no loss back"),
        pytest.param([200, 3], 10.0, (2, 0), id="after a long silence the numbers may start anew"),
    ],
)  # fmt: skip
def test_losses_are_counted_by_the_sequence_numbers(sequences, step_s, counts):
    source = only(heard(sequences, step_s))
    assert (source.received, source.lost) == counts


def clocked(count, before_s=0.0, first=0, missing=()):
    """Ten frames a second of one boot, each second's first with the clock; numbers from `first` on."""
    encoder, framer, frames = Encoder(1, 1), Framer(), []
    for k in range(first + count):
        boot_ms = round(1000 * before_s) + 100 * (k - first)
        clock = dialect.MAVLink_system_time_message(0, boot_ms)
        other = dialect.MAVLink_attitude_message(boot_ms, 0, 0, 0, 0, 0, 0)
        (frame,) = framer.feed(encoder.encode(other if (k - first) % 10 else clock))
        if k >= first and k - first not in missing:
            frames.append(frame)
    return frames


def counted(frames):
    peers = Peers()
    for k, frame in enumerate(frames):
        peers.on_frame(frame, LINK, 0.1 * k)
    source = only(peers)
    return source.received, source.lost


@pytest.mark.parametrize("first", [20, 100, 150, 250])
@pytest.mark.parametrize("unheard", [(), (0, 1, 2)])
def test_numbers_that_start_anew_with_the_vehicle_are_no_loss(first, unheard):
    before = clocked(95, before_s=60.0, first=first, missing=(33,))
    after = clocked(60, missing=(*unheard, 45))
    assert counted([*before, *after]) == (94 + 59 - len(unheard), 2)


def test_a_frame_of_an_unknown_id_counts_for_nothing():
    assert heard([0, 9], known=False).receptions(LINK, 1.0) == []


def crowd(peers, time_s):
    """As many made-up senders as there are places, none of them (1, 1)."""
    for made_up in range(PLACES):
        peers.on_frame(Frame(b"", 7, made_up % 250 + 2, made_up // 250, 0, True), LINK, time_s)


def test_whoever_made_up_addresses_before_the_vehicle_spoke_keeps_it_out_only_until_they_fall_silent():
    peers = Peers()
    crowd(peers, 0.0)
    assert peers.on_frame(Frame(b"", 7, 1, 1, 0, True), LINK, GONE_S) is None
    for sequence in range(1, 4):
        assert peers.on_frame(Frame(b"", 7, 1, 1, sequence, True), LINK, GONE_S + sequence) is not None
    ours = peers.receptions(LINK, GONE_S + 4.0)[0]
    assert (ours.system, ours.component, ours.received, ours.lost, ours.age_s) == (1, 1, 3, 0, 1.0)
    assert (len(list(peers)), peers.left_out[LINK]) == (PLACES, 1)


def frames_of(source, kind=dialect.MAV_TYPE_SUBMARINE):
    encoder = Encoder(*source)
    messages = (
        dialect.MAVLink_heartbeat_message(kind, 0, 0, 0, 4, 3),
        dialect.MAVLink_system_time_message(0, 1000),
        dialect.MAVLink_statustext_message(4, b"x" * 50, 7, 0),
    )
    return Framer().feed(b"".join(map(encoder.encode, messages)))


def made_up(first, count):
    """Frames of so many addresses, none of which is (1, 1)."""
    for n in range(first, first + count):
        yield from frames_of((2 + n % 253, 1 + n // 253 % 250))


def fleet():
    heard = Fleet()
    return lambda frame, time_s: heard.on_frame(frame, LINK, time_s)


def watcher():
    heard = Watcher(None)
    return lambda frame, time_s: heard.feed(frame, time_s, LINK)


@pytest.mark.parametrize("more", rest_in_soak(MORE))
@pytest.mark.parametrize("make", [fleet, watcher])
def test_made_up_addresses_fill_no_memory(make, more):
    hear = make()
    now_s = 0.0
    for frame in made_up(0, FULL):
        now_s += 0.001
        hear(frame, now_s)
    tracemalloc.start()
    try:
        for frame in made_up(FULL, more):
            now_s += 0.001
            hear(frame, now_s)
        frame = None
        assert tracemalloc.get_traced_memory()[0] < A_MEGABYTE
    finally:
        tracemalloc.stop()


def test_the_vehicle_that_was_there_first_is_meant_whoever_makes_up_addresses():
    fleet, now_s = Fleet(), 0.0
    for frame in (*frames_of((1, 1)), *made_up(0, FULL)):
        fleet.on_frame(frame, LINK, now_s)
    for _ in range(5):
        now_s += 1.0
        for frame in frames_of((1, 1)):
            fleet.on_frame(frame, LINK, now_s)
    fleet.choose(1, now_s)
    assert fleet.meant(now_s) == (1, 1)


BEAT = dialect.MAVLink_heartbeat_message(dialect.MAV_TYPE_SUBMARINE, 0, 0, 0, 4, 3)
OF_GROUND = dialect.MAVLink_heartbeat_message(dialect.MAV_TYPE_GCS, 8, 0, 0, 4, 3)
TOLD = dialect.MAVLink_param_value_message(b"FF_MODE", 3.0, 9, 1, 0)
OTHER = dialect.MAVLink_param_value_message(b"FF_MODES", 3.0, 9, 1, 0)
ORDER = dialect.MAVLink_param_set_message(1, 1, b"FF_MODE", 3.0, 9)


def hear(known, source, message, time_s):
    for frame in Framer().feed(Encoder(*source).encode(message)):
        known.on_frame(frame, LINK, time_s)


@pytest.mark.parametrize("message", [OF_GROUND, ORDER, OTHER])
def test_nobody_is_known_by_what_only_names_the_mode_or_beats_as_a_ground(message):
    known = Peers()
    hear(known, (255, 190), message, 1.0)
    assert known.known(1.0) == ()


def test_who_told_the_mode_stays_known_for_a_dive_and_who_only_beat_for_a_minute():
    known = Peers()
    hear(known, (1, 1), TOLD, 1.0)
    hear(known, (1, 1), BEAT, 2.0)
    hear(known, (2, 1), BEAT, 2.0)
    holder, passer = KnownVehicle((1, 1), True, 2.0), KnownVehicle((2, 1), False, 2.0)
    assert known.known(2.0 + 60.0) == (holder, passer)
    assert known.known(2.1 + 60.0) == (holder,)
    assert known.known(2.1 + 3600.0) == ()


def test_telemetry_of_the_mode_makes_a_vehicle_known_without_a_beat():
    known = Peers()
    for frame in Framer().feed(Encoder(4, 191).frame(*encode(Reading("ff_mode", 0.0, (2.0,))))):
        known.on_frame(frame, LINK, 5.0)
    assert known.known(5.0) == (KnownVehicle((4, 191), True, 5.0),)


SUBMARINE, COMPANION, STATION = (
    dialect.MAV_TYPE_SUBMARINE,
    dialect.MAV_TYPE_ONBOARD_CONTROLLER,
    dialect.MAV_TYPE_GCS,
)
NO_AUTOPILOT = dialect.MAV_AUTOPILOT_INVALID


class World:
    """A fleet that hears what is said at `now_s`."""

    def __init__(self):
        self.fleet, self.link, self.now_s, self.encoders = Fleet(), LINK, 100.0, {}

    def say(self, source, message, link=None):
        raw = self.encoders.setdefault(source, Encoder(*source)).encode(message)
        (frame,) = Framer().feed(raw)
        return self.fleet.on_frame(frame, link or self.link, self.now_s)

    def beat(self, source, kind=SUBMARINE, autopilot=0, armed=False, link=None):
        mode = dialect.MAV_MODE_FLAG_SAFETY_ARMED if armed else 0
        self.say(source, dialect.MAVLink_heartbeat_message(kind, autopilot, mode, 0, 4, 3), link)

    def live(self, *sources, seconds=3.0):
        for _ in range(round(seconds)):
            for source, words in sources:
                self.beat(source, **words)
            self.now_s += 1.0

    def meant(self):
        return self.fleet.meant(self.now_s)


@pytest.fixture
def world():
    return World()


def test_the_only_vehicle_is_meant_and_its_companion_before_its_autopilot(world):
    world.live(((1, 1), {}), ((1, 191), {"kind": COMPANION, "autopilot": NO_AUTOPILOT}))
    assert world.meant() == (1, 191)


def test_nobody_is_meant_before_a_companion_had_time_to_follow(world):
    world.beat((1, 1))
    with pytest.raises(LinkTimeout, match="only just now"):
        world.meant()
    world.now_s += 2.0
    assert world.meant() == (1, 1)


def test_of_several_vehicles_one_must_be_chosen(world):
    world.live(((1, 1), {}), ((2, 1), {}))
    with pytest.raises(LinkError, match=r"several vehicles beat \(systems 1, 2\)"):
        world.meant()
    assert world.fleet.choose(2, world.now_s) == (2, 1)
    assert world.meant() == (2, 1)
    with pytest.raises(LinkError, match="no vehicle beats as system 7; these do: 1, 2"):
        world.fleet.choose(7, world.now_s)
    assert world.fleet.choose(None, world.now_s) is None


def test_a_vehicle_that_can_not_be_chosen_yet_does_not_take_the_place_of_the_one_that_is(world):
    world.live(((1, 1), {}), ((2, 1), {}))
    world.fleet.choose(2, world.now_s)
    world.beat((3, 1))
    with pytest.raises(LinkTimeout, match="vehicle 3 was heard only just now; try again"):
        world.fleet.choose(3, world.now_s)
    assert world.meant() == (2, 1)


def test_the_chosen_one_does_not_become_another_when_it_falls_silent(world):
    world.live(((1, 1), {}), ((2, 1), {}))
    world.fleet.choose(2, world.now_s)
    world.live(((1, 1), {}), seconds=7.0)
    with pytest.raises(LinkTimeout, match="vehicle 2 has not beaten"):
        world.meant()


def test_a_ground_station_is_no_vehicle(world):
    world.live(((255, 190), {"kind": STATION, "autopilot": NO_AUTOPILOT}))
    with pytest.raises(LinkTimeout, match="no vehicle beats"):
        world.meant()


def test_a_vehicle_is_armed_where_any_part_of_it_says_so_and_no_station(world):
    world.live(((1, 1), {"armed": True}), ((1, 191), {"kind": COMPANION, "autopilot": NO_AUTOPILOT}))
    world.live(((2, 1), {}), ((2, 190), {"kind": STATION, "autopilot": NO_AUTOPILOT, "armed": True}))
    assert world.fleet.peers.armed(1)
    assert not world.fleet.peers.armed(2)


def test_two_vehicles_under_one_address_on_a_link_each_are_ordered_nothing(world):
    other = "udpin:2"
    for turn in range(8):
        world.beat((1, 1))
        world.beat((1, 1), link=other)
        world.say((1, 1), dialect.MAVLink_system_time_message(0, 1000 * turn))
        world.say((1, 1), dialect.MAVLink_system_time_message(0, 500_000 + 1000 * turn), other)
        world.now_s += 1.0
    with pytest.raises(LinkError, match="udpin:1 and udpin:2: two vehicles beat as system 1, component 1"):
        world.meant()
    assert world.fleet.peers.fault(2) == ""


def test_each_link_of_a_component_is_listed_and_the_last_is_the_way_to_it(world):
    world.beat((1, 1), link="tcp:old")
    world.beat((1, 1), link="tcp:new")
    assert [name for name, _ in world.fleet.sources(world.now_s)] == ["tcp:new", "tcp:old"]
    assert (world.fleet.link_of((1, 1)), world.fleet.link_of((9, 9))) == ("tcp:new", "")


def test_a_companion_that_was_never_heard_is_reached_on_the_link_of_its_vehicle(world):
    world.live(((1, 1), {}), ((2, 1), {"link": "tcp:other"}))
    assert [world.fleet.link_of(source) for source in ((1, 1), (1, 191), (3, 1))] == [LINK, LINK, ""]
