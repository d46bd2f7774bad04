"""The regression of a dive: exact where the filters are linear, whole or by blocks."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from bridge.vehicle.coefficients import YAW
from identify.diagnose.causes.candidates import Cause
from identify.diagnose.causes.evidence import (
    Block,
    Blocks,
    Candidates,
    equations_of,
    inverse,
    pieces_of,
    products_of,
)
from identify.diagnose.causes.weighing import rows_of, weighing_of
from identify.diagnose.filters.innovations import (
    TOGETHER,
    Autoregression,
    autoregression_of,
    autoregressions_of,
    early_half,
    mean_before,
    means_before,
    push_of,
    value_before,
)
from identify.diagnose.filters.judged_axes import thinned, without_quick
from identify.diagnose.filters.nominal import _unsmoothed
from identify.diagnose.filters.predicted import Predicted, euler_ahead, position, predicted, reading_ahead
from identify.diagnose.filters.regression import (
    Regression,
    delayed_thrust,
    mean_indices,
    piece_s,
    regression_of,
    steady_trims,
)
from identify.dive import Dive, Signal
from identify.effects.actuators import DEAD_ZONE
from identify.effects.effect import Act
from identify.effects.environment import STEADY_CURRENT
from identify.effects.hydrodynamics import COUPLED_DAMPING, QUADRATIC_DRAG
from identify.estimators.axes.motion import Motion
from identify.estimators.filter.state import VELOCITY
from identify.estimators.likelihood.axis import DAMPING, MASS
from identify.ingest.rotation import quaternions_from_euler


@pytest.fixture(scope="module")
def rows(nominal):
    return regression_of(nominal.joint, nominal.theta, ())


def innovations(problem, theta):
    error, _ = problem.filtered(theta, np.inf)
    return error[np.isfinite(problem.reading)]


def test_a_force_that_the_filter_knows_takes_out_of_its_innovations_what_its_column_says(rows):
    axis = rows.axes[0]
    force = np.sin(0.7 * axis.problem.axis.time_s)
    pushed = replace(
        axis.problem, axis=replace(axis.problem.axis, force=axis.problem.axis.force + force[:, None])
    )
    change = innovations(pushed, axis.theta) - innovations(axis.problem, axis.theta)
    np.testing.assert_allclose(-change / axis.std, axis.by_force(force[:, None])[:, 0], atol=1e-9)


def test_a_force_of_two_halves_takes_out_of_the_innovations_what_its_column_says(rows):
    for axis in rows.axes:
        time_s = axis.problem.axis.time_s
        halves = np.column_stack([np.sin(0.7 * time_s), np.cos(0.9 * time_s)])
        pushed = replace(
            axis.problem, axis=replace(axis.problem.axis, force=axis.problem.axis.force + halves)
        )
        change = innovations(pushed, axis.theta) - innovations(axis.problem, axis.theta)
        column = axis.by_force(halves.mean(axis=1)[:, None], halves[:, :1])[:, 0]
        np.testing.assert_allclose(-change / axis.std, column, atol=1e-9)


def test_the_halves_of_a_force_that_goes_straight_turn_a_body_as_far_as_it_does():
    time_s, ends = np.arange(0.0, 2.0, 0.02), np.array([0.5, 0.777, 1.31])
    starts = ends - np.array([0.05, 0.1, 0.0])
    values = np.column_stack([3.0 - 2.0 * time_s, 1.0 + 5.0 * time_s])
    means = means_before(time_s, values, starts, ends)
    early = early_half(means, time_s, values, starts, ends)
    span_s = (ends - starts)[:, None]
    at_start = np.array([3.0, 1.0]) + np.array([-2.0, 5.0]) * starts[:, None]
    # Integrated twice from rest: of a straight force, and of one held over each half.
    straight = at_start * span_s**2 / 2 + np.array([-2.0, 5.0]) * span_s**3 / 6
    np.testing.assert_allclose(span_s**2 / 8 * (3.0 * early + (2.0 * means - early)), straight, atol=1e-12)


def test_the_thrust_of_all_thrusters_along_a_course_answers_as_the_thrust_that_the_filters_know(
    rows, nominal
):
    """Held over all of a step it turns the hull by another angle, and a fibre-optic gyro reads that: beside a weak
    thruster the centre of mass was off."""
    (yaw,) = (axis for axis in rows.axes if axis.problem.axis.dof == 5)
    force, course = yaw.problem.axis.force, nominal.course
    means = force.mean(axis=1)[:, None]
    exact, held = (yaw.prewhitened(yaw.by_force(means, early)) for early in (force[:, :1], means))
    along = yaw.by_course(course, [course.wrench_of(course.thrust_n)[:, 5]])
    assert np.std(along - exact) < 0.25 * np.std(held - exact)


def test_water_that_moves_pushes_a_filter_by_what_turning_makes_of_it_but_in_roll_and_pitch(nominal):
    act = STEADY_CURRENT.act(nominal.course, np.array([0.1, 0.2]))
    pushes = push_of(act, nominal.course).by_dof
    assert set(pushes) == {0, 1, 2, YAW}
    for dof, push in pushes.items():
        np.testing.assert_array_equal(push, nominal.course.turned_by(act.water)[:, dof])


@pytest.mark.parametrize("count", [1, TOGETHER, TOGETHER + 1])
def test_forces_along_a_course_answer_as_their_means_over_each_step_do(nominal, rows, count):
    course, rng = nominal.course, np.random.default_rng(2)
    forces = [rng.standard_normal(len(course.time_s)) for _ in range(count)]
    for innovations in rows.axes:
        axis = innovations.problem.axis
        means = means_before(course.time_s, np.column_stack(forces), axis.before_s, axis.time_s)
        early = early_half(means, course.time_s, np.column_stack(forces), axis.before_s, axis.time_s)
        placed = np.any(axis.state_read != VELOCITY)
        answer = innovations.prewhitened(innovations.by_force(means, early if placed else means))
        assert np.allclose(innovations.by_course(course, forces, room=2)[:, :count], answer, atol=1e-12)
        assert np.allclose(innovations.by_course(course, forces), answer, atol=1e-12)


def test_readings_that_are_off_add_to_the_innovations_what_their_column_says(rows):
    for axis in rows.axes:
        off = np.cos(0.3 * axis.problem.axis.time_s)
        spoilt = replace(axis.problem, reading=axis.problem.reading + off)
        change = innovations(spoilt, axis.theta) - innovations(axis.problem, axis.theta)
        np.testing.assert_allclose(change / axis.std, axis.by_reading(off[:, None])[:, 0], atol=1e-8)


def test_what_is_expected_at_a_time_knows_no_reading_from_then_on(nominal):
    middle = float(np.median(nominal.course.time_s))
    problems = tuple(
        replace(problem, reading=problem.reading + np.where(problem.axis.time_s >= middle, 0.05, 0.0))
        for problem in nominal.joint.problems
    )
    joint = replace(nominal.joint, problems=problems)
    before = predicted(nominal.joint, nominal.theta, nominal.motion)
    after = predicted(joint, nominal.theta, nominal.motion)
    early = before.time_s <= middle
    np.testing.assert_array_equal(after.nu[early], before.nu[early])
    assert np.abs(after.nu[~early] - before.nu[~early]).max() > 0.01


def test_nor_does_it_know_a_thrust_that_a_controller_gives_in_answer_to_a_reading_of_that_time(nominal):
    """Readings and the grid share times here: the commands that follow a reading carry its noise."""
    first = nominal.joint.problems[0]
    read = first.axis.time_s[np.isfinite(first.reading)]
    at = float(read[len(read) // 2])
    problems = tuple(
        replace(
            problem,
            axis=replace(
                problem.axis, force=problem.axis.force + np.where(problem.axis.time_s > at, 5.0, 0.0)[:, None]
            ),
        )
        for problem in nominal.joint.problems
    )
    joint = replace(nominal.joint, problems=problems)
    step_s = float(nominal.motion.time_s[1] - nominal.motion.time_s[0])
    near = at + 1e-9 + step_s * np.arange(-40, 40)
    motion = Motion(near, np.zeros((80, 6)))
    before, after = (predicted(filters, nominal.theta, motion) for filters in (nominal.joint, joint))
    known = near < at + 1e-6
    np.testing.assert_array_equal(after.nu_dot[known], before.nu_dot[known])
    assert np.abs(after.nu_dot - before.nu_dot).max() > 0


def test_an_acceleration_between_readings_is_that_of_a_step_during_which_something_pushed(nominal):
    """Of several readings at one time all but the first end an empty step, in which no force means anything."""
    empty = [problem.axis.step_s[1:] <= 0 for problem in nominal.joint.problems]
    assert any(steps.any() for steps in empty)
    problems = tuple(
        replace(
            problem,
            axis=replace(
                problem.axis, force=np.where(problem.axis.step_s[:, None] > 0, problem.axis.force, 1e6)
            ),
        )
        for problem in nominal.joint.problems
    )
    joint = replace(nominal.joint, problems=problems)
    clean, spoilt = (predicted(filters, nominal.theta, nominal.motion) for filters in (nominal.joint, joint))
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
    candidates = Candidates(column, np.zeros(len(column), np.intp))
    alone = equations_of(size * column[:, 0], 0.0 * only, loose.nominal_precision[-1:], candidates)
    both = equations_of(size * column[:, 0], only, loose.nominal_precision[-1:], candidates)
    information = float(column[:, 0] @ column[:, 0])
    assert alone.fitted([[0]])[0] == pytest.approx(0.5 * size**2 * information)
    # Evidence of a size beside one that is known to MASS_OFF.
    assert both.fitted([[0]])[0] == pytest.approx(0.5 * size**2 / (1.0 / information + 0.02**2))


def test_a_steady_push_is_a_cause_but_in_roll_and_pitch_where_a_tilted_sensor_makes_one(nominal):
    starts = {
        p.axis.dof: of.start for p, of in zip(nominal.joint.problems, nominal.joint.slices, strict=True)
    }
    assert steady_trims(nominal.joint) == [start + 4 for dof, start in starts.items() if dof not in (3, 4)]
    means = set(mean_indices(nominal.joint))
    for dof, start in starts.items():
        assert means & {start, start + 1, start + 4} == {start, start + 1} | {start + 4} & {
            starts[k] + 4 for k in (3, 4) if k in starts and k == dof
        }


def test_thrust_that_followed_what_was_not_recorded_is_free_at_each_delay_in_its_axis_alone(nominal, rows):
    free = regression_of(nominal.joint, nominal.theta, (1,))
    more = free.nuisance.dense()[:, rows.nuisance.width :]
    assert more.shape[1] > 0
    assert more[rows.dof == 1].any(axis=0).all()
    assert not more[rows.dof != 1].any()


def test_moments_of_drift_are_loose_behind_an_autopilots_filter_alone(nominal, monkeypatch):
    loose = []
    monkeypatch.setattr(Regression, "with_drift_moments", lambda rows, _: loose.append(rows) or rows)
    rows_of(nominal)
    assert not loose
    rows_of(replace(nominal, filtered=(0, 1, 2)))
    assert loose


def test_a_hull_that_coasts_behind_an_autopilots_filter_is_slowed_by_the_drag_at_its_true_speed(nominal):
    """To the first order in the filter's time: without thrust m nu_dot = -(D + X |nu|) nu."""
    smoothing_s, mass, damping, drag = 0.01, 120.0, 30.0, 80.0
    still = nominal.course
    filtered = np.zeros_like(still.nu)
    filtered[:, 0] = np.linspace(-0.8, 0.8, len(filtered))
    slowed = np.zeros_like(filtered)
    slowed[:, 0] = -(damping + drag * np.abs(filtered[:, 0])) * filtered[:, 0] / mass
    course = replace(
        still, nu=filtered, nu_dot=slowed, asked_n=np.zeros_like(still.asked_n), mass=np.full(6, mass),
        damping=np.full(6, damping), quadratic=np.full(6, drag),
    )  # fmt: skip
    axis = SimpleNamespace(dof=0, smoothing_s=smoothing_s)
    true = _unsmoothed(course, SimpleNamespace(problems=[SimpleNamespace(axis=axis)]))
    nu = true.nu[:, 0]
    assert nu == pytest.approx(filtered[:, 0] + smoothing_s * slowed[:, 0])
    assert true.nu_dot[:, 0] == pytest.approx(-(damping + drag * np.abs(nu)) * nu / mass, abs=1e-4)


