"""How soon the app shows that a link is lost, or that a value has gone stale."""

import math

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mav

from bridge.clock import SimulatedClock
from bridge.wire.framing import Encoder, Framer
from bridge.wire.readings import Reading, encode
from gcs_plugin.watch.picture import Freshness
from gcs_plugin.watch.watcher import Watcher
from tui.app.header import pieces
from tui.app.station import Station
from tui.app.view import aged

TURN_S, REFRESH_S = 0.05, 0.25
SIGNALS = {
    "imu": (0.0, 0.0, -9.81, 0.0, 0.0, 0.05, 20.0),
    "dvl": (0.3, 0.0, 0.0, 0.01),
    "attitude": (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.05),
    "pressure": (130000.0, 12.0),
    "battery": (15.9, 12.0),
}


class Silenced:
    """A vehicle that says all of it twenty times a second, and beats once, until `silent_s`."""

    def __init__(self, clock, silent_s):
        self.trouble, self.clock, self.silent_s = "", clock, silent_s
        self.last_s, self.beat_s, self.encoder, self.framer = {}, -math.inf, Encoder(1, 1), Framer()

    def frames(self):
        now_s, raw = self.clock.now_s, b""
        if now_s < self.silent_s:
            for name, values in SIGNALS.items():
                self.last_s[name] = now_s
                raw += self.encoder.frame(*encode(Reading(name, now_s, values)))
            if now_s >= self.beat_s + 1.0:
                self.beat_s = now_s
                raw += self.encoder.encode(mav.MAVLink_heartbeat_message(12, 0, 0, 0, 4, 3))
        return [(now_s, "link", frame) for frame in self.framer.feed(raw)]

    def send(self, data):
        pass

    def close(self):
        pass


class Looked:
    """What the app showed at each of its refreshes, the first of them `first_s` after the start."""

    def __init__(self, first_s):
        self.clock = SimulatedClock()
        self.vehicle, self.watcher = Silenced(self.clock, 8.13), Watcher(None)
        station = Station(self.vehicle, self.watcher, self.clock, lambda _: None, lambda: None, REFRESH_S)
        self.views, due_s = [], first_s
        while self.clock.now_s < 60.0:
            self.clock.advance_to(self.clock.now_s + TURN_S)
            station.turn()
            if self.clock.now_s >= due_s:
                due_s += REFRESH_S
                view = station.view()
                self.views.append((self.clock.now_s, view, aged(view.picture, view.behind_s)))

    def lost_s(self):
        """When the top line first said that the link is lost."""
        return next(
            at_s
            for at_s, view, _ in self.views
            if any("LINK LOST" in form for piece in pieces(view) for form in piece.forms)
        )

    def marked_s(self, signal):
        """When the value was no longer shown as a fresh one, after it had been."""
        shown = [
            (at_s, row.freshness)
            for at_s, _, picture in self.views
            for row in picture.sensors
            if row.signal == signal and at_s > self.vehicle.silent_s
        ]
        return next(at_s for at_s, freshness in shown if freshness is not Freshness.FRESH)

    def limit_s(self, signal):
        """When it went stale, by pictures that are made every hundredth of a second."""
        for n in range(6000):
            at_s = self.vehicle.last_s[signal] + n / 100
            (row,) = [row for row in self.watcher.picture(at_s).sensors if row.signal == signal]
            if row.freshness is not Freshness.FRESH:
                return at_s
        raise AssertionError(f"{signal} never goes stale")


@pytest.fixture(scope="module", params=[0.0, 0.07, 0.13, 0.24])
def looked(request):
    return Looked(request.param)


def test_a_lost_link_is_told_within_three_and_a_half_seconds_of_the_last_heartbeat(looked):
    assert 3.0 < looked.lost_s() - looked.vehicle.beat_s <= 3.5


@pytest.mark.parametrize("signal", SIGNALS)
def test_a_value_is_marked_within_a_second_of_going_stale(looked, signal):
    limit_s = looked.limit_s(signal)
    assert limit_s - 0.01 <= looked.marked_s(signal) <= limit_s + 1.0
