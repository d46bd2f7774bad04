"""ArduPilot's rates of turn and accelerations are dated before its low-pass filters."""

import math

import numpy as np
import pytest
from autopilot_log import LATE_S, Turning, logged
from built_recordings import heartbeat, recording, servos, write
from pymavlink.dialects.v20 import ardupilotmega as mav

from identify.dive import Signal
from identify.ingest.mavlink.low_pass import delay_s, undone
from identify.ingest.open import read_dive


def butterworth(corner_hz, rate_rad_s):
    """Delay of a Butterworth filter of second order at a rate: the fall of its phase."""

    def phase(rate):
        s = 1j * rate / (2 * math.pi * corner_hz)
        return np.angle(1.0 / (s * s + math.sqrt(2) * s + 1.0))

    return -(phase(rate_rad_s * 1.001) - phase(rate_rad_s * 0.999)) / (0.002 * rate_rad_s)


def test_the_delay_is_that_of_a_butterworth_filter_for_all_that_a_vehicle_does():
    assert delay_s(20.0) == pytest.approx(butterworth(20.0, 2 * math.pi * 1.0), rel=0.01)
    assert delay_s(0.0) == 0.0


@pytest.mark.parametrize(("turn_hz", "left"), [(1.0, 0.002), (5.0, 0.006), (10.0, 0.01)])
def test_of_quick_turns_nothing_but_the_delay_is_left(turn_hz, left):
    """At 10 Hz a filter of 20 Hz turns the phase by 0.05 rad more than its delay, and takes 3 % away."""
    time_s, corner_hz = np.arange(0.0, 4.0, 0.02), 20.0
    s = 1j * turn_hz / corner_hz
    turning = np.exp(2j * np.pi * turn_hz * time_s)
    behind = Signal(time_s, (turning / (s * s + math.sqrt(2) * s + 1.0)).real[:, None].repeat(3, 1))
    delayed = (turning * np.exp(-2j * np.pi * turn_hz * delay_s(corner_hz))).real
    inner = slice(2, -2)
    off = undone(behind, corner_hz).value[inner] - delayed[inner, None]
    assert np.sqrt(2) * off.std() < left
    if turn_hz == 10.0:
        assert np.sqrt(2) * (behind.value[inner, 0] - delayed[inner]).std() > 0.05


def test_a_rate_beside_a_lost_message_stays_and_so_do_rates_that_come_too_seldom():
    time_s = np.delete(np.arange(0.0, 2.0, 0.02), 50)
    rates = Signal(time_s, np.sin(60.0 * time_s)[:, None])
    off = np.flatnonzero(undone(rates, 20.0).value[:, 0] == rates.value[:, 0])
    assert off.tolist() == [0, 1, 48, 49, 50, 51, 97, 98]
    seldom = Signal(time_s[::2], rates.value[::2])
    assert undone(seldom, 20.0) is seldom


@pytest.mark.parametrize(("stated", "late_s"), [(20.0, LATE_S), (10.0, 2 * LATE_S), (0.0, 0.0)])
def test_a_dataflash_log_is_dated_by_the_corner_it_states(tmp_path, stated, late_s):
    logged(
        tmp_path / "1.BIN",
        Turning(),
        lambda boot_s: boot_s,
        seconds=20.0,
        parameters={"INS_GYRO_FILTER": stated},
    )
    dive = read_dive(tmp_path / "1.BIN")
    assert dive.pwm.time_s[0] - dive.gyro.time_s[0] == pytest.approx(late_s, abs=1e-6)


@pytest.mark.parametrize(("autopilot", "late_s"), [(mav.MAV_AUTOPILOT_ARDUPILOTMEGA, 2 * LATE_S), (12, 0.0)])
def test_a_tlog_is_dated_by_what_the_autopilot_itself_says_and_only_ardupilots(tmp_path, autopilot, late_s):
    """A companion of the same system may state a parameter of that name for itself."""
    stamped = []
    for k in range(400):
        messages = [
            mav.MAVLink_attitude_message(20 * k, 0.0, 0.0, 0.0, 0.0, 0.0, math.sin(k)),
            servos(20_000 * k, [1500 + k % 7] * 8),
        ]
        if k % 50 == 0:
            corner = mav.MAVLink_param_value_message(b"INS_GYRO_FILTER", 10.0, 9, 1356, 7)
            messages += [heartbeat(autopilot=autopilot), corner]
        stamped += [(k / 50, 1, 1, message) for message in messages]
    stamped.append((8.0, 1, 191, mav.MAVLink_param_value_message(b"INS_GYRO_FILTER", 80.0, 9, 3, 1)))
    dive = read_dive(write(tmp_path / "t.tlog", recording(stamped)))
    np.testing.assert_allclose(dive.attitude.time_s - dive.gyro.time_s, late_s, atol=1e-6)
