"""A recording of an ArduSub or another autopilot: its velocity, its outputs and its clock are made ours."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from built_recordings import (
    NAN,
    Stamped,
    attitude,
    heartbeat,
    imu,
    odometry,
    outputs,
    recording,
    servos,
    write,
)
from pymavlink.dialects.v20 import ardupilotmega as mav

from identify.ingest.open import read_dive


def ned_velocity(boot_s: float, velocity: tuple[float, float, float]) -> Any:
    return mav.MAVLink_local_position_ned_message(int(boot_s * 1e3), 0, 0, 0, *velocity)


def ardusub_dive(boot_s: float = 0.0) -> list[Stamped]:
    """Ten seconds of an ArduSub that moves north at 1 m/s while it heads east."""
    said: list[Stamped] = []
    for k in range(100):
        t = boot_s + k / 10
        own = [
            attitude(t, np.pi / 2),
            ned_velocity(t, (1.0, 0.0, 0.2)),
            servos(round(t * 1e6), [1500, 1600, 0, 1400]),
            servos(round(t * 1e6), [1111] * 4, port=1),
            mav.MAVLink_scaled_imu2_message(int(t * 1e3), 0, 0, -1000, 0, 0, 250, 0, 0, 0),
            mav.MAVLink_global_position_int_message(int(t * 1e3), 0, 0, 0, -2500, 0, 0, 0, 0),
        ]
        said += [(t, 1, 1, message) for message in own]
        if k % 10 == 0:
            said.append((t, 1, 1, heartbeat(autopilot=3, armed=k >= 50)))
            said.append((t, 255, 190, heartbeat(mav.MAV_TYPE_GCS, 8, False)))
    return said


def test_ardusub_velocity_is_turned_from_north_east_down_into_body_axes(tmp_path: Path) -> None:
    dive = read_dive(write(tmp_path / "a.tlog", recording(ardusub_dive())))
    assert dive.velocity is not None
    assert dive.velocity.value[40] == pytest.approx([0.0, -1.0, 0.2], abs=1e-6)
    assert dive.velocity_is_filtered
    assert dive.depth is not None
    assert dive.depth.value[0] == pytest.approx([2.5])
    assert dive.gyro is not None
    # The rates of ATTITUDE, by which the autopilot steers, and not those of an IMU told as often.
    assert dive.gyro.value[0] == pytest.approx([0, 0, 0.1])
    assert dive.armed is not None
    assert dive.armed.value[:, 0].tolist() == [0.0] * 5 + [1.0] * 5


def test_servo_outputs_end_at_the_first_that_is_never_driven(tmp_path: Path) -> None:
    dive = read_dive(write(tmp_path / "a.tlog", recording(ardusub_dive())))
    assert dive.pwm is not None
    assert dive.pwm.value[0] == pytest.approx([1500, 1600])


def of_outputs(path: Path, pwm: list[float]) -> Any:
    said = [(k / 10, 1, 1, outputs(k / 10, pwm)) for k in range(100)]
    return read_dive(write(path, recording([*said, (10.0, 1, 1, imu(10.0, 0, 56, (0.1, 0.2, 0.3)))]))).pwm


def test_an_output_that_is_never_a_number_counts_as_driven(tmp_path: Path) -> None:
    value = of_outputs(tmp_path / "a.tlog", [NAN, 1500.0, 1600.0]).value
    assert value.shape == (100, 3)
    assert np.isnan(value[:, 0]).all()
    assert value[0, 1:] == pytest.approx([1500.0, 1600.0])


def test_unused_outputs_may_all_be_no_number(tmp_path: Path) -> None:
    assert of_outputs(tmp_path / "a.tlog", [1500.0, 1600.0, *[NAN] * 30]).value.shape == (100, 2)


def test_the_32_bit_microseconds_of_servo_outputs_are_unwrapped(tmp_path: Path) -> None:
    boot_s = 2 * 4294.967296 - 5.0
    dive = read_dive(write(tmp_path / "a.tlog", recording(ardusub_dive(boot_s))))
    assert dive.pwm is not None
    assert dive.pwm.time_s == pytest.approx(boot_s + np.arange(100) / 10, abs=1e-4)


def test_position_deltas_of_a_dvl_driver_come_before_the_filtered_velocity(tmp_path: Path) -> None:
    said = ardusub_dive()
    for k in range(100):
        t = k / 10
        delta = mav.MAVLink_vision_position_delta_message(
            int(t * 1e6), 100_000, [0] * 3, [0.05, 0.0, 0.01], 100
        )
        said.append((t, 255, 0, delta))
    said.sort(key=lambda m: m[0])
    dive = read_dive(write(tmp_path / "a.tlog", recording(said)))
    assert dive.velocity is not None
    assert dive.velocity.value[10] == pytest.approx([0.5, 0.0, 0.1], abs=1e-6)
    assert dive.velocity.time_s[10] == pytest.approx(0.95, abs=1e-3)
    assert not dive.velocity_is_filtered


def test_a_bridge_beside_an_autopilot_is_put_on_one_clock(tmp_path: Path) -> None:
    """The bridge booted 60 s after the autopilot; both say what happens at the same instant."""
    said: list[Stamped] = []
    for k in range(100):
        t = 5.0 + k / 10
        said.append((t, 1, 191, odometry(t, (t, 0.0, 0.0))))
        said += [(t, 1, 191, imu(t, 0, 0b111111, (0.0, 0.0, 0.1)))]
        said.append((t, 1, 1, servos(round((t + 60) * 1e6), [1500, 1600])))
        said.append((t, 1, 1, mav.MAVLink_scaled_pressure2_message(int((t + 60) * 1e3), 1100.0, 0, 2000)))
    dive = read_dive(write(tmp_path / "a.tlog", recording(said)))
    assert dive.pwm is not None
    assert dive.velocity is not None
    assert dive.pwm.time_s == pytest.approx(dive.velocity.time_s, abs=1e-3)
