"""How old an ArduPilot's pressure is when it is sent, by the DVL beside it."""

import numpy as np
import pytest
from built_recordings import Stamped, array, attitude, heartbeat, recording, servos, write
from pymavlink.dialects.v20 import ardupilotmega as mav

from identify.dive import Signal
from identify.ingest.mavlink.held_pressure import OLDEST_S, age_s, dated
from identify.ingest.open import read_dive

PA_PER_M = 10_050.0
PITCH_RAD = 0.3
AT_REST = np.array([np.cos(PITCH_RAD / 2), 0.0, np.sin(PITCH_RAD / 2), 0.0])


def down_m_s(time_s):
    return 0.2 * np.sin(2 * np.pi * time_s / 4.0)


def depth_m(time_s):
    return 8.0 - 0.2 * 4.0 / (2 * np.pi) * np.cos(2 * np.pi * time_s / 4.0)


def pitched(size=1.0):
    """A DVL's velocity and the attitude of a vehicle, its bow up, that rises and sinks as it goes ahead and astern."""
    time_s = np.arange(0.0, 120.0, 0.1)
    down = size * down_m_s(time_s)
    velocity = np.column_stack([-np.sin(PITCH_RAD) * down, 0.0 * down, np.cos(PITCH_RAD) * down])
    noise = np.random.default_rng(1).normal(0.0, 0.004, velocity.shape)
    attitude_s = np.arange(0.0, 120.0, 0.02)
    return Signal(time_s, velocity + noise), Signal(attitude_s, np.tile(AT_REST, (len(attitude_s), 1)))


def pressure(late_s):
    time_s = np.arange(1.03, 119.0, 0.1)
    noise = np.random.default_rng(2).normal(0.0, 20.0, len(time_s))
    return Signal(time_s, (101_325.0 + PA_PER_M * depth_m(time_s - late_s) + noise)[:, None])


@pytest.mark.parametrize("late_s", [0.03, 0.085, 0.12])
def test_the_age_is_that_at_which_the_depth_goes_with_the_dvl(late_s):
    assert age_s(pressure(late_s), *pitched()) == pytest.approx(late_s, abs=0.003)


def test_spikes_and_a_gap_of_the_dvl_do_not_bend_it():
    spiky, (velocity, attitude_of) = pressure(0.03), pitched()
    spiky.value[100::200] += 5_000.0
    heard = (velocity.time_s < 40.0) | (velocity.time_s > 55.0)
    gappy = Signal(velocity.time_s[heard], velocity.value[heard])
    assert age_s(spiky, gappy, attitude_of) == pytest.approx(0.03, abs=0.003)


def test_an_attitude_that_is_never_known_leaves_the_usual_age():
    velocity, attitude_of = pitched()
    unknown = Signal(attitude_of.time_s, np.full_like(attitude_of.value, np.nan))
    made = dated(pressure(0.03), velocity, unknown)
    assert made.time_s == pytest.approx(pressure(0.03).time_s - 0.085)


def test_a_depth_that_tells_nothing_leaves_the_usual_age():
    velocity, attitude_of = pitched(size=0.0)
    level = Signal(pressure(0.0).time_s, np.full((len(pressure(0.0).time_s), 1), 180_000.0))
    assert age_s(level, velocity, attitude_of) == 0.085
    short = Signal(velocity.time_s[:20], velocity.value[:20])
    assert age_s(pressure(0.03), short, attitude_of) == 0.085


@pytest.mark.parametrize(("late_s", "age"), [(-0.2, 0.0), (0.4, OLDEST_S)])
def test_a_dvl_that_is_late_or_early_itself_bends_it_no_further_than_a_pressure_may_be_old(late_s, age):
    assert age_s(pressure(late_s), *pitched()) == age


def test_a_recording_with_a_dvl_has_its_ardusubs_pressure_at_the_age_that_this_shows(tmp_path):
    stamped: list[Stamped] = []
    for k in range(300):
        t = k / 10
        moved = [0.0, 0.0, 0.1 * float(down_m_s(np.array(t)))]
        hpa = 1000.0 + 1e-2 * PA_PER_M * float(depth_m(np.array(t - 0.03)))
        stamped += [
            (t, 1, 1, attitude(t, 0.0)),
            (t, 1, 1, servos(round(t * 1e6), [1500, 1600])),
            (t, 1, 1, mav.MAVLink_scaled_pressure2_message(100 * k, hpa, 0, 2000)),
            (
                t,
                1,
                191,
                mav.MAVLink_vision_position_delta_message(int(t * 1e6), 100_000, [0] * 3, moved, 100),
            ),
            (t, 1, 191, array(t, "TAU_CMD", (1.0,))),
        ]
        if k % 10 == 0:
            stamped.append((t, 1, 1, heartbeat(autopilot=3)))
    dive = read_dive(write(tmp_path / "a.tlog", recording(stamped)))
    assert not dive.velocity_is_filtered
    assert dive.pressure.time_s[50] == pytest.approx(5.0 - 0.03, abs=0.004)
