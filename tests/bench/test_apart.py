"""How far two methods are apart, of answers made by hand."""

import math

import pytest

from bench import apart
from bench.accuracy_trials import Stated, Trial
from identify.estimators.table import SIDE_BY_SIDE
from identify.identification import Z95


def stated(value, std):
    return Stated(value, value * math.exp(-Z95 * std), value * math.exp(Z95 * std), False)


def trial(seed, method, **values):
    return Trial(seed, method, {name: stated(*one) for name, one in values.items()}, (), "converged", 1.0)


FIRST, SECOND = SIDE_BY_SIDE


def test_what_both_state_is_apart_by_the_larger_standard_error():
    trials = [
        trial(1, FIRST, M_u=(100.0, 0.01), M_v=(90.0, 0.1)),
        trial(1, SECOND, M_u=(100.0 * math.exp(0.04), 0.02)),
        trial(2, FIRST, M_u=(100.0, 0.01)),
    ]
    found = apart.distances(trials)
    assert list(found) == [1]
    assert found[1] == pytest.approx([2.0])


def test_a_mission_counts_once_however_many_of_its_coefficients_are_too_far():
    far = {"M_u": (120.0, 0.01), "D_u": (60.0, 0.01)}
    near = {"M_u": (100.0, 0.01), "D_u": (50.0, 0.01)}
    trials = [trial(s, FIRST, **near) for s in (1, 2)]
    trials += [trial(1, SECOND, **far), trial(2, SECOND, **near)]
    assert "1 of 2 missions hold one beyond both intervals and by 0.5 % or more" in " ".join(
        apart.lines(trials)
    )


def test_without_the_second_method_nothing_is_said():
    assert apart.lines([trial(1, FIRST, M_u=(100.0, 0.01))]) == []
