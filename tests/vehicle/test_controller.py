"""The controller: its references, its gains, and its view of the sensors."""

import math

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from bridge.arrays import NAN3, Quaternion
from bridge.attitude import heading_of, roll_pitch, unwrapped
from bridge.errors import ConfigError
from bridge.sensors.samples import DvlSample, ImuSample, PressureSample
from bridge.vehicle.config import Configuration, Device, Mounting, Sensors, Thruster, Vehicle, Water
from bridge.vehicle.controller import GAINS, Controller, Gains, GainTable, load_gains
from bridge.vehicle.navigation import Navigation, Navigator, known_at
from bridge.vehicle.references import DoubleS, Reference, Trail

BODY = Configuration(10.0, (1.0, 2.0, 4.0), (Thruster((1.0, 0.0, 0.0), (0.0, 0.0, 0.0)),))
P = Gains((1.0, 2.0), (0.0, 0.0), (0.5, 0.5))
PI = Gains((1.0, 1.0), (0.5, 0.5), (0.0, 0.0))
PROPORTIONAL = GainTable((0.0, 1.0), P, P, P, P, P, P)
INTEGRAL = GainTable((0.0, 1.0), PI, PI, PI, PI, PI, PI)
REACH = (40.0,) * 6
LEVEL = Navigation(
    velocity=(0.0, 0.0, 0.0),
    rate=(0.0, 0.0, 0.0),
    attitude=(1.0, 0.0, 0.0, 0.0),
    heading_rad=0.0,
    depth_m=0.0,
)


def wanted(u: float = 0.0, depth: float = 0.0, heading: float = 0.0) -> Reference:
    return Reference((u, 0, 0, 0, 0, 0), (0.0,) * 6, heading, depth)


def test_gains_are_per_unit_of_mass_and_run_over_the_reference_speed():
    controller = Controller(PROPORTIONAL, BODY, REACH)
    assert controller.step(LEVEL, wanted(u=0.5), 0.05, False)[0] == pytest.approx(10.0 * 1.5 * 0.5)
    assert controller.step(LEVEL, wanted(u=1.5), 0.05, False)[0] == pytest.approx(10.0 * 2.0 * 1.5)


def test_between_two_speeds_of_the_table_all_three_gains_are_between_theirs():
    steep = Gains((1.0, 2.0), (0.4, 0.8), (0.2, 0.6))
    controller = Controller(GainTable((0.0, 1.0), *(steep,) * 6), BODY, REACH)
    sinking = Navigation((0.0, 0.0, 0.3), 0, (0.0, 0.0, 0.0), 0, (1.0, 0, 0, 0), 0.0, 0, 0.5, 0)
    heave = controller.step(sinking, wanted(u=0.25, depth=0.6), 0.5, False)[2]
    assert heave == pytest.approx(10.0 * (1.25 * 0.1 + 0.5 * 0.1 * 0.5 - 0.3 * 0.3))


@pytest.mark.parametrize(("speed", "gain"), [(0.1, 1.0), (0.3, 1.5), (0.7, 3.0), (2.0, 4.0), (math.nan, 1.0)])
def test_a_gain_is_that_between_the_two_nearest_speeds_and_beyond_the_ends_the_ends(speed, gain):
    rising = Gains((1.0, 2.0, 4.0), (0.0,) * 3, (0.0,) * 3)
    controller = Controller(GainTable((0.2, 0.4, 1.0), *(rising,) * 6), BODY, REACH)
    heave = controller.step(LEVEL, wanted(u=speed, depth=0.1), 0.05, False)[2]
    assert heave == pytest.approx(10.0 * gain * 0.1)


def test_a_velocity_gain_stiffens_surge_and_sway_alone():
    moving = Navigation((0.0, 0.0, 0.1), 0, (0.0, 0.0, 0.2), 0, (1.0, 0, 0, 0), 0.1, 0, 0.5, 0)
    ask = Reference((0.3, 0.2, 0, 0, 0, 0), (0.0,) * 6, 0.4, 0.6)
    once, twice = (Controller(INTEGRAL, BODY, REACH).step(moving, ask, 0.05, False, gain) for gain in (1, 2))
    assert twice[:2] == pytest.approx((2 * once[0], 2 * once[1]))
    assert twice[2:] == once[2:]


def test_yaw_acts_on_heading_and_its_rate_and_heave_on_depth_and_its_rate():
    moving = Navigation((0.0, 0.0, 0.1), 0, (0.0, 0.0, 0.2), 0, (1.0, 0, 0, 0), 6.5, 0, 0.5, 0)
    tau = Controller(PROPORTIONAL, BODY, REACH).step(moving, wanted(depth=0.6, heading=7.0), 0.05, False)
    assert tau[5] == pytest.approx(4.0 * (0.5 - 0.5 * 0.2))
    assert tau[2] == pytest.approx(10.0 * (0.1 - 0.5 * 0.1))


