"""What comes and goes by no cause of the library: evenly, now and then, or a while after the motion."""

import numpy as np
import pytest
from soak import rows_rest_in_soak

from bench.missions.mission import draw_one
from identify.challenge.case import dive_of, draw_case
from identify.diagnose.gap import character_of
from identify.diagnose.nominal import nominal_of
from identify.diagnose.rhythms import bursts, mixture_gain, scores
from identify.diagnose.unexplained import GenericForce, Unexplained, unexplained_of
from identify.diagnose.verdict import next_for_unexplained, unexplained_forces
from identify.diagnose.weighing import weighing_of


@pytest.fixture(scope="module")
def nominal():
    mission = draw_one(100_300, seconds=240.0)
    return nominal_of(mission.dive, mission.file, mission.configuration)


@pytest.fixture(scope="module")
def weighing(nominal):
    return weighing_of(nominal, ())


def left_of(name, seed):
    """What is left of a short dive that hides one effect which no library has."""
    case = draw_case(seed, names=(name,), size=0.8, seconds=240.0)
    weighing = weighing_of(nominal_of(dive_of(case), case.file, case.configuration), ())
    return unexplained_of(weighing, weighing.fitted(()))


def test_a_filter_run_backwards_weighs_any_force_as_it_does_forwards(weighing):
    rng = np.random.default_rng(1)
    for own in weighing.rows.axes:
        force, left = rng.standard_normal(len(own.problem.axis.time_s)), rng.standard_normal(len(own.std))
        forwards = own.prewhitened(own.by_force(force[:, None]))[:, 0] @ left
        assert scores(own, left) @ force == pytest.approx(forwards, rel=1e-9)


def test_a_dive_that_obeys_its_model_leaves_nothing_that_comes_and_goes(weighing):
    assert not unexplained_forces(unexplained_of(weighing, weighing.fitted(())))


@pytest.mark.parametrize(
    ("name", "dof", "variable", "timing"),
    rows_rest_in_soak([
        ("knocks", 5, "time", "intermittent"), ("own_wake", 0, "speed", "transient"),
        ("vortex_shedding", 1, "speed", "periodic"), ("ballast_pump", 2, "time", "periodic"),
    ], keep=2),
)  # fmt: skip
def test_a_force_that_comes_and_goes_is_unexplained(name, dof, variable, timing):
    left = left_of(name, 330_901)
    assert (dof, variable, timing) in {
        (one.dof, one.variable, one.timing) for one in unexplained_forces(left)
    }


def test_what_comes_by_a_clock_of_its_own_asks_for_a_dive_on_one_spot(nominal):
    one = GenericForce(0, "time", None, nominal.course.depth_m, "intermittent")
    assert character_of(Unexplained((one,), (20.0,), (1.0,))).timing == "intermittent"
    assert "on one spot" in next_for_unexplained([one], nominal.course, None).manoeuvres[0]


def test_a_loud_stretch_now_and_then_is_foretold_and_one_noise_is_not():
    rng = np.random.default_rng(2)
    noise, piece = rng.standard_normal(400) ** 2, np.arange(400) // 20
    assert mixture_gain(noise, 1, piece) < 3.0
    noise[::17] *= 16.0
    assert mixture_gain(noise, 1, piece) > 20.0


def test_a_wild_reading_is_no_blow(weighing):
    own, rows = (
        weighing.rows.axes[0],
        np.random.default_rng(3).standard_normal(len(weighing.rows.axes[0].std)),
    )
    time_s = weighing.now.course.time_s
    wild = rows.copy()
    wild[::150] += 30.0
    gains = [max(one.gain for one in bursts({0: (own, values)}, time_s)) for values in (rows, wild)]
    assert gains[1] < gains[0] + 5.0
