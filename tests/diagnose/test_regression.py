"""The regression of a dive: exact where the filters are linear."""

from dataclasses import replace

import numpy as np
import pytest

from bench.missions.mission import draw_one
from identify.diagnose.evidence import equations_of
from identify.diagnose.innovations import mean_before, predicted, value_before
from identify.diagnose.nominal import nominal_of
from identify.diagnose.regression import MASS_OFF, piece_s, regression_of
from identify.effects.effect import Act
from identify.estimators.motion import Motion


@pytest.fixture(scope="module")
def nominal():
    mission = draw_one(100_300, seconds=60.0)
    return nominal_of(mission.dive, mission.file, mission.configuration)


@pytest.fixture(scope="module")
def rows(nominal):
    return regression_of(nominal.joint, nominal.theta, ())


def innovations(problem, theta):
    error, _ = problem.filtered(theta, np.inf)
    return error[np.isfinite(problem.reading)]


def test_a_force_that_the_filter_knows_takes_out_of_its_innovations_what_its_column_says(rows):
    own = rows.axes[0]
    force = np.sin(0.7 * own.problem.axis.time_s)
    told = replace(own.problem, axis=replace(own.problem.axis, force=own.problem.axis.force + force[:, None]))
    change = innovations(told, own.theta) - innovations(own.problem, own.theta)
    np.testing.assert_allclose(-change / own.std, own.by_force(force[:, None])[:, 0], atol=1e-9)


def test_readings_that_are_off_add_to_the_innovations_what_their_column_says(rows):
    for own in rows.axes:
        off = np.cos(0.3 * own.problem.axis.time_s)
        spoilt = replace(own.problem, reading=own.problem.reading + off)
        change = innovations(spoilt, own.theta) - innovations(own.problem, own.theta)
        np.testing.assert_allclose(change / own.std, own.by_reading(off[:, None])[:, 0], atol=1e-8)


def test_an_act_adds_to_the_axes_that_it_touches_and_to_no_other(nominal, rows):
    wrench = np.zeros((len(nominal.course.time_s), 6))
    wrench[:, 1] = 1.0
    column = rows.columns([Act(wrench=wrench)], nominal.course)[:, 0]
    assert np.any(column[rows.dof == 1])
    assert not np.any(column[rows.dof != 1])


def test_at_the_maximum_no_nominal_parameter_would_explain_any_more(rows):
    slope = rows.nuisance.crossed(rows.value[:, None])[:, 0]
    std = np.sqrt(np.diag(rows.nuisance.square()))
    assert np.abs(slope / std).max() < 1.5


def test_what_is_expected_at_a_time_knows_no_reading_from_then_on(nominal):
    middle = float(np.median(nominal.course.time_s))
    problems = tuple(
        replace(one, reading=one.reading + np.where(one.axis.time_s >= middle, 0.05, 0.0))
        for one in nominal.joint.problems
    )
    joint = replace(nominal.joint, problems=problems)
    before = predicted(nominal.joint, nominal.theta, nominal.motion)
    after = predicted(joint, nominal.theta, nominal.motion)
    early = before.time_s <= middle
    np.testing.assert_array_equal(after.nu[early], before.nu[early])
    assert np.abs(after.nu[~early] - before.nu[~early]).max() > 0.01