@pytest.mark.parametrize("heading", [math.pi - 0.1 - math.tau, math.pi - 0.1, math.pi - 0.1 + 3 * math.tau])
def test_a_heading_is_reached_by_the_shorter_way(heading):
    there = Navigation((0.0, 0, 0), 0, (0.0, 0, 0), 0, (1.0, 0, 0, 0), heading, 0, 0.0, 0)
    tau = Controller(PROPORTIONAL, BODY, REACH).step(there, wanted(heading=0.1 - math.pi), 0.05, False)
    assert tau[5] == pytest.approx(4.0 * 0.2)


def test_roll_and_pitch_are_pushed_level_and_damped():
    half = 0.1 / 2
    rolled = Navigation(
        (0.0, 0, 0), 0, (0.3, 0.0, 0.0), 0, (math.cos(half), math.sin(half), 0, 0), 0, 0, 0, 0
    )
    assert Controller(PROPORTIONAL, BODY, REACH).step(rolled, wanted(), 0.05, False)[3] == pytest.approx(
        -0.1 - 0.15
    )
    attitude = (math.cos(half), 0.0, math.sin(half), 0.0)
    assert roll_pitch(attitude) == pytest.approx((0.0, 0.1))
    pitched = Navigation((0.0, 0, 0), 0, (0.0, 0.3, 0.0), 0, attitude, 0, 0, 0, 0)
    tau = Controller(PROPORTIONAL, BODY, REACH).step(pitched, wanted(), 0.05, False)
    assert tau[4] == pytest.approx(2.0 * (-0.1 - 0.15))


def test_the_integral_is_error_times_time():
    controller = Controller(INTEGRAL, BODY, REACH)
    for _ in range(20):
        tau = controller.step(LEVEL, wanted(u=0.1), 0.05, False)
    assert tau[0] == pytest.approx(10.0 * (0.1 + 0.5 * 0.1 * 1.0))


def test_the_integral_does_not_grow_while_the_thrusters_are_saturated_but_may_shrink():
    controller = Controller(INTEGRAL, BODY, REACH)
    controller.step(LEVEL, wanted(u=0.1), 1.0, False)
    assert controller.step(LEVEL, wanted(u=0.1), 1.0, True)[0] == pytest.approx(1.0 + 0.5)
    assert controller.step(LEVEL, wanted(u=-0.05), 1.0, True)[0] == pytest.approx(-0.5 + 0.25)


def test_the_output_and_the_integral_stay_within_reach():
    controller = Controller(INTEGRAL, BODY, REACH)
    for _ in range(100):
        assert controller.step(LEVEL, wanted(u=3.0), 1.0, False)[0] <= 40.0
    assert controller.step(LEVEL, wanted(), 1.0, False)[0] <= 20.0


def test_an_axis_without_a_measurement_gets_nothing():
    tau = Controller(PROPORTIONAL, BODY, REACH).step(Navigation(), wanted(u=1.0, depth=1.0), 0.05, False)
    assert tau == (0.0,) * 6


def test_depth_is_held_without_a_velocity():
    tau = Controller(PROPORTIONAL, BODY, REACH).step(Navigation(depth_m=0.5), wanted(depth=0.6), 0.05, False)
    assert tau == pytest.approx((0.0, 0.0, 10.0 * 0.1, 0.0, 0.0, 0.0))


def test_a_reset_forgets_only_the_integrals_named():
    controller = Controller(INTEGRAL, BODY, REACH)
    ask = Reference((0.1, 0.1, 0, 0, 0, 0), (0.0,) * 6, 0.0, 0.0)
    controller.step(LEVEL, ask, 1.0, False)
    controller.reset((0,))
    tau = controller.step(LEVEL, ask, 1.0, False)
    assert tau[:2] == pytest.approx((1.5, 2.0))


@pytest.mark.parametrize("name", list(yaml.safe_load(GAINS.read_text())))
def test_every_shipped_gain_table_can_be_loaded(name):
    assert load_gains(name).surge.kp[0] > 0


