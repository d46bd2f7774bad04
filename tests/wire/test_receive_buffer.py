"""What this computer loses in its own socket is counted, and told as its own loss."""

import socket
import sys
from collections.abc import Iterator

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.clock import SimulatedClock
from bridge.framing import Encoder, Framer
from bridge.link.receive_buffer import ASKED_BYTES, ReceiveBuffer
from bridge.link.udp import UdpLink
from gcs_plugin.recording.link import TOLD_EVERY_S, RecordedLink

SENT = 2000
linux = pytest.mark.skipif(sys.platform != "linux", reason="the system does not count")


@pytest.fixture
def ends() -> Iterator[tuple[UdpLink, socket.socket]]:
    """A link whose socket has the smallest buffer, and who sends to it."""
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ground,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as vehicle,
    ):
        ground.bind(("127.0.0.1", 0))
        link = UdpLink("udpin:", ground, None)
        link.buffer = ReceiveBuffer(ground, 2048)
        vehicle.connect(ground.getsockname())
        yield link, vehicle


def frames(count: int) -> list[bytes]:
    encoder = Encoder(1, 1)
    return [encoder.encode(dialect.MAVLink_system_time_message(0, n)) for n in range(count)]


def test_a_read_gives_all_datagrams_that_are_there_in_order() -> None:
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ground,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as vehicle,
    ):
        ground.bind(("127.0.0.1", 0))
        link = UdpLink("udpin:", ground, None)
        sent = frames(100)
        for raw in sent:
            vehicle.sendto(raw, ground.getsockname())
        assert link.read(5.0) == b"".join(sent)
        assert link.read(0.0) == b""
        assert link.buffer.words == ""


@linux
def test_every_datagram_arrived_or_is_counted_as_lost_here(ends: tuple[UdpLink, socket.socket]) -> None:
    link, vehicle = ends
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


def test_a_system_that_gives_less_than_was_asked_for_is_told_with_what_to_do() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        buffer = ReceiveBuffer(sock)
        assert 0 < buffer.given_bytes <= ASKED_BYTES
        buffer.given_bytes, buffer.dropped = 212992, 7
        assert "lost 7 datagrams itself, not the link" in buffer.words
        assert "208 of 4096 KiB" in buffer.words
        assert f"net.core.rmem_max={ASKED_BYTES}" in buffer.words
        buffer.given_bytes = ASKED_BYTES
        assert "sysctl" not in buffer.words


def test_what_this_computer_lost_is_told_at_once_and_then_now_and_then(
    ends: tuple[UdpLink, socket.socket],
) -> None:
    link, _ = ends
    clock, said = SimulatedClock(), list[str]()
    recorded = RecordedLink(link, clock, lambda _, words: said.append(words))
    recorded.look()
    assert said == []
    for dropped in (3, 4, 5):
        link.buffer.dropped = dropped
        recorded.look()
    assert len(said) == 1
    assert "lost 3 datagrams itself, not the link" in said[0]
    clock.advance_to(TOLD_EVERY_S)
    recorded.look()
    recorded.look()
    assert len(said) == 2
    assert "lost 5 datagrams" in said[1]
    assert recorded.lost_here == 5