def test_a_steady_force_is_not_told_by_late_thrust_that_held_it(rows):
    """Columns of late thrust took a weight of 5.9 N in a sea of 1.9 N for the thrust that held the vehicle down."""
    for axis in rows.axes:
        of_axis = axis.problem.axis
        held = replace(axis, problem=replace(axis.problem, axis=replace(of_axis, force=of_axis.force + 5.0)))
        late = delayed_thrust(axis)
        np.testing.assert_allclose(delayed_thrust(held), late, atol=1e-6 * np.abs(late).max())


def test_thrust_in_yaw_may_be_of_another_scale_and_no_other(rows):
    scaled = rows.with_thrust_scale()
    (yaw,) = (axis for axis in rows.axes if axis.problem.axis.dof == 5)
    column = scaled.nuisance.dense()[:, -1]
    assert scaled.nuisance.width == rows.nuisance.width + 1
    assert not column[rows.dof != 5].any()
    force = yaw.problem.axis.force
    by_force = yaw.by_force(force.mean(axis=1)[:, None], force[:, :1])
    np.testing.assert_allclose(column[rows.dof == 5], yaw.prewhitened(by_force)[:, 0])


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


def test_an_angle_between_two_readings_is_the_first_turned_on_at_the_predicted_rate():
    time_s, read_s = np.arange(0.0, 2.0, 0.02), np.array([0.0, 0.5, 1.01])
    nu = np.zeros((len(time_s), 6))
    nu[:, 4] = 0.2
    # The hull was pushed before the last reading, which nothing before it may know.
    pitch = np.array([0.0, 0.1, 0.6])
    attitude = Signal(read_s, quaternions_from_euler(0.3 * pitch, pitch, np.full(3, 2.0)))
    roll, seen, heading = euler_ahead(attitude, Predicted(time_s, nu, np.zeros_like(nu)), np.zeros(0)).T
    before = (time_s > 0.5) & (time_s <= 1.0)
    assert roll[time_s <= 0.5] == pytest.approx(0.0, abs=1e-12)
    assert seen[time_s <= 0.5] == pytest.approx(0.2 * time_s[time_s <= 0.5], abs=1e-12)
    assert seen[before] == pytest.approx(0.1 + 0.2 * (time_s[before] - 0.5), abs=1e-4)
    assert heading[before] == pytest.approx(2.0, abs=0.005)
    assert seen[time_s > 1.01][0] == pytest.approx(0.602, abs=1e-3)


