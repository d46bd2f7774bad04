"""Sensors whose fitted noise is a good part of all that they read."""

from dataclasses import replace

import closed_loop
import numpy as np
import pytest
from test_judged import FILE as TURNING
from test_judged import YAW, one_axis

from identify.checks.fit import LOUD, loud, loud_doubts, loud_note
from identify.diagnose.diagnose import diagnose
from identify.dive import Signal
from identify.estimators.axes import build_axes
from identify.estimators.likelihood import estimate
from identify.estimators.likelihood_fit import fit_axes
from identify.identification import Outcome

FILE = closed_loop.vehicle_file()
SHAPE = FILE.vehicle.configurations["only"]


@pytest.fixture(scope="module")
def surge():
    """The fit of surge, where its noise stands in theta, and the standard deviation of the velocity."""
    dive = closed_loop.dive(np.random.default_rng(5), seconds=60.0)
    found = fit_axes(build_axes(dive, FILE, "only"), SHAPE, lambda *_: None)
    return found, found.joint.problems[0].noise_place, float(np.std(dive.velocity.value[:, 0]))


def noisy(surge, noise, pushed=(0,)):
    found, place, _ = surge
    theta = found.theta.copy()
    theta[place] = np.log(noise)
    return loud(found.joint, theta, pushed)


def test_an_honest_dive_is_not_loud(surge):
    found, *_ = surge
    assert loud(found.joint, found.theta, (0,)) == ()


def test_noise_above_a_fifth_of_the_signal_that_the_readings_do_not_show_makes_data_and_model_disagree(surge):
    *_, signal = surge
    assert noisy(surge, 0.99 * LOUD * signal) == ()
    (one,) = noisy(surge, 1.01 * LOUD * signal)
    assert one.inflated
    assert one.noise == pytest.approx(1000 * 1.01 * LOUD * signal)
    assert one.signal == pytest.approx(1000 * signal, rel=0.05)
    (doubt,) = loud_doubts([one])
    assert doubt.about == ("M_u", "D_u")
    assert doubt.outcome is Outcome.DISAGREES
    for part in ("In surge", "the DVL", f"{one.noise:.3g} mm/s", f"{one.signal:.3g} mm/s", "check"):
        assert part in doubt.sentence
    assert loud_note([one]) == ()


def test_where_no_thruster_pushed_inflated_noise_is_a_warning_alone(surge):
    *_, signal = surge
    (doubt,) = loud_doubts(noisy(surge, 0.5 * signal, pushed=()))
    assert doubt.outcome is Outcome.CONVERGED


def test_an_axis_that_hardly_moves_is_told_in_a_note_if_it_was_pushed():
    dive = closed_loop.dive(np.random.default_rng(5), seconds=60.0, noise=0.2)
    found = fit_axes(build_axes(dive, FILE, "only"), SHAPE, lambda *_: None)
    heard = loud(found.joint, found.theta, (0,))
    assert [one.inflated for one in heard] == [False]
    assert loud_doubts(heard) == ()
    (note,) = loud_note(heard)
    assert "in surge (the DVL" in note
    assert loud(found.joint, found.theta, ()) == ()


def test_a_gyro_whose_sign_flips_now_and_then_is_doubted_by_name():
    dive = one_axis(YAW, rate=True)
    value = dive.gyro.value.copy()
    value[::10] *= -1.0
    flips = replace(dive, gyro=Signal(dive.gyro.time_s, value))
    found = estimate(flips, TURNING, "only", lambda *_: None)
    told = [doubt for doubt in found.doubts if "of what the gyro reads for noise" in doubt.sentence]
    assert [doubt.about for doubt in told] == [("I_r", "D_r")]
    assert found.outcome is Outcome.DISAGREES
    noted = diagnose(flips, TURNING, "only", progress=lambda *_: None).notes
    assert told[0].sentence[:20] in " ".join(noted)
    assert not any("for noise" in one for one in estimate(dive, TURNING, "only", lambda *_: None).sentences)
