"""The coverage section: kept by the code that made it, a dive of nothing kept too, and intervals of pooled shares."""

import math
from pathlib import Path

import numpy as np
import pytest

from bench import coverage
from bench.coverage import Trial, Tried
from bench.pooled import effective_count, share95, wilson
from bench.remembered import Data, Remembered
from identify.identification import Z95


def _data(configuration: str, seed: int, names: tuple[str, ...] = ("M_u", "D_u"), z: float = 0.5) -> Data:
    low, value, high = (10.0 * math.exp(0.02 * k) for k in (z - Z95, z, z + Z95))
    trial = {"seed": seed, "configuration": configuration, "truth": 10.0, "value": value}
    trials = [{**trial, "name": name, "low95": low, "high95": high} for name in names]
    return {"configuration": configuration, "seed": seed, "outcome": "converged", "trials": trials}


def _kept(path: Path) -> Remembered:
    kept = Remembered(path)
    kept.put("survey 1", _data("survey", 1))
    kept.put("hovering 1", _data("hovering", 1, ()))
    return kept


def test_a_dive_of_which_nothing_could_be_told_is_kept_and_counted(tmp_path: Path) -> None:
    _kept(tmp_path / "kept.jsonl")
    dives = coverage.measured([1], Remembered(tmp_path / "kept.jsonl"))
    assert [len(one.trials) for one in dives] == [2, 0]
    assert "nothing could be told: hovering 1 (converged), of 2." in coverage.page(dives)


def test_a_line_that_a_kill_cut_short_is_left_out(tmp_path: Path) -> None:
    path = tmp_path / "kept.jsonl"
    _kept(path)
    with path.open("a") as out:
        out.write('{"key": "survey 2", "da')
    assert "survey 2" not in Remembered(path)
    assert len(coverage.measured([1], Remembered(path))) == 2


def test_figures_of_other_code_are_not_taken(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[bool] = []

    def measured(_seeds: list[int], kept: Remembered) -> list[Tried]:
        asked.append("survey 1" in kept)
        return []

    monkeypatch.setattr(coverage, "measured", measured)
    for code in ("old", "old", "new"):
        monkeypatch.setattr(coverage, "stamp", lambda *_sources, code=code: code)
        coverage.section([1], tmp_path)
        _kept(tmp_path / f"coverage-{code}.jsonl")
    assert asked == [False, True, False]


def test_the_page_counts_what_lies_inside_and_how_far_off_the_worst_is() -> None:
    dives = [coverage.tried(_data("survey", seed, z=0.5 if seed > 1 else 3.5)) for seed in range(1, 21)]
    page = " ".join(coverage.page(dives).split())
    assert "38 of 40 inside, 95.0 %" in page
    assert "2 beyond 3 standard errors, the largest 3.5" in page
    assert "| survey | M_u | 20 | 95 % | +0.65 |" in page


def test_a_page_of_nothing_says_so() -> None:
    assert "none" not in coverage.page([Tried("survey", 1, "not identifiable", ())])


def test_a_trial_knows_its_error_in_its_own_standard_errors() -> None:
    (trial, _) = coverage.tried(_data("survey", 1, z=-1.25)).trials
    assert isinstance(trial, Trial)
    assert trial.z == pytest.approx(-1.25)
    assert trial.inside


def test_wilsons_bounds_are_those_of_its_table() -> None:
    assert wilson(0.9, 10) == pytest.approx((0.5958, 0.9821), abs=1e-4)


def test_cases_alike_within_a_group_count_once() -> None:
    hits = np.random.default_rng(1).random(2000) < 0.9
    groups = np.repeat(np.arange(2000), 5)
    assert effective_count(np.repeat(hits, 5).tolist(), groups.tolist()) == pytest.approx(2000, rel=0.01)


def test_independent_cases_count_each() -> None:
    hits = np.random.default_rng(2).random(20_000) < 0.9
    assert effective_count(hits.tolist(), np.repeat(np.arange(4000), 5).tolist()) == pytest.approx(
        20_000, rel=0.1
    )


def test_groups_alike_by_chance_count_for_no_more_than_their_cases() -> None:
    assert effective_count([True, True, False] * 4, [1, 1, 1, 2, 2, 2, 3, 3, 3, 4, 4, 4]) == 12
    assert effective_count([True, True, True, False] * 2 + [True] * 3, [1] * 4 + [2] * 4 + [3] * 3) <= 11


def test_where_all_are_hits_there_are_as_many_cases_as_groups() -> None:
    assert share95([True] * 12, [1, 1, 1, 2, 2, 2, 3, 3, 3, 4, 4, 4]) == (1.0, *wilson(1.0, 4))


def test_bounds_of_correlated_cases_hold_the_share_as_often_as_they_say() -> None:
    rng = np.random.default_rng(4)
    held = []
    for _ in range(400):
        level = np.repeat(rng.standard_normal(150), 6)
        hits = 0.8 * level + 0.6 * rng.standard_normal(900) < 1.2815515655446004
        _, low, high = share95(hits.tolist(), np.repeat(np.arange(150), 6).tolist())
        held.append(low <= 0.9 <= high)
    assert 0.92 <= np.mean(held) <= 0.98
