"""UDP links and their peers, and the loss in this computer's own socket."""

import errno
import socket
import sys

import pytest
from fakes.ports import free_port
from links_read import SOON_S
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.clock import SimulatedClock
from bridge.errors import LinkLost
from bridge.links.open import open_link
from bridge.links.udp import ReceiveBuffer, UdpLink, source_of
from bridge.signing.link import KeylessLink
from bridge.wire.framing import Encoder, Framer
from gcs_plugin.recording.link import WARN_EVERY_S, RecordedLink


def test_udpin_answers_those_who_spoke_and_udpout_only_its_peer():
    ground = open_link("udpin:127.0.0.1:0")
    ground.write(b"nobody is there yet")
    vehicles = [open_link(f"udpout:127.0.0.1:{ground.port}") for _ in range(2)]
    for i, vehicle in enumerate(vehicles):
        beat = Encoder(1, 1 + i).frame(0, bytes(9))
        vehicle.write(beat)
        assert ground.read(SOON_S) == beat
    ground.write(b"all")
    assert [vehicle.read(SOON_S) for vehicle in vehicles] == [b"all", b"all"]
    first = vehicles[0]
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        stranger.sendto(b"obey me", ("127.0.0.1", first.port))
        assert first.read(0.2) == b""
    for link in (ground, *vehicles):
        link.close()
    with pytest.raises(LinkLost):
        ground.read(0.0)


def test_udpin_answers_the_vehicle_whatever_strangers_send():
    ground = open_link("udpin:127.0.0.1:0")
    vehicle, beat = open_link(f"udpout:127.0.0.1:{ground.port}"), Encoder(1, 1).frame(0, bytes(9))
    strangers = [open_link(f"udpout:127.0.0.1:{ground.port}") for _ in range(24)]
    for stranger in strangers:
        for link, data in ((vehicle, beat), (stranger, b"no frame")):
            link.write(data)
            assert ground.read(SOON_S) == data
    ground.write(b"to those who speak MAVLink")
    assert vehicle.read(SOON_S) == b"to those who speak MAVLink"
    assert [stranger.read(0.0) for stranger in strangers] == [b""] * len(strangers)
    for n, stranger in enumerate(strangers):
        for link, data in ((vehicle, beat), (stranger, Encoder(2 + n, 1).frame(0, bytes(9)))):
            link.write(data)
            assert ground.read(SOON_S) == data
    ground.write(b"to those who spoke last")
    assert vehicle.read(SOON_S) == b"to those who spoke last"
    assert sum(bool(stranger.read(0.0)) for stranger in strangers) == 7
    for link in (ground, vehicle, *strangers):
        link.close()


def test_udpout_to_this_computer_can_be_reached_from_this_computer_alone_by_the_newer_address_too():
    link = open_link("udpout:::1:14550")
    assert link._socket.getsockname()[:2] == ("::1", link.port)
    link.close()


def test_udpout_without_a_route_opens_all_the_same(monkeypatch):
    def unreachable(*_):
        raise OSError(errno.ENETUNREACH, "Network is unreachable")

    monkeypatch.setattr("bridge.links.udp._own_towards", unreachable)
    ground = open_link("udpin:127.0.0.1:0")
    vehicle = open_link(f"udpout:127.0.0.1:{ground.port}")
    vehicle.write(b"hello")
    assert ground.read(SOON_S) == b"hello"
    vehicle.close()
    ground.close()


def test_udpin_knows_as_whom_several_peers_speak_by_turns_and_forgets_it():
    ground = open_link("udpin:127.0.0.1:0")
    old, new, other = (open_link(f"udpout:127.0.0.1:{ground.port}") for _ in range(3))

    def says(link, encoder):
        link.write(encoder.frame(0, bytes(9)))
        assert ground.read(SOON_S)

    vehicle = Encoder(1, 1)
    for link in (old, old, new, new):
        says(link, vehicle)
        says(other, Encoder(1, 191))
    assert ground.contested == frozenset()
    says(old, vehicle)
    assert ground.contested == {(1, 1)}
    for _ in range(201):
        says(old, vehicle)
    assert ground.contested == frozenset()
    for link in (ground, old, new, other):
        link.close()


