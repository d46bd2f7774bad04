"""Which vehicle is meant, and when that is not clear enough to send anything."""

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.errors import LinkError, LinkTimeout
from bridge.framing import Encoder, Framer
from gcs_plugin.fleet import SILENT_S, Fleet

SUBMARINE, COMPANION, STATION = (
    dialect.MAV_TYPE_SUBMARINE,
    dialect.MAV_TYPE_ONBOARD_CONTROLLER,
    dialect.MAV_TYPE_GCS,
)
NO_AUTOPILOT = dialect.MAV_AUTOPILOT_INVALID


class Quiet:
    """A link that only has a name."""

    def __init__(self, name="udpin:1"):
        self.name = name

    def read(self, _):
        return b""

    def write(self, _):
        raise AssertionError("a fleet never sends")

    def close(self):
        pass


class World:
    """A fleet that hears what is said at `now_s`."""

    def __init__(self):
        self.fleet, self.link, self.now_s, self.encoders = Fleet(), Quiet(), 100.0, {}

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


def test_the_chosen_one_does_not_become_another_when_it_falls_silent(world):
    world.live(((1, 1), {}), ((2, 1), {}))
    world.fleet.choose(2, world.now_s)
    world.live(((1, 1), {}), seconds=SILENT_S + 1)
    with pytest.raises(LinkTimeout, match="vehicle 2 has not beaten"):
        world.meant()


def test_a_ground_station_is_no_vehicle(world):
    world.live(((255, 190), {"kind": STATION, "autopilot": NO_AUTOPILOT}))
    with pytest.raises(LinkTimeout, match="no vehicle beats"):
        world.meant()


def test_a_vehicle_is_armed_where_any_part_of_it_says_so_and_no_station(world):
    world.live(((1, 1), {"armed": True}), ((1, 191), {"kind": COMPANION, "autopilot": NO_AUTOPILOT}))
    world.live(((2, 1), {}), ((2, 190), {"kind": STATION, "autopilot": NO_AUTOPILOT, "armed": True}))
    assert world.fleet.armed(1)
    assert not world.fleet.armed(2)


def test_two_vehicles_under_one_address_are_ordered_nothing(world):
    for turn in range(8):
        world.beat((1, 1))
        for boot_ms in (1000 * turn, 500_000 + 1000 * turn):
            world.say((1, 1), dialect.MAVLink_system_time_message(0, boot_ms))
        world.now_s += 1.0
    with pytest.raises(LinkError, match="two vehicles beat as system 1"):
        world.meant()


def test_one_vehicle_on_two_links_is_no_pair_of_twins(world):
    other, encoder = Quiet("udpin:2"), Encoder(1, 1)
    for late in range(400):
        (frame,) = Framer().feed(encoder.encode(dialect.MAVLink_system_time_message(0, 1000 * late)))
        world.fleet.on_frame(frame, world.link, world.now_s + late)
        if late % 3 == 0:
            world.fleet.on_frame(frame, other, world.now_s + late + 5.0)
    assert world.fleet.fault(1) == ""


def test_two_vehicles_under_one_address_on_a_link_each_are_ordered_nothing(world):
    other = Quiet("udpin:2")
    for turn in range(8):
        world.beat((1, 1))
        world.beat((1, 1), link=other)
        world.say((1, 1), dialect.MAVLink_system_time_message(0, 1000 * turn))
        world.say((1, 1), dialect.MAVLink_system_time_message(0, 500_000 + 1000 * turn), other)
        world.now_s += 1.0
    with pytest.raises(LinkError, match="udpin:1 and udpin:2: two vehicles beat as system 1, component 1"):
        world.meant()
    assert world.fleet.fault(2) == ""


def test_a_start_anew_is_told(world):
    assert not world.say((1, 1), dialect.MAVLink_system_time_message(0, 90_000)).rebooted
    assert not world.say((1, 1), dialect.MAVLink_system_time_message(0, 91_000)).rebooted
    assert world.say((1, 1), dialect.MAVLink_system_time_message(0, 1_000)).rebooted


def test_a_link_that_is_long_gone_is_told_of_no_more(world):
    world.beat((1, 1), link=Quiet("tcp:old"))
    for later_s in (1.0, 299.0, 1.5):
        world.now_s += later_s
        world.beat((1, 1), link=Quiet("tcp:new"))
    assert [name for name, _ in world.fleet.sources(world.now_s)] == ["tcp:new"]
    assert (world.fleet.link_of((1, 1)), world.fleet.link_of((9, 9))) == ("tcp:new", "")