def test_the_noise_of_frequent_tilts_is_averaged_and_the_predicted_turn_is_not():
    rng = np.random.default_rng(100_006)
    time_s = np.arange(0.0, 60.0, 0.02)
    nu = np.zeros((len(time_s), 6))
    nu[:, 4] = 0.3 * np.cos(time_s)
    read = slice(None, None, 2)
    pitch = 0.3 * np.sin(time_s[read]) + 0.005 * rng.standard_normal(len(time_s[read]))
    attitude = Signal(time_s[read], quaternions_from_euler(0.0 * pitch, pitch, np.full(len(pitch), 2.0)))
    off = euler_ahead(attitude, Predicted(time_s, nu, np.zeros_like(nu)), np.zeros(0))[:, 1] - 0.3 * np.sin(
        time_s
    )
    assert np.std(off[time_s > 5.0]) < 0.3 * 0.005
    # Each run is averaged by itself.
    apart = euler_ahead(attitude, Predicted(time_s, nu, np.zeros_like(nu)), np.array([30.0]))[:, 1]
    np.testing.assert_allclose(apart[time_s < 29.9], (off + 0.3 * np.sin(time_s))[time_s < 29.9], atol=1e-9)
    assert np.abs(apart - off - 0.3 * np.sin(time_s)).max() > 1e-4