def test_an_unknown_gain_table_is_refused_with_the_names_there_are():
    with pytest.raises(ConfigError, match="survey, hovering, conservative"):
        load_gains("brisk")


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"speeds_m_s": [1.0, 0.0]}, "must rise"),
        ({"fed": {"gain": 0.0}}, "gain must be above 0"),
        ({"fed": {"straight_below_n": -1.0}}, "straight_below_n not negative"),
        ({"yaw": {"kp": [1.0], "ki": [0.0, 0.0], "kd": [0.0, 0.0]}}, "yaw"),
        ({"yaw": {"kp": [1.0, -1.0], "ki": [0.0, 0.0], "kd": [0.0, 0.0]}}, "none negative"),
    ],
)
def test_a_malformed_gain_table_is_refused(tmp_path, change, says):
    table = yaml.safe_load(GAINS.read_text())["conservative"] | change
    (tmp_path / "gains.yaml").write_text(yaml.safe_dump({"mine": table}))
    with pytest.raises(ConfigError, match=says):
        load_gains("mine", tmp_path / "gains.yaml")


PROFILES = st.builds(DoubleS, st.floats(-1, 1), st.floats(-1, 1), st.floats(0.5, 20), st.floats(0.05, 0.5))


@given(PROFILES)
@settings(max_examples=40)
def test_a_double_s_starts_and_ends_at_its_values_with_no_slope(profile):
    assert profile.at(0.0) == (profile.start, 0.0, 0.0)
    value, slope, integral = profile.at(profile.duration_s)
    assert (value, slope) == (profile.end, 0.0)
    assert integral == pytest.approx(0.5 * (profile.start + profile.end) * profile.duration_s)


@given(PROFILES)
@settings(max_examples=40)
def test_slope_and_integral_of_a_double_s_belong_to_its_value(profile):
    time_s = np.linspace(0, 1.3 * profile.duration_s, 4001)
    value, slope, integral = np.array([profile.at(t) for t in time_s]).T
    step = time_s[1]
    summed = np.concatenate([[0.0], np.cumsum((slope[1:] + slope[:-1]) / 2 * step)])
    np.testing.assert_allclose(profile.start + summed, value, atol=1e-3)
    summed = np.concatenate([[0.0], np.cumsum((value[1:] + value[:-1]) / 2 * step)])
    np.testing.assert_allclose(summed, integral, atol=1e-4)


@given(PROFILES)
@settings(max_examples=40)
def test_a_double_s_keeps_its_limits_of_slope_and_jerk(profile):
    time_s = np.linspace(0, profile.duration_s, 2001)
    slope = np.array([profile.at(t)[1] for t in time_s])
    steepest = abs(profile.end - profile.start) / (profile.duration_s * (1 - profile.ramp))
    assert np.abs(slope).max() <= steepest * (1 + 1e-9)
    jerk = steepest / (profile.ramp * profile.duration_s)
    assert np.abs(np.diff(slope) / time_s[1]).max() <= jerk * (1 + 1e-6) + 1e-9


@pytest.mark.parametrize(("duration_s", "ramp"), [(0.0, 0.25), (-1.0, 0.25), (5.0, 0.0), (5.0, 0.6)])
def test_a_double_s_without_time_or_with_too_long_a_ramp_is_refused(duration_s, ramp):
    with pytest.raises(ValueError, match="double-S"):
        DoubleS(0.0, 1.0, duration_s, ramp)


def asked_of(u: float, heading_rad: float = 0.0) -> Reference:
    return Reference((u, 0, 0, 0, 0, 0), (0.0,) * 6, heading_rad, 2 * u)


def trail(*kept: tuple[float, Reference]) -> Trail:
    of_late = Trail(1.0)
    for time_s, reference in kept:
        of_late.add(time_s, reference)
    return of_late


def test_a_trail_tells_what_was_wanted_between_two_ticks():
    then = trail((0.0, asked_of(0.0)), (0.1, asked_of(0.2)), (0.2, asked_of(0.6))).at(0.125)
    assert (then.nu[0], then.depth_m) == pytest.approx((0.3, 0.6))


@pytest.mark.parametrize(("time_s", "u"), [(-5.0, 0.1), (0.2, 0.3), (9.0, 0.3), (math.nan, 0.3)])
def test_beyond_its_ends_a_trail_holds_and_it_takes_no_time_for_the_latest(time_s, u):
    assert trail((0.0, asked_of(0.1)), (0.2, asked_of(0.3))).at(time_s).nu[0] == u


def test_a_trail_keeps_no_more_than_its_span():
    long = trail(*((0.1 * i, asked_of(float(i))) for i in range(50)))
    assert long.at(0.0).nu[0] == 39.0


def test_a_clock_that_begins_again_begins_a_new_trail():
    assert trail((7.0, asked_of(0.7)), (1.0, asked_of(0.1))).at(0.0).nu[0] == 0.1


