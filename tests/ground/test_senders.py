"""Tables of senders stay bounded whoever makes up addresses, and who speaks keeps his place."""

import tracemalloc

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect
from soak import rest_in_soak

from bridge.framing import Encoder, Framer
from gcs_plugin.fleet import LINE_GONE_S, Fleet
from gcs_plugin.senders import GONE_S, MOST_SENDERS, Senders
from gcs_plugin.twins import Twins
from gcs_plugin.watch.watcher import Watcher

FULL, MORE = 3000, (4000, 10_000)
A_MEGABYTE = 1_000_000


class Line:
    """A link that only has a name."""

    def __init__(self, name="udpin:1"):
        self.name = name


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


def test_who_speaks_keeps_his_place_and_who_is_gone_leaves_it():
    senders = Senders()
    assert all(senders.put((n, 1), 0.0, n) for n in range(MOST_SENDERS))
    assert senders.put((7, 1), GONE_S, "still here")
    assert not senders.put((0, 2), GONE_S, "too many")
    assert senders.get((0, 2)) is None
    assert senders.heard_s((0, 2)) == float("-inf")
    assert all(senders.put((n, 2), GONE_S + 0.1, n) for n in range(MOST_SENDERS - 1))
    assert not senders.put((0, 3), GONE_S + 0.1, "too many")
    assert (senders.get((7, 1)), senders.heard_s((7, 1))) == ("still here", GONE_S)
    assert len(senders.items()) == MOST_SENDERS


def fleet():
    heard = Fleet()
    return lambda frame, time_s: heard.on_frame(frame, Line(), time_s)


def watcher():
    heard = Watcher(None)
    return lambda frame, time_s: heard.feed(frame, time_s, "udpin:1")


@pytest.mark.parametrize("more", rest_in_soak(MORE))
@pytest.mark.parametrize(
    "make", [fleet, watcher, lambda: Twins(Line()).on_frame], ids=["fleet", "watcher", "twins"]
)
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
        fleet.on_frame(frame, Line(), now_s)
    for _ in range(5):
        now_s += 1.0
        for frame in frames_of((1, 1)):
            fleet.on_frame(frame, Line(), now_s)
    fleet.choose(1, now_s)
    assert fleet.meant(now_s) == (1, 1)


def test_a_link_that_is_long_gone_is_told_of_no_more_and_holds_up_nobody():
    fleet = Fleet()
    for frame in frames_of((1, 1)):
        fleet.on_frame(frame, Line("tcp:old"), 0.0)
    for now_s in (1.0, LINE_GONE_S, LINE_GONE_S + 1.0):
        for frame in frames_of((1, 1)):
            fleet.on_frame(frame, Line("tcp:new"), now_s)
        told = [name for name, _ in fleet.sources(now_s)]
    assert told == ["tcp:new"]
    assert fleet.link_of((1, 1)) == "tcp:new"
    assert fleet.link_of((9, 9)) == ""
