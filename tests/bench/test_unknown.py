"""Unknown forces: what the grammar draws, how large it is planted, what counts as known, and what the page tells."""

import math
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from bench.unknown import section
from bench.unknown.grammar import MEMORIES, TIMINGS, Factor, Sentence, draw_sentence, envelope, force_of
from bench.unknown.planted import left_of, likeness, planted, unknown_of
from bench.unknown.trials import Judged
from identify.challenge.case import draw_case
from identify.challenge.scenario import THRUST, VELOCITY

TIME_S = np.arange(0.0, 300.0, 0.1)
PLAIN = Sentence((0,), (1.0,), (), "none", 1.0, "steady", 0.0, 1.0, 0.0, 0.0, 7)


def test_a_seed_draws_one_force_and_the_next_another() -> None:
    force, same, other = (draw_sentence(np.random.default_rng(seed), 8) for seed in (3, 3, 4))
    assert force == same != other


def test_every_word_of_the_grammar_is_drawn() -> None:
    many = [draw_sentence(np.random.default_rng(seed), 8) for seed in range(600)]
    assert {force.memory for force in many} == set(MEMORIES)
    assert {force.timing for force in many} == set(TIMINGS)
    assert {force.rhythm for force in many} == {"none", "a period"}
    assert {force.parity for force in many} == {"odd", "even", "neither"}
    assert {dof for force in many for dof in force.dofs} == set(range(6))
    assert {len(force.dofs) for force in many} == {1, 2}
    sorts = Counter(force.goes_with for force in many)
    assert set(sorts) == {
        "velocity", "acceleration", "thrust", "pulse", "attitude", "depth", "two of these", "time alone",
    }  # fmt: skip
    assert min(sorts.values()) > 20
    assert {factor.axis for force in many for factor in force.factors if factor.sort == "pulse"} == set(
        range(8)
    )


def test_a_product_of_two_odd_factors_is_even() -> None:
    odd, even = Factor("velocity", 0, False, 1.0), Factor("depth", 0, True, 1.0)
    parities = [
        replace(PLAIN, factors=factors).parity
        for factors in ((odd,), (even,), (odd, odd), (odd, even), (even, even))
    ]
    assert parities == ["odd", "even", "even", "odd", "even"]


@pytest.mark.parametrize(
    ("timing", "ends", "there", "gone"),
    [
        ("steady", {}, (0.0, 300.0), (300.0, 300.0)),
        ("from a time on", {"begin": 0.5}, (151.1, 300.0), (0.0, 149.9)),
        ("for a while", {"begin": 0.5, "end": 0.75}, (151.1, 223.8), (225.0, 300.0)),
    ],
)
def test_a_force_is_there_when_its_timing_says(timing, ends, there, gone) -> None:
    force = envelope(replace(PLAIN, timing=timing, **ends), TIME_S)
    assert (force[(there[0] < TIME_S) & (there[1] > TIME_S)] == 1.0).all()
    assert not force[(gone[0] < TIME_S) & (gone[1] > TIME_S)].any()


def test_a_rhythm_has_its_period() -> None:
    there = envelope(replace(PLAIN, period_s=12.0, phase=0.4), TIME_S)
    assert there == pytest.approx(np.sin(2 * math.pi * TIME_S / 12.0 + 0.4), abs=1e-9)


def test_bursts_are_short_and_those_of_time_alone_go_both_ways() -> None:
    alone = envelope(replace(PLAIN, timing="bursts"), TIME_S)
    by_depth = envelope(replace(PLAIN, timing="bursts", factors=(Factor("depth", 0, True, 1.0),)), TIME_S)
    assert 0.02 < np.mean(alone != 0) < 0.5
    assert alone.min() < -0.9
    assert alone.max() > 0.9
    assert by_depth.min() == 0.0


def test_a_slow_drift_is_a_random_walk_of_its_own_seed() -> None:
    walk = replace(PLAIN, timing="slow drift")
    there = envelope(walk, TIME_S)
    steps = np.diff(there)
    assert np.sqrt(np.mean(there**2)) == pytest.approx(1.0)
    assert abs(np.corrcoef(steps[1:], steps[:-1])[0, 1]) < 0.1
    assert (envelope(walk, TIME_S) == there).all()
    assert not np.allclose(envelope(replace(walk, seed=8), TIME_S), there)


