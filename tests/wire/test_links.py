"""Links by name, lossy links, and links that come back."""

import errno
import random
import socket
import termios
import threading

import pytest
from fakes.lossy import Lossy
from fakes.ports import free_port, open_pty
from fakes.vehicle import FakeLink
from links_read import SOON_S, read_exactly

from bridge.clock import SimulatedClock
from bridge.errors import LinkError, LinkLost
from bridge.links.descriptor import open_tcpin
from bridge.links.link import Link, memory_pair
from bridge.links.open import open_link
from bridge.links.reconnecting import Aside, Reconnecting, next_retry_s
from bridge.signing.link import KeylessLink
from bridge.wire.framing import Encoder, Framer


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
        ("serial:/dev/ptmx:99999999999", "check the baud rate"),
        ("udpout:no-such-host.invalid:1", "the host 'no-such-host.invalid' is unknown"),
        ("udpin:192.0.2.1:14550", "this computer has no address 192.0.2.1; it has 127.0.0.1"),
        ("udpin:192.0.2.1:14550", "or udpout:192.0.2.1:14550 where 192.0.2.1 is the other side"),
        ("tcpin:192.0.2.1:5760", "or tcp:192.0.2.1:5760 where"),
        ("udpin:no-such-host.invalid:1", "the host 'no-such-host.invalid' is unknown"),
        ("tcp:192.168.2..1:5760", "'192.168.2..1' can't be a host's name or address"),
        (f"udpout:{'a' * 64}:14550", "can't be a host's name or address"),
    ],
)
def test_a_link_that_cannot_be_is_refused_in_one_sentence(spec, sentence):
    with pytest.raises(LinkError) as caught:
        open_link(spec)
    assert sentence in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("kind", ["udpin", "udpout", "tcp", "tcpin"])
def test_a_computer_that_has_no_socket_left_says_so(kind, monkeypatch):
    def none_left(*_):
        raise OSError(errno.EMFILE, "Too many open files")

    monkeypatch.setattr(socket, "socket", none_left)
    with pytest.raises(LinkError, match="Too many open files"):
        open_link(f"{kind}:127.0.0.1:14550")


def test_a_refused_connection_and_a_taken_port_are_named():
    with pytest.raises(LinkError, match="refused, nobody listens there"):
        open_link(f"tcp:127.0.0.1:{free_port()}")
    for kind in ("udpin", "tcpin"):
        first = open_link(f"{kind}:127.0.0.1:0")
        with pytest.raises(LinkError, match="Address already in use"):
            open_link(f"{kind}:127.0.0.1:{first.port}")
        first.close()


def test_tcp_carries_both_ways_and_the_next_peer_is_served_when_one_leaves():
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


def test_a_tcp_peer_that_goes_away_is_a_lost_link():
    server = open_tcpin("127.0.0.1", 0)
    client = open_link(f"tcp:127.0.0.1:{server.port}")
    client.write(b"x")
    assert read_exactly(server, 1) == b"x"
    server.close()
    with pytest.raises(LinkLost, match="the other side has gone"):
        client.read(SOON_S)
    client.close()


@pytest.mark.skipif(not hasattr(socket, "TCP_USER_TIMEOUT"), reason="of Linux")
def test_a_tcp_peer_whose_cable_was_pulled_is_lost_within_ten_seconds_though_data_wait_for_it(monkeypatch):
    """Data that nobody acknowledges are otherwise sent again for a quarter of an hour, and the next peer of a server
    waits for so long."""
    limits = []
    option = socket.socket.setsockopt

    def notes(sock, level, name, value):
        option(sock, level, name, value)
        if (level, name) == (socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT):
            limits.append(sock.getsockopt(level, name))

    monkeypatch.setattr(socket.socket, "setsockopt", notes)
    server = open_tcpin("127.0.0.1", 0)
    client = open_link(f"tcp:127.0.0.1:{server.port}")
    client.write(b"here")
    assert read_exactly(server, 4) == b"here"
    assert limits == [10_000, 10_000]
    client.close()
    server.close()


def test_a_serial_port_carries_every_byte_and_is_held_by_one_program():
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


