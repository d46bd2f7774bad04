"""Links open by name or are refused in a sentence, and a serial port, TCP and memory carry every byte both ways."""

import socket

import pytest
from links_read import SOON_S, free_port, read_exactly

from bridge.errors import LinkError, LinkLost
from bridge.link.descriptor import BACKLOG_BYTES
from bridge.link.memory import memory_pair
from bridge.link.open import open_link
from bridge.link.pseudo import open_pty
from bridge.link.tcp import TcpServer, open_tcpin
from bridge.link.udp import UdpLink


@pytest.mark.parametrize(
    ("spec", "sentence"),
    [
        ("", "is not a link; give serial"),
        ("serial", "is not a link"),
        ("udp:127.0.0.1:14550", "is not a link"),
        ("udpin:127.0.0.1:none", "'none' is not a port number"),
        ("udpout:127.0.0.1:70000", "'70000' is not a port number"),
        ("tcp:127.0.0.1", "'127.0.0.1' is not a port number"),
        ("serial:/dev/ttyNowhere:115200", "there is no port /dev/ttyNowhere; check"),
        ("serial:/dev/null", "check that it is a serial port"),
        ("udpout:no-such-host.invalid:1", "the host 'no-such-host.invalid' is unknown"),
        ("udpin:192.0.2.1:14550", "this computer has no address 192.0.2.1; it has 127.0.0.1"),
        ("udpin:192.0.2.1:14550", "or udpout:192.0.2.1:14550 where 192.0.2.1 is the other side"),
        ("tcpin:192.0.2.1:5760", "or tcp:192.0.2.1:5760 where"),
        ("udpin:no-such-host.invalid:1", "the host 'no-such-host.invalid' is unknown"),
    ],
)
def test_a_link_that_cannot_be_is_refused_in_one_sentence(spec: str, sentence: str) -> None:
    with pytest.raises(LinkError) as caught:
        open_link(spec)
    assert sentence in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_refused_connection_and_a_taken_port_are_named() -> None:
    with pytest.raises(LinkError, match="refused, nobody listens there"):
        open_link(f"tcp:127.0.0.1:{free_port(socket.SOCK_STREAM)}")
    for kind in ("udpin", "tcpin"):
        first = open_link(f"{kind}:127.0.0.1:0")
        assert isinstance(first, UdpLink | TcpServer)
        with pytest.raises(LinkError, match="Address already in use"):
            open_link(f"{kind}:127.0.0.1:{first.port}")
        first.close()


@pytest.mark.parametrize("kind", ["udpin", "tcpin"])
def test_a_link_without_a_host_listens_on_this_computer_alone(kind: str) -> None:
    link = open_link(f"{kind}::0")
    sock = link._socket if isinstance(link, UdpLink) else link._listener  # type: ignore[attr-defined]
    assert sock.getsockname()[0] == "127.0.0.1"
    link.close()


def test_tcp_carries_both_ways_and_the_next_peer_is_served_when_one_leaves() -> None:
    server = open_tcpin("127.0.0.1", 0)
    assert server.read(0.0) == b""
    server.write(b"to nobody")
    for word in (b"first", b"second"):
        client = open_link(f"tcp:127.0.0.1:{server.port}")
        client.write(word)
        assert read_exactly(server, len(word)) == word
        server.write(word.upper())
        assert read_exactly(client, len(word)) == word.upper()
        client.close()
        assert server.read(SOON_S) == b""
    server.close()
    with pytest.raises(LinkLost):
        server.read(0.0)


def test_a_tcp_peer_that_goes_away_is_a_lost_link() -> None:
    server = open_tcpin("127.0.0.1", 0)
    client = open_link(f"tcp:127.0.0.1:{server.port}")
    client.write(b"x")
    assert read_exactly(server, 1) == b"x"
    server.close()
    with pytest.raises(LinkLost, match="the other side has gone"):
        client.read(SOON_S)
    client.close()


def test_a_serial_port_carries_every_byte_and_is_held_by_one_program() -> None:
    device, path = open_pty()
    port = open_link(f"serial:{path}:115200")
    every = bytes(range(256))
    device.write(every)
    assert read_exactly(port, 256) == every
    port.write(every)
    assert read_exactly(device, 256) == every
    assert port.read(0.0) == b""
    with pytest.raises(LinkError, match="another program holds the port"):
        open_link(f"serial:{path}:115200")
    port.close()
    open_link(f"serial:{path}").close()
    device.close()


def test_a_port_that_is_unplugged_is_lost_with_a_sentence() -> None:
    device, path = open_pty()
    port = open_link(f"serial:{path}:115200")
    device.close()
    with pytest.raises(LinkLost, match=r"the other side has gone.*plug it in"):
        port.read(SOON_S)
    with pytest.raises(LinkLost):
        port.write(b"x")
    port.close()
    with pytest.raises(LinkLost, match="closed"):
        port.read(0.0)


def test_a_peer_that_takes_nothing_never_stalls_the_writer() -> None:
    device, path = open_pty()
    chunk = bytes(1000)
    for _ in range(2 * BACKLOG_BYTES // 1000):
        device.write(chunk)
    assert device.counts["dropped"] > 20
    port = open_link(f"serial:{path}")
    device.write(b"end")
    port.close()
    device.close()


def test_memory_carries_chunks_in_order_and_notices_the_other_end_closing() -> None:
    a, b = memory_pair()
    a.write(b"one")
    a.write(b"two")
    assert (b.read(0.0), b.read(0.0), b.read(0.0)) == (b"one", b"two", b"")
    a.write(b"last words")
    a.close()
    assert b.read(0.0) == b"last words"
    with pytest.raises(LinkLost):
        b.read(1.0)
    with pytest.raises(LinkLost):
        b.write(b"x")
