"""What the controller sees of the sensors."""

import math

import pytest

from bridge.navigation import Navigation, Navigator, known_at, unwrapped, yaw_of
from bridge.sensors.samples import NAN3, DvlSample, ImuSample, PressureSample, Quaternion
from bridge.vehicle.config import Configuration, Device, Mounting, Sensors, Vehicle, Water

SHAPE = Configuration(dry_mass_kg=72.0, inertia_kgm2=(2.0, 9.0, 10.0), thrusters=())
AHEAD = Device("wayfinder", mounting=Mounting(position_m=(0.5, 0.0, 0.2)))
WATER = Water(density_kg_m3=1025.0, surface_pressure_hpa=1000.0)
LEVEL: Quaternion = (1.0, 0.0, 0.0, 0.0)
HEARD = Navigation((0.1, 0.2, 0.3), 10.0, (0.4, 0.5, 0.6), 10.0, LEVEL, 0.7, 10.0, 0.8, 10.0)


def navigator() -> Navigator:
    return Navigator(Vehicle("test", {"only": SHAPE}, water=WATER, sensors=Sensors(dvl=AHEAD)))


def facing(heading_rad: float) -> Quaternion:
    return math.cos(heading_rad / 2), 0.0, 0.0, math.sin(heading_rad / 2)


def test_velocity_is_moved_from_the_transducer_to_the_origin() -> None:
    """Turning at 0.2 rad/s about z and 0.1 rad/s about y: r x is sideways, q z ahead, q x up."""
    known = navigator()
    known.take_imu(ImuSample(1.0, (0.0, 0.0, -9.81), (0.0, 0.1, 0.2)))
    known.take_dvl(DvlSample(1.0, (0.3 + 0.1 * 0.2, 0.2 * 0.5, -0.1 * 0.5), math.nan, 2.0))
    assert known.navigation.velocity == pytest.approx((0.3, 0.0, 0.0), abs=1e-12)


def test_a_velocity_holds_through_a_dropout_and_keeps_its_own_time() -> None:
    known = navigator()
    known.take_dvl(DvlSample(1.0, (0.3, 0.1, 0.0), math.nan, 2.0))
    known.take_dvl(DvlSample(1.1, NAN3, math.nan, math.nan))
    assert (known.navigation.velocity, known.navigation.velocity_time_s) == ((0.3, 0.1, 0.0), 1.0)


def test_yaw_rate_comes_from_the_gyro_until_that_falls_silent() -> None:
    known = navigator()
    known.take_yaw_rate(1.0, 0.25)
    known.take_imu(ImuSample(1.4, (0.0, 0.0, -9.81), (0.0, 0.0, 0.2)))
    assert known.navigation.rate == (0.0, 0.0, 0.25)
    known.take_imu(ImuSample(1.6, (0.0, 0.0, -9.81), (0.0, 0.0, 0.2)))
    assert known.navigation.rate == (0.0, 0.0, 0.2)


def test_a_heading_runs_on_past_half_a_turn() -> None:
    known = navigator()
    for step in range(9):
        known.take_imu(ImuSample(0.1 * step, (0.0, 0.0, -9.81), (0.0, 0.0, 0.0), facing(0.6 * step)))
    assert known.navigation.heading_rad == pytest.approx(4.8)
    assert yaw_of(facing(4.8)) == pytest.approx(4.8 - math.tau)


@pytest.mark.parametrize(
    ("angle", "near", "found"), [(-3.0, 3.1, -3.0 + math.tau), (0.5, -6.0, 0.5 - math.tau)]
)
def test_an_angle_is_brought_nearest_to_the_one_before(angle: float, near: float, found: float) -> None:
    assert unwrapped(angle, near) == pytest.approx(found)
    assert unwrapped(angle, math.nan) == angle
    assert math.isnan(unwrapped(math.nan, near))


def test_ten_metres_of_sea_are_a_depth_of_ten_metres() -> None:
    known = navigator()
    known.take_pressure(PressureSample(1.0, 100_000.0 + 1025.0 * WATER.gravity_m_s2 * 10.0, 12.0))
    assert known.navigation.depth_m == pytest.approx(10.0)


def test_what_is_fresh_is_known_as_it_is() -> None:
    assert known_at(HEARD, 11.0) is HEARD


def test_what_is_old_or_was_never_heard_is_not_known() -> None:
    stale = known_at(HEARD, 11.1)
    values = (*stale.velocity, *stale.rate, *stale.attitude, stale.heading_rad, stale.depth_m)
    assert all(map(math.isnan, values))
    assert stale.velocity_time_s == 10.0
    assert math.isnan(known_at(Navigation(depth_m=0.5), 0.0).depth_m)
