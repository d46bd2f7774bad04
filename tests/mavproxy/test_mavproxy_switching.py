"""Switching the feed-forward from MAVProxy, by itself: what the vehicle says between the question and the answer."""

import pytest

from bridge.clock import SimulatedClock
from bridge.wire.framing import Encoder, Framer
from bridge.wire.readings import Reading, encode
from gcs_plugin.fleet import Fleet

switching = pytest.importorskip("gcs_plugin.mavproxy.switching", reason="MAVProxy is not installed")


class Ground:
    """MAVProxy with a vehicle of system 1 that beats and says its mode."""

    def __init__(self):
        self.clock, self.fleet, self.said = SimulatedClock(), Fleet(), []
        self.switching = switching.Switching(self.fleet, self.clock, self.said.append)
        self._encoder, self._framer = Encoder(1, 1), Framer()

    def hear(self, mode, seconds=3):
        """The messages that are sent meanwhile."""
        sent = []
        for _ in range(seconds):
            self.clock.advance_to(self.clock.now_s + 1.0)
            for signal, values in (("alive", (0.0, 12.0, 0.0)), ("ff_mode", (mode,))):
                raw = self._encoder.frame(*encode(Reading(signal, self.clock.now_s, values)))
                for frame in self._framer.feed(raw):
                    self.fleet.on_frame(frame, "link", self.clock.now_s)
                    self.switching.on_frame(frame)
            sent += self.switching.tick()
        return [message for message in sent if message.get_type() == "PARAM_SET"]


@pytest.fixture
def ground(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    return Ground()


def test_a_mode_is_not_sent_to_a_vehicle_that_another_ground_switched_off_before_the_answer(ground):
    ground.hear(1.0)
    ground.switching.command(["both"])
    ground.hear(0.0)
    ground.switching.command(["yes", "both"])
    assert ground.hear(0.0) == []
    assert "it says off after shadow, as if another has switched it" in ground.said[-1]


def test_a_mode_that_a_vehicle_says_no_more_is_dated(ground):
    ground.hear(1.0)
    assert ground.switching.mode_words(1) == "feed-forward shadow"
    ground.clock.advance_to(ground.clock.now_s + 60.0)
    assert ground.switching.mode_words(1) == "feed-forward shadow 60 s ago"
    assert ground.switching.mode_words(2) == ""


@pytest.mark.parametrize("mode", [0.0, 1.0])
def test_a_mode_is_sent_where_the_vehicle_is_in_the_mode_that_it_was_in(ground, mode):
    ground.hear(mode)
    ground.switching.command(["both"])
    ground.switching.command(["yes", "both"])
    assert [message.param_value for message in ground.hear(mode)] == [3.0] * 3