def test_a_port_that_is_unplugged_is_lost_with_a_sentence():
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


@pytest.mark.parametrize("step", ["tcsetattr", "tcflush"])
def test_a_port_that_is_unplugged_while_it_is_opened_is_tried_again(step, monkeypatch):
    device, path = open_pty()
    clock = SimulatedClock()
    link = Reconnecting(lambda: open_link(f"serial:{path}"), clock)
    with monkeypatch.context() as unplugged:

        def fails(*_):
            raise termios.error(5, "Input/output error")

        unplugged.setattr(termios, step, fails)
        assert link.read(0.0) == b""
        assert "can't be set up (Input/output error); check the cable" in link.fault
    clock.advance_to(1.0)
    link.write(b"here")
    assert (link.fault, read_exactly(device, 4)) == ("", b"here")
    link.close()
    device.close()


def test_a_peer_that_takes_nothing_never_stalls_the_writer():
    device, path = open_pty()
    chunk = bytes(1000)
    for _ in range(131):
        device.write(chunk)
    assert device.dropped > 20
    port = open_link(f"serial:{path}")
    device.write(b"end")
    port.close()
    device.close()


def test_no_more_waits_for_a_slow_serial_port_than_it_carries_in_a_second():
    """What waited longer would look new to a crew that goes by the time of arrival."""
    for baud, most in ((57600, 5760), (115200, 11520)):
        device, path = open_pty()
        port = open_link(f"serial:{path}:{baud}")
        for _ in range(400):
            port.write(bytes(500))
        waiting = (400 - port.lost_writes) * 500
        while taken := device.read(0.05):
            waiting -= len(taken)
        assert most - 500 < waiting <= most
        port.close()
        device.close()


def test_writes_that_a_slow_peer_lost_are_counted_also_around_a_link_and_after_it_was_opened_again():
    devices = [open_pty(), open_pty()]
    paths = iter([path for _, path in devices])
    clock = SimulatedClock()
    link = Reconnecting(lambda: KeylessLink(open_link(f"serial:{next(paths)}:57600"), print), clock)
    counted = []
    for device, _ in devices:
        for _ in range(400):
            link.write(bytes(500))
        counted.append(link.lost_writes)
        device.close()
        while not link.fault:
            link.read(0.01)
        clock.advance_to(clock.now_s + 5.0)
    assert counted[0] > 50
    assert counted[1] > counted[0] + 50
    assert link.dropped == 0


def test_memory_carries_chunks_in_order_and_notices_the_other_end_closing():
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


def frames(count):
    encoder = Encoder(1, 1)
    return [encoder.frame(0, bytes((i, 2, 3, 4, 5, 6, 7, 8, 9))) for i in range(count)]


def drain(link):
    data = b""
    while more := link.read(0.0):
        data += more
    return data


@pytest.mark.parametrize(
    ("fault", "low", "high"),
    [("loss", 120, 160), ("duplicate", 240, 280), ("corrupt", 120, 160), ("reorder", 200, 200)],
)
def test_a_lossy_link_loses_doubles_damages_and_reorders_frames_at_its_rate_both_ways(fault, low, high):
    clock, sent = SimulatedClock(), frames(200)
    near, far = memory_pair()
    lossy = Lossy(near, random.Random(2), clock, **{fault: 0.3})
    for raw in sent:
        lossy.write(raw)
        far.write(raw)
    back = [lossy.read(0.0) for _ in sent]
    clock.advance_to(1.0)
    back.append(lossy.read(0.0))
    for data in (drain(far), b"".join(back)):
        arrived = [frame.raw for frame in Framer().feed(data) if frame.known]
        assert low <= len(arrived) <= high
        assert set(arrived) <= set(sent)
        assert (arrived != sorted(arrived, key=sent.index)) is (fault == "reorder")


def test_a_lossy_link_delays_and_its_switches_work_while_it_runs():
    clock, (raw,) = SimulatedClock(), frames(1)
    near, far = memory_pair()
    lossy = Lossy(near, random.Random(2), clock, delay_s=0.2)
    lossy.write(raw)
    for time_s, heard in ((0.1, b""), (0.2, raw)):
        clock.advance_to(time_s)
        lossy.read(0.0)
        assert drain(far) == heard
    lossy.outgoing.delay_s = 0.0
    for cut, heard in ((True, b""), (False, raw)):
        lossy.outgoing.cut = cut
        lossy.write(raw)
        assert drain(far) == heard


