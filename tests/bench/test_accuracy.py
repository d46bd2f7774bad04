"""The accuracy section: what counts as an error, a refusal, a warning; and the cache that survives a kill."""

import gzip
import json
import math
from pathlib import Path

import numpy as np
import pytest

from bench import accuracy, accuracy_trials, goals, trial
from bench.accuracy_trials import Bound, Stated, Trial
from bench.remembered import Remembered
from bench.tally import inside95, median_ratio, root_mean_square, tally

Z95 = 1.959963984540054


def stated(value: float, std: float, doubted: bool = False) -> Stated:
    return Stated(value, value * math.exp(-Z95 * std), value * math.exp(Z95 * std), doubted)


def efficient(count: int, spread: float = 1.0, claimed: float = 1.0) -> tuple[list[Bound], list[Trial]]:
    """A method that errs by `spread` times the bound and claims `claimed` times it."""
    rng = np.random.default_rng(3)
    bounds, trials = [], []
    for seed in range(1, count + 1):
        least = {"M_u": 0.02, "D_u": 0.05, "M_w": 0.5}
        bounds.append(Bound(seed, "square", 100.0, dict.fromkeys(least, 10.0), least))
        found = {
            name: stated(10.0 * math.exp(spread * least[name] * rng.standard_normal()), claimed * least[name])
            for name in ("M_u", "D_u")
        }
        trials.append(Trial(seed, "likelihood", found, ("M_w",), "converged", 0.5))
    return bounds, trials


def test_a_method_at_the_bound_has_ratio_one_and_right_intervals() -> None:
    found = tally("likelihood", *efficient(2000))
    assert root_mean_square(found.cases) == pytest.approx(1.0, abs=0.05)
    assert median_ratio(found.cases) == pytest.approx(1.0, abs=0.05)
    assert np.mean([case.inside for case in found.cases]) == pytest.approx(0.95, abs=0.015)
    assert np.std([case.z for case in found.cases]) == pytest.approx(1.0, abs=0.05)


def test_a_method_twice_as_far_off_that_says_so_is_inefficient_but_honest() -> None:
    found = tally("likelihood", *efficient(2000, spread=2.0, claimed=2.0))
    assert root_mean_square(found.cases) == pytest.approx(2.0, abs=0.1)
    assert np.mean([case.inside for case in found.cases]) == pytest.approx(0.95, abs=0.015)


def test_what_is_refused_counts_apart_by_what_the_bound_allows() -> None:
    bounds, trials = efficient(10)
    trials[0] = Trial(1, "likelihood", {"M_w": stated(10.0, 0.4)}, ("M_u", "D_u"), "converged", 0.5)
    found = tally("likelihood", bounds, trials)
    assert (len(found.cases), found.refused, found.refused_rightly, found.stated_rashly) == (18, 2, 9, 1)


def test_a_doubt_or_an_outcome_is_a_warning() -> None:
    bounds, trials = efficient(3)
    wild = {"M_u": stated(20.0, 0.02), "D_u": stated(10.0, 0.05)}
    trials[0] = Trial(1, "likelihood", wild, (), "converged", 0.5)
    trials[1] = Trial(
        2, "likelihood", {**wild, "M_u": stated(20.0, 0.02, doubted=True)}, (), "converged", 0.5
    )
    trials[2] = Trial(3, "likelihood", wild, (), "data and model disagree", 0.5)
    cases = tally("likelihood", bounds, trials).cases
    assert [case.warned for case in cases if case.name == "M_u"] == [False, True, True]
    row = next(line for line in accuracy.page(bounds, trials).splitlines() if line.startswith("| likelihood"))
    assert [cell.strip() for cell in row.split("|")][-4:-2] == ["3", "1"]


def test_a_method_at_the_bound_meets_every_goal_and_one_that_claims_too_much_misses_them() -> None:
    honest = tally("likelihood", *efficient(2000))
    assert [met for _, met in goals.verdicts(honest)] == [True] * 4
    rash = tally("likelihood", *efficient(2000, spread=3.0))
    assert [met for _, met in goals.verdicts(rash)] == [False] * 4


