"""`seatrial watch` by way of a recording: it outlives it, waits for the next, and tells the age of what it hears."""

import threading
from dataclasses import replace

import pytest
from vehicle_on_air import heartbeat

from bridge.clock import SimulatedClock
from bridge.errors import LinkLost
from bridge.framing import Encoder
from gcs_plugin.recording.state import Holding
from gcs_plugin.watch.watcher import Watcher
from tui import links, watched
from tui.commands.watch import Look

SPEC = "udpin:127.0.0.1:14550"
FIRST, SECOND = "tcp:127.0.0.1:40001", "tcp:127.0.0.1:40002"
HOLDING = Holding(7, FIRST, (SPEC,), "dives/a", "2026-11-20T09:12:03Z", 1, 1, 0, 7200.0, (), 0.0)


class Switched:
    """A link that beats at each read while it is `on`, is lost where it is not, and counts its reads."""

    def __init__(self, name, encoder):
        self.name, self._encoder, self.on, self.reads = name, encoder, True, 0

    def read(self, timeout_s):
        del timeout_s
        if not self.on:
            raise LinkLost(f"{self.name}: the other side has gone")
        self.reads += 1
        return self._encoder.encode(heartbeat())

    def close(self):
        self.on = False


class Ground:
    """This computer: a recording that runs or does not, the hubs that can be opened, and the vehicle's own port."""

    def __init__(self, monkeypatch):
        self.clock, encoder = SimulatedClock(), Encoder(1, 1)
        self.holding = HOLDING
        self.links = {name: Switched(name, encoder) for name in (FIRST, SECOND, SPEC)}
        self.opened = []
        monkeypatch.setattr(links, "holding_now", lambda: self.holding)
        monkeypatch.setattr("bridge.link.open.open_link", self.open)

    def open(self, name):
        self.opened.append(name)
        return self.links[name]

    def turn(self, link, turns=100):
        """What is read by then; 0.1 s a turn."""
        data = b""
        for _ in range(turns):
            data += link.read(0.01)
            self.clock.advance_to(self.clock.now_s + 0.1)
        return data


@pytest.fixture
def ground(monkeypatch):
    return Ground(monkeypatch)


@pytest.mark.parametrize("spec", [None, SPEC])
def test_it_waits_for_the_next_recording_and_leaves_the_vehicles_own_port_to_it(ground, spec):
    link = links.coming_back(links.link_for(spec), spec, ground.clock)
    assert ground.turn(link, 3)
    ground.holding, ground.links[FIRST].on = None, False
    assert not ground.turn(link)
    assert "start `seatrial record`" in link.fault
    ground.holding = replace(HOLDING, hub=SECOND)
    assert ground.turn(link)
    assert ground.opened == [FIRST, SECOND]
    link.close()


def test_a_link_of_its_own_is_opened_again(ground):
    ground.holding = None
    link = links.coming_back(links.link_for(SPEC), SPEC, ground.clock)
    assert ground.turn(link, 3)
    ground.links[SPEC].on = False
    ground.turn(link, 1)
    ground.links[SPEC].on = True
    assert ground.turn(link)
    assert set(ground.opened) == {SPEC}
    link.close()


def test_why_nothing_comes_is_told(ground):
    link = links.coming_back(links.link_for(None), None, ground.clock)
    looked, stop = Look(link, Watcher(None), ground.clock), threading.Event()
    read = link.read

    def scripted(timeout_s):
        ground.clock.advance_to(ground.clock.now_s + timeout_s)
        if ground.clock.now_s > 2.0:
            ground.holding, ground.links[FIRST].on = None, False
        if ground.clock.now_s > 12.0:
            stop.set()
        return read(0.01)

    link.read = scripted
    looked.listen(stop)
    line = watched.line(looked.picture, None, looked.fault)
    assert line.startswith("DISARMED 10 s ago | LINK LOST 10 s  sys 1/1 | ")
    assert line.endswith(
        "NOT RECORDING | no recording runs that could be listened to; start `seatrial record`"
    )
    link.close()


def test_the_next_recording_leaves_no_lost_link_behind(ground):
    link = links.coming_back(links.link_for(None), None, ground.clock)
    looked, stop = Look(link, Watcher(None), ground.clock), threading.Event()
    read = link.read

    def scripted(timeout_s):
        now_s = ground.clock.now_s
        ground.clock.advance_to(now_s + timeout_s)
        if now_s > 5.0 and ground.holding.hub == FIRST:
            ground.links[FIRST].on, ground.holding = False, replace(HOLDING, hub=SECOND)
        if ground.links[SECOND].reads == 20:
            stop.set()
        return read(0.01)

    link.read = scripted
    looked.listen(stop)
    (row,) = looked.picture.links
    assert not row.lost
    assert row.age_s < 1.0
    assert looked.fault == ""
    link.close()
