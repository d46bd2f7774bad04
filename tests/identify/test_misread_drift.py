"""What an autopilot's misread velocity makes of the moments that turn a drifting hull."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from bench.field.draw import NONE, draw
from bridge.vehicle.coefficients import HEAVE, PITCH, SURGE, SWAY, YAW
from bridge.vehicle.config import load_vehicle
from identify.dive import Signal
from identify.estimators.axes.build import build_axes
from identify.estimators.axes.motion import Motion
from identify.estimators.axes.readings import Pose, with_heave_of_depth
from identify.estimators.filter.state import POSITION
from identify.estimators.filter.transitions import transitions
from identify.estimators.likelihood.axis import DAMPING, DISTURBANCE, MASS
from identify.estimators.likelihood.fit import rough_fit
from identify.estimators.likelihood.misread_drift import error_by_depth, with_misread_drift
from identify.ingest.open import read_dive


@pytest.fixture(scope="module")
def begun(tmp_path_factory):
    """The rough fit of a sound dive, and the motion that it was made of."""
    folder = tmp_path_factory.mktemp("field")
    case = draw(11, 4, NONE, seconds=100.0)
    vehicle, log = folder / "vehicle.yaml", folder / "dive.tlog"
    vehicle.write_text(case.vehicle.text, encoding="utf-8")
    log.write_bytes(case.recording(0))
    file = load_vehicle(str(vehicle))
    (name,) = file.vehicle.configurations
    built = build_axes(read_dive(log, None, file), file, name)
    return rough_fit(built, file.vehicle.configurations[name], ()).value, built.motion


def of_steps(joint, dof):
    """The standard deviation that misread velocities add to the disturbance, per inertia, by step (n,)."""
    axis = next(problem.axis for problem in joint.problems if problem.axis.dof == dof)
    return axis, np.broadcast_to(axis.misread, axis.different_s.shape)[np.maximum(axis.step, 0)]


def test_misread_velocities_turn_a_fast_hull_and_no_slow_one(begun):
    fit, motion = begun
    theta, errors = fit.maximum.theta.copy(), []
    for problem, of_axis in zip(fit.joint.problems, fit.joint.slices, strict=True):
        if problem.axis.dof in (SURGE, SWAY):
            errors.append(problem.coloured(theta[of_axis])[0])
        # A hull much heavier to the side is turned the harder.
        theta[of_axis.start + MASS] += problem.axis.dof == SWAY
    masses = fit.joint.at(theta)[0].masses
    axis, misread = of_steps(with_misread_drift(fit.joint, theta, motion), YAW)
    speed = np.interp(axis.time_s, motion.time_s, np.hypot(*motion.nu[:, [SURGE, SWAY]].T))
    slow, fast = speed < 0.02, speed > 0.9 * speed.max()
    assert slow.any()
    assert not misread[slow].any()
    expected = (masses[SWAY] - masses[SURGE]) / masses[YAW] * speed.max() * np.mean(errors)
    # Levels of it are a factor of two apart.
    assert 0.5 * expected < np.median(misread[fast]) < 2.0 * expected


def test_a_hull_that_is_heavier_in_all_is_turned_by_misread_velocities_as_much_as_before(begun):
    """Else a fit makes the inertia, the righting moment and the masses that turn the hull larger by one factor, and the
    misread moments small beside them."""
    fit, _ = begun
    theta = fit.maximum.theta
    yaw = next(k for k, problem in enumerate(fit.joint.problems) if problem.axis.dof == YAW)
    problem, own = fit.joint.at(theta)[yaw], theta[fit.joint.slices[yaw]].copy()
    axis = problem.axis
    problem = problem.with_axis(
        replace(axis, misread=np.array([0.3]), white_times=np.zeros_like(axis.white_times))
    )
    own[DISTURBANCE] = -40.0
    heavier = own.copy()
    heavier[[MASS, DAMPING]] += np.log(2.0)
    table, of_heavier = (problem.transition_table(values)[:, 11:17] for values in (own, heavier))
    # Variances of angle and rate are the same, that of the moment is four times as large.
    assert np.unique(np.round(of_heavier / table, 6)).tolist() == [1.0, 2.0, 4.0]


def test_a_velocity_without_an_error_of_its_own_misreads_nothing(begun):
    fit, motion = begun
    turning = [problem for problem in fit.joint.problems if problem.axis.dof > 2]
    joint = replace(fit.joint, problems=tuple(turning))
    assert with_misread_drift(joint, fit.maximum.theta, motion) is joint


def test_a_step_with_a_larger_disturbance_lets_the_hull_be_turned_by_more():
    step_s, sigma = np.full(2, 0.05), np.array([0.02, 0.06])
    table = transitions(step_s, 0.4, np.array([0.3]), 5.0, sigma, 1.5, 0.1, np.zeros(2), 0.0, 1.0, 0.0)
    assert table[1, :11] == pytest.approx(table[0, :11], rel=1e-12)
    assert table[1, 11:17] == pytest.approx(9.0 * table[0, 11:17], rel=1e-9)


def test_a_surge_that_pitches_the_hull_does_so_by_the_heave_that_depth_tells(begun):
    fit, motion = begun
    own, exact = fit.maximum.theta, fit.maximum.theta.copy()
    for problem, of_axis in zip(fit.joint.problems, fit.joint.slices, strict=True):
        if problem.axis.dof == HEAVE:
            (depth,) = np.unique(problem.axis.channel[problem.axis.state_read == POSITION])
            exact[of_axis.start + problem.noise_index + depth] -= 12.0
    ahead, sinking = np.abs(motion.nu[:, [SURGE, HEAVE]]).T
    fast = (ahead > 0.8 * ahead.max()) & (sinking < 0.05 * ahead)
    pitching = []
    for theta in (own, exact):
        axis, misread = of_steps(with_misread_drift(fit.joint, theta, motion), PITCH)
        pitching.append(np.median(misread[np.interp(axis.time_s, motion.time_s, fast) == 1.0]))
    assert pitching[1] < 0.3 * pitching[0]


@pytest.mark.parametrize("begins_s", [(), (149.97,)])
def test_depth_mends_the_slow_error_of_a_heave_velocity_to_the_expected_remainder(begins_s):
    std, memory_s, noise_m, spacing_s = 0.011, 3.0, 0.003, 0.1
    rng, time_s = np.random.default_rng(7), np.arange(0.0, 400.0, 0.02)
    keep = np.exp(-0.02 / memory_s)
    error = lfilter([std * np.sqrt(1.0 - keep**2)], [1.0, -keep], rng.standard_normal(len(time_s)))
    sinking = 0.15 * np.sin(0.8 * time_s)
    nu = np.zeros((len(time_s), 6))
    nu[:, HEAVE] = sinking + error
    motion = Motion(time_s, nu, np.array(begins_s))
    read_s = time_s[::5]
    depth = np.interp(read_s, time_s, motion.integral(sinking)) + noise_m * rng.standard_normal(len(read_s))
    # Another run begins at another depth.
    depth += 2.0 * np.searchsorted(begins_s, read_s)
    mended = with_heave_of_depth(motion, Pose(Signal(read_s, depth[:, None]), np.zeros(len(time_s))))
    left = np.std(mended.nu[:, HEAVE] - sinking)
    assert left == pytest.approx(error_by_depth(std, memory_s, noise_m, spacing_s), rel=0.2)
    assert left < 0.4 * np.std(error)
    assert not mended.nu[:, :HEAVE].any()


def test_depth_that_says_less_than_a_velocity_leaves_its_error():
    assert error_by_depth(0.01, 1.0, 10.0, 1.0) == 0.01