def test_a_place_is_reckoned_with_the_tilt_at_which_the_hull_heaves():
    """Pitched nose up, it sinks along its own axis, and so goes ahead; in each run anew."""
    time_s = np.arange(0.0, 4.0, 0.02)
    motion = Motion(time_s, np.tile([0.3, 0.0, 0.2, 0.0, 0.0, 0.0], (len(time_s), 1)))
    gone = position(motion, np.tile([0.0, 0.1, 2.0], (len(time_s), 1)), np.array([1.99]))
    ahead = (0.3 * np.cos(0.1) + 0.2 * np.sin(0.1)) * np.where(time_s < 1.99, time_s, time_s - 2.0)
    np.testing.assert_allclose(gone, np.outer(ahead, [np.cos(2.0), np.sin(2.0)]), atol=1e-9)


def test_a_depth_between_two_readings_is_the_first_and_the_predicted_way_down_since():
    time_s = np.arange(0.0, 1.0, 0.02)
    depth = Signal(np.array([0.1, 0.49, 0.71]), np.array([[2.0], [np.nan], [9.0]]))
    ahead = reading_ahead(depth, time_s, np.full(len(time_s), 0.5), np.zeros(0))
    np.testing.assert_allclose(ahead[time_s <= 0.1], 2.0)
    until = (time_s > 0.1) & (time_s < 0.7)
    np.testing.assert_allclose(ahead[until], 2.0 + 0.5 * (time_s[until] - 0.1))
    np.testing.assert_allclose(ahead[time_s > 0.71], 9.0 + 0.5 * (time_s[time_s > 0.71] - 0.71))
    assert np.isnan(reading_ahead(None, time_s, time_s, np.zeros(0))).all()
    # In a run of its own, the time before its first reading has that reading.
    run = reading_ahead(depth, time_s, np.full(len(time_s), 0.5), np.array([0.5]))
    np.testing.assert_allclose(run[(time_s > 0.51) & (time_s < 0.7)], 9.0)


