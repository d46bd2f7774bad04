"""Shafts, heading and accelerometer tell of what they see, beside what they would read if nothing were hidden."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from fakes.planted import diagnosed, planted_nominal
from scipy.spatial.transform import Rotation

from bridge.vehicle.coefficients import YAW
from bridge.vehicle.thrusters import shaft_speed, thrust_curve
from identify.challenge.case import dive_of, draw_case
from identify.diagnose.diagnose import known_to
from identify.diagnose.filters.deviation import deviations
from identify.diagnose.filters.regression import regression_of
from identify.diagnose.filters.witnesses import _accelerometer, weighed_witness, witnesses
from identify.diagnose.words.causes import cause_line
from identify.dive import Signal
from identify.effects.actuators import COMMAND_DELAY, DEAD_ZONE_SHIFTED, thruster_lag
from identify.effects.effect import Act
from identify.effects.rigid_body import THRUST_BIAS
from identify.effects.sensors import GYRO_BIAS, GYRO_SCALE, IMU_GRAVITY_LEAK
from identify.ingest.rotation import euler_angles

SUSPECTS = COMMAND_DELAY, GYRO_BIAS, GYRO_SCALE


WITH_FOG = 300_911


def nominal_with(names, seed=300_901):
    case = draw_case(seed, names=names, size=0.8, seconds=120.0, rpm=True)
    return case, planted_nominal(case)


@pytest.fixture(scope="module")
def case_and_nominal():
    return nominal_with([])


@pytest.fixture(scope="module")
def turning():
    """A dive that turns round more than once."""
    case = draw_case(310_002, names=[], seconds=150.0)
    dive = dive_of(case)
    assert np.ptp(np.unwrap(euler_angles(dive.attitude.value)[2])) > 2.0 * np.pi
    return case, dive


@pytest.fixture(scope="module")
def honest(case_and_nominal):
    return case_and_nominal[1]


def of_kind(nominal, kind):
    return [witness for witness in nominal.witnesses if witness.kind == kind]


def test_an_estimated_heading_is_among_the_readings_where_no_fibre_optic_gyro_is(case_and_nominal):
    """Beside accepted effects its wander is no unknown force."""
    _, by_fog = nominal_with([], WITH_FOG)
    assert by_fog.by_estimated_angle == ()
    assert case_and_nominal[1].by_estimated_angle == (YAW,)
    assert np.flatnonzero(np.isinf(known_to(case_and_nominal[1]))).tolist() == [YAW]
    assert np.isfinite(known_to(by_fog)).all()


def test_where_nothing_hides_each_witness_reads_noise():
    _, honest = nominal_with([], WITH_FOG)
    kinds = {witness.kind for witness in honest.witnesses}
    assert kinds == {"shaft", "heading", "specific_force"}
    for witness in honest.witnesses:
        rows = weighed_witness(witness, [], honest.course).whitened(witness.off[:, None])[:, 0]
        assert abs(rows.mean()) < 5 / np.sqrt(len(rows))
        # These shafts are dated exactly, and allowed to be dated worse.
        assert (0.1 if witness.kind == "shaft" else 0.5) < rows.std() < 1.5


def test_shafts_that_stand_still_at_small_pulses_are_seen_thruster_by_thruster():
    case, nominal = nominal_with(["dead_zone"])
    half_width = case.truth()["effects"][0]["parameters"]["half_width"]
    act = DEAD_ZONE_SHIFTED.act(nominal.course, np.array([half_width]))
    for witness in of_kind(nominal, "shaft"):
        seen = witness.of(act)
        assert np.linalg.norm(witness.off - seen) < 0.5 * np.linalg.norm(witness.off)


def test_a_gyro_that_turns_at_rest_turns_on_beyond_the_heading():
    case, nominal = nominal_with(["gyro_bias"], WITH_FOG)
    bias = case.truth()["effects"][0]["parameters"]["z"]
    (heading,) = of_kind(nominal, "heading")
    assert heading.off.mean() == pytest.approx(-5.0 * bias, rel=0.1)
    seen = heading.of(GYRO_BIAS.act(nominal.course, np.array([bias])))
    np.testing.assert_allclose(seen, -5.0 * bias)


def test_without_a_fibre_optic_gyro_the_heading_is_among_the_readings_and_no_witness(honest):
    assert of_kind(honest, "heading") == []
    (yaw,) = (problem for problem in honest.joint.problems if problem.axis.dof == 5)
    assert [channel.name for channel in yaw.axis.channels] == ["gyro", "attitude"]


def test_a_gyro_whose_scale_is_off_is_named_with_its_size_instead_of_a_late_thrust(turning):
    case, dive = turning
    scaled = dive.gyro.value * [1.0, 1.0, 1.02]
    changed = dict.fromkeys(("fog",)) | {"gyro": Signal(dive.gyro.time_s, scaled)}
    diagnosis = diagnosed(case, *SUSPECTS, dive=replace(dive, **changed))
    (finding,) = diagnosis.findings
    assert finding.cause.effect is GYRO_SCALE
    assert finding.cause.values == pytest.approx([1.02], abs=2e-3)
    assert finding.parameters == {}
    assert "Fitted: scale 1.02" in cause_line(finding)


def deviated(dive, amplitude_rad, phase_rad):
    """The dive with a compass that is off by the sine of its heading."""
    turned = Rotation.from_quat(dive.attitude.value, scalar_first=True).as_euler("ZYX")
    turned[:, 0] += amplitude_rad * np.sin(turned[:, 0] + phase_rad)
    value = Rotation.from_euler("ZYX", turned).as_quat(scalar_first=True)
    return replace(dive, attitude=Signal(dive.attitude.time_s, value))


def test_a_compass_that_is_off_by_its_heading_is_told_from_a_gyro_beside_it(turning):
    case, dive = turning
    nominal = planted_nominal(case)
    left = []
    for each in (dive, deviated(dive, 0.08, 0.7)):
        (heading,) = of_kind(SimpleNamespace(witnesses=witnesses(each, case.file, nominal.course)), "heading")
        by_deviation = heading.known @ np.linalg.lstsq(heading.known, heading.off)[0]
        left.append((np.std(heading.off), np.std(heading.off - by_deviation)))
    assert left[1][0] > 5.0 * left[0][0]
    assert left[1][1] < 1.1 * left[0][1]


def test_a_compass_deviation_is_a_nuisance_too_where_its_heading_is_among_the_readings(turning):
    case, dive = turning
    unheard = dict.fromkeys(("fog", "nu_fb", "tau_pid", "nu_ref"))
    nominal = planted_nominal(case, dive=replace(dive, **unheard))
    rows, course = regression_of(nominal.joint, nominal.theta, ()), nominal.course
    loose, known = rows.with_deviation(course), rows.nuisance.width
    attitude = np.zeros_like(course.euler)
    attitude[:, 2] = 0.1 * (np.sin(course.euler[:, 2]) - np.sin(course.euler[0, 2]))
    (column,) = rows.columns([Act(attitude=attitude)], course).T
    assert np.any(column)
    np.testing.assert_allclose(loose.nuisance.dense()[:, known], column, atol=1e-9)
    np.testing.assert_array_equal(loose.nominal_precision[known:], np.ones(4))


@pytest.mark.parametrize(("turned_rad", "least", "most"), [(4.71, 0.88, 0.91), (9.42, 0.0, 0.05)])
def test_over_three_quarters_of_a_turn_a_compass_deviation_takes_up_nine_tenths_of_a_gyros_scale_and_later_hardly_any(
    turned_rad, least, most
):
    """Of the angle by a scale that is off by 3 %, beside a heading that is read to 4 mrad."""
    heading = np.linspace(0.0, turned_rad, 400)
    off = 0.03 * (heading - heading.mean()) / 0.004
    columns = deviations(heading) / 0.004
    columns -= columns.mean(axis=0)
    size = np.linalg.solve(columns.T @ columns + np.eye(4), columns.T @ off)
    taken = 1.0 - np.std(off - columns @ size) / np.std(off)
    assert least < taken < most


@pytest.mark.parametrize(("turned_rad", "possible"), [(4.6, False), (4.8, True), (-4.8, True)])
def test_a_gyros_scale_shows_over_most_of_a_turn_alone_for_over_less_a_compass_deviation_looks_the_same(
    honest, turned_rad, possible
):
    course = honest.course
    euler = np.zeros_like(course.euler)
    euler[:, 2] = np.angle(np.exp(1j * np.linspace(1.0, 1.0 + turned_rad, len(euler))))
    assert GYRO_SCALE.possible(replace(course, euler=euler), np.array([1.05])) == possible


def test_a_dive_with_commands_for_a_few_seconds_alone_has_no_heading_to_compare(case_and_nominal):
    dive = dive_of(case_and_nominal[0])
    start_s = dive.span_s[0] + 40.0
    few = {name: getattr(dive, name).between(start_s, start_s + 9.0) for name in ("pwm", "tau_cmd")}
    short = planted_nominal(case_and_nominal[0], replace(dive, **few))
    assert short.course.since_s[-1] < 10.0
    assert of_kind(short, "heading") == []


def test_an_accelerometer_that_is_tilted_reads_gravity():
    case, nominal = nominal_with(["imu_gravity_leak"])
    tilt = case.truth()["effects"][0]["parameters"]
    act = IMU_GRAVITY_LEAK.act(nominal.course, np.array([tilt["roll"], tilt["pitch"]]))
    for witness in of_kind(nominal, "specific_force"):
        assert witness.off.mean() == pytest.approx(witness.of(act).mean(), abs=0.01)


def test_a_push_on_the_hull_is_seen_by_none_of_them(honest):
    act = THRUST_BIAS.act(honest.course, np.array([1.0, 0.0, 0.0, 0.0]))
    assert all(witness.of(act) is None for witness in honest.witnesses)


STEPS_S = np.cumsum(np.random.default_rng(300_902).uniform(1.5, 4.0, 25))
PULSES_US = np.array([1500.0, *(np.tile([1620.0, 1400.0, 1560.0], 9)[:25])])


class Stepped:
    """Shafts that follow steps of their pulses by a lag, in closed form, and are told `late_s` later."""

    def __init__(self, case, course, late_s, more_lag_s=0.0):
        curve, count = case.file.vehicle.thrust_curve, course.asked_n.shape[1]
        self.lag_s = curve.lag_s + more_lag_s
        self.steps_s = course.time_s[np.searchsorted(course.time_s, STEPS_S)]
        self.asked_n = thrust_curve(curve, case.file.path.parent).thrust(PULSES_US)
        time_s = np.arange(0.0, 100.0, 0.05)
        shaft = 60.0 * shaft_speed(curve, self.thrust_n(time_s - late_s))
        self.dive = replace(
            dive_of(case),
            pwm=Signal(np.concatenate([[0.0], self.steps_s]), np.tile(PULSES_US[:, None], count)),
            rpm=Signal(time_s, np.tile(shaft[:, None], count)),
            attitude=None,
        )
        asked_n = self.asked_n[np.searchsorted(self.steps_s, course.time_s, side="right")]
        self.course = replace(course, asked_n=np.tile(asked_n[:, None], count))
        self.shafts = witnesses(self.dive, case.file, self.course)

    def thrust_n(self, time_s):
        """(n,) at times, each step fading in by itself."""
        since_s = np.maximum(time_s[:, None] - self.steps_s, 0.0)
        return self.asked_n[0] + (1.0 - np.exp(-since_s / self.lag_s)) @ np.diff(self.asked_n)


@pytest.mark.parametrize("late_s", [-0.05, 0.0, 0.2])
def test_speeds_that_are_told_late_are_nobodys_evidence_to_the_last_newton(case_and_nominal, late_s):
    case, nominal = case_and_nominal
    stepped = Stepped(case, nominal.course, late_s)
    assert len(stepped.shafts) == nominal.course.asked_n.shape[1]
    for shaft in stepped.shafts:
        size, *_ = np.linalg.lstsq(shaft.known, shaft.off, rcond=None)
        np.testing.assert_allclose(shaft.known @ size, shaft.off, atol=1e-9)
        assert (np.abs(shaft.off).max() > 0.1) == (late_s != 0.0)


def test_a_reading_goes_astray_by_what_the_thrust_changes_by_within_its_dates_jitter(case_and_nominal):
    case, nominal = case_and_nominal
    stepped = Stepped(case, nominal.course, 0.0)
    shaft = stepped.shafts[0]
    time_s = shaft.bins.time_s
    changed = stepped.thrust_n(time_s + 0.03) - stepped.thrust_n(time_s - 0.03)
    np.testing.assert_allclose(shaft.timing_std, shaft.bins.mean(0.5 * np.abs(changed)), atol=1e-9)
    assert shaft.timing_std.max() > 0.1
    weights = weighed_witness(shaft, [], nominal.course)
    assert np.all(weights.std >= 0.5 * shaft.timing_std)


def beyond(known, values):
    return np.linalg.norm(values - known @ np.linalg.lstsq(known, values, rcond=None)[0])


def test_telemetry_may_be_late_with_what_a_slower_thruster_does_too(case_and_nominal):
    case, nominal = case_and_nominal
    stepped = Stepped(case, nominal.course, 0.1, more_lag_s=0.25)
    shaft = stepped.shafts[0]
    act = thruster_lag(nominal.course.lag_s)[0].act(stepped.course, np.array([stepped.lag_s]))
    left = shaft.off - shaft.of(act)
    following = weighed_witness(shaft, [act], stepped.course).witness
    assert beyond(following.known, left) < 0.1 * beyond(shaft.known, left)
    np.testing.assert_array_equal(weighed_witness(shaft, [], stepped.course).witness.known, shaft.known)


@pytest.mark.parametrize("off_s", [-0.02, 0.02])
def test_shafts_say_nothing_of_a_lag_that_is_other_by_no_more_than_a_course_rounds(case_and_nominal, off_s):
    nominal = case_and_nominal[1]
    lag_s = nominal.course.lag_s
    act = thruster_lag(lag_s)[0].act(nominal.course, np.array([lag_s + off_s]))
    for shaft in of_kind(nominal, "shaft"):
        seen = shaft.of(act)
        assert beyond(shaft.known, seen) < 0.03 * np.linalg.norm(seen)


def test_an_accelerometer_reads_the_motion_in_a_turning_frame_and_gravity():
    rng, time_s = np.random.default_rng(5), 0.05 * np.arange(400)
    nu, nu_dot, down = (np.tile(rng.uniform(0.2, 0.6, size), (400, 1)) for size in (6, 6, 3))
    felt = nu_dot[:, :3] + np.cross(nu[:, 3:], nu[:, :3]) - 9.80665 * down
    course = SimpleNamespace(time_s=time_s, nu=nu, nu_dot=nu_dot, world=(None, None, down))
    dive = SimpleNamespace(specific_force=Signal(time_s, felt), attitude=True)
    ahead, aside = _accelerometer(dive, course)
    assert (ahead.number, aside.number) == (0, 1)
    for witness in (ahead, aside):
        assert witness.off == pytest.approx(np.zeros(len(witness.off)), abs=1e-9)