class Plug:
    """A link factory with a switch."""

    def __init__(self):
        self.plugged = False
        self.device: Link | None = None
        self.opened = 0

    def open(self):
        if not self.plugged:
            raise LinkError("there is no port")
        self.opened += 1
        mine, self.device = memory_pair()
        return mine

    def unplug(self):
        self.plugged = False
        self.device.close()


def test_a_port_comes_back_within_three_seconds_a_hundred_times():
    clock, plug, said = SimulatedClock(), Plug(), list[str]()
    link = Reconnecting(plug.open, clock, "port", said.append)
    for cycle in range(100):
        assert link.read(0.0) == b""
        link.write(b"lost")
        assert "port" in link.fault or "other end" in link.fault
        for _ in range(20 + cycle):
            clock.advance_to(clock.now_s + 1.01)
            assert link.read(0.0) == b""
        plug.plugged = True
        back_s = clock.now_s
        while plug.opened == cycle:
            clock.advance_to(clock.now_s + 0.1)
            assert link.read(0.0) == b""
        assert clock.now_s - back_s <= 3.0
        plug.device.write(b"again")
        assert (link.read(0.0), link.fault) == (b"again", "")
        plug.unplug()
    link.close()
    clock.advance_to(clock.now_s + 60)
    plug.plugged = True
    assert link.read(0.0) == b""
    assert plug.opened == 100
    (sentence,) = said
    assert "other end" in sentence


def test_what_is_written_while_a_port_is_away_is_counted():
    clock, plug = SimulatedClock(), Plug()
    link = Reconnecting(plug.open, clock, "port")
    for _ in range(3):
        link.write(b"lost")
    plug.plugged = True
    clock.advance_to(3.0)
    link.write(b"arrives")
    assert link.dropped == 3
    plug.unplug()
    link.write(b"lost")
    assert link.dropped == 4


def test_a_lost_port_is_let_go_before_it_is_opened_again():
    ports: list[FakeLink] = []

    def opened():
        assert all(port.closed for port in ports)
        ports.append(FakeLink("port", reads_fail=True))
        return ports[-1]

    clock = SimulatedClock()
    link = Reconnecting(opened, clock)
    for _ in range(3):
        link.read(0.0)
        clock.advance_to(clock.now_s + 3.0)
    assert [port.closed for port in ports] == [True] * 3


def test_the_pause_between_tries_doubles_up_to_a_second():
    pauses = [0.25]
    while len(pauses) < 6:
        pauses.append(next_retry_s(pauses[-1]))
    assert pauses == [0.25, 0.5, 1.0, 1.0, 1.0, 1.0]


def test_nobody_waits_for_a_network_that_takes_its_time_to_connect():
    answered, near = threading.Event(), memory_pair()[0]

    def slow():
        assert answered.wait(60.0)
        return near

    aside = Aside(slow, "tcp:far:1")
    for _ in range(3):
        with pytest.raises(LinkError, match="tcp:far:1: is being opened"):
            aside()
    answered.set()
    assert opened(aside) is near


def test_why_a_link_could_not_be_opened_aside_is_said_until_it_is():
    attempts: list[Link | Exception] = [
        LinkError("tcp:far:1: refused"),
        OSError("the adapter has gone"),
        ValueError("no such baud rate"),
        memory_pair()[0],
    ]

    def factory():
        attempt = attempts.pop(0)
        if isinstance(attempt, Exception):
            raise attempt
        return attempt

    said: list[str] = []
    assert opened(Aside(factory, "tcp:far:1"), said).name == "memory:a"
    assert "tcp:far:1: refused" in said
    for why in "the adapter has gone", "no such baud rate":
        assert f"tcp:far:1: can't be opened ({why}); check the link and its name" in said


def opened(aside, said=None):
    for _ in range(500):
        try:
            return aside()
        except LinkError as error:
            if said is not None:
                said.append(str(error))
    raise AssertionError("it was never opened")