class TestEvidence:
    def made(self, size, rng):
        piece = np.repeat(np.arange(40), 100)
        nominal, cause, idle = rng.normal(size=(3, 4000))
        value = 0.5 * nominal + size * cause + rng.normal(size=4000)
        columns = np.column_stack([cause, idle])
        return equations_of(value, nominal[:, None], np.zeros(1), Candidates(columns, piece))

    def test_a_cause_is_found_with_its_size_and_standard_error(self):
        evidence = self.made(0.3, np.random.default_rng(0)).evidence([0])
        std = float(np.sqrt(evidence.covariance[0, 0]))
        assert std == pytest.approx(1 / np.sqrt(4000), rel=0.1)
        assert abs(evidence.size[0] - 0.3) < 3 * std
        assert evidence.gain == pytest.approx(0.5 * 4000 * 0.3**2, rel=0.2)
        assert evidence.gain < evidence.fitted

    def test_a_column_that_explains_nothing_costs_on_pieces_held_out_what_its_error_does(self):
        rng = np.random.default_rng(1)
        gains = [self.made(0.0, rng).evidence([1]).gain for _ in range(60)]
        assert np.mean(gains) == pytest.approx(-0.5 * 5 / 4, abs=0.35)
        assert max(gains) < 6.0

    def test_a_copy_of_a_nominal_column_is_nobodys_evidence(self):
        rng = np.random.default_rng(2)
        nominal = rng.normal(size=(1000, 1))
        value = 2.0 * nominal[:, 0] + rng.normal(size=1000)
        sums = equations_of(
            value, nominal, np.zeros(1), Candidates(3.0 * nominal, np.repeat(np.arange(20), 50))
        )
        assert sums.evidence([0]).gain == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize(("lasting_s", "each_s"), [(600.0, 20.0), (200.0, 20.0), (90.0, 9.0), (29.0, 6.0)])
def test_a_short_dive_has_two_pieces_for_each_fold_as_long_as_a_drift_fits_into_them(lasting_s, each_s):
    assert piece_s(lasting_s) == pytest.approx(each_s)


PIECE = np.concatenate([np.repeat(np.arange(4), 25), np.repeat(np.arange(4), 15)])


@pytest.fixture
def blocks():
    rng = np.random.default_rng(100_001)
    first = Block(np.array([0, 2]), rng.normal(size=(100, 2)))
    return Blocks((first, Block(np.array([1, 2, 4]), rng.normal(size=(60, 3)))), 5)


def test_columns_by_blocks_are_added_and_multiplied_as_all_rows_are(blocks):
    pieces, dense, by = pieces_of(PIECE), blocks.dense(), np.zeros((5, 2))
    by[0, 0], by[2, 0], by[4, 1] = 2.0, -1.0, 3.0
    others = np.random.default_rng(100_002).normal(size=(160, 3))
    for product, expected in (
        (blocks.products(PIECE), products_of(dense, pieces)),
        (blocks.products_with(others, PIECE), products_of(dense, pieces, others)),
        (blocks.some([4, 2]), dense[:, [4, 2]]),
        (blocks.crossed(others), dense.T @ others),
        (blocks.times(by), dense @ by),
        (blocks.combined(by).dense(), dense @ by),
        (blocks.square(), dense.T @ dense),
    ):
        np.testing.assert_allclose(product, expected, atol=1e-12)
    # The second block alone has the fifth column, and so its multiple.
    assert 1 not in blocks.combined(by).parts[0].of


def test_columns_put_after_others_come_last_and_leave_these_as_they_are(blocks):
    before = np.zeros((160, 2))
    before[:100, 1] = 3.0
    both = blocks.blocks_of(before).with_columns(blocks)
    np.testing.assert_array_equal(both.dense(), np.hstack([before, blocks.dense()]))
    assert 1 not in both.parts[1].of


