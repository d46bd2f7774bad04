"""The plain baseline: least squares of one degree of freedom at a time, on motions whose equation is known."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from identify.diagnose.gap.drift import LINEAR, QUADRATIC, THRUST, TRIM, _sines, baseline_of
from identify.diagnose.gap.missing import disturbance_of
from identify.diagnose.gap.simulation import EACH
from identify.diagnose.verdict import swallowing

MASS, LINEAR_DRAG, SQUARE_DRAG, PUSH, LATE_S = 40.0, 12.0, 60.0, 2.5, 0.3


@pytest.fixture(scope="module")
def course(nominal):
    """Surge by its own equation, pushed 0.3 s late; all else at rest."""
    whole = nominal.course
    force = whole.wrench_of(whole.asked_n)[:, 0]
    late = np.interp(whole.time_s - LATE_S, whole.time_s, force)
    surge = np.zeros(len(late))
    for i in range(len(late) - 1):
        drag = (LINEAR_DRAG + SQUARE_DRAG * abs(surge[i])) * surge[i]
        surge[i + 1] = surge[i] + whole.step_s * (late[i] + PUSH - drag) / MASS
    nu = np.zeros_like(whole.nu)
    nu[:, 0] = surge
    return replace(whole, nu=nu)


def test_it_finds_mass_drags_trim_and_delay_of_a_motion_that_obeys_it(course):
    baseline = baseline_of(course, course.nu)
    terms = baseline.terms[0]
    assert baseline.delay_s[0] == pytest.approx(LATE_S, abs=0.03)
    assert 1.0 / terms[THRUST] == pytest.approx(MASS, rel=0.03)
    assert -terms[LINEAR] / terms[THRUST] == pytest.approx(LINEAR_DRAG, rel=0.15)
    assert -terms[QUADRATIC] / terms[THRUST] == pytest.approx(SQUARE_DRAG, rel=0.1)
    assert terms[TRIM] / terms[THRUST] == pytest.approx(PUSH, rel=0.1)


def test_flown_over_five_seconds_it_follows_that_motion_with_a_trim_of_its_own(course):
    measured = course.nu[::EACH]
    starts, length = np.array([100, 800, 1500]), 125
    baseline = baseline_of(course, course.nu)
    spoilt = replace(baseline, terms=baseline.terms * np.array([1, 1, 1, 1, 0.0]))
    flown = spoilt.flown(course, measured, starts, length)
    assert flown.shape == (3, length, 6)
    true = measured[starts[:, None] + np.arange(1, length + 1)]
    assert np.std(flown[..., 0] - true[..., 0]) < 0.02 * np.std(measured[:, 0])
    np.testing.assert_allclose(flown[..., 1:3], 0.0, atol=1e-9)


def test_the_disturbance_of_a_dive_that_obeys_its_model_is_a_small_part_of_its_thrust(nominal):
    by_dof = {item.dof: item for item in disturbance_of(nominal)}
    for dof in ("surge", "heave"):
        assert by_dof[dof].driven
        assert 0.0 < by_dof[dof].share < 0.1
        assert by_dof[dof].std > 0.0
    # Sway and heading were only held, by a thrust that answers the disturbance.
    for dof in ("sway", "yaw"):
        assert (by_dof[dof].driven, by_dof[dof].share) == (False, 1.0)
    assert not by_dof["roll"].pushed
    assert swallowing(by_dof.values()) == ()


def test_a_body_is_righted_by_the_sines_of_roll_and_pitch_alone():
    euler = np.random.default_rng(3).uniform(-0.5, 0.5, (50 * EACH, 3))
    sines = _sines(SimpleNamespace(euler=euler))
    assert np.array_equal(sines[:, 3:5], np.sin(euler[::EACH, :2]))
    assert not sines[:, [0, 1, 2, 5]].any()
