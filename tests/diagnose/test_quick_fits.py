"""What is made once and by blocks is what plain products of all rows come to; and others are weighed no more often than
causes change."""

from dataclasses import replace

import numpy as np
import pytest

from bench.missions.mission import draw_one
from identify.diagnose import search
from identify.diagnose.candidates import Cause
from identify.diagnose.evidence import equations_of, inverse
from identify.diagnose.nominal import nominal_of, refitted
from identify.diagnose.weighing import weighing_of
from identify.effects.actuators import DEAD_ZONE
from identify.effects.environment import STEADY_CURRENT
from identify.effects.hydrodynamics import COUPLED_DAMPING, QUADRATIC_DRAG

LIBRARY = (COUPLED_DAMPING, STEADY_CURRENT, DEAD_ZONE, QUADRATIC_DRAG)
DRAG = Cause(QUADRATIC_DRAG, np.array([20.0, 0.0, 0.0, 0.0, 0.0, 3.0]))
ZONE = Cause(DEAD_ZONE, np.array([0.3]))


@pytest.fixture(scope="module")
def nominal():
    mission = draw_one(100_300, seconds=120.0)
    return nominal_of(mission.dive, mission.file, mission.configuration)


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
    nominal = rows.nuisance.dense()
    square = nominal.T @ nominal + np.diag(rows.nominal_precision)
    table = np.column_stack([rows.value, fit.value])
    sizes = inverse(square) @ (nominal.T @ table)
    table -= nominal @ sizes
    # What the nominal parameters go away from where they are known to be.
    moved = 0.5 * float(rows.nominal_precision @ (sizes[:, 0] ** 2 - sizes[:, 1] ** 2))
    assert fit.residual_squares == pytest.approx(float(fit.value @ table[:, 1]), rel=1e-9)
    moving = table[rows.dof >= 0]
    assert fit.motion_nats == pytest.approx(
        0.5 * float((moving[:, 0] ** 2 - moving[:, 1] ** 2).sum()) + moved, rel=1e-6
    )


def test_a_fit_that_is_asked_for_again_is_the_same(nominal):
    weighing = weighing_of(nominal, LIBRARY)
    once, again = weighing.fitted([ZONE, DRAG]), weighing.fitted([ZONE, DRAG])
    assert (once.gain, once.std, once.motion_nats) == (again.gain, again.std, again.motion_nats)
    np.testing.assert_array_equal(once.value, again.value)
    np.testing.assert_array_equal(once.slopes, again.slopes)


def test_candidates_shed_what_they_lean_on_the_nominal_columns_by():
    rng = np.random.default_rng(100_004)
    nominal, others = rng.normal(size=(300, 3)), rng.normal(size=(300, 2))
    others += nominal[:, :2]
    value, piece = rng.normal(size=300), np.repeat(np.arange(6), 50)
    told = equations_of(value, nominal, np.zeros(3), others, piece)
    left = np.linalg.lstsq(nominal, np.column_stack([others, value]), rcond=None)[0]
    free = np.column_stack([others, value]) - nominal @ left
    for k in range(6):
        own = free[piece == k]
        np.testing.assert_allclose(told.held_square[k], own[:, :2].T @ own[:, :2], rtol=1e-5, atol=1e-3)
        np.testing.assert_allclose(told.held_right[k], own[:, :2].T @ own[:, 2], rtol=1e-5, atol=1e-3)


def test_all_others_are_weighed_once_for_each_change_of_causes_and_once_more(nominal, monkeypatch):
    """However often the values of those found have to be fitted anew."""
    size = 0.3 * nominal.course.damping[0] / np.abs(nominal.course.nu[:, 0]).max() * np.eye(6)[0] * 5.0
    opposed = refitted(nominal, [QUADRATIC_DRAG.act(nominal.course, -size)])
    spoilt = replace(opposed, acts=(), course=nominal.course)
    seen = []
    plain = search.improved

    def improved(weighing, fit, refused):
        better = plain(weighing, fit, refused)
        seen.append([cause.effect.label for cause in better.causes])
        return better

    monkeypatch.setattr(search, "improved", improved)
    found = search.explain(spoilt, LIBRARY, lambda *_report: None)
    assert found.causes
    assert len(seen) == 1 + sum(a != b for a, b in zip([[], *seen], seen, strict=False))
    assert seen[-1] == [cause.effect.label for cause in found.causes]