def remembering(share, count, rng):
    fresh, out = rng.standard_normal(count), np.zeros(count)
    for i in range(count):
        out[i] = fresh[i] + (share * out[i - 1] if i else 0.0)
    return fresh, out


def test_of_ten_readings_before_each_is_taken_off_by_its_own_share() -> None:
    shares, values = 0.1 * np.arange(1, 11), np.random.default_rng(6).standard_normal((70, 2))
    left = values.copy()
    Autoregression(np.arange(70), shares).prewhitened(left)
    before = np.vstack([np.zeros((10, 2)), values])
    taken = sum(share * before[10 - lag : 80 - lag] for lag, share in enumerate(shares, 1))
    np.testing.assert_allclose(left, values - taken, atol=1e-12)


def test_what_is_left_of_a_channel_that_remembers_is_what_was_new_each_time():
    fresh, values = remembering(0.6, 20_000, np.random.default_rng(100_001))
    memory = autoregression_of(np.arange(20_000), values)
    left = values[:, None].copy()
    memory.prewhitened(left)
    assert memory.by_lag[0] == pytest.approx(0.6, abs=0.03)
    np.testing.assert_allclose(left[20:, 0], fresh[20:], atol=0.2)


def test_a_channel_leaves_the_rows_of_another_alone():
    _, values = remembering(0.6, 5_000, np.random.default_rng(100_003))
    memory = autoregression_of(np.arange(0, 5_000, 2), values)
    left = values[:, None].copy()
    memory.prewhitened(left)
    np.testing.assert_array_equal(left[1::2, 0], values[1::2])
    assert np.abs(left[::2, 0] - values[::2]).max() > 0.5


def test_runs_shorter_than_the_memory_count_by_the_lags_that_they_hold():
    _, values = remembering(0.6, 3_000, np.random.default_rng(100_005))
    runs = [np.arange(2_000), np.arange(2_000, 2_004), np.arange(2_004, 2_005), np.arange(2_005, 3_000)]
    memories = autoregressions_of(runs, values)
    assert [memory.rows.tolist() for memory in memories] == [run.tolist() for run in runs]
    assert memories[2].by_lag[0] == pytest.approx(0.6, abs=0.05)


def test_white_innovations_keep_all_but_chance_and_a_few_rows_all():
    white = np.random.default_rng(100_004).standard_normal(20_000)
    assert np.abs(autoregression_of(np.arange(20_000), white).by_lag).max() < 0.03
    assert autoregression_of(np.arange(199), white).by_lag.size == 0


def test_a_hull_settles_no_quicker_than_the_inertia_of_its_body_lets_it(nominal, shape):
    """A fit without causes took the lost thrust of a quarter of a hull's for a quarter of its inertia."""
    (yaw,) = (
        of_axis
        for problem, of_axis in zip(nominal.joint.problems, nominal.joint.slices, strict=True)
        if problem.axis.dof == YAW
    )
    theta = nominal.theta.copy()
    theta[yaw.start + DAMPING] = np.log(10.0 * shape.inertia_kgm2[2])
    theta[yaw.start + MASS] = np.log(0.2 * shape.inertia_kgm2[2])
    start = SimpleNamespace(joint=nominal.joint, theta=theta)
    light = replace(shape, inertia_kgm2=tuple(0.2 * each for each in shape.inertia_kgm2))
    assert YAW not in without_quick(start, nominal.built, shape).missing
    assert "it settles within" in without_quick(start, nominal.built, light).missing[YAW]


def dive_with(**signals):
    return Dive("made", Path("made.tlog"), "0" * 64, **signals)


def test_a_fast_gyro_keeps_every_so_many_readings_as_they_were():
    time_s = np.arange(0.0, 10.0, 0.01)
    gyro = Signal(time_s, np.column_stack([np.sin(20 * time_s)] * 3))
    left = thinned(dive_with(gyro=gyro)).gyro
    assert 200 < len(left) < 300
    np.testing.assert_array_equal(left.value[:, 0], np.sin(20 * left.time_s))
    slow = Signal(np.arange(0.0, 10.0, 0.2), np.zeros((50, 1)))
    assert len(thinned(dive_with(depth=slow)).depth) == 50
    assert thinned(dive_with(fog=slow)).fog is slow


