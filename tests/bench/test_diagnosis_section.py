"""The proof of the diagnosis: dives, tables, goals, and rivals."""

import math
from importlib.util import find_spec
from typing import Any

import numpy as np
import pytest

from bench.diagnosis import beside, page, speed, tables
from bench.diagnosis.plan import (
    FULL,
    SHORT,
    UNKNOWABLE,
    Planned,
    planned,
    power_planned,
)
from bench.diagnosis.rivals import bic, network
from bench.diagnosis.rivals.said import Said, closed, missing, pushing
from bench.diagnosis.rivals.trials import RivalTrial
from bench.diagnosis.trials import Trial, effects_for
from identify.challenge.case import check_of, dive_of, draw_case
from identify.challenge.plants import ABSORBED, PLANTS
from identify.challenge.plants_novel import NOVEL
from identify.challenge.score import Answer, Named, Rate
from identify.diagnose.nominal import Nominal, nominal_of
from identify.effects.hydrodynamics import COUPLED_DAMPING, QUADRATIC_DRAG

NAN = math.nan


def told(
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
    rows = [(0.01 * value,) * 6 for value in (*drifts, 1.0)] if drifts else [(), (), ()]
    return Trial(group, truth, answer, "", 3.0, *rows)


def test_every_effect_hides_alone_and_once_more_left_out_of_the_library() -> None:
    plan = planned(FULL)
    groups = {group: [one for one in plan if one.group == group] for group in {one.group for one in plan}}
    assert len(groups["none"]) >= 300
    assert len(groups["two"]) >= 100
    assert {one.names for one in groups["one"]} == {(name,) for name in PLANTS}
    assert {one.names for one in groups["novel"]} == {(name,) for name in NOVEL}
    assert {one.left for one in groups["left out"]} == set(UNKNOWABLE)
    assert len(power_planned(FULL)) >= 3 * tables.EACH_POINT * len(set(PLANTS) - set(ABSORBED))


def test_no_seed_is_used_twice_and_the_short_form_has_those_of_development() -> None:
    full = [one.seed for one in (*planned(FULL), *power_planned(FULL))]
    short = [one.seed for one in (*planned(SHORT), *power_planned(SHORT))]
    speeds = range(905_000, 905_000 + speed.EACH)
    assert len({*full, *speeds}) == len(full) + len(speeds)
    assert min(one.seed for one in planned(FULL)) == 1_200_000
    assert min(one.seed for one in power_planned(FULL)) == 506_000
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
    points = tables.by_size([*large, *small], 8)
    assert [(round(low, 2), round(high, 2)) for low, high, _ in points] == [(0.1, 0.14), (2.0, 2.04)]
    assert [rate for _, _, rate in points] == [Rate(0, 40), Rate(40, 40)]
    assert len(tables.by_size(small[:5], 8)) == 1


def test_rivals_are_judged_on_the_same_dives_and_in_the_same_floors() -> None:
    own = [
        told("one", 1, "waves", said=("waves",), drifts=(5.0, 1.2)),
        told("two", 2, "waves", "tether", said=("waves", "tether"), drifts=(3.0, 1.0)),
        told("none", 3),
    ]
    others = [
        RivalTrial(
            "BIC, one cause", one.truth, _says("waves"), 1.0, one.before, tuple(0.03 for _ in one.before)
        )
        for one in own
    ]
    found = beside.beside(own, others)
    ours, rival = (
        next(one for one in found if one.method == method) for method in (beside.OURS, "BIC, one cause")
    )
    assert (ours.before, ours.after) == pytest.approx((5.0, 1.2))
    assert rival.after == pytest.approx(3.0)
    text = "\n".join(beside.lines(found))
    assert "on 3 of these dives" in text
    mine = next(row for row in text.splitlines() if row.startswith(f"| {beside.OURS}"))
    assert mine.endswith("| 0.0 % (0.0 to 79.3), 0 of 1 | 97 % | 98 % | 3.0 |")
    theirs = next(row for row in text.splitlines() if row.startswith("| BIC"))
    assert theirs.endswith("| 100.0 % (20.7 to 100.0), 1 of 1 | 33 % | 25 % | 1.0 |")


def _says(*names: str) -> Answer:
    return Answer("explained", tuple(Named(name, (), NAN, {}) for name in names), {}, NAN, NAN)


def test_a_page_holds_every_part_and_names_what_was_refused() -> None:
    trials = [
        told("none", 1), told("one", 2, "waves", said=("waves",), drifts=(5.0, 1.2)),
        told("two", 3, "waves", "tether", said=("waves",), drifts=(5.0, 3.0)),
        told("novel", 4, "knocks", verdict="unknown", novel=True),
    ]  # fmt: skip
    refused = Trial("one", {**trials[1].truth, "name": "one 5"}, None, "too short", 0.1, (), (), ())
    timed = speed.lines([{"cores": 4.0, "one core": 6.0, "count": 2}, {"cores": 16.0, "count": 2}])
    text = page.page([*trials, refused], [], timed)
    assert "5 simulated dives" in text
    assert "Refused: one 5 (too short)." in text
    said = " ".join(text.split())
    assert (
        "median 10.0 s on 2 cores, 16.0 s at most; one core takes 1.50 times as long (median of 1 dives)"
        in said
    )
    assert "**missed** by the median, that of 15 s is **missed** by the slowest" in said
    assert "two hidden: both" in text
    assert "| `waves` | 1 of 2 |" in text


@pytest.fixture(scope="module")
def pair() -> tuple[Nominal, Nominal]:
    case = draw_case(390_800, names=["quadratic_drag"], size=1.0, seconds=120.0)
    dive, check = (nominal_of(one, case.file, case.configuration) for one in (dive_of(case), check_of(case)))
    return dive, check


def test_bic_names_the_one_effect_that_saves_most(pair: tuple[Nominal, Nominal]) -> None:
    said = bic.named(pair[0], (COUPLED_DAMPING, QUADRATIC_DRAG))
    assert said.names == (("quadratic_drag", 0),)


def test_bic_names_none_where_none_pays_for_its_parameters(pair: tuple[Nominal, Nominal]) -> None:
    bare = bic.named(pair[0], (QUADRATIC_DRAG,)).now
    assert bic.named(bare, (QUADRATIC_DRAG,)).names == ()


if find_spec("pysindy") is not None:  # it comes with the optional extra `bench`

    def test_the_sparse_regression_keeps_the_terms_that_push_and_names_them() -> None:
        from bench.diagnosis.rivals import sindy

        rng = np.random.default_rng(1)
        columns = rng.standard_normal((2000, 6))
        sizes = sindy.sparse(
            columns, 2.0 * columns[:, 3] + 0.1 * columns[:, 1] + 0.5 * rng.standard_normal(2000)
        )
        assert np.flatnonzero(sizes).tolist() == [3]
        assert sizes[3] == pytest.approx(2.0, rel=0.15)
        case = draw_case(300_114, names=["steady_current"])
        said = sindy.named(nominal_of(dive_of(case), case.file, case.configuration))
        assert said.names[0] == ("steady_current", 0)


@pytest.mark.soak
def test_the_network_shrinks_the_gap_of_a_dive_that_is_long_enough_and_names_nothing() -> None:
    case = draw_case(390_801, names=["quadratic_drag"], size=1.0, seconds=240.0)
    nominal = nominal_of(dive_of(case), case.file, case.configuration)
    said = network.named(nominal)
    assert said.names == ()
    before, after = closed(said, nominal, nominal)
    assert np.nansum(after**2) < 0.8 * np.nansum(before**2)


def test_a_model_of_nothing_leaves_the_drift_as_it_is_and_the_right_cause_closes_it(
    pair: tuple[Nominal, Nominal],
) -> None:
    nothing = Said((), (pushing("nothing", lambda course: np.zeros_like(course.nu)),), pair[0])
    before, after = closed(nothing, *pair)
    assert after == pytest.approx(before, rel=0.02, nan_ok=True)
    before, after = closed(bic.named(pair[0], (QUADRATIC_DRAG,)), *pair)
    assert after[5] < 0.5 * before[5]


def test_the_missing_force_of_a_drag_goes_against_its_speed(pair: tuple[Nominal, Nominal]) -> None:
    gap, nu = missing(pair[0]), pair[0].motion.nu
    speed = nu[gap.at, 5]
    curved = speed * np.abs(speed) - speed * (np.abs(speed) @ speed**2) / (speed @ speed)
    assert np.corrcoef(gap.wrench[:, 5], curved)[0, 1] < -0.3
