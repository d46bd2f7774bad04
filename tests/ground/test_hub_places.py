"""Who comes to a hub when all its places are taken: told so, heard in nothing but OFF, and no trouble to the others."""

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.clock import SimulatedClock
from bridge.errors import LinkLost
from bridge.framing import Encoder, Framer, decode
from bridge.link.open import open_link
from gcs_plugin.recording import hub as hubs
from gcs_plugin.recording.hub import Hub
from tui.links import ByWay

TRIES = 2000
REAL32 = dialect.MAV_PARAM_TYPE_REAL32
GROUND = Encoder(255, 190)
LINK = "udpin:127.0.0.1:14550"
FULL = r"32 programs are connected to the recording of udpin:127.0.0.1:14550 already; end one of them"


def mode_set(mode):
    return GROUND.encode(dialect.MAVLink_param_set_message(1, 1, b"FF_MODE", mode, REAL32))


def mode_read():
    return GROUND.encode(dialect.MAVLink_param_request_read_message(1, 1, b"FF_MODE", -1))


def list_request():
    return GROUND.encode(dialect.MAVLink_param_request_list_message(1, 1))


def vehicle_beat():
    return Encoder(1, 1).encode(dialect.MAVLink_heartbeat_message(12, 0, 0, 0, 4, 3))


class House:
    """A hub all of whose places are taken, and who else comes."""

    def __init__(self):
        self.clock = SimulatedClock()
        self.hub = Hub(self.clock)
        self.said = []
        self.hub.tell = self.said.append
        self.links = []
        self.first = [self.comes() for _ in range(hubs.PLACES)]

    def comes(self):
        """One that connects, and whom the hub has seen."""
        before, dropped = self.hub.clients, self.hub.dropped
        self.links.append(ByWay(open_link(self.hub.address), [LINK]))
        self.taken(lambda _: self.hub.clients > before or self.hub.dropped > dropped)
        return self.links[-1]

    def taken(self, until):
        """What the hub passes on until it is enough; loopback delivers at once, or nearly."""
        frames = []
        for _ in range(TRIES):
            frames += self.hub.taken()
            if until(frames):
                return frames
        raise AssertionError(f"only {len(frames)} frames came")

    def waits(self, seconds):
        self.clock.advance_to(self.clock.boot_s() + seconds)

    def close(self):
        self.hub.close()
        for link in self.links:
            link.close()


@pytest.fixture
def house():
    house = House()
    yield house
    house.close()


def test_one_more_than_there_are_places_is_told_why_and_the_others_stay(house):
    with pytest.raises(LinkLost, match=FULL):
        house.comes().read(5.0)
    house.hub.broadcast(vehicle_beat())
    assert [link.read(5.0) for link in house.first] == [vehicle_beat()] * hubs.PLACES


def writes_on(link):
    """Write until it is lost."""
    for _ in range(TRIES):
        link.write(list_request())


def test_one_that_writes_before_it_reads_is_told_why_as_well(house):
    late = house.comes()
    with pytest.raises(LinkLost, match=FULL):
        writes_on(late)


def test_whoever_speaks_mavlink_reads_why_it_is_let_go(house):
    link = open_link(house.hub.address)
    house.taken(lambda _: house.hub.dropped)
    (frame,) = Framer().feed(link.read(5.0))
    assert decode(frame).text == "32 programs use this recording already; end one"
    link.close()


def test_a_place_that_becomes_free_is_given_to_the_next(house):
    house.first[3].close()
    house.taken(lambda _: house.hub.clients == hubs.PLACES - 1)
    order = list_request()
    house.comes().write(order)
    assert house.taken(bool) == [order]


def test_the_recorder_hears_once_that_all_places_are_taken_and_again_where_that_comes_anew(house):
    assert house.said == []
    house.comes()
    house.comes()
    assert house.said == [hubs.FULL]
    house.first[0].close()
    house.taken(lambda _: house.hub.clients == hubs.PLACES - 1)
    house.comes()
    house.comes()
    assert house.said == [hubs.FULL] * 2