@pytest.mark.parametrize(
    ("datagram", "source"),
    [
        (Encoder(7, 191).frame(0, bytes(9)), (7, 191)),
        (bytes((0xFE, 9, 0, 7, 191, 0)), (7, 191)),
        (b"", None),
        (b"no frame", None),
        (b"\xfd", None),
    ],
)
def test_a_datagram_tells_its_source_by_its_header(datagram, source):
    assert source_of(datagram) == source


def test_udpout_waits_for_a_peer_that_starts_later():
    port = free_port(socket.SOCK_DGRAM)
    vehicle = open_link(f"udpout:127.0.0.1:{port}")
    for _ in range(3):
        vehicle.write(b"too early")
        assert vehicle.read(0.01) == b""
    ground = open_link(f"udpin:127.0.0.1:{port}")
    vehicle.write(b"now")
    assert ground.read(SOON_S) == b"now"
    vehicle.close()
    ground.close()


SENT = 2000
linux = pytest.mark.skipif(sys.platform != "linux", reason="the system does not count")


@pytest.fixture
def ends():
    """A link, and who sends to it."""
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ground,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as vehicle,
    ):
        ground.bind(("127.0.0.1", 0))
        vehicle.connect(ground.getsockname())
        yield UdpLink("udpin:", ground, None), vehicle


def frames(count):
    encoder = Encoder(1, 1)
    return [encoder.encode(dialect.MAVLink_system_time_message(0, n)) for n in range(count)]


def test_a_read_gives_all_datagrams_that_are_there_in_order(ends):
    link, vehicle = ends
    sent = frames(100)
    for raw in sent:
        vehicle.send(raw)
    assert link.read(5.0) == b"".join(sent)
    assert link.read(0.0) == b""
    assert link.buffer.words == ""


@linux
def test_every_datagram_arrived_or_is_counted_as_lost_here(ends):
    link, vehicle = ends
    link.buffer = ReceiveBuffer(link._socket, 2048)
    framer, sent = Framer(), frames(SENT)
    for raw in sent[:-1]:
        vehicle.send(raw)
    arrived = 0
    while data := link.read(0.0):
        arrived += len(framer.feed(data))
    vehicle.send(sent[-1])
    assert [frame.raw for frame in framer.feed(link.read(5.0))] == [sent[-1]]
    assert arrived + 1 < SENT
    assert arrived + 1 + link.buffer.dropped == SENT
    assert f"lost {link.buffer.dropped} datagrams itself" in link.buffer.words


def test_a_system_that_gives_less_than_was_asked_for_is_told_with_what_to_do():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        buffer = ReceiveBuffer(sock)
        assert 0 < buffer.given_bytes <= 4194304
        buffer.given_bytes, buffer.dropped = 212992, 7
        assert "lost 7 datagrams itself, not the link" in buffer.words
        assert "208 of 4096 KiB" in buffer.words
        assert "net.core.rmem_max=4194304" in buffer.words
        buffer.given_bytes = 4194304
        assert "sysctl" not in buffer.words


def test_what_this_computer_lost_is_told_at_once_and_then_now_and_then(ends):
    link, _ = ends
    clock, said = SimulatedClock(), list[str]()
    recorded = RecordedLink(KeylessLink(link, said.append), clock, lambda _, words: said.append(words))
    recorded.look()
    assert said == []
    for dropped in (3, 4, 5):
        link.buffer.dropped = dropped
        recorded.look()
    assert len(said) == 1
    assert "lost 3 datagrams itself, not the link" in said[0]
    clock.advance_to(WARN_EVERY_S)
    recorded.look()
    recorded.look()
    assert len(said) == 2
    assert "lost 5 datagrams" in said[1]
    assert recorded.lost_here == 5
