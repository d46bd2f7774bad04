"""Replay on the recorded clock."""

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.clock import SimulatedClock
from bridge.errors import LogError
from bridge.framing import Encoder, Framer
from gcs_plugin.dives.replay import Pace, Player, schedule


def records_at(times_s):
    encoder, framer = Encoder(1, 1), Framer()
    frames = framer.feed(b"".join(encoder.encode(dialect.MAVLink_system_time_message(0, 1)) for _ in times_s))
    return [(round(1e15 + t * 1e6), frame) for t, frame in zip(times_s, frames, strict=True)]


class SlowClock(SimulatedClock):
    """Sleeps a little longer than asked, as computers do."""

    overshoot_s = 0.003

    def wait(self, seconds):
        self.advance_to(self.now_s + seconds + self.overshoot_s)


def played(times_s, pace, clock):
    return [clock.now_s for _ in Player(records_at(times_s), clock, clock.wait, pace)]


def test_no_delay_adds_up_over_a_long_recording():
    clock = SlowClock()
    heard_s = played([n * 0.05 for n in range(2000)], Pace(), clock)
    assert max(abs(heard - n * 0.05) for n, heard in enumerate(heard_s)) < 0.0031


@pytest.mark.parametrize("speed", [0.5, 1.0, 10.0])
def test_speed_scales_the_recorded_clock(speed):
    assert [due for due, _ in schedule(records_at([0, 1, 3]), Pace(speed))] == [0, 1 / speed, 3 / speed]


def test_a_replay_can_start_anywhere():
    found = list(schedule(records_at([0, 1, 2, 3]), Pace(start_s=1.5)))
    assert [due for due, _ in found] == [0, 1]


def test_long_gaps_are_clipped_and_stamps_that_run_back_are_due_at_once():
    assert [due for due, _ in schedule(records_at([0, 100, 99, 101]), Pace(longest_gap_s=2.0))] == [
        0,
        2,
        2,
        4,
    ]


def test_a_pause_stops_the_recorded_clock():
    clock = SlowClock()
    clock.overshoot_s = 0.0
    player = Player(records_at([0, 1, 2]), clock, clock.wait)
    heard_s = []
    wait = player._wait

    def wait_and_resume(seconds):
        wait(seconds)
        if player.paused and clock.now_s >= 6.0:
            player.resume()

    player._wait = wait_and_resume
    for index, _ in enumerate(player):
        heard_s.append(clock.now_s)
        if index == 1:
            player.pause()
    assert heard_s[:2] == pytest.approx([0.0, 1.0])
    assert heard_s[2] == pytest.approx(7.0, abs=0.11)


@pytest.mark.parametrize("pace", [{"speed": 0.0}, {"speed": float("nan")}, {"longest_gap_s": 0.0}])
def test_an_impossible_pace_is_refused(pace):
    with pytest.raises(LogError):
        Pace(**pace)