def test_a_heading_unwrapped_anew_has_not_turned_in_between():
    of_late = trail((0.0, asked_of(0.0, 3.1)), (0.1, asked_of(0.0, 3.2 - math.tau)))
    assert of_late.at(0.05).heading_rad == pytest.approx(3.15)


SHAPE = Configuration(dry_mass_kg=72.0, inertia_kgm2=(2.0, 9.0, 10.0), thrusters=())
AHEAD = Device("wayfinder", mounting=Mounting(position_m=(0.5, 0.0, 0.2)))
WATER = Water(density_kg_m3=1025.0, surface_pressure_hpa=1000.0)
LEVEL_READING: Quaternion = (1.0, 0.0, 0.0, 0.0)
HEARD = Navigation((0.1, 0.2, 0.3), 10.0, (0.4, 0.5, 0.6), 10.0, LEVEL_READING, 0.7, 10.0, 0.8, 10.0)


def navigator() -> Navigator:
    return Navigator(Vehicle("test", {"only": SHAPE}, water=WATER, sensors=Sensors(dvl=AHEAD)))


def facing(heading_rad: float) -> Quaternion:
    return math.cos(heading_rad / 2), 0.0, 0.0, math.sin(heading_rad / 2)


def test_velocity_is_moved_from_the_transducer_to_the_origin():
    """Turning at 0.2 rad/s about z and 0.1 rad/s about y: r x is sideways, q z ahead, q x up."""
    known = navigator()
    known.take_imu(ImuSample(1.0, (0.0, 0.0, -9.81), (0.0, 0.1, 0.2)))
    known.take_dvl(DvlSample(1.0, (0.3 + 0.1 * 0.2, 0.2 * 0.5, -0.1 * 0.5), math.nan, 2.0))
    assert known.navigation.velocity == pytest.approx((0.3, 0.0, 0.0), abs=1e-12)


def test_a_velocity_holds_through_a_dropout_and_keeps_its_own_time():
    known = navigator()
    known.take_dvl(DvlSample(1.0, (0.3, 0.1, 0.0), math.nan, 2.0))
    known.take_dvl(DvlSample(1.1, NAN3, math.nan, math.nan))
    assert (known.navigation.velocity, known.navigation.velocity_time_s) == ((0.3, 0.1, 0.0), 1.0)


def test_yaw_rate_comes_from_the_gyro_until_that_falls_silent():
    known = navigator()
    known.take_yaw_rate(1.0, 0.25)
    known.take_imu(ImuSample(1.4, (0.0, 0.0, -9.81), (0.01, 0.02, 0.2)))
    assert known.navigation.rate == (0.01, 0.02, 0.25)
    known.take_imu(ImuSample(1.6, (0.0, 0.0, -9.81), (0.01, 0.02, 0.2)))
    assert known.navigation.rate == (0.01, 0.02, 0.2)


def test_a_heading_runs_on_past_half_a_turn():
    known = navigator()
    for step in range(9):
        known.take_imu(ImuSample(0.1 * step, (0.0, 0.0, -9.81), (0.0, 0.0, 0.0), facing(0.6 * step)))
    assert known.navigation.heading_rad == pytest.approx(4.8)
    assert heading_of(facing(4.8)) == pytest.approx(4.8 - math.tau)


@pytest.mark.parametrize(
    ("angle", "near", "nearest"), [(-3.0, 3.1, -3.0 + math.tau), (0.5, -6.0, 0.5 - math.tau)]
)
def test_an_angle_is_brought_nearest_to_the_one_before(angle, near, nearest):
    assert unwrapped(angle, near) == pytest.approx(nearest)
    assert unwrapped(angle, math.nan) == angle
    assert math.isnan(unwrapped(math.nan, near))


def test_ten_metres_of_sea_are_a_depth_of_ten_metres():
    known = navigator()
    known.take_pressure(PressureSample(1.0, 100_000.0 + 1025.0 * WATER.gravity_m_s2 * 10.0, 12.0))
    assert known.navigation.depth_m == pytest.approx(10.0)


def test_what_is_fresh_is_known_as_it_is():
    assert known_at(HEARD, 11.0) is HEARD


def test_what_is_old_or_was_never_heard_is_not_known():
    stale = known_at(HEARD, 11.1)
    values = (*stale.velocity, *stale.rate, *stale.attitude, stale.heading_rad, stale.depth_m)
    assert all(map(math.isnan, values))
    assert stale.velocity_time_s == 10.0
    assert math.isnan(known_at(Navigation(depth_m=0.5), 0.0).depth_m)
