"""A velocity that is known along one axis alone."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from built_recordings import of_table
from fakes.planted import diagnosed

from identify.challenge.case import dive_of, draw_case
from identify.checks.readings.frozen import without_frozen
from identify.checks.readings.impossible import without_repeated
from identify.checks.readings.missing_signals import missing_signals
from identify.dive import Dive, Signal
from identify.estimators.table import estimator
from identify.run.identify import identify

MAP = "time: {column: t}\nvelocity: {columns: [u, %s, %s], unit: m/s}\n"


def in_surge_alone(velocity):
    return Signal(velocity.time_s, velocity.value * [1.0, np.nan, np.nan])


@pytest.fixture(scope="module")
def case():
    return draw_case(3_860_000_011, names=[], seconds=110.0)


@pytest.mark.parametrize("unknown", ["null", "~", '"?"'])
def test_an_axis_without_a_column_is_unknown_and_one_that_stays_still_is_zero(tmp_path, unknown):
    dive = of_table(tmp_path, "t,u\n0,0.5\n0.1,0.6\n0.2,\n", MAP % (unknown, '"-"'))
    np.testing.assert_array_equal(dive.velocity.value, [[0.5, np.nan, 0.0], [0.6, np.nan, 0.0]])


def test_readings_of_one_axis_that_repeat_or_stand_still_are_left_out_all_the_same():
    time_s = np.arange(0.0, 60.0, 0.1)
    twice = np.repeat(np.random.default_rng(0).normal(size=300), 2)
    dive = Dive(
        "d", Path("d.csv"), "0" * 64, velocity=in_surge_alone(Signal(time_s, np.column_stack([twice] * 3)))
    )
    assert len(without_repeated(dive).velocity) == 300

    moving = np.random.default_rng(0).normal(size=600)
    moving[200:500] = moving[200]
    nu_fb = Signal(time_s, np.random.default_rng(1).normal(size=(600, 6)))
    stuck = replace(
        dive,
        velocity=in_surge_alone(Signal(time_s, np.column_stack([moving] * 3))),
        nu_fb=nu_fb,
        pwm=Signal(time_s, np.full((600, 1), 1700.0)),
    )
    left = without_frozen(stuck)
    assert len(left.velocity) == 600 - 299
    assert left.frozen["velocity"][0] == pytest.approx((20.0, 49.9))


def test_identify_tells_the_axis_that_is_known_and_what_it_cannot_tell(case):
    dive = dive_of(case)
    likelihood = {"likelihood": estimator("likelihood")}
    whole, part = (
        {
            each.name: each
            for each in identify(
                replace(dive, velocity=velocity), case.file, case.configuration, likelihood
            ).answer.parameters
        }
        for velocity in (dive.velocity, in_surge_alone(dive.velocity))
    )
    for name in ("M_u", "D_u"):
        assert part[name].identifiable
        assert part[name].value == pytest.approx(whole[name].value, rel=0.05)
    assert part["M_v"].reason == "no velocity in sway was recorded; record the DVL"
    assert not part["D_w"].identifiable


def test_diagnose_judges_the_axis_that_is_known_and_names_the_others(case):
    dive = dive_of(case)
    diagnosis = diagnosed(case, dive=replace(dive, velocity=in_surge_alone(dive.velocity)))
    text = " ".join(diagnosis.provisos)
    assert "Sway was not judged: no velocity in sway was recorded" in text
    assert "Surge was not judged" not in text


@pytest.mark.parametrize(
    ("with_depth", "said"),
    [
        (False, "Velocity is known in surge alone: mass and damping in sway and heave can't be identified."),
        (
            True,
            "Velocity is known in surge alone: mass and damping in sway can't be identified, those in heave by depth "
            "alone.",
        ),
    ],
)
def test_a_recording_says_which_axes_its_velocity_lacks_and_blames_no_bottom_lock(with_depth, said):
    time_s = np.arange(0.0, 20.0, 0.1)
    velocity = in_surge_alone(Signal(time_s, np.ones((200, 3))))
    depth = Signal(time_s, np.ones((200, 1))) if with_depth else None
    notes = missing_signals(Dive("d", Path("d.csv"), "0" * 64, velocity=velocity, depth=depth))
    assert said in notes
    assert not any("bottom lock" in note for note in notes)
