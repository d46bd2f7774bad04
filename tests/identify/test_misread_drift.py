"""What an autopilot's misread velocity makes of the moments that turn a drifting hull."""

from dataclasses import replace

import numpy as np
import pytest

from bench.field.draw import NONE, draw
from bridge.vehicle.coefficients import SURGE, SWAY, YAW
from bridge.vehicle.config import load_vehicle
from identify.estimators.axes.build import build_axes
from identify.estimators.filter.transitions import transitions
from identify.estimators.likelihood.axis import MASS
from identify.estimators.likelihood.fit import rough_fit
from identify.estimators.likelihood.misread_drift import with_misread_drift
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
    """The standard deviation that misread velocities add to the disturbance, by step (n,)."""
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
    expected = (masses[SWAY] - masses[SURGE]) * speed.max() * np.mean(errors)
    # Levels of it are a factor of two apart.
    assert 0.5 * expected < np.median(misread[fast]) < 2.0 * expected


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
