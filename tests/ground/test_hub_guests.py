"""Who comes to a hub when all its places are taken: told so, heard in nothing but OFF, and no trouble to the others."""

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.clock import SimulatedClock
from bridge.errors import LinkLost
from bridge.framing import Encoder, Framer, decode
from bridge.link.open import open_link
from gcs_plugin.peers import ground_heartbeat
from gcs_plugin.recording import hub as hubs
from gcs_plugin.recording.hub import Hub
from tui.links import ByWay

TRIES = 2000
REAL32 = dialect.MAV_PARAM_TYPE_REAL32
GROUND = Encoder(255, 190)
LINK = "udpin:127.0.0.1:14550"
FULL = r"16 programs are connected to the recording of udpin:127.0.0.1:14550 already; end one of them"


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


def test_a_guest_hears_what_comes_and_forces_the_feed_forward_off(house):
    guest = house.comes()
    house.hub.broadcast(vehicle_beat())
    assert guest.read(5.0) == vehicle_beat()
    sent = [GROUND.encode(ground_heartbeat()), mode_set(0.0), mode_read()]
    guest.write(b"".join(sent))
    assert house.taken(lambda frames: len(frames) == 3) == sent
    assert house.hub.dropped == 0


@pytest.mark.parametrize(
    "order", [list_request(), mode_set(3.0)], ids=["parameters", "a mode that is not off"]
)
def test_what_else_a_guest_orders_is_not_passed_on_and_it_is_told_why(house, order):
    guest = house.comes()
    guest.write(order)
    assert house.taken(lambda _: house.hub.dropped) == []
    with pytest.raises(LinkLost, match=FULL):
        guest.read(5.0)


def writes_on(link):
    """Write until it is lost."""
    for _ in range(TRIES):
        link.write(list_request())


def test_a_guest_that_writes_before_it_reads_is_told_why_as_well(house):
    guest = house.comes()
    guest.write(list_request())
    house.taken(lambda _: house.hub.dropped)
    with pytest.raises(LinkLost, match=FULL):
        writes_on(guest)


def test_whoever_speaks_mavlink_reads_why_it_is_let_go(house):
    link = open_link(house.hub.address)
    house.taken(lambda _: house.hub.clients > hubs.PLACES)
    link.write(list_request())
    house.taken(lambda _: house.hub.dropped)
    (frame,) = Framer().feed(link.read(5.0))
    assert decode(frame).text == "16 programs use this recording already; end one"
    link.close()


def test_those_who_have_a_place_order_what_they_will_though_guests_are_there(house):
    house.comes()
    order = list_request()
    for link in house.first:
        link.write(order)
    assert house.taken(lambda frames: len(frames) == hubs.PLACES) == [order] * hubs.PLACES
    assert house.hub.dropped == 0


def test_a_guest_takes_the_place_of_one_that_leaves(house):
    guest = house.comes()
    house.first[3].close()
    house.taken(lambda _: house.hub.clients == hubs.PLACES)
    order = list_request()
    guest.write(order)
    assert house.taken(bool) == [order]


def test_one_more_guest_takes_the_place_of_the_one_that_listens_longest(house):
    before = [house.comes() for _ in range(hubs.GUESTS)]
    house.waits(hubs.STAYS_S)
    before[0].write(mode_set(0.0))
    house.taken(bool)
    newest = house.comes()
    assert house.hub.clients == hubs.PLACES + hubs.GUESTS
    with pytest.raises(LinkLost, match=FULL):
        before[1].read(5.0)
    house.hub.broadcast(vehicle_beat())
    for link in (*house.first, before[0], before[2], before[3], newest):
        assert link.read(5.0) == vehicle_beat()


def test_where_every_guest_has_just_come_one_more_is_told_to_wait(house):
    for _ in range(hubs.GUESTS):
        house.comes()
    with pytest.raises(LinkLost, match=FULL):
        house.comes().read(5.0)
    assert house.hub.clients == hubs.PLACES + hubs.GUESTS


def test_the_recorder_hears_once_that_all_places_are_taken_and_again_where_that_comes_anew(house):
    assert house.said == []
    guest = house.comes()
    house.comes()
    assert house.said == [hubs.FULL]
    for link in (guest, *house.first[:2]):
        link.close()
    house.taken(lambda _: house.hub.clients == hubs.PLACES - 1)
    house.comes()
    assert house.said == [hubs.FULL]
    house.comes()
    assert house.said == [hubs.FULL] * 2