def test_means_over_intervals_become_means_over_longer_ones_and_turn_as_far():
    step_s = 0.005
    time_s = step_s * (np.arange(600) + 0.5)
    fog = Signal(time_s, np.cos(time_s)[:, None])
    left = thinned(dive_with(fog=fog)).fog
    k = round(len(fog) / len(left))
    assert k > 1
    np.testing.assert_allclose(left.time_s[0], time_s[:k].mean())
    np.testing.assert_allclose(left.value.sum() * k * step_s, fog.value.sum() * step_s)


def test_no_mean_is_made_over_a_gap():
    time_s = np.concatenate([np.arange(0.0, 5.0, 0.01), np.arange(8.01, 12.0, 0.01)])
    left = thinned(dive_with(fog=Signal(time_s, np.ones((len(time_s), 1))))).fog
    assert not np.any((left.time_s > 5.0) & (left.time_s < 8.0))


LIBRARY = (COUPLED_DAMPING, STEADY_CURRENT, DEAD_ZONE, QUADRATIC_DRAG)
DRAG = Cause(QUADRATIC_DRAG, np.array([20.0, 0.0, 0.0, 0.0, 0.0, 3.0]))
ZONE = Cause(DEAD_ZONE, np.array([0.3]))


@pytest.mark.parametrize("cause", [DRAG, ZONE])
@pytest.mark.parametrize("candidates_first", [False, True])
def test_what_a_cause_adds_is_what_the_filters_make_of_its_act(nominal, cause, candidates_first):
    weighing = weighing_of(nominal, LIBRARY)
    columns, course = weighing._columns, nominal.course
    if candidates_first:
        assert columns.candidates.width > 0
    acts = [cause.act(course), *(cause.slope(course, p) for p in np.flatnonzero(cause.present))]
    plain = weighing.rows.columns(acts, course).T
    np.testing.assert_allclose(columns.of(cause), plain, rtol=1e-8, atol=1e-9 * np.abs(plain).max())


def test_a_fit_leaves_and_feels_what_a_projection_of_all_rows_does(nominal):
    weighing = weighing_of(nominal, LIBRARY)
    fit = weighing.fitted([DRAG, ZONE])
    rows = weighing.rows
    base = rows.nuisance.dense()
    square = base.T @ base + np.diag(rows.nominal_precision)
    table = np.column_stack([rows.value, fit.value])
    sizes = inverse(square) @ (base.T @ table)
    table -= base @ sizes
    # What the nominal parameters go away from where they are known to be.
    moved = 0.5 * float(rows.nominal_precision @ (sizes[:, 0] ** 2 - sizes[:, 1] ** 2))
    assert fit.residual_squares == pytest.approx(float(fit.value @ table[:, 1]), rel=1e-9)
    moving = table[rows.dof >= 0]
    assert fit.motion_nats == pytest.approx(
        0.5 * float((moving[:, 0] ** 2 - moving[:, 1] ** 2).sum()) + moved, rel=1e-6
    )
    course = weighing.now.course
    pushes = [Act(wrench=np.tile(unit, (len(course.time_s), 1))) for unit in np.eye(6)]
    steady = rows.columns(pushes, course)[rows.dof >= 0]
    taken = [
        float(np.sum((steady @ np.linalg.lstsq(steady, each, rcond=None)[0]) ** 2))
        for each in moving[:, :2].T
    ]
    assert fit.motion_nats - fit.unsteady_nats == pytest.approx(
        0.5 * (taken[0] - taken[1]), rel=1e-6, abs=1e-6
    )


def test_candidates_shed_what_they_lean_on_the_nominal_columns_by():
    rng = np.random.default_rng(100_004)
    nominal, others = rng.normal(size=(300, 3)), rng.normal(size=(300, 2))
    others += nominal[:, :2]
    value, piece = rng.normal(size=300), np.repeat(np.arange(6), 50)
    equations = equations_of(value, nominal, np.zeros(3), Candidates(others, piece))
    left = np.linalg.lstsq(nominal, np.column_stack([others, value]), rcond=None)[0]
    free = np.column_stack([others, value]) - nominal @ left
    for k in range(6):
        part = free[piece == k]
        np.testing.assert_allclose(
            equations.held_square[k], part[:, :2].T @ part[:, :2], rtol=1e-5, atol=1e-3
        )
        np.testing.assert_allclose(equations.held_right[k], part[:, :2].T @ part[:, 2], rtol=1e-5, atol=1e-3)
