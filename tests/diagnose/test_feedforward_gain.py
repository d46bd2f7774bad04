"""How far a feed-forward leaves a vehicle off its reference: the error's equation of motion, solved."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import quad

from identify.diagnose import feedforward_gain as module
from identify.diagnose.causes.candidates import Cause
from identify.diagnose.feedforward_gain import feedforward_gain, feedforward_gain_by
from identify.diagnose.gap.missing import Missing
from identify.effects.hydrodynamics import QUADRATIC_DRAG
from identify.effects.sensors import DVL_SCALE
from identify.estimators.likelihood.axis import DISTURBANCE, TIME_CONSTANT


def test_a_steady_force_leaves_an_error_that_grows_to_the_force_over_the_braking_or_without_end():
    force, since_s = np.full(40, 3.0), 0.5 * np.arange(1, 41)
    braked = module._error(force, 20.0, np.full(40, 6.0), 0.5)
    np.testing.assert_allclose(braked, 0.5 * (1.0 - np.exp(-0.3 * since_s)))
    np.testing.assert_allclose(module._error(force, 20.0, np.zeros(40), 0.5), 0.15 * since_s)


def test_at_the_beginning_of_each_run_no_error_is_known():
    force, braking = np.full(40, 3.0), np.full(40, 6.0)
    once = module._error(force[:20], 20.0, braking[:20], 0.5)
    square = module._mean_square(force, 20.0, braking, 0.5, [slice(0, 20), slice(20, 40)])
    assert square == pytest.approx(np.mean(once**2))


def fit(rise_s, std_n=4.0, memory_s=5.0):
    """A fit of surge and sway alike, of 20 kg, seen each half second."""
    theta = np.zeros(5)
    theta[[DISTURBANCE, TIME_CONSTANT]] = np.log([std_n, memory_s])
    problems = tuple(
        SimpleNamespace(axis=SimpleNamespace(dof=dof), rise_s=lambda _: rise_s) for dof in (0, 1)
    )
    course = SimpleNamespace(mass=np.full(6, 20.0), step_s=0.5 / module.EACH)
    joint = SimpleNamespace(problems=problems, slices=(slice(0, 5), slice(5, 10)))
    return SimpleNamespace(joint=joint, theta=np.tile(theta, 2), course=course)


@pytest.mark.parametrize("rise_s", [0.0, 1.5])
def test_a_disturbance_moves_a_braked_vehicle_by_the_integral_of_its_spectrum(rise_s):
    """Of a force d of 4 N with r T d'' + T d' + d = white noise, T = 5 s and r = `rise_s`."""
    memory_s, mass, braking = 5.0, 20.0, 6.0

    def spectrum(rate):
        return 1.0 / ((1.0 - rise_s * memory_s * rate**2) ** 2 + (memory_s * rate) ** 2)

    whole, _ = quad(spectrum, 0.0, np.inf)
    moved, _ = quad(lambda rate: spectrum(rate) / (braking**2 + (mass * rate) ** 2), 0.0, np.inf)
    assert module._driven(fit(rise_s), 1, braking) == pytest.approx(4.0**2 * moved / whole, rel=1e-6)


def test_nothing_is_known_of_a_disturbance_without_braking_or_of_an_axis_that_is_not_fitted():
    assert module._driven(fit(0.0), 0, 0.0) == module._driven(fit(0.0), 2, 6.0) == 0.0


def test_a_feed_forward_leaves_the_missing_force_before_and_its_rest_after_beside_the_disturbance():
    now, time_s, braking = fit(0.0), 0.5 * np.arange(40), np.full((40, 6), 6.0)
    wrench = np.zeros((40, 6))
    wrench[:, 0] = 3.0
    missing = Missing(time_s, wrench, 0.0 * wrench, 0.0 * wrench)
    gain = feedforward_gain_by(0.5 * wrench, missing, now, braking)
    noise = 2.0 * module._driven(now, 0, 6.0)
    square = np.mean(module._error(wrench[:, 0], 20.0, braking[:, 0], 0.5) ** 2)
    assert (gain.before_m_s, gain.after_m_s) == pytest.approx(
        (np.sqrt(square + noise), np.sqrt(square / 4 + noise))
    )


def test_no_feed_forward_makes_up_for_a_wrong_reading_or_for_a_force_that_it_does_not_know(nominal):
    count = len(nominal.course.time_s[:: module.EACH])
    missing = Missing(nominal.course.time_s[:: module.EACH], *np.zeros((3, count, 6)))
    for effect, is_known in (
        (DVL_SCALE, False), (replace(DVL_SCALE, feedforward=QUADRATIC_DRAG.feedforward), False),
        (QUADRATIC_DRAG, True), (replace(QUADRATIC_DRAG, feedforward=""), False),
    ):  # fmt: skip
        cause = Cause(effect, np.full(len(effect.parameters), 1.5))
        gain = feedforward_gain(cause, (), missing, nominal, np.full((count, 6), 6.0))
        assert (gain is not None) is is_known
