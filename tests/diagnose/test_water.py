"""Water that moves: the model goes by the velocity through it, the readings by that over ground."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from bench.missions.mission import draw_one
from identify.diagnose.accepted_before import with_accepted
from identify.diagnose.causes.candidates import Cause
from identify.diagnose.filters.innovations import reading_error
from identify.diagnose.filters.nominal import _alike, nominal_of, refitted
from identify.diagnose.gap.simulation import beyond_motion_of, velocity_error_of
from identify.dive import Signal
from identify.effects.environment import STEADY_CURRENT
from identify.effects.hydrodynamics import QUADRATIC_DRAG
from identify.estimators.axes.axis import Axis
from identify.estimators.filter.state import VELOCITY
from identify.estimators.likelihood.axis import AxisLikelihood
from identify.ingest.rotation import attitude_at, to_body

CURRENT = np.array([0.12, -0.08])


@pytest.fixture(scope="module")
def still_and_drifting():
    """The nominal models of a dive, and of the same dive read over a bottom that the water moves past."""
    mission = draw_one(100_302, seconds=120.0)
    dive = mission.dive
    attitude = attitude_at(dive.attitude, dive.velocity.time_s)
    water = to_body(attitude, np.tile([*CURRENT, 0.0], (len(attitude), 1)))
    drifting = replace(dive, velocity=Signal(dive.velocity.time_s, dive.velocity.value + water))
    return tuple(nominal_of(recording, mission.file, mission.configuration) for recording in (dive, drifting))


def test_less_its_current_a_dive_is_one_in_still_water(still_and_drifting):
    still, drifting = still_and_drifting
    less = drifting
    for _ in range(3):
        less = refitted(drifting, [STEADY_CURRENT.act(less.course, CURRENT)], less)
    np.testing.assert_allclose(less.course.mass[:2], still.course.mass[:2], rtol=0.01)
    np.testing.assert_allclose(less.course.damping[:2], still.course.damping[:2], rtol=0.02)
    np.testing.assert_allclose(less.course.nu[50:, :2], still.course.nu[50:, :2], atol=0.01)
    ground, _ = less.course.over_ground
    np.testing.assert_allclose(ground[50:, :2], drifting.course.nu[50:, :2], atol=0.02)


def test_the_drag_beside_a_current_is_that_of_the_speed_through_the_water(still_and_drifting):
    still, drifting = still_and_drifting
    less = refitted(drifting, [STEADY_CURRENT.act(drifting.course, CURRENT)])
    again = refitted(drifting, less.acts, less)
    for k in (0, 1):
        speed = still.joint.problems[k].axis.speed[50:]
        assert np.median(np.abs(drifting.joint.problems[k].axis.speed[50:] - speed)) > 0.05
        for fit in (less, again):
            np.testing.assert_allclose(fit.joint.problems[k].axis.speed[50:], speed, atol=0.02)


def test_an_accepted_current_is_known_in_every_further_fit(still_and_drifting):
    _, drifting = still_and_drifting
    accepted = with_accepted(drifting, (Cause(STEADY_CURRENT, CURRENT),))
    further = STEADY_CURRENT.act(accepted.course, np.array([0.01, 0.0]))
    both = STEADY_CURRENT.act(accepted.course, CURRENT + np.array([0.01, 0.0]))
    np.testing.assert_allclose(refitted(accepted, [further]).course.water, both.water, atol=1e-9)


def test_an_autopilot_shows_a_current_in_body_axes_of_as_long_ago_as_it_smooths(still_and_drifting):
    """It smooths velocity over ground in north and east, and turns it by the attitude of that time."""
    _, drifting = still_and_drifting
    problem, course = drifting.joint.problems[0], drifting.course
    course = replace(course, euler=np.column_stack([0.0 * course.euler[:, :2], 0.5 * course.since_s]))
    act = STEADY_CURRENT.act(course, CURRENT)
    late = replace(problem, axis=replace(problem.axis, smoothing_s=0.2))
    off = reading_error(late, act, course)
    heading = 0.5 * (problem.axis.time_s - 0.2 - course.time_s[0])
    seen = (problem.axis.state_read == VELOCITY) & (problem.axis.time_s > course.time_s[0] + 1.0)
    expected = CURRENT[0] * np.cos(heading) + CURRENT[1] * np.sin(heading)
    np.testing.assert_allclose(off[seen], expected[seen], atol=1e-4)


def test_a_current_is_no_error_of_a_sensor(still_and_drifting):
    _, drifting = still_and_drifting
    course, cause = drifting.course, Cause(STEADY_CURRENT, CURRENT)
    assert not velocity_error_of([cause], course).any()
    np.testing.assert_allclose(
        beyond_motion_of([cause], course)[:, :3], STEADY_CURRENT.act(course, CURRENT).water
    )


def test_what_the_filter_of_an_autopilot_is_off_by_is_that_of_its_quieter_axis(still_and_drifting):
    still, _ = still_and_drifting
    coloured = replace(still.joint.problems[0].axis.channels[0], coloured=0.015)

    def with_colour(axis: Axis) -> Axis:
        return replace(axis, channels=(coloured, *axis.channels[1:]))

    problems = tuple(replace(problem, axis=with_colour(problem.axis)) for problem in still.joint.problems[:2])
    joint = replace(still.joint, problems=problems)
    theta = np.concatenate([still.theta[of_axis] for of_axis in joint.slices])
    surge, sway = (
        of_axis.start + problem.coloured_index
        for of_axis, problem in zip(joint.slices, problems, strict=True)
    )
    theta[[surge, sway]] = np.log([0.032, 0.005])
    tied, at = _alike(joint, theta, (0, 1, 2))
    assert np.exp(at[[surge, sway]]) == pytest.approx([0.005, 0.005])
    assert [np.exp(problem.prior_mean[problem.coloured_index]) for problem in tied.problems] == pytest.approx(
        [0.005, 0.005]
    )
    same, where = _alike(joint, theta, ())
    assert same is joint
    assert where is theta


def test_a_current_of_half_a_minute_is_no_error_of_an_autopilots_velocity():
    """It would be taken up on every heading, and nothing would be left of it; an error of a second is as it was."""
    axis = SimpleNamespace(axis=SimpleNamespace(is_coloured=True), coloured_index=0)
    assert AxisLikelihood.coloured(axis, np.log([0.07, 35.0])) == pytest.approx((0.07, 5.0), rel=1e-3)
    assert AxisLikelihood.coloured(axis, np.log([0.02, 1.0])) == pytest.approx((0.02, 1.0), rel=1e-3)


def test_a_known_quadratic_drag_is_in_the_filters_and_no_force_beside_them(still_and_drifting):
    still, _ = still_and_drifting
    drag = QUADRATIC_DRAG.act(still.course, np.array([20.0, 0, 0, 0, 0, 0]))
    braked = refitted(still, [drag])
    np.testing.assert_array_equal(braked.joint.problems[0].axis.force, still.joint.problems[0].axis.force)
    assert braked.course.quadratic[0] == 20.0
    # What is given back to the regression is the drag at the speeds that braked.
    speed = braked.course.nu[:, 0]
    np.testing.assert_allclose(braked.acts[0].wrench[:, 0], -20.0 * np.abs(speed) * speed)
    assert np.abs(braked.acts[0].wrench - drag.wrench).max() > 0.01
    assert braked.course.damping[0] < still.course.damping[0]
