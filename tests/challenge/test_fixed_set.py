"""A small fixed set of hidden effects, large ones in short dives: each is named, and nothing is where nothing hides."""

import pytest
from soak import rest_in_soak, rows_rest_in_soak

from identify.challenge.answer import answer_of
from identify.challenge.case import dive_of, draw_case
from identify.challenge.score import Judged
from identify.diagnose.diagnose import diagnose
from identify.diagnose.result import plain

SIZE, SECONDS = 0.7, 110.0


def judged(seed, *names):
    case = draw_case(seed, names=names, size=SIZE, seconds=SECONDS)
    diagnosis = diagnose(dive_of(case), case.file, case.configuration, progress=lambda *_report: None)
    return Judged(case.truth(), answer_of(plain(diagnosis)))


@pytest.mark.parametrize("seed", rest_in_soak([391_000, 391_011]))
def test_where_nothing_hides_there_is_no_gap(seed):
    result = judged(seed)
    assert result.verdict == "no_gap"
    assert result.named == ()


@pytest.mark.parametrize(
    ("seed", "name"),
    rows_rest_in_soak(
        [
            (391_003, "dead_zone"),
            (391_001, "quadratic_drag"),
            (391_002, "steady_current"),
            (391_004, "net_buoyancy"),
            (391_005, "dvl_lever_arm"),
            (391_006, "coupled_damping"),
        ]
    ),
)
def test_an_effect_that_hides_is_named_first(seed, name):
    result = judged(seed, name)
    assert result.named_first()
    assert result.verdict != "no_gap"


def test_play_in_the_thrusters_that_no_library_has_is_unknown():
    result = judged(391_016, "backlash")
    assert result.verdict == "unknown"
