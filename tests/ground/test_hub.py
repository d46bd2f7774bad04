"""The hub: every frame to everyone on this computer, as many as it has places for."""

import socket

import pytest
from faked_ground import frames_of
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.errors import LinkError, LinkLost
from bridge.links.open import open_link
from bridge.wire.framing import Encoder
from gcs_plugin.recording import hub as hubs
from gcs_plugin.recording.hub import Hub
from tui.links import ByWay

TRIES = 2000
UNKNOWN = bytes([0xFD, 3, 0, 0, 7, 255, 190, 0x11, 0x22, 0x05, 1, 2, 3, 0xAA, 0xBB])


@pytest.fixture
def hub(clock):
    hub = Hub(clock)
    yield hub
    hub.close()


@pytest.fixture
def join(hub):
    """A client that the hub has let in, or has refused."""
    links = []

    def join():
        before, dropped = hub.clients, hub.dropped
        links.append(ByWay(open_link(hub.address), [LINK]))
        assert taken(hub, until=lambda _: hub.clients > before or hub.dropped > dropped) == []
        return links[-1]

    yield join
    for link in links:
        link.close()


def taken(hub, until):
    """The frames that the hub takes until they are enough; loopback delivers at once, or nearly."""
    frames = []
    for _ in range(TRIES):
        frames += hub.taken()
        if until(frames):
            return frames
    raise AssertionError(f"only {len(frames)} frames came")


def read(link, size):
    data = b""
    while len(data) < size:
        more = link.read(5.0)
        assert more
        data += more
    return data


def raw_client(hub, data):
    """A client below MAVLink: its socket, after it sent `data`."""
    host, port = hub.address.split(":")[1:]
    sock = socket.create_connection((host, int(port)), timeout=60.0)
    sock.sendall(data)
    return sock


def test_what_clients_send_is_taken_in_whole_frames_however_it_is_cut(hub, join):
    client, other = join(), join()
    mine, theirs = frames_of(4, system=255), frames_of(4, system=254)
    for byte in mine[0]:
        client.write(bytes([byte]))
    cut = len(mine[1]) // 2
    client.write(mine[1][:cut])
    for raw in theirs:
        other.write(raw)
    first = taken(hub, until=lambda frames: len(frames) == 5)
    client.write(mine[1][cut:] + mine[2] + mine[3])
    second = taken(hub, until=lambda frames: len(frames) == 3)
    assert sorted(first + second) == sorted(mine + theirs)
    assert [raw for raw in first + second if raw in mine] == mine


def test_a_frame_of_an_id_that_nobody_knows_is_taken_once_nothing_follows(hub, join, clock):
    join().write(UNKNOWN)
    for _ in range(TRIES):
        assert hub.taken() == []
    clock.advance_to(1.0)
    assert hub.taken() == [UNKNOWN]
    assert hub.dropped == 0


def test_one_that_stalls_is_dropped_and_the_others_get_all(hub, join):
    stalled, quick = join(), join()
    flood = b"".join(frames_of(1000))
    for _ in range(2000):
        hub.broadcast(flood)
        assert read(quick, len(flood)) == flood
        if hub.dropped:
            break
    assert (hub.dropped, hub.clients) == (1, 1)
    with pytest.raises(LinkLost):
        read(stalled, 1 << 40)


def test_one_that_floods_is_dropped(hub, join):
    flooding, other = join(), join()
    raw = frames_of(1)[0]
    for _ in range(hubs.BURST_BYTES // len(raw) + 100):
        flooding.write(raw)
        hub.taken()
        if hub.dropped:
            break
    assert (hub.dropped, hub.clients) == (1, 1)
    other.write(raw)
    assert taken(hub, until=bool) == [raw]


def test_as_much_as_a_link_carries_is_no_flood(hub, join, clock):
    client, raw = (
        join(),
        Encoder(255, 190).encode(dialect.MAVLink_param_set_message(1, 1, b"FF0_M_U", 96.5, 9)),
    )
    each_second = hubs.MOST_BYTES_A_S // len(raw)
    for second in range(20):
        for _ in range(each_second):
            client.write(raw)
        taken(hub, until=lambda frames: len(frames) == each_second)
        clock.advance_to(second + 1.0)
    assert hub.dropped == 0


@pytest.mark.parametrize(
    "stranger",
    [
        b"POST / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n" + frames_of(2)[1],
        frames_of(1)[0] + b"\0" + frames_of(2)[1],
    ],
    ids=["a browser", "a byte that no frame holds"],
)
def test_one_that_speaks_no_mavlink_is_dropped_with_all_that_it_sent(hub, stranger):
    with raw_client(hub, stranger):
        for _ in range(TRIES):
            assert hub.taken() == []
            if hub.dropped:
                break
    assert (hub.dropped, hub.clients) == (1, 0)


def test_one_that_leaves_is_not_counted_as_dropped_and_its_last_frames_are_taken(hub):
    sent = frames_of(2)
    raw_client(hub, sent[0] + sent[1] + UNKNOWN).close()
    frames = taken(hub, until=lambda frames: len(frames) == 3)
    assert frames == [*sent, UNKNOWN]
    hub.taken()
    assert (hub.dropped, hub.clients) == (0, 0)


def test_it_listens_on_this_computer_alone_on_the_port_that_it_is_given(hub, clock):
    kind, host, port = hub.address.split(":")
    assert (kind, host) == ("tcp", "127.0.0.1")
    assert int(port) > 0
    with pytest.raises(LinkError, match=f"--hub {port}: can't listen on that port"):
        Hub(clock, int(port))


def test_when_it_closes_its_clients_are_told(hub, join):
    client = join()
    hub.close()
    with pytest.raises(LinkLost, match="has ended, or let go of this program"):
        client.read(5.0)


GROUND = Encoder(255, 190)
LINK = "udpin:127.0.0.1:14550"
FULL = r"32 programs are connected to the recording of udpin:127.0.0.1:14550 already; end one of them"


REQUEST = GROUND.encode(dialect.MAVLink_param_request_list_message(1, 1))
BEAT = Encoder(1, 1).encode(dialect.MAVLink_heartbeat_message(12, 0, 0, 0, 4, 3))


@pytest.fixture
def full(join):
    """The clients that take all places of the hub."""
    return [join() for _ in range(hubs.PLACES)]


def test_one_more_than_there_are_places_is_told_why_and_the_others_stay(hub, join, full):
    with pytest.raises(LinkLost, match=FULL):
        join().read(5.0)
    hub.broadcast(BEAT)
    assert [link.read(5.0) for link in full] == [BEAT] * hubs.PLACES


def test_a_place_that_becomes_free_is_given_to_the_next(hub, join, full):
    full[3].close()
    taken(hub, until=lambda _: hub.clients == hubs.PLACES - 1)
    join().write(REQUEST)
    assert taken(hub, until=bool) == [REQUEST]