def test_nor_does_it_know_a_thrust_that_a_controller_gives_in_answer_to_a_reading_of_that_time(nominal):
    """Readings and the grid share times here: the commands that follow a reading carry its noise."""
    own = nominal.joint.problems[0]
    read = own.axis.time_s[np.isfinite(own.reading)]
    at = float(read[len(read) // 2])
    problems = tuple(
        replace(
            one,
            axis=replace(one.axis, force=one.axis.force + np.where(one.axis.time_s > at, 5.0, 0.0)[:, None]),
        )
        for one in nominal.joint.problems
    )
    joint = replace(nominal.joint, problems=problems)
    step_s = float(nominal.motion.time_s[1] - nominal.motion.time_s[0])
    near = at + 1e-9 + step_s * np.arange(-40, 40)
    motion = Motion(near, np.zeros((80, 6)))
    before, after = (predicted(one, nominal.theta, motion) for one in (nominal.joint, joint))
    known = near < at + 1e-6
    np.testing.assert_array_equal(after.nu_dot[known], before.nu_dot[known])
    assert np.abs(after.nu_dot - before.nu_dot).max() > 0


def test_an_acceleration_between_readings_is_that_of_a_step_during_which_something_pushed(nominal):
    """Of several readings at one time all but the first end an empty step, in which no force means anything."""
    empty = [one.axis.step_s[1:] <= 0 for one in nominal.joint.problems]
    assert any(one.any() for one in empty)
    problems = tuple(
        replace(
            one,
            axis=replace(one.axis, force=np.where(one.axis.step_s[:, None] > 0, one.axis.force, 1e6)),
        )
        for one in nominal.joint.problems
    )
    joint = replace(nominal.joint, problems=problems)
    clean, spoilt = (predicted(one, nominal.theta, nominal.motion) for one in (nominal.joint, joint))
    # The first event of all ends no step.
    np.testing.assert_array_equal(spoilt.nu_dot[10:], clean.nu_dot[10:])


def test_a_moment_of_drift_counts_by_what_it_is_beyond_the_masses_that_an_autopilots_filter_bends(
    nominal, rows
):
    course, size = nominal.course, 0.1
    wrench = np.zeros_like(course.nu)
    wrench[:, 5] = np.hypot(course.mass[0], course.mass[1]) * course.drifting[:, 0] * course.drifting[:, 1]
    loose = rows.with_drift_moments(course)
    column = loose.columns([Act(wrench=wrench)], course)
    only = loose.nuisance.dense()[:, -1:]
    np.testing.assert_allclose(only, column, atol=1e-9)
    told = equations_of(
        size * column[:, 0], 0.0 * only, loose.nominal_precision[-1:], column, np.zeros(len(column), np.intp)
    )
    beside = equations_of(
        size * column[:, 0], only, loose.nominal_precision[-1:], column, np.zeros(len(column), np.intp)
    )
    information = float(column[:, 0] @ column[:, 0])
    assert told.fitted([[0]])[0] == pytest.approx(0.5 * size**2 * information)
    # Evidence of a size beside one that is known to MASS_OFF.
    assert beside.fitted([[0]])[0] == pytest.approx(0.5 * size**2 / (1.0 / information + MASS_OFF**2))


def test_thrust_in_yaw_may_be_of_another_scale_and_no_other(rows):
    scaled = rows.with_thrust_scale()
    (yaw,) = (axis for axis in rows.axes if axis.problem.axis.dof == 5)
    column = scaled.nuisance.dense()[:, -1]
    assert scaled.nuisance.width == rows.nuisance.width + 1
    assert not column[rows.dof != 5].any()
    force = yaw.problem.axis.force.mean(axis=1)[:, None]
    np.testing.assert_allclose(column[rows.dof == 5], yaw.prewhitened(yaw.by_force(force))[:, 0])


def test_a_mean_up_to_a_time_is_the_same_whatever_comes_after_and_exact_for_straight_lines():
    time_s = np.arange(0.0, 2.0, 0.02)
    line = 3.0 - 2.0 * time_s
    ends = np.array([0.5, 0.777, 1.31])
    starts = ends - 0.1
    np.testing.assert_allclose(mean_before(time_s, line, starts, ends), 3.0 - (starts + ends))
    np.testing.assert_allclose(value_before(time_s, line, ends), 3.0 - 2.0 * ends)
    later = np.where(time_s > 0.777, 100.0, line)
    assert mean_before(time_s, later, starts[1:2], ends[1:2]) == pytest.approx(3.0 - (0.677 + 0.777))
    assert value_before(time_s, later, ends[1:2]) == pytest.approx(3.0 - 2.0 * 0.777)


class TestEvidence:
    def made(self, size, rng):
        piece = np.repeat(np.arange(40), 100)
        nominal, cause, idle = rng.normal(size=(3, 4000))
        value = 0.5 * nominal + size * cause + rng.normal(size=4000)
        columns = np.column_stack([cause, idle])
        return equations_of(value, nominal[:, None], np.zeros(1), columns, piece)

    def test_a_cause_is_found_with_its_size_and_standard_error(self):
        found = self.made(0.3, np.random.default_rng(0)).evidence([0])
        std = float(np.sqrt(found.covariance[0, 0]))
        assert std == pytest.approx(1 / np.sqrt(4000), rel=0.1)
        assert abs(found.size[0] - 0.3) < 3 * std
        assert found.gain == pytest.approx(0.5 * 4000 * 0.3**2, rel=0.2)
        assert found.gain < found.fitted

    def test_a_column_that_explains_nothing_costs_on_pieces_held_out_what_its_error_does(self):
        rng = np.random.default_rng(1)
        gains = [self.made(0.0, rng).evidence([1]).gain for _ in range(60)]
        assert np.mean(gains) == pytest.approx(-0.5 * 5 / 4, abs=0.35)
        assert max(gains) < 6.0

    def test_a_copy_of_a_nominal_column_is_nobodys_evidence(self):
        rng = np.random.default_rng(2)
        nominal = rng.normal(size=(1000, 1))
        value = 2.0 * nominal[:, 0] + rng.normal(size=1000)
        sums = equations_of(value, nominal, np.zeros(1), 3.0 * nominal, np.repeat(np.arange(20), 50))
        assert sums.evidence([0]).gain == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize(("lasting_s", "each_s"), [(600.0, 20.0), (200.0, 20.0), (90.0, 9.0), (29.0, 6.0)])
def test_a_short_dive_has_two_pieces_for_each_fold_as_long_as_a_drift_fits_into_them(lasting_s, each_s):
    assert piece_s(lasting_s) == pytest.approx(each_s)
