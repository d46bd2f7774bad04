"""One grid out of signals at their own rates."""

from pathlib import Path

import numpy as np
import pytest

from bridge.errors import FitError
from bridge.vehicle.config import Configuration, Device, Mounting, Sensors, Vehicle, VehicleFile
from identify.dive import Array, Dive, Signal
from identify.filters import aligned, derivative, low_pass

RATE_HZ = 10.0


def vehicle(lever_m: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> VehicleFile:
    shape = Configuration(dry_mass_kg=10.0, inertia_kgm2=(1.0, 1.0, 1.0), thrusters=())
    sensors = Sensors(dvl=Device("wayfinder", mounting=Mounting(position_m=lever_m)))
    return VehicleFile(Path("v.yaml"), Vehicle("v", {"v": shape}, sensors=sensors), None, "0")


def sampled(rate_hz: float, *columns: object, seconds: float = 40.0) -> Signal:
    """Each column a function of time, or a constant."""
    time_s = np.arange(int(seconds * rate_hz)) / rate_hz
    values = [column(time_s) if callable(column) else np.full(len(time_s), column) for column in columns]
    return Signal(time_s, np.column_stack(values))


def surge(time_s: Array) -> Array:
    value: Array = 0.3 * np.sin(2 * np.pi * 0.1 * time_s)
    return value


def dive(**signals: Signal) -> Dive:
    still = {"tau_cmd": sampled(20.0, *[1.0] * 6), "gyro": sampled(25.0, 0.0, 0.0, 0.0)}
    return Dive("d", Path("d.tlog"), "0", **{**still, **signals})  # type: ignore[arg-type]


def test_a_slow_sine_passes_without_delay_and_with_its_derivative() -> None:
    grid = aligned(dive(velocity=sampled(7.0, surge, 0.0, 0.0)), vehicle(), "v", RATE_HZ, cutoff_hz=1.0)
    inner = slice(30, -30)
    assert grid.nu[inner, 0] == pytest.approx(surge(grid.time_s[inner]), abs=2e-3)
    slope = 0.3 * 2 * np.pi * 0.1 * np.cos(2 * np.pi * 0.1 * grid.time_s)
    assert grid.nu_dot[inner, 0] == pytest.approx(slope[inner], abs=3e-3)
    assert grid.tau[:, 0] == pytest.approx(1.0)


def test_the_gain_at_the_cut_off_is_a_half_and_above_nyquist_nothing_happens() -> None:
    time_s = np.arange(2000) / RATE_HZ
    wave = np.sin(2 * np.pi * 1.0 * time_s)[:, None]
    filtered = low_pass(wave, RATE_HZ, 1.0)
    assert filtered[500:1500, 0] == pytest.approx(0.5 * wave[500:1500, 0], abs=1e-3)
    assert low_pass(wave, RATE_HZ, 5.0) is wave


def test_the_derivative_of_a_ramp_is_its_slope() -> None:
    ramp = np.linspace(0.0, 5.0, 51)[:, None]
    assert derivative(ramp, RATE_HZ) == pytest.approx(np.ones((51, 1)))


def test_velocity_is_carried_from_the_transducer_to_the_origin() -> None:
    """Turning at 0.2 rad/s, a transducer 0.5 m ahead slides sideways at 0.1 m/s while the origin stands still."""
    turning = dive(velocity=sampled(10.0, 0.0, 0.1, 0.0), gyro=sampled(25.0, 0.0, 0.0, 0.2))
    grid = aligned(turning, vehicle((0.5, 0.0, 0.0)), "v")
    assert grid.nu[:, :3] == pytest.approx(0.0, abs=1e-9)
    assert grid.nu[:, 5] == pytest.approx(0.2)


def test_a_fog_mean_counts_at_the_time_that_it_carries() -> None:
    """It is dated at the middle of its interval, so that of a steadily rising rate it is the rate itself."""
    rising = dive(fog=sampled(5.0, lambda t: 0.01 * t))
    grid = aligned(rising, vehicle(), "v", cutoff_hz=RATE_HZ)
    assert grid.nu[5:-5, 5] == pytest.approx(0.01 * grid.time_s[5:-5], abs=1e-9)


def test_where_bottom_lock_was_lost_the_grid_says_so() -> None:
    velocity = sampled(10.0, 0.1, 0.0, 0.0)
    velocity.value[100:150] = np.nan
    grid = aligned(dive(velocity=velocity), vehicle(), "v")
    lost = (grid.time_s > 10.2) & (grid.time_s < 14.7)
    assert not grid.valid[lost].any()
    assert grid.valid[(grid.time_s < 9.9) | (grid.time_s > 15.0)].all()


@pytest.mark.parametrize("known", [0, 1])
def test_a_velocity_known_once_at_most_is_known_nowhere(known: int) -> None:
    once = sampled(10.0, 0.1, 0.0, 0.0)
    once.value[known:] = np.nan
    for velocity in (once, Signal(once.time_s[:1], once.value[:1])):
        assert not aligned(dive(velocity=velocity), vehicle(), "v").valid.any()


def test_what_is_not_measured_is_zero_and_named() -> None:
    grid = aligned(dive(), vehicle(), "v")
    assert grid.has.tolist() == [False] * 3 + [True] * 3
    assert not grid.nu.any()
    assert grid.attitude[0].tolist() == [1.0, 0.0, 0.0, 0.0]


def test_commands_too_rare_to_know_the_force_between_them_are_refused() -> None:
    rare = dive(velocity=sampled(10.0, 0.1, 0.0, 0.0), tau_cmd=sampled(2.0, *[1.0] * 6))
    with pytest.raises(FitError, match=r"commands come at 2\.0 Hz"):
        aligned(rare, vehicle(), "v")


def test_a_dive_of_three_seconds_is_refused() -> None:
    short = dive(velocity=sampled(10.0, 0.1, 0.0, 0.0, seconds=3.0))
    with pytest.raises(FitError, match=r"overlap for 2\.9 s, at least 20 s"):
        aligned(short, vehicle(), "v")
