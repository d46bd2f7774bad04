"""A link that is away comes back, is let go before, leaks nothing, and holds nobody up while it opens."""

import os
import threading

import pytest
from links_read import SOON_S, read_exactly

from bridge.clock import SimulatedClock
from bridge.errors import LinkError, LinkLost
from bridge.link.base import Link
from bridge.link.memory import memory_pair
from bridge.link.open import open_link
from bridge.link.pseudo import open_pty
from bridge.link.reconnecting import Aside, Reconnecting, next_retry_s


class Plug:
    """A link factory with a switch."""

    def __init__(self) -> None:
        self.plugged = False
        self.device: Link | None = None
        self.opened = 0

    def open(self) -> Link:
        if not self.plugged:
            raise LinkError("there is no port")
        self.opened += 1
        mine, self.device = memory_pair()
        return mine

    def unplug(self) -> None:
        self.plugged = False
        assert self.device is not None
        self.device.close()


def test_a_port_comes_back_within_three_seconds_a_hundred_times() -> None:
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
        assert plug.device is not None
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


def test_what_is_written_while_a_port_is_away_is_counted() -> None:
    clock, plug = SimulatedClock(), Plug()
    link = Reconnecting(plug.open, clock, "port")
    for _ in range(3):
        link.write(b"lost")
    plug.plugged = True
    clock.advance_to(3.0)
    link.write(b"arrives")
    assert link.counts["dropped"] == 3
    plug.unplug()
    link.write(b"lost")
    assert link.counts["dropped"] == 4


def test_a_lost_port_is_let_go_before_it_is_opened_again() -> None:
    events: list[str] = []

    class Port:
        name = "port"

        def read(self, timeout_s: float) -> bytes:
            del timeout_s
            raise LinkLost("gone")

        def write(self, data: bytes) -> None: ...

        def close(self) -> None:
            events.append("close")

    def opened() -> Link:
        events.append("open")
        return Port()

    clock = SimulatedClock()
    link = Reconnecting(opened, clock)
    for _ in range(3):
        link.read(0.0)
        clock.advance_to(clock.now_s + 3.0)
    assert events == ["open", "close"] * 3


def test_plugging_in_a_hundred_times_leaks_no_handle() -> None:
    clock = SimulatedClock()
    ports: list[str] = []
    link = Reconnecting(lambda: open_link(f"serial:{ports[-1]}"), clock)
    before = len(os.listdir("/proc/self/fd")) if os.path.isdir("/proc/self/fd") else 0
    for _ in range(100):
        device, path = open_pty()
        ports.append(path)
        clock.advance_to(clock.now_s + 3.0)
        assert link.read(0.0) == b""
        device.write(b"x")
        assert read_exactly(link, 1) == b"x"
        device.close()
        assert link.read(SOON_S) == b""
        assert "gone" in link.fault
    link.close()
    assert (len(os.listdir("/proc/self/fd")) if before else 0) == before


def test_the_pause_between_tries_doubles_up_to_a_second() -> None:
    pauses = [0.25]
    while len(pauses) < 6:
        pauses.append(next_retry_s(pauses[-1]))
    assert pauses == [0.25, 0.5, 1.0, 1.0, 1.0, 1.0]


def test_nobody_waits_for_a_network_that_takes_its_time_to_connect() -> None:
    answered, near = threading.Event(), memory_pair()[0]

    def slow() -> Link:
        assert answered.wait(10.0)
        return near

    aside = Aside(slow, "tcp:far:1")
    for _ in range(3):
        with pytest.raises(LinkError, match="tcp:far:1: is being opened"):
            aside()
    answered.set()
    assert opened(aside) is near


def test_why_a_link_could_not_be_opened_aside_is_said_until_it_is() -> None:
    attempts: list[Link | LinkError] = [LinkError("tcp:far:1: refused"), memory_pair()[0]]

    def factory() -> Link:
        attempt = attempts.pop(0)
        if isinstance(attempt, LinkError):
            raise attempt
        return attempt

    said: list[str] = []
    assert opened(Aside(factory, "tcp:far:1"), said).name == "memory:a"
    assert "tcp:far:1: refused" in said


def opened(aside: Aside, said: list[str] | None = None) -> Link:
    for _ in range(500):
        try:
            return aside()
        except LinkError as error:
            if said is not None:
                said.append(str(error))
    raise AssertionError("it was never opened")