def test_goals_are_judged_for_both_methods_by_name_or_said_not_to_be() -> None:
    page = "\n".join(goals.lines([tally("likelihood", *efficient(2000))]))
    assert page.count(": met | nothing to judge |") == 4
    assert "`likelihood` 0 of 4000 (0.0 %)" in page


def test_refused_coefficients_are_told_beside_the_errors_that_leave_them_out() -> None:
    bounds, trials = efficient(10)
    trials[0] = Trial(1, "likelihood", {}, ("M_u", "D_u", "M_w"), "refused", 0.5)
    found = tally("likelihood", bounds, trials)
    assert found.refused_share == pytest.approx(0.1)
    assert "`likelihood` 2 of 20 (10.0 %)" in "\n".join(goals.lines([found]))
    row = next(line for line in accuracy.page(bounds, trials).splitlines() if line.startswith("| likelihood"))
    assert "| 10.0 % |" in row


def test_the_bounds_of_a_coverage_count_a_mission_once_where_its_coefficients_err_together() -> None:
    bounds, trials = efficient(400)
    alone = inside95(tally("likelihood", bounds, trials).cases)
    for one in trials:
        error = math.log(one.stated["M_u"].value / 10.0) / 0.02
        one.stated["D_u"] = stated(10.0 * math.exp(0.05 * error), 0.05)
    _, low, high = inside95(tally("likelihood", bounds, trials).cases)
    assert (high - low) / (alone[2] - alone[1]) == pytest.approx(math.sqrt(2), rel=0.15)


def test_a_mass_below_zero_is_an_error_like_any_other() -> None:
    bounds, _ = efficient(1)
    below = Trial(1, "PySINDy", {"M_u": Stated(-10.0, math.nan, math.nan, False)}, (), "converged", 0.1)
    (case,) = tally("PySINDy", bounds, [below]).cases
    assert case.error == pytest.approx(-2.0 / 0.02)
    assert math.isnan(case.z)


def test_a_value_at_its_bound_of_zero_has_an_error_and_no_z() -> None:
    bounds, _ = efficient(1)
    nothing = Trial(
        1, "closed form", {"M_u": Stated(0.0, math.nan, math.nan, False)}, (), "stopped at a bound", 0.1
    )
    (case,) = tally("closed form", bounds, [nothing]).cases
    assert case.error == pytest.approx(-1.0 / 0.02)
    assert math.isnan(case.z)


def test_the_page_names_methods_that_this_build_lacks() -> None:
    page = accuracy.page(*efficient(20), absent=("pinn",))
    assert "`pinn` is not installed here" in page
    assert "20 simulated missions (seeds 1 to 20" in page


def test_a_mission_is_measured_kept_and_read_back_alike(tmp_path: Path) -> None:
    kept = Remembered(tmp_path / "accuracy.jsonl")
    data = {
        "b": trial.bound_job(100_010),
        "t": trial.method_job("least squares", 100_010),
    }
    for key, value in data.items():
        kept.put(key, value)
    with (tmp_path / "accuracy.jsonl").open("a") as cut:
        cut.write('{"key": "x", "da')
    again = Remembered(tmp_path / "accuracy.jsonl")
    assert "x" not in again
    bounds, trials = accuracy_trials.known({key: again.get(key, dict) for key in data})
    assert set(bounds[0].truth) == set(trials[0].stated) | set(trials[0].refused)
    accuracy_trials.pack(bounds, trials, tmp_path / "all.jsonl.gz")
    rows = [
        json.loads(line) for line in gzip.decompress((tmp_path / "all.jsonl.gz").read_bytes()).splitlines()
    ]
    assert accuracy_trials.known(dict(enumerate(rows)))[1] == trials


@pytest.mark.soak
def test_what_was_measured_is_not_measured_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(accuracy_trials, "available", lambda: ("closed form",))
    first = accuracy_trials.measured([100_010], Remembered(tmp_path / "a.jsonl"))
    size = (tmp_path / "a.jsonl").stat().st_size
    assert accuracy_trials.measured([100_010], Remembered(tmp_path / "a.jsonl")) == first
    assert (tmp_path / "a.jsonl").stat().st_size == size
