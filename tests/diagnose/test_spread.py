"""Intervals of a cause's parameters: what parts of a dive say by themselves, and what hangs on masses and dampings."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from fakes.planted import damped, planted_nominal
from numpy.typing import NDArray

from identify.challenge.case import dive_of, draw_case
from identify.diagnose.causes.candidates import Cause
from identify.diagnose.causes.confidence import (
    _step_std,
    between_parts,
    coupled_nominal,
    covariance_of,
    in_other_forms,
    is_certain,
)
from identify.diagnose.causes.search import Explanation
from identify.diagnose.causes.weighing import Weighing, weighing_of
from identify.diagnose.filters.nominal import nominal_of
from identify.effects.actuators import DEAD_ZONE
from identify.effects.course import delayed
from identify.effects.effect import Act
from identify.effects.hydrodynamics import FOULING, QUADRATIC_DRAG

ROWS, PARTS = 6000, 6
DRAG = Cause(QUADRATIC_DRAG, np.array([2000.0, 0.0, 0.0, 0.0, 0.0, 0.0]))


def regression(seed: int, apart: float) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.intp]]:
    """Slopes, white noise with a size of its own in each part, and the parts; the sizes' mean is taken off."""
    rng = np.random.default_rng(seed)
    slopes = 0.1 * rng.standard_normal((ROWS, 1))
    parts = np.repeat(np.arange(PARTS), ROWS // PARTS)
    value = slopes[:, 0] * apart * rng.standard_normal(PARTS)[parts] + rng.standard_normal(ROWS)
    size = slopes[:, 0] @ value / (slopes[:, 0] @ slopes[:, 0])
    return slopes, value - slopes[:, 0] * size, parts


def test_parts_that_agree_but_for_noise_add_little_to_the_variance() -> None:
    slopes = regression(0, 0.0)[0]
    within = 1.0 / float(slopes[:, 0] @ slopes[:, 0])
    added = [float(between_parts(*regression(seed, 0.0))[0]) for seed in range(40)]
    assert np.mean(added) < 0.5 * within


def test_parts_that_disagree_widen_the_interval_as_much_as_the_mean_of_so_many_is_off() -> None:
    added = [float(between_parts(*regression(seed, 2.0))[0]) for seed in range(60)]
    assert np.mean(added) == pytest.approx(2.0**2 / PARTS, rel=0.25)


def test_a_part_that_hardly_tells_of_a_parameter_has_no_say() -> None:
    slopes, left, parts = regression(3, 0.0)
    quiet = parts == 0
    slopes[quiet] *= 0.01
    left[quiet] += 50.0 * slopes[quiet, 0] / 0.01
    loud = between_parts(slopes[~quiet], left[~quiet], parts[~quiet] - 1)
    assert between_parts(slopes, left, parts) == pytest.approx(loud)


def test_in_another_unit_a_parameter_is_known_as_well() -> None:
    slopes, left, parts = regression(1, 2.0)
    assert between_parts(1e-3 * slopes, left, parts) == pytest.approx(
        1e6 * between_parts(slopes, left, parts)
    )


def test_one_part_alone_says_nothing_of_others() -> None:
    slopes, left, parts = regression(4, 2.0)
    assert between_parts(slopes, left, np.zeros_like(parts)) == pytest.approx([0.0])


@pytest.fixture(scope="module")
def weighing() -> Weighing:
    case = draw_case(318_900, names=["fouling"], size=0.8, seconds=120.0)
    return weighing_of(planted_nominal(case), (FOULING, QUADRATIC_DRAG))


def test_drag_that_grows_is_so_many_times_the_damping_and_changes_with_it(weighing: Weighing) -> None:
    cause = Cause(FOULING, np.array([4e-4]))
    force = weighing.rows.columns([cause.act(weighing.now.course)], weighing.now.course)[:, 0]
    with_it = coupled_nominal(weighing, (cause,)).dense() - weighing.rows.nuisance.dense()
    assert with_it.sum(axis=1) == pytest.approx(-force, abs=1e-6 * float(np.abs(force).max()))


def test_a_growing_drag_of_a_hull_with_quadratic_drag_of_its_own_changes_with_that_too() -> None:
    case = draw_case(318_900, names=["fouling"], size=0.8, seconds=120.0)
    weighing = weighing_of(
        nominal_of(dive_of(case), damped(case.file, "both"), case.configuration), (FOULING,)
    )
    cause, course = Cause(FOULING, np.array([4e-4])), weighing.now.course
    force = weighing.rows.columns([cause.act(course)], course)[:, 0]
    with_it = coupled_nominal(weighing, (cause,)).dense() - weighing.rows.nuisance.dense()
    assert with_it.sum(axis=1) == pytest.approx(-force, abs=1e-6 * float(np.abs(force).max()))


def test_a_drag_of_its_own_changes_with_no_damping(weighing: Weighing) -> None:
    cause = Cause(QUADRATIC_DRAG, np.full(6, 5.0))
    assert coupled_nominal(weighing, (cause,)) is weighing.rows.nuisance


def read(weighing: Weighing, act: Act) -> Weighing:
    """The same dive as if an act were all that is in it, without noise."""
    return replace(
        weighing, rows=replace(weighing.rows, value=weighing.rows.columns([act], weighing.now.course)[:, 0])
    )


def test_a_form_that_is_true_is_moved_by_no_other_and_widened_by_no_part(weighing: Weighing) -> None:
    true = read(weighing, DRAG.act(weighing.now.course))
    fit = true.fitted((DRAG,))
    std = float(np.sqrt(fit.covariance[0, 0]))
    assert abs(float(in_other_forms(true, fit, weighing.rows.nuisance)[0])) < 0.01 * std
    assert float(np.sqrt(covariance_of(true, fit)[0, 0])) < 1.05 * std


def test_parts_that_disagree_widen_the_interval_no_more_beside_a_nuisance_that_a_prior_holds(
    weighing: Weighing,
) -> None:
    """A thrust of unknown scale, say, that acts just as the cause does, and is known to some per cent."""
    course, rows = weighing.now.course, weighing.rows
    act = DRAG.act(course)
    force = rows.columns([act], course)[:, 0]
    sizes = 1.0 + 0.2 * np.random.default_rng(0).standard_normal(int(rows.piece.max()) + 1)[rows.piece]
    apart = replace(rows, value=force * sizes)
    scale = replace(
        apart,
        nuisance=rows.nuisance.with_columns(rows.blocks([act], course)),
        nominal_precision=np.append(rows.nominal_precision, 0.03 * float(force @ force)),
    )
    stds = []
    for of in (apart, scale):
        fit = replace(weighing, rows=of).fitted((DRAG,))
        stds.append(float(np.sqrt(covariance_of(replace(weighing, rows=of), fit)[0, 0])))
    assert stds[1] == pytest.approx(stds[0], rel=0.01)
    assert stds[0] > 10.0 * float(np.sqrt(fit.covariance[0, 0]))


def test_where_the_form_is_another_at_large_sizes_the_interval_is_wide(weighing: Weighing) -> None:
    course = weighing.now.course
    cubic = read(weighing, DRAG.act(course).each(lambda part: part * np.abs(course.nu) / 0.3))
    fit = cubic.fitted((DRAG,))
    wide = covariance_of(cubic, fit)[0, 0] / fit.covariance[0, 0]
    assert wide > 20.0**2


def test_where_another_form_is_true_it_moves_the_parameter_within_its_interval(weighing: Weighing) -> None:
    course = weighing.now.course
    late = read(weighing, DRAG.act(course).each(lambda part: delayed(part, course.step_s, 0.2)))
    fit = late.fitted((DRAG,))
    shift, size = float(in_other_forms(late, fit, weighing.rows.nuisance)[0]), float(fit.causes[0].values[0])
    assert abs(shift) > 1.5 * float(np.sqrt(fit.covariance[0, 0]))
    assert covariance_of(late, fit)[0, 0] > shift**2
    # What comes late is as large.
    assert abs(size + shift - DRAG.values[0]) < abs(size - DRAG.values[0])


def certain(weighing: Weighing, act: Act, times: float = 1.0) -> bool:
    """Whether DRAG alone is certain on a dive that holds this act alone, so many times as large."""
    held = read(weighing, act.times(times))
    return is_certain(Explanation(held.fitted((DRAG,)), held, held.now))


def test_a_lone_cause_on_which_all_parts_agree_is_certain_if_it_saves_much(weighing: Weighing) -> None:
    act = DRAG.act(weighing.now.course)
    assert certain(weighing, act)
    assert not certain(weighing, act, 0.006)


def test_a_lone_cause_that_another_force_only_resembles_is_not_certain(weighing: Weighing) -> None:
    course = weighing.now.course
    late = (course.since_s > 0.5 * course.since_s[-1])[:, None]
    assert not certain(weighing, DRAG.act(course).each(lambda part: 3.0 * late * part))


def test_of_several_causes_none_is_certain_by_that(weighing: Weighing) -> None:
    true = read(weighing, DRAG.act(weighing.now.course))
    fit = true.fitted((DRAG, Cause(FOULING, np.array([4e-4]))))
    assert not is_certain(Explanation(fit, true, true.now))


def test_what_the_motion_tells_in_steps_is_known_as_far_as_a_move_makes_the_fit_worse_by_two_nats() -> None:
    zone = Cause(DEAD_ZONE, np.array([0.8]))

    def squares(causes: list[Cause]) -> float:
        """More by 3 up to a hundredth of the width off, by 5 beyond."""
        return 103.0 if abs(causes[0].values[0] / 0.8 - 1.0) < 0.015 else 105.0

    weighing = SimpleNamespace(residual_squares=squares)
    fit = SimpleNamespace(causes=(zone,), residual_squares=100.0)
    assert _step_std(weighing, fit, 0, 0) == pytest.approx(0.008 / 1.96, rel=1e-4)