def test_a_sentence_becomes_the_force_that_it_says() -> None:
    factors = (Factor("velocity", 1, True, 2.0), Factor("thrust", 5, False, 0.5))
    drawn_force = replace(
        PLAIN, dofs=(1, 5), gains=(0.8, -0.1), factors=factors, memory="delay", remembered=0.9
    )
    force = force_of(drawn_force, TIME_S, np.array([0.0, 0.0]), np.array([0.2, 3.0]))
    assert force.size.tolist() == [0.0, 0.8, 0.0, 0.0, 0.0, -0.1]
    assert force.signal.tolist() == [VELOCITY + 1, THRUST + 5]
    assert (force.even.tolist(), force.power.tolist()) == ([1, 0], [2.0, 0.5])
    assert (force.scale.tolist(), force.memory_s) == ([0.2, 3.0], 0.9)


def test_a_drawn_square_of_the_speed_is_known_as_drag_and_one_late_by_far_is_not() -> None:
    case = draw_case(391_003, kind="none", seconds=300.0)
    square = replace(PLAIN, gains=(-1.0,), factors=(Factor("velocity", 0, False, 2.0),))
    nearness = []
    for drawn_force in (square, replace(square, memory="delay", remembered=3.0)):
        force = planted(drawn_force, 3.0 * case.vehicle.share, np.zeros(1), np.full(1, 0.2))
        nearness.append(likeness(*replace(case, planted=(force,)).simulated(0), 0.0))
    assert nearness[0] > 0.95
    assert nearness[1] < 0.8


def test_a_steady_push_with_a_steady_pitch_is_known_as_a_push_that_a_trim_goes_with() -> None:
    case = draw_case(391_003, kind="none", seconds=200.0)
    both = replace(PLAIN, dofs=(1, 4), gains=(1.0, 3.0))
    force = planted(both, case.vehicle.share, np.zeros(0), np.zeros(0))
    scenario, simulated = replace(case, planted=(force,)).simulated(0)
    assert likeness(scenario, simulated, 0.0) > 0.95
    _, left = left_of(scenario, simulated)
    assert np.abs(left[:, 4]).max() < 0.1 * np.abs(left[:, 1]).max()


@pytest.mark.soak
def test_a_force_is_planted_as_large_as_its_drift_was_drawn_and_again_the_same() -> None:
    first, again = unknown_of(391_502), unknown_of(391_502)
    assert 0.9 * 1.5 < first.multiple < 1.1 * 6.0
    assert (first.sentence, first.multiple) == (again.sentence, again.multiple)
    dives = [unknown.case.simulated(0)[1].ticks.state for unknown in (first, again)]
    assert (dives[0] == dives[1]).all()


def dive(verdict: str, *causes: str, where: tuple[str, ...] = (), hidden: str = "", seed: int = 1) -> Judged:
    parts = {} if hidden else {"memory": "lag", "timing": "bursts"}
    return Judged(seed, "survey", hidden, parts, ("surge",), 3.0, verdict, causes, where)


def test_partly_counts_as_unknown_only_where_the_force_is() -> None:
    assert dive("unknown", where=("yaw",)).called
    assert dive("partly", "waves", where=("surge", "yaw")).called
    assert not dive("partly", "waves", where=("yaw",)).called
    assert not dive("explained", "waves", where=("surge",)).called
    assert not dive("no_gap").called


def test_the_page_tells_goals_parts_and_what_was_named_instead() -> None:
    drawn_ones = [dive("unknown", where=("surge",))] * 8 + [dive("explained", "waves"), dive("no_gap")]
    known = [dive("explained", "waves", hidden="waves")] * 49 + [dive("unknown", hidden="tether")]
    page = section.page(drawn_ones, known)
    assert "| unknown called so: 85 % | 80.0 % (49.0 to 94.3), 8 of 10 | **missed** |" in page
    assert "| known called unknown: 2 % | 2.0 % (0.4 to 10.5), 1 of 50 | met |" in page
    assert "| memory | lag | 10 | 80 % | 1 | 1 |" in page
    assert "| drift | 2.5 to 4 floors | 10 | 80 % | 1 | 1 |" in page
    assert "Known causes told instead of an unknown one: `waves` (1)." in page
    assert "Known effects called unknown: `tether` (1)." in page
    assert section.mistaken(known[:5]) == "Known effects called unknown: none."
