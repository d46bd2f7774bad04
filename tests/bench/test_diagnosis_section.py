"""The proof of the diagnosis: dives, tables and goals."""

import math
from typing import Any

from bench.diagnosis import goals, page, power, speed
from bench.diagnosis.plan import (
    BENCH,
    FULL,
    LACKED,
    SHORT,
    SPEED,
    Planned,
    planned,
    power_planned,
)
from bench.diagnosis.trials import Trial, effects_for
from identify.challenge.answer import Answer, Named
from identify.challenge.novel_effects import NOVEL
from identify.challenge.planted_effects import ABSORBED, PLANTS
from identify.challenge.score import Rate

NAN = math.nan


def trial_of(
    group: str, seed: int, *hidden: str, said: tuple[str, ...] = (), size: float = 2.0, probability: float = 0.9,
    verdict: str | None = None, drifts: tuple[float, float] | None = None, novel: bool = False,
) -> Trial:  # fmt: skip
    kind = "novel" if novel else {0: "none", 1: "one", 2: "two"}[len(hidden)]
    effects = [{"name": name, "number": 0, "novel": novel, "parameters": {"delay": 0.1}} for name in hidden]
    truth: dict[str, Any] = {
        "name": f"{group} {seed}", "kind": kind, "rpm": True, "poles": 1, "effects": effects, "size": size,
        "dof": ["surge"],
    }  # fmt: skip
    named = tuple(Named(name, (), probability, {}) for name in said)
    before, after = drifts or (NAN, NAN)
    answer = Answer(
        verdict or ("explained" if said else "no_gap"), named, {"surge": 1.0}, 0.9, 0.88, before, after
    )
    return Trial(group, truth, answer, "", 3.0)


def test_every_effect_hides_alone_and_once_more_left_out_of_the_library() -> None:
    plan = planned(FULL)
    groups = {
        group: [trial for trial in plan if trial.group == group] for group in {trial.group for trial in plan}
    }
    assert len(groups["none"]) >= 300
    assert len(groups["two"]) >= 100
    assert {trial.names for trial in groups["one"]} == {(name,) for name in PLANTS}
    assert {trial.names for trial in groups["novel"]} == {(name,) for name in NOVEL}
    assert {trial.left for trial in groups["left out"]} == set(LACKED)
    assert len(power_planned(FULL)) >= 3 * goals.EACH_POINT * len(set(PLANTS) - set(ABSORBED))


def test_no_seed_is_used_twice_and_the_short_form_has_those_of_development() -> None:
    full = [trial.seed for trial in (*planned(FULL), *power_planned(FULL))]
    short = [trial.seed for trial in (*planned(SHORT), *power_planned(SHORT))]
    speeds = range(BENCH + SPEED, BENCH + SPEED + speed.EACH)
    assert len({*full, *speeds}) == len(full) + len(speeds)
    assert min(trial.seed for trial in planned(FULL)) == 1_200_000
    assert min(trial.seed for trial in power_planned(FULL)) == 506_000
    assert all(300_000 <= seed < 400_000 for seed in short)


def test_the_library_of_a_dive_lacks_what_was_left_out_with_its_true_class() -> None:
    case = Planned("left out", 390_700, "novel", ("thruster_lag",), "thruster_lag").case()
    assert case.kind == "novel"
    names = {effect.name for effect in effects_for(case)}
    assert not names & {"thruster_lag", "command_delay"}
    assert len(names) > 30


def test_a_point_of_a_power_curve_holds_thirty_dives_or_all() -> None:
    small = [(0.1 + 0.001 * i, False) for i in range(40)]
    large = [(2.0 + 0.001 * i, True) for i in range(40)]
    points = goals.by_size([*large, *small], 8)
    assert [(round(low, 2), round(high, 2)) for low, high, _ in points] == [(0.1, 0.14), (2.0, 2.04)]
    assert [rate for _, _, rate in points] == [Rate(0, 40), Rate(40, 40)]
    assert len(goals.by_size(small[:5], 8)) == 1


def test_the_short_form_of_the_power_tells_its_own_seeds_and_where_its_rows_are(monkeypatch, tmp_path):
    def answered(_, jobs, __):
        rows = ({"effect": key.split()[0], "size": 1.0, "hit": True, "said": "waves"} for key in jobs)
        return dict(zip(jobs, rows, strict=True))

    monkeypatch.setattr(power, "ROOT", tmp_path)
    monkeypatch.setattr(power.Remembered, "fill", answered)
    text = power.section(tmp_path, tmp_path / "runs" / "power.jsonl.gz", short=True)
    said = " ".join(text.split())
    assert f"seeds from {power_planned(SHORT)[0].seed} on" in said
    assert "Every row is in `runs/power.jsonl.gz`." in said


def test_a_page_holds_every_part_and_names_what_was_refused() -> None:
    trials = [
        trial_of("none", 1), trial_of("one", 2, "waves", said=("waves",), drifts=(5.0, 1.2)),
        trial_of("two", 3, "waves", "tether", said=("waves",), drifts=(5.0, 3.0)),
        trial_of("novel", 4, "knocks", verdict="unknown", novel=True),
    ]  # fmt: skip
    refused = Trial("one", {**trials[1].truth, "name": "one 5"}, None, "too short", 0.1)
    silent = Trial("none", {**trials[0].truth, "name": "none 6"}, None, "too short", 0.1)
    text = page.page([*trials, refused, silent])
    assert "6 simulated dives" in text
    assert "Refused: one 5 (too short); none 6 (too short)." in text
    assert "| false alarms: 1 % | 0.0 % (0.0 to 79.3), 0 of 1 | met |" in text
    assert "where nothing hides it is left out of the false alarms" in " ".join(text.split())
    assert "| `waves` | 1 of 2 |" in text


def test_the_time_of_a_diagnosis_is_judged_by_the_median_and_the_slowest() -> None:
    text = speed.page([{"cores": 4.0, "one core": 6.0, "count": 2}, {"cores": 16.0, "count": 2}])
    said = " ".join(text.split())
    assert (
        "median 10.0 s on 2 cores, 16.0 s at most; one core takes 1.50 times as long (median of 1 dives)"
        in said
    )
    assert "5 s on 2 cores in the median: **missed**; 15 s for the slowest: **missed**" in said
    assert "15 s for the slowest: met" in " ".join(
        speed.page([{"cores": 4.9, "one core": 6.0, "count": 2}]).split()
    )
