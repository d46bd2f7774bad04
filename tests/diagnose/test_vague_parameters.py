"""A parameter that the dive says nothing of is not told, as of a damping in an axis that hardly moves."""

import numpy as np

from identify.diagnose.candidates import Cause
from identify.diagnose.findings import parameters_of
from identify.diagnose.weighing import Fitted
from identify.effects.hydrodynamics import QUADRATIC_DRAG
from identify.effects.sensors import DVL_BIAS


def fitted(effect, values, std):
    nothing = np.zeros(0)
    at = tuple((0, p) for p in range(len(std)))
    cause = Cause(effect, np.array(values, dtype=float))
    return Fitted((cause,), at, nothing, nothing, np.diag(np.square(std)), 0.0, 100.0, 1.0, 100.0)


def test_a_damping_in_roll_that_may_be_nothing_or_enormous_is_not_told():
    told = parameters_of(fitted(QUADRATIC_DRAG, [75, 140, 480, 3040, 78, 42], [4, 13, 110, 1600, 8, 1.1]), 0)
    assert set(told) == {"X_uu", "Y_vv", "Z_ww", "M_qq", "N_rr"}


def test_a_part_that_is_surely_small_is_told_though_it_may_be_nothing():
    assert set(parameters_of(fitted(DVL_BIAS, [0.05, 0.001, 0.0], [0.001] * 3), 0)) == {"x", "y", "z"}


def test_a_cause_of_which_all_is_vague_keeps_its_values():
    told = parameters_of(fitted(QUADRATIC_DRAG, [75, 0, 0, 3040, 0, 0], [60, 70, 70, 1600, 20, 20]), 0)
    assert len(told) == 6
